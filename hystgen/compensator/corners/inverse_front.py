"""The inverse with a memoryless part: `inverse_front.c`, with one branch or two."""

from __future__ import annotations

from hystgen.basics.jit import Scalar, jit
from hystgen.compensator.layout import Tables, clamp_drive
from hystgen.compensator.step import choosing, corners_of, turn_to
from hystgen.front.compensator import front_forward, front_inverse
from hystgen.plays.corners.corners_fixed import FixedMemory
from hystgen.plays.corners.corners_float import (
    Memory,
    copy_place,
    move_to_output,
    plays_step,
    start,
    take_back,
)
from hystgen.plays.slots import DOMAIN, HELD, INPUT_CLAMPED, OUTPUT_CLAMPED


@jit
def inverse_keep(m: Memory | FixedMemory) -> None:
    """Keep the position to which a commit returns."""
    copy_place(m.undo, m.here)
    m.step.undo_drive[0] = m.step.drive[0]
    m.step.undo_ascending[0] = m.step.ascending[0]


@jit
def inverse_replace(t: Tables, m: Memory, v: Scalar) -> None:
    """Undo the last step, since the actuator went to v instead."""
    take_back(t.inverse, m)
    m.step.drive[0] = m.step.undo_drive[0]
    m.step.ascending[0] = m.step.undo_ascending[0]
    turn_to(m, v)
    w = front_forward(t, v, m.step.ascending[0])
    if w != m.here.output[0]:
        move_to_output(t.inverse, m, w)


@jit
def inverse_hold(t: Tables, m: Memory) -> Scalar:
    """Repeat the last answer for a sample that is not finite."""
    inverse_keep(m)
    inverse_replace(t, m, m.step.returned[0] if m.step.stepped[0] and m.step.committed[0] else m.step.drive[0])
    m.step.stepped[0] = 1
    m.step.committed[0] = 0
    m.step.status[0] |= HELD
    return m.step.drive[0]


inverse_choose = choosing(front_inverse)


@jit
def inverse_step(t: Tables, m: Memory, u: Scalar) -> Scalar:
    """Answer one sample."""
    if not (-t.limits.real_max[0] <= u <= t.limits.real_max[0]):
        return inverse_hold(t, m)
    inverse_keep(m)
    if not (m.step.repeated[0] and u == m.step.reference[0]):
        level = u
        if u < t.limits.output.low[0]:
            level = t.limits.output.low[0]
        elif u > t.limits.output.high[0]:
            level = t.limits.output.high[0]
        m.step.bits[0] = 0 if level == u else INPUT_CLAMPED
        m.step.reference[0] = u
        w = plays_step(t.inverse, m, level - t.limits.offset[0])
        v, limited = inverse_choose(t, m, level, w)
        inside = clamp_drive(t, v)
        m.step.bits[0] |= DOMAIN if limited else 0
        if inside != v or inside == m.step.drive[0]:
            m.step.bits[0] |= 0 if inside == v else OUTPUT_CLAMPED
            inverse_replace(t, m, inside)
        else:
            turn_to(m, inside)
        m.step.last[0] = level
        m.step.repeated[0] = 1
    m.step.stepped[0] = 1
    m.step.committed[0] = 0
    m.step.status[0] |= m.step.bits[0]
    return m.step.drive[0]


@jit
def inverse_commit(t: Tables, m: Memory, applied: Scalar) -> None:
    """Replace the last answer by the drive that was actually applied."""
    v = clamp_drive(t, applied) + t.limits.zero[0]  # no drive is -0
    if not (-t.limits.real_max[0] <= applied <= t.limits.real_max[0]):
        m.step.status[0] |= HELD
        return
    if v != applied:
        m.step.status[0] |= INPUT_CLAMPED
    if m.step.stepped[0] and not m.step.committed[0]:
        m.step.returned[0] = m.step.drive[0]
    m.step.committed[0] = 1
    m.step.repeated[0] = 0
    inverse_replace(t, m, v)


@jit
def inverse_begin(t: Tables, m: Memory, zero: int) -> None:
    """Set the start memory of the parameter file, or all plays to 0."""
    start(t.inverse, m, t.inverse_zero if zero else t.inverse_first)
    m.step.last[0] = m.here.input[0] + t.limits.offset[0]
    move_to_output(t.inverse, m, t.begin[2 + zero])
    m.step.drive[0] = t.applied[2 + zero]
    m.step.ascending[0] = t.ascending[2 + zero]
    inverse_keep(m)
    m.step.returned[0] = m.step.drive[0]
    m.step.reference[0] = t.limits.zero[0]
    m.step.stepped[0] = 0
    m.step.committed[0] = 0
    m.step.repeated[0] = 0
    m.step.bits[0] = 0
    m.step.status[0] = 0


@jit
def inverse_visit(t: Tables, m: Memory, v: Scalar) -> None:
    """Move the actuator to drive v, in range or not, before the next sample."""
    inverse_keep(m)
    inverse_replace(t, m, v)
    inverse_keep(m)
    m.step.last[0] = m.here.input[0] + t.limits.offset[0]


OPERATIONS = corners_of(inverse_begin, inverse_visit, inverse_step, inverse_commit)
