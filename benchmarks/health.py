"""False alarms and detection of `emit --health` on blind stages.

    python -m benchmarks.health [--stages 60] [--sessions 5]

Each stage of `benchmarks.relays` is identified from one record and a held-out one, as `hystgen identify` does. The
watch then runs over further sessions with other drives, healthy ones first, and then with a gain that has changed.
Prints the share of windows with an alarm against the stated probability, and the share of changed windows detected.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Sequence

import numpy as np

import hystgen
from benchmarks.relays import Array, Stage, multisine
from hystgen.arithmetic import ARITHMETICS
from hystgen.compensator.health import MODEL_LEFT, Band, FloatWatch
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters

SECONDS = 1e-3
"""[s] Sample time. Chosen; no other was tried, and the watch counts samples, not seconds."""
SAMPLES = 12000
"""[samples] Length of a session: the next round number that holds five windows, of which the first gives the zero of
the sensor and four are judged."""
WINDOW = 2048
"""[samples] A window with about 100 independent means of the most coloured noise (0.9: 19 samples each)."""
PROBABILITIES = (0.1, 0.01, 1e-3)
"""Stated probabilities of a false alarm: those that 1200 windows can show."""
CHANGES = (0.002, 0.005, 0.01, 0.02, 0.05)
"""[fraction of the gain] Changes to be detected, from none detected to nearly all."""


def stage(seed: int) -> Stage:
    """Without mode and lag, since `identify` fits plays alone; noise white or coloured."""
    return Stage(seed, SECONDS, creep=0.002, lag=0.0, mode=None, noise=0.02, colour=(0.0, 0.5, 0.9)[seed % 3])


def identified(seed: int) -> tuple[Model, Stage]:
    """The model of a stage from two records, and the stage after them."""
    one = stage(seed)
    records = []
    for k in range(2):
        v = multisine(1000 * seed + k, SAMPLES, SECONDS)
        records.append({"t": np.arange(SAMPLES) * SECONDS, "v": v, "y": one.move(v)})
    with warnings.catch_warnings(action="ignore"):
        fit = hystgen.identify(records[:1], holdout=records[1:], name="m")
    return fit.model, one


def errors(model: Model, one: Stage, seed: int) -> tuple[Array, Array]:
    """Expected and measured displacement of a session. It begins with a sweep and a window, which are left out; the
    firmware takes the mean error of that window as the sensor's zero."""
    v = multisine(seed, SAMPLES, SECONDS, 4.0, 96.0)
    sweep = np.concatenate([np.linspace(2.0, 98.0, 500), np.linspace(98.0, v[0], 500)])
    with warnings.catch_warnings(action="ignore"):
        expected = np.asarray(model.simulate(np.concatenate([sweep, v])))
    measured = one.move(np.concatenate([sweep, v]))
    begin = len(sweep) + WINDOW
    zero = np.mean((measured - expected)[len(sweep) : begin])
    return expected[begin:], (measured - zero)[begin:]


def alarms(model: Model, sessions: Sequence[tuple[Array, Array]], probability: float) -> tuple[int, int]:
    """Windows with an alarm, and windows."""
    text = hystgen_text(model, probability)
    watch = FloatWatch(Band.of(parse_parameters(text)), ARITHMETICS["float32"])
    wrong = windows = 0
    for expected, measured in sessions:
        status, *_ = watch.update(expected, measured)
        ends = status[watch.band.window - 1 :: watch.band.window]
        wrong, windows = wrong + int(np.sum(ends == MODEL_LEFT)), windows + len(ends)
    return wrong, windows


def hystgen_text(model: Model, probability: float) -> str:
    """The model's parameter file with a sample time and this false-alarm probability."""
    from hystgen.parameters.files import dump_parameters

    emit = model.parameters.emit
    health = emit.health.model_copy(update={"false_alarms": probability, "window": WINDOW})
    update = {"sample_time": SECONDS, "emit": emit.model_copy(update={"health": health})}
    return dump_parameters(model.parameters.model_copy(update=update))


def main() -> None:
    """Print both tables."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--stages", type=int, default=60)
    asked.add_argument("--sessions", type=int, default=5)
    given = asked.parse_args()
    healthy = {p: np.zeros(2, int) for p in PROBABILITIES}
    changed = {c: np.zeros(2, int) for c in CHANGES}
    for seed in range(given.stages):
        model, one = identified(seed)
        sessions = [errors(model, one, 10_000 + 100 * seed + k) for k in range(given.sessions)]
        for p in PROBABILITIES:
            healthy[p] += alarms(model, sessions, p)
        for c in CHANGES:
            changed[c] += alarms(model, [(e, (1.0 + c) * m) for e, m in sessions], 1e-3)
    for p, (wrong, windows) in healthy.items():
        print(f"stated {p:g}: {wrong} of {windows} windows of healthy units, {wrong / windows:.2g}")
    for c, (found, windows) in changed.items():
        print(f"gain {100 * c:+g} %: {found} of {windows} windows, at a stated 0.001")


if __name__ == "__main__":
    main()
