"""Time and memory of a fit, compared with non-negative least squares on the whole regressor matrix.

    python benchmarks/identification.py [--check] [--large]

For 200 000 samples and 64 thresholds it prints the seconds that both take in the same run on one thread, including the
construction of the regressor matrix, and the difference of their residuals. `--large` also fits a record of 10^7
samples and prints the memory used beyond the record. `--check`: exit 1 unless the ratio is at least 10, the residuals
agree to a relative 1e-6 and, with `--large`, memory does not grow with the number of thresholds.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import sys
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

import hystgen
from hystgen.identification import pi, prepared, reduction
from hystgen.plays import operators
from hystgen.records import Record

Array = NDArray[np.float64]

SAMPLES, PLAYS = 200_000, 64
LARGE = 10_000_000
RUNS = 5
FASTER = 10.0
FEW, MANY, MEMORY_SAMPLES = 8, 100, 1_000_000


def drives(samples: int) -> dict[str, Array]:
    """Drives in volts: ramps between random turning points, a decaying sine, and the ramps with converter noise."""
    rng = np.random.default_rng(1)
    turns = rng.uniform(0.0, 100.0, samples // 500 + 2)
    ramps = np.interp(np.arange(samples) / 500.0, np.arange(len(turns)), turns)
    t = np.arange(samples) / samples
    sine = 50.0 + 50.0 * np.exp(-3.0 * t) * np.sin(2.0 * np.pi * 200.0 * t)
    return {"ramps": ramps, "decaying sine": sine, "noisy ramps": ramps + rng.normal(0.0, 0.02, samples)}


def best(run: Callable[[], object]) -> float:
    """Shortest time of a few runs, s."""
    times = []
    for _ in range(RUNS):
        began = time.perf_counter()
        run()
        times.append(time.perf_counter() - began)
    return min(times)


def compare(v: Array) -> tuple[float, float, float]:
    """Seconds of nnls and of hystgen, and the relative difference of their residuals."""
    from scipy.optimize import nnls

    r = np.linspace(0.0, 45.0, PLAYS + 1)
    rng = np.random.default_rng(2)
    y = operators.plays(v, r, 0.0).T @ rng.uniform(0.0, 1.0, PLAYS + 1) + rng.normal(0.0, 0.5, len(v)) - 30.0
    course = prepared.course_of(Record("made", np.arange(len(v)) * 1e-4, v, y), (), 0)
    columns = np.arange(PLAYS + 1)
    found: list[float] = [0.0, 0.0]

    def theirs() -> None:
        one = np.ones((len(v), 1))
        # an offset of either sign
        _, found[0] = nnls(np.column_stack([operators.plays(v, r, 0.0).T, one, -one]), y)

    def ours() -> None:
        reduced = reduction.reduce([course], r)
        found[1] = pi.residual(reduced.whole, columns, pi.non_negative(reduced.whole, columns)) ** 0.5

    ours()  # compiles
    return best(theirs), best(ours), abs(found[1] / found[0] - 1.0)


def fit(samples: int, plays: int | None) -> tuple[float, float]:
    """Seconds taken by a fit, and its peak memory beyond the record in bytes; call it in a separate process."""
    v = drives(samples)["noisy ramps"]
    y = operators.plays(v, [0.0, 5.0, 20.0], 0.0).T @ [0.5, 0.2, 0.1]
    record = Record("made", np.arange(samples) * 1e-5, v, y, sample_time=1e-5)
    hystgen.identify(record.section(0, 5000), thresholds=plays, holdout=record.section(5000, 9000))  # compiles
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    began = time.perf_counter()
    hystgen.identify(record, thresholds=plays, holdout=record.section(0, 100_000))
    grown = 1024.0 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
    return time.perf_counter() - began, grown


def apart(samples: int, plays: int | None) -> tuple[float, float]:
    """`fit` in a new process, so that the peak memory is its own."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(fit, (samples, plays))


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--large", action="store_true")
    options = parser.parse_args()
    met = True
    print(f"{SAMPLES} samples, {PLAYS} thresholds")
    print(f"{'drive':15s} {'nnls s':>8s} {'hystgen s':>10s} {'ratio':>6s}  residuals differ by")
    with threadpool_limits(1):
        for name, v in drives(SAMPLES).items():
            other, own, differ = compare(v)
            print(f"{name:15s} {other:8.3f} {own:10.3f} {other / own:6.1f}  {differ:.1e}")
            met = met and other >= FASTER * own and differ < 1e-6
    if options.large:
        seconds, grown = apart(LARGE, None)
        print(f"{LARGE} samples: {seconds:.1f} s, {grown / 1e6:.0f} MB beyond the record's {24e-6 * LARGE:.0f} MB")
        few, many = (apart(MEMORY_SAMPLES, plays)[1] for plays in (FEW, MANY))
        matrix = 8.0 * MEMORY_SAMPLES * (MANY - FEW)
        print(f"{MEMORY_SAMPLES} samples, {FEW} and {MANY} plays: {few / 1e6:.0f} and {many / 1e6:.0f} MB; "
              f"the regressor matrix would grow by {matrix / 1e6:.0f} MB")  # fmt: skip
        met = met and many - few < 0.1 * matrix
    if options.check:
        print("met" if met else "missed")
    return int(options.check and not met)


if __name__ == "__main__":
    sys.exit(main())
