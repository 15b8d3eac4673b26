"""Lines in what a model leaves: over time (mains hum) and over the position (the pitch of a sensor)."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.structure import Item

Array = NDArray[np.float64]

STANDS = 30.0
"""A line stands so many times above the median of its surroundings, in power."""

SHARE, ALONE = 0.03, 0.3
"""Least share of a record's residual variance in a line, and where only a few of the records have it."""

OWN, PEAK = 1e-6, 10.0
"""A line is the drive's own where that has so much of its power there, and so many times its surroundings'."""

CARRIED, HARMONICS = 0.5, 10
"""A drive that has at least this share of its power in one line answers with that line's harmonics, these of them: its
swing may change from turn to turn, so that it does not repeat itself, and an actuator bends it all the same."""

PERIODS = 8
"""Fewest periods in a record for a line to be seen, and fewest pitches in the travel."""

MOST = 4

CLOSE = 0.02
"""Frequencies of ringing that differ by less are the same."""

BINS = 4096
"""Positions are taken to so many places of the range."""

MAINS = (50.0, 60.0)


REPEATS = 0.01
"""A drive repeats itself where it differs from itself a period later by less than this share of its range, rms."""


@dataclass(frozen=True)
class Line:
    """What is told of a line, and the errors without it."""

    told: dict[str, Any]
    errors: list[Array]
    share: float


def lines(items: Sequence[Item], errors: Sequence[Array]) -> tuple[list[dict[str, Any]], list[Array]]:
    """Lines in the errors of several records, the strongest first, and the errors without them."""
    left, told = list(errors), []
    for _ in range(MOST):
        found = [line for line in (_in_time(items, left), _in_position(items, left)) if line is not None]
        if not found:
            break
        best = max(found, key=lambda line: line.share)
        told.append(best.told)
        left = best.errors
    return told, left


def _total(errors: Sequence[Array]) -> float:
    return float(sum(np.nansum(e**2) for e in errors))


def _share(before: Sequence[Array], after: Sequence[Array]) -> float:
    total = _total(before)
    return 1.0 - _total(after) / total if total > 0.0 else 0.0


# Over time ---------------------------------------------------------------------------------------------------


def _in_time(items: Sequence[Item], errors: Sequence[Array]) -> Line | None:
    """The strongest line that is in most of the records that are long enough for it, or that rules a few."""
    found: list[tuple[float, float, int]] = []
    for k, (item, error) in enumerate(zip(items, errors, strict=True)):
        found += [(share, frequency, k) for share, frequency in peaks(item, error)]
    times = [item.run.t[np.isfinite(e)] for item, e in zip(items, errors, strict=True)]
    lengths = [float(np.ptp(t)) if len(t) > 64 else 0.0 for t in times]
    rates = [1.0 / float(np.median(np.diff(item.run.t))) for item in items]
    best: tuple[float, float, list[int], list[int]] | None = None
    for _, frequency, k in found:
        near = [p for p in found if abs(p[1] - frequency) < 1.5 / min(lengths[p[2]], lengths[k])]
        seen = sorted({p[2] for p in near})
        able = [j for j, n in enumerate(lengths) if n * frequency >= PERIODS and 2.0 * frequency <= rates[j]]
        strength = sum(p[0] for p in near)
        common = len(seen) >= max(2, 0.4 * len(able)) or len(able) == len(seen)
        if (common or min(p[0] for p in near) > ALONE) and (best is None or strength > best[0]):
            longest = max(near, key=lambda p: lengths[p[2]])  # which tells the frequency best
            best = strength, longest[1], seen, able
    if best is None:
        return None
    _, frequency, seen, able = best
    frequency = _refined(items, errors, frequency, seen, lengths)
    after, sizes, has = [], [], []
    for k, (item, error) in enumerate(zip(items, errors, strict=True)):
        if lengths[k] * frequency < 2.0:
            after.append(error)
            continue
        e, size = _without(error, _phase(item, frequency))
        after.append(e)
        if k in seen or (k in able and _share([error], [e]) > SHARE):
            has.append(k)
        # two samples a period do not tell the amplitude
        if k in seen and (2.2 * frequency < rates[k] or all(2.2 * frequency > rates[j] for j in seen)):
            sizes.append(size)
    own = _share([errors[k] for k in has], [after[k] for k in has])
    told = {
        "kind": "line",
        "frequency": float(f"{frequency:.4g}"),
        "amplitude": float(np.median(sizes)),
        "share": own,
        "records": [items[k].name for k in has],
    }
    width = 0.5 / max(lengths[k] for k in seen)
    order = [(f, n) for f in MAINS for n in (1, 2, 3, 5) if abs(frequency - n * f) < max(width, 0.002 * frequency)]
    if order:
        mains, n = order[0]
        told["mains"] = mains if n == 1 else f"{n} x {mains:g} Hz"
    return Line(told, after, _share(errors, after))


def peaks(item: Item, error: Array) -> list[tuple[float, float]]:
    """Share and frequency of narrow peaks of one residual that are no multiples of what the drive does."""
    known = np.isfinite(error)
    n = len(error)
    if np.count_nonzero(known) < 256:
        return []
    step = float(np.median(np.diff(item.run.t)))
    e = np.interp(np.arange(n), np.flatnonzero(known), error[known])
    window = np.hanning(n)
    power = np.abs(np.fft.rfft((e - e.mean()) * window)) ** 2
    drive = np.abs(np.fft.rfft((item.run.v - item.run.v.mean()) * window)) ** 2
    total, driven = float(np.sum(power)), float(np.sum(drive))
    if total == 0.0:
        return []
    period = repetition(item.run.v)
    carrier = _carrier(drive)
    found: list[tuple[float, float]] = []
    for k in np.argsort(power)[::-1][:5].tolist():
        if k < PERIODS or power[k] < np.max(power[k - 1 : k + 2]):
            continue
        around = np.concatenate([power[max(k - 40, 1) : k - 3], power[k + 4 : k + 40]])
        beside = slice(max(k - 2, 0), k + 3)
        share = float(np.sum(power[beside])) / total
        if not len(around) or power[k] <= STANDS * float(np.median(around)) or share <= SHARE:
            continue
        # a line of the drive, which may be a small one of many harmonics
        own = np.concatenate([drive[max(k - 40, 1) : k - 3], drive[k + 4 : k + 40]])
        if float(np.sum(drive[beside])) >= OWN * driven and drive[k] > PEAK * float(np.median(own)):
            continue
        if period is not None and abs(k * period / n - round(k * period / n)) * n / period < 1.5:
            continue  # a harmonic of the drive
        if carrier is not None and k < (HARMONICS + 0.5) * carrier and abs(k - round(k / carrier) * carrier) < 1.5:
            continue
        if not any(abs(other - k / (n * step)) < 4.0 / (n * step) for _, other in found):
            found.append((share, k / (n * step)))
    return found


def _carrier(power: Array) -> float | None:
    """Place of the line that holds most of a windowed drive's power, in bins; None where none holds so much."""
    k = int(np.argmax(power))
    near = np.arange(max(k - 2, 0), min(k + 3, len(power)))
    held = float(np.sum(power[near]))
    return float(near @ power[near]) / held if k and held >= CARRIED * float(np.sum(power)) else None


def ringing(items: Sequence[Item], errors: Sequence[Array], most: int) -> tuple[float, ...]:
    """The frequencies of narrow peaks in any record, the strongest first, close ones once."""
    each = (peaks(item, error) for item, error in zip(items, errors, strict=True))
    found = sorted(itertools.chain(*each), reverse=True)
    kept: list[float] = []
    for _, frequency in found:
        if len(kept) < most and all(abs(frequency / other - 1.0) > CLOSE for other in kept):
            kept.append(frequency)
    return tuple(kept)


def repetition(v: Array) -> int | None:
    """Samples after which the drive repeats itself for at least as long again; None where it does not."""
    n = len(v)
    swing = float(np.ptp(v))
    if n < 64 or swing == 0.0:
        return None
    x = v - v.mean()
    squares = np.concatenate([[0.0], np.cumsum(x**2)])
    lag = np.arange(n // 2 + 1)
    both = np.fft.irfft(np.abs(np.fft.rfft(x, 2 * n)) ** 2)[: n // 2 + 1]
    apart = (squares[n - lag] + squares[n] - squares[lag] - 2.0 * both) / (n - lag)
    gone = np.flatnonzero(apart > (0.25 * swing) ** 2)
    if not len(gone):
        return None
    back = np.flatnonzero(apart[gone[0] :] < (REPEATS * swing) ** 2)
    if not len(back):
        return None
    first = int(gone[0] + back[0])
    last = min(first + 1 + int(REPEATS * first), n // 2)
    return first + int(np.argmin(apart[first : last + 1]))


def _refined(
    items: Sequence[Item], errors: Sequence[Array], frequency: float, seen: Sequence[int], lengths: Sequence[float]
) -> float:
    """The frequency at which a sine takes most out of the records."""
    places = frequency + np.linspace(-1.0, 1.0, 21) / max(lengths[k] for k in seen)
    for _ in range(2):
        removed = [
            sum(
                float(np.nansum(errors[k] ** 2) - np.nansum(_without(errors[k], _phase(items[k], f))[0] ** 2))
                for k in seen
            )
            for f in places
        ]
        best, step = float(places[int(np.argmax(removed))]), float(places[1] - places[0])
        places = best + np.linspace(-1.0, 1.0, 21) * step
    return best


def _phase(item: Item, frequency: float) -> Array:
    return np.asarray(2.0 * np.pi * frequency * (item.run.t - item.run.t[0]))


def _without(error: Array, phase: Array) -> tuple[Array, float]:
    """The error without its sine and cosine over a phase, and their amplitude."""
    known = np.isfinite(error)
    table = np.column_stack([np.cos(phase[known]), np.sin(phase[known]), np.ones(int(np.count_nonzero(known)))])
    solution = np.linalg.lstsq(table, error[known], rcond=None)[0]
    left = error.copy()
    left[known] -= table[:, :2] @ solution[:2]
    return left, float(np.hypot(solution[0], solution[1]))


# Over the position -------------------------------------------------------------------------------------------


def _in_position(items: Sequence[Item], errors: Sequence[Array]) -> Line | None:
    """A ripple with a fixed pitch over the predicted position, of the same phase in all records.

    The measured position would not do: a ripple that is large against its pitch is no sine over itself.
    """
    known = [np.isfinite(e) & np.isfinite(item.y) for item, e in zip(items, errors, strict=True)]
    values = [e[at] for e, at in zip(errors, known, strict=True)]
    places = [item.y[at] - e for item, e, at in zip(items, values, known, strict=True)]
    if sum(map(len, values)) < 256:
        return None
    low = min(float(y.min()) for y in places if len(y))
    span = max(float(y.max()) for y in places if len(y)) - low
    if span == 0.0:
        return None
    summed = np.zeros(BINS)
    for y, e in zip(places, values, strict=True):
        if len(e):
            at = np.minimum(((y - low) / span * BINS).astype(int), BINS - 1)
            summed += np.bincount(at, e - e.mean(), BINS)
    # four times as long: pitches between whole parts of the range
    power = np.abs(np.fft.rfft(summed, 4 * BINS)) ** 2
    power[: 4 * PERIODS] = 0.0
    power[2 * BINS // 4 :] = 0.0
    for k in _highest(power, 3):
        around = np.concatenate([power[max(k - 160, 4 * PERIODS) : k - 12], power[k + 13 : k + 160]])
        if not len(around) or power[k] <= STANDS * float(np.median(around)):
            continue
        pitch = _pitch(places, values, 4.0 * span / k)
        found = _ripple(items, errors, places, values, pitch)
        if found is not None:
            return found
    return None


def _highest(power: Array, most: int) -> list[int]:
    found: list[int] = []
    for k in np.argsort(power)[::-1].tolist():
        if len(found) == most or power[k] == 0.0:
            break
        if all(abs(k - other) > 8 for other in found):
            found.append(k)
    return found


def _pitch(places: Sequence[Array], values: Sequence[Array], pitch: float) -> float:
    """The pitch that takes most out of the errors."""
    y, e = np.concatenate(list(places)), np.concatenate([v - v.mean() for v in values if len(v)])
    span = float(np.ptp(y))
    candidates = 1.0 / (1.0 / pitch + np.linspace(-0.5, 0.5, 21) / span)
    return float(max(candidates, key=lambda p: abs(np.exp(2j * np.pi * y / p) @ e)))


def _ripple(
    items: Sequence[Item], errors: Sequence[Array], places: Sequence[Array], values: Sequence[Array], pitch: float
) -> Line | None:
    """The ripple, where what the other records say of it holds in most of those that travel over several pitches."""
    tables = [
        np.column_stack([np.cos(2.0 * np.pi * y / pitch), np.sin(2.0 * np.pi * y / pitch)]) for y in places
    ]
    parts = [k for k, y in enumerate(places) if len(y) > 64 and np.ptp(y) > 3.0 * pitch]
    pieces = [(tables[k], values[k] - values[k].mean()) for k in parts]
    if len(pieces) == 1:
        table, e = pieces[0]
        half = len(e) // 2
        pieces = [(table[:half], e[:half]), (table[half:], e[half:])]
    if not pieces:
        return None
    squares = [(x.T @ x, x.T @ e) for x, e in pieces]
    matrix, right = sum(s[0] for s in squares), sum(s[1] for s in squares)
    holds = 0
    for (x, e), (own, own_right) in zip(pieces, squares, strict=True):
        told = np.linalg.lstsq(matrix - own, right - own_right, rcond=None)[0]
        holds += bool(np.sum((e - x @ told) ** 2) < (1.0 - SHARE) * np.sum(e**2))
    solution = np.linalg.lstsq(matrix, right, rcond=None)[0]
    if holds < 0.6 * len(pieces):
        return None
    after = []
    for error, table in zip(errors, tables, strict=True):
        e = error.copy()
        e[np.isfinite(e)] -= table @ solution
        after.append(e)
    share = _share(errors, after)
    if share < SHARE:
        return None
    told = {
        "kind": "ripple",
        "pitch": float(f"{pitch:.4g}"),
        "amplitude": float(np.hypot(solution[0], solution[1])),
        "share": share,
        "records": [items[k].name for k in parts],
    }
    return Line(told, after, share)
