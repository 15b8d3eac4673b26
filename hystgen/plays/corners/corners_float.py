"""Plays of the corner engine in floating point: `c_runtime/plays/corners_float.c`, and code for both arithmetics."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hystgen.basics.jit import jit
from hystgen.plays.slots import Counts, Reals

# places in `Memory.real`: the plays, then the operator's own numbers
(INPUT, OUTPUT, NEXT, CAP, BEHIND, FROM, BASE, BEGIN, START, GAIN, SIGN, UNDO_INPUT, UNDO_OUTPUT, BEFORE, RETURNED,
 DRIVE, UNDO_DRIVE, REFERENCE, LEVEL) = range(19)  # fmt: skip  (CAP .. SIGN: in floating point)
# and in `Memory.counts`
(K, DEPTH, RISING, LIMITED, UNDO_K, UNDO_DEPTH, UNDO_RISING, STEPPED, COMMITTED, REPEAT, BITS, STATUS,
 ASCENDING, UNDO_ASCENDING, ON, SOUGHT) = range(16)  # fmt: skip  (ON: in fixed point; SOUGHT: with effects)
# `here` and `undo` of the operators in C: the indices of their first numbers in `Memory.real` and `Memory.counts`
HERE, UNDO = (INPUT, K), (UNDO_INPUT, UNDO_K)
BOTTOM = 2  # `rose` of the bottom, which is opposite to both directions
# places in `Curve.constant`
MOST, ZERO, HALF, ONE = range(4)


class Curve(NamedTuple):
    """`hystgen_curve_t`: one operator; [0] is for falling moves, with signs changed, [1] for rising ones."""

    way: Reals  # (n + 2): play k begins to follow when a move has come this far
    reach: Reals  # (n + 2): the same in output
    gain: Reals  # (n + 2)
    slope: Reals  # (n + 2): 1 / gain
    limit: Reals  # (2): of the output
    inside: Reals  # (2): outputs up to here stay within the limit whatever rounding does
    range: Reals  # (2): of the input
    constant: Reals  # MOST, ZERO, HALF, ONE


class Start(NamedTuple):
    """`hystgen_start_t`: a start memory."""

    center: Reals  # (1 or n + 1, 2): input and output of the sum while plays 0 .. k hold play k's value
    step: int  # 0: one for all plays, 1: one for each
    risen: int  # plays up to this one are left by rising moves, the others by falling ones
    bottom: Reals  # output, and the inputs at which a falling and a rising move passed it
    top: int  # plays from here on cannot move within the range


class Memory(NamedTuple):
    """One instance: plain arrays."""

    real: Reals
    counts: Counts
    output: Reals  # (n + 1): for each corner, like the next three
    passed: Reals  # (n + 1, 2): input at which a falling and a rising move have passed it, along the move
    top: Counts
    rose: Counts


def new_memory(plays: int, dtype: Any) -> Memory:
    """Memory for one instance of a model with that many plays beside play 0; `init` gives it its values."""
    return Memory(
        real=np.zeros(LEVEL + 1, dtype),
        counts=np.zeros(16, np.int64),
        output=np.zeros(plays + 1, dtype),
        passed=np.zeros((plays + 1, 2), dtype),
        top=np.zeros(plays + 1, np.int64),
        rose=np.zeros(plays + 1, np.int64),
    )


@jit
def copy_place(m: Any, to: tuple[int, int], source: tuple[int, int]) -> None:
    """Field by field, HERE or UNDO: input and output; k, depth and rising."""
    for i in range(2):
        m.real[to[0] + i] = m.real[source[0] + i]
    for i in range(3):
        m.counts[to[1] + i] = m.counts[source[1] + i]


@jit(inline=True)
def along(m: Memory, x: Any) -> Any:
    """x as seen along the present move: a falling move is a rising one with all signs changed."""
    return m.real[SIGN] * x


@jit(inline=True)
def forget_line(t: Curve, m: Memory) -> None:
    """Forget the line of the last outputs: the next sample searches."""
    m.real[SIGN] = t.constant[ONE] if m.counts[RISING] else -t.constant[ONE]
    m.real[NEXT] = m.real[INPUT]
    m.real[CAP] = m.real[INPUT]
    m.real[BEHIND] = m.real[INPUT]


@jit
def leave_corner(t: Curve, m: Memory) -> None:
    """Leave a corner here. A block whose last play follows only beyond the limit is never passed."""
    rising = m.counts[RISING]
    k = m.counts[K]
    c = m.counts[DEPTH]
    x = along(m, m.real[INPUT])
    room = t.limit[1 - rising] + along(m, m.real[OUTPUT])
    m.output[c] = m.real[OUTPUT]
    m.passed[c, rising] = x
    m.passed[c, 1 - rising] = t.constant[MOST] if t.reach[k] > room else t.way[k] - x
    m.top[c] = k
    m.rose[c] = rising
    m.counts[DEPTH] += 1


@jit
def turn_back(t: Curve, m: Memory) -> None:
    """Turn back: a corner stays where plays have followed."""
    if m.counts[K] > 0:
        leave_corner(t, m)
        m.counts[K] = 0
    m.counts[RISING] = 1 - m.counts[RISING]
    m.counts[LIMITED] = 0
    m.real[SIGN] = -m.real[SIGN]


@jit
def find_segment(step: Reals, k: int, end: int, way: Any) -> int:
    """The last of segments k .. end - 1 that begins before `way`; segment k does. `step`: all ways, or all reaches."""
    middle = (k + end) // 2
    while middle > k:
        if way > step[middle]:
            k = middle
        else:
            end = middle
        middle = (k + end) // 2
    return k


@jit
def stop_in_block(t: Curve, m: Memory, output: Any, to: Any) -> None:
    """End the move in the top corner's block: where the sum is `output`, or at `to` if that comes first."""
    c = m.counts[DEPTH] - 1
    rising = m.counts[RISING]
    reach = along(m, output - m.output[c])
    x = m.passed[c, rising]
    k = m.counts[K]
    if m.rose[c] != rising:
        k = find_segment(t.reach, k, m.top[c], reach)
        reach = reach - t.reach[k]
        x = t.way[k] - m.passed[c, 1 - rising]
    x = x + reach * t.slope[k]
    m.real[INPUT] = along(m, x) if x < along(m, to) else to
    m.real[OUTPUT] = output
    m.counts[K] = k
    forget_line(t, m)


@jit
def move_to_output(t: Curve, m: Memory, output: Any) -> None:
    """Move the plays to where their sum is `output`, up to rounding."""
    if along(m, output) < along(m, m.real[OUTPUT]):
        turn_back(t, m)
    rising = m.counts[RISING]
    kept = 0
    while m.counts[DEPTH] - kept > 1:
        middle = (kept + m.counts[DEPTH]) // 2
        reach = t.constant[ZERO] if m.rose[middle] == rising else t.reach[m.top[middle]]
        if along(m, output - m.output[middle]) >= reach:
            m.counts[DEPTH] = middle
            m.counts[K] = m.top[middle]
        else:
            kept = middle
    m.counts[LIMITED] = 0
    stop_in_block(t, m, output, along(m, t.constant[MOST]))


@jit
def move_to_input(t: Curve, m: Memory, to: Any) -> bool:
    """Move the plays to any input. False where the limit comes first, for the caller to stop them there."""
    if along(m, to) < along(m, m.real[INPUT]):
        turn_back(t, m)
    x = along(m, to)
    rising = m.counts[RISING]
    passed = m.counts[DEPTH] - 1
    if passed > 0 and x >= m.passed[passed, rising]:
        kept = 0
        while passed - kept > 1:
            middle = (kept + passed) // 2
            if x >= m.passed[middle, rising]:
                passed = middle
            else:
                kept = middle
        m.counts[K] = m.top[passed]
        m.counts[DEPTH] = passed
    c = m.counts[DEPTH] - 1
    k = m.counts[K]
    cap = m.passed[c, rising]
    after = cap
    begin = cap
    y = along(m, m.output[c])
    m.real[BEHIND] = to
    if m.rose[c] != rising:
        top = m.top[c]
        origin = m.passed[c, 1 - rising]
        room = t.inside[rising] - y
        k = find_segment(t.way, k, top, x + origin)
        begin = t.way[k] - origin
        y = y + t.reach[k]
        after = t.way[k + 1] - origin
        if t.reach[top] > room:
            cap = begin + (room - t.reach[k]) * t.slope[k]
        m.real[FROM] = -along(m, origin)
        m.real[BASE] = m.output[c]
        if k == 0 and origin <= t.range[1 - rising]:
            m.real[BEHIND] = m.real[FROM]
    m.real[BEGIN] = along(m, begin)
    m.real[START] = along(m, y)
    m.real[GAIN] = t.gain[k]
    output = m.real[START] + (to - m.real[BEGIN]) * m.real[GAIN]
    if along(m, output) > t.limit[rising]:
        return False
    if along(m, output) < along(m, m.real[OUTPUT]):
        cap = x
    else:
        m.real[OUTPUT] = output
    cap = t.range[rising] if t.range[rising] < cap else cap
    m.real[CAP] = along(m, cap)
    m.real[NEXT] = along(m, after if after < cap else cap)
    m.counts[K] = k
    m.real[INPUT] = to
    return True


@jit
def move_in_block(t: Curve, m: Memory, to: Any) -> bool:
    """Move on to an input short of CAP: more plays of the block follow. False if a search would be faster."""
    way = along(m, to - m.real[FROM])
    k = m.counts[K] + 1
    many = m.counts[K] + 8
    while k < many and way > t.way[k + 1]:
        k += 1
    m.real[BEGIN] = m.real[FROM] + along(m, t.way[k])
    m.real[START] = m.real[BASE] + along(m, t.reach[k])
    m.real[GAIN] = t.gain[k]
    output = m.real[START] + (to - m.real[BEGIN]) * m.real[GAIN]
    if k == many or along(m, output - m.real[OUTPUT]) < t.constant[ZERO]:
        return False
    after = m.real[FROM] + along(m, t.way[k + 1])
    m.real[NEXT] = after if along(m, after - m.real[CAP]) < t.constant[ZERO] else m.real[CAP]
    m.counts[K] = k
    m.real[INPUT] = to
    m.real[OUTPUT] = output
    return True


@jit(inline=True)
def plays_step(t: Curve, m: Memory, to: Any) -> Any:
    """The sum of the plays at the next input; a NaN moves nothing."""
    rising = m.counts[RISING]
    at = m.real[INPUT]
    on = to > at if rising else to < at
    most = m.real[NEXT] if on else at
    least = at if on or m.counts[K] > 0 else m.real[BEHIND]
    if least < to < most if rising else most < to < least:
        m.real[INPUT] = to
        m.real[OUTPUT] = m.real[START] + (to - m.real[BEGIN]) * m.real[GAIN]
        return m.real[OUTPUT]
    if on and (to < m.real[CAP] if rising else to > m.real[CAP]) and move_in_block(t, m, to):
        return m.real[OUTPUT]
    if to < m.real[INPUT] or to > m.real[INPUT]:
        move_to_input(t, m, to)
    return m.real[OUTPUT]


@jit
def start(t: Curve, m: Memory, s: Start) -> None:
    """Start memory. Each play is a block of its own."""
    m.output[0] = s.bottom[0]
    m.passed[0, 0] = s.bottom[1]
    m.passed[0, 1] = s.bottom[2]
    m.top[0] = s.top
    m.rose[0] = BOTTOM
    m.counts[DEPTH] = 1
    for k in range(s.top - 1, 0, -1):
        center = s.center[s.step * k]
        m.counts[K] = k
        m.counts[RISING] = 1 if k <= s.risen else 0
        m.real[SIGN] = t.constant[ONE] if m.counts[RISING] else -t.constant[ONE]
        m.real[INPUT] = center[0] + along(m, t.way[k] * t.constant[HALF])
        m.real[OUTPUT] = center[1] + along(m, t.reach[k] * t.constant[HALF])
        leave_corner(t, m)
    m.counts[K] = 0
    m.counts[RISING] = 1
    m.real[INPUT] = s.center[0, 0]
    m.real[OUTPUT] = s.center[0, 1]
    forget_line(t, m)
