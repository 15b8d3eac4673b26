"""The forward operator in fixed point: `forward.c`, with or without a memoryless part."""

from __future__ import annotations

from hystgen.basics.jit import jit
from hystgen.compensator.layout import FixedTables, clamp_drive
from hystgen.compensator.step import corners_of, turn_to
from hystgen.front.curve import front_forward
from hystgen.plays.corners.corners_fixed import FixedMemory, plays_step, start
from hystgen.plays.fixed import code
from hystgen.plays.slots import INPUT_CLAMPED


@jit
def forward_arrive(t: FixedTables, m: FixedMemory, v: int) -> None:
    """Move the actuator to drive v, in range or not."""
    turn_to(m, v)
    plays_step(t, m, front_forward(t, v, m.step.ascending[0]))


@jit(inline=True)
def forward_step(t: FixedTables, m: FixedMemory, v: int) -> int:
    """Answer one sample."""
    inside = clamp_drive(t, v)
    if inside != v:
        m.step.status[0] |= INPUT_CLAMPED
    forward_arrive(t, m, inside)
    found, bits = code(t, m.here.output[0])
    m.step.status[0] |= bits
    return found


@jit
def forward_begin(t: FixedTables, m: FixedMemory, zero: int) -> None:
    """Set the start memory of the parameter file, or all plays to 0."""
    start(t, m, t.zero if zero else t.start)
    m.step.next[0] = m.here.input[0]
    m.step.drive[0] = t.applied[zero]
    m.step.ascending[0] = t.ascending[zero]
    m.step.status[0] = 0


OPERATIONS = corners_of(forward_begin, forward_arrive, forward_step)
