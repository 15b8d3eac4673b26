"""Creep as a block in fixed point: 64-bit states that predict the next sample for an unchanged input.

With `A` the prediction, `X = A + c b1 (x - before)` and `A <- X + (1 - E)(c x - X)`, the same recursion as in floating
point. At rest every state is `c x`, whatever its rate, and it approaches this value with a real positive pole, so
rounding leaves a dead band but no limit cycle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hystgen.arithmetic.factors import GUARD, LARGEST, STATE_BITS, factor, lifted, times
from hystgen.arithmetic.factors import error as missed
from hystgen.basics.jit import jit, zero
from hystgen.basics.structures import Count, Factor, Signal, Struct, UInt8, firsts, memory_of, note
from hystgen.effects.creep.compensator import CreepNumbers
from hystgen.effects.kinds import BlockKind, RowedMemory, RowedTables, Rows, numbered
from hystgen.effects.part import Coded, FixedSurroundings, Realized, Sought, Verbs
from hystgen.plays.fixed import nearest


class FixedCreepTerm(Struct):
    """A state of creep: its contribution at the next sample approaches weight times the input by a share `rate` in each
    step."""

    rate: Factor
    late: Factor = note("share of an input change that takes effect at once")
    weight: Factor
    lift: UInt8 = note("bits of a state that the product with `late` leaves out")


class FixedCreepTable(Struct):
    """Creep after the plays: y = d h + X_1 + X_2 + ..."""

    direct: Factor = note("d")
    inverse_slope: Factor = note("1 / (immediate change in y with h)")
    inverse_rest: Factor = note("h over y at rest")
    bits: UInt8 = note("bits of the states below those of a signal,")
    drop: UInt8 = note("and bits that products leave out")
    n: Count


class FixedCreepTermState(Struct):
    """A state of creep."""

    next: Signal = note("at the next sample for an unchanged input")


class FixedCreepState(Struct):
    """Creep after the plays."""

    before: Signal = note("input of the last sample")
    ahead: Signal = note("output of the next one for the same input")


KIND = BlockKind("creep", FixedCreepTable, FixedCreepState, Rows("term", FixedCreepTerm, FixedCreepTermState))


FixedCreepTables = RowedTables[FixedCreepTable, FixedCreepTerm]
FixedCreepMemory = RowedMemory[FixedCreepState, FixedCreepTermState]


def guard(effect: CreepNumbers, size: float, code: int) -> tuple[int, int]:
    """Fraction bits of the states beyond a signal's, and bits dropped before a product, for inputs up to `size`.

    `code`: fraction bits of a signal, in output codes. Raises OverflowError if the slowest state would stall more than
    a quarter of a code from its target.
    """
    slowest = float(np.min(effect.terms.rate))
    states = max(float(np.sum(effect.terms.weight)) * size, 1.0)
    wanted = max(math.ceil(-math.log2(slowest)), 0) + GUARD
    bits = min(wanted, STATE_BITS - math.ceil(math.log2(states)) - 1)
    if bits < 0 or bits + code < wanted - GUARD + 1:
        raise OverflowError("no room")
    return bits, max(0, math.ceil(math.log2(states)) + bits + 2 - (LARGEST.bit_length() - 1))


@dataclass(frozen=True)
class CreepFormats(Coded):
    """A block: fraction bits of its states beyond a signal's, and bits dropped before a product."""

    one: CreepNumbers
    bits: int
    drop: int

    @property
    def direct(self) -> float:
        """The fraction of a step that arrives at once."""
        return self.one.rest - math.fsum(self.one.terms.weight.tolist())

    def there(self, size: float, signal: float) -> float:
        """Rounding errors of the output for inputs up to `size`, with signals in units of `signal`."""
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
        states = at.apart * float(sum(one.terms.weight))
        gain = 1.0 / one.slope if at.same else one.backward
        return gain * (error + self.there(at.size, at.signal) + own + states)

    def residual(self, missed: float, same: bool) -> float:
        """Error of the output after the inverse that results from an error of the play sum."""
        return missed * (self.one.slope * (1.0 / self.one.slope if same else self.one.backward))


def formats(one: CreepNumbers, about: FixedSurroundings, given: float, _: float) -> CreepFormats:
    """A block for inputs up to `given` output codes. Raises OverflowError if the states do not fit."""
    return CreepFormats(one, *guard(one, given * 2.0**about.bits, about.bits))


def tables(blocks: Sequence[CreepFormats], _: FixedSurroundings) -> FixedCreepTables:
    """All creep blocks of a model."""
    block, term = [], []
    for each in blocks:
        one, bits, drop = each.one, each.bits, each.drop
        given = (each.direct, 1.0 / one.slope, 1.0 / one.rest)
        block.append((*map(factor, given), bits, drop, len(one.terms)))
        for rate, _early, late, weight in one.terms.tolist():
            lift = lifted(late, bits)
            term.append((*map(factor, (rate * 2.0**drop, late * 2.0 ** (bits - lift), weight)), lift))
    first = firsts(len(each.one.terms) for each in blocks)
    return FixedCreepTables(FixedCreepTable.of(block), first, FixedCreepTerm.of(term))


# ---------------------------------------------------------------- creep.c


@jit
def creep_rest(t: FixedCreepTables, s: FixedCreepMemory, j: int, x: int) -> int:
    """Settle everything at the input x. Returns the output."""
    total = zero(x)
    for i in range(t.first[j], t.first[j + 1]):
        state = times(x, t.row.weight.mantissa[i], t.row.weight.shift[i]) << t.block.bits[j]
        s.row.next[i] = state
        total = total + state
    y = times(x, t.block.direct.mantissa[j], t.block.direct.shift[j]) + nearest(total, t.block.bits[j])
    s.block.before[j] = x
    s.block.ahead[j] = y
    return y


@jit
def creep_resting(t: FixedCreepTables, s: FixedCreepMemory, j: int, y: int) -> int:  # noqa: ARG001  block interface
    """The input that gives the output y once everything has settled."""
    return times(y, t.block.inverse_rest.mantissa[j], t.block.inverse_rest.shift[j])


@jit
def creep_solve(t: FixedCreepTables, s: FixedCreepMemory, j: int, y: int) -> int:
    """The input that gives the output y at this sample."""
    change = times(y - s.block.ahead[j], t.block.inverse_slope.mantissa[j], t.block.inverse_slope.shift[j])
    return s.block.before[j] + change


@jit
def creep_absorb(t: FixedCreepTables, s: FixedCreepMemory, j: int, x: int) -> int:
    """Absorb the input x at this sample. Returns the output."""
    change = x - s.block.before[j]
    direct = times(x, t.block.direct.mantissa[j], t.block.direct.shift[j])
    total = zero(x)
    following = zero(x)
    for i in range(t.first[j], t.first[j + 1]):
        late = times(change, t.row.late.mantissa[i], t.row.late.shift[i]) << t.row.lift[i]
        state = s.row.next[i] + late
        total = total + state
        settled = times(x, t.row.weight.mantissa[i], t.row.weight.shift[i]) << t.block.bits[j]
        state = state + times((settled - state) >> t.block.drop[j], t.row.rate.mantissa[i], t.row.rate.shift[i])
        s.row.next[i] = state
        following = following + state
    s.block.before[j] = x
    s.block.ahead[j] = direct + nearest(following, t.block.bits[j])
    return direct + nearest(total, t.block.bits[j])


ARITHMETIC = Realized(
    Verbs(memory_of(FixedCreepMemory), creep_rest, creep_absorb, creep_resting, creep_solve), numbered(KIND, 2, 2, 6),
    tables, formats, kinds=(KIND,),
)
