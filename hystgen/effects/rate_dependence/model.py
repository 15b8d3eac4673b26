"""Plays that depend on the rate of their input."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from hystgen.basics import parallel
from hystgen.basics.quantities import MAX_PLAYS, NotNegative, Positive
from hystgen.effects import recursions
from hystgen.effects.base import (
    About,
    Array,
    Candidate,
    Compensated,
    Effect,
    Place,
    Problem,
    Run,
    from_zero,
    not_one_a_play,
    without_plays,
)
from hystgen.plays import operators

Places = NDArray[np.intp]

LARGE, TOGETHER = 10_000, 4
"""Samples of plays with a nonlinear dashpot from which on threads share them, and plays that one takes at a time."""


class _RateDependence(Effect):
    name: Literal["rate_dependence"] = Field(description="name of the effect")

    place: ClassVar[Place] = Place.PLAYS

    def problems(self, thresholds: tuple[float, ...] | None) -> Iterator[Problem]:
        """There are plays to depend on the rate."""
        yield from without_plays(thresholds)

    @abstractmethod
    def follow(self, chosen: Places, w: Array, run: Run, thresholds: Array, start: Array, out: Array) -> None:
        """Write the plays of these numbers, all above 0, into rows (len(chosen), N)."""

    def plays(self, w: Array, run: Run, thresholds: Array, start: Array) -> Array:
        """The drive itself, and the plays."""
        out = np.empty((len(thresholds), len(w)))
        out[0] = w
        self.follow(np.arange(1, len(thresholds)), w, run, thresholds, start, out[1:])
        return out

    def summed(self, p: Array, w: Array, run: Run, thresholds: Array, start: Array) -> Array:
        """The sum of those that have a weight."""
        chosen = 1 + np.flatnonzero(p[1:])
        rows = np.empty((1 + len(chosen), len(w)))
        rows[0] = w
        self.follow(chosen, w, run, thresholds, start, rows[1:])
        return operators.weighted_sum(np.append(p[0], p[chosen]), rows)


class ThresholdRate(_RateDependence):
    """Thresholds that grow with the rate of the plays' input: `r_i + beta_i |w'|`.

    Al Janaideh, Krejci: Inverse rate-dependent Prandtl-Ishlinskii model for feedforward compensation of hysteresis in a
    piezomicropositioning actuator, IEEE/ASME Trans. Mechatronics 18, 2013; here linear in the rate. `w'` at a sample is
    the slope from the sample before, 0 at the first. The drive itself (weight p_0) takes no part.
    """

    shape: Literal["threshold"] = Field(default="threshold", description="thresholds grow with the rate")
    betas: Annotated[tuple[NotNegative, ...], Field(min_length=1, max_length=MAX_PLAYS)] = Field(
        description="beta_1 .. beta_n, s, one for each threshold but r_0", examples=[[0.001, 0.002]]
    )

    compensated: ClassVar[Compensated] = "exact"
    compensation: ClassVar[str] = (
        "exact for betas below half a sample time; beyond, relaxing plays stand in, which lag as far behind on ramps"
    )

    def problems(self, thresholds: tuple[float, ...] | None) -> Iterator[Problem]:
        """One beta a play."""
        yield from super().problems(thresholds)
        yield from not_one_a_play("betas", self.betas, thresholds)

    def remarks(self, thresholds: tuple[float, ...]) -> list[str]:
        """The rate from which the thresholds are no longer in order, where beta falls along them."""
        gaps, falls = np.diff(thresholds[1:]), -np.diff(self.betas)
        closing = falls > 0.0
        if not np.any(closing):
            return []
        return [f"thresholds stay in order up to |w'| = {np.min(gaps[closing] / falls[closing]):.6g} a second"]

    def follow(self, chosen: Places, w: Array, run: Run, thresholds: Array, start: Array, out: Array) -> None:
        """Plays with a dynamic threshold."""
        with np.errstate(over="ignore"):
            slope = np.minimum(np.abs(np.diff(w)) / run.steps, 1e300)
        rate = np.concatenate([[0.0], slope])
        betas = np.array(self.betas)[chosen - 1]
        recursions.dilated_plays(w, rate, thresholds[chosen], betas, start[chosen], out)

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """The same beta for all plays, beta in proportion to r, and a straight line over r."""
        if len(about.thresholds) < 2:
            return []
        r = np.asarray(about.thresholds[1:]) / about.thresholds[-1]
        unit = about.thresholds[-1] / max(about.fastest, 1e-12)

        def shape(label: str, *courses: Array) -> Candidate:
            table = unit * np.array(courses)

            def build(x: Array) -> ThresholdRate:
                return cls(name="rate_dependence", betas=tuple((x @ table).tolist()))

            n = len(courses)
            return Candidate(label, np.zeros(n), np.full(n, 3.0), np.full(n, 0.1), build, np.zeros(n))

        even = np.ones(len(r))
        return [
            shape("rate dependence, thresholds, one beta", even),
            shape("rate dependence, thresholds, beta in proportion to r", r),
            shape("rate dependence, thresholds, beta falling or rising with r", 1.0 - r, r),
        ]


class RelaxingPlays(_RateDependence):
    """Plays that follow viscously: `z' = dz_r(w - z)/tau`, `dz_r` what of its argument lies beyond +/- r.

    A dashpot beside the dry friction of every play; for tau = 0 the play itself. With `exponent` m the dashpot is
    nonlinear: `z' = (r_n/tau) sign(d) (|d|/r_n)^m`, `d = dz_r(w - z)`, r_n the largest threshold. Over straight `w` the
    linear case is exact, contacts within a step included; the nonlinear one is integrated to about 1e-6 of r_n a step.
    """

    shape: Literal["relaxation"] = Field(description="plays that follow viscously")
    time_constant: NotNegative = Field(description="tau, s; 0 is no delay of the plays", examples=[1.0e-3])
    exponent: Annotated[Positive, Field(ge=0.1, le=10.0)] = Field(
        default=1.0, description="m, 1 for a linear dashpot; 0.1 to 10"
    )

    compensated: ClassVar[Compensated] = "exact"
    compensation: ClassVar[str] = "exact: one equation a sample is solved"

    def follow(self, chosen: Places, w: Array, run: Run, thresholds: Array, start: Array, out: Array) -> None:
        """Viscous plays."""
        if self.time_constant == 0.0:
            out[:] = operators.plays(w, thresholds[chosen], start[chosen])
            return
        about = (self.time_constant, self.exponent, float(thresholds[-1]))
        starts = start[chosen]

        def move(some: slice) -> None:
            recursions.relaxing_plays(w, run.steps, thresholds[chosen[some]], *about, starts[some], out[some])

        if self.exponent == 1.0 or out.size < LARGE:
            move(slice(None))
        else:
            parallel.in_threads(move, [slice(k, k + TOGETHER) for k in range(0, len(chosen), TOGETHER)])

    @classmethod
    def candidates(cls, about: About) -> list[Candidate]:
        """The time constant alone, then with the exponent."""
        if len(about.thresholds) < 2:
            return []
        low, high, start, value = from_zero(0.1 * about.sample_time, about.duration, about.sample_time)

        def linear(x: Array) -> RelaxingPlays:
            return cls(name="rate_dependence", shape="relaxation", time_constant=value(float(x[0])))

        def bent(x: Array) -> RelaxingPlays:
            return linear(x).model_copy(update={"exponent": float(10.0 ** x[1])})

        others = tuple(x for decades in (1.0, 2.0, 3.0) if (x := start + decades) < high)
        straight = Candidate("rate dependence, relaxation", low, high, start, linear, np.zeros(1), others)
        return [
            straight,
            Candidate(
                f"{straight.label} with exponent",
                np.append(low, -0.6), np.append(high, 0.6), np.append(start, 0.0), bent, none=np.zeros(2),
                beyond=straight.label, grown=lambda x: np.append(x, 0.0),
            ),
        ]  # fmt: skip


SHAPES = (ThresholdRate, RelaxingPlays)
