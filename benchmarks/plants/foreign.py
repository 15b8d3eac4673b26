"""Disturbances and faults that are not effects of an actuator."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scene:
    """Samples of a record: session time [s], drive, noise-free output; noise rms, step and span of the output."""

    t: Array
    v: Array
    y: Array
    noise: float
    span_out: float


Fault = Callable[[np.random.Generator, list[Scene], list[Array], list[Array]], dict[str, float]]
"""Function that changes the measured columns v and y in place and returns the fault's parameters for the label."""


def hum(rng: np.random.Generator, scenes: list[Scene], v: list[Array], y: list[Array]) -> dict[str, float]:
    mains = 50.0 if rng.uniform() < 0.7 else 60.0
    size, phase = scenes[0].noise * _between(rng, 4.0, 15.0), rng.uniform(0.0, 6.0)
    third = rng.uniform(0.0, 0.4)
    for scene, seen in zip(scenes, y, strict=True):
        turn = 2.0 * math.pi * mains * scene.t + phase
        seen += size * (np.sin(turn) + third * np.sin(3.0 * turn))
    return {"frequency": mains, "amplitude": size}


def glitches(rng: np.random.Generator, scenes: list[Scene], v: list[Array], y: list[Array]) -> dict[str, float]:
    size = scenes[0].noise * _between(rng, 30.0, 300.0)
    number = 0
    for seen in y:
        rows = rng.choice(len(seen), int(rng.integers(2, 9)), replace=False)
        seen[rows] += size * rng.choice([-1.0, 1.0], len(rows)) * rng.uniform(0.5, 1.5, len(rows))
        number += len(rows)
    return {"samples": number, "size": size}


def dropouts(rng: np.random.Generator, scenes: list[Scene], v: list[Array], y: list[Array]) -> dict[str, float]:
    level = float(min(scene.y.min() for scene in scenes)) - 0.05 * scenes[0].span_out
    return {"samples": _runs(rng, y, lambda part: np.full(len(part), level), (3, 25)), "level": level}


def held_samples(rng: np.random.Generator, scenes: list[Scene], v: list[Array], y: list[Array]) -> dict[str, float]:
    return {"samples": _runs(rng, y, lambda part: np.full(len(part), part[0]), (10, 50))}


def stick_slip(rng: np.random.Generator, scenes: list[Scene], v: list[Array], y: list[Array]) -> dict[str, float]:
    """A guide that sticks until the actuator is some distance ahead, different each time, and then jumps after it."""
    size = scenes[0].noise * _between(rng, 8.0, 30.0)
    jumps = 0
    for scene, seen in zip(scenes, y, strict=True):
        place, limit = scene.y[0], size
        for k in range(len(seen)):
            if abs(scene.y[k] - place) > limit:
                place, limit = scene.y[k], size * rng.uniform(0.2, 1.8)
                jumps += 1
            seen[k] += place - scene.y[k]
    return {"jumps": jumps, "distance": size}


def ripple(rng: np.random.Generator, scenes: list[Scene], v: list[Array], y: list[Array]) -> dict[str, float]:
    """Interpolation error of a fringe or grating sensor."""
    size, phase = scenes[0].noise * _between(rng, 4.0, 15.0), rng.uniform(0.0, 6.0)
    pitch = scenes[0].span_out / rng.uniform(15.0, 40.0)
    for scene, seen in zip(scenes, y, strict=True):
        seen += size * np.sin(2.0 * math.pi * scene.y / pitch + phase)
    return {"pitch": pitch, "amplitude": size}


def full_scale(rng: np.random.Generator, scenes: list[Scene], v: list[Array], y: list[Array]) -> dict[str, float]:
    """A converter at its last code: every sample beyond it reads exactly that value."""
    top = float(max(scene.y.max() for scene in scenes)) - scenes[0].span_out * rng.uniform(0.03, 0.15)
    for seen in y:
        np.minimum(seen, top, out=seen)
    return {"level": top}


def units_one(rng: np.random.Generator, scenes: list[Scene], v: list[Array], y: list[Array]) -> dict[str, float]:
    """One record in other units or at another gain setting of the sensor."""
    factor = _one_of(rng, 1000.0, 0.001, 25.4, 10.0, 0.5, 2.0)
    record = int(rng.integers(len(y)))
    y[record] *= factor
    return {"record": record, "factor": factor}


def units_all(rng: np.random.Generator, scenes: list[Scene], v: list[Array], y: list[Array]) -> dict[str, float]:
    """Every record in other units than those of the nominal model."""
    factor = _one_of(rng, 1000.0, 0.001, 25.4, 0.1)
    for seen in y:
        seen *= factor
    return {"factor": factor}


def swapped(rng: np.random.Generator, scenes: list[Scene], v: list[Array], y: list[Array]) -> dict[str, float]:
    """The columns of drive and displacement exchanged, in one record or in all."""
    record = int(rng.integers(-1, len(y)))
    for k in range(len(y)):
        if record in (-1, k):
            v[k], y[k] = y[k], v[k]
    return {"record": record}


FAULTS: dict[str, Fault] = {
    "hum": hum,
    "glitches": glitches,
    "dropouts": dropouts,
    "held_samples": held_samples,
    "stick_slip": stick_slip,
    "ripple": ripple,
    "full_scale": full_scale,
    "units_one": units_one,
    "units_all": units_all,
    "swapped": swapped,
}


def _runs(
    rng: np.random.Generator, y: list[Array], replaced: Callable[[Array], Array], length: tuple[int, int]
) -> int:
    number = 0
    for seen in y:
        for _ in range(int(rng.integers(1, 5))):
            size = int(rng.integers(*length))
            first = int(rng.integers(10, len(seen) - size))
            seen[first : first + size] = replaced(seen[first : first + size])
            number += size
    return number


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def _one_of(rng: np.random.Generator, *choices: float) -> float:
    return choices[int(rng.integers(len(choices)))]
