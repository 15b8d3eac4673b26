"""Operators of plays in any arithmetic: `chain_plays.c`, `chain_relaxing.c`, `chain_moving.c` and `moved_*.c`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from hystgen.basics.jit import jit
from hystgen.compensator.chain.layout import ChainTables
from hystgen.compensator.chain.moving import DASHPOT, DILATED, PLAIN, RELAXING, STRAIGHT, stretch
from hystgen.compensator.chain.step import ChainState
from hystgen.plays.loop import State, loop_absorb, loop_output
from hystgen.plays.slots import Reals, zero

Function = Callable[..., Any]


class Kind(NamedTuple):
    """The functions in which arithmetics differ; `m` are the `moving` tables, `plays` those of plain plays."""

    level: Function  # of chain tables and a sum: the signal
    asked: Function  # of chain tables and a signal: the sum of the plays asked for
    solve: Function  # of plays, state and a sum: as engine loop
    relaxing_follow: Function  # of m, plays, state and w
    relaxing_input: Function  # of m, plays, state and a sum
    share_of: Function  # of factors, i and x: x times factor i
    yields: Function  # of m and a stretch, not negative: its yield in a step
    seen: Function  # of m and a way: the part of it at which the input counts as standing still
    moved_by: Function  # of m and a yield: the move of a play
    yield_of: Function  # of m and the move of a play: the yield
    bent: Function  # of m, plays, i and z
    search: Callable[[Function], Function]  # of a function from input to sum: the function that finds the input


def movement(kind: Kind) -> tuple[Function, Function, Function]:
    """`moved`, `move` and `put` of single plays, as in `moved.c` and `dashpot.c` of `effects/rate_dependence/`."""
    share_of, yields, seen, moved_by, yield_of = kind.share_of, kind.yields, kind.seen, kind.moved_by, kind.yield_of

    @jit
    def change(m: Any, r: Reals, i: int, s: State, lost: Reals, w: Any) -> Any:
        """Move, as a yield, of play i with a nonlinear dashpot while the input of the plays goes to w."""
        x = s.play[0] + seen(m, w - s.play[0]) - s.play[i]
        gained = zero(x)
        if x > r[i]:
            gained = yields(m, x - r[i])
        elif x < -r[i]:
            gained = -yields(m, -x - r[i])
        return gained + lost[i]

    @jit
    def moved(m: Any, r: Reals, i: int, s: State, lost: Reals, w: Any) -> Any:
        """Play i after the input of the plays has gone to w."""
        q = s.play[i]
        if m.moves == DASHPOT:
            return q + moved_by(m, change(m, r, i, s, lost, w))
        if m.moves == RELAXING:
            return q + share_of(m.first, i, stretch(w - q, r[i]))
        threshold = r[i]
        if m.moves == DILATED:
            before = s.play[0]
            way = w - before if w > before else before - w
            threshold = r[i] + share_of(m.first, i, way)
        low = w - threshold
        high = w + threshold
        upper = high if q > high else q
        return low if upper < low else upper

    @jit
    def move(m: Any, r: Reals, i: int, s: State, lost: Reals, w: Any) -> None:
        """Move play i while the input of the plays goes to w."""
        if m.moves == DASHPOT:
            gained = change(m, r, i, s, lost, w)
            z = s.play[i] + moved_by(m, gained)
            lost[i] = gained - yield_of(m, z - s.play[i])
            s.play[i] = z
        else:
            s.play[i] = moved(m, r, i, s, lost, w)

    @jit
    def put(m: Any, i: int, s: State, lost: Reals, z: Any) -> None:
        """Put play i to rest at z."""
        if m.moves == DASHPOT:
            lost[i] = zero(lost[i])
        s.play[i] = z

    return moved, move, put


def operators(kind: Kind) -> tuple[Function, Function, Function, Function]:
    """`start`, `follow`, `started` and `inverse_input` of models with effects, as functions of tables, state and a
    number."""
    level, asked, solve, bent = kind.level, kind.asked, kind.solve, kind.bent
    relaxing_follow, relaxing_input = kind.relaxing_follow, kind.relaxing_input
    share_of = kind.share_of
    moved, move, put = movement(kind)

    @jit
    def moved_sum(m: Any, plays: Any, s: State, lost: Reals, values: Reals, w: Any) -> Any:
        """The sum of the plays after their input has gone to w."""
        r, p = plays.threshold, plays.weight
        total = p[0] * w
        for i in range(1, len(r)):
            z = moved(m, r, i, s, lost, w)
            total = total + p[i] * (values[i] if z == s.play[i] else bent(m, plays, i, z))
        return total

    @jit
    def moved_follow(m: Any, plays: Any, s: State, lost: Reals, values: Reals, w: Any) -> Any:
        """Move the plays while their input goes to w. Returns their sum."""
        r, p = plays.threshold, plays.weight
        total = p[0] * w
        for i in range(1, len(r)):
            before = s.play[i]
            move(m, r, i, s, lost, w)
            if s.play[i] != before:
                values[i] = bent(m, plays, i, s.play[i])
            total = total + p[i] * values[i]
        s.play[0] = w
        return total

    @jit
    def relax(m: Any, plays: Any, s: State, values: Reals) -> None:
        """Move the plays to where they would rest with their input held, as seen one step later."""
        if m.moves != RELAXING:
            return
        for i in range(1, len(plays.threshold)):
            rest = s.play[i] + share_of(m.second, i, stretch(s.play[0] - s.play[i], plays.threshold[i]))
            if rest != s.play[i]:
                s.play[i] = rest
                values[i] = bent(m, plays, i, rest)

    @jit
    def resting(r: Reals, s: State, i: int, w: Any) -> Any:
        """Play i at rest with its input at w."""
        low = w - r[i]
        high = w + r[i]
        upper = high if s.play[i] > high else s.play[i]
        return low if upper < low else upper

    @jit
    def resting_sum(m: Any, plays: Any, s: State, values: Reals, w: Any) -> Any:
        """The sum of the plays if they came to rest with their input at w."""
        r, p = plays.threshold, plays.weight
        total = p[0] * w
        for i in range(1, len(r)):
            z = resting(r, s, i, w)
            total = total + p[i] * (values[i] if z == s.play[i] else bent(m, plays, i, z))
        return total

    @jit
    def moved_rest(m: Any, plays: Any, s: State, lost: Reals, values: Reals, w: Any) -> Any:
        """Bring the plays to rest with their input at w. Returns their sum."""
        r, p = plays.threshold, plays.weight
        total = p[0] * w
        for i in range(1, len(r)):
            put(m, i, s, lost, resting(r, s, i, w))
            values[i] = bent(m, plays, i, s.play[i])
            total = total + p[i] * values[i]
        s.play[0] = w
        return total

    @jit
    def sum_at(t: ChainTables, s: ChainState, w: Any) -> Any:
        """The sum of the plays with their input at w."""
        if s.own.moving[0]:
            return moved_sum(t.moving, t.plays, s.plays, s.lost, s.bent, w)
        return resting_sum(t.moving, t.plays, s.plays, s.bent, w)

    searched = kind.search(sum_at)

    @jit(inline=True)
    def start(t: ChainTables, s: ChainState, zero: int) -> None:
        """Set the plays to the start memory, or all to 0, as `step.plays_of` does."""

    @jit
    def follow(t: ChainTables, s: ChainState, w: Any) -> Any:
        """Move the plays with their input w. Returns their sum."""
        m = t.moving
        if m.moves == PLAIN and m.bends == STRAIGHT:
            loop_absorb(t.plays, s.plays, w)
            return level(t, loop_output(t.plays, s.plays))
        if m.scanned:
            if s.own.moving[0]:
                return level(t, relaxing_follow(m, t.plays, s.plays, w))
            loop_absorb(t.plays, s.plays, w)
            return level(t, loop_output(t.plays, s.plays))
        if s.own.moving[0]:
            total = moved_follow(m, t.plays, s.plays, s.lost, s.bent, w)
            relax(m, t.plays, s.plays, s.bent)
            return level(t, total)
        return level(t, moved_rest(m, t.plays, s.plays, s.lost, s.bent, w))

    @jit
    def started(t: ChainTables, s: ChainState) -> Any:
        """The sum of the plays in the start memory."""
        m = t.moving
        if m.scanned or (m.moves == PLAIN and m.bends == STRAIGHT):
            return level(t, loop_output(t.plays, s.plays))
        return level(t, moved_rest(m, t.plays, s.plays, s.lost, s.bent, s.plays.play[0]))

    @jit
    def inverse_input(t: ChainTables, s: ChainState, h: Any) -> Any:
        """Input of the plays at which their sum is h."""
        m = t.moving
        total = asked(t, h)
        if m.moves == PLAIN and m.bends == STRAIGHT:
            return solve(t.plays, s.plays, total)
        if m.scanned:
            if s.own.moving[0]:
                return relaxing_input(m, t.plays, s.plays, total)
            return solve(t.plays, s.plays, total)
        return searched(t, s, total)

    return start, follow, started, inverse_input
