"""The forward operator: `forward.c`, with or without a memoryless part."""

from __future__ import annotations

from hystgen.basics.jit import Scalar, jit
from hystgen.compensator.layout import Tables
from hystgen.compensator.step import corners_of, turn_to
from hystgen.front.compensator import front_forward
from hystgen.plays.corners.corners_float import Memory, plays_step, start
from hystgen.plays.slots import HELD, INPUT_CLAMPED


@jit(inline=True)
def forward_step(t: Tables, m: Memory, v: Scalar) -> Scalar:
    """Answer one sample."""
    if not (t.limits.drive.low[0] <= v <= t.limits.drive.high[0]):
        if not (-t.limits.real_max[0] <= v <= t.limits.real_max[0]):
            m.step.status[0] |= HELD
            return m.here.output[0] + t.limits.offset[0]
        v = t.limits.drive.low[0] if v < t.limits.drive.low[0] else t.limits.drive.high[0]
        m.step.status[0] |= INPUT_CLAMPED
    turn_to(m, v)
    return plays_step(t.forward, m, front_forward(t, v, m.step.ascending[0])) + t.limits.offset[0]


@jit
def forward_begin(t: Tables, m: Memory, zero: int) -> None:
    """Set the start memory of the parameter file, or all plays to 0."""
    start(t.forward, m, t.forward_zero if zero else t.forward_first)
    m.step.drive[0] = t.applied[zero]
    m.step.ascending[0] = t.ascending[zero]
    m.step.status[0] = 0


@jit
def forward_visit(t: Tables, m: Memory, v: Scalar) -> None:
    """Move the actuator to drive v, in range or not, before the next sample."""
    turn_to(m, v)
    plays_step(t.forward, m, front_forward(t, v, m.step.ascending[0]))


OPERATIONS = corners_of(forward_begin, forward_visit, forward_step)
