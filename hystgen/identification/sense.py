"""Which way the output goes with the drive, and which way round its loops run.

A play sum with positive weights rises with its drive, and its loops run counterclockwise: the output is behind. Weights
of either sign follow loops that run clockwise as well, such as those of a force over the displacement of a damper.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hystgen.identification import reduction
from hystgen.identification.reduction import Course, Reduced
from hystgen.plays import operators

Array = NDArray[np.float64]

PLAYS = 8
"""Plays, about, with weights of either sign; of many more, the weights of neighbours cancel."""

RANK = 1e-6
"""Share of the largest singular value below which a combination of plays is not determined by the records."""

CLEARLY = 0.9
"""Weights of either sign have to leave less than this times what positive ones leave to be believed."""

FALLING = (
    "y falls where v rises; if the sensor counts the other way, change the sign of y, else check which column is which"
)

CLOCKWISE = (
    "the loops run clockwise: y is ahead of v, where every play is behind its drive, so that no weights follow them. "
    "If y is a force and v the displacement that goes with it, exchange the columns (--columns v=..,y=..): the model "
    "then gives the displacement"
)

NO_PLAYS = "no hysteresis was found: the model has no play beside r_0, and its output follows its input without a loop"


@dataclass(frozen=True)
class Sense:
    """How the output moves with the drive.

    `falls`: it goes down where the drive goes up; `clockwise`: loops run the other way than those of plays, and weights
    of either sign explain the records clearly better than positive ones.
    """

    falls: bool
    clockwise: bool

    def sentences(self, plays: int) -> list[str]:
        """What the user should know, one sentence each; `plays`: how many the fitted model has."""
        found = [FALLING] if self.falls else [CLOCKWISE] if self.clockwise else []
        return [*found, NO_PLAYS] if plays == 0 else found


def of(reduced: Reduced, courses: Sequence[Course], squares: float) -> Sense:
    """The sense of reduced records; `squares`: the sum of squared errors that positive weights leave."""
    together = sum(_covaried(item) for item in courses if item.used)
    some = np.unique(np.linspace(0, len(reduced.thresholds) - 1, PLAYS + 1).astype(int))
    matrix, target = reduced.whole[:, some], reduced.whole[:, -1]
    weights, *_ = np.linalg.lstsq(matrix, target, rcond=RANK)
    left = float(np.sum((matrix @ weights - target) ** 2))
    r = reduced.thresholds[some]
    enclosed = sum(float(weights @ (r * _travelled(item, r))) for item in courses)
    return Sense(together < 0.0, enclosed < 0.0 and left < CLEARLY**2 * squares)


def _covaried(item: Course) -> float:
    """Sum of products of drive and output, each from its mean: negative where one falls while the other rises."""
    v, y = item.v[item.compared], item.y[item.compared]
    return float((v - np.mean(v)) @ (y - np.mean(y)))


def _travelled(item: Course, r: Array) -> Array:
    """Distance that each play moves; times its weight and threshold that is the area that its loops enclose."""
    states = reduction.start_states(item.v, item.visited, r)
    moved = operators.plays(item.v[: item.last], r, states)[:, item.first :]
    return np.asarray(np.abs(np.diff(moved, axis=1)).sum(axis=1))
