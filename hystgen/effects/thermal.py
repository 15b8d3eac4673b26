"""Gain and offset that follow a temperature."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from hystgen.effects.base import About, Array, Candidate, Compensated, Effect, Place, Run, span
from hystgen.effects.recursions import code
from hystgen.param_models import NotNegative, Number, Positive

COLUMN = "temperature"


class _Thermal(Effect):
    name: Literal["thermal"] = Field(description="name of the effect")

    place: ClassVar[Place] = Place.GAIN
    order: ClassVar[int] = 1
    selector: ClassVar[str] = "source"

    gain_per_degree: Number = Field(default=0.0, description="change of gain, 1/K", examples=[-0.002])
    offset_per_degree: Number = Field(default=0.0, description="change of offset, output units/K")
    reference: Number = Field(default=20.0, description="temperature at which nothing changes, degC")

    @abstractmethod
    def above(self, run: Run) -> Array:
        """Temperature above the reference (N,), K."""

    def gain(self, run: Run) -> Array:
        """`1 + gain_per_degree (T - reference)`."""
        return 1.0 + self.gain_per_degree * self.above(run)

    def offset(self, run: Run) -> Array:
        """`offset_per_degree (T - reference)`."""
        return self.offset_per_degree * self.above(run)


class LoggedThermal(_Thermal):
    """Gain `1 + g (T - T_ref)` and offset `o (T - T_ref)` of a temperature in the record's column `temperature`."""

    source: Literal["logged"] = Field(default="logged", description="temperature from the column `temperature`")

    timed: ClassVar[bool] = False
    columns: ClassVar[tuple[str, ...]] = (COLUMN,)
    compensated: ClassVar[Compensated] = "needs a sensor"
    compensation: ClassVar[str] = "exact with a temperature input to `step`"

    def above(self, run: Run) -> Array:
        """The logged temperature above the reference."""
        return run.extra[COLUMN] - self.reference

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """Gain, offset, both; none without a temperature in every record."""
        if COLUMN not in about.columns:
            return []
        unit = 0.01 * about.output_range
        found = []
        for what, row in (("gain", (0, None)), ("offset", (None, 0)), ("gain and offset", (0, 1))):
            n = sum(place is not None for place in row)

            def build(x: Array, row: tuple[int | None, int | None] = row) -> LoggedThermal:
                gain, offset = (0.0 if place is None else float(x[place]) for place in row)
                return cls(name="thermal", gain_per_degree=0.01 * gain, offset_per_degree=unit * offset)

            bounds = np.full(n, 5.0)
            found.append(Candidate(f"thermal, logged, {what}", -bounds, bounds, np.zeros(n), build, np.zeros(n)))
        return found


class SelfHeating(_Thermal):
    """Gain and offset of self-heating: `tau T' + T = heating |v v'|/2`, T above the reference, 0 at the start.

    A drive of amplitude V about 0 and frequency f has `|v v'|/2 = f V^2` in the mean, the law of dielectric loss; one
    thermal resistance and capacity carry the heat away. The heat of a step is spread evenly over it.
    """

    source: Literal["self_heating"] = Field(description="temperature from the drive's own heat")
    time_constant: Positive = Field(description="tau, s", examples=[60.0])
    heating: NotNegative = Field(description="K s/input^2: heating f V^2 is the final rise", examples=[1.0e-5])

    compensated: ClassVar[Compensated] = "needs a sensor"
    compensation: ClassVar[str] = "flagged: the temperature is not measured"

    def above(self, run: Run) -> Array:
        """Temperature rise, K; a search comes back to it with other gains and offsets."""
        return run.remembered(("above", self.time_constant, self.heating), lambda: self._rise(run))

    def _rise(self, run: Run) -> Array:
        decay, kept, none = _kept(run.steps / self.time_constant)
        out = np.empty(len(run.t))
        code().follow(np.append(self.heating * run.heat, 0.0), decay, kept, none, 0.0, out)
        return out

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """Time constant with gain, with offset, with both; heating is such that a session warms by about 1 K."""
        low, high = span(20.0 * about.sample_time, 3.0 * about.session)
        power = max(map(abs, about.drive)) * about.travel / (2.0 * max(about.session, about.sample_time))
        heating = 1.0 / max(power, 1e-12)
        unit = 0.01 * about.output_range
        found = []
        for what, row in (("gain", (1, None)), ("offset", (None, 1)), ("gain and offset", (1, 2))):
            n = sum(place is not None for place in row)

            def build(x: Array, row: tuple[int | None, int | None] = row) -> SelfHeating:
                gain, offset = (0.0 if place is None else float(x[place]) for place in row)
                return cls(
                    name="thermal", source="self_heating", time_constant=float(10.0 ** x[0]), heating=heating,
                    gain_per_degree=0.01 * gain, offset_per_degree=unit * offset,
                )  # fmt: skip

            start = np.append(high - 0.3 * (high - low), np.zeros(n))
            found.append(
                Candidate(
                    f"thermal, self-heating, {what}", np.append(low, np.full(n, -20.0)),
                    np.append(high, np.full(n, 20.0)), start, build, start,
                )
            )  # fmt: skip
        return found


def _kept(share: Array) -> Array:
    """Of the warmth and of the heat of each step, for steps in time constants; the next step's has no part in it."""
    return np.stack([np.exp(-share), -np.expm1(-share), np.zeros(len(share))])


SHAPES = (LoggedThermal, SelfHeating)
