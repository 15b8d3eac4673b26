"""Two axes that push each other, unknown to hystgen. SIMULATED.

Each axis is a bank of relays, smeared over a few millivolts, and so is what each axis does to the other: coupling has a
hysteresis of its own. Nothing here comes from hystgen: no plays, no filters.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SAMPLE_TIME = 0.002  # s
FULL = 100.0  # V
RANGE = 50.0  # um, of an axis
NOISE = 0.01  # um rms
COUPLED = (0.030, 0.022)  # of the range: what the full drive of Y does to X, and of X to Y

WIDTHS = np.array([0.0, 0.02, 0.05, 0.09, 0.15, 0.24])  # half widths of the relays, of the full drive
CENTRES = np.linspace(-0.3, 1.3, 220)
SMEARED = 0.02


class Relays:
    """A bank of relays, each pulled up above its centre plus its width, and down below its centre minus its width."""

    def __init__(self, shares: Array) -> None:
        self.up, self.down = (CENTRES[None, :] + way * WIDTHS[:, None] for way in (1.0, -1.0))
        self.share = np.repeat((shares / np.sum(shares))[:, None], len(CENTRES), axis=1) / len(CENTRES)
        self.state = -np.ones_like(self.up)

    def move(self, v: float) -> float:
        """The answer to a drive, 0 V to FULL: about 0 to 1."""
        x = v / FULL
        self.state = np.maximum(self.state, np.tanh((x - self.up) / SMEARED))
        self.state = np.minimum(self.state, np.tanh((x - self.down) / SMEARED))
        return 0.5 + 0.5 * 1.6 * float(np.sum(self.share * self.state))


class Stage:
    """Both axes, at rest at 0 V; `move` advances them to the next sample."""

    def __init__(self, seed: int = 1) -> None:
        self.noise = np.random.default_rng(seed)
        own = (np.array([1.0, 0.1, 0.09, 0.07, 0.05, 0.04]), np.array([1.0, 0.07, 0.1, 0.06, 0.06, 0.03]))
        other = (np.array([0.6, 0.05, 0.2, 0.2, 0.3, 0.2]), np.array([0.5, 0.1, 0.1, 0.3, 0.2, 0.1]))
        self.own, self.other = [Relays(each) for each in own], [Relays(each) for each in other]

    def move(self, drives: tuple[float, float]) -> tuple[float, float]:
        """The true displacements of X and Y, um."""
        own = [bank.move(v) for bank, v in zip(self.own, drives, strict=True)]
        pushed = [bank.move(v) for bank, v in zip(self.other, drives[::-1], strict=True)]
        x, y = (RANGE * (a + share * b) for a, share, b in zip(own, COUPLED, pushed, strict=True))
        return x, y

    def measured(self, drives: Array) -> Array:
        """Displacements (2, N) with the sensors' noise for drives (2, N)."""
        found = np.array([self.move((float(x), float(y))) for x, y in drives.T]).T
        return found + NOISE * self.noise.standard_normal(found.shape)


def recorded(rng: np.random.Generator, samples: int) -> Array:
    """Drives (2, N): both axes sweep once, one after the other, and then move on their own, at rates of their own."""
    sweep = FULL * (1.0 - np.abs(np.linspace(-1.0, 1.0, samples // 8)))
    found = []
    for first in (True, False):
        still = np.zeros(len(sweep))
        points = rng.uniform(0.0, FULL, int(rng.integers(9, 15)))
        points[0] = 0.0
        place = np.linspace(0.0, len(points) - 1.0, samples - 2 * len(sweep))
        low = np.minimum(place.astype(int), len(points) - 2)
        part = 0.5 - 0.5 * np.cos(np.pi * (place - low))
        moves = points[low] * (1.0 - part) + points[low + 1] * part
        found.append(np.concatenate([*((sweep, still) if first else (still, sweep)), moves]))
    return np.array(found)
