"""Movement and bending of plays in floating point: the C of `effects/rate_dependence/` and `effects/noncongruent/`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hystgen.basics.jit import jit
from hystgen.compensator.chain.layout import ChainTables
from hystgen.compensator.chain.moving import (
    BUMP,
    CENTRE,
    HALF,
    INVERSE_SCALE,
    INVERSE_WIDTH,
    LARGEST_INPUT,
    LEAST_INPUT,
    MIDDLE,
    POLYNOMIAL,
    SCALE,
    SEEN,
    TANH_CENTRE,
    MovingTables,
    stretch,
)
from hystgen.compensator.chain.moving_plays import Kind, operators
from hystgen.compensator.chain.step import ChainState
from hystgen.front.tanh.kernels import tanh
from hystgen.plays.loop import State, loop_solve
from hystgen.plays.slots import Reals


@jit
def yields(t: MovingTables, x: Any) -> Any:
    """The yield in a step of a play with a nonlinear dashpot at stretch x >= 0."""
    low = 0
    high = len(t.yields)
    while high - low > 1:
        middle = (low + high) // 2
        if x < t.yields[middle, 0]:
            high = middle
        else:
            low = middle
    on = x - t.yields[low, 0]
    return ((t.yields[low, 4] * on + t.yields[low, 3]) * on + t.yields[low, 2]) * on + t.yields[low, 1]


@jit(inline=True)
def seen(t: MovingTables, way: Any) -> Any:
    """The part of `way` at which the input counts as standing still."""
    return way * t.number[SEEN]


@jit(inline=True)
def unchanged(t: MovingTables, x: Any) -> Any:  # noqa: ARG001  as in fixed point
    """The move of a play for its yield, and the reverse."""
    return x


@jit(inline=True)
def share_of(factors: Reals, i: int, x: Any) -> Any:
    """x times the factor of play i."""
    return factors[i] * x


@jit
def bent(t: MovingTables, plays: Any, i: int, z: Any) -> Any:
    """Contribution of play i at z."""
    if t.bends == POLYNOMIAL:
        x = z * t.number[INVERSE_SCALE]
        total = z - z
        for k in range(t.curve.shape[1] - 1, -1, -1):
            total = (total + t.curve[i, k]) * x
        return z + t.number[SCALE] * (total * x)
    if t.bends == CENTRE:
        x = (z - t.number[MIDDLE]) * t.number[INVERSE_WIDTH]
        return z + t.number[BUMP] * (tanh(x, plays.tanh) + t.number[TANH_CENTRE])
    return z


@jit
def relaxing_follow(t: MovingTables, plays: Any, s: State, w: Any) -> Any:
    """Move viscous plays with one time constant with their input w. Returns their sum."""
    r, p = plays.threshold, plays.weight
    total = p[0] * w
    for i in range(1, len(r)):
        z = s.play[i] + t.first[1] * stretch(w - s.play[i], r[i])
        total = total + p[i] * z
        s.play[i] = z + t.second[1] * stretch(w - z, r[i])
    s.play[0] = w
    return total


@jit
def relaxing_input(t: MovingTables, plays: Any, s: State, h: Any) -> Any:
    """Input of viscous plays at which their sum is h: first without a stretched play, then with those stretched on the
    way to it."""
    r, p = plays.threshold, plays.weight
    rest = r[0]
    for i in range(1, len(r)):
        rest = rest + p[i] * s.play[i]
    rest = h - rest
    w = rest * t.inverse[0]
    rising = w > s.play[1]
    for i in range(1, len(r)):
        first = s.play[i] + r[i] if rising else s.play[i] - r[i]
        if w <= first if rising else w >= first:
            break
        rest = rest + t.share[i] * first
        w = rest * t.inverse[i]
        if w < first if rising else w > first:
            w = first
    return w


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


PLAYS = operators(
    Kind(
        same, same, loop_solve, relaxing_follow, relaxing_input, share_of, yields, seen, unchanged, unchanged, bent,
        search,
    )
)
