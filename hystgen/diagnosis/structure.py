"""A hypothesis about the actuator as a fit sees it: plays behind a front, effects around them, numbers to find.

The output is linear in the weights of the plays wherever an output map does not bend it, so every fit solves for the
weights and the change of all other numbers at once (`identification.joint`), on the free-run error of whole records.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hystgen.chain import chain
from hystgen.effects.base import Candidate, Effect, Place, Run
from hystgen.front.stage import Stage
from hystgen.identification import joint, reduction, weights
from hystgen.identification.constrained import root_mean_square
from hystgen.identification.fronts import Front, Kept
from hystgen.identification.joint import DIFFERENCE, Shaped
from hystgen.identification.reduction import Reduced
from hystgen.plays import operators

Array = NDArray[np.float64]
Samples = slice | NDArray[np.intp]
Sums = dict[object, Array]

ALL = slice(None)

_MOVED, _FILTERED, _RINGING, _MAPPED = range(4)
"""Parts of the chain behind which the compared samples are picked: plays, filters behind them, others, output maps."""

MOVEMENTS = 5, 2**25
"""Movements of the plays that are remembered for a record, and the bytes of them all."""

DIFFERENCES = 12, 2**25
"""The same of what hypotheses leave of a record: those followed up in a round are compared with each other."""

COMPARISONS = 40, 2**23
"""And of the errors by which they are compared, with what each leaves free in the record."""

FAR = 2.0
"""The start state may come from a drive so many times as wide as the recorded one."""

POLISHED = 1e-5
"""A search ends when a step lowers the error by less than this share: far below what any decision looks at."""

SETTLED = 3
"""Most steps to the offset in front of a map; each squares what is left of the map's curvature, some per cent."""


class NotFiniteError(ArithmeticError):
    """An output map makes no numbers of what it is given."""


class Recent:
    """Arrays that were asked for lately, by what made them; no more than so many, and than so many bytes."""

    def __init__(self, most: int, most_bytes: int) -> None:
        self._most, self._most_bytes = most, most_bytes
        self._arrays: dict[object, Array] = {}

    def recalled(self, by: object) -> Array | None:
        """What is remembered by this."""
        if by not in self._arrays:
            return None
        self._arrays[by] = found = self._arrays.pop(by)  # the latest one comes last
        return found

    def remember(self, by: object, found: Array) -> None:
        """Remember it in place of what was asked for least lately."""
        arrays = self._arrays
        while arrays and (len(arrays) >= self._most or found.nbytes * (len(arrays) + 1) > self._most_bytes):
            del arrays[next(iter(arrays))]
        if found.nbytes <= self._most_bytes:
            arrays[by] = found


@dataclass(frozen=True)
class Item:
    """A record as it is compared: `y` is NaN where it is not; `history` the drive before it, None when unknown.

    `session`: all records on one time axis, where they are of one session, and `part` what of it is this record.
    `moved`: how the plays moved lately, since most numbers of a search do not change it; `left`: what was left of it;
    `errors`: that with what is free in it fitted away.
    """

    name: str
    run: Run
    y: Array
    history: tuple[float, ...] | None
    output_range: float
    session: Run | None = None
    part: slice = field(default_factory=lambda: slice(None))
    moved: Recent = field(default_factory=lambda: Recent(*MOVEMENTS), init=False, repr=False, compare=False)
    left: Recent = field(default_factory=lambda: Recent(*DIFFERENCES), init=False, repr=False, compare=False)
    errors: Recent = field(default_factory=lambda: Recent(*COMPARISONS), init=False, repr=False, compare=False)

    @cached_property
    def known(self) -> NDArray[np.bool_]:
        """The samples that are compared."""
        return np.isfinite(self.y)

    @cached_property
    def compared(self) -> Samples:
        """Where these are: a slice if they are evenly spread, since that picks without a copy."""
        found = np.flatnonzero(self.known)
        steps = np.diff(found)
        if not len(steps) or np.any(steps != steps[0]):
            return found
        return slice(int(found[0]), int(found[-1]) + 1, int(steps[0]))

    def picked(self, rows: Array) -> Array:
        """Of rows (k, N) those samples, with nothing between them."""
        if isinstance(self.compared, slice):
            return np.ascontiguousarray(rows[:, self.compared])
        return rows.take(self.compared, axis=1)


@dataclass(frozen=True)
class Part:
    """An effect in a hypothesis: its catalogue name and the shape of it whose numbers are sought."""

    name: str
    candidate: Candidate


def kept(effect: Effect) -> Part:
    """An effect that stays as it is."""
    none = np.empty(0)
    return Part(effect.name, Candidate("as it is", none, none, none, lambda _: effect))


@dataclass(frozen=True)
class Structure:
    """Thresholds, a front and effects; its shape is the front's, then the numbers of each effect."""

    thresholds: Array
    front: Front
    parts: tuple[Part, ...] = ()

    @property
    def start(self) -> Array:
        """Where a search starts."""
        return np.concatenate([self.front.straight, *(part.candidate.start for part in self.parts)])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Least and largest value of every shape number."""
        low, high = self.front.bounds
        return (
            np.concatenate([low, *(part.candidate.low for part in self.parts)]),
            np.concatenate([high, *(part.candidate.high for part in self.parts)]),
        )

    def slack(self, shape: Array) -> Array:
        """What must not be negative beyond the bounds."""
        return self.front.slack(shape[: len(self.front.straight)])

    def pieces(self, shape: Array) -> tuple[Array, list[Array]]:
        """The front's shape and the numbers of each effect."""
        at = len(self.front.straight)
        found = []
        for part in self.parts:
            found.append(shape[at : at + len(part.candidate.start)])
            at += len(part.candidate.start)
        return shape[: len(self.front.straight)], found

    def effects(self, shape: Array) -> list[Effect]:
        """The effects, in the order of the parts."""
        return [part.candidate.build(numbers) for part, numbers in zip(self.parts, self.pieces(shape)[1], strict=True)]

    def held(self, shape: Array) -> Structure:
        """The same without numbers to find: what they make, kept as it is."""
        front_shape, _ = self.pieces(shape)
        front = Kept(self.front.stages(front_shape), self.front.name)
        return replace(self, front=front, parts=tuple(map(kept, self.effects(shape))))

    def actuator(self, shape: Array) -> Actuator:
        """What the numbers make."""
        return Actuator(self.thresholds, self.front.stages(self.pieces(shape)[0]), tuple(self.effects(shape)))

    def varied(self, shape: Array, here: Actuator) -> list[Actuator]:
        """What the numbers make with one after the other changed by `DIFFERENCE`; the rest is that of `here`."""
        front, numbers = self.pieces(shape)
        ends = len(front) + np.cumsum([len(x) for x in numbers])

        def one(j: int) -> Actuator:
            other = shape.copy()
            other[j] += DIFFERENCE
            front_shape, changed = self.pieces(other)
            if j < len(front):
                return replace(here, stages=self.front.stages(front_shape), gains=dict(here.gains))
            k = int(np.searchsorted(ends, j, side="right"))
            effects = (*here.effects[:k], self.parts[k].candidate.build(changed[k]), *here.effects[k + 1 :])
            return replace(here, effects=effects, gains=dict(here.gains))

        return [one(j) for j in range(len(shape))]


@dataclass(frozen=True)
class Actuator:
    """Plays of given thresholds between a front and effects; weights apart."""

    thresholds: Array
    stages: tuple[Stage, ...]
    effects: tuple[Effect, ...]
    gains: dict[tuple[int, int], tuple[Effect, Run, Array, Array]] = field(
        default_factory=dict, compare=False, repr=False
    )
    """Gain and offset over a run, which is kept along with its effect: the `id` of what is gone may be another's."""

    def at(self, place: Place) -> Sequence[Effect]:
        """The effects at one place of the chain, in its order."""
        return self._at.get(place, ())

    @cached_property
    def _at(self) -> dict[Place, list[Effect]]:
        found: dict[Place, list[Effect]] = {}
        for effect in sorted(self.effects, key=lambda each: each.order):
            found.setdefault(effect.place, []).append(effect)
        return found

    def columns(self, item: Item, p: Array | None = None, sums: Sums | None = None) -> tuple[Array, Array]:
        """Rows that the weights multiply, up to the output map, and what is added to them without a weight.

        Of the samples that are compared, where nothing behind needs the others: `compared` picks them in any case.
        With `p` a single row, the weighted sum: cheaper, since what follows the plays runs once. `sums`: sums of the
        same weights, of actuators that have effects in common.
        """
        run = item.run
        rows = self._slow(item) if p is None else self._slow_sum(item, p, {} if sums is None else sums)[None, :]
        constant = np.zeros(rows.shape[1])
        now = item.compared if self._needed <= _FILTERED else ALL
        whole = item.session or run
        for effect in self.at(Place.GAIN):
            key = id(effect), id(whole)
            if key not in self.gains:
                self.gains[key] = effect, whole, effect.gain(whole), effect.offset(whole)
            gain, offset = (values[item.part][now] for values in self.gains[key][2:])
            rows, constant = rows * gain, constant * gain + offset
        for effect in self.at(Place.LINEAR):
            if effect.order > 0:
                rows = effect.filtered(rows, run)
                if self.at(Place.GAIN):  # of nothing a filter makes nothing
                    constant = effect.filtered(constant, run)
        if self._needed == _RINGING:
            rows, constant = item.picked(rows), constant[item.compared]
        return rows, constant

    def compared(self, values: Array, item: Item) -> Array:
        """Of values at the samples of `columns`, (N,) or (k, N), those at samples that are compared."""
        return values[..., item.compared] if self._needed == _MAPPED else values

    @cached_property
    def _needed(self) -> int:
        """The last part of the chain that needs every sample; behind it the samples that are compared will do."""
        if not all(effect.pointwise for effect in self.at(Place.OUTPUT)):
            return _MAPPED
        if len(self._filters) < len(self.at(Place.LINEAR)):
            return _RINGING
        return _FILTERED if self._filters or not all(effect.pointwise for effect in self._bending) else _MOVED

    def _slow(self, item: Item) -> Array:
        """(n + 1, N) plays behind the filters that follow them, if there are any; remembered like the plays."""
        if self._needed == _MOVED:
            return self._plays(item)
        by = (self._moving, self._bending, self._filters, self._needed == _FILTERED)
        rows = item.moved.recalled(by)
        if rows is None:
            rows = self._plays(item)
            for effect in self._filters:
                rows = effect.filtered(rows, item.run)
            if self._needed == _FILTERED:
                rows = item.picked(rows)
            item.moved.remember(by, rows)
        return rows

    def _slow_sum(self, item: Item, p: Array, sums: Sums) -> Array:
        """(N,) their weighted sum; one number more or less changes a part of the chain alone."""
        by: object = (self._moving, self._bending)
        if by not in sums:
            sums[by] = self._summed(item, p)
        total = sums[by]
        for effect in self._filters:
            by = (by, effect)
            if by not in sums:
                sums[by] = effect.filtered(total, item.run)
            total = sums[by]
        return total[item.compared] if self._needed == _FILTERED else total

    @cached_property
    def _filters(self) -> tuple[Effect, ...]:
        """The filters right behind the plays."""
        return tuple(effect for effect in self.at(Place.LINEAR) if effect.order == 0)

    def _plays(self, item: Item) -> Array:
        """(n + 1, N) plays behind what bends them; those of the last few hypotheses are remembered."""
        if not self._bending:
            return self._moved(item)
        by = (self._moving, self._bending, self._needed == _MOVED)
        rows = item.moved.recalled(by)
        if rows is None:
            rows = chain.bent(self._bending, self._moved(item), self.thresholds)
            item.moved.remember(by, rows)
        return rows

    def _moved(self, item: Item) -> Array:
        """(n + 1, N) the plays before they are bent, remembered too."""
        by = (self._moving, (), self._needed == _MOVED)
        rows = item.moved.recalled(by)
        if rows is None:
            rows = chain.moved(self.at(Place.PLAYS), *self._input(item))
            if self._needed == _MOVED:
                rows = item.picked(rows)
            item.moved.remember(by, rows)
        return rows

    def _summed(self, item: Item, p: Array) -> Array:
        """(N,) weighted sum of the plays; those without a weight need not move for it.

        The sum is the same to the last digit whether they are remembered or not: what a process remembers depends on
        what it has tried before.
        """
        if self._bending:
            return chain.bent_sum(self._bending, p, self._moved(item), self.thresholds)
        rows = item.moved.recalled((self._moving, (), self._needed == _MOVED))
        if rows is not None:
            return operators.weighted_sum(p, rows)
        total = chain.summed(self.at(Place.PLAYS), p, *self._input(item))
        return total[item.compared] if self._needed == _MOVED else total

    @cached_property
    def _bending(self) -> tuple[Effect, ...]:
        """The effects that bend the plays."""
        return tuple(effect for effect in self.at(Place.PLAYS) if effect.bends_plays())

    @cached_property
    def _moving(self) -> object:
        """All that the plays' movement depends on, of one record."""
        movers = tuple(effect for effect in self.at(Place.PLAYS) if effect.moves_plays())
        return self.thresholds.tobytes(), tuple(self.at(Place.DRIVE)), self.stages, movers

    def _input(self, item: Item) -> tuple[Array, Run, Array, Array]:
        """What the plays follow, with their thresholds and where they start."""
        a = item.run.v
        for effect in self.at(Place.DRIVE):
            a = effect.drive(a, item.run)
        course = reduction.Course(item.name, a, a, item.history, 0, len(a))
        course = joint.through_front(course, self.stages)
        start = reduction.start_states(course.v, course.history, self.thresholds)
        return course.v, item.run, self.thresholds, start

    def mapped(self, h: Array, level: Array, item: Item) -> Array:
        """The output behind its maps, a limit in front of the offset and a sensor behind it; the offset is `level`."""
        maps = self.at(Place.OUTPUT)
        for effect in maps:
            if effect.order == 0:
                h = effect.mapped(h, item.run)
        h = h + level
        for effect in maps:
            if effect.order > 0:
                h = effect.mapped(h, item.run)
        return h

    def level(self, h: Array, item: Item, largest: Array | None = None) -> tuple[Array, Array]:
        """The best offset (N,) in front of a sensor and behind a limit, and how the output changes with it (N,).

        A sensor sees the responses to an unknown start state too, so they are part of it, and what is added at the very
        end is none of it: a curve about the wrong offset would be another one. `largest`: limits of their factors.
        """
        y = item.y[item.compared] - self.added(item)
        free = self._free(item) if self._needed == _MAPPED else self.nuisances(item)
        limits = np.full(len(free), np.inf) if largest is None else largest
        factors = np.zeros(len(free))
        level = np.full(len(h), float(np.mean(y - self.compared(h, item))))
        step = DIFFERENCE * max(float(np.ptp(h)), 1e-12)
        for _ in range(SETTLED):
            bent = self.mapped(h, level, item)
            if not np.isfinite(bent).all():
                raise NotFiniteError
            moved = (self.mapped(h, level + step, item) - bent) / step
            left, slopes = y - self.compared(bent, item), self.compared(free * moved, item)
            if not np.any(slopes[0]):
                break
            change, *_ = np.linalg.lstsq(slopes @ slopes.T, slopes @ left, rcond=1e-12)
            if np.any(np.abs(factors + change) > limits):
                change = _within(slopes, left, -limits - factors, limits - factors)
            factors += change
            shift = change @ free
            level = level + shift
            if np.max(np.abs(shift)) < step:
                break
        return level, moved

    def added(self, item: Item) -> Array:
        """What is added at the very end, of the samples that are compared."""
        total = np.zeros(len(item.run.t))
        for effect in self.at(Place.ADDED):
            total = total + effect.added(item.run)
        return total[item.compared]

    @cached_property
    def bends(self) -> bool:
        """Whether there is an output map."""
        return any(effect.place is Place.OUTPUT for effect in self.effects)

    def nuisances(self, item: Item, offset: Array | None = None) -> Array:
        """(k, N) what is free in every record, of the compared samples: its offset, responses to an unknown start.

        A history says what the plays remember, and not when the drive was there, which slow effects depend on.
        `offset`: what the offset does to the output, where a map lies between them.
        """
        free = self._free(item)[:, item.compared]
        return free if offset is None else free * offset

    def _free(self, item: Item) -> Array:
        """The same of all samples."""
        free = [np.ones((1, len(item.run.t)))]
        free += [found for effect in self._starting(item) if len(found := effect.transients(item.run))]
        return np.concatenate(free)

    def _starting(self, item: Item) -> list[Effect]:
        return [effect for effect in self.effects if item.history is None or not effect.fades]

    def largest(self, item: Item, p: Array) -> Array:
        """(k,) how large the factors of `nuisances` may be: an effect of little weight has little left from a start."""
        span = FAR * float(np.sum(p)) * (item.session or item.run).drive_range
        limits = [np.full(1, np.inf), *(span * effect.largest(item.run) for effect in self._starting(item))]
        return np.concatenate(limits)

    def error(self, item: Item, p: Array, like: tuple[Actuator, Array] | None = None) -> Array:
        """Measured less predicted, what is free in the record fitted away; NaN where it is not compared.

        `like`: another actuator and its weights, whose `nuisances` are free in place of its own, to compare the two on
        equal terms.
        """
        by = self._mark(p), None if like is None else like[0]._mark(like[1])
        whole = item.errors.recalled(by)
        if whole is None:
            left, offset = self._left(item, p)
            known = np.isfinite(left)
            free = (self.nuisances(item, offset) if like is None else like[0].nuisances(item))[:, known]
            largest = self.largest(item, p) if like is None else like[0].largest(item, like[1])
            e = np.full(len(left), np.nan)
            e[known] = left[known] - _within(free, left[known], -largest, largest) @ free
            whole = np.full(len(item.y), np.nan)
            whole[item.compared] = e
            whole.setflags(write=False)
            item.errors.remember(by, whole)
        return whole

    def _mark(self, p: Array) -> object:
        """All that a prediction depends on beside the record."""
        return self._numbers, p.tobytes()

    @cached_property
    def _numbers(self) -> object:
        effects = tuple((type(effect), repr(effect.model_dump())) for effect in self.effects)  # a user's may hold lists
        return self.thresholds.tobytes(), self.stages, effects

    def _left(self, item: Item, p: Array) -> Array:
        """(2, N) of the compared samples: what is left before anything is fitted, and how the offset changes it."""
        by = self._mark(p)
        found = item.left.recalled(by)
        if found is None:
            rows, constant = self.columns(item, p)
            h, moved = rows[0] + constant, np.ones(rows.shape[1])
            if self.bends:
                level, moved = self.level(h, item, self.largest(item, p))
                h = self.mapped(h, level, item)
            left = item.y[item.compared] - self.compared(h, item) - self.added(item)
            found = np.stack([left, self.compared(moved, item)])
            item.left.remember(by, found)
        return found


def _within(columns: Array, y: Array, low: Array, high: Array) -> Array:
    """Factors (k,) of columns (k, N) that fit y best between their limits; 0 lies between them."""
    table = np.empty((len(columns) + 1, len(y))).T
    table[:, :-1], table[:, -1] = columns.T, y
    triangle = reduction.reflected(table).triangle
    solution, *_ = np.linalg.lstsq(triangle[:, :-1], triangle[:, -1], rcond=1e-10)
    if np.all((low <= solution) & (solution <= high)):
        return np.asarray(solution)
    from scipy.optimize import lsq_linear

    able = high > low
    found = np.zeros(len(low))
    found[able] = lsq_linear(triangle[:, :-1][:, able], triangle[:, -1], (low[able], high[able]), method="bvls").x
    return found


class _Block:
    """A record's part of the system about a shape and weights: plays and measured output, reduced; derivatives later.

    The reflections of the reduction are kept, so that the columns of the derivatives are reduced alone.
    """

    def __init__(self, here: Actuator, item: Item, p: Array) -> None:
        self._item, self._p = item, p
        self._level = np.zeros(1)
        offset = None
        rows, constant = here.columns(item)
        h = operators.weighted_sum(p, rows) + constant
        measured = item.y[item.compared]
        if here.bends:
            self._level, moved = here.level(h, item)
            offset = here.compared(moved, item)
            bent = here.mapped(h, self._level, item)
            step = DIFFERENCE * max(float(np.ptp(h)), 1e-12)
            slope = (here.mapped(h + step, self._level, item) - bent) / step
            rows = here.compared(rows * slope, item)
            h = here.compared(bent, item)
            target = measured - h + p @ rows
        else:
            target = measured - constant
        added = here.added(item)
        self._sum = h + added
        self.samples = len(h)
        free = here.nuisances(item, offset)
        self._free = len(free)
        table = np.empty((len(free) + len(rows) + 1, len(h))).T
        table[:, : len(free)] = free.T
        table[:, len(free) : -1] = rows.T
        table[:, -1] = target - added
        self._reduced = [reduction.reflected(part) for part in self._cut(table)]

    def _cut(self, table: Array) -> list[Array]:
        """A few thousand samples at a time, which stay in the cache while they are reduced."""
        if len(table) <= reduction.CHUNK:
            return [table]
        return [table[k : k + reduction.CHUNK] for k in range(0, len(table), reduction.CHUNK)]

    def system(self, varied: Sequence[Actuator] = ()) -> Array:
        """Triangular: the plays, the measured output, and the derivatives; what is free in the record is taken out."""
        if not varied:
            return self._without_free([part.triangle for part in self._reduced])
        table = np.empty((len(varied), self.samples)).T
        sums: Sums = {}
        for j, other in enumerate(varied):
            table[:, j] = (self._of(other, sums) - self._sum) / DIFFERENCE
        parts = zip(self._reduced, self._cut(table), strict=True)
        return self._without_free([part.extended(columns) for part, columns in parts])

    def _of(self, other: Actuator, sums: Sums) -> Array:
        """What other numbers predict, with the same weights and offset."""
        rows, constant = other.columns(self._item, self._p, sums)
        moved = rows[0] + constant
        if other.bends:
            moved = other.compared(other.mapped(moved, self._level, self._item), self._item)
        return np.asarray(moved + other.added(self._item))

    def _without_free(self, triangles: Sequence[Array]) -> Array:
        whole = triangles[0] if len(triangles) == 1 else reduction.triangle(*triangles)
        return whole[self._free :, self._free :]


def linear(structure: Structure, items: Sequence[Item], shape: Array, p: Array) -> Shaped:
    """The best weights for a shape, and the system that is linear about the shape and weights `p` near to them."""
    n1 = len(structure.thresholds)
    here = structure.actuator(shape)
    try:
        blocks = [_Block(here, item, p) for item in items if item.known.any()]
    except NotFiniteError:
        return Shaped(shape, p, math.inf, p, 1, lambda: Reduced(structure.thresholds, np.empty((0, 0)), (), ()))
    samples = sum(block.samples for block in blocks)

    def derived() -> Reduced:
        varied = structure.varied(shape, here)
        whole = reduction.triangle(*(block.system(varied) for block in blocks))
        measured_last = [*range(n1), *range(n1 + 1, whole.shape[1]), n1]
        return Reduced(structure.thresholds, whole[:, measured_last], (), (samples,))

    whole = reduction.triangle(*(block.system() for block in blocks))
    if not np.isfinite(whole).all():  # numbers far from what the records are like
        return Shaped(shape, p, math.inf, p, samples, derived)
    columns = np.arange(n1)
    best = weights.non_negative(whole, columns)
    return Shaped(shape, p, root_mean_square(weights.residual(whole, columns, best), samples), best, samples, derived)


@dataclass(frozen=True)
class Fitted:
    """A structure with its numbers and weights, and the rms error of the fit."""

    structure: Structure
    shape: Array
    weights: Array
    rms: float

    @property
    def actuator(self) -> Actuator:
        """What was found."""
        return self.structure.actuator(self.shape)

    @property
    def bare(self) -> bool:
        """Whether there is neither a front nor an effect."""
        return not self.structure.parts and not self.actuator.stages

    def errors(self, items: Sequence[Item], like: Fitted | None = None) -> list[Array]:
        """Error signals over records; `like`: with what another model leaves free in them."""
        actuator = self.actuator
        other = None if like is None else (like.actuator, like.weights)
        return [actuator.error(item, self.weights, other) for item in items]


@dataclass(frozen=True, eq=False)
class Search:
    """A search for the numbers of a structure, as far as it has come; it can go on from there."""

    structure: Structure
    items: Sequence[Item]
    now: Shaped
    damping: float = joint.DAMPING

    def further(self, steps: int = joint.MOST_STEPS, little: float = POLISHED) -> Search:
        """So many steps further at most, until one lowers the error by too `little`."""
        now, damping = joint.search(
            lambda shape, p: linear(self.structure, self.items, shape, p),
            self.structure,
            self.now,
            steps,
            little,
            self.damping,
        )
        return replace(self, now=now, damping=damping)

    def found(self, otherwise: Array) -> Fitted:
        """What was found; `otherwise`: weights where the numbers lie too far from what the records are like."""
        best = self.now.best if math.isfinite(self.now.rms) else otherwise
        return Fitted(self.structure, self.now.shape, best, self.now.rms)


def begun(structure: Structure, items: Sequence[Item], start: Array, p: Array) -> Search:
    """A search at its start; `p`: weights near which to begin."""
    return Search(structure, items, linear(structure, items, np.clip(start, *structure.bounds), p))


def fit(structure: Structure, items: Sequence[Item], start: Array, p: Array) -> Fitted:
    """The end of a search from a start; `p`: weights near which to begin."""
    return begun(structure, items, start, p).further().found(p)


def invertible(fitted: Fitted, items: Sequence[Item], floor: float) -> tuple[Fitted, weights.Weights]:
    """A hypothesis with p_0 raised to a share `floor` of the sum of weights where the records allow it, as `identify`
    does it (`weights.fit`), and what was done; all other numbers are as they were."""
    p, here = fitted.weights, fitted.actuator
    kept = weights.Weights(p, fitted.rms)
    if len(p) < 2 or p[0] >= floor * float(np.sum(p)):
        return fitted, kept
    blocks = [_Block(here, item, p) for item in items if item.known.any()]
    whole = reduction.triangle(*(block.system() for block in blocks))
    samples = sum(block.samples for block in blocks)
    system = Reduced(fitted.structure.thresholds, whole, (), (samples,))
    made = weights.fit(system, np.arange(len(p)), floor)
    if made.free_p0 is None:
        return fitted, kept
    return replace(fitted, weights=made.p, rms=made.rms), replace(made, free_p0=float(p[0]))


def rms(errors: Sequence[Array]) -> float:
    """rms over all compared samples of all records."""
    joined = np.concatenate(list(errors))
    joined = joined[np.isfinite(joined)]
    return float(np.sqrt(np.mean(joined**2))) if len(joined) else float("nan")
