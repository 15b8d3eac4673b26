"""The shape of the front and the weights of the plays fitted together: least squares on the free-run output error.

The weights enter linearly, the shape does not: a Gauss-Newton method with a trust region, whose every step solves for
all weights and the change of the shape at once, under the constraints that keep the model invertible. Derivatives by
the shape are differences of free runs, so that they count what the plays remember of earlier samples.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hystgen.chain.static import directions, through_stages
from hystgen.front.stage import Stage
from hystgen.identification import pi, reduction
from hystgen.identification.fronts import Front
from hystgen.identification.reduction import Course, Reduced, Source
from hystgen.plays import operators

Array = NDArray[np.float64]

DIFFERENCE = 1e-6
"""Change of a shape number for a derivative; shapes are of the order of one."""

MOST_STEPS = 25

DAMPING = 1e-3
"""Of the first step, against the diagonal of its equations."""

ENOUGH = 0.005
"""The search ends when the sum of squares falls by less than this many times its share of one sample.

A step of one standard deviation of an estimate changes it by one such share.
"""

LEAST_CHANGE = 1e-8
"""It ends too when no shape number changes by more than this."""

COMPARED = 200_000
"""Samples that are compared while the shape is sought; of longer records each so many-th, all run through the plays."""

Tick = Callable[[int], None] | None


@dataclass(frozen=True)
class Shaped:
    """A shape, weights over a list of thresholds, and the system that is linear about both.

    `rms`: error of the `best` weights for the shape, to which `weights` are near. `derived` gives the system: a step
    that is not taken does not need it.
    """

    shape: Array
    weights: Array
    rms: float
    best: Array
    samples: int
    derived: Callable[[], Reduced]

    @cached_property
    def system(self) -> Reduced:
        """The system; its derivatives cost most of a search."""
        return self.derived()


def through_front(item: Course, stages: Sequence[Stage]) -> Course:
    """The course as the plays see it: their input in place of the drive, in the history too."""
    if not stages:
        return item
    rising, history = _session(item, stages)
    return replace(item, v=through_stages(stages, item.v, rising), history=history)


def _session(item: Course, stages: Sequence[Stage]) -> tuple[NDArray[np.bool_] | None, tuple[float, ...] | None]:
    """Directions of the drive along the course, and the history behind the front."""
    branched = any(stage.branches_differ for stage in stages)
    if item.history is None:
        return (directions(item.v, True) if branched else None), None
    before = np.array([0.0, *item.history])
    whole = directions(np.concatenate([before, item.v]), True) if branched else None
    visited = through_stages(stages, before[1:], None if whole is None else whole[1 : len(before)])
    return (None if whole is None else whole[len(before) :]), tuple(visited.tolist())


def refine(
    courses: Sequence[Course], front: Front, shape: Array, thresholds: Array, tick: Tick = None
) -> Shaped:
    """The best shape near `shape`, with non-negative weights for the plays of `thresholds`."""
    stages = front.stages(shape)
    plain = reduction.reduce([through_front(item, stages) for item in courses], thresholds, tick)
    p = pi.non_negative(plain.whole, np.arange(len(thresholds)))

    def linear(s: Array, q: Array) -> Shaped:
        return _linear(courses, front, s, q, thresholds, tick)

    return search(linear, front, linear(shape, p))[0]


class Limits(Protocol):
    """What a shape must keep to."""

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Least and largest value of every shape number."""

    def slack(self, shape: Array) -> Array:
        """What must not be negative beyond the bounds."""


def search(
    linear: Callable[[Array, Array], Shaped],
    limits: Limits,
    now: Shaped,
    most: int = MOST_STEPS,
    little: float = 0.0,
    damping: float = DAMPING,
) -> tuple[Shaped, float]:
    """The best shape near that of `now`, and the damping with which the search goes on from there.

    `linear` gives the system that is linear about a shape and weights. `little`: the search ends with a step that
    lowers the error by less than this share, too. Steps that fail are damped more, and counted. It ends before a step
    of which the linear system promises less than `ENOUGH`.
    """
    shape = now.shape
    low, high = limits.bounds
    for _ in range(most if len(shape) else 0):
        if damping > 1e6 or now.rms == 0.0 or not math.isfinite(now.rms):
            break
        system = now.system.whole
        if not np.isfinite(system).all():  # numbers next to these make none
            break
        try:
            change, p = solve_linear(system, now.weights, now.shape, limits, damping)
        except InfeasibleError:
            break
        moved = np.clip(now.shape + change, low, high)
        if np.max(np.abs(moved - now.shape)) < LEAST_CHANGE:
            break
        least = 0.5 * ENOUGH / now.samples
        left = system[:, -1] - system[:, :-1] @ np.concatenate([p, change])
        promised = root_mean_square(float(left @ left), now.samples)
        if now.rms - promised < least * now.rms:  # most of these steps fail, and each costs as much as any other
            break
        trial = linear(moved, p) if _allowed(limits, moved) else None
        if trial is not None and trial.rms < now.rms:
            done = now.rms - trial.rms < max(least, little) * now.rms
            now, damping = trial, damping * 0.2
            if done:
                break
        else:
            damping = max(damping, 1e-4) * 5.0
    return now, damping


def _allowed(limits: Limits, shape: Array) -> bool:
    slack = limits.slack(shape)
    return not len(slack) or float(np.min(slack)) > -1e-6


def _linear(
    courses: Sequence[Course], front: Front, shape: Array, p: Array, thresholds: Array, tick: Tick
) -> Shaped:
    """The best weights for a shape, and the system that is linear about the shape and weights `p` near to them."""
    every = max(1, sum(item.used for item in courses) // COMPARED)
    source = linear_source(front, shape, p, every)
    system = reduction.reduce(courses, thresholds, tick, source, len(shape))
    columns = np.arange(len(thresholds))
    best = pi.non_negative(system.whole, columns)
    rms = root_mean_square(pi.residual(system.whole, columns, best), system.samples)
    # About the weights that the derivatives were taken with: they are what the next step of the shape refers to
    return Shaped(shape, p, rms, best, system.samples, lambda: system)


def linear_source(front: Front, shape: Array, p: Array, every: int) -> Callable[[Course, Array], Source]:
    """Rows of the system that is linear about a shape and weights, for one in `every` samples."""
    versions = [front.stages(shape)]
    for j in range(len(shape)):
        one = shape.copy()
        one[j] += DIFFERENCE
        versions.append(front.stages(one))

    def source(course: Course, thresholds: Array) -> Source:
        return _rows_with_derivatives(course, thresholds, versions, p, every)

    return source


def _rows_with_derivatives(
    course: Course, thresholds: Array, versions: Sequence[Sequence[Stage]], p: Array, every: int
) -> Source:
    """The plays behind the first version of a front, and by how much each other version changes their weighted sum."""
    carried = []
    for stages in versions:
        rising, history = _session(course, stages)
        first = through_stages(stages, course.v[:1], None if rising is None else rising[:1])
        carried.append((stages, rising, reduction.start_states(first, history, thresholds)))
    n1 = len(thresholds)

    def rows(start: int, stop: int, compared: bool) -> Array:
        found = np.empty((stop - start, n1 + len(versions) + 1))
        sums = []
        for k, (stages, rising, states) in enumerate(carried):
            part = None if rising is None else rising[start:stop]
            moved = operators.plays(through_stages(stages, course.v[start:stop], part), thresholds, states)
            carried[k] = (stages, rising, np.ascontiguousarray(moved[:, -1]))
            if k == 0:
                found[:, 1 : n1 + 1] = moved.T
            sums.append(p @ moved)
        for k, total in enumerate(sums[1:]):
            found[:, n1 + 1 + k] = (total - sums[0]) / DIFFERENCE
        found[:, 0] = 1.0
        found[:, -1] = course.y[start:stop]
        # every so many-th sample stands for all of them
        found = found[-start % every :: every]
        return found[np.isfinite(found[:, -1])] * math.sqrt(every) if compared else found[:0]

    return rows


def solve_linear(
    system: Array, p: Array, shape: Array, limits: Limits, damping: float
) -> tuple[Array, Array]:
    """Change of the shape and new weights that fit a linear system best, under the constraints."""
    k, m = len(p), len(shape)
    matrix, target = system[:, :-1], system[:, -1]
    tied = np.zeros((m, k + m))
    size = np.linalg.norm(matrix[:, k:], axis=0)
    tied[:, k:] = np.diag(np.sqrt(damping) * np.maximum(size, 1e-12 * float(np.linalg.norm(target))))
    low, high = limits.bounds
    bounds, least = at_least(
        np.concatenate([np.zeros(k), low - shape]), np.concatenate([np.full(k, np.inf), high - shape])
    )
    slack = limits.slack(shape)
    if len(slack):
        slope = np.empty((len(slack), m))
        for j in range(m):
            one = shape.copy()
            one[j] += DIFFERENCE
            slope[:, j] = (limits.slack(one) - slack) / DIFFERENCE
        bounds = np.concatenate([bounds, np.concatenate([np.zeros((len(slack), k)), slope], axis=1)])
        least = np.concatenate([least, np.minimum(-slack, 0.0)])
    solution = least_squares(
        np.concatenate([matrix, tied]), np.concatenate([target, np.zeros(m)]), bounds, least, k
    )
    return solution[k:], solution[:k]


# Linear least squares under linear inequalities --------------------------------------------------------------


RIDGE = 1e-7
"""Weight of the tie break between solutions that fit equally well, with columns scaled to length one."""

STILL = 1e-9
"""A column of less than this share of the longest one, in the same unit, is rounding and nothing else."""

INFEASIBLE = 1e-10


class InfeasibleError(ValueError):
    """The inequalities contradict each other."""


def least_squares(matrix: Array, target: Array, bounds: Array, limits: Array, plays: int = 0) -> Array:
    """The x that minimises `|matrix x - target|` under `bounds x >= limits`.

    `matrix`: (rows, k); `bounds`: (inequalities, k); `plays`: number of leading columns with a unit of their own, the
    others have that of the target. Where the matrix does not determine x the shortest one, in the measure of its
    columns, is taken. Raises InfeasibleError.

    Lawson and Hanson, Solving Least Squares Problems (1974), chapter 23: the triangular factor makes of the problem
    the one of the shortest vector under inequalities (LDP), whose dual is a non-negative least-squares problem.
    """
    from scipy.linalg import solve_triangular
    from scipy.optimize import nnls

    k = matrix.shape[1]
    size = np.linalg.norm(matrix, axis=0)
    alike, reach = size.copy(), float(np.linalg.norm(target))
    if reach > 0.0 and np.any(size[:plays]):
        alike[:plays] *= reach / np.max(size[:plays])
    idle = alike <= STILL * np.max(alike)
    size[idle] = 1.0
    stacked = np.concatenate([np.where(idle, 0.0, matrix / size), RIDGE * np.eye(k)])
    q, triangle = np.linalg.qr(stacked)
    free = q.T @ np.concatenate([target, np.zeros(k)])
    # In the coordinates e = triangle (x size) - free the objective is |e|
    rows = np.asarray(solve_triangular(triangle, (bounds / size).T, trans="T")).T
    least = limits - rows @ free
    if np.all(least <= 0.0):
        shortest = np.zeros(k)
    else:
        length = np.linalg.norm(rows, axis=1)
        length[length == 0.0] = 1.0
        scale = float(np.max(np.abs(least / length)))
        dual_matrix = np.vstack([(rows / length[:, None]).T, least / length / scale])
        dual_target = np.zeros(k + 1)
        dual_target[-1] = 1.0
        multipliers, rest = nnls(dual_matrix, dual_target, maxiter=100 * (k + len(bounds)))
        if rest < INFEASIBLE:
            raise InfeasibleError("the inequalities contradict each other")
        # over the last component of the residual, which is the square of its length, and as that does not cancel to 0
        shortest = dual_matrix[:k] @ multipliers / rest**2 * scale
    return np.asarray(solve_triangular(triangle, shortest + free) / size)


def at_least(lower: Array, upper: Array) -> tuple[Array, Array]:
    """Bounds on single unknowns, infinite ones left out, as the inequalities of `least_squares`."""
    k = len(lower)
    eye = np.eye(k)
    below, above = np.isfinite(lower), np.isfinite(upper)
    return np.concatenate([eye[below], -eye[above]]), np.concatenate([lower[below], -upper[above]])


def root_mean_square(squares: float, samples: int) -> float:
    """rms of so many samples from the sum of their squares."""
    return math.sqrt(squares / max(samples, 1))
