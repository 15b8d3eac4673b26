"""Where model and measurement disagree: the stretches with the largest error, and what the drive does there."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.data.signals import still
from hystgen.diagnosis.findings.result import Stretch
from hystgen.diagnosis.search import acceptance

Array = NDArray[np.float64]

WINDOWS = 24
"""Windows that each record is cut into; neighbours of one kind become one stretch."""

LISTED = 12
"""Stretches that are listed: as many as a reader looks at."""


def worst(items: Sequence[Item], errors: Sequence[Array], noise: float) -> tuple[Stretch, ...]:
    """The worst stretches of all records, the largest rms first."""
    found = [each for item, error in zip(items, errors, strict=True) for each in _stretches(item, error, noise)]
    return tuple(sorted(found, key=lambda each: -each.rms)[:LISTED])


def _stretches(item: Item, error: Array, noise: float) -> list[Stretch]:
    """The windows of a record with more than noise, those next to each other joined where their kinds agree."""
    kind_of = _Kinds(item)
    merged: list[tuple[int, int, float, str]] = []
    edges = np.linspace(0, len(error), WINDOWS + 1).astype(int)
    for a, b in itertools.pairwise(edges.tolist()):
        part = error[a:b]
        known = np.isfinite(part)
        rms = float(np.sqrt(np.mean(part[known] ** 2))) if known.any() else 0.0
        if rms <= acceptance.STRETCH_ABOVE_NOISE * noise or rms == 0.0:
            continue
        kind = kind_of(a, b)
        if merged and merged[-1][1] == a and merged[-1][3] == kind:
            first, _, before, _ = merged.pop()
            width, own = a - first, b - a
            a, rms = first, float(np.sqrt((before**2 * width + rms**2 * own) / (width + own)))
        merged.append((a, b, rms, kind))
    t = item.run.t
    return [Stretch(item.name, kind, (float(t[a]), float(t[b - 1])), rms) for a, b, rms, kind in merged]


class _Kinds:
    """What the drive of a record does in samples [a, b): `after_step`, `range_end`, `fast` or `moving`."""

    def __init__(self, item: Item) -> None:
        self._v = item.run.v
        self._holds = still(item.run.v, max(16, len(item.y) // 100))
        self._rate = np.abs(np.gradient(item.run.v, item.run.t))
        self._fast = float(np.quantile(self._rate, acceptance.FAST_QUANTILE))
        low, high = float(item.run.v.min()), float(item.run.v.max())
        self._low = low + acceptance.RANGE_END * (high - low)
        self._high = high - acceptance.RANGE_END * (high - low)

    def __call__(self, a: int, b: int) -> str:
        held = sum(max(0, min(b, last) - max(a, first)) for first, last in self._holds)
        if held > 0.5 * (b - a):
            return "after_step"
        v = self._v[a:b]
        if np.mean((v > self._high) | (v < self._low)) > acceptance.RANGE_END_SHARE:
            return "range_end"
        return "fast" if self._fast > 0.0 and float(np.mean(self._rate[a:b])) > self._fast else "moving"
