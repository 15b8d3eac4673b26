"""Movement and bending of plays in floating point: the search, and the operators."""

from __future__ import annotations

from collections.abc import Callable

from hystgen.basics.jit import Answer, Scalar, jit, zero
from hystgen.compensator.chain.layout import FloatChainTables
from hystgen.compensator.chain.moving_plays import Kind, operators, unmoved
from hystgen.compensator.chain.parts import BENDS, ELEMENTS, MOVES
from hystgen.compensator.chain.step import ChainState
from hystgen.effects import plays as at
from hystgen.plays.loop import loop_solve
from hystgen.plays.slots import Reals


def search(
    _: object, sum_at: Callable[..., tuple[Scalar, Scalar, Scalar]], alike: Callable[..., bool], *__: object
) -> Answer:
    """The search of `moving_search.c`, from the functions that give the sum of the plays at an input and its slopes,
    and tell whether the same plays follow to two inputs."""

    @jit
    def searched(t: FloatChainTables, s: ChainState, h: Scalar) -> Scalar:
        """Input of the plays at which their sum is h: by Newton's method, from the input extrapolated with the slope of
        the last search, within the interval that remains, then by bisection. With elements, the input and h are kept
        for the move there."""
        number, m = t.moving.number, t.moving
        low: Scalar = number.least_input[0]
        high: Scalar = number.largest_input[0]
        w: Scalar = s.plays.play[0] + (h - s.plays.step.level[0]) * inverse(t, s.search.slope[0])
        k = 1
        while True:
            if not (w > low and w < high):  # outside the interval, or the end that was just tried
                w = low + (high - low) * number.half[0]
            total, slope, steady = sum_at(t, s, w)
            left = h - total
            if left < number.smooth[0] and left > -number.smooth[0] and s.own.moving[0]:
                lands = w + left * inverse(t, slope)
                if alike(t, s, w, lands):
                    s.search.slope[0] = steady
                    s.elements.found[0] = lands
                    s.elements.asked[0] = h
                    return lands
            if (left <= number.close[0] and left >= -number.close[0]) or k == at.NEWTON_TRIES + m.halves:
                s.search.slope[0] = steady
                w = w + left * (inverse(t, slope) if m.moves == at.DASHPOT else number.rate[0])
                if len(m.elements.element) > 0 and k < at.NEWTON_TRIES + m.halves:
                    s.elements.found[0] = w  # the sum there is h but for rounding
                    s.elements.asked[0] = h
                return w
            if left > zero(left):
                low = w
            else:
                high = w
            w = low if k > at.NEWTON_TRIES else w + left * inverse(t, slope)
            k += 1

    return searched


@jit
def inverse(t: FloatChainTables, slope: Scalar) -> Scalar:
    """1/slope, without division."""
    rate: Scalar = t.moving.number.rate[0]
    for _ in range(t.moving.turns):
        rate = rate + rate - slope * rate * rate
    return rate


@jit(inline=True)
def same(t: FloatChainTables, x: Scalar) -> Scalar:  # noqa: ARG001  as in fixed point
    """A sum of the plays as a signal, and a signal as a sum."""
    return x


@jit(inline=True)
def begin(s: ChainState, p: Reals) -> None:
    """Set the slope with which the first search begins: that without any play following."""
    s.search.slope[0] = p[0]


@jit
def found(m: at.MovingTables, s: ChainState, w: Scalar) -> bool:
    """Whether the last search has led to w, so that the sum there is known. Forgets where it has led."""
    led = s.own.inverse[0] != 0 and w == s.elements.found[0]
    s.elements.found[0] = m.number.largest_input[0]
    return bool(led)


@jit
def turned(t: FloatChainTables, s: ChainState) -> None:
    """Set the slope with which a search begins right after a turn, when no play follows."""
    slope = t.plays.weight[0]
    for j in range(len(t.moving.elements.element)):
        slope = slope + t.moving.elements.element.weight[j] * s.elements.element.c[j, 0]
    s.search.slope[0] = slope


@jit(inline=True)
def ordered(m: at.MovingTables) -> bool:
    """Whether a sum assumes that plays behind the first stationary one are stationary too: yes if they keep the order
    of their thresholds, up to rounding and `Mover.disorder`."""
    return m.moves in (at.PLAIN, at.DASHPOT)


KIND = Kind(
    same, same, loop_solve, MOVES.floating, BENDS.floating, ELEMENTS.floating, search, begin, found, turned, ordered
)
PLAYS = operators(KIND)
UNMOVED = unmoved(KIND)
