"""The picture of a model: loops, initial loading curve and, if it exists, the inverse with its accuracy."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import drawing
from hystgen.basics.drawing import label
from hystgen.cascade import Cascade
from hystgen.parameters.schema import Units

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


def figure(
    name: str, cascade: Cascade, units: Units, inverse: Callable[[Array], Array] | None, effects: bool
) -> Figure:
    """The figure; call within `drawing.styled`.

    `inverse`: maps references (N,) to drives (N,) inside the drive range; None if no inverse is to be shown; `effects`:
    whether the model has effects, which are not drawn.
    """
    low, high = cascade.input_range
    columns = 2 if inverse is None else 3
    drawn = drawing.figure(4.6 * columns, 4.0)
    axes = drawn.subplots(1, columns)
    t = np.linspace(0, 1, 1500)
    swing = np.concatenate([part * np.sin(2 * np.pi * t) for part in (1.0, 1.0, 0.6, 0.3)])
    v = (low + high) / 2 + (high - low) / 2 * swing
    y = cascade.simulate(v)
    axes[0].plot(v[1500:], y[1500:], color=drawing.MODEL, linewidth=1.2)
    title = "Loop without effects" if effects else "Loop"
    axes[0].set(title=title, xlabel=label("drive", units.input), ylabel=label("output", units.output))

    x = np.linspace(0, max(abs(end) for end in cascade.play_range), 400)
    axes[1].plot(x, cascade.pi.loading_curve(x), color=drawing.MEASURED)
    r = np.asarray(cascade.pi.thresholds)
    r = r[r <= x[-1]]
    axes[1].plot(r, cascade.pi.loading_curve(r), "o", color=drawing.MEASURED, markersize=3, label="thresholds")
    axes[1].set(title="Initial loading curve", xlabel="input of the plays", ylabel=label("output", units.output))
    axes[1].legend()

    if inverse is not None:
        bottom, top = float(np.min(y[1500:])), float(np.max(y[1500:]))
        u = (bottom + top) / 2 + (top - bottom) / 2 * swing
        drive = inverse(u)
        axes[2].plot(u[1500:], drive[1500:], color=drawing.OTHER, linewidth=1.2)
        axes[2].set(title="Inverse", xlabel=label("reference", units.output), ylabel=label("drive", units.input))
        error = float(np.max(np.abs(cascade.simulate(drive) - u)[1500:]))
        axes[2].annotate(
            f"model after inverse:\n|y - u| <= {error:.1e}", (0.04, 0.96), xycoords="axes fraction", va="top"
        )
    drawn.suptitle(name)
    return drawn
