"""A ripple with a fixed pitch over the position in what a model leaves: interpolation errors and converter steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.data.lines import Removed, removed_share
from hystgen.diagnosis.data.noise_floor import still
from hystgen.diagnosis.findings.kinds import Ripple
from hystgen.diagnosis.search import acceptance

Array = NDArray[np.float64]

MOST_SAMPLES = 20_000
"""Samples that a pitch is refined with: it is then as fine as the noise allows."""

FINER = 4
"""Zero padding of the spectrum over position, so that pitches between whole parts of the range have a bin."""


@dataclass(frozen=True)
class _Motion:
    """The motion of a record, at the samples `at` that are compared.

    `places`: predicted positions; `left`: errors; `moves`: how far the prediction moves from the sample before, NaN
    where the drive holds: there one position is measured again and again, and the model has been fitted to it. The
    measured position would not do: a ripple that is large against its pitch is no sine over itself.
    """

    at: NDArray[np.bool_]
    places: Array
    left: Array
    moves: Array

    @classmethod
    def of(cls, item: Item, error: Array) -> _Motion:
        """The motion of a record."""
        at = np.isfinite(error) & np.isfinite(item.y)
        predicted = item.y - error
        moves = np.diff(predicted, prepend=np.nan)
        for first, last in still(item.run.v, acceptance.HOLD_SAMPLES):
            moves[first + 1 : last] = np.nan
        return cls(at, predicted[at], error[at], moves[at])

    def resolves(self, pitch: float) -> NDArray[np.bool_]:
        """The samples that resolve a ripple of this pitch."""
        return np.asarray(np.abs(self.moves) < acceptance.RIPPLE_RESOLVED * pitch)


def in_position(items: Sequence[Item], errors: Sequence[Array]) -> Removed | None:
    """A ripple over the predicted position, with the same phase in all records."""
    motions = [_Motion.of(item, error) for item, error in zip(items, errors, strict=True)]
    if sum(len(motion.places) for motion in motions) < acceptance.SPECTRUM_SAMPLES:
        return None
    low = min(float(motion.places.min()) for motion in motions if len(motion.places))
    span = max(float(motion.places.max()) for motion in motions if len(motion.places)) - low
    if span == 0.0:
        return None
    bins, periods = acceptance.POSITION_BINS, acceptance.LINE_PERIODS
    summed = np.zeros(bins)
    for motion in motions:
        now = motion.resolves(span / periods)
        if now.any():
            place = np.minimum(((motion.places[now] - low) / span * bins).astype(int), bins - 1)
            summed += np.bincount(place, motion.left[now] - motion.left[now].mean(), bins)
    power = np.abs(np.fft.rfft(summed, FINER * bins)) ** 2
    power[: FINER * periods] = 0.0
    power[2 * bins // FINER :] = 0.0
    reach, away = FINER * acceptance.SURROUNDINGS, FINER * 3
    for k in _highest(power, acceptance.PITCHES):
        around = np.concatenate(
            [power[max(k - reach, FINER * periods) : k - away], power[k + away + 1 : k + reach]]
        )
        if not len(around) or power[k] <= acceptance.LINE_HEIGHT * float(np.median(around)):
            continue
        found = _ripple(items, errors, motions, _pitch(motions, FINER * span / k))
        if found is not None:
            return found
    return None


def _highest(power: Array, most: int) -> list[int]:
    found: list[int] = []
    for k in np.argsort(power)[::-1].tolist():
        if len(found) == most or power[k] == 0.0:
            break
        if all(abs(k - other) > 2 * FINER for other in found):
            found.append(k)
    return found


def _pitch(motions: Sequence[_Motion], pitch: float) -> float:
    """The pitch whose ripple removes most of the errors."""
    parts = [(motion, now) for motion, now in ((motion, motion.resolves(pitch)) for motion in motions) if now.any()]
    if not parts:
        return pitch
    every = max(1, sum(int(np.count_nonzero(now)) for _, now in parts) // MOST_SAMPLES)
    y = np.concatenate([motion.places[now][::every] for motion, now in parts])
    e = np.concatenate([motion.left[now][::every] - motion.left[now].mean() for motion, now in parts])

    def removed(waves: float) -> float:
        table = np.column_stack([np.cos(2.0 * np.pi * waves * y), np.sin(2.0 * np.pi * waves * y)])
        right = table.T @ e
        return float(right @ np.linalg.lstsq(table.T @ table, right, rcond=None)[0])

    best, step = 1.0 / pitch, 0.05 / max(float(np.ptp(y)), pitch)
    for _ in range(2):
        places = best + step * np.arange(-10, 11)
        best, step = float(max(places, key=removed)), 0.1 * step
    return 1.0 / best


def _ripple(
    items: Sequence[Item], errors: Sequence[Array], motions: Sequence[_Motion], pitch: float
) -> Removed | None:
    """The ripple, if the ripple of all other passes holds in most of the passes up and down over several pitches.

    What a lag or a loop leaves differs between the way up and the way down.
    """
    tables = [
        np.column_stack([np.cos(2.0 * np.pi * motion.places / pitch), np.sin(2.0 * np.pi * motion.places / pitch)])
        for motion in motions
    ]
    pieces, parts = [], []
    for k, (motion, table) in enumerate(zip(motions, tables, strict=True)):
        for way in (1.0, -1.0):
            now = motion.resolves(pitch) & (way * motion.moves > 0.0)
            passed = np.sum(np.abs(motion.moves[now])) / pitch
            if np.count_nonzero(now) > acceptance.PASS_SAMPLES and passed > acceptance.PASS_PITCHES:
                pieces.append((table[now], motion.left[now] - motion.left[now].mean()))
                parts.append(k)
    if len(pieces) < 2:
        return None
    squares = [(x.T @ x, x.T @ e) for x, e in pieces]
    matrix, right = sum(s[0] for s in squares), sum(s[1] for s in squares)
    holds = 0
    for (x, e), (own, own_right) in zip(pieces, squares, strict=True):
        others = np.linalg.lstsq(matrix - own, right - own_right, rcond=None)[0]
        holds += bool(np.sum((e - x @ others) ** 2) < (1.0 - acceptance.LINE_SHARE) * np.sum(e**2))
    solution = np.linalg.lstsq(matrix, right, rcond=None)[0]
    if holds < acceptance.COMMON_SHARE * len(pieces):
        return None
    share = removed_share([e for _, e in pieces], [e - x @ solution for x, e in pieces])
    if share < acceptance.LINE_SHARE:
        return None
    after = []
    for error, motion, table in zip(errors, motions, tables, strict=True):
        e = error.copy()
        e[motion.at] -= table @ solution
        after.append(e)
    finding = Ripple(
        pitch=float(f"{pitch:.4g}"),
        amplitude=float(np.hypot(solution[0], solution[1])),
        share=share,
        records=tuple(dict.fromkeys(items[k].name for k in parts)),
        converter_step=all(abs(_step(items[k].y) / pitch - 1.0) < acceptance.CONVERTER_STEP for k in parts),
    )
    return Removed(finding, after, share)


def _step(y: Array) -> float:
    """The smallest step between two outputs that occur."""
    return float(np.min(np.diff(np.unique(y[np.isfinite(y)])), initial=np.inf))
