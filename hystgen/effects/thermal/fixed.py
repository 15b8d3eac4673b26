"""Gain and offset that follow the drive's own heat, in fixed point."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from hystgen.arithmetic.factors import factor, times
from hystgen.basics.jit import inside, jit
from hystgen.basics.structures import firsts, memory_of
from hystgen.effects.gains import (
    FIXED,
    GAIN_BITS,
    ONE,
    coded_gain,
    newton_steps,
)
from hystgen.effects.kinds import numbered
from hystgen.effects.part import Coded, CodedGain, Coding, FixedSurroundings, Realized, Speed
from hystgen.effects.thermal import compensator as floating
from hystgen.effects.thermal.compensator import (
    FrictionPlay,
    FrictionTable,
    HeatMemory,
    HeatState,
    HeatTable,
    HeatTables,
    Warm,
)
from hystgen.plays.fixed import nearest

Numbers = tuple[float, float, float, float, float]
"""Constants of a block, as in `floating.heat_numbers`."""


# ---------------------------------------------------------------- heat.c

RISE_BITS = 59
"""Bits of the largest temperature rise that a drive can cause."""

AMOUNT_BITS = 50
"""Bits of the heat of a step, and of a temperature, in a product."""




@dataclass(frozen=True)
class Heat(Coded):
    """Own heat in fixed point: its table, thresholds of the rubbing plays and their fraction bits in drive codes, and
    the largest error of the temperature against the same recursion without rounding, degrees."""

    table: tuple[object, ...]
    thresholds: tuple[int, ...]
    bits: int
    error: float
    one: Warm | None = None

    def gain(self, size: float, speed: Speed, at: Coding) -> CodedGain:
        """The gain's properties, for inputs up to `size`."""
        assert self.one is not None
        effect: Any = self.one.effect
        wrong = self.error + floating.coarseness(effect, *speed)
        warmest, least, largest = floating.reached(effect, *speed)
        offset = warmest * abs(effect.offset_per_degree) / at.output_lsb
        at_once = floating.most_at_once(effect, *speed)
        rates = effect.gain_per_degree, effect.offset_per_degree
        return coded_gain(rates, size, at, wrong, at_once, least, largest, offset)


def heat(
    numbers: Numbers, turns: int, thresholds: Sequence[float], largest: int, lsb: float, level: float, code_bits: int
) -> Heat:
    """Own heat from `numbers` as in `heat_numbers`, Newton steps, `thresholds` as in the function of that name, drives
    up to `largest` codes of `lsb` and `code_bits` bits, and `level` signals per unit of the output. Raises
    OverflowError if a number does not fit."""
    rate, per_amount, per_degree, offset_per_degree, hottest = numbers
    if thresholds:
        bits = STATE_BITS - code_bits  # fraction bits of a play, in drive codes
        unit_of_drive = lsb / 2.0**bits
        rows = [round(r / unit_of_drive) for r in thresholds]
        most = (2 * largest << bits) * len(rows) ** 2
        per_code, astray = per_amount * unit_of_drive, float(len(rows) ** 2)  # a threshold is off by half a unit
    else:
        bits, rows, astray = 0, [], 0.0
        most, per_code = 2 * largest * largest, per_amount * lsb * lsb  # change of the square, codes
    coarse = max(0, most.bit_length() - AMOUNT_BITS)
    warmest = max(per_code * most / rate, 1e-300)
    unit = math.ldexp(1.0, math.ceil(math.log2(warmest)) - RISE_BITS)  # degrees
    drop = RISE_BITS - AMOUNT_BITS
    kept = unit * 2.0**drop
    heating = per_code * 2.0**coarse / unit
    lift = max(0, math.frexp(heating)[1] - 9)
    products = (rate * 2.0**drop, heating / 2.0**lift, per_degree * kept * ONE, offset_per_degree * kept * level)
    rounding = unit * (2.0**lift + 1.0) + per_code * (0.5 * 2.0**coarse * (coarse > 0) + astray)
    error = rounding / rate + 2.0 * kept + min(warmest, hottest) * 2.0**-29
    hot = min(round(hottest / kept), 1 << AMOUNT_BITS)
    return Heat((*map(factor, products), hot, turns, coarse, lift, drop), tuple(rows), bits, error)


def heat_formats(one: Warm, about: FixedSurroundings, *_: float) -> Heat:
    """Own heat of a block."""
    effect: Any = one.effect
    numbers = floating.heat_numbers(effect, about.ends, about.span, about.seconds)
    widths = floating.thresholds(effect, about.ends)
    turns = newton_steps(floating.heat_change(effect, about.ends, about.seconds), 2.0**-GAIN_BITS)
    found = heat(numbers, turns, widths, about.drive, float(about.drive_lsb), about.level, about.code_bits)
    return replace(found, one=one)


def heat_tables(rows: Sequence[Heat]) -> HeatTables:
    """The tables of several blocks."""
    return HeatTables(
        HeatTable.of([(*FIXED.limits, *one.table) for one in rows]),
        FrictionTable.of([(len(one.thresholds), 1, 2, one.bits) for one in rows]),
        firsts(len(one.thresholds) for one in rows),
        FrictionPlay.of([(r,) for one in rows for r in one.thresholds]),
    )


@jit
def warmed(t: HeatTable, s: HeatState, j: int, amount: int) -> int:
    """Absorb the heat of a step. Returns the temperature rise without its lowest bits."""
    warmer = times(nearest(amount, t.coarse[j]), t.per_amount.mantissa[j], t.per_amount.shift[j]) << t.lift[j]
    lost = times(s.high[j] >> t.drop[j], t.rate.mantissa[j], t.rate.shift[j])
    s.high[j] = s.high[j] + (warmer - lost)
    return s.high[j] >> t.drop[j]


@jit
def narrowed(t: HeatTable, j: int, gain: int) -> int:
    """Bring a gain back within limits that rounding may have exceeded."""
    return inside(gain, t.least[j], t.largest[j])


STATE_BITS = 31
"""Bits of a rubbing play, excluding its sign; a drive takes 15 or 31 of them."""

HEAT_ARITHMETIC = Realized(
    floating.heat_verbs(FIXED, memory_of(HeatMemory), warmed, narrowed, FIXED.given),
    numbered(floating.HEAT_KIND, 12, 2), lambda rows, _: heat_tables(rows), heat_formats, floating.HEAT_KINDS,
    functools.partial(floating.friction_constants, each=2),
)
