"""Drive waveforms on a fine time grid, from 0 to 1 over the drive range, beginning at a given value.

Edges of steps last some samples, so that a record resolves them, and no waveform jumps.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Drive = Callable[[np.random.Generator, Array, float, float], Array]
"""Function of a random generator, the time in the record from 0 to 1, the start value, and the time that a sample takes
on that scale."""


def path(t: Array, sample: float, points: list[tuple[float, float]]) -> Array:
    """A piecewise linear drive through (relative duration, value), with durations scaled to fill the record.

    Corners lie in the middle of a sample, as with a generator that shares the converters' clock.
    """
    durations = np.array([d for d, _ in points])
    times = np.concatenate(([0.0], np.cumsum(durations[1:])))
    corners = (np.round(times / times[-1] / sample) + 0.5) * sample
    return np.interp(t, corners, [x for _, x in points])


def _swings(start: float, turns: list[float], pace: float = 0.0) -> list[tuple[float, float]]:
    """Points of a path through `turns` at constant speed."""
    points = [(0.0, start)]
    for turn in turns:
        points.append((max(abs(turn - points[-1][1]), 1e-3), turn))
    if pace:
        points.append((pace, points[-1][1]))
    return points


def triangle(cycles: tuple[float, float]) -> Drive:
    def drive(rng: np.random.Generator, t: Array, start: float, sample: float) -> Array:
        number = round(rng.uniform(*cycles))
        top, bottom = rng.uniform(0.9, 1.0), rng.uniform(0.0, 0.1)
        return path(t, sample, _swings(start, [top, bottom] * number, 0.1))

    return drive


def nested(rng: np.random.Generator, t: Array, start: float, sample: float) -> Array:
    number = int(rng.integers(5, 9))
    middle = rng.uniform(0.4, 0.6)
    turns: list[float] = []
    for k in range(number):
        half = 0.5 * (1.0 - k / number)
        turns += [min(middle + half, 1.0), max(middle - half, 0.0)]
    return path(t, sample, _swings(start, [*turns, middle]))


def minor_loops(rng: np.random.Generator, t: Array, start: float, sample: float) -> Array:
    size = rng.uniform(0.15, 0.3)
    turns = [1.0, 0.0]
    for bias in (0.03, 0.5 - 0.5 * size, 0.97 - size):
        turns += [bias + size, bias] * 3
    turns += [1.0, 0.5, 0.5 + size, 0.5, 0.5 + size, 0.0]
    return path(t, sample, _swings(start, turns))


def holds(rng: np.random.Generator, t: Array, start: float, sample: float) -> Array:
    levels = [1.0, 0.0, rng.uniform(0.35, 0.65), rng.uniform(0.8, 0.95), rng.uniform(0.05, 0.3), start]
    edge = rng.uniform(3.0, 7.0) * sample
    points = [(0.0, start), (0.02, start)]
    for level in levels:
        points += [(edge, level), (rng.uniform(0.10, 0.22), level)]
    return path(t, sample, points)


def staircase(rng: np.random.Generator, t: Array, start: float, sample: float) -> Array:
    points = [(0.0, start), (0.02, start)]
    levels = rng.uniform(0.1, 0.9, 5).tolist()
    first = int(rng.integers(3))
    # one full-scale step down and one up, among smaller ones
    levels[first:first] = [1.0, 0.0, 0.97]
    for k, level in enumerate(levels):
        full = first < k < first + 3
        edge = rng.uniform(3.0, 8.0) * sample if full or rng.uniform() < 0.6 else rng.uniform(0.01, 0.03)
        points += [(edge, level), (rng.uniform(0.04, 0.16), level)]
    return path(t, sample, points)


def reversals(rng: np.random.Generator, t: Array, start: float, sample: float) -> Array:
    """Random turning points at random speeds; both ends are visited early."""
    number = int(rng.integers(14, 24))
    turns = np.concatenate(([1.0, 0.0], rng.uniform(0.02, 0.98, number)))
    points = [(0.0, start)]
    for turn in turns:
        distance = max(abs(float(turn) - points[-1][1]), 0.02)
        points.append((distance / math.exp(rng.uniform(-1.0, 1.0)), float(turn)))
        if rng.uniform() < 0.2:
            points.append((0.15, float(turn)))
    return path(t, sample, points)


def _approach(t: Array, wave: Array, start: float) -> Array:
    """Go smoothly from `start` to the wave within the first 4 % of the record."""
    x = np.clip(t / 0.04, 0.0, 1.0)
    ease = x * x * (3.0 - 2.0 * x)
    return start + ease * (wave - start)


def sweep(rng: np.random.Generator, t: Array, start: float, sample: float) -> Array:
    first, last = rng.uniform(2.0, 4.0), rng.uniform(20.0, 32.0)
    ratio = last / first
    phase = 2.0 * math.pi * first * (ratio**t - 1.0) / math.log(ratio)
    size = rng.uniform(0.35, 0.5)
    return _approach(t, 0.5 - size * np.cos(phase), start)


def multisine(highest: tuple[int, int]) -> Drive:
    def drive(rng: np.random.Generator, t: Array, start: float, sample: float) -> Array:
        top = int(rng.integers(*highest))
        lines = np.arange(1, top + 1, 2)
        sizes = 1.0 / np.sqrt(lines) if rng.uniform() < 0.5 else np.ones(len(lines))
        phases = rng.uniform(0.0, 2.0 * math.pi, len(lines))
        wave = np.zeros_like(t)
        for line, size, phase in zip(lines.tolist(), sizes.tolist(), phases.tolist(), strict=True):
            wave += size * np.cos(2.0 * math.pi * line * t + phase)
        low, high = float(wave.min()), float(wave.max())
        return _approach(t, (wave - low) / (high - low), start)

    return drive


def repeated(rng: np.random.Generator, t: Array, start: float, sample: float) -> Array:
    """A whole number of equal periods with harmonics, for a noise floor without a model."""
    number = int(rng.integers(4, 7))
    x = number * t
    wave = np.cos(2 * math.pi * x) + 0.4 * np.cos(6 * math.pi * x + rng.uniform(0, 6))
    wave += 0.25 * np.cos(10 * math.pi * x + rng.uniform(0, 6))
    low, high = float(wave.min()), float(wave.max())
    return _approach(t, (wave - low) / (high - low), start)


def fading(rng: np.random.Generator, t: Array, start: float, sample: float) -> Array:
    number = rng.uniform(6.0, 14.0)
    wave = 0.5 + 0.5 * np.exp(-rng.uniform(1.0, 2.5) * t) * np.sin(2.0 * math.pi * number * t)
    return _approach(t, wave, start)


def sine(cycles: float, size: float = 0.5) -> Drive:
    def drive(rng: np.random.Generator, t: Array, start: float, sample: float) -> Array:
        return _approach(t, 0.5 - size * np.cos(2.0 * math.pi * cycles * t), start)

    return drive


FIT: dict[str, Drive] = {
    "slow": triangle((2.0, 3.0)),
    "holds": holds,
    "minor": minor_loops,
    "fast": triangle((7.0, 11.0)),
    "nested": nested,
    "sweep": sweep,
    "multisine": multisine((11, 30)),
    "repeated": repeated,
}
"""Waveforms to fit, the most important ones first."""

HELD_OUT: dict[str, Drive] = {
    "staircase": staircase,
    "reversals": reversals,
    "fading": fading,
    "multisine": multisine((9, 25)),
}
"""Waveforms of held-out records."""
