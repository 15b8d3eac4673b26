"""A lag as a block in fixed point: the same split as in floating point, with states that have bits below a signal's.

Instead of the input that was to lead to the output asked for, which can be as large as the lead, the state keeps the
move `lead` of the lag that it was to make: what another input makes of it is `c` of the difference of two moves.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from hystgen.arithmetic.factors import GUARD, LARGEST, STATE_BITS, factor, times
from hystgen.basics.jit import jit
from hystgen.effects.kinds import Constants, Kind
from hystgen.effects.lag import compensator as floating
from hystgen.effects.lag.compensator import LagTables
from hystgen.plays.fixed import nearest
from hystgen.plays.slots import Reals, zero

EXACT_BITS = 8
"""Bits of the state of a lag that is inverted exactly, which no rounding can stall."""

KIND = Kind("lag", own=("rest", "solve", "absorb"), letters="fffbb", memory="wwww")
EXACT_KIND = Kind("lag_exact", own=("rest", "solve", "absorb"), letters="fffbb", memory="ww")


def constants(t: LagTables) -> Iterator[Constants]:
    """The numbers of each lag."""
    for each, exact in zip(floating.constants(t), t.exact, strict=True):
        yield replace(each, kind=EXACT_KIND if exact else KIND, products=(8, 4))


class Sizes:
    """Largest sizes of a lag's signals: its input, the output asked of it, its states, the answer of its inverse."""

    def __init__(self, exact: bool, rate: float, late: float, given: float, asked: float) -> None:
        self.given, self.asked = given, asked
        if exact:
            self.state = given + asked
            self.answer = given + self.state / late
        else:
            # |wanted| <= theta^2 asked + (1 - theta)(theta |wanted| + given), theta at most 1/2
            self.state = 3.0 * (given + asked)
            self.answer = given + self.state / rate


def tables(rows: list[tuple[bool, tuple[float, float, float, float], Sizes]]) -> LagTables:
    """All lags of a model, with the sizes of their signals. Raises OverflowError where states have no room."""
    block: list[list[int]] = []
    for exact, numbers, sizes in rows:
        room = STATE_BITS - math.ceil(math.log2(sizes.state))
        wanted = EXACT_BITS if exact else max(math.ceil(-math.log2(numbers[floating.RATE])), 0) + GUARD
        bits = min(wanted, room)
        if bits < (EXACT_BITS if exact else wanted - GUARD):
            raise OverflowError("no room")
        drop = max(0, math.ceil(math.log2(sizes.state)) + bits + 1 - (LARGEST.bit_length() - 1))
        rate, second, late, inverse = numbers
        given: tuple[float, ...]
        if exact:
            given = (rate * 2.0**drop, late * 2.0**bits, inverse * 2.0 ** (drop - bits))
        else:
            given = (rate * 2.0**drop, second * 2.0**drop, inverse * 2.0 ** (drop - bits))
        block.append([*(part for x in given for part in factor(x)), bits, drop])
    return LagTables(
        np.array([int(exact) for exact, *_ in rows], dtype=np.int64), np.array(block, np.int64).reshape(-1, 8)
    )


# ---------------------------------------------------------------- lag_fixed.c, lag_exact_fixed.c

RATE, SECOND, INVERSE, BITS, DROP = 0, 2, 4, 6, 7
HIGH, WANTED, ASKED, LEAD = 0, 1, 2, 3
NEXT, BEFORE = 0, 1


@jit
def scaled(t: LagTables, j: int, x: Any, which: int) -> Any:
    """A number of a state's units times a factor of lag j."""
    return times(x >> t.block[j, DROP], t.block[j, which], t.block[j, which + 1])


@jit
def lag_rest(t: LagTables, s: Reals, j: int, x: Any) -> Any:
    """Everything has settled at the input x. Returns the output."""
    state = x << t.block[j, BITS]
    s[j, HIGH] = state
    if t.exact[j]:
        s[j, BEFORE] = x
    else:
        s[j, WANTED] = state
        s[j, ASKED] = state
        s[j, LEAD] = zero(x)
    return x


@jit
def lag_solve(t: LagTables, s: Reals, j: int, y: Any) -> Any:
    """The input that leads to the output y at this sample."""
    asked = y << t.block[j, BITS]
    if t.exact[j]:
        return s[j, BEFORE] + scaled(t, j, asked - s[j, NEXT], INVERSE)
    s[j, LEAD] = asked + scaled(t, j, asked - s[j, WANTED], SECOND) - s[j, HIGH]
    s[j, ASKED] = asked
    return nearest(s[j, HIGH], t.block[j, BITS]) + scaled(t, j, s[j, LEAD], INVERSE)


@jit
def lag_absorb(t: LagTables, s: Reals, j: int, x: Any) -> Any:
    """The input is x at this sample. Returns the output."""
    given = x << t.block[j, BITS]
    if t.exact[j]:
        late = times(x - s[j, BEFORE], t.block[j, SECOND], t.block[j, SECOND + 1])
        reached = s[j, NEXT] + late
        s[j, NEXT] = reached + scaled(t, j, given - reached, RATE)
        s[j, BEFORE] = x
        return nearest(reached, t.block[j, BITS])
    change = scaled(t, j, given - s[j, HIGH], RATE)
    short = s[j, LEAD] - change
    s[j, HIGH] = s[j, HIGH] + change
    s[j, WANTED] = s[j, ASKED] - (short - scaled(t, j, short, SECOND))
    s[j, LEAD] = s[j, LEAD] - scaled(t, j, change, RATE)
    return nearest(s[j, HIGH] - scaled(t, j, change, SECOND), t.block[j, BITS])
