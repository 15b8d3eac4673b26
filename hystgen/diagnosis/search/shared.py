"""What a column shares with time, mains and drive: only the rest of it can show that an error follows the column."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data import disturbances
from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.search import acceptance
from hystgen.diagnosis.search.fits import Fitted
from hystgen.effects.base import follow

Array = NDArray[np.float64]


def column_of(fitted: Fitted) -> str:
    """The column that the last effect of a hypothesis follows, if any column could take its place; else "".

    An effect that exists for one column, such as a temperature, has that column for a physical reason.
    """
    last = fitted.structure.effects(fitted.shape)[-1:]
    return next((name for effect in last for name in effect.read if name not in effect.columns), "")


def apart(items: Sequence[Item], column: str, errors: Sequence[Sequence[Array]]) -> list[list[Array]]:
    """Several sets of errors, each without the part that time, mains lines of the column, or the drive can explain.

    Time: a polynomial for each record, since a drift has no form of its own. Drive: its value, square, rate, and
    averages over the times of a lag.
    """
    columns = [np.where(np.isfinite(item.y), item.run.extra[column], np.nan) for item in items]
    lines = disturbances.mains(items, [each - np.nanmean(each) for each in columns])
    bases = [_shared(item, lines) for item in items]
    return [
        [_without(error, basis) for error, basis in zip(each, bases, strict=True)]
        for each in errors
    ]


def _shared(item: Item, lines: Sequence[float]) -> Array:
    """Signals (k, N) that any column can share with the output."""
    t, v = item.run.t, item.run.v
    time = 2.0 * (t - t[0]) / max(float(t[-1] - t[0]), 1e-300) - 1.0
    rows = list(np.polynomial.legendre.legvander(time, acceptance.SHARED_DEGREE).T)
    place = v - float(v.mean())
    place = place / max(float(np.max(np.abs(place))), 1e-300)
    rate = np.gradient(place, t)
    rows += [place, place**2, rate, np.sign(rate)]
    for share in acceptance.SHARED_LAGS:
        late = np.empty(len(t))
        decay, early, now = item.run.factors(share * float(t[-1] - t[0]))
        follow(place, decay, early, now, float(place[0]), late)
        rows.append(late)
    for frequency in lines:
        phase = 2.0 * np.pi * frequency * (t - t[0])
        rows += [np.cos(phase), np.sin(phase)]
    return np.array(rows)


def _without(error: Array, basis: Array) -> Array:
    known = np.isfinite(error)
    left = error.copy()
    if np.count_nonzero(known) > 2 * len(basis):
        rows = basis[:, known]
        left[known] -= np.linalg.lstsq(rows.T, error[known], rcond=1e-9)[0] @ rows
    return left
