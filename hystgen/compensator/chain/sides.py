"""The two sides of the plays, in front of them and behind: the blocks of each part of the chain, part by part.

A user's own blocks come after the lag in front of the plays, and after creep behind them. All of these are linear and
time-invariant, so their order makes no difference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from hystgen.basics.jit import jit
from hystgen.compensator.chain.layout import ChainTables
from hystgen.compensator.chain.parts import AHEAD, BEHIND, PARTS, SENT
from hystgen.effects.part import ChainPart, Function, Verbs


class Blocks(NamedTuple):
    """The functions of a chain and its blocks in one arithmetic."""

    verbs: Callable[[ChainPart], Verbs]
    bent: tuple[Function, Function]  # maps of the output: forward, inverse
    target: Function  # the output to reach, from the preview's line
    front: tuple[Function, Function]  # forward, inverse
    plays: tuple[Function, Function, Function, Function]  # start, follow, started, inverse input
    finer: Function  # the signal in front of the plays, with bits below their input
    braked: Function  # the drive in reach that keeps a lag from overshooting
    ramp: Function  # a slew-limited drive one step later, and its rounding remainder


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
    """Apply `first`, then a verb of all blocks of part k in series."""

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
    """As `_then`, from the last block to the first."""

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
def _nothing(t: ChainTables, s: Any, x: Any) -> Any:  # noqa: ARG001  as with blocks
    """Return x itself: there are no blocks."""
    return x


def sides_of(every: Sequence[Verbs]) -> Sides:
    """The sides of a chain, from the verbs of all its parts."""

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
    """A verb of all blocks that have it, part by part, after `nothing`."""
    for k, verbs in enumerate(every):
        if function := getattr(verbs, verb):
            nothing = and_then(nothing, k, function)
    return nothing


def told(every: Sequence[Verbs], verb: str) -> Function:
    """A verb that takes a number from the caller; it returns whether any block had to limit that number."""

    def and_then(first: Function, k: int, function: Function) -> Function:
        @jit
        def both(t: ChainTables, s: Any, x: Any) -> bool:
            limited = first(t, s, x)
            for j in range(s.counts[k]):
                limited = function(t.blocks[k], s.blocks[k], j, x) or limited
            return bool(limited)

        return both

    @jit(inline=True)
    def nothing(t: ChainTables, s: Any, x: Any) -> bool:  # noqa: ARG001  as with blocks
        return False

    return _all(every, verb, and_then, nothing)


def resetting(every: Sequence[Verbs]) -> Function:
    """Reset all blocks to their values in the parameter file."""

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
    """Pass a move of the drive on to all blocks that see it."""

    def and_then(first: Function, k: int, function: Function) -> Function:
        @jit
        def both(t: ChainTables, s: Any, before: Any, v: Any) -> None:
            first(t, s, before, v)
            for j in range(s.counts[k]):
                function(t.blocks[k], s.blocks[k], j, before, v)

        return both

    @jit(inline=True)
    def nothing(t: ChainTables, s: Any, before: Any, v: Any) -> None:
        """No block sees the move."""

    return _all(every, "move", and_then, nothing)
