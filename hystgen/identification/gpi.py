"""Fitting a play sum with a memoryless part in front of it.

The front's shape and the weights are found together (`joint`). Thresholds and weights are then chosen as for a plain
play sum, with the front's output as the drive (`pi`), and shape and weights are refined once more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen.front.stage import Stage
from hystgen.identification import faults, joint, pi, reduction, start
from hystgen.identification.joint import DeadZones, Front, Kept, Tanh, even_breaks
from hystgen.identification.pi import DIGITS, IdentificationError, Solution
from hystgen.identification.reduction import Course, Source
from hystgen.plays import operators

Array = NDArray[np.float64]
Tick = Callable[[int], None] | None

KINDS = ("pi", "gpi-deadzone", "gpi-tanh")
"""Kinds of model that can be fitted; `auto` chooses among them."""

BREAK_COUNTS = (1, 2, 4, 8)
"""Numbers of breaks tried for a dead-zone sum."""

FRONT_PARSIMONY = 1.02
"""A front with fewer shape parameters is chosen if its validation error is within this factor of the best."""

INVERSE_PLAYS = 10
"""Number of plays of the measured output in the convex problem that starts the search for a dead-zone sum."""

LEAST_SLOPE = 0.1
"""Smallest slope of a front's piece, and of the inverse play sum, in that problem, as a fraction of the mean slope."""


@dataclass(frozen=True)
class How:
    """The options of a fit: `wanted` (number or thresholds of plays) and `breaks`, None to let the records decide;
    `floor`: smallest share of p_0 in the sum of weights; `tick`: counts samples as they are fitted."""

    wanted: int | tuple[float, ...] | None
    breaks: int | tuple[float, ...] | None
    floor: float
    tick: Tick = None


@dataclass(frozen=True)
class FittedModel:
    """A front, its shape and the play sum behind it."""

    front: Front
    shape: Array
    solution: Solution

    @property
    def stages(self) -> tuple[Stage, ...]:
        """The stages of the model."""
        return self.front.stages(self.shape, DIGITS)

    def inner(self, item: Course) -> Course:
        """A course as the plays see it."""
        return joint.through_front(item, self.stages)

    def begun(self, courses: Sequence[Course]) -> list[Course]:
        """Held-out courses, with start memories if their history is unknown."""
        return start.of_model(courses, self.stages, self.solution.thresholds, self.solution.weights)


def solve(courses: Sequence[Course], kind: str, how: How) -> tuple[FittedModel, list[Course]]:
    """Fit a model of one kind; also returns the courses as they were compared, with the measured drive.

    Among the fronts of a kind whose error on blocks left out of the fit is close to the smallest, the front with the
    fewest shape parameters is chosen. Raises IdentificationError.
    """
    return _solved(courses, kind, how, lambda found: [_by_blocks(found)])[0]


def to_judge(courses: Sequence[Course], kind: str, how: How) -> list[tuple[FittedModel, list[Course]]]:
    """The fits of one kind between which held-out records decide, the simplest first; otherwise the same as `solve`.

    Several fits are returned only for tanh envelopes, with one and with two branches: two branches form a loop of their
    own, as wide for a small amplitude as for a large one. Records of a single amplitude, and blocks left out of them,
    do not show whether their loop is of that kind.
    """

    def chosen(found: Sequence[_Found]) -> Sequence[_Found]:
        return found if kind == "gpi-tanh" else [_by_blocks(found)]

    return _solved(courses, kind, how, chosen)


@dataclass(frozen=True)
class _Found:
    """A front, its shape with a dense list of plays behind it, and its error on blocks left out of the fit."""

    front: Front
    shape: Array
    error: float


def _by_blocks(found: Sequence[_Found]) -> _Found:
    """The front with the fewest shape parameters whose error on blocks left out of the fit is close to the best."""
    best = found[0]
    for each in found[1:]:
        if each.error * FRONT_PARSIMONY < best.error:
            best = each
    return best


def _solved(
    courses: Sequence[Course], kind: str, how: How, choose: Callable[[Sequence[_Found]], Sequence[_Found]]
) -> list[tuple[FittedModel, list[Course]]]:
    """The fits with the fronts that `choose` selects."""
    # a start memory found without the front is not exact with it, but better than too few samples to compare
    courses = start.needed(courses, (), how.wanted if kind == "pi" else None)
    plain, compared = pi.solve(courses, how.wanted, how.floor, how.tick)
    if kind == "pi":
        return [(FittedModel(Kept(), np.empty(0), plain), compared)]
    # without the front, the wrong plays would be chosen: search for the shape with a dense list of plays
    fine = plain.thresholds
    if not isinstance(how.wanted, tuple) and plain.reach > 0.0:
        fine = np.array(pi.dense(plain.reach, sum(item.used for item in compared)).thresholds)
    found: list[_Found] = []
    for front in fronts_of(kind, compared, how.breaks):
        shaped = _shaped(compared, front, fine, found[-1].shape if found else None, how.tick)
        found.append(_Found(front, shaped.shape, validation(shaped, front)))
    return [_finished(courses, compared, each, plain, how) for each in choose(found)]


def _finished(
    courses: Sequence[Course], compared: Sequence[Course], found: _Found, plain: Solution, how: How
) -> tuple[FittedModel, list[Course]]:
    """The fit with a front: plays placed behind it, and its shape refitted for them."""
    front, shape = found.front, found.shape
    courses = start.needed(courses, front.stages(shape, DIGITS), how.wanted)
    fitted = _solve_behind(courses, front, shape, how)
    # the thresholds may have changed: find the best shape for them again
    r = fitted.solution.thresholds
    shape = joint.refine(compared, front, shape, r, how.tick).shape
    fitted = _solve_behind(courses, front, shape, replace(how, wanted=tuple(float(x) for x in r)))
    if how.wanted is None:
        fitted = replace(fitted, solution=fitted.solution.without_idle_plays())
    fitted = replace(fitted, solution=replace(fitted.solution, sense=plain.sense))  # a front does not change it
    largest = float(fitted.solution.thresholds[-1])
    firsts = [fitted.inner(item).resettled(largest).first for item in courses]
    return fitted, [replace(item, first=first) for item, first in zip(courses, firsts, strict=True)]


def _solve_behind(courses: Sequence[Course], front: Front, shape: Array, how: How) -> FittedModel:
    stages = front.stages(shape, DIGITS)
    behind = [joint.through_front(item, stages) for item in courses]
    solution, _ = pi.solve(behind, how.wanted, how.floor, how.tick)
    return FittedModel(front, shape, solution)


def fronts_of(kind: str, courses: Sequence[Course], breaks: int | tuple[float, ...] | None) -> list[Front]:
    """The fronts of a kind, with increasing numbers of shape parameters."""
    drive = (min(item.drive_range[0] for item in courses), max(item.drive_range[1] for item in courses))
    if kind == "gpi-tanh":
        return [Tanh(drive), Tanh(drive, 2)]
    if isinstance(breaks, tuple):
        if not all(drive[0] < place < drive[1] for place in breaks):
            raise IdentificationError(
                f"breaks have to lie inside the drive range of the records, {drive[0]:.6g} to {drive[1]:.6g}"
            )
        return [DeadZones(drive, breaks)]
    return [DeadZones(drive, even_breaks(drive, count)) for count in ([breaks] if breaks is not None else BREAK_COUNTS)]


def _shaped(
    courses: Sequence[Course], front: Front, thresholds: Array, before: Array | None, tick: Tick
) -> joint.LocalFit:
    """The best result of several starts; `before`: the shape of the front tried before this one."""
    starts = [front.straight]
    if isinstance(front, Tanh) and front.branches == 2 and before is not None:
        starts = [front.doubled(before)]
    if isinstance(front, DeadZones):
        convex = convex_start(courses, front)
        if convex is not None:
            starts.append(convex)
    found = [joint.refine(courses, front, shape, thresholds, tick) for shape in starts]
    return min(found, key=lambda shaped: shaped.rms)


def validation(shaped: joint.LocalFit, front: Front) -> float:
    """rms error on blocks of the records that took no part in fitting the weights and the last step of the shape."""
    squares = 0.0
    for fold, left_out in enumerate(shaped.system.folds):
        training = reduction.others(shaped.system, fold)
        change, p = joint.solve_linear(training, shaped.weights, shaped.shape, front, 0.0)
        unknowns = np.concatenate([p, change])
        squares += pi.residual(left_out, np.arange(len(unknowns)), unknowns)
    return pi.root_mean_square(squares, shaped.system.samples)


def convex_start(courses: Sequence[Course], front: DeadZones) -> Array | None:
    """Shape of a dead-zone sum from a problem that is linear in both the sum and the inverse play sum.

    `PI^-1[y] = G[v]`: plays of the measured output, with weights q_0 > 0 and q_i <= 0, on one side, pieces of the drive
    with positive slopes on the other (Kuhnen, European Journal of Control 9, 2003, 407-418, where the memoryless part
    lies behind the plays). The problem is convex, but it minimises an error in the drive, and noise in the output
    enters the plays, so its solution is only a starting point for the fit of the output. None if no sample remains.
    """
    low, high = front.drive
    places = np.array([low, *front.breaks, high])
    length = np.diff(places)
    m = len(length)
    swing = max(item.output_range for item in courses)
    z = np.linspace(0.0, 0.4 * swing, INVERSE_PLAYS + 1)
    turned = []
    for item in courses:
        # the memory of the inverse is unknown even if that of the plays is known
        measured = faults.bridged(item.y, ~np.isfinite(item.y))
        first = max(item.first, reduction.settled(measured[: item.last], math.inf))
        pieces = np.clip(item.v[None, :], places[:-1, None], places[1:, None]) - places[:-1, None]
        target = pieces[-1] * ((high - low) / length[-1])
        turned.append((replace(item, v=measured, y=target, history=None, start=None, first=first), pieces))
    if not sum(item.used for item, _ in turned):
        return None
    of_course = {id(item): pieces for item, pieces in turned}

    def source(item: Course, thresholds: Array) -> Source:
        pieces = of_course[id(item)]
        states = reduction.start_states(item.v, None, thresholds)

        def rows(start: int, stop: int, compared: bool) -> Array:
            nonlocal states
            moved = operators.plays(item.v[start:stop], thresholds, states)
            states = np.ascontiguousarray(moved[:, -1])
            # the mean slope is 1: the last piece follows from the others
            part = pieces[:, start:stop]
            others = part[:-1] - part[-1] * (length[:-1] / length[-1])[:, None]
            found = np.vstack([np.ones(stop - start), moved, -others, item.y[start:stop]]).T
            return found if compared else found[:0]

        return rows

    system = reduction.reduce([item for item, _ in turned], z, None, source, m - 1).whole
    k = len(z)
    q_least = LEAST_SLOPE * (high - low) / swing
    least = LEAST_SLOPE
    bounds = [np.eye(k + m - 1)[0], np.concatenate([np.ones(k), np.zeros(m - 1)])]
    limits = [q_least, q_least]
    for i in range(1, k):
        bounds.append(-np.eye(k + m - 1)[i])
        limits.append(0.0)
    for j in range(m - 1):
        bounds.append(np.eye(k + m - 1)[k + j])
        limits.append(least)
    bounds.append(np.concatenate([np.zeros(k), -length[:-1] / length[-1]]))
    limits.append(least - (high - low) / length[-1])
    try:
        solution = pi.least_squares(system[:, :-1], system[:, -1], np.array(bounds), np.array(limits), k)
    except pi.InfeasibleError:
        return None
    slopes = np.append(solution[k:], ((high - low) - float(length[:-1] @ solution[k:])) / length[-1])
    return front.shape(slopes)
