"""From a plan to a diagnosis in one run: plan the drives, play and record them, cut the recording, diagnose.

hardware.py has the two functions that touch hardware, here a simulated bench; replace them with your own. Nothing is
known about the stage except the range of its drive: the first record gives the model from which the diagnosis starts.

Writes plan, recording, model and diagnosis into the folder, and prints what a model of plays alone is missing.

Usage: python examples/acquire [-o FOLDER] [--rate HZ]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from hardware import DAC, read_position, write_drive

import hystgen
from hystgen.planning.session import Session
from hystgen.records import read_record, write_columns

STAGE = """hystgen: 1
name: bench
units: {input: V, output: um}
input_range: [0.0, 100.0]
model: {pi: {thresholds: [0], weights: [0.1]}}
"""
"""All that a plan needs: the range."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).parent / "out")
    parser.add_argument("--rate", type=float, default=200.0, help="sample rate of DAC and ADC, Hz")
    options = parser.parse_args()
    folder: Path = options.output
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "stage.yaml").write_text(STAGE)

    planned = hystgen.plan(folder / "stage.yaml", rate=options.rate, **DAC)
    planned.write(folder / "plan")
    print(planned.sentence())

    write_drive(np.loadtxt(folder / "plan" / "session_codes.txt", dtype=np.int64))
    v, y = read_position(options.rate)
    t = np.arange(len(v)) / options.rate
    write_columns(folder / "plan" / "recording.csv", ("t [s]", "v [V]", "y [um]"), (t, v, y))

    session = Session.read(folder / "plan" / "session.json")
    to_fit, held = session.cut(read_record(folder / "plan" / "recording.csv"))
    known = {"history": session.history, "rest": session.rest}
    fit = hystgen.identify(to_fit[:1], name="bench", units={"input": "V", "output": "um"}, **known)
    fit.write(folder / "bench.yaml")
    found = hystgen.diagnose(fit, to_fit, holdout=held, **known)
    found.write(folder / "diagnosis")
    print(found.sentence())


if __name__ == "__main__":
    main()
