"""The forward operator without a memoryless part: `forward.c`."""

from __future__ import annotations

from typing import Any

from hystgen.basics.jit import jit
from hystgen.compensator.layout import Tables
from hystgen.compensator.step import corners_of
from hystgen.plays.corners.corners_float import Memory, Start, plays_step, start
from hystgen.plays.slots import DRIVE_MAX, DRIVE_MIN, HELD, INPUT_CLAMPED, OFFSET, REAL_MAX


@jit(inline=True)
def forward_step(t: Tables, m: Memory, v: Any) -> Any:
    """Answer one sample."""
    if not (t.limits[DRIVE_MIN] <= v <= t.limits[DRIVE_MAX]):
        if not (-t.limits[REAL_MAX] <= v <= t.limits[REAL_MAX]):
            m.step.status[0] |= HELD
            return m.here.output[0] + t.limits[OFFSET]
        v = t.limits[DRIVE_MIN] if v < t.limits[DRIVE_MIN] else t.limits[DRIVE_MAX]
        m.step.status[0] |= INPUT_CLAMPED
    return plays_step(t.forward, m, v) + t.limits[OFFSET]


@jit
def forward_begin(t: Tables, m: Memory, which: Start) -> None:
    """The part that init and reset share."""
    start(t.forward, m, which)
    m.step.status[0] = 0


@jit
def forward_init(t: Tables, m: Memory) -> None:
    """Set the start memory of the parameter file."""
    forward_begin(t, m, t.forward_first)


@jit
def forward_reset(t: Tables, m: Memory) -> None:
    """Set all plays to 0 and clear the status; the caller makes the step of the reset."""
    forward_begin(t, m, t.forward_zero)


@jit
def forward_visit(t: Tables, m: Memory, v: Any) -> None:
    """Move the actuator to drive v, in range or not, before the next sample."""
    plays_step(t.forward, m, v)


OPERATIONS = corners_of(forward_init, forward_reset, forward_visit, forward_step)
