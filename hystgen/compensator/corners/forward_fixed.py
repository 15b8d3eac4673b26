"""The forward operator in fixed point: `forward.c`, with or without a memoryless part."""

from __future__ import annotations

from typing import Any

from hystgen.basics.jit import jit
from hystgen.compensator.layout import FixedTables, clamp_drive
from hystgen.compensator.step import corners_of
from hystgen.front.curve import front_forward
from hystgen.plays.corners.corners_fixed import FixedMemory, plays_step, start
from hystgen.plays.corners.corners_float import ASCENDING, DRIVE, INPUT, NEXT, OUTPUT, STATUS
from hystgen.plays.fixed import code
from hystgen.plays.slots import INPUT_CLAMPED, Reals


@jit
def forward_arrive(t: FixedTables, m: FixedMemory, v: Any) -> None:
    """Move the actuator to drive v; the direction of the move picks the branch."""
    if v > m.real[DRIVE]:
        m.counts[ASCENDING] = 1
    elif v < m.real[DRIVE]:
        m.counts[ASCENDING] = 0
    m.real[DRIVE] = v
    plays_step(t, m, front_forward(t, v, m.counts[ASCENDING]))


@jit(inline=True)
def forward_step(t: FixedTables, m: FixedMemory, v: Any) -> Any:
    """Answer one sample."""
    inside = clamp_drive(t, v)
    if inside != v:
        m.counts[STATUS] |= INPUT_CLAMPED
    forward_arrive(t, m, inside)
    found, bits = code(t, m.real[OUTPUT])
    m.counts[STATUS] |= bits
    return found


@jit
def forward_begin(t: FixedTables, m: FixedMemory, play: Reals, first: int) -> None:
    """The part that init and reset share; `first` as in `FixedTables.applied`."""
    start(t, m, play)
    m.real[NEXT] = m.real[INPUT]
    m.real[DRIVE] = t.applied[first]
    m.counts[ASCENDING] = t.ascending[first]
    m.counts[STATUS] = 0


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
