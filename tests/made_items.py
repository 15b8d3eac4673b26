"""Made-up records, drives and errors for tests of the diagnosis."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from hystgen.diagnosis.data.items import Item
from hystgen.effects.base import Run

Array = NDArray[np.float64]


def smooth(seed: int, samples: int = 2000) -> Array:
    """A smooth random drive of unit variance and zero mean."""
    decay = float(np.exp(-1.0 / 20.0))
    x = lfilter([1.0], [1.0, -2.0 * decay, decay**2], np.random.default_rng(seed).normal(size=samples + 200))[200:]
    return np.asarray((x - np.mean(x)) / np.std(x))


def tone(frequency: float, samples: int, size: Any = 1.0, step: float = 1e-3) -> Array:
    return np.asarray(size * np.sin(2.0 * np.pi * frequency * step * np.arange(samples) + 0.3))


def hiss(samples: int, seed: int = 0) -> Array:
    """White noise of unit variance."""
    return np.random.default_rng(seed).normal(size=samples)


def of_share(share: float) -> float:
    """Amplitude of a tone that, added to unit white noise, has this share of the total variance."""
    return float(np.sqrt(2.0 * share / (1.0 - share)))


def driven(v: Array, step: float = 1e-3, name: str = "r") -> Item:
    """A record whose output is a tenth of its drive."""
    return Item(name, Run(np.arange(len(v)) * step, v), 0.1 * v, None, 10.0)


def ramp(samples: int, step: float = 1e-3, name: str = "r") -> Item:
    """A record whose drive, a straight ramp, has no spectral lines."""
    return driven(np.linspace(0.0, 100.0, samples), step, name)


def sine(samples: int, seed: int = 0, history: tuple[float, ...] | None = (0.0,)) -> Item:
    """A record of a sine of 1 Hz, with noise."""
    t = np.arange(samples) * 1e-3
    v = 50.0 - 50.0 * np.cos(2.0 * np.pi * t)
    y = 0.1 * v + np.random.default_rng(seed).normal(0.0, 0.01, samples)
    return Item(f"r{seed}", Run(t, v), y, history, 10.0)
