"""The whole actuator, static model and effects in the order of the chain, simulated over the records of a session."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import EffectsError
from hystgen.chain.static import StaticModel, directions, through_stages
from hystgen.effects.base import Effect, Place, Run
from hystgen.plays import operators

Array = NDArray[np.float64]

VISIT = 10.0
"""[s] Duration of the linear move to each value of a history."""

VISIT_SAMPLES = 200
"""[samples] Length of that move. With a mode of 0.5 Hz, more samples change the output after a history by at most 4e-6
of its range; only 25 change it by 2e-4. Set by: benchmarks/chosen_numbers.py visits."""

SESSION_GAP = 10.0
"""[median steps] In longer gaps between records of a session the drive is held; in shorter ones it is linear."""

def rank(effect: Effect | type[Effect]) -> tuple[int, int]:
    """Position in the chain: place, then order; gains lie between the linear filters of order 0 and the others."""
    places = (Place.DRIVE, Place.PLAYS, Place.LINEAR, Place.GAIN, Place.LINEAR, Place.OUTPUT, Place.ADDED)
    late = effect.place is Place.LINEAR and effect.order > 0
    return 4 if late else places.index(effect.place), effect.order


def in_order(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """The effects in the order of the chain; effects with the same place and order stay as given."""
    return tuple(sorted(effects, key=rank))


@dataclass(frozen=True)
class JoinedRuns:
    """Consecutive records as one run, with the slice of each record in it."""

    run: Run
    parts: tuple[slice, ...]


def join(runs: Sequence[Run], history: Sequence[float] | None = None) -> JoinedRuns:
    """The runs of a session on one time axis.

    A record keeps its times (session time) if they follow the previous record's and leave room for its rest; otherwise
    it starts one median step after the previous record plus its rest. In rests, and in gaps of more than `SESSION_GAP`
    steps, the drive is held until one step before the next record. Before the first record the drive visits the values
    of `history`, each by a linear move of `VISIT` seconds, and holds the last for the record's rest. Raises ValueError
    for records without samples.
    """
    if not runs or any(len(run.t) == 0 for run in runs):
        raise ValueError("a session needs at least one record, and no record may be empty")
    names = set.intersection(*(set(run.extra) for run in runs))
    t: list[Array] = []
    v: list[Array] = []
    extra: dict[str, list[Array]] = {name: [] for name in names}
    parts = []
    count = 0

    def put(times: Array, drives: Array, columns: dict[str, Array]) -> None:
        nonlocal count
        t.append(np.asarray(times, dtype=np.float64))
        v.append(np.asarray(drives, dtype=np.float64))
        for name in names:
            extra[name].append(np.asarray(columns[name], dtype=np.float64))
        count += len(times)

    for i, run in enumerate(runs):
        step = float(np.median(np.diff(run.t))) if len(run.t) > 1 else 1.0
        times = np.asarray(run.t, dtype=np.float64)
        if i == 0 and history:
            end = float(times[0]) - step - run.rest
            visits = [float(x) for x in history]
            ramps = [np.linspace(a, b, VISIT_SAMPLES + 1)[1:] for a, b in itertools.pairwise(visits)]
            drives = np.concatenate([visits[:1], *ramps])
            since = np.arange(len(drives)) * (VISIT / VISIT_SAMPLES)
            first = {name: np.full(len(drives), float(run.extra[name][0])) for name in names}
            put(np.asarray(end - since[::-1], dtype=np.float64), drives, first)
        elif i:
            end = float(t[-1][-1])
            wanted = end + run.rest + step
            if times[0] <= end or (run.rest > 0.0 and times[0] < wanted):
                times = times + (wanted - times[0])
        pause = float(times[0] - t[-1][-1]) if count else 0.0
        if pause > SESSION_GAP * step or (run.rest > 0.0 and pause > 1.5 * step):
            held = {name: extra[name][-1][-1:] for name in names}
            put(np.array([times[0] - step]), v[-1][-1:], held)
        parts.append(slice(count, count + len(times)))
        put(times, run.v, {name: run.extra[name] for name in names})
    whole = Run(np.concatenate(t), np.concatenate(v), {name: np.concatenate(extra[name]) for name in names})
    return JoinedRuns(whole, tuple(parts))


NO_MOVE = 1e-12
"""[fraction of the largest drive] Behind an effect on the drive, a move of at most this size is rounding and has no
direction. While the drive rests, the output of a lag of a thousand samples moves back and forth by about 1e-13, since
rounding makes evenly spaced times, and thus the lag's factors, differ. Set by: tests/test_branches.py."""


def arriving_slack(static: StaticModel, effects: Sequence[Effect]) -> float:
    """Largest reversal in front of the memoryless part that does not switch its branch, in drive units."""
    if not static.branches_differ or not any(effect.place is Place.DRIVE for effect in effects):
        return 0.0
    largest = max(abs(end) for end in static.input_range)
    return NO_MOVE * largest if math.isfinite(largest) else 0.0


class Ordered:
    """Effects in the order of the chain, and their action at each place in it."""

    effects: tuple[Effect, ...]

    def at(self, place: Place) -> Sequence[Effect]:
        """The effects at one place, in the order of the chain."""
        return self._at.get(place, ())

    @cached_property
    def _at(self) -> dict[Place, list[Effect]]:
        found: dict[Place, list[Effect]] = {}
        for effect in sorted(self.effects, key=lambda each: each.order):
            found.setdefault(effect.place, []).append(effect)
        return found

    @cached_property
    def filters(self) -> tuple[Effect, ...]:
        """The filters right behind the plays; all others are behind the gains."""
        return tuple(effect for effect in self.at(Place.LINEAR) if effect.order == 0)

    @cached_property
    def bending(self) -> tuple[Effect, ...]:
        """The effects that bend the plays."""
        return tuple(effect for effect in self.at(Place.PLAYS) if effect.bends_plays())

    @cached_property
    def joining(self) -> tuple[Effect, ...]:
        """The effects that add a term to the play sum."""
        return tuple(effect for effect in self.at(Place.PLAYS) if effect.joins_plays())

    @cached_property
    def mover(self) -> Effect | None:
        """The one effect that determines how the plays move, if any."""
        return next((effect for effect in self.at(Place.PLAYS) if effect.moves_plays()), None)

    def driven(self, run: Run) -> Array:
        """The drive (N,) behind delay, slew limit and lag."""
        a = np.ascontiguousarray(run.v, dtype=np.float64)
        for effect in self.at(Place.DRIVE):
            a = effect.drive(a, run)
        return a

    def moved(self, w: Array, run: Run, thresholds: Array, start: Array) -> Array:
        """Rows (n+1, N) of the plays for their input `w`, before any effect bends them."""
        if self.mover is None:
            return operators.plays(w, thresholds, start)
        return self.mover.plays(w, run, thresholds, start)

    def summed(self, p: Array, w: Array, run: Run, thresholds: Array, start: Array) -> Array:
        """The weighted sum (N,) of the rows of `moved`."""
        if self.mover is None:
            return operators.play_sum(w, thresholds, start, p)
        if type(self.mover).summed is Effect.summed:
            return operators.weighted_sum(p, self.moved(w, run, thresholds, start))
        return self.mover.summed(p, w, run, thresholds, start)

    def bent(self, rows: Array, thresholds: Array) -> Array:
        """The rows after every effect that bends them."""
        for effect in self.bending:
            rows = effect.bent(rows, thresholds)
        return rows

    def bent_sum(self, p: Array, rows: Array, thresholds: Array) -> Array:
        """The weighted sum (N,) of the rows of `bent`; there must be an effect that bends them."""
        *first, last = self.bending
        for effect in first:
            rows = effect.bent(rows, thresholds)
        return last.bent_sum(p, rows, thresholds)

    def parallel(self, w: Array) -> Array:
        """The terms (N,) in parallel with the plays, for their input `w` (N,)."""
        total = np.zeros(len(w))
        for effect in self.joining:
            total += effect.parallel(w)
        return total

    def mapped(self, h: Array, level: Array | float, run: Run) -> Array:
        """The output after its maps: limits act before the offset `level` is added, sensors after."""
        for effect in self.at(Place.OUTPUT):
            if effect.order == 0:
                h = effect.mapped(h, run)
        h = h + level
        for effect in self.at(Place.OUTPUT):
            if effect.order > 0:
                h = effect.mapped(h, run)
        return h

    def added(self, run: Run) -> Array:
        """Sum (N,) of the terms added at the end of the chain."""
        total = np.zeros(len(run.t))
        for effect in self.at(Place.ADDED):
            total = total + effect.added(run)
        return total


class Chain(Ordered):
    """Static model and effects as one forward model.

    Order: delay, slew limit, lag, memoryless front, plays, creep, ageing and thermal, resonances, saturation, output
    offset, sensor nonlinearity, drift. Raises EffectsError if two effects determine how the plays move.
    """

    def __init__(self, cascade: StaticModel, effects: Sequence[Effect]) -> None:
        movers = [effect.name for effect in effects if effect.moves_plays()]
        if len(movers) > 1:
            raise EffectsError(f"only one effect can set how the plays move, not {' and '.join(movers)}")
        self.cascade = cascade
        self.effects = in_order(effects)

    def require_columns(self, runs: Sequence[Run]) -> None:
        """Raise EffectsError if a run lacks a column that an effect needs."""
        for name in sorted({column for effect in self.effects for column in effect.read}):
            if any(name not in run.extra for run in runs):
                who = next(effect.name for effect in self.effects if name in effect.read)
                raise EffectsError(f"the effect {who} needs the column {name}, which a record lacks")

    def simulate(self, runs: Sequence[Run], history: Sequence[float] | None = None) -> list[Array]:
        """Outputs (N,) of each run of a session, which begins at rest in the start memory; see `join`.

        Raises EffectsError if a column is missing or the result of an effect has the wrong form.
        """
        self.require_columns(runs)
        session = join(runs, history)
        y = self.output(session.run)
        if not np.isfinite(y).all() and np.isfinite(session.run.v).all():
            names = ", ".join(effect.name for effect in self.effects) or "the model"
            raise EffectsError(f"the output is not finite; check the parameters of {names}")
        return [y[part] for part in session.parts]

    def output(self, run: Run) -> Array:
        """Output (N,) of one run that starts at rest in the start memory."""
        w = self.play_input(run)
        y = np.asarray(self.cascade.pi.weights) @ self.plays(w, run) + self.parallel(w)
        for effect in self.filters:
            y = effect.filtered(y, run)
        for effect in self.at(Place.GAIN):
            gain, offset = effect.gains(run)
            y = gain * y + offset
        for effect in self.at(Place.LINEAR)[len(self.filters) :]:
            y = effect.filtered(y, run)
        return self.mapped(y, self.cascade.output_offset, run) + self.added(run)

    def play_input(self, run: Run) -> Array:
        """Input `w` (N,) of the plays: the drive behind delay, slew limit, lag and front."""
        a = self.driven(run)
        if not self.cascade.branches_differ:
            return through_stages(self.cascade.stages, a, None)
        before = float(self.cascade.front_inverse(self.cascade.pi.start[0])) if self.cascade.start_is_defined else 0.0
        moved = a
        if slack := arriving_slack(self.cascade, self.effects):
            moved = operators.plays(a, np.array([0.5 * slack]), np.array([before]))[0]
        rising = directions(np.concatenate([[before], moved]), True)[1:]
        return through_stages(self.cascade.stages, a, rising)

    def plays(self, w: Array, run: Run) -> Array:
        """Rows (n+1, N) to be weighted, from the start memory on: plays, moved by at most one effect and bent by any
        others."""
        pi = self.cascade.pi
        thresholds = np.asarray(pi.thresholds)
        return self.bent(self.moved(w, run, thresholds, np.asarray(pi.start)), thresholds)
