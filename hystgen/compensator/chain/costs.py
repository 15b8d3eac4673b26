"""Code size that effects add to a model: a table measured on emulated cores (`benchmarks/effect_costs.py`)."""

from __future__ import annotations

from hystgen.compensator import engines
from hystgen.compensator.chain import parts
from hystgen.compensator.chain.layout import ChainTables
from hystgen.effects.plays import CENTRE, DASHPOT, POLYNOMIAL
from hystgen.plays import slots

OWN = {
    "preview": "inverse", "quiet": "inverse", "slew": "", "braked": "", "tanh": "", "dead_zone": "", "relaxing": "",
    "dilated": "", "dashpot": "", "polynomial": "", "centre": "", "elements": "",
}
"""Parts of the code that belong to no block, and the operator if only one has the part. `dilated`: for all plays whose
input is found by a search; `braked`: for a block and a slew limit; `quiet`: for a drive that stands still at rest."""

PARTS = ("any", *(each for part in parts.PARTS for each in part.code), *OWN)
"""All parts of the code: `any` (`any_corners` with the corner engine) once per model with effects, every other part
once per kind of block."""

OPERATORS = {each: "forward" for part in parts.PARTS if part.forward for each in part.code} | {
    each: operator for each, operator in OWN.items() if operator
}
"""Parts that only one operator has."""

PER_PLAY = ("relaxing", "dilated", "dashpot", "polynomial", "centre")
"""Parts that move or bend plays, whose cost per sample grows with the number of plays."""


def found(t: ChainTables, operator: str) -> list[str]:
    """The parts that an operator of a model has; blocks of one kind share their code."""
    kinds = t.behind.kinds
    counts: dict[str, int] = {
        "preview": len(t.tap), "slew": t.slew, "braked": t.braked, "quiet": t.quiet,
        "tanh": kinds.count(slots.TANH), "dead_zone": kinds.count(slots.DEAD_ZONE),
        "relaxing": t.moving.scanned, "dilated": t.moving.used and not t.moving.scanned,
        "dashpot": t.moving.moves == DASHPOT,
        "polynomial": t.moving.bends == POLYNOMIAL, "centre": t.moving.bends == CENTRE,
        "elements": len(t.moving.elements.element),
    }
    for part, tables, blocks in zip(parts.PARTS, t.blocks, t.counts.tolist(), strict=True):
        counts |= zip(part.code, part.counted(tables, blocks), strict=True)
    common = "any" if t.plays.engine == slots.LOOP else "any_corners"
    return [common, *(part for part in PARTS[1:] if counts[part] and OPERATORS.get(part, operator) == operator)]


def code_bytes(t: ChainTables, arithmetic: str, operator: str) -> dict[str, int]:
    """Bytes of code at -O2 that effects add to an operator on each of `engines.CORES`."""
    sizes = [engines.effect_sizes()[part, arithmetic] for part in found(t, operator)]
    return {core: sum(each[core] for each in sizes) for core in engines.CORES}
