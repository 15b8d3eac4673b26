"""Weights of a play sum from a reduced system: non-negative least squares, and the floor under p_0.

The method is Lawson and Hanson's active set algorithm (Solving Least Squares Problems, 1974, chapter 23) as scipy
implements it, on the triangular system of `reduction`, whose offsets are projected out and hence free.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hystgen.identification.reduction import Reduced

Array = NDArray[np.float64]
Columns = NDArray[np.intp]

STILL = 1e-9
"""A play that moves less than this share of the drive is one that does not move."""

TIE = 1e-12
"""Weight of the tie break between solutions that fit equally well, as a share of the squared output.

Where the drive stays between few turning points several plays move alike, and how the weight is divided among them is
left to rounding. Of such solutions the one with the least sum of squares is taken. A play of which a thousandth part
moves like no other keeps its weight to about six digits.
"""

FLOOR_COST = 0.05
"""How much the rms error may grow, as a share of itself, for p_0 to be raised to its floor."""


def non_negative(system: Array, columns: Columns) -> Array:
    """Weights >= 0 of the chosen plays that minimise `|system[:, columns] p - system[:, -1]|`."""
    return _solve(system[:, columns], system[:, -1])


def _solve(matrix: Array, target: Array) -> Array:
    from scipy.optimize import nnls

    size = np.linalg.norm(matrix, axis=0)
    moving = size > STILL * size[0]
    length = float(np.linalg.norm(target))
    weights = np.zeros(len(size))
    if moving.any() and length > 0.0:
        # Columns and target of length one: the solution is the same, whatever the units, and the solver's absolute
        # tolerance fits all of them
        n = int(np.count_nonzero(moving))
        unit = np.concatenate([matrix[:, moving] / size[moving], math.sqrt(TIE) * np.eye(n)])
        scaled, _ = nnls(unit, np.concatenate([target / length, np.zeros(n)]), maxiter=100 * n)
        weights[moving] = scaled * length / size[moving]
    return weights


def residual(system: Array, columns: Columns, weights: Array) -> float:
    """Sum of squared errors of the weights on a system."""
    return float(np.sum((system[:, columns] @ weights - system[:, -1]) ** 2))


@dataclass(frozen=True)
class Weights:
    """Result of `fit`: the weights, their rms error, and what was done about p_0.

    `free_p0`, `free_rms`: the values before p_0 was raised to the floor; None when it was not.
    """

    p: Array
    rms: float
    free_p0: float | None = None
    free_rms: float | None = None


def fit(reduced: Reduced, columns: Columns, floor: float) -> Weights:
    """Weights for the chosen plays, with p_0 at least the share `floor` of their sum where the data allow it.

    p_0 is the slope just after a reversal, and the inverse divides by it. A record shows it only over the first,
    smallest travel, where a slight lag of sensor or amplifier already flattens the loop and drives the least-squares
    p_0 to zero. So when it falls below the floor, the fit is repeated under `p_0 >= floor * sum p`; this is taken when
    the rms error grows by at most 5 % of itself, that is when the data can hardly tell. Otherwise the smaller p_0 is
    what the actuator does (series backlash for p_0 = 0: no inverse) and stays.
    """
    matrix, target = reduced.whole[:, columns], reduced.whole[:, -1]

    def rms(p: Array) -> float:
        return float(np.sqrt(residual(reduced.whole, columns, p) / max(reduced.samples, 1)))

    free = _solve(matrix, target)
    if len(free) < 2 or free[0] >= floor * float(np.sum(free)):
        return Weights(free, rms(free))
    # p_0 = q_0 + share * sum of the others, all >= 0, is the bounded problem as another non-negative one
    share = floor / (1.0 - floor)
    bounded_matrix = matrix.copy()
    bounded_matrix[:, 1:] += share * matrix[:, :1]
    bounded = _solve(bounded_matrix, target)
    bounded[0] += share * float(np.sum(bounded[1:]))
    if rms(bounded) > (1.0 + FLOOR_COST) * rms(free):
        return Weights(free, rms(free))
    return Weights(bounded, rms(bounded), float(free[0]), rms(free))
