"""The parts of the loop engine's step that are specific to floating point."""

from __future__ import annotations

from hystgen.basics.jit import Scalar, jit
from hystgen.compensator.layout import Tables
from hystgen.compensator.step import made_of
from hystgen.front.compensator import front_forward, front_inverse
from hystgen.plays.loop import State, loop_output, loop_solve


@jit(inline=True)
def output(t: Tables, s: State) -> tuple[Scalar, int]:
    """Output for the present memory, including the offset, and its status."""
    return loop_output(t, s) + t.limits.offset[0], 0


@jit(inline=True)
def inverse_solve(t: Tables, s: State, level: Scalar) -> Scalar:
    """Input of the plays that gives output `level`."""
    return loop_solve(t, s, level - t.limits.offset[0])


@jit(inline=True)
def finite(t: Tables, x: Scalar) -> bool:
    """Whether x is neither NaN nor infinite."""
    return bool(-t.limits.real_max[0] <= x <= t.limits.real_max[0])


OPERATIONS = made_of(front_forward, front_inverse, output, inverse_solve, finite)
"""Forward and inverse operator."""
