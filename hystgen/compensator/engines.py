"""The engine of a model and its code size, from tables measured on emulated cores.

`benchmarks/engine_costs.py` makes two tables: `engine_costs.csv`, instructions per sample averaged over a decaying
multisine, and `code_sizes.csv`, bytes of code per module, the larger figure of two compilers. The code that effects add
is in `effect_sizes.csv`, made by `benchmarks/effect_costs.py`; the most expensive sample and its stack are in
`step_costs.csv`, made by `benchmarks/step_costs.py`.
"""

from __future__ import annotations

import csv
import functools
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from hystgen.arithmetic import ARITHMETICS
from hystgen.chain.static import StaticModel
from hystgen.front.tanh.model import TanhEnvelope

ENGINES = ("corners", "loop")
OPTIMIZE = ("auto", "speed", "size")
CORES = ("cortex-m0plus", "cortex-m4f")
SMALL, FLASH, CYCLES = "cortex-m0plus", 32768, 4800
"""The controller that `auto` optimizes for: a core, its bytes of flash, and cycles per sample (48 MHz at 10 kHz)."""


def choose(
    engine: str, optimize: str, cascade: StaticModel, operator: str, arithmetic: str, effects: bool = False,
    loads: bool = False,
) -> str:
    """The engine that `auto` stands for; an explicit choice is kept, but a model without plays always gets `loop`.
    `effects`: whether the model has any; effects must not move or bend plays. `loads`: whether the C loads its
    parameters at run time.

    `optimize` speed: fewer instructions, as a geometric mean over both cores; size: less code on both cores; auto: the
    smaller sum of the fractions of a small controller's flash and time, which breaks even at `FLASH / CYCLES`, 6.8
    bytes of code per instruction and sample. Instructions of both operators add up. With effects in fixed point only
    `speed` can select `corners`, whose search takes up to 136 bytes of stack in a chain: an interrupt handler is
    promised 128. The same holds for an inverse that loads its parameters, which only `loop` can exchange while it runs.
    Raises ValueError for any other value.
    """
    for what, value, known in (("engine", engine, ("auto", *ENGINES)), ("optimize", optimize, OPTIMIZE)):
        if value not in known:
            raise ValueError(f"{what} {value!r} is not one of {', '.join(known)}")
    if cascade.pi.n == 0:
        return "loop"
    if engine != "auto":
        return engine
    exchanges = loads and operator != "forward"
    if optimize != "speed" and (exchanges or (effects and ARITHMETICS[arithmetic].fixed)):
        return "loop"
    costs = {each: _cost(each, optimize, cascade, operator, arithmetic, effects) for each in ENGINES}
    return "corners" if costs["corners"] < costs["loop"] else "loop"


def code_bytes(cascade: StaticModel, operator: str, arithmetic: str, engine: str) -> Mapping[str, int]:
    """Bytes of code at -O2 on each of `CORES`, as measured for a model of the same kind."""
    return _code_sizes()[operator, arithmetic, kind(cascade, arithmetic), engine]


def kind(cascade: StaticModel, arithmetic: str) -> str:
    """The properties of a model on which its code depends: the memoryless stages (in fixed point only whether there are
    any) and the branches."""
    if not cascade.stages:
        return "pi"
    tanh = [isinstance(stage, TanhEnvelope) for stage in cascade.stages]
    front = "dead_zone" if ARITHMETICS[arithmetic].one_curve or not any(tanh) else "tanh" if all(tanh) else "mixed"
    return f"{front}_branches" if cascade.branches_differ else front


class Dearest(NamedTuple):
    """The most expensive sample: its instructions, and the stack of the deepest call in bytes."""

    instructions: int
    stack: int


def dearest(
    cascade: StaticModel, operator: str, arithmetic: str, engine: str, parts: Iterable[str] | None = None
) -> dict[str, Dearest]:
    """The most expensive sample of an operator on each of `CORES`, estimated from measured models: the cost of its
    plays plus that of its memoryless part and each of the effects' `parts`, and the largest stack among them. `parts`:
    None without effects."""
    front = kind(cascade, arithmetic)
    more = [] if front == "pi" else [(front, engine)]
    more += [(part, "loop") for part in parts or () if (part, arithmetic, "loop", operator) in _steps()]
    found = {}
    for core in CORES:
        base, *others = (
            _between(_steps()[part, arithmetic, which, operator], cascade.pi.n, core)
            for part, which in [("plays" if parts is None else "effects", engine), *more]
        )
        instructions = base.instructions + sum(each.instructions for each in others)
        found[core] = Dearest(instructions, max(base.stack, *(each.stack for each in others), 0))
    return found


def _between(measured: Mapping[int, Mapping[str, str]], n: int, core: str) -> Dearest:
    """The figures for `n` plays, interpolated linearly between the nearest rows, or those of the only row."""
    rows = sorted(measured)
    above = next((at for at in rows[1:] if at >= n), rows[-1])
    below = rows[max(rows.index(above) - 1, 0)]
    low, high = (Dearest(int(row[core]), int(row[f"{core} stack"])) for row in (measured[below], measured[above]))
    share = (n - below) / (above - below) if above > below else 0.0
    instructions = round(low.instructions + share * (high.instructions - low.instructions))
    return Dearest(instructions, max(low.stack, high.stack))


def effect_bytes(arithmetic: str, engine: str) -> Mapping[str, int]:
    """Bytes of code that having any effect at all adds to an operator."""
    return effect_sizes()["any" if engine == "loop" else "any_corners", arithmetic]


def _cost(engine: str, optimize: str, cascade: StaticModel, operator: str, arithmetic: str, effects: bool) -> float:
    operators = ("forward", "inverse") if operator == "both" else (operator,)
    code = dict(code_bytes(cascade, operator, arithmetic, engine))
    if effects:  # each individual effect adds the same with both engines
        more = effect_bytes(arithmetic, engine)
        code = {core: size + len(operators) * more[core] for core, size in code.items()}
    if optimize == "size":
        return sum(code.values())
    kind = "gpi" if cascade.stages else "pi"
    if effects:
        kind = "gpi_effects" if cascade.stages else "effects"
    instructions = dict.fromkeys(CORES, 0.0)
    for one in operators:
        measured = _instructions()[one, arithmetic, kind, engine]
        costs = measured[max(plays for plays in measured if plays <= cascade.pi.n)]
        instructions = {core: instructions[core] + float(costs[core]) for core in CORES}
    if optimize == "speed":
        return math.prod(instructions.values())
    return code[SMALL] / FLASH + instructions[SMALL] / CYCLES


@functools.cache
def _instructions() -> dict[tuple[str, str, str, str], dict[int, dict[str, str]]]:
    """Rows of instructions per sample by number of plays, for each operator, arithmetic, kind and engine."""
    found: dict[tuple[str, str, str, str], dict[int, dict[str, str]]] = {}
    for row in _rows("engine_costs.csv"):
        about = (row["operator"], row["arithmetic"], row["kind"], row["engine"])
        found.setdefault(about, {})[int(row["n"])] = row
    return found


@functools.cache
def effect_sizes() -> dict[tuple[str, str], dict[str, int]]:
    """Bytes of code that each part of a model with effects adds on each core, for each arithmetic."""
    return {
        (row["part"], row["arithmetic"]): {core: int(row[core]) for core in CORES}
        for row in _rows("effect_sizes.csv")
    }


@functools.cache
def _code_sizes() -> dict[tuple[str, str, str, str], dict[str, int]]:
    return {
        (row["operator"], row["arithmetic"], row["kind"], row["engine"]): {core: int(row[core]) for core in CORES}
        for row in _rows("code_sizes.csv")
    }


@functools.cache
def _steps() -> dict[tuple[str, str, str, str], dict[int, dict[str, str]]]:
    """Rows of the most expensive sample by number of plays, for each part, arithmetic, engine and operator."""
    found: dict[tuple[str, str, str, str], dict[int, dict[str, str]]] = {}
    for row in _rows("step_costs.csv"):
        about = (row["part"], row["arithmetic"], row["engine"], row["operator"])
        found.setdefault(about, {})[int(row["n"])] = row
    return found


def _rows(name: str) -> list[dict[str, str]]:
    with (Path(__file__).parent / name).open(encoding="ascii", newline="") as file:
        return list(csv.DictReader(file))
