"""Gain and offset behind the plays in fixed point."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hystgen.arithmetic.factors import MANTISSA_BITS, factor, times
from hystgen.basics.jit import jit
from hystgen.effects.gains import (
    GAIN_BITS,
    LARGEST,
    LARGEST_GAIN,
    LEAST,
    LEAST_GAIN,
    ONE,
    RECIPROCAL_ERROR,
    followed,
    newton_steps,
    reciprocal,
)
from hystgen.effects.kinds import Constants, Kind, Rows
from hystgen.effects.part import Coded, CodedGain, Coding, FixedSurroundings, Realized, Speed, Verbs
from hystgen.effects.thermal import compensator as floating
from hystgen.effects.thermal.compensator import (
    AT,
    BEGUN,
    GAIN,
    INVERSE,
    OFFSET,
    HeatTables,
    Warm,
)
from hystgen.effects.thermal.model import LoggedThermal, OwnHeat
from hystgen.plays.fixed import nearest
from hystgen.plays.slots import Reals, zero

LINEAR_ERROR = 2.0**-GAIN_BITS
"""[share of the signal] Error of a gain linear in a temperature: one product."""

FACTOR_ERROR = 2.0**-MANTISSA_BITS
"""[share of a product] Error of a factor: half of its last bit. A temperature's reference has the same error."""

TEMPERATURE_BITS = 37
"""Fraction bits of an internal temperature, so that temperatures of 512 degC are multiplied like any signal."""


KIND = Kind("gain", reading=(), own=("solve", "absorb"), letters="ffwwwb", memory="iiw")


def constants(t: Reals) -> Iterator[Constants]:
    """The numbers of each gain."""
    yield from (Constants(KIND, row, (2, 2)) for row in t)


def tables(rows: Sequence[tuple[float, ...]], level: float, bits: int, degrees: float) -> Reals:
    """All gains of a model, with `rows` as in `numbers`; `level`: signals per unit of the output, `bits`: how many a
    temperature has below a code; `degrees`: the largest code. Raises OverflowError."""
    found = []
    whole = 2.0**TEMPERATURE_BITS
    for row in rows:
        rates = (row[floating.PER_DEGREE] * ONE / whole, row[floating.OFFSET_PER_DEGREE] * level / whole)
        ends = [row[i] for i in (floating.REFERENCE, floating.COLDEST, floating.HOTTEST)]
        inside = [round(min(max(end, -degrees), degrees) * whole) for end in ends]
        found.append([*(part for x in rates for part in factor(x)), *inside, bits])
    return np.array(found, dtype=np.int64).reshape(-1, 8)


@dataclass(frozen=True)
class GainFormats(Coded):
    """A gain by its numbers in floating point."""

    one: Warm
    numbers: tuple[float, ...]

    def gain(self, size: float, speed: Speed, at: Coding) -> CodedGain:
        """The gain's properties, for inputs within a size."""
        return linear(self.one.effect, size, at, 2.0 ** -(TEMPERATURE_BITS + 1), 0.0, LEAST_GAIN, LARGEST_GAIN, at.span)


def linear(
    effect: LoggedThermal | OwnHeat, size: float, at: Coding, wrong: float, at_once: float, least: float,
    largest: float, offset: float,
) -> CodedGain:
    """A gain linear in a temperature that is off by `wrong` degrees and moves by `at_once` degrees in a sample."""
    degree = abs(effect.gain_per_degree) * size + abs(effect.offset_per_degree) / at.output_lsb
    there = wrong * degree + LINEAR_ERROR * size + FACTOR_ERROR * offset
    back = (wrong + at_once) * degree / least + RECIPROCAL_ERROR * size + FACTOR_ERROR * offset / least
    return CodedGain(least, largest, there, back, offset)


def formats(one: Warm, about: FixedSurroundings, *_: float) -> GainFormats:
    """A gain of a model."""
    effect: Any = one.effect
    return GainFormats(one, floating.numbers(effect, about.span))


def made(blocks: Sequence[GainFormats], about: FixedSurroundings) -> Reals:
    """The tables of several gains, by `tables`."""
    degrees = about.code_max / 2.0**about.temperature
    return tables([each.numbers for each in blocks], about.level, TEMPERATURE_BITS - about.temperature, degrees)


# ---------------------------------------------------------------- gain_fixed.c

PER_DEGREE, OFFSET_PER_DEGREE, REFERENCE, COLDEST, HOTTEST, BITS = 0, 2, 4, 5, 6, 7


@jit
def gain_reset(t: Reals, s: Reals, j: int) -> None:  # noqa: ARG001  used in floating point
    """Return to the state of the parameter file: gain 1, offset 0."""
    s[j, GAIN] = ONE
    s[j, INVERSE] = ONE
    s[j, OFFSET] = zero(s[j, OFFSET])


@jit
def gain_heat(t: Reals, s: Reals, j: int, temperature: Any) -> bool:
    """Set gain and offset by a temperature. Returns whether one of them had to be limited."""
    given = temperature << t[j, BITS]
    inside = given
    if inside < t[j, COLDEST]:
        inside = t[j, COLDEST]
    elif inside > t[j, HOTTEST]:
        inside = t[j, HOTTEST]
    above = inside - t[j, REFERENCE]
    s[j, OFFSET] = times(above, t[j, OFFSET_PER_DEGREE], t[j, OFFSET_PER_DEGREE + 1])
    wanted = ONE + times(above, t[j, PER_DEGREE], t[j, PER_DEGREE + 1])
    gain = wanted
    if gain < LEAST:
        gain = zero(wanted) + LEAST
    elif gain > LARGEST:
        gain = zero(wanted) + LARGEST
    s[j, GAIN] = gain
    s[j, INVERSE] = reciprocal(gain)
    return bool(gain != wanted or inside != given)


@jit
def gain_solve(t: Reals, s: Reals, j: int, y: Any) -> Any:  # noqa: ARG001  block interface
    """The input that gives the output y."""
    return times(y - s[j, OFFSET], s[j, INVERSE], GAIN_BITS)


@jit
def gain_absorb(t: Reals, s: Reals, j: int, x: Any) -> Any:  # noqa: ARG001  block interface
    """The output for the input x."""
    return times(x, s[j, GAIN], GAIN_BITS) + s[j, OFFSET]


# ---------------------------------------------------------------- heat_fixed.c

RISE_BITS = 59
"""Bits of the largest rise of the temperature that a drive can make."""

AMOUNT_BITS = 50
"""Bits of a step's heat, and of a temperature, in a product."""

HEAT_KIND = Kind(
    "heat", counts=("turns", "coarse", "lift", "drop"), reading=(), own=("solve", "absorb"), letters="ffffw",
    memory="wiiw",
)

RATE, PER_AMOUNT, PER_RISE, OFFSET_PER_RISE, HOTTEST_RISE, COARSE, LIFT, DROP, BITS_BELOW = 0, 2, 4, 6, 8, 9, 10, 11, 12
RISE, HEAT_GAIN, HEAT_INVERSE, HEAT_OFFSET = range(4)


@dataclass(frozen=True)
class Heat(Coded):
    """Own heat in fixed point: its table, thresholds of the rubbing plays, and the largest error of the temperature
    against the same recursion without rounding, degrees."""

    table: tuple[int, ...]
    thresholds: tuple[int, ...]
    error: float
    turns: int = 0
    """Newton steps"""
    one: Warm | None = None

    def gain(self, size: float, speed: Speed, at: Coding) -> CodedGain:
        """The gain's properties, for inputs within a size."""
        assert self.one is not None
        effect: Any = self.one.effect
        wrong = self.error + floating.coarseness(effect, *speed)
        warmest, least, largest = floating.reached(effect, *speed)
        offset = warmest * abs(effect.offset_per_degree) / at.output_lsb
        at_once = floating.most_at_once(effect, *speed)
        return linear(effect, size, at, wrong, at_once, least, largest, offset)


def heat(
    numbers: tuple[float, ...], thresholds: Sequence[float], largest: int, lsb: float, level: float, code_bits: int
) -> Heat:
    """Own heat from `numbers` as in `heat_numbers`, `thresholds` as in the function of that name, drives up to
    `largest` codes of `lsb` and `code_bits` bits, and `level` signals a unit of the output. Raises OverflowError."""
    rate, per_amount, per_degree, offset_per_degree, hottest, *_ = numbers
    if thresholds:
        bits = STATE_BITS - code_bits  # of a play below a drive code
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
    factors = [part for x in products for part in factor(x)]
    rounding = unit * (2.0**lift + 1.0) + per_code * (0.5 * 2.0**coarse * (coarse > 0) + astray)
    error = rounding / rate + 2.0 * kept + min(warmest, hottest) * 2.0**-29
    hot = min(round(hottest / kept), 1 << AMOUNT_BITS)
    return Heat((*factors, hot, coarse, lift, drop, bits), tuple(rows), error)


def heat_formats(one: Warm, about: FixedSurroundings, *_: float) -> Heat:
    """Own heat of a block."""
    effect: Any = one.effect
    numbers = floating.heat_numbers(effect, about.ends, about.span, about.seconds)
    rubbing = floating.thresholds(effect, about.ends)
    turns = newton_steps(floating.heat_change(effect, about.ends, about.seconds), 2.0**-GAIN_BITS)
    found = heat(numbers, rubbing, about.drive, float(about.drive_lsb), about.level, about.code_bits)
    return replace(found, turns=turns, one=one)


def heat_tables(rows: Sequence[Heat], about: FixedSurroundings) -> HeatTables:  # noqa: ARG001  block interface
    """The tables of several blocks."""
    return HeatTables(
        np.array([one.table for one in rows], dtype=np.int64).reshape(-1, BITS_BELOW + 1),
        np.array([one.turns for one in rows], dtype=np.int64),
        np.array(floating.padded([one.thresholds for one in rows]), dtype=np.int64),
        np.array([len(one.thresholds) for one in rows], dtype=np.int64),
    )


def heat_constants(t: HeatTables) -> Iterator[Constants]:
    """The numbers of each block."""
    for row, turns in zip(t.number, map(int, t.turns), strict=True):
        counts = (turns, *map(int, row[COARSE:BITS_BELOW]))
        yield Constants(HEAT_KIND, row[:COARSE], (12 + 2 * turns, 2), counts=counts)


@jit
def heat_reset(t: HeatTables, s: Reals, j: int) -> None:  # noqa: ARG001  used in floating point
    """Return to the temperature of the surroundings."""
    s[j, RISE] = zero(s[j, RISE])
    s[j, HEAT_GAIN] = ONE
    s[j, HEAT_INVERSE] = ONE
    s[j, HEAT_OFFSET] = zero(s[j, RISE])
    s[j, BEGUN] = zero(s[j, RISE])


@jit
def heat_way(before: Any, v: Any) -> Any:
    """The move of the drive's signed square."""
    way = (v * v if v >= 0 else -(v * v)) - (before * before if before >= 0 else -(before * before))
    return way if way >= 0 else -way


@jit
def heat_move(t: HeatTables, s: Reals, j: int, before: Any, v: Any) -> None:
    """The drive has moved to v."""
    n = t.number[j]
    amount = friction_move(t, s, j, before, v) if t.plays[j] else heat_way(before, v)
    warmer = times(nearest(amount, n[COARSE]), n[PER_AMOUNT], n[PER_AMOUNT + 1]) << n[LIFT]
    s[j, RISE] = s[j, RISE] + (warmer - times(s[j, RISE] >> n[DROP], n[RATE], n[RATE + 1]))
    warm = s[j, RISE] >> n[DROP]
    rise = n[HOTTEST_RISE] if warm > n[HOTTEST_RISE] else warm
    gain = ONE + times(rise, n[PER_RISE], n[PER_RISE + 1])
    if gain < LEAST:
        gain = zero(gain) + LEAST
    elif gain > LARGEST:
        gain = zero(gain) + LARGEST
    s[j, HEAT_OFFSET] = times(rise, n[OFFSET_PER_RISE], n[OFFSET_PER_RISE + 1])
    s[j, HEAT_INVERSE] = followed(gain, s[j, HEAT_INVERSE], t.turns[j])
    s[j, HEAT_GAIN] = gain


@jit
def heat_solve(t: HeatTables, s: Reals, j: int, y: Any) -> Any:  # noqa: ARG001  block interface
    """The input that gives the output y."""
    return times(y - s[j, HEAT_OFFSET], s[j, HEAT_INVERSE], GAIN_BITS)


@jit
def heat_absorb(t: HeatTables, s: Reals, j: int, x: Any) -> Any:  # noqa: ARG001  block interface
    """The output for the input x."""
    return times(x, s[j, HEAT_GAIN], GAIN_BITS) + s[j, HEAT_OFFSET]


# ---------------------------------------------------------------- friction_fixed.c

STATE_BITS = 31
"""Bits of a rubbing play, without its sign: a drive has 15 or 31 of them with it."""

FRICTION_KIND = Kind(
    "friction", (), (), Rows("play", letters="w", memory="i"), counts=("n", "bits"), flags=("begun",),
    reading=(), own=(),
)


def friction_constants(t: HeatTables) -> Iterator[Constants | None]:
    """The rubbing plays of each block; None where none rub."""
    for row, plays, numbers in zip(t.threshold, map(int, t.plays), t.number, strict=True):
        counts = (plays, int(numbers[BITS_BELOW]))
        yield Constants(FRICTION_KIND, (), (2 * plays, 0), row[:plays, None], counts) if plays else None


@jit
def friction_move(t: HeatTables, s: Reals, j: int, before: Any, v: Any) -> Any:
    """As in floating point."""
    bits = t.number[j, BITS_BELOW]
    if not s[j, BEGUN]:
        s[j, BEGUN] = 1
        for i in range(t.plays[j]):
            s[j, AT + i] = before << bits
    x = v << bits
    amount = zero(x)
    for i in range(t.plays[j]):
        r = t.threshold[j, i]
        at = s[j, AT + i]
        if x - r > at:
            to = x - r
            amount = amount + (2 * i + 1) * (to - at)
        elif x + r < at:
            to = x + r
            amount = amount + (2 * i + 1) * (at - to)
        else:
            break
        s[j, AT + i] = to
    return amount


ARITHMETIC = Realized(
    Verbs(floating.memory, absorb=gain_absorb, solve=gain_solve, reset=gain_reset, set_temperature=gain_heat),
    constants, made, formats,
)
HEAT_ARITHMETIC = Realized(
    Verbs(floating.heat_memory, absorb=heat_absorb, solve=heat_solve, reset=heat_reset, move=heat_move),
    heat_constants, heat_tables, heat_formats, beside=friction_constants,
)
