"""Stick-slip, a disturbance that is told with place and count and never named, in what a model leaves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.structure import Item

Array = NDArray[np.float64]

RESOLVED = 7.0
"""Stick-slip is sought over stretches in which the prediction moves by so many times the noise."""

STANDS, LEAPS = 0.15, 0.05
"""Least share of the stretches in which the output hardly moves, and in which it moves by far too much."""

GOES_ON = 0.3
"""Largest correlation of that from one stretch to the next."""

TURN = 5
"""Fewest jumps of stick-slip."""


def stick_slip(items: Sequence[Item], errors: Sequence[Array], noise: float) -> list[dict[str, Any]]:
    """Stick-slip: the output stands while it should move and then jumps after it, in the direction of the motion."""
    told = []
    for item, error in zip(items, errors, strict=True):
        found = _stick_slip(item, error, noise)
        if found is not None:
            told.append({"kind": "stick_slip", "record": item.name, **found})
    return told


def _stick_slip(item: Item, error: Array, noise: float) -> dict[str, Any] | None:
    """Over stretches in which the prediction moves by a few times the noise: how often the output stands and leaps.

    Noise makes the output stand in one stretch of a hundred. What a lag or ringing misses is smooth: it goes on from
    one stretch to the next, where a leap makes up for the standing before it.
    """
    known = np.isfinite(error) & np.isfinite(item.y)
    e, y = error[known], item.y[known]
    predicted = y - e
    move = np.abs(np.diff(predicted))
    moving = move > 0.25 * float(np.quantile(move, 0.75)) if len(move) else move > 0.0
    if np.count_nonzero(moving) < 10 * TURN or noise <= 0.0:
        return None
    m = max(1, int(np.ceil(RESOLVED * noise / float(np.median(move[moving])))))
    edges = np.arange(0, len(e), m)
    should, does = np.diff(predicted[edges]), np.diff(y[edges])
    inside = (np.abs(should) > 0.5 * RESOLVED * noise) & (np.abs(should) < 3.0 * RESOLVED * noise)
    if np.count_nonzero(inside) < 5 * TURN:
        return None
    ratio = does[inside] / should[inside]
    stands, leaps = float(np.mean(ratio < 0.4)), float(np.mean(ratio > 1.6))
    goes_on = ratio - np.mean(ratio)
    again = float(goes_on[1:] @ goes_on[:-1]) / max(float(goes_on @ goes_on), 1e-300)
    if stands < STANDS or leaps < LEAPS or again > GOES_ON:
        return None
    step = np.diff(e)
    at = np.flatnonzero((np.abs(step) > RESOLVED * noise) & (np.sign(step) == np.sign(np.diff(predicted))))
    if len(at) < TURN:
        return None
    first = float(item.run.t[np.flatnonzero(known)[at[0] + 1]])
    return {"count": len(at), "first": first, "size": float(np.median(np.abs(step[at])))}
