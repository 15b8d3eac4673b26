"""The plays of the corner engine in floating point: `c_runtime/corners_float.c`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hystgen.corners.memory import (
    BASE,
    BEGIN,
    BOTTOM,
    CAP,
    DEPTH,
    FROM,
    GAIN,
    HALF,
    INPUT,
    LIMITED,
    MOST,
    NEXT,
    ONE,
    OUTPUT,
    RISING,
    SIGN,
    START,
    ZERO,
    Curve,
    K,
    Memory,
    Reals,
    Start,
)


def along(m: Memory, x: Any) -> Any:
    """x as the present move sees it: a falling move is a rising one with all signs changed."""
    return m.real[SIGN] * x


def forget_line(t: Curve, m: Memory) -> None:
    """There is no line to go on along: the next sample searches."""
    m.real[NEXT] = along(m, -t.constant[MOST])
    m.real[CAP] = m.real[NEXT]


def leave_corner(t: Curve, m: Memory) -> None:
    """Leave a corner here. A block whose last play follows beyond the limit only is never passed."""
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


def turn_back(t: Curve, m: Memory) -> None:
    """Turn; a corner stays where plays have followed."""
    if m.counts[K] > 0:
        leave_corner(t, m)
        m.counts[K] = 0
    m.counts[RISING] = 1 - m.counts[RISING]
    m.real[SIGN] = -m.real[SIGN]


def find_segment(step: Reals, k: int, last: int, way: Any) -> int:
    """The last of segments k .. last that begins before `way`; `step` are all ways, or all reaches."""
    while k < last:
        middle = (k + last) // 2
        if way > step[middle + 1]:
            k = middle + 1
        else:
            last = middle
    return k


def set_line(t: Curve, m: Memory, k: int) -> None:
    """Set the line of segment k of the block that counts from FROM and BASE."""
    m.real[BEGIN] = m.real[FROM] + along(m, t.way[k])
    m.real[START] = m.real[BASE] + along(m, t.reach[k])
    m.real[GAIN] = t.gain[k]
    m.real[NEXT] = m.real[FROM] + along(m, t.way[k + 1])


def move_to_output(t: Curve, m: Memory, output: Any) -> None:
    """Move the plays to where their sum is `output`, as nearly as floating point can tell."""
    if along(m, output) < along(m, m.real[OUTPUT]):
        turn_back(t, m)
    rising = m.counts[RISING]
    kept = 0
    passed = m.counts[DEPTH]
    middle = passed - 1
    while passed - kept > 1:
        reach = t.constant[ZERO] if m.rose[middle] == rising else t.reach[m.top[middle]]
        if along(m, output - m.output[middle]) >= reach:
            passed = middle
            m.counts[K] = m.top[middle]
        else:
            kept = middle
        middle = (kept + passed) // 2
    m.counts[DEPTH] = passed
    reach = along(m, output - m.output[kept])
    x = m.passed[kept, rising]
    if m.rose[kept] != rising:
        k = find_segment(t.reach, m.counts[K], m.top[kept] - 1, reach)
        m.counts[K] = k
        reach = reach - t.reach[k]
        x = t.way[k] - m.passed[kept, 1 - rising]
    m.real[INPUT] = along(m, x + reach * t.slope[m.counts[K]])
    m.real[OUTPUT] = output
    m.counts[LIMITED] = 0
    forget_line(t, m)


def move_to_input(t: Curve, m: Memory, to: Any) -> Any:
    """Move the plays to an input that another corner may count for."""
    x = along(m, to)
    if x < along(m, m.real[INPUT]):
        turn_back(t, m)
        x = -x
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
    at_once = m.rose[c] == rising
    origin = m.passed[c, rising] if at_once else -m.passed[c, 1 - rising]
    cap = origin
    m.real[FROM] = along(m, origin)
    m.real[BASE] = m.output[c]
    if at_once:
        m.real[BEGIN] = m.real[FROM]
        m.real[START] = m.real[BASE]
        m.real[GAIN] = t.gain[k]
        m.real[NEXT] = m.real[FROM]
    else:
        top = m.top[c]
        room = t.inside[rising] - along(m, m.real[BASE])
        k = find_segment(t.way, k, top - 1, x - origin)
        set_line(t, m, k)
        cap = origin + t.way[top]
        if t.reach[top] > room:
            stop = along(m, m.real[BEGIN]) + (room - t.reach[k]) * t.slope[k]
            cap = stop if stop < cap else cap
    output = m.real[START] + (to - m.real[BEGIN]) * m.real[GAIN]
    if along(m, output) > t.limit[rising]:
        move_to_output(t, m, along(m, t.limit[rising]))
        m.real[INPUT] = m.real[INPUT] if along(m, m.real[INPUT]) < x else to
        m.counts[LIMITED] = 1
        return m.real[OUTPUT]
    if along(m, output) < along(m, m.real[OUTPUT]):
        cap = -t.constant[MOST]
    else:
        m.real[OUTPUT] = output
    cap = t.range[rising] if t.range[rising] < cap else cap
    m.real[CAP] = along(m, cap)
    m.real[NEXT] = m.real[NEXT] if along(m, m.real[NEXT]) < cap else m.real[CAP]
    m.counts[K] = k
    m.real[INPUT] = to
    m.counts[LIMITED] = 0
    return m.real[OUTPUT]


def move_in_block(t: Curve, m: Memory, to: Any) -> Any:
    """Move on to an input short of CAP: more plays of the same block follow."""
    way = along(m, to - m.real[FROM])
    k = m.counts[K]
    last = k + 8
    while k < last and way > t.way[k + 1]:
        k += 1
    set_line(t, m, k)
    output = m.real[START] + (to - m.real[BEGIN]) * m.real[GAIN]
    if k == last or along(m, output - m.real[OUTPUT]) < t.constant[ZERO]:
        return move_to_input(t, m, to)
    m.real[NEXT] = m.real[NEXT] if along(m, m.real[NEXT] - m.real[CAP]) < t.constant[ZERO] else m.real[CAP]
    m.counts[K] = k
    m.real[INPUT] = to
    m.real[OUTPUT] = output
    return output


def plays_step(t: Curve, m: Memory, to: Any) -> Any:
    """The sum of the plays for the next input; a NaN moves nothing."""
    rising = m.counts[RISING]
    if to > m.real[INPUT] if rising else to < m.real[INPUT]:
        if to < m.real[NEXT] if rising else to > m.real[NEXT]:
            m.real[INPUT] = to
            m.real[OUTPUT] = m.real[START] + (to - m.real[BEGIN]) * m.real[GAIN]
            return m.real[OUTPUT]
        if to < m.real[CAP] if rising else to > m.real[CAP]:
            return move_in_block(t, m, to)
    if to < m.real[INPUT] or to > m.real[INPUT]:
        return move_to_input(t, m, to)
    return m.real[OUTPUT]


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
    m.counts[LIMITED] = 0
    m.real[SIGN] = t.constant[ONE]
    m.real[INPUT] = s.center[0, 0]
    m.real[OUTPUT] = s.center[0, 1]
    forget_line(t, m)


COMPILED: list[Callable[..., Any]] = [
    along, forget_line, leave_corner, turn_back, find_segment, set_line, move_to_output, move_to_input,
    move_in_block, plays_step, start,
]  # fmt: skip  (callees before callers)
INLINED: set[Callable[..., Any]] = {along, forget_line, plays_step}
