"""Measure what `engine: auto` chooses from: instructions of a sample with each engine, for few plays.

    python benchmarks/engine_costs.py [-o hystgen/engine_costs.csv]

Mean over a decaying multisine, strict -O2 build of zig, the geometric mean of a Cortex-M0+ without and a Cortex-M4F
with an FPU, for both operators, every arithmetic, with and without a memoryless part (a dead zone). The shipped table
is read by `hystgen.tables.choose_engine`, so that the same parameters give the same C everywhere.
"""

from __future__ import annotations

import argparse
import csv
import functools
import itertools
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import targets as bench

from hystgen import reference, simulation
from hystgen.api import Model, emit_options
from hystgen.params import parse_parameters
from hystgen.verification import comparison, compilers, cross, emulator, sources, targets

PLAYS = (1, 2, 3, 4, 6, 8, 16)
CORES = ("cortex-m0plus", "cortex-m4f")
KINDS = ("pi", "gpi")
FRONT = "  memoryless: {kind: dead_zone, thresholds: [-5, 0, 5], weights: [-0.2, 1.2, 0.2]}\n"
SHIPPED = Path(__file__).resolve().parents[1] / "hystgen" / "engine_costs.csv"


@functools.cache
def model(n: int, kind: str) -> Model:
    """The benchmark's model, as it is or behind a dead zone."""
    p = bench.model(n).parameters.model.pi
    text = (
        f"hystgen: 1\nname: bench\ninput_range: [-{bench.RANGE}, {bench.RANGE}]\nmodel:\n  pi:\n"
        f"    thresholds: {list(p.thresholds)}\n    weights: {list(p.weights)}\n"
    )
    return Model(parse_parameters(text + FRONT * (kind == "gpi"), "bench.yaml"))


def means(folder: Path, n: int, kind: str, arithmetic: str, engine: str) -> dict[str, float]:
    """Geometric mean over the cores of the mean instructions of a sample, for each operator."""
    one = model(n, kind)
    files = sources.write(folder, one, emit_options(one, "both", arithmetic, engine))
    numbers, real = one.tables(arithmetic, engine), comparison.REALS[arithmetic]
    ends = numbers.limits[reference.DRIVE_MIN : reference.DRIVE_MAX + 1]
    drive = bench.multisine(bench.SAMPLES) * float(min(abs(ends[0]), ends[1]))
    drive = np.rint(drive) if real.kind == "i" else drive
    call = np.full(len(drive), reference.OP_STEP, dtype=np.uint8)
    session = simulation.Session(one.cascade, "forward", arithmetic, engine)
    signals: dict[str, Any] = {"forward": drive, "inverse": session.run(drive)[0].astype(float)}
    found = dict.fromkeys(signals, 1.0)
    for core in CORES:
        target = targets.find(core)
        entry = f"hystgen_harness_{files.operators[0]}"
        program = cross.find(target, "zig").image(files, folder / core, compilers.STRICT, cross.Layout(), entry)
        image = emulator.Image.load(program)
        for op, x in signals.items():
            machine = emulator.Core(target, image)
            record = comparison.expected_record(numbers, real, op == "inverse", ("signal", call, x))
            outcome = comparison.compare(functools.partial(machine.run, "bench", op), [record])
            assert not outcome.different, (n, kind, arithmetic, engine, op, outcome)
            found[op] *= float(machine.counts.mean()) ** (1 / len(CORES))
    return found


def main() -> None:
    """Measure everything and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=SHIPPED, help="the table, default the shipped one")
    output = parser.parse_args().output
    rows = []
    with tempfile.TemporaryDirectory(prefix="hystgen-costs-") as place:
        for number, (arithmetic, kind, n) in enumerate(itertools.product(comparison.REALS, KINDS, PLAYS)):
            loop, corners = (
                means(Path(place) / f"{number}-{engine}", n, kind, arithmetic, engine) for engine in ("loop", "corners")
            )
            for op in ("forward", "inverse"):
                rows.append((op, arithmetic, kind, n, round(loop[op]), round(corners[op])))
                print(*rows[-1], flush=True)
    with output.open("w", newline="", encoding="ascii") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("operator", "arithmetic", "kind", "n", "loop", "corners"))
        writer.writerows(sorted(rows))


if __name__ == "__main__":
    main()
