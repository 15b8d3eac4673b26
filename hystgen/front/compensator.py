"""The memoryless part in floating point: the stages of the front in series."""

from __future__ import annotations

from hystgen.basics.jit import Scalar, jit
from hystgen.front.dead_zone.compensator import dead_zone
from hystgen.front.stage import StageTables
from hystgen.front.tanh.compensator import envelope_forward, envelope_inverse
from hystgen.plays.slots import DEAD_ZONE


@jit
def front_forward(t: StageTables, v: Scalar, ascending: int) -> Scalar:
    """w = G[v] on one branch, stage by stage from the drive."""
    w = v
    for j in range(len(t.stage_kind)):
        first = t.stage_first[j]
        if t.stage_kind[j] == DEAD_ZONE:
            w = dead_zone(t, first, t.stage_size[j], w, 0)
        elif ascending:
            w = envelope_forward(t, first, w)
        else:
            w = envelope_forward(t, first + 7, w)
    return w


@jit
def front_inverse(t: StageTables, w: Scalar, ascending: int) -> tuple[Scalar, int]:
    """v = G^-1[w] on one branch, with the stages in reverse order, and whether an envelope's argument was limited."""
    v = w
    limited = 0
    for j in range(len(t.stage_kind) - 1, -1, -1):
        first = t.stage_first[j]
        if t.stage_kind[j] == DEAD_ZONE:
            v = dead_zone(t, first, t.stage_size[j], v, 1)
        else:
            if not ascending:
                first = first + 7
            v, one = envelope_inverse(t, first, v)
            limited = limited | one
    return v, limited
