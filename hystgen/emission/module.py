"""From a model to the text of its C files."""

from __future__ import annotations

import functools
import textwrap
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import jinja2

from hystgen.basics.names import comment_text
from hystgen.basics.problems import NotInvertibleError
from hystgen.basics.version import __version__
from hystgen.chain.static import StaticModel
from hystgen.emission import banner, cost, numbers, runtime, selftest
from hystgen.emission.options import Options
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.parameters.files import Parameters, parameters_sha256

LICENCE_WIDTH = 100


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


def files(parameters: Parameters, cascade: StaticModel, options: Options) -> dict[str, str]:
    """File names and their ASCII text. Raises NotInvertibleError and tables.FormatError."""
    if options.inverse and cascade.inverse_problems():
        raise NotInvertibleError(cascade.inverse_problems())
    values = _values(parameters, cascade, options)
    name, shared = parameters.name, options.layout == "shared-runtime"
    single = options.layout == "single-header"

    made: dict[str, str] = {}
    implementation = _implementation(values)
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
    operators = selftest.operators(values.numbers, options)
    costs = _selftest_cost(options, values.cost, sum(len(each["samples"]) for each in operators))
    for ending, about, details in (
        (".h", f"checks {name} on the target", costs),
        (".c", "recorded samples and their exact answers", []),
    ):
        file = f"{name}_selftest{ending}"
        top = _banner(values, file, about, details)
        made[file] = render(f"selftest{ending}.j2", values, banner=top, operators=operators)
    return {file: banner.seal(_tidy(text)) for file, text in made.items()}


def _implementation(values: SimpleNamespace) -> str:
    """The operators with all that they need of the run time, but what a shared one has."""
    kind = "fixed" if values.fixed else "float"
    if values.engine == "loop":
        return render("step.c.j2", values, tables=render(f"tables_{kind}.c.j2", values))
    return render("corners.c.j2", values, tables=render(f"tables_corners_{kind}.c.j2", values))


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
    family = runtime.FAMILIES[arithmetic]
    return {
        "family": family,
        "fixed": family.fixed,
        "real": family.real,
        "reach": family.reach,
        "FLT": "FLT" if family.real == "float" else "DBL",
        "mantissa": 24 if family.real == "float" else 53,
        "soft": runtime.SOFT.get(family.bits),
        "runtime_file": f"hystgen_runtime_{family.bits}",
        "runtime_version": runtime.VERSION,
    }


def runtime_files(arithmetic: str) -> dict[str, str]:
    """The run time that all models of one arithmetic share; the same bytes for every model."""
    about = _arithmetic(arithmetic)
    family: runtime.Family = about["family"]
    prefix = "hystgen_" + family.bits
    values = SimpleNamespace(
        **about,
        rt=prefix,
        RT=prefix.upper(),
        version=__version__,
        command=f"hystgen emit PARAMS --arithmetic {arithmetic} --layout shared-runtime",
        sha256="does not depend on any",
    )
    file = about["runtime_file"]
    types = "\n".join(runtime.types(header, (), prefix, family) for header in (*family.states, *family.tables))
    return {
        f"{file}.h": render(
            "runtime.h.j2",
            values,
            banner=_banner(values, f"{file}.h", f"kernels shared by all {arithmetic} models"),
            types=types,
            prototypes=runtime.prototypes(prefix, family),
        ),
        f"{file}.c": render(
            "runtime.c.j2",
            values,
            banner=_banner(values, f"{file}.c", f"see {file}.h"),
            kernels=runtime.render(runtime.kernel_pieces(family), prefix, family, static=False),
        ),
    }


def _values(parameters: Parameters, cascade: StaticModel, options: Options) -> SimpleNamespace:
    name = parameters.name
    about = _arithmetic(options.arithmetic)
    shared = options.layout == "shared-runtime"
    prefix = "hystgen_" + about["family"].bits if shared else name
    corners = options.engine == "corners"
    n = cascade.pi.n
    values = SimpleNamespace(
        **about,
        **numbers.fields(parameters, cascade, options, prefix),
        name=name,
        NAME=name.upper(),
        rt=prefix,
        RT=prefix.upper(),
        shared=shared,
        single_header=options.layout == "single-header",
        version=__version__,
        command=_command(name, options),
        sha256=parameters_sha256(parameters),
        units=_units(parameters),
        n=n,
        engine=options.engine,
        forward=options.forward,
        inverse=options.inverse,
        branches=cascade.branches_differ,
    )
    values.state_types = values.operator_types = values.operators = ""
    if corners and not shared:
        headers = values.family.states
        values.state_types = "\n".join(runtime.types(header, (), prefix, values.family) for header in headers)
    if corners:
        states, sources = _operator_files(values, options)
        most = max(n, 1) if values.fixed else n + 1
        values.operator_types = runtime.operators(states, name, most, prefix, values.family)
        values.operators = runtime.operators(sources, name, most, prefix, values.family)
    kernels = _kernels(values, options)
    values.kernels = "" if shared else kernels
    values.cost = _cost(cascade, options, values, kernels)
    values.details = _details(parameters, cascade, options, values)
    return values


def _command(name: str, options: Options) -> str:
    return f"hystgen emit {name}.yaml {' '.join(f'--{key} {getattr(options, key)}' for key in banner.OPTIONS)}"


def _units(parameters: Parameters) -> SimpleNamespace:
    drive, output = comment_text(parameters.units.input), comment_text(parameters.units.output)
    return SimpleNamespace(
        drive=f", {drive}" if drive else "",
        output=f", {output}" if output else "",
        drive_words=f"Drive in {drive}" if drive else "Drive in the units of the parameter file",
        output_words=f"output and reference in {output}" if output else "output and reference likewise",
    )


def _operator_files(values: SimpleNamespace, options: Options) -> tuple[list[str], list[str]]:
    """The files of the run time that have the operators of the corner engine: their types, and their functions."""
    front = "_front" if values.fronts else ""
    kind = "_fixed" if values.fixed else ""
    states, sources = [], ["clamp_fixed.c"] if values.fixed else []
    if options.forward:
        states.append(f"hystgen_forward{front}{kind}_state.h")
        sources.append(f"forward{front}{kind}.c")
    if options.inverse:
        states.append(f"hystgen_inverse{front}{kind}_state.h")
        if not values.fixed:
            sources.append("clamp_drive.c")
        if values.fronts:
            sources.append("inverse_two_branches.c" if values.branches else "inverse_one_branch.c")
        elif values.fixed:
            sources.append("inverse_finer.c" if values.fine else "inverse_whole.c")
        sources.append(f"inverse{front}{kind}.c")
    return states, sources


def _corner_roots(values: SimpleNamespace, options: Options) -> set[str]:
    """The functions of the run time that the operators of the corner engine call, but those of the front."""
    roots = {"hystgen_start"}
    if values.fixed:
        if options.forward:
            roots.add("hystgen_plays_step")
        if options.inverse:
            roots |= {"hystgen_copy_place", "hystgen_move_to_input", "hystgen_solve", "hystgen_move_to_solution"}
            if not values.fronts:
                roots |= {"hystgen_wide", "hystgen_over_slope"}
        return roots
    if options.forward or values.fronts:
        roots.add("hystgen_plays_step")
    if options.inverse:
        kernels = ("move_to_output", "move_to_input", "move_in_block", "forget_line", "copy_place")
        roots |= {f"hystgen_{kernel}" for kernel in kernels}
    return roots


def _loop_roots(values: SimpleNamespace, options: Options) -> set[str]:
    """The same of engine loop."""
    roots = {"hystgen_loop_rest", "hystgen_loop_absorb"}
    if values.start_list:
        roots.add("hystgen_loop_start")
    if options.forward or values.branches:
        roots.add("hystgen_loop_output")
    if options.inverse:
        roots.add("hystgen_loop_solve")
    return roots


def _kernels(values: SimpleNamespace, options: Options) -> str:
    """What the model needs of the run time, for a file of its own."""
    family: runtime.Family = values.family
    corners = options.engine == "corners"
    roots = _corner_roots(values, options) if corners else _loop_roots(values, options)
    types = {f"hystgen_{stage['kind']}_t" for stage in values.stages}
    if corners:
        types |= {"hystgen_segment_t", "hystgen_curve_t", *(() if values.fixed else ("hystgen_start_t",))}
        types |= {"hystgen_drive_t"} if values.fronts else set()
    else:
        types.add("hystgen_tables_t")
    for stage in values.stages:
        roots |= {f"hystgen_{stage['kind']}_{way}" for way in ("forward", *(["inverse"] if options.inverse else []))}
    if values.fixed:
        if options.forward or values.branches or (corners and values.fronts):
            roots.add("hystgen_nearest")
        if values.fronts:
            roots |= {"hystgen_nearest", "hystgen_curve", "hystgen_beyond"} if options.inverse else {"hystgen_curve"}
            types |= {"hystgen_ends_t"} if options.inverse else set()
    pieces = runtime.needed(runtime.kernel_pieces(family), sorted(roots))
    headers = family.tables if corners else family.tables[-1:]
    if corners and values.fixed and not types & {"hystgen_ends_t"}:
        headers = headers[:1]
    text = "\n".join(runtime.types(header, types, values.rt, family) for header in headers)
    return text + "\n" + runtime.render(pieces, values.rt, family, static=True)


def cost_of(parameters: Parameters, cascade: StaticModel, options: Options) -> cost.Cost:
    """What the emitted model costs, as its banner says."""
    found: cost.Cost = _values(parameters, cascade, options).cost
    return found


def _cost(cascade: StaticModel, options: Options, values: SimpleNamespace, kernels: str) -> cost.Cost:
    text = _implementation(values) + (kernels if values.shared else "")
    return cost.estimate(cascade, options, values.numbers, text, "".join(values.arrays))


def _selftest_cost(options: Options, found: cost.Cost, samples: int) -> list[str]:
    constants, instance = cost.selftest_bytes(options, found.memory, samples, cost.CORE_32)
    lines = ["", f"Cost (32-bit target): {constants} bytes of constants, {instance} bytes of RAM for its own instance"]
    if found.avr is not None:
        both = sum(cost.selftest_bytes(options, found.avr, samples, cost.AVR))
        lines.append(f"On an 8-bit AVR constants lie in RAM too: {both} bytes of RAM in all")
    return lines


def _details(parameters: Parameters, cascade: StaticModel, options: Options, values: SimpleNamespace) -> list[str]:
    about = comment_text(parameters.description)
    kinds = ["tanh envelope" if isinstance(stage, TanhEnvelope) else "dead zone" for stage in cascade.stages]
    model = f"{cascade.pi.n} plays" + (f" behind {', '.join(kinds)}" if kinds else "")
    estimate: cost.Cost = values.cost
    avr = [] if estimate.avr is None else [
        f"On an 8-bit AVR constants lie in RAM too: at most {estimate.avr.all} bytes of RAM in all, "
        f"{estimate.avr.play} of them for each play"
    ]  # fmt: skip
    rounding = "" if values.fixed else (
        " Not for targets that flush denormal numbers to zero or round other than to nearest, nor for flags that "
        "reorder sums (-fassociative-math) or contract products whatever the source says (clang's "
        "-ffp-contract=fast): there the answers can differ from the reference in the last bits."
    )
    single = f" Define {values.NAME}_IMPLEMENTATION in one C file before including this header."
    use = (
        "Use: one instance per actuator, init once, then step from one context only. init takes the start memory of "
        f"the parameter file; reset starts again from plays at 0.{single if values.single_header else ''}{rounding}"
    )
    return [
        "",
        *([about] if about else []),
        f"Model: {model}; arithmetic {options.arithmetic}; engine {options.engine}; operator {options.operator}; "
        f"layout {options.layout}",
        *([""] if values.precision else []),
        *values.precision,
        "",
        "Cost (32-bit target):",
        f"    code at -O2       about {estimate.code_words}, as measured for such a model",
        f"    constant tables   {estimate.memory.tables} bytes",
        *(f"    {op} instance  {size} bytes of RAM" for op, size in estimate.memory.instances),
        *(f"    {op} step, worst case: {words}" for op, words in estimate.worst_case),
        *avr,
        "",
        *textwrap.wrap(use, 108),
    ]
