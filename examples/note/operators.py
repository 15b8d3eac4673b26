"""Figures 1 to 3: play and stop, two masses with play between them, and the elastoplastic elements."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import printed as note

from hystgen.basics import drawing
from hystgen.plays import elastoplastic, operators


def make(folder: Path) -> None:
    """Write the figures to the folder. Raises MismatchError."""
    with drawing.styled():
        _characteristics(folder)
        _masses(folder)
        _elements(folder)


def _characteristics(folder: Path) -> None:
    t, r, start = np.linspace(0.0, 3.0, 1201), 1.0, 0.625
    v = note.coarse(3.0 * np.sin(2.0 * np.pi * t) * np.exp(-0.35 * t))
    play, stop = operators.play(v, r, start), operators.stop(v, r, start)
    note.close("play and stop add up to the input (26)", play + stop, v, 0.0)
    note.close("the stop stays within its threshold (6)", np.maximum(np.abs(stop), r), r, 0.0)
    note.close("the play stays within its threshold of the input (27)", np.maximum(np.abs(v - play), r), r, 0.0)
    drawn, (left, right) = note.panels(2)
    for axes, y, colour in ((left, play, note.FIRST), (right, stop, note.SECOND)):
        axes.plot(v, y, color=colour)
        axes.plot(v[0], y[0], "o", color=colour, markersize=5)
    line = {"arrowstyle": "-", "color": note.DIM}
    left.annotate(f"start, $M_0 = {start:g}$", (v[0], play[0]), (-2.4, 1.6), arrowprops=line, fontsize=9)
    right.annotate("start, $v_0 - M_0$", (v[0], stop[0]), (1.6, -0.4), arrowprops=line, fontsize=9)
    for offset in (-r, r):
        left.axline((0.0, offset), slope=1.0, color=note.DIM, linestyle="--", linewidth=0.9)
        right.axhline(offset, color=note.DIM, linestyle="--", linewidth=0.9)
    left.text(-2.1, -0.85, "$v + r$", color=note.DIM, fontsize=9, ha="right")
    left.text(1.75, 0.5, "$v - r$", color=note.DIM, fontsize=9)
    left.set_ylim(-2.6, 2.6)
    right.set_ylim(-1.25, 1.25)
    right.text(-2.4, 1.05, "$r$", color=note.DIM, fontsize=9)
    right.text(2.4, -1.16, "$-r$", color=note.DIM, fontsize=9)
    for axes, letter, name in ((left, "a", "play"), (right, "b", "stop")):
        note.describe(axes, letter, f"{name.capitalize()}, $r = 1$", note.DRIVE, f"{name} ({note.INPUT})")
    note.save(folder, "figure_01", drawn)


def _masses(folder: Path) -> None:
    gap = 0.5
    t = np.linspace(0.0, 6.0, 1201)
    first = np.interp(t, [0.0, 2.0, 4.0, 6.0], [0.0, 2.0, -2.0, 2.0])
    second = operators.play(first, gap)
    note.close("mass B stays behind by the gap", second[400], 2.0 - gap, 0.0)
    note.close("and turns once mass A has crossed it", second[500], 2.0 - gap, 0.0)
    drawn, (time, loop) = note.panels(2)
    for x, name, colour in ((first, "mass A, $x_1$", note.FIRST), (second, "mass B, $x_2$", note.SECOND)):
        time.plot(t, x, color=colour, label=name)
    loop.plot(first, second, color=note.SECOND)
    ends = {"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0}
    loop.annotate("", (0.8 + gap, 0.8), (0.8 - gap, 0.8), arrowprops=ends)
    loop.text(0.8, 0.83, "2a", ha="center", va="bottom", fontsize=9)
    note.describe(time, "b", "Two masses with play a = 0.5", "time (s)", f"position ({note.INPUT})", legend=True)
    note.describe(loop, "c", "Loop between the positions", f"$x_1$ ({note.INPUT})", f"$x_2$ ({note.INPUT})")
    note.save(folder, "figure_02", drawn)


def _elements(folder: Path) -> None:
    modulus, yield_stress = 2.0, 1.5
    load = note.coarse(4.0 * np.sin(2.0 * np.pi * note.TIME) * np.exp(-0.4 * note.TIME))
    strain = elastoplastic.parallel(load, modulus, yield_stress).strain
    stress = elastoplastic.series(load / modulus, modulus, yield_stress).stress
    play, stop = operators.play(load, yield_stress) / modulus, operators.stop(load, yield_stress)
    note.close("strain of the parallel element (12)", strain, play, 0.0)
    note.close("stress of the series element (17)", stress, stop, 0.0)
    drawn, (left, right) = note.panels(2)
    for axes, x, solved, operator, names in (
        (left, load, strain, play, ("return mapping", "play / E")),
        (right, load / modulus, stress, stop, ("return mapping", "stop of E times the strain")),
    ):
        axes.plot(x, solved, label=names[0], **drawing.LINES["measured"])
        axes.plot(x, operator, label=names[1], color=note.SECOND, linewidth=0.9, linestyle="--")
    title = "$E = 2$, yield stress $r = 1.5$"
    note.describe(left, "a", f"Parallel, {title}", "stress (stress units)", "strain", legend=True)
    note.describe(right, "b", f"Series, {title}", "strain", "stress (stress units)", legend=True)
    note.save(folder, "figure_03", drawn)
