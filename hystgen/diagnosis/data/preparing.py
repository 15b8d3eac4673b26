"""Prepare records for the fits: check whole records and single samples, and set held-out records aside."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import counted
from hystgen.chain import chain
from hystgen.diagnosis.data.items import FittedLike, Item, masks, rms
from hystgen.diagnosis.data.signals import still, unresolved_edges
from hystgen.diagnosis.findings.kinds import (
    DropOuts,
    ExchangedRecords,
    Finding,
    HeldSamples,
    IsolatedSamples,
    OtherHistory,
    Saturated,
    Scale,
    SwappedChannels,
)
from hystgen.diagnosis.search import acceptance
from hystgen.effects.base import Run
from hystgen.front.stage import Stage
from hystgen.identification import faults, pi, prepared, start
from hystgen.identification.faults import runs_of
from hystgen.identification.pi import IdentificationError
from hystgen.identification.reduction import AS_FAR, Course, settled
from hystgen.identification.start import STARTS, UNLIKE
from hystgen.records import Record, no_value

Array = NDArray[np.float64]
Kind = TypeVar("Kind", bound=Finding)


# Checks of whole records: units, columns, displacement, and the history before them -------------------------


Predict = Callable[[Record], Array]
"""The nominal model's prediction of a record, (N,) in output units up to an offset."""


@dataclass(frozen=True)
class Against:
    """A record's output as `factor * prediction + offset`, with the correlation between the two.

    `sense`: ratio of the measured loop's area to the predicted one's, negative if the output leads, 0 if it is not
    significant.
    """

    factor: float
    correlation: float
    sense: float


def checked(records: Sequence[Record], predict: Predict) -> tuple[list[Record | None], list[Finding]]:
    """The usable records, with None for each of the others, and the findings, at most one per record.

    Swapped columns are put right, unless loops run the wrong way in records that are not swapped; a record in other
    units, or with the output of another record, is left out. Faulty samples do not affect these checks.
    """
    plain = [faults.smooth(record) if _whole(record) else record for record in records]
    moving = [k for k, record in enumerate(plain) if _moves(record)]
    right = {k: _right_way_round(plain[k], predict) for k in moving}
    if any(one is plain[k] and seen.sense < 0.0 < seen.factor for k, (one, _, seen) in right.items()):
        right = {k: _as_recorded(plain[k], predict) for k in moving}  # the actuator leads, as no play sum does
    swapped = {k for k in moving if right[k][0] is not plain[k]}
    findings: list[Finding] = [SwappedChannels(records[k].name) for k in sorted(swapped)]
    kept: list[Record | None] = [
        replace(record, v=np.asarray(record.y), y=record.v) if k in swapped else record
        for k, record in enumerate(records)
    ]
    predicted, found = {k: each[1] for k, each in right.items()}, {k: each[2] for k, each in right.items()}
    records, judged = [right[k][0] if k in right else record for k, record in enumerate(plain)], list(found)
    widths = np.array([float(np.ptp(record.v)) for record in records])
    wider = widths[widths > 0.0]
    widest = float(np.max(wider[wider <= acceptance.OTHER_UNIT * np.median(wider)], initial=0.0))
    wide = [k for k in judged if np.ptp(records[k].v) > acceptance.WIDE_DRIVE * widest]
    for k in wide:
        other = _other(k, records, predicted, found)
        if other is not None:
            kept[k] = None
            findings.append(ExchangedRecords(records[k].name, records[other].name))
    sure = [k for k in wide if kept[k] is not None and abs(found[k].correlation) > acceptance.FOLLOWS]
    usual = float(np.median([found[k].factor for k in sure])) if sure else 1.0
    if not 1.0 / acceptance.SCALE_OF_ALL < usual < acceptance.SCALE_OF_ALL:
        findings.append(Scale("all", usual))
    little = [k for k in judged if k not in wide and found[k].correlation > acceptance.FOLLOWS]
    for k in (*sure, *little):
        factor = found[k].factor / usual
        least, most = (
            (1.0 / acceptance.SCALE_OF_ONE, acceptance.SCALE_OF_ONE) if k in sure else (0.0, acceptance.OTHER_UNIT)
        )
        if not least < factor < most:
            kept[k] = None
            findings.append(Scale(records[k].name, factor))
    for k in (k for k in wide if sure and k not in sure and kept[k] is not None):
        size = _spread(records[k].y) / max(usual * _spread(predicted[k]), 1e-300)
        if size < acceptance.DEAD_SENSOR:
            kept[k] = None
            findings.append(Scale(records[k].name, size))
    return kept, findings


def _spread(x: Any) -> float:
    return float(np.subtract(*np.quantile(x, (0.75, 0.25))))


def _whole(record: Record) -> bool:
    """Whether nearly all samples have a drive and an output value; other faults are reported later."""
    v, y = record.v, record.y
    if y is None or len(y) != len(v) or not (np.isfinite(y).all() and np.isfinite(v).all()):
        return False
    return all(np.count_nonzero(no_value(x)) <= faults.most(len(x)) for x in (v, y))


def _moves(record: Record) -> bool:
    """Whether a record is complete and its drive and output move."""
    return _whole(record) and bool(np.ptp(np.asarray(record.y)) > 0.0 and np.ptp(record.v) > 0.0)


def _against(record: Record, predicted: Array) -> Against:
    assert record.y is not None
    y, v = np.asarray(record.y, dtype=np.float64), np.asarray(record.v, dtype=np.float64)
    factor, correlation, scatter = _line(predicted, y)
    own, model = _area(v, y), _area(v, predicted)
    # standard deviation of the area due to white noise in the output
    around = scatter * float(np.sqrt(np.sum((v[2:] - v[:-2]) ** 2))) / 2.0
    expected = abs(factor) * model
    significant = abs(own) > acceptance.LOOP_SIGMAS * around and expected > 0.0
    return Against(factor, correlation, own / expected if significant else 0.0)


def _line(x: Array, y: Array) -> tuple[float, float, float]:
    """Slope, correlation and scatter of y over x, ignoring the few samples far off the line."""
    inside = np.ones(len(x), dtype=bool)
    slope, scatter = 0.0, 0.0
    for _ in range(4):
        dx, dy = x - np.mean(x[inside]), y - np.mean(y[inside])
        power = float(dx[inside] @ dx[inside])
        if power <= 1e-18 * max(float(np.max(x**2)), 1e-300) * len(x):
            return 0.0, 0.0, 0.0
        slope = float(dx[inside] @ dy[inside]) / power
        off = np.abs(dy - slope * dx - np.median(dy - slope * dx))
        scatter = 1.4826 * float(np.median(off))
        inside = off <= max(acceptance.OFF_LINE * scatter, 1e-12)
        if np.count_nonzero(inside) < acceptance.ON_LINE * len(x):
            inside[:] = True
            break
    dx, dy = x[inside] - np.mean(x[inside]), y[inside] - np.mean(y[inside])
    size = float(np.sqrt((dx @ dx) * (dy @ dy)))
    return slope, float(dx @ dy) / size if size > 0.0 else 0.0, scatter


def _area(v: Array, y: Array) -> float:
    """Area enclosed by (v, y), positive if counterclockwise, as when the output lags."""
    return 0.5 * float(np.sum(v[:-1] * y[1:] - v[1:] * y[:-1]) + v[-1] * y[0] - v[0] * y[-1])


def _as_recorded(record: Record, predict: Predict) -> tuple[Record, Array, Against]:
    """A record, its prediction, and how the two compare."""
    predicted = predict(record)
    return record, predicted, _against(record, predicted)


def _right_way_round(record: Record, predict: Predict) -> tuple[Record, Array, Against]:
    """The same for a record whose columns are put right if they are swapped."""
    _, predicted, found = _as_recorded(record, predict)
    if found.sense <= 0.0:
        assert record.y is not None
        swapped = replace(record, v=record.y, y=record.v)
        otherwise = predict(swapped)
        seen = _against(swapped, otherwise)
        if _better(seen, found):
            return swapped, otherwise, seen
    return record, predicted, found


def _better(swapped: Against, found: Against) -> bool:
    """Whether a record's columns are swapped: given the output as its drive, the model predicts the drive.

    The loop then has the right direction and about the expected size; if no loop is visible, the sensitivity decides.
    """
    if swapped.correlation < acceptance.FOLLOWS:
        return False
    least, most = 1.0 / acceptance.SCALE_OF_ALL, acceptance.SCALE_OF_ALL
    if swapped.sense == 0.0:
        as_one = 1.0 / acceptance.SCALE_OF_ONE < swapped.factor < acceptance.SCALE_OF_ONE
        return not least < found.factor < most and as_one
    better = swapped.correlation > found.correlation
    return better and swapped.sense > acceptance.LOOP_AREA and least < swapped.factor < most


def _other(k: int, records: Sequence[Record], predicted: dict[int, Array], found: dict[int, Against]) -> int | None:
    """Another record whose prediction matches the output of record k although k's own prediction does not, or None."""
    if abs(found[k].correlation) > acceptance.OWN_CORRELATION:
        return None
    y = np.asarray(records[k].y)
    others = [(j, _line(x, y)[1]) for j, x in predicted.items() if j != k and len(x) == len(y)]
    best = max(others, key=lambda each: each[1], default=(k, 0.0))
    return best[0] if best[1] > acceptance.FOREIGN_CORRELATION else None


# Whether the records start with the memory left by the given history -----------------------------------------


def contradicted(items: Sequence[Item], fitted: FittedLike) -> OtherHistory | None:
    """A finding if errors at the starts, which depend on the history, far exceed those elsewhere; else None.

    `items`: fitted records only, since held-out records may reach drives where the fit is a guess. The history precedes
    each of them, even in a session.
    """
    return _off(*_parts(items, fitted, False))


def bends(items: Sequence[Item], fitted: FittedLike, free: FittedLike) -> OtherHistory | None:
    """A finding if a model fitted with the history matches the starts only at the expense of the other samples.

    `free`: the model fitted only to samples that do not depend on the history, which predicts the starts correctly.
    Errors at the starts that do not affect the other samples may come from an effect that fades.
    """
    starts, rest = _parts(items, free, True)
    _, bent = _parts(items, fitted, True)
    return _off(starts, rest) if rms(bent) > acceptance.HISTORY_COSTS * rms(rest) else None


def _parts(items: Sequence[Item], fitted: FittedLike, own: bool) -> tuple[list[Array], list[Array]]:
    """Errors before and after the drive has wiped out the history; `own`: minus the mean of the later errors."""
    first, later = [], []
    for item, e in zip(items, fitted.errors(items), strict=True):
        if item.history is None:
            continue
        end = settled(item.run.v, fitted.reach)
        if own and np.isfinite(e[end:]).any():
            e = e - float(np.nanmean(e[end:]))
        first.append(e[:end])
        later.append(e[end:])
    return first, later


def _off(first: Sequence[Array], later: Sequence[Array]) -> OtherHistory | None:
    samples, others = (sum(int(np.count_nonzero(np.isfinite(e))) for e in part) for part in (first, later))
    if min(samples, others) < STARTS:
        return None
    start, rest = rms(first), rms(later)
    return OtherHistory("all", samples, start, rest) if start > UNLIKE * rest else None


# Preparation of the records for the fits ---------------------------------------------------------------------


@dataclass(frozen=True)
class Prepared:
    """Fitted and held-out records, with notes on every change to them.

    `repaired`: faults left out or bridged; `drive`: range of the fitted drives; `thresholds`: those of the plays.
    """

    to_fit: list[Item]
    held: list[Item]
    notes: list[str]
    repaired: list[Finding]
    drive: tuple[float, float]
    thresholds: Array


def prepare(
    records: Sequence[Record], holdout: Sequence[Record], history: tuple[float, ...] | None, rest: float,
    skip: float = 0.0,
) -> Prepared:
    """Items for the fits; without a usable held-out record, every third record or the end of each is held out.

    `skip`: seconds at the start of every record that are not compared. Raises IdentificationError, for example if too
    few samples can be compared.
    """
    notes: list[str] = []
    held_courses, held_rails = _courses(holdout, history, skip)
    if holdout and len(records) > 2 and not enough(held_courses):
        notes.append(too_little(held_courses, JUDGE))
        holdout = []
    if not holdout and len(records) > 2:
        aside = set_aside(records)
        holdout = [records[k] for k in aside]
        records = [record for k, record in enumerate(records) if k not in aside]
        names = ", ".join(record.name for record in holdout)
        notes.append(f"no usable held-out record was given: {names} set aside")
        held_courses, held_rails = _courses(holdout, history, skip)
    fit_courses, fit_rails = _courses(records, history, skip)
    if not enough(fit_courses):
        raise IdentificationError(too_little(fit_courses, "fit"))
    if holdout and not enough(held_courses):
        raise IdentificationError(too_little(held_courses, JUDGE))
    if not holdout and not enough(fit_courses, acceptance.SET_ASIDE):
        raise IdentificationError(too_little(fit_courses, f"fit and {JUDGE}", acceptance.SET_ASIDE))
    repaired: list[Finding] = [*fit_rails, *held_rails]
    prepared.mask_outliers(fit_courses, held_courses, None, 0.0)
    fit_courses, held_courses, way = _begun(fit_courses, held_courses)
    notes += way
    for courses, what in ((fit_courses, "fit"), (held_courses, JUDGE)):
        if courses and not any(course.used > acceptance.COMPARED_SAMPLES for course in courses):
            raise IdentificationError(too_little(courses, what))
    for course, record in zip((*fit_courses, *held_courses), (*records, *holdout), strict=True):
        _tell_left_out(course, record, notes, repaired)
    to_fit = [_item(c, r, rest) for c, r in zip(fit_courses, records, strict=True)]
    held = [_item(c, r, rest) for c, r in zip(held_courses, holdout, strict=True)]
    to_fit, held = _in_session(to_fit, held)
    if not held:
        to_fit, held = parted(to_fit)
        share = f"{100 * acceptance.SET_ASIDE:g} %"
        notes.append(f"no usable held-out record was given: the last {share} of each is set aside")
    if not all(item.timed for item in (*to_fit, *held)):
        notes.append("not every record has a time: time-dependent effects are not tried; give --sample-time")
    if not any(float(np.ptp(item.y[item.known])) > 0.0 for item in to_fit if item.known.any()):
        names = ", ".join(item.name for item in to_fit)
        raise IdentificationError(f"{names}: the measured output is constant where it is compared; check the sensor")
    reach = _reach(fit_courses)
    samples = sum(course.used for course in fit_courses)
    drive = (min(c.drive_range[0] for c in fit_courses), max(c.drive_range[1] for c in fit_courses))
    places = np.array(pi.dense(reach, samples, acceptance.PLAYS).thresholds)
    notes.extend(hardly_compared([*to_fit, *held]))
    return _without_faults(Prepared(to_fit, held, notes, repaired, drive, places))


def to_judge(
    records: Sequence[Record], history: tuple[float, ...] | None, rest: float, skip: float = 0.0
) -> tuple[list[Item], list[str]]:
    """Items for judging models without a fit, prepared as `prepare` does, and notes on what is not compared.

    Raises IdentificationError if too few samples can be compared.
    """
    notes: list[str] = []
    courses, rails = _courses(records, history, skip)
    if not enough(courses):
        raise IdentificationError(too_little(courses, JUDGE))
    repaired: list[Finding] = [*rails]
    prepared.mask_outliers(courses, [], None, 0.0)
    courses, _, way = _begun(courses, [])
    notes += way
    for course, record in zip(courses, records, strict=True):
        _tell_left_out(course, record, notes, repaired)
    items, _ = _in_session([_item(c, r, rest) for c, r in zip(courses, records, strict=True)], [])
    sound, wrong = without_faults(items, not_at_the_end(repaired, items))
    if any(item.known.any() for item in sound):
        items = sound
        notes += [each.sentence(None) for each in merged(wrong)]
    return items, [*notes, *hardly_compared(items)]


def to_watch(
    record: Record, stages: Sequence[Stage], thresholds: Array, weights: Array, history: tuple[float, ...] | None,
    rest: float, skip: float = 0.0,
) -> Item:
    """An item for judging a known model, by which its start memory is found if too little is compared without one.

    Nothing else is fitted to the record, unlike in `to_judge`. Raises IdentificationError if too few samples can be
    compared.
    """
    course, _ = prepared.without_rails(prepared.course_of(record, history, prepared.samples_in(record, skip)))
    if not enough([course]):
        raise IdentificationError(too_little([course], JUDGE))
    reach = math.inf if stages else float(thresholds[-1])
    begun = start.unknown(course, reach) if history is None else course
    if start.lacking(begun, acceptance.FEW_COMPARED):
        (begun,) = start.of_model([course], stages, thresholds, weights, acceptance.FEW_COMPARED, reach)
    return _item(begun, record, rest)


def _tell_left_out(course: Course, record: Record, notes: list[str], repaired: list[Finding]) -> None:
    """Add notes on the samples that are bridged or not compared, and findings about isolated ones."""
    for channel, wrong, what in (
        ("v", np.flatnonzero(course.v != record.v), faults.BRIDGED),
        ("y", _outliers(course), faults.NOT_COMPARED),
    ):
        if len(wrong):
            notes.append(faults.sentence(course.name, wrong, what))
            repaired.append(IsolatedSamples(course.name, channel, float(record.t[wrong[0]]), len(wrong)))
    edges = np.count_nonzero(unresolved_edges(course.v)[course.first :])
    if edges:
        notes.append(f"{course.name}: {counted(int(edges), 'sample')} not compared, at jumps of the drive")


def _courses(
    records: Sequence[Record], history: tuple[float, ...] | None, skip: float
) -> tuple[list[Course], list[Saturated]]:
    """The records as they are compared, and findings about samples left out at a converter's limit."""
    courses, saturated = [], []
    for record in records:
        course, ends = prepared.without_rails(prepared.course_of(record, history, prepared.samples_in(record, skip)))
        courses.append(course)
        for name, level, number in ends:
            saturated.append(Saturated(course.name, None, name, level, number))
    return courses, saturated


def _begun(to_fit: Sequence[Course], held: Sequence[Course]) -> tuple[list[Course], list[Course], list[str]]:
    """The courses, with start memories if too few samples could be compared without them, and notes on the directions
    of their loops.

    Otherwise no start memory is estimated, since it could absorb the first seconds of an effect. The need is judged for
    each fitted record, since the fit needs all of them, but for all held-out records together: a memory found before
    the effects are known may be wrong by an effect's whole contribution, and no effect can then remove that error.
    """
    low, high = min(float(c.v.min()) for c in to_fit), max(float(c.v.max()) for c in to_fit)
    largest = pi.loop_reach(high - low, pi.LEAST_VISIBLE)  # wider plays may exist but would hardly move
    begun = start.needed(to_fit, least=acceptance.FEW_COMPARED, largest=largest)
    solution, _ = pi.solve(begun, None, 0.0)
    begun_held = start.of_model(held, (), solution.thresholds, solution.weights, _least(held), largest)
    return begun, begun_held, solution.sense.sentences(len(solution.thresholds) - 1)


def _reach(courses: Sequence[Course]) -> float:
    """The largest threshold for the fits: that of the widest play that moves visibly, if only at the ends of the range.

    With a fit's usual largest threshold, the motion of wider plays would stay in the errors and look like an effect.
    """
    return pi.largest(courses, pi.LEAST_VISIBLE)


def _least(courses: Sequence[Course]) -> float:
    """Fraction of a held-out record's samples below which its start memory is estimated; 0 if enough samples of all
    held-out records together can be compared without one."""
    known = [int(np.count_nonzero(np.isfinite(course.y[course.begin : course.last]))) for course in courses]
    used = [start.unknown(course).used for course in courses]
    able = max(used, default=0) > acceptance.COMPARED_SAMPLES
    return 0.0 if able and sum(used) >= acceptance.FEW_COMPARED * sum(known) else acceptance.FEW_COMPARED


def _without_faults(ready: Prepared) -> Prepared:
    """The records without plainly faulty samples, unless too few samples would remain."""
    repaired = not_at_the_end(ready.repaired, [*ready.to_fit, *ready.held])
    number = len(ready.to_fit)
    items, wrong = without_faults([*ready.to_fit, *ready.held], repaired)
    to_fit, held = items[:number], items[number:]
    least = acceptance.COMPARED_SAMPLES
    if any(max(np.count_nonzero(item.known) for item in group) <= least for group in (to_fit, held)):
        return ready
    return replace(ready, to_fit=to_fit, held=held, repaired=merged([*repaired, *wrong]))


def _item(course: Course, record: Record, rest: float) -> Item:
    y, edges = course.y.copy(), unresolved_edges(course.v)
    y[: _arrived(course, edges)] = np.nan
    y[edges] = np.nan
    run = Run(np.ascontiguousarray(record.t, dtype=np.float64), course.v, dict(record.extra), rest)
    turns = None if course.start is None else course.start.turns
    return Item(course.name, run, y, course.history, course.output_range, turns=turns, timed=record.timed)


def _arrived(course: Course, edges: NDArray[np.bool_]) -> int:
    """First sample to compare; if a step of the drive wipes the start memory, the first at which the output is within
    `AS_FAR` of its settled value, since plays behind a lag or a slew limit are wiped only then."""
    first = course.first
    if course.start is not None or course.visited is not None or not edges[first : first + 1].any():
        return first
    holds = still(course.v[first : course.last], acceptance.EDGE_STANDS)
    if not holds or holds[0][0] > 0:
        return first
    y = course.y[first : first + holds[0][1]]
    rest = y[int(acceptance.HOLD_SETTLING * len(y)) :]
    if not np.isfinite(rest).any():
        return first
    return first + int(np.argmax(np.abs(y - np.nanmedian(rest)) <= AS_FAR * course.output_range))


def _outliers(course: Course) -> NDArray[np.intp]:
    """Samples left out only because they are isolated outliers of the output."""
    missing = np.isnan(course.y)
    missing[: course.first] = False
    return np.flatnonzero(missing if course.stretches is None else missing & ~course.stretches)


def _in_session(to_fit: list[Item], held: list[Item]) -> tuple[list[Item], list[Item]]:
    """The items with their session, if the records follow one another in time."""
    items = sorted([*to_fit, *held], key=lambda item: float(item.run.t[0]))
    apart = all(a.run.t[-1] < b.run.t[0] for a, b in itertools.pairwise(items))
    if len(items) < 2 or not apart:
        return to_fit, held
    whole = chain.join([replace(item.run, rest=0.0) for item in items])
    parts = {id(item): part for item, part in zip(items, whole.parts, strict=True)}
    first, second = (
        [replace(item, session=whole.run, part=parts[id(item)]) for item in group] for group in (to_fit, held)
    )
    return first, second


# Which records are held out, and whether there is enough to compare ------------------------------------------


JUDGE = "judge by"
"""The purpose of held-out records, for messages."""


def enough(courses: Sequence[Course], share: float = 1.0) -> bool:
    """Whether this fraction of at least one course is enough to compare, with a start memory if one can be found."""
    return any(share * _comparable(course) > acceptance.COMPARED_SAMPLES for course in courses)


def _comparable(course: Course) -> int:
    """Number of samples that can be compared, with a start memory if one can be found."""
    known = np.isfinite(course.y[course.begin : course.last])
    return int(np.count_nonzero(known)) if start.findable(course) else course.used


def too_little(courses: Sequence[Course], what: str, share: float = 1.0) -> str:
    """The message for courses with too few samples to compare; `what`: the purpose of these samples."""
    names = ", ".join(course.name for course in courses)
    most, least = max(course.used for course in courses), acceptance.COMPARED_SAMPLES / share
    if all(start.findable(course) for course in courses) and not enough(courses, share):
        most = max(_comparable(course) for course in courses)
        return (
            f"{names}: too few samples to {what}: at most {most} in a record, but more than {least:.0f} are needed; "
            "record more"
        )
    return (
        f"{names}: too few samples to {what}: at most {most} in a record after the start, whose memory is unknown, but "
        f"more than {least:.0f} are needed; give --history, or records that sweep their range again"
    )


def hardly_compared(items: Sequence[Item]) -> list[str]:
    """Notes on records with almost nothing to compare, and on those that are compared only in their second half."""
    notes = []
    for name, compared in masks(items):
        number = int(np.count_nonzero(compared))
        if number <= acceptance.COMPARED_SAMPLES:
            notes.append(
                f"{name}: only {counted(number, 'sample')} compared, of little use; if its start memory is unknown, "
                "give --history, or let it sweep its range again"
            )
        elif np.argmax(compared) > len(compared) // 2:
            notes.append(
                f"{name}: {number} of {len(compared)} samples are compared, those after the largest and the smallest "
                "drive, from where its memory is known; --history makes more usable"
            )
    return notes


def set_aside(records: Sequence[Record]) -> list[int]:
    """Indices of the records to hold out: every third one, shifted if that gives both sides fast and wide drives.

    An effect that shows only at fast edges cannot be found if no such edge is fitted, nor judged if none is held out.
    """
    rates = np.array([float(np.max(np.abs(np.diff(record.v) / np.diff(record.t)))) for record in records])
    swings = np.array([float(np.ptp(record.v)) for record in records])
    least = acceptance.FAST_RECORD
    showing = [{k for k, x in enumerate(found) if x >= least * np.max(found)} for found in (rates, swings)]

    def shared(aside: Sequence[int]) -> int:
        return sum(bool(some.intersection(aside)) and bool(some.difference(aside)) for some in showing)

    counts = [list(range(first, len(records), 3)) for first in (2, 1, 0)]
    others = [[*aside[:k], aside[k] - 1, *aside[k + 1 :]] for aside in counts for k in range(len(aside)) if aside[k]]
    return max(counts + others, key=shared)


def with_ends(ready: Prepared) -> Prepared | None:
    """The records with the end of each fitted one held out too; None if they already are, or the ends are too short."""
    ends = {id(item.run) for item in ready.to_fit} & {id(item.run) for item in ready.held}
    longest = max(int(np.count_nonzero(item.known)) for item in ready.to_fit)
    if ends or acceptance.SET_ASIDE * longest <= acceptance.COMPARED_SAMPLES:
        return None
    to_fit, held = parted(ready.to_fit)
    share = f"{100 * acceptance.SET_ASIDE:g} %"
    note = f"the held-out records alone support no name: the last {share} of each fitted record is held out too"
    return replace(ready, to_fit=to_fit, held=[*ready.held, *held], notes=[*ready.notes, note])


def parted(items: Sequence[Item]) -> tuple[list[Item], list[Item]]:
    """The beginning of every item, to be fitted, and its end, to be held out."""
    beginnings, ends = [], []
    for item in items:
        known = np.flatnonzero(item.known)
        split = int(known[int((1.0 - acceptance.SET_ASIDE) * len(known))])
        front, end = item.y.copy(), item.y.copy()
        front[split:], end[:split] = np.nan, np.nan
        beginnings.append(replace(item, y=front))
        ends.append(replace(item, y=end))
    return beginnings, ends


# Plainly faulty samples: drop-outs, held samples, a converter at its limit -----------------------------------


Runs = Sequence[tuple[int, int]]


def without_faults(items: Sequence[Item], repaired: Sequence[Finding]) -> tuple[list[Item], list[Finding]]:
    """The items without faulty samples, and findings about the faults; `repaired`: findings so far.

    A level that marks a drop-out or the converter's limit in one record marks it in all others.
    """
    ends = {each.level for each in repaired if isinstance(each, Saturated) and each.level is not None}
    dropped = [faults.drop_outs(item.y, item.run.v) for item in items]
    lost = {level for item, runs in zip(items, dropped, strict=True) for level in _levels(item.y, runs)} - ends
    kept: list[Item] = []
    found: list[Finding] = []
    for item, away in zip(items, dropped, strict=True):
        y = item.y.copy()
        levelled = {level: [run for run in runs_of(y == level) if run[1] - run[0] > 1] for level in ends | lost}
        full = sorted(run for level in ends for run in levelled[level])
        away = sorted({*away, *(run for level in lost for run in levelled[level])})
        for kind, runs in ((Saturated, full), (DropOuts, away), (HeldSamples, None)):
            if runs is None:
                runs = faults.held(y, item.run.v)
            wrong = np.zeros(len(y), dtype=bool)
            for a, b in runs:
                wrong[a:b] = True
            if np.isfinite(y[wrong]).any():
                found.append(_finding(kind, item, y, runs))
            y[wrong] = np.nan
        changed = np.isfinite(item.y) & ~np.isfinite(y)
        known = y[np.isfinite(y)]
        kept.append(replace(item, y=y, output_range=float(np.ptp(known))) if changed.any() and len(known) else item)
    return kept, found


def merged(findings: Sequence[Kind]) -> list[Kind]:
    """One finding per kind and record: a record whose end is held out was examined in two parts."""
    found: dict[object, Kind] = {}
    for each in findings:
        key = type(each), *(getattr(each, name, None) for name in ("record", "channel", "end"))
        if key in found:
            numbers = [name for name in ("count", "samples") if hasattr(each, name)]
            each = replace(found[key], **{name: getattr(found[key], name) + getattr(each, name) for name in numbers})
        found[key] = each
    return list(found.values())


def not_at_the_end(repaired: Sequence[Finding], items: Sequence[Item]) -> list[Finding]:
    """The repairs, with samples listed as held rather than saturated if another record goes beyond their level."""
    highest, lowest = (f([float(f(item.y[item.known])) for item in items if item.known.any()]) for f in (max, min))
    span = highest - lowest
    found: list[Finding] = []
    for each in repaired:
        if isinstance(each, Saturated) and each.level is not None:
            beyond = highest - each.level if each.end == "largest" else each.level - lowest
            if beyond > acceptance.RAIL_PASSED * span:
                each = HeldSamples(each.record, None, 1, each.count)
        found.append(each)
    return found


def _levels(y: Array, runs: Runs) -> set[float]:
    """Levels of the runs of equal values."""
    return {float(y[a]) for a, b in runs if b - a >= faults.SHORT and np.nanmin(y[a:b]) == np.nanmax(y[a:b])}


def _finding(kind: type[Finding], item: Item, y: Array, runs: Runs) -> Finding:
    values = np.concatenate([y[a:b] for a, b in runs])
    samples = int(np.count_nonzero(np.isfinite(values)))
    first = float(item.run.t[runs[0][0]])
    level = float(np.nanmin(values)) if np.nanmax(values) == np.nanmin(values) else None
    if kind is Saturated:
        return Saturated(item.name, first, None, level, samples)
    if kind is DropOuts:
        return DropOuts(item.name, first, level, len(runs), samples)
    return HeldSamples(item.name, first, len(runs), samples)
