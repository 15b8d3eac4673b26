"""Pictures of a fit, and of a compensator's tracking over records."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

from hystgen.basics import drawing
from hystgen.basics.drawing import label
from hystgen.report import fit_figures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hystgen.identification import Fit
    from hystgen.records import Record
    from hystgen.tracking import Tracking


def tracking_figure(tracking: Tracking) -> Figure:
    """The motion in each record, and the tracking error of each compensator over time."""
    figure = drawing.figure(9.0, 1.0 + 3.4 * len(tracking.records))
    panels = figure.subplots(2 * len(tracking.records), 1, squeeze=False)[:, 0]
    colours = (drawing.OTHER, drawing.GAP, drawing.MODEL)
    for motion, error, each in zip(panels[::2], panels[1::2], tracking.records, strict=True):
        motion.plot(each.t, each.reference, color=drawing.MEASURED, linewidth=1.0)
        motion.set(title=each.name, ylabel=label("reference", tracking.unit))
        for (which, values), colour in zip(each.errors.items(), colours, strict=True):
            words = f"{which}: {each.rms(which):.3g} % rms"
            error.plot(each.t, 100.0 * values / each.span, color=colour, linewidth=1.0, label=words)
        error.set(xlabel="time (s)", ylabel="tracking error (% of span)")
        drawing.legend_above(error, 3)
    return figure


def fit_figure(fit: Fit, records: Sequence[Record]) -> Figure:
    """Measured and predicted loop of one record, residuals over time, and the weights.

    `records`: the fitted records, then the held-out ones; the loop is from a held-out record if there is one.
    """
    units = fit.parameters.units
    shown = fit_figures.of_fit(fit, records)
    figure = drawing.figure(13.8, 4.2)
    loop, residual, weights = figure.subplots(1, 3)
    fit_figures.loop_panel(loop, fit_figures.drawn_ones(shown)[-1], units)
    for each, colour in zip(shown, itertools.cycle((drawing.RESIDUAL, drawing.OTHER, drawing.GAP)), strict=False):
        fit_figures.residual_panel(residual, each, units, colour)
    drawing.noise_lines(residual, fit_figures.noise_of(shown))
    residual.set_title("Residual", pad=20 if len(shown) < 2 else 34)
    drawing.legend_above(residual, 2)
    fit_figures.weight_panel(weights, fit, units, range(len(fit.parameters.model.pi.thresholds)))
    weights.set_title("Weights", pad=20)
    weights.set(xlabel=label("threshold", units.input))
    figure.suptitle(f"{fit.parameters.name}: identified")
    return figure
