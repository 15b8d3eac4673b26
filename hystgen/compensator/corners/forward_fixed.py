"""The forward operator in fixed point: `forward.c`, with or without a memoryless part."""

from __future__ import annotations

from typing import Any

from hystgen.basics.jit import jit
from hystgen.compensator.layout import FixedTables, clamp_drive
from hystgen.compensator.step import corners_of
from hystgen.front.curve import front_forward
from hystgen.plays.corners.corners_fixed import FixedMemory, plays_step, start
from hystgen.plays.fixed import code
from hystgen.plays.slots import INPUT_CLAMPED, Reals


@jit
def forward_arrive(t: FixedTables, m: FixedMemory, v: Any) -> None:
    """Move the actuator to drive v; the direction of the move picks the branch."""
    if v > m.step.drive[0]:
        m.step.ascending[0] = 1
    elif v < m.step.drive[0]:
        m.step.ascending[0] = 0
    m.step.drive[0] = v
    plays_step(t, m, front_forward(t, v, m.step.ascending[0]))


@jit(inline=True)
def forward_step(t: FixedTables, m: FixedMemory, v: Any) -> Any:
    """Answer one sample."""
    inside = clamp_drive(t, v)
    if inside != v:
        m.step.status[0] |= INPUT_CLAMPED
    forward_arrive(t, m, inside)
    found, bits = code(t, m.here.output[0])
    m.step.status[0] |= bits
    return found


@jit
def forward_begin(t: FixedTables, m: FixedMemory, play: Reals, first: int) -> None:
    """The part that init and reset share; `first` as in `FixedTables.applied`."""
    start(t, m, play)
    m.step.next[0] = m.here.input[0]
    m.step.drive[0] = t.applied[first]
    m.step.ascending[0] = t.ascending[first]
    m.step.status[0] = 0


@jit
def forward_init(t: FixedTables, m: FixedMemory) -> None:
    """Set the start memory of the parameter file."""
    forward_begin(t, m, t.start, 0)


@jit
def forward_reset(t: FixedTables, m: FixedMemory) -> None:
    """Set all plays to 0 and clear the status; the caller makes the step of the reset."""
    forward_begin(t, m, t.zero, 1)


@jit
def forward_visit(t: FixedTables, m: FixedMemory, v: Any) -> None:
    """Move the actuator to drive v, in range or not, before the next sample."""
    forward_arrive(t, m, v)


OPERATIONS = corners_of(forward_init, forward_reset, forward_visit, forward_step)
