"""A logged temperature as a block: gain and offset that the caller sets."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

from hystgen.basics.jit import jit
from hystgen.effects.kinds import Constants, Kind
from hystgen.effects.thermal.model import LoggedThermal, SelfHeating
from hystgen.plays.slots import Counts, Reals, zero

LEAST_GAIN, LARGEST_GAIN = 0.5, 2.0
"""[times] A gain set from outside is kept between these: one beyond them is a fault of its sensor, or a wrong unit. Set
by fixed point: with `fixed.GAIN_BITS` fraction bits, 2 is the end of what a gain and its reciprocal can be."""

MOST_CHANGE = 0.25
"""[share of the gain] The largest change of a gain in one sample that the C follows: five Newton steps from the last
reciprocal leave `0.25^32`, less than the rounding of double precision. A limit of 0.5 would take six of them in every
sample, one of 0.9 nine. Set by: benchmarks/chosen_numbers.py newton."""

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
    """As in the parameter file: gain 1, offset 0."""
    s[j, GAIN] = t[j, ONE]
    s[j, INVERSE] = t[j, ONE]
    s[j, OFFSET] = zero(t[j, ONE])


@jit
def gain_set(t: Reals, s: Reals, j: int, gain: Any) -> bool:
    """Set the gain. Returns whether it had to be limited."""
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
    """Set gain and offset by a temperature. Returns whether one of them had to be limited."""
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


# ---------------------------------------------------------------- heat.c

HEAT_KIND = Kind(
    "heat", ("rate", "per_square", "per_degree", "offset_per_degree", "hottest"),
    ("high", "low", "gain", "inverse", "offset"), counts=("turns",), reading=(), own=("solve", "absorb"),
)  # fmt: skip

HEAT_RATE, PER_SQUARE, PER_RISE, OFFSET_PER_RISE, HOTTEST_RISE, HEAT_ONE, HEAT_TWO = range(7)
HIGH, LOW, HEAT_GAIN, HEAT_INVERSE, HEAT_OFFSET = range(5)


class HeatTables(NamedTuple):
    """Own heat of a model: `number` (k, 7), and the number of Newton steps, `turns` (k,)."""

    number: Reals
    turns: Counts


def risen(effect: SelfHeating, rise: float, before: float, v: float, seconds: float) -> float:
    """The temperature's rise after a step in which the drive has moved from `before` to v."""
    loss = -math.expm1(-seconds / effect.time_constant)
    heat = effect.heating * 0.25 * abs(v * abs(v) - before * abs(before)) / seconds
    return rise + loss * (heat - rise)


def most_at_once(effect: SelfHeating, ends: tuple[float, float], move: float, seconds: float) -> float:
    """Largest rise in one step in which the drive moves by `move` within `ends`."""
    largest = max(map(abs, ends))
    return risen(effect, 0.0, largest - min(move, largest), largest, seconds) + (
        risen(effect, 0.0, 0.0, min(move - largest, largest), seconds) if move > largest else 0.0
    )


def farthest(effect: SelfHeating, ends: tuple[float, float], span: float, seconds: float) -> float:
    """Largest move of the drive within `ends` that may be repeated in every step without getting hotter than what the C
    follows: at the most the heat of a step is `heating/(4T)` of the change of `v |v|`. `span`: as of `heat_numbers`."""
    hottest = heat_numbers(effect, span, seconds)[HOTTEST_RISE]
    largest = max(map(abs, ends))
    change = 4.0 * seconds * hottest / effect.heating if effect.heating else math.inf
    if change < largest * largest:
        return change / (largest + math.sqrt(largest * largest - change))  # from the end of the range inwards
    return largest + math.sqrt(change - largest * largest)


def reached(effect: SelfHeating, ends: tuple[float, float], move: float, seconds: float) -> tuple[float, float, float]:
    """The warmest rise that a drive which moves by at most `move` a step within `ends` comes to, and the least and the
    largest gain on the way."""
    warmest = most_at_once(effect, ends, move, seconds) / -math.expm1(-seconds / effect.time_constant)
    gain = min(max(1.0 + effect.gain_per_degree * warmest, LEAST_GAIN), LARGEST_GAIN)
    return warmest, min(gain, 1.0), max(gain, 1.0)


def heat_numbers(effect: SelfHeating, span: float, seconds: float) -> tuple[float, ...]:
    """Constants of a block behind which the output spans `span`, at steps of `seconds`."""
    ends = [1e6]  # degrees; where a temperature does nothing
    if effect.gain_per_degree:
        ends += [(limit - 1.0) / effect.gain_per_degree for limit in (LEAST_GAIN, LARGEST_GAIN)]
    if effect.offset_per_degree:
        ends.append(span / abs(effect.offset_per_degree))
    loss = -math.expm1(-seconds / effect.time_constant)
    per_square = loss * effect.heating * 0.25 / seconds
    hottest = min(end for end in ends if end > 0.0)
    return loss, per_square, effect.gain_per_degree, effect.offset_per_degree, hottest, 1.0, 2.0


def heat_problems(effect: SelfHeating, ends: tuple[float, float], seconds: float) -> Iterator[str]:
    """Why the C cannot follow the gain."""
    change = abs(effect.gain_per_degree) * most_at_once(effect, ends, ends[1] - ends[0], seconds) / LEAST_GAIN
    if change > MOST_CHANGE:
        yield f"its gain changes by {100.0 * change:.3g} % in one move over the range, more than {MOST_CHANGE:.0%}"


def heat_turns(effect: SelfHeating, ends: tuple[float, float], seconds: float, roundoff: float) -> int:
    """Newton steps after which the reciprocal of the gain is exact up to rounding."""
    change = abs(effect.gain_per_degree) * most_at_once(effect, ends, ends[1] - ends[0], seconds) / LEAST_GAIN
    left = max(change, 1e-9)
    return next(n for n in itertools.count(1) if left ** (2**n) < roundoff)


def heat_constants(t: HeatTables) -> Iterator[Constants]:
    """The numbers of each block."""
    for row, turns in zip(t.number, map(int, t.turns), strict=True):
        yield Constants(HEAT_KIND, row[:HEAT_ONE], (7 + 2 * turns, 1), counts=(turns,))


@jit
def heat_reset(t: HeatTables, s: Reals, j: int) -> None:
    """As warm as its surroundings."""
    s[j, HIGH] = zero(t.number[j, HEAT_ONE])
    s[j, LOW] = zero(t.number[j, HEAT_ONE])
    s[j, HEAT_GAIN] = t.number[j, HEAT_ONE]
    s[j, HEAT_INVERSE] = t.number[j, HEAT_ONE]
    s[j, HEAT_OFFSET] = zero(t.number[j, HEAT_ONE])


@jit
def heat_move(t: HeatTables, s: Reals, j: int, before: Any, v: Any) -> None:
    """The drive has moved to v."""
    n = t.number[j]
    way = (v * v if v >= zero(v) else -(v * v)) - (before * before if before >= zero(v) else -(before * before))
    high = s[j, HIGH]
    change = (n[PER_SQUARE] * (way if way >= zero(v) else -way) - n[HEAT_RATE] * high) + s[j, LOW]
    following = high + change
    s[j, HIGH] = following
    s[j, LOW] = change - (following - high)
    rise = n[HOTTEST_RISE] if following > n[HOTTEST_RISE] else following
    gain = n[HEAT_ONE] + n[PER_RISE] * rise
    inverse = s[j, HEAT_INVERSE]
    for _ in range(t.turns[j]):
        inverse = inverse * (n[HEAT_TWO] - gain * inverse)
    s[j, HEAT_GAIN] = gain
    s[j, HEAT_INVERSE] = inverse
    s[j, HEAT_OFFSET] = n[OFFSET_PER_RISE] * rise


@jit(inline=True)
def heat_solve(s: Reals, j: int, y: Any) -> Any:
    """The input that gives the output y."""
    return (y - s[j, HEAT_OFFSET]) * s[j, HEAT_INVERSE]


@jit(inline=True)
def heat_absorb(s: Reals, j: int, x: Any) -> Any:
    """The output for the input x."""
    return s[j, HEAT_GAIN] * x + s[j, HEAT_OFFSET]
