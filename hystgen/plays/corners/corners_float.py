"""Plays of the corner engine in floating point: `c_runtime/plays/corners_float.c`, and code for both arithmetics."""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import DTypeLike

from hystgen.basics.jit import Scalar, jit
from hystgen.basics.structures import Count, Flag, Real, SmallCount, Struct, TwoReals
from hystgen.plays.slots import Reals, StepState

BOTTOM = 2  # `rose` of the bottom corner, which counts as opposite to both directions


class Literals(Struct):
    """Numbers that are literals in C."""

    most: Real  # largest number of the type
    zero: Real
    half: Real
    one: Real


class Curve(NamedTuple):
    """`hystgen_curve_t`: one operator; [0] is for falling moves, with signs changed, [1] for rising ones."""

    way: Reals  # (n + 2): distance along a move at which play k begins to follow
    reach: Reals  # (n + 2): the same in output units
    gain: Reals  # (n + 2)
    slope: Reals  # (n + 2): 1 / gain
    limit: Reals  # (2): of the output
    inside: Reals  # (2): outputs up to here stay within the limit however they are rounded
    range: Reals  # (2): of the input
    literal: Literals


class Start(NamedTuple):
    """`hystgen_start_t`: a start memory."""

    center: Reals  # (1 or n + 1, 2): input and output of the sum while plays 0 .. k hold play k's value
    step: int  # 0: one centre for all plays, 1: one for each
    risen: int  # corners of plays up to this one were left by rising moves, the others by falling moves
    bottom: Reals  # output, and the inputs at which a falling and a rising move passed it
    top: int  # plays from here on cannot move within the range


class PlaceState(Struct):
    """The plays' present position: plays 0 .. k follow the present move, `depth` corners hold the others."""

    input: Real  # of the play sum (forward: drive, inverse: output)
    output: Real
    k: Count
    depth: Count
    rising: Flag  # direction of the present move


class PlaysState(Struct):
    """The line that the next outputs of the play sum lie on."""

    next: Real  # input up to which the same plays follow and nothing is limited
    cap: Real  # input up to which the same corner applies and nothing is limited
    behind: Real  # while no play follows: the counterpart of `next` for moves in the other direction
    from_input: Real  # input and output from which the top corner's block is counted
    from_output: Real
    begin: Real  # output = start + (input - begin) gain
    start: Real
    gain: Real
    sign: Real  # 1 for rising, -1 for falling
    limited: Flag  # the output is at a limit, and the input may lie beyond the one that first reaches it


class Corner(Struct):
    """A turning point. It holds the plays of its block: those above the plays of the next corner, up to play `top`."""

    output: Real  # at the turning point
    passed: TwoReals  # inputs, along the move, at which a falling and a rising move pass it
    top: Count
    rose: SmallCount  # direction of the move that ended here, or `BOTTOM`


class Memory(NamedTuple):
    """One instance; `undo`: the plays' position before the last step."""

    here: PlaceState
    undo: PlaceState
    plays: PlaysState
    step: StepState
    corner: Corner  # (n + 1)


def new_memory(plays: int, dtype: DTypeLike) -> Memory:
    """Memory for one instance of a model with this many plays besides play 0; `init` sets its values."""
    here, undo = PlaceState.zeros(1, dtype), PlaceState.zeros(1, dtype)
    return Memory(here, undo, PlaysState.zeros(1, dtype), StepState.zeros(1, dtype), Corner.zeros(plays + 1, dtype))


@jit
def copy_place(to: PlaceState, source: PlaceState) -> None:
    """Copy a position field by field."""
    to.input[0] = source.input[0]
    to.output[0] = source.output[0]
    to.k[0] = source.k[0]
    to.depth[0] = source.depth[0]
    to.rising[0] = source.rising[0]


@jit(inline=True)
def along(m: Memory, x: Scalar) -> Scalar:
    """x along the present move: a falling move is treated as a rising one with all signs changed."""
    return m.plays.sign[0] * x


@jit(inline=True)
def forget_line(m: Memory) -> None:
    """Forget the line of the last outputs, so that the next sample starts a new search."""
    m.plays.next[0] = m.here.input[0]
    m.plays.cap[0] = m.here.input[0]
    m.plays.behind[0] = m.here.input[0]


@jit(inline=True)
def take_back(t: Curve, m: Memory) -> None:
    """Restore the plays' position from before the last step; corners left since then are dropped."""
    copy_place(m.here, m.undo)
    m.plays.sign[0] = t.literal.one[0] if m.here.rising[0] else -t.literal.one[0]
    forget_line(m)


@jit
def reverse(t: Curve, m: Memory) -> None:
    """Reverse the move and, if plays have followed, leave a corner. A block whose last play would begin to follow only
    beyond the limit is never passed."""
    rising = m.here.rising[0]
    k = m.here.k[0]
    if k > 0:
        c = m.here.depth[0]
        x = along(m, m.here.input[0])
        room = t.limit[1 - rising] + along(m, m.here.output[0])
        m.corner.output[c] = m.here.output[0]
        m.corner.passed[c, rising] = x
        m.corner.passed[c, 1 - rising] = t.literal.most[0] if t.reach[k] > room else t.way[k] - x
        m.corner.top[c] = k
        m.corner.rose[c] = rising
        m.here.depth[0] += 1
        m.here.k[0] = 0
    m.here.rising[0] = 1 - rising
    m.plays.limited[0] = 0
    m.plays.sign[0] = -m.plays.sign[0]


@jit
def find_segment(t: Curve, k: int, left: int, way: Scalar, reach: Scalar, both: bool) -> int:
    """The last of `left` segments from k on that begins before `way` and, if `both`, before `reach`; segment k does."""
    half = left // 2
    while half > 0:
        if (not both or reach > t.reach[k + half]) and way > t.way[k + half]:
            k += half
        left -= half
        half = left // 2
    return k


@jit
def move_or_stop(t: Curve, m: Memory, c: int, x: Scalar, end: Scalar, stop: bool) -> bool:
    """Move the plays in corner c's block to the input x, or stop them where their sum is `end`: always if `stop`,
    otherwise only at a limit that they reach first. x and `end` are along the move. Returns whether they stop."""
    rising = m.here.rising[0]
    origin = m.corner.passed[c, 1 - rising]
    cap: Scalar = m.corner.passed[c, rising]
    after = cap
    begin = cap
    y = along(m, m.corner.output[c])
    k = m.here.k[0]
    limits = stop
    if m.corner.rose[c] != rising:
        limits = limits or t.reach[m.corner.top[c]] > t.inside[rising] - y
        k = find_segment(t, k, m.corner.top[c] - k, x + origin, end - y, limits)
        begin = t.way[k] - origin
        y = y + t.reach[k]
    m.plays.begin[0] = along(m, begin)
    m.plays.start[0] = along(m, y)
    m.plays.gain[0] = t.gain[k]
    m.here.k[0] = k
    output = end if stop else y + (x - begin) * t.gain[k]
    if stop or output > end:
        to = begin + (end - y) * t.slope[k]
        m.here.input[0] = along(m, to if to < x else x)
        m.here.output[0] = along(m, end)
        forget_line(m)
        return True
    m.here.input[0] = along(m, x)
    m.plays.behind[0] = m.here.input[0]
    if m.corner.rose[c] != rising:
        after = t.way[k + 1] - origin
        cap = after if m.corner.rose[c] == BOTTOM else cap
        if limits:
            cap = begin + (t.inside[rising] - y) * t.slope[k]
        m.plays.from_input[0] = -along(m, origin)
        m.plays.from_output[0] = m.corner.output[c]
        if k == 0 and origin <= t.range[1 - rising]:
            m.plays.behind[0] = m.plays.from_input[0]
    if output < along(m, m.here.output[0]):
        cap = x
    else:
        m.here.output[0] = along(m, output)
        cap = t.range[rising] if t.range[rising] < cap else cap
    m.plays.cap[0] = along(m, cap)
    m.plays.next[0] = along(m, after if after < cap else cap)
    return False


@jit
def move_to_output(t: Curve, m: Memory, output: Scalar) -> None:
    """Move the plays until their sum is `output`, up to rounding."""
    if along(m, output) < along(m, m.here.output[0]):
        reverse(t, m)
    rising = m.here.rising[0]
    kept = 0
    left = m.here.depth[0]
    while left > 1:
        middle = kept + left // 2
        reach = t.literal.zero[0] if m.corner.rose[middle] == rising else t.reach[m.corner.top[middle]]
        if reach > along(m, output - m.corner.output[middle]):
            kept = middle
        left -= left // 2
    if kept + 1 < m.here.depth[0]:
        m.here.k[0] = m.corner.top[kept + 1]
        m.here.depth[0] = kept + 1
    m.plays.limited[0] = 0
    move_or_stop(t, m, kept, t.literal.most[0], along(m, output), True)


@jit
def move_to_input(t: Curve, m: Memory, to: Scalar) -> bool:
    """Move the plays to any input, or only to the limit if they reach it first. Returns whether they do."""
    if along(m, to) < along(m, m.here.input[0]):
        reverse(t, m)
    x = along(m, to)
    rising = m.here.rising[0]
    kept = m.here.depth[0] - 1
    if kept > 0 and x >= m.corner.passed[kept, rising]:
        left = kept
        kept = 0
        while left > 1:
            middle = kept + left // 2
            if m.corner.passed[middle, rising] > x:
                kept = middle
            left -= left // 2
        m.here.k[0] = m.corner.top[kept + 1]
        m.here.depth[0] = kept + 1
    return move_or_stop(t, m, kept, x, t.limit[rising], False)


@jit
def move_in_block(t: Curve, m: Memory, to: Scalar) -> bool:
    """Go on to an input short of `cap` where more plays of the block follow. Returns False if a search must."""
    way = along(m, to - m.plays.from_input[0])
    k = m.here.k[0] + 1
    while way > t.way[k + 1]:
        k += 1
        if k == m.here.k[0] + 8:
            return False
    m.plays.begin[0] = m.plays.from_input[0] + along(m, t.way[k])
    m.plays.start[0] = m.plays.from_output[0] + along(m, t.reach[k])
    m.plays.gain[0] = t.gain[k]
    output = m.plays.start[0] + (to - m.plays.begin[0]) * m.plays.gain[0]
    if along(m, output) < along(m, m.here.output[0]):
        return False
    after = m.plays.from_input[0] + along(m, t.way[k + 1])
    m.plays.next[0] = after if along(m, after) < along(m, m.plays.cap[0]) else m.plays.cap[0]
    m.here.k[0] = k
    m.here.input[0] = to
    m.here.output[0] = output
    return True


@jit(inline=True)
def plays_step(t: Curve, m: Memory, to: Scalar) -> Scalar:
    """The sum of the plays at the next input; a NaN moves nothing."""
    rising = m.here.rising[0]
    at = m.here.input[0]
    on = to > at if rising else to < at
    most = m.plays.next[0] if on else at
    least = at if on or m.here.k[0] > 0 else m.plays.behind[0]
    if least < to < most if rising else most < to < least:
        m.here.input[0] = to
        m.here.output[0] = m.plays.start[0] + (to - m.plays.begin[0]) * m.plays.gain[0]
        return m.here.output[0]
    if on and (to < m.plays.cap[0] if rising else to > m.plays.cap[0]) and move_in_block(t, m, to):
        return m.here.output[0]
    if to < m.here.input[0] or to > m.here.input[0]:
        move_to_input(t, m, to)
    return m.here.output[0]


@jit
def start(t: Curve, m: Memory, s: Start) -> None:
    """Set a start memory. Each play is a block of its own."""
    m.corner.output[0] = s.bottom[0]
    m.corner.passed[0, 0] = s.bottom[1]
    m.corner.passed[0, 1] = s.bottom[2]
    m.corner.top[0] = s.top
    m.corner.rose[0] = BOTTOM
    m.here.depth[0] = 1
    for k in range(s.top - 1, 0, -1):
        c = s.step * k
        m.here.k[0] = k
        m.here.rising[0] = 1 if k <= s.risen else 0
        m.plays.sign[0] = t.literal.one[0] if m.here.rising[0] else -t.literal.one[0]
        m.here.input[0] = s.center[c, 0] + along(m, t.way[k] * t.literal.half[0])
        m.here.output[0] = s.center[c, 1] + along(m, t.reach[k] * t.literal.half[0])
        reverse(t, m)
    m.here.k[0] = 0
    m.here.rising[0] = 1
    m.plays.sign[0] = t.literal.one[0]
    m.here.input[0] = s.center[0, 0]
    m.here.output[0] = s.center[0, 1]
    forget_line(m)
