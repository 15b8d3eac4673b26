"""The forward operator with a memoryless part: `forward.c`."""

from __future__ import annotations

from typing import Any

from hystgen.basics.jit import jit
from hystgen.compensator.layout import Tables
from hystgen.compensator.step import corners_of
from hystgen.front.compensator import front_forward
from hystgen.plays.corners.corners_float import ASCENDING, DRIVE, OUTPUT, STATUS, Memory, Start, plays_step, start
from hystgen.plays.slots import DRIVE_MAX, DRIVE_MIN, HELD, INPUT_CLAMPED, OFFSET, REAL_MAX


@jit
def forward_arrive(m: Memory, v: Any) -> None:
    """Move the actuator to drive v; the direction of the move picks the branch."""
    if v > m.real[DRIVE]:
        m.counts[ASCENDING] = 1
    elif v < m.real[DRIVE]:
        m.counts[ASCENDING] = 0
    m.real[DRIVE] = v


@jit(inline=True)
def forward_step(t: Tables, m: Memory, v: Any) -> Any:
    """Answer one sample."""
    if not (t.limits[DRIVE_MIN] <= v <= t.limits[DRIVE_MAX]):
        if not (-t.limits[REAL_MAX] <= v <= t.limits[REAL_MAX]):
            m.counts[STATUS] |= HELD
            return m.real[OUTPUT] + t.limits[OFFSET]
        v = t.limits[DRIVE_MIN] if v < t.limits[DRIVE_MIN] else t.limits[DRIVE_MAX]
        m.counts[STATUS] |= INPUT_CLAMPED
    forward_arrive(m, v)
    return plays_step(t.forward, m, front_forward(t, v, m.counts[ASCENDING])) + t.limits[OFFSET]


@jit
def forward_begin(t: Tables, m: Memory, which: Start, first: int) -> None:
    """The part that init and reset share; `first` as in `Tables.applied`."""
    start(t.forward, m, which)
    m.real[DRIVE] = t.applied[first]
    m.counts[ASCENDING] = t.ascending[first]
    m.counts[STATUS] = 0


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
    plays_step(t.forward, m, front_forward(t, v, m.counts[ASCENDING]))


OPERATIONS = corners_of(forward_init, forward_reset, forward_visit, forward_step)
