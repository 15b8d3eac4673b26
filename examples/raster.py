"""A raster scan, as of an atomic force microscope, driven by compiled C in front of a simulated stage.

The fast axis X runs to and fro in a triangle, the slow axis Y moves by a line at each turn (`--slow staircase`) or
steadily (`--slow ramp`). Before the image both axes sweep once across their range and back, which erases the hysteresis
of whatever moved before. Each axis is a stage of from_gap_to_firmware with hidden creep and a bent transducer, which
shares no code with hystgen. Three drives are compared: a linear scale, the C of the identified plays, and the C of the
whole model that the diagnosis found.

Writes the picture `raster.png` and the trajectories `fast.csv` and `slow.csv`, for `hystgen simulate --operator
inverse`, and prints the errors. The models are those of from_gap_to_firmware, which is run first, in about 20 s, if
FOLDER does not have them.

Usage: python examples/raster.py [-o FOLDER] [--slow staircase|ramp]
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import hystgen
from hystgen.basics import drawing
from hystgen.closed_loop import CompiledC

STORY = Path(__file__).resolve().parent / "from_gap_to_firmware"
sys.path.insert(0, str(STORY))

from stage import FULL, SAMPLE_TIME, Stage  # noqa: E402  beside that example

Array = NDArray[np.float64]
Drive = Callable[[float], float]

CORNER, SIZE = 8.0, 10.0
"""[um] Start of the image on both axes, and its width and height: inside the range of the sweep, with room for what
errors add."""

LINES, SAMPLES = 24, 100
"""Lines of the image, and samples of a line, to and fro: 1 s, at which creep acts within a line; few enough for the
example to take seconds."""

REACH, SWEEP = (6.0, 20.0), 200
"""[um] Range of the sweep before the image, which wipes out the memory of all that the image can reach, and samples of
each of its three parts: 2 s, no faster than the image."""

START = 3 * SWEEP
"""Samples before the image."""

PITCH = 2.0
"""[um] Pitch of the chequered sample that the picture shows."""


def raster(slow: str) -> tuple[Array, Array]:
    """Positions of the fast and of the slow axis (N,), um, the sweep first."""
    n = np.arange(LINES * SAMPLES)
    fast = 1.0 - np.abs(1.0 - 2.0 * ((n + 0.5) / SAMPLES % 1.0))  # to and fro stop at the same places
    line = n // SAMPLES if slow == "staircase" else n / SAMPLES
    sweep = np.concatenate([np.linspace(a, b, SWEEP) for a, b in (REACH, REACH[::-1], (REACH[0], CORNER))])
    return np.concatenate([sweep, CORNER + SIZE * fast]), np.concatenate([sweep, CORNER + SIZE * line / LINES])


def moved(to_drive: Drive, wanted: Array) -> Array:
    """The true motion (N,) with a compensator in front of the stage, um, about the mean of what was wanted."""
    stage = Stage()
    drives = [min(max(to_drive(float(u)), 0.0), FULL) for u in wanted]
    stage.rest(drives[0])
    y = np.array([stage.move(v) for v in drives])
    return y - np.mean((y - wanted)[START:])  # the zero of a displacement is arbitrary


def rms(error: Array) -> float:
    """Rms error in the image, % of its width."""
    return 100.0 * float(np.sqrt(np.mean(error[START:] ** 2))) / SIZE


def rows(values: Array) -> Array:
    """Samples of the image as rows (2 LINES, SAMPLES / 2) from left to right: trace, retrace, trace, .."""
    found = values[START:].reshape(2 * LINES, SAMPLES // 2).copy()
    found[1::2] = found[1::2, ::-1]
    return found


def between(x: Array) -> float:
    """Rms distance between trace and retrace at the same place on the fast axis, % of the image's width."""
    traces = rows(x)
    return 100.0 * float(np.sqrt(np.mean((traces[::2] - traces[1::2]) ** 2))) / SIZE


def seen(x: Array, y: Array) -> Array:
    """The image that the tip takes of a chequered sample, as `rows`."""
    return rows((np.floor(x / PITCH) + np.floor(y / PITCH)) % 2.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=STORY / "out")
    parser.add_argument("--slow", choices=["staircase", "ramp"], default="staircase")
    given = parser.parse_args()
    folder: Path = given.output
    if not all((folder / name).is_file() for name in ("recording.csv", "plain.yaml", "extended.yaml")):
        print("making the models with examples/from_gap_to_firmware, in about 20 s", flush=True)
        subprocess.run([sys.executable, STORY, "-o", folder], check=True)

    fast, slow = raster(given.slow)
    t = SAMPLE_TIME * np.arange(len(fast))
    for name, u in (("fast", fast), ("slow", slow)):
        table = np.column_stack([t, u])
        np.savetxt(folder / f"{name}.csv", table, "%.6g", ",", header="Time [s],Position [um]", comments="")

    recorded = np.loadtxt(folder / "recording.csv", delimiter=",", skiprows=1)
    slope, start = np.polyfit(recorded[:, 2], recorded[:, 1], 1)
    plays, whole = (hystgen.load(folder / name) for name in ("plain.yaml", "extended.yaml"))
    axes: dict[str, Callable[[], Drive]] = {
        "linear scale": lambda: lambda u: float(slope * u + start),
        "plays": lambda: CompiledC(plays).step,
        "whole model": lambda: CompiledC(whole).step,
    }
    print("rms error, % of the image   fast axis   slow axis   trace to retrace")
    with drawing.styled():
        figure = drawing.figure(11.0, 7.0)
        grid = figure.add_gridspec(2, 3, height_ratios=(1.5, 1.0))
        error = figure.add_subplot(grid[1, :])
        colours = (drawing.OTHER, drawing.GAP, drawing.MODEL)
        for k, ((name, axis), colour) in enumerate(zip(axes.items(), colours, strict=True)):
            x, y = moved(axis(), fast), moved(axis(), slow)
            print(f"{name:26} {rms(x - fast):10.3f}  {rms(y - slow):10.3f}  {between(x):17.3f}")
            panel = figure.add_subplot(grid[0, k])
            ends = (CORNER, CORNER + SIZE)
            panel.imshow(seen(x, y), cmap="gray", origin="lower", extent=(*ends, *ends), aspect="equal")
            panel.set(title=name.capitalize(), xlabel="fast axis (um)", ylabel="slow axis (um)")
            panel.grid(visible=False)
            words = f"{name}: {rms(x - fast):.2f} % rms"
            error.plot(t[START:], 100.0 * (x - fast)[START:] / SIZE, color=colour, linewidth=1.0, label=words)
        error.set(xlabel="time (s)", ylabel="error, fast axis (% of the image)")
        drawing.legend_above(error, 3)
        figure.suptitle("A chequered sample as it is seen, trace and retrace as neighbouring rows")
        (folder / "raster.png").write_bytes(drawing.content(figure, "png"))
    print(folder / "raster.png")


if __name__ == "__main__":
    main()
