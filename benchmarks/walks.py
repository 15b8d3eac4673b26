"""How many files a number passes through on its way, counted over real runs.

    python benchmarks/walks.py [-v]

For each run it prints the number of files of the package in which a function was called, and of doorways, pairs of
files of which one calls the other; with -v also the files. Imports, a first run, which fills caches, and other
processes do not count. A profiler sees no compiled functions, so the bit-exact reference runs as plain Python.
"""

from __future__ import annotations

import argparse
import functools
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

import hystgen

ROOT = Path(hystgen.__file__).parent
EXAMPLES = Path(__file__).parents[1] / "examples"
IN_PYTHON = "a sample through the bit-exact reference"
MODEL = """\
hystgen: 1
name: stage_x
units: {input: V, output: um}
input_range: [-4, 4]
model:
  pi:
    thresholds: [0, 0.45, 0.9, 1.35, 1.8]
    weights: [0.72, 0.6, 0.48, 0.36, 0.24]
"""


@functools.cache
def inside(file: str) -> str | None:
    """The path of a file within the package, None for other files; cached, since a walk asks at every call."""
    path = Path(file)
    return str(path.relative_to(ROOT)) if path.is_relative_to(ROOT) else None


def walk(run: Callable[[], object]) -> tuple[list[str], int]:
    """Files that a run enters, and the number of doorways between them."""
    files: set[str] = set()
    doorways: set[tuple[str, str]] = set()

    def place(frame: FrameType | None) -> str | None:
        if frame is None or frame.f_code.co_name == "<module>":
            return None
        return inside(frame.f_code.co_filename)

    def enter(frame: FrameType, event: str, _: Any) -> None:
        if event != "call" or (here := place(frame)) is None:
            return
        files.add(here)
        caller = frame.f_back
        while caller is not None and place(caller) is None:  # through a library, for example a decorator
            caller = caller.f_back
        before = place(caller)
        if before not in (None, here):
            doorways.add((str(before), here))

    run()
    sys.setprofile(enter)
    try:
        run()
    finally:
        sys.setprofile(None)
    return sorted(files), len(doorways)


def crept(model: hystgen.Model, path: Path) -> None:
    """Write a recording of steps after which the model's output creeps by 3 % with a time constant of 2 s."""
    t = 0.05 * np.arange(2000)
    v = 3.5 * np.repeat(np.random.default_rng(1).uniform(-1.0, 1.0, 50), 40)
    h = model.simulate(v)
    state, y = h[0], []
    for each in h:
        state += (each - state) * 0.05 / 2.0
        y.append(each + 0.03 * state)
    noise = 1e-3 * np.random.default_rng(2).normal(size=len(t))
    np.savetxt(path, np.column_stack([t, v, y + noise]), delimiter=",", header="t,v,y", comments="")


def runs(folder: Path) -> dict[str, Callable[[], object]]:
    """The walks by name."""
    parameters, recording = folder / "stage_x.yaml", folder / "crept.csv"
    parameters.write_text(MODEL)
    model = hystgen.load(parameters)
    crept(model, recording)
    drive = [0.1 * (k % 40) for k in range(80)]
    session = model.session("inverse", "float32")

    def named() -> None:
        if hasattr(os, "sched_setaffinity"):  # on one core there are no other processes
            os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
        found = hystgen.diagnose(model, [recording])
        assert [each.name for each in found.parameters.model.effects] == ["creep"], found.sentence()

    return {
        "a recording's column v to weights": lambda: hystgen.identify(EXAMPLES / "stage_recording.csv"),
        "a weight to its digit in float32 C": lambda: hystgen.emit(model, folder / "out", arithmetic="float32"),
        IN_PYTHON: lambda: session.run(drive),
        "a recording to a named effect": named,
    }


def main() -> int:
    """Print the table; each walk runs in a separate process."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-v", "--verbose", action="store_true", help="list the files")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        every = runs(Path(folder))
        if given.one:
            files, doorways = walk(every[given.one])
            print(f"{given.one:40} {len(files):5} {doorways:9}")
            print(*(f"    {file}" for file in files if given.verbose), sep="\n")
            return 0
    print(f"{'walk':40} files  doorways", flush=True)
    for name in every:
        environment = {**os.environ, "NUMBA_DISABLE_JIT": str(int(name == IN_PYTHON))}
        subprocess.run([sys.executable, __file__, *sys.argv[1:], "--one", name], check=True, env=environment)
    return 0


if __name__ == "__main__":
    sys.exit(main())
