"""The picture and the page of a unit in service: its sessions, the change, loops before and after, and the cause."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, ParamSpec

import numpy as np

from hystgen.basics import drawing
from hystgen.basics.drawing import label
from hystgen.basics.version import __version__
from hystgen.report.html import HtmlTable, Listing, Picture, Section, Text, page
from hystgen.report.viewer import Viewed, Viewer
from hystgen.service import monitoring
from hystgen.service.change import amount
from hystgen.service.monitoring import Monitoring
from hystgen.service.sessions import DIRECTIONS, ServiceSession

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDE, NARROW = 9.0, 4.2
"""[inches] Widths of the picture on a screen and on a phone."""

MOST_VIEWED = 4
"""[sessions] Before and after the change to zoom into; each adds up to 9 bytes a sample to the page."""

MOST_NAMES = 12
"""[sessions] More are numbered on the axis of a picture, not named."""

P = ParamSpec("P")


def _with_page(find: Callable[P, Monitoring]) -> Callable[P, Monitoring]:
    @functools.wraps(find)
    def found(*given: P.args, **named: P.kwargs) -> Monitoring:
        return replace(find(*given, **named), page=html, draw=figure)

    return found


monitor = _with_page(monitoring.monitor)
"""`hystgen.monitor`: the judgement, with a page to write and a picture to draw."""


def figure(found: Monitoring, width: float = WIDE) -> Figure:
    """Over the sessions: the clearest direction with its band, and the rms errors; below, the deviation over the drive
    before and after the change."""
    drawn = drawing.figure(width, 7.5 if width == WIDE else 10.0)
    below = "bn" if found.first else "n"
    places = ";".join(["o" * len(below), "e" * len(below), below])
    axes = drawn.subplot_mosaic(places, height_ratios=(1.0, 1.0, 1.2))
    axes["e"].sharex(axes["o"])
    axes["o"].tick_params(labelbottom=False)
    _over_sessions(axes["o"], found)
    _errors(axes["e"], found)
    _deviations([axes[name] for name in below], found)
    return drawn


def _over_sessions(axes: Axes, found: Monitoring) -> None:
    """The distance from the model along the clearest direction, in %, with the band that healthy sessions stay in."""
    best = found.clearest
    name = "gain" if best is None else best.direction
    shown = [(k, each.seen[name]) for k, each in enumerate(found.sessions) if name in each.seen]
    if not shown:
        return
    k = np.array([k for k, _ in shown])
    scale, unit = (1e3, "ms") if name == "rate" else (100.0, "%")
    values, sure = (scale * np.array([getattr(each, which) / each.size for _, each in shown])
                    for which in ("part", "sure"))
    axes.errorbar(k, values, 1.96 * sure, fmt="o", color=drawing.MEASURED, markersize=5, linewidth=1.2)
    centre, spread = found.band(name)
    axes.axhspan(scale * (centre - spread), scale * (centre + spread), color=drawing.RESIDUAL, alpha=0.15,
                 label=f"healthy sessions, {100.0 * (1.0 - found.false_alarms):.4g} %")
    _mark(axes, found)
    axes.set_title(DIRECTIONS[name][0].upper() + DIRECTIONS[name][1:], fontsize=9, pad=18)
    axes.set_ylabel(f"off the model ({unit})")
    drawing.legend_above(axes, 2)


def _errors(axes: Axes, found: Monitoring) -> None:
    """The rms residual and the rms tracking error of every session."""
    k = np.arange(len(found.sessions))
    axes.plot(k, [each.rms for each in found.sessions], "o-", color=drawing.RESIDUAL, label="off the model")
    tracked = [np.nan if each.tracking is None else each.tracking for each in found.sessions]
    if np.isfinite(tracked).any():
        axes.plot(k, tracked, "s-", color=drawing.MODEL, label="off the reference")
    if found.residual is not None:
        axes.axhline(found.residual, color=drawing.FAULT, linestyle="--", linewidth=1.0, label="identification")
    _mark(axes, found)
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel(label("rms error", found.model.parameters.units.output))
    named = len(k) <= MOST_NAMES
    axes.set_xticks(k, [each.name for each in found.sessions] if named else [str(j + 1) for j in k])
    axes.tick_params(axis="x", labelrotation=30 if named else 0)
    if named:
        for text in axes.get_xticklabels():
            text.set_horizontalalignment("right")
    drawing.legend_above(axes, 3)


def _mark(axes: Axes, found: Monitoring) -> None:
    if found.alarm:
        axes.axvline(found.first - 0.5, color=drawing.FAULT, linewidth=1.5, label="change")


def _deviations(panels: Sequence[Axes], found: Monitoring) -> None:
    """Measured minus expected over the drive, of the last session before and of the last since the change."""
    shown = [found.sessions[-1]] if not found.first else [found.sessions[found.first - 1], found.sessions[-1]]
    for axes, session in zip(panels, shown, strict=True):
        chosen = drawing.kept(0, len(session.known), session.residual)
        axes.plot(session.item.run.v[session.known][chosen], session.residual[chosen], color=drawing.RESIDUAL,
                  linewidth=0.8)
        axes.set_title(session.name, fontsize=9)
        axes.set_xlabel(label("drive", found.model.parameters.units.input))
    most = max(float(np.max(np.abs(each.residual))) for each in shown)
    for axes in panels:
        axes.set_ylim(-1.05 * most, 1.05 * most)
    panels[0].set_ylabel(label("deviation", found.model.parameters.units.output))


def html(found: Monitoring) -> str:
    """The page. Raises PlotError without matplotlib."""
    with drawing.styled():
        wide, narrow = (drawing.content(figure(found, width), "svg") for width in (WIDE, NARROW))
    marked = "; the vertical line is the change" if found.alarm else ""
    picture = Picture(
        "sessions", wide, narrow,
        "Above: how far the unit is from its model in every session, with 95 % intervals, and the band in which "
        f"healthy sessions stay{marked}. Middle: rms of measured minus expected and of measured minus reference. "
        "Below: deviation from the model over the drive, without offset and drift"
        + (", before and since the change." if found.alarm else "."),
        "Sessions over time with the band of healthy ones, rms errors, and deviations over the drive.",
    )
    sections = [
        Section("Over the sessions", [picture]),
        Section("Does it matter?", [_worth(found)]),
        Section("What changed", [Text(found.cause or _no_cause(found)), *_changes(found)]),
        Section("Sessions", [_table(found), Text(f"In the order of: {found.order}.")]),
        Section("Zoom", [_zoom(found)]),
        Section("What would tell more", [Listing(found.advice()) if found.advice() else Text("Nothing is open.")]),
        Section("What was done to the data", [Listing(found.notes) if found.notes else Text("Nothing.")]),
        Section("Provenance", [Text(f"hystgen {__version__}; the same records and model give the same page.")]),
    ]
    return page("A unit in service", [Text(found.sentence()), *_next_step(found)], sections)


def _next_step(found: Monitoring) -> list[Text]:
    if not found.alarm:
        return []
    command = "hystgen monitor params.yaml RECORDS --refine new.yaml"
    return [Text("Your next step: bring the model up to date.", command)]


def _no_cause(found: Monitoring) -> str:
    return "The diagnosis was not asked." if found.alarm else "Nothing stands out of what healthy sessions show."


def _number(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.4g}"


def _worth(found: Monitoring) -> HtmlTable:
    unit = found.model.parameters.units.output
    now = "since the change" if found.alarm else "last session"
    return HtmlTable(
        [
            [label("rms error", unit), "before", now],
            ["measured minus expected", _number(found.rms_then), _number(found.rms_now)],
            ["measured minus reference", _number(found.tracking_then), _number(found.tracking_now)],
        ],
        (0,),
    )


def _changes(found: Monitoring) -> list[HtmlTable | Text]:
    rows = [["direction", "first session", "change", "95 % from", "to", "p", "against", "remark"]]
    for each in found.changes:
        low, high = each.interval
        rows.append([
            DIRECTIONS[each.direction], found.sessions[each.first].name,
            *(amount(each.direction, x) for x in (each.size, low, high)), f"{each.p_value:.2g}", each.against,
            each.refused,
        ])
    explained = (
        "Every direction in which a unit can move away from its model, with the clearest change along it. p is the "
        f"chance of one so clear in a healthy set of sessions, over all directions; the alarm is at "
        f"{found.false_alarms:g}."
    )
    return [Text(explained), HtmlTable(rows, (0, 1, 6, 7))]


def _table(found: Monitoring) -> HtmlTable:
    unit = found.model.parameters.units.output
    off = label("off the model, rms", unit)
    rows = [["session", "samples", off, "of which structured", "gain", "off the reference"]]
    for each in found.sessions:
        gain = "" if each.gain is None else f"{100.0 * each.gain:+.3g} %"
        rows.append([
            each.name, str(len(each.known)), f"{each.rms:.4g}", f"{each.structured:.4g}", gain, _number(each.tracking)
        ])
    return HtmlTable(rows, (0,), found.first if found.alarm else None)


def _zoom(found: Monitoring) -> Viewer:
    """The sessions around the change."""
    units = found.model.parameters.units
    chosen = [*found.sessions[max(found.first - MOST_VIEWED // 2, 0) : found.first], *found.now[-(MOST_VIEWED // 2) :]]

    def viewed(each: ServiceSession) -> Viewed:
        role = "held out" if each in found.now else "fit"
        return Viewed(each.name, role, each.item.run.t, each.item.run.v, each.item.y, {"model": each.expected})

    return Viewer([viewed(each) for each in chosen], (units.input, units.output), None)
