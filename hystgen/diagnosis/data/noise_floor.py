"""The noise of the measurement without a model: from holds, from differences, from repeated periods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.search import acceptance

Array = NDArray[np.float64]


@dataclass(frozen=True)
class NoiseFloor:
    """Noise rms in output units by each way that the records allow, and the one that is used.

    Holds contain all noise that is faster than they last; repeated periods everything that does not repeat; differences
    only the changes from sample to sample, so they are a lower bound where the noise is coloured.
    """

    rms: float
    holds: float | None
    differences: float | None
    periods: float | None


def noise_floor(items: Sequence[Item]) -> NoiseFloor:
    """The noise of the measured outputs of several records."""
    holds = _pooled([part for item in items for part in _holds(item)], acceptance.QUIET_HOLDS)
    differences = _pooled([part for item in items for part in _differences(item)], 0.5)
    periods = _pooled([part for item in items for part in _periods(item)], 0.5)
    measured = [x for x in (holds, periods) if x is not None]
    return NoiseFloor(min(measured) if measured else differences or 0.0, holds, differences, periods)


def _pooled(parts: Sequence[tuple[float, int]], quantile: float) -> float | None:
    """Root of a quantile of the variances, so that odd parts do not count; longer parts count more."""
    sample = acceptance.HOLD_SAMPLES
    variances = np.array([v for v, n in parts for _ in range(max(1, min(n // sample, acceptance.HOLD_WEIGHT)))])
    return float(np.sqrt(np.quantile(variances, quantile))) if len(variances) else None


def still(v: Array, least: int) -> list[tuple[int, int]]:
    """Stretches [first, last) of at least `least` samples over which the drive stands still."""
    tolerance = acceptance.HOLD_DRIVE * max(float(np.ptp(v)), 1e-300)
    found, first = [], 0
    for k in np.append(np.flatnonzero(np.abs(np.diff(v)) > tolerance), len(v) - 1):
        if k + 1 - first >= least and np.ptp(v[first : k + 1]) <= 2.0 * tolerance:
            found.append((first, int(k) + 1))
        first = int(k) + 1
    return found


def _holds(item: Item) -> list[tuple[float, int]]:
    """Variance and samples of each hold, without what settles in it."""
    parts = []
    for first, last in still(item.run.v, acceptance.HOLD_SAMPLES):
        begin = first + int(acceptance.HOLD_SETTLING * (last - first))
        y, t = item.y[begin:last], item.run.t[begin:last]
        known = np.isfinite(y)
        if np.count_nonzero(known) < acceptance.HOLD_SAMPLES // 2:
            continue
        y, t = y[known], t[known] - item.run.t[first]
        # creep and drift within a hold are smooth in the logarithm of time
        s = np.log(np.maximum(t, 1e-12))
        s = (s - s.mean()) / max(float(np.std(s)), 1e-300)
        basis = np.column_stack([np.ones(len(y)), s, s**2, s**3])
        solution, *_ = np.linalg.lstsq(basis, y, rcond=None)
        left = y - basis @ solution
        if not _rings(left):
            parts.append((float(np.sum(left**2) / max(len(y) - 4, 1)), len(y)))
    return parts


def _rings(x: Array) -> bool:
    """Whether a signal is mostly one oscillation that hardly decays from sample to sample: an actuator, not noise.

    Linear prediction from the two samples before; coloured noise is predictable too, but by real or small poles.
    """
    before = np.column_stack([x[1:-1], x[:-2]])
    (a, b), *_ = np.linalg.lstsq(before, x[2:], rcond=None)
    missed = float(np.sum((x[2:] - before @ np.array([a, b])) ** 2))
    oscillates = a * a + 4.0 * b < 0.0 and -b > acceptance.RING_DECAY**2
    return bool(oscillates and missed < acceptance.RING_UNPREDICTED * float(np.sum(x[2:] ** 2)))


def _differences(item: Item) -> list[tuple[float, int]]:
    """Variance of white noise with the third differences of a record, and its samples."""
    y = item.y[item.known]
    if len(y) < acceptance.HOLD_SAMPLES:
        return []
    # third differences of white noise have 20 times its variance; their median absolute deviation ignores events
    third = np.diff(y, 3)
    scale = 1.4826 * float(np.median(np.abs(third - np.median(third))))
    return [(scale**2 / 20.0, len(y))]


def _periods(item: Item) -> list[tuple[float, int]]:
    """Variance of what does not repeat from one period of the drive to the next, behind the first one."""
    v = item.run.v
    n = len(v)
    swing = float(np.ptp(v))
    least = acceptance.HOLD_SAMPLES
    if n < 4 * least or swing == 0.0:
        return []
    spectrum = np.abs(np.fft.rfft(v - v.mean(), 2 * n)) ** 2
    correlation = np.fft.irfft(spectrum)[:n] / np.arange(n, 0, -1)
    falls = np.flatnonzero(correlation < 0.5 * correlation[0])
    if not len(falls):
        return []
    peak = int(falls[0] + np.argmax(correlation[falls[0] : n // 2])) if falls[0] < n // 2 else 0
    for period in range(max(peak - 2, least), peak + 3):
        apart = v[period:] - v[:-period]
        if len(apart) > least and np.sqrt(np.mean(apart**2)) < acceptance.PERIOD_REPEATS * swing:
            changed = item.y[2 * period :] - item.y[period:-period]
            changed = changed[np.isfinite(changed)]
            if len(changed) > least:
                return [(float(np.var(changed) / 2.0), len(changed))]
    return []
