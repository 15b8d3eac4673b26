"""The samples that an emitted self-test runs, and their answers from the bit reference."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from hystgen.compensator import reference
from hystgen.compensator.layout import FixedTables, Tables
from hystgen.emission.options import Options
from hystgen.emission.text import literal
from hystgen.plays import slots

CALLS = {slots.OP_STEP: "s", slots.OP_COMMIT: "c", slots.OP_RESET: "r"}


def _fractions(length: int) -> list[float]:
    """Turning points of a shrinking swing, then a fixed pseudo-random walk, in parts of the range (0 .. 1)."""
    points = [0.5, 1.0, 0.0]
    points += [0.5 + 0.5 * (-0.86) ** k for k in range(1, 20)]
    points += [1.05, 1.0, 1.0, -0.05, 0.5]
    seed = 12345
    while len(points) < length // 3:
        seed = (seed * 1103515245 + 12345) % 2**31
        points.append((seed >> 12) / 2**19)
    path = []
    for a, b in itertools.pairwise(points):
        path += [a + (b - a) * part / 3 for part in range(3)]
    return path


def operators(numbers: Tables | FixedTables, options: Options) -> list[dict[str, Any]]:
    """One entry an operator: its name and its samples as C text."""
    found = []
    for name in ("forward", "inverse"):
        if getattr(options, name):
            found.append({"name": name, "samples": _samples(numbers, name == "inverse")})
    return found


def _samples(numbers: Tables | FixedTables, inverse: bool) -> list[dict[str, Any]]:
    def at(low: Any, high: Any, part: float) -> Any:
        """The argument that far along a range: in the arithmetic's own operations, or the nearest code there is."""
        if numbers.fixed:
            most = int(numbers.limits[slots.CODE_MAX])
            return min(max(round(int(low) + (int(high) - int(low)) * part), -most - 1), most)
        real = numbers.threshold.dtype.type
        return low + (high - low) * real(part)

    first = slots.OUTPUT_MIN if inverse else slots.DRIVE_MIN
    low, high = numbers.limits[first], numbers.limits[first + 1]
    drive_low, drive_high = numbers.limits[slots.DRIVE_MIN], numbers.limits[slots.DRIVE_MAX]
    calls, arguments = [], []
    for i, part in enumerate(_fractions(180)):
        calls.append(slots.OP_STEP)
        arguments.append(at(low, high, part))
        if inverse and i % 23 == 22:
            calls.append(slots.OP_COMMIT)
            arguments.append(at(drive_low, drive_high, 0.3 + i / 1000.0))
        if i == 120:
            calls.append(slots.OP_RESET)
            arguments.append(at(low, high, 0.25))
    x = np.array(arguments, dtype=numbers.threshold.dtype)
    answers, status = reference.answers(numbers, inverse, calls, x, compiled=False)
    return [
        {"call": CALLS[c], "argument": literal(a), "answer": literal(y), "status": int(s)}
        for c, a, y, s in zip(calls, x, answers, status, strict=True)
    ]
