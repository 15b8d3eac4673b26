"""Creep as a block in fixed point: states of 64 bits that hold what the next sample gives for an unchanged input.

With `A` the prediction, `X = A + c b1 (x - before)` and `A <- X + (1 - E)(c x - X)`, the same recursion as in floating
point. At rest every state is `c x` whatever its rate is, and it approaches that by a real positive pole, so that what
rounding leaves is a dead band, and no cycle.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hystgen.arithmetic.factors import GUARD, LARGEST, STATE_BITS, factor, lifted, times
from hystgen.basics.jit import jit
from hystgen.effects.creep import compensator as floating
from hystgen.effects.creep.compensator import AHEAD, BEFORE, HIGH, CreepNumbers, CreepState, CreepTables
from hystgen.effects.kinds import Constants, Kind, Rows
from hystgen.effects.part import Arithmetic, Verbs
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
    quarter of a code from where it goes.
    """
    slowest = float(np.min(effect.terms[:, 0]))
    states = max(float(np.sum(effect.terms[:, 3])) * size, 1.0)
    wanted = max(math.ceil(-math.log2(slowest)), 0) + GUARD
    bits = min(wanted, STATE_BITS - math.ceil(math.log2(states)) - 1)
    if bits < 0 or bits + code < wanted - GUARD + 1:
        raise OverflowError("no room")
    return bits, max(0, math.ceil(math.log2(states)) + bits + 2 - (LARGEST.bit_length() - 1))


def tables(blocks: Sequence[tuple[CreepNumbers, float]], code: int) -> CreepTables:
    """All creep blocks of a model, each with the largest size of its input; `code` as for `guard`, which may raise."""
    block: list[list[int]] = []
    term: list[list[int]] = []
    for numbers, size in blocks:
        bits, drop = guard(numbers, size, code)
        direct = numbers.rest - math.fsum(numbers.terms[:, 3].tolist())
        given = (direct, 1.0 / numbers.slope, 1.0 / numbers.rest)
        block.append([*(part for x in given for part in factor(x)), bits, drop])
        for rate, _, late, weight in numbers.terms.tolist():
            lift = lifted(late, bits)
            scaled = (rate * 2.0**drop, late * 2.0 ** (bits - lift), weight)
            term.append([*(part for x in scaled for part in factor(x)), lift])
    first = np.cumsum([0, *(len(numbers.terms) for numbers, _ in blocks)]).astype(np.int64)
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
def creep_resting(t: CreepTables, s: CreepState, j: int, y: Any) -> Any:  # noqa: ARG001  as of every block
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


ARITHMETIC = Arithmetic(
    Verbs(floating.memory, creep_rest, creep_absorb, creep_resting, creep_solve), constants,
    lambda blocks, about: tables(blocks, about.bits), lambda one, about, given, _: (one, given * 2.0**about.bits),
)  # fmt: skip
