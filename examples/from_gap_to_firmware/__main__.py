"""From a recording that a model does not explain to firmware that tracks: identify, diagnose, emit, run the C.

A stage with hidden creep and a bent transducer (stage.py, which shares no code with hystgen) is recorded. A model is
identified, and the gap between model and stage is diagnosed. The C of the models before and after the diagnosis is
emitted, compiled on this machine and run in front of the same stage for a motion that is in no recording.

Writes recordings, models, C and the picture `tracking.png` into the folder, and prints the table.

Usage: python examples/from_gap_to_firmware [-o FOLDER]
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from stage import DAMPERS, FULL, SAMPLE_TIME, Stage, turns

import hystgen
from hystgen.basics import drawing
from hystgen.closed_loop import CompiledC
from hystgen.parameters.files import dump_parameters

Array = NDArray[np.float64]

SECONDS = 7.5 * DAMPERS[-1][0]
"""Length of the recording to fit, s: long enough for the slowest damper to come to rest several times, since only creep
that shows can be identified."""


def write(path: Path, drives: Array) -> Path:
    """A recording of a fresh stage."""
    y = Stage(seed=len(path.stem)).measure(drives)
    t = SAMPLE_TIME * np.arange(len(drives))
    rows = np.column_stack([t, drives, y])
    np.savetxt(path, rows, fmt="%.6g", delimiter=",", header="t_s,v_V,y_um", comments="")
    return path


def reference(low: float, high: float) -> Array:
    """A motion, um: down and up over the range, then sweeps, steps and holds inside it."""
    rng = np.random.default_rng(7)
    inside = low + (high - low) * turns(rng, 40.0, 10.0, 90.0) / FULL
    sweep = np.linspace(low, high, 300)
    return np.concatenate([np.full(200, low), sweep, sweep[::-1], inside])


def tracked(to_drive: Callable[[float], float], wanted: Array) -> Array:
    """The true motion with a compensator in front of the stage."""
    stage = Stage()
    stage.rest(min(max(to_drive(float(wanted[0])), 0.0), FULL))
    return np.array([stage.move(min(max(to_drive(float(u)), 0.0), FULL)) for u in wanted])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).parent / "out")
    folder: Path = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)

    rng = np.random.default_rng(3)
    sweep = np.concatenate([np.linspace(0.0, FULL, 400), np.linspace(FULL, 0.0, 400)])
    fit = write(folder / "recording.csv", np.concatenate([sweep, turns(rng, SECONDS, 0.0, FULL)]))
    held = write(folder / "held_out.csv", np.concatenate([sweep, turns(rng, SECONDS / 2, 0.0, FULL)]))

    plain = hystgen.identify(fit, holdout=[held], name="plain")
    plain.write(folder / "plain.yaml")
    found = hystgen.diagnose(folder / "plain.yaml", [fit], holdout=[held])
    found.write(folder / "diagnosis")
    print(found.sentence())
    extended = found.parameters.model_copy(update={"name": "extended", "sample_time": SAMPLE_TIME})
    (folder / "extended.yaml").write_text(dump_parameters(extended))
    models = [hystgen.load(folder / name) for name in ("plain.yaml", "extended.yaml")]
    hystgen.emit(models, folder / "firmware")

    low, high = 6.0, 20.0
    wanted = reference(low, high)
    record = np.loadtxt(fit, delimiter=",", skiprows=1)
    slope, start = np.polyfit(record[:, 2], record[:, 1], 1)
    runs: dict[str, Callable[[float], float]] = {
        "straight line": lambda u: float(slope * u + start),
        "identified": CompiledC(models[0]).step,
        "identified, diagnosed": CompiledC(models[1]).step,
    }
    t = SAMPLE_TIME * np.arange(len(wanted))
    inside = slice(800, None)
    with drawing.styled():
        figure = drawing.figure(9.0, 7.4)
        motion, error, enlarged = figure.subplots(3, 1, sharex=True)
        motion.plot(t, wanted, color=drawing.MEASURED, linewidth=1.0)
        motion.set(title="Motion wanted", ylabel="displacement (um)")
        colours = (drawing.OTHER, drawing.GAP, drawing.MODEL)
        for (name, step), colour in zip(runs.items(), colours, strict=True):
            left = wanted - tracked(step, wanted)
            left -= np.mean(left[inside])  # the zero of a displacement is arbitrary
            rms = 100.0 * float(np.std(left[inside])) / (high - low)
            print(f"{name:24} {rms:6.3f} % of the motion, rms")
            for axes in (error,) if name == "straight line" else (error, enlarged):
                axes.plot(t, 100.0 * left / (high - low), color=colour, linewidth=1.0, label=f"{name}: {rms:.2f} % rms")
        error.set(ylabel="tracking error (%)")
        drawing.legend_above(error, 3)
        enlarged.set_title("Enlarged, without the straight line", fontsize=9.5)
        enlarged.set(xlabel="time (s)", ylabel="tracking error (%)", ylim=(-2.2, 2.2))
        (folder / "tracking.png").write_bytes(drawing.content(figure, "png"))


if __name__ == "__main__":
    main()
