"""Saturation behind the plays; one in front of them is a stage of `model.memoryless`."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from hystgen.effects.base import About, Array, Candidate, Compensated, Effect, Place, Run
from hystgen.param_models import Positive

LEVELS = (np.array([-0.02]), np.array([-0.1]), np.array([-0.3]))
"""Starts within the output: a limit beyond what was measured does nothing, and neither does a small change of it."""


class _Saturation(Effect):
    name: Literal["saturation"] = Field(description="name of the effect")

    place: ClassVar[Place] = Place.OUTPUT
    timed: ClassVar[bool] = False
    hint: ClassVar[str] = "this is saturation behind the plays, one in front is a stage of model.memoryless"
    compensated: ClassVar[Compensated] = "exact"
    compensation: ClassVar[str] = "exact inside the range, clamped outside"

    @classmethod
    def _candidate(cls, label: str, about: About, high: float) -> Candidate:
        def build(x: Array) -> Effect:
            shape = cls.model_fields["shape"].annotation.__args__[0]  # type: ignore[union-attr]
            return cls(name="saturation", shape=shape, level=about.output_range * float(10.0 ** x[0]))  # type: ignore[call-arg]

        return Candidate(label, np.array([-1.0]), np.array([high]), np.array([0.3]), build, np.array([high]), LEVELS)


class TanhSaturation(_Saturation):
    """Smooth limit `y = level tanh(h/level)` of the output in front of the offset."""

    shape: Literal["tanh"] = Field(default="tanh", description="smooth limit")
    level: Positive = Field(description="largest output, output units", examples=[50.0])

    def mapped(self, y: Array, run: Run) -> Array:
        """The limited output."""
        return np.asarray(self.level * np.tanh(y / self.level))

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """The level, from a tenth of the output range to a thousand."""
        return [cls._candidate("saturation behind, tanh", about, 3.0)]


class HardSaturation(_Saturation):
    """Hard limit `y = min(max(h, -level), level)` of the output in front of the offset."""

    shape: Literal["hard"] = Field(description="hard limit")
    level: Positive = Field(description="largest output, output units", examples=[50.0])

    def mapped(self, y: Array, run: Run) -> Array:
        """The limited output."""
        return np.clip(y, -self.level, self.level)

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """The level, from a tenth of the output range to ten."""
        return [cls._candidate("saturation behind, hard", about, 1.0)]


SHAPES = (TanhSaturation, HardSaturation)
