"""The inverse with a memoryless part: `inverse_front.c`, with one branch or two."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hystgen.basics.jit import Jit, jit
from hystgen.compensator.layout import Tables, clamp_drive
from hystgen.compensator.step import corners_of
from hystgen.front.compensator import front_forward, front_inverse
from hystgen.plays.corners.corners_float import (
    Memory,
    Start,
    copy_place,
    move_to_output,
    plays_step,
    start,
    take_back,
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
    copy_place(m.undo, m.here)
    m.step.undo_drive[0] = m.step.drive[0]
    m.step.undo_ascending[0] = m.step.ascending[0]


@jit
def inverse_arrive(m: Memory, v: Any) -> None:
    """Move the actuator to drive v; the direction of the move picks the branch."""
    if v > m.step.drive[0]:
        m.step.ascending[0] = 1
    elif v < m.step.drive[0]:
        m.step.ascending[0] = 0
    m.step.drive[0] = v


@jit
def inverse_replace(t: Tables, m: Memory, v: Any) -> None:
    """Undo the last step: the actuator went to v instead."""
    take_back(t.inverse, m)
    m.step.drive[0] = m.step.undo_drive[0]
    m.step.ascending[0] = m.step.undo_ascending[0]
    inverse_arrive(m, v)
    w = front_forward(t, v, m.step.ascending[0])
    if w != m.here.output[0]:
        move_to_output(t.inverse, m, w)


@jit
def inverse_hold(t: Tables, m: Memory) -> Any:
    """Repeat the last answer for a sample that is not finite."""
    inverse_keep(m)
    inverse_replace(t, m, m.step.returned[0] if m.step.stepped[0] and m.step.committed[0] else m.step.drive[0])
    m.step.stepped[0] = 1
    m.step.committed[0] = 0
    m.step.status[0] |= HELD
    return m.step.drive[0]


@jit
def inverse_fits(t: Any, m: Any, v: Any, ascending: int) -> bool:
    """Whether the move to v lies on the branch for which v was computed."""
    inside = clamp_drive(t, v)
    if inside == m.step.drive[0]:
        return bool(m.step.ascending[0] == ascending)
    return bool((inside > m.step.drive[0]) == (ascending != 0))


def choosing(front_inverse: Callable[..., Any]) -> Jit[[Any, Any, Any, Any], tuple[Any, int]]:
    """`inverse_choose` with the inverse of an arithmetic's memoryless part."""

    @jit
    def inverse_choose(t: Any, m: Any, level: Any, w: Any) -> tuple[Any, int]:
        """The drive that gives w on the branch of its own move, and whether an envelope cannot give w."""
        up = 1
        if t.branches:
            up = m.step.ascending[0]
            if level > m.step.last[0]:
                up = 1
            elif level < m.step.last[0]:
                up = 0
        v, limited = front_inverse(t, w, up)
        if t.branches:
            fits = inverse_fits(t, m, v, up)
            back = clamp_drive(t, v) - m.step.drive[0]
            if not fits and (up != m.step.ascending[0] or back < -t.limits[HOLD] or back > t.limits[HOLD]):
                v, limited = front_inverse(t, w, 1 - up)
                fits = inverse_fits(t, m, v, 1 - up)
            if not fits:
                v = m.step.drive[0]
        return v, limited

    return inverse_choose


inverse_choose = choosing(front_inverse)


@jit
def inverse_step(t: Tables, m: Memory, u: Any) -> Any:
    """Answer one sample."""
    if not (-t.limits[REAL_MAX] <= u <= t.limits[REAL_MAX]):
        return inverse_hold(t, m)
    inverse_keep(m)
    if not (m.step.repeated[0] and u == m.step.reference[0]):
        level = u
        if u < t.limits[OUTPUT_MIN]:
            level = t.limits[OUTPUT_MIN]
        elif u > t.limits[OUTPUT_MAX]:
            level = t.limits[OUTPUT_MAX]
        m.step.bits[0] = 0 if level == u else INPUT_CLAMPED
        m.step.reference[0] = u
        w = plays_step(t.inverse, m, level - t.limits[OFFSET])
        v, limited = inverse_choose(t, m, level, w)
        inside = clamp_drive(t, v)
        m.step.bits[0] |= DOMAIN if limited else 0
        if inside != v or inside == m.step.drive[0]:
            m.step.bits[0] |= 0 if inside == v else OUTPUT_CLAMPED
            inverse_replace(t, m, inside)
        else:
            inverse_arrive(m, inside)
        m.step.last[0] = level
        m.step.repeated[0] = 1
    m.step.stepped[0] = 1
    m.step.committed[0] = 0
    m.step.status[0] |= m.step.bits[0]
    return m.step.drive[0]


@jit
def inverse_commit(t: Tables, m: Memory, applied: Any) -> None:
    """Replace the last answer by the drive that was really applied."""
    v = clamp_drive(t, applied) + t.limits[ZERO]  # no drive is -0
    if not (-t.limits[REAL_MAX] <= applied <= t.limits[REAL_MAX]):
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
def inverse_begin(t: Tables, m: Memory, which: Start, first: int) -> None:
    """The part that init and reset share; `first` as in `Tables.applied`."""
    start(t.inverse, m, which)
    m.step.last[0] = m.here.input[0] + t.limits[OFFSET]
    move_to_output(t.inverse, m, t.begin[first])
    m.step.drive[0] = t.applied[first]
    m.step.ascending[0] = t.ascending[first]
    inverse_keep(m)
    m.step.returned[0] = m.step.drive[0]
    m.step.reference[0] = t.limits[ZERO]
    m.step.stepped[0] = 0
    m.step.committed[0] = 0
    m.step.repeated[0] = 0
    m.step.bits[0] = 0
    m.step.status[0] = 0


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
    m.step.last[0] = m.here.input[0] + t.limits[OFFSET]


OPERATIONS = corners_of(inverse_init, inverse_reset, inverse_visit, inverse_step, inverse_commit)
