"""The plays of the corner engine in fixed point: `c_runtime/corners_fixed.c`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hystgen.corners.memory import DEPTH, INPUT, OUTPUT, RISING, FixedMemory, K, Reals
from hystgen.fixed import MARGIN, PLAY_MAX, PLAY_MIN, FixedTables, over_slope
from hystgen.reference import OFFSET

INPUT_MOST = 2**31 - 1

Place = tuple[Any, Any, int, int]
"""`hystgen_kink_t`: input, output, plays that follow from there on, corners that hold the others."""


def along(m: FixedMemory, x: Any) -> Any:
    """x as the present move sees it: a falling move is a rising one with all signs changed."""
    return x if m.counts[RISING] else -x


def leave_corner(m: FixedMemory) -> None:
    """Leave a corner here."""
    c = m.counts[DEPTH]
    m.output[c] = m.real[OUTPUT]
    m.input[c] = m.real[INPUT]
    m.top[c] = m.counts[K]
    m.rose[c] = m.counts[RISING]
    m.counts[DEPTH] += 1


def turn_back(m: FixedMemory) -> None:
    """Turn; a corner stays where plays have followed."""
    if m.counts[K] > 0:
        leave_corner(m)
        m.counts[K] = 0
    m.counts[RISING] = 1 - m.counts[RISING]


def kink(t: FixedTables, m: FixedMemory, depth: int, k: int) -> Place:
    """The place where play k begins to follow the present move, until then held by the last of `depth` corners."""
    c = depth - 1
    if m.rose[c] == m.counts[RISING]:
        return m.input[c], m.output[c], k, depth
    return m.input[c] + along(m, t.way[k]), m.output[c] + along(m, t.reach[k]), k, depth


def has_begun(t: FixedTables, m: FixedMemory, c: int, k: int, x: Any, by_output: int) -> bool:
    """Whether play k, held by corner c, follows by the time that the input, or the output, is x."""
    on = along(m, x - (m.output[c] if by_output else m.input[c]))
    if m.rose[c] == m.counts[RISING]:
        return bool(on >= 0)
    return bool(on >= (t.reach[k] if by_output else t.way[k]))


def find(t: FixedTables, m: FixedMemory, x: Any, by_output: int) -> Place:
    """The last place before x on the present move where another play begins to follow, or the present one."""
    place = (m.real[INPUT], m.real[OUTPUT], m.counts[K], m.counts[DEPTH])
    left = m.counts[DEPTH]
    k = m.counts[K]
    if left > 0 and has_begun(t, m, left - 1, m.top[left - 1], x, by_output):
        left -= 1
        low = 0
        while low < left:
            middle = (low + left) // 2
            if has_begun(t, m, middle, m.top[middle], x, by_output):
                left = middle
            else:
                low = middle + 1
        k = m.top[left]
        at = kink(t, m, left + 1, k)
        place = (at[0], at[1], k, left)
    if left > 0:
        last = m.top[left - 1] - 1
        if k < last and has_begun(t, m, left - 1, k + 1, x, by_output):
            k += 1
            while k < last:
                middle = (k + last) // 2
                if has_begun(t, m, left - 1, middle + 1, x, by_output):
                    k = middle + 1
                else:
                    last = middle
            place = kink(t, m, left, k)
    return place


def go_on(t: FixedTables, m: FixedMemory, place: Place, to: Any) -> None:
    """Move on from a place that the present move passes to an input at which the same plays follow."""
    m.real[OUTPUT] = place[1] + t.slope[place[2] + 1] * (to - place[0])
    m.real[INPUT] = to
    m.counts[K] = place[2]
    m.counts[DEPTH] = place[3]


def move_to_input(t: FixedTables, m: FixedMemory, to: Any) -> None:
    """Move the plays to any input."""
    if along(m, to - m.real[INPUT]) < 0:
        turn_back(m)
    go_on(t, m, find(t, m, to, 0), to)


def solve(t: FixedTables, m: FixedMemory, output: Any) -> tuple[Any, Place]:
    """The input that gives `output`, kept near the range, and the place that it was counted from; turns, but moves
    nothing."""
    if along(m, output - m.real[OUTPUT]) < 0:
        turn_back(m)
    place = find(t, m, output, 1)
    x = along(m, place[0]) + over_slope(t, along(m, output - place[1]), place[2] + 1)
    most = t.limits[PLAY_MAX] + t.limits[MARGIN] if m.counts[RISING] else t.limits[MARGIN] - t.limits[PLAY_MIN]
    return along(m, most if x > most else x), place


def move_to_solution(t: FixedTables, m: FixedMemory, place: Place, to: Any) -> None:
    """Move the plays to an input near the one that was solved for from `place`."""
    if along(m, to - place[0]) >= 0:
        following = to
        if place[3] > 0:
            following = kink(t, m, place[3], place[2] + 1)[0]
        if along(m, following - to) >= 0:
            go_on(t, m, place, to)
            return
    move_to_input(t, m, to)


def look_ahead(t: FixedTables, m: FixedMemory, end: Any) -> Any:
    """Output, as the present move sees it, up to which the same plays follow, or up to where the input comes to
    `end`."""
    k = m.counts[K]
    output = along(m, m.real[OUTPUT]) + t.slope[k + 1] * along(m, end - m.real[INPUT])
    if m.counts[DEPTH] > 0:
        following = along(m, kink(t, m, m.counts[DEPTH], k + 1)[1])
        return following if following < output else output
    return output


def start(t: FixedTables, m: FixedMemory, play: Reals) -> None:
    """Start memory: what each play holds, or all of them. Each is a block of its own, as if left by a move that ended
    where the play begins to follow."""
    aside = t.limits[OFFSET]
    m.counts[DEPTH] = 0
    for k in range(len(t.threshold) - 1, 0, -1):
        w = play[k if len(play) > 1 else 0]
        m.counts[K] = k
        m.counts[RISING] = 1 if w + t.threshold[k] <= INPUT_MOST else 0
        m.real[INPUT] = w + along(m, t.threshold[k])
        m.real[OUTPUT] = aside + w * t.slope[k + 1] + along(m, t.start_level[k])
        leave_corner(m)
        aside = aside + w * (t.slope[k + 1] - t.slope[k])
    m.counts[K] = 0
    m.counts[RISING] = 1
    m.real[INPUT] = play[0]
    m.real[OUTPUT] = aside + play[0] * t.slope[1]


COMPILED: list[Callable[..., Any]] = [
    along, leave_corner, turn_back, kink, has_begun, find, go_on, move_to_input, solve, move_to_solution,
    look_ahead, start,
]  # fmt: skip  (callees before callers)
INLINED: set[Callable[..., Any]] = {along}
