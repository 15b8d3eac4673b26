"""Whether the records begin in the memory that the history leads to which was given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hystgen.diagnosis import structure
from hystgen.diagnosis.structure import Fitted, Item
from hystgen.identification.reduction import settled
from hystgen.identification.remarks import STARTS, UNLIKE


def contradicted(items: Sequence[Item], fitted: Fitted) -> dict[str, Any] | None:
    """What `diagnosis.json` says where the starts, which depend on the history, are off by far more than the rest.

    `items`: those that were fitted; held-out ones decide nothing about a fit, and may go where it is a guess.
    Of a session only the first record begins behind the history. None where nothing contradicts it, or nothing tells.
    """
    first, later = [], []
    largest = float(fitted.structure.thresholds[-1])
    for item, e in zip(items, fitted.errors(items), strict=True):
        if item.history is None or (item.session is not None and item.part.start):
            continue
        end = settled(item.run.v, largest)
        first.append(e[:end])
        later.append(e[end:])
    samples, others = (sum(int(np.count_nonzero(np.isfinite(e))) for e in part) for part in (first, later))
    if min(samples, others) < STARTS:
        return None
    start, rest = structure.rms(first), structure.rms(later)
    if start <= UNLIKE * rest:
        return None
    return {"kind": "history", "record": "all", "samples": samples, "start": start, "rest": rest}
