"""A stage in plain loops, which share nothing with the package: a lag, plays as stops and springs, and creep."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence

STEP = 0.01
NOISE = 0.002
MODEL = """\
hystgen: 1
name: stage_x
units: {input: V, output: um}
sample_time: 0.01
input_range: [0, 100]
model: {pi: {thresholds: [0, 5, 12, 25], weights: [0.10, 0.02, 0.015, 0.01]}}
"""


def drive(seed: int, samples: int = 1000) -> list[float]:
    """Moves up and down at three speeds, with holds between some of them."""
    rng = random.Random(seed)
    v, now = [0.0], 0.0
    for target in [100.0, 0.0] + [rng.uniform(0.0, 100.0) for _ in range(200)]:
        steps = max(1, int(abs(target - now) / rng.choice([50.0, 200.0, 400.0]) / STEP))
        v += [now + (target - now) * (k + 1) / steps for k in range(steps)]
        v += [target] * rng.choice([0, 0, 40, 120])
        now = target
    return v[:samples]


def stage(v: Sequence[float], creep: float, lag: float, seed: int) -> list[float]:
    """A lag of the drive, stops and springs, creep at four time constants a factor of three apart; ten steps a sample.

    `creep`: amount of each; `lag`: time constant in s, 0 for none.
    """
    rng = random.Random(seed)
    stretch, slow = [0.0, 0.0, 0.0], [0.0] * 4
    before = here = 0.0
    shares = [1.0 - math.exp(-0.1 * STEP / (0.4 * 3.0**k)) for k in range(4)]
    y = []
    for each in v:
        for k in range(1, 11):
            asked = before + (each - before) * (k - 0.5) / 10.0
            move = (asked - here) * (1.0 - math.exp(-0.1 * STEP / lag)) if lag else (each - before) / 10.0
            here += move
            for j, reach in enumerate((5.0, 12.0, 25.0)):
                stretch[j] = max(-reach, min(reach, stretch[j] + move))
            h = 0.145 * here - 0.02 * stretch[0] - 0.015 * stretch[1] - 0.01 * stretch[2]
            for j, share in enumerate(shares):
                slow[j] += (h - slow[j]) * share
        before = each
        y.append(h + creep * sum(slow) + rng.gauss(0.0, NOISE))
    return y


def record_text(seed: int, creep: float = 0.0, lag: float = 0.0, header: str = "t,v,y") -> str:
    """A record as CSV."""
    v = drive(seed)
    rows = enumerate(zip(v, stage(v, creep, lag, seed), strict=True))
    return "\n".join([header, *(f"{k * STEP:.4f},{a:.6f},{b:.6f}" for k, (a, b) in rows), ""])
