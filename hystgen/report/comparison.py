"""The picture and the page of a comparison of models: the deviations of all of them on one scale."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hystgen import comparison
from hystgen.basics import drawing
from hystgen.basics.drawing import label
from hystgen.basics.version import __version__
from hystgen.comparison import LINE, Comparison, Deviation
from hystgen.report.html import HtmlTable, Listing, Section, Text, drawn, page, presented
from hystgen.report.viewer import Viewed, Viewer

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

WIDE, NARROW = 9.0, 4.2
"""[inches] Widths of the picture on a screen and on a phone."""

SIDE_BY_SIDE = 3
"""Maximum number of panels beside each other."""

GAP = 0.03
"""[fraction of the total time] Space between two records in a panel."""

ROOM = 1.08
"""Height of the common scale, as a multiple of the largest deviation of a model."""

PAGE = "report.html"

def figure(found: Comparison, width: float = WIDE) -> Figure:
    """The rms deviation of every model beside the noise, and below it every model's deviation over time, on one scale.

    The straight line is in the first part alone.
    """
    number = len(found.models)
    across = 1 if width == NARROW else 2 if number in (2, 4) else min(SIDE_BY_SIDE, number)
    down = -(-number // across)
    bars = 0.8 + 0.3 * (number + 1)
    whole = drawing.figure(width, bars + 2.3 * down)
    top, below = whole.subfigures(2, 1, squeeze=False, height_ratios=(bars, 2.3 * down))[:, 0]
    _bars(top.subplots(), found, width)
    panels = below.subplots(down, across, sharex=True, sharey=True, squeeze=False)
    most = ROOM * max(max(each.most for each in found.models), found.noise)
    for k, axes in enumerate(panels.flat):
        if k >= number:
            axes.set_axis_off()
            continue
        _over_time(axes, found, found.models[k])
        axes.set_ylim(-most, most)
        axes.set_title(_short(found.models[k].name, 30), fontsize=9)
        if k % across == 0:
            axes.set_ylabel(label("deviation", found.unit))
        if k + across >= number:
            axes.set_xlabel("time compared (s), record after record" if len(found.records) > 1 else "time compared (s)")
            axes.tick_params(labelbottom=True)
    return whole


def _bars(axes: Axes, found: Comparison, width: float) -> None:
    """The rms deviation of the straight line and of every model, on a logarithmic axis, and the noise."""
    every = (found.line, *found.models)
    for k, each in enumerate(every):
        colour = drawing.QUIET if each is found.line else _colour(found, each)
        axes.plot(max(each.rms, 1e-300), k, "o", color=colour, markersize=8)
        place = max(each.rms, 1e-300), k
        axes.annotate(f"{each.rms:.3g}", place, (8.0, 0.0), textcoords="offset points", va="center", fontsize=9)
    axes.axvline(found.noise, color=drawing.FAULT, linestyle="--", linewidth=1.1, label="noise")
    low, high = min(found.noise, *(each.rms for each in every)), max(each.rms for each in every)
    drawing.decades(axes, "x", (0.6 * low, high * (high / low) ** (0.15 if width == WIDE else 0.35) * 1.3))
    axes.set_yticks(range(len(every)), [_short(each.name, 40 if width == WIDE else 18) for each in every])
    axes.set_ylim(len(every) - 0.5, -0.5)
    axes.grid(axis="y", visible=False)
    axes.set_xlabel(label("rms deviation", found.unit))
    drawing.legend_above(axes, 1)


def _over_time(axes: Axes, found: Comparison, model: Deviation) -> None:
    """A model's deviation over time, the records one after another, with the noise."""
    start = 0.0
    gap = GAP * sum(float(np.ptp(record.t)) for record in found.records)
    for record, error in zip(found.records, model.errors, strict=True):
        first, last = np.flatnonzero(np.isfinite(error))[[0, -1]].tolist()
        chosen = drawing.kept(first, last + 1, error)
        t = record.t - record.t[first] + start
        axes.plot(t[chosen], error[chosen], color=_colour(found, model), linewidth=0.8)
        start = float(t[last]) + gap
        if record is not found.records[-1]:
            axes.axvline(start - 0.5 * gap, color=drawing.IGNORED, linewidth=0.8)
    for side in (found.noise, -found.noise):
        axes.axhline(side, color=drawing.FAULT, linewidth=0.8, linestyle="--")


def _colour(found: Comparison, model: Deviation) -> str:
    """Green for the closest model and those that cannot be told from it."""
    return drawing.RESIDUAL if model in (found.models[0], *found.tied) else drawing.MODEL


def _short(name: str, most: int) -> str:
    """The end of a long name, which tells files apart."""
    return name if len(name) <= most else f"..{name[2 - most :]}"


def html(found: Comparison) -> str:
    """The page. Raises PlotError without matplotlib."""
    names = ", ".join(record.name for record in found.records)
    picture = drawn(
        "deviations", partial(figure, found), (WIDE, NARROW),
        f"Above: rms deviation of every model and of a {LINE} on {names}; green: the closest, and any that cannot be "
        "told from it. Below: measured minus model over time, on one scale for all models; dashed: the noise, 1 sd. "
        "Samples that are not compared are left out.",
        "The rms deviation of each model beside the noise, and panels with each model's deviation over time.",
    )
    rows = found.rows()
    noise = f"The noise of the records is {found.noise:.3g}{f' {found.unit}' if found.unit else ''} rms."
    free = (
        "On these records, only the offset of each and, unless the history is given, its start state are fitted. The "
        f"{LINE} has one slope for all of them, by least squares."
    )
    marked = None if found.tied else [row[0] for row in rows[1:]].index(found.models[0].name)
    sections = [
        Section("Side by side", [HtmlTable(rows, (0, 1), marked), Text(noise), Text(free)]),
        Section("Deviations", [picture]),
        Section("Zoom and read values", [_zoom(found)]),
        Section("What was done to the data", [Listing(found.notes) if found.notes else Text("Nothing.")]),
        Section("Provenance", [Text(f"hystgen {__version__}; the same records and models give the same page.")]),
    ]
    return page("Comparison of models", [Text(found.sentence()), *_next_step(found)], sections)


def _next_step(found: Comparison) -> list[Text]:
    """What to do with the closest model, and why a model has no C yet."""
    why = [Text(f"{each.name} has no C yet: {each.refused}.") for each in found.models if each.refused]
    step, command = found.next_step()
    return [*why, *([Text(f"Your next step: {step}.", command)] if step else [])]


def _zoom(found: Comparison) -> Viewer:
    """The records with every model, the closest last, in the colour of a single model."""
    shown = [
        Viewed(each.name, "compared", each.t, each.v, each.y, {
            model.name: each.y - model.errors[k] for model in reversed(found.models)
        })
        for k, each in enumerate(found.records)
    ]
    return Viewer(shown, (found.drive_unit, found.unit), found.noise)


compare = presented(comparison.compare, html, figure)
"""`hystgen.compare`: the comparison, with a page to write and a picture to draw."""
