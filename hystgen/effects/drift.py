"""Drift of the output with session time."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from hystgen.effects.base import About, Array, Candidate, Effect, Place, Run
from hystgen.param_models import Number


class Drift(Effect):
    """Straight drift `y + rate t` over session time, whatever the drive does; zero at t = 0."""

    name: Literal["drift"] = Field(description="name of the effect")
    rate: Number = Field(description="output units per s", examples=[1e-4])

    place: ClassVar[Place] = Place.ADDED
    compensation: ClassVar[str] = "none without a sensor; an offset input to `step`"

    def added(self, run: Run) -> Array:
        """`rate t`."""
        return self.rate * run.t

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """The rate, in output ranges a session."""
        unit = about.output_range / max(about.session, about.sample_time)
        return [
            Candidate(
                "drift", np.array([-10.0]), np.array([10.0]), np.array([0.0]),
                lambda x: cls(name="drift", rate=float(x[0]) * unit), none=np.array([0.0]),
            )
        ]  # fmt: skip


SHAPES = (Drift,)
