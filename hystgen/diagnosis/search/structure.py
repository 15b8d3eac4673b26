"""The structure of a hypothesis: thresholds, a front and effects, with the shape numbers a fit may change."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.search.actuator import Actuator
from hystgen.effects.base import Candidate, Effect
from hystgen.identification.fronts import Front, Kept
from hystgen.identification.joint import DIFFERENCE

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Part:
    """An effect in a hypothesis: its catalogue name and the candidate whose numbers are fitted."""

    name: str
    candidate: Candidate


def kept(effect: Effect) -> Part:
    """An effect that stays as it is."""
    none = np.empty(0)
    return Part(effect.name, Candidate("as it is", none, none, none, lambda _: effect))


@dataclass(frozen=True)
class Structure:
    """Thresholds, a front and effects; its shape is the front's, then the numbers of each effect."""

    thresholds: Array
    front: Front
    parts: tuple[Part, ...] = ()

    @property
    def start(self) -> Array:
        """Where a search starts."""
        return np.concatenate([self.front.straight, *(part.candidate.start for part in self.parts)])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Least and largest value of every shape number."""
        low, high = self.front.bounds
        return (
            np.concatenate([low, *(part.candidate.low for part in self.parts)]),
            np.concatenate([high, *(part.candidate.high for part in self.parts)]),
        )

    def slack(self, shape: Array) -> Array:
        """Further constraints on a shape: numbers that must not be negative."""
        return self.front.slack(shape[: len(self.front.straight)])

    def pieces(self, shape: Array) -> tuple[Array, list[Array]]:
        """The front's shape and the numbers of each effect."""
        at = len(self.front.straight)
        found = []
        for part in self.parts:
            found.append(shape[at : at + len(part.candidate.start)])
            at += len(part.candidate.start)
        return shape[: len(self.front.straight)], found

    def effects(self, shape: Array) -> list[Effect]:
        """The effects, in the order of the parts."""
        return [part.candidate.build(numbers) for part, numbers in zip(self.parts, self.pieces(shape)[1], strict=True)]

    def held(self, shape: Array) -> Structure:
        """The same without free numbers: front and effects stay as a shape makes them."""
        front_shape, _ = self.pieces(shape)
        front = Kept(self.front.stages(front_shape), self.front.name)
        return replace(self, front=front, parts=tuple(map(kept, self.effects(shape))))

    def actuator(self, shape: Array) -> Actuator:
        """The actuator of a shape."""
        return Actuator(self.thresholds, self.front.stages(self.pieces(shape)[0]), tuple(self.effects(shape)))

    def varied(self, shape: Array, here: Actuator) -> list[Actuator]:
        """The actuators of a shape with each number in turn changed by `DIFFERENCE`; the rest is shared with `here`."""
        front, numbers = self.pieces(shape)
        ends = len(front) + np.cumsum([len(x) for x in numbers])

        def one(j: int) -> Actuator:
            other = shape.copy()
            other[j] += DIFFERENCE
            front_shape, changed = self.pieces(other)
            if j < len(front):
                return replace(here, stages=self.front.stages(front_shape), gains=dict(here.gains))
            k = int(np.searchsorted(ends, j, side="right"))
            effects = (*here.effects[:k], self.parts[k].candidate.build(changed[k]), *here.effects[k + 1 :])
            return replace(here, effects=effects, gains=dict(here.gains))

        return [one(j) for j in range(len(shape))]
