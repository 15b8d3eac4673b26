"""Joint fit of a front's shape and the plays' weights: least squares on the free-run output error.

The weights enter linearly, the shape does not. The method is Gauss-Newton with a trust region; every step solves for
all weights and the change in shape at once, under the constraints that keep the model invertible. Derivatives with
respect to the shape are differences between free runs, so they include the effect of earlier samples through the plays.
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
from hystgen.effects.base import Candidate, Effect
from hystgen.front.dead_zone.model import DeadZone
from hystgen.front.stage import Stage
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.identification import elements, pi, reduction
from hystgen.identification.pi import InfeasibleError, root_mean_square, rounded
from hystgen.identification.reduction import Course, Reduced, Source
from hystgen.plays import operators

Array = NDArray[np.float64]


# Fronts whose shape a fit may change -------------------------------------------------------------------------
#
# A front and the play sum behind it share a scale: `a G` with thresholds `a r` and weights `p / a` is the same model.
# Every front here maps the fitted drive range onto a range of the same length, and 0 onto 0, so that thresholds mean
# the same as without a front.


STEEPEST = math.log(20.0)
"""Logarithm of the largest ratio of two slopes of a dead-zone sum."""

FLATTER = math.log(200.0)
"""Logarithm of the largest ratio of the slopes of a limiter."""

SMOOTH = 16
"""Number of pieces of a dead-zone sum that approximates a smooth curve: with a ratio of 20 over the whole range, the
slopes of neighbouring pieces differ by at most a fifth."""

FLATTEST = 3.0
"""Largest argument of a tanh within the drive range; there, its slope is a hundredth of its largest."""

CURVED = (0.02, 3.0)
"""Smallest and largest half drive range in units of the tanh's argument."""


class Front(Protocol):
    """A family of memoryless parts with parameters `shape` (m,)."""

    @property
    def name(self) -> str:
        """The front's name in the fit table."""

    @property
    def straight(self) -> Array:
        """The shape of a (nearly) straight line, at which a search starts."""

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Smallest and largest value of every shape parameter."""

    def slack(self, shape: Array) -> Array:
        """Values that must not be negative for the front to be invertible, in addition to the bounds; may be empty."""

    def stages(self, shape: Array, digits: int | None = None) -> tuple[Stage, ...]:
        """The stages of the model, with their parameters rounded to `digits` if given.

        A search uses them unrounded, because differences of two numbers rounded to ten digits would lose six digits.
        """

    def parallel(self, shape: Array, digits: int | None = None) -> Effect | None:
        """The effect that adds a term to the play sum, rounded likewise; None if the model has none."""


class _Alone:
    """Fronts of plays with nothing in parallel."""

    def parallel(self, shape: Array, digits: int | None = None) -> Effect | None:
        """None."""
        return None


class _Bounded(_Alone):
    """Fronts that increase everywhere within their bounds."""

    def slack(self, shape: Array) -> Array:
        """No further constraints."""
        return np.empty(0)


@dataclass(frozen=True)
class Kept(_Bounded):
    """A fixed memoryless part; by default it has no stages, and the model is a plain play sum."""

    given: tuple[Stage, ...] = ()
    name: str = "pi"

    @property
    def straight(self) -> Array:
        """No shape parameters."""
        return np.empty(0)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """No bounds."""
        return np.empty(0), np.empty(0)

    def stages(self, shape: Array, digits: int | None = None) -> tuple[Stage, ...]:
        """The given stages."""
        return self.given


@dataclass(frozen=True)
class DeadZones(_Bounded):
    """Dead-zone sums with given breaks (41); the shape is the logarithm of each piece's slope relative to the first.

    `drive`: the fitted range; `breaks`: points inside it where the slope may change, strictly increasing and none of
    them 0, since a threshold of 0 is the straight line in every dead-zone sum.
    """

    drive: tuple[float, float]
    breaks: tuple[float, ...]
    name: str = "gpi-deadzone"

    @property
    def straight(self) -> Array:
        """All slopes equal."""
        return np.zeros(len(self.breaks))

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Every piece rises, and none is far steeper than another."""
        most = np.full(len(self.breaks), STEEPEST)
        return -most, most

    def slopes(self, shape: Array) -> Array:
        """Slopes of the pieces, beginning at the lowest drive."""
        ratio = np.exp(np.concatenate([[0.0], shape]))
        low, high = self.drive
        length = np.diff([low, *self.breaks, high])
        return np.asarray(ratio * (high - low) / float(ratio @ length))

    def shape(self, slopes: Array) -> Array:
        """The shape of given slopes, brought within the bounds."""
        least = float(np.max(slopes)) * math.exp(-STEEPEST)
        logs = np.log(np.maximum(slopes, least))
        return np.asarray(np.clip(logs[1:] - logs[0], -STEEPEST, STEEPEST))

    def stages(self, shape: Array, digits: int | None = None) -> tuple[Stage, ...]:
        """The dead-zone sum; its weight at 0 is the slope of the piece that contains 0."""
        slopes = self.slopes(shape)
        middle = int(np.searchsorted(self.breaks, 0.0, side="right"))
        terms = {0.0: float(slopes[middle])}
        for j, place in enumerate(self.breaks):
            outer, inner = (slopes[j], slopes[j + 1]) if j < middle else (slopes[j + 1], slopes[j])
            terms[place] = float(outer - inner)
        places = sorted(terms)
        return (DeadZone(places, _numbers([terms[place] for place in places], digits)),)


@dataclass(frozen=True)
class Ends(_Bounded):
    """A limiter: a straight line that becomes flatter near the ends of the drive range, made of two dead zones (41).

    The shape is the length of each flatter end, as a fraction of the range, and log(outer slope/inner slope).
    """

    drive: tuple[float, float]
    name: str = "gpi-deadzone"

    @property
    def straight(self) -> Array:
        """Slightly flatter at the ends, so that the derivatives with respect to the lengths are not zero."""
        return np.array([0.1, 0.1, -0.1])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """A length may be so small that it has no effect; the two bends must not meet."""
        return np.array([1e-3, 1e-3, -FLATTER]), np.array([0.45, 0.45, 0.0])

    def widest(self, shape: Array) -> float:
        """The length of the longer flatter end, as a fraction of the range."""
        return float(np.max(shape[:2]))

    def stages(self, shape: Array, digits: int | None = None) -> tuple[Stage, ...]:
        """The dead-zone sum."""
        low, high = self.drive
        ends = low + shape[0] * (high - low), high - shape[1] * (high - low)
        breaks = aside([float(x) for x in ends], 1e-3 * (high - low))
        return DeadZones(self.drive, breaks).stages(np.array([-shape[2], 0.0]), digits)


@dataclass(frozen=True)
class BentFront(_Bounded):
    """A front whose slope changes smoothly over the drive range, as a dead-zone sum (41) of many equal pieces.

    The shape is the coefficients of u, u^2, .. up to `degree` in the logarithm of the slope; u runs from -1 to 1.
    """

    drive: tuple[float, float]
    degree: int
    name: str = "gpi-deadzone"

    @property
    def straight(self) -> Array:
        """The same slope everywhere."""
        return np.zeros(self.degree)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Bounds that keep ratios of slopes within the limit of a piecewise search."""
        most = np.full(self.degree, 0.5 * STEEPEST / self.degree)
        return -most, most

    @cached_property
    def _pieces(self) -> DeadZones:
        return DeadZones(self.drive, even_breaks(self.drive, SMOOTH - 1))

    def stages(self, shape: Array, digits: int | None = None) -> tuple[Stage, ...]:
        """The dead-zone sum."""
        u = np.linspace(-1.0, 1.0, 2 * SMOOTH + 1)[1::2]
        logs = u * np.polynomial.polynomial.polyval(u, shape)
        return self._pieces.stages(logs[1:] - logs[0], digits)


@dataclass(frozen=True)
class Tanh(_Alone):
    """Tanh envelopes with one branch or two (45).

    The shape of a branch is `a1` times half the drive range, and the position of its steepest point, measured from the
    middle of the range in units of half its length. The descending branch has two more parameters: the logarithm of its
    height relative to the ascending branch, and its lift above that branch at mid-range, as a fraction of the range.
    """

    drive: tuple[float, float]
    branches: int = 1

    @property
    def name(self) -> str:
        """The name with the number of branches, which distinguishes rows of the table."""
        return "gpi-tanh" if self.branches == 1 else "gpi-tanh, two branches"

    @property
    def straight(self) -> Array:
        """Gently bent, so that the derivative with respect to the position is not zero; two branches have no gap."""
        return np.array([0.3, 0.0] if self.branches == 1 else [0.3, 0.0, 0.3, 0.0, 0.0, 0.0])

    def doubled(self, single: Array) -> Array:
        """The shape of two branches that both equal a single branch of shape `single`."""
        return np.concatenate([single, single, [0.0, 0.0]])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Curvature and position of each branch, then height and lift."""
        low = [CURVED[0], -20.0] * self.branches + [-0.5, 0.0] * (self.branches - 1)
        high = [CURVED[1], 20.0] * self.branches + [0.5, 0.3] * (self.branches - 1)
        return np.array(low), np.array(high)

    def slack(self, shape: Array) -> Array:
        """Distances of the ends from a branch's flat part, and of the descending branch from the ascending one."""
        held = [FLATTEST - shape[2 * b] * (1.0 + abs(shape[2 * b + 1])) for b in range(self.branches)]
        if self.branches == 2 and min(held) < -FLATTEST:  # a branch may be flat to the last digit, with zero height
            held += [-1.0] * len(self._places)
        elif self.branches == 2:
            stage = self._stage(shape, None)
            places = self._places
            gap = stage.forward(places, False) - stage.forward(places, True)
            held += list(gap / (self.drive[1] - self.drive[0]))
        return np.array(held)

    @cached_property
    def _places(self) -> Array:
        return np.linspace(*self.drive, 61)

    def stages(self, shape: Array, digits: int | None = None) -> tuple[Stage, ...]:
        """The envelope; the descending branch is lifted if rounding would put it too low."""
        return (self._stage(shape, digits),)

    def _stage(self, shape: Array, digits: int | None) -> TanhEnvelope:
        low, high = self.drive
        half = 0.5 * (high - low)
        middle = 0.5 * (low + high)

        def branch(curvature: float, place: float, length: float) -> tuple[float, float, float]:
            a1 = curvature / half
            a2 = -a1 * (middle + place * half)
            a0 = 2.0 * half * length / (math.tanh(a1 * high + a2) - math.tanh(a1 * low + a2))
            return a0, a1, a2

        def value(numbers: tuple[float, float, float], v: float) -> float:
            return numbers[0] * math.tanh(numbers[1] * v + numbers[2])

        up = branch(shape[0], shape[1], 1.0)
        up_all = (*up, -value(up, 0.0))
        if self.branches == 1:
            return TanhEnvelope(_branch(up_all, digits))
        down = branch(shape[2], shape[3], math.exp(shape[4]))
        lift = value(up, middle) + up_all[3] - value(down, middle) + shape[5] * 2.0 * half
        stage = TanhEnvelope(_branch(up_all, digits), _branch((*down, lift), digits))
        if digits is not None:
            places = np.linspace(low, high, 20001)
            short = float(np.max(stage.forward(places, True) - stage.forward(places, False)))
            if short > 0.0:
                stage = TanhEnvelope(stage.ascending, _branch((*down, lift + 1.01 * short + 1e-9 * half), digits))
        return stage


@dataclass(frozen=True)
class InParallel(_Bounded):
    """Elements in parallel with the plays, and no stage; the shape is the candidate's parameters."""

    candidate: Candidate

    @property
    def name(self) -> str:
        """The effect's name; a second row of the table never has the same one, as only one shape is chosen."""
        return self.candidate.build(self.candidate.start).name

    @property
    def straight(self) -> Array:
        """The first start, at which the elements do nothing."""
        return self.candidate.start

    @property
    def bounds(self) -> tuple[Array, Array]:
        """The candidate's."""
        return self.candidate.low, self.candidate.high

    def stages(self, shape: Array, digits: int | None = None) -> tuple[Stage, ...]:
        """No stages."""
        return ()

    def parallel(self, shape: Array, digits: int | None = None) -> Effect:
        """The elements."""
        effect = self.candidate.build(shape)
        numbers = {key: value for key, value in effect.model_dump().items() if isinstance(value, tuple | float)}
        made = {
            key: _numbers([value], digits)[0] if isinstance(value, float) else tuple(_numbers(value, digits))
            for key, value in numbers.items()
        }
        return effect.model_copy(update=made)


def _branch(values: tuple[float, ...], digits: int | None) -> tuple[float, float, float, float]:
    a0, a1, a2, a3 = _numbers(values, digits)
    return a0, a1, a2, a3


def _numbers(values: Sequence[float], digits: int | None) -> list[float]:
    return [float(x) if digits is None else rounded(float(x), digits) for x in values]


def even_breaks(drive: tuple[float, float], count: int) -> tuple[float, ...]:
    """`count` breaks evenly spaced inside the drive range; a break that would fall on 0 is moved slightly."""
    low, high = drive
    step = (high - low) / (count + 1)
    return aside([rounded(low + step * (j + 1), 6) for j in range(count)], 0.05 * step)


def aside(places: Sequence[float], least: float) -> tuple[float, ...]:
    """The positions, with any within `least` of 0 moved to `least`, since a dead zone with threshold 0 is the line
    itself."""
    return tuple(rounded(least, 6) if abs(x) < least else x for x in places)


# The search for a shape --------------------------------------------------------------------------------------


DIFFERENCE = 2.0**-16
"""Change in a shape parameter to find a derivative; shape parameters are of order one. A search needs only a few digits
of a derivative: here curvature affects the sixth digit, and the output keeps eleven digits above rounding."""

MOST_STEPS = 25
"""Maximum number of steps of a search. For `examples/stage_recording.csv`, fronts take 2 to 10."""

DAMPING = 1e-3
"""Damping of the first step, relative to the diagonal of its normal equations."""

ENOUGH = 0.005
"""[mean square error] The search ends when a step lowers the sum of squared errors by less than this.

Moving an estimate by one standard deviation changes the sum by one mean square error.
"""

LEAST_CHANGE = 1e-8
"""The search also ends when no shape parameter changes by more than this."""

GRAIN = 1.0 / 32.0
"""[rms error] Every unknown of a step is rounded to a multiple of a unit that moves the output by at most this much.

The rounding errors of m unknowns are independent, so together they raise the sum of squared errors by m GRAIN^2 / 12
times the mean square error: half of `ENOUGH` for 32 unknowns.
"""

COARSEST = 2.0**-10
"""Largest rounding unit of a shape parameter: rounding must not move parameters that hardly affect the output yet."""

COMPARED = 200_000
"""Number of samples compared in the search for the shape: an even selection from longer records, although all samples
run through the plays."""

Tick = Callable[[int], None] | None


@dataclass(frozen=True)
class LocalFit:
    """A shape, weights for a list of thresholds, and the system linearised about both.

    `rms`: error of `best`, the best weights for the shape; `weights` are close to them. `derived` computes the system,
    which a rejected step does not need.
    """

    shape: Array
    weights: Array
    rms: float
    best: Array
    samples: int
    derived: Callable[[], Reduced]

    @cached_property
    def system(self) -> Reduced:
        """The linearised system; its derivatives take most of the time of a search."""
        return self.derived()


def through_front(item: Course, stages: Sequence[Stage], parallel: Effect | None = None) -> Course:
    """The course as the plays see it: their input replaces the drive and the history, and their part of the output,
    without a term in parallel, the output."""
    inner = _through(item, stages)
    if parallel is None:
        return inner
    forgotten = elements.forgotten(inner, parallel)
    y = inner.y - elements.term(inner, parallel)
    return replace(inner, y=y, forgotten=forgotten, first=max(forgotten, inner.first))


def _through(item: Course, stages: Sequence[Stage]) -> Course:
    if not stages:
        return item
    rising, visited = _session(item, stages)
    v = through_stages(stages, item.v, rising)
    if item.history is None and item.start is not None and visited is not None:
        return replace(item, v=v, start=replace(item.start, turns=visited))
    return replace(item, v=v, history=visited)


def _session(item: Course, stages: Sequence[Stage]) -> tuple[NDArray[np.bool_] | None, tuple[float, ...] | None]:
    """Directions of the drive along the course, and its history behind the front."""
    branched = any(stage.branches_differ for stage in stages)
    if item.visited is None:
        return (directions(item.v, True) if branched else None), None
    before = np.array([0.0, *item.visited])
    whole = directions(np.concatenate([before, item.v]), True) if branched else None
    visited = through_stages(stages, before[1:], None if whole is None else whole[1 : len(before)])
    return (None if whole is None else whole[len(before) :]), tuple(visited.tolist())


def refine(
    courses: Sequence[Course], front: Front, shape: Array, thresholds: Array, tick: Tick = None, most: int = MOST_STEPS
) -> LocalFit:
    """The best shape near `shape` in at most `most` steps, with non-negative weights for the plays at `thresholds`."""
    stages, parallel = front.stages(shape), front.parallel(shape)
    plain = reduction.reduce([through_front(item, stages, parallel) for item in courses], thresholds, tick)
    p = pi.non_negative(plain.whole, np.arange(len(thresholds)))

    def linear(s: Array, q: Array) -> LocalFit:
        return _linear(courses, front, s, q, thresholds, tick)

    return search(linear, front, linear(shape, p), most)[0]


class Limits(Protocol):
    """Constraints on a shape."""

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Smallest and largest value of every shape parameter."""

    def slack(self, shape: Array) -> Array:
        """Values that must not be negative, in addition to the bounds."""


def search(
    linear: Callable[[Array, Array], LocalFit], limits: Limits, now: LocalFit, most: int = MOST_STEPS,
    little: float = 0.0, damping: float = DAMPING,
) -> tuple[LocalFit, float]:
    """The best shape near that of `now`, and the damping with which the search would continue.

    `linear` linearises the system about a shape and weights. `little`: the search also ends after a step that lowers
    the error by less than this fraction. Failed steps count towards `most`, and increase the damping of the next step.
    The search ends before a step for which the linear system predicts an improvement below `ENOUGH`.
    """
    shape = now.shape
    low, high = limits.bounds
    for _ in range(most if len(shape) else 0):
        if damping > 1e6 or now.rms == 0.0 or not math.isfinite(now.rms):
            break
        system = now.system.whole
        if not np.isfinite(system).all():  # the derivatives overflow
            break
        try:
            change, p = solve_linear(system, now.weights, now.shape, limits, damping)
        except InfeasibleError:
            break
        sizes = np.linalg.norm(system, axis=0)
        p = _grained(p, sizes[: len(p)], now.rms)
        moved = np.clip(_grained(now.shape + change, sizes[len(p) : -1], now.rms, COARSEST), low, high)
        if np.max(np.abs(moved - now.shape)) < LEAST_CHANGE:
            break
        least = 0.5 * ENOUGH / now.samples
        residual = system[:, -1] - system[:, :-1] @ np.concatenate([p, moved - now.shape])
        promised = root_mean_square(float(residual @ residual), now.samples)
        if now.rms - promised < least * now.rms:  # most such steps fail, at full cost
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


def _grained(found: Array, sizes: Array, rms: float, most: float = math.inf) -> Array:
    """A linear system's solution, rounded to the digits that the records determine; `sizes`: lengths of the system's
    columns.

    The rounding units are powers of two, at most `most`. The last bits from linear algebra libraries differ between
    processors; carried from step to step, they could lead a search to another minimum. With rounding, its steps are the
    same everywhere.
    """
    rounded = found.copy()
    known = (sizes > 0.0) & (rms > 0.0)
    unit = np.minimum(np.exp2(np.floor(np.log2(GRAIN * rms / sizes[known]))), most)
    rounded[known] = np.round(found[known] / unit) * unit
    return rounded


def _allowed(limits: Limits, shape: Array) -> bool:
    slack = limits.slack(shape)
    return not len(slack) or float(np.min(slack)) > -1e-6


def _linear(courses: Sequence[Course], front: Front, shape: Array, p: Array, thresholds: Array, tick: Tick) -> LocalFit:
    """The best weights for a shape, and the system linearised about the shape and weights `p` close to them."""
    every = max(1, sum(item.used for item in courses) // COMPARED)
    source = linear_source(front, shape, p, every)
    system = reduction.reduce(courses, thresholds, tick, source, len(shape))
    columns = np.arange(len(thresholds))
    best = pi.non_negative(system.whole, columns)
    rms = root_mean_square(pi.residual(system.whole, columns, best), system.samples)
    # not `best` but `p`, with which the derivatives were taken, since the next step starts from it
    return LocalFit(shape, p, rms, best, system.samples, lambda: system)


def linear_source(front: Front, shape: Array, p: Array, every: int) -> Callable[[Course, Array], Source]:
    """Rows of the system linearised about a shape and weights, for one in `every` samples."""
    versions = [(front.stages(shape), front.parallel(shape))]
    for j in range(len(shape)):
        one = shape.copy()
        one[j] += DIFFERENCE
        versions.append((front.stages(one), front.parallel(one)))

    def source(course: Course, thresholds: Array) -> Source:
        return _rows_with_derivatives(course, thresholds, versions, p, every)

    return source


def _rows_with_derivatives(
    course: Course, thresholds: Array, versions: Sequence[tuple[Sequence[Stage], Effect | None]], p: Array, every: int
) -> Source:
    """The plays behind the first version of a front, and how each other version changes their weighted sum.

    A term in parallel with the plays is subtracted from y, and its changes are part of those of the sum.
    """
    carried = []
    terms = [None if one is None else elements.term(_through(course, stages), one) for stages, one in versions]
    for stages, _ in versions:
        rising, visited = _session(course, stages)
        first = through_stages(stages, course.v[:1], None if rising is None else rising[:1])
        carried.append((stages, rising, reduction.start_states(first, visited, thresholds)))
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
            sums.append(operators.weighted_sum(p, moved))
        for k, one in enumerate(terms):
            if one is not None:
                sums[k] = sums[k] + one[start:stop]
        for k, total in enumerate(sums[1:]):
            found[:, n1 + 1 + k] = (total - sums[0]) / DIFFERENCE
        found[:, 0] = 1.0
        found[:, -1] = course.y[start:stop] if terms[0] is None else course.y[start:stop] - terms[0][start:stop]
        # one sample in `every` stands for all `every`
        found = found[-start % every :: every]
        return found[np.isfinite(found[:, -1])] * math.sqrt(every) if compared else found[:0]

    return rows


def solve_linear(system: Array, p: Array, shape: Array, limits: Limits, damping: float) -> tuple[Array, Array]:
    """Change in the shape, and new weights, that fit a linear system best under the constraints."""
    k, m = len(p), len(shape)
    matrix, target = system[:, :-1], system[:, -1]
    tied = np.zeros((m, k + m))
    size = np.linalg.norm(matrix[:, k:], axis=0)
    tied[:, k:] = np.diag(np.sqrt(damping) * np.maximum(size, 1e-12 * float(np.linalg.norm(target))))
    low, high = limits.bounds
    bounds, least = pi.at_least(
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
    solution = pi.least_squares(np.concatenate([matrix, tied]), np.concatenate([target, np.zeros(m)]), bounds, least, k)
    return solution[k:], solution[:k]
