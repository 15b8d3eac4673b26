"""The inverse without a memoryless part, in fixed point: `inverse_fixed.c`."""

from __future__ import annotations

from typing import Any

from hystgen.basics.jit import jit
from hystgen.compensator.layout import FixedTables, clamp_drive, inverse_clamp
from hystgen.compensator.step import corners_of
from hystgen.plays.corners.corners_fixed import FAR, FixedMemory, along, move_to_input, move_to_solution, solve, start
from hystgen.plays.corners.corners_float import (
    BEFORE,
    BITS,
    HERE,
    INPUT,
    NEXT,
    ON,
    OUTPUT,
    REFERENCE,
    REPEAT,
    RISING,
    STATUS,
    UNDO,
    K,
    copy_place,
)
from hystgen.plays.fixed import divide_by_slope, nearest
from hystgen.plays.slots import (
    DRIVE_MAX,
    DRIVE_MIN,
    FINE,
    FRACTION,
    INPUT_CLAMPED,
    OUTPUT_CLAMPED,
    OUTPUT_MAX,
    OUTPUT_MIN,
    SHY,
    Reals,
)

NEVER = -(2**31)


@jit(inline=True)
def inverse_along(m: FixedMemory, u: Any) -> Any:
    """A reference along the present move; ~u is -u - 1, which never overflows for a code."""
    return u if m.counts[RISING] else ~u


@jit
def inverse_stay(m: FixedMemory) -> None:
    """Make no step usual before another search, which begins here."""
    m.real[NEXT] = NEVER
    m.counts[ON] = 0


@jit
def inverse_look_ahead(t: FixedTables, m: FixedMemory, following: Any) -> None:
    """Make steps usual up to the next kink or limit, less rounding, but not below the least reference."""
    rising = m.counts[RISING]
    most = inverse_along(m, t.limits[OUTPUT_MAX] if rising else t.limits[OUTPUT_MIN])
    end = (t.limits[DRIVE_MAX] if rising else t.limits[DRIVE_MIN]) << t.limits[FINE]
    more = t.slope[m.counts[K] + 1] * along(m, end - m.real[INPUT])
    last = along(m, m.real[OUTPUT]) + more
    usual = ((following if following < last else last) >> t.limits[FRACTION]) - t.limits[SHY]
    least = (t.limits[OUTPUT_MIN] if rising else t.limits[OUTPUT_MAX]) << t.limits[FRACTION]
    if usual > m.real[NEXT] and along(m, m.real[OUTPUT] - least) >= 0:
        m.real[NEXT] = usual if usual < most else most


@jit
def inverse_search(t: FixedTables, m: FixedMemory, u: Any) -> Any:
    """Answer any sample except a usual one."""
    copy_place(m, UNDO, HERE)
    m.counts[ON] = 0
    if not (m.counts[REPEAT] and u == m.real[REFERENCE]):
        level = inverse_clamp(t, u)
        w, kink = solve(t, m, level << t.limits[FRACTION], -FAR)
        v = nearest(w, t.limits[FINE])
        inside = clamp_drive(t, v)
        following = move_to_solution(t, m, kink, inside << t.limits[FINE])
        inverse_stay(m)
        m.counts[BITS] = (0 if level == u else INPUT_CLAMPED) | (0 if inside == v else OUTPUT_CLAMPED)
        if m.counts[BITS] == 0:
            inverse_look_ahead(t, m, following)
        m.real[REFERENCE] = u
        m.counts[REPEAT] = 1
    m.counts[STATUS] |= m.counts[BITS]
    return m.real[INPUT] >> t.limits[FINE]


@jit
def inverse_step(t: FixedTables, m: FixedMemory, u: Any) -> Any:
    """Answer one sample."""
    on = along(m, (u << t.limits[FRACTION]) - m.real[OUTPUT])
    if inverse_along(m, u) < m.real[NEXT] and on > 0 and u != m.real[REFERENCE]:
        k = m.counts[K] + 1
        v = nearest(m.real[INPUT] + along(m, divide_by_slope(t, on, k)), t.limits[FINE])
        m.real[BEFORE] = m.real[INPUT]
        m.real[INPUT] = v << t.limits[FINE]
        m.real[OUTPUT] += t.slope[k] * (m.real[INPUT] - m.real[BEFORE])
        m.real[REFERENCE] = u
        m.counts[ON] = 1
        return v
    return inverse_search(t, m, u)


@jit
def inverse_commit(t: FixedTables, m: FixedMemory, applied: Any) -> None:
    """Replace the last answer by the drive that was really applied."""
    v = clamp_drive(t, applied)
    if v != applied:
        m.counts[STATUS] |= INPUT_CLAMPED
    if m.counts[ON]:
        m.real[OUTPUT] -= t.slope[m.counts[K] + 1] * (m.real[INPUT] - m.real[BEFORE])
        m.real[INPUT] = m.real[BEFORE]
        copy_place(m, UNDO, HERE)
    copy_place(m, HERE, UNDO)
    inverse_stay(m)
    m.counts[REPEAT] = 0
    move_to_input(t, m, v << t.limits[FINE])


@jit
def inverse_begin(t: FixedTables, m: FixedMemory, play: Reals) -> None:
    """The part that init and reset share."""
    start(t, m, play)
    copy_place(m, UNDO, HERE)
    inverse_stay(m)
    m.real[BEFORE] = 0
    m.real[REFERENCE] = 0
    m.counts[REPEAT] = 0
    m.counts[BITS] = 0
    m.counts[STATUS] = 0


@jit
def inverse_init(t: FixedTables, m: FixedMemory) -> None:
    """Set the start memory of the parameter file."""
    inverse_begin(t, m, t.start)


@jit
def inverse_reset(t: FixedTables, m: FixedMemory) -> None:
    """Set all plays to 0 and clear the status; the caller makes the step of the reset."""
    inverse_begin(t, m, t.zero)


@jit
def inverse_visit(t: FixedTables, m: FixedMemory, v: Any) -> None:
    """Move the actuator to drive v, in range or not, before the next sample."""
    move_to_input(t, m, v << t.limits[FINE])
    copy_place(m, UNDO, HERE)
    inverse_stay(m)


OPERATIONS = corners_of(inverse_init, inverse_reset, inverse_visit, inverse_step, inverse_commit)
