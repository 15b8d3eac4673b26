"""Plays whose loops depend on their position: minor loops between the same ends are not congruent."""

from __future__ import annotations

import itertools
from abc import abstractmethod
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from hystgen.basics.quantities import MAX_PLAYS, Number, Positive
from hystgen.effects.base import (
    About,
    Array,
    Candidate,
    Compensated,
    Effect,
    Place,
    Problem,
    curve,
    not_one_a_play,
    span,
    without_plays,
)

MAX_TERMS = 8
"""Maximum number of coefficients per play: records determine two (`CUBIC`); powers beyond the ninth hardly differ."""

CUBIC = "noncongruent, cubic"

PLACES = 101
"""Number of positions tried for a starting bump, hundredths of the range apart."""

LEAST, MOST = -10.0, 40.0
"""[tenths] Bounds of the coefficients of play functions at the largest drive. The density is 1 where a play is at 0:
one that rises evenly from 20 to 180 % of its mean ends at 9, with a coefficient of 40. Changed by: second_plants single
(noncongruent)."""

LOWEST, HIGHEST = -0.8, 2.5
"""Smallest and largest amplitude of a bump from which a search starts."""

EVEN = 1e-6
"""[relative] A density that falls below its ends as far as it rises above them, to within this, counts as a bump."""


class _Noncongruent(Effect):
    name: Literal["noncongruent"] = Field(description="name of the effect")

    place: ClassVar[Place] = Place.PLAYS
    shown_by: ClassVar[Mapping[str, int]] = {"slow_minor": 1, "fast_minor": 3, "reversals": 3, "slow_reversals": 5}
    order: ClassVar[int] = 1
    timed: ClassVar[bool] = False
    pointwise: ClassVar[bool] = True
    compensated: ClassVar[Compensated] = "exact"
    compensation: ClassVar[str] = "exact: one equation per sample is solved"

    def problems(self, thresholds: tuple[float, ...] | None) -> Iterator[Problem]:
        """A problem unless the model has plays to bend."""
        yield from without_plays(thresholds)

    @abstractmethod
    def bend(self, i: int, row: Array, thresholds: Array, weight: float, total: Array) -> None:
        """Add `weight` times the change that bending makes to play `i` > 0 to `total` (N,)."""

    @abstractmethod
    def bent(self, rows: Array, thresholds: Array) -> Array:
        """The drive itself, and the bent plays."""

    def bent_sum(self, p: Array, rows: Array, thresholds: Array) -> Array:
        """The sum of the bent plays; plays of weight 0 need not be bent."""
        total: Array = p @ rows
        for i in range(1, len(rows)):
            if p[i] != 0.0:
                self.bend(i, rows[i], thresholds, float(p[i]), total)
        return total


class PlayFunctions(_Noncongruent):
    """Play functions `sum p_i g_i(play_i)`, `g_i(s) = s + r_n sum_k c_ik xi^k`, `xi = s/r_n`, k = 2, 3, ...

    r_n is the largest threshold; the drive itself (weight p_0) is not bent. Every Preisach operator is such a sum of
    functions of plays (Brokate, Sprekels, Hysteresis and Phase Transitions, 1996).
    """

    shape: Literal["play_functions"] = Field(default="play_functions", description="a polynomial a play")
    coefficients: Annotated[
        tuple[Annotated[tuple[Number, ...], Field(min_length=1, max_length=MAX_TERMS)], ...],
        Field(min_length=1, max_length=MAX_PLAYS),
    ] = Field(
        description="a list for each threshold but r_0: coefficients of xi^2, xi^3, ..",
        examples=[[[0.05], [0.02, 0.01]]],
    )

    def problems(self, thresholds: tuple[float, ...] | None) -> Iterator[Problem]:
        """A problem unless there is one list for each play."""
        yield from super().problems(thresholds)
        yield from not_one_a_play("coefficients", self.coefficients, thresholds, "list")

    def bend(self, i: int, row: Array, thresholds: Array, weight: float, total: Array) -> None:
        """The amount that its polynomial adds to a play."""
        curve(row, float(thresholds[-1]), np.array(self.coefficients[i - 1]), weight, total)

    def bent(self, rows: Array, thresholds: Array) -> Array:
        """The drive itself, and the bent plays: all at once, since a compensator bends them sample by sample."""
        out = np.array(rows)
        xi = out[1:] / thresholds[-1]
        value = np.zeros_like(xi)
        for c in reversed(list(itertools.zip_longest(*self.coefficients[: len(xi)], fillvalue=0.0))):
            value = np.array(c)[:, None] + value * xi
        out[1:] += thresholds[-1] * xi * xi * value
        return out

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """The same parabola for all plays; then a cubic term, which may vary linearly over r; then a quartic one."""
        plays = len(about.thresholds) - 1
        if plays < 1:
            return []
        # of order one at the largest xi of the drive
        largest = max(1.0, max(map(abs, about.drive)) / about.thresholds[-1])

        share = np.array(about.thresholds[1:]) / about.thresholds[-1]

        def candidate(label: str, terms: int, *courses: Array, **more: Any) -> Candidate:
            def build(x: Array) -> PlayFunctions:
                table = 0.1 * x.reshape(len(courses), terms) / largest ** np.arange(1, terms + 1)
                rows = np.array(courses).T @ table
                return cls(name="noncongruent", coefficients=tuple(map(tuple, rows.tolist())))

            n = terms * len(courses)
            zero = np.zeros(n)
            return Candidate(label, np.full(n, LEAST), np.full(n, MOST), zero, build, zero, **more)

        even = np.ones(plays)
        return [
            candidate("noncongruent, parabola", 1, even),
            candidate(CUBIC, 2, even),
            candidate(
                "noncongruent, cubic over r", 2, 1.0 - share, share, beyond=CUBIC, grown=lambda x: np.tile(x, 2)
            ),
            candidate("noncongruent, quartic", 3, even, beyond=CUBIC, grown=lambda x: np.append(x, 0.0)),
        ]


class LoopCentre(_Noncongruent):
    """Preisach density that depends on the centre of a relay's loop: `p_i (1 + A sech^2((c - centre)/width))`.

    A play is the sum of relays of its half width over all centres c below its state (Brokate, Sprekels, Hysteresis and
    Phase Transitions, 1996), so the density makes every play `g(s) = s + A width (tanh((s - centre)/width) +
    tanh(centre/width))`. The drive itself (weight p_0) has no relays and is not bent.
    """

    shape: Literal["centre"] = Field(description="Preisach density that depends on the loop's centre")
    amplitude: Annotated[Number, Field(gt=-1.0)] = Field(
        description="A, relative increase of the density at `centre`; above -1", examples=[0.2]
    )
    centre: Number = Field(description="centre of the bump, input units of the plays", examples=[50.0])
    width: Positive = Field(description="width of the bump, input units of the plays", examples=[20.0])

    def bend(self, i: int, row: Array, thresholds: Array, weight: float, total: Array) -> None:
        """The amount that the density's integral adds to a play."""
        bump = np.tanh((row - self.centre) / self.width) + np.tanh(self.centre / self.width)
        total += weight * self.amplitude * self.width * bump

    def bent(self, rows: Array, thresholds: Array) -> Array:
        """The drive itself, and the bent plays, which all have the same curve."""
        out = np.array(rows)
        self.bend(1, rows[1:], thresholds, 1.0, out[1:])
        return out

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """Amplitude, centre within the drive range, width; tried if a cubic explains part of the error. A search starts
        at the bump of the cubic's density: from far away it would not find the position.
        """
        if len(about.thresholds) < 2:
            return []
        low, high = about.drive
        wide = high - low
        ends = span(0.05 * wide, 2.0 * wide)
        start = float(np.log10(0.4 * wide))

        def build(x: Array) -> LoopCentre:
            return cls(
                name="noncongruent", shape="centre", amplitude=float(x[0]),
                centre=low + wide * float(x[1]), width=10.0 ** float(x[2]),
            )

        def grown(cubic: Array) -> Array:
            largest = max(map(abs, about.drive))
            at = np.linspace(low, high, PLACES)
            density = np.maximum(1.0 + 0.2 * cubic[0] * at / largest + 0.3 * cubic[1] * (at / largest) ** 2, 0.05)
            outside = 0.5 * float(density[0] + density[-1])
            above, below = int(np.argmax(density)), int(np.argmin(density))
            # the density can rise or fall evenly from end to end: rounding would then decide which extreme is farther
            # off
            k = above if density[above] - outside >= (1.0 - EVEN) * (outside - density[below]) else below
            amplitude = float(np.clip(density[k] / outside - 1.0, LOWEST, HIGHEST))
            return np.array([amplitude, k / (PLACES - 1), start])

        return [
            Candidate(
                "noncongruent, loop centre", np.array([-0.9, 0.0, ends[0]]), np.array([3.0, 1.0, ends[1]]),
                np.array([0.05, 0.5, start]), build, np.array([0.0, 0.5, start]), (), CUBIC, grown,
            )
        ]


SHAPES = (PlayFunctions, LoopCentre)
