"""A model's numbers as C text: tables, limits and error bounds, for floating and for fixed point."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np

from hystgen.arithmetic import ARITHMETICS
from hystgen.basics.names import comment_text
from hystgen.chain.static import StaticModel
from hystgen.compensator import fixed_tables, float_tables
from hystgen.compensator.bounds import error_bounds
from hystgen.compensator.layout import FixedTables, Tables
from hystgen.emission.options import Options
from hystgen.emission.text import literal, operand, structure, table
from hystgen.front.curve import FORWARD, INVERSE
from hystgen.parameters.files import Parameters
from hystgen.plays import slots
from hystgen.plays.corners.memory import BOTTOM, Curve, Start


def fields(parameters: Parameters, cascade: StaticModel, options: Options, prefix: str) -> dict[str, Any]:
    """What the templates need to know of the numbers; `prefix` is that of the types of the run time."""
    if not ARITHMETICS[options.arithmetic].fixed:
        return _float_fields(parameters, cascade, options, prefix)
    return _fixed_fields(parameters, cascade, options, prefix)


def _limits(numbers: Tables | FixedTables) -> dict[str, Any]:
    """The places of `limits` that both kinds of arithmetic have."""
    limits = numbers.limits
    largest = limits[slots.CODE_MAX] if isinstance(numbers, FixedTables) else math.inf
    return {
        "numbers": numbers,
        # no code of the type lies beyond: a comparison would be always false
        "drive_can_exceed": limits[slots.DRIVE_MAX] < largest,
        "output_can_exceed": limits[slots.OUTPUT_MAX] < largest,
        "drive_min": operand(limits[slots.DRIVE_MIN]),
        "drive_max": operand(limits[slots.DRIVE_MAX]),
        "output_min": operand(limits[slots.OUTPUT_MIN]),
        "output_max": operand(limits[slots.OUTPUT_MAX]),
        "offset": operand(limits[slots.OFFSET]),
        "start": literal(numbers.start[0]),
        "start_list": len(numbers.start) > 1,
        "first_moves": {
            op: {
                call: (literal(numbers.applied[j]), "true" if numbers.ascending[j] else "false")
                for call, j in (("init", first), ("reset", first + 1))
            }
            for op, first in (("forward", 0), ("inverse", 2))
        },
        "hold": operand(limits[slots.HOLD]),
    }


def _float_fields(parameters: Parameters, cascade: StaticModel, options: Options, prefix: str) -> dict[str, Any]:
    name, real_t = parameters.name, f"{prefix}_real_t"
    corners = options.engine == "corners"
    numbers = float_tables.build_float(cascade, options.arithmetic, options.engine, True, True)
    dtype = numbers.threshold.dtype.type
    bounds = error_bounds(cascade, options.arithmetic, options.engine)
    stages = [_stage(numbers, j, name, real_t, options) for j in range(len(numbers.stage_kind))]
    engine = _corner_fields(numbers, name, prefix, options) if corners else _loop_fields(numbers, name, prefix, options)
    return {
        **_limits(numbers),
        **engine,
        "stages": stages,
        "fronts": bool(stages),
        "envelopes": any(stage["kind"] == "envelope" for stage in stages),
        "forward_max_error": operand(float_tables.upward(bounds.forward, dtype)),
        "inverse_max_error": operand(float_tables.upward(bounds.inverse, dtype)) if options.inverse else "",
        "inverse_rounding_error": operand(float_tables.upward(bounds.rounding, dtype)) if options.inverse else "",
        "wide_t": f"{name}_real_t",
        "play_t": f"{name}_real_t",
        "saturates": False,
        "precision": [],
    }


def _loop_fields(numbers: Tables, name: str, prefix: str, options: Options) -> dict[str, Any]:
    """The tables of engine loop: arrays in one structure, pointers to them, and the start memory."""
    real_t = f"{prefix}_real_t"
    columns = [
        ("threshold", "threshold", True),
        ("inverse_slope", "reciprocal", options.inverse),
        ("weight", "weight", True),
        ("lift", "lift", options.inverse),
    ]
    used = {field: own for field, own, wanted in columns if wanted}
    members = [(own, list(getattr(numbers, field))) for field, own in used.items()]
    arrays = [structure(real_t, f"{name}_play", members)]
    fields = ("threshold", "weight", "lift", "inverse_slope")
    pointers = [f"{name}_play.{used[field]}" if field in used else "NULL" for field in fields]
    if len(numbers.start) > 1:
        arrays.append(table(real_t, f"{name}_start", list(numbers.start)))
    return {"arrays": arrays, "pointers": pointers}


def _corner_fields(numbers: Tables, name: str, prefix: str, options: Options) -> dict[str, Any]:
    """The tables of engine corners, one operator after the other."""
    arrays = []
    front = len(numbers.stage_kind) > 0
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
                arrays.append(f"static const {prefix}_drive_t {name}_{operator}_drive[2] = {{{drives}}};\n")
    return {"arrays": arrays, "pointers": []}


def _lines(entries: Sequence[str]) -> str:
    """Entries of a table, none of them broken, on as few lines as they take."""
    whole = ", ".join(entry.replace(" ", "\0") for entry in entries)
    lines = textwrap.wrap(whole, 112, initial_indent="    ", subsequent_indent="    ", break_long_words=False)
    return "\n".join(lines).replace("\0", " ")


def _curve_tables(curve: Curve, starts: tuple[Start, Start], own: str, prefix: str) -> list[str]:
    """Segments, curve and start memories of one operator."""
    rows = zip(curve.way, curve.reach, curve.gain, curve.slope, strict=True)
    segments = _lines([f"{{{', '.join(map(literal, row))}}}" for row in rows])
    pairs = [f"{{{literal(pair[0])}, {literal(pair[1])}}}" for pair in (curve.limit, curve.inside, curve.range)]
    found = [
        f"static const {prefix}_segment_t {own}_segment[{len(curve.way)}] = {{\n{segments}\n}};\n",
        f"static const {prefix}_curve_t {own}_curve = {{\n    {own}_segment, {', '.join(pairs)}\n}};\n",
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
            f"    {{{before[text]}, {start.step}, {start.risen}, "
            f"{{{output}, {{{falling}, {rising}}}, {start.top}, {BOTTOM}}}}}"
        )
    found.append(
        f"static const {prefix}_start_t {own}_start[2] = {{\n" + ",\n".join(memories) + "\n};\n"
    )
    return found


def _stage(numbers: Tables, j: int, name: str, real_t: str, options: Options) -> dict[str, Any]:
    data = numbers.stage_data[int(numbers.stage_first[j]) :]
    own = f"{name}_stage_{j + 1}"
    if numbers.stage_kind[j] == slots.TANH:
        ascending, descending = data[:7], data[7:14]
        if np.array_equal(ascending, descending):
            branches = [{"name": own, "numbers": [literal(x) for x in ascending]}]
            place = f"&{own}"
        else:
            branches = [
                {"name": f"{own}_ascending", "numbers": [literal(x) for x in ascending]},
                {"name": f"{own}_descending", "numbers": [literal(x) for x in descending]},
            ]
            place = f"ascending ? &{own}_ascending : &{own}_descending"
        return {"kind": "envelope", "branches": branches, "table": place}
    n = int(numbers.stage_size[j])
    arrays, pointers, first = [], [], 0
    parts = (("break_x", n), ("break_y", n), ("anchor_x", n + 1), ("anchor_y", n + 1), ("slope", n + 1))
    for part, size in (*parts, ("inverse_slope", n + 1)):
        unused = part in ("break_y", "inverse_slope") and not options.inverse
        if unused or not size:
            pointers.append("NULL")
        else:
            pointers.append(f"{own}_{part}")
            arrays.append(table(real_t, f"{own}_{part}", list(data[first : first + size])))
        first += size
    return {"kind": "dead_zone", "name": own, "arrays": arrays, "pointers": pointers, "n": n, "table": f"&{own}"}


def _fixed_fields(parameters: Parameters, cascade: StaticModel, options: Options, prefix: str) -> dict[str, Any]:
    name, emit = parameters.name, parameters.emit
    corners = options.engine == "corners"
    numbers, form = fixed_tables.build(cascade, options.arithmetic, options.engine, emit.drive_lsb, emit.output_lsb)
    limits = numbers.limits
    engine = (_fixed_corner_fields if corners else _fixed_loop_fields)(numbers, name, prefix, options)
    fine = int(limits[slots.FINE])
    units = (comment_text(unit) for unit in (parameters.units.input, parameters.units.output))
    drive, output = (f" {unit}" if unit else "" for unit in units)
    precision = [
        f"Precision: a drive code is {float(form.drive_lsb):.6g}{drive}, an output code {float(form.output_lsb):.6g}"
        f"{output}; against the exact model",
        f"    forward within {form.forward_error:.4g} output codes = "
        f"{form.forward_error * float(form.output_lsb):.4g}{output}",
    ]
    if form.inverse_rounding is not None:
        precision.append(
            f"    inverse within {form.inverse_rounding:.4g} drive codes = "
            f"{form.inverse_rounding * float(form.drive_lsb):.4g}{drive}"
            + (" on the same branch" if numbers.branches else "")
        )
    precision += [
        f"Range: every sum of products stays below 2^{(form.largest_sum - 1).bit_length()} in magnitude (64 bits hold "
        "2^63),",
        f"    inputs of plays between {limits[slots.PLAY_MIN]} and {limits[slots.PLAY_MAX]}, "
        f"{form.sum_bits} fraction bits of an output code",
    ]
    return {
        **_limits(numbers),
        **engine,
        "stages": [],
        "fronts": bool(numbers.fronts),
        "fine": fine,
        "fine_factor": 2**fine,
        "fraction": int(limits[slots.FRACTION]),
        "code_max": int(limits[slots.CODE_MAX]),
        "saturates": bool(limits[slots.SATURATED] == limits[slots.CODE_MAX]),
        "curves": _curves(numbers, name, options) if numbers.fronts else {},
        "drive_lsb": _physical(form.drive_lsb),
        "output_lsb": _physical(form.output_lsb),
        "forward_max_error": _decimal(form.forward_error),
        "inverse_max_error": _decimal(form.inverse_error) if options.inverse and form.inverse_error else "",
        "inverse_rounding_error": _decimal(form.inverse_rounding) if options.inverse and form.inverse_rounding else "",
        "shy": int(limits[slots.SHY]),
        "half_code": 2**fine // 2,
        "wide_t": f"{prefix}_reach_t",
        "play_t": f"{prefix}_play_t",
        "precision": precision,
    }


def _fixed_loop_fields(numbers: FixedTables, name: str, prefix: str, options: Options) -> dict[str, Any]:
    """The tables of engine loop, pointers to them (NULL to those that nothing reads), and the start memory."""
    columns = [
        ("threshold", f"{prefix}_play_t", True),
        ("weight", "int32_t", True),
        ("slope", "int32_t", options.inverse),
        ("reciprocal", "uint32_t", options.inverse),
        ("shift", "uint8_t", options.inverse),
    ]
    arrays = [table(kind, f"{name}_{field}", list(getattr(numbers, field))) for field, kind, used in columns if used]
    if len(numbers.start) > 1:
        arrays.append(table(f"{prefix}_play_t", f"{name}_start", list(numbers.start)))
    margin = numbers.limits[slots.MARGIN]
    ends = (numbers.limits[slots.PLAY_MIN] - margin, numbers.limits[slots.PLAY_MAX] + margin)
    pointers = [f"{name}_{field}" if used else "NULL" for field, _, used in columns]
    return {"arrays": arrays, "pointers": [*pointers, *map(literal, ends)]}


def _fixed_corner_fields(numbers: FixedTables, name: str, prefix: str, options: Options) -> dict[str, Any]:
    """The tables of engine corners: one curve for both operators, and what a start memory is made of."""
    limits = numbers.limits
    never = (numbers.reach[-1], numbers.way[-1], 0, 0, 1)
    plays = (numbers.reach[:-1], numbers.way[:-1], numbers.slope[1:], numbers.reciprocal[1:], numbers.shift[1:])
    rows = ",\n".join(f"    {{{', '.join(map(literal, row))}}}" for row in [*zip(*plays, strict=True), never])
    most = (limits[slots.MARGIN] - limits[slots.PLAY_MIN], limits[slots.PLAY_MAX] + limits[slots.MARGIN])
    ends = f"{{{', '.join(map(literal, most))}}}"
    parts = f"{literal(limits[slots.OFFSET])}, {ends}, {len(numbers.threshold) - 1}"
    arrays = [
        f"static const {prefix}_segment_t {name}_model_segment[{len(numbers.way)}] = {{\n{rows}\n}};\n",
        f"static const {prefix}_curve_t {name}_model_curve = {{\n    {name}_model_segment, {parts}\n}};\n",
        table("int32_t", f"{name}_model_start", list(numbers.start)),
        table("int32_t", f"{name}_model_zero", list(numbers.zero)),
    ]
    for operator, first, wanted in (("forward", 0, options.forward), ("inverse", 2, options.inverse)):
        if wanted and numbers.fronts:
            drives = ", ".join(
                f"{{{literal(numbers.applied[j])}, {'true' if numbers.ascending[j] else 'false'}}}"
                for j in (first, first + 1)
            )
            arrays.append(f"static const {prefix}_drive_t {name}_{operator}_drive[2] = {{{drives}}};\n")
    return {"arrays": arrays, "pointers": []}


def _physical(x: Any) -> str:
    return repr(float(x))


def _decimal(x: float) -> str:
    """x in a few digits, rounded up."""
    digits = max(0, 5 - math.ceil(math.log10(x)))
    return repr(math.ceil(x * 10**digits) / 10**digits)


def _curves(numbers: FixedTables, name: str, options: Options) -> dict[str, dict[str, Any]]:
    """The curves of the memoryless part that are used: forward, and back where there is an inverse."""
    found = {}
    directions = (("_ascending", 0), ("_descending", 1)) if numbers.branches else (("", 0),)
    kinds = (("front", FORWARD), ("back", INVERSE)) if options.inverse else (("front", FORWARD),)
    for kind, first in kinds:
        for direction, branch in directions:
            which = first + branch
            own = f"{name}_{kind}{direction}"
            here = int(numbers.first[which])
            there = here + int(numbers.pieces[which])
            degree = numbers.coefficient.shape[1] - 1
            arrays = [
                table("int32_t", f"{own}_knot", list(numbers.knot[here:there])),
                table("uint8_t", f"{own}_scale", list(numbers.scale[here:there])),
                table("int32_t", f"{own}_coefficient", list(numbers.coefficient[here:there].ravel())),
            ]
            (low, high), (under, over) = numbers.domain[which], numbers.edge[which]
            ends = [*numbers.argument[which], low - under, high + over, low, high]
            found[f"{kind}{direction}"] = {
                "name": f"{kind}{direction}",
                "kind": kind,
                "arrays": arrays,
                "curve": f"{own}_knot, {own}_scale, {own}_coefficient, {there - here}, {degree}",
                "ends": ", ".join(literal(end) for end in ends) if kind == "back" else "",
                "below": int(numbers.below[which]),
            }
    return found
