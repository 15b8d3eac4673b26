"""Test benches: drive range, travel, sampling and length of the records that a user would take there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

RANGES = ((0.0, 100.0), (-20.0, 120.0), (0.0, 150.0), (-10.0, 10.0), (-30.0, 150.0), (-100.0, 100.0))

KINDS = ("static", "dynamic", "mixed")


@dataclass(frozen=True)
class Bench:
    """`rates` [1/s] of slow and fast records, equal unless the bench is mixed; `samples` per record."""

    kind: str
    low: float
    high: float
    span_out: float
    rates: tuple[float, float]
    samples: int

    @property
    def span(self) -> float:
        return self.high - self.low

    @property
    def middle(self) -> float:
        return 0.5 * (self.low + self.high)

    @property
    def two_sided(self) -> bool:
        """Whether both ends of the drive are far from zero."""
        return self.low < -0.3 * self.high

    @property
    def long(self) -> float:
        """Seconds of a slow record."""
        return self.samples / self.rates[0]

    @property
    def short(self) -> float:
        """Seconds of a fast record."""
        return self.samples / self.rates[1]


def draw(rng: np.random.Generator, kind: str, samples: int) -> Bench:
    low, high = RANGES[int(rng.integers(len(RANGES)))]
    span_out = float(np.exp(rng.uniform(np.log(2.0), np.log(100.0))))
    slow = float(rng.choice([50.0, 100.0, 200.0]))
    fast = float(rng.choice([2000.0, 5000.0, 10000.0, 20000.0]))
    rates = {"static": (slow, slow), "dynamic": (fast, fast), "mixed": (2.0 * slow, fast)}[kind]
    return Bench(kind, low, high, span_out, rates, int(samples * rng.uniform(0.85, 1.2)))
