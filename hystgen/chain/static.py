"""The static part of an actuator: memoryless stages, the play sum behind them, an offset and the drive range."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.front.dead_zone.model import DeadZone
from hystgen.front.stage import Stage
from hystgen.plays.play_sum import PlaySum

Array = NDArray[np.float64]


def directions(v: Array, ascending: bool) -> NDArray[np.bool_]:
    """Whether the drive rises at each sample; at rest its last direction counts, before its first move `ascending`."""
    moved = np.diff(v, prepend=v[:1])
    last = np.maximum.accumulate(np.where(moved != 0.0, np.arange(len(v)), -1))
    return np.asarray(np.where(last >= 0, moved[np.maximum(last, 0)] > 0.0, ascending))


def through_stages(stages: Sequence[Stage], v: Array, rising: NDArray[np.bool_] | None) -> Array:
    """`w = G[v]` sample by sample; `rising` may be None if no stage has two branches."""
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
class StaticModel:
    """The actuator: `y = PI[G[v]] + output_offset` (39), `G` the stages in order from the drive.

    `input_range`: the drive range in use (two numbers, or unbounded). `hystgen.Cascade` adds `simulate` and `inverse`.
    """

    pi: PlaySum
    stages: tuple[Stage, ...] = ()
    output_offset: float = 0.0
    input_range: tuple[float, float] = UNBOUNDED

    @property
    def branches_differ(self) -> bool:
        """Whether a stage has different branches for rising and falling drives."""
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
        """The input range of every stage while the drive stays inside `input_range`."""
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
        """The input range of every stage, over both branches of the stages before it."""
        both = zip(self.stage_ranges(True), self.stage_ranges(False), strict=True)
        return [(min(a[0], b[0]), max(a[1], b[1])) for a, b in both]

    @cached_property
    def play_range(self) -> tuple[float, float]:
        """Smallest and largest input of the plays, over both branches."""
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

        A single move to an end of the range takes every play to its extreme, so the output attains both values.
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
        """The output at each end of `input_range` after a move from the other end; never outside `output_range`.

        Once the drive has been at one end, references between the swung output at the other end and the limit of
        `output_range` there need a drive out of range. If plays that begin at 0, as after a reset, have a narrower
        range, theirs is used.
        """
        low, high = self.play_range
        starts = (self.pi.start, (0.0,) * (self.pi.n + 1))
        return (
            max(self._after(high, low, start=start) for start in starts),
            min(self._after(low, high, start=start) for start in starts),
        )

    def _after(self, *drives: float, start: Sequence[float] | None = None) -> float:
        """The output after the plays have moved from their start memory to the given inputs in turn.

        Computed in fractions, since an offset may cancel most of the sum and limits are rounded inward from the result.
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
        """Whether `G_R^-1`, and with it the drive of a start memory, is unique."""
        pairs = zip(self.stages, self.stage_ranges(True), strict=True)
        return not any(stage.inverse_problems(*ends) for stage, ends in pairs if isinstance(stage, DeadZone))

    @cached_property
    def branch_gap(self) -> float:
        """Bound on the distance between the branches of G within `input_range`; 0 with one branch.

        Both branches rise, so between two drives a < b they are at most L(b) - R(a) apart.
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
        """Bounds on the slope of G within `input_range`, over both branches."""
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
        """Ratio of the largest slope to the smallest: the factor by which the inverse can amplify a relative error."""
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
        """Reasons why there is no inverse over `input_range`; empty if there is one."""
        return list(self._inverse_problems)

    def _branch_problems(self) -> list[str]:
        """Ranges in which the descending branch lies below the ascending one: there the inverse moves the wrong way."""
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
