"""The inverse with a memoryless part: `inverse_front.c`, with one branch or two."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hystgen.basics.jit import Jit, jit
from hystgen.compensator.layout import Tables, clamp_drive
from hystgen.compensator.step import corners_of
from hystgen.front.compensator import front_forward, front_inverse
from hystgen.plays.corners.corners_float import (
    ASCENDING,
    BITS,
    COMMITTED,
    DRIVE,
    HERE,
    INPUT,
    LEVEL,
    OUTPUT,
    REFERENCE,
    REPEAT,
    RETURNED,
    STATUS,
    STEPPED,
    UNDO,
    UNDO_ASCENDING,
    UNDO_DRIVE,
    Memory,
    Start,
    copy_place,
    forget_line,
    move_to_output,
    plays_step,
    start,
)
from hystgen.plays.slots import (
    DOMAIN,
    HELD,
    HOLD,
    INPUT_CLAMPED,
    OFFSET,
    OUTPUT_CLAMPED,
    OUTPUT_MAX,
    OUTPUT_MIN,
    REAL_MAX,
    ZERO,
)


@jit
def inverse_keep(m: Memory) -> None:
    """Keep the place to which a commit goes back."""
    copy_place(m, UNDO, HERE)
    m.real[UNDO_DRIVE] = m.real[DRIVE]
    m.counts[UNDO_ASCENDING] = m.counts[ASCENDING]


@jit
def inverse_arrive(m: Memory, v: Any) -> None:
    """Move the actuator to drive v; the direction of the move picks the branch."""
    if v > m.real[DRIVE]:
        m.counts[ASCENDING] = 1
    elif v < m.real[DRIVE]:
        m.counts[ASCENDING] = 0
    m.real[DRIVE] = v


@jit
def inverse_replace(t: Tables, m: Memory, v: Any) -> None:
    """Undo the last step: the actuator went to v instead."""
    copy_place(m, HERE, UNDO)
    forget_line(t.inverse, m)
    m.real[DRIVE] = m.real[UNDO_DRIVE]
    m.counts[ASCENDING] = m.counts[UNDO_ASCENDING]
    inverse_arrive(m, v)
    w = front_forward(t, v, m.counts[ASCENDING])
    if w != m.real[OUTPUT]:
        move_to_output(t.inverse, m, w)


@jit
def inverse_hold(t: Tables, m: Memory) -> Any:
    """Repeat the last answer for a sample that is not finite."""
    inverse_keep(m)
    inverse_replace(t, m, m.real[RETURNED] if m.counts[STEPPED] and m.counts[COMMITTED] else m.real[DRIVE])
    m.counts[STEPPED] = 1
    m.counts[COMMITTED] = 0
    m.counts[STATUS] |= HELD
    return m.real[DRIVE]


@jit
def inverse_fits(t: Any, m: Any, v: Any, ascending: int) -> bool:
    """Whether the move to v lies on the branch for which v was computed."""
    inside = clamp_drive(t, v)
    if inside == m.real[DRIVE]:
        return bool(m.counts[ASCENDING] == ascending)
    return bool((inside > m.real[DRIVE]) == (ascending != 0))


def choosing(front_inverse: Callable[..., Any]) -> Jit[[Any, Any, Any, Any], tuple[Any, int]]:
    """`inverse_choose` with the inverse of an arithmetic's memoryless part."""

    @jit
    def inverse_choose(t: Any, m: Any, level: Any, w: Any) -> tuple[Any, int]:
        """The drive that gives w on the branch of its own move, and whether an envelope cannot give w."""
        up = 1
        if t.branches:
            up = m.counts[ASCENDING]
            if level > m.real[LEVEL]:
                up = 1
            elif level < m.real[LEVEL]:
                up = 0
        v, limited = front_inverse(t, w, up)
        if t.branches:
            fits = inverse_fits(t, m, v, up)
            back = clamp_drive(t, v) - m.real[DRIVE]
            if not fits and (up != m.counts[ASCENDING] or back < -t.limits[HOLD] or back > t.limits[HOLD]):
                v, limited = front_inverse(t, w, 1 - up)
                fits = inverse_fits(t, m, v, 1 - up)
            if not fits:
                v = m.real[DRIVE]
        return v, limited

    return inverse_choose


inverse_choose = choosing(front_inverse)


@jit
def inverse_step(t: Tables, m: Memory, u: Any) -> Any:
    """Answer one sample."""
    if not (-t.limits[REAL_MAX] <= u <= t.limits[REAL_MAX]):
        return inverse_hold(t, m)
    inverse_keep(m)
    if not (m.counts[REPEAT] and u == m.real[REFERENCE]):
        level = u
        if u < t.limits[OUTPUT_MIN]:
            level = t.limits[OUTPUT_MIN]
        elif u > t.limits[OUTPUT_MAX]:
            level = t.limits[OUTPUT_MAX]
        m.counts[BITS] = 0 if level == u else INPUT_CLAMPED
        m.real[REFERENCE] = u
        w = plays_step(t.inverse, m, level - t.limits[OFFSET])
        v, limited = inverse_choose(t, m, level, w)
        inside = clamp_drive(t, v)
        m.counts[BITS] |= DOMAIN if limited else 0
        if inside != v or inside == m.real[DRIVE]:
            m.counts[BITS] |= 0 if inside == v else OUTPUT_CLAMPED
            inverse_replace(t, m, inside)
        else:
            inverse_arrive(m, inside)
        m.real[LEVEL] = level
        m.counts[REPEAT] = 1
    m.counts[STEPPED] = 1
    m.counts[COMMITTED] = 0
    m.counts[STATUS] |= m.counts[BITS]
    return m.real[DRIVE]


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
        m.real[RETURNED] = m.real[DRIVE]
    m.counts[COMMITTED] = 1
    m.counts[REPEAT] = 0
    inverse_replace(t, m, v)


@jit
def inverse_begin(t: Tables, m: Memory, which: Start, first: int) -> None:
    """The part that init and reset share; `first` as in `Tables.applied`."""
    start(t.inverse, m, which)
    m.real[LEVEL] = m.real[INPUT] + t.limits[OFFSET]
    move_to_output(t.inverse, m, t.begin[first])
    m.real[DRIVE] = t.applied[first]
    m.counts[ASCENDING] = t.ascending[first]
    inverse_keep(m)
    m.real[RETURNED] = m.real[DRIVE]
    m.real[REFERENCE] = t.limits[ZERO]
    m.counts[STEPPED] = 0
    m.counts[COMMITTED] = 0
    m.counts[REPEAT] = 0
    m.counts[BITS] = 0
    m.counts[STATUS] = 0


@jit
def inverse_init(t: Tables, m: Memory) -> None:
    """Set the start memory of the parameter file."""
    inverse_begin(t, m, t.inverse_first, 2)


@jit
def inverse_reset(t: Tables, m: Memory) -> None:
    """Set all plays to 0 and clear the status; the caller makes the step of the reset."""
    inverse_begin(t, m, t.inverse_zero, 3)


@jit
def inverse_visit(t: Tables, m: Memory, v: Any) -> None:
    """Move the actuator to drive v, in range or not, before the next sample."""
    inverse_keep(m)
    inverse_replace(t, m, v)
    inverse_keep(m)
    m.real[LEVEL] = m.real[INPUT] + t.limits[OFFSET]


OPERATIONS = corners_of(inverse_init, inverse_reset, inverse_visit, inverse_step, inverse_commit)
