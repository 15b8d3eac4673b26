"""Drift from a clock of the compensator's own: samples since it was set, counted exactly."""

from __future__ import annotations

from typing import Any

from hystgen.basics.jit import jit
from hystgen.effects.drift.model import CurvedDrift, LinearDrift
from hystgen.effects.kinds import Constants, Kind
from hystgen.plays.slots import Reals, zero

# ---------------------------------------------------------------- clock.c

CARRY_SAMPLES = 2.0**24
"""Samples that a number of 24 bits counts exactly; both numbers together last for 2^48, nine years at 1 MHz."""

KIND = Kind(
    "clock", ("sample", "block", "carry", "rate", "half_change", "farthest"), ("high", "low", "lead"), own=(),
)  # fmt: skip

SAMPLE, BLOCK, CARRY, RATE, HALF_CHANGE, FARTHEST, ONE, MOST_AHEAD = range(8)
HIGH, LOW, LEAD = range(3)


def numbers(effect: LinearDrift | CurvedDrift, seconds: float, farthest: float, ahead: int) -> tuple[float, ...]:
    """The constants at steps of `seconds`, for references `ahead` samples ahead of the motion."""
    change = effect.change if isinstance(effect, CurvedDrift) else 0.0
    block = CARRY_SAMPLES * seconds
    return seconds, block, CARRY_SAMPLES, effect.rate, 0.5 * change, farthest, 1.0, float(ahead)


def constants(t: Reals) -> list[Constants]:
    """The numbers of the clock of a model, of tables (k, 8)."""
    return [Constants(KIND, row[:ONE], (5, 0)) for row in t]


@jit
def clock_start(s: Reals, j: int) -> None:
    """Start the clock at the drive absorbed last."""
    s[j, HIGH] = zero(s[j, HIGH])
    s[j, LOW] = zero(s[j, LOW])


@jit
def clock_tick(t: Reals, s: Reals, j: int) -> None:
    """One sample later."""
    following = s[j, LOW] + t[j, ONE]
    if following >= t[j, CARRY]:
        s[j, LOW] = zero(following)
        s[j, HIGH] = s[j, HIGH] + t[j, ONE]
    else:
        s[j, LOW] = following


@jit
def clock_drift(t: Reals, s: Reals, j: int, ahead: Any) -> Any:
    """The drift `ahead` samples after the present one."""
    time = s[j, HIGH] * t[j, BLOCK] + (s[j, LOW] + ahead) * t[j, SAMPLE]
    drift = (t[j, RATE] + t[j, HALF_CHANGE] * time) * time
    if drift > t[j, FARTHEST]:
        return t[j, FARTHEST]
    if drift < -t[j, FARTHEST]:
        return -t[j, FARTHEST]
    return drift
