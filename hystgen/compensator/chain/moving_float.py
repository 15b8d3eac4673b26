"""Movement and bending of plays in floating point: the search, and the operators."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hystgen.basics.jit import jit
from hystgen.compensator.chain.layout import ChainTables
from hystgen.compensator.chain.moving_plays import Kind, operators
from hystgen.compensator.chain.parts import BENDS, MOVES
from hystgen.compensator.chain.step import ChainState
from hystgen.effects.plays import HALF, LARGEST_INPUT, LEAST_INPUT
from hystgen.plays.loop import loop_solve


def search(sum_at: Callable[..., Any]) -> Callable[..., Any]:
    """`search_float.c`, from the function that gives the sum of the plays at an input."""

    @jit
    def searched(t: ChainTables, s: ChainState, h: Any) -> Any:
        """Input of the plays at which their sum is h, by bisection between the present input and the farthest one."""
        number = t.moving.number
        here = s.plays.play[0]
        total = sum_at(t, s, here)
        if total == h:
            return here
        low = here if total < h else number[LEAST_INPUT]
        high = number[LARGEST_INPUT] if total < h else here
        for _ in range(t.moving.halves):
            w = low + (high - low) * number[HALF]
            if sum_at(t, s, w) < h:
                low = w
            else:
                high = w
        return high

    return searched


@jit(inline=True)
def same(t: ChainTables, x: Any) -> Any:  # noqa: ARG001  as in fixed point
    """A sum of the plays as a signal, and a signal as a sum."""
    return x


PLAYS = operators(Kind(same, same, loop_solve, MOVES.floating, BENDS.floating, search))
