"""The forward operator with a memoryless part: `forward.c`."""

from __future__ import annotations

from typing import Any

from hystgen.basics.jit import jit
from hystgen.compensator.layout import Tables
from hystgen.compensator.step import corners_of
from hystgen.front.compensator import front_forward
from hystgen.plays.corners.corners_float import Memory, Start, plays_step, start
from hystgen.plays.slots import DRIVE_MAX, DRIVE_MIN, HELD, INPUT_CLAMPED, OFFSET, REAL_MAX


@jit
def forward_arrive(m: Memory, v: Any) -> None:
    """Move the actuator to drive v; the direction of the move picks the branch."""
    if v > m.step.drive[0]:
        m.step.ascending[0] = 1
    elif v < m.step.drive[0]:
        m.step.ascending[0] = 0
    m.step.drive[0] = v


@jit(inline=True)
def forward_step(t: Tables, m: Memory, v: Any) -> Any:
    """Answer one sample."""
    if not (t.limits[DRIVE_MIN] <= v <= t.limits[DRIVE_MAX]):
        if not (-t.limits[REAL_MAX] <= v <= t.limits[REAL_MAX]):
            m.step.status[0] |= HELD
            return m.here.output[0] + t.limits[OFFSET]
        v = t.limits[DRIVE_MIN] if v < t.limits[DRIVE_MIN] else t.limits[DRIVE_MAX]
        m.step.status[0] |= INPUT_CLAMPED
    forward_arrive(m, v)
    return plays_step(t.forward, m, front_forward(t, v, m.step.ascending[0])) + t.limits[OFFSET]


@jit
def forward_begin(t: Tables, m: Memory, which: Start, first: int) -> None:
    """The part that init and reset share; `first` as in `Tables.applied`."""
    start(t.forward, m, which)
    m.step.drive[0] = t.applied[first]
    m.step.ascending[0] = t.ascending[first]
    m.step.status[0] = 0


@jit
def forward_init(t: Tables, m: Memory) -> None:
    """Set the start memory of the parameter file."""
    forward_begin(t, m, t.forward_first, 0)


@jit
def forward_reset(t: Tables, m: Memory) -> None:
    """Set all plays to 0 and clear the status; the caller makes the step of the reset."""
    forward_begin(t, m, t.forward_zero, 1)


@jit
def forward_visit(t: Tables, m: Memory, v: Any) -> None:
    """Move the actuator to drive v, in range or not, before the next sample."""
    forward_arrive(m, v)
    plays_step(t.forward, m, front_forward(t, v, m.step.ascending[0]))


OPERATIONS = corners_of(forward_init, forward_reset, forward_visit, forward_step)
