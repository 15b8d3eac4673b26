"""How large the noise of the measurement is, without a model: from holds, from differences, from repeated periods."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.structure import Item

Array = NDArray[np.float64]

HOLD = 40
"""Fewest samples of a hold that is used."""

STANDS = 2e-4
"""The drive stands still where it stays within this share of its range."""

REPEATS = 2e-3
"""A period of the drive repeats where its rms difference is below this share of its range."""

SETTLED = 0.4
"""Share of a hold, its beginning, that is left out: what still moves there is no noise."""

SLOW, UNPREDICTED = 0.9, 0.3
"""Least decay of ringing from sample to sample, and largest share of its variance that two samples do not predict."""

QUIET = 0.25
"""Quantile of the holds that counts: in the others something may still ring or creep."""


@dataclass(frozen=True)
class Floor:
    """Noise rms in output units by each way that the records allow, and the one that is believed.

    Holds see all noise but what is slower than they last; repeated periods everything that does not repeat; differences
    only what changes from sample to sample, so that they are a lower bound where noise is coloured.
    """

    rms: float
    holds: float | None
    differences: float | None
    periods: float | None


def noise_floor(items: Sequence[Item]) -> Floor:
    """The noise of the measured outputs of several records."""
    holds = _pooled([part for item in items for part in _holds(item)], QUIET)
    differences = _pooled([part for item in items for part in _differences(item)], 0.5)
    periods = _pooled([part for item in items for part in _periods(item)], 0.5)
    told = [x for x in (holds, periods) if x is not None]
    best = min(told) if told else differences or 0.0
    return Floor(max(best, differences or 0.0) if not told else best, holds, differences, periods)


def _pooled(parts: Sequence[tuple[float, int]], quantile: float) -> float | None:
    """A quantile of the variances, so that odd parts do not count; longer parts count more."""
    variances = np.array([v for v, n in parts for _ in range(max(1, min(n // HOLD, 50)))])
    return float(np.sqrt(np.quantile(variances, quantile))) if len(variances) else None


def still(v: Array, least: int) -> list[tuple[int, int]]:
    """Stretches of at least so many samples over which the drive stands still."""
    tolerance = STANDS * max(float(np.ptp(v)), 1e-300)
    found, first = [], 0
    for k in np.append(np.flatnonzero(np.abs(np.diff(v)) > tolerance), len(v) - 1):
        if k + 1 - first >= least and np.ptp(v[first : k + 1]) <= 2.0 * tolerance:
            found.append((first, int(k) + 1))
        first = int(k) + 1
    return found


def _holds(item: Item) -> list[tuple[float, int]]:
    parts = []
    for first, last in still(item.run.v, HOLD):
        begin = first + int(SETTLED * (last - first))
        y, t = item.y[begin:last], item.run.t[begin:last]
        known = np.isfinite(y)
        if np.count_nonzero(known) < HOLD // 2:
            continue
        y, t = y[known], t[known] - item.run.t[first]
        # what creeps or drifts on in a hold is smooth in the logarithm of time
        s = np.log(np.maximum(t, 1e-12))
        s = (s - s.mean()) / max(float(np.std(s)), 1e-300)
        basis = np.column_stack([np.ones(len(y)), s, s**2, s**3])
        solution, *_ = np.linalg.lstsq(basis, y, rcond=None)
        left = y - basis @ solution
        if not _rings(left):
            parts.append((float(np.sum(left**2) / max(len(y) - 4, 1)), len(y)))
    return parts


def _rings(x: Array) -> bool:
    """Whether most of it is one oscillation that hardly decays from sample to sample: an actuator's, and no noise.

    Linear prediction from two samples before; noise that is not white is predicted too, but by real or small poles.
    """
    before = np.column_stack([x[1:-1], x[:-2]])
    (a, b), *_ = np.linalg.lstsq(before, x[2:], rcond=None)
    missed = float(np.sum((x[2:] - before @ np.array([a, b])) ** 2))
    return bool(a * a + 4.0 * b < 0.0 and -b > SLOW**2 and missed < UNPREDICTED * float(np.sum(x[2:] ** 2)))


def _differences(item: Item) -> list[tuple[float, int]]:
    y = item.y[item.known]
    if len(y) < HOLD:
        return []
    # third differences of white noise have 20 times its variance; their median absolute deviation ignores events
    third = np.diff(y, 3)
    scale = 1.4826 * float(np.median(np.abs(third - np.median(third))))
    return [(scale**2 / 20.0, len(y))]


def _periods(item: Item) -> list[tuple[float, int]]:
    v = item.run.v
    n = len(v)
    swing = float(np.ptp(v))
    if n < 4 * HOLD or swing == 0.0:
        return []
    spectrum = np.abs(np.fft.rfft(v - v.mean(), 2 * n)) ** 2
    correlation = np.fft.irfft(spectrum)[:n] / np.arange(n, 0, -1)
    falls = np.flatnonzero(correlation < 0.5 * correlation[0])
    if not len(falls):
        return []
    peak = int(falls[0] + np.argmax(correlation[falls[0] : n // 2])) if falls[0] < n // 2 else 0
    for period in range(max(peak - 2, HOLD), peak + 3):
        apart = v[period:] - v[:-period]
        if len(apart) > HOLD and np.sqrt(np.mean(apart**2)) < REPEATS * swing:
            changed = item.y[2 * period :] - item.y[period:-period]
            changed = changed[np.isfinite(changed)]
            if len(changed) > HOLD:
                return [(float(np.var(changed) / 2.0), len(changed))]
    return []
