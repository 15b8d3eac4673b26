"""Fitting a PI model to records: thresholds, number and weights of the plays.

The weights solve a non-negative least-squares problem on the triangular system of `reduction`, from which the free
offsets have been projected out, by Lawson and Hanson's active set algorithm (Solving Least Squares Problems, 1974,
chapter 23) as implemented in scipy.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen.identification import reduction
from hystgen.identification.faults import white_noise
from hystgen.identification.reduction import Course, Reduced, others, travel
from hystgen.plays import operators

Array = NDArray[np.float64]

DIGITS = 10
"""Significant digits of offsets and of the parameters of a front: more than a record determines."""

WEIGHT_DIGITS = 8
"""Significant digits of weights. Where plays move in nearly the same way, the tie break below leaves a singular value
of a millionth, through which the linear algebra library's last bits reach the tenth digit; two more are dropped."""

DUST = 1e-9
"""A weight below this fraction of the sum of weights is rounding error, not a play."""

FALLS = (
    "no play has a positive weight: y does not rise with v; if the sensor counts the other way, change the sign of y "
    "(--columns y=-y), otherwise check which column is which"
)
"""The message if no play has a positive weight."""


class IdentificationError(ValueError):
    """Records to which no model can be fitted; `str()` says why and what to do."""


@dataclass(frozen=True)
class Sense:
    """How the output moves with the drive.

    `falls`: the output goes down when the drive goes up; `clockwise`: loops run in the opposite direction to a play's
    loops, and weights of either sign explain the records clearly better than positive weights.
    """

    falls: bool
    clockwise: bool

    def sentences(self, plays: int, elements: bool = False) -> list[str]:
        """Warnings for the user, one sentence each; `plays`: number of plays in the fitted model; `elements`: whether
        it has elements in parallel with them."""
        found = [FALLING] if self.falls else [LEADING if elements else CLOCKWISE] if self.clockwise else []
        return found if plays or elements else [*found, NO_PLAYS]


@dataclass(frozen=True)
class Solution:
    """A fitted play sum.

    `reach`: largest threshold that the records support; `fitted`: the weights as fitted; `sense`: how the recorded
    output moves with the drive.
    """

    thresholds: Array
    weights: Array
    reach: float
    fitted: Weights
    sense: Sense

    def without_idle_plays(self, least: float = 0.0) -> Solution:
        """The solution without plays whose weight is at most a fraction of the sum of weights, 0 by default."""
        kept = (self.weights > least * np.sum(self.weights)) | (self.thresholds == 0.0)
        return replace(self, thresholds=self.thresholds[kept], weights=self.weights[kept])


def solve(
    courses: Sequence[Course], wanted: int | tuple[float, ...] | None, floor: float,
    tick: Callable[[int], None] | None = None,
) -> tuple[Solution, list[Course]]:
    """Choose thresholds (unless given as a list) and fit the weights; also returns the courses as they were compared.

    Raises IdentificationError.
    """
    reach = largest([item for item in courses if item.used])
    if reach == 0.0:
        names = ", ".join(dict.fromkeys(item.name for item in courses))
        raise IdentificationError(
            f"{names}: the drive no longer moves once the start memory is known; record more cycles, or give "
            "--history"
        )
    if isinstance(wanted, tuple):
        lists = [ThresholdList(wanted)]
    else:
        wide = once(courses, reach)
        if wanted is not None and len(wide) > wanted // 2:  # too few of the requested plays would remain
            wide = ()
        count = None if wanted is None else wanted - len(wide)
        lists = candidates(reach, sum(item.used for item in courses), count)
        lists = [ThresholdList((*each.thresholds, *wide)) for each in lists]
    top = max(candidate.thresholds[-1] for candidate in lists)
    compared = [item.resettled(top) for item in courses]
    samples = sum(item.used for item in compared)
    fewest = min(candidate.n for candidate in lists) + 2
    if samples < fewest:
        raise IdentificationError(
            f"{samples} samples can be compared, but {fewest - 2} plays need at least {fewest}; record more cycles, "
            "give --history, or use fewer thresholds"
        )
    reduced = reduction.reduce(compared, union(lists), tick)
    chosen = choose(reduced, lists)
    fitted = fit_weights(reduced, columns(reduced, chosen), floor)
    p = written(fitted.p)
    r = np.array(chosen.thresholds)
    if not np.any(p > 0.0):
        raise IdentificationError(FALLS)
    way = sense_of(reduced, compared, residual(reduced.whole, columns(reduced, chosen), p))
    solution = Solution(r, p, reach, fitted, way)
    return (solution if wanted is not None else solution.without_idle_plays()), compared


@dataclass(frozen=True)
class FreeRunErrors:
    """Errors of one course from `first` to `last` without its free offset; NaN where samples are not compared."""

    course: Course
    offset: float
    error: Array


def compare(item: Course, r: Array, p: Array) -> FreeRunErrors:
    """Free run of the model along the drive, compared from `first` to `last`, with one free offset."""
    error = (item.y - reduction.prediction(item.v, item.visited, r, p))[item.first : item.last]
    offset = float(np.nanmean(error))
    return FreeRunErrors(item, offset, error - offset)


# Direction of the output and of its loops. A play sum with positive weights rises with its drive, and its loops run
# counterclockwise: the output is higher on the way down than on the way up. The direction of recorded loops is
# determined from the recording alone, because fitted weights do not show it: a saturating output needs negative weights
# even if its loops run counterclockwise.


CLEARLY = 0.9
"""[fraction of the rms error] Another explanation of a record is clearly better if its error is below this."""

SENSED_PLAYS = 8
"""Number of plays in the fit with weights of either sign: with many more, the weights of neighbouring plays cancel."""

SENSED_RANK = 1e-6
"""Fraction of the largest singular value below which the records do not determine a combination of plays."""

LEAST_TURN = 0.05
"""[fraction of the drive's range] A smaller reversal (noise, dither) belongs to the leg that it interrupts."""

LEVELS = 32
"""Points per leg, each the mean of a group of samples, and drive values at which two legs are compared."""

SIGMAS = 4.0
"""[standard deviations] Loops have a direction if their width differs from zero by more than this: none of 60 straight
lines and saturating curves with noise exceeds it. Set by: tests/test_start.py TestDirection."""

ONE_WAY = 0.5
"""[fraction of the area between the legs] Smallest net area of loops that have a direction: the wings of a butterfly
run in opposite directions and cancel. Set by: tests/test_start.py TestDirection."""

SLOWEST, SAME_SPEED = (0.125, 0.25, 0.5, 1.0), 1.05
"""[fraction of the time] The slowest turns that take up each fraction are tried in order; turns that are at most a
twentieth faster are included. Set by: tests/test_start.py TestDirection."""

FALLING = (
    "y falls when v rises; if the sensor counts the other way, change the sign of y (--columns y=-y), otherwise check "
    "which column is which"
)

EXCHANGE = (
    "If y is a force and v the displacement that goes with it, exchange the columns (--columns v=y,y=v): the model "
    "then gives the displacement"
)

CLOCKWISE = (
    "the loops run clockwise: y is ahead of v, while every play lags its drive, so no weights can follow them. "
    + EXCHANGE
)

LEADING = (
    "the loops run clockwise: y is ahead of v. The plays lag, and elements with positive weights follow the lead. "
    + EXCHANGE
)

NO_PLAYS = "no hysteresis was found: the model has no play besides r_0, and its output follows its input without a loop"


def sense_of(reduced: Reduced, courses: Sequence[Course], squares: float) -> Sense:
    """How the output of reduced records moves with the drive; `squares`: the sum of squared errors with positive
    weights."""
    together = sum(_covaried(item) for item in courses if item.used)
    some = np.unique(np.linspace(0, len(reduced.thresholds) - 1, SENSED_PLAYS + 1).astype(int))
    matrix, target = reduced.whole[:, some], reduced.whole[:, -1]
    weights, *_ = np.linalg.lstsq(matrix, target, rcond=SENSED_RANK)
    left = float(np.sum((matrix @ weights - target) ** 2))
    return Sense(together < 0.0, left < CLEARLY**2 * squares and runs_clockwise(courses))


def _covaried(item: Course) -> float:
    """Covariance of drive and output times the number of samples; negative if one falls while the other rises."""
    v, y = item.v[item.compared], item.y[item.compared]
    return float((v - np.mean(v)) @ (y - np.mean(y)))


def runs_clockwise(courses: Sequence[Course]) -> bool:
    """Whether the recorded loops enclose their area clockwise, beyond what noise, drift and lags can produce.

    A lag in either signal adds a width that vanishes at low speed, so the slowest turns with a clear direction count.
    """
    turns = sorted((turn for item in courses for turn in turns_of(item)), key=lambda turn: turn.speed)
    spent = np.cumsum([abs(turn.later) for turn in turns])
    for share in SLOWEST:
        last = int(np.searchsorted(spent, share * spent[-1])) if turns else -1
        slow = [turn for turn in turns if turn.speed <= turns[last].speed * SAME_SPEED]
        if direction := _direction(slow, both=share < 1.0):
            return direction < 0
    return False


def _direction(turns: Sequence[Turn], both: bool) -> int:
    """1 if these loops run counterclockwise, -1 if clockwise, 0 if undecided. `both`: undecided unless there are turns
    both at the top and at the bottom.

    The width of a loop, the output of the downward leg minus that of the upward leg, is taken as proportional to the
    drive range that both legs cover. A drift widens loops after a turn at the top by as much as it narrows them after a
    turn at the bottom, and is fitted as well.
    """
    width = np.array([np.mean(turn.widths) for turn in turns])
    later = np.array([turn.later for turn in turns])
    span = np.array([turn.span for turn in turns])
    drifts = bool(np.any(later > 0.0) and np.any(later < 0.0))
    if not turns or (both and not drifts):
        return 0
    columns = np.column_stack([span, later]) if drifts else span[:, None]
    back = np.linalg.pinv(columns)
    fitted = back @ width
    deviation = _deviation(width - columns @ fitted, np.array([turn.deviation for turn in turns]), back[0])
    drift = float(fitted[1]) if drifts else 0.0
    profile = np.sum([turn.span * (turn.widths - drift * turn.later) for turn in turns], axis=0)
    seen = abs(fitted[0]) > SIGMAS * deviation and abs(np.sum(profile)) > ONE_WAY * np.sum(np.abs(profile))
    return int(np.sign(fitted[0])) if seen else 0


def _deviation(error: Array, noise: Array, row: Array) -> float:
    """Standard deviation of a fitted coefficient, `row @ width`, from the noise in the widths, or from their scatter if
    that is larger."""
    spare = len(error) - (2 if len(error) > 2 else len(error))
    scatter = math.sqrt(float(error @ error) / spare) if spare > 0 else 0.0
    return float(np.linalg.norm(row * np.maximum(noise, scatter)))


@dataclass(frozen=True)
class Turn:
    """The two legs of the drive on either side of a turning point, over the drive range `span` that both cover.

    `widths` (LEVELS,): outputs on the way down minus those on the way up; `later`: delay of the former, in samples;
    `deviation`: standard deviation of the mean width due to the noise of the output.
    """

    span: float
    widths: Array
    later: float
    deviation: float

    @property
    def speed(self) -> float:
        """Change in the drive per sample."""
        return self.span / abs(self.later)


def turns_of(item: Course) -> Iterator[Turn]:
    """The turns of the drive of a course between its first and its last compared sample."""
    place = item.begin + np.flatnonzero(np.isfinite(item.y[item.begin : item.last]))
    v, y = item.v[place], item.y[place]
    ends = corners(v)
    noise = white_noise(y) if len(y) > 3 else 0.0
    legs = [_leg(v, y, place, a, b) for a, b in itertools.pairwise(ends)]
    for before, after, corner in zip(legs[:-1], legs[1:], ends[1:-1], strict=True):
        low, high = max(before[0][0], after[0][0]), min(before[0][-1], after[0][-1])
        if high - low < LEAST_TURN * float(np.ptp(v)):
            continue
        levels = low + (high - low) * (np.arange(LEVELS) + 0.5) / LEVELS
        up, down = (before, after) if v[corner] >= high else (after, before)
        widths, later = (np.interp(levels, down[0], down[k]) - np.interp(levels, up[0], up[k]) for k in (1, 2))
        count = [np.count_nonzero((leg[0] >= low) & (leg[0] <= high)) * leg[3] for leg in (up, down)]
        deviation = noise * math.sqrt(sum(1.0 / max(each, 1.0) for each in count))
        if mean := float(np.mean(later)):
            yield Turn(high - low, widths, mean, deviation)


def corners(v: Array) -> list[int]:
    """First sample, turning points and last sample of a drive's legs; fewer than three samples if there is no turn.

    A play with half of `LEAST_TURN` as threshold ignores smaller moves, and last moved where the drive turned.
    """
    if len(v) < 3:
        return []
    move = np.diff(operators.play(v, 0.5 * LEAST_TURN * float(np.ptp(v)), float(v[0])))
    moved = np.flatnonzero(move)
    if not len(moved):
        return []
    rises = move[moved] > 0.0
    turned = moved[:-1][rises[1:] != rises[:-1]] + 1
    start = v[: moved[0] + 1]
    first = int(np.argmin(start) if rises[0] else np.argmax(start))
    return [first, *turned.tolist(), int(moved[-1]) + 1]


def _leg(v: Array, y: Array, place: NDArray[np.intp], a: int, b: int) -> tuple[Array, Array, Array, float]:
    """Drive, output and sample number of the points of one leg in order of rising drive, and samples per point."""
    order = a + np.argsort(v[a : b + 1], kind="stable")
    edges = np.unique(np.linspace(0, len(order), min(len(order), LEVELS) + 1).astype(int))[:-1]
    sizes = np.diff(np.append(edges, len(order)))
    drive, output, sample = (np.add.reduceat(x[order].astype(np.float64), edges) / sizes for x in (v, y, place))
    return drive, output, sample, len(order) / len(edges)


# Thresholds and number of the plays --------------------------------------------------------------------------


LEAST_TRAVEL = 0.15
"""The largest play still moves over this fraction of the drive's peak-to-peak range.

A play of threshold r moves over `p-p - 2 r` in a settled loop. As this motion goes to zero, the play's weight depends
only on the last few samples before each reversal and can take any value, yet it takes full effect once the drive
becomes slightly larger. At 15 % of the range (r = 0.85 of half the range) the weight is a slope measured over about as
much drive as the gap to the next smaller play, and the error at the ends of the loop is within 10 % of that with r_n =
0.9.
"""

LEAST_VISIBLE = 0.05
"""The same fraction for a play that only just moves visibly, at the ends of the range.

The diagnosis fits plays up to this limit, since otherwise the movement of wider plays could be mistaken for an effect.
A fit to records with an unknown start does the same if they show such a play: in one of ten plants whose drive grew in
both directions, the held-out error without it was 1.4 to 1.6 times the error with a known start; with it, 1.2 times
(`benchmarks/start_memory.py`, seeds 20 to 39).
"""

COUNTS = (6, 8, 12, 16, 24)
"""Numbers of plays tried by default."""

POWERS = (1.0, 1.5, 2.0)
"""Spacings tried, `r_i = r_n (i/n)^power`: even, or denser near zero where loops bend most."""

PLAYS_PARSIMONY = 1.01
"""The fewest plays whose validation error is within this factor of the best are chosen."""

DENSE = 16
"""Number of plays used while other parts of a model are searched for."""

MANY_PLAYS = 100
"""If there are more plays than this, only even spacing is tried."""

SAMPLES_A_PLAY = 8
"""By default there is at most one play per this many samples."""


@dataclass(frozen=True)
class ThresholdList:
    """A list of thresholds to try, r_0 = 0 included."""

    thresholds: tuple[float, ...]

    @property
    def n(self) -> int:
        """Number of plays without r_0."""
        return len(self.thresholds) - 1


def largest(courses: Sequence[Course], least: float = LEAST_TRAVEL) -> float:
    """The largest threshold whose play moves far enough in the record that moves it most.

    `least`: the distance that is far enough, as a fraction of the drive's range.

    Bisection finds it, since a play moves less the larger its threshold; nothing is assumed about the waveform, and a
    first loading from a known start counts like any other move.
    """
    found = 0.0
    for course in courses:
        low_end, high_end = course.drive_range
        if high_end == low_end:
            continue
        wanted = least * (high_end - low_end)
        low, high = 0.0, float(np.ptp(course.v))
        for _ in range(40):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if travel(course, middle) >= wanted else (low, middle)
        found = max(found, low)
    return found


def loop_reach(swing: float, least: float = LEAST_TRAVEL) -> float:
    """The largest threshold of a play that moves over the fraction `least` of the drive's range in a settled loop."""
    return 0.5 * (1.0 - least) * swing


def once(courses: Sequence[Course], reach: float) -> tuple[float, ...]:
    """Thresholds beyond `reach` of plays that move only once, taken from the start memories found."""
    starts = [item.start for item in courses if item.history is None and item.start is not None]
    return tuple(sorted({each.once for each in starts if each.once is not None and each.once > reach}))


def candidates(reach: float, samples: int, count: int | None = None) -> list[ThresholdList]:
    """The lists of thresholds to choose from: every spacing with every number of plays, or with `count` of them."""
    if count is not None:
        counts: Sequence[int] = (count,)
    else:
        counts = [n for n in COUNTS if n * SAMPLES_A_PLAY <= samples] or (max(1, samples // SAMPLES_A_PLAY),)
    lists = []
    for n in counts:
        # a single play has only one possible threshold; with very many plays, the spacing does not matter
        for power in POWERS[: 1 if n < 2 or n > MANY_PLAYS else None]:
            places = (rounded(reach * (i / n) ** power, 6) for i in range(1, n + 1))
            lists.append(ThresholdList((0.0, *places)))
    return lists


def dense(reach: float, samples: int, most: int = DENSE) -> ThresholdList:
    """A single list of `most` plays, fine enough to reveal the other effects in a record."""
    return candidates(reach, samples, min(most, max(1, samples // SAMPLES_A_PLAY)))[:2][-1]


def written(weights: Array) -> Array:
    """Weights as written to a parameter file: rounded, and 0 if they are only rounding error."""
    p = np.array([rounded(float(x), WEIGHT_DIGITS) for x in weights])
    p[p < DUST * float(np.sum(p))] = 0.0
    return p


def rounded(x: float, digits: int) -> float:
    """x rounded to `digits` significant digits."""
    return float(f"{x:.{digits}g}") if math.isfinite(x) else x


def union(lists: Sequence[ThresholdList]) -> Array:
    """All thresholds in the lists, each once."""
    return np.array(sorted({r for candidate in lists for r in candidate.thresholds}))


def columns(reduced: Reduced, candidate: ThresholdList) -> Columns:
    """Columns of the candidate's plays in the reduced systems."""
    return np.asarray(np.searchsorted(reduced.thresholds, candidate.thresholds))


def choose(reduced: Reduced, lists: Sequence[ThresholdList]) -> ThresholdList:
    """The fewest plays whose prediction of blocks left out of the fit is close to that of the best candidate.

    Weights fitted to three of four consecutive blocks predict the fourth. Ties go to the smaller error.
    """
    if len(lists) == 1:
        return lists[0]
    squares = np.zeros(len(lists))
    for fold, left_out in enumerate(reduced.folds):
        training = others(reduced, fold)
        for k, candidate in enumerate(lists):
            chosen = columns(reduced, candidate)
            squares[k] += residual(left_out, chosen, non_negative(training, chosen))
    errors = np.sqrt(squares)
    enough = float(errors.min()) * PLAYS_PARSIMONY
    return min(
        (candidate for candidate, error in zip(lists, errors, strict=True) if error <= enough),
        key=lambda candidate: (candidate.n, errors[lists.index(candidate)]),
    )


# Weights of a play sum, and the floor for p_0 ----------------------------------------------------------------


Columns = NDArray[np.intp]

STILL = 1e-9
"""A column shorter than this fraction of the first, or of the longest in its unit, is rounding: its play rests."""

TIE = 1e-12
"""Weight of the tie break between solutions that fit equally well, as a fraction of the squared output.

If the drive stays between a few turning points, several plays move in the same way, and rounding decides how the weight
is divided among them. The tie break chooses the solution with the smallest sum of squares. A play whose movement
differs from all others by a thousandth keeps its weight to about six digits.
"""

FLOOR_COST = 0.05
"""[fraction of the rms error] The error may grow by this much for p_0 to be raised to its floor."""


def non_negative(system: Array, columns: Columns) -> Array:
    """Weights >= 0 of the chosen plays that minimise `|system[:, columns] p - system[:, -1]|`."""
    return _least_squares(system[:, columns], system[:, -1])


def _least_squares(matrix: Array, target: Array) -> Array:
    from scipy.optimize import nnls

    size = np.linalg.norm(matrix, axis=0)
    moving = size > STILL * size[0]
    length = float(np.linalg.norm(target))
    weights = np.zeros(len(size))
    if moving.any() and length > 0.0:
        # scaled to length one, which makes the solution independent of units and suits the solver's tolerance
        n = int(np.count_nonzero(moving))
        unit = np.concatenate([matrix[:, moving] / size[moving], math.sqrt(TIE) * np.eye(n)])
        scaled, _ = nnls(unit, np.concatenate([target / length, np.zeros(n)]), maxiter=100 * n)
        weights[moving] = scaled * length / size[moving]
    return weights


def residual(system: Array, columns: Columns, weights: Array) -> float:
    """Sum of squared errors that the weights leave in a system."""
    return float(np.sum((system[:, columns] @ weights - system[:, -1]) ** 2))


@dataclass(frozen=True)
class Weights:
    """Result of `fit_weights`: the weights, their rms error, and whether p_0 was raised.

    `free_p0`, `free_rms`: the values before p_0 was raised to the floor; None if it was not raised.
    """

    p: Array
    rms: float
    free_p0: float | None = None
    free_rms: float | None = None


def fit_weights(reduced: Reduced, columns: Columns, floor: float) -> Weights:
    """Weights for the chosen plays, with p_0 at least the fraction `floor` of their sum if the data allow it.

    The inverse divides by p_0, the slope just after a reversal. A record shows that slope only over the first, smallest
    travel after a reversal, where even a slight lag of sensor or amplifier flattens the loop and drives the
    least-squares p_0 to zero. If it falls below the floor, the fit is repeated under `p_0 >= floor * sum p`. The result
    is used if the rms error grows by at most 5 %, since the data then hardly determine p_0. Otherwise the smaller p_0
    is a property of the actuator (series backlash for p_0 = 0: no inverse) and is kept.
    """
    matrix, target = reduced.whole[:, columns], reduced.whole[:, -1]

    def rms(p: Array) -> float:
        return float(np.sqrt(residual(reduced.whole, columns, p) / max(reduced.samples, 1)))

    free = _least_squares(matrix, target)
    if len(free) < 2 or free[0] >= floor * float(np.sum(free)):
        return Weights(free, rms(free))
    # with p_0 = q_0 + share * sum of the others, all >= 0, the bounded problem is again a non-negative one
    share = floor / (1.0 - floor)
    bounded_matrix = matrix.copy()
    bounded_matrix[:, 1:] += share * matrix[:, :1]
    bounded = _least_squares(bounded_matrix, target)
    bounded[0] += share * float(np.sum(bounded[1:]))
    if rms(bounded) > (1.0 + FLOOR_COST) * rms(free):
        return Weights(free, rms(free))
    return Weights(bounded, rms(bounded), float(free[0]), rms(free))


# Linear least squares under linear inequalities --------------------------------------------------------------


RIDGE = 1e-7
"""Weight of the tie break between solutions that fit equally well, with columns scaled to length one."""

INFEASIBLE = 1e-10
"""If the dual problem's solution is closer than this to its target, of length 1, the difference is rounding error: the
target is reached, so no point satisfies all inequalities (Farkas)."""


class InfeasibleError(ValueError):
    """The inequalities contradict each other."""


def least_squares(matrix: Array, target: Array, bounds: Array, limits: Array, plays: int = 0) -> Array:
    """The x that minimises `|matrix x - target|` under `bounds x >= limits`.

    `matrix`: (rows, k); `bounds`: (inequalities, k); `plays`: number of leading columns with a unit of their own; the
    other columns have the target's unit. If the matrix does not determine x, the result is the x with the least norm
    after multiplying each entry by the length of its column. Raises InfeasibleError.

    Lawson and Hanson, Solving Least Squares Problems (1974), chapter 23: the triangular factor turns the problem into
    that of the shortest vector under inequalities (LDP), whose dual is a non-negative least-squares problem.
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
    # in the coordinates e = triangle (x size) - free, the objective is |e|
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
        # the last component of the residual equals the square of its length, which is computed without cancellation
        shortest = dual_matrix[:k] @ multipliers / rest**2 * scale
    return np.asarray(solve_triangular(triangle, shortest + free) / size)


def at_least(lower: Array, upper: Array) -> tuple[Array, Array]:
    """Bounds on single unknowns, without infinite ones, in the form of inequalities for `least_squares`."""
    k = len(lower)
    eye = np.eye(k)
    below, above = np.isfinite(lower), np.isfinite(upper)
    return np.concatenate([eye[below], -eye[above]]), np.concatenate([lower[below], -upper[above]])


def root_mean_square(squares: float, samples: int) -> float:
    """rms from the sum of squares of a number of samples."""
    return math.sqrt(squares / max(samples, 1))
