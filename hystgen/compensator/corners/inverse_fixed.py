"""The inverse without a memoryless part, in fixed point: `inverse_fixed.c`."""

from __future__ import annotations

from hystgen.basics.jit import jit
from hystgen.compensator.layout import FixedTables, clamp_drive, inverse_clamp
from hystgen.compensator.step import corners_of
from hystgen.plays.corners.corners_fixed import FAR, FixedMemory, along, move_to_input, move_to_solution, solve, start
from hystgen.plays.corners.corners_float import copy_place
from hystgen.plays.fixed import divide_by_slope, nearest
from hystgen.plays.slots import INPUT_CLAMPED, OUTPUT_CLAMPED

NEVER = -(2**31)


@jit(inline=True)
def inverse_along(m: FixedMemory, u: int) -> int:
    """A reference along the present move; ~u is -u - 1, which never overflows for a code."""
    return u if m.here.rising[0] else ~u


@jit
def inverse_stay(m: FixedMemory) -> None:
    """Make no step usual until the next search, which begins here."""
    m.step.next[0] = NEVER
    m.step.usual[0] = 0


@jit
def inverse_look_ahead(t: FixedTables, m: FixedMemory, following: int) -> None:
    """Make steps usual up to the next kink or limit, less rounding, but not below the least reference."""
    rising = m.here.rising[0]
    most = inverse_along(m, t.limits.output.high[0] if rising else t.limits.output.low[0])
    end = (t.limits.drive.high[0] if rising else t.limits.drive.low[0]) << t.limits.fine[0]
    more = t.slope[m.here.k[0] + 1] * along(m, end - m.here.input[0])
    last = along(m, m.here.output[0]) + more
    usual = ((following if following < last else last) >> t.limits.fraction[0]) - t.limits.shy[0]
    least = (t.limits.output.low[0] if rising else t.limits.output.high[0]) << t.limits.fraction[0]
    if usual > m.step.next[0] and along(m, m.here.output[0] - least) >= 0:
        m.step.next[0] = usual if usual < most else most


@jit
def inverse_search(t: FixedTables, m: FixedMemory, u: int) -> int:
    """Answer any sample that is not usual."""
    copy_place(m.undo, m.here)
    m.step.usual[0] = 0
    if not (m.step.repeated[0] and u == m.step.reference[0]):
        level = inverse_clamp(t, u)
        w, kink = solve(t, m, level << t.limits.fraction[0], -FAR)
        v = nearest(w, t.limits.fine[0])
        inside = clamp_drive(t, v)
        following = move_to_solution(t, m, kink, inside << t.limits.fine[0])
        inverse_stay(m)
        m.step.bits[0] = (0 if level == u else INPUT_CLAMPED) | (0 if inside == v else OUTPUT_CLAMPED)
        if m.step.bits[0] == 0:
            inverse_look_ahead(t, m, following)
        m.step.reference[0] = u
        m.step.repeated[0] = 1
    m.step.status[0] |= m.step.bits[0]
    return m.here.input[0] >> t.limits.fine[0]


@jit
def inverse_step(t: FixedTables, m: FixedMemory, u: int) -> int:
    """Answer one sample."""
    on = along(m, (u << t.limits.fraction[0]) - m.here.output[0])
    if inverse_along(m, u) < m.step.next[0] and on > 0 and u != m.step.reference[0]:
        k = m.here.k[0] + 1
        v = nearest(m.here.input[0] + along(m, divide_by_slope(t, on, k)), t.limits.fine[0])
        m.step.before[0] = m.here.input[0]
        m.here.input[0] = v << t.limits.fine[0]
        m.here.output[0] += t.slope[k] * (m.here.input[0] - m.step.before[0])
        m.step.reference[0] = u
        m.step.usual[0] = 1
        return v
    return inverse_search(t, m, u)


@jit
def inverse_commit(t: FixedTables, m: FixedMemory, applied: int) -> None:
    """Replace the last answer by the drive that was actually applied."""
    v = clamp_drive(t, applied)
    if v != applied:
        m.step.status[0] |= INPUT_CLAMPED
    if m.step.usual[0]:
        m.here.output[0] -= t.slope[m.here.k[0] + 1] * (m.here.input[0] - m.step.before[0])
        m.here.input[0] = m.step.before[0]
        copy_place(m.undo, m.here)
    copy_place(m.here, m.undo)
    inverse_stay(m)
    m.step.repeated[0] = 0
    move_to_input(t, m, v << t.limits.fine[0])


@jit
def inverse_begin(t: FixedTables, m: FixedMemory, zero: int) -> None:
    """Set the start memory of the parameter file, or all plays to 0."""
    start(t, m, t.zero if zero else t.start)
    copy_place(m.undo, m.here)
    inverse_stay(m)
    m.step.before[0] = 0
    m.step.reference[0] = 0
    m.step.repeated[0] = 0
    m.step.bits[0] = 0
    m.step.status[0] = 0


@jit
def inverse_visit(t: FixedTables, m: FixedMemory, v: int) -> None:
    """Move the actuator to drive v, in range or not, before the next sample."""
    move_to_input(t, m, v << t.limits.fine[0])
    copy_place(m.undo, m.here)
    inverse_stay(m)


OPERATIONS = corners_of(inverse_begin, inverse_visit, inverse_step, inverse_commit)
