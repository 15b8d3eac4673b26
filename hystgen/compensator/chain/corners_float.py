"""Plays of engine corners in a model with effects, in floating point: `chain_corners_float.c`."""

from __future__ import annotations

from hystgen.basics.jit import Scalar, jit
from hystgen.compensator.chain.layout import FloatChainTables
from hystgen.compensator.chain.step import ChainState
from hystgen.plays.corners import corners_float
from hystgen.plays.corners.corners_float import Memory, copy_place, forget_line, move_to_output, plays_step


@jit
def start(t: FloatChainTables, s: ChainState, zero: int) -> None:
    """Set the plays to the start memory, or all to 0."""
    p = t.plays
    s.corners.step.sought[0] = 0
    if s.own.inverse[0]:
        corners_float.start(p.inverse, s.corners, p.inverse_zero if zero else p.inverse_first)
    else:
        corners_float.start(p.forward, s.corners, p.forward_zero if zero else p.forward_first)


@jit
def started(t: FloatChainTables, s: ChainState) -> Scalar:  # noqa: ARG001  as in fixed point
    """Sum of the plays."""
    m: Memory = s.corners
    return m.here.input[0] if s.own.inverse[0] else m.here.output[0]


@jit
def follow(t: FloatChainTables, s: ChainState, w: Scalar) -> Scalar:
    """Move the plays to input w. Returns their sum."""
    m: Memory = s.corners
    if not s.own.inverse[0]:
        return plays_step(t.plays.forward, m, w)
    if w != m.here.output[0]:
        if m.step.sought[0]:
            copy_place(m.here, m.undo)
            forget_line(t.plays.inverse, m)
        if w != m.here.output[0]:
            move_to_output(t.plays.inverse, m, w)
    m.step.sought[0] = 0
    return m.here.input[0]


@jit
def inverse_input(t: FloatChainTables, s: ChainState, h: Scalar) -> Scalar:
    """Input of the plays at which their sum is h."""
    m: Memory = s.corners
    copy_place(m.undo, m.here)
    m.step.sought[0] = 1
    return plays_step(t.plays.inverse, m, h)


PLAYS = start, follow, started, inverse_input
