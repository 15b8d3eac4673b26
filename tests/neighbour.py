"""A user's own effect without a compensator: the offset caused by a neighbour heated in a duty cycle."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from hystgen.effects import About, Candidate, Effect, Place, Run


class Neighbour(Effect):
    """Offset `amplitude (1 - cos(2 pi t/period))/2` over session time."""

    name: Literal["user:neighbour"] = Field(description="name of the effect")
    amplitude: float = Field(description="largest offset, output units", allow_inf_nan=False)
    period: Annotated[float, Field(gt=0, allow_inf_nan=False)] = Field(description="period of the duty cycle, s")

    place: ClassVar[Place] = Place.ADDED
    compensation: ClassVar[str] = "subtract it from the reference"

    def added(self, run: Run) -> np.ndarray:
        """The offset at every sample."""
        return 0.5 * self.amplitude * (1.0 - np.cos(2.0 * np.pi * run.t / self.period))

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """Amplitude in hundredths of the output range, period from a tenth of the session to ten sessions."""
        unit, last = 0.01 * about.output_range, np.log10(about.session)

        def build(x: np.ndarray) -> Neighbour:
            return cls(name="user:neighbour", amplitude=unit * float(x[0]), period=float(10.0 ** x[1]))

        low, high, start = np.array([-20.0, last - 1.0]), np.array([20.0, last + 1.0]), np.array([1.0, last])
        # A search finds the period only from a start close to it: one start every 12 %
        others = tuple(np.array([1.0, last + shift]) for shift in np.arange(-1.0, 1.0, 0.05))
        none = np.array([0.0, last])
        return [Candidate("user:neighbour", low, high, start, build, none, others, amounts=(0,))]
