"""Forward simulation of every effect: milliseconds of processor time for 60000 samples through 16 plays.

    python benchmarks/effects.py [--check]

The drive sweeps its whole range at 5 Hz, sampled at 10 kHz, so that half of the plays are always moving. Medians of
nine runs after compilation. With `--check` the exit code is 1 if an effect takes 50 ms or more; the limit is 150 ms for
plays that relax with an exponent, which are integrated with error control.
"""

from __future__ import annotations

import argparse
import statistics
import time
from typing import Any

import numpy as np

from hystgen import effects
from hystgen.cascade import PI, Cascade
from hystgen.chain.chain import Chain
from hystgen.effects import Effect, Run

SAMPLES, PLAYS = 60_000, 16
LIMIT, LIMIT_WITH_EXPONENT = 50.0, 150.0

CASES: tuple[dict[str, Any], ...] = (
    {"name": "creep", "time_constants": (0.1, 1.0), "weights": (0.02, 0.01)},
    {"name": "creep", "shape": "logarithmic", "per_decade": 0.01},
    {"name": "rate_dependence", "betas": (0.001,) * PLAYS},
    {"name": "rate_dependence", "shape": "relaxation", "time_constant": 0.003},
    {"name": "rate_dependence", "shape": "relaxation", "time_constant": 0.003, "exponent": 0.5},
    {"name": "rate_dependence", "shape": "relaxation", "time_constant": 0.003, "exponent": 2.0},
    {"name": "resonance", "frequency": 300.0, "damping": 0.02},
    {"name": "lag", "time_constant": 0.001},
    {"name": "delay", "time": 2.5e-4},
    {"name": "slew_limit", "rate": 1000.0},
    {"name": "saturation", "level": 80.0},
    {"name": "saturation", "shape": "hard", "level": 80.0},
    {"name": "thermal", "gain_per_degree": 0.01},
    {"name": "thermal", "source": "self_heating", "time_constant": 10.0, "heating": 1e-4, "gain_per_degree": 0.01},
    {"name": "drift", "rate": 0.1},
    {"name": "ageing", "loss": 0.1, "travel": 1e3},
    {"name": "ageing", "shape": "exponential", "loss": 0.1, "travel": 1e3},
    {"name": "sensor_nonlinearity", "coefficients": (0.01, 0.02), "scale": 50.0},
    {"name": "noncongruent", "coefficients": ((0.1,),) * PLAYS},
    {"name": "noncongruent", "shape": "centre", "amplitude": 0.3, "centre": 50.0, "width": 20.0},
)


def effect(case: dict[str, Any]) -> Effect:
    """The effect of a case, in the named shape or else in its first one."""
    shapes = effects.shapes(case["name"])
    word = case.get(shapes[0].selector)
    chosen = next((s for s in shapes if word and word in s.model_fields[s.selector].annotation.__args__), shapes[0])
    return chosen.model_validate(case)


def milliseconds(chain: Chain, run: Run) -> float:
    """Median processor time of a simulation."""
    chain.simulate([run])
    spent = []
    for _ in range(9):
        start = time.process_time()
        chain.simulate([run])
        spent.append(1e3 * (time.process_time() - start))
    return statistics.median(spent)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true")
    arguments = parser.parse_args()
    t = np.arange(SAMPLES) * 1e-4
    v = 50.0 + 50.0 * np.sin(2 * np.pi * 5 * t) * np.cos(2 * np.pi * 0.7 * t)
    run = Run(t, v, {"temperature": 20.0 + t})
    thresholds = np.linspace(0.0, 40.0, PLAYS + 1).tolist()
    cascade = Cascade(PI(thresholds, [0.5] + [0.05] * PLAYS), (), 0.0, (0.0, 100.0))
    rows = [("none", milliseconds(Chain(cascade, []), run), LIMIT)]
    for case in CASES:
        word = " ".join(str(case[key]) for key in ("shape", "source", "exponent") if key in case)
        limit = LIMIT_WITH_EXPONENT if "exponent" in case else LIMIT
        rows.append((f"{case['name']} {word}".strip(), milliseconds(Chain(cascade, [effect(case)]), run), limit))
    for name, spent, _ in rows:
        print(f"{name:38} {spent:6.1f} ms")
    return int(arguments.check and any(spent >= limit for _, spent, limit in rows))


if __name__ == "__main__":
    raise SystemExit(main())
