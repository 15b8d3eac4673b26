"""The two sides of the plays, in front of them and behind: all blocks of a kind, one kind after the other.

Blocks of the user's own come after the lag in front of the plays, and after creep behind them. All of these are linear
and time-invariant, so that their order makes no difference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any, NamedTuple

from hystgen.basics.jit import jit
from hystgen.compensator.chain.layout import ChainTables
from hystgen.compensator.chain.own import OwnTables
from hystgen.effects.kinds import OwnBlock
from hystgen.plays.slots import Reals

Function = Callable[..., Any]


class Blocks(NamedTuple):
    """The blocks of a chain in one arithmetic: modules with functions named as in the C, and functions."""

    lag: ModuleType
    creep: ModuleType
    ageing: ModuleType
    thermal: ModuleType
    resonance: ModuleType
    drift: ModuleType
    saturation: tuple[Function, Function]  # forward, inverse
    target: Function  # of the preview's line
    delayed: Function  # the delayed drive, from those that wait
    front: tuple[Function, Function]  # forward, inverse
    plays: tuple[Function, Function, Function, Function]  # start, follow, started, inverse input
    finer: Function  # the signal in front of the plays, with bits below their input
    braked: Function  # the drive within reach from which a lag does not overshoot
    ramp: Function  # a drive at a limited rate one step later, and what rounding took from it
    own: tuple[Function, Function, Function]  # of the user's own: product, signal into a block, signal out of it


class Sides(NamedTuple):
    """The verbs of both sides of the plays, as functions of tables, state and a number."""

    drive_rest: Function
    drive_absorb: Function
    drive_solve: Function
    output_rest: Function
    output_absorb: Function
    output_resting: Function
    output_solve: Function


def _each(verb: Function) -> Function:
    """A verb applied by n blocks of a kind, one after the other."""

    @jit
    def through(t: Any, s: Any, n: int, x: Any) -> Any:
        for j in range(n):
            x = verb(t, s, j, x)
        return x

    return through


def _back(verb: Function) -> Function:
    """The same from the last block to the first."""

    @jit
    def through(t: Any, s: Any, n: int, x: Any) -> Any:
        for j in range(n - 1, -1, -1):
            x = verb(t, s, j, x)
        return x

    return through


def _tabled(verb: Function) -> Function:
    """A verb that takes no tables, as one that does."""

    @jit(inline=True)
    def call(t: Any, s: Any, j: int, x: Any) -> Any:  # noqa: ARG001  as of every block
        return verb(s, j, x)

    return call


def _one(arithmetic: tuple[Function, Function, Function], block: OwnBlock, verb: str, j: int) -> Function:
    """A verb of block `j` of the user's own, with its numbers and memory picked."""
    product, entered, left = arithmetic
    function = block.compiled(verb, product)
    if verb == "resting":

        @jit
        def resting(t: OwnTables, s: Reals, y: Any) -> Any:  # noqa: ARG001  as of every block
            return left(t, j, function(t.number[t.first[j] : t.first[j + 1]], entered(t, j, y)))

        return resting

    @jit
    def call(t: OwnTables, s: Reals, x: Any) -> Any:
        row, memory = t.number[t.first[j] : t.first[j + 1]], s[t.place[j] : t.place[j + 1]]
        return left(t, j, function(row, memory, entered(t, j, x)))

    return call


def _through(calls: Sequence[Function]) -> Function:
    """A verb applied by blocks of the user's own, one after the other."""
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
    """Both sides in one arithmetic, with blocks of the user's own in front of the plays and behind them.

    Modes have memory only in the forward operator, so that the inverse skips them.
    """
    lag, creep, mode = blocks.lag, blocks.creep, blocks.resonance
    lag_rest, lag_absorb, lag_solve = _each(lag.lag_rest), _each(lag.lag_absorb), _back(lag.lag_solve)
    creep_rest, creep_absorb = _each(creep.creep_rest), _each(creep.creep_absorb)
    creep_solve, creep_resting = _back(creep.creep_solve), _back(creep.creep_resting)
    ageing_absorb, ageing_solve = (
        _each(_tabled(blocks.ageing.ageing_absorb)), _back(_tabled(blocks.ageing.ageing_solve))
    )  # fmt: skip
    heats_absorb, heats_solve = _each(_tabled(blocks.thermal.heat_absorb)), _back(_tabled(blocks.thermal.heat_solve))
    gain_absorb, gain_solve = _each(_tabled(blocks.thermal.gain_absorb)), _back(_tabled(blocks.thermal.gain_solve))
    mode_rest, mode_absorb = _each(_tabled(mode.mode_rest)), _each(mode.mode_absorb)

    def own(verb: str, given: Sequence[OwnBlock], begin: int) -> Function:
        calls = [_one(blocks.own, block, verb, begin + j) for j, block in enumerate(given)]
        return _through(calls[::-1] if verb in ("solve", "resting") else calls)

    own_drive_rest, own_drive_absorb, own_drive_solve = (own(verb, drives, 0) for verb in ("rest", "absorb", "solve"))
    ahead = len(drives)
    own_output_rest, own_output_absorb = (own(verb, outputs, ahead) for verb in ("rest", "absorb"))
    own_output_resting, own_output_solve = (own(verb, outputs, ahead) for verb in ("resting", "solve"))

    @jit
    def drive_side_rest(t: ChainTables, s: Any, v: Any) -> Any:
        """Everything in front of the plays settles at drive v. Returns the signal there."""
        return own_drive_rest(t.own, s.own, lag_rest(t.lag, s.lag, len(t.lag.exact), v))

    @jit
    def drive_side_absorb(t: ChainTables, s: Any, v: Any) -> Any:
        """The drive is v at this sample. Returns the signal in front of the plays."""
        return own_drive_absorb(t.own, s.own, lag_absorb(t.lag, s.lag, len(t.lag.exact), v))

    @jit
    def drive_side_solve(t: ChainTables, s: Any, y: Any) -> Any:
        """The drive that leads to y in front of the plays."""
        return lag_solve(t.lag, s.lag, len(t.lag.exact), own_drive_solve(t.own, s.own, y))

    @jit(inline=True)
    def gains_absorb(t: ChainTables, s: Any, x: Any) -> Any:
        """The output of the gains for the input x."""
        x = ageing_absorb(t.ageing, s.ageing, len(t.ageing.turns), x)
        x = heats_absorb(t.heat, s.heat, len(t.heat.turns), x)
        return gain_absorb(t.gain, s.gain, len(t.gain), x)

    @jit(inline=True)
    def gains_solve(t: ChainTables, s: Any, y: Any) -> Any:
        """The input of the gains that gives the output y."""
        y = gain_solve(t.gain, s.gain, len(t.gain), y)
        y = heats_solve(t.heat, s.heat, len(t.heat.turns), y)
        return ageing_solve(t.ageing, s.ageing, len(t.ageing.turns), y)

    @jit
    def output_side_rest(t: ChainTables, s: Any, h: Any) -> Any:
        """Everything behind the plays settles at their sum h. Returns the output."""
        x = own_output_rest(t.own, s.own, creep_rest(t.creep, s.creep, len(t.creep.block), h))
        return mode_rest(t.mode, s.mode, len(s.mode), gains_absorb(t, s, x))

    @jit
    def output_side_absorb(t: ChainTables, s: Any, h: Any) -> Any:
        """The sum of the plays is h at this sample. Returns the output."""
        x = own_output_absorb(t.own, s.own, creep_absorb(t.creep, s.creep, len(t.creep.block), h))
        return mode_absorb(t.mode, s.mode, len(s.mode), gains_absorb(t, s, x))

    @jit
    def output_side_resting(t: ChainTables, s: Any, y: Any) -> Any:
        """The sum of the plays that gives the output y once everything has settled."""
        x = own_output_resting(t.own, s.own, gains_solve(t, s, y))
        return creep_resting(t.creep, s.creep, len(t.creep.block), x)

    @jit
    def output_side_solve(t: ChainTables, s: Any, y: Any) -> Any:
        """The sum of the plays that gives the output y at this sample."""
        x = own_output_solve(t.own, s.own, gains_solve(t, s, y))
        return creep_solve(t.creep, s.creep, len(t.creep.block), x)

    return Sides(
        drive_side_rest, drive_side_absorb, drive_side_solve, output_side_rest, output_side_absorb,
        output_side_resting, output_side_solve,
    )  # fmt: skip
