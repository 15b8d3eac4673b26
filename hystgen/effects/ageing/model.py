"""Gain that falls with the distance travelled."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from hystgen.basics.quantities import Number, Positive
from hystgen.effects.base import About, Array, Candidate, Compensated, Effect, Place, Problem, Run, not_as_many

EXPONENTIAL = "ageing, exponential"

LEAST, MOST, APART = -3.0, 1.0, 0.6
"""[decimal logarithms of travels relative to the recorded travel] Bounds of a search, and half the distance between two
starting points. A thousandth of the travel is two sweeps of a recording of 2000; at ten times the travel, only a tenth
of an exponential loss is seen, which is a straight line to within 5 % and does not determine loss and travel. Two
travels start a factor of 16 apart, well inside the four decades. Changed by: blind single (ageing)."""


class _Ageing(Effect):
    name: Literal["ageing"] = Field(description="name of the effect")

    place: ClassVar[Place] = Place.GAIN
    shown_by: ClassVar[Mapping[str, int]] = {"cycles": 1, "slow_again": 2}
    compensated: ClassVar[Compensated] = "exact"
    compensation: ClassVar[str] = "exact, from the distance that the drive has travelled"
    timed: ClassVar[bool] = False
    forgets: ClassVar[bool] = False

    @classmethod
    def _candidate(cls, label: str, about: About) -> Candidate:
        """Only a loss: if the gain rises with travel, the cause is something else, such as the room's temperature."""
        total = max(about.travel, 1e-12)

        def build(x: Array) -> Effect:
            shape = cls.model_fields["shape"].annotation.__args__[0]  # type: ignore[union-attr]
            return cls(  # type: ignore[call-arg]
                name="ageing", shape=shape, loss=0.1 * float(x[0]), travel=total * float(10.0 ** x[1])
            )

        start = np.array([0.1, -0.7])
        none, others = np.array([0.0, -0.7]), (np.array([0.1, -2.0]), np.array([0.1, 0.5]))
        return Candidate(label, np.array([0.0, LEAST]), np.array([5.0, MOST]), start, build, none, others)


class LogarithmicAgeing(_Ageing):
    """Gain `1 - loss log10(1 + D/travel)`, D the distance travelled since the start of the session.

    The logarithmic law of depolarisation, which data sheets quote per decade, but over travel instead of time.
    """

    shape: Literal["logarithmic"] = Field(default="logarithmic", description="loss per decade of travel")
    loss: Number = Field(description="fraction lost per decade of travel", examples=[0.01])
    travel: Positive = Field(description="scale of the travel D in log10(1 + D/travel), input units", examples=[1.0e4])

    def gain(self, run: Run) -> Array:
        """The decreasing gain."""
        return np.asarray(1.0 - self.loss * run.remembered(("decades", self.travel), lambda: self._decades(run)))

    def _decades(self, run: Run) -> Array:
        """Decades of travel, cached: a search changes the loss more often than the travel."""
        with np.errstate(over="ignore"):
            return np.asarray(np.log10(1.0 + np.minimum(run.travelled / self.travel, 1e300)))

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """Loss and travel; the travel between a thousandth and ten times the recorded travel."""
        return [cls._candidate("ageing, logarithmic", about)]


class ExponentialAgeing(_Ageing):
    """Gain `1 - loss (1 - exp(-D/travel))`, D the distance travelled since the start of the session."""

    shape: Literal["exponential"] = Field(description="loss that levels off")
    loss: Number = Field(description="fraction lost in the end", examples=[0.05])
    travel: Positive = Field(description="travel after which 63 % is lost, input units", examples=[1.0e4])

    def gain(self, run: Run) -> Array:
        """The decreasing gain."""
        return np.asarray(1.0 + self.loss * _worn(run, self.travel))

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """Loss and travel; the travel between a thousandth and ten times the recorded travel."""
        return [cls._candidate(EXPONENTIAL, about)]


class SeveralAgeing(_Ageing):
    """Gain `1 - sum loss_i (1 - exp(-D/travel_i))`: losses that level off at different distances, like wear at several
    speeds.

    Two losses can follow laws between the exponential and the logarithmic one, which spreads over decades of travel.
    """

    shape: Literal["exponentials"] = Field(description="losses that level off at several distances")
    losses: Annotated[tuple[Number, ...], Field(min_length=1, max_length=16)] = Field(
        description="fractions lost in the end", examples=[[0.02, 0.03]]
    )
    travels: Annotated[tuple[Positive, ...], Field(min_length=1, max_length=16)] = Field(
        description="travels after which 63 % of each is lost, input units", examples=[[1.0e3, 1.0e4]]
    )

    def problems(self, thresholds: tuple[float, ...] | None) -> Iterator[Problem]:
        """A problem unless there is one loss for each travel."""
        yield from not_as_many("losses", self.losses, "travels", self.travels)

    def gain(self, run: Run) -> Array:
        """The decreasing gain."""
        total = np.ones(len(run.t))
        for loss, travel in zip(self.losses, self.travels, strict=True):
            total += loss * _worn(run, travel)
        return total

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """Two losses and travels, tried if a single exponential explains part of the error."""
        total = max(about.travel, 1e-12)

        def build(x: Array) -> SeveralAgeing:
            return cls(
                name="ageing", shape="exponentials", losses=tuple((0.1 * x[:2]).tolist()),
                travels=tuple((total * 10.0 ** x[2:]).tolist()),
            )

        def grown(one: Array) -> Array:
            loss, travel = one
            return np.array([0.5 * loss, 0.5 * loss, max(travel - APART, LEAST), min(travel + APART, MOST)])

        low, high = np.array([0.0, 0.0, LEAST, LEAST]), np.array([5.0, 5.0, MOST, MOST])
        start = np.array([0.1, 0.1, -2.0, 0.0])
        none = np.array([0.0, 0.0, -2.0, 0.0])
        return [Candidate("ageing, two exponentials", low, high, start, build, none, (), EXPONENTIAL, grown)]


def _worn(run: Run, travel: float) -> Array:
    """`exp(-D/travel) - 1`, cached: a search changes the loss more often than the travel."""
    return run.remembered(("worn", travel), lambda: np.asarray(np.expm1(-run.travelled / travel)))


SHAPES = (LogarithmicAgeing, ExponentialAgeing, SeveralAgeing)
