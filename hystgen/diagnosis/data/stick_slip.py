"""Stick-slip in what a model leaves: a disturbance that is reported with place and count, and never named."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.findings.kinds import StickSlip
from hystgen.diagnosis.search import acceptance

Array = NDArray[np.float64]


def stick_slip(items: Sequence[Item], errors: Sequence[Array], noise: float) -> list[StickSlip]:
    """Stick-slip: the output stands still while it should move, then catches up in a jump."""
    found = (_stick_slip(item, error, noise) for item, error in zip(items, errors, strict=True))
    return [each for each in found if each is not None]


def _stick_slip(item: Item, error: Array, noise: float) -> StickSlip | None:
    """How often the output stands and leaps over stretches in which the prediction moves by a few times the noise.

    What a lag or ringing misses is smooth: it continues from one stretch to the next, where a leap makes up for the
    standing before it.
    """
    known = np.isfinite(error) & np.isfinite(item.y)
    e, y = error[known], item.y[known]
    predicted = y - e
    move = np.abs(np.diff(predicted))
    moving = move > acceptance.SLIP_MOVING * float(np.quantile(move, 0.75)) if len(move) else move > 0.0
    if np.count_nonzero(moving) < 10 * acceptance.SLIP_JUMPS or noise <= 0.0:
        return None
    resolved = acceptance.SLIP_RESOLVED * noise
    m = max(1, int(np.ceil(resolved / float(np.median(move[moving])))))
    edges = np.arange(0, len(e), m)
    should, does = np.diff(predicted[edges]), np.diff(y[edges])
    slow, fast = acceptance.SLIP_STRETCH
    inside = (np.abs(should) > slow * resolved) & (np.abs(should) < fast * resolved)
    if np.count_nonzero(inside) < 5 * acceptance.SLIP_JUMPS:
        return None
    ratio = does[inside] / should[inside]
    off = acceptance.SLIP_OFF
    stands, leaps = float(np.mean(ratio < 1.0 - off)), float(np.mean(ratio > 1.0 + off))
    around = ratio - np.mean(ratio)
    again = float(around[1:] @ around[:-1]) / max(float(around @ around), 1e-300)
    if stands < acceptance.SLIP_STANDS or leaps < acceptance.SLIP_LEAPS or again > acceptance.SLIP_CONTINUES:
        return None
    step = np.diff(e)
    at = np.flatnonzero((np.abs(step) > resolved) & (np.sign(step) == np.sign(np.diff(predicted))))
    if len(at) < acceptance.SLIP_JUMPS:
        return None
    first = float(item.run.t[np.flatnonzero(known)[at[0] + 1]])
    return StickSlip(item.name, len(at), first, float(np.median(np.abs(step[at]))))
