"""A second simulator of plants for `hystgen diagnose`, which shares nothing with the first (`benchmarks/plants`).

The records are short (450 to 900 samples), as in a laboratory. Hysteresis comes from an Everett function with a stack
of extremes and from a friction element's differential equation; each effect has its own equation. Disturbances outside
the catalogue are random steps of another axis, room temperature acting on the gain, weights that change with time, slow
sinusoidal crosstalk, and a sticking guide. Cases and labels have the layout of `benchmarks.plants`, which runs and
scores them:

    python -m benchmarks.second_plants --kind single --seeds 0:30 -o build/second
    python -m benchmarks.plants run build/second/cases -o build/second/results
    python -m benchmarks.plants score build/second/cases build/second/labels build/second/results
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LOW, HIGH = 0.0, 100.0
FINER = 4
"""Fine steps per sample."""

NOISE = 4e-4
"""rms noise as a fraction of the output range."""

TAU = 2.0 * np.pi

LATE, RESOLVED = 30.0, 1.5
"""[samples] Delay of the strongest lag or delay, and the delay below which both look the same."""


# A session: records with gaps between them, on one fine time axis ---------------------------------------------


@dataclass(frozen=True)
class Session:
    """Fine time [s] and drive; for each record its fine samples, its name, and whether it is held out."""

    t: Array
    v: Array
    parts: tuple[slice, ...]
    names: tuple[str, ...]
    held: tuple[bool, ...]
    samples: int
    step: float
    """[s] sample time"""


def _triangle(t: Array, periods: float) -> Array:
    return np.asarray(1.0 - np.abs(1.0 - 2.0 * (t * periods % 1.0)))


def drives(rng: np.random.Generator) -> list[tuple[str, bool, Callable[[Array], Array]]]:
    """Name, whether held out, and drive from 0 to 1 as a function of the elapsed fraction of the record's time."""
    levels = rng.uniform(0.0, 1.0, 6)
    more = rng.uniform(0.0, 1.0, 5)
    phases = rng.uniform(0.0, TAU, 5)
    corners = np.concatenate([[0.0], rng.uniform(0.0, 1.0, 12)])

    def nested(t: Array) -> Array:
        return np.asarray(0.5 + 0.48 * (1.0 - t) * np.sin(TAU * 6.0 * t))

    def steps(at: Array) -> Callable[[Array], Array]:
        ends = np.concatenate([[0.0, 1.0, 0.0], at])
        return lambda t: np.asarray(ends[np.minimum((t * len(ends)).astype(int), len(ends) - 1)])

    def multi(t: Array) -> Array:
        sines = sum(np.sin(TAU * (2 * k + 1) * t + phases[k]) for k in range(5))
        return np.asarray(np.clip(0.5 + 0.17 * np.asarray(sines), 0.0, 1.0))

    def sweep(t: Array) -> Array:
        return np.asarray(0.5 + 0.5 * np.sin(TAU * (2.0 * t + 12.0 * t**2)))

    def bias(t: Array) -> Array:
        middle = np.array([0.2, 0.5, 0.8])[np.minimum((3.0 * t).astype(int), 2)]
        wide = np.where(t < 0.12, 4.0, 1.0)
        return np.asarray(np.clip(middle + 0.12 * wide * np.sin(TAU * 12.0 * t), 0.0, 1.0))

    def hold(t: Array) -> Array:
        return np.asarray(np.clip(np.where(t < 0.4, 4.0 * t, 1.0) - np.where(t > 0.7, 8.0 * (t - 0.7), 0.0), 0.0, 1.0))

    def walk(t: Array) -> Array:
        return np.asarray(np.interp(t, np.linspace(0.0, 1.0, len(corners)), corners))

    return [
        ("slow", False, lambda t: _triangle(t, 2.0)),
        ("nested", False, nested),
        ("steps", False, steps(levels)),
        ("multi", False, multi),
        ("sweep", False, sweep),
        ("bias", False, bias),
        ("fast", False, lambda t: np.asarray(0.5 + 0.5 * np.sin(TAU * 16.0 * t))),
        ("hold", False, hold),
        ("held_walk", True, walk),
        ("held_sine", True, lambda t: np.asarray(0.5 - 0.5 * (0.4 + 0.6 * t) * np.cos(TAU * 5.0 * t))),
        ("held_steps", True, steps(more)),
    ]


def session(rng: np.random.Generator, slow: bool) -> Session:
    """A session with a sample every 0.1 s (`slow`) or every millisecond."""
    samples = int(rng.choice([450, 600, 900]))
    step = 0.1 if slow else 1e-3
    fine = step / FINER
    t, v, parts, names, held = [np.zeros(1)], [np.zeros(1)], [], [], []
    for name, out, drive in drives(rng):
        share = (np.arange(samples * FINER) + 0.5) / (samples * FINER)
        moved = LOW + (HIGH - LOW) * drive(share)
        between = np.linspace(float(v[-1][-1]), float(moved[0]), 60)
        pause = samples * step * rng.uniform(0.5, 4.0)
        t.append(float(t[-1][-1]) + pause * np.arange(1, 61) / 60.0)
        v.append(between)
        first = sum(map(len, t))
        parts.append(slice(first, first + len(share)))
        t.append(float(t[-1][-1]) + fine * np.arange(1, len(share) + 1))
        v.append(moved)
        names.append(name)
        held.append(out)
    return Session(np.concatenate(t), np.concatenate(v), tuple(parts), tuple(names), tuple(held), samples, step)


def sampled(fine: Array, part: slice) -> Array:
    """A fine signal as a converter that averages over a sample sees it."""
    return np.asarray(fine[part].reshape(-1, FINER).mean(axis=1))


# Hysteresis: an Everett function over a stack of extremes, and a friction element -----------------------------


@dataclass(frozen=True)
class Stage:
    """The Everett function of a move by d is `d (slope + second d + third d^2)` everywhere; friction is added."""

    slope: float
    second: float
    third: float
    friction: float
    centre: float = 0.0
    """Relative growth of a move's output per drive range above the middle, which makes loops non-congruent."""

    def moved(self, v: Array) -> tuple[Array, Array]:
        """The reversible and the irreversible part of the output, for a drive in ranges that starts from 0."""
        return self.slope * v, self._everett(v) + self._friction(v)

    def _everett(self, v: Array) -> Array:
        out = np.empty(len(v))
        stack: list[tuple[float, float]] = [(0.0, 0.0)]  # drive and output at the remembered reversals
        up, last = True, float(v[0])
        level = self._move(0.0, last)
        out[0] = level
        for k in range(1, len(v)):
            x = float(v[k])
            if x != last and (x > last) != up:
                stack.append((last, level))
                up = x > last
            while len(stack) > 2 and (x >= stack[-2][0] if up else x <= stack[-2][0]):
                del stack[-2:]
            place, before = stack[-1]
            level = before + self._move(place, x)
            out[k], last = level, x
        return out

    def _move(self, a: float, b: float) -> float:
        d = abs(b - a)
        return float(np.copysign(
            d * d * (self.second + self.third * d) * (1.0 + self.centre * (0.5 * (a + b) - 0.5)), b - a
        ))  # fmt: skip

    def _friction(self, v: Array) -> Array:
        """Dahl's element: dz = dv (1 - z sign(dv) / limit)."""
        z, limit = 0.0, 0.08
        out = np.empty(len(v))
        for k, step in enumerate(np.diff(v, prepend=v[0]).tolist()):
            if step:
                end = limit if step > 0.0 else -limit
                z = end + (z - end) * float(np.exp(-abs(step) / limit))
            out[k] = z
        return self.friction * out


# Effects, each with an equation of its own and a strength ----------------------------------------------------


@dataclass
class Plant:
    """Changes that effects make to drive, irreversible part and output, each called with signals on the fine grid."""

    drive: list[Callable[[Session, Array], Array]]
    rest: list[Callable[[Session, Array], Array]]
    output: list[Callable[[Session, Array, Array], Array]]
    centre: float = 0.0

    def run(self, made: Session, stage: Stage) -> Array:
        """Output at all fine samples, for a drive in ranges."""
        v = (made.v - LOW) / (HIGH - LOW)
        for change in self.drive:
            v = change(made, v)
        stage = Stage(stage.slope, stage.second, stage.third, stage.friction, self.centre)
        first, rest = stage.moved(v)
        for change in self.rest:
            rest = change(made, rest)
        y = first + rest
        for after in self.output:
            y = after(made, v, y)
        return y


def filtered(t: Array, x: Array, time: float) -> Array:
    """A first-order lag on uneven times; the input steps halfway between consecutive times."""
    out = np.empty(len(x))
    state, last, kept = float(x[0]), float(x[0]), np.exp(-0.5 * np.diff(t, prepend=t[0]) / time).tolist()
    for k, (value, keep) in enumerate(zip(x.tolist(), kept, strict=True)):
        state = last + (state - last) * keep
        state = value + (state - value) * keep
        out[k], last = state, value
    return out


def _mode(t: Array, x: Array, frequency: float, damping: float) -> Array:
    """A vibration mode driven by x, which steps halfway between consecutive times; its rotation is exact."""
    out = np.empty(len(x))
    w, dt = TAU * frequency, np.diff(t, prepend=t[0])
    damped = w * np.sqrt(1.0 - damping**2)

    def turned(a: float, b: float, step: float) -> tuple[float, float]:
        fade, c, s = np.exp(-damping * w * step), np.cos(damped * step), np.sin(damped * step)
        return (
            fade * (a * c + (b + damping * w * a) / damped * s),
            fade * (b * c - (w * w * a + damping * w * b) / damped * s),
        )

    a, b = 0.0, 0.0  # deviation from x, and its rate
    last = float(x[0])
    for k, (value, step) in enumerate(zip(x.tolist(), dt.tolist(), strict=True)):
        a, b = turned(a, b, 0.5 * step)
        a, b = turned(a - (value - last), b, 0.5 * step)
        out[k], last = value + a, value
    return out


Effect = Callable[[np.random.Generator, Session, float, Plant], None]
"""Function that adds an effect to a plant, with a strength of about 0.01 to 1."""


def creep(rng: np.random.Generator, made: Session, x: float, plant: Plant) -> None:
    times = made.samples * made.step * np.geomspace(0.01, 20.0, 14)
    weights = times ** rng.uniform(-0.15, 0.15)
    weights *= x / weights.sum()

    def change(made: Session, v: Array, y: Array) -> Array:
        return np.asarray(y + sum(w * filtered(made.t, y, time) for w, time in zip(weights, times, strict=True)))

    plant.output.append(change)


def rate_dependence(rng: np.random.Generator, made: Session, x: float, plant: Plant) -> None:
    time = x * 0.2 * made.samples * made.step / 16.0
    plant.rest.append(lambda made, rest: filtered(made.t, rest, time))


def resonance(rng: np.random.Generator, made: Session, x: float, plant: Plant) -> None:
    frequency, damping = rng.uniform(0.05, 0.16) / made.step, rng.uniform(0.01, 0.05)
    plant.output.append(lambda made, v, y: y + min(10.0 * x, 1.0) * (_mode(made.t, y, frequency, damping) - y))


def lag(rng: np.random.Generator, made: Session, x: float, plant: Plant) -> None:
    time = x * LATE * made.step
    plant.drive.append(lambda made, v: filtered(made.t, filtered(made.t, v, time), 0.12 * time))


def delay(rng: np.random.Generator, made: Session, x: float, plant: Plant) -> None:
    late = x * LATE * made.step
    plant.drive.append(lambda made, v: np.interp(made.t - late, made.t, v))


def slew_limit(rng: np.random.Generator, made: Session, x: float, plant: Plant) -> None:
    rate = 0.05 / (x * 20.0 * made.step)

    def change(made: Session, v: Array) -> Array:
        out, now, last = np.empty(len(v)), float(v[0]), float(v[0])
        for k, (value, step) in enumerate(zip(v.tolist(), np.diff(made.t, prepend=made.t[0]).tolist(), strict=True)):
            most = rate * step
            if abs(value - last) <= most:
                now += float(np.clip(value - now, -most, most))
            else:  # the drive steps halfway between two times
                for goal in (last, value):
                    now += float(np.clip(goal - now, -0.5 * most, 0.5 * most))
            out[k], last = now, value
        return out

    plant.drive.append(change)


def asymmetry(rng: np.random.Generator, made: Session, x: float, plant: Plant) -> None:
    sign = rng.choice([-1.0, 1.0])
    plant.drive.append(lambda made, v: np.asarray(np.expm1(sign * x * v) / np.expm1(sign * x)))


def saturation(rng: np.random.Generator, made: Session, x: float, plant: Plant) -> None:
    plant.output.append(lambda made, v, y: 0.5 + np.arctan(3.0 * x * (y - 0.5)) / (3.0 * x))


def thermal(rng: np.random.Generator, made: Session, x: float, plant: Plant) -> None:
    time = made.samples * made.step * rng.uniform(1.0, 4.0)

    def change(made: Session, v: Array, y: Array) -> Array:
        power = np.abs(np.gradient(v, made.t)) * made.samples * made.step / 20.0
        return np.asarray(y * (1.0 + 0.3 * x * filtered(made.t, power, time)))

    plant.output.append(change)


def drift(rng: np.random.Generator, made: Session, x: float, plant: Plant) -> None:
    plant.output.append(lambda made, v, y: y + x * made.t / made.t[-1])


def ageing(rng: np.random.Generator, made: Session, x: float, plant: Plant) -> None:
    def change(made: Session, v: Array, y: Array) -> Array:
        travel = np.cumsum(np.abs(np.diff(v, prepend=v[0])))
        return np.asarray(y * (1.0 - 0.3 * x * (1.0 - (1.0 + travel / 8.0) ** -0.5)))

    plant.output.append(change)


def sensor_nonlinearity(rng: np.random.Generator, made: Session, x: float, plant: Plant) -> None:
    bend, phase = 0.2 * x, rng.uniform(0.0, 0.6)
    plant.output.append(lambda made, v, y: y + bend * np.sin(3.0 * y + phase))


def noncongruent(rng: np.random.Generator, made: Session, x: float, plant: Plant) -> None:
    plant.centre = float(min(4.0 * x, 1.6))


EFFECTS: dict[str, tuple[Effect, bool]] = {
    "creep": (creep, True), "rate_dependence": (rate_dependence, False), "resonance": (resonance, False),
    "lag": (lag, False), "delay": (delay, False), "slew_limit": (slew_limit, False), "asymmetry": (asymmetry, False),
    "saturation": (saturation, False), "thermal": (thermal, True), "drift": (drift, True), "ageing": (ageing, True),
    "sensor_nonlinearity": (sensor_nonlinearity, False), "noncongruent": (noncongruent, False),
}  # fmt: skip
"""All effects, with whether each needs a slow session."""


# Disturbances, which are not effects of the actuator --------------------------------------------------------


def other_axis(rng: np.random.Generator, made: Session, x: float, y: Array) -> Array:
    at = np.cumsum(rng.exponential(0.4 * made.samples * made.step, 400))
    levels = rng.normal(0.0, 1.0, 401)
    return np.asarray(y + 0.1 * x * levels[np.searchsorted(at, made.t)])


def room(rng: np.random.Generator, made: Session, x: float, y: Array) -> Array:
    places = np.linspace(0.0, made.t[-1], 14)
    return np.asarray(y * (1.0 + 0.1 * x * np.interp(made.t, places, np.cumsum(rng.normal(0.0, 1.0, 14)))))


def changing_weights(rng: np.random.Generator, made: Session, x: float, y: Array) -> Array:
    share = made.t / made.t[-1]
    v = (made.v - LOW) / (HIGH - LOW)
    return np.asarray(y + 0.2 * x * (share - 0.5) * (filtered(np.arange(len(v)) * 1.0, v, 40.0 * FINER) - v + y))


def crosstalk(rng: np.random.Generator, made: Session, x: float, y: Array) -> Array:
    period = made.samples * made.step * rng.uniform(0.6, 3.0)
    return np.asarray(y + 0.1 * x * np.sin(TAU * made.t / period + rng.uniform(0.0, TAU)))


def sticking(rng: np.random.Generator, made: Session, x: float, y: Array) -> Array:
    out, place, limit = np.empty(len(y)), float(y[0]), 0.1 * x
    for k, value in enumerate(y.tolist()):
        if abs(value - place) > limit:
            place, limit = value, 0.1 * x * rng.uniform(0.3, 1.7)
        out[k] = place
    return out


FOREIGN = {each.__name__: each for each in (other_axis, room, changing_weights, crosstalk, sticking)}


# Cases ------------------------------------------------------------------------------------------------------


def beside_steps(x: Array) -> NDArray[np.bool_]:
    """The samples within two of a fast step, of at most two samples, of the drive x (in ranges)."""
    near = np.zeros(len(x), dtype=bool)
    for k in range(1, len(x) - 3):
        size = abs(x[k + 2] - x[k])
        if size > 0.02 and max(abs(x[k] - x[k - 1]), abs(x[k + 3] - x[k + 2])) < 0.05 * size:
            near[k - 1 : k + 5] = True
    return near


def unabsorbed(y: Sequence[Array], v: Sequence[Array], without_steps: bool = False) -> float:
    """rms residual of a linear least-squares fit of plays with weights of any sign and an offset per record.

    All records are fitted together, each from the later of its two extremes on, with thresholds up to half the range.
    `without_steps`: leave out the samples `beside_steps`.
    """
    tables, targets = [], []
    for one, drive in zip(y, v, strict=True):
        x = (drive - LOW) / (HIGH - LOW)
        rows = [x]
        for r in 0.47 * np.linspace(0.0, 1.0, 17)[1:] ** 1.5:
            play, out = float(x[0]), np.empty(len(x))
            for k, value in enumerate(x.tolist()):
                play = max(value - r, min(value + r, play))
                out[k] = play
            rows.append(out)
        behind = max(int(np.argmax(x)), int(np.argmin(x)))
        if np.ptp(x) < 0.5 or behind > 0.8 * len(x):  # the record's start memory is wiped too late
            continue
        used = behind + np.flatnonzero(~(without_steps & beside_steps(x)[behind:]))
        part = np.stack(rows)[:, used]
        tables.append(part - part.mean(axis=1, keepdims=True))
        targets.append(one[used] - one[used].mean())
    table, target = np.concatenate(tables, axis=1).T, np.concatenate(targets)
    solution, *_ = np.linalg.lstsq(table, target, rcond=None)
    return float(np.sqrt(np.mean((target - table @ solution) ** 2)))


def alike(name: str, x: float) -> list[str]:
    """Effects that these records cannot tell from effect `name` of strength x: a lag and a delay of about a sample."""
    late = ("lag", "delay")
    return [other for other in late if other != name] if name in late and x * LATE < RESOLVED else []


def case(kind: str, seed: int, folder: Path) -> str:
    """Write one case and its label; returns its name."""
    rng = np.random.default_rng([20, {"single": 1, "pair": 2, "none": 3, "foreign": 4}[kind], seed])
    names = list(EFFECTS)
    chosen: list[str] = []
    if kind == "single":
        chosen = [names[seed % len(names)]]
    if kind == "pair":
        slow = bool(rng.integers(2))
        able = [name for name in names if EFFECTS[name][1] == slow or not EFFECTS[name][1]]
        first = rng.choice([name for name in able if EFFECTS[name][1] == slow])
        others = [name for name in able if name != first and {name, first} != {"lag", "delay"}]
        chosen = [str(first), str(rng.choice(others))]
    foreign = list(FOREIGN)[seed % len(FOREIGN)] if kind == "foreign" else None
    slow = any(EFFECTS[name][1] for name in chosen) or (not chosen and bool(rng.integers(2)))
    made = session(rng, slow)
    stage = Stage(rng.uniform(0.6, 0.8), rng.uniform(0.1, 0.3), rng.uniform(-0.05, 0.03), rng.uniform(0.0, 0.004))
    v = [sampled(made.v, part) for part in made.parts]
    draw = int(rng.integers(2**31))

    def output(strengths: dict[str, float]) -> list[Array]:
        plant = Plant([], [], [])
        for k, (name, x) in enumerate(strengths.items()):
            EFFECTS[name][0](np.random.default_rng([draw, k]), made, x, plant)
        y = plant.run(made, stage)
        if foreign is not None and "foreign" not in strengths:
            y = FOREIGN[foreign](np.random.default_rng(draw), made, amount, y)
        return [sampled(y, part) for part in made.parts]

    amount = 0.0
    bare = unabsorbed(output({}), v) if foreign is None else 0.0
    span = float(np.ptp(np.concatenate(output({})))) if foreign is None else 1.0
    noise = max(NOISE * span, bare)

    def strength(run: Callable[[float], list[Array]], wanted: float, without_steps: bool = False) -> float:
        low, high = 1e-4, 1.0
        for _ in range(9):
            middle = float(np.sqrt(low * high))
            low, high = (middle, high) if unabsorbed(run(middle), v, without_steps) < wanted else (low, middle)
        return float(np.sqrt(low * high))

    strengths: dict[str, float] = {}
    ratios: list[float] = []
    for name in chosen:
        ratio = float(np.exp(rng.uniform(np.log(5.0), np.log(20.0))))
        # a limit met only by steps within two samples cannot be told from a delay of those steps, so they do not count
        apart = name == "slew_limit"
        strengths[name] = strength(lambda x, name=name: output({name: x}), ratio * noise, apart)  # type: ignore[misc]
        left = unabsorbed(output({name: strengths[name]}), v, apart)
        ratios.append(float(np.sqrt(max(left**2 - bare**2, 0.0))) / noise)
    if foreign is not None:
        ratio = float(np.exp(rng.uniform(np.log(5.0), np.log(20.0))))

        def disturbed(x: float) -> list[Array]:
            nonlocal amount
            amount = x
            return output({})

        amount = strength(disturbed, ratio * noise)
    clean = output(strengths)
    scale = 40.0
    shown = [scale * (one + rng.normal(0.0, noise, len(one))) for one in clean]
    title = f"{kind}_{seed:05d}"
    home = folder / "cases" / title
    home.mkdir(parents=True, exist_ok=True)
    (folder / "labels").mkdir(exist_ok=True)
    for name, part, drive, one in zip(made.names, made.parts, v, shown, strict=True):
        t = sampled(made.t, part)
        rows = "\n".join(f"{a:.7g},{b:.7g},{c:.7g}" for a, b, c in zip(t, drive, one, strict=True))
        (home / f"{name}.csv").write_text(f"t,v,y\n{rows}\n")
    (home / "params.yaml").write_text(
        "hystgen: 1\nname: stage\nunits: {input: V, output: um}\ninput_range: [0, 100]\nmodel:\n  pi:\n"
        "    thresholds: [0, 5, 10, 20, 30]\n    weights: [0.28, 0.05, 0.04, 0.03, 0.02]\n"
    )
    files = [f"{name}.csv" for name in made.names]
    spec = {
        "fit": [f for f, out in zip(files, made.held, strict=True) if not out],
        "holdout": [f for f, out in zip(files, made.held, strict=True) if out],
        "history": None, "rest": None,
    }  # fmt: skip
    (home / "session.json").write_text(json.dumps(spec) + "\n")
    label = {
        "case": title, "kind": kind, "seed": seed, "block": "tune", "bench": "slow" if slow else "fast",
        "effects": [
            {"name": name, "form": "own", "ratio": ratio, "indistinguishable": alike(name, strengths[name])}
            for name, ratio in zip(chosen, ratios, strict=True)
        ],
        "foreign": None if foreign is None else {"name": foreign, "amount": amount},
        "visible": all(ratio >= 3.0 for ratio in ratios),
        "noise": {"holdout": scale * noise},
    }  # fmt: skip
    (folder / "labels" / f"{title}.json").write_text(json.dumps(label) + "\n")
    return title


def main(words: Sequence[str] | None = None) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.second_plants", description=__doc__)
    parser.add_argument("--kind", choices=("single", "pair", "none", "foreign"), required=True)
    parser.add_argument("--seeds", required=True, metavar="A:B")
    parser.add_argument("-o", dest="folder", type=Path, required=True)
    given = parser.parse_args(words)
    first, _, last = given.seeds.partition(":")
    for seed in range(int(first), int(last)):
        print(case(given.kind, seed, given.folder), file=sys.stderr, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
