"""From a model to the text of its C files."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import jinja2
import numpy as np

import hystgen
from hystgen import reference, tables
from hystgen.bounds import error_bounds
from hystgen.emission import cost, runtime, selftest
from hystgen.emission.text import literal, operand, table
from hystgen.models import Cascade, NotInvertibleError
from hystgen.names import comment_text
from hystgen.params import Parameters, parameters_sha256

LAYOUTS = ("self-contained", "shared-runtime", "single-header")
OPERATORS = ("inverse", "forward", "both")
LICENCE_WIDTH = 100


@dataclass(frozen=True)
class Options:
    """What to emit: `operator` inverse, forward or both; `engine` corners or loop; see LAYOUTS for `layout`."""

    operator: str
    arithmetic: str
    engine: str
    layout: str

    @property
    def forward(self) -> bool:
        """Whether the forward operator is part of it."""
        return self.operator in ("forward", "both")

    @property
    def inverse(self) -> bool:
        """Whether the inverse operator is part of it."""
        return self.operator in ("inverse", "both")


@functools.cache
def _environment() -> jinja2.Environment:
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(runtime.data_folder("templates")),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )


def render(template: str, values: SimpleNamespace, **more: object) -> str:
    """A template of `templates/` with these values."""
    return _environment().get_template(template).render({**vars(values), **more})


def files(parameters: Parameters, cascade: Cascade, options: Options) -> dict[str, str]:
    """File names and their ASCII text. Raises NotInvertibleError and tables.FormatError."""
    if options.inverse and cascade.inverse_problems():
        raise NotInvertibleError(cascade.inverse_problems())
    values = _values(parameters, cascade, options)
    name, shared = parameters.name, options.layout == "shared-runtime"
    single = options.layout == "single-header"

    made: dict[str, str] = {}
    implementation = render("step.c.j2", values, tables=render("tables.c.j2", values))
    header = f"{name}.h"
    what = {"both": "forward and inverse operator", "forward": "forward operator", "inverse": "inverse operator"}
    made[header] = render(
        "module.h.j2",
        values,
        banner=_banner(values, header, what[options.operator] + f" of {name}", values.details),
        implementation=implementation if single else "",
    )
    if not single:
        source = f"{name}.c"
        made[source] = render(
            "module.c.j2", values, banner=_banner(values, source, f"see {header}"), implementation=implementation
        )
    if shared:
        made.update(runtime_files(options.arithmetic))
    samples = selftest.operators(values.numbers, options)
    for ending, about in ((".h", f"checks {name} on the target"), (".c", "recorded samples and their exact answers")):
        file = f"{name}_selftest{ending}"
        made[file] = render(f"selftest{ending}.j2", values, banner=_banner(values, file, about), operators=samples)
    return {file: _tidy(text) for file, text in made.items()}


def _tidy(text: str) -> str:
    """No trailing blanks, no runs of blank lines, one newline at the end."""
    lines: list[str] = []
    for line in text.splitlines():
        stripped = line.rstrip()
        if stripped or (lines and lines[-1]):
            lines.append(stripped)
    while lines and not lines[-1]:
        lines.pop()
    return "\n".join(lines) + "\n"


def _banner(values: SimpleNamespace, file: str, what: str, details: Sequence[str] = ()) -> str:
    return render("banner.c.j2", values, file=file, what=what, details=details).rstrip("\n")


def _arithmetic(arithmetic: str) -> dict[str, Any]:
    single = arithmetic == "float32"
    bits = "f32" if single else "f64"
    return {
        "bits": bits,
        "real": "float" if single else "double",
        "FLT": "FLT" if single else "DBL",
        "mantissa": 24 if single else 53,
        "runtime_file": f"hystgen_runtime_{bits}",
        "runtime_version": runtime.VERSION,
    }


def runtime_files(arithmetic: str) -> dict[str, str]:
    """The run time that all models of one arithmetic share; the same bytes for every model."""
    about = _arithmetic(arithmetic)
    prefix = "hystgen_" + about["bits"]
    values = SimpleNamespace(
        **about,
        rt=prefix,
        RT=prefix.upper(),
        version=hystgen.__version__,
        command=f"hystgen emit PARAMS --arithmetic {arithmetic} --layout shared-runtime",
        sha256="does not depend on any",
    )
    pieces = runtime.kernel_pieces(about["bits"])
    file = about["runtime_file"]
    types = runtime.types("hystgen_state.h", (), prefix) + "\n" + runtime.types("hystgen_tables.h", (), prefix)
    return {
        f"{file}.h": render(
            "runtime.h.j2",
            values,
            banner=_banner(values, f"{file}.h", f"kernels shared by all {arithmetic} models"),
            types=types,
            prototypes=runtime.prototypes(prefix),
        ),
        f"{file}.c": render(
            "runtime.c.j2",
            values,
            banner=_banner(values, f"{file}.c", f"see {file}.h"),
            kernels=runtime.render(pieces, prefix, about["FLT"] + "_MAX", static=False),
        ),
    }


def _values(parameters: Parameters, cascade: Cascade, options: Options) -> SimpleNamespace:
    name = parameters.name
    about = _arithmetic(options.arithmetic)
    shared = options.layout == "shared-runtime"
    prefix = "hystgen_" + about["bits"] if shared else name
    numbers = tables.build(cascade, options.arithmetic, options.engine)
    dtype = numbers.threshold.dtype.type
    limits = numbers.limits
    bounds = error_bounds(cascade, options.arithmetic, options.engine)
    real_t = f"{prefix}_real_t"
    corners = options.engine == "corners"
    n = cascade.pi.n

    arrays, pointers = [], []
    used = {"threshold": True, "weight": not corners, "slope": corners, "lift": corners or options.inverse}
    used["inverse_slope"] = options.inverse
    for array in ("threshold", "weight", "slope", "lift", "inverse_slope"):
        if used[array]:
            arrays.append(table(real_t, f"{name}_{array}", list(getattr(numbers, array))))
        pointers.append(f"{name}_{array}" if used[array] else "NULL")
    start_list = len(numbers.start) > 1
    if start_list:
        arrays.append(table(real_t, f"{name}_start", list(numbers.start)))
    stages = [_stage(numbers, j, name, real_t, options) for j in range(len(numbers.stage_kind))]

    values = SimpleNamespace(
        **about,
        name=name,
        NAME=name.upper(),
        rt=prefix,
        RT=prefix.upper(),
        shared=shared,
        single_header=options.layout == "single-header",
        version=hystgen.__version__,
        command=_command(name, options),
        sha256=parameters_sha256(parameters),
        units=_units(parameters),
        numbers=numbers,
        n=n,
        engine=options.engine,
        forward=options.forward,
        inverse=options.inverse,
        branches=cascade.branches_differ,
        stages=stages,
        envelopes=any(stage["kind"] == "envelope" for stage in stages),
        arrays=arrays,
        pointers=pointers,
        start_list=start_list,
        start=literal(numbers.start[0]),
        drive_min=operand(limits[reference.DRIVE_MIN]),
        drive_max=operand(limits[reference.DRIVE_MAX]),
        output_min=operand(limits[reference.OUTPUT_MIN]),
        output_max=operand(limits[reference.OUTPUT_MAX]),
        offset=operand(limits[reference.OFFSET]),
        start_applied=literal(limits[reference.START_APPLIED]),
        reset_applied=literal(limits[reference.RESET_APPLIED]),
        hold=operand(limits[reference.HOLD]),
        forward_max_error=operand(_upward(bounds.forward, dtype)),
        inverse_max_error=operand(_upward(bounds.inverse, dtype)) if options.inverse else "",
        memory_fields=_memory_fields(name, prefix, n, corners),
    )
    values.state_types = _state_types(values, prefix, corners)
    values.kernels = _kernels(values, options)
    values.details = _details(parameters, cascade, options, values, numbers)
    return values


def _upward(x: float, dtype: Any) -> Any:
    rounded = dtype(x)
    return rounded if float(rounded) >= x else np.nextafter(rounded, dtype(np.inf))


def _command(name: str, options: Options) -> str:
    return (
        f"hystgen emit {name}.yaml --operator {options.operator} --arithmetic {options.arithmetic} "
        f"--engine {options.engine} --layout {options.layout}"
    )


def _units(parameters: Parameters) -> SimpleNamespace:
    drive, output = comment_text(parameters.units.input), comment_text(parameters.units.output)
    return SimpleNamespace(
        drive=f", {drive}" if drive else "",
        output=f", {output}" if output else "",
        drive_words=f"Drive in {drive}" if drive else "Drive in the units of the parameter file",
        output_words=f"output and reference in {output}" if output else "output and reference likewise",
    )


def _memory_fields(name: str, prefix: str, n: int, corners: bool) -> str:
    if corners:
        return (
            f"    {prefix}_memory_t memory;\n"
            f"    {prefix}_corner_t corner[{max(n, 1)}];"
        )
    return f"    {name}_real_t play[{n + 1}]; /* play 0 is the input of the plays */"


def _state_types(values: SimpleNamespace, prefix: str, corners: bool) -> str:
    if values.shared or not corners:
        return ""
    return runtime.types("hystgen_state.h", (), prefix)


def _kernels(values: SimpleNamespace, options: Options) -> str:
    if values.shared:
        return ""
    engine = options.engine
    roots = {f"hystgen_{engine}_rest", f"hystgen_{engine}_absorb"}
    if values.start_list:
        roots.add(f"hystgen_{engine}_start")
    if options.forward or values.branches:
        roots.add(f"hystgen_{engine}_output")
    if options.inverse:
        roots.add(f"hystgen_{engine}_solve")
    for stage in values.stages:
        roots.add(f"hystgen_{stage['kind']}_forward")
        if options.inverse:
            roots.add(f"hystgen_{stage['kind']}_inverse")
    types = {"hystgen_tables_t"} | {f"hystgen_{stage['kind']}_t" for stage in values.stages}
    pieces = runtime.needed(runtime.kernel_pieces(values.bits), sorted(roots))
    return (
        runtime.types("hystgen_tables.h", types, values.rt)
        + "\n"
        + runtime.render(pieces, values.rt, values.FLT + "_MAX", static=True)
    )


def _stage(numbers: reference.Tables, j: int, name: str, real_t: str, options: Options) -> dict[str, Any]:
    data = numbers.stage_data[int(numbers.stage_first[j]) :]
    own = f"{name}_stage_{j + 1}"
    if numbers.stage_kind[j] == reference.TANH:
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


def _details(
    parameters: Parameters, cascade: Cascade, options: Options, values: SimpleNamespace, numbers: reference.Tables
) -> list[str]:
    about = comment_text(parameters.description)
    kinds = [stage["kind"].replace("_", " ") for stage in values.stages]
    model = f"{cascade.pi.n} plays" + (f" behind {', '.join(kinds)}" if kinds else "")
    estimate = cost.estimate(cascade, options, numbers)
    return [
        "",
        *([about] if about else []),
        f"Model: {model}; arithmetic {options.arithmetic}; engine {options.engine}; operator {options.operator}; "
        f"layout {options.layout}",
        "",
        "Cost, derived from the model (32-bit target):",
        f"    constant tables   {estimate.table_bytes} bytes",
        *(f"    {op} instance  {size} bytes of RAM" for op, size in estimate.instance_bytes),
        *(f"    {op} step, worst case: {words}" for op, words in estimate.worst_case),
        "",
        "Use: one instance per actuator, init once, then step from one context only. init takes the start memory of",
        "the parameter file; reset starts again from plays at 0. Not for targets that flush denormal numbers to zero",
        "or round other than to nearest: there the answers can differ from the reference in the last bits.",
    ]
