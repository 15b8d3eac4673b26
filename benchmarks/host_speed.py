"""Speed on the host, as ratios measured in one run on one core.

    python benchmarks/host_speed.py [--check]

1. Simulating 10^6 samples through 64 plays, against the textbook sample loop in numpy (each play a row of an array).
2. The whole of `hystgen emit` for a small parameter file, against `python -c "import numpy, jinja2"`.

With `--check` the exit code is 1 if a ratio misses its target.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hystgen import PI

SAMPLES, PLAYS = 1_000_000, 64
FASTER, SLOWER_START = 100.0, 4.0

PARAMETERS = """\
hystgen: 1
name: stage_x
input_range: [0, 100]
model: {pi: {thresholds: [0, 5, 10, 20], weights: [0.1, 0.02, 0.02, 0.03]}}
"""


def textbook(v: NDArray[np.float64], r: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
    """`s = max(v - r, min(v + r, s))`, `y = p . s`, sample after sample."""
    s = np.zeros_like(r)
    y = np.empty_like(v)
    for k in range(len(v)):
        s = np.maximum(v[k] - r, np.minimum(v[k] + r, s))
        y[k] = p @ s
    return y


def seconds(action: Callable[[], object], repeats: int) -> float:
    """Median wall time of `action`."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def simulation(name: str, v: NDArray[np.float64]) -> float:
    """Ratio of the textbook loop's time to that of `simulate`."""
    r = np.linspace(0.0, 5.0, PLAYS + 1)
    p = np.concatenate([[1.0], np.full(PLAYS, 0.05)])
    model = PI(r.tolist(), p.tolist())
    model.simulate(v[:1000])  # compiles, unless cached
    y = textbook(v, r, p)
    gap = float(np.max(np.abs(y - model.simulate(v))))
    assert gap < 1e-10, gap
    slow = seconds(lambda: textbook(v, r, p), 3)
    fast = seconds(lambda: model.simulate(v), 15)
    print(f"{name:28} {slow * 1e3:10.1f} ms {fast * 1e3:10.2f} ms   {slow / fast:7.0f} times faster")
    return slow / fast


def start_up() -> float:
    """Ratio of the time of `hystgen emit` to that of importing numpy and jinja2."""
    with tempfile.TemporaryDirectory() as folder:
        parameters = Path(folder) / "stage_x.yaml"
        parameters.write_text(PARAMETERS)
        emit = [sys.executable, "-m", "hystgen.cli", "emit", str(parameters), "-o", folder]
        imports = [sys.executable, "-c", "import numpy, jinja2"]
        pairs = [
            [seconds(lambda command=command: subprocess.run(command, check=True, capture_output=True), 1)
             for command in (imports, emit)]
            for _ in range(11)
        ]  # fmt: skip
    base, whole = (statistics.median(column) for column in zip(*pairs, strict=True))
    print(f"{'import numpy, jinja2':28} {base * 1e3:10.0f} ms")
    print(f"{'hystgen emit':28} {whole * 1e3:10.0f} ms   {whole / base:7.2f} times the imports")
    return whole / base


def main() -> int:
    """Print the table; with --check, the exit code says whether the targets are met."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="exit 1 where a target is missed")
    wanted = parser.parse_args().check
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    k = np.linspace(0.0, 1.0, SAMPLES)
    rng = np.random.default_rng(1)
    signals = {
        "decaying sine": 8 * np.sin(600 * k) * np.linspace(1, 0.1, SAMPLES),
        "random walk": np.cumsum(rng.normal(0, 0.05, SAMPLES)),
        "white noise": rng.uniform(-8, 8, SAMPLES),  # every sample reverses across many plays: the worst case
    }
    print(f"{SAMPLES} samples, {PLAYS} plays      numpy loop       hystgen")
    ratios = {name: simulation(name, v) for name, v in signals.items()}
    slow_start = start_up()
    met = ratios["decaying sine"] >= FASTER and ratios["random walk"] >= FASTER and slow_start <= SLOWER_START
    print(f"targets: at least {FASTER:g} times faster on sine and walk, start at most {SLOWER_START:g} times: "
          + ("met" if met else "missed"))  # fmt: skip
    return int(wanted and not met)


if __name__ == "__main__":
    sys.exit(main())
