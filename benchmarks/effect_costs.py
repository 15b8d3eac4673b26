"""Measure what each effect adds to an emitted model: bytes of code, and instructions per sample.

    python benchmarks/effect_costs.py [-o FOLDER] [--cores cortex-m0plus,cortex-m4f] [--parts elements]

Code is a module's size at -O2, the larger of zig and gcc (RISC-V: zig only); instructions are the mean over a slow sine
in a strict -O2 build of zig, for the inverse, or for the forward operator if only it has the part. `any` is the cost of
having any effect, measured with a gain, the cheapest one (`any_corners`: code with the corner engine); the other rows
have the difference from that, which may be negative. Plays whose input is searched for have `dilated` in common, and
their rows have the cost beyond it; `braked` is the cost of a lag and a slew limit together beyond their sum, `quiet`
its cost beyond a lag. `effect_sizes.csv`, from which the banner of emitted files takes its figures, has the code on the
cores of `hystgen.compensator.engines`; `docs/effects.csv` has all cores. With `--parts`, only these rows are measured;
the others stay.
"""

from __future__ import annotations

import argparse
import csv
import functools
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from engine_costs import CODE_PLAYS, SHIPPED, _program

from hystgen.arithmetic import ARITHMETICS
from hystgen.compensator import engines
from hystgen.compensator.chain.costs import OPERATORS, PARTS
from hystgen.emission import module
from hystgen.emission.calls import emit_options
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.verification import comparison, emulator, sources, targets

MOVED = ("dashpot", "polynomial", "centre", "elements")
INSIDE = {"quiet": "lag", "friction": "heat"}
"""Parts of the code that occur only together with another part."""
BESIDE = dict.fromkeys(MOVED, "dilated") | INSIDE
"""The model that has all but the part, if it is not that of a gain."""
DOCS = Path(__file__).resolve().parents[1] / "docs"
EFFECTS = {
    "creep": "name: creep, time_constants: [0.01, 0.03, 0.1, 0.3, 1, 3], "
    "weights: [0.01, 0.01, 0.01, 0.01, 0.01, 0.01]",
    "lag": "name: lag, time_constant: 0.01",
    "lag_exact": "name: lag, time_constant: 2.0e-4",
    "ageing": "name: ageing, loss: 0.02, travel: 50",
    "heat": "name: thermal, source: self_heating, time_constant: 60, heating: 1.0e-5, gain_per_degree: 0.001",
    "friction": "name: thermal, source: hysteresis, time_constant: 60, heating: 1.0e-5, reach: 5, "
    "gain_per_degree: 0.001",
    "gain": "name: thermal, gain_per_degree: 0.001",
    "clock": "name: drift, rate: 1.0e-3",
    "preview": "name: resonance, frequency: 30, damping: 0.05",
    "slew": "name: slew_limit, rate: 1.0e+5",
    "braked": "name: lag, time_constant: 0.01}\n    - {name: slew_limit, rate: 1.0e+5",
    "tanh": "name: saturation, level: 1000",
    "dead_zone": "name: saturation, shape: stops, lower: -900, upper: 900, give: 0.1",
    "relaxing": "name: rate_dependence, shape: relaxation, time_constant: 5.0e-3",
    "dilated": "name: rate_dependence, betas: [1.0e-4, OTHERS]",
    "dashpot": "name: rate_dependence, shape: relaxation, time_constant: 5.0e-3, exponent: 2",
    "polynomial": "name: noncongruent, coefficients: [[0.02, 0.01], OTHERS]",
    "centre": "name: noncongruent, shape: centre, amplitude: 0.4, centre: 1, width: 2",
    "mode": "name: resonance, frequency: 30, damping: 0.05",
    "delay": "name: delay, time: 2.6e-3",
    "quiet": "name: lag, time_constant: 0.01",
    "elements": "name: bouc_wen, weights: [-0.1, 0.1], widths: [2, 0.7], exponent: 1.6, balance: 1.3",
}
"""A model with one effect for each part that `hystgen.compensator.chain.costs` counts."""
OTHERS = {"dilated": "0", "polynomial": "[0.02]"}
"""The value to be repeated for each play but the first."""
assert {"any", *EFFECTS} == set(PARTS)


@functools.cache
def model(effect: str, plays: int = CODE_PLAYS) -> Model:
    """A model of `plays` plays with one effect, or with none."""
    text = "hystgen: 1\nname: bench\ninput_range: [-10, 10]\nsample_time: 1.0e-3\nmodel:\n  pi:\n"
    text += f"    thresholds: {[0.45 * k for k in range(plays + 1)]}\n    weights: {[0.7] + [0.05] * plays}\n"
    if effect:
        others = "".join(f", {OTHERS.get(effect)}" for _ in range(plays - 1))
        text += f"  effects:\n    - {{{EFFECTS[effect].replace(', OTHERS', others)}}}\n"
    how = f"compensate: [drift, self_heating], quiet: {str(effect == 'quiet').lower()}, noise_gain: 1.0e+9"
    text += f"emit: {{compensation: {{{how}}}}}\n"
    return Model(parse_parameters(text, "bench.yaml"))


Measures = tuple[dict[str, int], dict[str, float]]


def measured(
    folder: Path, effect: str, arithmetic: str, cores: list[str], operator: str = "inverse", engine: str = "loop"
) -> Measures:
    """Bytes of code and mean instructions per sample of an operator on each core."""
    one = model(effect)
    options = emit_options(one, operator, arithmetic, engine)
    files = sources.write(folder, one, options)
    constants = module.of(one, options).cost.memory.tables
    numbers, real = one.tables(arithmetic, engine), ARITHMETICS[arithmetic].number
    low, high = map(float, numbers.limits.output[0] if operator == "inverse" else numbers.limits.drive[0])
    u = 0.5 * (low + high) + 0.4 * (high - low) * np.sin(0.01 * np.arange(600))
    record = comparison.expected_record(numbers, real, operator == "inverse", ("sine", np.zeros(len(u), np.uint8), u))
    code, counts = {}, {}
    for core in cores:
        names = ("zig",) if core.startswith("rv32") else ("zig", "gcc")
        built = {name: _program(files, folder / f"{core}-{name}", core, name) for name in names}
        images = {name: emulator.Image.load(path) for name, path in built.items()}
        code[core] = max(image.sections[".module"] for image in images.values()) - constants
        machine = emulator.Core(targets.find(core), images["zig"])
        outcome = comparison.compare(functools.partial(machine.run, "bench", operator), [record])
        assert not outcome.different, (effect, arithmetic, core, outcome)
        counts[core] = float(np.mean(machine.counts))
    return code, counts


def together(apart: list[Measures], least: Measures) -> Measures:
    """The cost of a model with several effects if each added as much as it does alone."""

    def added(of: Sequence[dict[str, Any]], base: dict[str, Any]) -> dict[str, Any]:
        return {core: sum(each[core] for each in of) - (len(of) - 1) * base[core] for core in base}

    code, counts = zip(*apart, strict=True)
    return added(code, least[0]), added(counts, least[1])


def main() -> None:
    """Measure everything and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, help="folder of both tables, default where they are shipped")
    parser.add_argument("--cores", default=",".join(engines.CORES))
    parser.add_argument("--parts", help="rows to measure, separated by commas; default all")
    given = parser.parse_args()
    cores = given.cores.split(",")
    parts = set(given.parts.split(",")) if given.parts else {"any_corners", *PARTS}
    sizes, costs = [], []
    with tempfile.TemporaryDirectory(prefix="hystgen-effects-") as place:
        for arithmetic in ARITHMETICS:

            @functools.cache
            def alone(effect: str, operator: str = "inverse", engine: str = "loop", of: str = arithmetic) -> Measures:
                return measured(Path(place) / f"{effect}-{operator}-{engine}-{of}", effect, of, cores, operator, engine)

            if "any_corners" in parts:
                (bare, _), (with_corners, _) = (alone(effect, engine="corners") for effect in ("", "gain"))
                sizes.append(("any_corners", arithmetic, *(with_corners[core] - bare[core] for core in cores)))
            for effect in ("any", *EFFECTS):
                if effect not in parts:
                    continue
                operator = OPERATORS.get(effect, "inverse")
                code, counts = alone("gain" if effect == "any" else effect, operator)
                before = alone("" if effect == "any" else BESIDE.get(effect, "gain"), operator)
                if effect == "braked":
                    before = together([alone("lag"), alone("slew")], alone("gain"))
                more = [(core, code[core] - before[0][core], counts[core] - before[1][core]) for core in cores]
                sizes.append((effect, arithmetic, *(size for _, size, _ in more)))
                costs += [(effect, arithmetic, core, size, round(count)) for core, size, count in more]
                print(*sizes[-1], *(round(count) for *_, count in more), flush=True)
    own, docs = (given.output or SHIPPED), (given.output or DOCS)
    if set(cores) >= set(engines.CORES):
        shipped = [0, 1, *(2 + cores.index(core) for core in engines.CORES)]
        heads = ("part", "arithmetic", *engines.CORES)
        write(own / "effect_sizes.csv", heads, [[row[k] for k in shipped] for row in sizes], 2, bool(given.parts))
    heads = ("part", "arithmetic", "core", "bytes of code", "instructions of a sample")
    write(docs / "effects.csv", heads, costs, 3, bool(given.parts))


def write(path: Path, heads: Sequence[str], rows: Sequence[Sequence[object]], keys: int, keep: bool) -> None:
    """Write a table. `keep`: replace the rows of an existing one that have the same first `keys` entries, and add the
    others behind the last row of their arithmetic."""
    made = [[str(entry) for entry in row] for row in rows]
    if keep:
        with path.open(encoding="ascii", newline="") as file:
            table = list(csv.reader(file))[1:]
        for row in made:
            same = [k for k, old in enumerate(table) if old[:keys] == row[:keys]]
            last = max(k for k, old in enumerate(table) if old[1] == row[1])
            table[slice(same[0], same[0] + 1) if same else slice(last + 1, last + 1)] = [row]
        made = table
    with path.open("w", encoding="ascii", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([heads, *made])


if __name__ == "__main__":
    main()
