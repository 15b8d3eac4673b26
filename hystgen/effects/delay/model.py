"""Dead time in front of the actuator."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from hystgen.basics.quantities import NotNegative
from hystgen.effects.base import About, Array, Candidate, Compensated, Effect, Place, Run, from_zero

FAR = (0.3, 0.4, 0.5, 0.55, 0.6, 0.7)
"""[fractions of the longest delay] Starts: as a function of the delay the error has several minima, none wider than
half a period of the fastest drive that the output follows."""


class Delay(Effect):
    """Pure delay `a(t) = v(t - T)` of the drive, with T any number of seconds.

    The drive is linear between samples, as for every effect, and constant before the first: steps do not overshoot,
    ramps are exact, and a sine of angular frequency w is off by at most (w dt)^2/8 of its amplitude.
    """

    name: Literal["delay"] = Field(description="name of the effect")
    time: NotNegative = Field(description="T, s", examples=[2.0e-4])

    place: ClassVar[Place] = Place.DRIVE
    shown_by: ClassVar[Mapping[str, int]] = {
        "fast_steps": 2, "staircase": 2, "sweep": 3, "fast_triangles": 3, "fast_reversals": 3
    }
    rank: ClassVar[float] = 3
    compensated: ClassVar[Compensated] = "none without preview"
    compensation: ClassVar[str] = "the reference is read ahead of time; without preview the motion is late"

    @property
    def dead_time(self) -> float:
        """The delay itself."""
        return self.time

    def time_scale(self, drive_range: float) -> float:
        """The delay itself."""
        return self.time

    def response(self, hertz: Array) -> NDArray[np.complex128]:
        """`exp(-i w T)`."""
        return np.asarray(np.exp(-2j * np.pi * hertz * self.time))

    def drive(self, a: Array, run: Run) -> Array:
        """The drive `time` seconds earlier."""
        return np.asarray(np.interp(run.t - self.time, run.t, a)) if self.time else a

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """The delay, from none to a tenth of the longest record."""
        low, high, start, value = from_zero(0.1 * about.sample_time, 0.1 * about.duration, about.sample_time)
        far = tuple(low + share * (high - low) for share in FAR)
        return [
            Candidate(
                "delay", low, high, start, lambda x: cls(name="delay", time=value(float(x[0]))), np.zeros(1), far
            )
        ]


SHAPES = (Delay,)
