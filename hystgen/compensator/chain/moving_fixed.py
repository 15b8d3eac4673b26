"""Movement and bending of plays in fixed point: the search, and the operators."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hystgen.basics.jit import jit
from hystgen.compensator.chain.layout import ChainTables
from hystgen.compensator.chain.moving_plays import Kind, operators
from hystgen.compensator.chain.parts import BENDS, MOVES
from hystgen.compensator.chain.step import ChainState
from hystgen.plays.fixed import loop_solve, nearest


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


PLAYS = operators(Kind(level, asked, loop_solve, MOVES.coded(), BENDS.coded(), search))
