"""The types of models with effects in C, written from the structures that the package declares."""

from __future__ import annotations

import functools
import textwrap
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from hystgen.basics.structures import Factor, Struct
from hystgen.compensator.chain.own_fixed import FixedNumber
from hystgen.compensator.chain.parts import PARTS
from hystgen.compensator.chain.step import QuietState, RampState, SteadyState
from hystgen.effects.bend import BendCurve, Bump, SmoothLimit
from hystgen.effects.kinds import BlockKind
from hystgen.effects.maps import FixedStops
from hystgen.effects.plays import (
    CurvePiece,
    ElementState,
    FixedElement,
    FixedElementState,
    FixedPiece,
    FixedSearchState,
    FixedYield,
    SearchState,
    Tilt,
)
from hystgen.emission.runtime import Field, Piece, declared_type
from hystgen.emission.text import WIDTH

IN_BOTH: Mapping[str, type[Struct]] = {"ramp_t": RampState, "quiet_t": QuietState, "steady_t": SteadyState,
                                             "tilt_t": Tilt}
OTHERS: Mapping[str, Mapping[str, type[Struct]]] = {
    "float": {"search_t": SearchState, "piece_t": CurvePiece, "element_t": ElementState},
    "fixed": {
        "factor_t": Factor, "number_t": FixedNumber, "bend_curve_t": BendCurve, "bend_t": SmoothLimit, "bump_t": Bump,
        "stops_t": FixedStops, "yield_t": FixedYield, "search_t": FixedSearchState, "piece_t": FixedPiece,
        "element_table_t": FixedElement, "element_t": FixedElementState,
    },
}
"""Structures besides those of blocks, by their names in C without prefix."""


class Declared(NamedTuple):
    """A structure in C; `rows`: the name of its pointer to the block's rows, and their type."""

    kind: type[Struct]
    rows: tuple[str, str] | None = None


def of_block(kind: BlockKind) -> Iterator[tuple[str, Declared]]:
    """Names and structures of a kind of block."""
    rows = None
    if kind.rows:
        rows = kind.rows.name, f"{kind.name}_{kind.rows.name}_t"
        yield rows[1], Declared(kind.rows.table)
        if kind.rows.state:
            yield f"{kind.name}_state_t", Declared(kind.rows.state)
    yield f"{kind.tabled}_table_t", Declared(kind.table, rows)
    yield f"{kind.name}_t", Declared(kind.state)


def structures(arithmetic: str) -> Mapping[str, Declared]:
    """Every structure of a kind of arithmetic, "float" or "fixed", by its name in C without prefix; each comes before
    those that contain it."""
    parts = (part.coded() if arithmetic == "fixed" else part.floating for part in PARTS)
    blocks = dict(each for part in parts for kind in part.kinds for each in of_block(kind))
    return {name: Declared(kind) for name, kind in {**IN_BOTH, **OTHERS[arithmetic]}.items()} | blocks


def fields(own: str, declared: Declared, known: Mapping[str, Declared], arithmetic: str) -> Iterator[Field]:
    """The members of the struct `own`. A structure that extends another one, of another name, begins with it."""
    names = {each.kind: name for name, each in known.items()}
    base: type[Struct] = declared.kind.__bases__[0]
    within = names.get(base, own)
    if declared.rows:
        yield Field(f"const hystgen_{declared.rows[1]} *", declared.rows[0])
    if within != own:
        yield Field(within, within.removesuffix("_t"))
    for name, (kind, length, only, note) in declared.kind.members().items():
        if only in ("", arithmetic) and (within == own or name not in base.members()):
            yield Field(names[kind] if isinstance(kind, type) else kind, name, note, f"{length or ''}")


@functools.cache
def pieces(arithmetic: str) -> tuple[Piece, ...]:
    """Every type in C."""
    known = structures(arithmetic)
    return tuple(
        declared_type(name, _comment(each.kind), fields(name, each, known, arithmetic))
        for name, each in known.items()
    )


def _comment(kind: type[Struct]) -> str:
    """A structure's docstring as a comment in C."""
    words = " ".join((kind.__doc__ or "").split())
    return "\n".join(textwrap.wrap(f"/* {words}\0*/", WIDTH, subsequent_indent="   ")).replace("\0", " ")
