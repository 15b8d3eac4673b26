"""The plays of the corner engine in fixed point: `c_runtime/plays/corners_fixed.c`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import DTypeLike

from hystgen.basics.jit import jit
from hystgen.basics.structures import Count, Flag, Int32, Int64, Struct
from hystgen.plays.corners.corners_float import PlaceState
from hystgen.plays.fixed import FixedPlayTables, divide_by_slope
from hystgen.plays.slots import Reals, StepState

INPUT_MOST = 2**31 - 1  # inputs of the plays, in their smallest steps, are an int32_t in C

Kink = tuple[int, int, int, int]
"""`hystgen_kink_t`: output and input along the present move, the last play that follows from here on, and the number of
corners that hold the others."""

FAR = 1 << 62
"""Larger than any sum of plays, which have fewer than 62 bits."""


class FixedCorner(Struct):
    """A turning point. It holds the plays of its block: those above the plays of the next corner, up to play `top`."""

    output: Int64  # at the turning point; in C, in two parts
    input: Int32
    top: Count
    rose: Flag  # whether a rising move ended here, or a falling one


class FixedMemory(NamedTuple):
    """One instance in fixed point; fields as in floating point."""

    here: PlaceState
    undo: PlaceState
    step: StepState
    corner: FixedCorner  # (n)


def new_fixed_memory(plays: int, dtype: DTypeLike = np.int64) -> FixedMemory:
    """Memory for one instance of a model with this many plays besides play 0; `init` sets its values."""
    here, undo = PlaceState.zeros(1, dtype), PlaceState.zeros(1, dtype)
    return FixedMemory(here, undo, StepState.zeros(1, dtype), FixedCorner.zeros(max(plays, 1), dtype))


@jit(inline=True)
def along(m: FixedMemory, x: int) -> int:
    """x along the present move: a falling move is treated as a rising one with all signs changed."""
    return x if m.here.rising[0] else -x


@jit
def leave_corner(m: FixedMemory) -> None:
    """Leave a corner at the present point."""
    c = m.here.depth[0]
    m.corner.output[c] = m.here.output[0]
    m.corner.input[c] = m.here.input[0]
    m.corner.top[c] = m.here.k[0]
    m.corner.rose[c] = m.here.rising[0]
    m.here.depth[0] += 1


@jit
def begins(t: FixedPlayTables, m: FixedMemory, c: int, k: int, by_output: bool) -> int:
    """The output or input, along the present move, at which play k of a corner's block begins to follow."""
    if by_output:
        return along(m, m.corner.output[c]) + (0 if m.corner.rose[c] == m.here.rising[0] else t.reach[k])
    return along(m, m.corner.input[c]) + (0 if m.corner.rose[c] == m.here.rising[0] else t.way[k])


@jit
def turn_back(m: FixedMemory) -> None:
    """Reverse the move and, if plays have followed, leave a corner."""
    if m.here.k[0] > 0:
        leave_corner(m)
        m.here.k[0] = 0
    m.here.rising[0] = 1 - m.here.rising[0]


@jit
def find(t: FixedPlayTables, m: FixedMemory, to: int, by_output: bool) -> Kink:
    """The last kink before `to`, an output or input along the move; the present point if no play begins to follow."""
    c = -1
    low = 0
    left = m.here.depth[0]
    k = m.here.k[0]
    while low < left:
        middle = (low + left) // 2
        if to >= begins(t, m, middle, m.corner.top[middle], by_output):
            left = middle
        else:
            low = middle + 1
    if left < m.here.depth[0]:
        c = left
        k = m.corner.top[c]
    if left > 0 and m.corner.rose[left - 1] != m.here.rising[0]:
        top = left - 1
        on = to - begins(t, m, top, 0, by_output)
        before = k
        last = m.corner.top[top] - 1
        while k < last:
            middle = (k + last) // 2 + 1
            if on >= (t.reach[middle] if by_output else t.way[middle]):
                k = middle
            else:
                last = middle - 1
        c = top if k > before else c
    if c < 0:
        return along(m, m.here.output[0]), along(m, m.here.input[0]), k, left
    return begins(t, m, c, k, True), begins(t, m, c, k, False), k, left


@jit
def find_input(t: FixedPlayTables, m: FixedMemory, to: int) -> Kink:
    """The same as `find` for a move to any input. May reverse the move, but moves no play."""
    if along(m, to - m.here.input[0]) < 0:
        turn_back(m)
    return find(t, m, along(m, to), False)


@jit
def go_on(m: FixedMemory, kink: Kink, to: int, moved: int) -> None:
    """Move the plays to an input short of the next kink; `moved` is the output gained since `kink`."""
    m.here.output[0] = along(m, kink[0] + moved)
    m.here.input[0] = to
    m.here.k[0] = kink[2]
    m.here.depth[0] = kink[3]


@jit
def gained(t: FixedPlayTables, m: FixedMemory, kink: Kink, to: int) -> int:
    """Output gained between a kink and the input `to`; -1 if `to` lies before the kink."""
    way = along(m, to) - kink[1]
    return -1 if way < 0 else t.slope[kink[2] + 1] * way


@jit
def move_to_input(t: FixedPlayTables, m: FixedMemory, to: int) -> None:
    """Move the plays to any input."""
    kink = find_input(t, m, to)
    go_on(m, kink, to, gained(t, m, kink, to))


@jit
def next_input(t: FixedPlayTables, m: FixedMemory) -> int:
    """Input at which another play begins to follow the present move, or the largest input."""
    x = INPUT_MOST
    if m.here.depth[0] > 0:
        following = begins(t, m, m.here.depth[0] - 1, m.here.k[0] + 1, False)
        x = following if following < x else x
    return along(m, x)


@jit(inline=True)
def plays_step(t: FixedPlayTables, m: FixedMemory, to: int) -> int:
    """The sum of the plays at the next input."""
    at = m.here.input[0]
    if at < to < m.step.next[0] if m.here.rising[0] else m.step.next[0] < to < at:
        m.here.output[0] += t.slope[m.here.k[0] + 1] * (to - at)
        m.here.input[0] = to
    elif to != at:
        move_to_input(t, m, to)
        m.step.next[0] = next_input(t, m)
    return m.here.output[0]


@jit
def solved(t: FixedPlayTables, m: FixedMemory, kink: Kink, to: int) -> int:
    """The input that gives `to`, an output beyond a kink along the move; at most slightly outside the range."""
    x = kink[1] + divide_by_slope(t, to - kink[0], kink[2] + 1)
    most = t.limits.play.high[0] + t.limits.margin[0] if m.here.rising[0] else t.limits.margin[0] - t.limits.play.low[0]
    return along(m, most if x > most else x)


@jit
def solve(t: FixedPlayTables, m: FixedMemory, output: int, following: int) -> tuple[int, Kink]:
    """The input for `output`, at most slightly outside the range, and the kink it is measured from.

    May reverse the move, but moves no play. Before the output `following`, along the move, no other play follows.
    """
    if along(m, output - m.here.output[0]) < 0:
        turn_back(m)
        following = -FAR
    to = along(m, output)
    if to < following:
        kink = (along(m, m.here.output[0]), along(m, m.here.input[0]), m.here.k[0], m.here.depth[0])
    else:
        kink = find(t, m, to, True)
    return solved(t, m, kink, to), kink


@jit
def next_output(t: FixedPlayTables, m: FixedMemory, kink: Kink) -> int:
    """Output, along the present move, at which another play begins to follow after a kink."""
    return begins(t, m, kink[3] - 1, kink[2] + 1, True) if kink[3] > 0 else FAR


@jit
def move_to_solution(t: FixedPlayTables, m: FixedMemory, kink: Kink, to: int) -> int:
    """Move the plays to an input near the one solved for from a kink. Returns the output, along the move, at which
    another play begins to follow."""
    following = next_output(t, m, kink)
    moved = gained(t, m, kink, to)
    if moved < 0 or kink[0] + moved > following:  # because of rounding or limiting
        kink = find_input(t, m, to)
        following = next_output(t, m, kink)
        moved = gained(t, m, kink, to)
    go_on(m, kink, to, moved)
    return following


@jit
def start(t: FixedPlayTables, m: FixedMemory, play: Reals) -> None:
    """Set a start memory: a value for each play, or one for all. Each play becomes a block of its own, as left by a
    move to the input at which it begins to follow."""
    aside = t.limits.offset[0]
    m.here.depth[0] = 0
    for k in range(len(t.threshold) - 1, 0, -1):
        w = play[k if len(play) > 1 else 0]
        m.here.k[0] = k
        m.here.rising[0] = 1 if w + t.threshold[k] <= INPUT_MOST else 0
        m.here.input[0] = w + along(m, t.threshold[k])
        m.here.output[0] = aside + w * t.slope[k + 1] + along(m, t.start_level[k])
        leave_corner(m)
        aside = aside + w * (t.slope[k + 1] - t.slope[k])
    m.here.k[0] = 0
    m.here.rising[0] = 1
    m.here.input[0] = play[0]
    m.here.output[0] = aside + play[0] * t.slope[1]
