"""A lag as a block in fixed point: the same split as in floating point, with states that have bits below a signal's.

Instead of the input solved for, which can be as large as the lead, the state keeps the lag's intended move `lead`; with
another input, the target falls short by `1 - theta` of the difference of the two moves.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from hystgen.arithmetic.factors import GUARD, LARGEST, STATE_BITS, factor, times
from hystgen.arithmetic.factors import error as missed
from hystgen.basics.jit import jit
from hystgen.effects.kinds import Constants, Kind
from hystgen.effects.lag import compensator as floating
from hystgen.effects.lag.compensator import HALVES, LagNumbers, LagSizes, LagTables, shifted, steady_led
from hystgen.effects.part import Coded, FixedSurroundings, Led, Realized, Verbs
from hystgen.plays.fixed import nearest
from hystgen.plays.slots import Reals, zero

EXACT_BITS = 8
"""Bits of the state of a lag that is inverted exactly, which no rounding can stall."""

KIND = Kind("lag", own=("rest", "solve", "absorb"), letters="fffbb", memory="wwww")
BRAKED_KIND = Kind("braked", own=KIND.own, letters=KIND.letters, memory=KIND.memory + "w", like=KIND.name)
EXACT_KIND = Kind("lag_exact", own=("rest", "solve", "absorb"), letters="fffbb", memory="ww")


def constants(t: LagTables) -> Iterator[Constants]:
    """As in floating point."""
    for each, exact in zip(floating.constants(t), t.exact, strict=True):
        yield replace(each, kind=EXACT_KIND if exact else BRAKED_KIND if t.braked else KIND, products=(8, 4))


def memory(t: LagTables, dtype: Any) -> Reals:
    """Memory (k, 5) of all lags."""
    return np.zeros((len(t.exact), 5), dtype)


@dataclass(frozen=True)
class LagFormats(Coded):
    """A lag with the sizes of its signals: bits of its states below a signal's, and those dropped before a product."""

    one: LagNumbers
    sizes: LagSizes
    bits: int
    drop: int

    @cached_property
    def _roundings(self) -> tuple[float, float, float]:
        """Of the output, of the state in the inverse, and of the answer, in units of signals."""
        exact, (rate, second, late, inverse) = self.one.exact, self.one.row
        state, scale, given = 2.0**-self.bits, 2.0**self.drop, self.sizes.given
        kept = state * (0.5 / rate + scale) + 2.0 * given * missed(rate * scale) / scale / rate
        finer = 2.0 ** (self.bits - self.drop)
        answer = self.sizes.state * missed(inverse / finer) * finer
        if exact:
            kept += (0.5 * state + 2.0 * given * missed(late * 2.0**self.bits) / 2.0**self.bits) / rate
            return kept + 0.5, kept, answer + state * scale / late + 0.5
        product = state * (0.5 + scale * second) + self.sizes.state * missed(second * scale) / scale
        return 3.0 * kept + product + 0.5, kept + 3.0 * product, answer + state * scale * inverse + 1.0

    @property
    def arrived(self) -> float:
        """Roundings of the output in front of the plays."""
        return self._roundings[0]

    @property
    def follows(self) -> float:
        """Change of the output for a change of the input in one sample, as a share."""
        rate, theta, *_ = self.one.row
        return 1.0 if self.one.exact else rate * (1.0 + 2.0 * theta)

    def led(self, error: float, code: float, same: bool, turning: bool) -> float:
        """Error of the input for an error of the output asked for; `code`: rounding of the input."""
        rate, second, late, _ = self.one.row
        _, kept, answer = self._roundings
        if not self.one.exact:  # its states have seen the same drives
            goal = shifted(second, turning) * error + (1.0 + 2.0 * second) / (1.0 - second) * kept
            return (goal + kept) / rate + answer + code
        if same:
            return (error + kept) / late + answer + code
        return ((2.0 - rate) * (error + kept) + answer * late + late * code) / (late - second)


def formats(one: LagNumbers, about: FixedSurroundings, given: float, asked: float) -> LagFormats:
    """A lag for signals up to these sizes. Raises OverflowError where states have no room."""
    sizes = one.sizes(given, asked, about.margin.turning)
    room = STATE_BITS - math.ceil(math.log2(sizes.state))
    wanted = EXACT_BITS if one.exact else max(math.ceil(-math.log2(one.row[floating.RATE])), 0) + GUARD
    bits = min(wanted, room)
    if bits < (EXACT_BITS if one.exact else wanted - GUARD):
        raise OverflowError("no room")
    drop = max(0, math.ceil(math.log2(sizes.state)) + bits + 1 - (LARGEST.bit_length() - 1))
    return LagFormats(one, sizes, bits, drop)


def tables(blocks: Sequence[LagFormats], about: FixedSurroundings) -> LagTables:
    """All lags of a model."""
    block: list[list[int]] = []
    for each in blocks:
        rate, second, late, inverse = each.one.row
        bits, drop = each.bits, each.drop
        middle = late * 2.0**bits if each.one.exact else second * 2.0**drop
        given = (rate * 2.0**drop, middle, inverse * 2.0 ** (drop - bits))
        block.append([*(part for x in given for part in factor(x)), bits, drop])
    exact = np.array([int(each.one.exact) for each in blocks], dtype=np.int64)
    return LagTables(exact, np.array(block, np.int64).reshape(-1, 8), about.braked)


# ---------------------------------------------------------------- lag_fixed.c, lag_exact_fixed.c

RATE, SECOND, INVERSE, BITS, DROP = 0, 2, 4, 6, 7
HIGH, WANTED, ASKED, LEAD, EARLIER = range(5)
NEXT, BEFORE = 0, 1

COARSE = 2**30 - 1
"""Largest number in the search for a lead, so that the square of a sum of two fits 64 bits."""


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
        s[j, EARLIER] = state
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
    s[j, EARLIER] = s[j, ASKED]
    return nearest(s[j, HIGH] - scaled(t, j, change, SECOND), t.block[j, BITS])


# ---------------------------------------------------------------- lag_steady_fixed.c


@jit
def steady_missed(t: LagTables, way: Any) -> Any:
    """How far a model's only lag falls short of a move in its first sample."""
    bits = t.block[0, BITS]
    return nearest(scaled(t, 0, way << bits, SECOND), bits)


@jit
def steady_solve(
    t: LagTables, s: Reals, y: Any, moved: Any, rises: int, applied: Any, little: Any
) -> tuple[Any, Any]:
    """As in floating point; an input that is kept has no move."""
    bits = t.block[0, BITS]
    way = y - (s[0, ASKED] >> bits)
    missed = s[0, EARLIER] - s[0, WANTED]
    s[0, WANTED] = (y - steady_led(way, moved)) << bits
    s[0, EARLIER] = s[0, WANTED]
    led = lag_solve(t, s, 0, y)
    v = steady_kept(t, s, led, rises, applied, little)
    if v != led:
        s[0, LEAD] = zero(v)
    s[0, WANTED] = s[0, WANTED] - missed
    return v, way


@jit
def steady_kept(t: LagTables, s: Reals, v: Any, rises: int, applied: Any, little: Any) -> Any:
    """As in floating point; `little` is at least a drive code, so that rounding to a code leaves the drive ahead."""
    bits = t.block[0, BITS]
    x = nearest(s[0, HIGH], bits)
    ahead, kept = v - x, (applied << bits) - s[0, HIGH]
    if not rises:
        ahead, kept = -ahead, -kept
    if ahead >= little:
        return v
    if kept >= 0 and kept <= (little + little) << bits:
        return applied
    return x + little if rises else x - little


@jit
def steady_absorb(s: Reals, before: Any) -> None:
    """The lag has followed; rounding loses nothing that could take it back."""


# ---------------------------------------------------------------- braked_fixed.c


@jit
def braked(t: LagTables, s: Reals, near: Any, short: Any, falling: Any, rising: Any, code: Any, drop: Any) -> Any:
    """As in floating point; `code`: a drive code; all arguments are signals; the search drops `drop` bits."""
    bits = t.block[0, BITS]
    missed = s[0, EARLIER] - s[0, WANTED]
    room = short + scaled(t, 0, -missed if missed < 0 else missed, INVERSE)
    if room + room < code:
        return near
    move = s[0, ASKED] - s[0, EARLIER]
    way = move
    if move > rising << bits:
        way = rising << bits
    elif move < -falling << bits:
        way = -falling << bits
    more = s[0, ASKED] - s[0, HIGH] + scaled(t, 0, way, SECOND) - way
    down = nearest(way, bits) + falling
    left = coarse(nearest(more, bits), drop)
    back = coarse(rising + falling - down if more < 0 else down, drop)
    ahead = near - (nearest(s[0, HIGH], bits) + scaled(t, 0, way, INVERSE))
    lead = coarse(-ahead if left < 0 else ahead, drop)
    less = braked_over(t, -left if left < 0 else left, lead, back, coarse(room, drop), drop) << drop
    return near + less if left < 0 else near - less


@jit
def braked_over(t: LagTables, size: Any, lead: Any, back: Any, room: Any, drop: Any) -> Any:
    """As in floating point, in the coarse numbers of the search."""
    margin = back >> 1
    most = coarsely(t, size, drop) if size <= margin else size
    if most > margin:
        most = braked_lead(size, lead, margin, coarsely(t, back, drop))
    over = lead - most
    if over > room:
        return room
    return -room if over < -room else over


@jit
def braked_lead(size: Any, lead: Any, margin: Any, way: Any) -> Any:
    """The largest lead, up to `lead`, with which the lag gains no more than `size`, where `way` is back/(1 - E)."""
    limit = way * (2 * size)
    if lead <= size or (lead + margin) * (lead + margin) <= limit:
        return lead
    low, high = size, lead
    for _ in range(HALVES):
        middle = low + ((high - low) >> 1)
        if (middle + margin) * (middle + margin) <= limit:
            low = middle
        else:
            high = middle
    return low


@jit
def coarse(x: Any, drop: Any) -> Any:
    """A signal as a coarse number of the search."""
    x = x >> drop
    if x > COARSE:
        return zero(x) + COARSE
    return zero(x) - COARSE if x < -COARSE else x


@jit
def coarsely(t: LagTables, x: Any, drop: Any) -> Any:
    """`x/(1 - E)` in coarse numbers."""
    return coarse(scaled(t, 0, x << (t.block[0, BITS] + drop), INVERSE), drop)


LED = Led(floating.steady_state, steady_solve, steady_kept, steady_absorb, steady_missed, braked, coarse=COARSE)
ARITHMETIC = Realized(
    Verbs(memory, lag_rest, lag_absorb, solve=lag_solve, led=LED), constants,
    tables, formats,
)
