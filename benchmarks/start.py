"""Processor time of `hystgen emit` for a plain model, relative to importing numpy and jinja2, which it needs.

`python benchmarks/start.py --runs 30` runs the two in turn, each in a process of its own, and prints the least and the
median of both and their ratio, and the modules of hystgen that the command imports. The first run, which compiles the
modules, is not counted, and PYTHONDONTWRITEBYTECODE is not passed on.
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

LISTED = """import sys
from hystgen import cli
cli.main(sys.argv[1:], standalone_mode=False)
print(*(name for name in sys.modules if name.split(".")[0] == "hystgen"), sep="\\n")
"""


def seconds(command: Sequence[str]) -> float:
    """Processor time of a process."""
    plain = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, env=plain)
    _, status, spent = os.wait4(process.pid, 0)
    if status:
        raise subprocess.CalledProcessError(status, command)
    return spent.ru_utime + spent.ru_stime


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=30)
    runs = parser.parse_args().runs
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
