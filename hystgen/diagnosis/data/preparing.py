"""Records made ready for the fits: what is fitted, what is held out, and what was done to them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen.chain import chain
from hystgen.diagnosis.data import bad_samples, held_out
from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.findings.kinds import Finding, IsolatedSamples, Saturated
from hystgen.diagnosis.search import acceptance
from hystgen.effects.base import Run
from hystgen.identification import faults, pi, prepared, thresholds
from hystgen.identification.pi import IdentificationError
from hystgen.identification.reduction import Course
from hystgen.records import Record

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Prepared:
    """Records to fit and held-out ones, and what was done to them.

    `repaired`: faults that were left out or bridged; `drive`: range of the fitted drives; `thresholds`: of the plays.
    """

    to_fit: list[Item]
    held: list[Item]
    notes: list[str]
    repaired: list[Finding]
    drive: tuple[float, float]
    thresholds: Array


def prepare(
    records: Sequence[Record], holdout: Sequence[Record], history: tuple[float, ...] | None, rest: float
) -> Prepared:
    """Items for the fits; without held-out records that can judge one in three is held out, or the end of each.

    Raises IdentificationError, also where there is too little to compare.
    """
    notes: list[str] = []
    held_courses, held_rails = _courses(holdout, history)
    if holdout and len(records) > 2 and not held_out.enough(held_courses):
        notes.append(held_out.too_little(held_courses, held_out.JUDGE))
        holdout = []
    if not holdout and len(records) > 2:
        aside = held_out.set_aside(records)
        holdout = [records[k] for k in aside]
        records = [record for k, record in enumerate(records) if k not in aside]
        names = ", ".join(record.name for record in holdout)
        notes.append(f"no record was given that can judge: {names} set aside")
        held_courses, held_rails = _courses(holdout, history)
    fit_courses, fit_rails = _courses(records, history)
    if not held_out.enough(fit_courses):
        raise IdentificationError(held_out.too_little(fit_courses, "fit"))
    if holdout and not held_out.enough(held_courses):
        raise IdentificationError(held_out.too_little(held_courses, held_out.JUDGE))
    if not holdout and not held_out.enough(fit_courses, acceptance.SET_ASIDE):
        raise IdentificationError(held_out.too_little(fit_courses, f"fit and {held_out.JUDGE}", acceptance.SET_ASIDE))
    repaired: list[Finding] = [*fit_rails, *held_rails]
    prepared.mask_outliers(fit_courses, held_courses, None, 0.0)
    for course, record in zip((*fit_courses, *held_courses), (*records, *holdout), strict=True):
        for channel, wrong, what in (
            ("v", np.flatnonzero(course.v != record.v), faults.BRIDGED),
            ("y", _outliers(course), faults.NOT_COMPARED),
        ):
            if len(wrong):
                notes.append(faults.sentence(course.name, wrong, what))
                repaired.append(IsolatedSamples(course.name, channel, float(record.t[wrong[0]]), len(wrong)))
    to_fit = [_item(c, r, rest) for c, r in zip(fit_courses, records, strict=True)]
    held = [_item(c, r, rest) for c, r in zip(held_courses, holdout, strict=True)]
    to_fit, held = _in_session(to_fit, held)
    if not held:
        to_fit, held = held_out.parted(to_fit)
        share = f"{100 * acceptance.SET_ASIDE:g} %"
        notes.append(f"no record was given that can judge: the last {share} of each is set aside")
    if not any(float(np.ptp(item.y[item.known])) > 0.0 for item in to_fit if item.known.any()):
        names = ", ".join(item.name for item in to_fit)
        raise IdentificationError(f"{names}: the measured output is constant where it is compared; check the sensor")
    reach = thresholds.largest(fit_courses)
    samples = sum(course.used for course in fit_courses)
    drive = (min(c.drive_range[0] for c in fit_courses), max(c.drive_range[1] for c in fit_courses))
    places = np.array(thresholds.dense(reach, samples, acceptance.PLAYS).thresholds)
    notes.extend(held_out.hardly_compared([*to_fit, *held]))
    return _without_faults(Prepared(to_fit, held, notes, repaired, drive, places))


def _courses(
    records: Sequence[Record], history: tuple[float, ...] | None
) -> tuple[list[Course], list[Saturated]]:
    """The records as they take part, and what was left out at a converter's end."""
    courses, saturated = [], []
    for record in records:
        course, ends = prepared.without_rails(pi.course(record, history, 0))
        courses.append(course)
        for name, level, number in ends:
            saturated.append(Saturated(course.name, None, name, level, number))
    return courses, saturated


def _without_faults(ready: Prepared) -> Prepared:
    """The records without samples that are plainly wrong, unless hardly any would be left."""
    repaired = bad_samples.not_at_the_end(ready.repaired, [*ready.to_fit, *ready.held])
    number = len(ready.to_fit)
    items, wrong = bad_samples.without_faults([*ready.to_fit, *ready.held], repaired)
    to_fit, held = items[:number], items[number:]
    least = acceptance.COMPARED_SAMPLES
    if any(max(np.count_nonzero(item.known) for item in group) <= least for group in (to_fit, held)):
        return ready
    return replace(ready, to_fit=to_fit, held=held, repaired=bad_samples.merged([*repaired, *wrong]))


def _item(course: Course, record: Record, rest: float) -> Item:
    y = course.y.copy()
    y[: course.first] = np.nan
    run = Run(np.ascontiguousarray(record.t, dtype=np.float64), course.v, dict(record.extra), rest)
    return Item(course.name, run, y, course.history, course.output_range)


def _outliers(course: Course) -> NDArray[np.intp]:
    """Samples whose output was left out as isolated, where it would be compared."""
    missing = np.isnan(course.y)
    missing[: course.first] = False
    return np.flatnonzero(missing if course.stretches is None else missing & ~course.stretches)


def _in_session(to_fit: list[Item], held: list[Item]) -> tuple[list[Item], list[Item]]:
    """The items with the session around them, where their times follow each other."""
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
