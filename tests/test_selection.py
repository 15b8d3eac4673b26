"""What the search accepts, on made-up hypotheses of which the errors are known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from hystgen.diagnosis import selection

Array = NDArray[np.float64]

NOISE, HIDDEN = 0.02, 1.0


def missing(record: int, samples: int = 2000) -> Array:
    """What the effects leave where they are missing: slow against a sample."""
    return np.asarray(HIDDEN * np.sin(0.05 * np.arange(samples) + record))


class Hypothesis:
    """Effects that are in, and the error that they leave: a share of what is missing, and noise of its own colour."""

    def __init__(self, world: World, names: frozenset[str], left: float | None = None) -> None:
        self.world, self.names = world, names
        self.left = world.left.get(names, 1.0) if left is None else left
        self.shape = np.zeros(len(names))
        self.actuator = SimpleNamespace(nuisances=lambda _: np.ones((1, 1)))

    def errors(self, items: list[int], _: Any = None) -> list[Array]:
        noise = [np.random.default_rng([item, *map(ord, sorted(self.names))]) for item in items]
        return [
            self.left * missing(item) + self.world.colour(random) for item, random in zip(items, noise, strict=True)
        ]


class World:
    """Which hypotheses there are, and how much of what is missing each leaves; those not told leave everything."""

    to_fit, held, noise = (0, 1, 2), (3, 4, 5), NOISE

    def __init__(self, left: dict[frozenset[str], float], names: str, memory: float = 0.0) -> None:
        self.left, self.all, self.memory = left, names, memory

    def colour(self, random: np.random.Generator, samples: int = 2000) -> Array:
        white, noise = random.normal(0.0, NOISE * np.sqrt(1.0 - self.memory**2), samples), np.zeros(samples)
        for k in range(1, samples):
            noise[k] = self.memory * noise[k - 1] + white[k]
        return noise

    def tried(self, now: Hypothesis, name: str) -> Any:
        extended = Hypothesis(self, now.names | {name})
        errors = extended.errors(list(self.held))
        option: Any = SimpleNamespace(label=name, name=name)
        rms = float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
        return selection.Tried(option, extended, (name,), rms, errors)

    def extensions(self, now: Hypothesis, _: Any = ()) -> list[Any]:
        found = [self.tried(now, name) for name in self.all if name not in now.names]
        return sorted(found, key=lambda each: each.held_out)

    def gap(self, now: Hypothesis) -> float:
        return float(np.sqrt(np.mean(np.concatenate(now.errors(list(self.held))) ** 2)))


def together(world: World, monkeypatch: pytest.MonkeyPatch, alone: dict[str, float] | None = None) -> list[str]:
    """Names of the two that are found; `alone`: what an effect leaves when it is sought from where both are."""

    def without(now: Hypothesis, name: str, _: Any) -> Hypothesis:
        (rest,) = now.names - {name}
        return Hypothesis(world, frozenset(rest), (alone or {}).get(rest))

    monkeypatch.setattr(selection, "_without", without)
    records: Any = SimpleNamespace(
        to_fit=world.to_fit, held=world.held, noise=NOISE, extensions=world.extensions, left=world.gap
    )
    now: Any = Hypothesis(world, frozenset())
    failed = selection._step(now, world.gap(now), records)
    assert failed is not None
    assert failed.merit is None
    both = selection._together(failed, world.gap(now), records)
    if both is None:
        return []
    first, step = both
    assert first.before == world.gap(now)
    assert first.after <= first.before
    return sorted([first.name, step.best.name])


BOTH = {frozenset("a"): 0.95, frozenset("ab"): 0.02}


def test_effects_that_hide_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither is enough for a name without the other, both leave noise; a third one changes hardly anything."""
    assert together(World({**BOTH, frozenset("c"): 0.9}, "abc"), monkeypatch) == ["a", "b"]


def test_an_effect_that_needs_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sought from where both are, one does as well alone: the search had merely not found it."""
    assert together(World(BOTH, "ab"), monkeypatch, {"a": 0.021, "b": 0.021}) == []


@pytest.mark.parametrize("left", [0.0, 1.0])
@pytest.mark.parametrize("memory", [0.0, 0.9, 0.99])
def test_chance_makes_no_pair(left: float, memory: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every hypothesis leaves the same, be it noise of any colour or a disturbance that none explains."""
    names = "abcdef"
    same = {frozenset(a + b): left for a in names for b in names} | {frozenset(): left}
    assert together(World(same, names, memory), monkeypatch) == []
