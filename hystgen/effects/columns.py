"""Gain and offset that follow a logged column: the law shared by all effects with such a column."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hystgen.effects.base import Array, Compensated, Effect, Place, Run, follow
from hystgen.plays import operators

TEMPERATURE = "temperature"
"""The column that has a call of its own in C, `set_temperature`; all others have `set_influence`."""


@dataclass(frozen=True)
class Law:
    """What a column does. With the column's value c, or its response c to `time_constant` [s], `x = c - reference`:

    the gain is `1 + gain x`, the offset `offset x + curve[0] x^2 + curve[1] x^3 + sum weights_i play_i(x)`, with plays
    of these `thresholds` that start at 0. `ends`: values of the column for which the law is known.
    """

    column: str
    gain: float = 0.0
    offset: float = 0.0
    reference: float = 0.0
    time_constant: float = 0.0
    curve: tuple[float, ...] = ()
    thresholds: tuple[float, ...] = ()
    weights: tuple[float, ...] = ()
    ends: tuple[float, float] = (-math.inf, math.inf)

    @property
    def plain(self) -> bool:
        """Whether gain and offset are linear in the column's value at the same time."""
        return not (self.time_constant or self.curve or self.thresholds)

    @property
    def steepest(self) -> float:
        """Largest change of the offset per unit of the column, without its curve."""
        return abs(self.offset) + math.fsum(map(abs, self.weights))

    def above(self, run: Run) -> Array:
        """`x` (N,) at the samples of a run."""
        c = run.extra[self.column]
        if self.time_constant:
            out = np.empty(len(c))
            decay, early, late = run.factors(self.time_constant)
            follow(np.ascontiguousarray(c), decay, early, late, float(c[0]), out)
            c = out
        return c - self.reference

    def gains(self, run: Run) -> tuple[Array, Array]:
        """Gain and offset (N,) over a run."""
        x = self.above(run)
        offset = self.offset * x
        for power, c in enumerate(self.curve, 2):
            offset = offset + c * x**power
        if self.thresholds:
            r, p = np.array(self.thresholds), np.array(self.weights)
            offset = offset + operators.play_sum(np.ascontiguousarray(x), r, np.zeros(len(r)), p)
        return 1.0 + self.gain * x, offset


class Follower(Effect):
    """An effect whose gain and offset follow a column of the record."""

    place: ClassVar[Place] = Place.GAIN
    order: ClassVar[int] = 1
    compensated: ClassVar[Compensated] = "needs a sensor"

    @property
    @abstractmethod
    def law(self) -> Law:
        """What its column does."""

    @property
    def read(self) -> tuple[str, ...]:
        """The law's column."""
        return (self.law.column,)

    @property
    def needs_time(self) -> bool:
        """Whether it responds with a lag."""
        return bool(self.law.time_constant)

    def gains(self, run: Run) -> tuple[Array, Array]:
        """Gain and offset of the law."""
        return self.law.gains(run)

    def time_scale(self, drive_range: float) -> float:
        """The time constant of the column's response."""
        return self.law.time_constant
