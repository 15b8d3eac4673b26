"""Measure the most expensive sample of emitted models: its instructions, and the bytes of stack of the deepest call.

    python benchmarks/step_costs.py [-o FOLDER] [--jobs 2] [--parts elements]

Records and figures are those of `hystgen verify`: the largest over the builds of zig and gcc, on a Cortex-M0+ without
and a Cortex-M4F with an FPU. Rows `plays` are models of plays alone, rows `effects` the same with a gain, the cheapest
effect. Rows of memoryless parts, and of parts of the effects' code, have the instructions that the part adds to a model
of `CODE_PLAYS` plays, and the stack of the whole model. Parts that move or bend plays are also measured for one.
`hystgen.compensator.engines` reads `step_costs.csv` for the banner of emitted files. With `--parts`, only the rows of
these parts of the effects' code are measured, and the others stay as they are.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import csv
import itertools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import effect_costs
import engine_costs

import hystgen
from hystgen.arithmetic import ARITHMETICS
from hystgen.compensator import engines
from hystgen.compensator.chain.costs import OPERATORS, PER_PLAY
from hystgen.model import Model

PLAYS = (1, 4, 16, 64)
"""[plays] Factors of four, between which `engines.dearest` is linear: the loop engine costs the same for every play."""
FEW, MANY = 1, engine_costs.CODE_PLAYS
"""[plays] The smallest number, and the one for which code is measured; parts with a cost per play are run with both."""
SAMPLES = 300
"""[samples] Length of a record: with 1000, ten plays take at most 2 % more (float32 and q31, both cores)."""

Measured = dict[str, tuple[int, ...]]
"""By operator: instructions on each core, then bytes of stack on each."""
Row = tuple[Any, ...]


def worst(model: Model, arithmetic: str, engine: str, operator: str = "both") -> Measured:
    """The most expensive sample and the deepest call of each operator."""
    report = hystgen.verify(model, arithmetic, operator, engine, targets=list(engines.CORES), target_length=SAMPLES)
    assert report.ok, report.table()
    found = {}
    for op in ("forward", "inverse") if operator == "both" else (operator,):
        rows = [[row for row in report.rows if (row.operator, row.target) == (op, core)] for core in engines.CORES]
        found[op] = (
            *(max(row.max_instructions or 0 for row in of) for of in rows),
            *(max(row.stack or 0 for row in of) for of in rows),
        )
    return found


def beyond(found: Measured, base: Measured) -> Measured:
    """The instructions that a model takes beyond those of another model, and its own stack."""
    cores = len(engines.CORES)
    return {
        op: (*(a - b for a, b in zip(of[:cores], base[op][:cores], strict=True)), *of[cores:])
        for op, of in found.items()
    }


def measure(arithmetic: str, parts: frozenset[str] = frozenset()) -> list[Row]:
    """All rows of an arithmetic, or those of some parts of the effects' code."""
    rows: list[Row] = []

    def add(part: str, engine: str, n: int, found: Mapping[str, tuple[int, ...]]) -> None:
        for op, of in found.items():
            rows.append((part, arithmetic, engine, op, n, *of))
            print(*rows[-1], flush=True)

    bases: dict[tuple[str, str, int], Measured] = {}
    if parts:
        bases = {("effects", "loop", n): worst(engine_costs.model(n, "", engine_costs.GAIN), arithmetic, "loop")
                 for n in (FEW, MANY)}  # fmt: skip
    for engine in () if parts else engines.ENGINES:
        for part, effects in (("plays", ""), ("effects", engine_costs.GAIN)):
            for n in sorted({*PLAYS, MANY}):
                bases[part, engine, n] = worst(engine_costs.model(n, "", effects), arithmetic, engine)
                if n in PLAYS:
                    add(part, engine, n, bases[part, engine, n])
        for kind, front in engine_costs.FRONTS.items():
            model = engine_costs.model(MANY, front)
            if front and engines.kind(model.cascade, arithmetic) == kind:
                add(kind, engine, MANY, beyond(worst(model, arithmetic, engine), bases["plays", engine, MANY]))
    for part, n, found in _effects(arithmetic, bases, parts or frozenset(effect_costs.EFFECTS)):
        add(part, "loop", n, found)
    return rows


def _effects(
    arithmetic: str, bases: Mapping[tuple[str, str, int], Measured], parts: frozenset[str]
) -> Iterator[tuple[str, int, Measured]]:
    needed = parts | {effect_costs.BESIDE[part] for part in parts if part in effect_costs.BESIDE}
    needed |= {"lag", "slew"} if "braked" in parts else set()
    for n in (MANY, FEW):
        apart: dict[str, Measured] = {}
        for part in effect_costs.EFFECTS:
            if part == "gain" or part not in needed or (n == FEW and part not in PER_PLAY):
                continue
            operator = OPERATORS.get(part, "both")
            apart[part] = worst(effect_costs.model(part, n), arithmetic, "loop", operator)
        for part in [each for each in apart if each in parts]:
            found = apart[part]
            beside = effect_costs.BESIDE.get(part)
            base = apart[beside] if beside else bases["effects", "loop", n]
            more = beyond(found, base)
            if part == "braked":
                for one in ("lag", "slew"):
                    more = beyond(more, beyond(apart[one], base))
            yield part, n, more


def main() -> None:
    """Measure everything and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=engine_costs.SHIPPED, help="folder, default the shipped")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--parts", help="parts of the effects' code, separated by commas; default all rows")
    given = parser.parse_args()
    parts = frozenset(given.parts.split(",")) if given.parts else frozenset()
    with concurrent.futures.ProcessPoolExecutor(given.jobs) as pool:
        rows = [row for of in pool.map(measure, ARITHMETICS, itertools.repeat(parts)) for row in of]
    path = given.output / "step_costs.csv"
    if parts:
        with path.open(newline="", encoding="ascii") as file:
            kept = [row for row in list(csv.reader(file))[1:] if row[0] not in parts]
        rows += [(*row[:4], int(row[4]), *row[5:]) for row in kept]
    with path.open("w", newline="", encoding="ascii") as file:
        writer = csv.writer(file, lineterminator="\n")
        stacks = (f"{core} stack" for core in engines.CORES)
        writer.writerow(("part", "arithmetic", "engine", "operator", "n", *engines.CORES, *stacks))
        writer.writerows(sorted(rows))


if __name__ == "__main__":
    main()
