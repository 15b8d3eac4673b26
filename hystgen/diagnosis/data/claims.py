"""Whether records are what they claim: their units, their columns, their displacement, and the history before them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data.items import Item, Model, rms
from hystgen.diagnosis.findings.kinds import ExchangedRecords, Finding, OtherHistory, Scale, SwappedChannels
from hystgen.diagnosis.search import acceptance
from hystgen.identification import faults
from hystgen.identification.quality import STARTS, UNLIKE
from hystgen.identification.reduction import settled
from hystgen.records import Record, no_value

Array = NDArray[np.float64]

Predict = Callable[[Record], Array]
"""What the nominal model predicts of a record, (N,) in output units up to an offset."""


@dataclass(frozen=True)
class Against:
    """A record's output as `factor * prediction + offset`, with the correlation of the two.

    `sense`: area of the measured loop over that of the predicted one, negative where the output is ahead of the drive,
    0 where it is not significant.
    """

    factor: float
    correlation: float
    sense: float


def checked(records: Sequence[Record], predict: Predict) -> tuple[list[Record | None], list[Finding]]:
    """The records that can be used, None in place of the others, and the findings, one a record.

    Exchanged columns are put right; a record in other units than the others, or with another's output, is left out.
    Wrong samples take no part in the judgement.
    """
    kept: list[Record | None] = []
    seen: list[Record] = []
    findings: list[Finding] = []
    found: dict[int, Against] = {}
    predicted: dict[int, Array] = {}
    for k, record in enumerate(records):
        plain = right = faults.smooth(record) if _whole(record) else record
        if _moves(plain):
            right, predicted[k], found[k] = _right_way_round(plain, predict)
        swapped = right is not plain
        if swapped:
            findings.append(SwappedChannels(record.name))
        kept.append(replace(record, v=np.asarray(record.y), y=record.v) if swapped else record)
        seen.append(right)
    records, judged = seen, list(found)
    widths = np.array([float(np.ptp(record.v)) for record in records])
    moving = widths[widths > 0.0]
    widest = float(np.max(moving[moving <= acceptance.OTHER_UNIT * np.median(moving)], initial=0.0))
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
    """Whether nearly all samples have values of drive and output; other faults are reported later."""
    v, y = record.v, record.y
    if y is None or len(y) != len(v) or not (np.isfinite(y).all() and np.isfinite(v).all()):
        return False
    return all(np.count_nonzero(no_value(x)) <= faults.most(len(x)) for x in (v, y))


def _moves(record: Record) -> bool:
    """Whether drive and output of a whole record move."""
    return _whole(record) and bool(np.ptp(np.asarray(record.y)) > 0.0 and np.ptp(record.v) > 0.0)


def _against(record: Record, predicted: Array) -> Against:
    assert record.y is not None
    y, v = np.asarray(record.y, dtype=np.float64), np.asarray(record.v, dtype=np.float64)
    factor, correlation, scatter = _line(predicted, y)
    own, model = _area(v, y), _area(v, predicted)
    # white noise of the output gives the area this standard deviation
    around = scatter * float(np.sqrt(np.sum((v[2:] - v[:-2]) ** 2))) / 2.0
    expected = abs(factor) * model
    significant = abs(own) > acceptance.LOOP_SIGMAS * around and expected > 0.0
    return Against(factor, correlation, own / expected if significant else 0.0)


def _line(x: Array, y: Array) -> tuple[float, float, float]:
    """Slope, correlation and scatter of y over x, without the few samples that lie far off."""
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
    """Area that (v, y) encloses counterclockwise, the sense of an output that is late."""
    return 0.5 * float(np.sum(v[:-1] * y[1:] - v[1:] * y[:-1]) + v[-1] * y[0] - v[0] * y[-1])


def _right_way_round(record: Record, predict: Predict) -> tuple[Record, Array, Against]:
    """A record, with its columns exchanged if they were, its prediction, and how the two compare."""
    predicted = predict(record)
    found = _against(record, predicted)
    if found.sense <= 0.0:
        assert record.y is not None
        swapped = replace(record, v=record.y, y=record.v)
        otherwise = predict(swapped)
        seen = _against(swapped, otherwise)
        if _better(seen, found):
            return swapped, otherwise, seen
    return record, predicted, found


def _better(swapped: Against, found: Against) -> bool:
    """Whether a record's columns are exchanged: with the output as drive, the model predicts the drive.

    Its loop then runs the right way, as wide as expected; where no loop is visible, the sensitivity decides.
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
    """The record whose prediction the output of record k follows, where it does not follow its own."""
    if abs(found[k].correlation) > acceptance.OWN_CORRELATION:
        return None
    y = np.asarray(records[k].y)
    others = [(j, _line(x, y)[1]) for j, x in predicted.items() if j != k and len(x) == len(y)]
    best = max(others, key=lambda each: each[1], default=(k, 0.0))
    return best[0] if best[1] > acceptance.FOREIGN_CORRELATION else None


# Whether the records begin in the memory to which the given history leads ------------------------------------


def contradicted(items: Sequence[Item], fitted: Model) -> OtherHistory | None:
    """The finding where the starts, which depend on the history, are off by far more than the rest, else None.

    `items`: fitted records; held-out ones decide nothing about a fit, and may go where it is a guess. Of a session only
    the first record begins behind the history.
    """
    return _off(*_parts(items, fitted, False))


def bends(items: Sequence[Item], fitted: Model, free: Model) -> OtherHistory | None:
    """The same where a model fitted with the history can follow it, at the cost of the rest.

    `free`: the model fitted to what does not depend on the history, which predicts what the starts should have been.
    Starts that are off alone, and cost the rest nothing, may be an effect that fades.
    """
    starts, rest = _parts(items, free, True)
    _, bent = _parts(items, fitted, True)
    return _off(starts, rest) if rms(bent) > acceptance.HISTORY_COSTS * rms(rest) else None


def _parts(items: Sequence[Item], fitted: Model, own: bool) -> tuple[list[Array], list[Array]]:
    """Errors that depend on the history, and errors that do not; `own`: with the offset of the latter."""
    first, later = [], []
    for item, e in zip(items, fitted.errors(items), strict=True):
        if item.history is None or (item.session is not None and item.part.start):
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
