"""One step of engine loop, and the operations around it: commit, reset, init.

Every function has its counterpart in `c_runtime/` or in the step template, mostly of the same name. Engine corners has
its own in `hystgen.compensator.corners`, and shares the memoryless part and the tables.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hystgen.compensator.layout import Tables
from hystgen.front.compensator import FRONT, front_forward, front_inverse
from hystgen.plays.loop import (
    ANSWER,
    APPLIED,
    ASCENDING,
    BITS,
    HAS_PENDING,
    LEVEL,
    PENDING,
    REFERENCE,
    REPEAT,
    STATUS,
    STEPPED,
    State,
    loop_absorb,
    loop_output,
    loop_rest,
    loop_solve,
    loop_start,
)
from hystgen.plays.slots import (
    DOMAIN,
    DRIVE_MAX,
    DRIVE_MIN,
    HELD,
    HOLD,
    INPUT_CLAMPED,
    OFFSET,
    OP_COMMIT,
    OP_INIT,
    OP_RESET,
    OP_STEP,
    OUTPUT_CLAMPED,
    OUTPUT_MAX,
    OUTPUT_MIN,
    REAL_MAX,
    ZERO,
    Bytes,
    Reals,
)

# ---------------------------------------------------------------- the step template


def output(t: Tables, s: State) -> Any:
    """Output for the memory as it is, offset included."""
    return loop_output(t, s) + t.limits[OFFSET]


def solve(t: Tables, s: State, u: Any) -> Any:
    """Input of the plays that gives u, offset included."""
    return loop_solve(t, s, u - t.limits[OFFSET])


def begin(t: Tables, s: State, which: int) -> None:
    """What init and reset have in common once the plays are set; `which` as in `Tables.applied`."""
    applied = t.applied[which]
    s.counts[ASCENDING] = t.ascending[which]
    s.counts[HAS_PENDING] = 0
    s.counts[REPEAT] = 0
    s.counts[STEPPED] = 0
    s.counts[BITS] = 0
    s.real[PENDING] = applied
    s.real[APPLIED] = applied
    s.real[LEVEL] = output(t, s)
    s.counts[STATUS] = 0
    s.real[REFERENCE] = s.real[LEVEL]
    s.real[ANSWER] = s.real[LEVEL]


def init(t: Tables, s: State, inverse: int) -> None:
    """Start memory of the parameter file."""
    if len(t.start) == 1:
        loop_rest(s, t.start[0])
    else:
        loop_start(s, t.start)
    begin(t, s, 2 * inverse)


def see_drive(t: Tables, s: State, v: Any) -> None:
    """The actuator sees drive v: its own move picks the branch."""
    if t.branches:
        if v > s.real[APPLIED]:
            s.counts[ASCENDING] = 1
        elif v < s.real[APPLIED]:
            s.counts[ASCENDING] = 0
    s.real[APPLIED] = v
    loop_absorb(t, s, front_forward(t, v, s.counts[ASCENDING]))


def finite(t: Tables, x: Any) -> bool:
    """Neither NaN nor infinite."""
    return bool(-t.limits[REAL_MAX] <= x <= t.limits[REAL_MAX])


def forward_step(t: Tables, s: State, v: Any) -> Any:
    """One sample of the forward operator."""
    if not finite(t, v):
        s.counts[STATUS] |= HELD
        return s.real[ANSWER]
    if v < t.limits[DRIVE_MIN]:
        v = t.limits[DRIVE_MIN]
        s.counts[STATUS] |= INPUT_CLAMPED
    elif v > t.limits[DRIVE_MAX]:
        v = t.limits[DRIVE_MAX]
        s.counts[STATUS] |= INPUT_CLAMPED
    see_drive(t, s, v)
    s.real[ANSWER] = output(t, s)
    return s.real[ANSWER]


def answer(s: State, v: Any) -> Any:
    """Leave drive v pending and return it."""
    s.real[ANSWER] = v
    s.real[PENDING] = v
    s.counts[HAS_PENDING] = 1
    s.counts[STEPPED] = 1
    return v


def clamp_drive(t: Tables, v: Any) -> Any:
    """v inside the input range."""
    if v < t.limits[DRIVE_MIN]:
        return t.limits[DRIVE_MIN]
    if v > t.limits[DRIVE_MAX]:
        return t.limits[DRIVE_MAX]
    return v


def fits(s: State, v: Any, ascending: int) -> bool:
    """Whether going to v is a move of the branch that v was computed on."""
    if v == s.real[APPLIED]:
        return bool(s.counts[ASCENDING] == ascending)
    return bool((v > s.real[APPLIED]) == (ascending != 0))


def choose_branch(t: Tables, s: State, u: Any, w: Any) -> tuple[Any, int]:
    """The drive on the branch of its own move: that of u's move first, the other one next, else no move."""
    up = s.counts[ASCENDING]
    if u > s.real[LEVEL]:
        up = 1
    elif u < s.real[LEVEL]:
        up = 0
    v, limited = front_inverse(t, w, up)
    if fits(s, clamp_drive(t, v), up):
        return v, limited
    back = clamp_drive(t, v) - s.real[APPLIED]
    if up == s.counts[ASCENDING] and -t.limits[HOLD] <= back <= t.limits[HOLD]:
        return s.real[APPLIED], limited
    v, limited = front_inverse(t, w, 1 - up)
    if fits(s, clamp_drive(t, v), 1 - up):
        return v, limited
    return s.real[APPLIED], limited


def inverse_step(t: Tables, s: State, u: Any) -> Any:
    """One sample of the inverse operator."""
    if s.counts[HAS_PENDING]:
        see_drive(t, s, s.real[PENDING])
        s.counts[HAS_PENDING] = 0
    if not finite(t, u):
        s.counts[STATUS] |= HELD
        return answer(s, s.real[ANSWER] if s.counts[STEPPED] else s.real[APPLIED])
    if s.counts[REPEAT] and u == s.real[REFERENCE]:
        s.counts[STATUS] |= s.counts[BITS]
        return answer(s, s.real[ANSWER])
    bits = 0
    s.real[REFERENCE] = u
    s.counts[REPEAT] = 1
    if u < t.limits[OUTPUT_MIN]:
        u = t.limits[OUTPUT_MIN]
        bits = bits | INPUT_CLAMPED
    elif u > t.limits[OUTPUT_MAX]:
        u = t.limits[OUTPUT_MAX]
        bits = bits | INPUT_CLAMPED
    w = solve(t, s, u)
    if t.branches:
        v, limited = choose_branch(t, s, u, w)
    else:
        v, limited = front_inverse(t, w, 1)
    s.real[LEVEL] = u
    if limited:
        bits = bits | DOMAIN
    inside = clamp_drive(t, v)
    if inside != v:
        bits = bits | OUTPUT_CLAMPED
    s.counts[BITS] = bits
    s.counts[STATUS] |= bits
    return answer(s, inside)


def inverse_commit(t: Tables, s: State, applied: Any) -> None:
    """What the drive really applied in place of the last answer."""
    if not finite(t, applied):
        s.counts[STATUS] |= HELD
        return
    v = clamp_drive(t, applied) + t.limits[ZERO]  # no drive is -0
    if v != applied:
        s.counts[STATUS] |= INPUT_CLAMPED
    s.real[PENDING] = v
    s.counts[HAS_PENDING] = 1
    s.counts[REPEAT] = 0


def reset(t: Tables, s: State, inverse: int) -> None:
    """All plays 0, status cleared; the step that belongs to a reset is the caller's."""
    loop_rest(s, t.limits[ZERO])
    begin(t, s, 2 * inverse + 1)


def run(t: Tables, s: State, inverse: int, op: Bytes, x: Reals, answers: Reals, status: Bytes) -> None:
    """Operations op[i] with argument x[i]; answers[i] is that of a step, else 0; status[i] is read and cleared."""
    for i in range(len(op)):
        if op[i] == OP_INIT:
            init(t, s, inverse)
        elif op[i] == OP_COMMIT:
            inverse_commit(t, s, x[i])
        else:
            if op[i] == OP_RESET:
                reset(t, s, inverse)
            if inverse:
                inverse_step(t, s, x[i])
            else:
                forward_step(t, s, x[i])
        answers[i] = s.real[ANSWER] if op[i] == OP_STEP else t.limits[ZERO]
        status[i] = s.counts[STATUS]
        s.counts[STATUS] = 0


def visit(t: Tables, s: State, inverse: int, v: Any) -> None:  # noqa: ARG001  the same call for every engine
    """Let the actuator be at drive v before the next sample."""
    see_drive(t, s, v)
    s.real[LEVEL] = output(t, s)

COMPILED: list[Callable[..., Any]] = [
    loop_rest, loop_start, loop_absorb, loop_output, loop_solve, *FRONT, output, solve, begin, init, see_drive, finite,
    forward_step, answer, clamp_drive, fits, choose_branch, inverse_step, inverse_commit, reset, visit, run,
]  # fmt: skip  (callees before callers)

# What every sample goes through
INLINED: set[Callable[..., Any]] = {output, solve, see_drive, finite, forward_step, answer, clamp_drive}
