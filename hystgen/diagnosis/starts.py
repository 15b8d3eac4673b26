"""Whether the records begin in the memory that the history leads to which was given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis import structure
from hystgen.diagnosis.structure import Fitted, Item
from hystgen.identification.reduction import settled
from hystgen.identification.remarks import STARTS, UNLIKE

Array = NDArray[np.float64]


BENT = 1.5
"""A history has bent a model that leaves so many times as much of what does not depend on it."""


def contradicted(items: Sequence[Item], fitted: Fitted) -> dict[str, Any] | None:
    """What `diagnosis.json` says where the starts, which depend on the history, are off by far more than the rest.

    `items`: those that were fitted; held-out ones decide nothing about a fit, and may go where it is a guess.
    Of a session only the first record begins behind the history. None where nothing contradicts it, or nothing tells.
    """
    return _off(*_parts(items, fitted, False))


def bends(items: Sequence[Item], fitted: Fitted, free: Fitted) -> dict[str, Any] | None:
    """The same where a model fitted with the history can follow it: at the cost of the rest.

    `free`: the model fitted to what does not depend on the history, which says what the starts should have been.
    Starts that are off alone, and cost the rest nothing, may be an effect that fades.
    """
    starts, rest = _parts(items, free, True)
    _, bent = _parts(items, fitted, True)
    return _off(starts, rest) if structure.rms(bent) > BENT * structure.rms(rest) else None


def _parts(items: Sequence[Item], fitted: Fitted, own: bool) -> tuple[list[Array], list[Array]]:
    """Errors of what depends on the history, and of what does not; `own`: with the offset of the latter."""
    first, later = [], []
    largest = float(fitted.structure.thresholds[-1])
    for item, e in zip(items, fitted.errors(items), strict=True):
        if item.history is None or (item.session is not None and item.part.start):
            continue
        end = settled(item.run.v, largest)
        if own and np.isfinite(e[end:]).any():
            e = e - float(np.nanmean(e[end:]))
        first.append(e[:end])
        later.append(e[end:])
    return first, later


def _off(first: Sequence[Array], later: Sequence[Array]) -> dict[str, Any] | None:
    samples, others = (sum(int(np.count_nonzero(np.isfinite(e))) for e in part) for part in (first, later))
    if min(samples, others) < STARTS:
        return None
    start, rest = structure.rms(first), structure.rms(later)
    if start <= UNLIKE * rest:
        return None
    return {"kind": "history", "record": "all", "samples": samples, "start": start, "rest": rest}
