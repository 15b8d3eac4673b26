"""A session of records on a bench: the drive on a fine time grid, including the time between the records."""

from __future__ import annotations

import itertools
import math
from collections.abc import Container, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from . import drives
from .bench import Bench

Array = NDArray[np.float64]

FINER = 8
"""Fine steps per sample of a record."""


@dataclass(frozen=True)
class Planned:
    """One record: its waveform's name, whether it is held out, its rate [1/s], and its samples of FINER fine steps
    each, starting at fine index `first`."""

    waveform: str
    held_out: bool
    rate: float
    first: int
    samples: int

    @property
    def fine(self) -> slice:
        return slice(self.first, self.first + FINER * self.samples)


@dataclass(frozen=True)
class Session:
    """`t` [s], `v` [input] on the fine grid; `history`, `rest`: before each record, if they are known."""

    bench: Bench
    t: Array
    v: Array
    records: tuple[Planned, ...]
    history: tuple[float, ...] | None
    rest: float | None
    temperature: Array
    aperture: int
    """Number of fine steps, in the middle of a sample, over which both converters average."""

    @property
    def dt(self) -> Array:
        return np.diff(self.t, prepend=self.t[0])

    def sampled(self, fine: Array, record: Planned) -> Array:
        """A fine signal as the converter sees it, without noise."""
        parts = fine[record.fine].reshape(record.samples, FINER)
        half = self.aperture // 2
        return np.asarray(parts[:, FINER // 2 - half : FINER // 2 + half].mean(axis=1))

    def times(self, record: Planned) -> Array:
        """Session time of the samples."""
        parts = self.t[record.fine].reshape(record.samples, FINER)
        return np.asarray(parts.mean(axis=1))


Waveforms = list[tuple[str, drives.Drive, bool]]
"""Name, generator, and whether held out, in the order of the session."""


def plan(rng: np.random.Generator, bench: Bench, known: bool, waveforms: Waveforms) -> Session:
    """Drive a bench through records with the given waveforms."""
    pace = 0.06 * bench.short if bench.kind == "dynamic" else 0.06 * bench.long
    rest = _round(rng.uniform(0.5, 4.0) * (bench.short if bench.kind == "dynamic" else 0.3 * bench.long))
    history = None
    if known:
        ends = [[bench.high, bench.low], [bench.low, bench.high], [bench.high, bench.low, bench.middle]]
        history = tuple(ends[int(rng.integers(3))])
    t: list[Array] = [np.zeros(1)]
    v: list[Array] = [np.array([bench.low + bench.span * rng.uniform(0.0, 1.0)])]
    records = []

    def now() -> tuple[float, float]:
        return float(t[-1][-1]), float(v[-1][-1])

    for name, waveform, held_out in waveforms:
        turns = history or tuple(bench.low + bench.span * rng.uniform(0.0, 1.0, int(rng.integers(1, 4))))
        for turn in turns:
            clock, start = now()
            t.append(clock + np.linspace(0.0, pace, 81)[1:])
            v.append(np.linspace(start, turn, 81)[1:])
        clock, start = now()
        pause = rest if known else rest * rng.uniform(0.3, 2.0)
        t.append(clock + pause * np.geomspace(1e-4, 1.0, 50))
        v.append(np.full(50, start))
        clock, start = now()
        rate = bench.rates[1] if _is_fast(rng, bench, name) else bench.rates[0]
        fine = (np.arange(FINER * bench.samples) + 0.5) / FINER
        records.append(Planned(name, held_out, rate, sum(map(len, t)), bench.samples))
        relative = waveform(rng, fine / bench.samples, (start - bench.low) / bench.span, 1.0 / bench.samples)
        t.append(clock + (fine + 0.5) / rate)
        v.append(bench.low + bench.span * relative)
    clock = np.concatenate(t)
    room = _room(rng, clock)
    aperture = 2 if rng.uniform() < 0.6 else 4
    return Session(bench, clock, np.concatenate(v), tuple(records), history, rest if known else None, room, aperture)


@dataclass(frozen=True)
class Given:
    """A drive from elsewhere: session time [s] and drive [input] of its samples, held out or not."""

    name: str
    held_out: bool
    t: Array
    v: Array


def read_drives(folder: Path, held_out: Container[str]) -> list[Given]:
    """The CSV files of a folder, columns t and v, in the order of their names."""
    found = []
    for path in sorted(folder.glob("*.csv")):
        t, v = np.loadtxt(path, delimiter=",", skiprows=1, usecols=(0, 1), unpack=True)
        found.append(Given(path.stem, path.name in held_out, t, v))
    return found


def replayed(rng: np.random.Generator, span_out: float, given: Sequence[Given]) -> Session:
    """Given drives unchanged, with rests between them; the top and the bottom are visited before the first."""
    low, high = min(float(each.v.min()) for each in given), max(float(each.v.max()) for each in given)
    steps = [float(np.median(np.diff(each.t))) for each in given]
    rates = (1.0 / max(steps), 1.0 / min(steps))
    bench = Bench("mixed", low, high, span_out, rates, round(float(np.median([len(each.t) for each in given]))))
    rest = min(float(b.t[0] - a.t[-1]) for a, b in itertools.pairwise(given))
    before = given[0].t[0] - rest - 0.06 * bench.long * np.linspace(2.0, 0.0, 161)
    t, v = [before], [np.interp(np.arange(161), [0, 80, 160], [low, high, low])]
    records = []
    for each, step in zip(given, steps, strict=True):
        begin = float(t[-1][-1])
        pause = float(each.t[0]) - step - begin
        t.append(begin + pause * np.geomspace(1e-4, 1.0, 50))
        v.append(np.full(50, v[-1][-1]))
        fine = ((np.arange(FINER) + 0.5) / FINER - 0.5) * step
        records.append(Planned(each.name, each.held_out, 1.0 / step, sum(map(len, t)), len(each.t)))
        t.append((each.t[:, None] + fine[None, :]).ravel())
        v.append(np.interp(t[-1], each.t, each.v))
    clock = np.concatenate(t)
    room = _room(rng, clock)
    return Session(bench, clock, np.concatenate(v), tuple(records), (high, low), rest, room, 2)


def rich(rng: np.random.Generator, records: int) -> Waveforms:
    """Waveforms that can show every effect of the bench; the held-out ones are anywhere except at the very start."""
    names = list(drives.FIT)
    fit = [(name, drives.FIT[name], False) for name in names[: max(records - 3, 5)]]
    fit = [fit[k] for k in rng.permutation(len(fit))]
    others = list(drives.HELD_OUT)
    chosen = ["staircase", "reversals", others[2 + int(rng.integers(2))]]
    order = [*fit]
    for name in chosen:
        order.insert(int(rng.integers(2, len(order) + 1)), (name, drives.HELD_OUT[name], True))
    return order


def poor(rng: np.random.Generator) -> Waveforms:
    """One waveform at one speed and amplitude, repeated: a sine, or a slow triangle."""
    if rng.uniform() < 0.6:
        waveform = drives.sine(round(rng.uniform(4.0, 9.0)), rng.uniform(0.25, 0.5))
        name = "sine"
    else:
        waveform, name = drives.triangle((2.0, 2.0)), "slow"
    number = int(rng.integers(1, 3))
    return [(name, waveform, k == number) for k in range(number + 1)]


def _is_fast(rng: np.random.Generator, bench: Bench, name: str) -> bool:
    if bench.kind != "mixed":
        return True
    if name in ("fast", "sweep", "staircase"):
        return True
    if name in ("slow", "holds", "minor", "reversals"):
        return False
    return bool(rng.uniform() < 0.5)


def _room(rng: np.random.Generator, t: Array) -> Array:
    """Temperature of the room [degC]: some degrees up and down over the session."""
    x = (t - t[0]) / (t[-1] - t[0])
    out = np.zeros_like(x)
    for _ in range(3):
        out += rng.uniform(0.4, 1.0) * np.sin(2.0 * math.pi * rng.uniform(0.5, 2.5) * x + rng.uniform(0.0, 6.0))
    return np.asarray(22.0 + rng.uniform(-1.5, 1.5) + rng.uniform(0.5, 2.5) * out + rng.uniform(-2.0, 2.0) * x)


def _round(x: float) -> float:
    """The number rounded to two significant digits, as a user would write it down."""
    return float(f"{x:.2g}")
