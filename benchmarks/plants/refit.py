"""A fine play sum fitted to records by non-negative least squares: how much of a signal such a sum can absorb."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import nnls

from .session import Session

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

FINE = 48
"""Number of plays in the sum that defines the unabsorbed part."""

RIDGE = 1e-9

STILL = 1e-9
"""A play that moves by less than this fraction of the largest movement gets no weight."""


@dataclass(frozen=True)
class Track:
    """Samples of all records in order, with the drive between the records: `record` is -1 there."""

    t: Array
    v: Array
    record: Ints
    held_out: NDArray[np.bool_]
    """One flag per record."""

    @property
    def seen(self) -> NDArray[np.bool_]:
        return self.record >= 0

    def of(self, held_out: bool) -> NDArray[np.bool_]:
        """Mask of the seen samples of held-out records, or of the others."""
        return self.held_out[self.record[self.seen]] == held_out


def track(session: Session) -> Track:
    t, v, record = [], [], []
    last = 0
    for k, item in enumerate(session.records):
        t += [session.t[last : item.first], session.times(item)]
        v += [session.v[last : item.first], session.sampled(session.v, item)]
        record += [np.full(item.first - last, -1), np.full(item.samples, k)]
        last = item.fine.stop
    return Track(
        np.concatenate(t), np.concatenate(v), np.concatenate(record), np.array([r.held_out for r in session.records])
    )


@njit(cache=True)
def plays(v: Array, radii: Array) -> Array:
    """Play of each half width, shape (N, n), all dragged from below at the start."""
    out = np.empty((len(v), len(radii)))
    for i in range(len(radii)):
        r = radii[i]
        s = v[0] - r
        for k in range(len(v)):
            s = max(v[k] - r, min(v[k] + r, s))
            out[k, i] = s
    return out


def radii(span: float, number: int) -> Array:
    """Half widths from 0 to half the span, denser near 0."""
    x = np.linspace(0.0, 1.0, number)
    return np.asarray(0.5 * span * (0.35 * x + 0.65 * x * x) * (1.0 - 1e-6))


def centred(columns: Array, record: Ints) -> Array:
    """Columns minus their mean over each record, whose samples are contiguous: a free offset per record."""
    starts = np.concatenate(([0], np.flatnonzero(np.diff(record)) + 1))
    counts = np.diff(np.append(starts, len(record)))
    means = np.add.reduceat(columns, starts, axis=0).T / counts
    return np.asarray(columns - np.repeat(means.T, counts, axis=0))


def fit(columns: Array, y: Array, free: int = 0) -> Array:
    """Least-squares weights, non-negative except for the last `free`; columns (N, n) and y (N,) must have zero mean."""
    rms = np.sqrt(np.mean(columns * columns, axis=0))
    scale = np.where(rms > STILL * np.max(rms), rms, np.inf)
    scaled = columns / scale
    if free:
        scaled = np.hstack((scaled, -scaled[:, -free:]))
    gram = scaled.T @ scaled
    gram[np.diag_indices_from(gram)] += RIDGE * len(y)
    factor = np.linalg.cholesky(gram)
    found, _ = nnls(factor.T, np.linalg.solve(factor, scaled.T @ y), maxiter=50 * len(gram))
    if free:
        found[len(scale) - free : len(scale)] -= found[len(scale) :]
    return np.asarray(found[: len(scale)] / scale)


@dataclass(frozen=True)
class Left:
    """Rms residual of a noise-free output: over all records and over the held-out ones after a joint refit to all, and
    over the records to fit after a refit to only these."""

    everywhere: float
    held_out: float
    to_fit: float


def unabsorbed(course: Track, output: Array, span: float) -> Left:
    """The residual of a fine play sum fitted to an output (seen samples)."""
    record = course.record[course.seen]
    columns = centred(plays(course.v, radii(span, FINE))[course.seen], record)
    y = centred(output, record)
    left = y - columns @ fit(columns, y)
    fitted = course.of(False)
    alone = y[fitted] - columns[fitted] @ fit(columns[fitted], y[fitted])
    return Left(_rms(left), _rms(left[course.of(True)]), _rms(alone))


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))
