"""Search for errors of random models with effects in every arithmetic, and compare them with the stated bounds.

    python benchmarks/bounds.py [--seeds 0:3] [--arithmetic float32,q15] [--effects creep,viscous] [--tries 40]

For each effect and seed, a search looks for the largest error of either operator. Its drives consist of sweeps, holds,
jumps, noise, and shaking at the largest step for which the bounds hold; later it varies the end of the worst drive so
far. The inverse gets the model's output for such a drive as its reference. Exact answers come from the double model,
`model.simulate` forwards and `hystgen.compensator.chained` backwards, which share no tables with the C except for the
verbs of lag and creep. Where a bound compares compensators that have seen the same drives, exact answers come from the
double-precision tables, to which the drives sent are committed. A line for each operator gives the median and the
largest ratio of bound to error, and the number of exceeded bounds, which must be 0.

A search may miss the largest error, so a ratio is only an upper limit of a bound's slack.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import FormatError, NotInvertibleError
from hystgen.compensator import reference
from hystgen.compensator.chain import bounds, tables
from hystgen.compensator.chain.layout import Compiled, output_range
from hystgen.compensator.chain.run import answers
from hystgen.compensator.chained import Compensator
from hystgen.effects import Run
from hystgen.effects.plays import PLAIN
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.plays import slots

Array = NDArray[np.float64]
Generator = np.random.Generator

T, LENGTH = 1e-3, 600
"""[s, samples] Sample time and length of a record. The time constants below are chosen in samples, so the sample time
only sets their unit. Errors that add up come closer to their bounds in longer records: random models reach 1/44 of a
dashpot's forward bound in 600 samples, and one of them, shaken, reaches a quarter in 1e5."""

RELAXING = "name: rate_dependence, shape: relaxation, time_constant"
CENTRE = "name: noncongruent, shape: centre, centre: 1, width: 2, amplitude"
EFFECTS: dict[str, Callable[[Generator], str]] = {
    "creep": lambda rng: f"name: creep, time_constants: [{_log(rng, -2, 0)}, {_log(rng, 0, 2)}], weights: [0.03, 0.05]",
    "lag": lambda rng: f"name: lag, time_constant: {_log(rng, -3, -1.5)}",
    "quick lag": lambda rng: f"name: lag, time_constant: {_log(rng, -4, -3.31)}",
    "viscous": lambda rng: f"{RELAXING}: {_log(rng, -3.3, -1)}",
    "dashpot": lambda rng: f"{RELAXING}: {_log(rng, -3, -1)}, exponent: {rng.uniform(1.2, 3.0):.3g}",
    "soft dashpot": lambda rng: f"{RELAXING}: {_log(rng, -3, -2)}, exponent: {rng.uniform(0.4, 0.9):.3g}",
    "centre": lambda rng: f"{CENTRE}: {rng.uniform(-0.3, 0.5):.3g}",
    "saturation": lambda rng: f"name: saturation, level: {_log(rng, 1.1, 1.6)}, centre: {rng.uniform(-3.0, 3.0):.3g}",
    "thermal": lambda rng: f"name: thermal, gain_per_degree: {rng.uniform(-4e-3, 4e-3):.3g}, offset_per_degree: 0.01",
    "ageing": lambda rng: f"name: ageing, loss: 0.02, travel: {_log(rng, 1, 2)}",
    "slew limit": lambda rng: f"name: slew_limit, rate: {_log(rng, 2.2, 3.2)}",
}


def _log(rng: Generator, low: float, high: float) -> str:
    return f"{10.0 ** rng.uniform(low, high):.4g}"


def drawn(name: str, seed: int) -> Model:
    """A random model of plays with an effect; about half of all models have a memoryless part in front."""
    rng = np.random.default_rng([seed, sum(map(ord, name))])
    n = int(rng.integers(3, 9))
    thresholds = np.append(0.0, np.cumsum(rng.uniform(0.1, 0.6, n))).round(3).tolist()
    weights = np.append(rng.uniform(0.3, 1.0), 10.0 ** rng.uniform(-1.5, -0.2, n)).round(3).tolist()
    front = "  memoryless: {kind: tanh, ascending: {a0: 6, a1: 0.25, a2: 0.1, a3: 0.2}}\n" if rng.random() < 0.5 else ""
    text = (
        f"hystgen: 1\nname: drawn\nunits: {{input: V, output: um}}\ninput_range: [-4.0, 4.0]\nmodel:\n"
        f"  pi:\n    thresholds: {thresholds}\n    weights: {weights}\n{front}  output_offset: 0.5\n"
        f"  effects:\n    - {{{EFFECTS[name](rng)}}}\nsample_time: {T}\n"
        "emit: {compensation: {noise_gain: 1.0e+9}}\n"
    )
    return Model(parse_parameters(text, "drawn.yaml"))


def part(rng: Generator, step: float, low: float, high: float, begin: float) -> list[float]:
    """A stretch of a drive, starting from `begin`, that moves by at most `step` per sample."""
    n, rate = int(rng.integers(2, 100)), step * float(rng.choice([1.0, rng.random()]))
    k = np.arange(n)
    moves = (
        np.full(n, rate * rng.choice([-1.0, 1.0])),
        step * rng.choice([-1.0, 1.0]) * (1.0 - 2.0 * (k % 2)) + step * rng.uniform(-0.06, 0.06),
        rng.uniform(-rate, rate, n),
        np.zeros(n),
        np.repeat(rng.choice([-1.0, 1.0], n), int(rng.integers(1, 9)))[:n] * rate,
    )[int(rng.integers(5))]
    found = []
    for move in np.clip(moves, -step, step).tolist():
        begin = min(max(begin + move, low), high)
        found.append(begin)
    return found


def grown(rng: Generator, step: float, low: float, high: float, begin: Sequence[float]) -> Array:
    """A random drive of LENGTH samples that starts with `begin`."""
    v = list(begin) or [float(rng.uniform(low, high))]
    while len(v) < LENGTH:
        v += part(rng, step, low, high, v[-1])
    return np.array(v[:LENGTH])


class Measured:
    """A model in one arithmetic, its bounds in physical units, and the errors of either operator for a drive."""

    def __init__(self, model: Model, arithmetic: str) -> None:
        self.model, self.compiled = model, tables.build(model.chain, arithmetic, T)
        codes = self.compiled.codes
        self.t = np.arange(LENGTH) * T
        if codes is None:
            self.drive = self.output = 1.0
            found = bounds.chain_bounds(self.compiled, arithmetic)
            self.bounds = found.forward, found.rounding
            self.same = bool(bounds.condition(self.compiled))
        else:
            self.drive, self.output = float(codes.drive_lsb), float(codes.output_lsb)
            self.bounds = codes.forward_error * self.output, codes.inverse_rounding * self.drive
            self.same = bool(codes.condition)
        self.double = tables.build(model.chain, "float64", T)

    def given(self, x: Array, unit: float) -> Array:
        """The arithmetic's numbers nearest to x."""
        return np.rint(x / unit) if self.compiled.codes else np.float32(x).astype(float)

    def _extra(self, one: Compiled) -> dict[str, Array]:
        """A temperature in half degrees, exact in every arithmetic."""
        if "set_temperature" not in one.tables.calls:
            return {}
        return {"temperature": 20.0 + 0.5 * np.round(4.0 * np.sin(30.0 * self.t))}

    def forward(self, v: Array) -> float:
        """Error of the forward operator, output units."""
        given = self.given(v, self.drive)
        extra = self._extra(self.compiled)
        found = answers(self.compiled, Run(self.t, given, extra), False).astype(float) * self.output
        exact = self.model.simulate(given * self.drive, t=self.t, extra=extra)
        if self.compiled.codes is not None:  # a gain may take the output out of the range of codes
            most = float(self.compiled.tables.limits.code_max[0]) * self.output
            exact = np.clip(exact, -most, most)
        return float(np.max(np.abs(found - exact)))

    def inverse(self, v: Array) -> float:
        """Error of the inverse in drive units, for the model's output with this drive as the reference."""
        extra = self._extra(self.compiled)
        moves = self.compiled.tables.moving.moves != PLAIN
        low, high = output_range(self.compiled.static, self.compiled.parts, T)
        y = self.model.simulate(v, t=self.t, extra=extra)
        y = np.clip(y, low, high) if moves else y + 0.01 * (y - 0.5 * (low + high))  # some are out of reach
        u = self.given(y, self.output)
        if self.compiled.codes is not None:
            most = float(self.compiled.tables.limits.code_max[0])
            u = np.clip(u, -most, most)
        sent = answers(self.compiled, Run(self.t, u, extra), True).astype(float) * self.drive
        ends = tuple(float(end) * self.drive for end in self.compiled.tables.limits.drive[0])
        reached = np.clip(u * self.output, low, high)
        if self.same:
            op = np.tile(np.array([slots.OP_STEP, slots.OP_COMMIT], dtype=np.uint8), LENGTH)
            wanted, _ = reference.answers(self.double.tables, True, op, np.column_stack([reached, sent]).ravel())
            exact = np.clip(wanted[::2], *ends)
        elif moves:
            exact = v  # the model's own drive; rounding of the reference adds little to the error
        else:
            exact = Compensator(self.model.chain).drives(Run(self.t, reached, extra), ends)  # type: ignore[arg-type]
        return float(np.max(np.abs(sent - exact)))


def searched(one: Measured, error: Callable[[Array], float], rng: Generator, tries: int) -> float:
    """The largest error that a search finds."""
    low, high = one.model.cascade.input_range
    step = 0.999 * one.compiled.largest_step
    best, worst = np.empty(0), 0.0
    for k in range(tries):
        kept = best[: int(rng.integers(1, LENGTH))] if k >= tries // 3 else ()
        v = one.given(grown(rng, step, low, high, list(kept)), one.drive) * one.drive
        if (found := error(v)) > worst:
            best, worst = v, found
    return worst


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="0:3", help="first and last of the models of each effect, as 0:3")
    parser.add_argument("--arithmetic", default="float32,q15")
    parser.add_argument("--effects", default=",".join(EFFECTS))
    parser.add_argument("--tries", type=int, default=40, help="drives that a search tries")
    asked = parser.parse_args()
    first, last = map(int, asked.seeds.split(":"))
    print(f"{'effect':<13} {'arithmetic':<10} {'operator':<8} models  over  bound/error: median, largest")
    for name in asked.effects.split(","):
        for arithmetic in asked.arithmetic.split(","):
            ratios: dict[str, list[float]] = {"forward": [], "inverse": []}
            for seed in range(first, last):
                try:
                    one = Measured(drawn(name, seed), arithmetic)
                except (FormatError, NotInvertibleError):
                    continue
                for (operator, found), bound in zip(ratios.items(), one.bounds, strict=True):
                    error: Any = getattr(one, operator)
                    worst = searched(one, error, np.random.default_rng(seed), asked.tries)
                    found.append(bound / worst if worst else math.inf)
            for operator, found in ratios.items():
                if found:
                    over = sum(ratio < 1.0 for ratio in found)
                    least = f"{np.median(found):8.3g} {max(found):8.3g}"
                    print(f"{name:<13} {arithmetic:<10} {operator:<8} {len(found):6} {over:5}  {least}", flush=True)


if __name__ == "__main__":
    main()
