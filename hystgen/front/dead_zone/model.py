"""Dead-zone sums: a piecewise linear map in front of the plays, and its inverse."""

from __future__ import annotations

import bisect
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics.arguments import finite_numbers
from hystgen.basics.problems import NotInvertibleError, counted

Array = NDArray[np.float64]


class Pieces(NamedTuple):
    """A piecewise linear map: its breaks, the values there, and a point and the slope of each piece."""

    breaks: tuple[float, ...]
    values: tuple[float, ...]
    anchors: tuple[tuple[float, float], ...]
    slopes: tuple[float, ...]


@dataclass(frozen=True)
class DeadZone:
    """Dead-zone sum `w = eta_0 v + sum eta_j S_(rho_j)(v)` (41).

    `thresholds`: rho, strictly increasing, containing 0; `weights`: eta, same length. Raises ValueError otherwise.
    """

    thresholds: Sequence[float]
    weights: Sequence[float]

    def __post_init__(self) -> None:
        thresholds = finite_numbers(self.thresholds, "thresholds")
        weights = finite_numbers(self.weights, "weights")
        if any(b <= a for a, b in itertools.pairwise(thresholds)) or 0.0 not in thresholds:
            raise ValueError("dead-zone thresholds must be strictly increasing and contain 0")
        if len(weights) != len(thresholds):
            raise ValueError(f"{counted(len(thresholds), 'threshold')} but {counted(len(weights), 'weight')}")
        object.__setattr__(self, "thresholds", thresholds)
        object.__setattr__(self, "weights", weights)

    @property
    def branches_differ(self) -> bool:
        """False: both directions share one curve."""
        return False

    @cached_property
    def breaks(self) -> tuple[float, ...]:
        """Where the slope changes: all thresholds except 0."""
        return tuple(r for r in self.thresholds if r != 0.0)

    @cached_property
    def piece_slopes(self) -> tuple[float, ...]:
        """Slopes of the linear pieces, one more than there are breaks: the partial sums of the weights."""
        zero = self.thresholds.index(0.0)
        eta = self.weights
        left = [math.fsum(eta[j : zero + 1]) for j in range(zero)]
        right = [math.fsum(eta[zero : j + 1]) for j in range(zero + 1, len(eta))]
        return (*left, eta[zero], *right)

    @cached_property
    def anchors(self) -> tuple[tuple[float, float], ...]:
        """A point of each piece: its break nearest to zero, or the origin for the piece that contains it."""
        middle = sum(1 for b in self.breaks if b < 0)
        points = []
        for j in range(len(self.piece_slopes)):
            k = j if j < middle else j - 1
            points.append((0.0, self._value(0.0)) if j == middle else (self.breaks[k], self._values[k]))
        return tuple(points)

    def _value(self, x: float) -> float:
        if math.isinf(x):  # take the sign from the end piece's slope, since infinite terms can cancel
            slope = self.piece_slopes[-1 if x > 0 else 0]
            return slope * x if slope else self.anchors[-1 if x > 0 else 0][1]
        rho, eta, least, most = self._terms
        return math.fsum((eta * np.clip(x - rho, least, most)).tolist())

    @cached_property
    def _terms(self) -> tuple[Array, Array, Array, Array]:
        """rho, eta, and the limits of `x - rho` in each term."""
        rho, eta = np.array(self.thresholds), np.array(self.weights)
        return rho, eta, np.where(rho > 0, 0.0, -math.inf), np.where(rho < 0, 0.0, math.inf)

    @cached_property
    def _values(self) -> tuple[float, ...]:
        """Values at the breaks."""
        return tuple(map(self._value, self.breaks))

    @cached_property
    def _all_pieces(self) -> tuple[Array, Array, Array]:
        """Breaks, anchors and slopes as arrays."""
        return np.array(self.breaks), np.array(self.anchors), np.array(self.piece_slopes)

    def forward(self, x: ArrayLike, ascending: bool = True) -> Array:
        """Value at x, in both directions."""
        points = np.asarray(x, dtype=np.float64)
        breaks, anchors, slopes = self._all_pieces
        piece = np.searchsorted(breaks, points, side="right")
        anchor = anchors[piece]
        return np.asarray(anchor[..., 1] + (points - anchor[..., 0]) * slopes[piece])

    def inverse_map(self) -> DeadZone:
        """The dead-zone sum that undoes this one: thresholds tau (53)(55), weights mu (54)(56).

        Raises NotInvertibleError unless every partial sum of the weights is positive.
        """
        problems = self.inverse_problems(-math.inf, math.inf)
        if problems:
            raise NotInvertibleError(problems)
        zero = self.thresholds.index(0.0)
        slopes = self.piece_slopes
        mu = []
        for j in range(len(self.weights)):
            if j == zero:
                mu.append(1.0 / slopes[j])
            else:
                outer, inner = slopes[j], slopes[j + 1] if j < zero else slopes[j - 1]
                mu.append(-self.weights[j] / (outer * inner))
        return DeadZone([self._value(rho) for rho in self.thresholds], mu)

    def inverse(
        self, y: ArrayLike, ascending: bool = True, low: float = -math.inf, high: float = math.inf
    ) -> Array:
        """The x at which the map, which must rise over [low, high], has the value y; the end pieces extend further."""
        ends, anchors, slopes = self._inverses(low, high)
        values = np.asarray(y, dtype=np.float64)
        piece = np.searchsorted(ends, values, side="right")
        anchor = anchors[piece]
        return np.asarray(anchor[..., 0] + (values - anchor[..., 1]) / slopes[piece])

    def _inverses(self, low: float, high: float) -> tuple[Array, Array, Array]:
        """Values at the breaks, anchors and slopes from `over` as arrays, computed once per range."""
        if (low, high) not in self._inverted:
            kept = self.over(low, high)
            self._inverted[low, high] = np.array(kept.values), np.array(kept.anchors), np.array(kept.slopes)
        return self._inverted[low, high]

    @cached_property
    def _inverted(self) -> dict[tuple[float, float], tuple[Array, Array, Array]]:
        return {}

    def over(self, low: float, high: float) -> Pieces:
        """The linear pieces within [low, high]; the first and the last continue beyond it."""
        first, last = self._pieces(low, high)[0], self._pieces(low, high)[-1]
        breaks = self.breaks[first:last]
        return Pieces(
            breaks,
            self._values[first:last],
            self.anchors[first : last + 1],
            self.piece_slopes[first : last + 1],
        )

    def _pieces(self, low: float, high: float) -> range:
        first = bisect.bisect_right(self.breaks, low)
        last = bisect.bisect_left(self.breaks, high)
        return range(first, max(first, last) + 1)

    def image(self, low: float, high: float, ascending: bool = True) -> tuple[float, float]:
        """Smallest and largest value over [low, high], which occur at the ends or at breaks."""
        inside = slice(bisect.bisect_right(self.breaks, low), bisect.bisect_left(self.breaks, high))
        values = (self._value(low), self._value(high), *self._values[inside])
        return min(values), max(values)

    def slope_range(self, low: float, high: float, ascending: bool = True) -> tuple[float, float]:
        """Smallest and largest slope of the pieces within [low, high]."""
        slopes = [self.piece_slopes[j] for j in self._pieces(low, high)]
        return min(slopes), max(slopes)

    def inverse_problems(self, low: float, high: float) -> list[str]:
        """Descriptions of the pieces within [low, high] whose partial sum of weights is not positive."""
        edges = (-math.inf, *self.breaks, math.inf)
        return [
            f"the dead-zone weights sum to {self.piece_slopes[j]:.6g} between {max(edges[j], low):.6g} and "
            f"{min(edges[j + 1], high):.6g}, but every partial sum from eta_0 on must be positive"
            for j in self._pieces(low, high)
            if not self.piece_slopes[j] > 0.0
        ]
