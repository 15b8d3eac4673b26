"""The report on a diagnosis: one page on the missing effects, the error due to each, and the remaining error."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ParamSpec

from hystgen import diagnosis
from hystgen.basics import drawing, parallel
from hystgen.basics.drawing import label
from hystgen.basics.problems import counted, percent
from hystgen.basics.version import __version__
from hystgen.diagnosis.findings.content import ONE_LOOP
from hystgen.diagnosis.findings.kinds import VARIABLE_NAMES, Fault, Structured, times_noise
from hystgen.diagnosis.findings.result import Diagnosis, NamedEffect, Result, Signals
from hystgen.diagnosis.search.acceptance import is_noise
from hystgen.report.diagnosis_figures import ALTERNATIVES, FIGURES, NARROW, WIDE, applies, caption
from hystgen.report.html import Details, Folded, HtmlTable, Listing, Picture, Section, Text, page
from hystgen.report.properties import settling
from hystgen.report.viewer import Viewed, Viewer

if TYPE_CHECKING:
    from hystgen.effects.base import Effect

FRONT = ("exact", "part of the inverse: the front is inverted behind the plays")
"""Accuracy and method of a compensator's correction for a stage in front of the plays."""

VISIBLE = 0.01
"""Relative difference above which an error is visibly larger than another."""

P = ParamSpec("P")


def _with_page(find: Callable[P, Diagnosis]) -> Callable[P, Diagnosis]:
    @functools.wraps(find)
    def found(*given: P.args, **named: P.kwargs) -> Diagnosis:
        made = find(*given, **named)
        names = [name for name in FIGURES if applies(made, name)]
        figures = {name: functools.partial(FIGURES[name], width=WIDE) for name in names}
        return replace(made, page=html, figures=figures)

    return found


diagnose = _with_page(diagnosis.diagnose)
"""`hystgen.diagnose`: the result of the search, with a page to write and figures to draw."""


def html(found: Diagnosis, parameters_text: str) -> str:
    """The page. Raises PlotError without matplotlib."""
    result = found.result
    names = [name for name in FIGURES if applies(found, name)]
    each = list(itertools.product(names, (WIDE, NARROW)))
    with drawing.styled():
        contents = parallel.each(
            lambda one: drawing.content(FIGURES[one[0]](found, one[1]), "svg"), each, parallel.cores()
        )
    drawn = dict(zip(each, contents, strict=True))
    figures = {
        name: Picture(name, drawn[name, WIDE], drawn[name, NARROW], caption(found, name), ALTERNATIVES[name])
        for name in names
    }
    sections = [
        Section("How the gap shrinks", [figures["gap"], *_refitted(result), _noise(result)]),
        Section("What was found", _found(found)),
        Section("Settling", [Text(f"The output of the model with the effects is {settling(found.model)}.")]),
        Section("Remaining error", _left(result)),
        Section("Faults of the data", _faults(result)),
        Section("Before and after, on held-out records", [figures["overlay"], figures["deviation"]]),
        Section("Zoom and read values", [_zoom(found)]),
        *(Section(title, [figures[name]]) for name, title in BY_NAME.items() if name in figures),
        Section("Where model and measurement disagree", [figures["records"], figures["time"], *_where(result)]),
        Section("What the error depends on", [figures["against"], figures["frequency"]]),
        Section("What cannot be separated", _rivals(result)),
        Section("Shapes that were tried", _ranking(result)),
        Section("What was done to the data", [Listing(found.notes) if found.notes else Text("Nothing.")]),
        Section("Parameters", [Details("Parameter file with the effects added", parameters_text)]),
        Section("Provenance", [Text(f"hystgen {__version__}; the same records give the same page.")]),
    ]
    warnings = [Text(f"About the inverse: {said}.") for said in found.warnings]
    top = [Text(found.sentence()), *warnings, _next_step(found)]
    return page(f"{found.parameters.name}: diagnosis", top, sections)


BY_NAME = {"bode": "Frequency response", "stops": "Creep"}
"""Figures of certain effects, with the titles of their sections."""


def _zoom(found: Diagnosis) -> Viewer:
    """The records with the errors before and after, held-out ones first."""
    named, units = bool(found.result.effects), found.parameters.units

    def viewed(each: Signals) -> Viewed:
        after = each.y - each.after
        models = {"refitted": each.y - each.before, "with the effects": after} if named else {"refitted model": after}
        return Viewed(each.name, "held out" if each.held_out else "fit", each.t, each.v, each.y, models)

    ordered = sorted(found.signals, key=lambda each: not each.held_out)
    return Viewer([viewed(each) for each in ordered], (units.input, units.output), found.result.noise_floor)


def _next_step(found: Diagnosis) -> Text:
    """The recommended next step, with its command."""
    step, command = found.next_step()
    return Text(f"Your next step: {step}.", command)


def _chance(p_value: float) -> str:
    """A p-value, which may be below the smallest double."""
    return f"{p_value:.1g}" if p_value > 0.0 else "< 1e-300"


def _refitted(result: Result) -> list[Text]:
    """An explanation of the second bar, if it is visibly longer than the first."""
    given, refitted = result.gap.as_given, result.gap.refitted
    if refitted.holdout <= (1.0 + VISIBLE) * given.holdout:
        return []
    fitted = f"{given.fit:.4g} to {refitted.fit:.4g}"
    return [
        Text(
            f"Refitting changes the {label('rms error', result.unit)} of the fitted records from {fitted}, and that of "
            f"the held-out ones from {given.holdout:.4g} to {refitted.holdout:.4g}: fitted weights absorb some of a "
            "missing effect, which may show differently in other records."
        )
    ]


NOISE_FROM = {
    "holds": "the holds of the drive",
    "periods": "the part that does not repeat from one period of the drive to the next",
    "differences": "the differences between neighbouring samples, since the records have no holds and no equal periods",
    "resolution": "the resolution of the recorded numbers, since every other estimate is smaller",
}
"""The source of the noise floor, as text."""


def _noise(result: Result) -> Text:
    floor = f"{label('noise floor', result.unit)} is {result.noise_floor:.3g}"
    return Text(f"The {floor}, from {NOISE_FROM[result.noise_from]}.")


def _found(found: Diagnosis) -> list[Text | HtmlTable]:
    """The effects found, and what they mean for a compensator."""
    result, there, not_emitted = found.result, found.parameters.model.effects, found.not_emitted()
    if not result.effects:
        return [Text("No effect in the catalogue removes enough of the held-out error to be named.")]
    unit = result.unit
    rows = [["effect", label("held-out rms before", unit), label("after", unit), "share of the gap", "p", "named by"]]
    means = [["effect", "compensation", "how"]]
    numbers = [["effect", "parameter", "value", "95 % from", "to", "what it is"]]
    for effect in result.effects:
        before, after = effect.holdout_before, effect.holdout_after
        share = f"{round(100.0 * effect.share_of_gap)} %"
        named_by = "the search" if not effect.known else "you; the records support it" if effect.unsupported is None \
            else f"you; {found.not_supported(effect)}"
        rows.append([effect.name, f"{before:.4g}", f"{after:.4g}", share, _chance(effect.p_value), named_by])
        kind = _kind(effect, there)
        how = (kind.compensated, kind.compensation) if kind is not None else FRONT
        means.append([effect.name, *how])
        said = {} if kind is None else {key: field.description or "" for key, field in kind.model_fields.items()}
        for key, value in effect.parameters.items():
            several = _numbers(value, effect.intervals.get(key), key.replace("_", " "))
            numbers += [[effect.name, *row, said.get(key, "")] for row in several]
    return [
        HtmlTable(rows, (0, 5)),
        Text("What they mean for a compensator:"),
        HtmlTable(means, (0, 1, 2)),
        Text(f"They cannot be emitted as C yet: {not_emitted}.") if not_emitted
        else Text(
            "Error of the motion with the compensator:", f"hystgen track params.yaml {found.judged_by()} -o tracking/"
        ),
        Text(
            "Their parameters. The intervals account for correlated residuals and for free weights, but not for other "
            "shapes that may fit as well:"
        ),
        HtmlTable(numbers, (0, 1, 5)),
    ]


def _kind(effect: NamedEffect, there: Sequence[Effect]) -> type[Effect] | None:
    """The class of a named effect, among the effects of the model; None for a stage in front of the plays."""
    if effect.parameters.get("kind"):
        return None
    return next(type(each) for each in reversed(there) if each.name == effect.name)


def _numbers(value: object, sure: Any, name: str = "") -> list[list[str]]:
    """Rows of name, value, lower and upper end, one per number; equal lists are represented by the first."""
    if isinstance(value, Mapping):
        known = sure or {}
        return [
            row for key, each in value.items()
            for row in _numbers(each, known.get(key), f"{name} {key.replace('_', ' ')}".strip())
        ]
    if isinstance(value, tuple):
        alike = len(value) > 1 and isinstance(value[0], tuple) and all(each == value[0] for each in value)
        chosen = value[:1] if alike else value
        return [
            row for k, each in enumerate(chosen)
            for row in _numbers(each, sure[k] if sure else None,
                                f"{name} of each play" if alike else f"{name} {k + 1}" if len(value) > 1 else name)
        ]
    if isinstance(value, bool | str):
        return [[name, str(value), "", ""]]
    return [[name, f"{value:.4g}", *_pair(sure)]]


def _pair(known: Sequence[float] | None) -> list[str]:
    return [f"{x:.4g}" for x in known] if known and known[0] < known[1] else ["fixed", ""]


def _left(result: Result) -> list[Text | Listing | HtmlTable]:
    seen = [each for each in result.unexplained if not isinstance(each, Fault)]
    if not seen:
        after, noise = result.gap.after.holdout, result.noise_floor
        if is_noise(after, noise):
            return [Text("Only noise.")]
        times = f"The remaining error is {times_noise(after / noise)}"
        return [Text(f"{times}, but it has no distinct features: noise that is not white looks the same.")]
    sentences = [each.sentence(result.unit) for each in seen]
    blocks: list[Text | Listing | HtmlTable] = [Listing(sentences)]
    for each in seen:
        if isinstance(each, Structured) and each.share_by_variable:
            rows = [["the remaining error depends on", "share of its variance"]]
            shares = each.share_by_variable.items()
            rows += [[VARIABLE_NAMES[name], f"{100.0 * share:.0f} %"] for name, share in shares]
            blocks += [HtmlTable(rows, (0,)), Text("Each variable alone, judged on samples not used to fit it.")]
    more = [text for each in seen for text in each.advice()]
    return [*blocks, Text("To learn more:"), Listing(more)] if more else blocks


WHAT = {
    "saturated": "converter at its limit",
    "drop_outs": "drop-outs",
    "held_samples": "held samples",
    "isolated_samples": "isolated samples",
    "swapped_channels": "drive and displacement exchanged",
    "history": "a history other than the given one",
}


def _faults(result: Result) -> list[Text | HtmlTable]:
    seen = [each.entry() for each in result.unexplained if isinstance(each, Fault)]
    if not seen:
        disturbed = any(not isinstance(each, Structured) for each in result.unexplained)
        return [Text("None in single samples; disturbances are listed above." if disturbed else "None were seen.")]
    rows = [["record", "what", "times", "samples", "first at (s)", label("level", result.unit), "done"]]
    for each in sorted(seen, key=lambda one: (str(one["record"]), str(one["kind"]))):
        single = each["kind"] in ("saturated", "isolated_samples")
        samples = each.get("count") if single else each.get("samples")
        done = "put right" if each["kind"] == "swapped_channels" else (
            "bridged" if each.get("channel") == "v" else "not compared"
        )
        rows.append(
            [
                str(each["record"]),
                WHAT[str(each["kind"])] + (f" of {each['channel']}" if "channel" in each else ""),
                "" if single or "count" not in each else str(each["count"]),
                "" if samples is None else str(samples),
                f"{each['first']:.6g}" if "first" in each else "",
                f"{each['level']:.6g}" if "level" in each else "",
                done,
            ]
        )
    return [HtmlTable(rows, (0, 1, 6))]


def _rivals(result: Result) -> list[Text | Listing]:
    advice = result.advice
    more = [Text(f"{ONE_LOOP.capitalize()}.")] if ONE_LOOP in advice else []
    if not result.not_separable:
        return [Text("Nothing came close to the named effects." if result.effects else "Nothing was named."), *more]
    pairs = (" and ".join(pair) for pair in result.not_separable)
    return [Listing([f"{pair}: {text}" for pair, text in zip(pairs, advice, strict=False)]), *more]


def _where(result: Result) -> list[Text | HtmlTable]:
    if not result.where:
        return [Text("No stretch of a record has an error of the refitted model far above the noise.")]
    rows = [["record", "what happens there", "from (s)", "to (s)", label("rms", result.unit)]]
    rows += [
        [each.record, each.kind.replace("_", " "), *(f"{x:.6g}" for x in each.interval), f"{each.rms:.3g}"]
        for each in result.where
    ]
    return [Text("The stretches with the largest error of the refitted model:"), HtmlTable(rows, (0, 1))]


def _ranking(result: Result) -> list[Text | Folded]:
    """All shapes that were fully fitted in one table, folded."""
    if not result.ranking:
        return [Text("None: with the refitted model, only noise remains.")]
    unit = result.unit
    rows: list[Sequence[str]] = [
        ["round", "effect", "shape", label("rms of the fit", unit), label("held-out rms", unit), "above best", "why"]
    ]
    for k, tried in enumerate(result.ranking):
        best = min((each.holdout for each in tried), default=0.0)
        for each in tried:
            margin = percent(each.holdout / best - 1.0, ".1f") if best > 0.0 else ""
            errors = f"{each.fit:.4g}", f"{each.holdout:.4g}"
            rows.append([str(k + 1), each.name, each.shape, *errors, margin, each.refused or "named"])
    refused = sum(each.refused is not None for tried in result.ranking for each in tried)
    said = f"{counted(len(rows) - 1, 'shape')}, {refused} of them refused, and why"
    rounds = "Each round adds one effect to those already named; it ends when no shape removes enough."
    return [Folded(said, [Text(rounds), HtmlTable(rows, (1, 2, 6))])]
