"""Saturation behind the plays in fixed point: curves of polynomials, and straight pieces."""

from __future__ import annotations

from typing import Any, NamedTuple

from hystgen.arithmetic.factors import times
from hystgen.basics.jit import jit
from hystgen.front.curve import curve
from hystgen.plays.fixed import nearest
from hystgen.plays.slots import TANH, Counts, Reals


class Saturations(NamedTuple):
    """All that saturates, in order from the plays.

    `kind` (k,): TANH or DEAD_ZONE, the latter for straight pieces; `piece` (k, 6): of straight pieces the ends between
    which nothing changes, the slope beyond them and 1 over that, as factors. Curves as in
    `hystgen.compensator.layout.FixedTables`, two for each k, there and back; `scaled` (2 k, 2): bits of a signal that
    an argument leaves out, and those that a value does.
    """

    kind: Counts
    piece: Reals
    knot: Reals
    coefficient: Reals
    scale: Reals
    first: Reals
    pieces: Reals
    domain: Reals
    scaled: Reals


# ---------------------------------------------------------------- bend.c, stops.c

LOWER, UPPER, GIVE, INVERSE_GIVE = 0, 1, 2, 4


@jit
def bend(t: Saturations, which: int, x: Any) -> tuple[Any, int]:
    """The value of a curve at x, and whether x had to be limited to its ends."""
    argument = nearest(x, t.scaled[which, 0])
    inside = argument
    if inside < t.domain[which, 0]:
        inside = t.domain[which, 0]
    elif inside > t.domain[which, 1]:
        inside = t.domain[which, 1]
    return curve(t, which, inside) << t.scaled[which, 1], 1 if inside != argument else 0


@jit
def stops(t: Saturations, j: int, x: Any, slope: int) -> Any:
    """x, with another slope beyond the ends."""
    inside = x
    if inside < t.piece[j, LOWER]:
        inside = t.piece[j, LOWER]
    elif inside > t.piece[j, UPPER]:
        inside = t.piece[j, UPPER]
    return inside + times(x - inside, t.piece[j, slope], t.piece[j, slope + 1])


@jit
def saturated(t: Saturations, x: Any) -> Any:
    """What saturates makes of x."""
    y = x
    for j in range(len(t.kind)):
        if t.kind[j] == TANH:
            y, _ = bend(t, 2 * j, y)
        else:
            y = stops(t, j, y, GIVE)
    return y


@jit
def unsaturated(t: Saturations, y: Any) -> tuple[Any, int]:
    """What gives y behind what saturates, and whether nothing does."""
    x = y
    limited = 0
    for j in range(len(t.kind) - 1, -1, -1):
        if t.kind[j] == TANH:
            x, one = bend(t, 2 * j + 1, x)
            limited = limited | one
        else:
            x = stops(t, j, x, INVERSE_GIVE)
    return x, limited
