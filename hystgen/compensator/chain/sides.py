"""The two sides of the plays, in front of them and behind: the blocks of each part of the chain, part after part.

Blocks of the user's own come after the lag in front of the plays, and after creep behind them. All of these are linear
and time-invariant, so that their order makes no difference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from hystgen.basics.jit import jit
from hystgen.compensator.chain.layout import ChainTables
from hystgen.compensator.chain.parts import AHEAD, BEHIND, PARTS, SENT
from hystgen.effects.part import ChainPart, Function, Verbs


class Blocks(NamedTuple):
    """The blocks of a chain in one arithmetic, and functions."""

    verbs: Callable[[ChainPart], Verbs]
    bent: tuple[Function, Function]  # what saturates: forward, inverse
    target: Function  # of the preview's line
    front: tuple[Function, Function]  # forward, inverse
    plays: tuple[Function, Function, Function, Function]  # start, follow, started, inverse input
    finer: Function  # the signal in front of the plays, with bits below their input
    braked: Function  # the drive within reach from which a lag does not overshoot
    ramp: Function  # a drive at a limited rate one step later, and what rounding took from it


class Sides(NamedTuple):
    """Verbs of all blocks of a model, as functions of tables, state and a number."""

    sent_rest: Function
    sent_absorb: Function
    drive_rest: Function
    drive_absorb: Function
    drive_solve: Function
    output_rest: Function
    output_absorb: Function
    output_resting: Function
    output_solve: Function


def _then(first: Function, k: int, verb: Function) -> Function:
    """What `first` does, and then a verb by all blocks of part k, one after the other."""

    @jit
    def each(t: Any, s: Any, n: int, x: Any) -> Any:
        for j in range(n):
            x = verb(t, s, j, x)
        return x

    @jit(inline=True)
    def through(t: ChainTables, s: Any, x: Any) -> Any:
        return each(t.blocks[k], s.blocks[k], s.counts[k], first(t, s, x))

    return through


def _back(first: Function, k: int, verb: Function) -> Function:
    """The same from the last block to the first."""

    @jit
    def each(t: Any, s: Any, n: int, x: Any) -> Any:
        for j in range(n - 1, -1, -1):
            x = verb(t, s, j, x)
        return x

    @jit(inline=True)
    def through(t: ChainTables, s: Any, x: Any) -> Any:
        return each(t.blocks[k], s.blocks[k], s.counts[k], first(t, s, x))

    return through


@jit(inline=True)
def _nothing(t: ChainTables, s: Any, x: Any) -> Any:  # noqa: ARG001  as of any blocks
    """What no blocks make of x."""
    return x


def sides_of(every: Sequence[Verbs]) -> Sides:
    """The sides of a chain, with the verbs of all its parts."""

    def through(side: Sequence[ChainPart], verb: str) -> Function:
        back = verb in ("resting", "solve")
        places = [PARTS.index(part) for part in (reversed(side) if back else side)]
        found = [(k, function) for k in places if (function := every[k].verb(verb))]
        made: Function = _nothing
        for k, function in found:
            made = (_back if back else _then)(made, k, function)

        @jit
        def call(t: ChainTables, s: Any, x: Any) -> Any:
            return made(t, s, x)

        return call

    return Sides(
        *(through(SENT, verb) for verb in ("rest", "absorb")),
        *(through(AHEAD, verb) for verb in ("rest", "absorb", "solve")),
        *(through(BEHIND, verb) for verb in ("rest", "absorb", "resting", "solve")),
    )


def _all(every: Sequence[Verbs], verb: str, and_then: Function, nothing: Function) -> Function:
    """A verb by all blocks that have it, from `nothing` on by one part after the other."""
    for k, verbs in enumerate(every):
        if function := getattr(verbs, verb):
            nothing = and_then(nothing, k, function)
    return nothing


def told(every: Sequence[Verbs], verb: str) -> Function:
    """A verb with a number from the caller; whether any block had to limit it."""

    def and_then(first: Function, k: int, function: Function) -> Function:
        @jit
        def both(t: ChainTables, s: Any, x: Any) -> bool:
            limited = first(t, s, x)
            for j in range(s.counts[k]):
                limited = function(t.blocks[k], s.blocks[k], j, x) or limited
            return bool(limited)

        return both

    @jit(inline=True)
    def nothing(t: ChainTables, s: Any, x: Any) -> bool:  # noqa: ARG001  as of any blocks
        return False

    return _all(every, verb, and_then, nothing)


def resetting(every: Sequence[Verbs]) -> Function:
    """All blocks as in the parameter file."""

    def and_then(first: Function, k: int, function: Function) -> Function:
        @jit
        def both(t: ChainTables, s: Any) -> None:
            first(t, s)
            for j in range(s.counts[k]):
                function(t.blocks[k], s.blocks[k], j)

        return both

    @jit(inline=True)
    def nothing(t: ChainTables, s: Any) -> None:
        """No block has a setting."""

    return _all(every, "reset", and_then, nothing)


def moves(every: Sequence[Verbs]) -> Function:
    """All blocks that see how the drive moves, as it does."""

    def and_then(first: Function, k: int, function: Function) -> Function:
        @jit
        def both(t: ChainTables, s: Any, before: Any, v: Any) -> None:
            first(t, s, before, v)
            for j in range(s.counts[k]):
                function(t.blocks[k], s.blocks[k], j, before, v)

        return both

    @jit(inline=True)
    def nothing(t: ChainTables, s: Any, before: Any, v: Any) -> None:
        """No block sees it."""

    return _all(every, "move", and_then, nothing)
