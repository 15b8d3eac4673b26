"""A lag as a block in fixed point: the same split as in floating point, with states finer than a signal.

Instead of the input solved for, which can be as large as the lead, the state keeps the lag's intended move `lead`; with
another input, the target falls short by `1 - theta` times the difference between the two moves.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hystgen.arithmetic.factors import GUARD, LARGEST, STATE_BITS, factor, times
from hystgen.arithmetic.factors import error as missed
from hystgen.basics.jit import inside, jit, zero
from hystgen.basics.structures import AnyFactor, memory_of
from hystgen.effects.lag import compensator as floating
from hystgen.effects.lag.compensator import (
    HALVES,
    ExactTable,
    LagMemory,
    LagNumbers,
    LagSizes,
    LagTable,
    LagTables,
    shifted,
    steady_led,
)
from hystgen.effects.part import Coded, FixedSurroundings, Led, Realized, Verbs
from hystgen.plays.fixed import nearest

EXACT_BITS = 8
"""Bits of the state of a lag that is inverted exactly, which rounding cannot stall."""


@dataclass(frozen=True)
class LagFormats(Coded):
    """A lag with its signals' sizes, its states' fraction bits beyond a signal's, and bits dropped before a product."""

    one: LagNumbers
    sizes: LagSizes
    bits: int
    drop: int

    @cached_property
    def _roundings(self) -> tuple[float, float, float]:
        """Rounding errors of the output, of the state in the inverse, and of the answer, in units of signals."""
        exact, rate, second, late = self.one.exact, self.one.rate, self.one.second, self.one.late
        state, scale, given = 2.0**-self.bits, 2.0**self.drop, self.sizes.given
        kept = state * (0.5 / rate + scale) + 2.0 * given * missed(rate * scale) / scale / rate
        finer = 2.0 ** (self.bits - self.drop)
        answer = self.sizes.state * missed(self.one.inverse / finer) * finer
        if exact:
            kept += (0.5 * state + 2.0 * given * missed(late * 2.0**self.bits) / 2.0**self.bits) / rate
            return kept + 0.5, kept, answer + state * scale / late + 0.5
        product = state * (0.5 + scale * second) + self.sizes.state * missed(second * scale) / scale
        return 3.0 * kept + product + 0.5, kept + 3.0 * product, answer + state * scale * self.one.inverse + 1.0

    @property
    def arrived(self) -> float:
        """Rounding errors of the output in front of the plays."""
        return self._roundings[0]

    @property
    def follows(self) -> float:
        """Fraction of a change of the input that reaches the output in the same sample."""
        return 1.0 if self.one.exact else self.one.rate * (1.0 + 2.0 * self.one.second)

    def led(self, error: float, code: float, same: bool, turning: bool) -> float:
        """Error of the input for an error of the requested output; `code`: rounding of the input."""
        rate, second, late = self.one.rate, self.one.second, self.one.late
        _, kept, answer = self._roundings
        if not self.one.exact:  # its states have seen the same drives
            goal = shifted(second, turning) * error + (1.0 + 2.0 * second) / (1.0 - second) * kept
            return (goal + kept) / rate + answer + code
        if same:
            return (error + kept) / late + answer + code
        return ((2.0 - rate) * (error + kept) + answer * late + late * code) / (late - second)


def formats(one: LagNumbers, about: FixedSurroundings, given: float, asked: float) -> LagFormats:
    """A lag for signals up to these sizes. Raises OverflowError if the states do not fit."""
    sizes = one.sizes(given, asked, about.margin.turning)
    room = STATE_BITS - math.ceil(math.log2(sizes.state))
    wanted = EXACT_BITS if one.exact else max(math.ceil(-math.log2(one.rate)), 0) + GUARD
    bits = min(wanted, room)
    if bits < (EXACT_BITS if one.exact else wanted - GUARD):
        raise OverflowError("no room")
    drop = max(0, math.ceil(math.log2(sizes.state)) + bits + 1 - (LARGEST.bit_length() - 1))
    return LagFormats(one, sizes, bits, drop)


def tables(blocks: Sequence[LagFormats], about: FixedSurroundings) -> LagTables:
    """All lags of a model."""
    rows = []
    for each in blocks:
        one, bits, drop = each.one, each.bits, each.drop
        middle = one.late * 2.0**bits if one.exact else one.second * 2.0**drop
        rows.append((*map(factor, (one.rate * 2.0**drop, middle, one.inverse * 2.0 ** (drop - bits))), bits, drop))
    exact = np.array([int(each.one.exact) for each in blocks], dtype=np.int64)
    return LagTables(exact, LagTable.of(rows), ExactTable.of(rows), about.braked)


# ---------------------------------------------------------------- lag.c, exact.c

COARSE = 2**30 - 1
"""Largest number in the search for a lead, so that the square of a sum of two such numbers fits in 64 bits."""


@jit
def scaled(t: LagTable | ExactTable, j: int, x: int, by: AnyFactor) -> int:
    """A number in a state's units times a factor of lag j."""
    return times(x >> t.drop[j], by.mantissa[j], by.shift[j])


@jit
def lag_rest(t: LagTables, s: LagMemory, j: int, x: int) -> int:
    """Settle everything at the input x. Returns the output."""
    if t.exact[j]:
        s.inverted.next[j] = x << t.inverted.bits[j]
        s.inverted.before[j] = x
        return x
    state = x << t.led.bits[j]
    s.led.high[j] = state
    s.led.wanted[j] = state
    s.led.asked[j] = state
    s.led.lead[j] = zero(x)
    s.led.earlier[j] = state
    return x


@jit
def lag_solve(t: LagTables, s: LagMemory, j: int, y: int) -> int:
    """The input that leads to the output y at this sample."""
    if t.exact[j]:
        left = (y << t.inverted.bits[j]) - s.inverted.next[j]
        return s.inverted.before[j] + scaled(t.inverted, j, left, t.inverted.inverse_late)
    asked = y << t.led.bits[j]
    s.led.lead[j] = asked + scaled(t.led, j, asked - s.led.wanted[j], t.led.theta) - s.led.high[j]
    s.led.asked[j] = asked
    return nearest(s.led.high[j], t.led.bits[j]) + scaled(t.led, j, s.led.lead[j], t.led.inverse_rate)


@jit
def lag_absorb(t: LagTables, s: LagMemory, j: int, x: int) -> int:
    """Absorb the input x at this sample. Returns the output."""
    if t.exact[j]:
        late = times(x - s.inverted.before[j], t.inverted.late.mantissa[j], t.inverted.late.shift[j])
        reached = s.inverted.next[j] + late
        given = x << t.inverted.bits[j]
        s.inverted.next[j] = reached + scaled(t.inverted, j, given - reached, t.inverted.rate)
        s.inverted.before[j] = x
        return nearest(reached, t.inverted.bits[j])
    change = scaled(t.led, j, (x << t.led.bits[j]) - s.led.high[j], t.led.rate)
    left = s.led.lead[j] - change
    s.led.high[j] = s.led.high[j] + change
    s.led.wanted[j] = s.led.asked[j] - (left - scaled(t.led, j, left, t.led.theta))
    s.led.lead[j] = s.led.lead[j] - scaled(t.led, j, change, t.led.rate)
    s.led.earlier[j] = s.led.asked[j]
    return nearest(s.led.high[j] - scaled(t.led, j, change, t.led.theta), t.led.bits[j])


# ---------------------------------------------------------------- steady.c


@jit
def steady_missed(t: LagTables, way: int) -> int:
    """How far a model's only lag falls short of a move in its first sample."""
    bits = t.led.bits[0]
    return nearest(scaled(t.led, 0, way << bits, t.led.theta), bits)


@jit
def steady_solve(
    t: LagTables, s: LagMemory, y: int, moved: int, rises: int, applied: int, little: int
) -> tuple[int, int]:
    """As in floating point; a kept input has no move."""
    bits = t.led.bits[0]
    way = y - (s.led.asked[0] >> bits)
    missed = s.led.earlier[0] - s.led.wanted[0]
    s.led.wanted[0] = (y - steady_led(way, moved)) << bits
    s.led.earlier[0] = s.led.wanted[0]
    led = lag_solve(t, s, 0, y)
    v = steady_kept(t, s, led, rises, applied, little)
    if v != led:
        s.led.lead[0] = zero(v)
    s.led.wanted[0] = s.led.wanted[0] - missed
    return v, way


@jit
def steady_kept(t: LagTables, s: LagMemory, v: int, rises: int, applied: int, little: int) -> int:
    """As in floating point; `little` is at least a drive code, so that rounding to a code leaves the drive ahead."""
    bits = t.led.bits[0]
    x = nearest(s.led.high[0], bits)
    ahead, kept = v - x, (applied << bits) - s.led.high[0]
    if not rises:
        ahead, kept = -ahead, -kept
    if ahead >= little:
        return v
    if kept >= 0 and kept <= (little + little) << bits:
        return applied
    return x + little if rises else x - little


@jit
def steady_absorb(s: LagMemory, before: int) -> None:
    """Note that the lag has moved; sums are exact, so no remainder can take it back."""


# ---------------------------------------------------------------- braked.c


@jit
def braked(
    t: LagTables, s: LagMemory, near: int, short: int, falling: int, rising: int, code: int, drop: int
) -> int:
    """As in floating point; `code`: a drive code; all arguments are signals; the search drops `drop` bits."""
    bits = t.led.bits[0]
    missed = s.led.earlier[0] - s.led.wanted[0]
    room = short + scaled(t.led, 0, -missed if missed < 0 else missed, t.led.inverse_rate)
    if room + room < code:
        return near
    way = inside(s.led.asked[0] - s.led.earlier[0], -falling << bits, rising << bits)
    more = s.led.asked[0] - s.led.high[0] + scaled(t.led, 0, way, t.led.theta) - way
    down = nearest(way, bits) + falling
    left = coarse(nearest(more, bits), drop)
    back = coarse(rising + falling - down if more < 0 else down, drop)
    ahead = near - (nearest(s.led.high[0], bits) + scaled(t.led, 0, way, t.led.inverse_rate))
    lead = coarse(-ahead if left < 0 else ahead, drop)
    less = braked_over(t, -left if left < 0 else left, lead, back, coarse(room, drop), drop) << drop
    return near + less if left < 0 else near - less


@jit
def braked_over(t: LagTables, size: int, lead: int, back: int, room: int, drop: int) -> int:
    """As in floating point, in the coarse numbers of the search."""
    margin = back >> 1
    most = coarsely(t, size, drop) if size <= margin else size
    if most > margin:
        most = braked_lead(size, lead, margin, coarsely(t, back, drop))
    return inside(lead - most, -room, room)


@jit
def braked_lead(size: int, lead: int, margin: int, way: int) -> int:
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
def coarse(x: int, drop: int) -> int:
    """A signal as a coarse number of the search."""
    most = zero(x) + COARSE
    return inside(x >> drop, -most, most)


@jit
def coarsely(t: LagTables, x: int, drop: int) -> int:
    """`x/(1 - E)` in coarse numbers."""
    return coarse(scaled(t.led, 0, x << (t.led.bits[0] + drop), t.led.inverse_rate), drop)


LED = Led(floating.steady_state, steady_solve, steady_kept, steady_absorb, steady_missed, braked, coarse=COARSE)
ARITHMETIC = Realized(
    Verbs(memory_of(LagMemory), lag_rest, lag_absorb, solve=lag_solve, led=LED),
    functools.partial(floating.constants, if_exact=(8, 4), led=(8, 4)),
    tables, formats, kinds=floating.KINDS,
)
