"""Reduce records to a small triangular system that contains everything a fit needs, whatever the number of samples.

The regressors of a PI model are its plays, `y = sum p_i play_(r_i)[v] + offset`. The plays are computed for a few
thousand samples at a time and reduced by QR (a sequential TSQR; Demmel, Grigori, Hoemmen and Langou, SIAM J. Sci.
Comput. 34, 2012, A206-A239), so that memory use does not grow with samples times thresholds. The column of ones comes
first: the rows below the first are then the system with the offset projected out exactly.

As long as the same plays follow the drive, each of them is the drive plus a constant, and the others do not move, so
all plays are linear in the drive. However many samples such a segment has, two rows contain all information for least
squares about its plays, and one number contains the part of y that no play can follow.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.jit import jit
from hystgen.plays import operators

Array = NDArray[np.float64]

CHUNK = 8192
"""Number of samples reduced at a time."""

BLOCKED = 64
"""Number of columns processed at a time in the linear algebra library's work space."""

AS_FAR = 1e-3
"""[fraction of its range] A drive that comes within this of its largest or smallest value counts as having reached it:
four codes of a 12-bit converter. For plays with larger thresholds, the error is at most this fraction of the motion."""

FOLDS = 4
"""Number of consecutive blocks of each record for the blocked validation."""


@dataclass(frozen=True)
class StartMemory:
    """A start memory found by a fit (`start`).

    `turns`: drive values that bring virgin plays to it; `uncertainty`: half the width of the 95 % interval of the
    memory's contribution to the output at the first sample, output units; `once`: threshold of a play that has moved
    away from this memory but is too wide to move back in the record, None if there is none.
    """

    turns: tuple[float, ...]
    uncertainty: float
    once: float | None = None


@dataclass(frozen=True)
class Course:
    """One record's samples in a fit: drive and output from the record's start, compared over [first, last).

    The drive before `first` also runs through the plays, and so does the drive at samples whose `y` is NaN, which are
    not compared. `history`: drive values visited before the record; None if unknown, and `start` is then the estimated
    memory, if one was searched for. `begin`: first sample that may be compared, regardless of the start memory.
    `origin`: index of the record that the course is part of, and index of the course's first sample in that record.
    `stretches`: samples of y left out in faulty stretches rather than as isolated ones; None if there are none.
    `approach`: with an unknown history, the input relative to the first one from which elements in parallel with the
    plays, at rest, came to it; `forgotten`: first sample from which they hardly depend on that.
    """

    name: str
    v: Array
    y: Array
    history: tuple[float, ...] | None
    first: int
    last: int
    begin: int = 0
    origin: tuple[int, int] = (0, 0)
    stretches: NDArray[np.bool_] | None = None
    start: StartMemory | None = None
    approach: float = 0.0
    forgotten: int = 0

    @property
    def visited(self) -> tuple[float, ...] | None:
        """Drive values that bring virgin plays to the start memory; None if that is neither known nor found."""
        return self.start.turns if self.history is None and self.start is not None else self.history

    @property
    def used(self) -> int:
        """Number of compared samples."""
        return int(np.count_nonzero(np.isfinite(self.y[self.first : self.last])))

    @property
    def compared(self) -> NDArray[np.intp]:
        """Indices of the compared samples."""
        return self.first + np.flatnonzero(np.isfinite(self.y[self.first : self.last]))

    @property
    def drive_range(self) -> tuple[float, float]:
        """Smallest and largest drive of the compared samples; if there are none, of all from `first` to `last`."""
        part = self.v[self.compared] if self.used else self.v[self.first : self.last]
        return float(part.min()), float(part.max())

    @property
    def output_range(self) -> float:
        """Peak-to-peak output of the compared samples."""
        return float(np.ptp(self.y[self.compared])) if self.used else 0.0

    def resettled(self, largest: float) -> Course:
        """The course, ignoring only as much of its start as necessary for plays up to the threshold `largest`."""
        first = 0 if self.visited is not None else settled(self.v[: self.last], largest)
        return replace(self, first=max(first, self.begin, self.forgotten))


def start_states(v: Array, history: Sequence[float] | None, thresholds: Array) -> Array:
    """Play states just before the first sample.

    With a history: virgin plays (state 0, as in `simulate`) after that history. Without a history: plays at rest at the
    first drive value, which is wrong by an unknown amount until the memory has been wiped.
    """
    if history is None:
        return np.full(len(thresholds), v[0])
    if not history:
        return np.zeros(len(thresholds))
    return _behind(tuple(history), thresholds.tobytes()).copy()


@functools.lru_cache(maxsize=256)
def _behind(history: tuple[float, ...], thresholds: bytes) -> Array:
    """Virgin plays after a history; cached, since a search requests the same few again and again."""
    r = np.frombuffer(thresholds).copy()  # writable, since the plays would be compiled again for a read-only array
    return operators.plays(history, r, 0.0)[:, -1]


def settled(v: Array, reach: float) -> int:
    """First sample from which an unknown start memory affects the plays only by an offset.

    Once the drive has swept `2 reach`, every play up to threshold `reach` is exact. Once it has visited its own largest
    and smallest values, plays with larger thresholds are constant, as they never move again in this record. The earlier
    sample counts. Values within `AS_FAR` of each other count as equal, so that noise does not decide between turns.
    """
    extremes = max(_reached(v), _reached(-v))
    swept = np.maximum.accumulate(v) - np.minimum.accumulate(v) >= 2.0 * reach
    return min(extremes, int(np.argmax(swept))) if swept[-1] else extremes


def _reached(v: Array) -> int:
    """The sample with the largest drive during its first visit to the region of its maximum."""
    there = v >= np.max(v) - AS_FAR * np.ptp(v)
    first = int(np.argmax(there))
    visit = v[first:] if there[first:].all() else v[first : first + int(np.argmin(there[first:]))]
    return first + int(np.argmax(visit))


def travel(course: Course, threshold: float) -> float:
    """Peak-to-peak movement of one play over the compared samples.

    If these begin before the memory of that play is known, the result is at most its movement in a settled loop over
    the range of the drive: any further movement depends on the start, which is at best estimated.
    """
    start = start_states(course.v, course.visited, np.array([threshold]))[0]
    moved = operators.play(course.v[: course.last], threshold, float(start))
    whole = float(np.ptp(moved[course.compared] if course.used else moved[course.first :]))
    if course.first >= replace(course, start=None).resettled(threshold).first:
        return whole
    return min(whole, float(np.ptp(course.v[course.begin : course.last])) - 2.0 * threshold)


def ways(x: Array) -> tuple[float, float]:
    """A signal's longest moves up and down, regardless of turns in between."""
    return float(np.max(x - np.minimum.accumulate(x))), float(np.max(np.maximum.accumulate(x) - x))


def prediction(v: Array, history: Sequence[float] | None, thresholds: Array, weights: Array) -> Array:
    """Free-run output of a play sum over the drive, without offset; one play at a time."""
    starts = start_states(v, history, thresholds)
    total = np.zeros_like(v)
    for r, p, start in zip(thresholds, weights, starts, strict=True):
        if p != 0.0:
            total += p * operators.play(v, float(r), float(start))
    return total


@dataclass(frozen=True)
class Reduced:
    """Triangular systems of several records over one list of thresholds; columns are the plays, then y.

    `whole`: every record with its own free offset. `folds`: one system for each consecutive block, every block with its
    own offset. `counts`: samples in each fold.
    """

    thresholds: Array
    whole: Array
    folds: tuple[Array, ...]
    counts: tuple[int, ...]

    @property
    def samples(self) -> int:
        """Number of samples reduced."""
        return sum(self.counts)


Source = Callable[[int, int, bool], Array]
"""Rows `[1, columns.., y]` with the same normal equations as the samples from start to stop of one course.

Called in order, beginning at sample 0; returns no rows if the samples are not compared.
"""


def play_rows(course: Course, thresholds: Array) -> Source:
    """Rows of the plays of one course, far fewer than samples if the drive runs smoothly (`segment_rows`)."""
    states = start_states(course.v, course.visited, thresholds)

    def rows(start: int, stop: int, compared: bool) -> Array:
        return segment_rows(course.v[start:stop], course.y[start:stop], thresholds, states, compared)

    return rows


def reduce(
    courses: Sequence[Course], thresholds: Array, tick: Callable[[int], None] | None = None,
    source: Callable[[Course, Array], Source] = play_rows, further: int = 0,
) -> Reduced:
    """Reduce the records; `tick` is called with the number of samples of each chunk.

    `source`: returns the rows of a course, with `further` columns after those for the plays at `thresholds`.
    """
    width = len(thresholds) + further + 1
    whole = np.empty((0, width))
    folds = [np.empty((0, width)) for _ in range(FOLDS)]
    counts = [0] * FOLDS
    for course in courses:
        edges = np.linspace(course.first, course.last, FOLDS + 1).astype(int).tolist()
        blocks = [np.empty((0, width + 1)) for _ in range(FOLDS)]
        rows = source(course, thresholds)
        for k, (begin, end) in enumerate(itertools.pairwise([0, *edges])):
            for start in range(begin, end, CHUNK):
                stop = min(start + CHUNK, end)
                found = rows(start, stop, k > 0)
                if k > 0:
                    blocks[k - 1] = triangle(blocks[k - 1], found)
                    counts[k - 1] += int(np.count_nonzero(np.isfinite(course.y[start:stop])))
                if tick is not None:
                    tick(stop - start)
        whole = triangle(whole, _without_offset(triangle(*blocks)))
        folds = [triangle(fold, _without_offset(block)) for fold, block in zip(folds, blocks, strict=True)]
    return Reduced(thresholds, whole, tuple(folds), tuple(counts))


def triangle(*parts: Array) -> Array:
    """The triangular factor of stacked parts: the same normal equations, with at most as many rows as columns."""
    rows, columns = sum(map(len, parts)), parts[0].shape[1]
    stacked = np.concatenate(parts, out=np.empty((columns, rows)).T)
    return reflected(stacked).triangle if rows > 1 else stacked


@dataclass(frozen=True)
class Reflected:
    """A table reduced to its triangular factor, with the reflections used, to be applied to later columns."""

    triangle: Array
    reflections: Array
    factors: Array

    def extended(self, columns: Array) -> Array:
        """The triangular factor of the table with these columns appended; they are overwritten."""
        from scipy.linalg import lapack

        rank = len(self.factors)
        room = BLOCKED * columns.shape[1]
        turned, _, _ = lapack.dormqr("L", "T", self.reflections[:, :rank], self.factors, columns, room, overwrite_c=1)
        below = reflected(turned[rank:]).triangle
        left = np.concatenate([self.triangle, np.zeros((len(below), self.triangle.shape[1]))])
        return np.concatenate([left, np.concatenate([turned[:rank], below])], axis=1)


def reflected(table: Array) -> Reflected:
    """Householder's reduction of a table, which is overwritten if its columns are contiguous."""
    from scipy.linalg import lapack

    if not len(table):
        return Reflected(table, table, np.empty(0))
    found, factors, _, _ = lapack.dgeqrf(table, lwork=BLOCKED * table.shape[1], overwrite_a=1)
    return Reflected(np.where(_upper(table.shape[1])[: len(found)], found[: table.shape[1]], 0.0), found, factors)


@functools.cache
def _upper(size: int) -> NDArray[np.bool_]:
    """Mask of the upper triangle."""
    return np.triu(np.ones((size, size), dtype=bool))


def _without_offset(triangle: Array) -> Array:
    return triangle[1:, 1:]


def others(reduced: Reduced, fold: int) -> Array:
    """The system of all folds but one."""
    return triangle(*(part for k, part in enumerate(reduced.folds) if k != fold))


# From samples to rows with the same normal equations, about two per segment of the memory --------------------


@jit
def _close_segment(
    thresholds: Array, states: Array, k: int, rising: bool, sums: Array, out: Array, row: int
) -> int:
    """Write the rows of a segment with plays 0 .. k-1 moving; `sums`: count, means and centred moments of v and y."""
    root = np.sqrt(sums[0])
    spread = np.sqrt(sums[3])
    out[row, 0] = root
    for i in range(len(thresholds)):
        if i < k:
            out[row, 1 + i] = root * (sums[1] - thresholds[i] if rising else sums[1] + thresholds[i])
        else:
            out[row, 1 + i] = root * states[i]
    out[row, -1] = root * sums[2]
    row += 1
    if spread > 0.0:
        out[row, 0] = 0.0
        for i in range(len(thresholds)):
            out[row, 1 + i] = spread if i < k else 0.0
        out[row, -1] = sums[4] / spread
        row += 1
        sums[6] += max(sums[5] - sums[4] * sums[4] / sums[3], 0.0)
    else:
        sums[6] += sums[5]
    return row


@jit
def _segment_rows(v: Array, y: Array, thresholds: Array, states: Array, sums: Array, out: Array) -> int:
    """Write the rows of the samples whose y is a number into `out`, or none if it has no room; return their number.

    Updates the plays' `states`. `sums`: room for seven numbers. The memory is admissible, so if a play does not move,
    plays with larger thresholds do not move either.
    """
    wanted = len(out) > 0
    sums[:] = 0.0
    row = 0
    k = 0
    rising = True
    for t in range(len(v)):
        x = v[t]
        moving = 0
        up = x > states[0]
        if up:
            while moving < len(thresholds) and states[moving] < x - thresholds[moving]:
                moving += 1
        else:
            while moving < len(thresholds) and states[moving] > x + thresholds[moving]:
                moving += 1
        if wanted and sums[0] > 0.0 and moving > 0 and (moving != k or up != rising):
            row = _close_segment(thresholds, states, k, rising, sums, out, row)
            sums[:6] = 0.0
        if moving > 0 or sums[0] == 0.0:
            k = moving
            rising = up
        for i in range(moving):
            states[i] = x - thresholds[i] if up else x + thresholds[i]
        if wanted and y[t] == y[t]:  # not NaN
            sums[0] += 1.0
            from_v = x - sums[1]
            from_y = y[t] - sums[2]
            sums[1] += from_v / sums[0]
            sums[2] += from_y / sums[0]
            sums[3] += from_v * (x - sums[1])
            sums[4] += from_v * (y[t] - sums[2])
            sums[5] += from_y * (y[t] - sums[2])
    if wanted:
        if sums[0] > 0.0:
            row = _close_segment(thresholds, states, k, rising, sums, out, row)
        out[row, :] = 0.0
        out[row, -1] = np.sqrt(sums[6])
        row += 1
    return row


def segment_rows(v: Array, y: Array, thresholds: Array, states: Array, wanted: bool) -> Array:
    """Rows `[1, plays.., y]` for the samples, none unless `wanted`; updates the plays' `states`."""
    out = np.empty((len(v) + 1 if wanted else 0, len(thresholds) + 2))
    return out[: _segment_rows(v, y, thresholds, states, np.empty(7), out)]
