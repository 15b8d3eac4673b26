"""Drift from the compensator's own clock: samples since it was set, counted exactly."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hystgen.basics.jit import jit
from hystgen.effects.base import Place
from hystgen.effects.drift.model import CurvedDrift, LinearDrift
from hystgen.effects.kinds import Constants, Kind
from hystgen.effects.part import ChainPart, FloatSurroundings, Function, Realized, Unmeasured, Verbs, called, late
from hystgen.plays.slots import Reals, zero

# ---------------------------------------------------------------- clock.c

CARRY_SAMPLES = 2.0**24
"""Samples that a number of 24 bits counts exactly; both numbers together last for 2^48, nine years at 1 MHz."""

KIND = Kind(
    "clock", ("sample", "block", "carry", "rate", "half_change", "farthest"), ("high", "low", "lead"), own=(),
)

SAMPLE, BLOCK, CARRY, RATE, HALF_CHANGE, FARTHEST, ONE, MOST_AHEAD = range(8)
HIGH, LOW, LEAD = range(3)


def numbers(effect: LinearDrift | CurvedDrift, seconds: float, farthest: float, ahead: int) -> tuple[float, ...]:
    """The constants at steps of `seconds`, for references `ahead` samples ahead of the motion."""
    change = effect.change if isinstance(effect, CurvedDrift) else 0.0
    block = CARRY_SAMPLES * seconds
    return seconds, block, CARRY_SAMPLES, effect.rate, 0.5 * change, farthest, 1.0, float(ahead)


def constants(t: Reals) -> list[Constants]:
    """The numbers of a model's clock, from tables (k, 8)."""
    return [Constants(KIND, row[:ONE], (5, 0)) for row in t]


def memory(t: Reals, dtype: Any) -> Reals:
    """Memory (k, 3) of the clock of a model."""
    return np.zeros((len(t), 3), dtype)


@jit
def clock_start(t: Reals, s: Reals, j: int) -> None:  # noqa: ARG001  block interface
    """Start the clock at the drive absorbed last."""
    s[j, HIGH] = zero(s[j, HIGH])
    s[j, LOW] = zero(s[j, LOW])


@jit
def clock_tick(t: Reals, s: Reals, j: int, before: Any, v: Any) -> None:  # noqa: ARG001  block interface
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


def verbs(memory: Function, start: Function, tick: Function, drift: Function, one: int, most: int) -> Verbs:
    """The verbs of a clock from its functions in an arithmetic; `one`, `most`: columns of 1 and the farthest lead."""

    @jit
    def added(t: Reals, s: Reals, j: int) -> Any:
        """The drift now."""
        return drift(t, s, j, zero(t[j, one]))

    @jit
    def lead(t: Reals, s: Reals, j: int, filled: int) -> None:
        """A reference has arrived: the next one lies one sample further ahead, up to the preview."""
        following = t[j, one]
        if filled:
            following = following + s[j, LEAD]
        s[j, LEAD] = t[j, most] if following > t[j, most] else following

    @jit
    def ahead(t: Reals, s: Reals, j: int, filled: int, moving: int) -> Any:
        """The drift by the time of the newest reference."""
        late = s[j, LEAD] if filled else zero(t[j, one])
        return drift(t, s, j, late + t[j, one] if moving else late)

    return Verbs(memory, reset=start, move=tick, added=added, lead=lead, ahead=ahead)


def tables(effects: Sequence[LinearDrift | CurvedDrift], about: FloatSurroundings) -> Reals:
    """The tables (k, 8) of the clock of a model."""
    rows = [numbers(each, about.seconds, about.span, about.ahead) for each in effects]
    found: Reals = about.reals(rows, "drift").reshape(-1, 8)
    return found


ARITHMETIC = Realized(verbs(memory, clock_start, clock_tick, clock_drift, ONE, MOST_AHEAD), constants, tables)

PART = ChainPart(
    "clock", "drift", Place.ADDED, called("drift"), lambda effect, *_: effect,
    ARITHMETIC, late("drift"),
    kinds=(KIND,), code=("clock",),
    unmeasured=Unmeasured(
        "drift",
        "a clock that runs alone, and nothing says when it began; set_offset takes it from outside, and "
        "emit.compensation.compensate: [drift] lets the module count from there",
        "drift (a clock that runs alone; nothing says when it began",
    ),
)
"""Drift as a part of the chain: a clock's contribution to the displacement."""

PARTS = (PART,)
