"""Descriptions in a model's files: the banner, the header's macros and calls, and the glossary of the C."""

from __future__ import annotations

import re
import shlex
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from hystgen.arithmetic import ARITHMETICS
from hystgen.basics.problems import FormatError, duration
from hystgen.basics.version import __version__
from hystgen.compensator.bounds import UNSLEWED, together
from hystgen.compensator.converter import CodeLine
from hystgen.compensator.health import MODEL_LEFT
from hystgen.emission import cost, runtime
from hystgen.emission.compensator import EmittedModel, Macro, influence_macros
from hystgen.emission.cost import Cost
from hystgen.emission.options import OPTIONS, Options
from hystgen.emission.runtime import Piece
from hystgen.emission.text import WIDTH, Number, comment_text, define, literal, operand
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.parameters.files import Parameters

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import Compiled

# Banner

PERIODS = (50, 200)
"""[samples] Periods of the sines whose loss the header states: a fast one, as long as the fastest sweep with stated
bounds, and a slow one."""


def banner(file: str, what: str, command: str, sha256: str, details: Sequence[str] = ()) -> str:
    """A banner; `command`: the one that made the file; `sha256`: hash of the parameters; `details`: further lines."""
    width = WIDTH - len(" * ")
    lines = []
    for line in details:
        hang = " " * 8 if line.startswith(" ") else ""
        lines += textwrap.wrap(line, width, subsequent_indent=hang, break_on_hyphens=False) or [""]
    whole = re.sub(r"(--\w+) ", "\\1\0", command)  # an option and its value stay together
    words = textwrap.wrap(whole, width - len("     \\"), subsequent_indent=" " * 4, break_on_hyphens=False)
    return runtime.template(
        "banner.c.j2", file=file, what=what, version=__version__, sha256=sha256, details=lines,
        command=" \\\n *     ".join(words).replace("\0", " "),
    ).rstrip("\n")


def command(parameters: Parameters, options: Options) -> str:
    """The command that emits the model again."""
    origins: dict[str, None] = {}
    if effects := parameters.model.effects:
        from hystgen.effects import own as own_effects
        from hystgen.effects.base import USER

        origins = {own_effects.origin(type(each)): None for each in effects if each.name.startswith(USER)}
    more = " --health" * options.health + " --allow-partial" * bool(options.left_out)
    more += "".join(f" --effects {shlex.quote(each)}" for each in origins)
    chosen = " ".join(
        f"--{key} {getattr(options, key)}" for key in OPTIONS if getattr(options, key) != "constant"
    )
    return f"hystgen emit {parameters.name}.yaml {chosen}{more}"


def runtime_origin(arithmetic: str) -> tuple[str, str]:
    """For a shared run time: the command that emits it, and words for the hash of parameters."""
    return f"hystgen emit PARAMS --arithmetic {arithmetic} --layout shared-runtime", "none, the same for all"


def conditions(one: EmittedModel) -> tuple[str, str]:
    """The conditions for NAME_INVERSE_ROUNDING_ERROR in words, on branches and on memory; empty if there are none."""
    branch = "both take the same branch" if one.variant.branches else ""
    return branch, one.numbers.errors.condition or UNSLEWED * one.variant.slew


def unbounded(one: EmittedModel) -> list[str]:
    """A sentence if no bound on the inverse's error is known."""
    if (found := one.measured) is None:
        return []
    unit = one.form.unit(one.units.drive)
    said = (
        f"Accuracy: no bound of the inverse's error is known; the largest found in {found.samples} samples is "
        f"{found.error:.2g}{unit}"
    )
    rounding = float(one.numbers.errors.rounding)
    if found.confirms(rounding):
        said += f", and it is at most {rounding:.3g}{unit} while {together(*conditions(one))}"
    return [said]


def reading(one: EmittedModel) -> list[str]:
    """How the inverse reads the reference: one sentence for each option."""
    compiled = one.compiled
    if compiled is None or not one.options.inverse:
        return _converted(one)
    return [*_converted(one), *_averaged(compiled), *_branches(compiled, one.model.parameters), *_quiet(one, compiled)]


class _Reach(NamedTuple):
    """The range of a reference's codes and that of the model in words; the share of the codes inside the latter, and
    whether they cover it."""

    codes: str
    model: str
    inside: float
    whole: bool


def _reach(one: EmittedModel) -> _Reach | None:
    both, unit = one.model.parameters.emit.converter, one.units.output
    if one.conversion is None or both is None:
        return None
    lsb = float(one.numbers.lsb[1]) if one.numbers.lsb else 1.0
    low, high = (lsb * float(end) for end in one.numbers.tables.limits.output[0])
    least, most = sorted(both.reference.range)
    codes, model = (f"{a:.5g} .. {b:.5g} {unit}".rstrip() for a, b in ((least, most), (low, high)))
    return _Reach(codes, model, (min(high, most) - max(low, least)) / (most - least), least <= low and high <= most)


def misread(one: EmittedModel) -> list[str]:
    """A sentence if most codes of the reference's converter lie beyond the model's range, as with another unit.

    Raises FormatError if all of them do.
    """
    reach = _reach(one)
    if reach is None or reach.inside >= 0.5:  # most codes are of use
        return []
    if reach.inside <= 0.0:
        words = f"is {reach.codes}, all beyond the model's own, {reach.model}; give it in the unit of the output"
        raise FormatError((("emit", "converter", "reference", "range"), words))
    return [
        f"Converter: {100.0 - 100.0 * reach.inside:.3g} % of the reference's codes, {reach.codes}, lie beyond the "
        f"model's range, {reach.model}, and are limited to it; emit.converter.reference.range is in the unit of the "
        "output"
    ]


def _converted(one: EmittedModel) -> list[str]:
    """A sentence if the codes of the reference's converter do not reach the whole range of references, as is usual:
    few stages are used over every displacement that some history of drives leads to."""
    reach = _reach(one)
    if reach is None or reach.whole or misread(one):
        return []
    return [f"Converter: codes of references reach {reach.codes}, and the model's range is {reach.model}"]


def _averaged(compiled: Compiled) -> list[str]:
    """The averages that limit the noise gain, the shaper or notch that keeps modes from ringing, and their
    drawbacks."""
    from hystgen.compensator.chain.layout import LEAST_LATE

    found = []
    if (one := compiled.smoothing) is not None:
        often = {1: "once", 2: "twice"}.get(one.times, f"{one.times} times")
        losses = " and ".join(f"{100.0 * one.loss(period):.2g} % at {period} samples per period" for period in PERIODS)
        late = f", and the motion is {one.late:.3g} samples later" if one.late > LEAST_LATE else ""
        found.append(
            f"Noise: references are averaged {often} over {one.width:.4g} samples, so the noise gain is "
            f"{compiled.noise_gain:.4g} instead of {one.without:.4g}; a sine loses {losses}{late}"
        )
    if (kept := compiled.shaped) is not None:
        missed = 100.0 * kept.missed(PERIODS[-1])
        found.append(
            f"Resonance: after a step of the reference the stage does not ring ({kept.by}). Not for tracking: this "
            f"makes the motion {kept.late:.3g} samples late, and the error of a sine at {PERIODS[-1]} samples per "
            f"period is {missed:.2g} % of its amplitude"
        )
    return found


def _branches(compiled: Compiled, parameters: Parameters) -> list[str]:
    """The error that remains when a drive in front of two branches comes to rest."""
    from hystgen.compensator.chain.bounds import kept_branch

    if not compiled.tables.turning:
        return []
    most = f"{kept_branch(compiled):.3g} {comment_text(parameters.units.output)}".rstrip()
    return [
        "Branches: the drive turns to the other branch only if that misses the reference by less initially than "
        f"staying on its own branch; this leaves an error of at most {most} at rest"
    ]


def _quiet(one: EmittedModel, compiled: Compiled) -> list[str]:
    """A sentence on when a drive is kept at rest, and how closely."""

    t = compiled.tables
    if not one.variant.quiet:
        return []
    unit = one.form.unit(one.units.drive, "drive")
    kept = float(t.number.dither[0]) / 2.0 ** one.form.drive_bits(t)
    return [
        f"Quiet: after {t.quiet} equal references the drive stands still as long as it is within {kept:.4g}{unit} of "
        "the drive that is needed at rest; the input of the plays is then at most twice as far from its target"
    ]


def details(one: EmittedModel, notes: Sequence[str], estimate: Cost) -> list[str]:
    """The lines of a header's banner; `notes`: how the inverse reads references, and why it may be of little use."""
    parameters, options = one.model.parameters, one.options
    about = comment_text(parameters.description)
    avr = [] if estimate.avr is None else [
        f"On an 8-bit AVR constants lie in RAM too: at most {estimate.avr.all} bytes of RAM in total, "
        f"{estimate.avr.play} of them for each play"
    ]
    single = f" Define {one.names.NAME}_IMPLEMENTATION in one C file before including this header."
    use = (
        f"Use: {'load a block, then ' * (options.tables == 'runtime')}one instance per actuator, init once, then step "
        "from one context only. init takes the start memory of the parameter file; reset restarts with all plays at 0."
        f"{single * (options.layout == 'single-header')}{one.form.warning}"
    )
    shapes = ((effect.name, getattr(effect, "shape", "")) for effect in parameters.model.effects if effect.block)
    blocks = dict.fromkeys(f"{name} ({shape})" if shape else name for name, shape in shapes)
    uncounted = f" without {' and '.join(blocks)}" if blocks else ""
    precision = one.numbers.precision
    return [
        "",
        *([about] if about else []),
        f"Model: {_model(one)}; arithmetic {options.arithmetic}; engine {options.engine}; operator {options.operator}; "
        f"layout {options.layout}",
        *(f"Not compensated: {words}" for words in options.left_out),
        *notes,
        *([""] if precision else []),
        *precision,
        "",
        "Cost (32-bit target):",
        f"    code at -O2       about {estimate.code_words}, as measured for a similar model with 10 plays"
        f"{uncounted}",
        f"    constant tables   {estimate.memory.tables} bytes" if options.tables == "constant" else
        f"    parameters        about {estimate.memory.tables} bytes of RAM for each unit, loaded from a block",
        *(f"    {op} instance  {size} bytes of RAM" for op, size in estimate.memory.instances),
        *(f"    {op} step, worst case: {words}" for op, words in estimate.worst_case),
        *(f"    {op} step, costliest: about {estimate.dearest_words(op)}, as measured for similar models{uncounted}"
          for op in options.operators),
        *avr,
        "",
        use,
    ]


def _model(one: EmittedModel) -> str:
    n = one.model.cascade.pi.n
    kinds = ["tanh envelope" if isinstance(stage, TanhEnvelope) else "dead zone" for stage in one.model.cascade.stages]
    names = dict.fromkeys(effect.name for effect in one.model.parameters.model.effects)
    behind = f" behind {', '.join(kinds)}" if kinds else ""
    effects = f"; effects {', '.join(names)}" if names else ""
    return f"{n} play{'' if n == 1 else 's'}{behind}{effects}"


def selftest_cost(options: Options, found: Cost, samples: int, codes: int, windows: int) -> list[str]:
    """The memory that the self-test takes, with this many samples, codes and windows."""
    arithmetic = ARITHMETICS[options.arithmetic]
    contents = samples, codes, windows
    constants, instance = cost.selftest_bytes(
        arithmetic.bytes, arithmetic.fixed, found.memory, *contents, cost.CORE_32
    )
    lines = ["", f"Cost (32-bit target): {constants} bytes of constants, {instance} bytes of RAM for its own instance"]
    if found.avr is not None:
        both = sum(cost.selftest_bytes(arithmetic.bytes, arithmetic.fixed, found.avr, *contents, cost.AVR))
        lines.append(f"On an 8-bit AVR constants lie in RAM too: {both} bytes of RAM in total")
    return lines


# Macros and types


def version_number() -> int:
    """The version as a number that the preprocessor can compare; a prerelease counts as its release."""
    major, minor, patch = map(int, re.findall(r"\d+", __version__)[:3])
    return 10000 * major + 100 * minor + patch


def defined(one: EmittedModel, macros: Iterable[Macro]) -> list[str]:
    return [define(f"{one.names.NAME}_{name}", value, comment) for name, value, comment in macros]


def typedefs(one: EmittedModel) -> list[str]:
    """The types of a model's numbers, including those of plays and sums unless a shared run time has them."""
    units, names, types = one.units, one.names, one.family.types
    real = f"typedef {one.family.real} {names.name}_real_t;"
    if not one.numbers.lsb:
        drive = f"Drive in {units.drive or 'the units of the parameter file'}"
        output = f"output and reference {f'in {units.output}' if units.output else 'likewise'}"
        return [f"/* {drive}; {output} */", real]
    codes = (
        f"/* Codes: a drive code is {names.NAME}_DRIVE_LSB{units.behind('drive')}, an output code "
        f"{names.NAME}_OUTPUT_LSB{units.behind('output')} */"
    )
    words = "/* Inputs of the plays, inputs at which plays start to follow, and outputs before rounding */"
    own = [words, *(f"typedef {kind} {names.name}_{each};" for each, kind in types.items())]
    return [codes, real, *(own if names.rt == names.name else [])]


def limits(one: EmittedModel) -> list[Macro]:
    """The header's macros for a model's numbers."""
    numbers, form, units = one.numbers, one.form, one.units
    drive, output = form.counted("drive", units.drive), form.counted("output", units.output)
    found: list[Macro] = [("N_PLAYS", str(one.model.cascade.pi.n), ""), *_timing(one)]
    words = ("physical units per code; code 0 is 0", "")
    found += [
        (f"{side}_LSB", literal(lsb), comment)
        for side, lsb, comment in zip(("DRIVE", "OUTPUT"), numbers.lsb, words, strict=False)
    ]
    ends = numbers.tables.limits
    found += [
        ("DRIVE_MIN", operand(ends.drive.low[0]), drive),
        ("DRIVE_MAX", operand(ends.drive.high[0]), ""),
        ("OUTPUT_MIN", operand(ends.output.low[0]), f"{output}, over every drive history in range"),
        ("OUTPUT_MAX", operand(ends.output.high[0]), ""),
    ]
    found += _codes(one)
    found += _health(one)
    if one.erasing:
        from hystgen.emission import degauss

        found += degauss.macros(one.erasing, units.behind("output"))
    for each in errors(one):
        comment = f"{each.what}, {form.counted(each.side, each.unit)}"
        if each.samples is not None:
            comment = f"no bound: the largest found in {each.samples} samples, {comment}"
        if each.condition:
            comment = f"the same while {each.condition}"
        found.append((each.macro, operand(each.value), comment))
    return found


@dataclass(frozen=True)
class StatedError:
    """An error that the header states: its macro without the model's prefix, its `value` in the `unit` of a `side`,
    drive or output; `samples`: None for a bound; `condition`: when a bound holds, empty for always; `what`: the
    quantity in error."""

    macro: str
    value: Number
    side: str
    unit: str
    samples: int | None = None
    condition: str = ""
    what: str = "against the double model"


def errors(one: EmittedModel) -> Iterator[StatedError]:
    """The errors that the header states."""
    found, suffix, units = one.numbers.errors, one.form.suffix, one.units
    if "forward" in one.options.operators:
        yield StatedError(f"FORWARD_MAX_ERROR{suffix}", found.forward, "output", units.output)
    if not one.options.inverse:
        return
    drive, measured = ("drive", units.drive), one.measured
    if measured is None:
        yield StatedError(f"INVERSE_MAX_ERROR{suffix}", found.inverse, *drive)
    else:
        error = one.family.arithmetic.real(measured.error)
        yield StatedError(f"INVERSE_MEASURED_ERROR{suffix}", error, *drive, measured.samples)
    branch, condition = conditions(one)
    stated = measured is None or measured.confirms(float(found.rounding))
    if stated and (one.variant.branches or (condition and found.rounding != found.inverse)):
        same = together(branch, condition)
        yield StatedError(f"INVERSE_ROUNDING_ERROR{suffix}", found.rounding, *drive, condition=same)
    if one.conversion:
        real, converted = one.family.arithmetic.real, "of a converted code"
        reference, sent = (real(each) for each in (one.conversion.reference_error, one.conversion.drive_error))
        yield StatedError(f"REFERENCE_CODE_ERROR{suffix}", reference, "output", units.output, what=converted)
        yield StatedError(f"DRIVE_CODE_ERROR{suffix}", sent, *drive, what=converted)


def _codes(one: EmittedModel) -> list[Macro]:
    """Macros for the ends of the converters' codes."""
    conversion, converters = one.conversion, one.model.parameters.emit.converter
    found: list[Macro] = []
    if conversion is None or converters is None:
        return found
    for side, line, of, unit in (
        ("reference", conversion.reference, converters.reference, one.units.output),
        ("drive", conversion.drive, converters.drive, one.units.drive),
    ):
        each = f"codes of the {side}'s converter, {float(CodeLine.of(of).step):.6g}{f' {unit}' if unit else ''} each"
        found += [(f"{side.upper()}_CODE_MIN", operand(line.least), each),
                  (f"{side.upper()}_CODE_MAX", str(line.most), "")]
    return found


def _health(one: EmittedModel) -> list[Macro]:
    """Macros about the watch over the model's error."""
    if one.watch is None:
        return []
    band, real = one.watch.band, one.family.arithmetic.real
    unit = one.units.output or "output units"
    found = [
        ("HEALTH_WINDOW", f"{band.window}u", "samples after which the error of the model is judged"),
        ("HEALTH_MEAN_BAND", literal(real(band.mean)), f"{unit}: largest mean error of a window, either sign"),
        ("HEALTH_RMS_BAND", literal(real(band.rms)), f"{unit}: largest rms error of a window"),
    ]
    per = {"MEAN": f"{unit} per unit of health_t.mean", "SQUARE": f"({unit})^2 per unit of health_t.mean_square"}
    return [*found, *((f"HEALTH_{name}_LSB", literal(lsb), per[name]) for name, lsb in one.watch.lsb)]


def watched(one: EmittedModel) -> list[str]:
    """Sentences on the bands of the watch over the model's error, and on false alarms."""
    if one.watch is None:
        return []
    band, seconds = one.watch.band, one.model.parameters.sample_time
    unit = f" {one.units.output}" if one.units.output else ""
    lasts = "" if seconds is None else f" ({duration(band.window * seconds)})"
    said = (
        f"Health: over {band.window} samples{lasts} the mean error stays within {band.mean:.4g}{unit} and the rms "
        f"error within {band.rms:.4g}{unit}; "
    )
    found = one.model.parameters.residual
    if band.false_alarms is None or found is None or seconds is None:
        return [said + "this band comes from the parameter file, so the rate of false alarms is unknown"]
    return [said + (
        f"a window of a healthy unit leaves these bands with probability {band.false_alarms:.3g}, about once in "
        f"{duration(band.window * seconds / band.false_alarms)}. They follow from a residual of {found.rms:.4g}{unit} "
        f"in {found.samples:.3g} independent samples; a window has {band.independent:.3g}"
    ) + ". The mean holds for a zero of the sensor that is the mean of an earlier window"]


def _timing(one: EmittedModel) -> list[Macro]:
    """Macros about time: the sample time, and for a model with effects its consequences."""
    kind, period, compiled = one.family.arithmetic.real, one.model.parameters.sample_time, one.compiled
    found: list[Macro] = [] if period is None else [("SAMPLE_TIME", literal(kind(period)), "s, between steps")]
    if compiled is None:
        return found
    from hystgen.compensator.chain.layout import LEAST_LATE

    ahead = "samples by which the argument of step is ahead of the motion"
    if compiled.late > LEAST_LATE:
        ahead += f", which is {compiled.late:.4g} late"
    return [
        *found,
        ("PREVIEW", str(compiled.ahead), ahead),
        ("NOISE_GAIN", literal(kind(compiled.noise_gain)), "largest reference-to-drive gain, relative to that at rest"),
        ("MAX_RATE", literal(kind(compiled.max_rate)), "drive change per second up to which the errors below hold"),
        *_influences(one),
        *one.form.code_sizes(compiled.tables, one.columns),
    ]


def _influences(one: EmittedModel) -> list[Macro]:
    """Indices of the columns that `set_influence` sets, with the limits of each, beyond which it is limited."""
    assert one.compiled
    t = one.compiled.tables.columns
    ends = ((low, high) for low, high, entry in zip(t.lowest, t.highest, t.entry, strict=True) if entry >= 0)
    return [
        (f"INFLUENCE_{macro}", f"{i}u", f"index of column {comment_text(column)}, limited to {low:.6g} .. {high:.6g}")
        for i, (macro, column, (low, high)) in enumerate(
            zip(influence_macros(one.columns), one.columns, ends, strict=True)
        )
    ]


def status(one: EmittedModel) -> list[str]:
    """The bits of the status functions."""
    limited = "inverse: the drive was limited to the drive range"
    envelope = "inverse: the argument of an envelope was limited"
    found = [
        ("INPUT_CLAMPED", "the input was out of range and was limited"),
        ("OUTPUT_CLAMPED", limited + "; forward: the output to its codes" * one.numbers.saturates),
        ("HELD", one.form.held),
        ("DOMAIN", envelope if one.numbers.envelopes else "never set: no envelope limits an argument"),
    ]
    if one.variant.chain:
        slewed = "the drive was kept within its rate limit"
        found += [
            ("SLEW_LIMITED", slewed if one.variant.slew else "never set: nothing limits the drive's rate"),
            ("LIMITED_SETTING", "an offset, gain, temperature or column was limited"),
        ]
    bits: list[Macro] = [(f"STATUS_{name}", f"{1 << bit}u", words) for bit, (name, words) in enumerate(found)]
    if one.watch:
        words = "returned by health_update: the error of the model is outside its band"
        bits.append(("STATUS_MODEL_LEFT", f"{MODEL_LEFT}u", words))
    return defined(one, bits)


# Calls


class CallFacts(NamedTuple):
    """What the documentation of a call says besides its arguments: when the call may be made, what it costs (empty if
    that is counted for each model), and the status bits that it may set, if the model has them."""

    order: str
    cost: str
    bits: tuple[str, ...] = ()


_FIRST, _FEW = "after init; at any time", "a few operations, less than a step"
_ENTERED, _SET = ("INPUT_CLAMPED", "HELD"), ("LIMITED_SETTING", "HELD")
CALLS = {
    "init": CallFacts("before every other call; may be repeated at any time", "one pass over the plays"),
    "reset": CallFacts(_FIRST, "that of init and of a step"),
    "step": CallFacts(
        "after init; once every sample time, from one context", "",
        (*_ENTERED, "OUTPUT_CLAMPED", "DOMAIN", "SLEW_LIMITED"),
    ),
    "commit": CallFacts(
        "after a step and before the next one, any number of times; before the first step it sets a first drive",
        "a few comparisons; the next step absorbs the drive", _ENTERED,
    ),
    "status": CallFacts(_FIRST, "one load and one store"),
    "push": CallFacts("after init and before the first step", "less than a step", (*_ENTERED, "DOMAIN")),
    "settle": CallFacts(_FIRST, "at most that of two steps", _ENTERED),
    "set_offset": CallFacts(_FIRST, _FEW, _SET),
    "set_temperature": CallFacts(_FIRST, _FEW, _SET),
    "set_influence": CallFacts(_FIRST, "a few operations and those of the column's plays, less than a step", _SET),
    "set_gain": CallFacts(_FIRST, _FEW, _SET),
    "health_init": CallFacts("before health_update; may be repeated at any time", "six stores"),
    "health_update": CallFacts(
        "after health_init; once every sample time", "at most 40 instructions on a Cortex-M4F, except in float64",
        ("MODEL_LEFT",),
    ),
    "travel": CallFacts(_FIRST, "one load"),
    "set_travel": CallFacts("after init and before the first step, or at any time", _FEW, _SET),
    "expected": CallFacts("after a step, a commit or settle", _FEW),
    "correct": CallFacts(
        "after a step, when the sensor's value belongs to the drive that was applied before that step", _FEW, _SET
    ),
    "reference_from_code": CallFacts("at any time", _FEW),
    "drive_from_code": CallFacts("at any time", _FEW),
    "code_from_drive": CallFacts("at any time", _FEW),
    "exchange": CallFacts(
        "after commit and before the next step", "that of two steps, and three instances on the stack"
    ),
    "degauss_init": CallFacts("before the first step of the sequence; again to begin another", _FEW),
    "degauss_step": CallFacts("after its init; once every sample time, until done", _FEW),
    "degauss_done": CallFacts("after its init", _FEW),
    "step_code": CallFacts(
        "after init; once every sample time, from one context, in place of step and commit",
        "that of a step, of commit and of three conversions",
        ("INPUT_CLAMPED", "OUTPUT_CLAMPED", "DOMAIN", "SLEW_LIMITED"),
    ),
}
"""The calls of the interface."""

_PROTOTYPE = re.compile(r"(?P<answer>[\w ]+?) hystgen_((?P<op>forward|inverse)_)?(?P<call>\w+)\((?P<given>[^)]*)\);")


def documented(one: EmittedModel, cost: Cost) -> Iterator[Piece]:
    """Prototypes of a model's interface, each below its documentation."""
    for piece in runtime.prototypes_of(one.variant, one.options.operators, one.calls):
        found = _PROTOTYPE.search(" ".join(piece.code.split()))
        assert found, piece.text
        brief = piece.text.partition("/*")[2].partition("*/")[0]
        words = " ".join(re.sub(r"^ *\* ?", " ", line) for line in brief.splitlines())
        call, op = found["call"], found["op"]
        code, given = piece.code, found["given"]
        if one.options.tables == "runtime" and (call == "init" or not op) and call not in runtime.CONSTANT:
            pointer = "const hystgen_parameters_t *p"
            given = f"{given}, {pointer}" if op else f"{pointer}, {given}"
            code = code.replace(f"({found['given']})", f"({given})")
        names = [re.findall(r"\w+", each)[-1] for each in given.split(", ")]
        lines = [("", " ".join(words.split())), ("", "")]
        lines += [(f"@param {name}", _parameter(name, call, one)) for name in names]
        if found["answer"] != "void":
            lines.append(("@return", _answer(call, op, one)))
        lines += [
            ("@pre", CALLS[call].order),
            ("@note", f"Status bits: {_bits(call, op, one)}"),
            ("@note", f"Cost: {_cost(call, op, one, cost)}"),
        ]
        if one.options.tables == "runtime":
            lines = [(mark, _of_parameters(text, one)) for mark, text in lines]
        above = "\n".join(["/**", *(line for mark, text in lines for line in _line(mark, text)), " */"])
        yield Piece(piece.name, f"{above}\n{code.lstrip()}\n", piece.uses)


def _of_parameters(text: str, one: EmittedModel) -> str:
    """A text in which members of the parameters stand for the macros of the same numbers."""
    ends = rf"\b(?:HYSTGEN|{one.names.NAME})_(DRIVE|OUTPUT)_MIN \.\. MAX"
    text = re.sub(ends, lambda found: f"{found[1].lower()}_min .. {found[1].lower()}_max of the parameters", text)
    lsb = rf"\b{one.names.NAME}_(\w+_LSB)\b"
    return re.sub(lsb, lambda found: f"the parameters' {found[1].lower()}", text)


def _line(mark: str, text: str) -> list[str]:
    whole = f"{mark} {text}".strip()
    return textwrap.wrap(
        whole, WIDTH, initial_indent=" * ", subsequent_indent=" *     " if mark else " * ", break_on_hyphens=False
    ) or [" *"]


def _unit(what: str, one: EmittedModel) -> str:
    """A quantity with the unit of the drive or the output, or a code in fixed point."""
    side = "drive" if what == "drive" else "output"
    words = {"drive": "drive", "output": "displacement", "reference": "reference"}[what]
    macro = f"{one.names.NAME}_{side.upper()}_LSB"
    return one.form.quantity(words, macro, getattr(one.units, side))


def _parameter(name: str, call: str, one: EmittedModel) -> str:
    form, macros = one.form, one.names.NAME
    if name == "self":
        return "the sequence" if call.startswith("degauss") else "the instance"
    if name in ("next", "take"):
        return {
            "next": "the other parameters, loaded by the same module, which stay the caller's; in fixed point with the "
            "same sizes of codes", "take": "whether to take them, or only to ask",
        }[name]
    if name == "p":
        return "the parameters of the unit, which stay the caller's and have to stay where they are"
    held = "" if call.startswith("health") else form.unless_held(call)
    if name in form.settings:
        return form.settings[name].replace("MODEL", macros) + held
    drive = _unit("drive", one) + f"; limited to {macros}_DRIVE_MIN .. MAX"
    what = {
        "v": drive,
        "u": _unit("reference", one) + f"; limited to {macros}_OUTPUT_MIN .. MAX",
        "applied": drive,
        "d": _unit("output", one),
        "measured": _unit("output", one) + "; a sample with NaN or infinity is skipped" * (
            call == "health_update" and one.watch is not None and one.watch.skips
        ),
        "expected": _unit("output", one) + f", {expected(one)}",
        "i": f"index of the column, one of {macros}_INFLUENCE_*; any other is ignored, and reported as limited",
        "start": drive,
        "travel": "total distance that the drive has moved, in units of the drive",
        "code": f"code of the converter, {macros}_{'DRIVE' if call == 'drive_from_code' else 'REFERENCE'}_CODE_MIN .. "
        "MAX, beyond which it is limited; codes in two's complement have their sign extended to 32 bits",
        "drive": _unit("drive", one) + "; NaN gives the lowest code" * bool(held),
    }[name]
    return what + held * (name not in ("code", "drive", "start"))


def expected(one: EmittedModel) -> str:
    """Where the displacement that the model expects comes from."""
    own = one.names.name
    if "expected" in one.calls.get("inverse", ()):
        return f"as {own}_inverse_expected gives it for the drive applied when it was measured"
    if "forward" in one.options.operators:
        return f"as {own}_forward_step gives it for the drive applied when it was measured"
    return f"that is the reference, within {one.names.NAME}_OUTPUT_MIN .. MAX, unless the drive was limited or replaced"


def _answer(call: str, op: str | None, one: EmittedModel) -> str:
    if call in ("step_code", "code_from_drive"):
        return f"code of the drive's converter, {one.names.NAME}_DRIVE_CODE_MIN .. MAX"
    if call in ("reference_from_code", "drive_from_code"):
        return _unit(call.partition("_")[0], one)
    if call == "status":
        return f"{one.names.NAME}_STATUS_* bits, 0 for none"
    if call == "health_update":
        return f"{one.names.NAME}_STATUS_MODEL_LEFT if the last whole window is outside its band, else 0"
    if call == "degauss_done":
        return "true after the last drive"
    if call == "travel":
        return "total distance that the drive has moved, in units of the drive"
    drive = (op == "inverse" and call == "step") or call in ("degauss_step", "exchange")
    return _unit("drive" if drive else "output", one)


def _bits(call: str, op: str | None, one: EmittedModel) -> str:
    if call == "reset":
        return "cleared, then those of the step"
    if call == "status":
        return "all of them are cleared"
    there = {
        "HELD": bool(one.form.unless_held(call)),
        "OUTPUT_CLAMPED": op == "inverse" or one.numbers.saturates,
        "DOMAIN": op == "inverse" and one.numbers.envelopes,
        "SLEW_LIMITED": one.variant.slew,
    }
    found = [f"{one.names.NAME}_STATUS_{bit}" for bit in CALLS[call].bits if there.get(bit, True)]
    return ", ".join(found) or "none"


def _cost(call: str, op: str | None, one: EmittedModel, cost: Cost) -> str:
    if op and call == "step":
        return f"at most {dict(cost.worst_case)[op]}"
    if call == "commit" and one.corners and not one.variant.chain:
        return "at most that of a step"
    return CALLS[call].cost


# Words

_CORNERS = "_corner_t"
"""A name that only the corner engine uses."""

WORDS = (
    ("play", r"\bplays?\b",
     "holds its value until its input is a threshold away, and then follows at that distance"),
    ("move", _CORNERS,
     "the rise or the fall of the input from one turning point to the next. Lengths are measured along the move, "
     "so a falling move is a rising one with all signs changed"),
    ("corner", _CORNERS,
     "a turning point from which some plays still hold their values; corners are a stack, the newest one on top"),
    ("block", _CORNERS,
     "the plays that one corner holds: those with larger thresholds than the corner above holds, up to its `top`"),
    ("way", _CORNERS, "distance of the input from a turning point"),
    ("reach", _CORNERS,
     "distance of the output from a turning point; a reach_t also holds inputs and drives beyond every code"),
    ("segment", _CORNERS, "a straight piece of output against input, up to where the next play begins to follow"),
    ("pass", r"\bpass\[",
     "the input at which a move has taken a whole block along: the corner is passed, and forgotten"),
    ("kink", r"\bkink\b", "a point along the move where another play begins to follow"),
    ("effect", r"_(?:creep|lag|gain|course|mode|heat|ageing|clock)_\w*table",
     "a block of the chain from drive to displacement. rest: it has settled at an input; absorb: one sample passes "
     "through it; solve: the input for an output now; resting: the input for an output at rest"),
    ("pending", r"\bpending\b",
     "the last returned drive; the next call absorbs it into the memory, or the drive committed in its place"),
)
"""Each word, a pattern that texts with this word contain, and its meaning."""


def overview(text: str) -> str:
    """A comment that explains the words of `WORDS` that a C text uses; empty if it uses none."""
    found = [f"{word}: {meaning}" for word, sign, meaning in WORDS if re.search(sign, text)]
    if not found:
        return ""
    lines = [line for each in found for line in textwrap.wrap(
        f"{each}.", WIDTH, initial_indent="   ", subsequent_indent="       ", break_on_hyphens=False
    )]
    return "\n".join(["/* Words of this file", "", *lines, "*/", ""])
