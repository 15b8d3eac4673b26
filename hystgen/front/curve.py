"""The memoryless part in fixed point: piecewise polynomials, `c_runtime/front/curve.c`."""

from __future__ import annotations

from hystgen.basics.jit import jit
from hystgen.front.stage import CurveTables, Polynomials
from hystgen.plays.fixed import nearest

HALF = 1 << 30

# offsets of the two curves of the memoryless part, each with two branches
FORWARD, INVERSE = 0, 2


@jit
def curve(t: Polynomials, which: int, x: int) -> int:
    """Value of a curve: c0 + c1 h + c2 h^2 + ... on the piece that contains x, with h = 0 .. 1 along it."""
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


@jit
def front_forward(t: CurveTables, v: int, ascending: int) -> int:
    """w = G[v] on one branch."""
    if t.fronts:
        return curve(t, FORWARD + 1 - ascending, v)
    return v << t.limits.fine[0]


@jit
def front_inverse(t: CurveTables, w: int, ascending: int) -> tuple[int, int]:
    """v = G^-1[w] on one branch (one code out of range if w is beyond its domain), and whether an envelope limits w."""
    if not t.fronts:
        return nearest(w, t.limits.fine[0]), 0
    which = INVERSE + 1 - ascending
    if w > t.domain[which, 1]:
        if w > t.domain[which, 1] + t.edge[which, 1]:
            return t.limits.drive.high[0] + 1, 1 if w > t.argument[which, 1] else 0
        return t.limits.drive.high[0], 0
    if w < t.domain[which, 0]:
        if w < t.domain[which, 0] - t.edge[which, 0]:
            return t.limits.drive.low[0] - 1, 1 if w < t.argument[which, 0] else 0
        return t.limits.drive.low[0], 0
    return nearest(curve(t, which, w), t.below[which]), 0
