"""Measure the costs by which `engine: auto` chooses: code size, and each engine's instructions per sample.

    python benchmarks/engine_costs.py [-o hystgen]

Instructions are the mean over a decaying multisine in a strict -O2 build of zig, for both operators and every
arithmetic, with and without a memoryless part (a dead zone); models with a gain, the cheapest effect, are measured at
fewer numbers of plays. Code is a module's size at -O2, the larger of zig and gcc, for every kind that
`hystgen.compensator.engines.kind` distinguishes. Both are measured on a Cortex-M0+ without and a Cortex-M4F with an
FPU. `hystgen.compensator.engines` reads the tables as shipped, so the same parameters give the same C everywhere.
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

from hystgen.arithmetic import ARITHMETICS
from hystgen.compensator import engines, reference
from hystgen.emission import module
from hystgen.emission.calls import emit_options
from hystgen.emission.options import OPERATORS
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.plays import slots
from hystgen.verification import comparison, compilers, cross, emulator, sources, targets

PLAYS = (1, 2, 3, 4, 6, 8, 16)
CODE_PLAYS = 10  # code is measured with these plays; 64 change it by at most 16 bytes (gcc, float32, q31, both cores)
KINDS = ("pi", "gpi", "effects", "gpi_effects")
GAIN = "  effects: [{name: thermal, gain_per_degree: 0.001}]\nsample_time: 1.0e-3\n"
EFFECT_PLAYS = (1, 4, 16)
"""Plays of models with effects; a model takes the nearest row at or below its number. Three rows suffice: from 1 to 16
plays, the corner engine grows by 3 %, the loop engine by 1240 to 1364 instructions per play (float32, inverse, M0+)."""
DEAD_ZONE = "{kind: dead_zone, thresholds: [-5, 0, 5], weights: [-0.2, 1.2, 0.2]}"
TANH = "{kind: tanh, ascending: {a0: 15, a1: 0.1, a2: 0.1, a3: 0.2}}"
BRANCHES = TANH[:-1] + ", descending: {a0: 15, a1: 0.1, a2: 0.1, a3: 0.5}}"
FRONTS = {
    "pi": "",
    "dead_zone": DEAD_ZONE,
    "dead_zone_branches": BRANCHES,  # in fixed point, where every stage becomes a curve
    "tanh": TANH,
    "tanh_branches": BRANCHES,
    "mixed": f"[{DEAD_ZONE}, {TANH}]",
    "mixed_branches": f"[{DEAD_ZONE}, {BRANCHES}]",
}
SHIPPED = Path(__file__).resolve().parents[1] / "hystgen" / "compensator"


@functools.cache
def model(n: int, front: str, effects: str = "") -> Model:
    """The benchmark's model, alone or behind memoryless stages, with or without effects."""
    p = bench.model(n).parameters.model.pi
    text = (
        f"hystgen: 1\nname: bench\ninput_range: [-{bench.RANGE}, {bench.RANGE}]\nmodel:\n  pi:\n"
        f"    thresholds: {list(p.thresholds)}\n    weights: {list(p.weights)}\n"
    )
    return Model(parse_parameters(text + (f"  memoryless: {front}\n" if front else "") + effects, "bench.yaml"))


def means(folder: Path, n: int, kind: str, arithmetic: str, engine: str) -> dict[str, dict[str, float]]:
    """Mean instructions per sample on each core, for each operator."""
    one = model(n, DEAD_ZONE if kind.startswith("gpi") else "", GAIN if kind.endswith("effects") else "")
    files = sources.write(folder, one, emit_options(one, "both", arithmetic, engine))
    numbers, real = one.tables(arithmetic, engine), ARITHMETICS[arithmetic].number
    ends = numbers.limits.drive[0]
    drive = bench.multisine(bench.SAMPLES) * float(min(abs(ends[0]), ends[1]))
    drive = np.rint(drive) if real.kind == "i" else drive
    call = np.full(len(drive), slots.OP_STEP, dtype=np.uint8)
    wanted, _ = reference.answers(numbers, False, call, drive)
    signals: dict[str, Any] = {"forward": drive, "inverse": wanted.astype(float)}
    found: dict[str, dict[str, float]] = {op: {} for op in signals}
    for core in engines.CORES:
        target = targets.find(core)
        image = emulator.Image.load(_program(files, folder / core, core, "zig"))
        for op, x in signals.items():
            machine = emulator.Core(target, image)
            record = comparison.expected_record(numbers, real, op == "inverse", ("signal", call, x))
            outcome = comparison.compare(functools.partial(machine.run, "bench", op), [record])
            assert not outcome.different, (n, kind, arithmetic, engine, op, outcome)
            found[op][core] = float(machine.counts.mean())
    return found


def _program(files: sources.Sources, folder: Path, core: str, compiler: str) -> Path:
    entry = f"hystgen_harness_{files.operators[0]}"
    return cross.find(targets.find(core), compiler).image(files, folder, compilers.STRICT, cross.MemoryMap(), entry)


def code(folder: Path, kind: str, operator: str, arithmetic: str, engine: str) -> dict[str, int]:
    """Bytes of code in a module without its constant tables, on each core, the larger of both compilers' sizes."""
    one = model(CODE_PLAYS, FRONTS[kind])
    assert engines.kind(one.cascade, arithmetic) == kind
    options = emit_options(one, operator, arithmetic, engine)
    files = sources.write(folder, one, options)
    constants = module.of(one, options).cost.memory.tables
    found = {}
    for core in engines.CORES:
        built = [_program(files, folder / f"{core}-{compiler}", core, compiler) for compiler in ("zig", "gcc")]
        found[core] = max(emulator.Image.load(program).sections[".module"] for program in built) - constants
    return found


def main() -> None:
    """Measure everything and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=SHIPPED, help="folder of the tables, default the shipped")
    parser.add_argument("--only", choices=("costs", "sizes"), help="one of the tables")
    arguments = parser.parse_args()
    costs: list[tuple[Any, ...]] = []
    sizes: list[tuple[Any, ...]] = []
    with tempfile.TemporaryDirectory(prefix="hystgen-costs-") as place:
        for arithmetic, kind, n, engine in itertools.product(ARITHMETICS, KINDS, PLAYS, engines.ENGINES):
            if arguments.only != "sizes" and (n in EFFECT_PLAYS or not kind.endswith("effects")):
                found = means(Path(place) / f"{len(costs)}", n, kind, arithmetic, engine)
                costs += [(op, arithmetic, kind, n, engine, *map(round, cores.values())) for op, cores in found.items()]
                print(*costs[-1], flush=True)
        for arithmetic, kind in itertools.product(ARITHMETICS, FRONTS):
            told_apart = kind in ("pi", "dead_zone") or (kind == "dead_zone_branches") == (arithmetic in ("q31", "q15"))
            if arguments.only == "costs" or not told_apart:
                continue
            for operator, engine in itertools.product(OPERATORS, engines.ENGINES):
                found_code = code(Path(place) / f"code-{len(sizes)}", kind, operator, arithmetic, engine)
                sizes.append((operator, arithmetic, kind, engine, *found_code.values()))
                print(*sizes[-1], flush=True)
    about = ("operator", "arithmetic", "kind")
    for name, header, rows in (
        ("engine_costs.csv", (*about, "n", "engine"), costs),
        ("code_sizes.csv", (*about, "engine"), sizes),
    ):
        if rows:
            with (arguments.output / name).open("w", newline="", encoding="ascii") as file:
                writer = csv.writer(file, lineterminator="\n")
                writer.writerow((*header, *engines.CORES))
                writer.writerows(sorted(rows))


if __name__ == "__main__":
    main()
