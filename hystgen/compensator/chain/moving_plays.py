"""Operators of plays in any arithmetic: `c_runtime/chain_plays.c`, `chain_relaxing.c` and `chain_moving.c`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from hystgen.basics.jit import jit
from hystgen.compensator.chain.layout import ChainTables
from hystgen.compensator.chain.moving import PLAIN, STRAIGHT
from hystgen.compensator.chain.step import MOVING, ChainState
from hystgen.plays.loop import State, loop_absorb, loop_output
from hystgen.plays.slots import Reals

Function = Callable[..., Any]


class Kind(NamedTuple):
    """What plays do in one arithmetic; `m` are the `moving` tables, `plays` those of plain plays."""

    level: Function  # of chain tables and a sum: that as a signal
    asked: Function  # of chain tables and a signal: the sum that it asks of the plays
    solve: Function  # of plays, state and a sum: as engine loop
    relaxing_follow: Function  # of m, plays, state and w
    relaxing_input: Function  # of m, plays, state and a sum
    moved: Function  # of m, r, i, state, lost and w
    left: Function  # of m, r, i, z and w
    keep: Function  # of m, r, i, state, lost, w and z
    put: Function  # of m, r, i, state, lost and z
    bent: Function  # of m, plays, i and z
    search: Callable[[Function], Function]  # of a function that gives the sum at an input: that finds the input


def operators(kind: Kind) -> tuple[Function, Function, Function]:
    """`follow`, `started` and `inverse_input` of models with effects, of their tables, their state and a number."""
    level, asked, solve, relaxing_follow, relaxing_input, moved, left, keep, put, bent, search = kind

    @jit
    def moved_sum(m: Any, plays: Any, s: State, lost: Reals, values: Reals, w: Any) -> Any:
        """What the plays give once their input has gone to w."""
        r, p = plays.threshold, plays.weight
        total = p[0] * w
        for i in range(1, len(r)):
            z = moved(m, r, i, s, lost, w)
            total = total + p[i] * (values[i] if z == s.play[i] else bent(m, plays, i, z))
        return total

    @jit
    def moved_follow(m: Any, plays: Any, s: State, lost: Reals, values: Reals, w: Any) -> Any:
        """The plays follow their input w; their sum."""
        r, p = plays.threshold, plays.weight
        total = p[0] * w
        for i in range(1, len(r)):
            z = moved(m, r, i, s, lost, w)
            rest = left(m, r, i, z, w)
            value = values[i] if z == s.play[i] else bent(m, plays, i, z)
            total = total + p[i] * value
            values[i] = value if rest == z else bent(m, plays, i, rest)
            keep(m, r, i, s, lost, w, rest)
        s.play[0] = w
        return total

    @jit
    def resting(r: Reals, s: State, i: int, w: Any) -> Any:
        """Play i at rest with its input at w."""
        low = w - r[i]
        high = w + r[i]
        upper = high if s.play[i] > high else s.play[i]
        return low if upper < low else upper

    @jit
    def resting_sum(m: Any, plays: Any, s: State, w: Any) -> Any:
        """What rest at an input w gives."""
        r, p = plays.threshold, plays.weight
        total = p[0] * w
        for i in range(1, len(r)):
            total = total + p[i] * bent(m, plays, i, resting(r, s, i, w))
        return total

    @jit
    def moved_rest(m: Any, plays: Any, s: State, lost: Reals, values: Reals, w: Any) -> Any:
        """The plays at rest with their input at w; their sum."""
        r, p = plays.threshold, plays.weight
        total = p[0] * w
        for i in range(1, len(r)):
            put(m, r, i, s, lost, resting(r, s, i, w))
            values[i] = bent(m, plays, i, s.play[i])
            total = total + p[i] * values[i]
        s.play[0] = w
        return total

    @jit
    def sum_at(t: ChainTables, s: ChainState, w: Any) -> Any:
        """What the plays give with their input at w."""
        if s.flags[MOVING]:
            return moved_sum(t.moving, t.plays, s.plays, s.lost, s.bent, w)
        return resting_sum(t.moving, t.plays, s.plays, w)

    searched = search(sum_at)

    @jit
    def follow(t: ChainTables, s: ChainState, w: Any) -> Any:
        """The plays follow their input w; their sum."""
        m = t.moving
        if m.moves == PLAIN and m.bends == STRAIGHT:
            loop_absorb(t.plays, s.plays, w)
            return level(t, loop_output(t.plays, s.plays))
        if m.scanned:
            if s.flags[MOVING]:
                return level(t, relaxing_follow(m, t.plays, s.plays, w))
            loop_absorb(t.plays, s.plays, w)
            return level(t, loop_output(t.plays, s.plays))
        if s.flags[MOVING]:
            return level(t, moved_follow(m, t.plays, s.plays, s.lost, s.bent, w))
        return level(t, moved_rest(m, t.plays, s.plays, s.lost, s.bent, w))

    @jit
    def started(t: ChainTables, s: ChainState) -> Any:
        """The sum of the plays as they are set."""
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
            if s.flags[MOVING]:
                return relaxing_input(m, t.plays, s.plays, total)
            return solve(t.plays, s.plays, total)
        return searched(t, s, total)

    return follow, started, inverse_input
