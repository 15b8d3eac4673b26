"""Lines over time in what a model leaves: mains hum and other steady tones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data import spectra
from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.findings.kinds import Line, Ripple
from hystgen.diagnosis.search import acceptance

Array = NDArray[np.float64]

MAINS = (50.0, 60.0)
"""Hz: the world's mains frequencies."""

MAINS_HARMONICS = (1, 2, 3, 5)


@dataclass(frozen=True)
class Removed:
    """A line or ripple, the errors without it, and the share of the variance of all errors that it takes."""

    finding: Line | Ripple
    errors: list[Array]
    share: float


def removed_share(before: Sequence[Array], after: Sequence[Array]) -> float:
    """Share of the power of some errors that is gone in others."""
    total = _power(before)
    return 1.0 - _power(after) / total if total > 0.0 else 0.0


def _power(errors: Sequence[Array]) -> float:
    return float(sum(np.nansum(e**2) for e in errors))


def in_time(items: Sequence[Item], errors: Sequence[Array]) -> Removed | None:
    """The strongest line that is in most of the records long enough for it, or that rules a few."""
    found: list[tuple[float, float, int]] = []
    for k, (item, error) in enumerate(zip(items, errors, strict=True)):
        found += [(share, frequency, k) for share, frequency in spectra.peaks(item, error)]
    times = [item.run.t[np.isfinite(e)] for item, e in zip(items, errors, strict=True)]
    lengths = [float(np.ptp(t)) if len(t) > acceptance.LINE_SAMPLES else 0.0 for t in times]
    rates = [1.0 / float(np.median(np.diff(item.run.t))) for item in items]
    best: tuple[float, float, list[int], list[int]] | None = None
    for _, frequency, k in found:
        near = [p for p in found if abs(p[1] - frequency) < acceptance.SAME_BINS / min(lengths[p[2]], lengths[k])]
        seen = sorted({p[2] for p in near})
        able = [
            j for j, n in enumerate(lengths)
            if n * frequency >= acceptance.LINE_PERIODS and 2.0 * frequency <= rates[j]
        ]  # fmt: skip
        strength = sum(p[0] for p in near)
        common = len(seen) >= max(2, acceptance.SEEN_IN * len(able)) or len(able) == len(seen)
        rules = min(p[0] for p in near) > acceptance.RULING_SHARE
        if (common or rules) and (best is None or strength > best[0]):
            longest = max(near, key=lambda p: lengths[p[2]])  # the frequency is sharpest there
            best = strength, longest[1], seen, able
    if best is None:
        return None
    _, frequency, seen, able = best
    frequency = _refined(items, errors, frequency, seen, lengths)
    after, sizes, has = [], [], []
    for k, (item, error) in enumerate(zip(items, errors, strict=True)):
        if lengths[k] * frequency < 2.0:  # less than two periods are no line
            after.append(error)
            continue
        e, size = _without(error, _phase(item, frequency))
        after.append(e)
        if k in seen or (k in able and removed_share([error], [e]) > acceptance.LINE_SHARE):
            has.append(k)
        # two samples a period do not show the amplitude
        resolved = acceptance.AMPLITUDE_SAMPLES * frequency
        if k in seen and (resolved < rates[k] or all(resolved > rates[j] for j in seen)):
            sizes.append(size)
    finding = Line(
        frequency=float(f"{frequency:.4g}"),
        amplitude=float(np.median(sizes)),
        share=removed_share([errors[k] for k in has], [after[k] for k in has]),
        records=tuple(dict.fromkeys(items[k].name for k in has)),
        mains=_mains(frequency, 0.5 / max(lengths[k] for k in seen)),
    )
    return Removed(finding, after, removed_share(errors, after))


def _mains(frequency: float, width: float) -> float | str | None:
    """The mains frequency that a line belongs to, or which harmonic of it the line is; `width`: its uncertainty, Hz."""
    for mains in MAINS:
        for n in MAINS_HARMONICS:
            if abs(frequency - n * mains) < max(width, acceptance.MAINS_TOLERANCE * frequency):
                return mains if n == 1 else f"{n} x {mains:g} Hz"
    return None


def steady(items: Sequence[Item], errors: Sequence[Array]) -> Removed | None:
    """The strongest line, if in most of the records that have it one half predicts the line of the other half.

    An actuator answers with the lines of its drive, which are excluded, or it rings and fades.
    """
    line = in_time(items, errors)
    if line is None or not isinstance(line.finding, Line):
        return None
    holds = 0
    having = [k for k, item in enumerate(items) if item.name in line.finding.records]
    for k in having:
        known = np.isfinite(errors[k])
        phase, e = _phase(items[k], line.finding.frequency)[known], errors[k][known]
        table = np.column_stack([np.cos(phase), np.sin(phase), np.ones(len(e))])
        half = len(e) // 2
        removed = 0.0
        for here, other in ((slice(half), slice(half, None)), (slice(half, None), slice(half))):
            wave = table[other, :2] @ np.linalg.lstsq(table[here], e[here], rcond=None)[0][:2]
            rest = e[other] - e[other].mean()
            removed += float(np.sum(rest**2) - np.sum((rest - wave) ** 2))
        own = np.sum((e - e.mean()) ** 2) - np.nansum(_without(e, phase)[0] ** 2)
        holds += bool(removed > acceptance.STEADY_SHARE * own)
    return line if holds >= acceptance.COMMON_SHARE * len(having) else None


def _refined(
    items: Sequence[Item], errors: Sequence[Array], frequency: float, seen: Sequence[int], lengths: Sequence[float]
) -> float:
    """The frequency at which a sine removes most of the errors."""
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
