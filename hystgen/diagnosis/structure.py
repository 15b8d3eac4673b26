"""A hypothesis about the actuator as a fit sees it: plays behind a front, effects around them, numbers to find.

The output is linear in the weights of the plays wherever an output map does not bend it, so every fit solves for the
weights and the change of all other numbers at once (`identification.joint`), on the free-run error of whole records.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from hystgen.effects import chain
from hystgen.effects.base import Candidate, Effect, Place, Run
from hystgen.identification import joint, reduction, weights
from hystgen.identification.constrained import root_mean_square
from hystgen.identification.fronts import Front, Kept
from hystgen.identification.joint import DIFFERENCE, Shaped
from hystgen.models import Stage

Array = NDArray[np.float64]


REMEMBERED, MOST_BYTES = 3, 2**28
"""Movements of the plays that are remembered for a record, and the size of one that is."""


SETTLED = 3
"""Steps to the offset in front of a map; each squares what is left of the map's curvature, some per cent."""


@dataclass(frozen=True)
class Item:
    """A record as it is compared: `y` is NaN where it is not; `history` the drive before it, None when unknown.

    `session`: all records on one time axis, where they are of one session, and `part` what of it is this record.
    `moved`: how the plays moved lately, by what moved them, since most numbers of a search do not change it.
    """

    name: str
    run: Run
    y: Array
    history: tuple[float, ...] | None
    output_range: float
    session: Run | None = None
    part: slice = field(default_factory=lambda: slice(None))
    moved: dict[object, Array] = field(default_factory=dict, repr=False, compare=False)

    @property
    def known(self) -> NDArray[np.bool_]:
        """The samples that are compared."""
        return np.isfinite(self.y)

    def thinned(self, every: int) -> Item:
        """The same with one in so many samples compared."""
        if every <= 1:
            return self
        y = np.full_like(self.y, np.nan)
        y[::every] = self.y[::every]
        return replace(self, y=y)


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


_ORDER = {place: k for k, place in enumerate(Place)}


@dataclass(frozen=True)
class Actuator:
    """Plays of given thresholds between a front and effects; weights apart."""

    thresholds: Array
    stages: tuple[Stage, ...]
    effects: tuple[Effect, ...]
    gains: dict[tuple[int, int], tuple[Array, Array]] = field(default_factory=dict, compare=False, repr=False)

    def at(self, place: Place) -> list[Effect]:
        """The effects at one place of the chain, in its order."""
        return sorted((e for e in self.effects if e.place is place), key=lambda e: e.order)

    def columns(self, item: Item, p: Array | None = None) -> tuple[Array, Array]:
        """Rows that the weights multiply, up to the output map, and what is added to them without a weight.

        With `p` a single row, the weighted sum: cheaper, since what follows the plays runs once.
        """
        run = item.run
        plays = self._plays(item)
        rows = plays if p is None else (p @ plays)[None, :]
        constant = np.zeros(plays.shape[1])
        linear = self.at(Place.LINEAR)
        for effect in linear:
            if effect.order == 0:
                rows = effect.filtered(rows, run)
        whole = item.session or run
        for effect in self.at(Place.GAIN):
            if (id(effect), id(whole)) not in self.gains:
                self.gains[id(effect), id(whole)] = effect.gain(whole), effect.offset(whole)
            gain, offset = (values[item.part] for values in self.gains[id(effect), id(whole)])
            rows, constant = rows * gain, constant * gain + offset
        for effect in linear:
            if effect.order > 0:
                rows, constant = effect.filtered(rows, run), effect.filtered(constant, run)
        return rows, constant

    def _plays(self, item: Item) -> Array:
        """(n + 1, N) plays along the record; those of the last few hypotheses are remembered."""
        before, memory = tuple(self.at(Place.DRIVE)), tuple(self.at(Place.PLAYS))
        key = (self.thresholds.tobytes(), before, self.stages, memory)
        if key in item.moved:
            item.moved[key] = plays = item.moved.pop(key)  # the latest one comes last
            return plays
        a = item.run.v
        for effect in before:
            a = effect.drive(a, item.run)
        course = reduction.Course(item.name, a, a, item.history, 0, len(a), 0.0)
        course = joint.through_front(course, self.stages)
        w = course.v
        start = reduction.start_states(w, course.history, self.thresholds)
        plays = chain.plays(memory, w, item.run, self.thresholds, start)
        while len(item.moved) >= REMEMBERED:
            del item.moved[next(iter(item.moved))]
        if plays.nbytes <= MOST_BYTES:
            item.moved[key] = plays
        return plays

    def mapped(self, h: Array, level: float, item: Item) -> Array:
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

    def level(self, h: Array, item: Item) -> tuple[float, Array]:
        """The best offset in front of a sensor and behind a limit, and how the output changes with it (N,)."""
        known = item.known
        level = float(np.mean((item.y - h)[known]))
        step = DIFFERENCE * max(float(np.ptp(h)), 1e-12)
        for _ in range(SETTLED):
            bent = self.mapped(h, level, item)
            moved = (self.mapped(h, level + step, item) - bent) / step
            if not np.any(moved[known]):
                break
            level += float(moved[known] @ (item.y - bent)[known] / (moved[known] @ moved[known]))
        return level, moved

    def added(self, item: Item) -> Array:
        """What is added at the very end."""
        total = np.zeros(len(item.run.t))
        for effect in self.at(Place.ADDED):
            total = total + effect.added(item.run)
        return total

    @property
    def bends(self) -> bool:
        """Whether there is an output map."""
        return any(effect.place is Place.OUTPUT for effect in self.effects)

    def nuisances(self, item: Item, offset: Array | None = None) -> Array:
        """(k, N) what is free in every record: its offset, and responses to an unknown start state.

        `offset`: what the offset does to the output, where a map lies between them.
        """
        free = [np.ones((1, len(item.run.t))) if offset is None else offset[None, :]]
        if item.history is None:
            free += [found for effect in self.effects if len(found := effect.transients(item.run))]
        return np.concatenate(free)

    def error(self, item: Item, p: Array, free: Array | None = None) -> Array:
        """Measured less predicted, what is free in the record fitted away; NaN where it is not compared.

        `free`: `nuisances` of another model, to compare the two on equal terms.
        """
        rows, constant = self.columns(item, p)
        h = rows[0] + constant
        offset = None
        if self.bends:
            level, offset = self.level(h, item)
            h = self.mapped(h, level, item)
        e = item.y - h - self.added(item)
        known = np.isfinite(e)
        free = (self.nuisances(item, offset) if free is None else free)[:, known].T
        solution, *_ = np.linalg.lstsq(free, e[known], rcond=1e-10)
        e[known] -= free @ solution
        return np.asarray(e)


def linear(structure: Structure, items: Sequence[Item], shape: Array, p: Array) -> Shaped:
    """The best weights for a shape, and the system that is linear about the shape and weights `p` near to them."""
    n1, m = len(structure.thresholds), len(shape)
    here = structure.actuator(shape)
    varied = []
    for j in range(m):
        one = shape.copy()
        one[j] += DIFFERENCE
        varied.append(structure.actuator(one))
    whole: Array = np.empty((0, n1 + m + 1))
    samples = 0
    for item in items:
        known = item.known
        if not known.any():
            continue
        rows, constant = here.columns(item)
        h = p @ rows + constant
        slope: Array | float = 1.0
        level, offset = 0.0, None
        target = item.y - constant
        if here.bends:
            level, offset = here.level(h, item)
            bent = here.mapped(h, level, item)
            step = DIFFERENCE * max(float(np.ptp(h)), 1e-12)
            slope = (here.mapped(h + step, level, item) - bent) / step
            target = item.y - bent + slope * (p @ rows)
            h = bent
        added = here.added(item)
        target = target - added
        differences = np.empty((m, len(h)))
        for j, other in enumerate(varied):
            row, const = other.columns(item, p)
            moved = row[0] + const
            if other.bends:
                moved = other.mapped(moved, level, item)
            differences[j] = (moved + other.added(item) - h - added) / DIFFERENCE
        free = here.nuisances(item, offset)
        table = np.concatenate([free, rows * slope, differences, target[None, :]])[:, known].T
        block = np.asarray(np.linalg.qr(table, mode="r"))[len(free) :, len(free) :]
        whole = np.asarray(np.linalg.qr(np.concatenate([whole, block]), mode="r"))
        samples += int(np.count_nonzero(known))
    system = reduction.Reduced(structure.thresholds, whole, (), (samples,))
    if not np.isfinite(whole).all():  # numbers far from what the records are like
        return Shaped(shape, p, math.inf, system)
    columns = np.arange(n1)
    best = weights.non_negative(whole, columns)
    return Shaped(shape, p, root_mean_square(weights.residual(whole, columns, best), samples), system)


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

    def errors(self, items: Sequence[Item], like: Fitted | None = None) -> list[Array]:
        """Error signals over records; `like`: with what another model leaves free in them."""
        actuator, free = self.actuator, (like or self).actuator
        return [actuator.error(item, self.weights, free.nuisances(item)) for item in items]


def fit(
    structure: Structure, items: Sequence[Item], start: Array, p: Array, steps: int = joint.MOST_STEPS
) -> Fitted:
    """Search from a start; `p`: weights near which to begin."""
    low, high = structure.bounds
    found = joint.search(
        lambda shape, q: linear(structure, items, shape, q), structure, np.clip(start, low, high), p, steps
    )
    if not math.isfinite(found.rms):
        return Fitted(structure, found.shape, p, math.inf)
    best = weights.non_negative(found.system.whole, np.arange(len(structure.thresholds)))
    return Fitted(structure, found.shape, best, found.rms)


def rms(errors: Sequence[Array]) -> float:
    """rms over all compared samples of all records."""
    joined = np.concatenate(list(errors))
    joined = joined[np.isfinite(joined)]
    return float(np.sqrt(np.mean(joined**2))) if len(joined) else float("nan")
