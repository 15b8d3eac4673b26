"""Figures 18 and 21 to 25: models with a dead-zone sum or a tanh envelope in front of the plays, and their inverses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import inverse
import models
import numpy as np
import printed as note

from hystgen import DeadZone
from hystgen.basics import drawing
from hystgen.front.tanh import kernels
from hystgen.plays import operators


def make(folder: Path) -> None:
    """Write the figures to the folder. Raises MismatchError."""
    _numbers()
    with drawing.styled():
        _dead_zones(folder)
        _example_4(folder)
        _example_4_inverse(folder)
        _example_5(folder)
        _example_6(folder)
        _example_6_inverse(folder)


def _numbers() -> None:
    """Numbers that the note prints for Examples 4 and 6."""
    found = note.PI_4.inverse()
    # The last digit of the note's z_5 = 4.386 is one too high
    note.check("Example 4, z_i (36)", found.thresholds, "0 0.293 0.877 1.755 2.924 4.385 6.139")
    note.check("Example 4, z_5 to three digits", found.thresholds[5], "4.39")
    note.check("Example 4, q_i (37)", found.weights, "1.5385 -0.7691 -0.2564 -0.1282 -0.0769 -0.0513 -0.0366")
    zone = note.DEAD_ZONE_4.inverse_map()
    numbers = [4.765, *note.ETA_4]

    def positive(eta: note.Array) -> note.Array:
        made = DeadZone([0.0, *note.RHO_4], eta.tolist()).inverse_map()
        return np.array([*made.thresholds, *made.weights])

    off = note.spread(positive, numbers, 0.5e-3)
    printed = "0 1.906 3.179 3.809 4.241 4.524 4.704 4.816 4.885 4.928 4.954 4.97"
    note.check("Example 4, tau_j (53)", zone.thresholds[11:], printed, off[:12])
    note.check("Example 4, tau_-j (55)", [-tau for tau in zone.thresholds[11::-1]], printed, off[:12])
    # mu from the printed eta; the note's mu, up to 10.226, differ by no more than the rounding of eta allows
    right = "0.210 0.065 0.122 0.182 0.306 0.510 0.847 1.407 2.303 3.852 6.590 11.384"
    note.check("Example 4, mu_j (54)", zone.weights[11:], right)
    note.check("Example 4, mu_-j (56)", zone.weights[11::-1], right)
    printed = "0.210 0.065 0.122 0.182 0.305 0.508 0.84 1.384 2.248 3.704 6.179 10.226"
    note.check("Example 4, printed mu_j", zone.weights[11:], printed, off[12:])
    x = np.linspace(-5.5, 5.5, 111)
    back = note.ENVELOPE_6.inverse(x)
    # on either side two quotients, an inverse tanh, and a quotient or product
    off_by = note.rounded(2 * kernels.ATANH_MAX_ULP["float64"] + 4, back)
    note.close("Example 6, inverse envelope 2.5 atanh(x/6) (58)", back, 2.5 * np.arctanh(x / 6.0), off_by)


def _dead_zones(folder: Path) -> None:
    v, rho = np.linspace(-3.0, 3.0, 601), (-2.0, -1.0, 0.0, 1.0, 2.0)
    eta = (0.6, -0.5, 1.0, -0.4, -0.3)
    drawn, (single, total) = note.panels(2)
    for threshold, colour in ((-1.0, note.FIRST), (0.0, note.DIM), (1.0, note.SECOND)):
        y = operators.dead_zone(v, threshold)
        single.plot(v, y, color=colour, label=rf"$\rho$ = {threshold:g}")
    zone = DeadZone(rho, eta)
    w = zone.forward(v)
    summed = sum(weight * operators.dead_zone(v, threshold) for threshold, weight in zip(rho, eta, strict=True))
    # either way a difference, a product and a sum for each of five dead zones
    note.close("the dead-zone sum (41)", w, summed, note.rounded(2 * 15, 3.0 * np.sum(np.abs(eta))))
    total.plot(v, w, color=note.FIRST)
    for j, (low, high) in enumerate(((-3.0, -2.0), (-2.0, -1.0), (-1.0, 1.0), (1.0, 2.0), (2.0, 3.0))):
        slope = zone.piece_slopes[j]
        middle = 0.5 * (low + high)
        total.annotate(f"slope {slope:.2g}", (middle, float(zone.forward(middle))), xytext=(6, -12),
                       textcoords="offset points", fontsize=9)  # fmt: skip
    total.plot(rho, zone.forward(rho), "o", color=note.FIRST, markersize=4)
    total.margins(x=0.14)
    note.describe(single, "a", "Dead zone", note.DRIVE, f"output ({note.INPUT})", legend=True)
    title = r"Dead-zone sum, slopes $\eta_0 + .. + \eta_j$"
    note.describe(total, "b", title, note.DRIVE, f"output $w$ ({note.INPUT})")
    note.save(folder, "figure_18", drawn)


def _over_time(axes: Any, letter: str, title: str, lines: list[tuple[note.Array, str]]) -> None:
    for (signal, name), colour, style in zip(
        lines, (note.FIRST, note.THIRD, note.SECOND), ("-", "-.", "--"), strict=True
    ):
        axes.plot(note.TIME, signal, style, color=colour, label=name)
    note.describe(axes, letter, title, "time (s)", "signals, each in its units", legend=True)


def _example_4(folder: Path) -> None:
    v, model = note.sine(5.0), note.EXAMPLE_4
    w, y = model.front(v), model.simulate(v)
    drawn, (time, zones, plays, loop) = note.panels(4)
    names = [(v, "input $v$"), (w, "dead-zone sum $w$"), (y, "output $y$")]
    _over_time(time, "a", r"Example 4, $v = 5 \sin 2 \pi t$", names)
    for threshold in note.DEAD_ZONE_4.thresholds:
        colour = note.DIM if threshold == 0.0 else note.SECOND if threshold > 0.0 else note.FIRST
        zones.plot(v[:1001], operators.dead_zone(v[:1001], threshold), color=colour, linewidth=0.9)
    zones.text(-3.5, 0.4, r"$\rho_j < 0$", color=note.FIRST, ha="center")
    zones.text(3.2, 3.9, r"$\rho_0 = 0$", color=note.DIM, ha="right")
    zones.text(3.5, -0.8, r"$\rho_j > 0$", color=note.SECOND, ha="center")
    note.describe(zones, "b", "Dead zones", note.DRIVE, f"dead zones ({note.INPUT})")
    models.draw_plays(plays, "c", w, note.PI_4, "Plays of the dead-zone sum", note.INPUT)
    loop.plot(v, y, color=note.SECOND)
    note.describe(loop, "d", "Loop and first rise", note.DRIVE, note.ANSWER)
    note.save(folder, "figure_21", drawn)


def _compensation(folder: Path, name: str, model: Any, u: note.Array, title: str, of_plays: str) -> None:
    x = note.PI_4.inverse().simulate(u)
    v = model.inverse().simulate(u)
    y = model.simulate(v)
    note.close(f"{title}, compensation (49)", y, u, note.cancelled(model, u, v))
    off_by = 2.0 * note.inverted(model.pi, u) + note.rounded(8, x) + note.rounded(8, model.front_slopes[1] * v)
    note.close(f"{title}, the inverses one after the other (48)", model.front(v), x, off_by)
    drawn, (time, loop, *tracking) = note.panels(4)
    lines = [(u, "reference $u$"), (x, of_plays), (v, "input $v$")]
    _over_time(time, "a", title, lines)
    loop.plot(u, v, color=note.SECOND)
    note.describe(loop, "b", "Inverse", note.REFERENCE, note.DRIVE)
    inverse.draw_tracking(tracking, "cd", u, y, note.TIME)
    note.save(folder, name, drawn)


def _example_4_inverse(folder: Path) -> None:
    title = r"Example 4, $u = 15 \sin 2 \pi t$"
    _compensation(folder, "figure_22", note.EXAMPLE_4, note.sine(15.0), title, "inverse of the plays $x$")


def _example_5(folder: Path) -> None:
    u, model = note.sine(8.25) + note.sine(6.75, 5.0), note.EXAMPLE_4
    v = model.inverse().simulate(u)
    y = model.simulate(v)
    note.close("Example 5, compensation (49)", y, u, note.cancelled(model, u, v))
    inverse.save_compensation(folder, "figure_23", "Example 5", u, v, y)


def _example_6(folder: Path) -> None:
    v, model = note.sine(5.0), note.EXAMPLE_6
    h, y = model.front(v), model.simulate(v)
    # a unit in the last place is two roundings; numpy's tanh is within one, and there is a product on either side
    off_by = note.rounded(2 * kernels.TANH_MAX_ULP["float64"] + 4, 6.0)
    note.close("Example 6, envelope (46)", h, 6.0 * np.tanh(0.4 * v), off_by)
    drawn, (time, loop) = note.panels(2)
    names = [(v, "input $v$"), (h, "envelope $h$"), (y, "output $y$")]
    _over_time(time, "a", r"Example 6, $v = 5 \sin 2 \pi t$", names)
    loop.plot(v, y, color=note.SECOND)
    note.describe(loop, "b", "Loop and first rise", note.DRIVE, note.ANSWER)
    note.save(folder, "figure_24", drawn)


def _example_6_inverse(folder: Path) -> None:
    title = r"Example 6, $u = 10 \sin 2 \pi t$"
    _compensation(folder, "figure_25", note.EXAMPLE_6, note.sine(10.0), title, "inverse of the plays $x$")
