"""The parts of the loop engine's step that are specific to fixed point."""

from __future__ import annotations

from hystgen.basics.jit import jit
from hystgen.compensator.layout import FixedTables
from hystgen.compensator.step import made_of
from hystgen.front.curve import front_forward, front_inverse
from hystgen.plays.fixed import code, loop_solve
from hystgen.plays.loop import State, loop_output


@jit
def output(t: FixedTables, s: State) -> tuple[int, int]:
    """Output code for the present memory, limited to the type, and its status."""
    return code(t, loop_output(t, s) + t.limits.offset[0])


@jit
def inverse_solve(t: FixedTables, s: State, level: int) -> int:
    """Input of the plays that gives output code `level`."""
    return loop_solve(t, s, (level << t.limits.fraction[0]) - t.limits.offset[0])


@jit
def finite(t: FixedTables, x: int) -> bool:  # noqa: ARG001  as in floating point
    """True: every code is finite."""
    return True


OPERATIONS = made_of(front_forward, front_inverse, output, inverse_solve, finite)
"""Forward and inverse operator."""
