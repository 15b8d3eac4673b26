"""Pictures of a fit, and of a compensator's tracking over records."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hystgen.basics import drawing
from hystgen.basics.drawing import label
from hystgen.report import fit_figures, panels
from hystgen.tracking import LINE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hystgen.identification import Fit
    from hystgen.records import Record
    from hystgen.tracking import Tracking


def tracking_figure(tracking: Tracking) -> Figure:
    """The motion in each record, the tracking error of each compensator over time on one scale, and the same enlarged
    without the straight line."""
    figure = drawing.figure(9.0, 1.0 + 5.0 * len(tracking.records))
    grid = figure.subplots(3 * len(tracking.records), 1, squeeze=False)[:, 0]
    colours = (drawing.OTHER, drawing.GAP, drawing.MODEL)
    for motion, error, enlarged, each in zip(grid[::3], grid[1::3], grid[2::3], tracking.records, strict=True):
        motion.sharex(enlarged)
        error.sharex(enlarged)
        chosen = drawing.kept(0, len(each.t), each.reference)
        motion.plot(each.t[chosen], each.reference[chosen], color=drawing.MEASURED, linewidth=1.0)
        motion.set(title=each.name, ylabel=label("reference", tracking.unit))
        most = 0.0
        for (which, values), colour in zip(each.errors.items(), colours, strict=True):
            words = f"{which}: {each.rms(which):.3g} % rms"
            chosen = drawing.kept(0, len(each.t), values)
            error.plot(each.t[chosen], 100.0 * values[chosen] / each.span, color=colour, linewidth=1.0, label=words)
            if which != LINE:
                enlarged.plot(each.t[chosen], 100.0 * values[chosen] / each.span, color=colour, linewidth=1.0)
                most = max(most, each.most(which))
        for axes in (motion, error):
            axes.tick_params(labelbottom=False)
        error.set(ylabel="error (% of span)")
        drawing.legend_above(error, 3)
        if most > 0.0:  # the errors before the memory is known may be larger than all others
            enlarged.set_ylim(-1.1 * most, 1.1 * most)
        enlarged.set_title(f"Enlarged, without the {LINE}", fontsize=9.5)
        enlarged.set(xlabel="time (s)", ylabel="error (% of span)")
    figure.align_ylabels(grid)
    return figure


def fit_figure(fit: Fit, records: Sequence[Record]) -> Figure:
    """Measured and predicted loop of one record, the same less the straight line by speed, residuals over time, and the
    weights.

    `records`: the fitted records, then the held-out ones; the loop is from a held-out record if there is one.
    """
    units = fit.parameters.units
    shown = fit_figures.of_fit(fit, records)
    figure = drawing.figure(10.5, 8.2)
    (loop, deviation), (residual, weights) = figure.subplots(2, 2)
    judged = fit_figures.drawn_ones(shown)[-1]
    fit_figures.loop_panel(loop, judged, units)
    points = fit_figures.deviation_panel(deviation, judged, units, panels.fastest([np.abs(judged.rate)]))
    figure.colorbar(points, ax=deviation, label=label("speed", fit_figures.per_second(units)), pad=0.02, aspect=30)
    for each, colour in zip(shown, itertools.cycle((drawing.RESIDUAL, drawing.OTHER, drawing.GAP)), strict=False):
        fit_figures.residual_panel(residual, each, units, colour)
    drawing.noise_lines(residual, fit_figures.noise_of(shown))
    pad = 20 if len(shown) < 2 else 34
    residual.set_title("Residual", pad=pad)
    drawing.legend_above(residual, 2)
    fit_figures.weight_panel(weights, fit, units, range(len(fit.parameters.model.pi.thresholds)))
    weights.set_title("Weights", pad=pad)
    weights.set(xlabel=label("threshold", units.input))
    figure.suptitle(f"{fit.parameters.name}: identified")
    return figure
