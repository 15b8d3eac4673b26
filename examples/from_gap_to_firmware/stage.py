"""The stage that hystgen knows nothing about: stick and slip, a bent transducer, creep, a noisy sensor. SIMULATED.

A transducer bends the drive, sliders that stick behind springs until they slip take up part of it, and two springs with
dampers keep moving afterwards. Nothing here comes from hystgen: the simulation uses none of its plays, dead zones or
filters. Time advances in steps far finer than the samples.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SAMPLE_TIME = 0.01  # s, a fortieth of the fastest damper's time constant, so that its creep shows in many samples
FINE = 10  # simulation steps per sample
FULL = 100.0  # V
NOISE = 0.004  # um rms

YIELDS = np.linspace(2.0, 60.0, 40)  # V, where each slider slips
STIFFNESS = 0.16 * np.exp(-YIELDS / 25.0) / np.sum(np.exp(-YIELDS / 25.0))  # um/V each
GAIN = 0.22  # um/V, with all sliders slipping
BENT = 1.2e-3  # 1/V: the transducer gives v + BENT v (FULL - v)
DAMPERS = ((0.4, 0.03), (8.0, 0.04))  # s, and share of the motion that comes late


class Stage:
    """The stage at rest at 0 V; `move` advances it to the next sample."""

    def __init__(self, seed: int = 1) -> None:
        self.noise = np.random.default_rng(seed)
        self.v = self.bent = self.h = 0.0
        self.stretch = np.zeros_like(YIELDS)
        self.late = np.zeros(len(DAMPERS))

    def move(self, v: float) -> float:
        """The true displacement, um, after the drive has moved to v along a straight line in one sample."""
        for drive in np.linspace(self.v, v, FINE + 1)[1:]:
            bent = drive + BENT * drive * (FULL - drive)
            self.stretch = np.clip(self.stretch + (bent - self.bent), -YIELDS, YIELDS)
            self.bent = bent
            self.h = GAIN * bent - float(STIFFNESS @ self.stretch)
            for i, (seconds, share) in enumerate(DAMPERS):
                self.late[i] += (share * self.h - self.late[i]) * SAMPLE_TIME / FINE / seconds
        self.v = v
        return 2.0 + self.h + float(np.sum(self.late))

    def rest(self, v: float) -> None:
        """Move to v and stay there until the dampers have come to rest."""
        self.move(v)
        self.late = np.array([share * self.h for _, share in DAMPERS])

    def measure(self, drives: Array) -> Array:
        """Sensor readings, sample by sample, after the stage has rested at the first drive."""
        self.rest(float(drives[0]))
        return np.array([self.move(float(v)) for v in drives]) + NOISE * self.noise.normal(size=len(drives))


def turns(rng: np.random.Generator, seconds: float, least: float, most: float) -> Array:
    """Straight moves and holds between random drives."""
    n = int(seconds / SAMPLE_TIME)
    drives: list[float] = []
    at = least
    while len(drives) < n:
        to = float(rng.uniform(least, most))
        drives += np.linspace(at, to, int(rng.integers(20, 120))).tolist()
        drives += [to] * int(rng.choice([0, 0, 150]))
        at = to
    return np.array(drives[:n])
