"""Plays of engine corners in a model with effects, in floating point: `chain_corners_float.c`."""

from __future__ import annotations

from hystgen.basics.jit import Scalar, jit
from hystgen.compensator.chain.layout import FloatChainTables
from hystgen.compensator.chain.step import ChainState
from hystgen.plays.corners import corners_float
from hystgen.plays.corners.corners_float import Curve, Memory, copy_place, move_to_output, plays_step, take_back


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
def move_on(t: Curve, m: Memory, w: Scalar) -> bool:
    """Move the plays from the solution to another output w of its line. Returns False if that takes a search."""
    k, rising = m.here.k[0], m.here.rising[0]
    if k > 0:
        if rising != m.undo.rising[0] or m.here.depth[0] != m.undo.depth[0]:
            return False
        since = m.plays.start[0] if k > m.undo.k[0] else m.undo.output[0]
        if w <= since if rising else w >= since:
            return False
    h = m.plays.begin[0] + (w - m.plays.start[0]) * t.slope[k]
    if h >= m.plays.next[0] if rising else h <= m.plays.next[0]:
        return False
    if k == 0 and (h <= m.plays.behind[0] if rising else h >= m.plays.behind[0]):
        return False
    m.here.input[0] = h
    m.here.output[0] = w
    return True


@jit
def follow(t: FloatChainTables, s: ChainState, w: Scalar) -> Scalar:
    """Move the plays to input w. Returns their sum."""
    m: Memory = s.corners
    if not s.own.inverse[0]:
        return plays_step(t.plays.forward, m, w)
    sought = m.step.sought[0] != 0
    if w != m.here.output[0] and not (sought and move_on(t.plays.inverse, m, w)):
        if sought:
            take_back(t.plays.inverse, m)
        if w != m.here.output[0]:
            move_to_output(t.plays.inverse, m, w)
    m.step.sought[0] = 0
    return m.here.input[0]


@jit
def inverse_input(t: FloatChainTables, s: ChainState, h: Scalar) -> Scalar:
    """Input of the plays at which their sum is h."""
    m: Memory = s.corners
    if h != m.here.input[0]:
        copy_place(m.undo, m.here)
        m.step.sought[0] = 1
        plays_step(t.plays.inverse, m, h)
    return m.here.output[0]


PLAYS = start, follow, started, inverse_input
