"""Records made for tests, their files read and written without the package, and plays by brute force."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml import YAML

from hystgen.records import Record

Array = NDArray[np.float64]


def brute_plays(v: Sequence[float] | Array, thresholds: Sequence[float], start: Sequence[float] | float) -> Array:
    """States of all plays after every sample, shape (N, n+1)."""
    states = [float(start)] * len(thresholds) if isinstance(start, int | float) else [float(s) for s in start]
    out = []
    for x in np.asarray(v, dtype=float).tolist():
        for i, r in enumerate(thresholds):
            if states[i] < x - r:
                states[i] = x - r
            elif states[i] > x + r:
                states[i] = x + r
        out.append(list(states))
    return np.array(out).reshape(-1, len(thresholds))


def brute_output(
    v: Array, thresholds: Sequence[float], weights: Sequence[float], start: Sequence[float] | float
) -> Array:
    return np.asarray(brute_plays(v, thresholds, start) @ np.asarray(weights))


def first_exact(v: Array, largest: float) -> int:
    """First sample from which plays up to a threshold depend on an unknown start only by a constant.

    That is once the drive has covered twice the threshold, or has been at both of its extremes.
    """
    low = high = v[0]
    for k, x in enumerate(v):
        low, high = min(low, x), max(high, x)
        if high - low >= 2.0 * largest or (low == v.min() and high == v.max()):
            return k
    raise AssertionError


def error_figures(y: Array, predicted: Array, first: int) -> tuple[float, float, float]:
    """rms and largest error with a free offset, and rms in % of the peak-to-peak output, all from sample `first`."""
    error = (y - predicted)[first:]
    error = error - error.sum() / len(error)
    rms = float(np.sqrt((error**2).sum() / len(error)))
    return rms, float(abs(error).max()), 100.0 * rms / float(y[first:].max() - y[first:].min())


def wander(seed: int, low: float = 0.0, high: float = 100.0, turns: int = 60, samples: int = 40) -> Array:
    """Straight lines between random drives."""
    places = np.random.default_rng(seed).uniform(low, high, turns)
    places[3], places[5] = low, high
    return np.interp(np.arange((turns - 1) * samples + 1) / samples, np.arange(turns), places)


def record(v: Array, y: Array, name: str = "made") -> Record:
    return Record(name, np.arange(len(v)) * 0.001, v, y, sample_time=0.001)


def noisy(y: Array, sigma: float, seed: int = 9) -> Array:
    return np.asarray(y + np.random.default_rng(seed).normal(0.0, sigma, len(y)))


def columns(path: Path) -> tuple[Array, Array, Array]:
    table = np.genfromtxt(path, delimiter=",", names=True)
    return table["t"], table["v"], table["y"]


def part_of_file(source: Path, target: Path, first: int, last: int | None = None) -> Path:
    """The header and some samples of a CSV file, copied as text."""
    header, *lines = source.read_text().splitlines()
    target.write_text("\n".join([header, *lines[first:last]]) + "\n")
    return target


def write_csv(path: Path, v: Any, y: Any) -> Path:
    lines = [f"{k * 0.001!r},{float(a)!r},{float(b)!r}" for k, (a, b) in enumerate(zip(v, y, strict=True))]
    path.write_text("\n".join(["t,v,y", *lines]) + "\n")
    return path


def written(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = YAML(typ="safe").load(path)
    return content
