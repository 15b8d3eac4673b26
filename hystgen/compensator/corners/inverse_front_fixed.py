"""The inverse with a memoryless part in fixed point: `inverse_front_fixed.c`, with one branch or two."""

from __future__ import annotations

from hystgen.basics.jit import jit
from hystgen.compensator.corners.inverse_front import inverse_keep
from hystgen.compensator.layout import FixedTables, clamp_drive, inverse_clamp
from hystgen.compensator.step import choosing, corners_of, turn_to
from hystgen.front.curve import front_forward, front_inverse
from hystgen.plays.corners.corners_fixed import FAR, FixedMemory, move_to_input, move_to_solution, solve, start
from hystgen.plays.corners.corners_float import copy_place
from hystgen.plays.fixed import code
from hystgen.plays.slots import DOMAIN, INPUT_CLAMPED, OUTPUT_CLAMPED

inverse_choose = choosing(front_inverse)


@jit
def inverse_arrive(t: FixedTables, m: FixedMemory, v: int) -> int:
    """Move the actuator to drive v. Returns the input of the plays."""
    turn_to(m, v)
    return front_forward(t, v, m.step.ascending[0])


@jit
def inverse_step(t: FixedTables, m: FixedMemory, u: int) -> int:
    """Answer one sample."""
    inverse_keep(m)
    if not (m.step.repeated[0] and u == m.step.reference[0]):
        level = inverse_clamp(t, u)
        w, kink = solve(t, m, level << t.limits.fraction[0], m.step.next[0])
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
def inverse_commit(t: FixedTables, m: FixedMemory, applied: int) -> None:
    """Replace the last answer by the drive that was actually applied."""
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
def inverse_begin(t: FixedTables, m: FixedMemory, zero: int) -> None:
    """Set the start memory of the parameter file, or all plays to 0."""
    start(t, m, t.zero if zero else t.start)
    m.step.drive[0] = t.applied[2 + zero]
    m.step.ascending[0] = t.ascending[2 + zero]
    inverse_keep(m)
    m.step.reference[0] = 0
    m.step.last[0] = code(t, m.here.output[0])[0]
    m.step.repeated[0] = 0
    m.step.next[0] = -FAR
    m.step.bits[0] = 0
    m.step.status[0] = 0


@jit
def inverse_visit(t: FixedTables, m: FixedMemory, v: int) -> None:
    """Move the actuator to drive v, in range or not, before the next sample."""
    move_to_input(t, m, inverse_arrive(t, m, v))
    inverse_keep(m)
    m.step.last[0] = code(t, m.here.output[0])[0]


OPERATIONS = corners_of(inverse_begin, inverse_visit, inverse_step, inverse_commit)
