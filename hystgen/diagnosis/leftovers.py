"""What is left after the named effects: described, not named.

Disturbances that are none of the actuator (mains hum, glitches, held samples, a saturated converter) are told with
place and count; anything else by the variables that go with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.structure import Item

Array = NDArray[np.float64]

LINE = 30.0
"""A spectral line stands so many times above the median of its surroundings, in power."""

LINE_SHARE = 0.03
"""Least share of the residual's variance in a line that is told."""

EVENT = 10.0
"""A jump is so many robust standard deviations of the residual's steps."""

HELD = 4
"""Fewest equal samples in a row, while the drive moves, that count as held."""

RAIL = 12
"""Fewest samples at the very end of the output's range that count as saturated."""

MULTIPLE = 3.0
"""An output so many times what the believed model predicts is in other units, or another channel."""

MOVES = 0.3
"""Only records whose drive moves over this share of the widest one's range tell of their scale."""

WORTH = 0.1
"""Least share of the residual's variance for a variable that is told to go with it."""


def disturbances(items: Sequence[Item], errors: Sequence[Array]) -> list[dict[str, Any]]:
    """Lines and held samples in the records."""
    told: list[dict[str, Any]] = []
    for item, error in zip(items, errors, strict=True):
        told += _lines(item, error)
        told += _held(item)
    return told


def scales(items: Sequence[Item], predicted: Sequence[Array]) -> list[dict[str, Any]]:
    """Records whose output is a multiple of what the believed model predicts: wrong units, or swapped channels."""
    factors: list[float] = []
    widest = max(float(np.ptp(item.run.v)) for item in items)
    wide = [(item, y) for item, y in zip(items, predicted, strict=True) if np.ptp(item.run.v) > MOVES * widest]
    for item, y in wide:
        known = item.known
        x = y[known] - np.mean(y[known])
        power = float(x @ x)
        factors.append(float(x @ item.y[known]) / power if power > 0.0 else 1.0)
    usual = float(np.median(factors))
    told: list[dict[str, Any]] = []
    if not 1.0 / MULTIPLE < usual < MULTIPLE:
        told.append({"kind": "scale", "record": "all", "factor": usual})
    for (item, _), factor in zip(wide, factors, strict=True):
        if not 1.0 / MULTIPLE < factor / usual < MULTIPLE:
            told.append({"kind": "scale", "record": item.name, "factor": factor})
    return told


def _lines(item: Item, error: Array) -> list[dict[str, Any]]:
    """Narrow lines of the residual that are no multiples of what the drive does."""
    known = np.isfinite(error)
    n = len(error)
    if np.count_nonzero(known) < 256:
        return []
    step = float(np.median(np.diff(item.run.t)))
    e = np.interp(np.arange(n), np.flatnonzero(known), error[known])
    window = np.hanning(n)
    power = np.abs(np.fft.rfft((e - e.mean()) * window)) ** 2
    drive = np.abs(np.fft.rfft((item.run.v - item.run.v.mean()) * window)) ** 2
    frequency = np.fft.rfftfreq(n, step)
    total = float(np.sum(power))
    if total == 0.0:
        return []
    found: list[dict[str, Any]] = []
    for k in np.argsort(power)[::-1][:5]:
        if k < 8:
            continue
        around = np.concatenate([power[max(k - 40, 1) : k - 3], power[k + 4 : k + 40]])
        share = float(np.sum(power[max(k - 2, 0) : k + 3]) / total)
        own = float(np.sum(drive[max(k - 2, 0) : k + 3]) / max(float(np.sum(drive)), 1e-300))
        if len(around) and power[k] > LINE * float(np.median(around)) and share > LINE_SHARE and own < 1e-4:
            # a harmonic of a periodic drive is none: it has neighbours at its distance
            fundamental = int(np.argmax(drive[1:])) + 1
            multiple = k / fundamental
            if fundamental > 3 and abs(multiple - round(multiple)) < 2.0 / fundamental and multiple < 40:
                continue
            if not any(abs(each["frequency"] - frequency[k]) < 4.0 / (n * step) for each in found):
                found.append(
                    {"kind": "line", "record": item.name, "frequency": float(f"{frequency[k]:.4g}"), "share": share}
                )
    return found


def _held(item: Item) -> list[dict[str, Any]]:
    """Runs of equal output samples while the drive moves on."""
    y, v = item.y, item.run.v
    same = np.append(np.diff(y) == 0.0, False)
    moved = np.append(np.abs(np.diff(v)) > 0.25 * float(np.median(np.abs(np.diff(v)))), False)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same & moved, [False]]).astype(np.int8)))
    runs = [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a + 1 >= HELD]
    step = np.abs(np.diff(y))
    usual = float(np.nanmedian(step[step > 0.0])) if np.any(step > 0.0) else 0.0
    grain = float(np.nanmin(step[step > 0.0])) if np.any(step > 0.0) else 0.0
    # a coarse converter repeats codes without any fault
    if not runs or grain > 0.1 * usual:
        return []
    return [{"kind": "held_samples", "record": item.name, "count": len(runs), "first": float(item.run.t[runs[0][0]])}]


def rails(y: Array, v: Array) -> list[tuple[str, float]]:
    """Ends of the output, with their level, at which many samples in a row are equal while the drive moves on."""
    known = y[np.isfinite(y)]
    found = []
    for name, end in (("largest", float(known.max())), ("least", float(known.min()))):
        at = y == end
        edges = np.flatnonzero(np.diff(np.concatenate([[False], at, [False]]).astype(np.int8)))
        longest = max(zip(edges[::2], edges[1::2], strict=True), key=lambda run: int(run[1] - run[0]))
        moved = float(np.ptp(v[longest[0] : longest[1]]))
        if longest[1] - longest[0] >= RAIL and moved > 0.01 * float(np.ptp(v)):
            found.append((name, end))
    return found


def structure(items: Sequence[Item], errors: Sequence[Array]) -> tuple[float, Mapping[str, float]]:
    """Share of the residual's variance that smooth functions of one variable take away in records that they have not
    seen: the largest such share, and the share of each variable."""
    shares: dict[str, float] = {}
    for name, values in _variables(items).items():
        shares[name] = _share(values, errors)
    return max(shares.values(), default=0.0), {k: round(s, 4) for k, s in shares.items() if s > WORTH}


def _variables(items: Sequence[Item]) -> dict[str, list[Array]]:
    rates = [np.gradient(item.run.v, item.run.t) for item in items]
    return {
        "drive": [item.run.v for item in items],
        "rate": rates,
        "displacement": [np.interp(item.run.t, item.run.t[item.known], item.y[item.known]) for item in items],
        "time": [item.run.t - item.run.t[0] for item in items],
        "travel": [np.concatenate([[0.0], np.cumsum(np.abs(np.diff(item.run.v)))]) for item in items],
        "drive and direction": [
            item.run.v + 1e3 * np.ptp(item.run.v) * (rate > 0.0) for item, rate in zip(items, rates, strict=True)
        ],
    }


def _share(values: Sequence[Array], errors: Sequence[Array]) -> float:
    """Cross-validated share over halves of the records taken alternately in blocks."""
    x = np.concatenate([v[np.isfinite(e)] for v, e in zip(values, errors, strict=True)])
    e = np.concatenate([e[np.isfinite(e)] for e in errors])
    if len(e) < 200 or np.ptp(x) == 0.0:
        return 0.0
    edges = np.unique(np.quantile(x, np.linspace(0.0, 1.0, 25)))
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
    fold = (np.arange(len(e)) * 8 // len(e)) % 2
    left = 0.0
    for k in (0, 1):
        train, test = fold != k, fold == k
        count = np.bincount(place[train], minlength=len(edges))
        mean = np.bincount(place[train], e[train], minlength=len(edges)) / np.maximum(count, 1)
        left += float(np.sum((e[test] - mean[place[test]]) ** 2))
    return max(0.0, 1.0 - left / max(float(np.sum(e**2)), 1e-300))
