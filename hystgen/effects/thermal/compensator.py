"""A logged temperature as a block: gain and offset that the caller sets."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from hystgen.basics.jit import jit
from hystgen.effects.kinds import Constants, Kind
from hystgen.effects.thermal.model import LoggedThermal
from hystgen.plays.slots import Reals, zero

LEAST_GAIN, LARGEST_GAIN = 0.5, 2.0
"""A gain set from outside is kept between these: one outside is a fault of its sensor, or of its unit."""

# ---------------------------------------------------------------- gain.c

PER_DEGREE, OFFSET_PER_DEGREE, REFERENCE, COLDEST, HOTTEST, LEAST, LARGEST, ONE = range(8)
GAIN, INVERSE, OFFSET = 0, 1, 2


KIND = Kind(
    "gain",
    ("per_degree", "offset_per_degree", "reference", "coldest", "hottest", "least", "largest"),
    ("gain", "inverse", "offset"),
    reading=(), own=("solve", "absorb"),
)  # fmt: skip


def constants(t: Reals) -> Iterator[Constants]:
    """The numbers of each gain, of tables (k, 8)."""
    for row in t:
        yield Constants(KIND, row[:ONE], (1, 1))


def numbers(effect: LoggedThermal, span: float) -> tuple[float, ...]:
    """Constants of a block behind which the output spans `span`: rates, reference, and between which temperatures.

    Outside of them the gain would leave its limits, or the offset alone would be as large as the span.
    """
    ends = [math.inf]
    if effect.gain_per_degree:
        ends += [(limit - 1.0) / effect.gain_per_degree for limit in (LEAST_GAIN, LARGEST_GAIN)]
    if effect.offset_per_degree:
        ends += [span / effect.offset_per_degree, -span / effect.offset_per_degree]
    up = min((end for end in ends if end > 0.0), default=math.inf)
    down = max((end for end in ends if end < 0.0), default=-math.inf)
    largest = 1e6  # degrees; where a temperature does nothing
    return (
        effect.gain_per_degree, effect.offset_per_degree, effect.reference,
        effect.reference + max(down, -largest), effect.reference + min(up, largest),
        LEAST_GAIN, LARGEST_GAIN, 1.0,
    )  # fmt: skip


@jit
def gain_reset(t: Reals, s: Reals, j: int) -> None:
    """The gain of the parameter file: none."""
    s[j, GAIN] = t[j, ONE]
    s[j, INVERSE] = t[j, ONE]
    s[j, OFFSET] = zero(t[j, ONE])


@jit
def gain_set(t: Reals, s: Reals, j: int, gain: Any) -> bool:
    """The gain from the next step on; whether it had to be limited."""
    inside = gain
    if inside < t[j, LEAST]:
        inside = t[j, LEAST]
    elif inside > t[j, LARGEST]:
        inside = t[j, LARGEST]
    s[j, GAIN] = inside
    s[j, INVERSE] = t[j, ONE] / inside
    return bool(inside != gain)


@jit
def gain_heat(t: Reals, s: Reals, j: int, temperature: Any) -> bool:
    """Gain and offset of a temperature; whether it had to be limited."""
    inside = temperature
    if inside < t[j, COLDEST]:
        inside = t[j, COLDEST]
    elif inside > t[j, HOTTEST]:
        inside = t[j, HOTTEST]
    above = inside - t[j, REFERENCE]
    s[j, OFFSET] = t[j, OFFSET_PER_DEGREE] * above
    limited = gain_set(t, s, j, t[j, ONE] + t[j, PER_DEGREE] * above)
    return bool(limited or inside != temperature)


@jit(inline=True)
def gain_solve(s: Reals, j: int, y: Any) -> Any:
    """The input that gives the output y."""
    return (y - s[j, OFFSET]) * s[j, INVERSE]


@jit(inline=True)
def gain_absorb(s: Reals, j: int, x: Any) -> Any:
    """The output for the input x."""
    return s[j, GAIN] * x + s[j, OFFSET]
