"""Saturation behind the plays in fixed point: curves of polynomials, and straight pieces."""

from __future__ import annotations

from typing import Any, NamedTuple

from hystgen.arithmetic.factors import times
from hystgen.basics.jit import jit
from hystgen.effects.bend import Bends, bend
from hystgen.plays.slots import TANH, Counts, Reals


class Saturations(NamedTuple):
    """All saturations, in order from the plays.

    `stage_kind` (k,): TANH, or DEAD_ZONE for straight pieces; `piece` (k, 6): for straight pieces, the ends between
    which nothing changes, the slope beyond them and 1 over it, as factors. `bends`: two curves for each k, forward and
    inverse.
    """

    stage_kind: Counts
    piece: Reals
    bends: Bends


# ---------------------------------------------------------------- bend.c, stops.c

LOWER, UPPER, GIVE, INVERSE_GIVE = 0, 1, 2, 4


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
    """x behind all saturations."""
    y = x
    for j in range(len(t.stage_kind)):
        if t.stage_kind[j] == TANH:
            y, _ = bend(t.bends, 2 * j, y)
        else:
            y = stops(t, j, y, GIVE)
    return y


@jit
def unsaturated(t: Saturations, y: Any) -> tuple[Any, int]:
    """The input of all saturations for the output y, and whether no input gives it."""
    x = y
    limited = 0
    for j in range(len(t.stage_kind) - 1, -1, -1):
        if t.stage_kind[j] == TANH:
            x, one = bend(t.bends, 2 * j + 1, x)
            limited = limited | one
        else:
            x = stops(t, j, x, INVERSE_GIVE)
    return x, limited
