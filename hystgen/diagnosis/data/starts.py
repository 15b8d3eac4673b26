"""Whether the records begin in the memory to which the given history leads."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data.items import Item, Model, rms
from hystgen.diagnosis.findings.kinds import OtherHistory
from hystgen.diagnosis.search import acceptance
from hystgen.identification.reduction import settled
from hystgen.identification.remarks import STARTS, UNLIKE

Array = NDArray[np.float64]


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
