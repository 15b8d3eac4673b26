"""Drift of the output with session time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from hystgen.basics.quantities import Number
from hystgen.effects.base import About, Array, Candidate, Compensated, Effect, Place, Run


class _Drift(Effect):
    name: Literal["drift"] = Field(description="name of the effect")
    rate: Number = Field(description="output units per s, at the start of the session", examples=[1e-4])

    place: ClassVar[Place] = Place.ADDED
    from_start: ClassVar[bool] = True
    shown_by: ClassVar[Mapping[str, int]] = {"slow_again": 1, "holds": 2}
    compensated: ClassVar[Compensated] = "needs a sensor"
    compensation: ClassVar[str] = (
        "by set_offset, where it is measured; over the time since then with emit.compensation.compensate: [drift]"
    )

    def time_scale(self, drive_range: float) -> float:
        """Infinite: drift never ends."""
        return math.inf


class LinearDrift(_Drift):
    """Linear drift `y + rate t` over session time, whatever the drive does; zero at t = 0."""

    shape: Literal["linear"] = Field(default="linear", description="a constant rate")

    def added(self, run: Run) -> Array:
        """`rate t`."""
        return self.rate * run.t

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """The rate, in output ranges per session."""
        unit = about.output_range / max(about.session, about.sample_time)
        return [
            Candidate(
                "drift", np.array([-10.0]), np.array([10.0]), np.array([0.0]),
                lambda x: cls(name="drift", rate=float(x[0]) * unit), none=np.array([0.0]),
            )
        ]


class CurvedDrift(_Drift):
    """Drift at a changing rate, `y + rate t + change t^2/2`: a frame that warms up, a sensor that settles."""

    shape: Literal["curved"] = Field(description="a linearly changing rate")
    change: Number = Field(description="of the rate, output units per s^2", examples=[1e-7])

    def added(self, run: Run) -> Array:
        """`rate t + change t^2/2`."""
        return (self.rate + 0.5 * self.change * run.t) * run.t

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """The rate and its change, in output ranges per session."""
        session = max(about.session, about.sample_time)
        unit = about.output_range / session

        def build(x: Array) -> CurvedDrift:
            return cls(name="drift", shape="curved", rate=float(x[0]) * unit, change=float(x[1]) * unit / session)

        none = np.zeros(2)
        return [Candidate("drift, curved", np.full(2, -20.0), np.full(2, 20.0), none, build, none=none)]


SHAPES = (LinearDrift, CurvedDrift)
