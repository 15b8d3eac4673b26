"""Whether `hystgen diagnose` names a logged column that acts on the output, and only such a column.

The simulator shares nothing with the package: hysteresis is a sum of soft relays, coupling to another axis a sum of
relays of that axis's drive with a stiffness of its own, a load acts through a heated bar of eight cells, and room drift
is a random path. Columns that do not act share a drift or the mains with the output, copy the drive, or are noise.

    python -m benchmarks.influences --kinds offset gain lagged coupled --seeds 0:15
    python -m benchmarks.influences --kinds drift mains drive noise --seeds 0:15
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RATE = 400.0
"""[Hz] Sample rate; lines of the mains at 50 Hz have eight samples a period."""

SAMPLES = 1600
"""[samples] Length of a record: 4 s. It decides nothing; longer records take longer to search."""

NOISE = 5e-4
"""rms noise of the output, as a fraction of its range."""

ACTING = ("offset", "gain", "lagged", "coupled")
IDLE = ("drift", "mains", "drive", "noise")


@dataclass(frozen=True)
class Case:
    """Records to fit and to hold out, each as named columns, and the column that acts on the output, if any."""

    to_fit: list[dict[str, Array]]
    held: list[dict[str, Array]]
    acting: str


def relays(v: Array, density: Array, widths: Array, centres: Array, softness: float) -> Array:
    """Sum (N,) of soft relays: relay (i, j) is pulled up above `centre + width` and down below `centre - width`."""
    up, down = (centres[None, :] + way * widths[:, None] for way in (1.0, -1.0))
    state = -np.ones_like(up)
    out = np.empty(len(v))
    for k, x in enumerate(v):
        state = np.maximum(state, np.tanh((x - up) / softness))
        state = np.minimum(state, np.tanh((x - down) / softness))
        out[k] = float(np.sum(density * state))
    return out


def stage(v: Array, rng: np.random.Generator) -> Array:
    """The displacement (N,) for drives within 0 .. 1, range about 1."""
    widths = np.array([0.0, 0.02, 0.05, 0.1, 0.17, 0.26])
    share = np.array([1.0, 0.12, 0.1, 0.08, 0.06, 0.05]) * rng.uniform(0.7, 1.3, len(widths))
    centres = np.linspace(-0.35, 1.35, 240)
    density = np.repeat((share / share.sum())[:, None], len(centres), axis=1)
    return 0.5 * 1.7 * relays(v, density / len(centres), widths, centres, 0.02)


def drive(rng: np.random.Generator, n: int, kind: int) -> Array:
    """A drive within 0 .. 1, beginning with a sweep up and down: triangles, sines, or smooth random moves."""
    sweep = np.concatenate([np.linspace(0.0, 1.0, n // 10), np.linspace(1.0, 0.0, n // 10)])
    m = n - len(sweep)
    t = np.arange(m) / RATE
    if kind == 0:
        turns = np.concatenate([[0.0], *[[rng.uniform(0.55, 1.0), rng.uniform(0.0, 0.45)] for _ in range(5)]])
        rest = np.interp(np.linspace(0.0, len(turns) - 1.0, m), np.arange(len(turns)), turns)
    elif kind == 1:
        rest = 0.5 - 0.5 * np.cos(2.0 * np.pi * rng.uniform(1.0, 2.0) * t) * np.linspace(1.0, 0.3, m)
    else:
        points = rng.uniform(0.0, 1.0, 14)
        points[0] = 0.0
        at = np.linspace(0.0, 13.0, m)
        low = np.minimum(at.astype(int), 12)
        part = 0.5 - 0.5 * np.cos(np.pi * (at - low))
        rest = points[low] * (1.0 - part) + points[low + 1] * part
    return np.concatenate([sweep, rest])


def wandering(rng: np.random.Generator, n: int) -> Array:
    """A slow random path (n,) of rms 1, as room temperature makes it over a record."""
    t = np.linspace(0.0, 1.0, n)
    path = rng.normal(0.0, 1.0) * t + sum(
        rng.normal(0.0, 1.0 / k) * np.sin(np.pi * k * rng.uniform(0.3, 1.0) * t + rng.uniform(0.0, 6.3)) for k in (1, 2)
    )
    return np.asarray((path - path.mean()) / path.std())


def moved(rng: np.random.Generator, n: int) -> Array:
    """A column that changes on its own: loads put on and off, or a wave with a random course."""
    if rng.random() < 0.5:
        edges = np.sort(rng.integers(n // 20, n, 7))
        levels = rng.uniform(-1.0, 1.0, 8)
        return levels[np.searchsorted(edges, np.arange(n), side="right")]
    t = np.arange(n) / RATE
    return np.asarray(np.sin(2.0 * np.pi * rng.uniform(0.6, 3.1) * t + rng.uniform(0.0, 6.3)) * rng.uniform(0.6, 1.0))


def bar(x: Array, seconds: float) -> Array:
    """The far end's answer (N,) to x: eight cells in a row, each following its neighbours."""
    cells = np.full(8, x[0])
    rate = 30.0 / (seconds * RATE)
    fine = max(1, int(np.ceil(4.0 * rate)))
    out = np.empty(len(x))
    for k, u in enumerate(x):
        for _ in range(fine):
            left = np.concatenate([[u], cells[:-1]])
            right = np.concatenate([cells[1:], cells[-1:]])
            cells = cells + rate / fine * (left - 2.0 * cells + right)
        out[k] = cells[-1]
    return out


def case(kind: str, seed: int) -> Case:
    """A session of three records and a held-out one with a column `load` and a column `spare` that never acts."""
    rng = np.random.default_rng([seed, *kind.encode()])
    n, size = SAMPLES, rng.uniform(0.008, 0.03)
    records = []
    plant = rng.integers(2**31)
    hertz, lag = rng.choice([50.0, 60.0]) * rng.uniform(0.998, 1.002), rng.uniform(0.05, 0.3)
    own = rng.integers(2**31)
    for k in range(4):
        t = np.arange(n) / RATE + 6.0 * k
        v = drive(rng, n, k % 3)
        y = stage(v, np.random.default_rng(plant))
        load, spare = moved(rng, n), moved(rng, n) + 0.02 * rng.standard_normal(n)
        if kind == "offset":
            y = y + size * load
        elif kind == "gain":
            y = y * (1.0 + 2.5 * size * load)
        elif kind == "lagged":
            y = y + 1.5 * size * bar(load, lag)
        elif kind == "coupled":
            load = drive(rng, n, (k + 1) % 3)
            y = y + 4.0 * size * stage(load, np.random.default_rng(own))
        elif kind == "drift":
            path = wandering(rng, n)
            load = path + 0.1 * rng.standard_normal(n)
            y = y + size * path
        elif kind == "mains":
            hum = np.sin(2.0 * np.pi * hertz * t)
            load = hum + 0.3 * moved(rng, n) + 0.05 * rng.standard_normal(n)
            y = y + 0.5 * size * np.sin(2.0 * np.pi * hertz * t + 0.4)
        elif kind == "drive":
            load = bar(v, 0.05) + 0.01 * rng.standard_normal(n)
            y = y + size * wandering(rng, n)
        else:
            load = moved(rng, n) + rng.standard_normal(n)
            y = y + size * wandering(rng, n) * (seed % 2)
        y = 10.0 * (y + NOISE * rng.standard_normal(n))
        columns = {"load": 20.0 + 5.0 * load, "spare": 300.0 + 50.0 * spare}
        records.append({"t": t, "v": 100.0 * v, "y": y, **columns})
    return Case(records[:3], records[3:], "load" if kind in ACTING else "")


def run(kind: str, seed: int) -> dict[str, object]:
    """What the diagnosis of a case says: named columns, other names, and errors before and after."""
    import hystgen

    one = case(kind, seed)
    begun = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        plain = hystgen.identify(one.to_fit, holdout=one.held, model="pi")
        found = hystgen.diagnose(plain, one.to_fit, holdout=one.held).content
    named = [each["parameters"].get("column") for each in found["effects"]]
    columns = [name for name in named if name]
    return {
        "kind": kind, "seed": seed, "acting": one.acting, "columns": columns,
        "right": one.acting in columns if one.acting else not columns,
        "false": sorted(set(columns) - {one.acting}),
        "others": [each["name"] for each, name in zip(found["effects"], named, strict=True) if not name],
        "gap": [found["gap"][each]["holdout"] for each in ("refitted", "after")], "noise": found["noise_floor"],
        "advice": found["advice"], "seconds": round(time.process_time() - begun, 1),
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Run cases and print a line for each, and a summary."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinds", nargs="+", default=[*ACTING, *IDLE], choices=[*ACTING, *IDLE])
    parser.add_argument("--seeds", default="0:15", help="first:last, the last excluded")
    given = parser.parse_args(arguments)
    first, last = map(int, given.seeds.split(":"))
    for kind in given.kinds:
        right = false = 0
        for seed in range(first, last):
            told = run(kind, seed)
            right, false = right + bool(told["right"]), false + bool(told["false"])
            print(json.dumps(told), flush=True)
        print(f"{kind}: right {right} of {last - first}, false columns in {false}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
