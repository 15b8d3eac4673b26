"""Figures 5, 6 and 8 to 10, the play sum and its properties, and a figure of our own, plays for a density."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import printed as note

from hystgen import PI
from hystgen.basics import drawing
from hystgen.plays import density, operators


def make(folder: Path) -> None:
    """Write the figures to the folder. Raises MismatchError."""
    with drawing.styled():
        _any_input(folder)
        _width_and_slopes(folder)
        _example_1(folder)
        _starts(folder)
        _example_1_width_and_slopes(folder)
        _density(folder)


def _any_input(folder: Path) -> None:
    t = np.linspace(0.0, 6.0, 3001)
    v = 2.2 * np.sin(2.0 * np.pi * 0.5 * t) + 1.6 * np.sin(2.0 * np.pi * 0.9 * t + 0.4)
    y = note.EXAMPLE_1.simulate(v)
    s = operators.plays(v, note.EXAMPLE_1.thresholds)
    off_by = note.summed(note.EXAMPLE_1, v)
    note.close("the model is the sum of its plays (21)", y, np.array(note.EXAMPLE_1.weights) @ s, off_by)
    drawn, (time, loop) = note.panels(2)
    time.plot(t, v, color=note.FIRST, label=note.DRIVE)
    time.plot(t, y, color=note.SECOND, linestyle="--", label=note.ANSWER)
    loop.plot(v, y, color=note.SECOND)
    note.describe(time, "a", "Any input", "time (s)", "input, output", legend=True)
    note.describe(loop, "b", "Loops", note.DRIVE, note.ANSWER)
    note.save(folder, "figure_05", drawn)


def _full_loop(model: PI, v_max: float) -> tuple[note.Array, note.Array]:
    """Drive and output of one closed loop between `-v_max` and `v_max`, rising first."""
    one_way = np.linspace(-v_max, v_max, 2001)
    v = np.concatenate([one_way, one_way[::-1]])
    return v, model.simulate(np.concatenate([v, v]))[len(v) :]


def _draw_width(axes: Any, model: PI, v_max: float) -> None:
    """Draw the loop, and the distance between its rising and falling halves where the output is zero."""
    v, y = _full_loop(model, v_max)
    right, left = float(np.interp(0.0, y[:2001], v[:2001])), float(np.interp(0.0, y[:2000:-1], v[:2000:-1]))
    # both crossings shift by the output error divided by the slope there
    off_by = 2.0 * note.summed(model, v) / model.slopes[0] + note.rounded(8, v_max)
    note.close("width of the loop (32), corrected", right - left, model.width, off_by)
    axes.plot(v, y, color=note.FIRST)
    axes.annotate("", (left, 0.0), (right, 0.0), arrowprops={"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0})
    place = (0.35 * v_max, -0.35 * y.max())
    line = {"arrowstyle": "-", "color": note.DIM}
    axes.annotate(rf"$\sigma$ = {model.width:.4g}", (0.0, 0.0), place, fontsize=10, arrowprops=line)
    note.describe(axes, "a", "Full loop", note.DRIVE, note.ANSWER)


def _draw_slopes(axes: Any, model: PI, v_max: float) -> None:
    ends = np.array([*model.thresholds, v_max])
    axes.plot(ends, model.loading_curve(ends), color=note.FIRST, marker="o", markersize=3, markevery=range(model.n + 1))
    for i, slope in enumerate(model.slopes):
        middle = 0.5 * (ends[i] + ends[i + 1])
        axes.annotate(f"$S_{i + 1}$ = {slope:.4g}", (middle, model.loading_curve(middle)), xytext=(7, -10),
                      textcoords="offset points", fontsize=9)  # fmt: skip
    note.describe(axes, "b", "Initial loading curve, slopes $S_i = p_0 + .. + p_{i-1}$", f"$r$ ({note.INPUT})",
                  rf"$\varphi(r)$ ({note.OUTPUT})")  # fmt: skip
    axes.set_xlim(0.0, 1.15 * v_max)


def _width_and_slopes(folder: Path) -> None:
    model, v_max, bottom = PI([0, 0.75, 1.5, 2.25], [0.4, 0.3, 0.3, 0.3]), 4.0, -6.3
    ends = np.array([*model.thresholds, v_max])
    v, y = _full_loop(model, v_max)
    for i in range(4):
        turns = 2.0 * ends[i : i + 2] - v_max
        inside = (v[:2001] > turns[0] + 0.01) & (v[:2001] < turns[1] - 0.01)
        slopes = np.diff(y[:2001][inside]) / np.diff(v[:2001][inside])
        # a step involves two outputs and two inputs
        step = 2.0 * v_max / 2000
        off_by = 2.0 * (note.summed(model, v) + model.slopes[i] * note.rounded(2, v_max)) / step
        note.close(f"slope S_{i + 1} of a segment (33)", slopes, model.slopes[i], off_by)
    drawn, (loop, curve) = note.panels(2)
    _draw_width(loop, model, v_max)
    for i in range(4):
        a, b = 2.0 * ends[i : i + 2] - v_max
        loop.annotate("", (a, bottom), (b, bottom), arrowprops={"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0})
        loop.text(0.5 * (a + b), bottom, rf"2$\Delta r_{i}$", ha="center", va="bottom", fontsize=9)
        loop.plot([b, b], [bottom, np.interp(b, v[:2001], y[:2001])], color=note.DIM, linewidth=0.7, linestyle=":")
    _draw_slopes(curve, model, v_max)
    note.save(folder, "figure_06", drawn)


def draw_plays(axes: Any, letter: str, v: note.Array, model: PI, title: str, unit: str) -> None:
    """The plays of a model over their input `v`, each with its threshold next to its flat top."""
    plays = operators.plays(v, model.thresholds)[1:]
    place, step = -np.inf, 0.06 * np.ptp(plays)
    for i in range(model.n - 1, -1, -1):
        axes.plot(v, plays[i], color=note.FIRST, alpha=0.25 + 0.75 * i / (model.n - 1), linewidth=1.2)
        place = max(place + step, v.max() - model.thresholds[i + 1])
        axes.text(1.03 * v.max(), place, f"{model.thresholds[i + 1]:.4g}", va="center", fontsize=8)
    axes.text(1.03 * v.max(), place + step, "threshold", va="center", fontsize=8)
    axes.set_xlim(right=1.35 * v.max())
    note.describe(axes, letter, title, f"their input ({unit})", f"plays ({unit})")


def _example_1(folder: Path) -> None:
    v = note.sine(4.0)
    y = note.EXAMPLE_1.simulate(v)
    drawn, (time, plays, loop, curve) = note.panels(4)
    time.plot(note.TIME, v, color=note.FIRST, label=note.DRIVE)
    time.plot(note.TIME, y, color=note.SECOND, linestyle="--", label=note.ANSWER)
    note.describe(time, "a", r"Example 1, $v = 4 \sin 2 \pi t$", "time (s)", "input, output", legend=True)
    draw_plays(plays, "b", v, note.EXAMPLE_1, "Plays of the model", note.INPUT)
    loop.plot(v, y, color=note.SECOND)
    note.describe(loop, "c", "Loop and first rise", note.DRIVE, note.ANSWER)
    x = np.linspace(0.0, 4.0, 401)
    phi = note.EXAMPLE_1.loading_curve(x)
    virgin = note.EXAMPLE_1.simulate(x)
    off_by = note.summed(note.EXAMPLE_1, x)
    note.close("a virgin model follows the loading curve (22)", virgin, phi, off_by)
    curve.plot(x, phi, color=note.FIRST)
    r = np.array(note.EXAMPLE_1.thresholds)
    curve.plot(r, note.EXAMPLE_1.loading_curve(r), "o", color=note.FIRST, markersize=4)
    title = "Initial loading curve, thresholds"
    note.describe(curve, "d", title, f"$r$ ({note.INPUT})", rf"$\varphi(r)$ ({note.OUTPUT})")
    note.save(folder, "figure_08", drawn)


def _starts(folder: Path) -> None:
    v, styles = note.sine(4.0), ("-", "--", "-.")
    drawn, (play, loop) = note.panels(2)
    outputs = []
    for start, style, colour in zip((0.0, 1.0, -1.0), styles, (note.FIRST, note.SECOND, note.THIRD), strict=True):
        model = PI(note.EXAMPLE_1.thresholds, note.EXAMPLE_1.weights, start)
        outputs.append(model.simulate(v))
        fifth = operators.play(v, model.thresholds[5], start)
        play.plot(note.TIME[:1001], fifth[:1001], style, color=colour, label=f"$M_0$ = {start:g}")
        loop.plot(v[:1001], outputs[-1][:1001], style, color=colour, label=f"$M_0$ = {start:g}")
    # the input has moved by 2 r_6 = 5.4 once it has come down from 4 to -1.4
    swept = int(np.argmax(np.maximum.accumulate(v) - v >= 2.0 * note.EXAMPLE_1.thresholds[-1]))
    for other in outputs[1:]:
        note.close("the start is forgotten after a sweep of 2 r_6", other[swept:], outputs[0][swept:], 0.0)
        if not abs(other[0] - outputs[0][0]) > 0.1:
            raise note.MismatchError("different starts give the same output")
    note.describe(play, "a", "Play of $r_5 = 2.25$, first period", "time (s)", f"play ({note.INPUT})", legend=True)
    note.describe(loop, "b", "Model, first period", note.DRIVE, note.ANSWER, legend=True)
    note.save(folder, "figure_09", drawn)


def _example_1_width_and_slopes(folder: Path) -> None:
    # Slopes from the printed weights, instead of the note's 0.71 1.33 1.8 2.16 2.4 2.51 2.53
    note.check("Example 1, slopes S_i (33)", note.EXAMPLE_1.slopes, "0.72 1.32 1.80 2.16 2.40 2.52 2.532")
    note.check("Example 1, width (32), corrected", note.EXAMPLE_1.width, "1.5")
    note.check("Example 1, width (32), corrected", note.EXAMPLE_1.width, "1.518")
    drawn, (loop, curve) = note.panels(2)
    # 4 sin does not quite reach the largest width: the outermost play still rests where the output is zero
    _draw_width(loop, note.EXAMPLE_1, 5.0)
    v = note.sine(4.0)[1000:]
    loop.plot(v, note.EXAMPLE_1.simulate(note.sine(4.0))[1000:], color=note.SECOND, linestyle="--", linewidth=1.0)
    loop.text(-3.9, -3.0, r"$4 \sin 2 \pi t$", color=note.SECOND, ha="right", fontsize=9)
    _draw_slopes(curve, note.EXAMPLE_1, 4.0)
    note.save(folder, "figure_10", drawn)


def _density(folder: Path) -> None:
    """`p(r) = 0.8 exp(-0.3 r)` up to 10 as 6 plays, and their largest error."""
    continuous = density.from_formula(density.parse_formula("0.8*exp(-0.3*r)"), 10.0)
    plays = continuous.discretise(0.7, 6)
    model = PI(plays.thresholds, plays.weights)
    x = np.linspace(0.0, 10.0, 1001)
    exact = 0.7 * x + 0.8 * (x / 0.3 - (1.0 - np.exp(-0.3 * x)) / 0.09)
    gap = exact - model.loading_curve(x)
    # 6 products and sums against three quotients, an exponential and three sums of the larger terms
    off_by = note.rounded(2 * 6 + 2, exact) + note.rounded(12, 0.8 * np.max(x) / 0.3)
    if not (np.min(gap) >= -off_by and np.max(gap) <= plays.error):
        raise note.MismatchError("density: the loading curve exceeds its error bound")
    drawn, (curve, error) = note.panels(2)
    curve.plot(x, exact, label="density (19)", **drawing.LINES["measured"])
    curve.plot(x, model.loading_curve(x), label="6 plays (22)", **drawing.LINES["model"])
    curve.plot(plays.thresholds, model.loading_curve(plays.thresholds), "o", color=note.SECOND, markersize=3)
    error.plot(x, gap, color=note.FIRST)
    error.axhline(plays.error, color=note.SECOND, linestyle="--", linewidth=1.0)
    error.text(10.0, plays.error, "bound", color=note.SECOND, ha="right", va="bottom", fontsize=9)
    title = "Initial loading curve"
    note.describe(curve, "a", title, f"$r$ ({note.INPUT})", rf"$\varphi(r)$ ({note.OUTPUT})", legend=True)
    note.describe(error, "b", "Error of the plays", f"$r$ ({note.INPUT})", f"difference ({note.OUTPUT})")
    note.save(folder, "density", drawn)
