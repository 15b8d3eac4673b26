"""Whole records that are not what they say: in other units, with drive and displacement exchanged, or with the
displacement of another record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.structure import Actuator, Item
from hystgen.effects.base import Run
from hystgen.identification import faults
from hystgen.records import Record, no_value

Array = NDArray[np.float64]

ALL = 3.0
"""The output of all records is so many times, or one so-many-th of, what the believed model predicts: other units."""

ONE = 1.7
"""The same of one record against the others: an actuator's own sensitivity changes less with amplitude and rate."""

MOVES = 0.3
"""Only records whose drive moves over this share of the widest one's range tell of their scale."""

OTHER_UNIT = 30.0
"""A drive that many times as wide as half of the others is in another unit, and no measure for them."""

DEAD = 0.1
"""An output that does not go with the drive and moves by less than this share of what is expected is no measurement."""

GOES_WITH = 0.9
"""Least correlation of output and prediction for a scale to be told from them."""

FOREIGN, OWN = 0.95, 0.5
"""An output belongs to another record where it correlates so well with its prediction and no better with its own."""

RIGHT_WAY = 0.3
"""An output follows its drive where its loop runs the right way, with this share of the area that is expected."""

SURE = 5.0
"""The area of a loop counts where it is so many times what the scatter of the output makes of it."""


@dataclass(frozen=True)
class Against:
    """A record's output `factor * prediction + offset`, with the correlation of the two.

    `sense`: area of the measured loop over that of the predicted one, negative where the output is ahead of the drive,
    0 where it is not significant.
    """

    factor: float
    correlation: float
    sense: float


def checked(
    records: Sequence[Record], actuator: Actuator, weights: Array, history: tuple[float, ...] | None
) -> tuple[list[Record | None], list[dict[str, Any]]]:
    """The records as they can be used, None for one that cannot, and what was found, one entry a record.

    Exchanged columns are put right; a record in other units than the others, or with another's output, is left out.
    Wrong samples take no part in the judgement.
    """
    kept: list[Record | None] = []
    seen: list[Record] = []
    told: list[dict[str, Any]] = []
    found: dict[int, Against] = {}
    predicted: dict[int, Array] = {}
    for k, record in enumerate(records):
        plain = right = faults.smooth(record) if _whole(record) else record
        if _tells(plain):
            right, predicted[k], found[k] = _right_way_round(plain, actuator, weights, history)
        swapped = right is not plain
        if swapped:
            told.append({"kind": "swapped_channels", "record": record.name, "repaired": True})
        kept.append(replace(record, v=np.asarray(record.y), y=record.v) if swapped else record)
        seen.append(right)
    records, tells = seen, list(found)
    widths = np.array([float(np.ptp(record.v)) for record in records])
    moving = widths[widths > 0.0]
    widest = float(np.max(moving[moving <= OTHER_UNIT * np.median(moving)], initial=0.0))
    wide = [k for k in tells if np.ptp(records[k].v) > MOVES * widest]
    for k in wide:
        other = _other(k, records, predicted, found, tells)
        if other is not None:
            kept[k] = None
            told.append({"kind": "exchanged_records", "record": records[k].name, "with": records[other].name})
    sure = [k for k in wide if kept[k] is not None and abs(found[k].correlation) > GOES_WITH]
    usual = float(np.median([found[k].factor for k in sure])) if sure else 1.0
    if not 1.0 / ALL < usual < ALL:
        told.append({"kind": "scale", "record": "all", "factor": usual})
    little = [k for k in tells if k not in wide and found[k].correlation > GOES_WITH]
    for k in (*sure, *little):
        factor = found[k].factor / usual
        if not (1.0 / ONE if k in sure else 0.0) < factor < (ONE if k in sure else OTHER_UNIT):
            kept[k] = None
            told.append({"kind": "scale", "record": records[k].name, "factor": factor})
    for k in (k for k in wide if sure and k not in sure and kept[k] is not None):
        size = _spread(records[k].y) / max(usual * _spread(predicted[k]), 1e-300)
        if size < DEAD:
            kept[k] = None
            told.append({"kind": "scale", "record": records[k].name, "factor": size})
    return kept, told


def _spread(x: Any) -> float:
    return float(np.subtract(*np.quantile(x, (0.75, 0.25))))


def _whole(record: Record) -> bool:
    """Whether a record has values of drive and output for nearly all samples; what is wrong otherwise is told later."""
    v, y = record.v, record.y
    if y is None or len(y) != len(v) or not (np.isfinite(y).all() and np.isfinite(v).all()):
        return False
    return all(np.count_nonzero(no_value(x)) <= faults.most(len(x)) for x in (v, y))


def _tells(record: Record) -> bool:
    """Whether a record has an output that moves as well."""
    return _whole(record) and bool(np.ptp(np.asarray(record.y)) > 0.0 and np.ptp(record.v) > 0.0)


def _predicted(record: Record, actuator: Actuator, weights: Array, history: tuple[float, ...] | None) -> Array:
    assert record.y is not None
    run = Run(np.ascontiguousarray(record.t, dtype=np.float64), np.ascontiguousarray(record.v, dtype=np.float64),
              dict(record.extra))  # fmt: skip
    rows, constant = actuator.columns(Item(record.name, run, np.asarray(record.y), history, 1.0), weights)
    return np.asarray(rows[0] + constant)


def _against(record: Record, predicted: Array) -> Against:
    assert record.y is not None
    y, v = np.asarray(record.y, dtype=np.float64), np.asarray(record.v, dtype=np.float64)
    factor, correlation, scatter = _line(predicted, y)
    own, model = _area(v, y), _area(v, predicted)
    # noise of the output, white, makes an area of this standard deviation
    around = scatter * float(np.sqrt(np.sum((v[2:] - v[:-2]) ** 2))) / 2.0
    expected = abs(factor) * model
    return Against(factor, correlation, own / expected if abs(own) > SURE * around and expected > 0.0 else 0.0)


def _line(x: Array, y: Array) -> tuple[float, float, float]:
    """Slope, correlation and scatter of y over x, without the few samples that lie far out."""
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
        inside = off <= max(6.0 * scatter, 1e-12)
        if np.count_nonzero(inside) < 0.8 * len(x):
            inside[:] = True
            break
    dx, dy = x[inside] - np.mean(x[inside]), y[inside] - np.mean(y[inside])
    size = float(np.sqrt((dx @ dx) * (dy @ dy)))
    return slope, float(dx @ dy) / size if size > 0.0 else 0.0, scatter


def _area(v: Array, y: Array) -> float:
    """Area that (v, y) runs around counterclockwise, the way of an output that is late."""
    return 0.5 * float(np.sum(v[:-1] * y[1:] - v[1:] * y[:-1]) + v[-1] * y[0] - v[0] * y[-1])


def _right_way_round(
    record: Record, actuator: Actuator, weights: Array, history: tuple[float, ...] | None
) -> tuple[Record, Array, Against]:
    """A record, with its columns exchanged if they were, what the model predicts of it, and how the two compare."""
    predicted = _predicted(record, actuator, weights, history)
    found = _against(record, predicted)
    if found.sense <= 0.0:
        assert record.y is not None
        swapped = replace(record, v=record.y, y=record.v)
        otherwise = _predicted(swapped, actuator, weights, history)
        seen = _against(swapped, otherwise)
        if _better(seen, found):
            return swapped, otherwise, seen
    return record, predicted, found


def _better(swapped: Against, found: Against) -> bool:
    """Whether a record's columns are exchanged: with the output as drive, the drive is what the model predicts.

    Its loop then runs the right way, as wide as expected; where none is to be seen, the sensitivity has to tell.
    """
    if swapped.correlation < GOES_WITH:
        return False
    if swapped.sense == 0.0:
        return not 1.0 / ALL < found.factor < ALL and 1.0 / ONE < swapped.factor < ONE
    better = swapped.correlation > found.correlation
    return better and swapped.sense > RIGHT_WAY and 1.0 / ALL < swapped.factor < ALL


def _other(
    k: int, records: Sequence[Record], predicted: dict[int, Array], found: dict[int, Against], tells: Sequence[int]
) -> int | None:
    """The record whose prediction the output of record k follows, where it does not follow its own."""
    if abs(found[k].correlation) > OWN:
        return None
    y = np.asarray(records[k].y)
    others = [(j, _line(predicted[j], y)[1]) for j in tells if j != k and len(predicted[j]) == len(y)]
    best = max(others, key=lambda each: each[1], default=(k, 0.0))
    return best[0] if best[1] > FOREIGN else None
