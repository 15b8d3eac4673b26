"""One step, and the operations around it: commit, reset, init. All chains share `operations_of`; `made_of` makes the
chain without blocks (loop engine, no effects), and `hystgen.compensator.chain` has chains with blocks.

Every function has a counterpart of the same name in `c_runtime/`. Functions that both operators share begin with
`operator_` there (`hystgen_operator_begin`; emission writes one for each) and have no prefix here (`begin`). The corner
engine without effects has its own functions in `hystgen.compensator.corners` and shares only the memoryless part and
the tables.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

from hystgen.basics.jit import Action, Answer, Check, LimitedAnswer, N, Scalar, jit
from hystgen.compensator.layout import FixedTables, Limited, Tables, clamp_drive, inverse_clamp
from hystgen.plays.loop import State, loop_absorb, loop_rest, loop_start
from hystgen.plays.slots import (
    DOMAIN,
    HELD,
    INPUT_CLAMPED,
    OP_CALL,
    OP_COMMIT,
    OP_INIT,
    OP_RESET,
    OP_STEP,
    OP_UNREAD,
    OUTPUT_CLAMPED,
    Bytes,
    Reals,
    StepState,
)


class Stepping(Protocol):
    """Anything with the memory of the step itself, which every engine has."""

    @property
    def step(self) -> StepState: ...


class Branching(Limited, Protocol):
    """The tables of a memoryless part that may have two branches."""

    @property
    def branches(self) -> int: ...


class Operations(NamedTuple):
    """The operations on an instance of one operator: `init` sets the start memory, `visit` moves the actuator before
    the next sample, `step` answers a sample, `run` executes a sequence of calls."""

    init: Action
    visit: Action
    step: Answer
    run: Action


@jit(inline=True)
def forward_commit(t: Limited, s: object, applied: Scalar) -> None:
    """Do nothing: the forward operator has absorbed every drive."""


@jit(inline=True)
def inverse_answer(s: Stepping, v: Scalar) -> Scalar:
    """Leave drive v pending and return it."""
    s.step.answer[0] = v
    s.step.pending[0] = v
    s.step.has_pending[0] = 1
    s.step.stepped[0] = 1
    return v


@jit
def inverse_fits(t: Limited, s: Stepping, v: Scalar, ascending: int) -> bool:
    """Whether the move to v lies on the branch for which v was computed."""
    inside = clamp_drive(t, v)
    if inside == s.step.drive[0]:
        return bool(s.step.ascending[0] == ascending)
    return bool((inside > s.step.drive[0]) == (ascending != 0))


@jit(inline=True)
def turn_to(s: Stepping, v: Scalar) -> None:
    """Move the actuator to drive v; the direction of the move selects the branch."""
    if v > s.step.drive[0]:
        s.step.ascending[0] = 1
    elif v < s.step.drive[0]:
        s.step.ascending[0] = 0
    s.step.drive[0] = v


def choosing(
    front_inverse: Callable[..., tuple[N, int]]
) -> Callable[[Branching, Stepping, N, N], tuple[N, int]]:
    """`inverse_choose`, for the memoryless inverse of an arithmetic."""

    @jit
    def inverse_choose(t: Branching, s: Stepping, level: N, w: N) -> tuple[N, int]:
        """The drive that gives w on the branch of its own move: tries the branch of the reference's move, then the
        other; if neither fits, the drive holds."""
        if not t.branches:
            return front_inverse(t, w, 1)
        up = s.step.ascending[0]
        if level > s.step.last[0]:
            up = 1
        elif level < s.step.last[0]:
            up = 0
        v, limited = front_inverse(t, w, up)
        if inverse_fits(t, s, v, up):
            return v, limited
        back = clamp_drive(t, v) - s.step.drive[0]
        if up == s.step.ascending[0] and -t.limits.hold[0] <= back <= t.limits.hold[0]:
            return s.step.drive[0], limited
        v, limited = front_inverse(t, w, 1 - up)
        if inverse_fits(t, s, v, 1 - up):
            return v, limited
        return s.step.drive[0], limited

    return inverse_choose


class PlayOperations(NamedTuple):
    """Operations of plays behind a memoryless part, in any chain: `init` and `reset` set a start memory, `arrive` moves
    to a drive, `drive` finds the drive for an input of the plays."""

    init: Action
    reset: Action
    arrive: Answer
    drive: Answer


def plays_of(front_forward: Answer, front_inverse: LimitedAnswer, output: Answer) -> PlayOperations:
    """The operations of plays, from the two functions of the memoryless part and `output` for the present memory."""

    inverse_choose = choosing(front_inverse)

    @jit
    def begin(t: Tables | FixedTables, s: State, which: int) -> None:
        """The part shared by init and reset, once the plays are set; `which` as in `Tables.applied`."""
        drive = t.applied[which]
        s.step.ascending[0] = t.ascending[which]
        s.step.has_pending[0] = 0
        s.step.repeated[0] = 0
        s.step.stepped[0] = 0
        s.step.bits[0] = 0
        s.step.pending[0] = drive
        s.step.drive[0] = drive
        s.step.last[0] = output(t, s)
        s.step.status[0] = 0
        s.step.reference[0] = s.step.last[0]
        s.step.answer[0] = s.step.last[0]

    @jit
    def init(t: Tables | FixedTables, s: State, inverse: int) -> None:
        """Set the start memory of the parameter file."""
        if len(t.start) == 1:
            loop_rest(s, t.start[0])
        else:
            loop_start(s, t.start)
        begin(t, s, 2 * inverse)

    @jit
    def reset(t: Tables | FixedTables, s: State, inverse: int) -> None:
        """Set all plays to 0 and clear the status; the caller then makes the reset's step."""
        loop_rest(s, t.limits.zero[0])
        begin(t, s, 2 * inverse + 1)

    @jit(inline=True)
    def set_drive(t: Tables | FixedTables, s: State, v: Scalar) -> None:
        """Move the actuator to drive v; with two branches, the direction of the move selects one."""
        if t.branches:
            turn_to(s, v)
        s.step.drive[0] = v

    @jit(inline=True)
    def arrive(t: Tables | FixedTables, s: State, v: Scalar) -> Scalar:
        """Move the actuator to drive v. Returns the input of the plays."""
        set_drive(t, s, v)
        return front_forward(t, v, s.step.ascending[0])

    @jit
    def inverse_drive(t: Tables | FixedTables, s: State, level: Scalar, w: Scalar) -> Scalar:
        """The drive that gives w."""
        v, limited = inverse_choose(t, s, level, w)
        s.step.last[0] = level
        if limited:
            s.step.bits[0] |= DOMAIN
        return v

    return PlayOperations(init, reset, arrive, inverse_drive)


class Hooks(NamedTuple):
    """The functions of a chain that a step calls, as functions of tables and memory."""

    plays: Callable[..., Stepping]  # the memory of the step itself
    finite: Check
    absorb: Action
    shown: LimitedAnswer  # the present output, and status bits
    unread: Action  # record that a reference is not finite
    held: Answer  # the drive for such a reference
    stands: Check  # whether the last answer holds for a reference
    sought: Answer  # the drive for a limited reference, possibly out of range; sets `bits`
    other: Answer  # a call that models without effects do not have


def run_of(
    init: Action, reset: Action, step: Answer, commit: Action, plays: Callable[..., Stepping], other: Answer
) -> Action:
    """`Operations.run` for any engine."""

    @jit
    def run(t: Limited, s: object, op: Bytes, x: Reals, answers: Reals, status: Bytes) -> None:
        """Run op[i] with argument x[i]. answers[i] is the call's answer, 0 if it has none and for a reset; status[i] is
        the status, read and cleared, or 0 if it is left for a later call."""
        m = plays(s).step
        for i in range(len(op)):
            call = op[i] & OP_CALL
            answers[i] = t.limits.zero[0]
            if call == OP_INIT:
                init(t, s)
            elif call == OP_COMMIT:
                commit(t, s, x[i])
            elif call == OP_RESET:
                reset(t, s)
                step(t, s, x[i])
            elif call == OP_STEP:
                answers[i] = step(t, s, x[i])
            else:
                answers[i] = other(t, s, call, x[i])
            left = m.status[0] if op[i] & OP_UNREAD else 0
            status[i] = m.status[0] - left
            m.status[0] = left

    return run


def corners_of(begin: Action, visit: Action, step: Answer, commit: Action = forward_commit) -> Operations:
    """The operations of one operator in the corner engine without effects, where the plays' memory is the whole memory;
    `begin` sets the start memory of the parameter file (0), or all plays to 0 (1)."""

    @jit(inline=True)
    def init(t: Limited, m: Stepping) -> None:
        """Set the start memory of the parameter file."""
        begin(t, m, 0)

    @jit(inline=True)
    def reset(t: Limited, m: Stepping) -> None:
        """Set all plays to 0 and clear the status; the caller then makes the reset's step."""
        begin(t, m, 1)

    @jit(inline=True)
    def itself(m: Stepping) -> Stepping:
        """The memory itself."""
        return m

    return Operations(init, visit, step, run_of(init, reset, step, commit, itself, no_other))


@jit(inline=True)
def no_other(t: Limited, s: object, call: int, x: Scalar) -> Scalar:  # noqa: ARG001  the same call for every chain
    """Return 0: a model without effects has no other calls."""
    return t.limits.zero[0]


def operations_of(inverse: bool, init: Action, reset: Action, visit: Action, hooks: Hooks) -> Operations:
    """The operations of one operator on a chain; step, commit, hold, clamp and status are the same for every chain."""
    plays, finite, absorb, shown, unread, held, stands, sought, other = hooks

    @jit(inline=True)
    def forward_step(t: Limited, s: object, v: Scalar) -> Scalar:
        """Answer one sample of the forward operator."""
        m = plays(s)
        if not finite(t, v):
            m.step.status[0] |= HELD
            return m.step.answer[0]
        inside = clamp_drive(t, v)
        if inside != v:
            m.step.status[0] |= INPUT_CLAMPED
        absorb(t, s, inside)
        m.step.answer[0], bits = shown(t, s)
        m.step.status[0] |= bits
        return m.step.answer[0]

    @jit(inline=True)
    def inverse_take(t: Limited, s: object) -> None:
        """Absorb the pending drive."""
        m = plays(s)
        if m.step.has_pending[0]:
            absorb(t, s, m.step.pending[0])
            m.step.has_pending[0] = 0

    @jit
    def inverse_step(t: Limited, s: object, u: Scalar) -> Scalar:
        """Answer one sample of the inverse operator."""
        m = plays(s)
        inverse_take(t, s)
        if not finite(t, u):
            m.step.status[0] |= HELD
            unread(t, s)
            return inverse_answer(m, held(t, s))
        level = inverse_clamp(t, u)
        if level != u:
            m.step.status[0] |= INPUT_CLAMPED
        if stands(t, s, u):
            m.step.status[0] |= m.step.bits[0]
            return inverse_answer(m, m.step.answer[0])
        v = sought(t, s, level)
        inside = clamp_drive(t, v)
        if inside != v:
            m.step.bits[0] |= OUTPUT_CLAMPED
        m.step.status[0] |= m.step.bits[0]
        return inverse_answer(m, inside)

    @jit(inline=True)
    def inverse_commit(t: Limited, s: object, applied: Scalar) -> None:
        """Replace the last answer by the drive that was actually applied."""
        m = plays(s)
        if not finite(t, applied):
            m.step.status[0] |= HELD
            return
        v = clamp_drive(t, applied) + t.limits.zero[0]  # no drive is -0
        if v != applied:
            m.step.status[0] |= INPUT_CLAMPED
        m.step.repeated[0] = 0
        m.step.pending[0] = v
        m.step.has_pending[0] = 1

    step, commit = (inverse_step, inverse_commit) if inverse else (forward_step, forward_commit)
    return Operations(init, visit, step, run_of(init, reset, step, commit, plays, other))


def made_of(
    front_forward: Answer, front_inverse: LimitedAnswer, output: LimitedAnswer, inverse_solve: Answer, finite: Check
) -> tuple[Operations, Operations]:
    """The operations of the forward operator and the inverse of a chain without blocks, from the functions in which
    arithmetics differ: the memoryless part, the output for the present memory with its status bits, the plays' input
    for an output, and whether an argument is finite."""

    @jit(inline=True)
    def level_of(t: Tables | FixedTables, s: State) -> Scalar:
        """The output for the present memory, without its status, since this is not a step."""
        return output(t, s)[0]

    plays_init, plays_reset, arrive, inverse_drive = plays_of(front_forward, front_inverse, level_of)

    @jit(inline=True)
    def itself(s: State) -> State:
        """The memory itself, which consists of the plays alone."""
        return s

    @jit(inline=True)
    def absorb(t: Tables | FixedTables, s: State, v: Scalar) -> None:
        """Absorb drive v."""
        loop_absorb(t, s, arrive(t, s, v))

    @jit
    def visit(t: Tables | FixedTables, s: State, v: Scalar) -> None:
        """Move the actuator to drive v before the next sample."""
        absorb(t, s, v)
        s.step.last[0], bits = output(t, s)
        s.step.status[0] |= bits

    @jit(inline=True)
    def unread(t: Tables | FixedTables, s: State) -> None:
        """Do nothing: there is no preview line to fill."""

    @jit(inline=True)
    def held(t: Tables | FixedTables, s: State) -> Scalar:  # noqa: ARG001  the same call for every chain
        """The last answer again."""
        return s.step.answer[0] if s.step.stepped[0] else s.step.drive[0]

    @jit(inline=True)
    def stands(t: Tables | FixedTables, s: State, u: Scalar) -> bool:  # noqa: ARG001
        """Whether the last answer holds for reference u; u becomes the last reference."""
        if s.step.repeated[0] and u == s.step.reference[0]:
            return True
        s.step.reference[0] = u
        s.step.repeated[0] = 1
        return False

    @jit(inline=True)
    def sought(t: Tables | FixedTables, s: State, level: Scalar) -> Scalar:
        """The drive for the limited reference `level`."""
        s.step.bits[0] = 0
        return inverse_drive(t, s, level, inverse_solve(t, s, level))

    hooks = Hooks(itself, finite, absorb, output, unread, held, stands, sought, no_other)

    def operator(inverse: bool) -> Operations:
        """The operations of one operator."""

        @jit(inline=True)
        def init(t: Tables | FixedTables, s: State) -> None:
            """Set the start memory of the parameter file."""
            plays_init(t, s, inverse)

        @jit(inline=True)
        def reset(t: Tables | FixedTables, s: State) -> None:
            """Set all plays to 0 and clear the status; the caller then makes the reset's step."""
            plays_reset(t, s, inverse)

        return operations_of(inverse, init, reset, visit, hooks)

    return operator(False), operator(True)
