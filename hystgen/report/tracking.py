"""The picture and the page of a compensator's tracking on the recorded actuator."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from hystgen import tracking
from hystgen.basics import drawing
from hystgen.basics.drawing import Array, label
from hystgen.basics.version import __version__
from hystgen.report import panels
from hystgen.report.html import HtmlTable, Listing, Picture, Section, Text, drawn, page, presented
from hystgen.report.viewer import Viewed, Viewer
from hystgen.tracking import LINE, PLAYS, WHOLE, Tracked, Tracking

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDE, NARROW = 9.0, 4.4
"""[inches] Widths of the pictures on a screen and on a phone."""

COLOURS: Mapping[str, str] = {LINE: drawing.OTHER, PLAYS: drawing.GAP, WHOLE: drawing.MODEL}


def shown(found: Tracking) -> list[str]:
    """The compensators to draw: without effects, plays alone are the whole model."""
    return [which for which in COLOURS if found.left_out or which != PLAYS]


def figure(found: Tracking, width: float = WIDE) -> Figure:
    """Per record the reference and the motion; the error of each compensator over time on one scale; the same enlarged
    without the straight line; and the stretch in which the whole model's error is largest, on a scale of its own."""
    wide = width == WIDE
    whole = drawing.figure(width, 0.5 + (6.8 if wide else 9.4) * len(found.records))
    grid = whole.subplots(4 * len(found.records), 1, squeeze=False)
    for (motion, error, enlarged, worst), each in zip(grid.reshape(-1, 4), found.records, strict=True):
        motion.sharex(enlarged)
        error.sharex(enlarged)
        chosen = drawing.kept(0, len(each.t), each.reference)
        motion.plot(each.t[chosen], each.reference[chosen], label="reference", **drawing.LINES["measured"])
        _draw(motion, each, LINE, each.reference - each.errors[LINE], f"motion, {LINE}")
        motion.set(ylabel=label("displ.", found.unit))
        motion.set_title(each.name, pad=8 if wide else 36)
        for which in shown(found):
            in_percent = 100.0 * each.errors[which] / each.span
            _draw(error, each, which, in_percent, f"{which}: {each.rms(which):.3g} % rms")
            if which != LINE:
                _draw(enlarged, each, which, in_percent)
        for axes in (motion, error):
            axes.tick_params(labelbottom=False)
            drawing.legend_above(axes, 3 if wide else 1)
        most = max(each.most(which) for which in shown(found)[1:])
        if most > 0.0:  # the errors before the memory is known may be larger than all others
            enlarged.set_ylim(-1.1 * most, 1.1 * most)
        enlarged.set_title(f"Enlarged, without the {LINE}", fontsize=9.5)
        for axes in (error, enlarged):
            axes.set(ylabel="error (% of span)")
        left = compared(each, WHOLE)
        first, last = panels.worst_stretch(left)
        _draw(worst, each, WHOLE, left)
        peak = float(np.nanmax(np.abs(left[first:last]))) or 1.0
        worst.set(xlim=(each.t[first], each.t[last - 1]), ylim=(-1.1 * peak, 1.1 * peak), xlabel="time (s)")
        worst.set(ylabel=label("error", found.unit))
        rms = float(np.sqrt(np.nanmean(left[first:last] ** 2)))
        worst.set_title(f"Worst stretch: error {rms:.3g}{f' {found.unit}' if found.unit else ''} rms", fontsize=9.5)
        enlarged.axvspan(each.t[first], each.t[last - 1], color=drawing.GAP, alpha=0.15, linewidth=0)
        enlarged.set(xlabel="time (s)")
    whole.align_ylabels(grid[:, 0])
    return whole


def _draw(axes: Axes, each: Tracked, which: str, values: Array, name: str | None = None) -> None:
    """A line over time in the colour of a compensator."""
    chosen = drawing.kept(0, len(each.t), values)
    axes.plot(each.t[chosen], values[chosen], color=COLOURS[which], linewidth=1.0, label=name)


def compared(each: Tracked, which: str) -> Array:
    """Error (N,) of a compensator; NaN before the memory is known."""
    return np.where(np.arange(len(each.t)) < each.known, np.nan, each.errors[which])


def worst_record(found: Tracking) -> Tracked:
    """The record with the whole model's largest error, relative to its motion."""
    return max(found.records, key=lambda each: each.rms(WHOLE))


Densities = Mapping[str, tuple[Array, Array]]
"""Frequencies and spectral density of each compensator's error."""


def densities(found: Tracking, each: Tracked) -> Densities:
    """The spectra of a record; empty if it is too short."""
    spectra = {which: panels.density(each.t, compared(each, which)) for which in shown(found)}
    return {which: one for which, one in spectra.items() if one is not None}


def spectrum(name: str, unit: str, spectra: Densities, width: float) -> Figure:
    """The spectra of the compensators' errors, with the mains."""
    figure = drawing.figure(width, 3.8)
    axes = figure.subplots()
    for which, (hertz, values) in spectra.items():
        axes.plot(hertz, values, color=COLOURS[which], linewidth=1.0, label=which)
    drawing.decades(axes, "x", (float(hertz[0]), float(hertz[-1])))
    drawing.decades(axes, "y")
    panels.mark_mains(axes, *spectra[WHOLE])
    axes.set(xlabel="frequency (Hz)", ylabel=label("error density", f"{unit}/\N{SQUARE ROOT}Hz" if unit else None))
    axes.set_title(name, pad=20)
    drawing.legend_above(axes)
    return figure


def html(found: Tracking) -> str:
    """The page. Raises PlotError without matplotlib."""
    each = worst_record(found)
    errors = drawn(
        "errors", partial(figure, found), (WIDE, NARROW),
        f"From the top, for each record: its motion, which is the reference, and the motion with the {LINE}; the "
        f"tracking error of each compensator, reference minus motion; the same enlarged, without the {LINE}; and the "
        "stretch shaded above, in which the whole model's error is largest.",
        f"Tracking errors over time. {found.sentence()}",
    )
    spectra = densities(found, each)
    below: Picture | Text = Text(f"No spectrum: {each.name} has no 64 samples in a row.")
    if spectra:
        caption = f"Spectral density of each compensator's error. {panels.mains_words(*spectra[WHOLE])}"
        below = drawn("spectrum", partial(spectrum, each.name, found.unit, spectra), (WIDE, NARROW), caption, caption)
    limits = [*(text for record in found.records for text in record.limited), *found.notes]
    note = Text("In % of the span of the motion, about the mean, from the sample at which the memory is known.")
    what = Listing([f"{which}: {text}." for which, text in found.compensators.items()])
    sections = [
        Section("Tracking errors", [HtmlTable(found.rows(), (0, 1)), note, what]),
        Section("Over time", [errors]),
        Section("Zoom and read values", [_zoom(found)]),
        Section("Spectrum of the error", [below]),
        Section("Limits and conversions", [Listing(limits) if limits else Text("None.")]),
        Section("Provenance", [Text(f"hystgen {__version__}; the same model and records give the same page.")]),
    ]
    return page("Tracking on the recorded actuator", [Text(found.sentence())], sections)


def _zoom(found: Tracking) -> Viewer:
    """The motions with each compensator, and the drives of the whole model."""
    viewed = [
        Viewed(each.name, "reference", each.t, each.drive, each.reference, {
            which: each.reference - compared(each, which) for which in shown(found)
        })
        for each in found.records
    ]
    return Viewer(viewed, (found.drive_unit, found.unit), words=("reference", "reference \N{MINUS SIGN} motion"))


track = presented(tracking.track, html, figure)
"""`hystgen.track`: the tracking errors, with a page to write and a picture to draw."""
