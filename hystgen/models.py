"""Prandtl-Ishlinskii models as frozen objects: what they are, what they can do, and their inverses.

`PI` is the play sum, `DeadZone` and `TanhEnvelope` are the memoryless parts in front of it, and `Cascade` is the whole
actuator: stages in order from the drive, the play sum, an output offset and the drive range it is used in.
"""

from __future__ import annotations

import bisect
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen import kernels, memory
from hystgen.checks import numbers

Array = NDArray[np.float64]


class NotInvertibleError(ValueError):
    """A well-formed model whose inverse was asked for and does not exist; `reasons` says why, one line each."""

    def __init__(self, reasons: Sequence[str]) -> None:
        super().__init__("the model has no inverse: " + "; ".join(reasons))
        self.reasons = list(reasons)


@dataclass(frozen=True)
class PI:
    """Play sum `y = p_0 v + sum p_i play_(r_i)[v]` (21).

    `thresholds`: r_0 = 0 < r_1 < ... < r_n in units of the input; `weights`: p_0 .. p_n, any finite numbers, in output
    per input unit; `initial_state`: one number or n+1 of them, projected to the admissible set (`projected` tells).
    Raises ValueError for anything else.
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
            raise ValueError(f"{len(thresholds)} thresholds but {len(weights)} weights")
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
    ) -> PI:
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

    def inverse(self) -> PI:
        """The analytic inverse, another play sum with thresholds z (36), weights q (37) and the start memory mapped.

        Raises NotInvertibleError.
        """
        problems = self.inverse_problems()
        if problems:
            raise NotInvertibleError(problems)
        p, r, c = self.weights, self.thresholds, self.slopes
        z = [math.fsum(p[g] * (r[i] - r[g]) for g in range(i)) for i in range(self.n + 1)]
        q = [1.0 / p[0], *(-p[i] / (c[i] * c[i - 1]) for i in range(1, self.n + 1))]
        return PI(z, q, tuple(memory.through(self.start, p).tolist()))

    def simulate(self, v: ArrayLike) -> Array:
        """Output for the input samples `v` (N,), from the start memory, in double precision."""
        return Cascade(pi=self).simulate(v)


class Stage(Protocol):
    """A memoryless part, strictly monotone where it can be inverted; `ascending` picks the branch."""

    @property
    def branches_differ(self) -> bool:
        """Whether the ascending and the descending branch are different curves."""

    def forward(self, x: ArrayLike, ascending: bool = True) -> Array:
        """Value of the branch at x."""

    def inverse(self, y: ArrayLike, ascending: bool = True, low: float = ..., high: float = ...) -> Array:
        """The x in [low, high] at which the branch has the value y."""

    def image(self, low: float, high: float, ascending: bool) -> tuple[float, float]:
        """Least and largest value over [low, high]."""

    def slope_range(self, low: float, high: float, ascending: bool) -> tuple[float, float]:
        """Least and largest slope over [low, high]."""

    def inverse_problems(self, low: float, high: float) -> list[str]:
        """Why the stage has no inverse over [low, high]."""


class Pieces(NamedTuple):
    """A piecewise straight map: breaks and the values there, and of each piece a point and the slope."""

    breaks: tuple[float, ...]
    values: tuple[float, ...]
    anchors: tuple[tuple[float, float], ...]
    slopes: tuple[float, ...]


@dataclass(frozen=True)
class DeadZone:
    """Dead-zone sum `w = eta_0 v + sum eta_j S_(rho_j)(v)` (41).

    `thresholds`: rho, strictly rising, containing 0; `weights`: eta, same length. Raises ValueError otherwise.
    """

    thresholds: Sequence[float]
    weights: Sequence[float]

    def __post_init__(self) -> None:
        thresholds = numbers(self.thresholds, "thresholds")
        weights = numbers(self.weights, "weights")
        if any(b <= a for a, b in itertools.pairwise(thresholds)) or 0.0 not in thresholds:
            raise ValueError("dead-zone thresholds rise strictly and contain 0")
        if len(weights) != len(thresholds):
            raise ValueError(f"{len(thresholds)} thresholds but {len(weights)} weights")
        object.__setattr__(self, "thresholds", thresholds)
        object.__setattr__(self, "weights", weights)

    @property
    def branches_differ(self) -> bool:
        """One curve for both directions."""
        return False

    @cached_property
    def breaks(self) -> tuple[float, ...]:
        """The places where the slope changes: all thresholds but 0."""
        return tuple(r for r in self.thresholds if r != 0.0)

    @cached_property
    def piece_slopes(self) -> tuple[float, ...]:
        """Slopes of the straight pieces, one more than there are breaks: the partial sums of the weights."""
        zero = self.thresholds.index(0.0)
        eta = self.weights
        left = [math.fsum(eta[j : zero + 1]) for j in range(zero)]
        right = [math.fsum(eta[zero : j + 1]) for j in range(zero + 1, len(eta))]
        return (*left, eta[zero], *right)

    @cached_property
    def anchors(self) -> tuple[tuple[float, float], ...]:
        """A point of each piece: its break next to zero, or the origin for the piece that contains it."""
        middle = sum(1 for b in self.breaks if b < 0)
        points = []
        for j in range(len(self.piece_slopes)):
            k = j if j < middle else j - 1
            points.append((0.0, self._value(0.0)) if j == middle else (self.breaks[k], self._values[k]))
        return tuple(points)

    def _value(self, x: float) -> float:
        if math.isinf(x):  # the end piece decides, its terms may cancel
            slope = self.piece_slopes[-1 if x > 0 else 0]
            return slope * x if slope else self.anchors[-1 if x > 0 else 0][1]
        rho, eta, least, most = self._terms
        return math.fsum((eta * np.clip(x - rho, least, most)).tolist())

    @cached_property
    def _terms(self) -> tuple[Array, Array, Array, Array]:
        """rho, eta, and the least and largest value of `x - rho` in each term."""
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
        """Value at x; both directions share it."""
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
        """The x in [low, high], where the map has to rise, that has the value y; beyond it the end pieces go on."""
        ends, anchors, slopes = self._inverses(low, high)
        values = np.asarray(y, dtype=np.float64)
        piece = np.searchsorted(ends, values, side="right")
        anchor = anchors[piece]
        return np.asarray(anchor[..., 0] + (values - anchor[..., 1]) / slopes[piece])

    def _inverses(self, low: float, high: float) -> tuple[Array, Array, Array]:
        """Values at the breaks, anchors and slopes of `over` as arrays, made once for each range."""
        if (low, high) not in self._inverted:
            kept = self.over(low, high)
            self._inverted[low, high] = np.array(kept.values), np.array(kept.anchors), np.array(kept.slopes)
        return self._inverted[low, high]

    @cached_property
    def _inverted(self) -> dict[tuple[float, float], tuple[Array, Array, Array]]:
        return {}

    def over(self, low: float, high: float) -> Pieces:
        """The straight pieces that [low, high] touches; the first and the last go on beyond it."""
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
        """Least and largest value over [low, high]; they lie at the ends or at breaks."""
        inside = slice(bisect.bisect_right(self.breaks, low), bisect.bisect_left(self.breaks, high))
        values = (self._value(low), self._value(high), *self._values[inside])
        return min(values), max(values)

    def slope_range(self, low: float, high: float, ascending: bool = True) -> tuple[float, float]:
        """Least and largest slope of the pieces that [low, high] touches."""
        slopes = [self.piece_slopes[j] for j in self._pieces(low, high)]
        return min(slopes), max(slopes)

    def inverse_problems(self, low: float, high: float) -> list[str]:
        """The pieces inside [low, high] whose partial sum of weights is not positive."""
        edges = (-math.inf, *self.breaks, math.inf)
        return [
            f"the dead-zone weights sum to {self.piece_slopes[j]:.6g} between {max(edges[j], low):.6g} and "
            f"{min(edges[j + 1], high):.6g}, every partial sum with eta_0 has to be positive"
            for j in self._pieces(low, high)
            if not self.piece_slopes[j] > 0.0
        ]


Branch = tuple[float, float, float, float]


@dataclass(frozen=True)
class TanhEnvelope:
    """Envelope `a0 tanh(a1 x + a2) + a3` with an ascending and a descending branch (45)-(47).

    Each branch is (a0, a1, a2, a3) with a0 a1 > 0; `descending` defaults to `ascending`. Raises ValueError otherwise.
    """

    ascending: Branch
    descending: Branch | None = None

    def __post_init__(self) -> None:
        for name, value in (("ascending", self.ascending), ("descending", self.descending or self.ascending)):
            branch = numbers(value, f"the {name} branch's a0 .. a3")
            if len(branch) != 4 or not branch[0] * branch[1] > 0.0:
                raise ValueError(f"the {name} branch has four numbers a0 .. a3 with a0 a1 > 0")
            object.__setattr__(self, name, branch)

    @property
    def branches_differ(self) -> bool:
        """Whether the two branches are different curves."""
        return self.ascending != self.descending

    def branch(self, ascending: bool) -> Branch:
        """(a0, a1, a2, a3) of one branch."""
        return self.ascending if ascending or self.descending is None else self.descending

    def forward(self, x: ArrayLike, ascending: bool = True) -> Array:
        """Value of the branch at x. A single float is computed alike on every machine."""
        a0, a1, a2, a3 = self.branch(ascending)
        if isinstance(x, float):
            tables = kernels.tanh_tables(np.float64)
            return np.asarray(a0 * float(kernels.tanh(np.float64(a1 * x + a2), tables)) + a3)
        return np.asarray(a0 * np.tanh(a1 * np.asarray(x, dtype=np.float64) + a2) + a3)

    def inverse(
        self, y: ArrayLike, ascending: bool = True, low: float = -math.inf, high: float = math.inf
    ) -> Array:
        """The x at which the branch is y (58); values the branch never reaches are taken as its last reachable ones."""
        a0, a1, a2, a3 = self.branch(ascending)
        edge = float(np.nextafter(1.0, 0.0))
        if isinstance(y, float):
            tables = kernels.atanh_tables(np.float64)
            argument = min(max((y - a3) / a0, -edge), edge)
            return np.asarray((float(kernels.atanh(np.float64(argument), tables)) - a2) / a1)
        arguments = np.clip((np.asarray(y, dtype=np.float64) - a3) / a0, -edge, edge)
        return np.asarray((np.arctanh(arguments) - a2) / a1)

    def image(self, low: float, high: float, ascending: bool) -> tuple[float, float]:
        """Value at the ends: the branch rises everywhere."""
        return float(self.forward(float(low), ascending)), float(self.forward(float(high), ascending))

    def slope_range(self, low: float, high: float, ascending: bool) -> tuple[float, float]:
        """`a0 a1 / cosh(a1 x + a2)^2` is largest where the argument is nearest to zero."""
        a0, a1, a2, _ = self.branch(ascending)
        ends = sorted((a1 * low + a2, a1 * high + a2))
        nearest = min(max(0.0, ends[0]), ends[1])
        tables = kernels.tanh_tables(np.float64)

        def slope(argument: float) -> float:
            t = float(kernels.tanh(np.float64(argument), tables))
            return a0 * a1 * (1.0 - t) * (1.0 + t)

        return min(slope(ends[0]), slope(ends[1])), slope(nearest)

    def inverse_problems(self, low: float, high: float) -> list[str]:
        """Slopes that vanish in double precision: the range lies beyond what the envelope can tell apart."""
        return [
            f"the {'ascending' if up else 'descending'} envelope is flat to double precision within "
            f"{low:.6g} to {high:.6g}; narrow input_range"
            for up in ((True, False) if self.branches_differ else (True,))
            if not self.slope_range(low, high, up)[0] > 0.0
        ]


def directions(v: Array, ascending: bool) -> NDArray[np.bool_]:
    """Whether the drive rises at each sample; where it stands still the last direction, at first `ascending`."""
    moved = np.diff(v, prepend=v[:1])
    last = np.maximum.accumulate(np.where(moved != 0.0, np.arange(len(v)), -1))
    return np.asarray(np.where(last >= 0, moved[np.maximum(last, 0)] > 0.0, ascending))


def through_stages(stages: Sequence[Stage], v: Array, rising: NDArray[np.bool_] | None) -> Array:
    """`w = G[v]` sample by sample; `rising` may be None where no stage has two branches."""
    w = v
    for stage in stages:
        if stage.branches_differ:
            assert rising is not None
            w = np.where(rising, stage.forward(w, True), stage.forward(w, False))
        else:
            w = stage.forward(w)
    return np.ascontiguousarray(w)


UNBOUNDED = (-math.inf, math.inf)


@dataclass(frozen=True)
class Cascade:
    """The actuator: `y = PI[G[v]] + output_offset` (39), `G` the stages in order from the drive.

    `input_range`: the drive it is used in (two numbers, or unbounded). `simulate` runs it, `inverse` gives the
    compensator.
    """

    pi: PI
    stages: tuple[Stage, ...] = ()
    output_offset: float = 0.0
    input_range: tuple[float, float] = UNBOUNDED

    @property
    def branches_differ(self) -> bool:
        """Whether the direction of the drive matters."""
        return any(stage.branches_differ for stage in self.stages)

    def front(self, v: ArrayLike, ascending: bool = True) -> Array:
        """`w = G[v]` on one branch of every stage."""
        w = v if isinstance(v, float) else np.asarray(v, dtype=np.float64)
        for stage in self.stages:
            w = stage.forward(w if not isinstance(v, float) else float(w), ascending)
        return np.asarray(w)

    def front_inverse(self, w: ArrayLike, ascending: bool = True) -> Array:
        """`v = G^-1[w]` on one branch, stages in reverse order."""
        v = w if isinstance(w, float) else np.asarray(w, dtype=np.float64)
        for stage, (low, high) in zip(reversed(self.stages), reversed(self.stage_ranges(ascending)), strict=True):
            v = stage.inverse(v if not isinstance(w, float) else float(v), ascending, low, high)
        return np.asarray(v)

    def stage_ranges(self, ascending: bool) -> tuple[tuple[float, float], ...]:
        """The input range of every stage when the drive stays inside `input_range`."""
        return self._stage_ranges[ascending]

    @cached_property
    def _stage_ranges(self) -> dict[bool, tuple[tuple[float, float], ...]]:
        found = {}
        for ascending in (True, False):
            ranges = []
            low, high = self.input_range
            for stage in self.stages:
                ranges.append((low, high))
                low, high = stage.image(low, high, ascending)
            found[ascending] = tuple(ranges)
        return found

    @property
    def stage_spans(self) -> list[tuple[float, float]]:
        """The input range of every stage, over both branches of those before it."""
        both = zip(self.stage_ranges(True), self.stage_ranges(False), strict=True)
        return [(min(a[0], b[0]), max(a[1], b[1])) for a, b in both]

    @cached_property
    def play_range(self) -> tuple[float, float]:
        """Least and largest input of the plays, over both branches."""
        ends = []
        for ascending in (True, False):
            low, high = self.input_range
            for stage in self.stages:
                low, high = stage.image(low, high, ascending)
            ends.append((low, high))
        return min(e[0] for e in ends), max(e[1] for e in ends)

    @cached_property
    def output_range(self) -> tuple[float, float]:
        """Extremes of the output over every drive history inside `input_range` from the start memory.

        The straight way to an end of the range leaves every play at its extreme, so that the ends are attained.
        """
        low, high = (self._after(w) for w in self.play_range)
        return low, high

    @cached_property
    def reset_range(self) -> tuple[float, float]:
        """Extremes of the output over every drive history inside `input_range` when all plays begin at 0."""
        low, high = (self._after(w, start=(0.0,) * (self.pi.n + 1)) for w in self.play_range)
        return low, high

    @cached_property
    def swung(self) -> tuple[float, float]:
        """The output at either end of `input_range` after the other end: inside `output_range`, or right at its ends.

        References between an end of that and this need a drive out of range, once the drive has been at the other end.
        Where plays that begin at 0, as after a reset, need it for more references, theirs count.
        """
        low, high = self.play_range
        starts = (self.pi.start, (0.0,) * (self.pi.n + 1))
        return (
            max(self._after(high, low, start=start) for start in starts),
            min(self._after(low, high, start=start) for start in starts),
        )

    def _after(self, *drives: float, start: Sequence[float] | None = None) -> float:
        """The output when the plays have been led from their start memory to inputs, one after the other.

        In fractions: an offset may cancel most of the sum, and limits are rounded inward from here.
        """
        thresholds = [Fraction(r) for r in self.pi.thresholds]
        states = [Fraction(s) for s in (self.pi.start if start is None else start)]
        for w in map(Fraction, drives):
            states = [min(max(s, w - r), w + r) for s, r in zip(states, thresholds, strict=True)]
            states[0] = w
        weights = [Fraction(p) for p in self.pi.weights]
        total = sum((p * s for p, s in zip(weights, states, strict=True)), Fraction(self.output_offset))
        return float(total)

    @property
    def start_is_defined(self) -> bool:
        """Whether `G_R^-1`, and with it the drive that a start memory stands for, is unique."""
        pairs = zip(self.stages, self.stage_ranges(True), strict=True)
        return not any(stage.inverse_problems(*ends) for stage, ends in pairs if isinstance(stage, DeadZone))

    @cached_property
    def branch_gap(self) -> float:
        """Bound of how far the branches of G lie apart within `input_range`; 0 with one branch.

        Both rise, so that between two drives a < b they are nowhere farther apart than L(b) - R(a).
        """
        if not self.branches_differ:
            return 0.0
        low, high = self.input_range
        drives = [low + (high - low) * i / 512 for i in range(513)]
        up = [float(self.front(v, True)) for v in drives]
        down = [float(self.front(v, False)) for v in drives]
        return max(max(down[i + 1] - up[i], up[i + 1] - down[i]) for i in range(512))

    @cached_property
    def front_slopes(self) -> tuple[float, float]:
        """Bounds of the slope of G over `input_range`, over both branches."""
        bounds = []
        for ascending in (True, False):
            least, most = 1.0, 1.0
            for stage, (low, high) in zip(self.stages, self.stage_ranges(ascending), strict=True):
                a, b = stage.slope_range(low, high, ascending)
                least, most = least * a, most * b
            bounds.append((least, most))
        return min(b[0] for b in bounds), max(b[1] for b in bounds)

    @cached_property
    def slope_ratio(self) -> float:
        """Largest slope of the model over its smallest: how much the inverse can amplify a relative error."""
        least = self.front_slopes[0] * min(self.pi.slopes)
        most = self.front_slopes[1] * max(self.pi.slopes)
        return most / least if least > 0.0 else math.inf

    @cached_property
    def _inverse_problems(self) -> tuple[str, ...]:
        problems = self.pi.inverse_problems()
        for ascending in (True, False) if self.branches_differ else (True,):
            for stage, (low, high) in zip(self.stages, self.stage_ranges(ascending), strict=True):
                problems += [p for p in stage.inverse_problems(low, high) if p not in problems]
        if not problems and self.branches_differ:
            problems += self._branch_problems()
        return tuple(problems)

    def inverse_problems(self) -> list[str]:
        """Why there is no inverse over `input_range`; empty when there is one."""
        return list(self._inverse_problems)

    def _branch_problems(self) -> list[str]:
        """Where the descending branch runs below the ascending one: there the inverse would step the wrong way."""
        low, high = self.input_range
        if not (math.isfinite(low) and math.isfinite(high)):
            return ["with two branches the input range has to be finite"]
        v = np.linspace(low, high, 20001)
        up, down = self.front(v, True), self.front(v, False)
        slack = 8.0 * np.finfo(np.float64).eps * np.maximum(np.abs(up), np.abs(down))
        wrong = np.concatenate([[False], down < up - slack, [False]])
        starts = np.flatnonzero(~wrong[:-1] & wrong[1:])
        ends = np.flatnonzero(wrong[:-1] & ~wrong[1:]) - 1
        return [
            f"the descending envelope lies below the ascending one for drives between {v[a]:.6g} and {v[b]:.6g}, "
            "by up to "
            f"{float(np.max(up[a : b + 1] - down[a : b + 1])):.6g}; the inverse needs descending >= ascending over "
            "the whole input_range"
            for a, b in zip(starts, ends, strict=True)
        ]

    def simulate(self, v: ArrayLike, clamp: bool = False) -> Array:
        """Output for the drive samples `v` (N,) from the start memory, in double; `clamp` limits the drive."""
        from hystgen import simulation

        return simulation.simulate(self, v, clamp=clamp)

    def inverse(self) -> InverseCascade:
        """The compensator `v = G^-1[PI^-1[u]]` (48). Raises NotInvertibleError."""
        problems = self.inverse_problems()
        if problems:
            raise NotInvertibleError(problems)
        return InverseCascade(self)


@dataclass(frozen=True)
class InverseCascade:
    """The compensator of a cascade: reference in, drive out."""

    forward: Cascade

    def inverse(self) -> Cascade:
        """The model that this compensates."""
        return self.forward

    def simulate(self, u: ArrayLike, clamp: bool = False) -> Array:
        """Drive for the reference samples `u` (N,), in double precision; `clamp` keeps it inside `input_range`."""
        from hystgen import simulation

        return simulation.simulate_inverse(self.forward, u, clamp=clamp)
