"""Code size that effects add to a model: a table measured on emulated cores (`benchmarks/effect_costs.py`)."""

from __future__ import annotations

from collections import Counter

from hystgen.compensator import engines
from hystgen.compensator.chain import moving
from hystgen.compensator.chain.layout import ChainTables
from hystgen.compensator.chain.parts import NAMES
from hystgen.plays import slots

PARTS = (
    "any", "creep", "lag", "lag_exact", "ageing", "heat", "friction", "gain", "clock", "preview", "slew", "braked",
    "tanh", "dead_zone", "relaxing", "dilated", "dashpot", "polynomial", "centre", "mode", "delay", "quiet",
)
"""Parts of the code: `any` (with engine corners `any_corners`) once for a model with effects, each other part once for
its kind of block; `friction` in addition to `heat` if plays rub, `dilated` for all plays whose input is found by a
search, `braked` for a lag together with a slew limit, `quiet` for a drive that stands still at rest."""

OPERATORS = {"preview": "inverse", "quiet": "inverse", "mode": "forward", "delay": "forward"}
"""Parts that only one operator has."""

PER_PLAY = ("relaxing", "dilated", "dashpot", "polynomial", "centre")
"""Parts that move or bend plays: their cost per sample grows with the number of plays."""


def parts(t: ChainTables, operator: str) -> list[str]:
    """The parts that an operator of a model has; blocks of one kind share their code."""
    exact = t.of("lag").exact.tolist()
    kinds = [int(kind) for kind in t.behind.stage_kind]
    found = Counter(dict(zip(NAMES, t.counts.tolist(), strict=True)) | {
        "delay": t.number_of("wait"), "lag": exact.count(0), "lag_exact": exact.count(1),
        "friction": t.of("heat").plays.any(), "preview": len(t.tap),
        "slew": t.slew, "braked": t.braked,
        "tanh": kinds.count(slots.TANH), "dead_zone": kinds.count(slots.DEAD_ZONE),
        "relaxing": t.moving.scanned, "dilated": t.moving.used and not t.moving.scanned,
        "dashpot": t.moving.moves == moving.DASHPOT,
        "quiet": t.quiet,
        "polynomial": t.moving.bends == moving.POLYNOMIAL, "centre": t.moving.bends == moving.CENTRE,
    })
    common = "any" if t.plays.engine == slots.LOOP else "any_corners"
    return [common, *(part for part in PARTS[1:] if found[part] and OPERATORS.get(part, operator) == operator)]


def code_bytes(t: ChainTables, arithmetic: str, operator: str) -> dict[str, int]:
    """Bytes of code at -O2 that effects add to an operator on each of `engines.CORES`."""
    found = [engines.effect_sizes()[part, arithmetic] for part in parts(t, operator)]
    return {core: sum(each[core] for each in found) for core in engines.CORES}
