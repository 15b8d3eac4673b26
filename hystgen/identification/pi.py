"""Fitting a PI model to records: thresholds, weights, and how good it is."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import arguments
from hystgen.identification import faults, reduction, thresholds, weights
from hystgen.identification.reduction import Course
from hystgen.identification.report import Row
from hystgen.identification.thresholds import Candidate, rounded
from hystgen.identification.weights import Weights
from hystgen.records import LARGEST, SHORTEST, Record, no_value

Array = NDArray[np.float64]

DIGITS = 10
"""Significant digits of fitted numbers: far below what a record tells, above what depends on the linear algebra."""

DUST = 1e-9
"""A weight of less than this share of their sum is rounding, not a play."""

MOST_PLAYS = 1000

SMALLEST = 1e-20
"""Drive or output that moves by less is no measurement: squares of it, and ratios to the other one, leave the numbers
that there are in double precision and in parameter files."""


FALLS = (
    "no play has a positive weight: y does not rise with v; if the sensor counts the other way, change the sign of y, "
    "else check which column is which"
)
"""What is said of records from which nothing is left of a model."""


class IdentificationError(ValueError):
    """Records that no model can be fitted to; `str()` says why and what to do."""


@dataclass(frozen=True)
class Solution:
    """A fitted play sum. `reach`: largest threshold that the records support; `fitted`: what was done about p_0."""

    thresholds: Array
    weights: Array
    reach: float
    fitted: Weights

    def without_idle_plays(self) -> Solution:
        """The same without plays that have no weight: they are no part of the model."""
        kept = (self.weights > 0.0) | (self.thresholds == 0.0)
        return replace(self, thresholds=self.thresholds[kept], weights=self.weights[kept])


def course(record: Record, history: tuple[float, ...] | None, skip: int) -> Course:
    """The record as it takes part: its start ignored as far as the start memory is unknown, isolated faults that show
    without a model bridged (drive) or left out (output).

    Raises IdentificationError for a record without what a fit needs.
    """
    if record.y is None:
        raise IdentificationError(f"{record.name} has no measured column y; name one with --columns")
    v = np.ascontiguousarray(record.v, dtype=np.float64)
    y = np.ascontiguousarray(record.y, dtype=np.float64)
    if len(v) != len(y):
        raise IdentificationError(f"{record.name} has {len(v)} samples of v and {len(y)} of y")
    if not (np.isfinite(v).all() and np.isfinite(y).all()):
        raise IdentificationError(f"{record.name} has samples without a value; drop them first")
    if len(v) < skip + SHORTEST:
        raise IdentificationError(f"{record.name} has {len(v)} samples, at least {skip + SHORTEST} are needed")
    for name, x in (("v", v), ("y", y)):
        missing = int(np.count_nonzero(no_value(x)))
        if missing > faults.most(len(x)):
            raise IdentificationError(
                f"{record.name}: {missing} of {len(x)} samples of {name} stand for no value, "
                f"{x[no_value(x)][0]:.6g} for one; from {LARGEST:g} on numbers are none in any unit. Record again, or "
                f"convert {name}"
            )
    y = np.where(faults.wrong_output(v, y), np.nan, y)
    v = faults.bridged(v, faults.wrong_drive(v, y))
    if np.ptp(v[skip:]) == 0.0:
        raise IdentificationError(f"{record.name}: the drive is constant; a fit needs a drive that moves")
    measured = y[skip:][np.isfinite(y[skip:])]
    if not len(measured) or np.ptp(measured) == 0.0:
        raise IdentificationError(f"{record.name}: the measured output is constant; is the right column y?")
    for name, x in (("v", v), ("y", measured)):
        if np.ptp(x) < SMALLEST:
            raise IdentificationError(
                f"{record.name}: {name} moves by {np.ptp(x):.3g} in all, which is no movement in any unit; convert it "
                "to a smaller unit, or name another column"
            )
    return resettled(Course(record.name, v, y, history, skip, len(v), skip), math.inf)


def resettled(item: Course, largest: float) -> Course:
    """The course with no more of its start ignored than a largest threshold makes necessary."""
    first = 0 if item.history is not None else reduction.settled(item.v[: item.last], largest)
    return replace(item, first=max(first, item.begin))


def solve(
    courses: Sequence[Course],
    wanted: int | tuple[float, ...] | None,
    floor: float,
    tick: Callable[[int], None] | None = None,
) -> tuple[Solution, list[Course]]:
    """Choose thresholds (unless given as a list), fit the weights; also the courses as they were compared.

    Raises IdentificationError.
    """
    reach = thresholds.largest([item for item in courses if item.used])
    if reach == 0.0:
        names = ", ".join(dict.fromkeys(item.name for item in courses))
        raise IdentificationError(
            f"{names}: once the start memory is known the drive does not move any more; record more cycles, or give "
            "--history"
        )
    if isinstance(wanted, tuple):
        lists = [Candidate(wanted)]
    else:
        lists = thresholds.candidates(reach, sum(item.used for item in courses), wanted)
    top = max(candidate.thresholds[-1] for candidate in lists)
    compared = [resettled(item, top) for item in courses]
    samples = sum(item.used for item in compared)
    fewest = min(candidate.n for candidate in lists) + 2
    if samples < fewest:
        raise IdentificationError(
            f"{samples} samples can be compared, {fewest - 2} plays need at least {fewest}; record more cycles, "
            "give --history, or use fewer thresholds"
        )
    reduced = reduction.reduce(compared, thresholds.union(lists), tick)
    chosen = thresholds.choose(reduced, lists)
    fitted = weights.fit(reduced, thresholds.columns(reduced, chosen), floor)
    p = np.array([rounded(float(x), DIGITS) for x in fitted.p])
    p[p < DUST * float(np.sum(p))] = 0.0
    r = np.array(chosen.thresholds)
    if not np.any(p > 0.0):
        raise IdentificationError(FALLS)
    solution = Solution(r, p, reach, fitted)
    return (solution if wanted is not None else solution.without_idle_plays()), compared


@dataclass(frozen=True)
class Errors:
    """Error samples of one course from `first` to `last`, its free offset taken out; NaN where not compared."""

    course: Course
    offset: float
    error: Array


def compare(item: Course, r: Array, p: Array) -> Errors:
    """Free run of the model along the drive, compared from `first` to `last`, with one free offset."""
    error = (item.y - reduction.prediction(item.v, item.history, r, p))[item.first : item.last]
    offset = float(np.nanmean(error))
    return Errors(item, offset, error - offset)


def row(part: str, model: str, errors: Sequence[Errors]) -> Row:
    """The table's row."""
    joined = np.concatenate([e.error for e in errors])
    joined = joined[np.isfinite(joined)]
    return Row(
        part,
        model,
        tuple(e.course.name for e in errors),
        len(joined),
        sum(e.course.first - e.course.begin for e in errors),
        float(np.sqrt(np.mean(joined**2))),
        float(np.max(np.abs(joined))),
        max(e.course.output_range for e in errors),
    )


def checked_thresholds(wanted: int | Sequence[float] | None) -> int | tuple[float, ...] | None:
    """None, a number of plays, or a list of thresholds that begins with 0. Raises ValueError."""
    if wanted is None:
        return None
    if isinstance(wanted, int | np.integer) and not isinstance(wanted, bool):
        if not 0 <= wanted <= MOST_PLAYS:
            raise ValueError(f"thresholds is a number of plays from 0 to {MOST_PLAYS}, not {wanted}")
        return int(wanted)
    if isinstance(wanted, str | float | bool):
        raise ValueError("thresholds is a whole number of plays or a list of thresholds")
    places = arguments.numbers("thresholds", wanted, "[0, 1.5, 3]")
    if not places or places[0] != 0.0:
        places = (0.0, *places)
    if any(b <= a for a, b in itertools.pairwise(places)):
        raise ValueError("thresholds are finite, not negative, and rise strictly")
    return places
