"""How plays move and are bent in fixed point: `c_runtime/moved_*.c`, `bent_fixed.c` and `relaxing_fixed.c`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hystgen.arithmetic.factors import times
from hystgen.basics.jit import jit
from hystgen.compensator.chain.layout import LARGEST_LEVEL, LEVEL_DROP, ChainTables
from hystgen.compensator.chain.moving import (
    DASHPOT,
    DILATED,
    RELAXING,
    STRAIGHT,
    YIELD_BEGIN,
    YIELD_C3,
    YIELD_LIFT,
    YIELD_SCALE,
    FixedMovingTables,
    stretch,
)
from hystgen.compensator.chain.moving_plays import Kind, operators
from hystgen.compensator.chain.step import ChainState
from hystgen.effects.bend import bend
from hystgen.front.curve import HALF
from hystgen.plays.fixed import loop_solve, nearest
from hystgen.plays.loop import State
from hystgen.plays.slots import Reals


@jit
def yields(t: FixedMovingTables, x: Any) -> Any:
    """What a play that is stretched by x, not negative, gains of it in a step, with bits below a step of the input."""
    inside = t.stretch if x > t.stretch else x
    low = 0
    high = len(t.yields)
    while high - low > 1:
        middle = (low + high) // 2
        if inside < t.yields[middle, YIELD_BEGIN]:
            high = middle
        else:
            low = middle
    h = (inside - t.yields[low, YIELD_BEGIN]) << t.yields[low, YIELD_SCALE]
    y = h - h
    for k in range(YIELD_C3, YIELD_BEGIN, -1):
        y = t.yields[low, k] + ((y * h + HALF) >> 31)
    y = y << t.yields[low, YIELD_LIFT]
    most = x << t.yield_bits
    return most if y > most else y


@jit
def change(t: FixedMovingTables, r: Reals, i: int, s: State, lost: Reals, w: Any) -> Any:
    """How far play i with a nonlinear dashpot moves while the input of the plays goes to w, as a yield."""
    x = s.play[0] + times(w - s.play[0], t.seen[0], t.seen[1]) - s.play[i]
    gained = x - x
    if x > r[i]:
        gained = yields(t, x - r[i])
    elif x < -r[i]:
        gained = -yields(t, -x - r[i])
    return gained + lost[i]


@jit
def moved(t: FixedMovingTables, r: Reals, i: int, s: State, lost: Reals, w: Any) -> Any:
    """Play i once the input of the plays has gone to w."""
    q = s.play[i]
    if t.moves == DASHPOT:
        return q + nearest(change(t, r, i, s, lost, w), t.yield_bits)
    if t.moves == RELAXING:
        return q + times(stretch(w - q, r[i]), t.first[i, 0], t.first[i, 1])
    threshold = r[i]
    if t.moves == DILATED:
        before = s.play[0]
        way = w - before if w > before else before - w
        threshold = r[i] + times(way, t.first[i, 0], t.first[i, 1])
    low = w - threshold
    high = w + threshold
    upper = high if q > high else q
    return low if upper < low else upper


@jit
def left(t: FixedMovingTables, r: Reals, i: int, z: Any, w: Any) -> Any:
    """Where play i comes to rest from z with its input held at w, as far as one more step goes."""
    if t.moves == RELAXING:
        return z + times(stretch(w - z, r[i]), t.second[i, 0], t.second[i, 1])
    return z


@jit
def keep(t: FixedMovingTables, r: Reals, i: int, s: State, lost: Reals, w: Any, z: Any) -> None:
    """Play i has moved, and comes to rest at z, while the input of the plays goes to w."""
    if t.moves == DASHPOT:
        lost[i] = change(t, r, i, s, lost, w) - ((z - s.play[i]) << t.yield_bits)
    s.play[i] = z


@jit
def put(t: FixedMovingTables, r: Reals, i: int, s: State, lost: Reals, z: Any) -> None:
    """Play i rests at z."""
    if t.moves == DASHPOT:
        lost[i] = r[0]
    s.play[i] = z


@jit
def bent(t: FixedMovingTables, plays: Any, i: int, z: Any) -> Any:  # noqa: ARG001  as in floating point
    """What play i contributes at z."""
    if t.bends == STRAIGHT:
        return z
    value, _ = bend(t.bump, t.bump_of[i], z)
    return z + nearest(value, t.bump_bits)


@jit
def relaxing_follow(t: FixedMovingTables, plays: Any, s: State, w: Any) -> Any:
    """Viscous plays of one time constant follow their input w; their sum. They stay as near to each other as they are
    to be, give or take no rounding."""
    r, p = plays.threshold, plays.weight
    total = p[0] * w
    for i in range(1, len(r)):
        z = s.play[i] + times(stretch(w - s.play[i], r[i]), t.first[1, 0], t.first[1, 1])
        total = total + p[i] * z
        rest = z + times(stretch(w - z, r[i]), t.second[1, 0], t.second[1, 1])
        if i > 1:
            room = r[i] - r[i - 1]
            if rest > s.play[i - 1] + room:
                rest = s.play[i - 1] + room
            elif rest < s.play[i - 1] - room:
                rest = s.play[i - 1] - room
        s.play[i] = rest
    s.play[0] = w
    return total


@jit
def relaxing_input(t: FixedMovingTables, plays: Any, s: State, h: Any) -> Any:  # noqa: ARG001  as in floating point
    """Input of viscous plays at which their sum is h: none is stretched where play 1 rests, and from there on they are
    solved for like others, with smaller slopes."""
    s.play[0] = s.play[1]
    return loop_solve(t.relaxed, s, h)


def search(sum_at: Callable[..., Any]) -> Callable[..., Any]:
    """`search_fixed.c`, with what the plays give at an input."""

    @jit
    def searched(t: ChainTables, s: ChainState, h: Any) -> Any:
        """Input of the plays at which their sum is h, by halves between where it is and the farthest: the nearer of
        two neighbours."""
        here = s.plays.play[0]
        total = sum_at(t, s, here)
        if total == h:
            return here
        low = here if total < h else -t.moving.farthest
        high = t.moving.farthest if total < h else here
        while high - low > 1:
            middle = low + (high - low) // 2
            if sum_at(t, s, middle) >= h:
                high = middle
            else:
                low = middle
        return low if h - sum_at(t, s, low) < sum_at(t, s, high) - h else high

    return searched


@jit
def level(t: ChainTables, total: Any) -> Any:
    """A sum of the plays, which has bits below those of a signal, as one."""
    return nearest(total, t.number[LEVEL_DROP])


@jit
def asked(t: ChainTables, h: Any) -> Any:
    """The sum that a signal asks of the plays, kept to what they can give."""
    inside = h
    if inside > t.number[LARGEST_LEVEL]:
        inside = t.number[LARGEST_LEVEL]
    elif inside < -t.number[LARGEST_LEVEL]:
        inside = -t.number[LARGEST_LEVEL]
    return inside << t.number[LEVEL_DROP]


PLAYS = operators(
    Kind(level, asked, loop_solve, relaxing_follow, relaxing_input, moved, left, keep, put, bent, search)
)
