"""Linear least squares under linear inequalities.

Lawson and Hanson, Solving Least Squares Problems (1974), chapter 23: the triangular factor turns the problem into the
one of the shortest vector under inequalities (LDP), and that one's dual is a non-negative least-squares problem.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RIDGE = 1e-7
"""Weight of the tie break between solutions that fit equally well, with columns scaled to length one."""

STILL = 1e-9
"""A column of less than this share of the longest one, in the same unit, is rounding and nothing else."""

INFEASIBLE = 1e-10


class InfeasibleError(ValueError):
    """The inequalities contradict each other."""


def least_squares(matrix: Array, target: Array, bounds: Array, limits: Array, plays: int = 0) -> Array:
    """The x that minimises `|matrix x - target|` under `bounds x >= limits`.

    `matrix`: (rows, k); `bounds`: (inequalities, k); `plays`: the first so many columns have a unit of their own, the
    others that of the target. Where the matrix does not determine x the shortest one, in the measure of its columns, is
    taken. Raises InfeasibleError.
    """
    from scipy.linalg import solve_triangular
    from scipy.optimize import nnls

    k = matrix.shape[1]
    size = np.linalg.norm(matrix, axis=0)
    alike, reach = size.copy(), float(np.linalg.norm(target))
    if reach > 0.0 and np.any(size[:plays]):
        alike[:plays] *= reach / np.max(size[:plays])
    idle = alike <= STILL * np.max(alike)
    size[idle] = 1.0
    stacked = np.concatenate([np.where(idle, 0.0, matrix / size), RIDGE * np.eye(k)])
    q, triangle = np.linalg.qr(stacked)
    free = q.T @ np.concatenate([target, np.zeros(k)])
    # In the coordinates e = triangle (x size) - free the objective is |e|
    rows = np.asarray(solve_triangular(triangle, (bounds / size).T, trans="T")).T
    least = limits - rows @ free
    if np.all(least <= 0.0):
        shortest = np.zeros(k)
    else:
        length = np.linalg.norm(rows, axis=1)
        length[length == 0.0] = 1.0
        scale = float(np.max(np.abs(least / length)))
        dual_matrix = np.vstack([(rows / length[:, None]).T, least / length / scale])
        dual_target = np.zeros(k + 1)
        dual_target[-1] = 1.0
        multipliers, rest = nnls(dual_matrix, dual_target, maxiter=100 * (k + len(bounds)))
        if rest < INFEASIBLE:
            raise InfeasibleError("the inequalities contradict each other")
        # over the last component of the residual, which is the square of its length, and as that does not cancel to 0
        shortest = dual_matrix[:k] @ multipliers / rest**2 * scale
    return np.asarray(solve_triangular(triangle, shortest + free) / size)


def at_least(lower: Array, upper: Array) -> tuple[Array, Array]:
    """Bounds on single unknowns, infinite ones left out, as the inequalities of `least_squares`."""
    k = len(lower)
    eye = np.eye(k)
    below, above = np.isfinite(lower), np.isfinite(upper)
    return np.concatenate([eye[below], -eye[above]]), np.concatenate([lower[below], -upper[above]])


def root_mean_square(squares: float, samples: int) -> float:
    """rms of so many samples from the sum of their squares."""
    return math.sqrt(squares / max(samples, 1))
