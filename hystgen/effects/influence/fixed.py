"""Gain and offset that follow a logged column, in fixed point."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hystgen.arithmetic.factors import factor
from hystgen.basics.jit import jit
from hystgen.basics.structures import firsts
from hystgen.effects.gains import (
    FACTOR_ERROR,
    FIXED,
    GAIN_BITS,
    LARGEST_GAIN,
    LEAST_GAIN,
    ONE,
    coded_gain,
    newton_steps,
)
from hystgen.effects.influence import compensator as floating
from hystgen.effects.influence.compensator import (
    CoursePlay,
    CourseState,
    CourseTable,
    Followed,
    GainTable,
    GainTables,
    LimitedLaw,
    limited,
)
from hystgen.effects.kinds import numbered
from hystgen.effects.part import Coded, CodedGain, Coding, FixedSurroundings, Realized, Speed

TEMPERATURE_BITS = 37
"""Fraction bits of an internal temperature, so that temperatures up to 512 degC can be multiplied like any signal."""

COLUMN_BITS = 46
"""Bits of the internal value of any other column: as many as the largest temperature has."""


@dataclass(frozen=True)
class GainFormats(Coded):
    """A gain: its law, the fraction bits of the column's codes and of its internal value, and of signals."""

    one: Followed
    wide: LimitedLaw
    code: int
    whole: int
    signal: int

    def gain(self, size: float, speed: Speed, at: Coding) -> CodedGain:
        """The gain's properties, for inputs up to `size`.

        A step of a lag has three roundings of half a unit, which add up until the lag's own decay balances them.
        """
        law, wrong, products = self.wide.law, 2.0 ** -(self.whole + 1), 0
        if not law.plain:
            wrong *= 2.0
            if law.time_constant:
                rate, _ = self.wide.steps(speed.seconds)
                wrong += 1.5 * 2.0**-self.whole / rate + 4.0 * FACTOR_ERROR * self.wide.reach
            products = len(law.weights) + 6
        rates = law.gain, self.wide.slope
        found = coded_gain(rates, size, at, wrong, 0.0, LEAST_GAIN, LARGEST_GAIN, at.span)
        more = products * (2.0**-self.signal + 2.0 * FACTOR_ERROR * at.span)
        return found._replace(there=found.there + more, back=found.back + more / LEAST_GAIN)


def formats(one: Followed, about: FixedSurroundings, *_: float) -> GainFormats:
    """A gain of a model."""
    wide = limited(one.effect.law, about.span)
    if one.effect.columns:  # the temperature
        code, whole = about.temperature, TEMPERATURE_BITS
        degrees = about.code_max / 2.0**code
        wide = LimitedLaw(wide.law, *(min(max(end, -degrees), degrees) for end in (wide.lowest, wide.highest)))
    else:
        farthest = max(abs(wide.lowest), abs(wide.highest))
        code = math.floor(math.log2(about.code_max / farthest))
        whole = code + COLUMN_BITS - about.code_bits
    return GainFormats(one, wide, code, whole, about.bits)


def made(blocks: Sequence[GainFormats], about: FixedSurroundings) -> GainTables:
    """The tables of several gains. Raises OverflowError if a number does not fit."""
    rows, ways, plays, level = [], [], [], about.level
    for each in blocks:
        wide, law, unit = each.wide, each.wide.law, 2.0**each.whole
        rates = factor(law.gain * ONE / unit), factor(law.offset * level / unit)
        limits = (round(end * unit) for end in (law.reference, wide.lowest, wide.highest))
        rows.append((*FIXED.limits, *rates, *limits, each.whole - each.code))
        turns = newton_steps(wide.change(about.seconds), 2.0**-GAIN_BITS)
        counts = len(law.weights), turns, law.time_constant > 0.0
        steps = (*map(factor, wide.steps(about.seconds)), factor(ONE / (wide.reach * unit)))
        ways.append((*counts, *steps, *(round(power * level) for power in wide.powers())))
        plays += [
            (round(r * unit), factor(p * level / unit)) for r, p in zip(law.thresholds, law.weights, strict=True)
        ]
    return GainTables(
        GainTable.of(rows),
        CourseTable.of(ways),
        np.array([not each.wide.law.plain for each in blocks], dtype=np.int64),
        firsts(len(each.wide.law.weights) for each in blocks),
        CoursePlay.of(plays),
        floating.entries([each.one for each in blocks]),
        np.array([2.0**each.code for each in blocks]),
        np.array([each.wide.law.reference for each in blocks]),
        np.array([each.wide.lowest for each in blocks]),
        np.array([each.wide.highest for each in blocks]),
    )


@jit
def _added(s: CourseState, j: int, change: int) -> int:
    """Add to the state of a lag. Returns it."""
    s.high[j] = s.high[j] + change
    return s.high[j]


ARITHMETIC = Realized(
    floating.gain_verbs(FIXED, _added), numbered(floating.KIND, 2, 2), made, formats,
    kinds=(floating.KIND, floating.COURSE_KIND), beside=floating.courses,
)
