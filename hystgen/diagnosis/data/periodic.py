"""Periodic disturbances in what a model leaves: lines over time, and a ripple over the position."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data import lines as over_time
from hystgen.diagnosis.data import ripple
from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.data.lines import Removed
from hystgen.diagnosis.findings.kinds import Line, Ripple
from hystgen.diagnosis.search import acceptance

Array = NDArray[np.float64]
Way = Callable[[Sequence[Item], Sequence[Array]], Removed | None]


def lines(items: Sequence[Item], errors: Sequence[Array]) -> tuple[list[Line | Ripple], list[Array]]:
    """Lines in the errors of several records, the strongest first, and the errors without them."""
    return _strongest_first(items, errors, (over_time.in_time, ripple.in_position), 0.0)


def ruling(items: Sequence[Item], errors: Sequence[Array]) -> tuple[list[Line | Ripple], list[Array]]:
    """The same for lines that rule the errors and do not come from the actuator: steady ones and ripples."""
    return _strongest_first(items, errors, (over_time.steady, ripple.in_position), acceptance.RULING_SHARE)


def _strongest_first(
    items: Sequence[Item], errors: Sequence[Array], ways: Sequence[Way], least: float
) -> tuple[list[Line | Ripple], list[Array]]:
    left, found = list(errors), []
    for _ in range(acceptance.MOST_LINES):
        seen = [line for line in (way(items, left) for way in ways) if line is not None and line.share >= least]
        if not seen:
            break
        best = max(seen, key=lambda line: line.share)
        found.append(best.finding)
        left = best.errors
    return found, left
