"""The plays of the loop engine, which moves each play in each sample: floating point, and parts shared by fixed point.

Functions that also exist in C have the same names here as in `c_runtime/`, and the same operations in the same order
and arithmetic, so that results can be compared bit for bit. They do not depend on numpy's or numba's types: they run as
plain Python on the scalars of their arrays, or compiled (see `hystgen.basics.jit`). Real constants come from arrays
because a literal would not have the arithmetic's type.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from hystgen.basics.jit import Element, Scalar, jit
from hystgen.plays.slots import LimitTable, Reals, StepState


class PlayTables(Protocol):
    """The model constants that memory and plays need in any arithmetic."""

    @property
    def threshold(self) -> Reals: ...
    @property
    def weight(self) -> Reals: ...
    @property
    def limits(self) -> LimitTable: ...


class LoopTables(PlayTables, Protocol):
    """The additional model constants that solving needs in floating point."""

    @property
    def lift(self) -> Reals: ...
    @property
    def inverse_slope(self) -> Reals: ...


class State(NamedTuple):
    """The memory of one instance."""

    step: StepState
    play: Reals


def new_state(t: PlayTables) -> State:
    """Memory for one instance of the model; `init` sets its values."""
    dtype = t.threshold.dtype
    return State(StepState.zeros(1, dtype), np.zeros(len(t.threshold), dtype))


# ---------------------------------------------------------------- loop_absorb.c, loop_solve.c


@jit
def loop_rest(s: State, w: Scalar) -> None:
    """Set every play to w."""
    for i in range(len(s.play)):
        s.play[i] = w


@jit
def loop_start(s: State, start: Reals) -> None:
    """Set each play to its own start value."""
    for i in range(len(s.play)):
        s.play[i] = start[i]


@jit
def project(t: PlayTables, s: State, w: Scalar) -> None:
    """Set play 0 to w and move each other play as little as the one before it allows."""
    r = t.threshold
    s.play[0] = w
    for i in range(1, len(r)):
        room = r[i] - r[i - 1]
        low = s.play[i - 1] - room
        high = s.play[i - 1] + room
        upper = high if s.play[i] > high else s.play[i]
        s.play[i] = low if upper < low else upper


@jit
def loop_absorb(t: PlayTables, s: State, w: Scalar) -> None:
    """play_r[w] = max(w - r, min(w + r, play)), play by play."""
    for i in range(len(s.play)):
        low = w - t.threshold[i]
        high = w + t.threshold[i]
        upper: Scalar = s.play[i]
        if upper > high:
            upper = high
        if upper < low:
            upper = low
        s.play[i] = upper


@jit
def loop_output(t: PlayTables, s: State) -> Element:
    """p_0 play_0 + p_1 play_1 + ..., in this order."""
    total = t.limits.zero[0]
    for i in range(len(s.play)):
        total = total + t.weight[i] * s.play[i]
    return total


@jit
def loop_solve(t: LoopTables, s: State, output: Scalar) -> Scalar:
    """Input of the plays that gives `output`: assumes that every play follows, then drops the plays with the largest
    thresholds one by one until the solution makes the last remaining play follow."""
    rising = output >= loop_output(t, s)
    tail = t.limits.zero[0]
    next_follows = t.limits.zero[0]
    for last in range(len(s.play) - 1, -1, -1):
        k = last + 1
        if rising:
            first = s.play[last] + t.threshold[last]
            w = (output - (tail - t.lift[k])) * t.inverse_slope[k]
        else:
            first = s.play[last] - t.threshold[last]
            w = (output - (tail + t.lift[k])) * t.inverse_slope[k]
        if w >= first if rising else w <= first:
            if k < len(s.play) and (w > next_follows if rising else w < next_follows):
                return next_follows
            return w
        tail = tail + t.weight[last] * s.play[last]
        next_follows = first
    return s.play[0]
