"""The nominal model: the parameter file's model as a structure whose numbers a fit may change."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.cascade import Cascade
from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.data.preparing import Prepared
from hystgen.diagnosis.search import acceptance
from hystgen.diagnosis.search.actuator import Actuator
from hystgen.diagnosis.search.structure import Part, Structure
from hystgen.effects.base import Candidate, Effect, Run
from hystgen.front.dead_zone.model import DeadZone
from hystgen.front.stage import Stage
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.identification.fronts import DeadZones, Front, Kept, Tanh
from hystgen.records import Record

Array = NDArray[np.float64]


def front_of(stages: Sequence[Stage], drive: tuple[float, float]) -> tuple[Front, Array]:
    """The nominal front as a member of a family, and its shape in that family."""
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
    """Whether a search may begin at a shape: a neighbour of it would not be the nominal front."""
    low, high = front.bounds
    slack = front.slack(np.clip(shape, low, high))
    return bool(np.all((low <= shape) & (shape <= high)) and np.all(slack >= -acceptance.TOUCHING))


def structure_of(cascade: Cascade, given: Sequence[Effect], found: Prepared) -> tuple[Structure, Array]:
    """The nominal model with free weights, front and numbers of its effects, and the start of a search."""
    front, shape = front_of(cascade.stages, found.drive)
    places = found.thresholds if cascade.stages else _through(found.thresholds, cascade.pi.thresholds)
    parts = tuple(Part(effect.name, _near(effect)) for effect in given)
    return Structure(places, front, parts), np.concatenate([shape, *(part.candidate.start for part in parts)])


def nominal_weights(cascade: Cascade, structure: Structure) -> Array | None:
    """The nominal weights at the structure's nearest thresholds; None behind a front, which has a scale of its own."""
    if cascade.stages:
        return None
    p, places = np.zeros(len(structure.thresholds)), structure.thresholds
    for r, weight in zip(cascade.pi.thresholds, cascade.pi.weights, strict=True):
        p[int(np.argmin(np.abs(places - r)))] += weight
    return p


def _near(effect: Effect) -> Candidate:
    """The effect with free factors on its numbers: zeros and signs stay."""
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

    zeros, wide = np.zeros(number), math.log(acceptance.NOMINAL_RANGE)
    return Candidate("as it is, or nearly", zeros - wide, zeros + wide, zeros, build)


def _size(value: object) -> int:
    """Number of factors of a key."""
    if isinstance(value, float):
        return int(value != 0.0)
    if not isinstance(value, tuple) or not any(map(_size, value)):
        return 0
    singly = len(value) <= acceptance.SINGLE_FACTORS and all(isinstance(each, float) for each in value)
    return len(value) if singly else 1


def _times(value: Any, factors: Sequence[float], effect: Effect, key: str) -> Any:
    """The numbers times their factors, within the limits of the key."""
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


def _through(places: Array, nominal: Sequence[float]) -> Array:
    """The places, those next to a nominal threshold moved there, so that a right nominal model is met exactly."""
    moved = places.copy()
    for r in nominal:
        near = int(np.argmin(np.abs(places - r)))
        if near and r < places[-1]:
            moved[near] = r
    return np.asarray(np.unique(moved))


def as_given(cascade: Cascade, given: Sequence[Effect]) -> tuple[Actuator, Array]:
    """The nominal model unchanged, and its weights."""
    return Actuator(np.array(cascade.pi.thresholds), cascade.stages, tuple(given)), np.array(cascade.pi.weights)


def predicted(record: Record, actuator: Actuator, weights: Array, history: tuple[float, ...] | None) -> Array:
    """(N,) what an actuator with these weights predicts of a record, up to an offset, output units."""
    assert record.y is not None
    run = Run(np.ascontiguousarray(record.t, dtype=np.float64), np.ascontiguousarray(record.v, dtype=np.float64),
              dict(record.extra))  # fmt: skip
    rows, constant = actuator.columns(Item(record.name, run, np.asarray(record.y), history, 1.0), weights)
    return np.asarray(rows[0] + constant)
