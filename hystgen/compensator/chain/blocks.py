"""The blocks of a model with their constants, in the order of the chain."""

from __future__ import annotations

from collections.abc import Sequence

from hystgen.compensator.chain.layout import ChainTables, OwnChainTables
from hystgen.compensator.chain.parts import AHEAD, BEHIND, BESIDE, NAMES, PARTS, parts_with
from hystgen.effects.kinds import Constants
from hystgen.effects.part import ChainPart


def of(t: ChainTables, parts: Sequence[ChainPart], operator: str = "forward") -> list[Constants]:
    """The blocks of an operator that belong to the given parts of the chain."""
    every = parts_with(*t.own_blocks, t.own_effects) if isinstance(t, OwnChainTables) else PARTS
    pairs = [(every[k], t.blocks[k]) for k in map(PARTS.index, parts)]
    return [
        each for part, tables in pairs if operator == "forward" or not part.forward
        for each in part.of(t).constants(tables)
    ]


def sides(t: ChainTables, operator: str) -> tuple[list[Constants], list[Constants]]:
    """The blocks of an operator: those in front of the plays, starting at the drive, and those behind them."""
    return of(t, AHEAD, operator), of(t, BEHIND, operator)


def every(t: ChainTables, operator: str) -> list[Constants]:
    """The blocks on both sides, their additional structs, and the clock of a drift."""
    besides = (each for part in PARTS for each in beside(t, part.name) if each)
    return [*of(t, (*AHEAD, *BEHIND), operator), *besides, *clocks(t)]


def beside(t: ChainTables, name: str) -> list[Constants | None]:
    """For each block of a part, the constants of its additional struct, or None without one: for own heat the plays
    whose friction heats it, unless the square of the drive does; for a gain how it follows its column, unless at once
    and along a line."""
    part = PARTS[NAMES.index(name)]
    return list(part.of(t).beside(t.of(name)))


def clocks(t: ChainTables) -> list[Constants]:
    """The clock of a drift, if there is one."""
    return of(t, BESIDE)
