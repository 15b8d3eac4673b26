"""Iterative learning on blind stages: the error should fall in each of five passes, and never rise by more than noise.

    python -m benchmarks.learning [--stages 12] [--repetitions 3]

Each stage of `benchmarks.relays`, with creep, a lag and a mode, is identified from one record as `hystgen identify`
does. A raster of 5 Hz and about 9 um then runs through the model's inverse five times, each with the correction from
the pass before. Prints the rms error of each pass, over everything and below 40 Hz, and the noise of its mean, um.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Iterator

import numpy as np

import hystgen
from benchmarks.relays import Array, Stage, multisine
from hystgen.model import Model
from hystgen.service.learning import Learned

SECONDS = 1e-3
"""[s] Sample time: four or more samples in a period of every mode, 160 to 220 Hz. Chosen; no other was tried."""
SAMPLES = 6000
"""[samples] Length of the records for identification: 6 s. Chosen; no other was tried."""
PASSES = 5
"""Passes with a corrected reference, the number within which the error has to fall."""


def stage(seed: int) -> Stage:
    """A stage with every effect of the simulator."""
    return Stage(seed, SECONDS, mode=(160.0 + 10.0 * (seed % 7), 0.1), noise=0.004, colour=(0.0, 0.6)[seed % 2])


def raster(low: float, high: float, samples: int = 800) -> Array:
    """Four periods of a triangle of 5 Hz from `low` to `high`, whose turns are rounded over 40 ms."""
    phase = (np.arange(3 * samples) * 4.0 / samples) % 1.0
    x = np.convolve(1.0 - np.abs(2.0 * phase - 1.0), np.ones(40) / 40.0, "same")[samples : 2 * samples]
    return np.asarray(low + (high - low) * (x - x.min()) / np.ptp(x))


def identified(one: Stage) -> Model:
    """The model of a stage from one record."""
    v = multisine(one.seed, SAMPLES, SECONDS)
    with warnings.catch_warnings(action="ignore"):
        record = {"t": np.arange(SAMPLES) * SECONDS, "v": v, "y": one.move(v)}
        return hystgen.identify([record], name="m", thresholds=12).model


def passes(one: Stage, model: Model, repetitions: int, refit: bool = False) -> Iterator[Learned]:
    """Five passes: each is recorded and then corrected."""
    probe = np.asarray(model.simulate(np.array([2.0, 98.0, 20.0, 80.0])))
    wanted = raster(float(probe[2]), float(probe[3]))
    given, records = wanted, []
    t = np.arange(len(wanted)) * SECONDS
    for _ in range(PASSES):
        with warnings.catch_warnings(action="ignore"):
            v = np.asarray(model.inverse().simulate(np.tile(given, repetitions + 1)))
        y = one.move(v)
        for k in range(1, repetitions + 1):  # the first repetition comes from elsewhere
            part = slice(k * len(t), (k + 1) * len(t))
            records.append({"t": t, "v": v[part], "y": y[part], "u": given})
        found = hystgen.refine(
            model, records, reference={"t": t, "v": wanted, "u": wanted}, refit=len(records) == repetitions and refit,
        )
        yield found
        if found.reference is not None:
            given = found.reference


def below(found: list[Learned], hertz: float) -> list[float]:
    """rms error of each pass below a frequency."""
    lines = np.fft.rfftfreq(len(found[0].t), SECONDS) <= hertz
    return [
        float(np.std(np.fft.irfft(np.fft.rfft(each.error) * lines, len(each.t)))) for each in found
    ]


def main() -> None:
    """Print a line for each stage."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--stages", type=int, default=12)
    asked.add_argument("--repetitions", type=int, default=3)
    given = asked.parse_args()
    for seed in range(given.stages):
        one = stage(seed)
        model = identified(one)
        found = list(passes(one, model, given.repetitions))
        last = found[-1].report.passes
        errors = " ".join(f"{each.rms:.4f}" for each in last)
        c = found[0].report.correction
        low = " ".join(f"{each:.4f}" for each in below(found, 40.0))
        print(
            f"stage {seed}: {errors}; below 40 Hz {low}; noise {last[-1].floor:.4f}; "
            f"{' '.join(each.report.verdict for each in found)}; band {c.band if c else 0:.1f} Hz, "
            f"gamma {c.gamma if c else 1:.2f}", flush=True,
        )


if __name__ == "__main__":
    main()
