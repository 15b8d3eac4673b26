"""The inverse without a memoryless part: `inverse.c`."""

from __future__ import annotations

from hystgen.basics.jit import Scalar, jit
from hystgen.compensator.layout import Tables, clamp_drive
from hystgen.compensator.step import corners_of
from hystgen.plays.corners.corners_float import (
    Memory,
    copy_place,
    move_in_block,
    move_to_input,
    move_to_output,
    start,
    take_back,
)
from hystgen.plays.slots import (
    HELD,
    INPUT_CLAMPED,
    OUTPUT_CLAMPED,
)


@jit
def inverse_search(t: Tables, m: Memory, u: Scalar) -> Scalar:
    """Answer any sample that is not usual."""
    x = u - t.limits.offset[0]
    bits = 0
    copy_place(m.undo, m.here)
    if not (t.limits.output.low[0] <= u <= t.limits.output.high[0]):
        bits = INPUT_CLAMPED if -t.limits.real_max[0] <= u <= t.limits.real_max[0] else HELD
        x = (t.limits.output.low[0] if u < t.limits.output.low[0] else t.limits.output.high[0]) - t.limits.offset[0]
    if bits == HELD:
        if m.step.stepped[0] and m.step.committed[0]:
            move_to_output(t.inverse, m, m.step.returned[0])
    elif (m.plays.limited[0] and (x >= m.here.input[0] if m.here.rising[0] else x <= m.here.input[0])) or (
        x != m.here.input[0] and move_to_input(t.inverse, m, x)
    ):
        m.plays.limited[0] = 1
        bits |= OUTPUT_CLAMPED
    m.step.before[0] = m.here.input[0]
    m.step.stepped[0] = 1
    m.step.committed[0] = 0
    m.step.status[0] |= bits
    return m.here.output[0]


@jit(inline=True)
def inverse_step(t: Tables, m: Memory, u: Scalar) -> Scalar:
    """Answer one sample."""
    rising = m.here.rising[0]
    x = u - t.limits.offset[0]
    at = m.here.input[0]
    on = x > at if rising else x < at
    most = m.plays.next[0] if on else at
    least = at if on or m.here.k[0] > 0 else m.plays.behind[0]
    if least < x < most if rising else most < x < least:
        m.step.before[0] = m.here.input[0]
        m.here.input[0] = x
        m.here.output[0] = m.plays.start[0] + (x - m.plays.begin[0]) * m.plays.gain[0]
        return m.here.output[0]
    if on and (x < m.plays.cap[0] if rising else x > m.plays.cap[0]):
        copy_place(m.undo, m.here)
        m.step.before[0] = x
        if move_in_block(t.inverse, m, x):
            return m.here.output[0]
    return inverse_search(t, m, u)


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
        m.step.returned[0] = m.here.output[0]
    m.step.committed[0] = 1
    if m.step.before[0] != m.here.input[0]:
        copy_place(m.undo, m.here)
        m.undo.input[0] = m.step.before[0]
        m.undo.output[0] = m.plays.start[0] + (m.step.before[0] - m.plays.begin[0]) * m.plays.gain[0]
    take_back(t.inverse, m)
    move_to_output(t.inverse, m, v)
    m.step.before[0] = m.here.input[0]


@jit
def inverse_begin(t: Tables, m: Memory, zero: int) -> None:
    """Set the start memory of the parameter file, or all plays to 0."""
    start(t.inverse, m, t.inverse_zero if zero else t.inverse_first)
    move_to_output(t.inverse, m, clamp_drive(t, m.here.output[0]))
    copy_place(m.undo, m.here)
    m.step.before[0] = m.here.input[0]
    m.step.stepped[0] = 0
    m.step.committed[0] = 0
    m.step.status[0] = 0


@jit
def inverse_visit(t: Tables, m: Memory, v: Scalar) -> None:
    """Move the actuator to drive v, in range or not, before the next sample."""
    move_to_output(t.inverse, m, v)
    copy_place(m.undo, m.here)
    m.step.before[0] = m.here.input[0]


OPERATIONS = corners_of(inverse_begin, inverse_visit, inverse_step, inverse_commit)
