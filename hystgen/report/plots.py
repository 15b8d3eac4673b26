"""Pictures of a fit and of a simulation."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hystgen import simulation
from hystgen.arithmetic import FIXED
from hystgen.basics import drawing
from hystgen.basics.drawing import Array, label
from hystgen.report import fit_figures, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from hystgen.identification import Fit
    from hystgen.model import Model
    from hystgen.records import Record

NEAR = 0.1
"""[fraction of a range] A limit is drawn if the signal comes this near to it: further away, its line would only flatten
the signal."""


def simulation_figure(
    model: Model, records: Sequence[Record], answers: Sequence[Array], operator: str, arithmetic: str | None
) -> Figure:
    """Per record the signal that the operator takes, its answers (N,), the rate of the drive and, beside the answers,
    the loop of output over drive.

    `records`: in the operator's units. Lines mark `input_range` and the slew limit where the drive is in those units.
    """
    taken, _ = simulation.SIGNALS[operator]
    forward = operator == "forward"
    what = ("drive", "output") if forward else ("reference", "drive")
    units = simulation.units_of(model, operator, arithmetic)
    colours = (drawing.MODEL, drawing.MEASURED) if forward else (drawing.MEASURED, drawing.MODEL)
    figure = drawing.figure(12.0, 6.4 * len(records))
    grid = figure.add_gridspec(3 * len(records), 3)
    for k, (record, found) in enumerate(zip(records, answers, strict=True)):
        signals = (record.columns()[taken], np.asarray(found, dtype=np.float64))
        drive, output = signals if forward else signals[::-1]
        time = "time (s)" if record.timed else "sample"
        panels = [figure.add_subplot(grid[3 * k + row, :2]) for row in range(3)]
        for panel, name, x, unit, colour in zip(panels, what, signals, units, colours, strict=False):
            at = drawing.kept(0, len(x), x)
            panel.plot(record.t[at], x[at], color=colour, linewidth=1.0)
            panel.set(title=name.capitalize(), ylabel=label(name, unit))
        drive_unit, output_unit = units if forward else units[::-1]
        rates, middles = simulation.pace(record.t, drive), 0.5 * (record.t[1:] + record.t[:-1])
        at = drawing.kept(0, len(rates), rates)
        panels[2].plot(middles[at], rates[at], color=drawing.OTHER, linewidth=1.0)
        panels[2].set(title="Rate of the drive", xlabel=time, ylabel=label("rate", f"{drive_unit or 'units'}/s"))
        if arithmetic not in FIXED:
            _mark(panels[0 if forward else 1], model.cascade.input_range, drive, "input range")
            for up, down in simulation.slew_limits(model):
                _mark(panels[2], (-down, up), rates, "slew limit")
        loop = figure.add_subplot(grid[3 * k : 3 * k + 3, 2])
        at = drawing.kept(0, len(drive), drive, output)
        loop.plot(drive[at], output[at], color=drawing.MODEL, linewidth=0.8)
        which = "Output over drive" if forward else "Reference over drive"
        loop.set(title=which, xlabel=label("drive", drive_unit), ylabel=label(what[int(forward)], output_unit))
        if len(records) > 1:
            panels[0].set_title(f"{record.name}: {what[0]}")
        figure.align_ylabels(panels)
    figure.suptitle(f"{model.name}: {operator} operator")
    return figure


def _mark(axes: Axes, ends: tuple[float, float], x: Array, what: str) -> None:
    """Lines at those of both ends of a range that the signal comes near, with a legend."""
    span = ends[1] - ends[0]
    near = [end for end in ends if len(x) and np.min(np.abs(x - end)) < NEAR * span]
    for k, end in enumerate(near):
        axes.axhline(end, color=drawing.FAULT, linewidth=1.0, linestyle="--", label=None if k else what)
    if near:
        drawing.legend_above(axes, 1)


def fit_figure(fit: Fit, records: Sequence[Record]) -> Figure:
    """Measured and predicted loop of one record, their deviation from the straight line by speed, residuals over time,
    and the weights.

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
