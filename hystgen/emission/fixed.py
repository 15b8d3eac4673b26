"""A model's numbers as C text, in fixed point."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

from hystgen.chain.static import StaticModel
from hystgen.compensator import fixed_tables
from hystgen.compensator.layout import FixedTables
from hystgen.emission.compensator import (
    AnyTables,
    ConstantTable,
    EmittedStage,
    Errors,
    Form,
    Macro,
    Numbers,
    Tabled,
    Writer,
    drives,
    entries,
    influence_macros,
    macros,
    members,
    pointers,
    structures,
)
from hystgen.emission.options import Options
from hystgen.emission.runtime import Field
from hystgen.emission.text import Number, comment_text, literal, operand
from hystgen.front.curve import FORWARD, INVERSE
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.plays import slots
from hystgen.plays.slots import Reals

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import ChainTables, Codes, Compiled
    from hystgen.compensator.chain.moving import FixedMovingTables
    from hystgen.effects.bend import Bends
    from hystgen.model import Model

COLUMNS = (("threshold", "play_t"), ("weight", "int32_t"), ("slope", "int32_t"), ("reciprocal", "uint32_t"),
           ("shift", "uint8_t"))
"""Fields of the loop engine's tables, and the types of their arrays."""

RELAXING = COLUMNS[2:]
"""The columns that the loop engine has for plays that relax."""


class FixedForm(Form):
    """Fixed point."""

    apart = "HYSTGEN_APART"
    suffix = "_LSB"
    held = "never set: every code is valid"
    settings: ClassVar[Mapping[str, str]] = {
        "temperature": "temperature, in codes of MODEL_TEMPERATURE_LSB",
        "gain": "gain relative to the parameter file's, in codes of MODEL_GAIN_LSB",
        "value": "value of the column, in codes of its MODEL_INFLUENCE_.._LSB",
        "share": "0 to the largest code, which stands for 1",
    }

    def counted(self, side: str, unit: str) -> str:
        return f"{side} codes"

    def unit(self, unit: str, side: str = "") -> str:
        return f" {side} codes" if side else " codes"

    def quantity(self, words: str, macro: str, unit: str) -> str:
        return f"{words}, in codes of {macro}{f' {unit}' if unit else ''}"

    def between(self, low: Number, high: Number, part: float) -> Number:
        return int(low) + (int(high) - int(low)) * part

    def numbers(self, model: Model, options: Options, writer: Writer) -> Numbers:
        cascade, emit = model.cascade, model.parameters.emit
        t, form = fixed_tables.build(cascade, options.arithmetic, options.engine, emit.drive_lsb, emit.output_lsb)
        ends = t.limits
        curves, counts = _curves(t, options, writer)
        rounding = form.inverse_rounding if options.inverse else None
        return Numbers(
            t, (*macros(t), *_macros(t), *counts), tuple(_plays(t, t, options, writer)),
            (*_pointers(t, options, writer), *curves),
            _errors(options, (form.forward_error, form.inverse_error, rounding)),
            fronts=bool(t.fronts), envelopes=_envelopes(cascade), finer=int(ends.fine[0]) > 0,
            saturates=bool(ends.saturated[0] == ends.code_max[0]),
            lsb=(float(form.drive_lsb), float(form.output_lsb)),
            precision=(
                *_precision(model, form, " on the same branch" * bool(t.branches)),
                f"Range: every sum of products stays below 2^{(form.largest_sum - 1).bit_length()} in magnitude (64 "
                "bits hold 2^63),",
                f"    inputs of plays between {ends.play.low[0]} and {ends.play.high[0]}, "
                f"{form.sum_bits} fraction bits of an output code",
            ),
        )

    def chained(
        self, model: Model, compiled: Compiled, effects: Tabled, stages: Sequence[EmittedStage], options: Options,
        writer: Writer,
    ) -> Numbers:
        tables, codes, (arrays, constants) = compiled.tables, compiled.codes, effects
        plays: FixedTables = tables.plays
        assert codes is not None
        curves, counts = _curves(plays, options, writer)
        where = f" where {codes.condition}" if codes.condition else " on the same branch" * bool(plays.branches)
        return Numbers(
            tables, (*macros(plays), *_macros(plays), *counts, *constants),
            tuple(_plays(plays, tables, options, writer)),
            (*curves, *arrays, *_pointers(plays, options, writer), *_relaxing(tables, writer),
             *(each for stage in stages for each in stage.arrays)),
            _errors(options, (codes.forward_error, codes.inverse_error, codes.inverse_rounding), codes.condition),
            fronts=bool(plays.fronts),
            envelopes=_envelopes(compiled.static) or any(one.kind == "bend" for one in stages),
            finer=bool(tables.number.arriving_bits[0]), saturates=True,
            lsb=(float(codes.drive_lsb), float(codes.output_lsb)),
            precision=(
                *_precision(model, codes, where),
                f"Range: every signal behind the plays stays below 2^{codes.largest.bit_length()}, with "
                f"{tables.number.level_bits[0]} bits below an output code; states of effects below 2^62 (64 bits "
                "hold 2^63)",
            ),
        )

    def behind(self, t: ChainTables, writer: Writer) -> list[EmittedStage]:
        return [_saturation(t, j, writer.own) for j in range(len(t.behind.kind))]

    def moving(self, t: ChainTables, writer: Writer) -> Tabled:
        from hystgen.compensator.chain import moving

        plays: FixedMovingTables = t.moving
        numbers: list[Macro] = [
            ("LARGEST_INPUT", operand(plays.farthest), "of the plays, for a search"),
            ("NEAR", operand(plays.near), "least change of the sum with half a step of the input"),
            ("RATE_BITS", f"{plays.rate_bits}u", "of steps of the input per change of the sum, below one"),
            ("FASTEST", operand(moving.FASTEST), "the largest such rate"),
            ("SECANTS", f"{moving.SECANTS}u", "tries of a search by secants, before those by halving"),
        ]
        if plays.scanned:
            arrays = [
                writer.entries("factor_t", f"relaxing_{name}", list(map(literal, rows[1, :])))
                for name, rows in (("late", plays.first), ("kept", plays.second))
            ]
            arrays += [
                writer.array(kind, f"relaxing_{field}", list(getattr(plays.relaxed, field)))
                for field, kind in RELAXING
            ]
            return arrays, numbers
        names = {moving.RELAXING: ("late", "kept"), moving.DILATED: ("wider",)}.get(plays.moves, ())
        arrays = [
            self.factors(name, rows, writer) for name, rows in zip(names, (plays.first, plays.second), strict=False)
        ]
        if plays.moves == moving.DASHPOT:
            rows = [members(type(plays.yields), row) for row in plays.yields]
            arrays.append(writer.rows("yield_t", "yields", rows))
            arrays.append(writer.entries("factor_t", "standing_share", list(map(literal, plays.seen))))
            numbers += [
                ("YIELDS", f"{len(rows)}u", "pieces of the yield of a dashpot"),
                ("YIELD_BITS", f"{plays.yield_bits}u", "of a yield below a step of the plays' input"),
                ("STRETCH", operand(plays.stretch), "of a play, at the end of the last piece"),
            ]
        if plays.bends != moving.STRAIGHT:
            arrays += _bumps(plays, writer)
            numbers += [
                ("BUMP_END", operand(plays.bump.domain[0, 1]), "largest argument of the curve of a bent play"),
                ("BUMP_DEGREE", f"{plays.bump.coefficient.shape[1] - 1}u", ""),
                ("BUMP_LIFT", f"{plays.bump.scaled[0, 1]}u", "bits that its polynomials leave out"),
                ("BUMP_BITS", f"{plays.bump_bits}u", "bits of its values below a step of the plays' input"),
            ]
        if count := len(plays.elements.element):
            own = plays.elements
            arrays += structures(writer, ("piece", own.piece), ("element_table", own.element), ("tilt", own.tilt))
            numbers += [
                ("ELEMENTS", f"{count}u", "in parallel with the plays"),
                ("PIECES", f"{len(own.piece)}u", "of their curve"),
                ("BASE", operand(own.base[0]), "subtracted from the sum of elements with a tilted drive"),
                ("STRAIGHT", operand(own.straight), "steps of the input over which their sum is straight"),
            ]
        return arrays, numbers

    def effects(self, t: ChainTables) -> list[Macro]:
        low, high = t.plays.limits.drive[0]
        return [
            ("FINE_MIN", operand(low), "ends of the drive range at the output of the drive side"),
            ("FINE_MAX", operand(high), ""),
        ]

    def code_sizes(self, t: ChainTables, columns: Sequence[str]) -> list[Macro]:
        from hystgen.compensator.chain.fixed_tables import TEMPERATURE_BITS

        bits = int(31 - t.number.share_bits[0])
        degree = ("TEMPERATURE_LSB", repr(2.0 ** -TEMPERATURE_BITS[bits]), "degC per code of set_temperature")
        gain = ("GAIN_LSB", repr(2.0 ** (2 - bits)), "per code of set_gain; travels are in drive codes")
        units = (unit for unit, entry in zip(t.columns.unit, t.columns.entry, strict=True) if entry >= 0)
        influences = [
            (f"INFLUENCE_{macro}_LSB", repr(1.0 / float(unit)), f"units of column {comment_text(column)} per code")
            for macro, column, unit in zip(influence_macros(columns), columns, units, strict=True)
        ]
        return [*[degree] * ("set_temperature" in t.calls), *[gain] * ("set_gain" in t.calls), *influences]

    def drive_bits(self, t: ChainTables) -> int:

        return int(t.number.drive_bits[0])

    def factors(self, own: str, rows: Reals, writer: Writer) -> ConstantTable:
        return writer.rows("factor_t", own, [list(map(literal, row)) for row in rows])

    def corners(self, inverse: bool, plays: int) -> list[Field]:
        return [
            Field("place_t", "here"),
            Field("signal_t", "next", "output, along the move, at which another play begins to follow"),
            Field("kink_t", "kink", "of the present step; kept here rather than on the stack"),
            Field("corner_t", "corner", length=str(max(plays, 1))),
        ]


def _errors(options: Options, bounds: tuple[float, float | None, float | None], condition: str = "") -> Errors:
    """The bounds, rounded up to a few digits."""
    forward, inverse, rounding = (_upward(bound) if bound else 0.0 for bound in bounds)
    return Errors(forward, inverse, rounding, condition) if options.inverse else Errors(forward, 0.0, 0.0, condition)


def _upward(x: float) -> float:
    digits = max(0, 5 - math.ceil(math.log10(x)))
    scale: int = 10**digits
    return math.ceil(x * scale) / scale


def _envelopes(cascade: StaticModel) -> bool:
    return any(isinstance(stage, TanhEnvelope) for stage in cascade.stages)


def _precision(model: Model, form: fixed_tables.Format | Codes, branch: str) -> list[str]:
    """The size of codes, and the error bounds on answers against the exact model."""
    units = model.parameters.units
    drive, output = (f" {comment_text(unit)}".rstrip() for unit in (units.input, units.output))
    drive_lsb, output_lsb = float(form.drive_lsb), float(form.output_lsb)
    forward, inverse = form.forward_error, form.inverse_rounding
    found = [
        f"Precision: a drive code is {drive_lsb:.6g}{drive}, an output code {output_lsb:.6g}{output}; "
        "against the exact model",
        f"    forward within {forward:.4g} output codes = {forward * output_lsb:.4g}{output}",
    ]
    if inverse is not None:
        found.append(f"    inverse within {inverse:.4g} drive codes = {inverse * drive_lsb:.4g}{drive}{branch}")
    return found


def _macros(t: FixedTables) -> list[Macro]:
    """Macros that functions use only in fixed point."""
    step = int(len(t.start) > 1)
    shy = "output codes that rounding can add, by half a drive code and an inexact reciprocal"
    return [
        ("START_STEP", str(step), "entries from one play to the next; reset starts each at 0"),
        ("CODE_MAX", literal(t.limits.code_max[0]), "the largest code of either sign"),
        ("FRACTION", f"{t.limits.fraction[0]}u", "bits of a sum below an output code"),
        ("FINE", f"{t.limits.fine[0]}u", "bits of an input of the plays below a drive code"),
        ("SHY", literal(t.limits.shy[0]), shy),
    ]


def _plays(t: FixedTables, model: AnyTables, options: Options, writer: Writer) -> list[ConstantTable]:
    """The tables of an engine and the start memory; `model`: the tables of the model, which may have effects."""
    if options.engine == "corners":
        return _corner_tables(t, options, writer, model is not t)
    start = [writer.array("play_t", "model_start", list(t.start))] * (len(t.start) > 1)
    return [*(writer.array(kind, field, list(getattr(t, field))) for field, kind in COLUMNS), *start]


def _pointers(t: FixedTables, options: Options, writer: Writer) -> list[ConstantTable]:
    """Pointers to the loop engine's tables and the ends of the plays' input."""
    places = [f"{writer.name}_{field}" for field, _ in COLUMNS]
    return [pointers(t, [*places, *_ends(t)], writer)] * (options.engine == "loop")


def _relaxing(t: ChainTables, writer: Writer) -> list[ConstantTable]:
    """Pointers for plays that relax."""
    own = [f"{writer.name}_{'relaxing_' * ((field, kind) in RELAXING)}{field}" for field, kind in COLUMNS]
    return [pointers(t.plays, [*own, *_ends(t.plays)], writer, "relaxing")] * bool(t.moving.scanned)


def _ends(t: FixedTables) -> list[str]:
    margin = t.limits.margin[0]
    return [literal(t.limits.play.low[0] - margin), literal(t.limits.play.high[0] + margin)]


def _corner_tables(t: FixedTables, options: Options, writer: Writer, chain: bool) -> list[ConstantTable]:
    """The corner engine's tables: one curve for both operators, and the contents of a start memory."""
    never = (t.reach[-1], t.way[-1], 0, 0, 1)
    plays = zip(t.reach[:-1], t.way[:-1], t.slope[1:], t.reciprocal[1:], t.shift[1:], strict=True)
    low, high = t.limits.play.low[0], t.limits.play.high[0]
    ends = f"{{{entries([t.limits.margin[0] - low, high + t.limits.margin[0]])}}}"
    segments = [list(map(literal, each)) for each in (*plays, never)]
    parts = [f"{writer.name}_model_segment", literal(t.limits.offset[0]), ends, str(len(t.threshold) - 1)]
    found = [
        writer.rows("segment_t", "model_segment", segments),
        writer.entries("curve_t", "model_curve", parts),
        writer.array("int32_t", "model_start", list(t.start)),
        writer.array("int32_t", "model_zero", list(t.zero)),
    ]
    fronts = options.operators if t.fronts and not chain else ()
    return [*found, *(drives(t, (t.applied,), operator, writer) for operator in fronts)]


def _curves(t: FixedTables, options: Options, writer: Writer) -> tuple[list[ConstantTable], list[Macro]]:
    """The curves of the memoryless part that are in use, forward and for an inverse also backward, and their sizes."""
    if not t.fronts:
        return [], []
    arrays: list[ConstantTable] = []
    counts: list[Macro] = [("DEGREE", f"{t.coefficient.shape[1] - 1}u", "of the polynomials of every curve")]
    directions = (("_ascending", 0), ("_descending", 1)) if t.branches else (("", 0),)
    kinds = (("front", FORWARD), ("back", INVERSE)) if options.inverse else (("front", FORWARD),)
    for kind, first in kinds:
        for direction, branch in directions:
            which, own = first + branch, f"{kind}{direction}"
            words = "/* w = G[v] */\n" if kind == "front" else "/* v = G^-1[w] */\n"
            arrays += _pieces(t, which, own, writer, words)
            counts.append((f"{own}_PIECES".upper(), f"{t.pieces[which]}u", ""))
            if kind == "back":
                (low, high), (under, over) = t.domain[which, :], t.edge[which, :]
                ends = [*t.argument[which, :], low - under, high + over, low, high]
                arrays.append(writer.entries("ends_t", f"{own}_ends", list(map(literal, ends))))
    if options.inverse:
        counts.append(("BELOW", f"{int(t.below[INVERSE])}u", "bits of a curve back below a drive code"))
    return arrays, counts


def _pieces(t: FixedTables | Bends, which: int, own: str, writer: Writer, words: str = "") -> list[ConstantTable]:
    """The tables of a curve's pieces."""
    here = int(t.first[which])
    rows = slice(here, here + int(t.pieces[which]))
    return [
        writer.array("int32_t", f"{own}_knot", list(t.knot[rows]), words),
        writer.array("uint8_t", f"{own}_scale", list(t.scale[rows])),
        writer.array("int32_t", f"{own}_coefficient", list(t.coefficient[rows].ravel())),
    ]


def _bumps(t: FixedMovingTables, writer: Writer) -> list[ConstantTable]:
    """The curves of bent plays minus the plays themselves."""
    curves = [_pieces(t.bump, k, f"bump_{k + 1}", writer) for k in range(len(t.bump.pieces))]
    rows = [[*(each.name for each in curve), str(n)] for curve, n in zip(curves, t.bump.pieces, strict=True)]
    return [
        *(text for curve in curves for text in curve),
        writer.rows("bump_t", "bump", rows),
        writer.array("uint16_t", "bump_of", list(t.bump_of)),
    ]


def _saturation(t: ChainTables, j: int, writer: Writer) -> EmittedStage:
    """A stage of saturation behind the plays."""
    behind, own = t.behind, f"behind_{j + 1}"
    if behind.kind[j] == slots.DEAD_ZONE:
        row = members(type(behind.stops), behind.stops[j])
        return EmittedStage("stops", (writer.entries("stops_t", own, row),), f"&hystgen_{own}")
    curves = [
        _pieces(behind.bends, which, f"{own}_{direction}", writer)
        for which, direction in ((2 * j, "there"), (2 * j + 1, "back"))
    ]
    bends: Bends = behind.bends
    both = []
    for k, curve in enumerate(curves, 2 * j):
        numbers = *bends.domain[k, :], bends.pieces[k], bends.coefficient.shape[1] - 1, *bends.scaled[k, :]
        both.append(f"{{{', '.join([*(each.name for each in curve), *map(literal, numbers)])}}}")
    arrays = (*(text for curve in curves for text in curve), writer.entries("bend_t", own, both))
    return EmittedStage("bend", arrays, f"&hystgen_{own}", ", limited")


FORM = FixedForm()
