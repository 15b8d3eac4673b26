"""Gain and offset behind the plays in fixed point."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from hystgen.arithmetic.factors import MANTISSA_BITS, factor, times
from hystgen.basics.jit import inside, jit
from hystgen.basics.structures import firsts, memory_of
from hystgen.effects.gains import (
    FIXED,
    GAIN_BITS,
    LARGEST_GAIN,
    LEAST_GAIN,
    ONE,
    RECIPROCAL_ERROR,
    newton_steps,
)
from hystgen.effects.kinds import numbered
from hystgen.effects.part import Coded, CodedGain, Coding, FixedSurroundings, Realized, Speed
from hystgen.effects.thermal import compensator as floating
from hystgen.effects.thermal.compensator import (
    FrictionPlay,
    FrictionTable,
    GainTable,
    HeatMemory,
    HeatState,
    HeatTable,
    HeatTables,
    Warm,
)
from hystgen.effects.thermal.model import LoggedThermal, OwnHeat
from hystgen.plays.fixed import nearest

LINEAR_ERROR = 2.0**-GAIN_BITS
"""[fraction of the signal] Error of a gain that is linear in a temperature: one product."""

FACTOR_ERROR = 2.0**-MANTISSA_BITS
"""[fraction of a product] Error of a factor: half its last bit. The reference temperature has the same error."""

TEMPERATURE_BITS = 37
"""Fraction bits of an internal temperature, so that temperatures up to 512 degC can be multiplied like any signal."""


Numbers = tuple[float, float, float, float, float]
"""Constants of a block, as in `floating.numbers` and `floating.heat_numbers`."""


def tables(rows: Sequence[Numbers], level: float, bits: int, degrees: float) -> GainTable:
    """All gains of a model, with `rows` as in `numbers`; `level`: signals per unit of the output; `bits`: left shift
    from a code to a temperature; `degrees`: the largest code. Raises OverflowError if a number does not fit."""
    found = []
    whole = 2.0**TEMPERATURE_BITS
    for per_degree, offset_per_degree, *ends in rows:
        rates = factor(per_degree * ONE / whole), factor(offset_per_degree * level / whole)
        limits = (round(min(max(end, -degrees), degrees) * whole) for end in ends)
        found.append((*FIXED.limits, *rates, *limits, bits))
    return GainTable.of(found)


@dataclass(frozen=True)
class GainFormats(Coded):
    """A gain, given by its constants in floating point."""

    one: Warm
    numbers: Numbers

    def gain(self, size: float, speed: Speed, at: Coding) -> CodedGain:
        """The gain's properties, for inputs up to `size`."""
        return linear(self.one.effect, size, at, 2.0 ** -(TEMPERATURE_BITS + 1), 0.0, LEAST_GAIN, LARGEST_GAIN, at.span)


def linear(
    effect: LoggedThermal | OwnHeat, size: float, at: Coding, wrong: float, at_once: float, least: float,
    largest: float, offset: float,
) -> CodedGain:
    """A gain linear in a temperature that is off by `wrong` degrees and changes by `at_once` degrees per sample."""
    degree = abs(effect.gain_per_degree) * size + abs(effect.offset_per_degree) / at.output_lsb
    there = wrong * degree + LINEAR_ERROR * size + FACTOR_ERROR * offset
    back = (wrong + at_once) * degree / least + RECIPROCAL_ERROR * size + FACTOR_ERROR * offset / least
    return CodedGain(least, largest, there, back, offset)


def formats(one: Warm, about: FixedSurroundings, *_: float) -> GainFormats:
    """A gain of a model."""
    effect: Any = one.effect
    return GainFormats(one, floating.numbers(effect, about.span))


def made(blocks: Sequence[GainFormats], about: FixedSurroundings) -> GainTable:
    """The tables of several gains, made by `tables`."""
    degrees = about.code_max / 2.0**about.temperature
    return tables([each.numbers for each in blocks], about.level, TEMPERATURE_BITS - about.temperature, degrees)


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
        return linear(effect, size, at, wrong, at_once, least, largest, offset)


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

ARITHMETIC = Realized(
    floating.gain_verbs(FIXED), numbered(floating.KIND, 2, 2), made, formats, kinds=(floating.KIND,),
    degrees=lambda t: float(t.reference[0]) / 2.0**TEMPERATURE_BITS,
)
HEAT_ARITHMETIC = Realized(
    floating.heat_verbs(FIXED, memory_of(HeatMemory), warmed, narrowed, FIXED.given),
    numbered(floating.HEAT_KIND, 12, 2), lambda rows, _: heat_tables(rows), heat_formats, floating.HEAT_KINDS,
    functools.partial(floating.friction_constants, each=2),
)
