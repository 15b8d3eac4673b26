"""The play sum of Prandtl-Ishlinskii models and its analytic inverse, as a frozen object."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics.checks import numbers
from hystgen.basics.problems import NotInvertibleError, counted
from hystgen.plays import memory

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PlaySum:
    """Play sum `y = p_0 v + sum p_i play_(r_i)[v]` (21).

    `thresholds`: r_0 = 0 < r_1 < ... < r_n in units of the input; `weights`: p_0 .. p_n, any finite numbers, in output
    per input unit; `initial_state`: one number or n+1 of them, projected to the admissible set (`projected`: whether it
    was). Raises ValueError for anything else.
    """

    thresholds: Sequence[float]
    weights: Sequence[float]
    initial_state: float | Sequence[float] = 0.0
    start: tuple[float, ...] = field(init=False, repr=False)
    projected: bool = field(init=False, repr=False)

    def __post_init__(self) -> None:
        thresholds = numbers(self.thresholds, "thresholds")
        weights = numbers(self.weights, "weights")
        if thresholds[0] != 0.0 or any(b <= a for a, b in itertools.pairwise(thresholds)):
            raise ValueError("thresholds start with 0 and rise strictly")
        if len(weights) != len(thresholds):
            raise ValueError(f"{counted(len(thresholds), 'threshold')} but {counted(len(weights), 'weight')}")
        requested: float | tuple[float, ...]
        if isinstance(self.initial_state, int | float):
            (requested,) = numbers([self.initial_state], "the initial state")
        else:
            requested = numbers(self.initial_state, "initial states")
        start, projected = memory.project(requested, thresholds)
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
        at each corner is by how much the slope changes there (22)(23), of which `p(r) = phi''(r)` is the limit.

        `x`: N + 1 points from 0, strictly rising, in input units; `phi`: the curve there, from 0, in output units; the
        last slope goes on beyond the last point. The thresholds are the first N points. Raises ValueError otherwise.
        """
        points, curve = numbers(np.asarray(x).tolist(), "x"), numbers(np.asarray(phi).tolist(), "phi")
        if len(points) != len(curve) or len(points) < 2:
            raise ValueError("a loading curve has as many values as points, at least two")
        if points[0] != 0.0 or curve[0] != 0.0 or not np.all(np.diff(points) > 0.0):
            raise ValueError("a loading curve starts at (0, 0) and its points rise strictly")
        with np.errstate(over="ignore", invalid="ignore"):
            weights = np.diff(np.diff(curve) / np.diff(points), prepend=0.0)
        if not np.all(np.isfinite(weights)):
            raise ValueError("a slope between the points of a loading curve is too steep for a number")
        return cls(points[:-1], weights.tolist(), initial_state)

    @property
    def n(self) -> int:
        """Number of plays without r_0."""
        return len(self.thresholds) - 1

    @cached_property
    def slopes(self) -> tuple[float, ...]:
        """Slopes `C_i = p_0 + ... + p_i` of the loop's segments (33)."""
        return tuple(math.fsum(self.weights[: i + 1]) for i in range(self.n + 1))

    @property
    def width(self) -> float:
        """Largest full width of the loop, `2 sum p_i r_i / sum p_i` (32), corrected to count p_0 below the line."""
        lift = math.fsum(p * r for p, r in zip(self.weights, self.thresholds, strict=True))
        return 2.0 * lift / self.slopes[-1] if self.slopes[-1] else math.inf

    def loading_curve(self, x: ArrayLike) -> Array:
        """Initial loading curve `phi(x) = sum p_g max(x - r_g, 0)` (22) for x >= 0."""
        points = np.asarray(x, dtype=np.float64)
        excess = np.maximum(points[..., None] - np.asarray(self.thresholds), 0.0)
        return np.asarray(excess @ np.asarray(self.weights))

    def inverse_problems(self) -> list[str]:
        """Why there is no inverse; empty when there is one. Every `C_i` has to be positive."""
        return [
            f"the weights up to p_{i} sum to {c:.6g}, the inverse needs a positive sum"
            + (" (p_0 > 0)" if i == 0 else "")
            for i, c in enumerate(self.slopes)
            if not c > 0.0
        ]

    def inverse(self) -> Self:
        """The analytic inverse, another play sum with thresholds z (36), weights q (37) and the start memory mapped.

        Raises NotInvertibleError.
        """
        problems = self.inverse_problems()
        if problems:
            raise NotInvertibleError(problems)
        p, r, c = self.weights, self.thresholds, self.slopes
        z = [math.fsum(p[g] * (r[i] - r[g]) for g in range(i)) for i in range(self.n + 1)]
        q = [1.0 / p[0], *(-p[i] / (c[i] * c[i - 1]) for i in range(1, self.n + 1))]
        return type(self)(z, q, tuple(memory.through(self.start, p).tolist()))
