"""Saturation behind the plays; one in front of them is a stage of `model.memoryless`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from hystgen.basics.quantities import NotNegative, Number, Positive
from hystgen.effects.base import About, Array, Candidate, Compensated, Effect, Place, Problem, Run

LEVELS = (np.array([-0.02]), np.array([-0.1]), np.array([-0.3]))
"""Starts inside the output range: a limit beyond the measured range has no effect, even if it changes slightly."""

MIDDLE = 0.5
"""[fraction of the output range from its lower end] Centre at which a search starts."""

INSIDE, GIVE = (0.03, 0.1), 0.2
"""Start of a search: distances of the stops inside the output range, as fractions of it, and the slope beyond them."""

AWAY, FARTHEST = -0.3, 0.45
"""[fractions of the range] Bounds on the distance of the stops from its ends in a search: outside, where they have no
effect, and inside."""


class _Saturation(Effect):
    name: Literal["saturation"] = Field(description="name of the effect")

    place: ClassVar[Place] = Place.OUTPUT
    shown_by: ClassVar[Mapping[str, int]] = {"slow": 2, "slow_reversals": 3}
    timed: ClassVar[bool] = False
    pointwise: ClassVar[bool] = True
    hint: ClassVar[str] = "this is saturation behind the plays; one in front is a stage of model.memoryless"
    compensated: ClassVar[Compensated] = "exact"
    compensation: ClassVar[str] = "exact inside the range, clamped outside"


class _Level(_Saturation):
    @classmethod
    def _candidate(cls, label: str, about: About, high: float) -> Candidate:
        def build(x: Array) -> Effect:
            shape = cls.model_fields["shape"].annotation.__args__[0]  # type: ignore[union-attr]
            return cls(name="saturation", shape=shape, level=about.output_range * float(10.0 ** x[0]))  # type: ignore[call-arg]

        return Candidate(label, np.array([-1.0]), np.array([high]), np.array([0.3]), build, np.array([high]), LEVELS)


class TanhSaturation(_Level):
    """Smooth limit `y = centre + level tanh((h - centre)/level)` of the output, before the offset is added.

    Limits that are the same in both directions are centred on the middle of the stage's travel, where the output of a
    unipolar drive is not 0.
    """

    shape: Literal["tanh"] = Field(default="tanh", description="smooth limit")
    level: Positive = Field(description="largest distance from the centre, output units", examples=[50.0])
    centre: Number = Field(default=0.0, description="output midway between the limits, output units", examples=[20.0])

    later: ClassVar[tuple[str, ...]] = ("centre",)

    @property
    def envelope(self) -> tuple[float, float, float, float]:
        """a0 to a3 of this curve in the form `a0 tanh(a1 h + a2) + a3`."""
        return self.level, 1.0 / self.level, 0.0 - self.centre / self.level, self.centre

    def mapped(self, y: Array, run: Run) -> Array:
        """The limited output."""
        return np.asarray(self.centre + self.level * np.tanh((y - self.centre) / self.level))

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """The level, from a tenth to a thousand times the output range; then also the centre, within the output."""
        low, high = about.drive
        bottom = about.output_range * low / (high - low)  # for plays without hysteresis

        def build(x: Array) -> TanhSaturation:
            level, centre = about.output_range * float(10.0 ** x[0]), bottom + about.output_range * float(x[1])
            return cls(name="saturation", level=level, centre=centre)

        none = np.array([3.0, MIDDLE])
        starts = [np.append(level, MIDDLE) for level in LEVELS]
        return [
            cls._candidate("saturation behind, tanh", about, 3.0),
            Candidate(
                "saturation behind, tanh off centre", np.array([-1.0, -1.0]), np.array([3.0, 2.0]), starts[0], build,
                none, tuple(starts[1:]),
            ),
        ]


class HardSaturation(_Level):
    """Hard limit `y = min(max(h, -level), level)` of the output, before the offset is added."""

    shape: Literal["hard"] = Field(description="hard limit")
    level: Positive = Field(description="largest output, output units", examples=[50.0])

    def mapped(self, y: Array, run: Run) -> Array:
        """The limited output."""
        return np.clip(y, -self.level, self.level)

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """The level, from a tenth to ten times the output range."""
        return [cls._candidate(HARD, about, 1.0)]


HARD = "saturation behind, hard"


class Stops(_Saturation):
    """Elastic stops at either end: beyond `upper` and `lower` the output continues with `give` times its slope.

    Beyond a stop, the stage moves on against the stop's stiffness in parallel with its own; its travel need not be
    centred between the two stops.
    """

    shape: Literal["stops"] = Field(description="elastic stops at either end")
    lower: Number = Field(description="start of the lower stop, output units", examples=[-1.0])
    upper: Number = Field(description="start of the upper stop, above lower, output units", examples=[38.0])
    give: Annotated[NotNegative, Field(le=1.0)] = Field(
        default=0.0, description="slope beyond the stops relative to that between, 0 for hard stops", examples=[0.1]
    )

    def problems(self, thresholds: tuple[float, ...] | None) -> Iterator[Problem]:
        """A problem unless lower < upper."""
        if not self.lower < self.upper:
            yield ("upper",), f"{self.upper!r} is not above lower = {self.lower!r}; give lower < upper"

    def mapped(self, y: Array, run: Run) -> Array:
        """The output between the stops, and a fraction of it beyond."""
        inside = np.clip(y, self.lower, self.upper)
        return np.asarray(inside + self.give * (y - inside))

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """Position and give of the stops, tried if a hard limit helps."""
        low, high = about.drive
        wide = about.output_range
        bottom, top = (wide * v / (high - low) for v in about.drive)  # for plays without hysteresis

        def build(x: Array) -> Stops:
            return cls(
                name="saturation", shape="stops", lower=bottom + wide * float(x[1]), upper=top - wide * float(x[0]),
                give=float(x[2]),
            )

        def grown(hard: Array) -> Array:
            level = wide * 10.0 ** float(hard[0])
            places = np.array([top - level, -level - bottom]) / wide
            return np.append(np.clip(places, AWAY, FARTHEST), GIVE)

        one, other = (np.array([share, share, GIVE]) for share in INSIDE)
        return [
            Candidate(
                "saturation behind, stops", np.array([AWAY, AWAY, 0.0]), np.array([FARTHEST, FARTHEST, 0.9]), one,
                build, np.array([AWAY, AWAY, GIVE]), (other,), HARD, grown,
            )
        ]


SHAPES = (TanhSaturation, HardSaturation, Stops)
