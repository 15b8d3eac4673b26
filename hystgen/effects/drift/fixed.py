"""Drift from the compensator's own clock in fixed point: summed sample by sample, without rounding.

The change per sample, and the change of that, are constants with 60 bits below a signal; the sum is kept as whole
signals and a fraction. The clock stops once the drift has left the range of offsets for good.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from hystgen.basics.jit import jit
from hystgen.effects.drift import compensator as floating
from hystgen.effects.drift.model import CurvedDrift, LinearDrift
from hystgen.effects.kinds import Constants, Kind
from hystgen.effects.part import FixedSurroundings, Realized
from hystgen.plays.slots import Reals, zero

MOST_SAMPLES = 2**44
"""Most samples that are counted: half a year at 1 MHz. A drift still in range by then stays where it is."""

STATE_BITS = 58
"""Bits of a change per sample, without its sign: references ahead of time sum several of them."""

KIND = Kind("clock", own=(), letters="wwwwb", memory="wwwww")

SLOPE, CHANGE, SAMPLES, FARTHEST, BITS, ONE, MOST_AHEAD = range(7)
WHOLE, PART, GAINED, COUNT = 0, 1, 3, 4


@dataclass(frozen=True)
class ClockNumbers:
    """The table (7,) of a clock, and the largest error of its drift in signals."""

    table: list[int]
    error: float


def numbers(
    effect: LinearDrift | CurvedDrift, step: float, signal: Fraction, farthest: float, ahead: int
) -> ClockNumbers:
    """The constants for samples `step` seconds apart, signals of `signal` output units, and a drift of `farthest`
    signals either way. Raises OverflowError if the drift does not fit the numbers before it stays beyond that."""
    rate, change = (Fraction(x) for x in (effect.rate, getattr(effect, "change", 0.0)))
    own = Fraction(step)
    twice = change * own * own / signal
    slope = rate * own / signal + twice / 2
    samples = _samples(float(slope), float(twice), farthest)
    peak = 0.0 if not twice else min(max(float(-slope / twice), 0.0), float(samples))
    far = max(abs(_drift(float(slope), float(twice), n)) for n in (peak, float(samples)))
    fastest = abs(slope) + abs(twice) * (samples + ahead)
    room = STATE_BITS - math.ceil(math.log2(2.0 + 2.0 * ahead))
    bits = min(room - max(math.ceil(math.log2(float(fastest))), 0) if fastest else room, room)
    if bits < 0 or far > 2.0**60:
        raise OverflowError("no room")
    scaled = round(slope * 2**bits), round(twice * 2**bits)
    reach = samples + ahead
    error = 1.0 + 0.5 * 2.0**-bits * (reach + 0.5 * float(reach) ** 2 * bool(twice))
    return ClockNumbers([*scaled, samples, math.floor(farthest), bits, 1, ahead], error)


def _drift(slope: float, twice: float, n: float) -> float:
    return slope * n + 0.5 * twice * n * (n - 1.0)


def _samples(slope: float, twice: float, farthest: float) -> int:
    """The number of samples after which the drift stays beyond `farthest`; at most `MOST_SAMPLES`."""
    if abs(_drift(slope, twice, float(MOST_SAMPLES))) <= farthest:
        return MOST_SAMPLES
    low, high = max(math.ceil(-slope / twice) + 1, 0) if slope * twice < 0.0 else 0, MOST_SAMPLES  # from where it turns
    while high - low > 1:
        middle = (low + high) // 2
        if _drift(slope, twice, float(middle)) * math.copysign(1.0, twice or slope) > farthest:
            high = middle
        else:
            low = middle
    return high


def constants(t: Reals) -> list[Constants]:
    """The numbers of a model's clock, from tables (k, 7)."""
    return [Constants(KIND, row[:ONE], (3, 0)) for row in t]


# ---------------------------------------------------------------- clock_fixed.c


def memory(t: Reals, dtype: Any) -> Reals:
    """Memory (k, 5) of the clock of a model."""
    return np.zeros((len(t), 5), dtype)


@jit
def clock_start(t: Reals, s: Reals, j: int) -> None:  # noqa: ARG001  block interface
    """Start the clock at the drive absorbed last."""
    s[j, WHOLE] = zero(s[j, WHOLE])
    s[j, PART] = s[j, WHOLE]
    s[j, GAINED] = s[j, WHOLE]
    s[j, COUNT] = s[j, WHOLE]


@jit
def clock_tick(t: Reals, s: Reals, j: int, before: Any, v: Any) -> None:  # noqa: ARG001  block interface
    """One sample later."""
    if s[j, COUNT] >= t[j, SAMPLES]:
        return
    part = s[j, PART] + t[j, SLOPE] + s[j, GAINED]
    whole = part >> t[j, BITS]
    s[j, WHOLE] = s[j, WHOLE] + whole
    s[j, PART] = part - (whole << t[j, BITS])
    s[j, GAINED] = s[j, GAINED] + t[j, CHANGE]
    s[j, COUNT] = s[j, COUNT] + 1


@jit
def clock_drift(t: Reals, s: Reals, j: int, ahead: Any) -> Any:
    """The drift `ahead` samples after the present one."""
    more = (t[j, SLOPE] + s[j, GAINED]) * ahead + t[j, CHANGE] * ((ahead * (ahead - 1)) // 2)
    drift = s[j, WHOLE] + ((s[j, PART] + more) >> t[j, BITS])
    if drift > t[j, FARTHEST]:
        return t[j, FARTHEST]
    if drift < -t[j, FARTHEST]:
        return -t[j, FARTHEST]
    return drift


def formats(effect: LinearDrift | CurvedDrift, about: FixedSurroundings, *_: float) -> ClockNumbers:
    """The clock of an effect, for references as far ahead as they may come."""
    return numbers(effect, about.seconds, about.output_lsb / 2**about.bits, float(about.farthest), about.ahead)


ARITHMETIC = Realized(
    floating.verbs(memory, clock_start, clock_tick, clock_drift, ONE, MOST_AHEAD), constants,
    lambda clocks, _: np.array([one.table for one in clocks], dtype=np.int64).reshape(-1, 7), formats,
)
