"""Records prepared for comparison with a model, with all usable samples or with fewer.

Within a stretch where drive and plays are linear, no samples are needed, since plays depend only on turning points and
filters are exact for linear inputs.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.search import acceptance
from hystgen.effects.base import Run
from hystgen.identification.joint import DIFFERENCE
from hystgen.identification.reduction import Course, StartMemory

Array = NDArray[np.float64]
Samples = slice | NDArray[np.intp]
Mask = NDArray[np.bool_]

MOVEMENTS = 5, 2**25
"""Maximum number of play movements cached for a record, and their total size in bytes."""

DIFFERENCES = 12, 2**25
"""The same limits for errors before free offsets are fitted; each hypothesis of a round is compared with others."""

COMPARISONS = 40, 2**23
"""The same limits for errors after the free offsets and start states are fitted."""

ROUNDED = float(np.finfo(np.float64).eps) ** 0.5
"""Smallest relative change in a value for a difference quotient, so that the slope keeps half of the digits."""


class Recent:
    """A cache of the most recently used arrays, by key: at most `most` arrays with `most_bytes` in total."""

    def __init__(self, most: int, most_bytes: int) -> None:
        self._most, self._most_bytes = most, most_bytes
        self._arrays: dict[object, Array] = {}

    def recalled(self, by: object) -> Array | None:
        """The array under a key, or None."""
        if by not in self._arrays:
            return None
        self._arrays[by] = found = self._arrays.pop(by)  # moved to the end: most recently used
        return found

    def kept(self, by: object, make: Callable[[], Array]) -> Array:
        """The array under a key, computed if it is missing; the least recently used arrays are dropped to make room."""
        found = self.recalled(by)
        if found is not None:
            return found
        found, arrays = make(), self._arrays
        while arrays and (len(arrays) >= self._most or found.nbytes * (len(arrays) + 1) > self._most_bytes):
            del arrays[next(iter(arrays))]
        if found.nbytes <= self._most_bytes:
            arrays[by] = found
        return found


@dataclass(frozen=True)
class Item:
    """A record to compare. `y`: NaN at samples left out; `history`: drive values before the record, None if unknown.

    `timed`: whether the record's times are known. `turns`: drive values that bring virgin plays to the start memory
    found without a history, if any. `session`: all records on one time axis, if they form a session; `part`: this
    record's samples in the session. Three caches: `moved`, movements of the plays, which most parameters of a search
    leave unchanged; `residuals`, errors before the free offsets are fitted; `errors`, errors with fitted offsets.
    """

    name: str
    run: Run
    y: Array
    history: tuple[float, ...] | None
    output_range: float
    session: Run | None = None
    part: slice = field(default_factory=lambda: slice(None))
    turns: tuple[float, ...] | None = None
    timed: bool = True
    moved: Recent = field(default_factory=lambda: Recent(*MOVEMENTS), init=False, repr=False, compare=False)
    residuals: Recent = field(default_factory=lambda: Recent(*DIFFERENCES), init=False, repr=False, compare=False)
    errors: Recent = field(default_factory=lambda: Recent(*COMPARISONS), init=False, repr=False, compare=False)

    @property
    def visited(self) -> tuple[float, ...] | None:
        """Drive values that bring virgin plays to the start memory; None if that is neither known nor found."""
        return self.turns if self.history is None else self.history

    @cached_property
    def known(self) -> NDArray[np.bool_]:
        """The samples that are compared."""
        return np.isfinite(self.y)

    @cached_property
    def compared(self) -> Samples:
        """Indices of the compared samples, or a slice if they are evenly spaced, which avoids a copy."""
        found = np.flatnonzero(self.known)
        steps = np.diff(found)
        if not len(steps) or np.any(steps != steps[0]):
            return found
        return slice(int(found[0]), int(found[-1]) + 1, int(steps[0]))

    @property
    def course(self) -> Course:
        """The record in the form that `identify` compares."""
        samples = np.flatnonzero(self.known)
        first, last = (int(samples[0]), int(samples[-1]) + 1) if len(samples) else (0, 0)
        start = None if self.turns is None else StartMemory(self.turns, 0.0)
        return Course(self.name, self.run.v, self.y, self.history, first, last, first, start=start)

    def step(self, h: Array) -> float:
        """Step with which to find a map's slope by differences around a predicted output (N,), output units.

        The usual fraction of the measured range, but large enough to survive the output's rounding, since the range is
        zero if the drive rests or only one sample is compared.
        """
        largest = max(float(np.max(np.abs(x), initial=0.0)) for x in (h, self.y[self.known]))
        return float(max(DIFFERENCE * self.output_range, ROUNDED * largest, 1e-300))

    def picked(self, rows: Array) -> Array:
        """The compared samples of rows (k, N), as a contiguous array."""
        if isinstance(self.compared, slice):
            return np.ascontiguousarray(rows[:, self.compared])
        return rows.take(self.compared, axis=1)


def rms(errors: Sequence[Array]) -> float:
    """rms over all compared samples of all records."""
    joined = np.concatenate(list(errors))
    joined = joined[np.isfinite(joined)]
    return float(np.sqrt(np.mean(joined**2))) if len(joined) else float("nan")


def compared(items: Sequence[Item]) -> tuple[int, int]:
    """Number of samples compared, and number recorded."""
    found = [mask for _, mask in masks(items)]
    return sum(int(np.count_nonzero(mask)) for mask in found), sum(map(len, found))


def masks(items: Sequence[Item]) -> list[tuple[str, Mask]]:
    """Each record's name and a mask of its compared samples; the two parts of a record may be separate items."""
    found: dict[int, tuple[str, Mask]] = {}
    for item in items:
        _, others = found.get(id(item.run), ("", np.zeros(len(item.known), dtype=bool)))
        found[id(item.run)] = item.name, item.known | others
    return list(found.values())


class FittedLike(Protocol):
    """What checks of the records need to know about a fitted model."""

    @property
    def reach(self) -> float:
        """The largest threshold, input units."""

    def errors(self, items: Sequence[Item]) -> list[Array]:
        """Measured minus predicted, (N,) for each record; NaN at samples that are not compared."""


# Fewer samples to search with --------------------------------------------------------------------------------


def needed(items: Sequence[Item], errors: Sequence[Array], noise: float) -> list[Mask]:
    """Masks of the samples whose omission would change the prediction at the others noticeably relative to the noise.

    `errors`: errors of a model over the records, NaN where unknown.
    """
    return [_needed(item, residual, noise) for item, residual in zip(items, errors, strict=True)]


def _needed(item: Item, residual: Array, noise: float) -> Mask:
    run, known, number = item.run, np.isfinite(residual), len(item.run.t)
    if np.count_nonzero(known) < 2:
        return np.ones(number, dtype=bool)
    residual, predicted = (np.interp(run.t, run.t[known], x[known]) for x in (residual, item.y - residual))
    as_drive = float(np.ptp(run.v)) / max(float(np.ptp(predicted)), 1e-300)
    bends = [  # signal, limit on its deviation from a straight line, and whether that limit is an rms or a maximum
        (predicted, acceptance.THIN_STRAIGHT * noise, False),
        (run.v, acceptance.THIN_STRAIGHT * noise * as_drive, False),
        (residual, acceptance.THIN_RESIDUAL * noise, True),
        *((column, acceptance.THIN_COLUMN * float(np.ptp(column)), True) for column in run.extra.values()),
    ]
    found, straight = np.zeros(number, dtype=bool), np.zeros(number, dtype=bool)
    size = acceptance.THIN_STEPS
    while size > 1:
        first = np.arange(0, number, size)
        ends, sizes = np.append(first, number - 1), np.diff(np.append(first, number))
        here = np.ones(len(first), dtype=bool)
        for x, most, typical in bends:
            off = np.abs(x - np.interp(run.t, run.t[ends], x[ends]))
            much = np.sqrt(np.add.reduceat(off**2, first) / sizes) if typical else np.maximum.reduceat(off, first)
            here &= much <= most
        now = np.repeat(here, sizes) & ~straight
        found[first[now[first]]] = True
        straight |= now
        size //= 2
    found |= ~straight
    found[[0, -1]] = True
    turns = np.flatnonzero(np.diff(np.sign(np.diff(run.v)))) + 1  # plays remember turning points
    kept = np.flatnonzero(found)
    beyond = np.abs(run.v[turns] - np.interp(run.t[turns], run.t[kept], run.v[kept]))
    found[turns[beyond > acceptance.THIN_TURNING * noise * as_drive]] = True
    return found


def everything(groups: Sequence[Sequence[Item]]) -> list[list[Mask]]:
    """Masks that keep every sample."""
    return [[np.ones(len(item.run.t), dtype=bool) for item in group] for group in groups]


def thinned(groups: Sequence[Sequence[Item]], most: int, masks: Sequence[Sequence[Mask]]) -> list[list[Item]]:
    """Groups of records, each thinned to at most `most` samples: the needed ones and evenly spaced ones.

    `masks`: the needed samples of each record. If all groups are small enough, they are returned unchanged.
    """
    every = [max(1, -(-sum(int(np.count_nonzero(item.known)) for item in group) // most)) for group in groups]
    if max(every) == 1:
        return [list(group) for group in groups]
    kept: dict[int, Mask] = {}  # keyed by run, since two items may be parts of the same record
    for group, step, needs in zip(groups, every, masks, strict=True):
        for item, mask in zip(group, needs, strict=True):
            keep = mask.copy()
            keep[::step] = True
            kept[id(item.run)] = keep | kept.get(id(item.run), False)
    sessions: dict[int, tuple[Run, Mask]] = {}
    for item in itertools.chain(*groups):
        if item.session is not None:
            _, whole = sessions.setdefault(id(item.session), (item.session, np.ones(len(item.session.t), dtype=bool)))
            whole[item.part] = kept[id(item.run)]
    picked = {key: (run.picked(np.flatnonzero(mask)), np.cumsum(mask)) for key, (run, mask) in sessions.items()}
    runs: dict[int, Run] = {}

    def less(item: Item, step: int) -> Item:
        keep = kept[id(item.run)]
        run = runs.setdefault(id(item.run), item.run.picked(np.flatnonzero(keep)))
        y = np.full_like(item.y, np.nan)
        y[::step] = item.y[::step]
        made = replace(item, run=run, y=y[keep])
        if item.session is None:
            return made
        session, number = picked[id(item.session)]
        begin = int(number[item.part.start]) - 1
        return replace(made, session=session, part=slice(begin, begin + len(run.t)))

    return [[less(item, step) for item in group] for group, step in zip(groups, every, strict=True)]
