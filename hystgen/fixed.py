"""What fixed point does otherwise: the part of the bit reference that is not common to all arithmetics.

Inputs of the plays are whole multiples of a least step, sums are whole multiples of a fraction of the output code, and
both engines compute the same whole numbers, so that they agree in every bit. Here are rounding to codes, dividing by
the slope with a reciprocal and the memoryless part (piecewise polynomials), which both have, and what engine loop does
otherwise than in floating point (`hystgen.reference`); that of engine corners is in `hystgen.corners`. All have their
counterparts of the same names in `c_runtime/`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from hystgen import reference
from hystgen.reference import DRIVE_MAX, DRIVE_MIN, OFFSET, OUTPUT_CLAMPED, STATUS, Reals, State, loop_output

# more places in `limits`, after those of `hystgen.reference`
PLAY_MIN, PLAY_MAX, MARGIN, FRACTION, FINE, CODE_MAX, SATURATED, SHY = range(10, 18)

HALF = 1 << 30

# the curves of the memoryless part, two branches of each
FORWARD, INVERSE = 0, 2


class FixedTables(NamedTuple):
    """The constants of one model in fixed point; arrays of int64, however narrow they are in C."""

    threshold: Reals
    weight: Reals
    slope: Reals  # of sums per least step of the plays' input
    start_level: Reals
    way: Reals  # 2 threshold: input gained behind a corner by the time play k begins to follow; one never does
    reach: Reals  # 2 start_level: the output likewise
    reciprocal: Reals  # 2^(32 + shift) / slope
    shift: Reals
    start: Reals
    zero: Reals  # all plays 0
    limits: Reals
    applied: Reals  # drive before the first move: 2 * inverse + (0 after init, 1 after reset)
    ascending: Reals  # direction before the first move, likewise
    knot: Reals  # where the pieces of the curves begin, curve after curve
    coefficient: Reals  # (pieces, degree + 1)
    scale: Reals  # left shift that stretches a piece to 2^31
    first: Reals  # first piece of each curve
    pieces: Reals
    domain: Reals  # (4, 2): first and last argument of a curve
    edge: Reals  # (4, 2): how far beyond them an argument is still no more than rounding
    argument: Reals  # (4, 2): least and greatest argument that the envelopes themselves can take
    below: Reals  # (4,): least steps of a curve's value per code, as a power of 2
    engine: int
    branches: int
    fronts: int


def nearest(x: Any, bits: Any) -> Any:
    """x / 2^bits to the nearest whole number, ties away from zero."""
    if bits == 0:
        return x
    half = 1 << (bits - 1)
    if x < 0:
        return (x + half - 1) >> bits
    return (x + half) >> bits


def over_slope(t: FixedTables, d: Any, k: int) -> Any:
    """d / slope[k] to the nearest whole number, d not negative."""
    r = t.reciprocal[k]
    shift = t.shift[k]
    quotient = (d >> 32) * r + (((d & 0xFFFFFFFF) * r) >> 32)
    return ((quotient >> (shift - 1)) + 1) >> 1


def going(t: FixedTables, w: Any, d: Any, k: int, rising: int) -> Any:
    """Input of the plays that is d further on in output than w, kept near the range of the plays' input."""
    step = over_slope(t, d, k)
    if rising:
        most = t.limits[PLAY_MAX] + t.limits[MARGIN]
        if step > most - w:
            return most
        return w + step
    least = t.limits[PLAY_MIN] - t.limits[MARGIN]
    if step > w - least:
        return least
    return w - step


def loop_solve(t: FixedTables, s: State, output: Any) -> Any:
    """Input of the plays that gives `output`, taking along the plays one by one."""
    here = loop_output(t, s)
    w = s.play[0]
    if output == here:
        return w
    rising = 1 if output > here else 0
    left = output - here if rising else here - output
    k = 1
    while k < len(s.play):
        start = s.play[k] + t.threshold[k] if rising else s.play[k] - t.threshold[k]
        step = t.slope[k] * (start - w if rising else w - start)
        if left < step:
            break
        left = left - step
        w = start
        k += 1
    return going(t, w, left, k, rising)


def curve(t: FixedTables, which: int, x: Any) -> Any:
    """Value of a curve: c0 + c1 h + c2 h^2 + ... on the piece that x lies on, h = 0 .. 1 along it."""
    j = t.first[which]
    high = j + t.pieces[which] - 1
    while j < high:
        middle = (j + high + 1) // 2
        if x >= t.knot[middle]:
            j = middle
        else:
            high = middle - 1
    h = (x - t.knot[j]) << t.scale[j]
    y = h - h
    for i in range(t.coefficient.shape[1] - 1, -1, -1):
        y = t.coefficient[j, i] + ((y * h + HALF) >> 31)
    return y


def front_forward(t: FixedTables, v: Any, ascending: int) -> Any:
    """w = G[v] on one branch."""
    if t.fronts:
        return curve(t, FORWARD + 1 - ascending, v)
    return v << t.limits[FINE]


def front_inverse(t: FixedTables, w: Any, ascending: int) -> tuple[Any, int]:
    """v = G^-1[w] on one branch, one code beyond the range where w lies beyond it; whether an envelope limits w."""
    if not t.fronts:
        return nearest(w, t.limits[FINE]), 0
    which = INVERSE + 1 - ascending
    if w > t.domain[which, 1]:
        if w > t.domain[which, 1] + t.edge[which, 1]:
            return t.limits[DRIVE_MAX] + 1, 1 if w > t.argument[which, 1] else 0
        return t.limits[DRIVE_MAX], 0
    if w < t.domain[which, 0]:
        if w < t.domain[which, 0] - t.edge[which, 0]:
            return t.limits[DRIVE_MIN] - 1, 1 if w < t.argument[which, 0] else 0
        return t.limits[DRIVE_MIN], 0
    return nearest(curve(t, which, w), t.below[which]), 0


def output(t: FixedTables, s: State) -> Any:
    """Output code for the memory as it is, limited to the type."""
    code = nearest(loop_output(t, s) + t.limits[OFFSET], t.limits[FRACTION])
    if code > t.limits[SATURATED] or code < -t.limits[SATURATED]:
        s.counts[STATUS] |= OUTPUT_CLAMPED
    if code > t.limits[CODE_MAX]:
        return t.limits[CODE_MAX]
    if code < -t.limits[CODE_MAX]:
        return -t.limits[CODE_MAX]
    return code


def inverse_solve(t: FixedTables, s: State, level: Any) -> Any:
    """Input of the plays that gives output code `level`."""
    return loop_solve(t, s, (level << t.limits[FRACTION]) - t.limits[OFFSET])


def finite(t: FixedTables, x: Any) -> bool:  # noqa: ARG001  every code is
    """Whole numbers are."""
    return True


SHARED: list[Callable[..., Any]] = [nearest, over_slope, curve, front_forward, front_inverse]
"""What both engines have."""

_OWN: list[Callable[..., Any]] = [*SHARED, going, loop_solve, output, inverse_solve, finite]
_REPLACED = {function.__name__ for function in (*_OWN, *reference.FRONT)}
_COMMON = [function for function in reference.COMPILED if function.__name__ not in _REPLACED]
_PLAYS = {"loop_rest", "loop_start", "loop_absorb", "loop_output"}

# Callees before callers: the memory, then what is written here, then what a step means
COMPILED: list[Callable[..., Any]] = [
    *(function for function in _COMMON if function.__name__ in _PLAYS),
    *_OWN,
    *(function for function in _COMMON if function.__name__ not in _PLAYS),
]
INLINED: set[Callable[..., Any]] = {function for function in COMPILED if function in reference.INLINED}
