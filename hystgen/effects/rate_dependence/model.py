"""Plays that depend on the rate of their input."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from hystgen.basics import parallel
from hystgen.basics.jit import jit
from hystgen.basics.quantities import MAX_PLAYS, NotNegative, Positive
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
from hystgen.plays.operators import followed

Places = NDArray[np.intp]

LARGE, TOGETHER = 10_000, 4
"""[samples, plays] From this many samples on, threads share the plays of a nonlinear dashpot, this many at a time."""

MOST_PIECES = 1000
"""Maximum number of pieces per step of a nonlinear relaxation."""

CLOSE = 1e-7
"""[largest thresholds] Error allowed per piece of a nonlinear relaxation."""

SLOW = 1.0
"""Largest fraction of a disturbance that friction removes in a piece computed by the Taylor series."""

NEARLY = 0.3
"""[fraction of a stretch] Largest change of a stretch in a piece that uses only the leading term of curvature."""

SLIGHT = 1e-4
"""Largest fraction of the speed lost to friction for which friction is integrated along the unperturbed motion."""


@jit
def dilated_plays(w: Array, rate: Array, r: Array, beta: Array, states: Array, out: Array) -> None:
    """Plays whose thresholds are `r + beta rate_k`, from `states`, into the rows of `out`."""
    # Four in parallel: a single recursion would stall on its previous sample
    fours = len(r) // 4 * 4
    for i in range(0, fours, 4):
        r0, r1, r2, r3 = r[i], r[i + 1], r[i + 2], r[i + 3]
        b0, b1, b2, b3 = beta[i], beta[i + 1], beta[i + 2], beta[i + 3]
        s0, s1, s2, s3 = states[i], states[i + 1], states[i + 2], states[i + 3]
        for k in range(len(w)):
            s0, s1 = followed(s0, w[k], r0 + b0 * rate[k]), followed(s1, w[k], r1 + b1 * rate[k])
            s2, s3 = followed(s2, w[k], r2 + b2 * rate[k]), followed(s3, w[k], r3 + b3 * rate[k])
            out[i, k], out[i + 1, k], out[i + 2, k], out[i + 3, k] = s0, s1, s2, s3
    for i in range(fours, len(r)):
        state = states[i]
        for k in range(len(w)):
            state = followed(state, w[k], r[i] + beta[i] * rate[k])
            out[i, k] = state


@jit
def mean_decay(x: float) -> float:
    """`(1 - exp(-x))/x`."""
    if x < 0.1:  # the series is equally exact and much faster
        return 1.0 - x * (0.5 - x * (1 / 6 - x * (1 / 24 - x * (1 / 120 - x * (1 / 720 - x * (1 / 5040 - x / 40320))))))
    return -math.expm1(-x) / x


@jit
def bent_decay(x: float) -> float:
    """`(1 - 2 x exp(-x) - exp(-2 x))/(2 x^3)`, or `int_0^x exp(s - x) (1 - exp(-s))^2 ds/(2 x^3)`."""
    if x < 0.1:
        return 1 / 6 - x * (1 / 6 - x * (11 / 120 - x * (13 / 360 - x * 57 / 5040)))
    decay = math.exp(-x)
    return (1.0 - decay * (2.0 * x + decay)) / (2.0 * x * x * x)


@jit
def taylor(e: float, c1: float, q0: float, m: float, step: float) -> tuple[float, float]:
    """Gain of `e` in a step of `e' = speed - q` with `q ~ e^m`: six Taylor terms from `c1` on, and the last of them.

    The terms `q_k` of q follow from `e q' = m q e'`; from the second on, the terms of e are `-step q_(k-1)/k`.
    """
    d = 1.0 / e
    q1 = m * c1 * q0 * d
    c2 = -step * q1 / 2
    q2 = ((m - 1) * c1 * q1 + 2 * m * c2 * q0) * d / 2
    c3 = step * q2 * (-1 / 3)
    q3 = ((m - 2) * c1 * q2 + (2 * m - 1) * c2 * q1 + 3 * m * c3 * q0) * d * (1 / 3)
    c4 = -step * q3 / 4
    q4 = ((m - 3) * c1 * q3 + (2 * m - 2) * c2 * q2 + (3 * m - 1) * c3 * q1 + 4 * m * c4 * q0) * d / 4
    c5 = step * q4 * (-1 / 5)
    q5 = (m - 4) * c1 * q4 + (2 * m - 3) * c2 * q3 + (3 * m - 2) * c3 * q2 + (4 * m - 1) * c4 * q1 + 5 * m * c5 * q0
    c6 = step * q5 * d * (-1 / 30)
    return c1 + (c2 + (c3 + (c4 + (c5 + c6)))), c6


@jit
def stretch(e: float, speed: float, duration: float, tau: float, exponent: float, scale: float) -> tuple[float, float]:
    """Stretch `e` after `duration` of `e' = speed - (scale/tau) (e/scale)^exponent`, and the time left at e = 0.

    The linear case is exact. Otherwise it is computed in pieces: by the equation's Taylor series where friction is
    slow, and where it is fast by a scheme that is exact for the equation linearised about `e` (exponential
    Rosenbrock-Euler) with the leading term of the curvature; each piece is as long as the truncation error allows.
    """
    if exponent == 1.0:
        final = e + (speed - e / tau) * duration * mean_decay(duration / tau)
        if final > 0.0 or speed >= 0.0:  # a slow rise may round to below zero
            return max(final, 0.0), 0.0
        taken = tau * math.log1p(e / (-speed * tau))
        return 0.0, duration - taken if taken < duration else 0.0
    left = duration
    step = left
    fall = scale / tau * (e / scale) ** exponent
    for _ in range(MOST_PIECES):
        if not fall < 1e200:
            return (0.0, 0.0) if speed >= 0.0 else (0.0, left)
        change = speed - fall
        if fall < 0.5 * SLIGHT * speed:  # the speed dominates
            little = scale * (SLIGHT * speed * tau / scale) ** (1.0 / exponent)
            taken = min((little - e) / speed, left)
            final = e + speed * taken
            e = final - (scale / tau * (final / scale) ** exponent * final - fall * e) / ((exponent + 1.0) * speed)
            left -= taken
            if not left > 0.0:
                break
            fall = scale / tau * (e / scale) ** exponent
            continue
        if not fall < 1e200 * e * e:  # relaxes at once, to almost nothing
            return 0.0, left if speed < 0.0 else 0.0
        slope = exponent * fall / e
        step = min(step, left)
        part = slope * step
        if part <= SLOW and abs(change) * step <= 0.5 * e:
            gain, last = taylor(e, change * step, fall, exponent, step)
            if abs(last) > CLOSE * scale:
                step *= 0.5
                continue
            e += gain
            left -= step
            if left <= 1e-12 * duration:
                break
            step *= 4.0
            fall = scale / tau * (e / scale) ** exponent
            continue
        gain = change * step * mean_decay(part)
        final = e + gain
        if speed == 0.0:
            final = max(final, 0.0)
        bend = slope / e
        end, after = 0.0, 0.0
        if abs(gain) > NEARLY * e:
            end = max(final, 0.1 * e)
            after = scale / tau * (end / scale) ** exponent
            bend = max(bend, exponent * after / end / end)
            wrong = step * gain * gain * bend * abs(exponent - 1.0) / 12.0
        else:  # the curvature about e adds its leading term
            more = (1.0 - exponent) * bend * change * change * bent_decay(part) * step * step * step
            final += more
            wrong = abs(more * gain) / e * (abs(exponent - 2.0) / 3.0 + 2.0 * abs(exponent - 1.0))
        if wrong > CLOSE * scale and (final > 0.0 or e > CLOSE * scale):
            step *= max(0.2, 0.9 * (CLOSE * scale / wrong) ** (1.0 / 3.0))
            continue
        if final < 0.0:
            share = slope * e / change
            taken = -e / change if part <= 1e-8 else -math.log1p(share) / slope if share > -1.0 else step
            return 0.0, max(left - min(taken, step), 0.0)
        e = final
        left -= step
        if left <= 1e-12 * duration or not e > 0.0:
            break
        step *= 4.0
        fall = after if e == end else scale / tau * (e / scale) ** exponent
    return e, 0.0


@jit
def relaxed(
    x: float, target: float, left: float, r: float, tau: float, exponent: float, scale: float, state: float
) -> float:
    """State of a viscous play after its input has moved from `x` to `target` in the time `left`.

    `z' = (scale/tau) (stretch/scale)^exponent` beyond the threshold.
    """
    speed = (target - x) / left
    side = 0.0
    if x - r - state > 0.0:
        side = 1.0
    elif state - r - x > 0.0:
        side = -1.0
    if side != 0.0:
        e, left = stretch(side * (x - state) - r, side * speed, left, tau, exponent, scale)
        if left > 0.0:  # the play has caught up, and the input is on its way back
            x = target - speed * left
            state = x - side * r
            side = 0.0
        else:
            state = target - side * (r + e)
    if side == 0.0 and left > 0.0 and target != x:
        way = 1.0 if target > x else -1.0
        beyond = way * (target - state) - r
        if beyond > 0.0:
            taken = left * min(beyond / (way * (target - x)), 1.0)
            e, _ = stretch(0.0, way * speed, taken, tau, exponent, scale)
            state = target - way * (r + e)
    return state


@jit
def relaxing_plays(
    w: Array, steps: Array, r: Array, tau: float, exponent: float, scale: float, states: Array, out: Array
) -> None:
    """Plays of thresholds `r` that follow their input viscously, from `states`, into the rows of `out`.

    In parallel, since a single recursion would stall on its previous sample.
    """
    for i in range(len(r)):
        states[i] = min(max(states[i], w[0] - r[i]), w[0] + r[i])
        out[i, 0] = states[i]
    for k in range(len(w) - 1):
        for i in range(len(r)):
            states[i] = relaxed(w[k], w[k + 1], steps[k], r[i], tau, exponent, scale, states[i])
            out[i, k + 1] = states[i]


class _RateDependence(Effect):
    name: Literal["rate_dependence"] = Field(description="name of the effect")

    place: ClassVar[Place] = Place.PLAYS
    shown_by: ClassVar[Mapping[str, int]] = {
        "fast_triangles": 1, "fast_minor": 1, "fast_reversals": 1, "settling": 2, "reversals": 2
    }
    rank: ClassVar[float] = 4

    def problems(self, thresholds: tuple[float, ...] | None) -> Iterator[Problem]:
        """A problem unless the model has plays with a threshold."""
        yield from without_plays(thresholds)

    @abstractmethod
    def follow(self, chosen: Places, w: Array, run: Run, thresholds: Array, start: Array, out: Array) -> None:
        """Write the plays with these indices, all above 0, into rows (len(chosen), N)."""

    def plays(self, w: Array, run: Run, thresholds: Array, start: Array) -> Array:
        """The drive itself, and the plays."""
        out = np.empty((len(thresholds), len(w)))
        out[0] = w
        self.follow(np.arange(1, len(thresholds)), w, run, thresholds, start, out[1:])
        return out

    def summed(self, p: Array, w: Array, run: Run, thresholds: Array, start: Array) -> Array:
        """The weighted sum, without plays of weight 0."""
        chosen = 1 + np.flatnonzero(p[1:])
        rows = np.empty((1 + len(chosen), len(w)))
        rows[0] = w
        self.follow(chosen, w, run, thresholds, start, rows[1:])
        return operators.weighted_sum(np.append(p[0], p[chosen]), rows)


class ThresholdRate(_RateDependence):
    """Thresholds that grow with the rate of the plays' input: `r_i + beta_i |w'|`.

    Al Janaideh, Krejci: Inverse rate-dependent Prandtl-Ishlinskii model for feedforward compensation of hysteresis in a
    piezomicropositioning actuator, IEEE/ASME Trans. Mechatronics 18, 2013; here linear in the rate. `w'` at a sample is
    the slope from the sample before, 0 at the first. The drive itself (weight p_0) does not depend on the rate.
    """

    shape: Literal["threshold"] = Field(default="threshold", description="thresholds grow with the rate")
    betas: Annotated[tuple[NotNegative, ...], Field(min_length=1, max_length=MAX_PLAYS)] = Field(
        description="beta_1 .. beta_n, s, one for each threshold but r_0", examples=[[0.001, 0.002]]
    )

    compensated: ClassVar[Compensated] = "exact"
    compensation: ClassVar[str] = (
        "exact for betas below half a sample time; beyond that, relaxing plays stand in, which lag as much on ramps"
    )

    def problems(self, thresholds: tuple[float, ...] | None) -> Iterator[Problem]:
        """A problem unless there is one beta for each play."""
        yield from super().problems(thresholds)
        yield from not_one_a_play("betas", self.betas, thresholds)

    def remarks(self, thresholds: tuple[float, ...]) -> list[str]:
        """The rate from which the thresholds are no longer in order, if beta decreases along them."""
        gaps, falls = np.diff(thresholds[1:]), -np.diff(self.betas)
        closing = falls > 0.0
        if not np.any(closing):
            return []
        return [f"thresholds stay in order up to |w'| = {np.min(gaps[closing] / falls[closing]):.6g} per second"]

    def time_scale(self, drive_range: float) -> float:
        """The largest beta: the plays lag as much as with a dashpot of that time constant."""
        return max(self.betas)

    def follow(self, chosen: Places, w: Array, run: Run, thresholds: Array, start: Array, out: Array) -> None:
        """Plays with a dynamic threshold."""
        with np.errstate(over="ignore"):
            slope = np.minimum(np.abs(np.diff(w)) / run.steps, 1e300)
        rate = np.concatenate([[0.0], slope])
        betas = np.array(self.betas)[chosen - 1]
        dilated_plays(w, rate, thresholds[chosen], betas, start[chosen], out)

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
    """Plays that follow viscously: `z' = dz_r(w - z)/tau`, `dz_r` the part of its argument beyond +/- r.

    Every play has a dashpot parallel to its dry friction; with tau = 0 it is an ordinary play. With `exponent` m the
    dashpot is nonlinear: `z' = (r_n/tau) sign(d) (|d|/r_n)^m`, `d = dz_r(w - z)`, r_n the largest threshold. For
    straight `w` the linear case is exact, including contacts within a step; the nonlinear one is within about 1e-6 of
    r_n per step.
    """

    shape: Literal["relaxation"] = Field(description="plays that follow viscously")
    time_constant: NotNegative = Field(description="tau, s; 0 for plays without delay", examples=[1.0e-3])
    exponent: Annotated[Positive, Field(ge=0.1, le=10.0)] = Field(
        default=1.0, description="m, 1 for a linear dashpot; 0.1 to 10"
    )

    compensated: ClassVar[Compensated] = "exact"
    compensation: ClassVar[str] = "exact: one equation per sample is solved"

    def time_scale(self, drive_range: float) -> float:
        """The time constant."""
        return self.time_constant

    def follow(self, chosen: Places, w: Array, run: Run, thresholds: Array, start: Array, out: Array) -> None:
        """Viscous plays."""
        if self.time_constant == 0.0:
            out[:] = operators.plays(w, thresholds[chosen], start[chosen])
            return
        about = (self.time_constant, self.exponent, float(thresholds[-1]))
        starts = start[chosen]

        def move(some: slice) -> None:
            relaxing_plays(w, run.steps, thresholds[chosen[some]], *about, starts[some], out[some])

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
        ]


SHAPES = (ThresholdRate, RelaxingPlays)


def load() -> None:
    """Compile the recursions, or load them from the cache, by running them on two samples."""
    w, one = np.arange(2.0), np.ones(1)
    dilated_plays(w, w, one, one, np.zeros(1), np.empty((1, 2)))
    relaxing_plays(w, one, one, 1.0, 1.0, 1.0, np.zeros(1), np.empty((1, 2)))
