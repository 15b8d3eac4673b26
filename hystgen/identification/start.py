"""The start memory of records with an unknown history, estimated together with the weights.

A memory is admissible if `s(0) = v_0` and, between two thresholds, it changes by no more than their distance:
`s_i = s_(i-1) + d_i (r_i - r_(i-1))` with every `d_i` from -1 to 1. Until the drive moves it for the first time, a play
adds the constant `p_i s_i` to the output; after that it no longer depends on the start. The output is therefore
piecewise linear in the `d` of every record, which join the weights as further bounded unknowns (the search is in
`joint`). A prior as wide as the bounds allow keeps slopes that no sample determines at `d = 0`.

The result is a course's `StartMemory`: drive values that would have produced that memory. Like a known history, they
have the same meaning with any front and any thresholds.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen.front.stage import Stage
from hystgen.identification import joint, pi, reduction
from hystgen.identification.joint import LocalFit
from hystgen.identification.reduction import Course, Reduced, StartMemory
from hystgen.plays import operators

Array = NDArray[np.float64]

STARTS, UNLIKE = 8, 3.0
"""Minimum number of samples of a start, and the ratio of its rms error to the error elsewhere above which the given or
estimated memory is taken to be wrong."""

ROUNDING = 1e-6
"""Fraction of the output range below which errors are only rounding, as in records computed without noise."""

LEAST_KNOWN = 0.5
"""If the memory is known for at least this fraction of a record's samples, the earlier samples are left out: a start
memory fitted to them would flatter the model being judged. With 0.5, none of 56 simulated records without a history is
rejected, and the median held-out error is 1.00 times that with the true history; with 0.25, it is 1.02 times."""

PLAYS = 12
"""Number of thresholds for which start memories are estimated: the middle one of the numbers of plays that fits try by
default. Given thresholds are used instead if there are no more than this and the records move their plays; time grows
with the cube of their number."""

SPREAD = math.sqrt(3.0)
"""Reciprocal of the standard deviation of a slope that is uniform from -1 to 1."""

NORMAL = 1.96
"""Half the width, in standard deviations, of the interval that holds 95 % of a normal distribution."""

ZIGZAGS = 4
"""Pairs of turns that approximate a slope between two thresholds, with an error of at most 1/16 of their distance."""

TOGETHER = 6
"""Maximum number of courses that share weights in a search, whose cost grows with the cube of their number."""

ROUNDS = 2
"""Number of searches; the errors of the first search set the weight of the prior in the next."""


def estimated(
    courses: Sequence[Course], stages: Sequence[Stage] = (), wanted: int | tuple[float, ...] | None = None
) -> list[Course]:
    """The courses compared from their beginning, with a start memory for each course with an unknown history.

    `stages`: the front of the plays; `wanted`: their thresholds, for which the memory is then exact, or any other value
    that the option takes. The start of a course stays ignored if its errors are far larger than those after it (a
    transient), or if the drive does not go up and down again.
    """
    if all(item.history is not None for item in courses):
        return list(courses)
    begun = [unknown(item) for item in courses]
    found = _memories(tuple(map(_Alike, begun)), tuple(stages), wanted)
    return [
        item if start is None else replace(item, start=start, first=item.begin)
        for item, start in zip(begun, found, strict=True)
    ]


@dataclass(frozen=True, eq=False)
class _Alike:
    """A course, equal to any other from which the same start memory follows."""

    item: Course

    @functools.cached_property
    def _content(self) -> tuple[object, ...]:
        item = self.item
        signals = item.v.tobytes(), item.y.tobytes()
        return *signals, item.history, item.first, item.last, item.begin, item.approach, item.forgotten

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Alike) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)


@functools.lru_cache(maxsize=4)
def _memories(
    courses: tuple[_Alike, ...], stages: tuple[Stage, ...], wanted: int | tuple[float, ...] | None
) -> list[StartMemory | None]:
    """The start memories of courses, None where none is found.

    The last ones are cached: looking for outliers, fitting the weights and fitting each kind of front ask for the same.
    """
    begun = [each.item for each in courses]
    places = [k for k, item in enumerate(begun) if findable(item)]
    some = [begun[k] for k in places]
    seen = [joint.through_front(item, stages) for item in some]
    swing = max((float(np.ptp(item.v[item.begin : item.last])) for item in seen), default=0.0)
    if swing == 0.0:
        return [item.start for item in begun]
    reach, once = pi.loop_reach(swing), None
    if isinstance(wanted, tuple) and 1 < len(wanted) <= PLAYS + 1 and wanted[-1] <= reach:
        r = np.array(wanted)
    else:
        r = np.array(pi.dense(reach, sum(item.last - item.begin for item in some), PLAYS).thresholds)
        if not isinstance(wanted, tuple):
            once = pi.rounded(pi.loop_reach(swing, pi.LEAST_VISIBLE), 6)
    for first in range(0, len(places), TOGETHER):
        here = places[first : first + TOGETHER]
        for k, item in zip(here, _started([begun[k] for k in here], stages, r, None, once), strict=True):
            begun[k] = item
    return [item.start for item in begun]


def needed(
    courses: Sequence[Course], stages: Sequence[Stage] = (), wanted: int | tuple[float, ...] | None = None,
    least: float = LEAST_KNOWN, largest: float = math.inf,
) -> list[Course]:
    """The courses, with a start memory (`estimated`) for each that would otherwise have too few comparable samples.

    `least`: fraction of a course's samples that is enough; `largest`: threshold above which plays hardly move; their
    memory is ignored if waiting for it would leave too few samples to compare and no start memory is found.
    """
    known = [_enough(item, least, largest) for item in courses]
    short = [lacking(item, least) for item in courses]
    if not any(short):
        return known
    found = estimated(courses, stages, wanted)
    return [
        item if lacks and item.start is not None else other
        for item, other, lacks in zip(found, known, short, strict=True)
    ]


def of_model(
    courses: Sequence[Course], stages: Sequence[Stage], thresholds: Array, weights: Array, least: float = LEAST_KNOWN,
    largest: float = math.inf,
) -> list[Course]:
    """The courses for judging a model with fixed weights; the starts of courses that are not `lacking` are ignored.

    `least`, `largest`: as in `needed`.
    """
    if len(thresholds) == 1:  # without plays there is nothing to estimate
        return [replace(item, start=StartMemory((), 0.0), first=item.begin) for item in courses]
    begun = [_enough(item, least, largest) for item in courses]
    places = [k for k, item in enumerate(begun) if lacking(item, least)]
    if places:
        some = [unknown(begun[k]) for k in places]
        for k, before, item in zip(places, some, _started(some, stages, thresholds, weights), strict=True):
            begun[k] = begun[k] if item is before else item
    return begun


def unknown(item: Course, largest: float = math.inf) -> Course:
    """The course without an estimated start memory, and without its start if no history is known either.

    `largest`: threshold up to which the memory of plays matters.
    """
    return replace(item, start=None).resettled(largest)


def _enough(item: Course, least: float, largest: float) -> Course:
    """The course from where every play is known or, if that is too short, from where those up to `largest` are."""
    exact = unknown(item)
    return exact if exact.used >= least * _whole(item).used else unknown(item, largest)


def findable(item: Course) -> bool:
    """Whether the drive of a record goes up and down again far enough (`pi.LEAST_TRAVEL`) to show a start memory."""
    v = item.v[item.begin : item.last]
    if item.history is not None or not len(v):
        return item.history is not None
    return bool(min(reduction.ways(v)) >= pi.LEAST_TRAVEL * np.ptp(v) > 0.0)


def lacking(item: Course, least: float) -> bool:
    """Whether less than a fraction `least` of a course is comparable without a start memory, and one can be found."""
    return findable(item) and unknown(item).used < least * _whole(item).used


def _started(
    courses: Sequence[Course], stages: Sequence[Stage], r: Array, weights: Array | None, once: float | None = None
) -> list[Course]:
    """The courses with the start memories that were found, except for transients.

    `once`: threshold of a play added to those of `r` (n+1,) if that makes the error clearly smaller. The added play
    represents all plays that the drive moves only once, on its way beyond its earlier range: an actuator that came from
    a wider range has such plays.
    """
    inner = [joint.through_front(item, stages) for item in courses]
    search = _Search.of(inner, r, weights)
    found, moved = search.result(), None
    if once is not None:
        wider = _Search.of(inner, np.append(r, once), weights)
        other = wider.result()
        if other.rms < pi.CLEARLY * found.rms:
            search, found, r, moved = wider, other, wider.r, once
    begun = []
    for item, seen, (slopes, uncertainty) in zip(courses, inner, search.parted(found), strict=True):
        if item.history is None:
            turns = turns_of(r, float(seen.v[0]) + memory_of(slopes, r))
            whole = replace(seen, start=StartMemory(turns, uncertainty), first=item.begin)
            if not _transient(whole, item.first, r, found.best):
                given = StartMemory(in_front(turns, stages), uncertainty, moved)
                item = replace(item, start=given, first=item.begin)
        begun.append(item)
    return begun


def _whole(item: Course) -> Course:
    """The course compared from its first permitted sample."""
    return replace(item, first=item.begin)


def in_front(turns: tuple[float, ...], stages: Sequence[Stage]) -> tuple[float, ...]:
    """Drive values that the stages turn into `turns` at the input of the plays."""
    drives = []
    for before, turn in itertools.pairwise((0.0, *turns)):
        value = turn
        for stage in reversed(stages):
            value = float(stage.inverse(value, turn > before))
        drives.append(value)
    return tuple(drives)


def _transient(item: Course, settled: int, r: Array, p: Array) -> bool:
    """Whether the errors of a model before the memory is known are far larger than afterwards."""
    known = np.isfinite(item.y)
    if min(np.count_nonzero(known[item.first : settled]), np.count_nonzero(known[settled : item.last])) < STARTS:
        return False
    start = pi.compare(item, r, p).error[: settled - item.first]
    rest = pi.compare(replace(item, first=settled), r, p).error
    least = ROUNDING * item.output_range
    return float(np.nanstd(start)) > UNLIKE * max(float(np.nanstd(rest)), least)


def memory_of(slopes: Array, r: Array) -> Array:
    """States (n+1,) minus the first drive, from the slopes (n,) of a memory over the thresholds (n+1,)."""
    return np.concatenate([[0.0], np.cumsum(slopes * np.diff(r))])


def turns_of(r: Array, states: Array) -> tuple[float, ...]:
    """Drive values that bring virgin plays with thresholds r (n+1,) to an admissible memory (n+1,).

    As a function of the threshold, the memory left by a history has slopes of -1 and 1 only: going inwards from the
    outermost play, a part that falls with the threshold comes from a turn at `s + r`, a part that rises from a turn at
    `s - r`. Slopes in between become `ZIGZAGS` pairs of such parts, which are exact at the thresholds.
    """
    outermost = states[-1] + r[-1] if states[-1] >= 0.0 else states[-1] - r[-1]
    turns = [float(outermost)]
    for i in range(len(r) - 1, 0, -1):
        width = float(r[i] - r[i - 1])
        rising = 0.5 * (width + float(np.clip(states[i] - states[i - 1], -width, width)))
        at, state = float(r[i]), float(states[i])
        for _ in range(ZIGZAGS):
            for up, length in ((True, rising / ZIGZAGS), (False, (width - rising) / ZIGZAGS)):
                if length > pi.DUST * width:
                    turns.append(state - at if up else state + at)
                    at, state = at - length, state - length if up else state + length
    return tuple(turns)


@dataclass(frozen=True)
class _Bounds:
    """Bounds on the slopes of memories over the thresholds."""

    number: int

    @property
    def bounds(self) -> tuple[Array, Array]:
        """From -1 to 1."""
        return -np.ones(self.number), np.ones(self.number)

    def slack(self, shape: Array) -> Array:
        """No further constraints."""
        return np.empty(0)


@dataclass(frozen=True)
class _System:
    """One course: the rows from the sample at which no play depends on the start any more, and the earlier samples."""

    item: Course
    r: Array
    settled: int
    tail: Array

    @classmethod
    def of(cls, item: Course, r: Array) -> _System:
        """The course over thresholds r (n+1,)."""
        v = item.v[: item.last]
        swept = np.maximum.accumulate(v) - np.minimum.accumulate(v) >= 2.0 * r[-1]
        settled = 0 if item.history is not None else int(np.argmax(swept)) if swept[-1] else item.last
        states = reduction.start_states(v, item.history, r)
        tail = np.empty((0, len(r) + 2))
        edges = sorted({*range(0, item.last, reduction.CHUNK), settled, item.begin, item.last})
        for a, b in itertools.pairwise(edges):
            wanted = a >= max(settled, item.begin)
            tail = reduction.triangle(tail, reduction.segment_rows(v[a:b], item.y[a:b], r, states, wanted))
        return cls(item, r, settled, tail)

    @property
    def slopes(self) -> int:
        """Number of unknowns that describe the start."""
        return len(self.r) - 1 if self.item.history is None else 0

    def simple(self) -> list[Array]:
        """Slopes of simple memories: at rest, virgin, and with one turn before the first sample."""
        if not self.slopes:
            return []
        first, n = float(self.item.v[0]), self.slopes
        virgin = np.clip(0.0, first - self.r, first + self.r)
        turned = [sign * np.where(np.arange(n) < k, 1.0, -1.0) for k in range(n + 1) for sign in (1.0, -1.0)]
        return [np.zeros(n), np.diff(virgin) / np.diff(self.r), *turned]

    def rows(self, slopes: Array, p: Array) -> Array:
        """Rows `[plays (n+1), change with the slopes.., y]` linearised about slopes and weights, offset removed.

        A play that has not moved yet is a constant; once it has moved, the output does not depend on its start.
        """
        if not self.slopes:
            return reduction.triangle(self.tail)[1:, 1:]
        item, r, n = self.item, self.r, self.slopes
        states = float(item.v[0]) + memory_of(slopes, r)
        moved = self._moved(states)
        edges = {*range(0, self.settled, reduction.CHUNK), *moved[moved < self.settled].tolist(), self.settled}
        edges |= {min(item.begin, self.settled)}
        tables = [np.concatenate([self.tail[:, :-1], np.zeros((len(self.tail), n)), self.tail[:, -1:]], axis=1)]
        for a, b in itertools.pairwise(sorted(edges)):
            found = reduction.segment_rows(item.v[a:b], item.y[a:b], r, states, a >= item.begin)
            if len(found):
                change = self.change(p * (a < moved))
                tables.append(np.concatenate([found[:, :-1], found[:, :1] * change, found[:, -1:]], axis=1))
            if sum(map(len, tables)) > reduction.CHUNK:
                tables = [reduction.triangle(*tables)]
        return reduction.triangle(*tables)[1:, 1:]

    def left(self, slopes: Array, p: Array) -> float:
        """Root of the sum of squared errors for a memory and weights, without reducing a table of all plays."""
        item, begin = self.item, min(self.item.begin, self.settled)
        states = float(item.v[0]) + memory_of(slopes, self.r)
        output = operators.play_sum(item.v[: self.settled], self.r, states, p)
        errors = (item.y[: self.settled] - output)[begin:]
        errors = errors[np.isfinite(errors)]
        after = self.tail[:, -1] - self.tail[:, 1:-1] @ p
        both = np.concatenate([np.ones(len(errors)), self.tail[:, 0]]), np.concatenate([errors, after])
        return float(np.abs(reduction.triangle(np.column_stack(both))[-1, -1]))

    def change(self, held: Array) -> Array:
        """Change in the output per unit of each slope, for the weights `held` of the plays that have not moved."""
        return np.asarray(np.cumsum(held[::-1])[::-1][1:] * np.diff(self.r))

    def _moved(self, states: Array) -> NDArray[np.intp]:
        """The sample (n+1,) at which each play moves for the first time, at most `settled`."""
        v = self.item.v[: self.settled]
        if not len(v):
            return np.zeros(len(states), dtype=np.intp)
        above = np.searchsorted(np.maximum.accumulate(v), states + self.r, side="right")
        below = np.searchsorted(-np.minimum.accumulate(v), self.r - states, side="right")
        return np.asarray(np.maximum.accumulate(np.minimum(above, below)))


@dataclass(frozen=True)
class _Search:
    """The search for the slopes of all courses and the weights that they share, unless these are known."""

    systems: tuple[_System, ...]
    r: Array
    known: Array | None

    @classmethod
    def of(cls, courses: Sequence[Course], r: Array, known: Array | None) -> _Search:
        """The search for the courses, as seen by plays with thresholds r (n+1,), from their beginning."""
        return cls(tuple(_System.of(_whole(item), r) for item in courses), r, known)

    @property
    def _slopes(self) -> int:
        return sum(each.slopes for each in self.systems)

    def result(self) -> LocalFit:
        """The best slopes, with their weights in `best`."""
        shape, rms = self._first_slopes(), 0.0
        for _ in range(ROUNDS):
            linear = functools.partial(self._linear, rms)
            now = linear(shape, self._first_weights(shape))
            found, _ = joint.search(linear, _Bounds(self._slopes), now)
            shape, rms = found.shape, found.rms
        return found

    def parted(self, found: LocalFit) -> list[tuple[Array, float]]:
        """Slopes of each course, and half the width of the 95 % interval of their contribution at its start."""
        k = 0 if self.known is not None else len(self.r)
        system, p = found.system.whole[:, :-1], found.best
        free = np.concatenate([p[:k] > 0.0, np.abs(found.shape) < 1.0])
        spread = np.zeros((k + len(found.shape),) * 2)
        inner = system[:, free]
        spread[np.ix_(free, free)] = found.rms**2 * np.linalg.pinv(inner.T @ inner)
        parts, at = [], 0
        for each in self.systems:
            here = slice(k + at, k + at + each.slopes)
            change = each.change(p)[: each.slopes]
            variance = float(change @ spread[here, here] @ change)
            parts.append((found.shape[at : at + each.slopes], NORMAL * math.sqrt(max(variance, 0.0))))
            at += each.slopes
        return parts

    def _first_slopes(self) -> Array:
        """The best memory with at most one turn for each course, each fitted with its own weights."""
        shape = [np.empty(0)]
        for each in self.systems:
            found = each.simple()
            left = [self._left(each, slopes) for slopes in found]
            shape += [found[int(np.argmin(left))]] if found else []
        return np.concatenate(shape)

    def _left(self, system: _System, slopes: Array) -> float:
        """The residual error on one course with a memory and, unless weights are known, its best weights."""
        if self.known is not None:
            return system.left(slopes, self.known)
        alone = replace(self, systems=(system,))
        return alone._linear(0.0, slopes, alone._first_weights(slopes)).rms

    def _first_weights(self, shape: Array) -> Array:
        """Weights that fit best for given slopes."""
        if self.known is not None:
            return np.empty(0)
        system = self._whole(shape, np.zeros(len(self.r)), 0.0)
        return pi.non_negative(system, np.arange(len(self.r)))

    def _linear(self, rms: float, shape: Array, p: Array) -> LocalFit:
        """The system linearised about slopes and weights; `rms`: the errors that set the weight of the prior."""
        samples = sum(each.item.used for each in self.systems)
        if self.known is None:
            system = self._whole(shape, p, rms)
            columns = np.arange(len(self.r))
            best = pi.non_negative(system, columns)
            squares = pi.residual(system, columns, best)
        else:
            system, best = self._whole(shape, self.known, rms), self.known
            left = system[:, -1] - system[:, : len(best)] @ best
            system, squares = np.column_stack([system[:, len(best) : -1], left]), float(left @ left)
        size = pi.root_mean_square(squares, samples)
        return LocalFit(shape, p, size, best, samples, lambda: Reduced(self.r, system, (), (samples,)))

    def _whole(self, shape: Array, p: Array, rms: float) -> Array:
        """Rows `[plays, slopes of all courses, y]` of all courses and of the prior."""
        n1, number, at = len(self.r), self._slopes, 0
        tables = []
        for each in self.systems:
            rows = each.rows(shape[at : at + each.slopes], p)
            table = np.zeros((len(rows), n1 + number + 1))
            table[:, :n1], table[:, -1] = rows[:, :n1], rows[:, -1]
            table[:, n1 + at : n1 + at + each.slopes] = rows[:, n1:-1]
            tables.append(table)
            at += each.slopes
        prior = np.concatenate([np.zeros((number, n1)), np.eye(number), -shape[:, None]], axis=1)
        return reduction.triangle(*tables, SPREAD * rms * prior)
