"""Gain and offset behind the plays in fixed point."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from hystgen.arithmetic.factors import factor, times
from hystgen.basics.jit import jit
from hystgen.effects.kinds import Constants, Kind
from hystgen.effects.thermal import compensator as floating
from hystgen.effects.thermal.compensator import GAIN, INVERSE, LARGEST_GAIN, LEAST_GAIN, OFFSET
from hystgen.plays.slots import Reals, zero

GAIN_BITS = 29
"""Fraction bits of a gain: 2 is the largest, and mantissas have 31."""

ONE = 1 << GAIN_BITS
LEAST, LARGEST = int(LEAST_GAIN * ONE), int(LARGEST_GAIN * ONE)

TEMPERATURE_BITS = 37
"""Fraction bits of a temperature inside, so that temperatures of 512 degC are multiplied like any signal."""


KIND = Kind("gain", reading=(), own=("solve", "absorb"), letters="ffwwwb", memory="iiw")


def constants(t: Reals) -> Iterator[Constants]:
    """The numbers of each gain."""
    yield from (Constants(KIND, row, (2, 2)) for row in t)


def tables(rows: list[tuple[float, ...]], level: float, bits: int, degrees: float) -> Reals:
    """All gains of a model, `rows` as `numbers` has them; `level`: signals a unit of the output, `bits`: of a
    temperature below a code, of which the largest is `degrees`. Raises OverflowError."""
    found = []
    whole = 2.0**TEMPERATURE_BITS
    for row in rows:
        rates = (row[floating.PER_DEGREE] * ONE / whole, row[floating.OFFSET_PER_DEGREE] * level / whole)
        ends = [row[i] for i in (floating.REFERENCE, floating.COLDEST, floating.HOTTEST)]
        inside = [round(min(max(end, -degrees), degrees) * whole) for end in ends]
        found.append([*(part for x in rates for part in factor(x)), *inside, bits])
    return np.array(found, dtype=np.int64).reshape(-1, 8)


# ---------------------------------------------------------------- gain_fixed.c

PER_DEGREE, OFFSET_PER_DEGREE, REFERENCE, COLDEST, HOTTEST, BITS = 0, 2, 4, 5, 6, 7


@jit
def reciprocal(gain: Any) -> Any:
    """1 over a gain."""
    return ((1 << (2 * GAIN_BITS)) + (gain >> 1)) // gain


@jit
def gain_reset(t: Reals, s: Reals, j: int) -> None:  # noqa: ARG001  as in floating point
    """The gain of the parameter file: none."""
    s[j, GAIN] = ONE
    s[j, INVERSE] = ONE
    s[j, OFFSET] = zero(s[j, OFFSET])


@jit
def gain_heat(t: Reals, s: Reals, j: int, temperature: Any) -> bool:
    """Gain and offset of a temperature; whether it had to be limited."""
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
def gain_solve(s: Reals, j: int, y: Any) -> Any:
    """The input that gives the output y."""
    return times(y - s[j, OFFSET], s[j, INVERSE], GAIN_BITS)


@jit
def gain_absorb(s: Reals, j: int, x: Any) -> Any:
    """The output for the input x."""
    return times(x, s[j, GAIN], GAIN_BITS) + s[j, OFFSET]
