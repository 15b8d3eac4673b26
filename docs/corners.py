"""The figure of docs/corners.md: a drive with its corners, the loop they lie on, and the curve shared by all moves.

    python docs/corners.py
"""

from __future__ import annotations

import itertools
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("svg")
import matplotlib.pyplot as plt

from hystgen.model import Model
from hystgen.parameters.files import parse_parameters

MODEL = """
hystgen: 1
name: figure
input_range: [0, 10]
model:
  pi:
    thresholds: [0, 0.75, 1.5, 2.5, 3.5]
    weights: [0.5, 0.2, 0.2, 0.2, 0.2]
"""
TURNS = (0.0, 9.5, 2.5, 8.0, 4.5)  # V: start, then four turns of a shrinking swing, so that each leaves a corner
END = (TURNS[4] + TURNS[3]) / 2  # V: short of corner 3, which is not passed yet
NEXT = (TURNS[3] + TURNS[1]) / 2  # V: beyond corner 3 and short of corner 1
BLUE, ORANGE, GREY = "#1f77b4", "#d95f02", "#777777"


def main() -> None:
    """Draw the figure and write `corners.svg` beside this file."""
    mpl.rcParams.update({"svg.hashsalt": "hystgen", "svg.fonttype": "none", "font.size": 10})
    model = Model(parse_parameters(MODEL, "figure.yaml"))
    pi = model.parameters.model.pi
    ends = [*TURNS, END, NEXT]
    steps = [np.linspace(a, b, 400) for a, b in itertools.pairwise(ends)]
    drive = np.concatenate(steps)
    output = model.simulate(drive)
    now = 400 * (len(steps) - 1)  # samples up to END
    corners = [400 * (j + 1) - 1 for j in range(len(TURNS) - 1)]
    r, c = np.array(pi.thresholds), np.cumsum(pi.weights)
    z = np.array([np.sum(np.array(pi.weights)[: k + 1] * (r[k] - r[: k + 1])) for k in range(len(r))])

    figure, (time, loop, curve) = plt.subplots(1, 3, figsize=(12, 4.2), layout="constrained")
    time.plot(drive[:now], color=BLUE)
    time.plot(np.arange(now, len(drive)), drive[now:], color=ORANGE, linestyle="--")
    loop.plot(drive[:now], output[:now], color=BLUE)
    loop.plot(drive[now:], output[now:], color=ORANGE, linestyle="--")
    for j, at in enumerate(corners):
        for axes, x, y in ((time, at, drive[at]), (loop, drive[at], output[at])):
            axes.plot(x, y, "o", color="black")
            up = drive[at] > 5
            axes.annotate(f"{j + 1}", (x, y), (0, 6 if up else -14), textcoords="offset points", ha="center")
    time.axhline(drive[corners[2]], color=GREY, linewidth=0.8, linestyle=":")
    time.annotate("passes 4 and 3", (len(drive), NEXT), (-4, 8), textcoords="offset points", ha="right", color=ORANGE)
    time.set(xlabel="sample", ylabel="drive (V)", ylim=(-1, 11), title="Corners 1 to 4 hold plays")
    loop.set(xlabel="drive (V)", ylabel="output", title="The same moves in the loop")

    way = np.append(2 * r, 2 * r[-1] + 2)
    reach = np.append(2 * z, 2 * z[-1] + 2 * c[-1])
    curve.plot(way, reach, color=BLUE)
    curve.plot(way[:-1], reach[:-1], "o", color="black")
    for k in range(1, len(r)):
        curve.annotate(f"play {k}", (way[k], reach[k]), (-6, 4), textcoords="offset points", ha="right")
        curve.plot([way[k], way[k], 0], [0, reach[k], reach[k]], color=GREY, linewidth=0.6, linestyle=":")
    middle = (way[2] + way[3]) / 2, (reach[2] + reach[3]) / 2
    curve.annotate("segment 2: gain C₂", middle, (12, -16), textcoords="offset points", color=BLUE)
    curve.set(xlabel="way from a corner: 2 r_k", ylabel="reach: 2 z_k", title="One curve for every corner")
    curve.set(xlim=(0, None), ylim=(0, None))
    for axes in (time, loop, curve):
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(Path(__file__).with_suffix(".svg"), metadata={"Date": None})


if __name__ == "__main__":
    main()
