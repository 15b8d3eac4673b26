"""How far a compiled operator can be from the exact model: rounding-error bounds, derived once for every model.

Forward: rounded thresholds, start memory and stage constants move a play by no more than their own error, because a
play never amplifies a difference of its input, threshold or start value (3); sums and products add their unit
roundoffs. In the corner list an output is computed from that of the corner below it, so that the roundings of up to n
corners and of the output itself add up. With S = sum |p_i| max |w| + sum |p_i| r_i, which no play sum exceeds, one
such step `(y + m z_(k-1)) + (w - (e + m r_(k-1))) slope_k` (m at most 2, z the start level) adds at most, in unit
roundoffs, with a = |m r_(k-1)| and b the rest of the way from e to w, a + b at most 2 max |w|: sum |p_i| (2 a + 3 b)
from the tables and products, S for the first sum, S for the anchor's, S for the last; together 9 S. A corner of a start
memory that is a list adds less: 2 S from two slopes, 2 S for their difference and the product, S for the sum.

Inverse: the drive as sent is an exact input of the exact model, whose output then differs from the reference by a
residual eta: the forward error plus the rounding of the solution. That needs solving to stop where another play would
follow: on the straight piece before, of slope P_k, rounding of eta is one of eta / P_k in w, which behind that place
would count with a steeper slope. Both engines stop there, and neither answers a move with one the other way, which
would do the same to the plays that follow behind a turn. The exact inverse turns a reference error eta into
at most `(2/p_0 - 1/C_n) eta` at the input of the plays (the sum of |q_i|), and the front into that over its smallest
slope. A clamp or commit gives both the same drive and adds nothing.

With two branches two drives can give the same output, one on each, and rounding decides between them where the
reference moves by no more than that. Both outputs are right to within the bound; the drives then differ by what the
gap between the branches makes at the input of the plays, now and in what the plays remember. The bound counts that.
The first move starts from the drive that the start memory stands for, G_R^-1(s_0), which need not be a number of the
type. The forward operator tells on which side of it every drive lies, to the rounding of G_R^-1 in double precision.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hystgen import kernels
from hystgen.models import Cascade, DeadZone, Stage, TanhEnvelope

SECOND_ORDER = 1.01  # products of roundoffs, and the rounding of this computation itself


@dataclass(frozen=True)
class ErrorBounds:
    """Largest differences from the exact model: `forward` in output, `inverse` in drive units (inf: no inverse).

    `rounding` is the part of `inverse` that does not come from taking another branch.
    """

    forward: float
    inverse: float
    rounding: float


def largest_sum(cascade: Cascade) -> float:
    """Size that nothing added up for a play sum exceeds: sum |p_i| max |w| + sum |p_i| r_i."""
    pi = cascade.pi
    total = math.fsum(abs(p) for p in pi.weights)
    lift = math.fsum(abs(p) * r for p, r in zip(pi.weights, pi.thresholds, strict=True))
    w = max(*(abs(end) for end in cascade.play_range), *(abs(s) for s in pi.start))
    return total * w + lift


def _stage_errors(
    stage: Stage, low: float, high: float, eps: float, kind: str, ascending: bool
) -> tuple[float, float, float]:
    """Error of the stage's value, of its inverse (as an error of the value), and its largest |slope|."""
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


def _one(cascade: Cascade, kind: str, engine: str) -> tuple[float, float]:
    """Forward error, and the residual eta of the inverse in output units, for one arithmetic."""
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

    size = largest_sum(cascade)
    states = front + eps * (4 * w + 5 * pi.thresholds[-1])
    sums = (pi.n + 3) if engine == "loop" else 9 * (pi.n + 1)
    forward = total * states + eps * (sums * size + 2 * (size + offset))
    solving = eps * (5 * (size + 2 * offset) + 4 * size) + total * front_inverse
    underflow = (8 * pi.n + 16) * float(np.finfo(kind).smallest_subnormal) * (1 + total)
    return forward + underflow, forward + solving + underflow


def error_bounds(cascade: Cascade, arithmetic: str, engine: str) -> ErrorBounds:
    """Bounds for `arithmetic` 'float32' or 'float64' and `engine` 'corners' or 'loop', against the double model.

    The double model's own rounding is counted too. The inverse bound never exceeds the drive range, which both keep.
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


def straight_margin(cascade: Cascade, arithmetic: str) -> float:
    """How far short of the next play's output a straight piece is left, so that rounding cannot lead beyond.

    In unit roundoffs, with S the largest sum: 4 S for the two start levels in the tables, 6 S for the two sums with
    them, 4 S and 2 S for the same of the thresholds, 2 S each for the difference, the reciprocal and the product, S
    for the last sum, S for taking this off, 2 S and twice the offset for adding and taking off the offset: below 32.
    """
    return 16 * float(np.finfo(arithmetic).eps) * (largest_sum(cascade) + abs(cascade.output_offset))


def limited(cascade: Cascade, arithmetic: str) -> tuple[float | None, float | None]:
    """References below, above which the drive may be at its lower, its upper limit; None where rounding alone can.

    No memory makes the output at a limit lie further inside than that after the other end of the range.
    """
    margin = straight_margin(cascade, arithmetic)
    (low, high), (lowest, highest) = cascade.swung, cascade.output_range
    return (
        low + margin if low - lowest > margin else None,
        high - margin if highest - high > margin else None,
    )
