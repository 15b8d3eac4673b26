"""From a model to the text of its C files."""

from __future__ import annotations

import dataclasses
import functools
import re
import textwrap
from collections.abc import Sequence
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import jinja2
import numpy as np

from hystgen.basics.version import __version__
from hystgen.chain.static import StaticModel
from hystgen.compensator.bounds import UNSLEWED, together
from hystgen.emission import chain, cost, interface, numbers, runtime, selftest, words
from hystgen.emission.options import OPTIONS, Options, seal
from hystgen.emission.text import WIDTH, comment_text, define, fit, literal
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.parameters.files import Parameters, parameters_sha256
from hystgen.plays import slots

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import Compiled

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
    """File names and their ASCII text. Raises tables.FormatError."""
    return emitted(parameters, cascade, options)[0]


def emitted(
    parameters: Parameters, cascade: StaticModel, options: Options, sha256: str | None = None
) -> tuple[dict[str, str], list[str]]:
    """File names and their ASCII text, and sentences of the banner on what makes the inverse of little use.

    `sha256`: hash of the parameters in the file, by default of `parameters`. Raises tables.FormatError.
    """
    values = values_of(parameters, cascade, options)
    values.sha256 = sha256 or parameters_sha256(parameters)
    name, shared = parameters.name, options.layout == "shared-runtime"
    single = options.layout == "single-header"

    made: dict[str, str] = {}
    implementation = _implementation(values)
    header = f"{name}.h"
    what = {"both": "forward and inverse operator", "forward": "forward operator", "inverse": "inverse operator"}
    made[header] = render(
        "module.h.j2",
        values,
        banner=banner_of(values, header, what[options.operator] + f" of {name}", values.details),
        implementation=implementation if single else "",
    )
    if not single:
        source = f"{name}.c"
        made[source] = render(
            "module.c.j2", values, banner=banner_of(values, source, f"see {header}"), implementation=implementation
        )
    if shared:
        made.update(runtime_files(options.arithmetic))
    operators = selftest.operators(values.numbers, options, values.calls)
    costs = _selftest_cost(options, values.cost, sum(len(each["samples"]) for each in operators))
    for ending, about, details in (
        (".h", f"checks {name} on the target", costs),
        (".c", "recorded samples and their exact answers", []),
    ):
        file = f"{name}_selftest{ending}"
        top = banner_of(values, file, about, details)
        made[file] = render(f"selftest{ending}.j2", values, banner=top, operators=operators, unread=slots.OP_UNREAD)
    return {file: seal(_tidy(fit(text))) for file, text in made.items()}, values.doubts


def _implementation(values: SimpleNamespace) -> str:
    """The operators with the parts of the run time that they need, except those in a shared one."""
    family: runtime.Family = values.family
    single = values.single_header
    opening, apart, closing = (
        runtime.verbatim(files, values.name, family, values.name)
        for files in (
            (*(family.opening_apart if single else ()), *family.opening),
            (*family.soft(values.kernels), "arithmetic/storage.h"),
            family.closing if single else (),
        )
    )
    tables = render("tables.c.j2", values)
    code = (values.kernels, values.types, tables, values.operators)
    return "\n".join((words.overview("\n".join(code)), opening, apart, *code, closing))


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


def banner_of(values: SimpleNamespace, file: str, what: str, details: Sequence[str] = ()) -> str:
    width = WIDTH - len(" * ")
    lines = []
    for line in details:
        hang = " " * 8 if line.startswith(" ") else ""
        lines += textwrap.wrap(line, width, subsequent_indent=hang, break_on_hyphens=False) or [""]
    whole = re.sub(r"(--\w+) ", "\\1\0", values.command)  # an option and its value stay together
    command = textwrap.wrap(whole, width - len("     \\"), subsequent_indent=" " * 4, break_on_hyphens=False)
    more = {"file": file, "what": what, "details": lines, "command": " \\\n *     ".join(command).replace("\0", " ")}
    return render("banner.c.j2", values, **more).rstrip("\n")


def _arithmetic(arithmetic: str) -> dict[str, Any]:
    family = runtime.FAMILIES[arithmetic]
    return {
        "family": family,
        "fixed": family.fixed,
        "real": family.real,
        "includes": family.includes,
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

    def whole(*names: str) -> str:
        return runtime.verbatim(names, file, family, prefix)

    kernels = runtime.render(runtime.kernel_pieces(family), prefix, family, static=False)
    return {
        f"{file}.h": render(
            "runtime.h.j2",
            values,
            banner=banner_of(values, f"{file}.h", f"kernels shared by all {arithmetic} models"),
            build=whole(*family.build),
            typedefs=[(family.real, "real_t"), *((kind, own) for own, kind in family.types.items())],
            types=runtime.all_types((*family.states, *family.tables), prefix, family),
            prototypes=runtime.prototypes(prefix, family),
        ),
        f"{file}.c": render(
            "runtime.c.j2",
            values,
            banner=banner_of(values, f"{file}.c", f"see {file}.h"),
            implementation="\n".join(
                [words.overview(kernels), whole(*family.opening),
                 whole(*family.soft(kernels), "arithmetic/storage.h"), kernels]
            ),
        ),
    }


def values_of(parameters: Parameters, cascade: StaticModel, options: Options) -> SimpleNamespace:
    """Values for the templates, from which the cost is counted too."""
    name = parameters.name
    about = _arithmetic(options.arithmetic)
    shared = options.layout == "shared-runtime"
    prefix = "hystgen_" + about["family"].bits if shared else name
    corners = options.engine == "corners"
    n = cascade.pi.n
    compiled: Compiled | None = None
    if parameters.model.effects:
        from hystgen.emission import doubts, effects, own

        compiled = effects.compiled(parameters, cascade, options)
    about["family"] = dataclasses.replace(
        about["family"], chain=compiled is not None, loop=compiled is None and options.engine == "loop"
    )
    values = SimpleNamespace(
        **about,
        **(numbers.chain_fields(parameters, compiled, options, prefix) if compiled
           else numbers.fields(parameters, cascade, options, prefix)),
        name=name,
        NAME=name.upper(),
        rt=prefix,
        RT=prefix.upper(),
        shared=shared,
        single_header=options.layout == "single-header",
        version=__version__,
        version_number=_version_number(),
        command=_command(parameters, options),
        units=_units(parameters),
        n=n,
        engine=options.engine,
        forward=options.forward,
        inverse=options.inverse,
        branches=cascade.branches_differ,
    )
    family: runtime.Family = values.family
    values.variant = runtime.Variant(
        options.engine, values.fixed, values.fronts, values.branches, values.finer, values.saturates, values.start_list,
        compiled is not None, compiled is not None and bool(compiled.tables.slew),
        compiled is not None and bool(compiled.tables.braked), compiled is not None and bool(compiled.tables.quiet),
        compiled is not None and bool(compiled.tables.turning),
        compiled is not None and compiled.tables.number_of("delay") > 0,
        compiled is not None and "travel" in compiled.tables.calls, *(chain.plays(compiled.tables) if compiled else ()),
    )  # fmt: skip
    glue: chain.Glue | None = getattr(values, "glue", None)
    kind = np.float64 if values.fixed else np.dtype(values.family.arithmetic.number).type
    values.timing = _timing(parameters, kind)
    values.reading, values.doubts = [], []
    own_types: list[runtime.Piece] = []
    own_functions: list[runtime.Piece] = []
    if compiled:
        values.timing += effects.times(compiled, kind)
        own_types, own_functions = own.pieces(compiled.tables)
        if options.inverse:
            values.reading = effects.reading(compiled, parameters.units, values.units.drive.replace(",", ""))
            values.doubts = doubts.found(parameters, compiled)
    values.doubts += _unbounded(values) if options.inverse else []
    operators = [op for op in ("forward", "inverse") if getattr(options, op)]
    values.corners = (max(n, 1) if values.fixed else n + 1) if corners else 0
    front = render("front.c.j2", values) if values.stages else ""
    values.functions = front + "\n" + glue.functions if glue else front
    values.calls = calls = glue.calls if glue else {}
    pieces = runtime.operator_pieces(values.variant, family, operators, values.functions, calls, own_functions)
    kernels = runtime.needed(
        [*runtime.table_pieces(family), *runtime.kernel_pieces(family)], sorted(runtime.used(pieces))
    )
    carried = runtime.carried(family, pieces) if shared else []
    values.operators = runtime.render_operators(pieces, name, values.corners, prefix, family, carried)
    values.types = ""
    values.instances = glue.states if glue else {}  # whole, as the files of the run time name their fields
    if glue:
        glue = values.glue = chain.with_fields(glue, {op: runtime.fields(pieces, op) for op in operators})
        types = runtime.chain_types(own_types, "\n".join(glue.states.values()), family)
        states = runtime.needed(types, [f"hystgen_{op}_t" for op in operators])
        tabled = runtime.needed(types, sorted(runtime.used(pieces)))
        tables = [piece for piece in tabled if piece not in states]
        values.types = runtime.render_operators(tables, name, 0, prefix, family)
    else:
        states = runtime.state_pieces(values.variant, family, operators, pieces)
    values.states = runtime.render_operators(states, name, values.corners, prefix, family)
    if corners and not shared:
        values.states = runtime.all_types(family.states, prefix, family) + "\n" + values.states
    values.every = [*values.arrays, *values.beside]
    for kind in ("arrays", "beside"):
        setattr(values, kind, _named_by(getattr(values, kind), values.operators, values.every))
    values.build = runtime.verbatim(family.build, name, family, name)
    values.typedefs = _typedefs(values)
    values.limits = _limits(values)
    values.status = _status(values)
    values.macros = _macros(values)
    text = runtime.render(kernels, prefix, family, static=True)
    values.kernels = runtime.render_carried(carried, name, prefix, family) if shared else text
    types = [*runtime.memory_pieces(family), *runtime.table_pieces(family), *([] if glue else states)]
    values.cost = _cost(cascade, options, values, text, types)
    values.api = runtime.api(
        operators, name, prefix, family, calls, lambda pieces: interface.documented(pieces, values)
    )
    values.details = _details(parameters, cascade, options, values)
    return values


def _named_by(tables: Sequence[str], operators: str, every: Sequence[str]) -> list[str]:
    """The tables that functions name, or another of `every` that they name."""
    name = re.compile(r"(\w+)(?:\[\w+\])* = \{")
    named = set(re.findall(r"\w+", operators))
    for text in reversed(every):  # those that others name stand before them
        found = name.search(text)
        if found is None or found[1] in named:
            named |= set(re.findall(r"\w+", text))
    return [text for text in tables if (found := name.search(text)) is None or found[1] in named]


def _typedefs(values: SimpleNamespace) -> list[str]:
    """The types of a model's numbers, those of plays and sums too unless a shared run time has them."""
    real = f"typedef {values.real} {values.name}_real_t;"
    if not values.fixed:
        return [f"/* {values.units.drive_words}; {values.units.output_words} */", real]
    codes = (
        f"/* Codes: a drive code is {values.NAME}_DRIVE_LSB{values.units.drive}, an output code "
        f"{values.NAME}_OUTPUT_LSB{values.units.output} */"
    )
    words = "/* Inputs of the plays, where plays start to follow, and outputs before they are rounded */"
    types = [f"typedef {kind} {values.name}_{own};" for own, kind in values.family.types.items()]
    return [codes, real, *([] if values.shared else [words, *types])]


def _limits(values: SimpleNamespace) -> list[str]:
    """The macros of the header that a model's numbers are in."""
    bound = "against the double model, "
    lsb = "_LSB" * values.fixed
    drive, output = ("drive codes", "output codes") if values.fixed else (
        f"drive{values.units.drive}", f"output{values.units.output}"
    )  # fmt: skip
    found = [("N_PLAYS", str(values.n), ""), *values.timing]
    if values.fixed:
        found += [("DRIVE_LSB", values.drive_lsb, "physical units a code; code 0 is 0"),
                  ("OUTPUT_LSB", values.output_lsb, "")]  # fmt: skip
    found += [
        ("DRIVE_MIN", values.drive_min, drive),
        ("DRIVE_MAX", values.drive_max, ""),
        ("OUTPUT_MIN", values.output_min, f"{output}, over every drive history in range"),
        ("OUTPUT_MAX", values.output_max, ""),
    ]
    if values.forward:
        found.append((f"FORWARD_MAX_ERROR{lsb}", values.forward_max_error, bound + output))
    if values.inverse:
        found.append((f"INVERSE_MAX_ERROR{lsb}", values.inverse_max_error, bound + drive))
    branch, condition = _conditions(values)
    apart = condition and values.inverse_rounding_error != values.inverse_max_error
    if values.inverse and (values.branches or apart):
        words = f"the same while {together(branch, condition)}"
        found.append((f"INVERSE_ROUNDING_ERROR{lsb}", values.inverse_rounding_error, words))
    return [define(f"{values.NAME}_{name}", value, comment) for name, value, comment in found]


def _conditions(values: SimpleNamespace) -> tuple[str, str]:
    """The conditions of NAME_INVERSE_ROUNDING_ERROR in words: of two branches, and of the memory; empty ones do not
    matter."""
    branch = "both take the same branch" if values.branches else ""
    return branch, values.condition or UNSLEWED * values.variant.slew


def _unbounded(values: SimpleNamespace) -> list[str]:
    """A bound of the inverse's error that says nothing."""
    limits = values.numbers.limits
    whole = float(limits[slots.DRIVE_MAX]) - float(limits[slots.DRIVE_MIN])
    bounds = [float(text.rstrip("f")) for text in (values.inverse_max_error, values.inverse_rounding_error)]
    if bounds[0] < whole:
        return []
    lsb, unit = "_LSB" * values.fixed, " codes" if values.fixed else values.units.drive.replace(",", "")
    said = f"Error: {values.NAME}_INVERSE_MAX_ERROR{lsb} is the whole range of the drive, {whole:.4g}{unit}"
    if bounds[1] < whole:
        return [f"{said}; at most {bounds[1]:.3g}{unit} while {together(*_conditions(values))}"]
    return [f"{said}: no drive is near the exact one for certain"]


def _version_number() -> int:
    """The version as a number that the preprocessor can compare; what is not final counts as its release."""
    major, minor, patch = map(int, re.findall(r"\d+", __version__)[:3])
    return 10000 * major + 100 * minor + patch


def _timing(parameters: Parameters, kind: type[np.floating[Any]]) -> list[tuple[str, str, str]]:
    """The macro of the sample time, if there is one."""
    period = parameters.sample_time
    return [] if period is None else [("SAMPLE_TIME", literal(kind(period)), "s, from step to step")]


def _status(values: SimpleNamespace) -> list[str]:
    """The bits of the status functions."""
    limited = "inverse: the drive was limited to the drive range"
    found = [
        ("INPUT_CLAMPED", 1, "the input was out of range and was limited"),
        ("OUTPUT_CLAMPED", 2, limited + "; forward: the output to its codes" * values.saturates),
        ("HELD", 4, "never set: every code is a number" if values.fixed
         else "NaN or infinite input: the last answer was held"),
        ("DOMAIN", 8, "inverse: the argument of an envelope was limited" if values.envelopes
         else "never set: no envelope limits an argument"),
        *([("SLEW_LIMITED", 16, "the drive was kept within its rate" if values.variant.slew
            else "never set: nothing limits the drive's rate"),
           ("LIMITED_SETTING", 32, "an offset, gain or temperature was limited")] if values.variant.chain else []),
    ]  # fmt: skip
    return [define(f"{values.NAME}_STATUS_{name}", f"{bit}u", comment) for name, bit, comment in found]


def _macros(values: SimpleNamespace) -> list[str]:
    """The numbers of the model that its functions use."""
    return [
        define(f"{values.NAME}_{name}", value, comment)
        for name, value, comment in values.constants
        if f"{values.NAME}_{name}" in values.operators
    ]


def _command(parameters: Parameters, options: Options) -> str:
    more = " --allow-partial" * bool(options.left_out)
    if parameters.model.effects:
        from hystgen.emission import effects

        more += effects.sources(parameters)
    chosen = " ".join(f"--{key} {getattr(options, key)}" for key in OPTIONS)
    return f"hystgen emit {parameters.name}.yaml {chosen}{more}"


def _units(parameters: Parameters) -> SimpleNamespace:
    drive, output = comment_text(parameters.units.input), comment_text(parameters.units.output)
    return SimpleNamespace(
        drive=f", {drive}" if drive else "",
        output=f", {output}" if output else "",
        drive_words=f"Drive in {drive}" if drive else "Drive in the units of the parameter file",
        output_words=f"output and reference in {output}" if output else "output and reference likewise",
    )


def calls_of(parameters: Parameters, cascade: StaticModel, options: Options) -> dict[str, list[str]]:
    """By operator, the functions that a model with effects has in addition to those of every model."""
    glue: chain.Glue | None = getattr(values_of(parameters, cascade, options), "glue", None)
    return glue.calls if glue else {}


def reading_of(parameters: Parameters, cascade: StaticModel, options: Options) -> list[str]:
    """How the inverse of a model with effects reads the reference, as in its banner: one sentence for each option."""
    found: list[str] = values_of(parameters, cascade, options).reading
    return found


def cost_of(parameters: Parameters, cascade: StaticModel, options: Options) -> cost.Cost:
    """The cost of the emitted model, as in its banner."""
    found: cost.Cost = values_of(parameters, cascade, options).cost
    return found


def _cost(
    cascade: StaticModel, options: Options, values: SimpleNamespace, kernels: str, types: Sequence[runtime.Piece]
) -> cost.Cost:
    text = _implementation(values) + (kernels if values.shared else "")
    glue: chain.Glue | None = getattr(values, "glue", None)
    fields = glue.fields if glue else {}
    return cost.estimate(cascade, options, values.numbers, text, "".join(values.arrays), types, fields)


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
    model = f"{cascade.pi.n} play{'' if cascade.pi.n == 1 else 's'}" + (f" behind {', '.join(kinds)}" if kinds else "")
    names = dict.fromkeys(effect.name for effect in parameters.model.effects)
    model += f"; effects {', '.join(names)}" if names else ""
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
    shapes = ((effect.name, getattr(effect, "shape", "")) for effect in parameters.model.effects if effect.block)
    blocks = dict.fromkeys(f"{name} ({shape})" if shape else name for name, shape in shapes)
    uncounted = f" without {' and '.join(blocks)}" if blocks else ""
    return [
        "",
        *([about] if about else []),
        f"Model: {model}; arithmetic {options.arithmetic}; engine {options.engine}; operator {options.operator}; "
        f"layout {options.layout}",
        *(f"Not compensated: {words}" for words in options.left_out),
        *values.reading,
        *values.doubts,
        *([""] if values.precision else []),
        *values.precision,
        "",
        "Cost (32-bit target):",
        f"    code at -O2       about {estimate.code_words}, as measured for such a model with 10 plays"
        f"{uncounted}",
        f"    constant tables   {estimate.memory.tables} bytes",
        *(f"    {op} instance  {size} bytes of RAM" for op, size in estimate.memory.instances),
        *(f"    {op} step, worst case: {words}" for op, words in estimate.worst_case),
        *(f"    {op} step, dearest: about {estimate.dearest_words(op)}, as measured for such a model{uncounted}"
          for op, _ in estimate.worst_case),
        *avr,
        "",
        use,
    ]
