"""What a step of engine loop does otherwise in fixed point: limiting the output code, solving for one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hystgen.compensator import step
from hystgen.compensator.layout import FixedTables
from hystgen.front import compensator
from hystgen.front.curve import curve, front_forward, front_inverse
from hystgen.plays.fixed import going, loop_solve, nearest, over_slope
from hystgen.plays.loop import STATUS, State, loop_output
from hystgen.plays.slots import CODE_MAX, FRACTION, OFFSET, OUTPUT_CLAMPED, SATURATED


def output(t: FixedTables, s: State) -> Any:
    """Output code for the memory as it is, limited to the type."""
    code = nearest(loop_output(t, s) + t.limits[OFFSET], t.limits[FRACTION])
    if code > t.limits[SATURATED] or code < -t.limits[SATURATED]:
        s.counts[STATUS] |= OUTPUT_CLAMPED
    if code > t.limits[CODE_MAX]:
        return t.limits[CODE_MAX]
    if code < -t.limits[CODE_MAX]:
        return -t.limits[CODE_MAX]
    return code


def solve(t: FixedTables, s: State, u: Any) -> Any:
    """Input of the plays that gives output code u."""
    return loop_solve(t, s, (u << t.limits[FRACTION]) - t.limits[OFFSET])


def finite(t: FixedTables, x: Any) -> bool:  # noqa: ARG001  every code is
    """Whole numbers are."""
    return True


SHARED: list[Callable[..., Any]] = [nearest, over_slope, curve, front_forward, front_inverse]
"""What both engines have."""

_OWN: list[Callable[..., Any]] = [*SHARED, going, loop_solve, output, solve, finite]
_REPLACED = {function.__name__ for function in (*_OWN, *compensator.FRONT)}
_COMMON = [function for function in step.COMPILED if function.__name__ not in _REPLACED]
_PLAYS = {"loop_rest", "loop_start", "loop_absorb", "loop_output"}

# Callees before callers: the memory, then what is written here, then what a step means
COMPILED: list[Callable[..., Any]] = [
    *(function for function in _COMMON if function.__name__ in _PLAYS),
    *_OWN,
    *(function for function in _COMMON if function.__name__ not in _PLAYS),
]
INLINED: set[Callable[..., Any]] = {function for function in COMPILED if function in step.INLINED}
