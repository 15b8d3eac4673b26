"""One step of a model with effects, and its calls: the bit-exact reference of `c_runtime/compensator/chain/chain.c`.

Blocks in front of the plays (lag) and behind them (creep, gain) absorb the applied drive forwards and are solved
backwards; the plays between them are those of engine loop or corners. The functions of the blocks, and the conversion
between codes and signals, come from the arithmetic (`step_float`, `step_fixed`).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hystgen.basics.jit import Action, Answer, Check, LimitedAnswer, Scalar, inside, jit
from hystgen.basics.structures import Flag, Play, Reach, Real, Signal, Struct, UInt32, note
from hystgen.compensator.chain.layout import ChainTables, Contents, OwnChainTables
from hystgen.compensator.chain.parts import AHEAD, BEHIND, BESIDE, LED, PARTS, SENT, parts_with
from hystgen.compensator.chain.preview import PreviewLine, preview_put, preview_repeat
from hystgen.compensator.chain.sides import Blocks, calling, moves, side_of, told, told_of
from hystgen.compensator.layout import clamp_drive, inverse_clamp
from hystgen.compensator.step import Hooks, Operations, operations_of, plays_of
from hystgen.effects.kinds import OwnBlock
from hystgen.effects.part import Verbs
from hystgen.effects.plays import FixedMovingTables, FixedSearchState, SearchState
from hystgen.plays import loop
from hystgen.plays.loop import State, loop_output, project
from hystgen.plays.slots import (
    CORNERS,
    DOMAIN,
    HELD,
    INPUT_CLAMPED,
    LIMITED_SETTING,
    OP_CARRY,
    OP_CORRECT,
    OP_EXPECTED,
    OP_GAIN,
    OP_INFLUENCE,
    OP_OFFSET,
    OP_PUSH,
    OP_SETTLE,
    OP_TEMPERATURE,
    OP_TRAVEL,
    OP_TRAVELLED,
    SLEW_LIMITED,
    Counts,
    Reals,
)

(CLOCK,) = map(PARTS.index, BESIDE)
AGED = next(k for k, part in enumerate(PARTS) if "travel" in part.calls)


class RampState(Struct):
    """A rate-limited drive: the value sent, and its rounding remainder."""

    drive: Reach
    rest: Play


class QuietState(Struct):
    """A drive that stands still while the reference does."""

    arrived: Signal = note("last output of the drive side")
    reference: Signal
    equal: UInt32 = note("equal references in a row, at most one more than needed to stand still")


class SteadyState(Struct):
    """A lag in front of two branches."""

    way: Signal = note("move of the lag's target in this sample,")
    moved: Signal = note("and in the previous one")
    rises: Flag = note("the lag arrives from below")


class OwnState(Struct):
    """The memory of every model with effects in addition to `StepState`."""

    applied: Real  # drive seen last
    output: Signal  # result of the output side for the sum of the plays
    offset: Signal  # set in addition to that of the model
    moving: Flag  # a drive has been applied
    inverse: Flag  # whether it is the inverse operator


class ChainState(NamedTuple):
    """One instance. `corners`: the plays in engine corners, `()` in engine loop, which keeps its plays in `plays`."""

    plays: State
    lost: Reals  # (n + 1,), rounding remainder of each play that a nonlinear dashpot moves
    bent: Reals  # (n + 1,), contribution of each play, if an effect moves or bends plays
    elements: Any  # memory of the elements in parallel with the plays
    blocks: tuple[Any, ...]  # memory of each of `parts.PARTS`
    counts: Counts  # of their blocks in this operator
    line: PreviewLine
    own: OwnState
    reached: RampState
    quiet: QuietState
    steady: SteadyState
    corners: Any
    kink: Reals  # (4,), in fixed point: the kink of the solution found by engine corners
    search: Any  # of the input of plays that an effect moves or bends


def new_state(t: ChainTables, inverse: bool) -> ChainState:
    """Memory for one instance of an operator; `init` sets it."""
    dtype = t.threshold.dtype
    parts = parts_with(*t.own_blocks) if isinstance(t, OwnChainTables) else PARTS
    verbs = [part.of(t).verbs for part in parts]
    corners = int(t.plays.engine == CORNERS)
    loops = loop.new_state(t.plays)
    return ChainState(
        loops._replace(play=loops.play[:0]) if corners else loops,
        np.zeros(len(t.threshold), dtype),
        np.zeros(len(t.threshold), dtype),
        t.moving.elements.memory(),
        tuple(each.memory(tables, dtype) for each, tables in zip(verbs, t.blocks, strict=True)),
        np.where([inverse and part.forward for part in parts], 0, t.counts),
        PreviewLine(np.zeros(len(t.tap), dtype), np.zeros(1, np.int64)),
        OwnState.of([(0, 0, 0, 0, inverse)], dtype),
        RampState.zeros(1, dtype),
        QuietState.zeros(1, dtype),
        SteadyState.of([(0, 0, 1)], dtype),
        t.plays.new_corners() if corners else (),
        np.zeros(4 * corners, dtype),
        (FixedSearchState if isinstance(t.moving, FixedMovingTables) else SearchState).zeros(1, dtype),
    )


class Conversions(NamedTuple):
    """Conversions of an operator's arguments into signals, and of signals into its answers, in one arithmetic."""

    finite: Check
    drive_signal: Answer
    arriving: Answer  # a signal as an input of the plays
    level_signal: Answer
    drive_code: Answer
    output_code: LimitedAnswer  # with status bits
    entered_travel: Answer  # a travel that verification sets
    shared: Answer  # a share of a signal


@jit(inline=True)
def same(t: object, x: Scalar, ascending: int) -> Scalar:  # noqa: ARG001  as with a memoryless part
    """x itself: there is no memoryless part."""
    return x


@jit(inline=True)
def same_inverse(t: object, x: Scalar, ascending: int) -> tuple[Scalar, int]:  # noqa: ARG001
    """x itself, which nothing limits."""
    return x, 0


def made_of(
    blocks: Blocks, codes: Conversions, contents: Contents, drives: tuple[OwnBlock, ...], outputs: tuple[OwnBlock, ...]
) -> Operations:
    """The operations of one operator of models with these contents in one arithmetic, with a user's own blocks in front
    of the plays and behind. Numba compiles no branch that a constant from outside the function excludes."""
    inverse, branches, maps, preview = contents.inverse, contents.branches, contents.maps, contents.preview
    slew, braking, quiet, turning = contents.slew, contents.braked, contents.quiet, contents.turning
    known = [blocks.verbs(part) for part in parts_with(drives, outputs)]
    every = [verbs if has else Verbs(verbs.memory) for verbs, has in zip(known, contents.parts, strict=True)]
    timed, aged = contents.parts[CLOCK], contents.parts[AGED]
    still, lagging = inverse and quiet, inverse and turning
    blocks_reset, blocks_tick, blocks_move = calling(every, "reset"), calling(every, "tick"), moves(every)
    clock: Any = known[CLOCK]  # has all of the verbs below
    clock_reset, clock_added, clock_lead, clock_ahead = clock.reset, clock.added, clock.lead, clock.ahead
    travelled_by = known[AGED].travelled
    assert travelled_by
    bent, unbent = blocks.bent
    preview_target = blocks.target
    front_forward, front_inverse = blocks.front if contents.front else (same, same_inverse)
    start, follow, started, inverse_input = blocks.moved if contents.moving else blocks.plays
    finer, braked, ramp = blocks.finer, blocks.braked, blocks.ramp
    led = known[LED].led
    assert led
    led_state, led_solve, led_kept, led_absorb, led_missed, *_ = led
    finite, drive_signal, arriving, level_signal, drive_code, output_code, entered_travel, shared = codes
    plays_init, plays_reset, arrive, _ = plays_of(front_forward, front_inverse, loop_output)

    sent_rest, sent_absorb = side_of(every, SENT, "rest", "absorb")
    drive_side_rest, drive_side_absorb, drive_side_solve = side_of(every, AHEAD, "rest", "absorb", "solve")
    output_side_rest, output_side_absorb = side_of(every, BEHIND, "rest", "absorb")
    output_side_resting, output_side_solve = side_of(every, BEHIND, "resting", "solve")

    @jit(inline=True)
    def displacement(t: ChainTables, s: ChainState, y: Scalar) -> Scalar:
        """The displacement: the result of the output side after saturation, plus the offsets."""
        offset: Scalar = t.number.output_offset[0] + s.own.offset[0]
        if timed:
            for j in range(s.counts[CLOCK]):
                offset = offset + clock_added(t.blocks[CLOCK], s.blocks[CLOCK], j)
        return (bent(t.behind, y) if maps else y) + offset

    @jit(inline=True)
    def undisplaced(t: ChainTables, s: ChainState, u: Scalar) -> tuple[Scalar, int]:
        """The result that the output side has to give for displacement u, and whether no such result exists."""
        offset = t.number.output_offset[0] + s.own.offset[0]
        if timed:
            for j in range(s.counts[CLOCK]):
                filled, moving = s.line.filled[0], s.own.moving[0]
                offset = offset + clock_ahead(t.blocks[CLOCK], s.blocks[CLOCK], j, filled, moving)
        y = u - offset
        limited = 0
        if maps:
            y, limited = unbent(t.behind, y)
        return y, limited

    @jit(inline=True)
    def settings_reset(t: ChainTables, s: ChainState) -> None:
        """Reset offset and gains to their values in the parameter file."""
        s.own.offset[0] = t.limits.zero[0]
        s.reached.drive[0] = t.limits.zero[0]
        s.reached.rest[0] = t.limits.zero[0]
        blocks_reset(t, s)

    @jit(inline=True)
    def travelled(t: ChainTables, s: ChainState, v: Scalar) -> None:
        """Move the drive from its last value to v, in one sample."""
        blocks_move(t, s, s.own.applied[0], v)

    # ---------------------------------------------------------------- chain_turn.c, chain_turn_late.c

    @jit(inline=True)
    def turns(t: ChainTables, back: Scalar, way: Scalar) -> bool:
        """Whether a drive that should go back by `back` turns to the other branch, which is `way` away. If it leads a
        lag, it turns only if holding misses by more than the lag would in the first sample of a turn over `way`."""
        missed = back - t.plays.limits.hold[0]
        if turning:
            return bool(missed > led_missed(t.blocks[LED], -way if way < 0 else way))
        return bool(missed > 0)

    # ---------------------------------------------------------------- chain_two_branches.c

    @jit
    def branch_drive(t: ChainTables, s: ChainState, w: Scalar) -> Scalar:
        """The drive that gives w on the branch of its own move: it stays on its branch while it moves on or holds, and
        turns only to go back by more than rounding."""
        up, drive = s.plays.step.ascending[0] if branches else 1, s.plays.step.drive[0]
        v, limited = front_inverse(t.plays, w, up)
        if branches:
            inside = clamp_drive(t.plays, v)
            back = drive - inside if up else inside - drive
            if back > 0:
                v, limited = front_inverse(t.plays, w, 1 - up)
                other = clamp_drive(t.plays, v)
                fits = other < drive if up else other > drive
                if not (fits and turns(t, back, other - inside)):
                    v = drive
        if limited:
            s.plays.step.bits[0] |= DOMAIN
        return v

    # ---------------------------------------------------------------- steady.c

    @jit
    def steady_rest(t: ChainTables, s: ChainState) -> None:
        """Record that the lag is at rest."""
        s.steady.way[0] = t.limits.zero[0]
        s.steady.moved[0] = t.limits.zero[0]
        s.steady.rises[0] = 1

    @jit
    def steady_drive(t: ChainTables, s: ChainState, a: Scalar) -> Scalar:
        """The drive that leads to a in front of two branches, with the lag arriving from the side of its branch."""
        s.steady.rises[0] = s.plays.step.ascending[0]
        if a > s.plays.step.drive[0]:
            s.steady.rises[0] = 1
        elif a < s.plays.step.drive[0]:
            s.steady.rises[0] = 0
        last = drive_signal(t, s.own.applied[0])
        moved, rises = s.steady.moved[0], s.steady.rises[0]
        v, s.steady.way[0] = led_solve(t.blocks[LED], s.blocks[LED], a, moved, rises, last, t.number.dither[0])
        return v

    @jit
    def steady_hold(t: ChainTables, s: ChainState, v: Scalar) -> Scalar:
        """The drive v, or a drive that keeps the lag on its branch."""
        last = drive_signal(t, s.own.applied[0])
        return led_kept(t.blocks[LED], s.blocks[LED], v, s.steady.rises[0], last, t.number.dither[0])

    # ---------------------------------------------------------------- quiet.c

    @jit
    def quiet_rest(t: ChainTables, s: ChainState, a: Scalar) -> None:
        """Record that everything is at rest with a in front of the plays."""
        s.quiet.arrived[0] = a
        s.quiet.reference[0] = t.limits.zero[0]
        s.quiet.equal[0] = 0

    @jit
    def quiet_count(t: ChainTables, s: ChainState, u: Scalar) -> None:
        """Count how many references in a row are equal, the next one being u."""
        if u != s.quiet.reference[0]:
            s.quiet.reference[0] = u
            s.quiet.equal[0] = 0
        if s.quiet.equal[0] <= t.quiet:
            s.quiet.equal[0] += 1

    @jit
    def quiet_drive(t: ChainTables, s: ChainState, a: Scalar, v: Scalar) -> Scalar:
        """The drive for a in front of the plays: v, which leads to a, or a drive that stands still."""
        most = t.number.dither[0]
        away = v - a
        if s.quiet.equal[0] > t.quiet:
            most = most + most
            away = a - s.quiet.arrived[0]
        if away > most or away < -most:
            s.quiet.equal[0] = 0
        if s.quiet.equal[0] < t.quiet:
            return v
        if s.quiet.equal[0] == t.quiet:
            return a
        last = drive_signal(t, s.own.applied[0])
        if a - last > t.number.dither[0] or last - a > t.number.dither[0]:
            return a
        return last

    # ---------------------------------------------------------------- chain.c

    @jit
    def expected(t: ChainTables, s: ChainState) -> Scalar:
        """The displacement that the model expects after the last absorbed drive."""
        code, _ = output_code(t, displacement(t, s, s.own.output[0]))
        return code

    @jit
    def begin(t: ChainTables, s: ChainState) -> None:
        """Bring everything to rest at the start memory, once the plays are set; shared by init and reset."""
        s.line.filled[0] = 0
        s.own.moving[0] = 0
        drive = s.plays.step.drive[0]
        s.plays.step.drive[0] = arriving(t, drive_signal(t, drive))
        s.own.applied[0] = drive
        a = drive_side_rest(t, s, drive_signal(t, drive))
        if lagging:
            steady_rest(t, s)
        if still:
            quiet_rest(t, s, a)
        s.plays.step.level[0] = started(t, s)
        s.own.output[0] = output_side_rest(t, s, s.plays.step.level[0])

    @jit
    def absorb(t: ChainTables, s: ChainState, v: Scalar, reached: Scalar) -> None:
        """Absorb drive v, which has become `reached` behind delay and slew limit; the first drive finds everything at
        rest."""
        moving = s.own.moving[0] != 0
        blocks_tick(t, s)
        if moving:
            travelled(t, s, v)
        x = drive_signal(t, reached)
        before = led_state(s.blocks[LED]) if lagging else t.limits.zero[0]
        a = drive_side_absorb(t, s, x) if moving else drive_side_rest(t, s, x)
        if lagging:
            if moving:
                led_absorb(s.blocks[LED], before)
                s.steady.moved[0] = s.steady.way[0]
                s.steady.way[0] = t.limits.zero[0]
            else:
                steady_rest(t, s)
        if still:
            s.quiet.arrived[0] = a
            if not moving:
                quiet_rest(t, s, a)
        h = follow(t, s, arrive(t.plays, s.plays, arriving(t, a)))
        s.plays.step.level[0] = h
        s.own.output[0] = output_side_absorb(t, s, h) if moving else output_side_rest(t, s, h)
        s.own.applied[0] = v
        s.own.moving[0] = 1

    # ---------------------------------------------------------------- chain_slew.c

    @jit
    def nearest_ramp(t: ChainTables, before: Scalar, rest: Scalar, v: Scalar) -> tuple[Scalar, Scalar]:
        """The drive nearest to v that the amplifier reaches in one step from `before` with rounding remainder `rest`,
        and the new drive's remainder."""
        if v > before or (v == before and rest < 0):
            drive, left = ramp(before, rest, t.number.slew_rising[0], t.number.slew_rising_rest[0])
            beyond = v > drive or (v == drive and left < 0)
        else:
            drive, left = ramp(before, rest, -t.number.slew_falling[0], -t.number.slew_falling_rest[0])
            beyond = v < drive or (v == drive and left > 0)
        return (drive, left) if beyond else (v, t.limits.zero[0])

    @jit
    def forward_slewed(t: ChainTables, s: ChainState, v: Scalar) -> Scalar:
        """The drive nearest to v that the amplifier reaches in one step; v itself in the first step."""
        before, rest = s.reached.drive[0], s.reached.rest[0]
        drive, left = nearest_ramp(t, before, rest, v) if s.own.moving[0] else (v, t.limits.zero[0])
        s.reached.drive[0], s.reached.rest[0] = drive, left
        return drive

    @jit
    def inverse_within(t: ChainTables, s: ChainState, v: Scalar) -> tuple[Scalar, Scalar]:
        """The drive nearest to v that the amplifier reaches in one step from the last applied drive, and its rounding
        remainder; the last drive keeps its own remainder if it was the answer."""
        rest = s.reached.rest[0] if s.own.applied[0] == s.reached.drive[0] else t.limits.zero[0]
        return nearest_ramp(t, s.own.applied[0], rest, v)

    @jit(inline=True)
    def last_answer(t: ChainTables, s: ChainState) -> Scalar:  # noqa: ARG001  as with a slew limit
        """The last answer again."""
        return s.plays.step.answer[0] if s.plays.step.stepped[0] else s.own.applied[0]

    @jit
    def inverse_held(t: ChainTables, s: ChainState) -> Scalar:
        """The last answer again, or the drive nearest to it that the amplifier reaches in one step."""
        last = last_answer(t, s)
        if not s.own.moving[0]:
            return last
        s.reached.drive[0], s.reached.rest[0] = inverse_within(t, s, last)
        if s.reached.drive[0] != last:
            s.plays.step.status[0] |= SLEW_LIMITED
        return s.reached.drive[0]

    # ---------------------------------------------------------------- chain_unbraked.c or one of chain_braked*.c

    @jit
    def inverse_slewed(t: ChainTables, s: ChainState, v: Scalar) -> Scalar:
        """The reachable drive nearest to v, or the one from which a lag does not overshoot."""
        if not s.own.moving[0]:
            return v
        near, rest = inverse_within(t, s, v)
        if braking and not (t.quiet and s.quiet.equal[0] >= t.quiet):
            drive = braked(t, s, v, near)
            if turning:
                drive = drive_code(t, steady_hold(t, s, drive_signal(t, drive)))
            near, rest = inverse_within(t, s, drive)
        s.reached.drive[0], s.reached.rest[0] = near, rest
        return near

    @jit(inline=True)
    def forward_absorb(t: ChainTables, s: ChainState, v: Scalar) -> None:
        """Absorb drive v, after the delay and the amplifier's slew limit."""
        late = sent_absorb(t, s, v) if s.own.moving[0] else sent_rest(t, s, v)
        reached = late
        if slew:
            reached = forward_slewed(t, s, late)
            if reached != late:
                s.plays.step.status[0] |= SLEW_LIMITED
        absorb(t, s, v, reached)

    @jit(inline=True)
    def plays_in(s: ChainState) -> State:
        """The memory of the step itself."""
        return s.plays

    @jit(inline=True)
    def shown(t: ChainTables, s: ChainState) -> tuple[Scalar, int]:
        """The present displacement, and its status."""
        return output_code(t, displacement(t, s, s.own.output[0]))

    @jit
    def inverse_put(t: ChainTables, s: ChainState, level: Scalar) -> Scalar:
        """Pass the next reference, already limited, through the preview if there is one. Returns the output to reach at
        this sample."""
        if quiet:
            quiet_count(t, s, level_signal(t, level))
        wanted, limited = undisplaced(t, s, level_signal(t, level))
        if limited:
            s.plays.step.status[0] |= DOMAIN
        if preview:
            if timed:
                for j in range(s.counts[CLOCK]):
                    clock_lead(t.blocks[CLOCK], s.blocks[CLOCK], j, s.line.filled[0])
            preview_put(s.line, wanted)
            return preview_target(t.tap, s.line)
        return wanted

    @jit(inline=True)
    def inverse_push(t: ChainTables, s: ChainState, u: Scalar) -> None:
        """Put the next reference into the preview without answering it."""
        if not finite(t, u):
            s.plays.step.status[0] |= HELD
            unread(t, s)
            return
        level = inverse_clamp(t, u)
        if level != u:
            s.plays.step.status[0] |= INPUT_CLAMPED
        inverse_put(t, s, level)

    @jit(inline=True)
    def unread(t: ChainTables, s: ChainState) -> None:  # noqa: ARG001  the same call for every chain
        """Repeat the newest reference of a preview instead of one that is not finite."""
        if preview:
            preview_repeat(s.line)

    @jit(inline=True)
    def stands(t: ChainTables, s: ChainState, u: Scalar) -> bool:  # noqa: ARG001
        """False: every reference needs a new answer, since time has passed for the effects."""
        return False

    @jit
    def inverse_sought(t: ChainTables, s: ChainState, level: Scalar) -> Scalar:
        """The drive for the limited reference `level`, within reach of a slew limit."""
        y = inverse_put(t, s, level)
        moving = s.own.moving[0] != 0
        h = output_side_solve(t, s, y) if moving else output_side_resting(t, s, y)
        s.plays.step.bits[0] = 0
        w = inverse_input(t, s, h)
        a = finer(t, s, h, w, branch_drive(t, s, w))
        v = a
        if moving:
            v = steady_drive(t, s, a) if turning else drive_side_solve(t, s, a)
            if quiet:
                v = quiet_drive(t, s, a, v)
        v = drive_code(t, v)
        if slew:
            reached = inverse_slewed(t, s, v)
            if reached != v:
                s.plays.step.bits[0] |= SLEW_LIMITED
            return reached
        return v

    @jit
    def put_offset(t: ChainTables, s: ChainState, d: Scalar) -> None:
        """Set the offset of the displacement, within its limits."""
        if not finite(t, d):
            s.plays.step.status[0] |= HELD
            return
        within = inside(d, -t.number.farthest_offset[0], t.number.farthest_offset[0])
        if within != d:
            s.plays.step.status[0] |= LIMITED_SETTING
        s.own.offset[0] = within

    @jit(inline=True)
    def set_offset(t: ChainTables, s: ChainState, d: Scalar) -> None:
        """Set the offset of the displacement, and restart drift."""
        put_offset(t, s, d)
        if timed and finite(t, d):
            for j in range(s.counts[CLOCK]):
                clock_reset(t.blocks[CLOCK], s.blocks[CLOCK], j)

    @jit(inline=True)
    def correct(t: ChainTables, s: ChainState, measured: Scalar, share: Scalar) -> None:
        """Trim the offset by a share of the difference between measured and expected displacement."""
        more = shared(t, share, level_signal(t, measured) - displacement(t, s, s.own.output[0]))
        put_offset(t, s, s.own.offset[0] + more)

    def setting(put: Check) -> Action:
        """A call that sets a number in the blocks through `put`."""

        @jit(inline=True)
        def set_number(t: ChainTables, s: ChainState, x: Scalar) -> None:
            """Set the number, within its limits."""
            if not finite(t, x):
                s.plays.step.status[0] |= HELD
            elif put(t, s, x):
                s.plays.step.status[0] |= LIMITED_SETTING

        return set_number

    set_gain, set_travel = (setting(told(every, f"set_{what}")) for what in ("gain", "travel"))
    put_column = told_of(every)

    @jit
    def set_column(t: ChainTables, s: ChainState, entry: int, x: Scalar) -> None:
        """Set a column by its index, -1 for the temperature, within its limits."""
        if not finite(t, x):
            s.plays.step.status[0] |= HELD
        elif put_column(t, s, entry, x):
            s.plays.step.status[0] |= LIMITED_SETTING

    @jit(inline=True)
    def start_at(t: ChainTables, s: ChainState, after: int) -> None:
        """Start from the present plays, after init (0) or reset (1)."""
        start(t, s, after)
        begin(t, s)
        if not inverse:
            s.plays.step.answer[0] = expected(t, s)

    @jit(inline=True)
    def init(t: ChainTables, s: ChainState) -> None:
        """Set the start memory of the parameter file, and its settings."""
        settings_reset(t, s)
        plays_init(t.plays, s.plays, inverse)
        start_at(t, s, 0)

    @jit(inline=True)
    def reset(t: ChainTables, s: ChainState) -> None:
        """Set all plays to 0 and clear the status; the caller makes the step of the reset."""
        plays_reset(t.plays, s.plays, inverse)
        start_at(t, s, 1)

    @jit(inline=True)
    def seen(t: ChainTables, s: ChainState, v: Scalar) -> None:
        """Absorb drive v in either operator."""
        if inverse:
            absorb(t, s, v, v)
        else:
            forward_absorb(t, s, v)

    @jit(inline=True)
    def settle(t: ChainTables, s: ChainState, v: Scalar) -> None:
        """Bring everything to rest at drive v; the plays move there as in any step."""
        if not finite(t, v):
            s.plays.step.status[0] |= HELD
            return
        inside = clamp_drive(t, v) + t.limits.zero[0]  # no drive is -0
        if inside != v:
            s.plays.step.status[0] |= INPUT_CLAMPED
        if s.own.moving[0]:
            travelled(t, s, inside)
        s.own.moving[0] = 0
        seen(t, s, inside)

    @jit
    def other(t: ChainTables, s: ChainState, call: int, x: Scalar) -> Scalar:
        """Run a call that only models with effects have. Returns its answer, or 0."""
        if call == OP_PUSH:
            inverse_push(t, s, x)
        elif call == OP_SETTLE:
            if s.plays.step.has_pending[0]:
                absorb(t, s, s.plays.step.pending[0], s.plays.step.pending[0])
                s.plays.step.has_pending[0] = 0
            settle(t, s, x)
        elif call == OP_OFFSET:
            set_offset(t, s, level_signal(t, x))
        elif call == OP_TEMPERATURE:
            set_column(t, s, -1, x)
        elif call == OP_GAIN:
            set_gain(t, s, x)
        elif call == OP_TRAVEL:
            set_travel(t, s, entered_travel(t, x))
        elif call == OP_TRAVELLED:
            if aged:
                return travelled_by(s.blocks[AGED], 0)
        elif call == OP_CORRECT:
            correct(t, s, x, t.number.share[0])
        elif call == OP_EXPECTED:
            return expected(t, s)
        elif call == OP_CARRY:
            project(t.plays, s.plays, arrive(t.plays, s.plays, s.plays.step.drive[0]))
            moving = s.own.moving[0]
            s.own.moving[0] = 0  # the plays, but no other block
            s.plays.step.level[0] = started(t, s)
            s.own.moving[0] = moving
        elif call >= OP_INFLUENCE:
            set_column(t, s, call - OP_INFLUENCE, x)
        return t.limits.zero[0]

    held = inverse_held if slew else last_answer
    return operations_of(
        inverse, init, reset, seen, Hooks(plays_in, finite, seen, shown, unread, held, stands, inverse_sought, other)
    )
