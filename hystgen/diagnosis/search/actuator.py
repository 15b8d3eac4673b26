"""The forward model of a hypothesis over one record: plays behind a front, effects around them, free start states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hystgen.chain import chain
from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.search import acceptance
from hystgen.effects.base import Effect, Place, Run
from hystgen.front.stage import Stage
from hystgen.identification import joint, reduction
from hystgen.identification.joint import DIFFERENCE
from hystgen.plays import operators

Array = NDArray[np.float64]
Sums = dict[object, Array]

ALL = slice(None)

_MOVED, _FILTERED, _RINGING, _MAPPED = range(4)
"""Parts of the chain behind which the compared samples are picked: plays, filters behind them, other filters, maps."""

LEVEL_STEPS = 3
"""Most Newton steps to the offset in front of a map, whose curvature is a few per cent: each squares the rest."""


class NotFiniteError(ArithmeticError):
    """An output map has no finite values at its input."""


@dataclass(frozen=True)
class Actuator:
    """Plays with given thresholds between a front and effects; the weights are given apart."""

    thresholds: Array
    stages: tuple[Stage, ...]
    effects: tuple[Effect, ...]
    gains: dict[tuple[int, int], tuple[Effect, Run, Array, Array]] = field(
        default_factory=dict, compare=False, repr=False
    )
    """Gain and offset over a run, with the effect and the run themselves: the `id` of a deleted one may be reused."""

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
        """Rows that the weights multiply, up to the output map, and the constant that is added to them.

        Of the compared samples alone where nothing behind needs the others; `compared` picks them in any case. With `p`
        a single row, the weighted sum, for which the rest of the chain runs once. `sums`: weighted sums shared by
        actuators that have effects in common.
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
                if self.at(Place.GAIN):  # without one the constant is zero
                    constant = effect.filtered(constant, run)
        if self._needed == _RINGING:
            rows, constant = item.picked(rows), constant[item.compared]
        return rows, constant

    def compared(self, values: Array, item: Item) -> Array:
        """The compared samples of values (N,) or (k, N) at the samples of `columns`."""
        return values[..., item.compared] if self._needed == _MAPPED else values

    @cached_property
    def _needed(self) -> int:
        """The last part of the chain that needs every sample; behind it the compared ones are enough."""
        if not all(effect.pointwise for effect in self.at(Place.OUTPUT)):
            return _MAPPED
        if len(self._filters) < len(self.at(Place.LINEAR)):
            return _RINGING
        return _FILTERED if self._filters or not all(effect.pointwise for effect in self._bending) else _MOVED

    def _slow(self, item: Item) -> Array:
        """(n + 1, N) plays behind the filters that follow them, remembered like the plays."""
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
        """(N,) their weighted sum; actuators that differ in one number share the part of the chain before it."""
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
        """(n + 1, N) plays behind the effects that bend them; those of the last few hypotheses are remembered."""
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

        The sum has the same bits whether the plays are remembered or not: that depends on what a process did before.
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
        """Everything but the record on which the movement of the plays depends."""
        movers = tuple(effect for effect in self.at(Place.PLAYS) if effect.moves_plays())
        return self.thresholds.tobytes(), tuple(self.at(Place.DRIVE)), self.stages, movers

    def _input(self, item: Item) -> tuple[Array, Run, Array, Array]:
        """The input of the plays, the run, their thresholds and their start."""
        a = item.run.v
        for effect in self.at(Place.DRIVE):
            a = effect.drive(a, item.run)
        course = reduction.Course(item.name, a, a, item.history, 0, len(a))
        course = joint.through_front(course, self.stages)
        start = reduction.start_states(course.v, course.history, self.thresholds)
        return course.v, item.run, self.thresholds, start

    def mapped(self, h: Array, level: Array, item: Item) -> Array:
        """The output behind its maps: a limit in front of the offset `level`, a sensor behind it."""
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

        A sensor sees the responses to an unknown start state as well, so they are included; drift added behind it is
        not, since a curve about the wrong offset would be a different one. `largest`: limits of the responses' factors.
        """
        y = item.y[item.compared] - self.added(item)
        free = self._free(item) if self._needed == _MAPPED else self.nuisances(item)
        limits = np.full(len(free), np.inf) if largest is None else largest
        factors = np.zeros(len(free))
        level = np.full(len(h), float(np.mean(y - self.compared(h, item))))
        step = DIFFERENCE * max(float(np.ptp(h)), 1e-12)
        for _ in range(LEVEL_STEPS):
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
        """The sum of what is added at the end of the chain, at the compared samples."""
        total = np.zeros(len(item.run.t))
        for effect in self.at(Place.ADDED):
            total = total + effect.added(item.run)
        return total[item.compared]

    @cached_property
    def bends(self) -> bool:
        """Whether there is an output map."""
        return any(effect.place is Place.OUTPUT for effect in self.effects)

    def nuisances(self, item: Item, offset: Array | None = None) -> Array:
        """(k, N) free components of every record at the compared samples: its offset, responses to an unknown start.

        A history gives the memory of the plays, but not its times, on which slow effects depend. `offset`: the change
        of the output with the offset, where a map lies between them.
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
        """(k,) largest factors of `nuisances`: an effect of little weight has a small start response."""
        span = acceptance.START_SPAN * float(np.sum(p)) * (item.session or item.run).drive_range
        found = np.concatenate([[np.inf], *(effect.largest(item.run) for effect in self._starting(item))])
        limited = np.isfinite(found)
        return np.where(limited, span * np.where(limited, found, 0.0), np.inf)  # a span of 0 limits no other either

    def error(self, item: Item, p: Array, like: tuple[Actuator, Array] | None = None) -> Array:
        """Measured less predicted with the free components fitted; NaN where the record is not compared.

        `like`: another actuator and its weights, whose `nuisances` are free in place of its own: the two are then
        compared on equal terms.
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
        """Everything but the record on which a prediction depends."""
        return self._numbers, p.tobytes()

    @cached_property
    def _numbers(self) -> object:
        effects = tuple((type(effect), repr(effect.model_dump())) for effect in self.effects)  # a user's may hold lists
        return self.thresholds.tobytes(), self.stages, effects

    def _left(self, item: Item, p: Array) -> Array:
        """(2, N) at the compared samples: the error before a fit of free components, and its change with the offset."""
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
