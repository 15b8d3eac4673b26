"""The bit reference of engine loop: the emitted C, operation for operation, in Python.

Every function has its counterpart of the same name in `c_runtime/` and computes the same operations in the same order
in the same arithmetic, so that results are compared for equal bits. What both operators do alike C has for each of them
(`forward_begin`, `inverse_begin`); here it is written once (`begin`). That of engine corners is in `hystgen.corners`,
and shares the memoryless part and the tables.

The functions know nothing of numpy's or numba's types: they run as plain Python on scalars of the arrays they are
given, or compiled (see `hystgen.compiled`). Real constants come out of arrays because a literal would not have the
arithmetic's type.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from hystgen.corners.memory import Curve, Start
from hystgen.kernels import AtanhTables, TanhTables, atanh, tanh

Reals = NDArray[Any]
Counts = NDArray[np.int64]
Bytes = NDArray[np.uint8]

# arithmetic-independent names for places in the arrays below
DRIVE_MIN, DRIVE_MAX, OUTPUT_MIN, OUTPUT_MAX, OFFSET = 0, 1, 2, 3, 4
HOLD, REAL_MAX, ZERO = 7, 8, 9

CORNERS, LOOP = 0, 1
TANH, DEAD_ZONE = 0, 1

PENDING, DRIVE, REFERENCE, LEVEL, ANSWER = 0, 1, 2, 3, 4
ASCENDING, HAS_PENDING, REPEAT, STEPPED, BITS, STATUS = 0, 1, 2, 3, 4, 5

INPUT_CLAMPED, OUTPUT_CLAMPED, HELD, DOMAIN = 1, 2, 4, 8

OP_STEP, OP_COMMIT, OP_RESET, OP_INIT = 0, 1, 2, 3


class Tables(NamedTuple):
    """The constants of one model in one arithmetic; arrays of the real type unless said otherwise."""

    threshold: Reals  # n + 1
    weight: Reals  # n + 1
    slope: Reals  # n + 2
    lift: Reals  # n + 2
    start_level: Reals  # n + 1
    inverse_slope: Reals  # n + 2
    start: Reals  # n + 1 plays, or 1 where all start at the same value
    limits: Reals  # DRIVE_MIN .. ZERO
    applied: Reals  # drive before the first move: 2 * inverse + (0 after init, 1 after reset)
    ascending: Counts  # direction before the first move, likewise
    stage_kind: Counts  # TANH or DEAD_ZONE, in order from the drive
    stage_first: Counts  # where the stage's numbers begin in stage_data
    stage_size: Counts  # break points of a dead zone
    stage_data: Reals
    forward: Curve  # of the corner engine, as what follows
    inverse: Curve
    forward_first: Start
    forward_zero: Start
    inverse_first: Start
    inverse_zero: Start
    begin: Reals  # input of the plays before the first move, as `applied`
    engine: int
    branches: int  # 1 where an ascending and a descending branch differ
    tanh: TanhTables
    atanh: AtanhTables


class PlayTables(Protocol):
    """What memory and plays need of a model's constants, in any arithmetic."""

    @property
    def threshold(self) -> Reals: ...
    @property
    def weight(self) -> Reals: ...
    @property
    def limits(self) -> Reals: ...


class State(NamedTuple):
    """One instance: plain arrays."""

    real: Reals
    counts: Counts
    play: Reals


def new_state(t: PlayTables) -> State:
    """Memory for one instance of the model; `init` gives it its values."""
    dtype = t.threshold.dtype
    return State(real=np.zeros(5, dtype), counts=np.zeros(6, np.int64), play=np.zeros(len(t.threshold), dtype))


# ---------------------------------------------------------------- loop_absorb.c, loop_solve.c


def loop_rest(s: State, w: Any) -> None:
    """Every play holds w."""
    for i in range(len(s.play)):
        s.play[i] = w


def loop_start(s: State, start: Reals) -> None:
    """Each play holds its own start value."""
    for i in range(len(s.play)):
        s.play[i] = start[i]


def loop_absorb(t: PlayTables, s: State, w: Any) -> None:
    """play_r[w] = max(w - r, min(w + r, play)), play by play."""
    for i in range(len(s.play)):
        low = w - t.threshold[i]
        high = w + t.threshold[i]
        upper = s.play[i]
        if upper > high:
            upper = high
        if upper < low:
            upper = low
        s.play[i] = upper


def loop_output(t: PlayTables, s: State) -> Any:
    """p_0 play_0 + p_1 play_1 + ..., in this order."""
    total = t.limits[ZERO]
    for i in range(len(s.play)):
        total = total + t.weight[i] * s.play[i]
    return total


def loop_solve(t: Tables, s: State, output: Any) -> Any:
    """Input of the plays that gives `output`, letting go of the largest thresholds one by one."""
    rising = output >= loop_output(t, s)
    tail = t.limits[ZERO]
    next_follows = t.limits[ZERO]
    for last in range(len(s.play) - 1, -1, -1):
        k = last + 1
        if rising:
            first = s.play[last] + t.threshold[last]
            w = (output - (tail - t.lift[k])) * t.inverse_slope[k]
        else:
            first = s.play[last] - t.threshold[last]
            w = (output - (tail + t.lift[k])) * t.inverse_slope[k]
        if w >= first if rising else w <= first:
            if k < len(s.play) and (w > next_follows if rising else w < next_follows):
                return next_follows
            return w
        tail = tail + t.weight[last] * s.play[last]
        next_follows = first
    return s.play[0]


# ---------------------------------------------------------------- envelope_*.c, dead_zone_*.c


def envelope_forward(t: Tables, first: int, x: Any) -> Any:
    """a0 tanh(a1 x + a2) + a3."""
    d = t.stage_data
    return d[first] * tanh(d[first + 1] * x + d[first + 2], t.tanh) + d[first + 3]


def envelope_inverse(t: Tables, first: int, y: Any) -> tuple[Any, int]:
    """(atanh((y - a3) / a0) - a2) / a1, and whether the argument had to be limited."""
    d = t.stage_data
    argument = (y - d[first + 3]) * d[first + 4]
    limited = 0
    if argument > d[first + 6]:
        argument = d[first + 6]
        limited = 1
    elif argument < -d[first + 6]:
        argument = -d[first + 6]
        limited = 1
    return (atanh(argument, t.atanh) - d[first + 2]) * d[first + 5], limited


def dead_zone(t: Tables, first: int, n: int, x: Any, inverse: int) -> Any:
    """Follow the straight piece that x lies on; the tables of the inverse are those of the forward map swapped."""
    d = t.stage_data
    breaks = first + n * inverse
    anchor_in = first + 2 * n + (n + 1) * inverse
    anchor_out = first + 2 * n + (n + 1) * (1 - inverse)
    slope = first + 2 * n + 2 * (n + 1) + (n + 1) * inverse
    low = 0
    high = n
    while low < high:
        middle = (low + high) // 2
        if x >= d[breaks + middle]:
            low = middle + 1
        else:
            high = middle
    return d[anchor_out + low] + (x - d[anchor_in + low]) * d[slope + low]


def front_forward(t: Tables, v: Any, ascending: int) -> Any:
    """w = G[v] on one branch, stage by stage from the drive."""
    w = v
    for j in range(len(t.stage_kind)):
        first = t.stage_first[j]
        if t.stage_kind[j] == DEAD_ZONE:
            w = dead_zone(t, first, t.stage_size[j], w, 0)
        elif ascending:
            w = envelope_forward(t, first, w)
        else:
            w = envelope_forward(t, first + 7, w)
    return w


def front_inverse(t: Tables, w: Any, ascending: int) -> tuple[Any, int]:
    """v = G^-1[w] on one branch, stages in reverse order, and whether an envelope's argument was limited."""
    v = w
    limited = 0
    for j in range(len(t.stage_kind) - 1, -1, -1):
        first = t.stage_first[j]
        if t.stage_kind[j] == DEAD_ZONE:
            v = dead_zone(t, first, t.stage_size[j], v, 1)
        else:
            if not ascending:
                first = first + 7
            v, one = envelope_inverse(t, first, v)
            limited = limited | one
    return v, limited


# ---------------------------------------------------------------- loop*.c, clamp.c, inverse_*_branch*.c


def output(t: Tables, s: State) -> Any:
    """Output for the memory as it is, offset included."""
    return loop_output(t, s) + t.limits[OFFSET]


def inverse_solve(t: Tables, s: State, level: Any) -> Any:
    """Input of the plays that gives output `level`."""
    return loop_solve(t, s, level - t.limits[OFFSET])


def begin(t: Tables, s: State, which: int) -> None:
    """What init and reset have in common once the plays are set; `which` as in `Tables.applied`."""
    drive = t.applied[which]
    s.counts[ASCENDING] = t.ascending[which]
    s.counts[HAS_PENDING] = 0
    s.counts[REPEAT] = 0
    s.counts[STEPPED] = 0
    s.counts[BITS] = 0
    s.real[PENDING] = drive
    s.real[DRIVE] = drive
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


def arrive(t: Tables, s: State, v: Any) -> Any:
    """The actuator is at drive v, whose own move picks the branch; the input of the plays."""
    if t.branches:
        if v > s.real[DRIVE]:
            s.counts[ASCENDING] = 1
        elif v < s.real[DRIVE]:
            s.counts[ASCENDING] = 0
    s.real[DRIVE] = v
    return front_forward(t, v, s.counts[ASCENDING])


def absorb(t: Tables, s: State, v: Any) -> None:
    """The actuator has seen drive v."""
    loop_absorb(t, s, arrive(t, s, v))


def finite(t: Tables, x: Any) -> bool:
    """Neither NaN nor infinite."""
    return bool(-t.limits[REAL_MAX] <= x <= t.limits[REAL_MAX])


def clamp_drive(t: Tables, v: Any) -> Any:
    """v inside the input range."""
    if v < t.limits[DRIVE_MIN]:
        return t.limits[DRIVE_MIN]
    if v > t.limits[DRIVE_MAX]:
        return t.limits[DRIVE_MAX]
    return v


def inverse_clamp(t: Tables, u: Any) -> Any:
    """u inside the output range."""
    if u < t.limits[OUTPUT_MIN]:
        return t.limits[OUTPUT_MIN]
    if u > t.limits[OUTPUT_MAX]:
        return t.limits[OUTPUT_MAX]
    return u


def forward_step(t: Tables, s: State, v: Any) -> Any:
    """One sample of the forward operator."""
    if not finite(t, v):
        s.counts[STATUS] |= HELD
        return s.real[ANSWER]
    inside = clamp_drive(t, v)
    if inside != v:
        s.counts[STATUS] |= INPUT_CLAMPED
    absorb(t, s, inside)
    s.real[ANSWER] = output(t, s)
    return s.real[ANSWER]


def inverse_answer(s: State, v: Any) -> Any:
    """Leave drive v pending and return it."""
    s.real[ANSWER] = v
    s.real[PENDING] = v
    s.counts[HAS_PENDING] = 1
    s.counts[STEPPED] = 1
    return v


def inverse_take(t: Tables, s: State) -> None:
    """What is pending is what the actuator has seen."""
    if s.counts[HAS_PENDING]:
        absorb(t, s, s.real[PENDING])
        s.counts[HAS_PENDING] = 0


def inverse_fits(t: Tables, s: State, v: Any, ascending: int) -> bool:
    """Whether going to v is a move of the branch that v was computed on."""
    inside = clamp_drive(t, v)
    if inside == s.real[DRIVE]:
        return bool(s.counts[ASCENDING] == ascending)
    return bool((inside > s.real[DRIVE]) == (ascending != 0))


def inverse_choose(t: Tables, s: State, level: Any, w: Any) -> tuple[Any, int]:
    """The drive on the branch of its own move: that of the reference's move first, then the other one, else no move."""
    if not t.branches:
        return front_inverse(t, w, 1)
    up = s.counts[ASCENDING]
    if level > s.real[LEVEL]:
        up = 1
    elif level < s.real[LEVEL]:
        up = 0
    v, limited = front_inverse(t, w, up)
    if inverse_fits(t, s, v, up):
        return v, limited
    back = clamp_drive(t, v) - s.real[DRIVE]
    if up == s.counts[ASCENDING] and -t.limits[HOLD] <= back <= t.limits[HOLD]:
        return s.real[DRIVE], limited
    v, limited = front_inverse(t, w, 1 - up)
    if inverse_fits(t, s, v, 1 - up):
        return v, limited
    return s.real[DRIVE], limited


def inverse_drive(t: Tables, s: State, level: Any, w: Any) -> Any:
    """The drive that gives w."""
    v, limited = inverse_choose(t, s, level, w)
    s.real[LEVEL] = level
    if limited:
        s.counts[BITS] |= DOMAIN
    return v


def inverse_search(t: Tables, s: State, u: Any, level: Any, bits: int) -> Any:
    """Answer reference u, which is `level` once it is limited; `bits` is its status so far."""
    if s.counts[REPEAT] and u == s.real[REFERENCE]:
        s.counts[STATUS] |= s.counts[BITS]
        return inverse_answer(s, s.real[ANSWER])
    s.real[REFERENCE] = u
    s.counts[REPEAT] = 1
    s.counts[BITS] = bits
    v = inverse_drive(t, s, level, inverse_solve(t, s, level))
    inside = clamp_drive(t, v)
    if inside != v:
        s.counts[BITS] |= OUTPUT_CLAMPED
    s.counts[STATUS] |= s.counts[BITS]
    return inverse_answer(s, inside)


def inverse_step(t: Tables, s: State, u: Any) -> Any:
    """One sample of the inverse operator."""
    inverse_take(t, s)
    if not finite(t, u):
        s.counts[STATUS] |= HELD
        return inverse_answer(s, s.real[ANSWER] if s.counts[STEPPED] else s.real[DRIVE])
    level = inverse_clamp(t, u)
    return inverse_search(t, s, u, level, 0 if level == u else INPUT_CLAMPED)


def inverse_replace(s: State, applied: Any, v: Any) -> None:
    """Drive v, which is `applied` once it is limited, is pending in place of the last answer."""
    if v != applied:
        s.counts[STATUS] |= INPUT_CLAMPED
    s.counts[REPEAT] = 0
    s.real[PENDING] = v
    s.counts[HAS_PENDING] = 1


def inverse_commit(t: Tables, s: State, applied: Any) -> None:
    """What the drive really applied in place of the last answer."""
    if not finite(t, applied):
        s.counts[STATUS] |= HELD
        return
    inverse_replace(s, applied, clamp_drive(t, applied) + t.limits[ZERO])  # no drive is -0


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
    absorb(t, s, v)
    s.real[LEVEL] = output(t, s)


FRONT: list[Callable[..., Any]] = [envelope_forward, envelope_inverse, dead_zone, front_forward, front_inverse]

COMPILED: list[Callable[..., Any]] = [
    loop_rest, loop_start, loop_absorb, loop_output, loop_solve, *FRONT, output, inverse_solve, begin, init, arrive,
    absorb, finite, clamp_drive, inverse_clamp, forward_step, inverse_answer, inverse_take, inverse_fits,
    inverse_choose, inverse_drive, inverse_search, inverse_step, inverse_replace, inverse_commit, reset, visit, run,
]  # fmt: skip  (callees before callers)

# What every sample goes through
INLINED: set[Callable[..., Any]] = {
    output, inverse_solve, arrive, absorb, finite, forward_step, inverse_answer, inverse_take, inverse_search,
    clamp_drive, inverse_clamp,
}  # fmt: skip
