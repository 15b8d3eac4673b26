"""The two sides of the plays, in front of them and behind: the blocks of the chain, part by part.

A user's own blocks come after the lag in front of the plays, and after creep behind them. All of these are linear and
time-invariant, so their order does not matter.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, Protocol, TypeVar

from hystgen.basics.jit import Action, Answer, Check, LimitedAnswer, Scalar, jit
from hystgen.compensator.chain.layout import ChainTables
from hystgen.compensator.chain.parts import PARTS
from hystgen.effects.part import ChainPart, Verbs
from hystgen.plays.slots import Counts

F = TypeVar("F", Action, Check)


class Blocks(NamedTuple):
    """The functions of a chain and its blocks in one arithmetic."""

    verbs: Callable[[ChainPart], Verbs]
    bent: tuple[Answer, LimitedAnswer]  # maps of the output: forward, inverse
    target: Answer  # the output to reach, from the preview's line
    front: tuple[Answer, LimitedAnswer]  # forward, inverse
    plays: tuple[Action, Answer, Answer, Answer]  # start, follow, started, inverse input
    moved: tuple[Action, Answer, Answer, Answer]  # the same if an effect moves or bends plays
    finer: Answer  # the signal in front of the plays, with bits below their input
    braked: Answer  # the reachable drive that keeps a lag from overshooting
    ramp: Callable[..., tuple[Scalar, Scalar]]  # a slew-limited drive one step later, and its rounding remainder


class BlockMemory(Protocol):
    """The memory of a chain's blocks, part by part, and how many of them this operator has."""

    @property
    def blocks(self) -> tuple[object, ...]: ...
    @property
    def counts(self) -> Counts: ...


def _then(first: Answer, k: int, verb: Answer, back: bool) -> Answer:
    """A function that applies `first`, then a verb of all blocks of part k in series, from the last if `back`."""

    @jit(inline=True)
    def through(t: ChainTables, s: BlockMemory, x: Scalar) -> Scalar:
        x = first(t, s, x)
        n = s.counts[k]
        for j in range(n):
            x = verb(t.blocks[k], s.blocks[k], n - 1 - j if back else j, x)
        return x

    return through


@jit(inline=True)
def _nothing(t: ChainTables, s: BlockMemory, x: Scalar) -> Scalar:  # noqa: ARG001  as with blocks
    """Return x itself: there are no blocks."""
    return x


def side_of(every: Sequence[Verbs], side: Sequence[ChainPart], *verbs: str) -> Iterator[Answer]:
    """The given verbs for all blocks on one side, as functions of tables, state and a number."""

    def through(verb: str) -> Answer:
        back = verb in ("resting", "solve")
        places = [PARTS.index(part) for part in (reversed(side) if back else side)]
        found = [(k, function) for k in places if (function := every[k].verb(verb))]
        if not found:
            return _nothing
        made: Answer = _nothing
        for k, function in found:
            made = _then(made, k, function, back)

        @jit
        def call(t: ChainTables, s: BlockMemory, x: Scalar) -> Scalar:
            return made(t, s, x)

        return call

    return map(through, verbs)


def _all(every: Sequence[Verbs], verb: str, and_then: Callable[[F, int, F], F], nothing: F) -> F:
    """A verb of all blocks that have it, part by part, starting with `nothing`."""
    for k, verbs in enumerate(every):
        if function := getattr(verbs, verb):
            nothing = and_then(nothing, k, function)
    return nothing


def told(every: Sequence[Verbs], verb: str) -> Check:
    """A verb that passes a number from the caller to all blocks, and returns whether any of them had to limit it."""

    def and_then(first: Check, k: int, function: Check) -> Check:
        @jit(inline=True)
        def both(t: ChainTables, s: BlockMemory, x: Scalar) -> bool:
            limited = first(t, s, x)
            for j in range(s.counts[k]):
                limited = function(t.blocks[k], s.blocks[k], j, x) or limited
            return bool(limited)

        return both

    @jit(inline=True)
    def nothing(t: ChainTables, s: BlockMemory, x: Scalar) -> bool:  # noqa: ARG001  as with blocks
        return False

    return _all(every, verb, and_then, nothing)


def told_of(every: Sequence[Verbs]) -> Callable[..., bool]:
    """A function that passes the value of a column, by its index, to all blocks, and returns whether any of them had to
    limit it."""

    def and_then(first: Any, k: int, function: Any) -> Any:
        @jit(inline=True)
        def both(t: ChainTables, s: BlockMemory, entry: int, x: Scalar) -> bool:
            limited = first(t, s, entry, x)
            for j in range(s.counts[k]):
                limited = function(t.blocks[k], s.blocks[k], j, entry, x) or limited
            return bool(limited)

        return both

    @jit(inline=True)
    def nothing(t: ChainTables, s: BlockMemory, entry: int, x: Scalar) -> bool:  # noqa: ARG001  as with blocks
        return False

    return _all(every, "set_column", and_then, nothing)


def calling(every: Sequence[Verbs], verb: str) -> Action:
    """A verb without arguments of all blocks that have it."""

    def and_then(first: Action, k: int, function: Action) -> Action:
        @jit(inline=True)
        def both(t: ChainTables, s: BlockMemory) -> None:
            first(t, s)
            for j in range(s.counts[k]):
                function(t.blocks[k], s.blocks[k], j)

        return both

    @jit(inline=True)
    def nothing(t: ChainTables, s: BlockMemory) -> None:
        """No block has this verb."""

    return _all(every, verb, and_then, nothing)


def moves(every: Sequence[Verbs]) -> Action:
    """Pass a move of the drive on to all blocks that see it."""

    def and_then(first: Action, k: int, function: Action) -> Action:
        @jit(inline=True)
        def both(t: ChainTables, s: BlockMemory, before: Scalar, v: Scalar) -> None:
            first(t, s, before, v)
            for j in range(s.counts[k]):
                function(t.blocks[k], s.blocks[k], j, before, v)

        return both

    @jit(inline=True)
    def nothing(t: ChainTables, s: BlockMemory, before: Scalar, v: Scalar) -> None:
        """No block sees the move."""

    return _all(every, "move", and_then, nothing)
