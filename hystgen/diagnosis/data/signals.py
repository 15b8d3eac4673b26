"""Properties of drives, outputs and errors: noise, holds, turning points and spectral peaks."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.search import acceptance
from hystgen.plays import operators

Array = NDArray[np.float64]
Places = NDArray[np.intp]


# Measurement noise: from holds, from differences, from repeated periods --------------------------------------


@dataclass(frozen=True)
class NoiseFloor:
    """Noise rms in output units from each method that the records allow; `rms`: the value used; `ruled`: the method
    used.

    Holds show all noise that is fast compared with their length; repeated periods show everything that does not repeat;
    differences show only changes from sample to sample, a lower bound if the noise is coloured. The noise is at least
    `resolution`: the rounding of the recorded values, or a fraction of the range that no sensor resolves.
    """

    rms: float
    holds: float | None
    differences: float | None
    periods: float | None
    resolution: float = 0.0
    ruled: str = "differences"


def noise_floor(items: Sequence[Item]) -> NoiseFloor:
    """The noise in the measured outputs of several records."""
    holds = _pooled([part for item in items for part in _holds(item)], acceptance.QUIET_HOLDS)
    differences = _pooled([part for item in items for part in _differences(item)], 0.5)
    periods = _pooled([part for item in items for part in _periods(item)], 0.5)
    measured = {name: x for name, x in (("holds", holds), ("periods", periods)) if x is not None}
    ruled = min(measured, key=lambda name: measured[name]) if measured else "differences"
    rms = measured.get(ruled, differences or 0.0)
    seen = [item.y[item.known] for item in items if item.known.any()]
    least = acceptance.LEAST_NOISE * max((float(np.ptp(y)) for y in seen), default=0.0)
    steps = [step for step in map(converter_step, seen) if math.isfinite(step)]
    resolution = max(float(np.median(steps)) / math.sqrt(12.0) if steps else 0.0, least)
    if rms <= resolution:
        rms, ruled = resolution, "resolution"
    return NoiseFloor(rms, holds, differences, periods, resolution, ruled)


def converter_step(y: Array) -> float:
    """The smallest step between two different outputs; infinite if all are equal."""
    return float(np.min(np.diff(np.unique(y[np.isfinite(y)])), initial=np.inf))


def _pooled(parts: Sequence[tuple[float, int]], quantile: float) -> float | None:
    """Square root of a quantile of the variances, which is robust to outliers; longer parts count more."""
    sample = acceptance.HOLD_SAMPLES
    variances = np.array([v for v, n in parts for _ in range(max(1, min(n // sample, acceptance.HOLD_WEIGHT)))])
    return float(np.sqrt(np.quantile(variances, quantile))) if len(variances) else None


def still(v: Array, least: int) -> list[tuple[int, int]]:
    """Stretches [first, last) of at least `least` samples in which the drive stands still."""
    tolerance = max(stands_within(v), 1e-300)
    found, first = [], 0
    for k in np.append(np.flatnonzero(np.abs(np.diff(v)) > tolerance), len(v) - 1):
        if k + 1 - first >= least and np.ptp(v[first : k + 1]) <= 2.0 * tolerance:
            found.append((first, int(k) + 1))
        first = int(k) + 1
    return found


def settled(item: Item) -> list[slice]:
    """The samples of each hold of a record after settling."""
    holds = still(item.run.v, acceptance.HOLD_SAMPLES)
    return [slice(first + int(acceptance.HOLD_SETTLING * (last - first)), last) for first, last in holds]


def stands_within(v: Array) -> float:
    """Largest sample-to-sample change of a drive at rest: measurement noise, or one converter code."""
    swing = float(np.ptp(v))
    code = converter_step(v)
    jitter = 1.001 * code if code <= acceptance.COARSE_DRIVE * swing else 0.0
    return max(acceptance.HOLD_DRIVE * swing, jitter)


def _holds(item: Item) -> list[tuple[float, int]]:
    """Variance and number of samples of each hold after settling."""
    parts = []
    for (first, _), part in zip(still(item.run.v, acceptance.HOLD_SAMPLES), settled(item), strict=True):
        y, t = item.y[part], item.run.t[part]
        known = np.isfinite(y)
        if np.count_nonzero(known) < acceptance.HOLD_SAMPLES // 2 or np.ptp(y[known]) == 0.0:
            continue  # too few samples, or all equal
        y, t = y[known], t[known] - item.run.t[first]
        # creep and drift within a hold are smooth in the logarithm of time
        s = np.log(np.maximum(t, 1e-12))
        s = (s - s.mean()) / max(float(np.std(s)), 1e-300)
        basis = np.column_stack([np.ones(len(y)), s, s**2, s**3])
        solution, *_ = np.linalg.lstsq(basis, y, rcond=None)
        residual = y - basis @ solution
        if not _rings(residual):
            parts.append((float(np.sum(residual**2) / max(len(y) - 4, 1)), len(y)))
    return parts


def _rings(x: Array) -> bool:
    """Whether a signal is mostly one lightly damped oscillation: actuator ringing rather than noise.

    The test is linear prediction from two samples; coloured noise is predictable too, but with real or small poles.
    """
    before = np.column_stack([x[1:-1], x[:-2]])
    (a, b), *_ = np.linalg.lstsq(before, x[2:], rcond=None)
    missed = float(np.sum((x[2:] - before @ np.array([a, b])) ** 2))
    oscillates = a * a + 4.0 * b < 0.0 and -b > acceptance.RING_DECAY**2
    return bool(oscillates and missed < acceptance.RING_UNPREDICTED * float(np.sum(x[2:] ** 2)))


def _differences(item: Item) -> list[tuple[float, int]]:
    """Variance of white noise, from the third differences of a record, and the number of samples."""
    y = _sampled(item.y[item.known])
    if len(y) < acceptance.HOLD_SAMPLES:
        return []
    # third differences of white noise have 20 times its variance; their median absolute deviation ignores events
    third = np.diff(y, 3)
    scale = 1.4826 * float(np.median(np.abs(third - np.median(third))))
    return [(scale**2 / 20.0, len(y))]


def _sampled(y: Array) -> Array:
    """The samples actually measured, if those between them were held or interpolated; otherwise all samples."""
    for order in (1, 2):
        changes = np.abs(np.diff(y, order))
        at = np.flatnonzero(changes > UNMEASURED * float(np.ptp(y))) if len(y) > order else np.empty(0, dtype=np.intp)
        if 2 <= len(at) <= acceptance.HELD_SHARE * len(changes):
            every = max(2, int(np.median(np.diff(at))))
            return y[(int(at[0]) + 1) % every :: every]
    return y


UNMEASURED = 1e-9
"""[fraction of the output range] Smaller changes count as rounding. Interpolated samples are detected in files with 12
digits and offsets up to ten times the range, but not in files with 9 digits; a noise-free sine has smaller second
differences only above 70 000 samples per period. Set by: benchmarks/chosen_numbers.py exact."""


def _periods(item: Item) -> list[tuple[float, int]]:
    """Variance of the part of the output that does not repeat from one period of the drive to the next."""
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
    peak = int(falls[0] + np.argmax(correlation[falls[0] : n // 2 + 1])) if falls[0] <= n // 2 else 0
    for period in range(max(peak - 2, least), peak + 3):
        apart = v[period:] - v[:-period]
        if len(apart) > least and np.sqrt(np.mean(apart**2)) < acceptance.PERIOD_REPEATS * swing:
            for first in (period, 0):  # after the first period, or both if there are only two
                changed = item.y[first + period :] - item.y[first : n - period]
                changed = changed[np.isfinite(changed)]
                if len(changed) > least:
                    return [(float(np.var(changed) / 2.0), len(changed))]
    return []


# Turns of the drive, and whether all records follow one loop -------------------------------------------------


def reversals(v: Array) -> Places:
    """Samples at which the drive reverses by more than a fraction of its range."""
    return _moves(v)[1]


def shows_speed(items: Sequence[Item]) -> bool:
    """Whether the drive takes different times for about equal distances between turns."""
    moves = [np.empty((0, 2))]
    for item in items:
        at = reversals(item.run.v)
        moves.append(np.abs(np.column_stack([np.diff(item.run.v[at]), np.diff(item.run.t[at])])))
    length, seconds = np.concatenate(moves).T
    order = np.argsort(length, kind="stable")
    length, seconds = length[order], seconds[order]
    last = np.searchsorted(length, (1.0 + acceptance.LOOP_ENDS) * length, side="right").tolist()
    return any(
        float(np.max(seconds[k:end])) > acceptance.LOOP_SPEEDS * float(seconds[k])
        or float(seconds[k]) > acceptance.LOOP_SPEEDS * float(np.min(seconds[k:end]))
        for k, end in enumerate(last)
    )


def unresolved_edges(v: Array) -> NDArray[np.bool_]:
    """Samples at which the drive jumps from one level to the next; its course between these samples is unknown.

    A jump within one sample, or two if the converter averages, may begin anywhere in that time, as a step or a ramp.
    The errors during the jump and at the next sample depend on the edge assumed, and there even a small lag matters.
    """
    swing = float(np.ptp(v))
    step = np.abs(np.diff(v))
    moves = step > stands_within(v)
    found = np.zeros(len(v), dtype=bool)
    stands, longest = acceptance.EDGE_STANDS, acceptance.EDGE_SAMPLES
    ends = np.flatnonzero(np.diff(np.concatenate([[False], moves, [False]]).astype(np.int8)))
    for first, last in zip(ends[::2].tolist(), ends[1::2].tolist(), strict=True):
        jumps = last - first <= longest and float(np.sum(step[first:last])) > acceptance.EDGE * swing
        alone = not moves[max(first - stands, 0) : first].any() and not moves[last : last + stands].any()
        if jumps and alone:
            found[first + 1 : last + 2] = True
    return found


def one_loop(items: Sequence[Item]) -> bool:
    """Whether the drive moves between the same two ends in all records, without holds, which would add information."""
    ends = []
    for item in items:
        v, t = item.run.v, item.run.t
        moved, turns = _moves(v)
        if not len(turns):
            return False
        passing = float(np.ptp(t[moved])) / (len(turns) + 1)
        if np.max(np.diff(t[moved])) > acceptance.LOOP_STANDS * passing:
            return False
        at = _between_ends(turns)
        ends += [v[at], np.array([v[at[0] :].min(), v[at[0] :].max()])]
    levels = np.concatenate(ends)
    low, high = float(levels.min()), float(levels.max())
    return bool(np.minimum(levels - low, high - levels).max() <= acceptance.LOOP_ENDS * (high - low))


def one_speed(items: Sequence[Item]) -> bool:
    """Whether the drive takes the same time from each of its ends to the next in all records."""
    passed = np.concatenate([np.diff(item.run.t[_between_ends(reversals(item.run.v))]) for item in items])
    return not len(passed) or bool(passed.max() <= acceptance.LOOP_SPEEDS * passed.min())


def _moves(v: Array) -> tuple[Places, Places]:
    """Samples after which the drive moves, and samples at which it turns, once a play has removed its noise."""
    z = operators.plays(v, np.array([0.5 * acceptance.REVERSAL * float(np.ptp(v))]), np.array([v[0]]))[0]
    steps = np.diff(z)
    moved = np.flatnonzero(steps)
    return moved, moved[np.flatnonzero(np.diff(np.sign(steps[moved])))] + 1


def _between_ends(turns: Places) -> Places:
    """All turns but the first, since the move to that one may begin anywhere."""
    return turns[1:] if len(turns) > 1 else turns


# Spectra of errors: narrow peaks not caused by the drive, ringing that fades, the period of a drive ----------


BESIDE = 2
"""Bins on either side of a peak that belong to it: half the main lobe of a Hann window."""


def peaks(item: Item, error: Array) -> list[tuple[float, float]]:
    """Power fraction and frequency (Hz) of narrow peaks in an error, except lines of the drive and their harmonics."""
    filled = _filled(item, error)
    if filled is None:
        return []
    e, step = filled
    n = len(e)
    window = np.hanning(n)
    power = np.abs(np.fft.rfft((e - e.mean()) * window)) ** 2
    total = float(np.sum(power))
    narrow: list[tuple[int, slice, float]] = []
    for k in _crests(power):
        beside = slice(max(k - BESIDE, 0), k + BESIDE + 1)
        share = float(np.sum(power[beside])) / total
        around = _around(power, k, acceptance.SURROUNDINGS)
        if power[k] > acceptance.LINE_HEIGHT * around and share > acceptance.LINE_SHARE:
            narrow.append((k, beside, share))
    if not narrow:
        return []
    drive = np.abs(np.fft.rfft((item.run.v - item.run.v.mean()) * window)) ** 2
    driven = float(np.sum(drive))
    period = repetition(item.run.v)
    carrier = _carrier(drive)
    found: list[tuple[float, float]] = []
    for k, beside, share in narrow:
        # a line of the drive itself, perhaps a weak one amid many harmonics
        own = float(np.sum(drive[beside])) >= acceptance.DRIVE_LINE_SHARE * driven
        if own and drive[k] > acceptance.PEAK_HEIGHT * _around(drive, k, acceptance.SURROUNDINGS):
            continue
        if period is not None and abs(k * period / n - round(k * period / n)) * n / period < acceptance.SAME_BINS:
            continue  # a harmonic of the drive
        if (
            carrier is not None
            and k < (acceptance.HARMONICS + 0.5) * carrier
            and abs(k - round(k / carrier) * carrier) < acceptance.SAME_BINS
        ):
            continue
        if not any(abs(other - k / (n * step)) < 2 * BESIDE / (n * step) for _, other in found):
            found.append((share, k / (n * step)))
    return found


def ringing(items: Sequence[Item], errors: Sequence[Array], most: int) -> tuple[float, ...]:
    """Frequencies (Hz) of narrow peaks and fading ringing in any record, strongest first, near duplicates dropped."""
    each = ([*peaks(item, error), *_fading(item, error)] for item, error in zip(items, errors, strict=True))
    found = sorted(itertools.chain(*each), reverse=True)
    kept: list[float] = []
    for _, frequency in found:
        if len(kept) < most and all(abs(frequency / other - 1.0) > acceptance.SAME_RINGING for other in kept):
            kept.append(frequency)
    return tuple(kept)


def _fading(item: Item, error: Array) -> list[tuple[float, float]]:
    """Power fraction and frequency of the highest peaks in the mean spectra of a record's parts.

    Ringing that fades is too broad to be a peak in the spectrum of the whole record.
    """
    from scipy.signal import welch

    filled = _filled(item, error)
    if filled is None:
        return []
    e, step = filled
    found: list[tuple[float, float]] = []
    for size in (len(e) // parts for parts in acceptance.SPECTRUM_PARTS):
        if size < acceptance.SPECTRUM_SAMPLES:
            continue
        places, power = welch(e, 1.0 / step, nperseg=size)
        near = acceptance.SURROUNDINGS_OF_PARTS
        high = [k for k in _crests(power) if power[k] > acceptance.PEAK_HEIGHT * _around(power, k, near)]
        if not high:
            continue
        drive = welch(item.run.v, 1.0 / step, nperseg=size)[1]
        for k in high:
            if drive[k] <= acceptance.PEAK_HEIGHT * _around(drive, k, near):
                share = float(np.sum(power[k - BESIDE : k + BESIDE + 1]) / np.sum(power))
                found.append((share, float(np.average(places[k - 1 : k + 2], weights=power[k - 1 : k + 2]))))
    return found


def repetition(v: Array) -> int | None:
    """Period of the drive in samples, if it repeats for at least one more period; else None."""
    n = len(v)
    swing = float(np.ptp(v))
    if n < acceptance.LINE_SAMPLES or swing == 0.0:
        return None
    x = v - v.mean()
    squares = np.concatenate([[0.0], np.cumsum(x**2)])
    lag = np.arange(n // 2 + 1)
    both = np.fft.irfft(np.abs(np.fft.rfft(x, 2 * n)) ** 2)[: n // 2 + 1]
    apart = (squares[n - lag] + squares[n] - squares[lag] - 2.0 * both) / (n - lag)
    gone = np.flatnonzero(apart > (acceptance.DRIVE_AWAY * swing) ** 2)
    if not len(gone):
        return None
    back = np.flatnonzero(apart[gone[0] :] < (acceptance.DRIVE_REPEATS * swing) ** 2)
    if not len(back):
        return None
    first = int(gone[0] + back[0])
    last = min(first + 1 + int(acceptance.DRIVE_REPEATS * first), n // 2)
    return first + int(np.argmin(apart[first : last + 1]))


def _filled(item: Item, error: Array) -> tuple[Array, float] | None:
    """An error with its gaps bridged, and the time between samples; None if too few samples are compared."""
    known = np.isfinite(error)
    if np.count_nonzero(known) < acceptance.SPECTRUM_SAMPLES:
        return None
    step = float(np.median(np.diff(item.run.t)))
    return np.interp(np.arange(len(error)), np.flatnonzero(known), error[known]), step


def _crests(power: Array) -> list[int]:
    """Bins of the highest local maxima of a spectrum."""
    highest = np.argsort(power)[::-1][: acceptance.CRESTS].tolist()
    periods = acceptance.LINE_PERIODS
    return [k for k in highest if k >= periods and power[k] > 0.0 and power[k] >= np.max(power[k - 1 : k + 2])]


def _around(power: Array, k: int, reach: int) -> float:
    """The median of a spectrum on both sides of a bin."""
    away = BESIDE + 1
    return float(np.median(np.concatenate([power[max(k - reach, 1) : k - away], power[k + away + 1 : k + reach]])))


def _carrier(power: Array) -> float | None:
    """Bin of the line with most of a windowed drive's power; None if no line has enough power."""
    k = int(np.argmax(power))
    near = np.arange(max(k - BESIDE, 0), min(k + BESIDE + 1, len(power)))
    held = float(np.sum(power[near]))
    return float(near @ power[near]) / held if k and held >= acceptance.CARRIER_SHARE * float(np.sum(power)) else None
