"""A model's numbers as C text: tables, limits and error bounds, for floating and for fixed point."""

from __future__ import annotations

import dataclasses
import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hystgen.arithmetic import ARITHMETICS
from hystgen.chain.static import StaticModel
from hystgen.compensator import fixed_tables, float_tables
from hystgen.compensator.bounds import error_bounds
from hystgen.compensator.layout import FixedTables, Tables
from hystgen.emission import chain
from hystgen.emission.options import Options
from hystgen.emission.text import WIDTH, comment_text, constant, literal, operand, structure, table
from hystgen.front.curve import FORWARD, INVERSE
from hystgen.front.stage import StageTables
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.parameters.files import Parameters
from hystgen.plays import slots
from hystgen.plays.corners.corners_float import Curve, Start

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import Compiled


def fields(parameters: Parameters, cascade: StaticModel, options: Options, prefix: str) -> dict[str, Any]:
    """Values for the templates; `prefix`: of the types of the run time."""
    fixed = ARITHMETICS[options.arithmetic].fixed
    found = (_fixed_fields if fixed else _float_fields)(parameters, cascade, options, prefix)
    if options.engine == "loop":
        operators = [op for op in ("forward", "inverse") if getattr(options, op)]
        found["glue"] = chain.alone(operators, cascade.pi.n, fixed)
    return found


def _limits(numbers: Tables | FixedTables, more: Sequence[tuple[str, str, str]] = ()) -> dict[str, Any]:
    """Values that both kinds of arithmetic have; `constants` are macros that functions may use, with `more` of them."""
    limits = numbers.limits
    return {
        "numbers": numbers,
        "drive_min": operand(limits[slots.DRIVE_MIN]),
        "drive_max": operand(limits[slots.DRIVE_MAX]),
        "output_min": operand(limits[slots.OUTPUT_MIN]),
        "output_max": operand(limits[slots.OUTPUT_MAX]),
        "start_list": len(numbers.start) > 1,
        "constants": [
            ("OFFSET", operand(limits[slots.OFFSET]), "part of every output"),
            ("START", operand(numbers.start[0]), "what each play holds after init"),
            *(
                (f"{op}_{call}_{what}", value, comment)
                for op, first in (("FORWARD", 0), ("INVERSE", 2))
                for call, j in (("INIT", first), ("RESET", first + 1))
                for what, value, comment in (
                    ("DRIVE", operand(numbers.applied[j]), "that the plays stand for then"),
                    ("ASCENDING", "true" if numbers.ascending[j] else "false", "and the direction it came from"),
                )
            ),
            ("HOLD", operand(limits[slots.HOLD]), "a drive that is stepped back by no more is held"),
            *more,
        ],
    }


def chain_fields(
    parameters: Parameters, compiled: Compiled, options: Options, prefix: str
) -> dict[str, Any]:
    """The same of a model with effects, `glue` with its blocks."""
    if compiled.tables.fixed:
        return _fixed_chain_fields(parameters, compiled, options, prefix)
    from hystgen.compensator.chain.bounds import chain_bounds, condition

    name, tables = parameters.name, compiled.tables
    static = dataclasses.replace(compiled.static, output_offset=0.0)
    behind = [
        stage(tables.behind, j, name, f"{prefix}_real_t", options, "behind")
        for j in range(len(tables.behind.stage_kind))
    ]
    operators = [op for op in ("forward", "inverse") if getattr(options, op)]
    glue = chain.glue(compiled, operators, name, behind)
    limits, dtype = tables.limits, tables.threshold.dtype.type
    bounds = chain_bounds(compiled, options.arithmetic)
    plays = _float_fields(parameters, static, options, prefix, tables.plays)
    return {
        **plays,
        "numbers": tables,
        "output_min": operand(limits[slots.OUTPUT_MIN]),
        "output_max": operand(limits[slots.OUTPUT_MAX]),
        "constants": [*plays["constants"], *glue.constants],
        "beside": [*plays["beside"], *glue.arrays, *glue.beside],
        "envelopes": plays["envelopes"] or any(one["kind"] == "envelope" for one in behind),
        "forward_max_error": operand(float_tables.upward(bounds.forward, dtype)),
        "inverse_max_error": operand(float_tables.upward(bounds.inverse, dtype)) if options.inverse else "",
        "inverse_rounding_error": operand(float_tables.upward(bounds.rounding, dtype)) if options.inverse else "",
        "condition": condition(compiled),
        "glue": glue,
    }


def _fixed_chain_fields(parameters: Parameters, compiled: Compiled, options: Options, prefix: str) -> dict[str, Any]:
    from hystgen.compensator.chain.layout import ARRIVING_BITS, LEVEL_BITS

    name, tables, codes = parameters.name, compiled.tables, compiled.codes
    plays = tables.plays
    assert isinstance(plays, FixedTables) and codes is not None  # noqa: PT018
    behind = [chain.saturation(tables, j, name, name) for j in range(len(tables.behind.kind))]
    operators = [op for op in ("forward", "inverse") if getattr(options, op)]
    glue = chain.glue(compiled, operators, name, behind)
    curves, counts = _curves(plays, name, prefix, options) if plays.fronts else ([], [])
    corners = options.engine == "corners"
    pointers = _fixed_loop_pointers(plays, name, options)
    own = [] if corners else [_loop_tables(pointers, plays, name, prefix)]
    if tables.moving.scanned and options.inverse:
        others = [f"{name}_relaxing_{part}" for part in ("slope", "reciprocal", "shift")]
        own.append(_loop_tables([*pointers[:2], *others, *pointers[5:]], plays, name, prefix, "relaxing"))
    about = _limits(plays, [*_fixed_constants(plays), *counts, *glue.constants])
    ends = zip(("drive_min", "drive_max", "output_min", "output_max"), tables.limits, strict=False)
    return {
        **about,
        **{end: operand(value) for end, value in ends},
        "numbers": tables,
        "arrays": _fixed_corner_fields(plays, name, prefix, options, True) if corners
        else _fixed_loop_fields(plays, name, prefix, options),
        "beside": [*curves, *glue.arrays, *own, *glue.beside],
        "stages": [],
        "fronts": bool(plays.fronts),
        "envelopes": any(isinstance(stage, TanhEnvelope) for stage in compiled.static.stages)
        or any(one["kind"] == "bend" for one in behind),
        "finer": bool(tables.number[ARRIVING_BITS]),
        "saturates": True,
        "condition": codes.condition,
        "drive_lsb": _physical(codes.drive_lsb),
        "output_lsb": _physical(codes.output_lsb),
        "forward_max_error": _decimal(codes.forward_error),
        "inverse_max_error": _decimal(codes.inverse_error) if options.inverse else "",
        "inverse_rounding_error": _decimal(codes.inverse_rounding) if options.inverse else "",
        "precision": [
            *_precision(
                parameters, (codes.drive_lsb, codes.output_lsb), (codes.forward_error, codes.inverse_rounding),
                f" where {codes.condition}" if codes.condition else " on the same branch" * plays.branches,
            ),
            f"Range: every signal behind the plays stays below 2^{codes.largest.bit_length()}, with "
            f"{tables.number[LEVEL_BITS]} bits below an output code; states of effects below 2^62 (64 bits hold 2^63)",
        ],
        "glue": glue,
    }  # fmt: skip


def _float_fields(
    parameters: Parameters, cascade: StaticModel, options: Options, prefix: str, numbers: Tables | None = None
) -> dict[str, Any]:
    """`numbers`: of the plays in a model with effects."""
    name, real_t = parameters.name, f"{prefix}_real_t"
    corners = options.engine == "corners"
    chain = numbers is not None
    if numbers is None:
        numbers = float_tables.build_float(cascade, options.arithmetic, options.engine, True, True)
    dtype = numbers.threshold.dtype.type
    bounds = error_bounds(cascade, options.arithmetic, options.engine)
    stages = [stage(numbers, j, name, real_t, options) for j in range(len(numbers.stage_kind))]
    arrays = (
        _corner_fields(numbers, name, prefix, options, chain) if corners
        else _loop_fields(numbers, name, prefix, options)
    )  # fmt: skip
    own = [] if corners else [_loop_tables(_loop_pointers(name, options), numbers, name, prefix)]
    return {
        **_limits(numbers),
        "arrays": arrays,
        "beside": [*own, *(array for stage in stages for array in stage["arrays"])],
        "stages": stages,
        "fronts": bool(stages),
        "finer": False,
        "condition": "",
        "envelopes": any(stage["kind"] == "envelope" for stage in stages),
        "forward_max_error": operand(float_tables.upward(bounds.forward, dtype)),
        "inverse_max_error": operand(float_tables.upward(bounds.inverse, dtype)) if options.inverse else "",
        "inverse_rounding_error": operand(float_tables.upward(bounds.rounding, dtype)) if options.inverse else "",
        "saturates": False,
        "precision": [],
    }


_COLUMNS = (
    ("threshold", "threshold", True),
    ("inverse_slope", "reciprocal", False),
    ("weight", "weight", True),
    ("lift", "lift", False),
)
"""Fields of the tables of engine loop, what their arrays are called, and whether both operators read them."""


def _loop_fields(numbers: Tables, name: str, prefix: str, options: Options) -> list[str]:
    """The tables of engine loop: arrays in one structure, and the start memory."""
    real_t = f"{prefix}_real_t"
    members = [(own, list(getattr(numbers, field))) for field, own, both in _COLUMNS if both or options.inverse]
    arrays = [structure(real_t, f"{name}_play", members)]
    if len(numbers.start) > 1:
        arrays.append(table(real_t, f"{name}_model_start", list(numbers.start)))
    return arrays


def _loop_pointers(name: str, options: Options) -> list[str]:
    """Pointers to these arrays, NULL for those that nothing reads."""
    places = {field: f"{name}_play.{own}" for field, own, both in _COLUMNS if both or options.inverse}
    return [places.get(field, "NULL") for field in ("threshold", "weight", "lift", "inverse_slope")]


def _loop_tables(
    pointers: Sequence[str], numbers: Tables | FixedTables, name: str, prefix: str, whose: str = "model"
) -> str:
    """Pointers to the tables of engine loop."""
    entries = _lines([*pointers, str(len(numbers.threshold) - 1)])
    return constant(f"{prefix}_tables_t {name}_{whose}_tables", entries.splitlines())


def _corner_fields(numbers: Tables, name: str, prefix: str, options: Options, chain: bool) -> list[str]:
    """The tables of engine corners, one operator after the other; `chain`: of a model with effects."""
    arrays = []
    front = len(numbers.stage_kind) > 0 and not chain
    for operator, curve, starts, wanted in (
        ("forward", numbers.forward, (numbers.forward_first, numbers.forward_zero), options.forward),
        ("inverse", numbers.inverse, (numbers.inverse_first, numbers.inverse_zero), options.inverse),
    ):
        if wanted:
            arrays += _curve_tables(curve, starts, f"{name}_{operator}", prefix)
            if front:
                first = 2 * (operator == "inverse")
                drives = ", ".join(
                    f"{{{literal(numbers.applied[j])}, {literal(numbers.begin[j])}, "
                    f"{'true' if numbers.ascending[j] else 'false'}}}"
                    for j in (first, first + 1)
                )
                arrays.append(f"static const {prefix}_drive_t {name}_{operator}_first_drive[2] = {{{drives}}};\n")
    return arrays


def _lines(entries: Sequence[str]) -> str:
    """Entries of a table on as few lines as possible; an entry that fits on a line is not broken."""
    fitting = WIDTH - len("    ,")
    whole = ", ".join(entry.replace(" ", "\0") if len(entry) <= fitting else entry for entry in entries)
    lines = textwrap.wrap(whole, WIDTH, initial_indent="    ", subsequent_indent="    ", break_long_words=False)
    return "\n".join(lines).replace("\0", " ")


def _curve_tables(curve: Curve, starts: tuple[Start, Start], own: str, prefix: str) -> list[str]:
    """Segments, curve and start memories of one operator."""
    rows = zip(curve.way, curve.reach, curve.gain, curve.slope, strict=True)
    segments = _lines([f"{{{', '.join(map(literal, row))}}}" for row in rows])
    pairs = [f"{{{literal(pair[0])}, {literal(pair[1])}}}" for pair in (curve.limit, curve.inside, curve.range)]
    entries = _lines([f"{own}_segment", *pairs])
    found = [
        f"static const {prefix}_segment_t {own}_segment[{len(curve.way)}] = {{\n{segments}\n}};\n",
        constant(f"{prefix}_curve_t {own}_curve", entries.splitlines()),
    ]
    before: dict[str, str] = {}
    memories = []
    for start, memory in zip(starts, ("init", "reset"), strict=True):
        points = [f"{{{literal(point[0])}, {literal(point[1])}}}" for point in start.center]
        text = points[0] if len(points) == 1 else f"\n{_lines(points)}\n"
        if text not in before:  # after init and after reset plays may hold the same
            before[text] = f"{own}_{memory}_center"
            found.append(f"static const {prefix}_real_t {before[text]}[{len(points)}][2] = {{{text}}};\n")
        output, falling, rising = map(literal, start.bottom)
        memories.append(
            f"{{{before[text]}, {start.step}, {start.risen}, "
            f"{{{output}, {{{falling}, {rising}}}, {start.top}, {prefix.upper()}_BOTTOM}}}}"
        )
    found.append(
        f"static const {prefix}_start_t {own}_start[2] = {{\n" + ",\n".join(_lines([m]) for m in memories) + "\n};\n"
    )
    return found


def stage(
    numbers: StageTables, j: int, name: str, real_t: str, options: Options, where: str = "stage"
) -> dict[str, Any]:
    """A stage of the memoryless part, or of saturation: its kind, its tables, and how the chain names them and what
    they limit."""
    data = numbers.stage_data[int(numbers.stage_first[j]) :]
    own = f"{where}_{j + 1}"
    prefix = real_t.removesuffix("real_t")
    if numbers.stage_kind[j] == slots.TANH:
        ascending, descending = data[:7], data[7:14]
        branches = {own: ascending}
        place = f"&hystgen_{own}"
        if not np.array_equal(ascending, descending):
            branches = {f"{own}_ascending": ascending, f"{own}_descending": descending}
            place = f"ascending ? &hystgen_{own}_ascending : &hystgen_{own}_descending"
        words = "/* a0 tanh(a1 x + a2) + a3, then 1/a0, 1/a1 and the largest argument of atanh */\n"
        arrays = [
            f"{words}static const {prefix}envelope_t {name}_{branch} = {{\n{_lines(list(map(literal, row)))}\n}};\n"
            for branch, row in branches.items()
        ]
        return {"kind": "envelope", "arrays": arrays, "table": place, "limited": ", limited"}
    n = int(numbers.stage_size[j])
    arrays, pointers, first = [], [], 0
    parts = (("break_x", n), ("break_y", n), ("anchor_x", n + 1), ("anchor_y", n + 1), ("slope", n + 1))
    for part, size in (*parts, ("inverse_slope", n + 1)):
        unused = part in ("break_y", "inverse_slope") and not options.inverse
        if unused or not size:
            pointers.append("NULL")
        else:
            pointers.append(f"{name}_{own}_{part}")
            arrays.append(table(real_t, f"{name}_{own}_{part}", list(data[first : first + size])))
        first += size
    entries = _lines([*pointers, str(n)])
    words = "/* the straight pieces of the dead-zone sum */\n"
    arrays.append(f"{words}static const {prefix}dead_zone_t {name}_{own} = {{\n{entries}\n}};\n")
    return {"kind": "dead_zone", "arrays": arrays, "table": f"&hystgen_{own}", "limited": ""}


def _fixed_fields(parameters: Parameters, cascade: StaticModel, options: Options, prefix: str) -> dict[str, Any]:
    name, emit = parameters.name, parameters.emit
    corners = options.engine == "corners"
    numbers, form = fixed_tables.build(cascade, options.arithmetic, options.engine, emit.drive_lsb, emit.output_lsb)
    limits = numbers.limits
    arrays = (
        _fixed_corner_fields(numbers, name, prefix, options, False) if corners
        else _fixed_loop_fields(numbers, name, prefix, options)
    )  # fmt: skip
    own = [] if corners else [_loop_tables(_fixed_loop_pointers(numbers, name, options), numbers, name, prefix)]
    curves, counts = _curves(numbers, name, prefix, options) if numbers.fronts else ([], [])
    fine = int(limits[slots.FINE])
    precision = _precision(
        parameters, (form.drive_lsb, form.output_lsb), (form.forward_error, form.inverse_rounding),
        " on the same branch" if numbers.branches else "",
    )  # fmt: skip
    precision += [
        f"Range: every sum of products stays below 2^{(form.largest_sum - 1).bit_length()} in magnitude (64 bits hold "
        "2^63),",
        f"    inputs of plays between {limits[slots.PLAY_MIN]} and {limits[slots.PLAY_MAX]}, "
        f"{form.sum_bits} fraction bits of an output code",
    ]
    return {
        **_limits(numbers, _fixed_constants(numbers) + counts),
        "arrays": arrays,
        "beside": [*own, *curves],
        "stages": [],
        "fronts": bool(numbers.fronts),
        "envelopes": any(isinstance(stage, TanhEnvelope) for stage in cascade.stages),
        "finer": fine > 0,
        "condition": "",
        "saturates": bool(limits[slots.SATURATED] == limits[slots.CODE_MAX]),
        "drive_lsb": _physical(form.drive_lsb),
        "output_lsb": _physical(form.output_lsb),
        "forward_max_error": _decimal(form.forward_error),
        "inverse_max_error": _decimal(form.inverse_error) if options.inverse and form.inverse_error else "",
        "inverse_rounding_error": _decimal(form.inverse_rounding) if options.inverse and form.inverse_rounding else "",
        "precision": precision,
    }


def _precision(
    parameters: Parameters, lsb: tuple[Any, Any], errors: tuple[float, float | None], branch: str
) -> list[str]:
    """The size of codes, and how far answers are from the exact model."""
    units = (comment_text(unit) for unit in (parameters.units.input, parameters.units.output))
    drive, output = (f" {unit}" if unit else "" for unit in units)
    drive_lsb, output_lsb = (float(x) for x in lsb)
    forward, inverse = errors
    found = [
        f"Precision: a drive code is {drive_lsb:.6g}{drive}, an output code {output_lsb:.6g}{output}; "
        "against the exact model",
        f"    forward within {forward:.4g} output codes = {forward * output_lsb:.4g}{output}",
    ]
    if inverse is not None:
        found.append(f"    inverse within {inverse:.4g} drive codes = {inverse * drive_lsb:.4g}{drive}{branch}")
    return found


def _fixed_constants(numbers: FixedTables) -> list[tuple[str, str, str]]:
    """Numbers that functions name in fixed point alone."""
    limits = numbers.limits
    step = int(len(numbers.start) > 1)
    shy = "output codes that rounding can add: half a drive code, and an inexact reciprocal"
    return [
        ("START_STEP", str(step), "entries from play to play; reset takes 0 for each"),
        ("CODE_MAX", literal(limits[slots.CODE_MAX]), "the largest code of either sign"),
        ("FRACTION", f"{limits[slots.FRACTION]}u", "bits of a sum below an output code"),
        ("FINE", f"{limits[slots.FINE]}u", "bits of an input of the plays below a drive code"),
        ("SHY", literal(limits[slots.SHY]), shy),
    ]


_FIXED_COLUMNS = (("threshold", "play_t", True), ("weight", "int32_t", True), ("slope", "int32_t", False),
                  ("reciprocal", "uint32_t", False), ("shift", "uint8_t", False))  # fmt: skip
"""Fields of the tables of engine loop in fixed point, their types, and whether both operators read them."""


def _fixed_loop_fields(numbers: FixedTables, name: str, prefix: str, options: Options) -> list[str]:
    """The tables of engine loop and the start memory."""
    play_t = f"{prefix}_play_t"
    arrays = [
        table(play_t if kind == "play_t" else kind, f"{name}_{field}", list(getattr(numbers, field)))
        for field, kind, both in _FIXED_COLUMNS
        if both or options.inverse
    ]
    if len(numbers.start) > 1:
        arrays.append(table(play_t, f"{name}_model_start", list(numbers.start)))
    return arrays


def _fixed_loop_pointers(numbers: FixedTables, name: str, options: Options) -> list[str]:
    """Pointers to these tables, NULL for those that nothing reads, and the ends of the input of the plays."""
    margin = numbers.limits[slots.MARGIN]
    ends = (numbers.limits[slots.PLAY_MIN] - margin, numbers.limits[slots.PLAY_MAX] + margin)
    pointers = [f"{name}_{field}" if both or options.inverse else "NULL" for field, _, both in _FIXED_COLUMNS]
    return [*pointers, *map(literal, ends)]


def _fixed_corner_fields(numbers: FixedTables, name: str, prefix: str, options: Options, chain: bool) -> list[str]:
    """The tables of engine corners: one curve for both operators, and what a start memory is made of; `chain`: of a
    model with effects."""
    limits = numbers.limits
    never = (numbers.reach[-1], numbers.way[-1], 0, 0, 1)
    plays = (numbers.reach[:-1], numbers.way[:-1], numbers.slope[1:], numbers.reciprocal[1:], numbers.shift[1:])
    rows = ",\n".join(f"    {{{', '.join(map(literal, row))}}}" for row in [*zip(*plays, strict=True), never])
    most = (limits[slots.MARGIN] - limits[slots.PLAY_MIN], limits[slots.PLAY_MAX] + limits[slots.MARGIN])
    ends = f"{{{', '.join(map(literal, most))}}}"
    n = len(numbers.threshold) - 1
    parts = _lines([f"{name}_model_segment", literal(limits[slots.OFFSET]), ends, str(n)])
    arrays = [
        f"static const {prefix}_segment_t {name}_model_segment[{len(numbers.way)}] = {{\n{rows}\n}};\n",
        constant(f"{prefix}_curve_t {name}_model_curve", parts.splitlines()),
        table("int32_t", f"{name}_model_start", list(numbers.start)),
        table("int32_t", f"{name}_model_zero", list(numbers.zero)),
    ]
    for operator, first, wanted in (("forward", 0, options.forward), ("inverse", 2, options.inverse)):
        if wanted and numbers.fronts and not chain:
            drives = ", ".join(
                f"{{{literal(numbers.applied[j])}, {'true' if numbers.ascending[j] else 'false'}}}"
                for j in (first, first + 1)
            )
            arrays.append(f"static const {prefix}_drive_t {name}_{operator}_first_drive[2] = {{{drives}}};\n")
    return arrays


def _physical(x: Any) -> str:
    return repr(float(x))


def _decimal(x: float) -> str:
    """x in a few digits, rounded up."""
    digits = max(0, 5 - math.ceil(math.log10(x)))
    return repr(math.ceil(x * 10**digits) / 10**digits)


def _curves(
    numbers: FixedTables, name: str, prefix: str, options: Options
) -> tuple[list[str], list[tuple[str, str, str]]]:
    """The curves of the memoryless part in use: forward and, for an inverse, back; and their sizes."""
    arrays = []
    counts = [("DEGREE", f"{numbers.coefficient.shape[1] - 1}u", "of the polynomials of every curve")]
    directions = (("_ascending", 0), ("_descending", 1)) if numbers.branches else (("", 0),)
    kinds = (("front", FORWARD), ("back", INVERSE)) if options.inverse else (("front", FORWARD),)
    for kind, first in kinds:
        for direction, branch in directions:
            which = first + branch
            own = f"{name}_{kind}{direction}"
            here = int(numbers.first[which])
            there = here + int(numbers.pieces[which])
            words = "/* w = G[v] */\n" if kind == "front" else "/* v = G^-1[w] */\n"
            arrays += [
                words + table("int32_t", f"{own}_knot", list(numbers.knot[here:there])),
                table("uint8_t", f"{own}_scale", list(numbers.scale[here:there])),
                table("int32_t", f"{own}_coefficient", list(numbers.coefficient[here:there].ravel())),
            ]
            counts.append((f"{kind}{direction}_PIECES".upper(), f"{there - here}u", ""))
            if kind == "back":
                (low, high), (under, over) = numbers.domain[which], numbers.edge[which]
                ends = [*numbers.argument[which], low - under, high + over, low, high]
                entries = _lines(list(map(literal, ends)))
                arrays.append(constant(f"{prefix}_ends_t {own}_ends", entries.splitlines()))
    if options.inverse:
        counts.append(("BELOW", f"{int(numbers.below[INVERSE])}u", "bits of a curve back below a drive code"))
    return arrays, counts
