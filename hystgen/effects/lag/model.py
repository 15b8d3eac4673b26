"""First-order lag of an amplifier or of averaging in front of the actuator."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from hystgen.basics.quantities import NotNegative
from hystgen.effects.base import About, Array, Candidate, Compensated, Effect, Place, Run, follow, from_zero


class Lag(Effect):
    """First-order lag `tau a' + a = v` of the drive.

    For `v` linear over a step the solution is exact (first-order hold: Franklin, Powell, Workman, Digital Control of
    Dynamic Systems). A record starts settled at its first drive.
    """

    name: Literal["lag"] = Field(description="name of the effect")
    time_constant: NotNegative = Field(description="tau, s; 0 for no lag", examples=[0.0125])

    place: ClassVar[Place] = Place.DRIVE
    shown_by: ClassVar[Mapping[str, int]] = {
        "fast_steps": 1, "staircase": 1, "sweep": 2, "fast_triangles": 2, "fast_minor": 2, "fast_reversals": 2
    }
    rank: ClassVar[float] = 2
    order: ClassVar[int] = 2
    compensated: ClassVar[Compensated] = "approximate"
    compensation: ClassVar[str] = "a lead, exact on ramps; the error is a quarter of the second difference of the drive"

    def time_scale(self, drive_range: float) -> float:
        """The time constant."""
        return self.time_constant

    def response(self, hertz: Array) -> NDArray[np.complex128]:
        """`1/(1 + i w tau)`."""
        return np.asarray(1.0 / (1.0 + 2j * np.pi * hertz * self.time_constant))

    @property
    def corner(self) -> tuple[float, str] | None:
        """The frequency at which the gain has fallen to 0.71."""
        return (1.0 / (2.0 * math.pi * self.time_constant), "corner") if self.time_constant > 0.0 else None

    def drive(self, a: Array, run: Run) -> Array:
        """The drive behind the lag."""
        out = np.empty_like(a)
        decay, early, late = run.factors(self.time_constant)
        follow(a, decay, early, late, float(a[0]), out)
        return out

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """The time constant, from none to a fifth of the longest record, searched from several starting points."""
        low, high, start, value = from_zero(0.1 * about.sample_time, 0.2 * about.duration, about.sample_time)

        def build(x: Array) -> Lag:
            return cls(name="lag", time_constant=value(float(x[0])))

        others = tuple(x for decades in (1.0, 2.0) if (x := start + decades) < high)
        return [Candidate("lag", low, high, start, build, np.zeros(1), others)]


SHAPES = (Lag,)
