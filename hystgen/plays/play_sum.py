"""The play sum of Prandtl-Ishlinskii models, its memory and its analytic inverse, as a frozen object."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics.arguments import finite_numbers
from hystgen.basics.problems import NotInvertibleError, counted

Array = NDArray[np.float64]


# The memory of the plays. After any input the states satisfy |s_i - s_(i-1)| <= r_i - r_(i-1) with s_0 = w, the input
# of the plays. States that violate this cannot result from any history, and the inverse is not exact with them.


def project(requested: float | Sequence[float], thresholds: Sequence[float]) -> tuple[tuple[float, ...], bool]:
    """The admissible start memory nearest to the requested one, and whether it had to be changed.

    `requested`: one number for all plays, or n+1 numbers of which entry 0 (the input) is ignored. Play 1 is kept; then
    each play in turn is moved into reach of the previous play. The result starts with `s_0 = s_1`.
    Raises ValueError for a list of the wrong length.
    """
    n = len(thresholds) - 1
    if isinstance(requested, int | float):
        return (float(requested),) * (n + 1), False
    if len(requested) != n + 1:
        raise ValueError(f"initial_state has {len(requested)} entries, the model needs {n + 1}")
    if n == 0:
        return (float(requested[0]),), False
    states = [float(requested[1])]
    for i in range(2, n + 1):
        reach = thresholds[i] - thresholds[i - 1]
        states.append(min(max(float(requested[i]), states[-1] - reach), states[-1] + reach))
    # rounding in sums of decimal numbers does not count as a projection
    grain = 8 * np.finfo(np.float64).eps
    moved = any(
        abs(a - float(b)) > grain * max(abs(a), abs(float(b)), r)
        for a, b, r in zip(states, requested[1:], thresholds[1:], strict=True)
    )
    return (states[0], *states), moved


def is_admissible(states: Sequence[float], thresholds: Sequence[float], tolerance: float = 0.0) -> bool:
    """Whether some history leads to these states."""
    steps = np.abs(np.diff(np.asarray(states, dtype=np.float64)))
    return bool(np.all(steps <= np.diff(np.asarray(thresholds, dtype=np.float64)) + tolerance))


def through(states: Sequence[float], weights: Sequence[float]) -> Array:
    """States of the inverse's plays from those of the model's plays: `zeta_i = C_i s_i + sum over g > i of p_g s_g`.

    `C_i = p_0 + ... + p_i`. With the weights of the inverse the same formula gives the model's states back.
    """
    s = np.asarray(states, dtype=np.float64)
    p = np.asarray(weights, dtype=np.float64)
    above = np.concatenate([np.cumsum((p * s)[::-1])[::-1][1:], [0.0]])
    return np.asarray(np.cumsum(p) * s + above)


@dataclass(frozen=True)
class PlaySum:
    """Play sum `y = p_0 v + sum p_i play_(r_i)[v]` (21).

    `thresholds`: r_0 = 0 < r_1 < ... < r_n in units of the input; `weights`: p_0 .. p_n, any finite numbers, in output
    per input unit; `initial_state`: one number or n+1 numbers, projected to the admissible set (`projected`: whether
    that changed them). Raises ValueError for anything else.
    """

    thresholds: Sequence[float]
    weights: Sequence[float]
    initial_state: float | Sequence[float] = 0.0
    start: tuple[float, ...] = field(init=False, repr=False)
    projected: bool = field(init=False, repr=False)

    def __post_init__(self) -> None:
        thresholds = finite_numbers(self.thresholds, "thresholds")
        weights = finite_numbers(self.weights, "weights")
        if thresholds[0] != 0.0 or any(b <= a for a, b in itertools.pairwise(thresholds)):
            raise ValueError("thresholds must start with 0 and rise strictly")
        if len(weights) != len(thresholds):
            raise ValueError(f"{counted(len(thresholds), 'threshold')} but {counted(len(weights), 'weight')}")
        requested: float | tuple[float, ...]
        if isinstance(self.initial_state, int | float):
            (requested,) = finite_numbers([self.initial_state], "the initial state")
        else:
            requested = finite_numbers(self.initial_state, "initial states")
        start, projected = project(requested, thresholds)
        for name, value in (
            ("thresholds", thresholds),
            ("weights", weights),
            ("initial_state", requested),
            ("start", start),
            ("projected", projected),
        ):
            object.__setattr__(self, name, value)

    @classmethod
    def from_loading_curve(
        cls, x: ArrayLike, phi: ArrayLike, initial_state: float | Sequence[float] = 0.0
    ) -> Self:
        """The play sum whose initial loading curve is the polygon through the points: `p_0 = phi'(0)`, and the weight
        at each corner is the change of slope there (22)(23); the limit is the density `p(r) = phi''(r)`.

        `x`: N + 1 strictly rising points from 0 on, in input units; `phi`: the curve's values there, from 0, in output
        units. Beyond, the last slope continues. The thresholds are the first N points. Raises ValueError otherwise.
        """
        points, curve = finite_numbers(np.asarray(x).tolist(), "x"), finite_numbers(np.asarray(phi).tolist(), "phi")
        if len(points) != len(curve) or len(points) < 2:
            raise ValueError("a loading curve needs as many values as points, at least two")
        if points[0] != 0.0 or curve[0] != 0.0 or not np.all(np.diff(points) > 0.0):
            raise ValueError("a loading curve must start at (0, 0), with strictly rising points")
        with np.errstate(over="ignore", invalid="ignore"):
            weights = np.diff(np.diff(curve) / np.diff(points), prepend=0.0)
        if not np.all(np.isfinite(weights)):
            raise ValueError("a slope between the points of a loading curve is too steep for a number")
        return cls(points[:-1], weights.tolist(), initial_state)

    @property
    def n(self) -> int:
        """Number of plays, excluding r_0."""
        return len(self.thresholds) - 1

    @cached_property
    def slopes(self) -> tuple[float, ...]:
        """Slopes `C_i = p_0 + ... + p_i` of the loop's segments (33)."""
        return tuple(math.fsum(self.weights[: i + 1]) for i in range(self.n + 1))

    @property
    def width(self) -> float:
        """Largest full width of the loop, `2 sum p_i r_i / sum p_i` (32), corrected: p_0 is in the denominator."""
        lift = math.fsum(p * r for p, r in zip(self.weights, self.thresholds, strict=True))
        return 2.0 * lift / self.slopes[-1] if self.slopes[-1] else math.inf

    def loading_curve(self, x: ArrayLike) -> Array:
        """Initial loading curve `phi(x) = sum p_g max(x - r_g, 0)` (22) for x >= 0."""
        points = np.asarray(x, dtype=np.float64)
        excess = np.maximum(points[..., None] - np.asarray(self.thresholds), 0.0)
        return np.asarray(excess @ np.asarray(self.weights))

    def inverse_problems(self) -> list[str]:
        """Why there is no inverse; empty if there is one. Every `C_i` has to be positive."""
        return [
            f"the weights up to p_{i} sum to {c:.6g}, the inverse needs a positive sum"
            + (" (p_0 > 0)" if i == 0 else "")
            for i, c in enumerate(self.slopes)
            if not c > 0.0
        ]

    def inverse(self) -> Self:
        """The analytic inverse, a play sum with thresholds z (36), weights q (37) and the start memory mapped to it.

        Raises NotInvertibleError.
        """
        problems = self.inverse_problems()
        if problems:
            raise NotInvertibleError(problems)
        p, r, c = self.weights, self.thresholds, self.slopes
        z = [math.fsum(p[g] * (r[i] - r[g]) for g in range(i)) for i in range(self.n + 1)]
        q = [1.0 / p[0], *(-p[i] / (c[i] * c[i - 1]) for i in range(1, self.n + 1))]
        return type(self)(z, q, tuple(through(self.start, p).tolist()))
