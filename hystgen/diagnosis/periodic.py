"""Lines in what a model leaves: over time (mains hum) and over the position (the pitch of a sensor)."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.floor import HOLD, still
from hystgen.diagnosis.structure import Item

Array = NDArray[np.float64]

STANDS = 30.0
"""A line stands so many times above the median of its surroundings, in power."""

SHARE, RULES = 0.03, 0.3
"""Least share of the residual variance in a line, and in one that rules: it may be in a few of the records alone, and
hum or a ripple is taken out before effects are sought. What effects leave that are not found yet may look like a weak
one."""

COMMON = 0.6
"""Share of the records, or of the ways, in which a line has to hold."""

STAYS = 0.5
"""A line is steady where what one half of a record tells of it takes so much of the other as their own one does."""

OWN, PEAK = 1e-6, 10.0
"""A line is the drive's own where that has so much of its power there, and so many times its surroundings'."""

CARRIED, HARMONICS = 0.5, 10
"""A drive that has at least this share of its power in one line answers with that line's harmonics, these of them: its
swing may change from turn to turn, so that it does not repeat itself, and an actuator bends it all the same."""

PERIODS = 8
"""Fewest periods in a record for a line to be seen, and fewest pitches in the travel."""

MOST = 4

PARTS = 8, 64
"""Parts of a record whose mean spectra show what fades."""

WHOLE, PART = 40, 12
"""Bins on either side of a peak that are its surroundings, in the spectrum of a record and in those of its parts."""

LEAST = 256
"""Samples from which on a record, or a part of it, has a spectrum."""

CLOSE = 0.02
"""Frequencies of ringing that differ by less are the same."""

RESOLVED = 0.25
"""A sample tells of a ripple where the position moves by less than this share of its pitch."""

OF_THE_CONVERTER = 0.02
"""A pitch that is the least step of the output within this share is that of the converter's codes."""

ENOUGH = 20_000
"""Samples from which a pitch is told."""

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
    return _strongest_first(items, errors, (_in_time, _in_position), 0.0)


def ruling(items: Sequence[Item], errors: Sequence[Array]) -> tuple[list[dict[str, Any]], list[Array]]:
    """The same of lines that rule the errors and are none of the actuator: steady ones, and those over the position."""
    return _strongest_first(items, errors, (_steady, _in_position), RULES)


def _strongest_first(
    items: Sequence[Item],
    errors: Sequence[Array],
    ways: Sequence[Callable[[Sequence[Item], Sequence[Array]], Line | None]],
    least: float,
) -> tuple[list[dict[str, Any]], list[Array]]:
    left, told = list(errors), []
    for _ in range(MOST):
        found = [line for line in (way(items, left) for way in ways) if line is not None and line.share >= least]
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
        if (common or min(p[0] for p in near) > RULES) and (best is None or strength > best[0]):
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
        "records": list(dict.fromkeys(items[k].name for k in has)),
    }
    width = 0.5 / max(lengths[k] for k in seen)
    order = [(f, n) for f in MAINS for n in (1, 2, 3, 5) if abs(frequency - n * f) < max(width, 0.002 * frequency)]
    if order:
        mains, n = order[0]
        told["mains"] = mains if n == 1 else f"{n} x {mains:g} Hz"
    return Line(told, after, _share(errors, after))


def _steady(items: Sequence[Item], errors: Sequence[Array]) -> Line | None:
    """The strongest line, where one half of a record tells what it is in the other, in most of those that have it.

    An actuator answers with the lines of its drive, which are none of these, or rings and fades.
    """
    line = _in_time(items, errors)
    if line is None:
        return None
    holds = 0
    having = [k for k, item in enumerate(items) if item.name in line.told["records"]]
    for k in having:
        known = np.isfinite(errors[k])
        phase, e = _phase(items[k], line.told["frequency"])[known], errors[k][known]
        table = np.column_stack([np.cos(phase), np.sin(phase), np.ones(len(e))])
        half = len(e) // 2
        removed = 0.0
        for here, there in ((slice(half), slice(half, None)), (slice(half, None), slice(half))):
            wave = table[there, :2] @ np.linalg.lstsq(table[here], e[here], rcond=None)[0][:2]
            rest = e[there] - e[there].mean()
            removed += float(np.sum(rest**2) - np.sum((rest - wave) ** 2))
        own = np.sum((e - e.mean()) ** 2) - np.nansum(_without(e, phase)[0] ** 2)
        holds += bool(removed > STAYS * own)
    return line if holds >= COMMON * len(having) else None


def peaks(item: Item, error: Array) -> list[tuple[float, float]]:
    """Share and frequency of narrow peaks of one residual that are no multiples of what the drive does."""
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
        beside = slice(max(k - 2, 0), k + 3)
        share = float(np.sum(power[beside])) / total
        if power[k] > STANDS * _around(power, k, WHOLE) and share > SHARE:
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
        if float(np.sum(drive[beside])) >= OWN * driven and drive[k] > PEAK * _around(drive, k, WHOLE):
            continue
        if period is not None and abs(k * period / n - round(k * period / n)) * n / period < 1.5:
            continue  # a harmonic of the drive
        if carrier is not None and k < (HARMONICS + 0.5) * carrier and abs(k - round(k / carrier) * carrier) < 1.5:
            continue
        if not any(abs(other - k / (n * step)) < 4.0 / (n * step) for _, other in found):
            found.append((share, k / (n * step)))
    return found


def _filled(item: Item, error: Array) -> tuple[Array, float] | None:
    """An error with its gaps bridged, and the time between samples; None where too few of them are compared."""
    known = np.isfinite(error)
    if np.count_nonzero(known) < LEAST:
        return None
    step = float(np.median(np.diff(item.run.t)))
    return np.interp(np.arange(len(error)), np.flatnonzero(known), error[known]), step


def _crests(power: Array) -> list[int]:
    """Bins of the highest local maxima of a spectrum."""
    highest = np.argsort(power)[::-1][:5].tolist()
    return [k for k in highest if k >= PERIODS and power[k] > 0.0 and power[k] >= np.max(power[k - 1 : k + 2])]


def _around(power: Array, k: int, reach: int) -> float:
    """The median of a spectrum on both sides of a bin."""
    return float(np.median(np.concatenate([power[max(k - reach, 1) : k - 3], power[k + 4 : k + reach]])))


def _carrier(power: Array) -> float | None:
    """Place of the line that holds most of a windowed drive's power, in bins; None where none holds so much."""
    k = int(np.argmax(power))
    near = np.arange(max(k - 2, 0), min(k + 3, len(power)))
    held = float(np.sum(power[near]))
    return float(near @ power[near]) / held if k and held >= CARRIED * float(np.sum(power)) else None


def ringing(items: Sequence[Item], errors: Sequence[Array], most: int) -> tuple[float, ...]:
    """The frequencies of narrow peaks in any record and of what fades, the strongest first, close ones once."""
    each = ([*peaks(item, error), *_fading(item, error)] for item, error in zip(items, errors, strict=True))
    found = sorted(itertools.chain(*each), reverse=True)
    kept: list[float] = []
    for _, frequency in found:
        if len(kept) < most and all(abs(frequency / other - 1.0) > CLOSE for other in kept):
            kept.append(frequency)
    return tuple(kept)


def _fading(item: Item, error: Array) -> list[tuple[float, float]]:
    """Share and frequency of the highest peaks in mean spectra of a record's parts.

    What rings and fades is too broad to be a peak in the spectrum of the whole.
    """
    from scipy.signal import welch

    filled = _filled(item, error)
    if filled is None:
        return []
    e, step = filled
    found: list[tuple[float, float]] = []
    for size in (len(e) // parts for parts in PARTS):
        if size < LEAST:
            continue
        places, power = welch(e, 1.0 / step, nperseg=size)
        high = [k for k in _crests(power) if power[k] > PEAK * _around(power, k, PART)]
        if not high:
            continue
        drive = welch(item.run.v, 1.0 / step, nperseg=size)[1]
        for k in high:
            if drive[k] <= PEAK * _around(drive, k, PART):
                share = float(np.sum(power[k - 2 : k + 3]) / np.sum(power))
                found.append((share, float(np.average(places[k - 1 : k + 2], weights=power[k - 1 : k + 2]))))
    return found


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


@dataclass(frozen=True)
class _Course:
    """A record as a ripple sees it: predicted places of the samples that are compared, what is left there, and how far
    up or down the prediction moves from the sample before, NaN where the drive holds.

    There one place is measured again and again, and the model has been bent to meet it. The measured position would not
    do: a ripple that is large against its pitch is no sine over itself.
    """

    at: NDArray[np.bool_]
    places: Array
    left: Array
    moves: Array

    @classmethod
    def of(cls, item: Item, error: Array) -> _Course:
        """The course of a record."""
        at = np.isfinite(error) & np.isfinite(item.y)
        predicted = item.y - error
        moves = np.diff(predicted, prepend=np.nan)
        for first, last in still(item.run.v, HOLD):
            moves[first + 1 : last] = np.nan
        return cls(at, predicted[at], error[at], moves[at])

    def tells(self, pitch: float) -> NDArray[np.bool_]:
        """The samples that resolve a ripple of this pitch."""
        return np.asarray(np.abs(self.moves) < RESOLVED * pitch)


def _in_position(items: Sequence[Item], errors: Sequence[Array]) -> Line | None:
    """A ripple with a fixed pitch over the predicted position, of the same phase in all records."""
    courses = [_Course.of(item, error) for item, error in zip(items, errors, strict=True)]
    if sum(len(course.places) for course in courses) < LEAST:
        return None
    low = min(float(course.places.min()) for course in courses if len(course.places))
    span = max(float(course.places.max()) for course in courses if len(course.places)) - low
    if span == 0.0:
        return None
    summed = np.zeros(BINS)
    for course in courses:
        now = course.tells(span / PERIODS)
        if now.any():
            place = np.minimum(((course.places[now] - low) / span * BINS).astype(int), BINS - 1)
            summed += np.bincount(place, course.left[now] - course.left[now].mean(), BINS)
    # four times as long: pitches between whole parts of the range
    power = np.abs(np.fft.rfft(summed, 4 * BINS)) ** 2
    power[: 4 * PERIODS] = 0.0
    power[2 * BINS // 4 :] = 0.0
    for k in _highest(power, 3):
        around = np.concatenate([power[max(k - 160, 4 * PERIODS) : k - 12], power[k + 13 : k + 160]])
        if not len(around) or power[k] <= STANDS * float(np.median(around)):
            continue
        found = _ripple(items, errors, courses, _pitch(courses, 4.0 * span / k))
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


def _pitch(courses: Sequence[_Course], pitch: float) -> float:
    """The pitch whose ripple takes most out of the errors."""
    parts = [(course, now) for course, now in ((course, course.tells(pitch)) for course in courses) if now.any()]
    if not parts:
        return pitch
    every = max(1, sum(int(np.count_nonzero(now)) for _, now in parts) // ENOUGH)
    y = np.concatenate([course.places[now][::every] for course, now in parts])
    e = np.concatenate([course.left[now][::every] - course.left[now].mean() for course, now in parts])

    def removed(waves: float) -> float:
        table = np.column_stack([np.cos(2.0 * np.pi * waves * y), np.sin(2.0 * np.pi * waves * y)])
        right = table.T @ e
        return float(right @ np.linalg.lstsq(table.T @ table, right, rcond=None)[0])

    best, step = 1.0 / pitch, 0.05 / max(float(np.ptp(y)), pitch)
    for _ in range(2):
        places = best + step * np.arange(-10, 11)
        best, step = float(max(places, key=removed)), 0.1 * step
    return 1.0 / best


def _ripple(items: Sequence[Item], errors: Sequence[Array], courses: Sequence[_Course], pitch: float) -> Line | None:
    """The ripple, where what others say of it holds in most of the ways up and down over several pitches.

    What a lag or a loop leaves is another one on the way back.
    """
    tables = [
        np.column_stack([np.cos(2.0 * np.pi * course.places / pitch), np.sin(2.0 * np.pi * course.places / pitch)])
        for course in courses
    ]
    pieces, parts = [], []
    for k, (course, table) in enumerate(zip(courses, tables, strict=True)):
        for way in (1.0, -1.0):
            now = course.tells(pitch) & (way * course.moves > 0.0)
            if np.count_nonzero(now) > 32 and np.sum(np.abs(course.moves[now])) > 3.0 * pitch:
                pieces.append((table[now], course.left[now] - course.left[now].mean()))
                parts.append(k)
    if len(pieces) < 2:
        return None
    squares = [(x.T @ x, x.T @ e) for x, e in pieces]
    matrix, right = sum(s[0] for s in squares), sum(s[1] for s in squares)
    holds = 0
    for (x, e), (own, own_right) in zip(pieces, squares, strict=True):
        told = np.linalg.lstsq(matrix - own, right - own_right, rcond=None)[0]
        holds += bool(np.sum((e - x @ told) ** 2) < (1.0 - SHARE) * np.sum(e**2))
    solution = np.linalg.lstsq(matrix, right, rcond=None)[0]
    if holds < COMMON * len(pieces):
        return None
    share = _share([e for _, e in pieces], [e - x @ solution for x, e in pieces])
    if share < SHARE:
        return None
    after = []
    for error, course, table in zip(errors, courses, tables, strict=True):
        e = error.copy()
        e[course.at] -= table @ solution
        after.append(e)
    told = {
        "kind": "ripple",
        "pitch": float(f"{pitch:.4g}"),
        "amplitude": float(np.hypot(solution[0], solution[1])),
        "share": share,
        "records": list(dict.fromkeys(items[k].name for k in parts)),
        "converter_step": all(abs(_grain(items[k].y) / pitch - 1.0) < OF_THE_CONVERTER for k in parts),
    }
    return Line(told, after, share)


def _grain(y: Array) -> float:
    """The least step between two outputs that occur."""
    return float(np.min(np.diff(np.unique(y[np.isfinite(y)])), initial=np.inf))
