"""Random parameter files of all kinds that the package accepts, for one arithmetic at a time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

Generator = np.random.Generator

# Decades of weights and thresholds below the largest that an arithmetic resolves
DECADES = {"float32": 12.0, "float64": 12.0, "q31": 6.0, "q15": 2.5}
MOST_PLAYS = {"float32": 64, "float64": 64, "q31": 48, "q15": 24}


def parameters(rng: Generator, arithmetic: str, name: str) -> dict[str, Any]:
    """A parameter file as plain data. Some are refused, since the package decides what fits an arithmetic."""
    fixed = arithmetic in ("q15", "q31")
    unit_in, unit_out = (10.0 ** (rng.uniform(-9, 9) if rng.random() < 0.5 else rng.uniform(-1, 2)) for _ in range(2))
    low, high = _range(rng, fixed)
    stages = _stages(rng, low, high)
    w = _image(stages, low, high)
    pi = _plays(rng, arithmetic, w, with_inverse=bool(rng.random() < 0.97))
    offset = 0.0
    total = sum(pi["weights"]) * (w[1] - w[0])
    if rng.random() < 0.5:
        offset = float(rng.normal() * total * (10.0 ** rng.uniform(-3, 1.0 if fixed else 3)))
    model: dict[str, Any] = {"pi": pi}
    if stages:
        model["memoryless"] = stages if len(stages) > 1 or rng.random() < 0.5 else stages[0]
    _scale(model, unit_in, unit_out)
    if offset:
        model["output_offset"] = offset * unit_out
    made: dict[str, Any] = {
        "hystgen": 1, "name": name, "input_range": [low * unit_in, high * unit_in], "model": model,
    }  # fmt: skip
    if fixed and rng.random() < 0.2:  # coarser than necessary
        codes = (2**31 - 1) if arithmetic == "q31" else (2**15 - 1)
        made["emit"] = {"drive_lsb": max(map(abs, made["input_range"])) / codes * 10.0 ** rng.uniform(0.01, 1.5)}
    return made


def _range(rng: Generator, fixed: bool) -> tuple[float, float]:
    """Range of the drive: around 0, from or to 0, or away from 0."""
    kind = rng.integers(6)
    if kind == 0:
        return -1.0, 1.0
    if kind == 1:
        return 0.0, 1.0
    if kind == 2:
        return -float(rng.uniform(0.01, 2)), float(rng.uniform(0.01, 2))
    if kind == 3:
        return -1.0, 0.0
    away = 10.0 ** rng.uniform(-1, 0.7 if fixed else 3)
    return (away, away + 1.0) if kind == 4 else (-away - 1.0, -away)


def _stages(rng: Generator, low: float, high: float) -> list[dict[str, Any]]:
    kinds = rng.choice(
        ["", "dead_zone", "tanh", "branches", "dead_zone tanh", "tanh dead_zone", "dead_zone branches",
         "branches dead_zone", "tanh tanh", "dead_zone dead_zone"],
        p=[0.4, 0.17, 0.09, 0.14, 0.04, 0.04, 0.04, 0.04, 0.02, 0.02],
    )  # fmt: skip
    stages: list[dict[str, Any]] = []
    for kind in kinds.split():
        ends = _image(stages, low, high)
        stages.append(_dead_zone(rng, *ends) if kind == "dead_zone" else _tanh(rng, *ends, kind == "branches"))
    return stages


def _dead_zone(rng: Generator, low: float, high: float) -> dict[str, Any]:
    count = int(rng.choice([1, 2, 3, 5, 10, 20, 40]))
    span = high - low
    breaks = rng.uniform(low - 0.1 * span, high + 0.1 * span, count)
    if count > 1 and rng.random() < 0.3:  # crowded
        breaks = breaks[0] + span * 10.0 ** rng.uniform(-4, -1) * np.arange(count)
    slopes = 10.0 ** rng.uniform(-rng.choice([0.1, 1.0, 2.0]), 0, count + 2)
    thresholds = sorted({0.0, *map(float, breaks)})
    zero = thresholds.index(0.0)
    weights = [0.0] * len(thresholds)
    weights[zero] = float(slopes[0])
    for side in (range(zero + 1, len(thresholds)), range(zero - 1, -1, -1)):
        at = weights[zero]
        for j in side:  # the partial sums are the slopes
            weights[j] = float(slopes[j % len(slopes)]) - at
            at += weights[j]
    return {"kind": "dead_zone", "thresholds": thresholds, "weights": weights}


def _tanh(rng: Generator, low: float, high: float, two: bool) -> dict[str, Any]:
    """An envelope whose argument stays below about 2.5 over the range; a second, descending branch lies above."""
    ends = sorted(rng.uniform(-1, 1, 2) * rng.choice([0.2, 1.0, 2.5]))
    a1 = (ends[1] - ends[0]) / (high - low) + 1e-3 / (high - low)
    a2 = ends[0] - a1 * low
    a0 = 10.0 ** rng.uniform(-1, 1) / a1
    a3 = float(rng.normal()) * a0 * float(rng.choice([0.0, 0.1, 1.0]))
    sign = float(rng.choice([-1, 1]))
    up = {"a0": sign * a0, "a1": sign * a1, "a2": sign * a2, "a3": a3}
    stage: dict[str, Any] = {"kind": "tanh", "ascending": up}
    if two:
        gap = 10.0 ** rng.uniform(-6, -0.3)
        down = dict(up)
        if rng.random() < 0.7:
            down["a3"] = a3 + gap * a0 * (high - low) * a1
        if rng.random() < 0.5:
            down["a2"] = sign * (a2 + gap * a1 * (high - low))
        if rng.random() < 0.3:  # of another shape, and lifted until it lies above
            down["a0"] *= 1 + float(rng.uniform(-0.05, 0.05))
            down["a1"] *= 1 + float(rng.uniform(-0.05, 0.05))
            x = np.linspace(low, high, 1001)
            below = min(0.0, float(np.min(_tanh_values(down, x) - _tanh_values(up, x))))
            down["a3"] -= below - gap * a0 * 1e-2
        if down == up:
            down["a3"] = a3 + gap * a0
        stage["descending"] = down
    return stage


def _tanh_values(a: dict[str, float], x: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    return np.asarray(a["a0"] * np.tanh(a["a1"] * x + a["a2"]) + a["a3"])


def _image(stages: list[dict[str, Any]], low: float, high: float) -> tuple[float, float]:
    """Range of the output of the stages, each of which rises on both branches."""

    def value(stage: dict[str, Any], x: float, branch: str) -> float:
        if stage["kind"] == "tanh":
            a = stage.get(branch, stage["ascending"])
            return a["a0"] * math.tanh(a["a1"] * x + a["a2"]) + a["a3"]
        total = 0.0
        for rho, eta in zip(stage["thresholds"], stage["weights"], strict=True):
            total += eta * (max(x - rho, 0.0) if rho > 0 else min(x - rho, 0.0) if rho < 0 else x)
        return total

    ends = []
    for branch in ("ascending", "descending"):
        a, b = low, high
        for stage in stages:
            a, b = value(stage, a, branch), value(stage, b, branch)
        ends.append((a, b))
    return min(e[0] for e in ends), max(e[1] for e in ends)


def _plays(rng: Generator, arithmetic: str, w: tuple[float, float], with_inverse: bool) -> dict[str, Any]:
    n = int(rng.choice([0, 1, 2, 3, 5, 8, 13, 24, MOST_PLAYS[arithmetic]]))
    if rng.random() < 0.01 and not arithmetic.startswith("q"):
        n = 128
    span = w[1] - w[0]
    thresholds = _thresholds(rng, arithmetic, n, span)
    n = len(thresholds) - 1
    decades = DECADES[arithmetic]
    kind = rng.integers(4)
    if kind == 0:  # over all decades
        weights = 10.0 ** rng.uniform(-decades, 0, n + 1)
    elif kind == 1:
        weights = rng.uniform(0.2, 1, n + 1)
    elif kind == 2:  # falling
        weights = np.exp(-np.arange(n + 1) * rng.uniform(0, 0.3 if arithmetic != "q15" else 0.1))
    else:
        weights = 10.0 ** rng.uniform(-1, 1, n + 1)
    p0 = rng.integers(4)
    if p0 == 0 and n:  # flat until the first play follows
        weights[0] = weights[1:].sum() * 10.0 ** -rng.uniform(1, min(decades / 2, 6))
    elif p0 == 1:
        weights[0] = weights.max()
    if n and rng.random() < 0.2:
        weights[1:][rng.random(n) < 0.3] = 0.0
    if not with_inverse and n:
        weights[0] = 0.0
        weights[1] = 1.0
    pi: dict[str, Any] = {"thresholds": thresholds, "weights": [float(x) for x in weights]}
    start = _start(rng, np.array(thresholds), w)
    if start is not None:
        pi["initial_state"] = start
    return pi


def _thresholds(rng: Generator, arithmetic: str, n: int, span: float) -> list[float]:
    """Thresholds in the unit of the plays' input: even, geometric, random, crowded or wider than the range."""
    fixed = arithmetic.startswith("q")
    kind = rng.integers(6)
    reach = span * float(rng.choice([0.05, 0.4, 0.5, 1.0, 1.3, 100.0 if not fixed else 1.0]))
    if kind == 0:
        r = reach * np.arange(1, n + 1) / max(n, 1)
    elif kind == 1:
        r = reach * np.geomspace(10.0 ** -rng.uniform(0.5, {"q15": 2.0, "q31": 5.0}.get(arithmetic, 9.0)), 1, n)
    elif kind == 2:  # neighbours only some last bits apart
        least = {"q15": 2.0**-13, "q31": 2.0**-28, "float32": 2.0**-22}.get(arithmetic, 2.0**-50)
        r = reach * (rng.uniform(0.1, 1) + np.cumsum(rng.integers(1, 6, n)) * least * 2.0 ** rng.integers(0, 4))
    elif kind == 3:  # in a few groups
        centres = rng.uniform(0.05, 1, 3)
        r = reach * np.abs(rng.choice(centres, n) + rng.normal(0, 10.0 ** -rng.uniform(1, 3), n))
    else:
        r = reach * rng.uniform(0.001, 1, n)
    least = span * {"q15": 2.0**-13, "q31": 2.0**-28, "float32": 1e-30}.get(arithmetic, 1e-30)
    kept = [0.0]
    for x in sorted(map(float, r)):
        if x > kept[-1] + least:
            kept.append(x)
    return kept


def _start(rng: Generator, r: np.ndarray[Any, Any], w: tuple[float, float]) -> float | list[float] | None:
    """A start memory: none, one number (inside or outside), or a list (left by a history, with slack, inadmissible)."""
    n, span = len(r) - 1, w[1] - w[0]
    kind = rng.integers(8)
    if kind <= 1:
        return None
    inside = float(rng.uniform(*w))
    if kind == 2:
        return inside
    if kind == 3:
        return inside + span * float(rng.normal()) * float(rng.choice([0.5, 2.0]))
    if kind == 4:
        return float(rng.normal() * span)
    if kind == 5:  # left by a history
        s = np.zeros(n + 1)
        for at in [*rng.uniform(*w, int(rng.integers(1, 8)))]:
            s = np.clip(s, at - r, at + r)
        return [float(x) for x in s]
    s = np.empty(n + 1)
    s[0] = inside
    for i in range(1, n + 1):
        reach = r[i] - r[i - 1]
        s[i] = s[i - 1] + reach * (rng.uniform(-1, 1) if kind == 6 else rng.uniform(-3, 3))
    return [float(x) for x in s]


def _scale(model: dict[str, Any], unit_in: float, unit_out: float) -> None:
    """Convert the input of the first stage and the weights of the plays to other units."""
    stages = model.get("memoryless", [])
    stages = stages if isinstance(stages, list) else [stages]
    pi = model["pi"]
    if not stages:
        pi["thresholds"] = [x * unit_in for x in pi["thresholds"]]
        pi["weights"] = [x * unit_out / unit_in for x in pi["weights"]]
        start = pi.get("initial_state")
        if start is not None:
            pi["initial_state"] = [x * unit_in for x in start] if isinstance(start, list) else start * unit_in
        return
    pi["weights"] = [x * unit_out for x in pi["weights"]]
    first = stages[0]
    if first["kind"] == "tanh":
        for branch in ("ascending", "descending"):
            if branch in first:
                first[branch]["a1"] /= unit_in
    else:
        first["thresholds"] = [x * unit_in for x in first["thresholds"]]
        first["weights"] = [x / unit_in for x in first["weights"]]


def text(data: dict[str, Any]) -> str:
    """The parameter file; JSON is YAML."""
    return "\n".join(["# drawn at random by tests/oracle", *_lines(data, "")]) + "\n"


def _lines(data: dict[str, Any], indent: str) -> list[str]:
    lines: list[str] = []
    for key, value in data.items():
        if isinstance(value, dict) and not (set(value) & {"a0"}):
            lines += [f"{indent}{key}:", *_lines(value, indent + "  ")]
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            lines.append(f"{indent}{key}:")
            for entry in value:
                inner = _lines(entry, indent + "    ")
                lines += [f"{indent}  - {inner[0].strip()}", *inner[1:]]
        else:
            lines.append(f"{indent}{key}: {_flow(value)}")
    return lines


def _flow(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k}: {_flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_flow, value)) + "]"
    if isinstance(value, float):
        written = repr(float(value))  # YAML takes 1e-5 for text
        return written if "e" not in written or "." in written else written.replace("e", ".0e")
    return str(value)
