"""Creep as a block in fixed point: 64-bit states that predict the next sample for an unchanged input.

With `A` the prediction, `X = A + c b1 (x - before)` and `A <- X + (1 - E)(c x - X)`, the same recursion as in floating
point. At rest every state is `c x` whatever its rate is, and it approaches that by a real positive pole, so that
rounding leaves a dead band but no limit cycle.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hystgen.arithmetic.factors import GUARD, LARGEST, STATE_BITS, factor, lifted, times
from hystgen.arithmetic.factors import error as missed
from hystgen.basics.jit import jit
from hystgen.effects.creep import compensator as floating
from hystgen.effects.creep.compensator import AHEAD, BEFORE, HIGH, CreepNumbers, CreepState, CreepTables
from hystgen.effects.kinds import Constants, Kind, Rows
from hystgen.effects.part import Coded, FixedSurroundings, Realized, Sought, Verbs
from hystgen.plays.fixed import nearest
from hystgen.plays.slots import zero

KIND = Kind(
    "creep", rows=Rows("term", letters="fffb", memory="w"), counts=("n",), letters="fffbb", memory="ww",
)


def constants(t: CreepTables) -> Iterator[Constants]:
    """The numbers of each block."""
    for each in floating.constants(t):
        yield replace(each, kind=KIND, products=(2 + 6 * len(each.rows), 2))


def guard(effect: CreepNumbers, size: float, code: int) -> tuple[int, int]:
    """Bits of the states below a signal's, and those dropped before a product, for inputs up to `size`.

    `code`: bits of a signal below an output code. Raises OverflowError where the slowest state would stall more than a
    quarter of a code from its target.
    """
    slowest = float(np.min(effect.terms[:, 0]))
    states = max(float(np.sum(effect.terms[:, 3])) * size, 1.0)
    wanted = max(math.ceil(-math.log2(slowest)), 0) + GUARD
    bits = min(wanted, STATE_BITS - math.ceil(math.log2(states)) - 1)
    if bits < 0 or bits + code < wanted - GUARD + 1:
        raise OverflowError("no room")
    return bits, max(0, math.ceil(math.log2(states)) + bits + 2 - (LARGEST.bit_length() - 1))


@dataclass(frozen=True)
class CreepFormats(Coded):
    """A block: bits of its states below a signal's, and those dropped before a product."""

    one: CreepNumbers
    bits: int
    drop: int

    @property
    def direct(self) -> float:
        """The share of a step that arrives at once."""
        return self.one.rest - math.fsum(self.one.terms[:, 3].tolist())

    def there(self, size: float, signal: float) -> float:
        """Roundings of the output for inputs within a size, with signals of this unit."""
        state, found = 2.0**-self.bits * signal, 0.0
        for rate, _, late, weight in self.one.terms.tolist():
            scale = 2.0 ** (self.bits - lifted(late, self.bits))
            found += state * (0.5 / rate + 2.0**self.drop) + 0.5 * signal / scale / rate
            found += 0.5 * signal + missed(weight) * size + 2.0 * size * missed(late * scale) / scale / rate
            found += 2.0 * weight * size * missed(rate * 2.0**self.drop) / 2.0**self.drop / rate
        return found + missed(self.direct) * size + signal

    def solved(self, error: float, at: Sought) -> float:
        """Error of the inverse for an error of the output."""
        one = self.one
        moved = at.asked + at.size * one.rest
        own = one.slope * (missed(1.0 / one.slope) * moved + 0.5 * at.signal)
        states = at.apart * float(sum(one.terms[:, 3]))
        gain = 1.0 / one.slope if at.same else one.backward
        return gain * (error + self.there(at.size, at.signal) + own + states)

    def residual(self, missed: float, same: bool) -> float:
        """Error of the output after the inverse, for an error of the play sum."""
        return missed * (self.one.slope * (1.0 / self.one.slope if same else self.one.backward))


def formats(one: CreepNumbers, about: FixedSurroundings, given: float, _: float) -> CreepFormats:
    """A block for inputs up to `given` output codes. Raises OverflowError where states have no room."""
    return CreepFormats(one, *guard(one, given * 2.0**about.bits, about.bits))


def tables(blocks: Sequence[CreepFormats], _: FixedSurroundings) -> CreepTables:
    """All creep blocks of a model."""
    block: list[list[int]] = []
    term: list[list[int]] = []
    for each in blocks:
        bits, drop = each.bits, each.drop
        given = (each.direct, 1.0 / each.one.slope, 1.0 / each.one.rest)
        block.append([*(part for x in given for part in factor(x)), bits, drop])
        for rate, _early, late, weight in each.one.terms.tolist():
            lift = lifted(late, bits)
            scaled = (rate * 2.0**drop, late * 2.0 ** (bits - lift), weight)
            term.append([*(part for x in scaled for part in factor(x)), lift])
    first = np.cumsum([0, *(len(each.one.terms) for each in blocks)]).astype(np.int64)
    return CreepTables(np.array(block, dtype=np.int64).reshape(-1, 8), first, np.array(term, np.int64).reshape(-1, 7))


# ---------------------------------------------------------------- creep_fixed.c

DIRECT, INVERSE_SLOPE, INVERSE_REST, BITS, DROP = 0, 2, 4, 6, 7
RATE, LATE, WEIGHT, LIFT = 0, 2, 4, 6


@jit
def creep_rest(t: CreepTables, s: CreepState, j: int, x: Any) -> Any:
    """Everything has settled at the input x. Returns the output."""
    total = zero(x)
    for i in range(t.first[j], t.first[j + 1]):
        state = times(x, t.term[i, WEIGHT], t.term[i, WEIGHT + 1]) << t.block[j, BITS]
        s.state[i, HIGH] = state
        total = total + state
    y = times(x, t.block[j, DIRECT], t.block[j, DIRECT + 1]) + nearest(total, t.block[j, BITS])
    s.block[j, BEFORE] = x
    s.block[j, AHEAD] = y
    return y


@jit
def creep_resting(t: CreepTables, s: CreepState, j: int, y: Any) -> Any:  # noqa: ARG001  block interface
    """The input that gives the output y once everything has settled."""
    return times(y, t.block[j, INVERSE_REST], t.block[j, INVERSE_REST + 1])


@jit
def creep_solve(t: CreepTables, s: CreepState, j: int, y: Any) -> Any:
    """The input that gives the output y at this sample."""
    change = times(y - s.block[j, AHEAD], t.block[j, INVERSE_SLOPE], t.block[j, INVERSE_SLOPE + 1])
    return s.block[j, BEFORE] + change


@jit
def creep_absorb(t: CreepTables, s: CreepState, j: int, x: Any) -> Any:
    """The input is x at this sample. Returns the output."""
    change = x - s.block[j, BEFORE]
    direct = times(x, t.block[j, DIRECT], t.block[j, DIRECT + 1])
    total = zero(x)
    following = zero(x)
    for i in range(t.first[j], t.first[j + 1]):
        late = times(change, t.term[i, LATE], t.term[i, LATE + 1]) << t.term[i, LIFT]
        state = s.state[i, HIGH] + late
        total = total + state
        settled = times(x, t.term[i, WEIGHT], t.term[i, WEIGHT + 1]) << t.block[j, BITS]
        state = state + times((settled - state) >> t.block[j, DROP], t.term[i, RATE], t.term[i, RATE + 1])
        s.state[i, HIGH] = state
        following = following + state
    s.block[j, BEFORE] = x
    s.block[j, AHEAD] = direct + nearest(following, t.block[j, BITS])
    return direct + nearest(total, t.block[j, BITS])


ARITHMETIC = Realized(
    Verbs(floating.memory, creep_rest, creep_absorb, creep_resting, creep_solve), constants,
    tables, formats,
)
