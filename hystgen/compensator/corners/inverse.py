"""The inverse without a memoryless part: `inverse.c`."""

from __future__ import annotations

from typing import Any

from hystgen.basics.jit import jit
from hystgen.compensator.layout import Tables, clamp_drive
from hystgen.compensator.step import corners_of
from hystgen.plays.corners.corners_float import (
    BEFORE,
    BEGIN,
    BEHIND,
    CAP,
    COMMITTED,
    GAIN,
    HERE,
    INPUT,
    LIMITED,
    NEXT,
    OUTPUT,
    RETURNED,
    RISING,
    START,
    STATUS,
    STEPPED,
    UNDO,
    UNDO_INPUT,
    UNDO_OUTPUT,
    K,
    Memory,
    Start,
    copy_place,
    forget_line,
    move_in_block,
    move_to_input,
    move_to_output,
    start,
    stop_in_block,
)
from hystgen.plays.slots import (
    DRIVE_MAX,
    DRIVE_MIN,
    HELD,
    INPUT_CLAMPED,
    OFFSET,
    OUTPUT_CLAMPED,
    OUTPUT_MAX,
    OUTPUT_MIN,
    REAL_MAX,
    ZERO,
)


@jit
def inverse_search(t: Tables, m: Memory, u: Any) -> Any:
    """Answer any sample except a usual one."""
    x = u - t.limits[OFFSET]
    bits = 0
    copy_place(m, UNDO, HERE)
    if not (t.limits[OUTPUT_MIN] <= u <= t.limits[OUTPUT_MAX]):
        bits = INPUT_CLAMPED if -t.limits[REAL_MAX] <= u <= t.limits[REAL_MAX] else HELD
        x = (t.limits[OUTPUT_MIN] if u < t.limits[OUTPUT_MIN] else t.limits[OUTPUT_MAX]) - t.limits[OFFSET]
    if bits == HELD:
        if m.counts[STEPPED] and m.counts[COMMITTED]:
            move_to_output(t.inverse, m, m.real[RETURNED])
    elif m.counts[LIMITED] and (x >= m.real[INPUT] if m.counts[RISING] else x <= m.real[INPUT]):
        bits |= OUTPUT_CLAMPED
    elif x != m.real[INPUT] and not move_to_input(t.inverse, m, x):
        stop_in_block(t.inverse, m, t.limits[DRIVE_MAX] if m.counts[RISING] else t.limits[DRIVE_MIN], x)
        m.counts[LIMITED] = 1
        bits |= OUTPUT_CLAMPED
    m.real[BEFORE] = m.real[INPUT]
    m.counts[STEPPED] = 1
    m.counts[COMMITTED] = 0
    m.counts[STATUS] |= bits
    return m.real[OUTPUT]


@jit(inline=True)
def inverse_step(t: Tables, m: Memory, u: Any) -> Any:
    """Answer one sample."""
    rising = m.counts[RISING]
    x = u - t.limits[OFFSET]
    at = m.real[INPUT]
    on = x > at if rising else x < at
    most = m.real[NEXT] if on else at
    least = at if on or m.counts[K] > 0 else m.real[BEHIND]
    if least < x < most if rising else most < x < least:
        m.real[BEFORE] = m.real[INPUT]
        m.real[INPUT] = x
        m.real[OUTPUT] = m.real[START] + (x - m.real[BEGIN]) * m.real[GAIN]
        return m.real[OUTPUT]
    if on and (x < m.real[CAP] if rising else x > m.real[CAP]):
        copy_place(m, UNDO, HERE)
        m.real[BEFORE] = x
        if move_in_block(t.inverse, m, x):
            return m.real[OUTPUT]
    return inverse_search(t, m, u)


@jit
def inverse_commit(t: Tables, m: Memory, applied: Any) -> None:
    """Replace the last answer by the drive that was really applied."""
    v = clamp_drive(t, applied) + t.limits[ZERO]  # no drive is -0
    if not (-t.limits[REAL_MAX] <= applied <= t.limits[REAL_MAX]):
        m.counts[STATUS] |= HELD
        return
    if v != applied:
        m.counts[STATUS] |= INPUT_CLAMPED
    if m.counts[STEPPED] and not m.counts[COMMITTED]:
        m.real[RETURNED] = m.real[OUTPUT]
    m.counts[COMMITTED] = 1
    if m.real[BEFORE] != m.real[INPUT]:
        copy_place(m, UNDO, HERE)
        m.real[UNDO_INPUT] = m.real[BEFORE]
        m.real[UNDO_OUTPUT] = m.real[START] + (m.real[BEFORE] - m.real[BEGIN]) * m.real[GAIN]
    copy_place(m, HERE, UNDO)
    forget_line(t.inverse, m)
    move_to_output(t.inverse, m, v)
    m.real[BEFORE] = m.real[INPUT]


@jit
def inverse_begin(t: Tables, m: Memory, which: Start) -> None:
    """The part that init and reset share."""
    start(t.inverse, m, which)
    move_to_output(t.inverse, m, clamp_drive(t, m.real[OUTPUT]))
    copy_place(m, UNDO, HERE)
    m.real[BEFORE] = m.real[INPUT]
    m.counts[STEPPED] = 0
    m.counts[COMMITTED] = 0
    m.counts[STATUS] = 0


@jit
def inverse_init(t: Tables, m: Memory) -> None:
    """Set the start memory of the parameter file."""
    inverse_begin(t, m, t.inverse_first)


@jit
def inverse_reset(t: Tables, m: Memory) -> None:
    """Set all plays to 0 and clear the status; the caller makes the step of the reset."""
    inverse_begin(t, m, t.inverse_zero)


@jit
def inverse_visit(t: Tables, m: Memory, v: Any) -> None:
    """Move the actuator to drive v, in range or not, before the next sample."""
    move_to_output(t.inverse, m, v)
    copy_place(m, UNDO, HERE)
    m.real[BEFORE] = m.real[INPUT]


OPERATIONS = corners_of(inverse_init, inverse_reset, inverse_visit, inverse_step, inverse_commit)
