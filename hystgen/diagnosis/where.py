"""Where model and measurement disagree: the stretches of the records with the largest error, and what goes on there."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.floor import still
from hystgen.diagnosis.structure import Item

Array = NDArray[np.float64]

WINDOWS = 24
"""Stretches that each record is cut into."""

ABOVE = 1.5
"""A stretch is told where its rms is so many times the noise."""

TOLD = 12


def places(items: Sequence[Item], errors: Sequence[Array], noise: float) -> list[dict[str, Any]]:
    """The worst stretches, the largest rms first: record, kind, interval in seconds, rms in output units."""
    found = []
    for item, error in zip(items, errors, strict=True):
        n = len(error)
        holds = still(item.run.v, max(16, n // 100))
        rate = np.abs(np.gradient(item.run.v, item.run.t))
        fast = float(np.quantile(rate, 0.9))
        low, high = float(item.run.v.min()), float(item.run.v.max())
        edges = np.linspace(0, n, WINDOWS + 1).astype(int)
        flags = []
        for a, b in itertools.pairwise(edges.tolist()):
            part = error[a:b]
            known = np.isfinite(part)
            rms = float(np.sqrt(np.mean(part[known] ** 2))) if known.any() else 0.0
            flags.append((a, b, rms, _kind(item, a, b, holds, rate, fast, low, high)))
        merged: list[list[Any]] = []
        for a, b, rms, kind in flags:
            if rms <= ABOVE * noise or rms == 0.0:
                continue
            if merged and merged[-1][1] == a and merged[-1][3] == kind:
                width, own = merged[-1][1] - merged[-1][0], b - a
                merged[-1][2] = float(np.sqrt((merged[-1][2] ** 2 * width + rms**2 * own) / (width + own)))
                merged[-1][1] = b
            else:
                merged.append([a, b, rms, kind])
        found += [
            {
                "record": item.name,
                "kind": kind,
                "interval": [float(item.run.t[a]), float(item.run.t[b - 1])],
                "rms": rms,
            }
            for a, b, rms, kind in merged
        ]
    return sorted(found, key=lambda each: -each["rms"])[:TOLD]


def _kind(
    item: Item, a: int, b: int, holds: Sequence[tuple[int, int]], rate: Array, fast: float, low: float, high: float
) -> str:
    inside = sum(max(0, min(b, last) - max(a, first)) for first, last in holds)
    if inside > 0.5 * (b - a):
        return "after_step"
    v = item.run.v[a:b]
    if np.mean((v > high - 0.1 * (high - low)) | (v < low + 0.1 * (high - low))) > 0.6:
        return "range_end"
    return "fast" if fast > 0.0 and float(np.mean(rate[a:b])) > fast else "moving"
