"""The inverse with a memoryless part in fixed point: `inverse_front_fixed.c`, with one branch or two."""

from __future__ import annotations

from typing import Any

from hystgen.basics.jit import jit
from hystgen.compensator.corners.inverse_front import choosing
from hystgen.compensator.layout import FixedTables, clamp_drive, inverse_clamp
from hystgen.compensator.step import corners_of
from hystgen.front.curve import front_forward, front_inverse
from hystgen.plays.corners.corners_fixed import FAR, FixedMemory, move_to_input, move_to_solution, solve, start
from hystgen.plays.corners.corners_float import copy_place
from hystgen.plays.fixed import code
from hystgen.plays.slots import DOMAIN, FRACTION, INPUT_CLAMPED, OUTPUT_CLAMPED, Reals

inverse_choose = choosing(front_inverse)


@jit
def inverse_keep(m: FixedMemory) -> None:
    """Keep the place to which a commit goes back."""
    copy_place(m.undo, m.here)
    m.step.undo_drive[0] = m.step.drive[0]
    m.step.undo_ascending[0] = m.step.ascending[0]


@jit
def inverse_arrive(t: FixedTables, m: FixedMemory, v: Any) -> Any:
    """Move the actuator to drive v; the direction of the move picks the branch. Returns the input of the plays."""
    if v > m.step.drive[0]:
        m.step.ascending[0] = 1
    elif v < m.step.drive[0]:
        m.step.ascending[0] = 0
    m.step.drive[0] = v
    return front_forward(t, v, m.step.ascending[0])


@jit
def inverse_step(t: FixedTables, m: FixedMemory, u: Any) -> Any:
    """Answer one sample."""
    inverse_keep(m)
    if not (m.step.repeated[0] and u == m.step.reference[0]):
        level = inverse_clamp(t, u)
        w, kink = solve(t, m, level << t.limits[FRACTION], m.step.next[0])
        v, limited = inverse_choose(t, m, level, w)
        inside = clamp_drive(t, v)
        m.step.bits[0] = 0 if level == u else INPUT_CLAMPED
        m.step.bits[0] |= DOMAIN if limited else 0
        m.step.bits[0] |= 0 if inside == v else OUTPUT_CLAMPED
        m.step.next[0] = move_to_solution(t, m, kink, inverse_arrive(t, m, inside))
        m.step.reference[0] = u
        m.step.last[0] = level
        m.step.repeated[0] = 1
    m.step.status[0] |= m.step.bits[0]
    return m.step.drive[0]


@jit
def inverse_commit(t: FixedTables, m: FixedMemory, applied: Any) -> None:
    """Replace the last answer by the drive that was really applied."""
    v = clamp_drive(t, applied)
    if v != applied:
        m.step.status[0] |= INPUT_CLAMPED
    copy_place(m.here, m.undo)
    m.step.drive[0] = m.step.undo_drive[0]
    m.step.ascending[0] = m.step.undo_ascending[0]
    m.step.repeated[0] = 0
    m.step.next[0] = -FAR
    move_to_input(t, m, inverse_arrive(t, m, v))


@jit
def inverse_begin(t: FixedTables, m: FixedMemory, play: Reals, first: int) -> None:
    """The part that init and reset share; `first` as in `FixedTables.applied`."""
    start(t, m, play)
    m.step.drive[0] = t.applied[first]
    m.step.ascending[0] = t.ascending[first]
    inverse_keep(m)
    m.step.reference[0] = 0
    m.step.last[0] = code(t, m.here.output[0])[0]
    m.step.repeated[0] = 0
    m.step.next[0] = -FAR
    m.step.bits[0] = 0
    m.step.status[0] = 0


@jit
def inverse_init(t: FixedTables, m: FixedMemory) -> None:
    """Set the start memory of the parameter file."""
    inverse_begin(t, m, t.start, 2)


@jit
def inverse_reset(t: FixedTables, m: FixedMemory) -> None:
    """Set all plays to 0 and clear the status; the caller makes the step of the reset."""
    inverse_begin(t, m, t.zero, 3)


@jit
def inverse_visit(t: FixedTables, m: FixedMemory, v: Any) -> None:
    """Move the actuator to drive v, in range or not, before the next sample."""
    move_to_input(t, m, inverse_arrive(t, m, v))
    inverse_keep(m)
    m.step.last[0] = code(t, m.here.output[0])[0]


OPERATIONS = corners_of(inverse_init, inverse_reset, inverse_visit, inverse_step, inverse_commit)
