"""Plays of engine corners in a model with effects, in fixed point: `chain_corners_fixed.c` and, for the signal in front
of the plays, `chain_corners_finer.c`.
"""

from __future__ import annotations

from hystgen.basics.jit import jit
from hystgen.compensator.chain.layout import FixedChainTables
from hystgen.compensator.chain.moving_fixed import asked, level
from hystgen.compensator.chain.step import ChainState
from hystgen.plays.corners import corners_fixed
from hystgen.plays.corners.corners_fixed import (
    FAR,
    FixedMemory,
    Kink,
    along,
    find,
    find_input,
    gained,
    go_on,
    next_output,
    solve,
)
from hystgen.plays.fixed import FixedPlayTables, divide_by_slope
from hystgen.plays.slots import Reals


@jit
def keep(to: Reals, kink: Kink) -> None:
    """Copy the kink field by field."""
    for i in range(4):
        to[i] = kink[i]


@jit
def start(t: FixedChainTables, s: ChainState, zero: int) -> None:
    """Set the plays to the start memory, or all to 0; this sets only their positions."""
    m: FixedMemory = s.corners
    corners_fixed.start(t.plays, m, t.plays.zero if zero else t.plays.start)
    for i in range(4):
        s.kink[i] = 0
    m.step.next[0] = -FAR
    m.step.sought[0] = 0


@jit
def started(t: FixedChainTables, s: ChainState) -> int:
    """Sum of the plays."""
    total: int = level(t, s.corners.here.output[0])
    return total


@jit
def move_on(t: FixedPlayTables, m: FixedMemory, kept: Reals, w: int) -> bool:
    """Move the plays to an input between `kept` and the next kink. Returns False if the input lies elsewhere."""
    kink = (kept[0], kept[1], kept[2], kept[3])
    moved = gained(t, m, kink, w)
    if moved < 0 or kink[0] + moved > m.step.next[0]:
        return False
    go_on(m, kink, w, moved)
    return True


@jit
def moved(t: FixedPlayTables, m: FixedMemory, kept: Reals, w: int) -> bool:
    """Move the plays to any input between `kept` and the next kink, which it finds."""
    m.step.next[0] = next_output(t, m, (kept[0], kept[1], kept[2], kept[3]))
    return move_on(t, m, kept, w)


@jit
def follow(t: FixedChainTables, s: ChainState, w: int) -> int:
    """Move the plays to input w. Returns their sum."""
    m: FixedMemory = s.corners
    if s.own.inverse[0]:
        there = m.step.sought[0] != 0 and moved(t.plays, m, s.kink, w)
    else:
        turns = w < m.here.input[0] if m.here.rising[0] else w > m.here.input[0]
        there = not turns and move_on(t.plays, m, s.kink, w)
    if not there:
        keep(s.kink, find_input(t.plays, m, w))
        moved(t.plays, m, s.kink, w)
    m.step.sought[0] = 0
    total: int = level(t, m.here.output[0])
    return total


@jit
def seen(t: FixedChainTables, m: FixedMemory, kept: Reals, w: int) -> None:
    """Record the last kink before a solution w that is to be refined; plays that begin to follow at w do not count."""
    x = along(m, w)
    if t.number.arriving_bits[0] > 0 and along(m, m.here.input[0]) < x <= kept[1]:
        keep(kept, find(t.plays, m, x - 1, False))


@jit
def inverse_input(t: FixedChainTables, s: ChainState, h: int) -> int:
    """Input of the plays at which their sum is h."""
    m: FixedMemory = s.corners
    w, kink = solve(t.plays, m, asked(t, h), m.step.next[0])
    keep(s.kink, kink)
    m.step.sought[0] = 1
    seen(t, m, s.kink, w)
    return w


@jit
def finer(t: FixedChainTables, s: ChainState, h: int, w: int, a: int) -> int:
    """As in engine loop: the signal in front of the plays that makes their sum h, with more bits than their input w."""
    bits = t.number.arriving_bits[0]
    if bits == 0:
        return a
    m: FixedMemory = s.corners
    whole = a << bits
    x = along(m, w)
    on = x - along(m, m.here.input[0])
    if h > t.number.largest_level[0] or h < -t.number.largest_level[0] or on < 0:
        return whole
    k = s.kink[2] + 1 if on > 0 else 1
    left = along(m, h << t.number.level_drop[0]) - s.kink[0] - t.plays.slope[k] * (x - s.kink[1])
    size = -left if left < 0 else left
    if size > t.plays.slope[k]:
        return whole
    more = divide_by_slope(t.plays, size << bits, k)
    return whole + along(m, -more if left < 0 else more)


PLAYS = start, follow, started, inverse_input
