"""Movement and bending of plays in fixed point: the C of `effects/rate_dependence/` and `effects/noncongruent/`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hystgen.arithmetic.factors import times
from hystgen.basics.jit import jit
from hystgen.compensator.chain.layout import ChainTables
from hystgen.compensator.chain.moving import (
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
    """The yield in a step of a play with a nonlinear dashpot at stretch x >= 0, with bits below a step of the input."""
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
def seen(t: FixedMovingTables, way: Any) -> Any:
    """The part of `way` at which the input counts as standing still."""
    return times(way, t.seen[0], t.seen[1])


@jit
def moved_by(t: FixedMovingTables, gained: Any) -> Any:
    """The move of a play for its yield."""
    return nearest(gained, t.yield_bits)


@jit
def yield_of(t: FixedMovingTables, moved: Any) -> Any:
    """The yield for a play's move."""
    return moved << t.yield_bits


@jit
def share_of(factors: Reals, i: int, x: Any) -> Any:
    """x times the factor of play i."""
    return times(x, factors[i, 0], factors[i, 1])


@jit
def bent(t: FixedMovingTables, plays: Any, i: int, z: Any) -> Any:  # noqa: ARG001  as in floating point
    """Contribution of play i at z."""
    if t.bends == STRAIGHT:
        return z
    value, _ = bend(t.bump, t.bump_of[i], z)
    return z + nearest(value, t.bump_bits)


@jit
def relaxing_follow(t: FixedMovingTables, plays: Any, s: State, w: Any) -> Any:
    """Move viscous plays with one time constant with their input w. Returns their sum. In spite of rounding,
    neighbouring plays rest at most as far apart as their thresholds."""
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
    """Input of viscous plays at which their sum is h. With the input where play 1 rests, none is stretched; beyond that
    they are solved for like plain plays, with smaller slopes."""
    s.play[0] = s.play[1]
    return loop_solve(t.relaxed, s, h)


def search(sum_at: Callable[..., Any]) -> Callable[..., Any]:
    """`search_fixed.c`, from the function that gives the sum of the plays at an input."""

    @jit
    def searched(t: ChainTables, s: ChainState, h: Any) -> Any:
        """Input of the plays at which their sum is h, by bisection between the present input and the farthest one: the
        nearer of two neighbours, or the input beyond the farthest if even that is not enough."""
        here = s.plays.play[0]
        total = sum_at(t, s, here)
        low = -t.moving.farthest if total > h else here
        size = (t.moving.farthest if total < h else here) - low
        while size > 1:
            middle = low + size // 2
            size -= size // 2
            if sum_at(t, s, middle) < h:
                low = middle
        above = h - sum_at(t, s, low)
        if low == t.moving.farthest:
            return low + 1 if above > 0 else low
        below = sum_at(t, s, low + 1) - h
        if above < 0:
            return low - 1
        if below < 0:
            return low + 2
        return low + 1 if above > below else low

    return searched


@jit
def level(t: ChainTables, total: Any) -> Any:
    """A sum of the plays, which has bits below a signal's, as a signal."""
    return nearest(total, t.number.level_drop[0])


@jit
def asked(t: ChainTables, h: Any) -> Any:
    """The sum of the plays that a signal asks for, limited to their range."""
    inside = h
    if inside > t.number.largest_level[0]:
        inside = t.number.largest_level[0]
    elif inside < -t.number.largest_level[0]:
        inside = -t.number.largest_level[0]
    return inside << t.number.level_drop[0]


PLAYS = operators(
    Kind(
        level, asked, loop_solve, relaxing_follow, relaxing_input, share_of, yields, seen, moved_by, yield_of, bent,
        search,
    )
)
