"""Figures 11 to 14: the inverse of the play sum, its effect, and the effect of an inverse with wrong parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import models
import numpy as np
import printed as note

from hystgen import PI
from hystgen.basics import drawing


def make(folder: Path) -> None:
    """Write the figures to the folder. Raises MismatchError."""
    with drawing.styled():
        _inverse(folder)
        _exact(folder)
        _approximate(folder)
        _two_frequencies(folder)


def _inverse(folder: Path) -> None:
    u, inverse = note.sine(10.0), note.EXAMPLE_1.inverse()
    note.check("Example 2, z_i (36)", inverse.thresholds, "0 0.324 0.918 1.728 2.7 3.78 4.914")
    note.check("Example 2, q_i (37)", inverse.weights, "1.3889 -0.6313 -0.2020 -0.0926 -0.0463 -0.0198 -0.0019")
    v = inverse.simulate(u)
    drawn, (time, plays, loop, curve) = note.panels(4)
    time.plot(note.TIME, u, color=note.FIRST, label=note.REFERENCE)
    time.plot(note.TIME, v, color=note.SECOND, linestyle="--", label=note.DRIVE)
    note.describe(time, "a", r"Example 2, $u = 10 \sin 2 \pi t$", "time (s)", "reference, drive", legend=True)
    models.draw_plays(plays, "b", u, inverse, "Plays of the inverse", note.OUTPUT)
    loop.plot(u, v, color=note.SECOND)
    note.describe(loop, "c", "Loop and first rise", note.REFERENCE, note.DRIVE)
    x = np.linspace(0.0, 10.0, 401)
    phi = inverse.loading_curve(x)
    # sums of 7 terms, each with a difference and a product; the weights and thresholds are such sums themselves
    largest = note.EXAMPLE_1.slopes[-1] * 10.0 * np.sum(np.abs(inverse.weights))
    off_by = note.rounded(3 * 7 * 7, largest)
    note.close("the inverse's loading curve is the model's, reflected", note.EXAMPLE_1.loading_curve(phi), x, off_by)
    curve.plot(x, phi, color=note.FIRST)
    curve.plot(inverse.thresholds, inverse.loading_curve(inverse.thresholds), "o", color=note.FIRST, markersize=4)
    curve_axis = rf"$\varphi(r)$ ({note.INPUT})"
    note.describe(curve, "d", "Initial loading curve of the inverse, thresholds", f"$r$ ({note.OUTPUT})", curve_axis)
    note.save(folder, "figure_11", drawn)


def draw_tracking(areas: list[Any], letters: str, u: note.Array, y: note.Array, x: note.Array) -> None:
    """Reference and compensated output over time and over each other; `x`: the times."""
    time, line = areas
    time.plot(x, u, label="reference $u$", **drawing.LINES["measured"])
    time.plot(x, y, label="output $y$", color=note.SECOND, linewidth=0.9, linestyle="--")
    line.plot(u, y, color=note.SECOND)
    worst = f"largest error {np.max(np.abs(y - u)):.2g}"
    line.text(0.04, 0.94, worst, transform=line.transAxes, va="top", fontsize=9)
    note.describe(time, letters[0], "Tracking", "time (s)", f"output ({note.OUTPUT})", legend=True)
    note.describe(line, letters[1], "Output over reference", note.REFERENCE, note.ANSWER)


def save_compensation(folder: Path, name: str, example: str, u: note.Array, v: note.Array, y: note.Array) -> None:
    """Inverse, model and composition in a row, each over its input: reference u, drive v, output y."""
    drawn, (inverse, model, both) = note.panels(3, 3)
    inverse.plot(u, v, color=note.SECOND)
    model.plot(v, y, color=note.FIRST)
    both.plot(u, y, color=note.THIRD)
    note.describe(inverse, "a", f"{example}, inverse", note.REFERENCE, note.DRIVE)
    note.describe(model, "b", "Model", note.DRIVE, note.ANSWER)
    note.describe(both, "c", "Compensated", note.REFERENCE, note.ANSWER)
    note.save(folder, name, drawn)


def _exact(folder: Path) -> None:
    u = note.sine(10.0)
    v = note.EXAMPLE_1.inverse().simulate(u)
    y = note.EXAMPLE_1.simulate(v)
    note.close("Example 2, compensation by the exact inverse (34)", y, u, note.cancelled(note.EXAMPLE_1, u, v))
    drawn, areas = note.panels(2)
    draw_tracking(areas, "ab", u, y, note.TIME)
    note.save(folder, "figure_12", drawn)


def _approximate(folder: Path) -> None:
    estimate = note.ESTIMATE_2
    inverse = estimate.inverse()
    numbers = [*estimate.thresholds[1:], *estimate.weights]

    def parameters(x: note.Array) -> note.Array:
        found = PI([0.0, *x[:6]], x[6:].tolist()).inverse()
        return np.array([*found.thresholds, *found.weights])

    off = note.spread(parameters, numbers, 0.5e-4)
    printed = "0 0.3525 0.9703 1.8056 2.8045 3.9144 5.0877"
    note.check("Example 2, z_i of the estimate", inverse.thresholds, printed, off[:7])
    printed = "1.327 -0.5985 -0.1897 -0.0883 -0.0450 -0.0219 -0.0027"
    note.check("Example 2, q_i of the estimate", inverse.weights, printed, off[7:])
    u = note.sine(10.0)
    y = note.EXAMPLE_1.simulate(inverse.simulate(u))
    drawn, areas = note.panels(2)
    draw_tracking(areas, "ab", u, y, note.TIME)
    areas[0].set_title("(a) Tracking with the inverse of the estimate")
    note.save(folder, "figure_13", drawn)


def _two_frequencies(folder: Path) -> None:
    u = note.sine(5.85) + note.sine(2.35, 5.0)
    v = note.EXAMPLE_1.inverse().simulate(u)
    y = note.EXAMPLE_1.simulate(v)
    note.close("Example 3, compensation by the exact inverse", y, u, note.cancelled(note.EXAMPLE_1, u, v))
    save_compensation(folder, "figure_14", "Example 3", u, v, y)
