"""What stands in front of the plays and what behind them: every block of a kind, one kind after the other.

Blocks of the user's own come behind the lag in front of the plays, and behind creep: these are all linear and do not
change with time, so that their order makes no difference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any, NamedTuple

from hystgen.basics.jit import jit
from hystgen.compensator.chain.layout import ChainTables
from hystgen.effects.kinds import OwnBlock
from hystgen.effects.thermal.compensator import heat_absorb, heat_solve

Function = Callable[..., Any]


class Blocks(NamedTuple):
    """What the blocks of a chain do in one arithmetic: modules with functions named as in the C, and functions."""

    lag: ModuleType
    creep: ModuleType
    ageing: ModuleType
    thermal: ModuleType
    resonance: ModuleType
    drift: ModuleType
    saturation: tuple[Function, Function]  # forward, inverse
    target: Function  # of the preview's line
    delayed: Function  # drive, of the line of those that wait
    front: tuple[Function, Function]  # forward, inverse
    plays: tuple[Function, Function, Function]  # follow, started, inverse input
    finer: Function  # what has to arrive, with bits below an input of the plays


class Sides(NamedTuple):
    """What both sides of the plays do, of tables, state and a number."""

    drive_rest: Function
    drive_absorb: Function
    drive_solve: Function
    output_rest: Function
    output_absorb: Function
    output_resting: Function
    output_solve: Function


class _Kind(NamedTuple):
    """Blocks of one kind: how many there are, of tables and state, and the verbs, of tables, state, which one, and a
    number; `solve` and `resting` are None for what the forward operator alone has."""

    count: Function
    rest: Function
    absorb: Function
    solve: Function | None
    resting: Function | None


def _every(count: Function, verb: Function, backwards: bool) -> Function:
    """What all blocks of a kind do one after the other."""
    if backwards:

        @jit
        def back(t: ChainTables, s: Any, x: Any) -> Any:
            for j in range(count(t, s) - 1, -1, -1):
                x = verb(t, s, j, x)
            return x

        return back

    @jit
    def through(t: ChainTables, s: Any, x: Any) -> Any:
        for j in range(count(t, s)):
            x = verb(t, s, j, x)
        return x

    return through


def _through(calls: Sequence[Function]) -> Function:
    """What one function does after the other."""
    if len(calls) == 1:
        return calls[0]
    first, behind = calls[0], _through(calls[1:])

    @jit
    def both(t: ChainTables, s: Any, x: Any) -> Any:
        return behind(t, s, first(t, s, x))

    return both


def _own(block: OwnBlock, j: int) -> _Kind:
    """Block `j` of the user's own."""

    @jit
    def one(t: ChainTables, s: Any) -> int:  # noqa: ARG001  as of every kind
        return 1

    def call(function: Function) -> Function:
        @jit
        def verb(t: ChainTables, s: Any, _: int, x: Any) -> Any:
            numbers = t.own.number[t.own.first[j] : t.own.first[j + 1]]
            return function(numbers, s.own[t.own.place[j] : t.own.place[j + 1]], x)

        return verb

    resting_of = block.compiled["resting"]

    @jit
    def resting(t: ChainTables, s: Any, _: int, y: Any) -> Any:  # noqa: ARG001  as of every block
        return resting_of(t.own.number[t.own.first[j] : t.own.first[j + 1]], y)

    rest, absorb, solve = (call(block.compiled[verb]) for verb in ("rest", "absorb", "solve"))
    return _Kind(one, rest, absorb, solve, resting)


def _lags(lag: ModuleType) -> _Kind:
    @jit
    def count(t: ChainTables, s: Any) -> int:  # noqa: ARG001  as of every kind
        return len(t.lag.exact)

    def call(function: Function) -> Function:
        @jit
        def verb(t: ChainTables, s: Any, j: int, x: Any) -> Any:
            return function(t.lag, s.lag, j, x)

        return verb

    return _Kind(count, call(lag.lag_rest), call(lag.lag_absorb), call(lag.lag_solve), None)


def _creeps(creep: ModuleType) -> _Kind:
    @jit
    def count(t: ChainTables, s: Any) -> int:  # noqa: ARG001  as of every kind
        return len(t.creep.block)

    def call(function: Function) -> Function:
        @jit
        def verb(t: ChainTables, s: Any, j: int, x: Any) -> Any:
            return function(t.creep, s.creep, j, x)

        return verb

    verbs = (creep.creep_rest, creep.creep_absorb, creep.creep_solve, creep.creep_resting)
    return _Kind(count, *map(call, verbs))


def _ageing(ageing: ModuleType) -> _Kind:
    absorb_of, solve_of = ageing.ageing_absorb, ageing.ageing_solve

    @jit
    def count(t: ChainTables, s: Any) -> int:  # noqa: ARG001  as of every kind
        return len(t.ageing.turns)

    @jit
    def absorb(t: ChainTables, s: Any, j: int, x: Any) -> Any:  # noqa: ARG001  as of every block
        return absorb_of(s.ageing, j, x)

    @jit
    def solve(t: ChainTables, s: Any, j: int, y: Any) -> Any:  # noqa: ARG001  as of every block
        return solve_of(s.ageing, j, y)

    return _Kind(count, absorb, absorb, solve, solve)


def _heats() -> _Kind:
    @jit
    def count(t: ChainTables, s: Any) -> int:  # noqa: ARG001  as of every kind
        return len(t.heat.turns)

    @jit
    def absorb(t: ChainTables, s: Any, j: int, x: Any) -> Any:  # noqa: ARG001  as of every block
        return heat_absorb(s.heat, j, x)

    @jit
    def solve(t: ChainTables, s: Any, j: int, y: Any) -> Any:  # noqa: ARG001  as of every block
        return heat_solve(s.heat, j, y)

    return _Kind(count, absorb, absorb, solve, solve)


def _gains(thermal: ModuleType) -> _Kind:
    absorb_of, solve_of = thermal.gain_absorb, thermal.gain_solve

    @jit
    def count(t: ChainTables, s: Any) -> int:  # noqa: ARG001  as of every kind
        return len(t.gain)

    @jit
    def absorb(t: ChainTables, s: Any, j: int, x: Any) -> Any:  # noqa: ARG001  as of every block
        return absorb_of(s.gain, j, x)

    @jit
    def solve(t: ChainTables, s: Any, j: int, y: Any) -> Any:  # noqa: ARG001  as of every block
        return solve_of(s.gain, j, y)

    return _Kind(count, absorb, absorb, solve, solve)


def _modes(resonance: ModuleType) -> _Kind:
    rest_of, absorb_of = resonance.mode_rest, resonance.mode_absorb

    @jit
    def count(t: ChainTables, s: Any) -> int:  # noqa: ARG001  the inverse has no memory of them
        return len(s.mode)

    @jit
    def rest(t: ChainTables, s: Any, j: int, x: Any) -> Any:  # noqa: ARG001  as of every block
        return rest_of(s.mode, j, x)

    @jit
    def absorb(t: ChainTables, s: Any, j: int, x: Any) -> Any:
        return absorb_of(t.mode, s.mode, j, x)

    return _Kind(count, rest, absorb, None, None)


def sides_of(blocks: Blocks, drives: Sequence[OwnBlock], outputs: Sequence[OwnBlock]) -> Sides:
    """Both sides in one arithmetic, with blocks of the user's own in front of the plays and behind them."""
    ahead = [_own(block, j) for j, block in enumerate(drives)]
    behind = [_own(block, len(drives) + j) for j, block in enumerate(outputs)]
    before = [_lags(blocks.lag), *ahead]
    after = [
        _creeps(blocks.creep), *behind, _ageing(blocks.ageing), _heats(), _gains(blocks.thermal),
        _modes(blocks.resonance),
    ]  # fmt: skip

    def verb(kinds: Sequence[_Kind], name: str) -> Function:
        calls = [(kind.count, getattr(kind, name)) for kind in kinds]
        backwards = name in ("solve", "resting")
        every = [_every(count, call, backwards) for count, call in calls if call is not None]
        return _through(every[::-1] if backwards else every)

    return Sides(
        *(verb(before, name) for name in ("rest", "absorb", "solve")),
        *(verb(after, name) for name in ("rest", "absorb", "resting", "solve")),
    )
