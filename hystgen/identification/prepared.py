"""Records prepared for a fit: cut at gaps, faults in the drive bridged, wrong samples of the output left out.

Faults that show without a model are found when a course is made, before any fit; isolated samples far from a first,
robust fit to their neighbours are found after that fit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import counted, percent
from hystgen.identification import faults, pi, start
from hystgen.identification.pi import IdentificationError
from hystgen.identification.reduction import Course
from hystgen.records import LARGEST, SHORTEST, Record, no_value

Array = NDArray[np.float64]

LEAST_SOUND = 0.1
"""Smallest fraction of a record that must remain once the samples at the ends of a converter's range are removed."""

MUCH_LESS = 0.5
"""[fraction of the drive's range] If less than this is left after a skipped start, a warning says so: plays need at
least half the range to move out of any state."""

MOST_FITS = 4
"""Maximum number of robust fits; they end as soon as a fit finds the same faults as the previous one."""

LESS_MISSED = 0.25
"""The drive, not the output, is wrong if bridging it reduces the squared error to less than this fraction."""

LEAST_MOVEMENT = 1e-20
"""A smaller motion of drive or output cannot be a measurement: its square, or its ratio to the other motion, falls
outside the range of double precision and of parameter files."""


def courses(
    records: Sequence[Record], history: tuple[float, ...] | None, skip: float
) -> tuple[list[Course], list[str]]:
    """The courses of the records, and a sentence about each change.

    `history` precedes every record; after a gap the memory is unknown again. `skip`: seconds at the start of every
    record that are not compared. Raises IdentificationError.
    """
    made: list[Course] = []
    reported: list[str] = []
    for number, record in enumerate(records):
        skipped = samples_in(record, skip)
        reported += about_skip(record, skipped)
        pieces = faults.between_gaps(record)
        if len(pieces) == 1:
            made.append(replace(course_of(record, history, skipped), origin=(number, 0)))
            continue
        found = []
        for piece in pieces:
            try:
                before = None if piece.after_gap else history
                part = course_of(piece.record, before, max(skipped - piece.first, 0))
                found.append(replace(part, origin=(number, piece.first)))
            except IdentificationError as failure:
                reported.append(f"left out: {failure}")
        if not found:
            raise IdentificationError(f"{record.name}: no part between its gaps can be used; record without gaps")
        reported.append(
            f"{record.name}: cut at {counted(len(pieces) - 1, 'gap')} of more than "
            f"{faults.LONG_GAP:g} steps; the drive in these gaps is unknown, so each part starts anew"
        )
        made += found
    for k, item in enumerate(made):
        made[k], more = _without_stretches(item)
        reported += more
    return made, reported


def about_skip(record: Record, skipped: int) -> list[str]:
    """A warning if little of the drive's range is left once the start is skipped."""
    whole, left = float(np.ptp(record.v)), record.v[skipped:]
    if not skipped or not len(left) or np.ptp(left) >= MUCH_LESS * whole:
        return []
    share = percent(float(np.ptp(left)) / whole)
    return [f"{record.name}: once its start is skipped, the drive covers only {share} of its range; skip less"]


def samples_in(record: Record, seconds: float) -> int:
    """Number of samples in the first seconds of a record."""
    return int(np.searchsorted(record.t, record.t[0] + seconds - 1e-6 * record.sample_time)) if seconds else 0


def course_of(record: Record, history: tuple[float, ...] | None, skip: int) -> Course:
    """The record as it enters a fit: without the start where the memory is unknown, and with isolated faults that can
    be found without a model bridged (drive) or left out (output).

    Raises IdentificationError for a record that a fit cannot use.
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
        skipped = f", of which {min(skip, len(v))} are to be skipped" if skip else ""
        raise IdentificationError(
            f"{record.name} has {counted(len(v), 'sample')}{skipped}, but at least {SHORTEST} are needed"
            + ("; skip less, or record more" if skip else "")
        )
    for name, x in (("v", v), ("y", y)):
        missing = int(np.count_nonzero(no_value(x)))
        if missing > faults.most(len(x)):
            raise IdentificationError(
                f"{record.name}: {missing} of {len(x)} samples of {name} stand for a missing value, "
                f"{x[no_value(x)][0]:.6g} for example; numbers of {LARGEST:g} or more are not readings in any unit. "
                f"Record again, or convert {name}"
            )
    y = np.where(faults.wrong_output(v, y), np.nan, y)
    v = faults.bridged(v, faults.wrong_drive(v, y))
    if np.ptp(v[skip:]) == 0.0:
        raise IdentificationError(f"{record.name}: the drive is constant; a fit needs a drive that moves")
    measured = y[skip:][np.isfinite(y[skip:])]
    if not len(measured) or np.ptp(measured) == 0.0:
        raise IdentificationError(f"{record.name}: the measured output is constant; is y the right column?")
    for name, x in (("v", v), ("y", measured)):
        if np.ptp(x) < LEAST_MOVEMENT:
            raise IdentificationError(
                f"{record.name}: {name} moves by {np.ptp(x):.3g} in all, which is too little in any unit; convert it "
                "to a smaller unit, or name another column"
            )
    return Course(record.name, v, y, history, skip, len(v), skip).resettled(math.inf)


def without_rails(item: Course) -> tuple[Course, list[tuple[str, float, int]]]:
    """The course without samples at the ends of a converter's range, and the name, level and sample count of each end.

    Raises IdentificationError if too few samples remain.
    """
    levels = faults.rails(item.y, item.v)
    if not levels:
        return item, []
    at = np.isin(item.y, [level for _, level in levels])
    left, before = np.count_nonzero(np.isfinite(item.y) & ~at), np.count_nonzero(np.isfinite(item.y))
    if left < max(LEAST_SOUND * before, SHORTEST):
        raise IdentificationError(
            f"{item.name}: y is at the limit of the converter in {before - left} of {len(at)} samples; set the "
            "sensor's range to cover the whole motion, and record again"
        )
    return _less(item, at), [(name, level, int(np.count_nonzero(item.y == level))) for name, level in levels]


def _without_runs(item: Course) -> tuple[Course, list[tuple[str, list[tuple[int, int]]]]]:
    """The course without drop-outs and held samples, and the positions of these."""
    found = []
    for what, find in (("drop-out", faults.drop_outs), ("run", faults.held)):
        runs = find(item.y, item.v)
        if runs:
            item = _less(item, faults.flags_of(runs, len(item.y)))
            found.append((what, runs))
    return item, found


def _less(item: Course, wrong: NDArray[np.bool_]) -> Course:
    """The course without these samples of y."""
    faulty = wrong if item.stretches is None else wrong | item.stretches
    return replace(item, y=np.where(wrong, np.nan, item.y), stretches=faulty)


def _without_stretches(item: Course) -> tuple[Course, list[str]]:
    """The course without the samples of y in plainly wrong stretches, and a sentence about each kind."""
    left, ends = without_rails(item)
    reported = [
        f"{item.name}: {counted(number, 'sample')} of y at the limit of the converter, the {name} value {level:.6g}, "
        "not compared"
        for name, level, number in ends
    ]
    left, runs = _without_runs(left)
    for what, places in runs:
        number = counted(sum(b - a for a, b in places), "sample")
        held = " of equal samples while the drive moves" if what == "run" else ""
        reported.append(
            f"{item.name}: {counted(len(places), what)}{held}, {number} of y not compared; the first is sample "
            f"{places[0][0]}"
        )
    return left, reported


def mask_outliers(
    to_fit: list[Course], held: list[Course], wanted: int | tuple[float, ...] | None, floor: float
) -> None:
    """Leave out isolated samples of y that lie far from the prediction of a play sum fitted to their neighbours.

    The start is examined too, since only the final fit decides how much of it is compared. A wrong drive is bridged.
    Pulses of the drive are left out of the first fit, which then decides whether they are real: a false pulse could
    make the memory seem known. The play sum is fitted by least trimmed squares (Rousseeuw and Van Driessen, Data Mining
    and Knowledge Discovery 12, 2006): it is refitted without the samples with the largest errors, as many as may be
    rejected, so that none of them attracts it.
    """
    first = start.needed([_without_pulses(_without_runs(item)[0]) for item in to_fit])
    solution, _ = pi.solve(first, wanted, floor)
    to_fit[:] = [replace(item, start=each.start).resettled(math.inf) for item, each in zip(to_fit, first, strict=True)]
    places = tuple(float(r) for r in solution.thresholds)
    before: list[Array] = []
    for number in range(MOST_FITS):
        to_fit[:] = [_with_drive_right(item, solution, number > 0) for item in to_fit]
        wrong = [faults.outliers(_errors(item, solution), item.v, item.output_range) for item in to_fit]
        now = [np.stack([item.v, flags]) for item, flags in zip(to_fit, wrong, strict=True)]
        if before and all(np.array_equal(one, other) for one, other in zip(before, now, strict=True)):
            break
        before = now
        trimmed = [_trimmed(_without_runs(item)[0], _errors(item, solution)) for item in to_fit]
        solution, _ = pi.solve(trimmed, places, floor)
    for group in (to_fit, held):
        for k, item in enumerate(group):
            right = _with_drive_right(item, solution, True)
            flags = faults.outliers(_errors(right, solution), right.v, right.output_range)
            group[k] = replace(right, y=np.where(flags, np.nan, right.y)) if flags.any() else right


def _without_pulses(item: Course) -> Course:
    """The course without the rows in which the drive jumps away and back."""
    wrong = faults.flags_of(faults.pulses(item.v), len(item.v))
    if not wrong.any():
        return item
    return replace(item, v=faults.bridged(item.v, wrong), y=np.where(wrong, np.nan, item.y)).resettled(math.inf)


def _with_drive_right(item: Course, solution: pi.Solution, robust: bool) -> Course:
    """The course with its drive bridged at isolated samples to which the output does not respond.

    A sample of the drive is wrong if bridging it makes the model's error there far smaller and no larger elsewhere: a
    wrong drive stays in the memory, a wrong output does not. It is also wrong if the whole row is wrong, which the
    output shows at that row or later: a real pulse would have changed the memory. A pulse right before the end of a
    record counts as a fault: it does not help a fit, and would only widen the range and hide when the memory became
    known. With a `robust` solution, the largest and the smallest drive are also tested if the errors there are among
    the largest: such drives set the model's range, and the samples that they spoil may hide them.
    """
    error = _errors(item, solution)
    far = faults.far_from_others(error, item.output_range)
    isolated = faults.flags_of(far, len(item.v))
    suspects = [run for run in far if faults.returns(item.v, *run)]
    if robust:
        missed = _most_missed(item, error).tolist()
        ends = [(k, k + 1) for k in (int(np.argmax(item.v)), int(np.argmin(item.v))) if k in missed]
        suspects += [run for run in ends if faults.returns(item.v, *run)]
    for first, last in dict.fromkeys([*faults.pulses(item.v), *suspects]):
        run = faults.flags_of([(first, last)], len(item.v))
        other = replace(item, v=faults.bridged(item.v, run)).resettled(math.inf)
        less = _errors(other, solution)
        explained = _size(less[run]) < LESS_MISSED * _size(error[run])
        wrong = bool(isolated[run].any()) and _neither(error[run], less[run])
        there = (explained or wrong) and _size(less[~run]) <= _size(error[~run])
        at_the_end = len(item.v) - last < faults.LONGEST
        if there or at_the_end or _not_remembered(error[~run], less[~run]):
            item, error = other, less
    return item


def _neither(error: Array, less: Array) -> bool:
    """Whether outputs lie farther from both predictions, with and without a pulse of the drive, than these lie from
    each other, so that neither following the drive nor lagging behind it explains them."""
    known = np.isfinite(error)
    nearer = np.minimum(np.abs(error[known]), np.abs(less[known]))
    return bool(known.any() and (nearer > np.abs(error[known] - less[known])).all())


def _not_remembered(error: Array, less: Array) -> bool:
    """Whether the errors around a pulse of the drive show that the pulse left no trace in the memory.

    Samples count where the pulse's effect exceeds the model's own errors without the pulse, `less`, and only if the sum
    of the effect is as significant as an outlier.
    """
    own = np.abs(less[np.isfinite(less)])
    usual = np.sort(own)[: -faults.most(len(own))]
    if not len(usual):
        return False
    scatter = math.sqrt(float(np.mean(usual**2)))
    effect = error - less
    # wrong outputs carry no information about the drive
    here = (np.abs(effect) > scatter) & (np.abs(less) <= usual[-1])
    error, less, effect = error[here], less[here], effect[here]
    sure = _size(effect) > (faults.OUTLYING * scatter) ** 2
    return sure and abs(float(less @ effect)) < math.sqrt(LESS_MISSED) * float(error @ effect)


def _size(error: Array) -> float:
    """Sum of squares of the known errors."""
    return float(np.nansum(error**2))


def _errors(item: Course, solution: pi.Solution) -> Array:
    """Errors (N,) of a course, including its whole start."""
    return pi.compare(replace(item, first=0, last=len(item.v)), solution.thresholds, solution.weights).error


def _most_missed(item: Course, error: Array) -> NDArray[np.intp]:
    """The compared samples with the largest errors, as many as may be isolated faults."""
    compared = item.compared
    return compared[np.argsort(-np.abs(error[compared]), kind="stable")[: faults.most(len(compared))]]


def _trimmed(item: Course, error: Array) -> Course:
    """The course without the samples with the largest errors."""
    y = item.y.copy()
    y[_most_missed(item, error)] = np.nan
    return replace(item, y=y)
