"""Plots to a file of the user's choice: a model with its loop, loading curve and inverse; a fit."""

from __future__ import annotations

import itertools
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hystgen.basics.writing import write_atomically
from hystgen.model import Model
from hystgen.report import drawing, fit_figures
from hystgen.report.drawing import PlotError, label

if TYPE_CHECKING:
    from hystgen.identification import Fit
    from hystgen.records import Record
    from hystgen.tracking import Tracking

FORMATS = (".png", ".svg")


def check_path(path: str | os.PathLike[str]) -> None:
    """Raise PlotError for a file that cannot hold a plot."""
    target = Path(path)
    if target.suffix.lower() not in FORMATS:
        raise PlotError(f"{target}: a plot is a .png or .svg file")
    if not target.parent.is_dir():
        raise PlotError(f"{target}: the folder does not exist")
    drawing.require()


def _save(figure: Any, path: str | os.PathLike[str]) -> None:
    check_path(path)
    write_atomically(path, drawing.content(figure, Path(path).suffix.lower()[1:]))


def show_model(model: Model, path: str | os.PathLike[str]) -> None:
    """Loops, initial loading curve and, if it exists, the inverse with its accuracy, as PNG or SVG.

    Raises PlotError without matplotlib or for another file type.
    """
    with drawing.styled():
        _save(_model_figure(model), path)


def _model_figure(model: Model) -> Any:
    c, units = model.cascade, model.parameters.units
    low, high = c.input_range
    invertible = not c.inverse_problems() and not model.effects
    columns = 3 if invertible else 2
    figure = drawing.figure(4.6 * columns, 4.0)
    axes = figure.subplots(1, columns)
    t = np.linspace(0, 1, 1500)
    swing = np.concatenate([part * np.sin(2 * np.pi * t) for part in (1.0, 1.0, 0.6, 0.3)])
    v = (low + high) / 2 + (high - low) / 2 * swing
    y = c.simulate(v)
    axes[0].plot(v[1500:], y[1500:], color=drawing.MODEL, linewidth=1.2)
    title = "Loop without effects" if model.effects else "Loop"
    axes[0].set(title=title, xlabel=label("drive", units.input), ylabel=label("output", units.output))

    x = np.linspace(0, max(abs(end) for end in c.play_range), 400)
    axes[1].plot(x, c.pi.loading_curve(x), color=drawing.MEASURED)
    r = np.asarray(c.pi.thresholds)
    r = r[r <= x[-1]]
    axes[1].plot(r, c.pi.loading_curve(r), "o", color=drawing.MEASURED, markersize=3, label="thresholds")
    axes[1].set(title="Initial loading curve", xlabel="input of the plays", ylabel=label("output", units.output))
    axes[1].legend()

    if invertible:
        bottom, top = float(np.min(y[1500:])), float(np.max(y[1500:]))
        u = (bottom + top) / 2 + (top - bottom) / 2 * swing
        drive = model.inverse().simulate(u, clamp=True)
        axes[2].plot(u[1500:], drive[1500:], color=drawing.OTHER, linewidth=1.2)
        axes[2].set(title="Inverse", xlabel=label("reference", units.output), ylabel=label("drive", units.input))
        error = float(np.max(np.abs(model.simulate(drive) - u)[1500:]))
        axes[2].annotate(
            f"model after inverse:\n|y - u| <= {error:.1e}", (0.04, 0.96), xycoords="axes fraction", va="top"
        )
    figure.suptitle(model.name)
    return figure


def show_tracking(tracking: Tracking, path: str | os.PathLike[str]) -> None:
    """The motion of each record and the tracking error of each compensator along time, as PNG or SVG.

    Raises PlotError.
    """
    with drawing.styled():
        figure = drawing.figure(9.0, 1.0 + 3.4 * len(tracking.records))
        panels = figure.subplots(2 * len(tracking.records), 1, squeeze=False)[:, 0]
        colours = (drawing.OTHER, drawing.GAP, drawing.MODEL)
        for motion, error, each in zip(panels[::2], panels[1::2], tracking.records, strict=True):
            motion.plot(each.t, each.reference, color=drawing.MEASURED, linewidth=1.0)
            motion.set(title=each.name, ylabel=label("reference", tracking.unit))
            for (which, values), colour in zip(each.errors.items(), colours, strict=True):
                words = f"{which}: {each.rms(which):.3g} % rms"
                error.plot(each.t, 100.0 * values / each.span, color=colour, linewidth=1.0, label=words)
            error.set(xlabel="time, s", ylabel="tracking error, % of span")
            drawing.legend_above(error, 3)
        _save(figure, path)


def show_fit(fit: Fit, records: list[Record], path: str | os.PathLike[str]) -> None:
    """Measured and predicted loop of one record, residuals along time, and the weights, as PNG or SVG.

    `records`: those of the fit, then those held out, of which the loop is one where there are any. Raises PlotError.
    """
    units = fit_figures.units_of(fit)
    shown = fit_figures.of_fit(fit, records)
    with drawing.styled():
        figure = drawing.figure(13.8, 4.2)
        loop, residual, weights = figure.subplots(1, 3)
        fit_figures.loop_panel(loop, fit_figures.drawn_ones(shown)[-1], units)
        for each, colour in zip(shown, itertools.cycle((drawing.RESIDUAL, drawing.OTHER, drawing.GAP)), strict=False):
            fit_figures.residual_panel(residual, each, units, colour)
        residual.set_title("Residual", pad=20)
        drawing.legend_above(residual, 2)
        fit_figures.weight_panel(weights, fit, units, range(len(fit.parameters.model.pi.thresholds)))
        weights.set_title("Weights", pad=20)
        weights.set(xlabel=label("threshold", units.drive))
        figure.suptitle(f"{fit.parameters.name}: identified")
        _save(figure, path)
