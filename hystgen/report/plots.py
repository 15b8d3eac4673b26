"""Pictures: loop, loading curve, inverse, fits. matplotlib is imported when one is drawn."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hystgen.api import Model

if TYPE_CHECKING:
    from hystgen.identification import Fit
    from hystgen.records import Record

FORMATS = (".png", ".svg")
DRIVE, OUTPUT, OTHER = "#1f5a99", "#c2410c", "#3f7d3a"


class PlotError(ValueError):
    """A plot that cannot be drawn here."""


def _figure(columns: int) -> tuple[Any, Any]:
    try:
        import matplotlib
    except ImportError:
        raise PlotError("plots need matplotlib; install it with: pip install 'hystgen[plot]'") from None
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    matplotlib.rcParams.update({"svg.hashsalt": "hystgen", "axes.grid": True, "grid.alpha": 0.3})
    return plt.subplots(1, columns, figsize=(4.6 * columns, 4.0), layout="constrained")


def check_path(path: str | os.PathLike[str]) -> None:
    """Raise PlotError for a file that no plot can be written to."""
    target = Path(path)
    if target.suffix.lower() not in FORMATS:
        raise PlotError(f"{target}: a plot is a .png or .svg file")
    if not target.parent.is_dir():
        raise PlotError(f"{target}: the folder does not exist")


def _save(figure: Any, path: str | os.PathLike[str]) -> None:
    import matplotlib.pyplot as plt

    check_path(path)
    target = Path(path)
    kind = target.suffix.lower()
    staging = target.with_name(f".{target.name}.part{kind}")
    try:
        figure.savefig(staging, dpi=110, metadata={"Date": None} if kind == ".svg" else {"Software": None})
        os.replace(staging, target)
    finally:
        staging.unlink(missing_ok=True)
        plt.close(figure)


def _label(what: str, unit: str) -> str:
    return f"{what} ({unit})" if unit else what


def show_model(model: Model, path: str | os.PathLike[str]) -> None:
    """Loops, initial loading curve and, where it exists, the inverse with what it achieves, as PNG or SVG.

    Raises PlotError without matplotlib or for another file type.
    """
    c, units = model.cascade, model.parameters.units
    low, high = c.input_range
    invertible = not c.inverse_problems() and not model.effects
    figure, axes = _figure(3 if invertible else 2)
    t = np.linspace(0, 1, 1500)
    swing = np.concatenate([part * np.sin(2 * np.pi * t) for part in (1.0, 1.0, 0.6, 0.3)])
    v = (low + high) / 2 + (high - low) / 2 * swing
    y = c.simulate(v)
    axes[0].plot(v[1500:], y[1500:], color=OUTPUT, linewidth=1.2)
    title = "Loop without effects" if model.effects else "Loop"
    axes[0].set(title=title, xlabel=_label("drive", units.input), ylabel=_label("output", units.output))

    x = np.linspace(0, max(abs(end) for end in c.play_range), 400)
    axes[1].plot(x, c.pi.loading_curve(x), color=DRIVE)
    r = np.asarray(c.pi.thresholds)
    r = r[r <= x[-1]]
    axes[1].plot(r, c.pi.loading_curve(r), "o", color=DRIVE, markersize=3, label="thresholds")
    axes[1].set(title="Initial loading curve", xlabel="input of the plays", ylabel=_label("output", units.output))
    axes[1].legend()

    if invertible:
        bottom, top = float(np.min(y[1500:])), float(np.max(y[1500:]))
        u = (bottom + top) / 2 + (top - bottom) / 2 * swing
        drive = model.inverse().simulate(u, clamp=True)
        axes[2].plot(u[1500:], drive[1500:], color=OTHER, linewidth=1.2)
        axes[2].set(title="Inverse", xlabel=_label("reference", units.output), ylabel=_label("drive", units.input))
        error = float(np.max(np.abs(model.simulate(drive) - u)[1500:]))
        axes[2].annotate(
            f"model after inverse:\n|y - u| <= {error:.1e}", (0.04, 0.96), xycoords="axes fraction", va="top"
        )
    figure.suptitle(model.name)
    _save(figure, path)


def show_fit(fit: Fit, records: list[Record], path: str | os.PathLike[str]) -> None:
    """Measured and predicted loops of the first record, residuals along time, and the weights, as PNG or SVG.

    Samples that an unknown start memory reaches are left out. Raises PlotError.
    """
    units = fit.parameters.units
    figure, axes = _figure(3)
    for i, record in enumerate(records):
        assert record.y is not None
        known = slice(fit.settled(record), None)
        residual = record.y - fit.predict(record)
        residual -= np.mean(residual[known])
        if i == 0:
            axes[0].plot(record.v[known], record.y[known], color=DRIVE, linewidth=0.8, label="measured")
            model = (record.y - residual)[known]
            axes[0].plot(record.v[known], model, color=OUTPUT, linewidth=0.8, label="model")
            axes[0].set(title=record.name)
        time = record.t - record.t[0]
        axes[1].plot(time[known], residual[known], linewidth=0.8, label=record.name)
    axes[0].set(xlabel=_label("drive", units.input), ylabel=_label("output", units.output))
    axes[0].legend()
    axes[1].set(title="Residual", xlabel="time (s)", ylabel=_label("measured - model", units.output))
    axes[1].legend()
    part = fit.parameters.model.pi
    axes[2].plot(part.thresholds, part.weights, "o", color=OTHER, markersize=4)
    axes[2].vlines(part.thresholds, 0, part.weights, color=OTHER, linewidth=1)
    per = f"{units.output}/{units.input}" if units.input and units.output else ""
    axes[2].set(title="Weights", xlabel=_label("threshold", units.input), ylabel=_label("weight", per))
    figure.suptitle(f"{fit.parameters.name}: identified")
    _save(figure, path)
