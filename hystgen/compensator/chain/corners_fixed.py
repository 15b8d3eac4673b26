"""Plays of engine corners in a model with effects, in fixed point: `chain_corners_fixed.c` and, for the signal in front
of the plays, `chain_corners_finer.c`.
"""

from __future__ import annotations

from typing import Any

from hystgen.basics.jit import jit
from hystgen.compensator.chain.layout import ARRIVING_BITS, LARGEST_LEVEL, LEVEL_DROP, ChainTables
from hystgen.compensator.chain.moving_fixed import asked, level
from hystgen.compensator.chain.step import OPERATOR, ChainState
from hystgen.plays.corners import corners_fixed
from hystgen.plays.corners.corners_fixed import FAR, along, find, move_to_input, move_to_solution, plays_step, solve
from hystgen.plays.corners.corners_float import INPUT, NEXT, OUTPUT, SOUGHT
from hystgen.plays.fixed import over_slope


@jit
def start(t: ChainTables, s: ChainState, zero: int) -> None:
    """The plays are at the start memory, or all at 0."""
    m = s.corners
    corners_fixed.start(t.plays, m, t.plays.zero if zero else t.plays.start)
    m.counts[SOUGHT] = 0
    m.real[NEXT] = -FAR if s.flags[OPERATOR] else m.real[INPUT]


@jit
def started(t: ChainTables, s: ChainState) -> Any:
    """Sum of the plays."""
    return level(t, s.corners.real[OUTPUT])


@jit
def follow(t: ChainTables, s: ChainState, w: Any) -> Any:
    """The plays follow their input w. Returns their sum."""
    m = s.corners
    if not s.flags[OPERATOR]:
        return level(t, plays_step(t.plays, m, w))
    if m.counts[SOUGHT]:
        m.real[NEXT] = move_to_solution(t.plays, m, (s.kink[0], s.kink[1], s.kink[2], s.kink[3]), w)
    else:
        move_to_input(t.plays, m, w)
        m.real[NEXT] = -FAR
    m.counts[SOUGHT] = 0
    return level(t, m.real[OUTPUT])


@jit
def inverse_input(t: ChainTables, s: ChainState, h: Any) -> Any:
    """Input of the plays at which their sum is h."""
    m = s.corners
    w, kink = solve(t.plays, m, asked(t, h), m.real[NEXT])
    for i in range(4):
        s.kink[i] = kink[i]
    m.counts[SOUGHT] = 1
    return w


@jit
def finer(t: ChainTables, s: ChainState, h: Any, w: Any, a: Any) -> Any:
    """As in engine loop: the signal in front of the plays that gives their sum h, with more bits than their input w."""
    bits = t.number[ARRIVING_BITS]
    if bits == 0:
        return a
    whole = a << bits
    m = s.corners
    x = along(m, w)
    beyond = h > t.number[LARGEST_LEVEL] or h < -t.number[LARGEST_LEVEL]
    if beyond or x < along(m, m.real[INPUT]):  # or w was limited
        return whole
    k = 0
    left = along(m, (h << t.number[LEVEL_DROP]) - m.real[OUTPUT])
    if x > along(m, m.real[INPUT]):
        kink = find(t.plays, m, x - 1, False)
        k = kink[2]
        left = along(m, h << t.number[LEVEL_DROP]) - (kink[0] + t.plays.slope[k + 1] * (x - kink[1]))
    size = -left if left < 0 else left
    if size > t.plays.slope[k + 1]:
        return whole
    more = over_slope(t.plays, size << bits, k + 1)
    return whole + along(m, -more if left < 0 else more)


PLAYS = start, follow, started, inverse_input
