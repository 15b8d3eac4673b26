"""The catalogue's effects derived from physics: how each is drawn for a bench, and how it acts on the fine grid.

`strength` scales an effect; at 0 it does nothing. `values` are its physical parameters, which the label records.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..bench import Bench

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Effect:
    """One effect of a plant: its catalogue name, and its physical form here."""

    name: str
    form: str
    strength: float
    values: Mapping[str, float]

    def scaled(self, factor: float) -> Effect:
        return replace(self, strength=self.strength * factor)


@dataclass(frozen=True)
class Surroundings:
    """Inputs of an effect: fine time and steps [s], drive [input], temperature [degC], the bench.

    Strengths of effects that accumulate refer to the end of the session, or of `first` if the plant went through it.
    """

    t: Array
    dt: Array
    drive: Array
    temperature: Array
    bench: Bench
    first: Surroundings | None = None

    @property
    def scale(self) -> Surroundings:
        return self.first or self


Draw = Callable[[np.random.Generator, Bench], Effect]


@dataclass(frozen=True)
class Kind:
    """How an effect is drawn, the `benches` that can show it, and its `family`: two of one family look alike and never
    make a pair."""

    draw: Draw
    benches: tuple[str, ...]
    family: str


def catalogue() -> dict[str, Kind]:
    """All kinds by catalogue name, in the order of the chain from the drive to the output."""
    from . import drive_side, memory, output_side, slow

    kinds: dict[str, Kind] = {}
    for module in (drive_side, memory, slow, output_side):
        kinds.update(module.KINDS)
    return kinds


def pick(rng: np.random.Generator, *names: str) -> str:
    return names[int(rng.integers(len(names)))]


def between(rng: np.random.Generator, low: float, high: float) -> float:
    """A log-uniform random number."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def values(**numbers: Any) -> dict[str, float]:
    return {key: float(x) for key, x in numbers.items()}
