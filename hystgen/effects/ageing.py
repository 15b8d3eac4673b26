"""Gain that falls with the distance travelled."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from hystgen.effects.base import About, Array, Candidate, Compensated, Effect, Place, Run
from hystgen.param_models import Number, Positive


class _Ageing(Effect):
    name: Literal["ageing"] = Field(description="name of the effect")

    place: ClassVar[Place] = Place.GAIN
    compensated: ClassVar[Compensated] = "needs a sensor"
    compensation: ClassVar[str] = "a gain input to `step`"
    timed: ClassVar[bool] = False

    @classmethod
    def _candidate(cls, label: str, about: About) -> Candidate:
        total = max(about.travel, 1e-12)

        def build(x: Array) -> Effect:
            shape = cls.model_fields["shape"].annotation.__args__[0]  # type: ignore[union-attr]
            return cls(  # type: ignore[call-arg]
                name="ageing", shape=shape, loss=0.1 * float(x[0]), travel=total * float(10.0 ** x[1])
            )

        start = np.array([0.1, -0.7])
        none, others = np.array([0.0, -0.7]), (np.array([0.1, -2.0]), np.array([0.1, 0.5]))
        return Candidate(label, np.array([-5.0, -3.0]), np.array([5.0, 1.0]), start, build, none, others)


class LogarithmicAgeing(_Ageing):
    """Gain `1 - loss log10(1 + D/travel)`, D the distance travelled since the start of the session.

    The logarithmic law of depolarisation, which data sheets quote a decade, over travel in place of time.
    """

    shape: Literal["logarithmic"] = Field(default="logarithmic", description="loss a decade of travel")
    loss: Number = Field(description="share lost a decade of travel", examples=[0.01])
    travel: Positive = Field(description="travel from which decades count, input units", examples=[1.0e4])

    def gain(self, run: Run) -> Array:
        """The falling gain."""
        return np.asarray(1.0 - self.loss * run.remembered(("decades", self.travel), lambda: self._decades(run)))

    def _decades(self, run: Run) -> Array:
        """Decades of travel; a search changes the loss more often than the travel."""
        with np.errstate(over="ignore"):
            return np.asarray(np.log10(1.0 + np.minimum(run.travelled / self.travel, 1e300)))

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """Loss and travel, the travel from a thousandth of the recorded one to ten."""
        return [cls._candidate("ageing, logarithmic", about)]


class ExponentialAgeing(_Ageing):
    """Gain `1 - loss (1 - exp(-D/travel))`, D the distance travelled since the start of the session."""

    shape: Literal["exponential"] = Field(description="loss that comes to an end")
    loss: Number = Field(description="share lost in the end", examples=[0.05])
    travel: Positive = Field(description="travel after which 63 % is lost, input units", examples=[1.0e4])

    def gain(self, run: Run) -> Array:
        """The falling gain."""
        worn = run.remembered(("worn", self.travel), lambda: np.asarray(np.expm1(-run.travelled / self.travel)))
        return np.asarray(1.0 + self.loss * worn)

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """Loss and travel, the travel from a thousandth of the recorded one to ten."""
        return [cls._candidate("ageing, exponential", about)]


SHAPES = (LogarithmicAgeing, ExponentialAgeing)
