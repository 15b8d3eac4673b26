"""Two coupled axes: record, name the coupling, compensate it in compiled C, and compare the tracking errors.

Each axis is identified on its own, from records in which the other axis moves too; its drive is logged beside them. The
diagnosis names that column. In the loop, the C of each axis gets the last drive of the other with `set_influence`.

Writes the records, the models `x_plain.yaml`, `x.yaml`, `y_plain.yaml`, `y.yaml`, the C of both axes and the picture
`tracking.png` into FOLDER, and prints the errors.

Usage: python examples/xy_stage [-o FOLDER]
"""

from __future__ import annotations

import argparse
import sys
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import hystgen
from hystgen.basics import drawing
from hystgen.closed_loop import CompiledC
from hystgen.parameters.files import dump_parameters

sys.path.insert(0, str(Path(__file__).resolve().parent))

from stage import FULL, RANGE, SAMPLE_TIME, Stage, recorded

Array = NDArray[np.float64]

AXES = ("x", "y")
RECORDS, SAMPLES = 3, 1200
"""Records, of which the last is held out, and samples of each: 2.4 s."""

SWEEP, START = 400, 1200
"""Samples of a sweep, and of all that comes before the figure is tracked."""


def columns(drives: Array, places: Array, axis: int) -> dict[str, Array]:
    """A record of one axis, with the drive of the other beside it."""
    t = SAMPLE_TIME * np.arange(drives.shape[1])
    return {"t": t, "v": drives[axis], "y": places[axis], f"v_{AXES[1 - axis]}": drives[1 - axis]}


def figure_of_eight() -> Array:
    """Positions (2, N) to track, um: a sweep of X, one of Y, and a figure that both draw together."""
    low, high, middle = 0.25 * RANGE, 0.75 * RANGE, 0.5 * RANGE
    sweep = np.interp(np.linspace(0.0, 3.0, SWEEP), (0.0, 1.0, 2.0, 3.0), (middle, high, low, middle))
    still = np.full(SWEEP, middle)
    turn = np.linspace(0.0, 4.0 * np.pi, 2400)
    x, y = middle + 0.2 * RANGE * np.sin(turn), middle + 0.2 * RANGE * np.sin(2.0 * turn)
    return np.array([np.concatenate([sweep, still, still, x]), np.concatenate([still, sweep, still, y])])


def tracked(models: list[hystgen.Model], wanted: Array) -> Array:
    """True positions (2, N), um, about the means of those wanted, with the C of both axes in front of the stage."""
    stage, axes = Stage(), [CompiledC(model) for model in models]
    follows = [any(effect.read for effect in model.effects) for model in models]
    last, found = [0.0, 0.0], []
    for u in wanted.T:
        for k, axis in enumerate(axes):
            if follows[k]:
                axis.set_influence(f"v_{AXES[1 - k]}", last[1 - k])
            last[k] = min(max(axis.step(float(u[k])), 0.0), FULL)
        found.append(stage.move((last[0], last[1])))
    places = np.array(found).T
    return places - np.mean((places - wanted)[:, START:], axis=1, keepdims=True)  # the zero is arbitrary


def rms(error: Array) -> float:
    """Rms error in the figure, % of the range of an axis."""
    return 100.0 * float(np.sqrt(np.mean(error[START:] ** 2))) / RANGE


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).resolve().parent / "out")
    folder: Path = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(7)
    sessions = []
    for k in range(RECORDS):
        drives = recorded(rng, SAMPLES)
        sessions.append((drives, Stage(k).measured(drives)))
    plain, whole = [], []
    for axis, name in enumerate(AXES):
        records = [columns(*session, axis) for session in sessions]
        for k, record in enumerate(records):
            header = ",".join(record)
            np.savetxt(folder / f"{name}_{k}.csv", np.column_stack([*record.values()]), "%.6g", ",", header=header,
                       comments="")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            fit = hystgen.identify(records[:-1], holdout=records[-1:], model="pi", name=f"stage_{name}")
            found = hystgen.diagnose(fit, records[:-1], holdout=records[-1:])
        print(f"axis {name.upper()}: {found.sentence()}", flush=True)
        for suffix, said, models in (("_plain", fit.parameters, plain), ("", found.parameters, whole)):
            parameters = said.model_copy(update={"sample_time": SAMPLE_TIME})
            (folder / f"{name}{suffix}.yaml").write_text(dump_parameters(parameters), encoding="utf-8")
            models.append(hystgen.Model(parameters))
        hystgen.emit(whole[-1], folder / "c")

    wanted = figure_of_eight()
    before, after = tracked(plain, wanted), tracked(whole, wanted)
    print("rms error, % of an axis      X        Y")
    for words, places in (("plays of each axis alone", before), ("with the other's drive", after)):
        print(f"{words:26} {rms(places[0] - wanted[0]):.4f}   {rms(places[1] - wanted[1]):.4f}")
    with drawing.styled():
        picture = drawing.figure(11.0, 6.0)
        grid = picture.add_gridspec(2, 2, width_ratios=(1.0, 1.6))
        path, t = picture.add_subplot(grid[:, 0]), SAMPLE_TIME * np.arange(wanted.shape[1])
        path.plot(*wanted[:, START:], color=drawing.OTHER, linewidth=3.0, label="wanted")
        pairs = (("before", before, drawing.GAP), ("after", after, drawing.MODEL))
        for words, places, colour in pairs:
            shown = wanted + 20.0 * (places - wanted)
            path.plot(*shown[:, START:], color=colour, linewidth=1.0, label=f"{words}, error 20 times enlarged")
        path.set(xlabel="X (um)", ylabel="Y (um)", aspect="equal")
        drawing.legend_above(path, 1)
        for k, name in enumerate(AXES):
            panel = picture.add_subplot(grid[k, 1])
            for words, places, colour in pairs:
                error = places[k] - wanted[k]
                panel.plot(t[START:], error[START:], color=colour, linewidth=1.0,
                           label=f"{words}: {rms(error):.3f} % rms")
            panel.set(xlabel="time (s)", ylabel=f"error of {name.upper()} (um)")
            drawing.legend_above(panel, 2)
        (folder / "tracking.png").write_bytes(drawing.content(picture, "png"))
    print(f"written to {folder}")


if __name__ == "__main__":
    main()
