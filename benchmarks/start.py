"""Processor time of `hystgen emit` for a plain model, relative to importing numpy and jinja2, which it needs.

`python benchmarks/start.py --runs 30` runs the two in turn, each in a separate process, and prints the minimum and
median of both, their ratio, and the hystgen modules that the command imports. Since modules must be compiled, the first
run is not counted, and PYTHONDONTWRITEBYTECODE is not passed on.

`python benchmarks/start.py --first` prints the processor time of `hystgen verify` of ten plays with creep and a lag in
each arithmetic, first with an empty cache of compiled functions and then with the cache that this run filled.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

PLAIN = """hystgen: 1
name: plain
input_range: [-4, 4]
model: {pi: {thresholds: [0, 0.5, 1], weights: [0.7, 0.5, 0.3]}}
"""

EFFECTS = """hystgen: 1
name: effects
input_range: [-4, 4]
sample_time: 1.0e-3
model:
  pi:
    thresholds: [0, 0.4, 0.8, 1.2, 1.6, 2.0, 2.4, 2.8, 3.2, 3.6]
    weights: [0.72, 0.6, 0.48, 0.36, 0.24, 0.12, 0.1, 0.05, 0.03, 0.012]
  effects:
    - {name: creep, time_constants: [0.01, 0.1, 300], weights: [0.02, 0.03, 0.05]}
    - {name: lag, time_constant: 0.01}
"""

LISTED = """import sys
from hystgen import cli
cli.main(sys.argv[1:], standalone_mode=False)
print(*(name for name in sys.modules if name.split(".")[0] == "hystgen"), sep="\\n")
"""


def seconds(command: Sequence[str], **more: str) -> float:
    """Processor time of a process, with `more` in its environment, and of the processes that it waits for."""
    plain = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"} | more
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, env=plain)
    _, status, spent = os.wait4(process.pid, 0)
    if status:
        raise subprocess.CalledProcessError(status, command)
    return spent.ru_utime + spent.ru_stime


def first_verify() -> None:
    """Print the times of the first and the second `verify`."""
    for arithmetic in ("float32", "float64", "q31", "q15"):
        with tempfile.TemporaryDirectory(prefix="hystgen-start-") as name:
            model = Path(name) / "effects.yaml"
            model.write_text(EFFECTS, encoding="utf-8")
            verify = [sys.executable, "-m", "hystgen", "verify", str(model), "--arithmetic", arithmetic]
            first, second = (seconds(verify, NUMBA_CACHE_DIR=name) for _ in range(2))
        print(f"{arithmetic}: first verify {first:.1f} s, second {second:.1f} s", flush=True)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=30)
    parser.add_argument("--first", action="store_true", help="the first verify of a model with effects instead")
    given = parser.parse_args()
    if given.first:
        first_verify()
        return
    runs = given.runs
    with tempfile.TemporaryDirectory(prefix="hystgen-start-") as name:
        model = Path(name) / "plain.yaml"
        model.write_text(PLAIN, encoding="utf-8")
        emit = ["emit", str(model), "-o", name]
        commands = {
            "numpy and jinja2": [sys.executable, "-c", "import numpy, jinja2"],
            "emit": [sys.executable, "-m", "hystgen", *emit],
        }
        for command in commands.values():
            seconds(command)
        turns = [[seconds(command) for command in commands.values()] for _ in range(runs)]
        listed = subprocess.run([sys.executable, "-c", LISTED, *emit], capture_output=True, text=True, check=True)
    base, whole = zip(*turns, strict=True)
    for of, each in zip(commands, (base, whole), strict=True):
        print(f"{of}: {min(each):.3f} s, median {statistics.median(each):.3f} s")
    medians = statistics.median(whole) / statistics.median(base)
    print(f"ratio: {min(whole) / min(base):.2f}, of the medians {medians:.2f}")
    modules = [line for line in listed.stdout.splitlines() if line.startswith("hystgen")]
    print(f"{len(modules)} modules of hystgen")


if __name__ == "__main__":
    main()
