"""Made-up hypotheses, drives and results with known answers, for tests of the diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.findings.kinds import Finding, Structured
from hystgen.diagnosis.findings.result import FitErrors, Gap, Inverse, NamedEffect, Result
from hystgen.diagnosis.search import screening, selection
from hystgen.effects.base import Run

Array = NDArray[np.float64]

NOISE, HIDDEN = 0.02, 1.0


def missing(record: int, samples: int = 2000) -> Array:
    """Error of a record without any effect; it varies slowly from sample to sample."""
    return np.asarray(HIDDEN * np.sin(0.05 * np.arange(samples) + record))


class Hypothesis:
    """A set of effects and the error it leaves: a share of `missing`, plus the world's noise."""

    def __init__(self, world: World, names: frozenset[str], left: float | None = None) -> None:
        self.world, self.names = world, names
        self.left = world.left.get(names, 1.0) if left is None else left
        self.shape, self.weights = np.zeros(len(names)), np.zeros(0)
        ends = self.shape - 1.0, self.shape + 1.0
        self.structure = SimpleNamespace(bounds=ends, parts=(), front=None, effects=lambda _: ())
        self.bare = not names
        self.actuator = SimpleNamespace(nuisances=lambda _: np.ones((1, 1)))

    @property
    def rms(self) -> float:
        return self.world.rms(self.errors(list(self.world.to_fit)))

    def errors(self, items: list[int], _: Any = None) -> list[Array]:
        noise = [np.random.default_rng([item, *map(ord, sorted(self.names))]) for item in items]
        return [
            self.left * missing(item) + self.world.colour(random)
            for item, random in zip(items, noise, strict=True)
        ]


class World:
    """The share of `missing` that each set of effects leaves; sets that are not listed leave all of it."""

    to_fit, held, noise = (0, 1, 2), (3, 4, 5), NOISE
    one_loop = one_speed = False

    def __init__(self, left: dict[frozenset[str], float], names: str, memory: float = 0.0) -> None:
        self.left, self.all, self.memory = left, names, memory

    def colour(self, random: np.random.Generator, samples: int = 2000) -> Array:
        white = random.normal(0.0, NOISE * np.sqrt(1.0 - self.memory**2), samples)
        white[0] = 0.0
        return np.asarray(lfilter([1.0], [1.0, -self.memory], white))

    def tried(self, now: Hypothesis, name: str) -> Any:
        extended = Hypothesis(self, now.names | {name})
        errors = extended.errors(list(self.held))
        option: Any = SimpleNamespace(label=name, name=name)
        return screening.Tried(option, extended, (name,), self.rms(errors), errors)

    def extensions(self, now: Hypothesis, worth: Any = None) -> list[Any]:
        found = [self.tried(now, name) for name in self.all if name not in now.names]
        found = [each for each in found if worth is None or worth(each.option)]
        return sorted(found, key=lambda each: each.held_out)

    def gap(self, now: Hypothesis) -> float:
        return self.rms(now.errors(list(self.held)))

    @staticmethod
    def rms(errors: list[Array]) -> float:
        return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))

    @property
    def records(self) -> Any:
        return SimpleNamespace(
            to_fit=self.to_fit, held=self.held, noise=NOISE, gap=HIDDEN / np.sqrt(2.0), extensions=self.extensions,
            residual=self.gap, quick=self.to_fit, full=self.to_fit, one_loop=self.one_loop, one_speed=self.one_speed,
            compared=1.0, terms=lambda now, _: [now], at_rest=lambda *_: [],
        )  # fmt: skip


TO_FIT, HELD = (0, 1, 2, 3), (4, 5, 6)

RECORDS: Any = SimpleNamespace(
    to_fit=TO_FIT, held=HELD, noise=NOISE, one_loop=False, compared=1.0, terms=lambda now, _: [now],
    at_rest=lambda *_: [],
)  # fmt: skip
"""Records of which only the errors left by each option are known."""


class Made:
    """An option with the errors it leaves of fitted and of held-out records.

    `on_equal_terms`: errors with the other option's free terms; `most`: whether its amount is at its upper bound;
    `levels_off`: as in a candidate."""

    def __init__(
        self,
        name: str,
        free: int,
        left: tuple[float, float],
        on_equal_terms: tuple[float, float] | None = None,
        most: bool = False,
        levels_off: tuple[int, float] | None = None,
    ) -> None:
        self.name, self.left, self.on_equal_terms, self.shape = name, left, on_equal_terms or left, np.zeros(2)
        self.rms = left[0]
        amount = SimpleNamespace(
            low=np.full(2, -1.0), high=np.full(2, 0.0 if most else 1.0), amounts=(1,), levels_off=levels_off
        )
        self.structure = SimpleNamespace(
            bounds=(np.full(2, -1.0), np.full(2, 1.0)),
            parts=(SimpleNamespace(candidate=amount, ordinary=amount, known=False),),
            front=None,
            effects=lambda _: (),
            pieces=lambda shape: (np.empty(0), [shape]),
        )
        self.bare = True
        self.actuator = SimpleNamespace(nuisances=lambda _: np.ones((free, 1)))

    def errors(self, items: Sequence[int], like: Any = None) -> list[Array]:
        random = np.random.default_rng(0)
        share = self.left if like is None or like is self else self.on_equal_terms
        return [share[item in HELD] * random.normal(size=2000) for item in items]


def first_of(best: Made, other: Made, effect: str | None = None) -> str:
    """Name of the option that is taken; `effect`: the effect that both are shapes of, if any."""
    tried: list[Any] = [
        screening.Tried(SimpleNamespace(name=made.name), made, (effect or made.name,), made.left[1], made.errors(HELD))  # type: ignore[arg-type]
        for made in (best, other)
    ]
    first: Any = selection.simplest_first(tried, RECORDS)[0].fitted
    return str(first.name)


def result(
    verdict: str,
    names: Sequence[str],
    after: float,
    unexplained: Sequence[Finding],
    rivals: Sequence[tuple[str, str]] = (),
) -> Result:
    """A result with a refitted error of 0.5 um and noise of 0.02 um."""
    gap = Gap(FitErrors(0.5, 0.5), FitErrors(0.5, 0.5), FitErrors(after, after))
    effects = tuple(NamedEffect(name, {}, {}, 0.5, 0.5, after, 0.0, "") for name in names)
    inverse = Inverse(True, ())
    return Result(verdict, 0.02, 10.0, "um", gap, effects, tuple(unexplained), (), tuple(rivals), (), (), inverse)


STRUCTURE = Structured(0.05, 2.5, None, {}, None, None, None, None, ())


def sweep(*ends: float, seconds: float = 1.0, noise: float = 0.0) -> Item:
    """Straight moves between these drives, 200 samples each."""
    v = np.interp(np.arange(200 * (len(ends) - 1) + 1) / 200, np.arange(len(ends)), ends)
    v = v + np.random.default_rng(1).normal(0.0, noise, len(v))
    run = Run(np.arange(len(v)) * seconds / 200, v)
    return Item("made", run, v, None, 10.0)
