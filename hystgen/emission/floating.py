"""A model's numbers as C text, in floating point."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from hystgen.compensator import float_tables
from hystgen.compensator.bounds import error_bounds
from hystgen.compensator.layout import Tables
from hystgen.emission.compensator import (
    AnyTables,
    ConstantTable,
    EmittedStage,
    Errors,
    Form,
    Numbers,
    Tabled,
    Writer,
    drives,
    entries,
    macros,
    macros_of,
    pointers,
    structures,
)
from hystgen.emission.options import Options
from hystgen.emission.runtime import Field
from hystgen.emission.text import Number, literal, operand
from hystgen.front.stage import StageTables
from hystgen.plays import slots
from hystgen.plays.corners.corners_float import Curve, Start
from hystgen.plays.slots import Reals

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import ChainTables, Compiled
    from hystgen.compensator.chain.moving import MovingTables
    from hystgen.model import Model

COLUMNS = ("threshold", "reciprocal", "weight", "lift")
"""Arrays of the loop engine's tables."""

DEAD_ZONE = (("break_x", 0), ("break_y", 0), ("anchor_x", 1), ("anchor_y", 1), ("slope", 1), ("inverse_slope", 1))
"""Arrays of a dead zone, and how many more entries than break points each has."""

class FloatingForm(Form):
    """Floating point."""

    held = "NaN or infinite input: the last answer was held"
    warning = (
        " Not for targets that flush denormal numbers to zero or do not round to nearest, nor for flags that "
        "reorder sums (-fassociative-math) or fuse multiply-adds whatever the source says (clang's "
        "-ffp-contract=fast): the last bits of answers could then differ from the reference."
    )
    settings: ClassVar[Mapping[str, str]] = {
        "temperature": "temperature, degC",
        "gain": "gain relative to the parameter file's",
        "value": "value of the column, in its unit",
        "share": "0 to 1",
    }

    def unless_held(self, call: str) -> str:
        return f"; NaN and infinite: {'held' if call in ('step', 'reset') else 'ignored'}"

    def between(self, low: Number, high: Number, part: float) -> Number:
        return low + (high - low) * type(high)(part)

    def numbers(self, model: Model, options: Options, writer: Writer) -> Numbers:
        t = float_tables.build_float(model.cascade, options.arithmetic, options.engine, True, True)
        bounds = error_bounds(model.cascade, options.arithmetic, options.engine)
        errors = _errors(t, options, (bounds.forward, bounds.inverse, bounds.rounding))
        return _numbers(t, t, errors, options, writer)

    def chained(
        self, model: Model, compiled: Compiled, effects: Tabled, stages: Sequence[EmittedStage], options: Options,
        writer: Writer,
    ) -> Numbers:
        from hystgen.compensator.chain.bounds import chain_bounds, condition

        tables, (arrays, constants) = compiled.tables, effects
        bounds = chain_bounds(compiled, options.arithmetic)
        errors = _errors(tables, options, (bounds.forward, bounds.inverse, bounds.rounding))
        plays = _numbers(tables.plays, tables, errors, options, writer)
        return dataclasses.replace(
            plays, tables=tables, macros=(*plays.macros, *constants),
            beside=(*plays.beside, *arrays, *(each for stage in stages for each in stage.arrays)),
            errors=dataclasses.replace(errors, condition=condition(compiled)),
            envelopes=plays.envelopes or any(one.kind == "envelope" for one in stages),
        )

    def behind(self, t: ChainTables, writer: Writer) -> list[EmittedStage]:
        return [_stage(t.behind, j, f"behind_{j + 1}", writer) for j in range(len(t.behind.stage_kind))]

    def moving(self, t: ChainTables, writer: Writer) -> Tabled:
        from hystgen.compensator.chain import moving

        plays: MovingTables = t.moving
        if plays.scanned:
            columns = [("share", list(plays.share)), ("inverse", list(plays.inverse))]
            return [writer.columns("real_t", "relaxing", columns)], [
                ("LATE", operand(plays.first[1]), "share of its stretch that a play gains by the end of a step"),
                ("KEPT", operand(plays.second[1]), "and on the way to the next step"),
            ]
        names = {moving.RELAXING: ("late", "kept"), moving.DILATED: ("wider",)}.get(plays.moves, ())
        arrays = [
            writer.array("real_t", name, list(row))
            for name, row in zip(names, (plays.first, plays.second), strict=False)
        ]
        for name, rows, wanted in (
            ("yields", plays.yields, plays.moves == moving.DASHPOT),
            ("curve", plays.curve, plays.bends == moving.POLYNOMIAL),
        ):
            if wanted:
                arrays.append(writer.matrix("real_t", name, list(rows)))
        if len(plays.elements.element):
            arrays += structures(writer, ("piece", plays.elements.piece), ("tilt", plays.elements.tilt))
            arrays += [
                writer.array("real_t", f"element_{name}", list(getattr(plays.elements.element, name)))
                for name in type(plays.elements.element).members()
            ]
        return arrays, [
            *macros_of(plays.number),
            ("TERMS", f"{plays.curve.shape[1]}u", "of a polynomial"),
            ("NEWTON_TRIES", f"{moving.NEWTON_TRIES}u", "tries of a search by Newton's method"),
            ("HALVES", f"{plays.halves}u", "and by halving after them"),
            ("TURNS", f"{plays.turns}u", "steps to the reciprocal of a slope"),
            ("YIELDS", f"{len(plays.yields)}u", "pieces of the yield of a dashpot"),
            ("ELEMENTS", f"{len(plays.elements.element)}u", "in parallel with the plays"),
            ("PIECES", f"{len(plays.elements.piece)}u", "of their curve"),
            ("BASE", operand(plays.elements.base[0]), "subtracted from the sum of elements with a tilted drive"),
        ]

    def factors(self, own: str, rows: Reals, writer: Writer) -> ConstantTable:
        return writer.array("real_t", own, list(rows))

    def corners(self, inverse: bool, plays: int) -> list[Field]:
        undo = [Field("place_t", "undo", "place of the plays before the solution")] * inverse
        return [Field("plays_t", "plays"), *undo, Field("corner_t", "corner", length=str(plays + 1))]


def _errors(t: Tables | ChainTables, options: Options, bounds: tuple[float, float, float]) -> Errors:
    """The bounds, rounded up to the arithmetic's numbers."""
    forward, inverse, rounding = (float_tables.upward(bound, t.threshold.dtype.type) for bound in bounds)
    return Errors(forward, inverse, rounding) if options.inverse else Errors(forward, 0.0, 0.0)


def _numbers(t: Tables, model: AnyTables, errors: Errors, options: Options, writer: Writer) -> Numbers:
    """The numbers of a model, or those of the plays in a model with effects; `model`: its tables."""
    stages = [_stage(t, j, f"stage_{j + 1}", writer) for j in range(len(t.stage_kind))]
    beside = [array for stage in stages for array in stage.arrays]
    if options.engine == "corners":
        plays = _corner_tables(t, options, writer, front=bool(stages) and model is t)
    else:
        plays = _loop_tables(t, writer)
        places = [f"{writer.name}_play.{own}" for own in ("threshold", "weight", "lift", "reciprocal")]
        beside = [pointers(t, places, writer), *beside]
    return Numbers(
        t, tuple(macros(t)), tuple(plays), tuple(beside), errors, fronts=bool(stages),
        envelopes=any(stage.kind == "envelope" for stage in stages), stages=tuple(stages),
    )


def _loop_tables(t: Tables, writer: Writer) -> list[ConstantTable]:
    """The loop engine's tables: arrays in one structure, and the start memory."""
    fields = {"reciprocal": "inverse_slope"}
    columns = [(own, list(getattr(t, fields.get(own, own)))) for own in COLUMNS]
    start = [writer.array("real_t", "model_start", list(t.start))] * (len(t.start) > 1)
    return [writer.columns("real_t", "play", columns), *start]


def _corner_tables(t: Tables, options: Options, writer: Writer, front: bool) -> list[ConstantTable]:
    """The corner engine's tables, one operator after the other."""
    found = []
    for operator, curve, starts in (
        ("forward", t.forward, (t.forward_first, t.forward_zero)),
        ("inverse", t.inverse, (t.inverse_first, t.inverse_zero)),
    ):
        if operator in options.operators:
            found += _curve_tables(curve, starts, operator, writer)
            found += [drives(t, (t.applied, t.begin), operator, writer)] * front
    return found


def _curve_tables(curve: Curve, starts: tuple[Start, Start], operator: str, writer: Writer) -> list[ConstantTable]:
    """Segments, curve and start memories of one operator."""
    rows = zip(curve.way, curve.reach, curve.gain, curve.slope, strict=True)
    pairs = [f"{{{entries(pair[:2])}}}" for pair in (curve.limit, curve.inside, curve.range)]
    segments = writer.rows("segment_t", f"{operator}_segment", [list(map(literal, row)) for row in rows])
    found = [segments, writer.entries("curve_t", f"{operator}_curve", [segments.name, *pairs])]
    before: dict[str, str] = {}
    memories = []
    for start, memory in zip(starts, ("init", "reset"), strict=True):
        center = writer.matrix("real_t", f"{operator}_{memory}_center", [point[:2] for point in start.center])
        content = center.text.partition("=")[2]
        if content not in before:  # plays may start alike after init and after reset
            before[content] = center.name
            found.append(center)
        output, falling, rising = map(literal, start.bottom)
        bottom = f"{{{output}, {{{falling}, {rising}}}, {start.top}, {writer.prefix.upper()}_BOTTOM}}"
        memories.append([before[content], str(start.step), str(start.risen), bottom])
    return [*found, writer.rows("start_t", f"{operator}_start", memories)]


def _stage(t: StageTables, j: int, own: str, writer: Writer) -> EmittedStage:
    """A stage of the memoryless part, or of saturation."""
    data = t.stage_data[int(t.stage_first[j]) :]
    if t.stage_kind[j] == slots.TANH:
        branches, place = {own: data[:7]}, f"&hystgen_{own}"
        if not np.array_equal(data[:7], data[7:14]):
            branches = {f"{own}_ascending": data[:7], f"{own}_descending": data[7:14]}
            place = f"ascending ? &hystgen_{own}_ascending : &hystgen_{own}_descending"
        words = "/* a0 tanh(a1 x + a2) + a3 */\n"
        arrays = [
            writer.entries("envelope_t", branch, list(map(literal, row)), words) for branch, row in branches.items()
        ]
        return EmittedStage("envelope", tuple(arrays), place, ", limited")
    n, first = int(t.stage_size[j]), 0
    arrays, places = [], []
    for part, more in DEAD_ZONE:
        values = list(data[first : first + n + more])
        first += n + more
        if values:
            arrays.append(writer.array("real_t", f"{own}_{part}", values))
        places.append(arrays[-1].name if values else "NULL")
    words = "/* the straight pieces of the dead-zone sum */\n"
    zone = writer.entries("dead_zone_t", own, [*places, str(n)], words)
    return EmittedStage("dead_zone", (*arrays, zone), f"&hystgen_{own}")


FORM = FloatingForm()
