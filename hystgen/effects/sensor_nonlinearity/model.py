"""Curvature of the displacement sensor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from hystgen.basics.quantities import Number, Positive
from hystgen.effects.base import About, Array, Candidate, Compensated, Effect, Place, Problem, Run, curve, not_as_many

BENT = 1.0
"""Parabolas from which a search starts, 10 % at the end of the range: from a linear sensor it could overshoot."""

PIECES = (6, 12)
"""Numbers of pieces of the monotone curves that are tried if a cubic helps. For a square root over the range, the
residual is 1.3 times the noise with six pieces and 1.03 with twelve; for an arctangent, or a tanh whose end slope is a
sixth of its middle slope, 9 to 10 and 1.3 times (`test_sensor_curves`, noise 0.02 % of the output)."""

STEEP = 3.0
"""Largest logarithm of the ratio of two pieces' slopes: a factor of twenty, beyond which a sensor would be useless on
one side."""

MAX_KNOTS = 64
"""Maximum number of knots of a curve: more than on any sensor's calibration sheet."""


class _Sensor(Effect):
    name: Literal["sensor_nonlinearity"] = Field(description="name of the effect")

    place: ClassVar[Place] = Place.OUTPUT
    shown_by: ClassVar[Mapping[str, int]] = {"multisine": 2, "slow": 3, "slow_minor": 3, "slow_reversals": 4}
    order: ClassVar[int] = 1
    timed: ClassVar[bool] = False
    pointwise: ClassVar[bool] = True
    compensated: ClassVar[Compensated] = "none needed"
    compensation: ClassVar[str] = "corrected in the data, never inverted in the drive"
    mistaken: ClassVar[Mapping[str, tuple[str, str]]] = {
        "asymmetry": (
            "the memoryless part was diagnosed as asymmetry, and the records could not tell it from a curved sensor; "
            "if it is the sensor's, the inverse bends the true motion.",
            "the sensor was diagnosed as curved, and the records could not tell that from an asymmetry of the stage; "
            "if it is the stage's, the inverse leaves it as it is.",
        )
    }


class SensorPolynomial(_Sensor):
    """Sensor that measures `y + scale sum_k c_k xi^k`, `xi = y/scale`, k = 2, 3, ...; single-valued in y."""

    shape: Literal["polynomial"] = Field(default="polynomial", description="a polynomial of the output")
    coefficients: Annotated[tuple[Number, ...], Field(min_length=1, max_length=16)] = Field(
        description="c_2, c_3, .., fractions of scale", examples=[[0.01, -0.005]]
    )
    scale: Positive = Field(description="output at which xi = 1, output units", examples=[50.0])

    settled: ClassVar[tuple[str, ...]] = ("scale",)

    def mapped(self, y: Array, run: Run) -> Array:
        """The sensor reading."""
        shown = np.array(y)
        curve(np.asarray(y), self.scale, np.array(self.coefficients), 1.0, shown)
        return shown

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """A parabola, then a cubic, over the output range; if the cubic helps, also a quartic term."""

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


class SensorCurve(_Sensor):
    """Sensor that reads `values` at `knots`, with a smooth curve in between that rises everywhere; linear beyond.

    Cubic pieces whose slopes at the knots are harmonic means of the adjacent secants': the curve has no turning point
    (F. N. Fritsch, J. Butland, SIAM Journal on Scientific and Statistical Computing 5, 1984, 300-304).
    """

    shape: Literal["curve"] = Field(description="a curve through points, which rises everywhere")
    knots: Annotated[tuple[Number, ...], Field(min_length=2, max_length=MAX_KNOTS)] = Field(
        description="outputs, rising, output units", examples=[[0.0, 10.0, 20.0]]
    )
    values: Annotated[tuple[Number, ...], Field(min_length=2, max_length=MAX_KNOTS)] = Field(
        description="sensor readings at the knots, rising, output units", examples=[[0.0, 11.0, 20.0]]
    )

    settled: ClassVar[tuple[str, ...]] = ("knots", "values")

    def problems(self, thresholds: tuple[float, ...] | None) -> Iterator[Problem]:
        """Problems unless there are as many values as knots, and both rise."""
        yield from not_as_many("values", self.values, "knots", self.knots)
        for key in ("knots", "values"):
            for k, (one, other) in enumerate(zip(getattr(self, key)[:-1], getattr(self, key)[1:], strict=True), 1):
                if not other > one:
                    yield (key, k), f"has to be above {one:g}, the previous entry"
                    break

    def mapped(self, y: Array, run: Run) -> Array:
        """The sensor reading."""
        x, c = self._pieces
        at = np.asarray(y)
        k = np.clip(np.searchsorted(x, at, side="right"), 0, len(x))
        u = at - np.append(x[0], x)[k]
        return np.asarray(((c[3, k] * u + c[2, k]) * u + c[1, k]) * u + c[0, k])

    @cached_property
    def _pieces(self) -> tuple[Array, Array]:
        """The knots, and coefficients (4, pieces + 2) of powers of the distance from the knot below; with both end
        pieces."""
        x, y = np.array(self.knots), np.array(self.values)
        steps, slopes = np.diff(x), np.diff(y) / np.diff(x)
        at = np.concatenate([slopes[:1], 2.0 / (1.0 / slopes[:-1] + 1.0 / slopes[1:]), slopes[-1:]])
        square = (3.0 * slopes - 2.0 * at[:-1] - at[1:]) / steps
        cube = (at[:-1] + at[1:] - 2.0 * slopes) / steps**2
        zero = np.zeros(1)
        return x, np.stack([
            np.concatenate([y[:1], y[:-1], y[-1:]]), np.concatenate([at[:1], at]),
            np.concatenate([zero, square, zero]), np.concatenate([zero, cube, zero]),
        ])

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """Pieces of equal width over the measured output, with free slopes; tried if a cubic helps.

        The ends stay fixed, since the weights of the plays and the offsets already stretch and shift the output.
        """
        low, high = about.output
        if not high > low:
            return []

        def candidate(pieces: int) -> Candidate:
            knots = np.linspace(low, high, pieces + 1)

            def build(x: Array) -> SensorCurve:
                rises = np.exp(np.append(x, 0.0))
                values = low + (high - low) * np.concatenate([[0.0], np.cumsum(rises)]) / np.sum(rises)
                return cls(
                    name="sensor_nonlinearity", shape="curve", knots=tuple(knots.tolist()),
                    values=tuple(values.tolist()),
                )

            def grown(cubic: Array) -> Array:
                shown = SensorPolynomial(
                    name="sensor_nonlinearity", coefficients=tuple((0.1 * cubic).tolist()), scale=about.output_range
                ).mapped(knots, Run(knots, knots))
                rises = np.maximum(np.diff(shown), np.exp(-STEEP) * np.ptp(knots) / pieces)
                return np.asarray(np.clip(np.log(rises[:-1] / rises[-1]), -STEEP, STEEP))

            none = np.zeros(pieces - 1)
            label = f"sensor, curve of {pieces} pieces"
            return Candidate(label, none - STEEP, none + STEEP, none, build, none, (), CUBIC, grown)

        return [candidate(pieces) for pieces in PIECES]


SHAPES = (SensorPolynomial, SensorCurve)
