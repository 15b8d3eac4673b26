"""The drives of records: where they turn, and whether all of them pass one loop."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.search import acceptance
from hystgen.plays import operators

Array = NDArray[np.float64]
Places = NDArray[np.intp]


def reversals(v: Array) -> Places:
    """Samples at which the drive turns, by more than a share of its range."""
    return _moves(v)[1]


def one_loop(items: Sequence[Item]) -> bool:
    """Whether the drive moves between the same two ends in all records without a hold, which would show more."""
    ends = []
    for item in items:
        v, t = item.run.v, item.run.t
        moved, turns = _moves(v)
        if not len(turns):
            return False
        passing = float(np.ptp(t[moved])) / (len(turns) + 1)
        if np.max(np.diff(t[moved])) > acceptance.LOOP_STANDS * passing:
            return False
        at = _between_ends(turns)
        ends += [v[at], np.array([v[at[0] :].min(), v[at[0] :].max()])]
    levels = np.concatenate(ends)
    low, high = float(levels.min()), float(levels.max())
    return bool(np.minimum(levels - low, high - levels).max() <= acceptance.LOOP_ENDS * (high - low))


def one_speed(items: Sequence[Item]) -> bool:
    """Whether the drive takes the same time from each of its ends to the next in all records."""
    passed = np.concatenate([np.diff(item.run.t[_between_ends(reversals(item.run.v))]) for item in items])
    return not len(passed) or bool(passed.max() <= acceptance.LOOP_SPEEDS * passed.min())


def _moves(v: Array) -> tuple[Places, Places]:
    """Samples behind which the drive moves on, and those at which it turns, without its noise: as a play follows it."""
    z = operators.plays(v, np.array([0.5 * acceptance.REVERSAL * float(np.ptp(v))]), np.array([v[0]]))[0]
    steps = np.diff(z)
    moved = np.flatnonzero(steps)
    return moved, moved[np.flatnonzero(np.diff(np.sign(steps[moved])))] + 1


def _between_ends(turns: Places) -> Places:
    """The turns without the first one: the way to it may begin anywhere."""
    return turns[1:] if len(turns) > 1 else turns
