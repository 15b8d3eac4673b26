"""Operators of plays in any arithmetic, from the functions of the effects that move and bend them: `moving_plays.c`."""

from __future__ import annotations

from typing import Any, NamedTuple

from hystgen.basics.jit import Answer, Scalar, jit
from hystgen.compensator.chain.layout import ChainTables
from hystgen.compensator.chain.step import ChainState
from hystgen.effects.part import Function
from hystgen.effects.plays import RELAXING, Bending, Elements, Moves
from hystgen.plays.loop import State, loop_absorb, loop_output
from hystgen.plays.slots import Reals


class Kind(NamedTuple):
    """The functions in which arithmetics differ."""

    level: Function  # of chain tables and a sum: the signal
    asked: Function  # of chain tables and a signal: the sum of the plays asked for
    solve: Function  # of plays, state and a sum: as engine loop
    moves: Moves  # plays that an effect moves
    bends: Bending  # plays that an effect bends
    elements: Elements  # those in parallel with the plays
    search: Function  # of `sum_at`, `tried_at`, `alike` and `slope_at` below: the function that finds the input
    begin: Function  # of state and weights: sets the slope or rate with which the first search begins
    found: Function  # of moving tables, state and input: whether a search has just led there; forgets it
    turned: Function  # of tables and state: sets the same right after elements have turned
    ordered: Function  # of moving tables: whether a sum assumes that plays behind the first stationary one are too


@jit(inline=True)
def start(t: ChainTables, s: ChainState, zero: int) -> None:
    """Set the plays to the start memory, or all to 0, as `step.plays_of` does."""


def unmoved(kind: Kind) -> tuple[Function, Function, Function, Function]:
    """`start`, `follow`, `started` and `inverse_input` of models whose effects neither move nor bend plays, nor join
    them, as functions of tables, state and a number."""
    level: Answer = kind.level
    solve: Answer = kind.solve
    asked = kind.asked

    @jit
    def follow(t: ChainTables, s: ChainState, w: Scalar) -> Scalar:
        """Move the plays with their input w. Returns their sum."""
        loop_absorb(t.plays, s.plays, w)
        return level(t, loop_output(t.plays, s.plays))

    @jit(inline=True)
    def started(t: ChainTables, s: ChainState) -> Scalar:
        """The sum of the plays in the start memory."""
        return level(t, loop_output(t.plays, s.plays))

    @jit(inline=True)
    def inverse_input(t: ChainTables, s: ChainState, h: Scalar) -> Scalar:
        """Input of the plays at which their sum is h."""
        return solve(t.plays, s.plays, asked(t, h))

    return start, follow, started, inverse_input


def operators(kind: Kind) -> tuple[Function, Function, Function, Function]:
    """The same functions for models with an effect that moves, bends or joins plays."""
    level, asked, solve, moves, (bent, steep), (joined, turn, unload), search, begin, found, turned, ordered = kind
    moved, move, put, rests, relaxing_follow, relaxing_input, tried = moves

    @jit
    def resting(r: Reals, s: State, i: int, w: Scalar) -> Scalar:
        """Play i at rest with its input at w."""
        low = w - r[i]
        high = w + r[i]
        upper = high if s.play[i] > high else s.play[i]
        return low if upper < low else upper

    @jit
    def sum_at(t: ChainTables, s: ChainState, w: Scalar) -> Any:
        """The sum of the plays with their input at w, moved there or at rest."""
        m, plays, play = t.moving, t.plays, s.plays.play
        r, p = plays.threshold, plays.weight
        total = p[0] * w
        for i in range(1, len(r)):
            z = moved(m, r, i, s.plays, s.lost, w) if s.own.moving[0] else resting(r, s.plays, i, w)
            total = total + p[i] * (s.bent[i] if z == play[i] else bent(m, plays, i, z))
        if len(m.elements.element) > 0 and s.own.moving[0]:
            more, _ = joined(m.elements, s.elements, w)
            total = total + more
        return total

    @jit
    def tried_at(t: ChainTables, s: ChainState, w: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """The same sum, its slope in w, and its slope in steady motion, in which moving plays follow fully."""
        m, plays = t.moving, t.plays
        r, p = plays.threshold, plays.weight
        total = p[0] * w
        slope = p[0]
        steady = p[0]
        follows = True
        for i in range(1, len(r)):
            if follows:
                moves, z, share = tried(m, r, i, s.plays, s.lost, s.own.moving[0], w)
                if moves:
                    value, change = steep(m, plays, i, z)
                    more = p[i] * change
                    total = total + p[i] * value
                    steady = steady + more
                    slope = slope + more * share
                    continue
                follows = not ordered(m)
            total = total + p[i] * s.bent[i]
        if len(m.elements.element) > 0 and s.own.moving[0]:
            more, steeper = joined(m.elements, s.elements, w)
            total = total + more
            steady = steady + steeper
            slope = slope + steeper
        return total, slope, steady

    @jit
    def elements_follow(m: Any, s: ChainState, w: Scalar) -> bool:
        """Turn the elements in parallel with the plays if their input, on its way to w, turns. Returns whether they
        do."""
        if len(m.elements.element) == 0:
            return False
        before = s.plays.play[0]
        turns = w != before and (w > before) != (s.elements.upward[0] == 1)
        if turns:
            turn(m.elements, s.elements, before)
        return bool(turns)

    @jit
    def moved_follow(m: Any, plays: Any, s: State, lost: Reals, values: Reals, w: Scalar) -> Any:
        """Move the plays while their input goes to w. Returns their sum."""
        r, p = plays.threshold, plays.weight
        total = p[0] * w
        follows = True
        for i in range(1, len(r)):
            if follows:
                if move(m, r, i, s, lost, w):
                    values[i] = bent(m, plays, i, s.play[i])
                else:
                    follows = not ordered(m)
            total = total + p[i] * values[i]
        s.play[0] = w
        return total

    @jit
    def relax(m: Any, plays: Any, s: State, values: Reals) -> None:
        """Move relaxing plays on towards rest with their input held; the next step starts from there."""
        if m.moves != RELAXING:
            return
        for i in range(1, len(plays.threshold)):
            rest = rests(m, plays.threshold, i, s)
            if rest != s.play[i]:
                s.play[i] = rest
                values[i] = bent(m, plays, i, rest)

    @jit
    def moved_rest(t: ChainTables, s: ChainState, w: Scalar) -> Any:
        """Bring the plays to rest with their input at w. Returns their sum. In memory is set the slope, or in fixed
        point the rate, with which a search begins."""
        m, plays, play = t.moving, t.plays, s.plays.play
        if len(m.elements.element) > 0:
            unload(m.elements, s.elements, w)
            found(m, s, w)
        r, p = plays.threshold, plays.weight
        total = p[0] * w
        begin(s, p)
        for i in range(1, len(r)):
            put(m, i, s.plays, s.lost, resting(r, s.plays, i, w))
            s.bent[i] = bent(m, plays, i, play[i])
            total = total + p[i] * s.bent[i]
        play[0] = w
        return total

    @jit
    def follows(t: ChainTables, s: ChainState, i: int, w: Scalar) -> bool:
        """Whether plain play i moves with the input at w; beyond the last play, none does."""
        r, play = t.plays.threshold, s.plays.play
        return i < len(r) and resting(r, s.plays, i, w) != play[i]

    @jit
    def alike(t: ChainTables, s: ChainState, w: Scalar, other: Scalar) -> bool:
        """Whether the same plain plays move to either input; they do so in the order of their thresholds."""
        first = 1
        while follows(t, s, first, w):
            first += 1
        return (first == 1 or follows(t, s, first - 1, other)) and not follows(t, s, first, other)

    @jit
    def slope_at(t: ChainTables, s: ChainState, w: Scalar) -> Scalar:
        """In fixed point, the slope of the sum of plain plays and elements at the input tried last, w."""
        slope: Scalar = t.plays.weight[0] + s.elements.slope[0]
        i = 1
        while follows(t, s, i, w):
            slope = slope + t.plays.weight[i]
            i += 1
        return slope

    searched = search(sum_at, tried_at, alike, slope_at)

    @jit
    def follow(t: ChainTables, s: ChainState, w: Scalar) -> Any:
        """Move the plays with their input w. Returns their sum."""
        m = t.moving
        if m.scanned:
            if s.own.moving[0]:
                return level(t, relaxing_follow(m, t.plays, s.plays, w))
            loop_absorb(t.plays, s.plays, w)
            return level(t, loop_output(t.plays, s.plays))
        if s.own.moving[0]:
            turns = elements_follow(m, s, w)
            total = moved_follow(m, t.plays, s.plays, s.lost, s.bent, w)
            summed = level(t, total)
            if len(m.elements.element) > 0:
                known = found(m, s, w) and not turns
                summed = s.elements.asked[0] if known else level(t, total + joined(m.elements, s.elements, w)[0])
            relax(m, t.plays, s.plays, s.bent)
            return summed
        return level(t, moved_rest(t, s, w))

    @jit
    def started(t: ChainTables, s: ChainState) -> Any:
        """The sum of the plays in the start memory."""
        m = t.moving
        if m.scanned:
            return level(t, loop_output(t.plays, s.plays))
        return level(t, moved_rest(t, s, s.plays.play[0]))

    @jit
    def inverse_input(t: ChainTables, s: ChainState, h: Scalar) -> Any:
        """Input of the plays at which their sum is h."""
        m = t.moving
        total = asked(t, h)
        if m.scanned:
            if s.own.moving[0]:
                return relaxing_input(m, t.plays, s.plays, total)
            return solve(t.plays, s.plays, total)
        here = s.plays.step.level[0]
        if len(m.elements.element) > 0 and s.own.moving[0] and h != here and (h > here) != (s.elements.upward[0] == 1):
            turn(m.elements, s.elements, s.plays.play[0])
            turned(t, s)
        return searched(t, s, total)

    return start, follow, started, inverse_input
