"""Fitting a play sum with a memoryless part in front of it, or with elements in parallel.

The shape of the front or of the elements and the weights are found together (`joint`). Thresholds and weights are then
chosen as for a plain play sum, with the front's output as the drive and without the elements' part of the output
(`pi`), and shape and weights are refined once more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen import effects
from hystgen.effects.base import About, Effect
from hystgen.front.stage import Stage
from hystgen.identification import elements, faults, joint, pi, reduction, start
from hystgen.identification.joint import DeadZones, Front, InParallel, Kept, Tanh, even_breaks
from hystgen.identification.pi import DIGITS, IdentificationError, Solution
from hystgen.identification.reduction import Course, Source
from hystgen.plays import operators

Array = NDArray[np.float64]
Tick = Callable[[int], None] | None

KINDS = ("pi", "gpi-deadzone", "gpi-tanh")
"""Kinds of model that can be requested."""

PROMISING = 0.95
"""[fraction of the error with plays alone] Further elements are tried only if the simplest leave at most this in the
fit, far more than `auto` accepts. Blocks left out of the fit choose among them. Set by: the run time of `auto`."""

ROUNDS = 2
"""[searches] Number for the elements and the unknown starts of the records in turn. Set by: the Dahl and Bouc-Wen
plants of `examples/compensate_plants.py`, without and with noise of 0.1 %: 1, 2 and 3 find the same to 1e-6 %."""

FIRST_STEPS = 2
"""[steps] Number taken from each start of the elements: the first finds their weights, which begin at 0. The best start
is then searched to the end. Set by: the same plants, which are found with 1, 2, 3 and 5."""

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
        return joint.through_front(item, self.stages, self.parallel)

    @property
    def parallel(self) -> Effect | None:
        """The elements in parallel with the plays, if any."""
        return self.front.parallel(self.shape, DIGITS)

    def begun(self, courses: Sequence[Course]) -> list[Course]:
        """Held-out courses, with start memories if their history is unknown."""
        r, p = self.solution.thresholds, self.solution.weights
        if self.parallel is not None:
            courses = [elements.approached(item, self.parallel, r, p) for item in courses]
            if len(r) == 1:  # there are no plays whose start could be estimated
                return [replace(item, first=self.inner(item).resettled(0.0).first) for item in courses]
        return _without(self.parallel, self.stages, courses, lambda items: start.of_model(items, self.stages, r, p))


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
    """A front, its shape with a dense list of plays behind it, its error in the fit (`rms`) and on blocks left out of
    it, and the courses with their approaches."""

    front: Front
    shape: Array
    rms: float
    error: float
    courses: Sequence[Course]


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
    alone = math.inf
    if kind == effects.PARALLEL:
        alone = joint.refine(compared, Kept(), Kept().straight, fine, how.tick).rms
    found: list[_Found] = []
    for front in fronts_of(kind, compared, how.breaks):
        if found and found[0].rms > PROMISING * alone:  # the simplest elements do not help
            break
        begun, shaped = _shaped(compared, front, fine, found, how.tick)
        found.append(_Found(front, shaped.shape, shaped.rms, validation(shaped, front), begun))
    return [_finished(courses, each, plain, how) for each in choose(found)]


def _without(
    parallel: Effect | None, stages: Sequence[Stage], courses: Sequence[Course],
    found: Callable[[Sequence[Course]], list[Course]],
) -> list[Course]:
    """The courses with the start memories that are found without the output of elements in parallel with the plays."""
    if parallel is None:
        return found(courses)
    inner = [joint.through_front(item, stages, parallel) for item in courses]
    plays = [replace(item, y=each.y, forgotten=each.forgotten) for item, each in zip(courses, inner, strict=True)]
    return [replace(each, y=item.y) for each, item in zip(found(plays), courses, strict=True)]


def _finished(
    courses: Sequence[Course], found: _Found, plain: Solution, how: How
) -> tuple[FittedModel, list[Course]]:
    """The fit with a front: plays placed behind it, and its shape refitted for them."""
    front, shape = found.front, found.shape
    courses = [replace(item, approach=each.approach) for item, each in zip(courses, found.courses, strict=True)]
    stages, parallel = front.stages(shape, DIGITS), front.parallel(shape, DIGITS)
    courses = _without(parallel, stages, courses, lambda items: start.needed(items, stages, how.wanted))
    fitted = _solve_behind(courses, front, shape, how)
    # the thresholds may have changed: find the best shape for them again
    r = fitted.solution.thresholds
    shaped = joint.refine(found.courses, front, shape, r, how.tick)
    if isinstance(front, InParallel):
        begun, shaped = _with_approaches(found.courses, front, shaped, r, how.tick)
        courses = [replace(item, approach=each.approach) for item, each in zip(courses, begun, strict=True)]
    shape = shaped.shape
    fitted = _solve_behind(courses, front, shape, replace(how, wanted=tuple(float(x) for x in r)))
    if how.wanted is None:
        least = 0.0 if fitted.parallel is None else start.ROUNDING
        fitted = replace(fitted, solution=fitted.solution.without_idle_plays(least))
    # neither a front nor elements change the sense of the recorded loops
    fitted = replace(fitted, solution=replace(fitted.solution, sense=plain.sense))
    largest = float(fitted.solution.thresholds[-1])
    firsts = [fitted.inner(item).resettled(largest).first for item in courses]
    return fitted, [replace(item, first=first) for item, first in zip(courses, firsts, strict=True)]


def _with_approaches(
    courses: Sequence[Course], front: InParallel, shaped: joint.LocalFit, thresholds: Array, tick: Tick
) -> tuple[list[Course], joint.LocalFit]:
    """The courses with the approaches of their first samples, and the shape found with them.

    Both are found in turn, since a start that the elements have almost forgotten hardly changes the shape.
    """
    found = list(courses)
    for _ in range(ROUNDS):
        parallel = front.parallel(shaped.shape)
        found = [elements.approached(item, parallel, thresholds, shaped.best) for item in found]
        shaped = joint.refine(_settled(found, parallel), front, shaped.shape, thresholds, tick)
    return found, shaped


def _solve_behind(courses: Sequence[Course], front: Front, shape: Array, how: How) -> FittedModel:
    stages, parallel = front.stages(shape, DIGITS), front.parallel(shape, DIGITS)
    behind = [joint.through_front(item, stages, parallel) for item in courses]
    solution, _ = pi.solve(behind, how.wanted, how.floor, how.tick)
    return FittedModel(front, shape, solution)


def fronts_of(kind: str, courses: Sequence[Course], breaks: int | tuple[float, ...] | None) -> list[Front]:
    """The fronts of a kind, with increasing numbers of shape parameters."""
    drive = (min(item.drive_range[0] for item in courses), max(item.drive_range[1] for item in courses))
    if kind == "gpi-tanh":
        return [Tanh(drive), Tanh(drive, 2)]
    if kind == effects.PARALLEL:
        about = _about(courses, drive)
        shapes = [each for shape in effects.shapes(effects.PARALLEL) for each in shape.candidates(about)]
        return [InParallel(each) for each in sorted(shapes, key=lambda each: (each.beyond != "", len(each.start)))]
    if isinstance(breaks, tuple):
        if not all(drive[0] < place < drive[1] for place in breaks):
            raise IdentificationError(
                f"breaks have to lie inside the drive range of the records, {drive[0]:.6g} to {drive[1]:.6g}"
            )
        return [DeadZones(drive, breaks)]
    return [DeadZones(drive, even_breaks(drive, count)) for count in ([breaks] if breaks is not None else BREAK_COUNTS)]


def _about(courses: Sequence[Course], drive: tuple[float, float]) -> About:
    """Ranges of the courses for the candidates of an effect that does not depend on time, which a course does not know:
    times are in samples."""
    moves = [np.abs(np.diff(item.v)) for item in courses]
    longest = float(max(len(item.v) for item in courses))
    return About(
        drive, max(item.output_range for item in courses), 1.0, longest, longest,
        max(float(np.max(each)) for each in moves), sum(float(np.sum(each)) for each in moves), (), timed=False,
    )


def _shaped(
    courses: Sequence[Course], front: Front, thresholds: Array, before: Sequence[_Found], tick: Tick
) -> tuple[Sequence[Course], joint.LocalFit]:
    """The best result of several starts, and the courses with their approaches; `before`: the fronts tried before this
    one."""
    starts = [front.straight]
    if isinstance(front, InParallel):
        return _in_parallel(courses, front, thresholds, before, tick)
    if isinstance(front, Tanh) and front.branches == 2 and before:
        starts = [front.doubled(before[-1].shape)]
    if isinstance(front, DeadZones):
        convex = convex_start(courses, front)
        if convex is not None:
            starts.append(convex)
    found = [joint.refine(courses, front, shape, thresholds, tick) for shape in starts]
    return courses, min(found, key=lambda shaped: shaped.rms)


def _in_parallel(
    courses: Sequence[Course], front: InParallel, thresholds: Array, before: Sequence[_Found], tick: Tick
) -> tuple[list[Course], joint.LocalFit]:
    """The best elements, from those of the simpler candidate that they contain, or from the best of several starts."""
    candidate = front.candidate
    starts = (candidate.start, *candidate.others)
    simpler = {each.front.candidate.label: each.shape for each in before if isinstance(each.front, InParallel)}
    if candidate.grown is not None and candidate.beyond in simpler:
        starts = (candidate.grown(simpler[candidate.beyond]),)
    if len(starts) > 1:
        tried = [joint.refine(courses, front, shape, thresholds, tick, FIRST_STEPS) for shape in starts]
        starts = (min(tried, key=lambda shaped: shaped.rms).shape,)
    shape = starts[0]
    shaped = joint.refine(_settled(courses, front.parallel(shape)), front, shape, thresholds, tick)
    return _with_approaches(courses, front, shaped, thresholds, tick)


def _settled(courses: Sequence[Course], parallel: Effect) -> list[Course]:
    """The courses, compared only where the elements have forgotten an unknown start."""
    return [replace(item, first=joint.through_front(item, (), parallel).first) for item in courses]


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
