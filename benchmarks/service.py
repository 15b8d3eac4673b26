"""Blind units in service for `hystgen monitor`: false alarms of healthy ones, and detections by size of change.

The plants share no code and no form with the package: relays drawn at random (two-position switches with a reversible
part beside them), or Bouc and Wen's differential equation; creep, load, ageing and sensors have equations of their own.
A unit is identified once, from a record of nested loops, by the package; its sessions are then driven by the package's
inverse of that model. Sessions differ in reference, amplitude, length, noise and start memory; the sensor's noise is
coloured and drifts. Half the units repeat one or two references, half never do.

    python -m benchmarks.service healthy --seeds 0:300 -o build/service/healthy.csv
    python -m benchmarks.service changes --seeds 1000:1012 -o docs/service.csv
    python -m benchmarks.service figure --source docs/service.csv -o docs/service.svg
"""

from __future__ import annotations

import argparse
import csv
import functools
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import hystgen
from hystgen.records import Record
from hystgen.service import change

Array = NDArray[np.float64]

FULL = 100.0
"""[V] Drive range, from 0."""

STROKE = 20.0
"""[um] Motion over the whole range, about."""

CHANGES = ("gain", "creep", "load", "ageing", "cracked", "sensor")
SIZES = (0.01, 0.02, 0.05, 0.1)
COUNTS = (1, 3, 6)
"""Sessions after the change, behind `BEFORE` earlier ones."""

BEFORE = 6


@dataclass
class Relays:
    """Switches that close at `up` and open at `down` (M,), of heights `height`, and a reversible part."""

    up: Array
    down: Array
    height: Array
    slope: float
    stiffening: float
    state: Array = field(default_factory=lambda: np.empty(0))

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Relays:
        """A unit."""
        centre = rng.normal(rng.uniform(35.0, 65.0), rng.uniform(22.0, 45.0), 3000)
        half = rng.exponential(rng.uniform(8.0, 20.0), 3000)
        height = np.full(3000, rng.uniform(0.35, 0.55) * STROKE / 3000)
        slope = rng.uniform(0.5, 0.65) * STROKE / FULL
        return cls(centre + half, centre - half, height, slope, rng.uniform(0.0, 0.06))

    def run(self, v: Array) -> Array:
        """The motion (N,), um."""
        state = np.zeros(len(self.up)) if not len(self.state) else self.state
        y = np.empty(len(v))
        for k, x in enumerate(v):
            state[self.up <= x] = 1.0
            state[self.down >= x] = 0.0
            y[k] = self.height @ state
        self.state = state
        w = v / FULL
        return np.asarray(y + self.slope * v * (1.0 + self.stiffening * w * w))

    def cracked(self, part: float) -> Relays:
        """With a share of all relays gone, the narrow ones first: a crack opens a part of the stack."""
        height = self.height.copy()
        height[np.argsort(self.up - self.down)[: int(2.0 * part * len(height))]] = 0.0
        return replace(self, height=height, slope=self.slope * (1.0 - 0.5 * part), state=np.empty(0))


@dataclass
class BoucWen:
    """Bouc and Wen's equation, `z' = v' (a - (b sign(v' z) + c) |z|^n)`, whose z is taken from a straight line."""

    a: float
    b: float
    c: float
    n: float
    slope: float
    weight: float
    z: float = 0.0
    last: float = 0.0

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> BoucWen:
        """A unit."""
        return cls(
            1.0, rng.uniform(0.02, 0.05), rng.uniform(-0.01, 0.01), rng.uniform(1.0, 1.4),
            rng.uniform(0.7, 0.8) * STROKE / FULL, rng.uniform(0.05, 0.09),
        )

    def run(self, v: Array) -> Array:
        """The motion (N,), um."""
        y, z, last = np.empty(len(v)), self.z, self.last
        for k, x in enumerate(v):
            for _ in range(4):
                move = 0.25 * (x - last)
                z += move * self.a - move * self.c * abs(z) ** self.n - abs(move) * self.b * abs(z) ** (self.n - 1) * z
            y[k], last = self.weight * z, x
        self.z, self.last = z, last
        return np.asarray(self.slope * v - y)

    def cracked(self, part: float) -> BoucWen:
        """With a smaller hysteretic part and a softer spring."""
        return replace(self, weight=self.weight * (1.0 - 2.0 * part), slope=self.slope * (1.0 - 0.5 * part))


Plant = Relays | BoucWen


def creeping(y: Array, step: float, size: float) -> Array:
    """The motion with creep: two viscous elements follow it, each with half of `size`."""
    found = y.copy()
    for tau in (0.15, 1.5):
        share, state = 1.0 - np.exp(-step / tau), y[0]
        for k in range(len(y)):
            state += share * (y[k] - state)
            found[k] += 0.5 * size * (state - y[0])
    return found


def coloured(rng: np.random.Generator, number: int, size: float) -> Array:
    """Noise of a sensor: a white part, one with a memory of about ten samples, and a random walk; total rms `size`."""
    white = rng.standard_normal((3, number))
    memory = np.empty(number)
    state = 0.0
    for k in range(number):
        state = 0.9 * state + white[1, k]
        memory[k] = state
    walk = np.cumsum(white[2]) / np.sqrt(number)
    parts = white[0], memory * np.sqrt(1.0 - 0.81), walk
    return np.asarray(size * (0.6 * parts[0] + 0.7 * parts[1] + 0.5 * (parts[2] - parts[2].mean())))


Use = Callable[[float], tuple[Array, float]]
"""The reference (um, if the unit reached all of `STROKE`) and the sample time (s) for an amplitude."""


def references(rng: np.random.Generator) -> Use:
    """A use of the unit: for an amplitude (fraction of the stroke), the reference and the sample time."""
    kind = rng.integers(0, 4)
    number = int(rng.integers(700, 2200))
    step = float(rng.choice([1e-3, 2e-3, 5e-3]))
    middle, periods = rng.uniform(0.45, 0.55), rng.integers(3, 9)
    phases, levels = rng.uniform(0.0, 2.0 * np.pi, 4), rng.uniform(-1.0, 1.0, 14)

    def made(amplitude: float) -> tuple[Array, float]:
        x = np.arange(number) / number
        if kind == 0:  # a scan
            wave = 2.0 * np.abs(2.0 * (x * periods % 1.0) - 1.0) - 1.0
        elif kind == 1:
            wave = sum(np.sin(2.0 * np.pi * (periods + 2 * j) * x + phases[j]) for j in range(4)) / 2.6
        elif kind == 2:  # moves and holds
            ends = np.interp(x * 13.0, np.arange(14) + np.where(np.arange(14) % 2, 0.0, 0.6), levels[:14])
            wave = ends
        else:
            wave = np.sin(2.0 * np.pi * periods * x) * (1.0 - 0.6 * x)
        return STROKE * np.clip(middle + 0.45 * amplitude * np.asarray(wave), 0.02, 0.98), step

    return made


def identified(rng: np.random.Generator, plant: Plant) -> hystgen.Model:
    """The model of a new unit, from one record of nested loops and one of random moves that is held out."""
    x = np.arange(2400) / 2400.0
    nested = 50.0 + 50.0 * np.sin(2.0 * np.pi * 6.0 * x) * np.where(x < 0.2, 1.0, 1.0 - 0.9 * (x - 0.2) / 0.8)
    corners = rng.uniform(0.0, FULL, 16)
    corners[:2] = 0.0, FULL
    walk = np.interp(np.arange(1500) / 100.0, np.arange(16), corners)
    found = []
    for v in (nested, walk):
        y = plant.run(v)
        found.append({"t": 2e-3 * np.arange(len(v)), "v": v, "y": y + coloured(rng, len(v), 0.001 * STROKE)})
    return hystgen.identify(found[0], holdout=found[1], name="unit", units={"input": "V", "output": "um"}).model


def changed(plant: Plant, change: str, size: float) -> Plant:
    """The unit itself after a change; only a crack changes its inside."""
    return plant.cracked(size) if change == "cracked" and size else plant


def session(
    rng: np.random.Generator, name: str, plant: Plant, model: hystgen.Model, use: Use, amplitude: float, change: str,
    size: float, age: float,
) -> Record:
    """A recorded session; `age`: share of a creeping change that has happened."""
    u, step = use(amplitude)
    low, high = model.cascade.input_range
    ends = np.asarray(model.simulate(np.array([low, high, low])))
    u = ends[2] + (ends[1] - ends[2]) * u / STROKE  # what the unit reaches
    v = np.clip(np.asarray(model.inverse().simulate(u)), 0.0, FULL)
    before = np.interp(np.linspace(0.0, 3.0, 120), np.arange(4), [*rng.uniform(0.0, FULL, 3), v[0]])
    y = plant.run(np.concatenate([before, v]))[120:]
    if change == "creep":
        y = creeping(y, step, 4.0 * size)
    elif change in ("gain", "sensor"):
        y = y * (1.0 - size)
        if change == "sensor":
            y = y - size * (y - 0.5 * STROKE) ** 2 / STROKE
    elif change == "load":
        y = y * (1.0 - size * (0.5 + y / STROKE))
    elif change == "ageing":
        y = y * (1.0 - 2.0 * size * age)
    noise = coloured(rng, len(y), rng.uniform(0.0006, 0.002) * STROKE)
    drift = rng.uniform(-0.003, 0.003) * STROKE * np.linspace(0.0, 1.0, len(y)) ** rng.uniform(0.5, 1.5)
    t = step * np.arange(len(y))
    return Record(name, t, v, y + noise + drift + rng.uniform(-1.0, 1.0), {"u": u}, step, units={"v": "V", "y": "um"})


@functools.cache
def new(seed: int) -> tuple[Plant, hystgen.Model]:
    """A new unit and its model, which has an inverse."""
    rng = np.random.default_rng(seed)
    while True:
        plant: Plant = Relays.drawn(rng) if seed % 2 else BoucWen.drawn(rng)
        model = identified(rng, plant)
        if not model.cascade.inverse_problems():
            return plant, model


def unit(
    seed: int, number: int, change: str = "none", size: float = 0.0, after: int = 0
) -> tuple[hystgen.Model, list[Record]]:
    """A unit's model and its sessions, the last `after` of which are changed."""
    plant, model = new(seed)
    rng = np.random.default_rng([seed, 2])
    repeated = bool(seed // 2 % 2)
    uses = [references(rng) for _ in range(int(rng.integers(1, 3)))] if repeated else []
    amplitudes = [rng.uniform(0.6, 1.0) for _ in uses]
    made = []
    other = changed(plant, change, size)
    for k in range(number):
        late = k >= number - after
        if uses:
            j = int(rng.integers(len(uses)))
            use, amplitude = uses[j], amplitudes[j]
        else:
            use, amplitude = references(rng), rng.uniform(0.5, 1.0)
        age = (k - number + after + 1) / after if late else 0.0
        made.append(session(
            rng, f"session_{k + 1:02d}.csv", other if late else plant, model, use, amplitude,
            change if late else "none", size, age,
        ))
    return model, made


def healthy(seed: int, number: int | None = None) -> dict[str, object]:
    """A healthy unit: the p-value of its sessions, with and without the residual of identification, and of the first
    session alone; `number` of sessions, by default 4 to 12."""
    number = number or int(np.random.default_rng([seed, 1]).integers(4, 13))
    model, sessions = unit(seed, number)
    found = hystgen.monitor(model, sessions, causes=False)
    alone = replace(found, changes=tuple(change.find(found.sessions, None, found.false_alarms)))
    first = replace(found, changes=tuple(change.find(found.sessions[:1], found.residual, found.false_alarms)))
    bound = found.residual or np.nan
    return {
        "seed": seed, "sessions": number, "p": found.p_value, "p_without_residual": alone.p_value,
        "p_first_session": first.p_value, "missed": max(each.structured for each in found.sessions) / bound,
        "missed_at_the_median": float(np.median([each.structured for each in found.sessions])) / bound,
    }


def changes(seed: int) -> Iterator[dict[str, object]]:
    """A unit with every change, size and number of sessions."""
    for what in CHANGES:
        for size in SIZES:
            model, sessions = unit(seed, BEFORE + max(COUNTS), what, size, max(COUNTS))
            for after in COUNTS:
                kept = sessions[: BEFORE + after]
                found = hystgen.monitor(model, kept, causes=False)
                yield {
                    "seed": seed, "change": what, "size": size, "after": after, "p": found.p_value,
                    "alarm": int(found.alarm), "since": found.since or "",
                    "right": int(found.since == sessions[BEFORE].name),
                }


def figure(source: Path, target: Path) -> None:
    """Draw the share of units that raise an alarm over the size of the change, from the file that `changes` writes."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    mpl.rcParams.update({"svg.hashsalt": "hystgen", "svg.fonttype": "none", "font.size": 10})
    with source.open(newline="") as lines:
        rows = list(csv.DictReader(lines))
    drawn = Figure(figsize=(9.0, 4.6), layout="constrained")
    panels = drawn.subplots(2, 3, sharex=True, sharey=True)
    for axes, what in zip(panels.flat, CHANGES, strict=True):
        for after, marker in zip(COUNTS, "osD", strict=True):
            shares = []
            for size in SIZES:
                chosen = [r for r in rows if (r["change"], float(r["size"]), int(r["after"])) == (what, size, after)]
                shares.append(100.0 * float(np.mean([int(r["alarm"]) for r in chosen])))
            axes.plot([100.0 * size for size in SIZES], shares, marker=marker, label=f"{after} after the change")
        axes.set_title(what, loc="left")
        axes.set_xscale("log")
        axes.set_xticks([1, 2, 5, 10], ["1", "2", "5", "10"])
        axes.minorticks_off()
        axes.grid(alpha=0.3)
    for axes in panels[1]:
        axes.set_xlabel("size of the change (%)")
    for axes in panels[:, 0]:
        axes.set_ylabel("alarms (%)")
    panels[0, 0].legend(frameon=False, fontsize=8)
    drawn.savefig(target, metadata={"Date": None})


def main() -> None:
    """Run one of the measurements."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["healthy", "changes", "figure"])
    parser.add_argument("--seeds", default="0:300")
    parser.add_argument("--source", type=Path, help="for the figure: what changes wrote")
    parser.add_argument("-o", type=Path, required=True)
    given = parser.parse_args()
    if given.what == "figure":
        figure(given.source, given.o)
        return
    first, last = map(int, given.seeds.split(":"))
    given.o.parent.mkdir(parents=True, exist_ok=True)
    with given.o.open("w", newline="") as out:
        table = None
        for seed in range(first, last):
            for row in [healthy(seed)] if given.what == "healthy" else changes(seed):
                if table is None:
                    table = csv.DictWriter(out, list(row))
                    table.writeheader()
                table.writerow({k: f"{x:.3g}" if isinstance(x, float) else x for k, x in row.items()})
                out.flush()
            print(seed, file=sys.stderr)


if __name__ == "__main__":
    main()
