"""The report of a diagnosis: one page that says what is missing, how much it explains and what is left."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hystgen import __version__, effects
from hystgen.report import drawing
from hystgen.report.drawing import label
from hystgen.report.fit_figures import binned
from hystgen.report.html import Details, Figure, Listing, Section, Table, Text, page

if TYPE_CHECKING:
    from hystgen.diagnosis import Diagnosis, Signals

Array = NDArray[np.float64]

BEFORE, AFTER, FLOOR = "#8a929c", drawing.RESIDUAL, drawing.FAULT

WIDE, NARROW = 9.0, 4.2


def html(found: Diagnosis, parameters_text: str) -> str:
    """The page. Raises PlotError without matplotlib."""
    content = found.content
    figures = {}
    with drawing.styled():
        for name, draw in FIGURES.items():
            wide, narrow = (drawing.content(draw(found, width), "svg") for width in (WIDE, NARROW))
            figures[name] = Figure(name, wide, narrow, CAPTIONS[name], ALTERNATIVES[name])
    sections = [
        Section("How the gap shrinks", [figures["gap"]]),
        Section("Before and after, on a held-out record", [figures["overlay"]]),
        Section("What the error goes with", [figures["against"]]),
        Section("What was found", _found(content)),
        Section("What is left", _left(content)),
        Section("What cannot be told apart", _rivals(content)),
        Section("Where model and measurement disagreed", _where(content)),
        Section("Shapes that were tried", _ranking(content)),
        Section("What was done to the data", [Listing(found.notes) if found.notes else Text("Nothing.")]),
        Section("Parameters", [Details("Parameter file with the effects added", parameters_text)]),
        Section("Provenance", [Text(f"hystgen {__version__}; the same records give the same page.")]),
    ]
    return page(f"{found.parameters.name}: diagnosis", [Text(found.sentence())], sections)


# Pictures ----------------------------------------------------------------------------------------------------


def _gap(found: Diagnosis, width: float) -> Any:
    content = found.content
    unit = content["unit"]
    steps = [("as given", content["gap"]["as_given"]["holdout"]), ("refitted", content["gap"]["refitted"]["holdout"])]
    steps += [(f"+ {effect['name']}", effect["holdout_after"]) for effect in content["effects"]]
    drawn = drawing.figure(width, 0.9 + 0.42 * len(steps))
    axes = drawn.subplots()
    places = np.arange(len(steps))
    values = [value for _, value in steps]
    axes.barh(places, values, color=[BEFORE, drawing.MODEL, *[AFTER] * (len(steps) - 2)], height=0.6)
    for place, value in zip(places, values, strict=True):
        axes.annotate(f" {value:.3g}", (value, place), va="center", fontsize=9)
    axes.axvline(content["noise_floor"], color=FLOOR, linestyle="--", linewidth=1.2, label="noise")
    axes.set_yticks(places, [name for name, _ in steps])
    axes.invert_yaxis()
    axes.set_xlim(0.0, 1.18 * max(*values, content["noise_floor"]))
    axes.set(xlabel=label("rms error on held-out records", unit))
    drawing.legend_above(axes, 1)
    return drawn


def worst(found: Diagnosis) -> Signals:
    """The held-out record with the largest error of the refitted model."""
    return max((each for each in found.signals if each.held_out), key=lambda each: float(np.nanstd(each.before)))


def _overlay(found: Diagnosis, width: float) -> Any:
    each, unit = worst(found), found.content["unit"]
    drawn = drawing.figure(width, 5.2)
    top, bottom = drawn.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    chosen = drawing.kept(0, len(each.t), each.y, each.before, each.after)
    t = each.t[chosen] - each.t[0]
    top.plot(t, each.y[chosen], label="measured", **drawing.LINES["measured"])
    top.plot(t, (each.y - each.after)[chosen], label="model with the effects", **drawing.LINES["model"])
    top.set(ylabel=label("displacement", unit))
    top.set_title(each.name)
    drawing.legend_above(top, 2)
    bottom.plot(t, each.before[chosen], color=BEFORE, linewidth=0.8, label="refitted")
    bottom.plot(t, each.after[chosen], color=AFTER, linewidth=0.8, label="with the effects")
    for sign in (-1.0, 1.0):
        bottom.axhline(sign * found.content["noise_floor"], color=FLOOR, linestyle="--", linewidth=1.0)
    bottom.set(xlabel="time (s)", ylabel=label("error", unit))
    drawing.legend_above(bottom, 2)
    return drawn


def _against(found: Diagnosis, width: float) -> Any:
    held = [each for each in found.signals if each.held_out]
    units, unit = found.parameters.units, found.content["unit"]
    drawn = drawing.figure(width, 5.2 if width == WIDE else 10.0)
    grid = drawn.subplots(2, 2, sharey=True) if width == WIDE else drawn.subplots(4, 1, sharey=True)
    variables: list[tuple[str, list[Array]]] = [
        (label("drive", units.input), [each.v for each in held]),
        (label("drive rate", f"{units.input}/s" if units.input else "1/s"), [np.gradient(x.v, x.t) for x in held]),
        (label("displacement", unit), [each.y for each in held]),
        ("time in the record (s)", [each.t - each.t[0] for each in held]),
    ]
    for axes, (name, values) in zip(np.ravel(grid), variables, strict=True):
        x = np.concatenate(values)
        for errors, colour, what in (
            ([each.before for each in held], BEFORE, "refitted"),
            ([each.after for each in held], AFTER, "with the effects"),
        ):
            e = np.concatenate(errors)
            known = np.isfinite(e) & np.isfinite(x)
            low, high = (float(q) for q in np.quantile(x[known], (0.005, 0.995)))
            middle, mean, spread = binned(x[known], e[known], low, high if high > low else low + 1.0)
            axes.fill_between(middle, mean - spread, mean + spread, color=colour, alpha=0.25, linewidth=0)
            axes.plot(middle, mean, color=colour, linewidth=1.5, label=f"{what}, mean \N{PLUS-MINUS SIGN} 1 sd in bins")
        axes.axhline(0.0, color=drawing.QUIET, linewidth=0.6)
        axes.set(xlabel=name)
    for axes in np.ravel(grid)[:: 2 if width == WIDE else 1]:
        axes.set(ylabel=label("error", unit))
    drawing.legend_above(np.ravel(grid)[1 if width == WIDE else 0], 1)
    return drawn


FIGURES = {"gap": _gap, "overlay": _overlay, "against": _against}

CAPTIONS = {
    "gap": "rms error on the held-out records: of the model as given, refitted, and with one effect after the other. "
    "The dashed line is the noise, measured without a model.",
    "overlay": "The held-out record on which the refitted model does worst, and what is left of it before and after.",
    "against": "Mean and scatter of the error on all held-out records, before and after, against what it may go with.",
}

ALTERNATIVES = {
    "gap": "Bars of the held-out error after each step, with the noise as a line.",
    "overlay": "Measured and predicted displacement along time, and below it the error before and after.",
    "against": "Four panels of binned errors against drive, rate, displacement and time, before and after.",
}


# Words -------------------------------------------------------------------------------------------------------


def _found(content: dict[str, Any]) -> list[Text | Table]:
    if not content["effects"]:
        return [Text("No effect of the catalogue removes enough of the held-out error to get a name.")]
    rows = [["effect", "parameters", "held-out rms before", "after", "share of the gap", "p", "compensation"]]
    for effect in content["effects"]:
        rows.append(
            [
                effect["name"],
                "; ".join(f"{key} {_short(value)}" for key, value in effect["parameters"].items()),
                f"{effect['holdout_before']:.4g}",
                f"{effect['holdout_after']:.4g}",
                f"{100.0 * effect['share_of_gap']:.0f} %",
                f"{effect['p_value']:.1g}",
                _compensation(effect["name"]),
            ]
        )
    return [Table(rows, (0, 1, 6))]


def _compensation(name: str) -> str:
    """What an effect means for a compensator."""
    if name in effects.CATALOGUE and name != "saturation":
        return effects.shapes(name)[0].compensation
    return "exact: part of the inverse" if name == "asymmetry" else "exact inside the range"


def _short(value: Any) -> str:
    if isinstance(value, list):
        first = ", ".join(_short(each) for each in value[:4])
        return f"[{first}{', ..' if len(value) > 4 else ''}]"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _left(content: dict[str, Any]) -> list[Text | Listing]:
    said = []
    for each in content["unexplained"]:
        facts = ", ".join(f"{key} {_short(value)}" for key, value in each.items() if key != "kind")
        said.append(f"{str(each['kind']).replace('_', ' ')}: {facts}")
    return [Listing(said) if said else Text("Nothing but noise.")]


def _rivals(content: dict[str, Any]) -> list[Text | Listing]:
    if not content["not_separable"]:
        return [Text("Nothing came close to what was named.")]
    pairs = (" and ".join(pair) for pair in content["not_separable"])
    return [Listing([f"{pair}: {advice}" for pair, advice in zip(pairs, content["advice"], strict=True)])]


def _where(content: dict[str, Any]) -> list[Text | Table]:
    if not content["where"]:
        return [Text("Nowhere by more than the noise.")]
    rows = [["record", "what goes on there", "from (s)", "to (s)", label("rms", content["unit"])]]
    rows += [
        [w["record"], str(w["kind"]).replace("_", " "), *(f"{x:.4g}" for x in w["interval"]), f"{w['rms']:.3g}"]
        for w in content["where"]
    ]
    return [Table(rows, (0, 1))]


def _ranking(content: dict[str, Any]) -> list[Text | Table]:
    blocks: list[Text | Table] = []
    for k, tried in enumerate(content["ranking"]):
        rows: list[Sequence[str]] = [["effect", "shape", "rms of the fit", "held-out rms"]]
        rows += [[t["name"], t["shape"], f"{t['fit']:.4g}", f"{t['holdout']:.4g}"] for t in tried]
        blocks += [Text(f"Round {k + 1}, the shapes that were fitted to the end:"), Table(rows, (0, 1))]
    return blocks or [Text("None: the refitted model leaves no more than noise.")]
