"""Rounding-error bounds of a compiled operator against the exact model, derived once for every model.

Forward, loop engine: rounded thresholds, start memory and stage constants shift a play by no more than their own error,
because a play never amplifies a difference in its input, threshold or start value (3); sums and products add their unit
roundoffs (`LoopRoundings`).

Corner engine: an answer is computed from the corner below it, which is itself an earlier answer, so the roundings of up
to n + 1 corners and of the answer add up. `CornerRoundings` counts the roundings of one answer.

Inverse: the drive as sent is an exact input of the exact model, whose output then differs from the reference by a
residual eta. This requires a solution to stop where the next play would begin to follow: on the linear piece up to that
point, of slope P_k, an output error eta becomes eta / P_k in w; beyond it, that error in w would meet a steeper slope.
The loop engine stops at that point; the corner engine switches to the steeper piece early, by the largest rounding
error. Neither answers a move with one in the opposite direction: plays that follow after such a turn would have the
same effect. The exact inverse turns a reference error eta into at most `(2/p_0 - 1/C_n) eta` at the input of the plays
(the sum of |q_i|), and the front divides that by its smallest slope. Clamps and commits affect both equally.

With two branches, two drives can give the same output, one on each branch, and rounding decides between them if the
reference moves by less than a rounding error. Both outputs are within the bound; the drives then differ by the gap
between the branches, which affects the present input of the plays and their memory; the bound includes this. The first
move starts from the drive of the start memory, G_R^-1(s_0), which may not be representable in the type. The forward
operator knows on which side of this drive every other one lies, up to the rounding of G_R^-1 in double precision.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hystgen.chain.static import StaticModel
from hystgen.front.dead_zone.model import DeadZone
from hystgen.front.stage import Stage
from hystgen.front.tanh import kernels
from hystgen.front.tanh.model import TanhEnvelope

UNSLEWED = "no slew limit acts"
"""A condition on a bound, in words."""

SECOND_ORDER = 1.01  # products of roundoffs, and the rounding of this computation itself


@dataclass(frozen=True)
class ErrorBounds:
    """Largest differences from the exact model: `forward` in output units, `inverse` in drive units (inf: no inverse).

    `rounding` is the part of `inverse` that remains when the C and the exact model take the same branch.
    """

    forward: float
    inverse: float
    rounding: float


def together(*conditions: str) -> str:
    """Join conditions that must all hold, in words; empty ones are dropped."""
    *others, last = [each for each in conditions if each] or [""]
    return f"{', '.join(others)} and {last}" if others else last


def largest_sum(cascade: StaticModel) -> float:
    """Bound on every partial result of a play sum: sum |p_i| max |w| + sum |p_i| r_i."""
    pi = cascade.pi
    total = math.fsum(abs(p) for p in pi.weights)
    lift = math.fsum(abs(p) * r for p, r in zip(pi.weights, pi.thresholds, strict=True))
    w = max(*(abs(end) for end in cascade.play_range), *(abs(s) for s in pi.start))
    return total * w + lift


def _stage_errors(
    stage: Stage, low: float, high: float, eps: float, kind: str, ascending: bool
) -> tuple[float, float, float]:
    """Error of the stage's value, error of its inverse (expressed in the value), and largest |slope|."""
    x = max(abs(low), abs(high))
    y = max(abs(end) for end in stage.image(low, high, ascending))
    slope = max(abs(s) for s in stage.slope_range(low, high, ascending))
    if isinstance(stage, TanhEnvelope):
        a0, a1, a2, a3 = (abs(a) for a in stage.branch(ascending))
        forward = slope * 3 * eps * (x + a2 / a1) + eps * (a0 * (3 + 2 * kernels.TANH_MAX_ULP[kind]) + 2 * a3)
        inverse = eps * (4 * (y + a3) + a0 * (0.9 * kernels.ATANH_MAX_ULP[kind] + 4 * (0.45 + a2)))
        return forward, inverse, slope
    assert isinstance(stage, DeadZone)
    return eps * (6 * slope * x + 2 * y), eps * (6 * y + 2 * slope * x), slope


@dataclass(frozen=True)
class CornerRoundings:
    """Roundings of the corner engine, derived operation by operation from `c_runtime/plays/corners_float.c`.

    `forward`, `inverse`: error that one answer adds to the sum of the plays, for plays that have seen the same inputs,
    in output units; `early`: by how much plays follow too early in the inverse, in output units; `margin`: how far an
    answer along a line can overshoot the exact one, in units of the plays' input.

    With u the unit roundoff, C the sum of |p_i|, W the largest input of the plays and T its travel, outputs are at most
    C W and change by at most C T. A table entry or an operation adds u times the size of its result; an error in the
    plays' input becomes C times that error in the output.
    """

    forward: float
    inverse: float
    early: float
    margin: float

    @classmethod
    def of(cls, cascade: StaticModel, kind: str) -> CornerRoundings:
        """The roundings of a model in 'float32' or 'float64'; zero if the drive's range is unlimited."""
        if not all(math.isfinite(end) for end in cascade.input_range):
            return cls(0.0, 0.0, 0.0, 0.0)
        u = float(np.finfo(kind).eps) / 2
        pi = cascade.pi
        seen = (*cascade.play_range, *pi.start, 0.0)
        w, travel = max(map(abs, seen)), max(seen) - min(seen)
        c = math.fsum(abs(p) for p in pi.weights)
        # inverse: begin (table, sum), its distance, gain and product; reach (table), two sums of drives
        line = c * (w + travel) + 3 * c * travel
        drives = 2 * w + travel
        passed = c * (w + travel)  # where a block is passed: table and sum
        early = line + passed
        inverse = line + c * drives + early
        # forward: begin (table, sum), its distance, gain and product; reach (table), two sums of outputs; blocks
        forward = c * (w + travel) + 3 * c * travel + c * (2 * w + travel) + c * (w + travel)
        # at the limit: two differences of drives, slope, product and sum; then as for an answer
        least = min(abs(p) for p in np.cumsum(pi.weights)) if not cascade.inverse_problems() else math.inf
        margin = drives + 2 * travel + (line + c * (w + 4 * travel) + early) / least
        return cls(u * forward, u * inverse, u * early, SECOND_ORDER * u * margin)


@dataclass(frozen=True)
class LoopRoundings:
    """Roundings of the loop engine in unit roundoffs u, derived operation by operation from `c_runtime/plays/loop_*.c`.

    `level`: the largest sum of the plays, in output units; `summed`: error of that sum, for plays that have seen the
    same inputs; `solved`: error that solving for their input adds, in output units.

    A play is at most Z_i = max(|low + r_i|, |high - r_i|, |start|) from 0. Rounding its threshold and adding it shifts
    the play by at most u (Z_i + r_i). A rounded weight and its product add 2 u p_i Z_i, and each of n sums adds u times
    the level.
    """

    level: float
    summed: float
    solved: float

    @classmethod
    def of(cls, cascade: StaticModel) -> LoopRoundings:
        """The roundings of a model."""
        pi = cascade.pi
        p, r, start = (np.abs(np.array(each)) for each in (pi.weights, pi.thresholds, pi.start))
        low, high = cascade.play_range
        far = np.maximum(np.maximum(np.abs(low + r), np.abs(high - r)), start)
        level = float(p @ far)
        summed = 2.0 * level + float(p[1:] @ (far + r)[1:]) + pi.n * level
        # sum of the plays that follow: the level less the others' and a product (table), two sums; its reciprocal
        # (table) and a product; the input where the next play would follow is as accurate as a play
        c = float(np.sum(p))
        solved = 2.0 * float(p @ r) + 2.0 * level + 3.0 * c * float(far[0]) + 2.0 * c * float(np.max(far + r))
        return cls(level, summed, solved)


def _one(cascade: StaticModel, kind: str, engine: str) -> tuple[float, float]:
    """Forward error and the inverse's residual eta for one arithmetic, in output units."""
    eps = float(np.finfo(kind).eps) / 2
    pi = cascade.pi
    total = math.fsum(abs(p) for p in pi.weights)
    w = max(*(abs(end) for end in cascade.play_range), *(abs(s) for s in pi.start))
    offset = abs(cascade.output_offset)
    drive = max(abs(end) for end in cascade.input_range)

    front = front_inverse = 0.0
    for ascending in (True, False) if cascade.branches_differ else (True,):
        error, residual = 0.0, eps * drive
        for stage, (low, high) in zip(cascade.stages, cascade.stage_ranges(ascending), strict=True):
            value, back, slope = _stage_errors(stage, low, high, eps, kind, ascending)
            error = slope * error + value
            residual = slope * residual + back
        front, front_inverse = max(front, error), max(front_inverse, residual)

    underflow = (8 * pi.n + 16) * float(np.finfo(kind).smallest_subnormal) * (1 + total)
    if engine == "loop":
        one = LoopRoundings.of(cascade)
        forward = total * front + eps * (one.summed + one.level + 2 * offset) + underflow
        reference = 4 * one.level + 4 * offset  # rounded limits, and the difference from a rounded offset
        return forward, forward + eps * (one.solved + reference) + total * front_inverse
    corner = CornerRoundings.of(cascade, kind)
    answers = pi.n + 2  # n + 1 corners below an answer
    offsets = eps * (total * w + 2 * offset) + underflow
    forward = answers * corner.forward + total * front + offsets
    return forward, answers * corner.inverse + total * (front + front_inverse) + offsets


def error_bounds(cascade: StaticModel, arithmetic: str, engine: str) -> ErrorBounds:
    """Bounds for `arithmetic` 'float32' or 'float64' and `engine` 'corners' or 'loop', against the double model.

    They include the double model's own rounding. The inverse bound never exceeds the drive range, which limits both.
    """
    forward, residual = _one(cascade, arithmetic, engine)
    own_forward, own_residual = _one(cascade, "float64", "corners")
    inverse = rounding = math.inf
    if not cascade.inverse_problems():
        pi = cascade.pi
        gain = (2.0 / pi.weights[0] - 1.0 / pi.slopes[-1]) / cascade.front_slopes[0]
        rounding = SECOND_ORDER * gain * (residual + own_residual)
        gap = cascade.branch_gap
        inverse = rounding + gain * pi.slopes[-1] * gap + gap / cascade.front_slopes[0]
        whole = cascade.input_range[1] - cascade.input_range[0]
        inverse, rounding = min(inverse, whole), min(rounding, whole)
    return ErrorBounds(SECOND_ORDER * (forward + own_forward), inverse, rounding)
