"""The properties of a model as text."""

from __future__ import annotations

import decimal
import math

from hystgen.arithmetic import ARITHMETICS, FIXED, FLOATING
from hystgen.basics.problems import EffectsError, FormatError, NotInvertibleError, counted, percent
from hystgen.compensator import fixed_tables
from hystgen.compensator.bounds import error_bounds
from hystgen.compensator.converter import CodeLine
from hystgen.emission import interface, module
from hystgen.emission.calls import emit_options
from hystgen.front.dead_zone.model import DeadZone
from hystgen.model import SETTLED, Model

HARD_RATIO = 1e6
"""Slope ratio above which a warning is given: a float32 rounding error, 6e-8, becomes 6 % of the drive."""

WIDE = 0.05
"""Fraction of the drive range above which an error in the inverse is mentioned."""

UP = decimal.Context(prec=3, rounding=decimal.ROUND_CEILING)


def properties(model: Model, within: float = SETTLED) -> str:
    """The text of `hystgen show`: ranges, slopes, loop width, settling, whether there is an inverse, error bounds.

    `within`: error within which the output counts as settled, as a fraction of a step.
    """
    c, p = model.cascade, model.parameters
    pi = c.pi
    drive, output = (f" {unit}" if unit else "" for unit in (p.units.input, p.units.output))
    # behind a front, the input of the plays has no unit
    play = "" if c.stages else drive
    slope = f"{output}/{p.units.input}" if play and output else ""
    fronts = ["dead zone" if isinstance(stage, DeadZone) else "tanh envelope" for stage in c.stages]
    lines = [
        f"{model.name}: {counted(pi.n, 'play')}" + (f" behind {', '.join(fronts)}" if fronts else ""),
        *([p.description] if p.description else []),
        f"drive range        {c.input_range[0]:.6g} to {c.input_range[1]:.6g}{drive}",
        f"input of the plays {c.play_range[0]:.6g} to {c.play_range[1]:.6g}{play}",
        f"output range       {c.output_range[0]:.6g} to {c.output_range[1]:.6g}{output}"
        " (every drive history in range from the start memory)",
        f"loop width         {pi.width:.6g}{play} (input of the plays, full width, large loops)",
        "slopes             " + ", ".join(f"{s:.6g}" for s in pi.slopes[:8]) + (", ..." if pi.n > 7 else "") + slope,
        f"slope ratio        {c.slope_ratio:.6g} (largest slope of the model over its smallest)",
        f"start memory       {'projected to the admissible set' if pi.projected else 'as in the parameter file'}",
    ]
    curve, history = p.model.pi.density_error, p.model.pi.density_output_error
    if curve is not None and history is not None:
        lines.append(
            f"density            loading curve within {_most(curve)}{output}, output of any history within "
            f"{_most(history)}{output}"
        )
    lines.append(f"settling           {settling(model, within)}")
    if both := p.emit.converter:
        read, made = (float(abs(CodeLine.of(one).step)) for one in (both.reference, both.drive))
        lines.append(f"converters         {read:.4g}{output} per code of the reference, {made:.4g}{drive} of the drive")
    problems = c.inverse_problems()
    if model.effects:
        said = "effects            the lines above, except settling, are for the model without them"
        lines += [said, *_effects(model)]
    elif problems:
        lines += ["inverse            none:", *(f"    {problem}" for problem in problems)]
        lines += _fixed(model, drive, output)
    else:
        lines.append(
            f"inverse            exists; references {c.output_range[0]:.6g} to {c.output_range[1]:.6g}{output} "
            f"map to drives inside {c.input_range[0]:.6g} to {c.input_range[1]:.6g}{drive}"
        )
        for arithmetic in FLOATING:
            bounds = error_bounds(c, arithmetic, model.engine(arithmetic=arithmetic))
            lines.append(
                f"error, {arithmetic}     forward {_most(bounds.forward)}{output}, inverse "
                f"{_most(bounds.rounding)}{drive} at most, against the exact model"
            )
        lines += _fixed(model, drive, output)
        if c.branches_differ:
            lines.append("branches           the inverse's error bounds hold while it is on the exact model's branch")
    if not model.effects and (words := cost(model)):
        lines.append(f"cost of the C      {words}")
    return "\n".join(lines)


def facts(model: Model, within: float = SETTLED) -> dict[str, object]:
    """The same properties as data, without error bounds and cost: `hystgen show --json`."""
    c, p = model.cascade, model.parameters
    problems = c.inverse_problems()
    try:
        settled = model.settling(within).content()
    except EffectsError as error:
        settled = {"not_known": str(error)}
    return {
        "hystgen": 1,
        "name": model.name,
        "units": {"input": p.units.input, "output": p.units.output},
        "plays": c.pi.n,
        "drive_range": list(c.input_range),
        "output_range": list(c.output_range),
        "loop_width": c.pi.width,
        "slopes": [float(slope) for slope in c.pi.slopes],
        "slope_ratio": c.slope_ratio if math.isfinite(c.slope_ratio) else None,
        "inverse": {"exists": not problems, "problems": problems},
        "effects": [effect.model_dump(mode="json") for effect in model.effects],
        "settling": settled,
    }


def settling(model: Model, within: float = SETTLED) -> str:
    """The model's settling in a sentence, or the reason why it is unknown."""
    try:
        return model.settling(within).sentence(model.parameters.units.output)
    except EffectsError as error:
        return f"not known: {error}"


def cost(model: Model) -> str:
    """Cost of the C that `emit` would write, forward only if there is no inverse; empty if `emit` refuses."""
    try:
        options = emit_options(model, operator="forward" if model.cascade.inverse_problems() else None)
        found = module.of(model, options).cost
    except FormatError:
        return ""
    instances = (f"{op} instance {size} bytes of RAM" for op, size in found.memory.instances)
    return (
        f"{options.operator} in {options.arithmetic}, engine {options.engine}; code at -O2 about {found.code_words}; "
        f"constant tables {found.memory.tables} bytes; {', '.join(instances)}"
    )


def _most(bound: float) -> str:
    """A bound rounded up to three digits."""
    return f"{float(UP.create_decimal_from_float(bound)):.3g}"


def _effects(model: Model) -> list[str]:
    """Each effect in the order of the chain: its parameters, and how a compensator corrects it."""
    lines = []
    for effect in model.chain.effects:
        shape = getattr(effect, effect.selector, "")
        lines.append(f"    {effect.name}{f', {shape}' if shape else ''}")
        for key, field in type(effect).model_fields.items():
            if key not in ("name", effect.selector):
                value = getattr(effect, key)
                lines.append(f"        {key} = {_shown(value)}: {field.description}")
        lines += [f"        {remark}" for remark in effect.remarks(tuple(model.cascade.pi.thresholds))]
        if words := effect.corrected(model.parameters.emit.compensation.resonance):
            lines.append(f"        compensation: {words}")
    return [*lines, *(f"    {words}" for words in _reading(model))]


def _reading(model: Model) -> list[str]:
    """How the inverse treats the reference, in the words of the C banner; empty if `emit` refuses the model."""
    try:
        options = emit_options(model, operator="inverse")
        return interface.reading(module.compensator(model, options))
    except (FormatError, NotInvertibleError, EffectsError):
        return []


def _shown(value: object) -> str:
    """The text of a number or a list; a long list is shortened."""
    if isinstance(value, tuple):
        return "[" + ", ".join(_shown(entry) for entry in value[:8]) + (", ..]" if len(value) > 8 else "]")
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _fixed(model: Model, drive: str, output: str) -> list[str]:
    """Resolution and error bounds of fixed point in physical units, or why it is not available."""
    lines = []
    for arithmetic in FIXED:
        try:
            form = _format(model, arithmetic)
        except FormatError as error:
            lines.append(f"{arithmetic}                not available: " + str(error).replace("\n", "\n" + 34 * " "))
            continue
        a, b = float(form.drive_lsb), float(form.output_lsb)
        back = "" if form.inverse_rounding is None else f", inverse {_most(form.inverse_rounding * a)}{drive}"
        lines.append(
            f"error, {arithmetic}         forward {_most(form.forward_error * b)}{output}{back} at most; a code is "
            f"{a:.4g}{drive}, {b:.4g}{output}"
        )
    return lines


def warnings(model: Model) -> list[str]:
    """Warnings about the model, one sentence each."""
    c = model.cascade
    if model.effects or c.inverse_problems():
        return []
    if c.slope_ratio > HARD_RATIO:
        return [
            f"the slope ratio is {c.slope_ratio:.3g}: the inverse amplifies rounding and model errors by that factor; "
            "raise p_0 or narrow input_range"
        ]
    arithmetic = model.parameters.emit.arithmetic
    try:
        error = _inverse_error(model, arithmetic)
    except FormatError:
        return []
    share = error / (c.input_range[1] - c.input_range[0])
    if share < WIDE:
        return []
    unit, finer, whole = model.parameters.units.input, ARITHMETICS[arithmetic].finer, "the drive's range"
    return [
        f"the inverse in {arithmetic} may be off by {_most(error)}{f' {unit}' if unit else ''}, "
        f"{percent(share, '.0f', whole)}: {f'use {finer}, ' if finer else ''}raise p_0 or narrow input_range"
    ]


def _inverse_error(model: Model, arithmetic: str) -> float:
    """Largest difference between the emitted inverse and the exact one, in input units. Raises FormatError."""
    if arithmetic in FLOATING:
        return error_bounds(model.cascade, arithmetic, model.engine(arithmetic=arithmetic)).rounding
    form = _format(model, arithmetic)
    return 0.0 if form.inverse_rounding is None else form.inverse_rounding * float(form.drive_lsb)


def _format(model: Model, arithmetic: str) -> fixed_tables.Format:
    """The model in fixed point. Raises FormatError."""
    emit, engine = model.parameters.emit, model.engine(arithmetic=arithmetic)
    return fixed_tables.build(model.cascade, arithmetic, engine, emit.drive_lsb, emit.output_lsb)[1]
