"""The page of a fleet: its units side by side, the distribution of their figures, and the outliers."""

from __future__ import annotations

import csv
import io
import os
import shlex
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hystgen import comparison
from hystgen.basics import drawing, writing
from hystgen.basics.drawing import Array, label
from hystgen.basics.problems import counted
from hystgen.basics.version import __version__
from hystgen.fleet import outliers
from hystgen.fleet.batch import Fleet, Unit
from hystgen.fleet.outliers import Judged
from hystgen.model import Model, load
from hystgen.report.html import Folded, HtmlTable, Picture, Section, Text, drawn, page
from hystgen.report.panels import straight_line
from hystgen.report.viewer import Viewed, Viewer

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FILES = ("report.html", "units.svg", "loops.svg")

WIDE, NARROW = 9.0, 4.4
"""[inches] Widths of the pictures on a screen and on a phone."""

NAMED = 30
"""[units] More units than these are numbered, not named, below the picture, where names would overlap."""

MARKED = 8
"""[units] Maximum number of outliers that are named in a panel; the table names all."""

ZOOMED = 12
"""[units] Maximum number of records to zoom into, so that the page stays small: outliers and the typical unit."""


def report_fleet(fleet: Fleet, folder: str | os.PathLike[str]) -> Path:
    """Write `report.html`, which is self-contained, and its pictures into a folder, either all files or none; returns
    the page's path.

    The loops come from the parameter files, and the outliers' records are read again. Raises PlotError without
    matplotlib, ParameterError, OSError.
    """
    models = {unit.name: load(fleet.folder / f"{unit.name}.yaml") for unit in fleet.units if unit.done}
    pictures = []
    if models:
        pictures = [_units(fleet), _loops(fleet, models)]
    text = page(f"Fleet of {counted(len(fleet.units), 'unit')}", _lead(fleet), _sections(fleet, pictures))
    made = {FILES[0]: text.encode("utf-8"), **{f"{each.name}.svg": each.wide for each in pictures}}
    return writing.write_files(Path(folder), made)[0]


def _lead(fleet: Fleet) -> list[Text]:
    done = len(fleet.units) - len(fleet.failed)
    found = f"outliers are judged only with {outliers.FEWEST} or more"
    if fleet.judged:
        found = f"{counted(len(fleet.outliers), 'outlier')} among them"
    said = [Text(f"{counted(done, 'unit')} identified, {found}; {len(fleet.failed)} failed.")]
    for unit in [*fleet.failed, *fleet.outliers][:1]:
        why = "the failed unit" if unit in fleet.failed else "the outlier"
        command = f"hystgen identify {shlex.quote(unit.file)} -o {unit.name}.yaml --report {unit.name}/"
        said.append(Text(f"Your next step: look at {why} {unit.name}.", command))
    return said


def _sections(fleet: Fleet, pictures: list[Picture]) -> list[Section]:
    head, *rows = csv.reader(io.StringIO(fleet.summary()))
    words = [k for k, name in enumerate(head) if name in ("unit", "file", "status", "message", "kind", "outlier_in")]
    table = HtmlTable([row[:-1] for row in (head, *rows)], words)
    failed = [("unit", "reason"), *((unit.name, unit.message) for unit in fleet.failed)]
    far = [("unit", "figures far from the median, with modified z-scores")]
    far += [(unit.name, unit.outlier) for unit in fleet.outliers]
    marked = [
        Section(title, [HtmlTable(listed, (0, 1))])
        for title, listed in (("Failed", failed), ("Outliers", far))
        if len(listed) > 1
    ]
    zoom = _zoom(fleet)
    return [
        *marked,
        *(Section(title, [each]) for title, each in zip(("Units side by side", "Loops"), pictures, strict=False)),
        *([Section("Zoom and read values", zoom)] if zoom else []),
        Section("All units", [Folded(counted(len(fleet.units), "unit"), [table])]),
        Section("Provenance", [Text(f"hystgen {__version__}; the same records give the same page.")]),
    ]


# The figures of the units -----------------------------------------------------------------------------------------


def _values(fleet: Fleet, judged: Judged) -> dict[str, float]:
    """A figure of every unit that has it, as it is compared."""
    found = {unit.name: judged.value(unit.figures) for unit in fleet.units if unit.done}
    return {name: value for name, value in found.items() if value is not None}


def _shown(fleet: Fleet) -> list[Judged]:
    """The figures to draw: those judged, with the error of the fit where nothing was held out."""
    listed = [each for each in outliers.JUDGED if _values(fleet, each)]
    return listed if any(each.error for each in listed) else [FITTED, *listed]


FITTED = Judged("rms % of the fit", "fit_rms_percent", error=True)


def _units(fleet: Fleet) -> Picture:
    listed = _shown(fleet)
    names = ", ".join(each.words for each in listed)
    limits = "; shaded: not an outlier" if fleet.judged else ""
    return drawn(
        "units", partial(_units_figure, fleet, listed), (WIDE, NARROW),
        f"Each point is a unit, in the order of their names; at the right the distribution of each figure; line: the "
        f"median{limits}. {'Red: units that are outliers in this figure or another. ' if fleet.outliers else ''}"
        "Width: of the widest loop; gain: range of the output over that of the drive.",
        f"{names} of every unit, with their distributions.",
    )


def _units_figure(fleet: Fleet, listed: list[Judged], width: float) -> Figure:
    wide = width == WIDE
    figure = drawing.figure(width, (1.5 if wide else 1.7) * len(listed) + 0.6)
    grid = figure.subplots(len(listed), 2, squeeze=False, sharey="row", width_ratios=(5, 1))
    order = [unit.name for unit in fleet.units if unit.done]
    odd = {unit.name: unit.outlier for unit in fleet.outliers}
    for (axes, beside), judged in zip(grid, listed, strict=True):
        values = _values(fleet, judged)
        points = {name: float(np.exp(value)) if judged.error else value for name, value in values.items()}
        for name, value in points.items():
            colour = drawing.FAULT if name in odd else drawing.MODEL
            axes.plot(order.index(name), value, "o", markersize=4, color=colour)
        far = [name for name in points if judged.words in odd.get(name, "")][:MARKED]
        for name in far:
            right = order.index(name) > len(order) / 2
            axes.annotate(
                name, (order.index(name), points[name]), (-6 if right else 6, 0), textcoords="offset points",
                fontsize=8, color=drawing.FAULT, ha="right" if right else "left", va="center",
            )
        _limits(axes, beside, judged, list(values.values()), fleet.judged)
        edges = _bins(list(values.values()), judged)
        beside.hist(list(points.values()), bins=edges, orientation="horizontal", color=drawing.QUIET)
        beside.tick_params(labelbottom=False)
        beside.grid(visible=False)
        axes.set(ylabel=judged.words, xlim=(-0.7, len(order) - 0.3))
        axes.tick_params(labelbottom=False)
    bottom = grid[-1, 0]
    bottom.tick_params(labelbottom=True)
    if len(order) <= (NAMED if wide else NAMED // 2):
        bottom.set_xticks(range(len(order)), order, rotation=90)
    else:
        bottom.locator_params(axis="x", integer=True)
        bottom.set(xlabel="unit, in the order of the table")
    grid[-1, 1].set(xlabel="units")
    figure.align_ylabels(grid[:, 0])
    return figure


def _bins(values: list[float], judged: Judged) -> Array:
    """Edges of a histogram with about the square root of the number of values as bins; even in the compared values."""
    edges = np.linspace(min(values), max(values), max(5, round(np.sqrt(len(values)))) + 1)
    if edges[0] == edges[-1]:
        edges = edges[0] + max(abs(edges[0]), 1.0) * np.linspace(-0.05, 0.05, 6)
    return np.exp(edges) if judged.error else edges


def _limits(axes: Axes, beside: Axes, judged: Judged, values: list[float], marked: bool) -> None:
    """The median, and the band of the values that are no outliers."""
    middle, far = outliers.spread(values)[0], outliers.margin(judged, values)
    ends = [middle - (100.0 if judged.error else far), middle, middle + far]
    low, at, high = np.exp(ends) if judged.error else ends
    if judged.error:
        drawing.decades(axes, "y", (0.7 * float(np.exp(min(values))), 1.4 * float(np.exp(max(*values, ends[2])))))
    for each in (axes, beside):
        each.axhline(at, color=drawing.QUIET, linewidth=0.9)
        if marked:
            each.axhspan(max(low, axes.get_ylim()[0]), high, color=drawing.OTHER, alpha=0.08, linewidth=0)


# The loops --------------------------------------------------------------------------------------------------------


def _loops(fleet: Fleet, models: Mapping[str, Model]) -> Picture:
    odd = [unit.name for unit in fleet.outliers]
    named = f"; red: the outliers{'' if len(odd) > MARKED else ', ' + ', '.join(odd)}" if odd else ""
    return drawn(
        "loops", partial(_loops_figure, models, odd), (WIDE, NARROW),
        f"The loop of every model over its drive range, and its deviation from the straight line that is best for all "
        f"of them{named}.",
        "Loops of all models, and their deviations from one straight line.",
    )


def _loops_figure(models: Mapping[str, Model], odd: list[str], width: float) -> Figure:
    loops = {name: _loop(model) for name, model in models.items()}
    offset, slope = straight_line(*(np.concatenate([each[k] for each in loops.values()]) for k in (0, 1)))
    wide = width == WIDE
    figure = drawing.figure(width, 3.8 if wide else 7.2)
    left, right = figure.subplots(1, 2) if wide else figure.subplots(2, 1)
    units = next(iter(models.values())).parameters.units
    for name in sorted(loops, key=lambda name: name in odd):
        v, y = loops[name]
        style = {"color": drawing.FAULT if name in odd else drawing.QUIET, "linewidth": 1.1 if name in odd else 0.6}
        left.plot(v, y, rasterized=len(models) > NAMED, **style)
        right.plot(v, y - offset - slope * v, rasterized=len(models) > NAMED, **style)
    for axes, what in ((left, "displacement"), (right, "displacement \N{MINUS SIGN} line")):
        axes.set(xlabel=label("drive", units.input), ylabel=label(what, units.output))
    return figure


def _loop(model: Model) -> tuple[Array, Array]:
    """Drive and output of a model over its whole range, down and up, without effects."""
    low, high = model.cascade.input_range
    v = np.concatenate([np.linspace(low, high, 100), np.linspace(high, low, 100), np.linspace(low, high, 100)])
    return v[100:], np.asarray(model.cascade.simulate(v))[100:]


# Records to zoom into ---------------------------------------------------------------------------------------------


def _zoom(fleet: Fleet) -> list[Text | Viewer]:
    """The records of the outliers, and of the unit whose error is the median."""
    error = _shown(fleet)[0]
    sound = [unit for unit in fleet.units if unit.done and not unit.outlier and error.value(unit.figures) is not None]
    sound.sort(key=lambda unit: error.value(unit.figures) or 0.0)
    typical = sound[len(sound) // 2 :][:1]
    viewed: list[Viewed] = []
    units = ("", "")
    for unit in [*fleet.outliers[: ZOOMED - 1], *typical]:
        found = _compared(fleet, unit)
        if found is not None:
            units = (found.drive_unit, found.unit)
            (record, *_), (model,) = found.records, found.models
            role = "outlier" if unit.outlier else "typical unit"
            viewed.append(Viewed(unit.name, role, record.t, record.v, record.y, {"model": record.y - model.errors[0]}))
    if not viewed:
        return []
    return [Text("The records of the outliers, and of a typical unit."), Viewer(viewed, units)]


def _compared(fleet: Fleet, unit: Unit) -> comparison.Comparison | None:
    """A unit's model on its own record; None if the record cannot be read any more."""
    keys = ("history", "rest", "skip", "columns", "sample_time", "delimiter")
    options = {key: fleet.options[key] for key in keys if key in fleet.options}
    compare: Callable[..., comparison.Comparison] = comparison.compare
    try:
        return compare(fleet.folder / f"{unit.name}.yaml", unit.file, **options)
    except (ValueError, OSError):
        return None
