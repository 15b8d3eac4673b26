"""What stands in front of the plays and what behind them: every block of a kind, one kind after the other.

Blocks of the user's own come behind the lag in front of the plays, and behind creep: these are all linear and do not
change with time, so that their order makes no difference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from hystgen.basics.jit import jit
from hystgen.compensator.chain.layout import ChainTables
from hystgen.compensator.chain.own import OwnTables
from hystgen.effects.kinds import OwnBlock
from hystgen.effects.thermal.compensator import heat_absorb, heat_solve
from hystgen.plays.slots import Reals


class Blocks(NamedTuple):
    """What the blocks of a chain do in one arithmetic, each function as in the C of the same name."""

    lag: tuple[Callable[..., Any], Callable[..., Any], Callable[..., Any]]  # rest, absorb, solve
    creep: tuple[Callable[..., Any], Callable[..., Any], Callable[..., Any], Callable[..., Any]]  # and resting
    ageing: tuple[Callable[..., Any], Callable[..., Any]]  # absorb, solve
    ageing_settings: tuple[Callable[..., Any], Callable[..., Any], Callable[..., Any]]  # move, set, set_travel
    gain: tuple[Callable[..., Any], Callable[..., Any]]
    gain_settings: tuple[Callable[..., Any], Callable[..., Any]]  # reset, heat
    saturation: tuple[Callable[..., Any], Callable[..., Any]]  # forward, inverse
    target: Callable[..., Any]  # of the preview's line
    front: tuple[Callable[..., Any], Callable[..., Any]]  # forward, inverse
    plays: tuple[Callable[..., Any], Callable[..., Any], Callable[..., Any]]  # follow, started, inverse input
    finer: Callable[..., Any]  # what has to arrive, with bits below an input of the plays


class Sides(NamedTuple):
    """What both sides of the plays do, of tables, state and a number."""

    drive_rest: Callable[..., Any]
    drive_absorb: Callable[..., Any]
    drive_solve: Callable[..., Any]
    output_rest: Callable[..., Any]
    output_absorb: Callable[..., Any]
    output_resting: Callable[..., Any]
    output_solve: Callable[..., Any]


def _one(block: OwnBlock, verb: str, j: int) -> Callable[..., Any]:
    """What block `j` of the user's own does."""
    function = block.compiled[verb]
    if verb == "resting":

        @jit
        def resting(t: OwnTables, s: Reals, y: Any) -> Any:  # noqa: ARG001  as of every block
            return function(t.number[t.first[j] : t.first[j + 1]], y)

        return resting

    @jit
    def call(t: OwnTables, s: Reals, x: Any) -> Any:
        return function(t.number[t.first[j] : t.first[j + 1]], s[t.place[j] : t.place[j + 1]], x)

    return call


def _through(calls: Sequence[Callable[..., Any]]) -> Callable[..., Any]:
    """What blocks do one after the other."""
    if not calls:

        @jit(inline=True)
        def nothing(t: OwnTables, s: Reals, x: Any) -> Any:  # noqa: ARG001  as of any blocks
            return x

        return nothing
    if len(calls) == 1:
        return calls[0]
    first, behind = calls[0], _through(calls[1:])

    @jit
    def both(t: OwnTables, s: Reals, x: Any) -> Any:
        return behind(t, s, first(t, s, x))

    return both


def sides_of(blocks: Blocks, drives: Sequence[OwnBlock], outputs: Sequence[OwnBlock]) -> Sides:
    """Both sides in one arithmetic, with blocks of the user's own in front of the plays and behind them."""
    lag_rest, lag_absorb, lag_solve = blocks.lag
    creep_rest, creep_absorb, creep_solve, creep_resting = blocks.creep
    ageing_absorb, ageing_solve = blocks.ageing
    gain_absorb, gain_solve = blocks.gain

    def own(verb: str, given: Sequence[OwnBlock], begin: int, backwards: bool = False) -> Callable[..., Any]:
        calls = [_one(block, verb, begin + j) for j, block in enumerate(given)]
        return _through(calls[::-1] if backwards else calls)

    own_drive_rest, own_drive_absorb = own("rest", drives, 0), own("absorb", drives, 0)
    own_drive_solve = own("solve", drives, 0, backwards=True)
    ahead = len(drives)
    own_output_rest, own_output_absorb = own("rest", outputs, ahead), own("absorb", outputs, ahead)
    own_output_resting = own("resting", outputs, ahead, backwards=True)
    own_output_solve = own("solve", outputs, ahead, backwards=True)

    @jit
    def drive_side_rest(t: ChainTables, s: Any, v: Any) -> Any:
        """Everything in front of the plays settles at drive v; what arrives there."""
        x = v
        for j in range(len(t.lag.exact)):
            x = lag_rest(t.lag, s.lag, j, x)
        return own_drive_rest(t.own, s.own, x)

    @jit
    def drive_side_absorb(t: ChainTables, s: Any, v: Any) -> Any:
        """The drive is v at this sample; what arrives in front of the plays."""
        x = v
        for j in range(len(t.lag.exact)):
            x = lag_absorb(t.lag, s.lag, j, x)
        return own_drive_absorb(t.own, s.own, x)

    @jit
    def drive_side_solve(t: ChainTables, s: Any, y: Any) -> Any:
        """The drive that leads to y in front of the plays."""
        x = own_drive_solve(t.own, s.own, y)
        for j in range(len(t.lag.exact) - 1, -1, -1):
            x = lag_solve(t.lag, s.lag, j, x)
        return x

    @jit
    def output_side_rest(t: ChainTables, s: Any, h: Any) -> Any:
        """Everything behind the plays settles at their sum h; the output."""
        x = h
        for j in range(len(t.creep.block)):
            x = creep_rest(t.creep, s.creep, j, x)
        x = own_output_rest(t.own, s.own, x)
        for j in range(len(t.ageing.turns)):
            x = ageing_absorb(s.ageing, j, x)
        for j in range(len(t.heat.turns)):
            x = heat_absorb(s.heat, j, x)
        for j in range(len(t.gain)):
            x = gain_absorb(s.gain, j, x)
        return x

    @jit
    def output_side_absorb(t: ChainTables, s: Any, h: Any) -> Any:
        """The sum of the plays is h at this sample; the output."""
        x = h
        for j in range(len(t.creep.block)):
            x = creep_absorb(t.creep, s.creep, j, x)
        x = own_output_absorb(t.own, s.own, x)
        for j in range(len(t.ageing.turns)):
            x = ageing_absorb(s.ageing, j, x)
        for j in range(len(t.heat.turns)):
            x = heat_absorb(s.heat, j, x)
        for j in range(len(t.gain)):
            x = gain_absorb(s.gain, j, x)
        return x

    @jit
    def output_side_resting(t: ChainTables, s: Any, y: Any) -> Any:
        """The sum of the plays that gives the output y once everything has settled."""
        x = y
        for j in range(len(t.gain) - 1, -1, -1):
            x = gain_solve(s.gain, j, x)
        for j in range(len(t.heat.turns) - 1, -1, -1):
            x = heat_solve(s.heat, j, x)
        for j in range(len(t.ageing.turns) - 1, -1, -1):
            x = ageing_solve(s.ageing, j, x)
        x = own_output_resting(t.own, s.own, x)
        for j in range(len(t.creep.block) - 1, -1, -1):
            x = creep_resting(t.creep, s.creep, j, x)
        return x

    @jit
    def output_side_solve(t: ChainTables, s: Any, y: Any) -> Any:
        """The sum of the plays that gives the output y at this sample."""
        x = y
        for j in range(len(t.gain) - 1, -1, -1):
            x = gain_solve(s.gain, j, x)
        for j in range(len(t.heat.turns) - 1, -1, -1):
            x = heat_solve(s.heat, j, x)
        for j in range(len(t.ageing.turns) - 1, -1, -1):
            x = ageing_solve(s.ageing, j, x)
        x = own_output_solve(t.own, s.own, x)
        for j in range(len(t.creep.block) - 1, -1, -1):
            x = creep_solve(t.creep, s.creep, j, x)
        return x

    return Sides(
        drive_side_rest, drive_side_absorb, drive_side_solve, output_side_rest, output_side_absorb,
        output_side_resting, output_side_solve,
    )  # fmt: skip
