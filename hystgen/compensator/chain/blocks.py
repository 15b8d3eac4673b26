"""The blocks of a model with their constants, in the order of the chain."""

from __future__ import annotations

from collections.abc import Sequence

from hystgen.compensator.chain.layout import ChainTables, OwnChainTables
from hystgen.compensator.chain.parts import AHEAD, BEHIND, BESIDE, PARTS, parts_with
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
    """The blocks on both sides, plays that generate heat by friction, and the clock of a drift."""
    return [*of(t, (*AHEAD, *BEHIND), operator), *(each for each in rubbing(t) if each), *clocks(t)]


def rubbing(t: ChainTables) -> list[Constants | None]:
    """For each block of own heat, the plays whose friction heats it, or None if the square of the drive heats it."""
    pairs = zip(PARTS, t.blocks, strict=True)
    return [each for part, tables in pairs for each in part.of(t).beside(tables)]


def clocks(t: ChainTables) -> list[Constants]:
    """The clock of a drift, if there is one."""
    return of(t, BESIDE)
