"""Closed simulation: the plants of the cases, driven by compensators that the package makes from their records.

`identify` and `diagnose` fit models to the records; their inverses, as the emitted C computes them (`simulate
--arithmetic float32`, to whose bits `verify` holds the C), turn a reference found in no record into a drive, to which
the plant responds on its own fine grid. The package is called only through its command line.

It prints the rms error about its mean, in per cent of the reference's range, for a straight line, for the plays that
`identify` finds and for the model that `diagnose` writes, and the ratio of the last two.
"""

from __future__ import annotations

import itertools
import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import labels
from .case import OPEN, REPORT, SMALL, Case, contents, in_turn, make
from .run import COMMAND
from .session import FINER, Planned

Array = NDArray[np.float64]

EFFECTS = (
    "creep", "lag", "rate_dependence", "asymmetry", "saturation", "resonance", "delay", "noncongruent", "slew_limit",
    "ageing", "thermal",
)  # fmt: skip
"""Tracked effects: all but drift, which needs a clock, and sensor nonlinearity, which is not an error of the stage."""

PAIRS = "pairs"
"""Plants with two effects."""

FAST = ("lag", "rate_dependence", "resonance", "delay", "slew_limit")
"""Effects that are tracked at the rate of the bench's fast records."""

LENGTH, SWEEP = 3000, 400
"""Samples of a reference, and of one sweep over its range; the first two sweeps do not count."""

SLOWEST = 60
"""Samples in the fastest half wave of a reference."""

GOOD = 2.0, 0.05
"""The error of a good compensator is at most this multiple of the held-out residual, or this many per cent."""

INSIDE = 0.1
"""Distance of a reference from the ends of the output, as a fraction of the output's range over the drive range."""


@dataclass(frozen=True)
class Tracked:
    """Residual errors on one plant, rms in % of the reference's range; `named`: whether its effects were named."""

    effect: str
    seed: int
    named: bool
    line: float
    plays: float
    whole: float
    holdout: float
    words: str

    @property
    def ratio(self) -> float:
        return self.whole / self.plays

    @property
    def good(self) -> bool:
        multiple, least = GOOD
        return self.whole <= max(multiple * self.holdout, least)


def reference(rng: np.random.Generator, low: float, high: float) -> Array:
    """Two sweeps over the range, then smooth noise, a raster and steps with rounded edges."""
    up = np.linspace(low, high, SWEEP)
    parts = [up, up[::-1]]
    rest = LENGTH - 2 * SWEEP
    knots = np.arange(0, rest // 3 + SLOWEST, SLOWEST)
    heights = rng.uniform(0.0, 1.0, len(knots))
    at = np.arange(rest // 3)
    place = at / SLOWEST
    k = place.astype(int)
    soft = 0.5 - 0.5 * np.cos(np.pi * (place - k))
    smooth = heights[k] + (heights[k + 1] - heights[k]) * soft
    raster = np.abs((at / (2.5 * SLOWEST)) % 2.0 - 1.0)
    steps = np.repeat(rng.uniform(0.1, 0.9, rest // 240 + 2), 80)[: rest - 2 * (rest // 3)]
    edge = np.hanning(31)
    longer = np.concatenate([np.full(15, steps[0]), steps, np.full(15, steps[-1])])
    steps = np.convolve(longer, edge / edge.sum(), "valid")
    joined = np.zeros(1)
    for part in (smooth, raster, steps):  # joined by straight moves
        joined = np.concatenate([joined, np.linspace(joined[-1], part[0], SLOWEST), part])
    return np.concatenate([*parts, low + (high - low) * joined[:rest]])


def rooms(case: Case) -> Array:
    """Temperature along a reference: three waves over the records' temperature range, from their first temperature."""
    seen = case.session.temperature
    low, high = float(seen.min()), float(seen.max())
    level = 2.0 * (seen[0] - low) / (high - low) - 1.0 if high > low else 0.0
    phase = np.arcsin(np.clip(level, -1.0, 1.0)) + 6.0 * np.pi * np.arange(LENGTH) / LENGTH
    return 0.5 * (low + high) + 0.5 * (high - low) * np.sin(phase)


def answer(case: Case, drive: Array, room: Array, rate: float) -> Array:
    """Output of the plant for each sample of a drive and room temperature, from rest at the first value."""
    held = np.full(LENGTH, drive[0])  # ringing at the start has decayed after these samples
    drive, room = np.concatenate([held, drive]), np.concatenate([np.full(LENGTH, room[0]), room])
    n = len(drive)
    before = np.geomspace(1e-4, 1.0, 50) * 5.0 * max(case.session.bench.long, n / rate)
    fine = before[-1] + ((np.arange(FINER * n) + 0.5) / FINER + 0.5) / rate
    times = before[-1] + (np.arange(n) + 1.0) / rate
    t = np.concatenate([before, fine])
    v = np.interp(t, times, drive)
    planned = Planned("reference", True, rate, len(before), n)
    heat = np.interp(t, times, room)
    stage = replace(case.session, t=t, v=v, records=(planned,), history=None, rest=None, temperature=heat)
    return stage.sampled(case.plant.respond(stage, case.session), planned)[LENGTH:]


def plant(effect: str, seed: int, samples: int = SMALL) -> Case:
    """The case of one effect, or of a pair of them; `seed` counts within the report block."""
    if effect == PAIRS:
        fits = (k for k in itertools.count(REPORT) if set(contents("pair", k)[0]) <= set(EFFECTS))
        return make("pair", next(itertools.islice(fits, seed, None)), samples)
    if effect == OPEN:
        return make("open", REPORT + seed, samples)
    number = in_turn().index(effect) + len(in_turn()) * seed
    return make("single", REPORT + _aligned(number), samples)


def track(effect: str, seed: int, samples: int = SMALL) -> Tracked:
    """One plant with one effect, or with a pair of them."""
    case = plant(effect, seed, samples)
    names = [each.name for each in case.plant.effects]
    assert effect in (PAIRS, *names)
    rate = case.session.bench.rates[1 if set(names) & set(FAST) else 0]
    with tempfile.TemporaryDirectory() as place:
        home = labels.write(case, Path(place), with_rivals=False)
        session = json.loads((home / "session.json").read_text())
        words = [*session["fit"], *(word for name in session["holdout"] for word in ("--holdout", name))]
        if session["history"]:
            words.append("--history=" + ",".join(f"{x:g}" for x in session["history"]))
        if session["rest"]:
            words.append(f"--rest={session['rest']:g}")
        _call(home, "identify", *words, "-o", "plain.yaml", "--units", "V,um")
        _call(home, "diagnose", "plain.yaml", *words, "-o", "out")
        found = json.loads((home / "out" / "diagnosis.json").read_text())
        shutil.copy(home / "out" / "params.yaml", home / "whole.yaml")
        outputs = np.concatenate([columns["y"] for columns in case.measured])
        drives = np.concatenate([columns["v"] for columns in case.measured])
        stand = case.session.bench
        # a line fit gives the ends: a ringing stage goes further, but no drive can hold it there
        low, high = np.polyval(np.polyfit(drives, outputs, 1), [stand.low, stand.high]).tolist()
        low, high = low + INSIDE * (high - low), high - INSIDE * (high - low)
        u = reference(np.random.default_rng(seed), low, high)
        room = rooms(case)
        rows = np.column_stack([np.arange(len(u)) / rate, u, room])
        np.savetxt(home / "reference.csv", rows, delimiter=",", header="t,u,temperature", comments="", fmt="%.12g")
        slope, start = np.polyfit(outputs, drives, 1)
        tried = {"line": np.clip(start + slope * u, stand.low, stand.high)}
        for name in ("plain", "whole"):
            with (home / f"{name}.yaml").open("a") as file:
                file.write(f"sample_time: {1.0 / rate!r}\n")
                heated = "thermal" in names  # this may mean self-heating by the drive
                if name == "whole":  # references here have no noise
                    asked = ", compensate: [self_heating]" * heated
                    file.write(f"emit:\n  compensation: {{noise_gain: 1.0e+9{asked}}}\n")
            _call(home, "simulate", f"{name}.yaml", "reference.csv", "--operator", "inverse", "--arithmetic", "float32",
                  "-o", f"{name}.csv")  # fmt: skip
            tried[name] = np.genfromtxt(home / f"{name}.csv", delimiter=",", names=True, deletechars="")["v"]
    left = {}
    for name, drive in tried.items():
        error = (answer(case, drive, room, rate) - u)[2 * SWEEP :]
        left[name] = 100.0 * float(np.std(error)) / (high - low)
    named = [entry["name"] for entry in found["effects"]]
    alike = {name for pair in found["not_separable"] if set(pair) & set(named) for name in pair}
    holdout = 100.0 * found["gap"]["after"]["holdout"] / (high - low)
    words = ", ".join(named) or found["verdict"]
    if effect == PAIRS:
        words = f"{words} ({', '.join(names)})"
    return Tracked(effect, seed, set(names) <= {*named, *alike}, left["line"], left["plain"], left["whole"], holdout,
                   words)  # fmt: skip


def _aligned(number: int) -> int:
    """The seed in the report block for effect number `number`: from seed 0 on, cases take the effects in turn."""
    return number - REPORT % len(in_turn())


def _call(folder: Path, *words: Any) -> None:
    done = subprocess.run([*COMMAND, *words], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(words)}: {done.stderr[-1500:]}")


def _tried(task: tuple[str, int]) -> Tracked | tuple[str, int, str]:
    try:
        return track(*task)
    except RuntimeError as error:
        return (*task, str(error))


def table(rows: Sequence[Tracked]) -> Iterator[str]:
    """A row for each plant, then the medians of those whose effects were named."""
    yield f"{'effect':16} {'seed':>4} {'line':>7} {'plays':>7} {'whole':>7} {'ratio':>6} {'held out':>8}  found"
    for row in rows:
        mark = " " if row.named else "*"
        yield (
            f"{row.effect:16} {row.seed:4} {row.line:7.3f} {row.plays:7.3f} {row.whole:7.3f} {row.ratio:6.2f}{mark}"
            f"{row.holdout:8.3f}  {row.words}"
        )
    yield ""
    for effect in dict.fromkeys(row.effect for row in rows):
        ratios = [row.ratio for row in rows if row.effect == effect and row.named]
        if ratios:
            yield f"{effect:16} median {np.median(ratios):.3f}, largest {max(ratios):.3f} of {len(ratios)} named"
    multiple, least = GOOD
    good = sum(row.good for row in rows)
    yield f"{good} of {len(rows)} leave at most {multiple:g} times the held-out residual, or {least:g} %"
    yield "rms about the mean, % of the reference's range; *: another name was found, or none"


def main(effects: Sequence[str], seeds: range, jobs: int) -> int:
    """Print the table. Returns 1 if a plant failed."""
    tasks = [(effect, seed) for effect in effects or EFFECTS for seed in seeds]
    rows, failed = [], []
    with ProcessPoolExecutor(jobs) as pool:
        for number, found in enumerate(pool.map(_tried, tasks), 1):
            print(f"{number}/{len(tasks)}", file=sys.stderr, flush=True)
            if isinstance(found, Tracked):
                rows.append(found)
            else:
                failed.append(found)
    print(*table(rows), sep="\n")
    for effect, seed, message in failed:
        print(f"{effect} {seed}: {message}")
    return int(bool(failed))


