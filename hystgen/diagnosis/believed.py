"""The believed model and the records, as the fits of a diagnosis take them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.chain import chain
from hystgen.chain.static import StaticModel
from hystgen.diagnosis import bad_samples, held_out
from hystgen.diagnosis.structure import Actuator, Item, Part, Structure
from hystgen.effects.base import Candidate, Effect, Run
from hystgen.front.dead_zone.model import DeadZone
from hystgen.front.stage import Stage
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.identification import faults, pi, prepared, thresholds
from hystgen.identification.fronts import DeadZones, Front, Kept, Tanh
from hystgen.identification.pi import IdentificationError
from hystgen.identification.reduction import Course
from hystgen.records import Record

Array = NDArray[np.float64]

WIDE = float(np.log(3.0))
"""Numbers of believed effects are sought up to three times as large and as small."""

SINGLY = 4
"""Numbers of a longer list change by a factor that they have in common."""

TOUCHING = 1e-6
"""By so much a front may fall short of what is asked of its shape: ten digits of a file are rounded."""

PLAYS = 32
"""With half as many, what the steps between thresholds leave is up to 1.4 times the noise in effect-free records, and
takes part in every comparison of effects; more leave no less."""


def front_of(stages: Sequence[Stage], drive: tuple[float, float]) -> tuple[Front, Array]:
    """The believed front as a family around it, and the shape that it has in that family."""
    if not stages:
        return Kept(), np.empty(0)
    if len(stages) == 1 and isinstance(stages[0], DeadZone):
        kept = stages[0].over(*drive)
        if kept.breaks:
            family = DeadZones(drive, kept.breaks)
            return family, family.shape(np.array(kept.slopes))
    if len(stages) == 1 and isinstance(stages[0], TanhEnvelope):
        half, middle = 0.5 * (drive[1] - drive[0]), 0.5 * (drive[0] + drive[1])
        shape = []
        for up in (True, False) if stages[0].branches_differ else (True,):
            _, a1, a2, _ = stages[0].branch(up)
            shape += [abs(a1) * half, (-a2 / a1 - middle) / half]
        tanh = Tanh(drive)
        if stages[0].branches_differ:
            (low, high), (down_low, down_high) = (stages[0].image(*drive, up) for up in (True, False))
            lift = float(stages[0].forward(middle, False) - stages[0].forward(middle, True))
            scale = high - low
            if scale > 0.0 and down_high > down_low:
                tanh = Tanh(drive, 2)
                shape += [math.log((down_high - down_low) / scale), max(lift / scale, 0.0)]
        found = np.array(shape)
        if len(found) == len(tanh.straight) and _inside(tanh, found):
            return tanh, found
    return Kept(tuple(stages)), np.empty(0)


def _inside(front: Front, shape: Array) -> bool:
    """Whether a search may begin at a shape: another one near it would not be the front that is believed."""
    low, high = front.bounds
    slack = front.slack(np.clip(shape, low, high))
    return bool(np.all((low <= shape) & (shape <= high)) and np.all(slack >= -TOUCHING))


@dataclass(frozen=True)
class Prepared:
    """Records to fit and held-out ones, what was done to them, and the drive range of the former.

    `repaired`: isolated samples that were left out or bridged, as `diagnosis.json` lists them.
    """

    to_fit: list[Item]
    held: list[Item]
    notes: list[str]
    repaired: list[dict[str, Any]]
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
    if not holdout and not held_out.enough(fit_courses, held_out.SET_ASIDE):
        raise IdentificationError(held_out.too_little(fit_courses, f"fit and {held_out.JUDGE}", held_out.SET_ASIDE))
    repaired = fit_rails + held_rails
    prepared.mask_outliers(fit_courses, held_courses, None, 0.0)
    for course, record in zip((*fit_courses, *held_courses), (*records, *holdout), strict=True):
        for channel, wrong, what in (
            ("v", np.flatnonzero(course.v != record.v), faults.BRIDGED),
            ("y", _outliers(course), faults.NOT_COMPARED),
        ):
            if len(wrong):
                notes.append(faults.told(course.name, wrong, what))
                place = {"record": course.name, "channel": channel, "first": float(record.t[wrong[0]])}
                repaired.append({"kind": "isolated_samples", **place, "count": len(wrong)})
    to_fit = [_item(c, r, rest) for c, r in zip(fit_courses, records, strict=True)]
    held = [_item(c, r, rest) for c, r in zip(held_courses, holdout, strict=True)]
    to_fit, held = _in_session(to_fit, held)
    if not held:
        to_fit, held = held_out.parted(to_fit)
        share = f"{100 * held_out.SET_ASIDE:g} %"
        notes.append(f"no record was given that can judge: the last {share} of each is set aside")
    if not any(float(np.ptp(item.y[item.known])) > 0.0 for item in to_fit if item.known.any()):
        names = ", ".join(item.name for item in to_fit)
        raise IdentificationError(f"{names}: the measured output is constant where it is compared; check the sensor")
    reach = thresholds.largest(fit_courses)
    samples = sum(course.used for course in fit_courses)
    drive = (min(c.drive_range[0] for c in fit_courses), max(c.drive_range[1] for c in fit_courses))
    places = np.array(thresholds.dense(reach, samples, PLAYS).thresholds)
    notes.extend(held_out.hardly_compared([*to_fit, *held]))
    return _without_faults(Prepared(to_fit, held, notes, repaired, drive, places))


def _courses(
    records: Sequence[Record], history: tuple[float, ...] | None
) -> tuple[list[Course], list[dict[str, Any]]]:
    """The records as they take part, and what was left out at a converter's end."""
    courses, told = [], []
    for record in records:
        course, ends = prepared.without_rails(pi.course(record, history, 0))
        courses.append(course)
        for name, level, number in ends:
            told.append({"kind": "saturated", "record": course.name, "end": name, "level": level, "count": number})
    return courses, told


def _without_faults(ready: Prepared) -> Prepared:
    """The records without samples that are plainly wrong, unless hardly any would be left."""
    repaired = bad_samples.not_at_the_end(ready.repaired, [*ready.to_fit, *ready.held])
    number = len(ready.to_fit)
    items, wrong = bad_samples.without_faults([*ready.to_fit, *ready.held], repaired)
    to_fit, held = items[:number], items[number:]
    if any(max(np.count_nonzero(item.known) for item in group) <= held_out.ENOUGH for group in (to_fit, held)):
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
    """The items with the session around them, where their times tell that they are of one."""
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


def structure_of(cascade: StaticModel, given: Sequence[Effect], found: Prepared) -> tuple[Structure, Array]:
    """The believed model with its weights, thresholds, front and effects' numbers free, and where a search starts."""
    front, shape = front_of(cascade.stages, found.drive)
    places = found.thresholds if cascade.stages else _through(found.thresholds, cascade.pi.thresholds)
    parts = tuple(Part(effect.name, _near(effect)) for effect in given)
    return Structure(places, front, parts), np.concatenate([shape, *(part.candidate.start for part in parts)])


def believed_weights(cascade: StaticModel, structure: Structure) -> Array | None:
    """The believed weights at the structure's thresholds next to their own; None behind a front, which has a scale."""
    if cascade.stages:
        return None
    p, places = np.zeros(len(structure.thresholds)), structure.thresholds
    for r, weight in zip(cascade.pi.thresholds, cascade.pi.weights, strict=True):
        p[int(np.argmin(np.abs(places - r)))] += weight
    return p


def _near(effect: Effect) -> Candidate:
    """The effect with its numbers free, by factors: what is 0 stays that, and signs are kept."""
    sizes = {key: _size(value) for key, value in effect if key not in effect.settled}
    free = {key: size for key, size in sizes.items() if size}
    number = sum(free.values())

    def build(x: Array) -> Effect:
        if not np.any(x):
            return effect
        at, changed = 0, {}
        for key, size in free.items():
            changed[key] = _times(getattr(effect, key), np.exp(x[at : at + size]).tolist(), effect, key)
            at += size
        return effect.model_copy(update=changed)

    zeros = np.zeros(number)
    return Candidate("as it is, or nearly", zeros - WIDE, zeros + WIDE, zeros, build)


def _size(value: object) -> int:
    """How many factors the numbers of a key have."""
    if isinstance(value, float):
        return int(value != 0.0)
    if not isinstance(value, tuple) or not any(map(_size, value)):
        return 0
    return len(value) if len(value) <= SINGLY and all(isinstance(each, float) for each in value) else 1


def _times(value: Any, factors: Sequence[float], effect: Effect, key: str) -> Any:
    """The numbers times their factors, kept within what the key may be."""
    if isinstance(value, tuple):
        each = factors if len(factors) == len(value) else list(factors) * len(value)
        return tuple(_times(one, [factor], effect, key) for one, factor in zip(value, each, strict=True))
    changed = value * factors[0]
    for limit in type(effect).model_fields[key].metadata:
        changed = max(changed, getattr(limit, "ge", changed))
        changed = min(changed, getattr(limit, "le", changed))
        if getattr(limit, "gt", -math.inf) >= changed:
            changed = float(np.nextafter(limit.gt, math.inf))
    return changed


def _through(places: Array, believed: Sequence[float]) -> Array:
    """The places, those next to a believed threshold moved there: where the belief is right, it is met exactly."""
    moved = places.copy()
    for r in believed:
        near = int(np.argmin(np.abs(places - r)))
        if near and r < places[-1]:
            moved[near] = r
    return np.asarray(np.unique(moved))


def as_given(cascade: StaticModel, given: Sequence[Effect]) -> tuple[Actuator, Array]:
    """The believed model unchanged, and its weights."""
    return Actuator(np.array(cascade.pi.thresholds), cascade.stages, tuple(given)), np.array(cascade.pi.weights)
