"""Spectra of errors: narrow peaks that the drive does not make, ringing that fades, and the period of a drive."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.search import acceptance

Array = NDArray[np.float64]

BESIDE = 2
"""Bins on either side of a peak that belong to it: half the main lobe of a Hann window."""


def peaks(item: Item, error: Array) -> list[tuple[float, float]]:
    """Share and frequency (Hz) of narrow peaks of an error that are neither lines nor harmonics of the drive."""
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
        # a line of the drive, which may be a small one of many harmonics
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
    """Frequencies (Hz) of narrow peaks in any record and of fading ringing, the strongest first, close ones once."""
    each = ([*peaks(item, error), *_fading(item, error)] for item, error in zip(items, errors, strict=True))
    found = sorted(itertools.chain(*each), reverse=True)
    kept: list[float] = []
    for _, frequency in found:
        if len(kept) < most and all(abs(frequency / other - 1.0) > acceptance.SAME_RINGING for other in kept):
            kept.append(frequency)
    return tuple(kept)


def _fading(item: Item, error: Array) -> list[tuple[float, float]]:
    """Share and frequency of the highest peaks in the mean spectra of a record's parts.

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
    """Samples after which the drive repeats itself for at least as long again; None where it does not."""
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
    """An error with its gaps bridged, and the time between samples; None where too few of them are compared."""
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
    """Place (bins) of the line that holds most of a windowed drive's power; None where none holds enough of it."""
    k = int(np.argmax(power))
    near = np.arange(max(k - BESIDE, 0), min(k + BESIDE + 1, len(power)))
    held = float(np.sum(power[near]))
    return float(near @ power[near]) / held if k and held >= acceptance.CARRIER_SHARE * float(np.sum(power)) else None
