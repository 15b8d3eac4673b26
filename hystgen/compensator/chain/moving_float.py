"""Movement and bending of plays in floating point: the search, and the operators."""

from __future__ import annotations

from collections.abc import Callable

from hystgen.basics.jit import Answer, Scalar, jit
from hystgen.compensator.chain.layout import FloatChainTables
from hystgen.compensator.chain.moving_plays import Kind, operators
from hystgen.compensator.chain.parts import BENDS, MOVES
from hystgen.compensator.chain.step import ChainState
from hystgen.effects.plays import CLOSE, HALF, LARGEST_INPUT, LEAST_INPUT, NEWTON_TRIES, RATE
from hystgen.plays.loop import loop_solve


def search(_: object, sum_at: Callable[..., tuple[Scalar, Scalar]]) -> Answer:
    """The search of `moving_search.c`, from the function that gives the sum of the plays at an input, and its slope."""

    @jit
    def searched(t: FloatChainTables, s: ChainState, h: Scalar) -> Scalar:
        """Input of the plays at which their sum is h: by Newton's method from the present input, within the interval of
        inputs that are left, then by halving it."""
        number = t.moving.number
        low: Scalar = number[LEAST_INPUT]
        high: Scalar = number[LARGEST_INPUT]
        w: Scalar = s.plays.play[0]
        for k in range(NEWTON_TRIES + t.moving.halves):
            total, slope = sum_at(t, s, w)
            left = h - total
            if left <= number[CLOSE] and left >= -number[CLOSE]:
                return w + left * number[RATE]
            if total < h:
                low = w
            else:
                high = w
            if k < NEWTON_TRIES:
                w = w + left * inverse(t, slope)
            if not (w > low and w < high):  # nor is the end that was just tried
                w = low + (high - low) * number[HALF]
        return high

    return searched


@jit
def inverse(t: FloatChainTables, slope: Scalar) -> Scalar:
    """1/slope, without division."""
    rate: Scalar = t.moving.number[RATE]
    for _ in range(t.moving.turns):
        rate = rate + rate - slope * rate * rate
    return rate


@jit(inline=True)
def same(t: FloatChainTables, x: Scalar) -> Scalar:  # noqa: ARG001  as in fixed point
    """A sum of the plays as a signal, and a signal as a sum."""
    return x


PLAYS = operators(Kind(same, same, loop_solve, MOVES.floating, BENDS.floating, search))
