"""Curvature of the displacement sensor."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from hystgen.basics.quantities import Number, Positive
from hystgen.effects.base import About, Array, Candidate, Compensated, Effect, Place, Run, curve

BENT = 1.0
"""Parabolas from which a search starts, 10 % at the range's end: from a straight sensor its step may overshoot."""


class SensorPolynomial(Effect):
    """Sensor that measures `y + scale sum_k c_k xi^k`, `xi = y/scale`, k = 2, 3, ...; single-valued in y."""

    name: Literal["sensor_nonlinearity"] = Field(description="name of the effect")
    shape: Literal["polynomial"] = Field(default="polynomial", description="a polynomial of the output")
    coefficients: Annotated[tuple[Number, ...], Field(min_length=1, max_length=16)] = Field(
        description="c_2, c_3, .., shares of scale", examples=[[0.01, -0.005]]
    )
    scale: Positive = Field(description="output at which xi = 1, output units", examples=[50.0])

    settled: ClassVar[tuple[str, ...]] = ("scale",)

    place: ClassVar[Place] = Place.OUTPUT
    order: ClassVar[int] = 1
    timed: ClassVar[bool] = False
    pointwise: ClassVar[bool] = True
    compensated: ClassVar[Compensated] = "none needed"
    compensation: ClassVar[str] = "corrected in the data, never inverted in the drive"

    def mapped(self, y: Array, run: Run) -> Array:
        """What the sensor shows."""
        shown = np.array(y)
        curve(np.asarray(y), self.scale, np.array(self.coefficients), 1.0, shown)
        return shown

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """A parabola, then a cubic, over the output range; where that helps, with a quartic term."""

        def build(x: Array) -> SensorPolynomial:
            return cls(
                name="sensor_nonlinearity", coefficients=tuple((0.1 * x).tolist()), scale=about.output_range
            )

        def candidate(label: str, n: int, beyond: str = "") -> Candidate:
            none = np.zeros(n)
            one, other = (np.append(side, none[1:]) for side in (-BENT, BENT))
            grown = (lambda x: np.append(x, 0.0)) if beyond else None
            return Candidate(label, none - 5.0, none + 5.0, one, build, none, (other,), beyond, grown)

        return [candidate("sensor, parabola", 1), candidate(CUBIC, 2), candidate("sensor, quartic", 3, CUBIC)]


CUBIC = "sensor, cubic"

SHAPES = (SensorPolynomial,)
