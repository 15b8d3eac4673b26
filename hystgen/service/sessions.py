"""Sessions of a unit in service: in order of time, each compared with the model and described in a few numbers."""

from __future__ import annotations

import itertools
import math
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import RecordError
from hystgen.diagnosis.data import preparing
from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.search.fits import Fitted
from hystgen.diagnosis.search.hypothesis import NotFiniteError
from hystgen.identification import faults
from hystgen.identification.pi import IdentificationError
from hystgen.identification.quality import correlation_time
from hystgen.plays import operators
from hystgen.records import Record, Source

Array = NDArray[np.float64]

REFERENCE = "u"
"""The column with the reference, in output units."""

TIME_STAMP = "recorded_at"
"""The column with the time of a session, in s since any fixed moment; its first value counts."""

DATE = re.compile(r"(?<!\d)(\d{4})-?(\d{2})-?(\d{2})(?:[T_ -]?(\d{2})[-:.h]?(\d{2})(?:[-:.m]?(\d{2}))?)?(?!\d)")
"""A date in a file's name, with or without a time of day."""

DIRECTIONS = {
    "gain": "the size of the motion",
    "loop": "the width of the loop",
    "curve": "the curvature of the motion over the drive",
    "rate": "a lag behind the drive",
    "slow": "a slow response after moves",
    "shape": "the shape of the motion",
}
"""Ways in which a unit can move away from its model: each a signal made from the model's expectation, and `shape`, the
part of the residual along these and further signals made from expectation and drive together, without a sign."""

SHAPE = "shape"

PLAYS = (0.05, 0.1, 0.2, 0.35)
"""[fractions of the drive range] Thresholds of plays among the signals of `shape`: from a loop that hardly shows to the
widest one that a session closes."""

DRIFT_PASSES = 4
"""[passes] Drift is slower than the motion: cosines of up to one half period in this many passes over half the range
are taken out of the residual."""

MOST_COSINES = 12
"""Number of these cosines at most, which bounds the time for long sessions."""

FEWEST_SAMPLES = 100
"""Fewest compared samples of a session: about four for each signal and cosine that its residual is split into, so that
what is left of it shows the noise and its correlation."""

COLLINEAR = 1e-3
"""[fraction of its size] A direction of which drift and offset leave less than this is not seen in a session."""


@dataclass(frozen=True)
class Seen:
    """A direction in a session, in output units: its rms `size` per unit of change, the `part` of the residual along
    it, and the standard deviation `sure` of that part, from the correlated rest of the residual."""

    size: float
    part: float
    sure: float


@dataclass(frozen=True)
class ServiceSession:
    """A session: N samples. `error`: measured minus expected, its offset removed, NaN where not compared;
    `tracking`: rms of measured minus reference, its offset removed, None without a reference."""

    name: str
    record: Record = field(repr=False, compare=False)
    item: Item = field(repr=False, compare=False)
    error: Array = field(repr=False, compare=False)

    @property
    def expected(self) -> Array:
        """The model's expectation (N,), NaN where not compared."""
        return np.asarray(self.item.y - self.error)

    @cached_property
    def known(self) -> NDArray[np.intp]:
        """Indices of the compared samples."""
        return np.flatnonzero(np.isfinite(self.error))

    @cached_property
    def passes(self) -> int:
        """Number of times that the drive crosses the middle half of its range."""
        v = self.item.run.v[self.known]
        middle, quarter = 0.5 * (v.max() + v.min()), 0.25 * float(np.ptp(v))
        sides = np.sign(v - middle)[np.abs(v - middle) > quarter]
        return int(np.count_nonzero(np.diff(sides)))

    @cached_property
    def _drift(self) -> Array:
        """(N, k) orthonormal offset and slow cosines at the compared samples."""
        count = min(max(1, self.passes // DRIFT_PASSES), MOST_COSINES)
        t = self.item.run.t[self.known]
        share = (t - t[0]) / max(float(np.ptp(t)), 1e-300)
        return np.asarray(np.linalg.qr(np.cos(np.pi * np.outer(share, np.arange(count + 1))))[0])

    def _steady(self, x: Array) -> Array:
        """Samples without offset and drift."""
        return np.asarray(x - self._drift @ (self._drift.T @ x))

    @cached_property
    def residual(self) -> Array:
        """The error at the compared samples, without offset and drift."""
        return self._steady(self.error[self.known])

    @property
    def rms(self) -> float:
        """rms of the residual, output units."""
        return _rms(self.residual)

    @cached_property
    def tracking(self) -> float | None:
        """rms of measured minus reference about its mean, output units; None without a reference."""
        if REFERENCE not in self.record.extra:
            return None
        error = (self.item.y - self.record.extra[REFERENCE])[self.known]
        return _rms(error - np.mean(error)) if np.isfinite(error).all() else None

    @cached_property
    def _along(self) -> dict[str, Array]:
        """The directions that this session shows, at the compared samples, without offset and drift."""
        y, v, t = self.expected[self.known], self.item.run.v[self.known], self.item.run.t[self.known]
        half = max(0.5 * float(np.ptp(y)), 1e-300)
        line = np.vander(v / max(float(np.ptp(v)), 1e-300), 3)
        found = {
            "gain": y,
            "loop": y - line @ np.linalg.lstsq(line, y, rcond=None)[0],
            "curve": (y - 0.5 * (float(y.max()) + float(y.min()))) ** 2 / half,
        }
        if self.item.timed:
            found |= {"rate": -np.gradient(y, t), "slow": np.mean(_slow_parts(y, t), axis=0)}
        steady = {name: self._steady(x) for name, x in found.items()}
        return {name: x for name, x in steady.items() if _rms(x) > COLLINEAR * _rms(found[name] - np.mean(found[name]))}

    @cached_property
    def _signals(self) -> Array:
        """(N, k) All signals that the residual may follow, without offset and drift, each of rms 1."""
        y, v, t = self.expected[self.known], self.item.run.v[self.known], self.item.run.t[self.known]
        span = float(np.ptp(v))
        more = [operators.play(v, part * span, float(v[0])) for part in PLAYS]
        more += [(v - v.min()) ** 2 / span, (v - v.min()) ** 3 / span**2, np.asarray(v)]
        if self.item.timed:
            more += list(_slow_parts(y, t))
        signals = [*self._along.values(), *(self._steady(x) for x in more)]
        return np.column_stack([x / _rms(x) for x in signals if _rms(x) > 0.0])

    @cached_property
    def structured(self) -> float:
        """rms of the part of the residual along all signals together, less that of noise alone, output units."""
        part, number, spread = self.explained
        return math.sqrt(max(part**2 - number * spread**2, 0.0))

    @cached_property
    def explained(self) -> tuple[float, int, float]:
        """rms of the part of the residual along all signals, the number of these that are not combinations of others,
        and the standard deviation of noise along one of them."""
        table = self._signals
        solution, _, number, _ = np.linalg.lstsq(table, self.residual, rcond=COLLINEAR)
        rest = self.residual - table @ solution
        free = max(len(rest) - int(number) - self._drift.shape[1], 1)
        spread = math.sqrt(float(rest @ rest) * correlation_time(rest) / (free * len(rest)))
        return _rms(table @ solution), int(number), spread

    @cached_property
    def seen(self) -> dict[str, Seen]:
        """Every direction that this session shows; of `shape` the part is a logarithm."""
        explained, number, spread = self.explained
        found = {
            name: Seen(_rms(x), float(self.residual @ x) / (len(x) * _rms(x)), spread)
            for name, x in self._along.items()
        }
        if found:  # the logarithm of the root of a chi-square number
            found[SHAPE] = Seen(1.0, math.log(max(explained, 1e-300)), 1.0 / math.sqrt(2.0 * number))
        return found

    @property
    def gain(self) -> float | None:
        """Relative distance of the motion's size from the model's; None if the session does not show it."""
        seen = self.seen.get("gain")
        return None if seen is None else seen.part / seen.size

    @cached_property
    def use(self) -> Array:
        """(3,) How the drive moved: lowest and highest value, and logarithm of the rms speed."""
        v, t = self.item.run.v[self.known], self.item.run.t[self.known]
        speed = _rms(np.diff(v)) / float(np.median(np.diff(t))) if self.item.timed else 1.0
        return np.array([v.min(), v.max(), math.log(max(speed, 1e-300))])


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2))) if len(x) else 0.0


def _slow_parts(y: Array, t: Array) -> Array:
    """(k, N) What slow exponentials add to a signal, one a decade of time constants from ten samples to the record."""
    from scipy.signal import lfilter

    step, span = float(np.median(np.diff(t))), float(np.ptp(t))
    number = max(2, 1 + round(math.log10(max(0.1 * span / step, 10.0))))
    shares = -np.expm1(-step / np.geomspace(10.0 * step, max(span, 20.0 * step), number))
    return np.array([lfilter([share], [1.0, share - 1.0], y - y[0]) - (y - y[0]) for share in shares])


def in_order(records: Sequence[Record], sources: Sequence[Source]) -> tuple[list[Record], str]:
    """The records in the order of their time, and where that order comes from.

    A column `recorded_at`, else dates in the names of the files, else the records' own times if they do not overlap,
    else the order in which they were given.
    """
    if all(TIME_STAMP in record.extra for record in records):
        return sorted(records, key=lambda each: float(each.extra[TIME_STAMP][0])), f"column {TIME_STAMP}"
    names = [os.path.basename(os.fspath(s)) if isinstance(s, str | os.PathLike) else "" for s in sources]
    dated = [DATE.search(name) for name in names]
    if all(dated):
        keys = ["".join(part or "00" for part in found.groups()) for found in dated if found]
        return [records[k] for k in sorted(range(len(keys)), key=keys.__getitem__)], "dates in the file names"
    by_time = sorted(records, key=lambda each: float(each.t[0]))
    apart = all(float(a.t[-1]) < float(b.t[0]) for a, b in itertools.pairwise(by_time))
    if len(records) > 1 and apart and all(record.timed for record in records):
        return by_time, "times of the records"
    return list(records), "order in which they were given"


def compared(
    records: Sequence[Record], fitted: Fitted, history: tuple[float, ...] | None, rest: float, skip: float
) -> tuple[list[ServiceSession], list[str]]:
    """The sessions that can be compared with a model, and notes on the others. Raises RecordError if there is none.

    Every session stands alone: its offset, and without a history its start memory, are its own.
    """
    found, notes = [], []
    for record in records:
        try:
            actuator = fitted.actuator
            item = preparing.to_watch(
                record, actuator.stages, actuator.thresholds, fitted.weights, history, rest, skip
            )
            (error,) = fitted.errors([item])
            wrong = faults.outliers(np.where(np.isfinite(error), error, 0.0), item.run.v, item.output_range)
            if wrong.any():
                notes.append(faults.sentence(record.name, np.flatnonzero(wrong), faults.NOT_COMPARED))
                item = replace(item, y=np.where(wrong, np.nan, item.y))
                (error,) = fitted.errors([item])
        except IdentificationError as refused:
            notes.append(f"{record.name} is left out: {refused}")
            continue
        except NotFiniteError:
            notes.append(f"{record.name} is left out: an effect of the model gives no finite output")
            continue
        session = ServiceSession(record.name, record, item, error)
        if len(session.known) < FEWEST_SAMPLES:
            notes.append(
                f"{record.name} is left out: only {len(session.known)} samples can be compared, since its start memory "
                f"is unknown, and at least {FEWEST_SAMPLES} are needed; give --history"
            )
        elif session.seen:
            found.append(session)
        else:
            notes.append(f"{record.name} is left out: its drive hardly moves")
    if not found:
        raise RecordError([f"{note}; record a session with moves over a few loops" for note in notes])
    return found, notes
