"""Calls that lead from one kink of a model to the next; searches and roundings are most error-prone at kinks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.jit import plain
from hystgen.compensator import reference
from hystgen.compensator.layout import FixedTables, Tables
from hystgen.plays import slots
from hystgen.plays.slots import Bytes

POINTS = 2000
"""Number of points in a path: following the plays one by one in Python takes about 0.1 s for this many."""

# Kinds of points on the path: a drive at which a play starts to follow, one at which a play would start to follow after
# a turn here, a limit of the drive, or any drive
FOLLOWS, TURNS, LIMIT, ANY = range(4)
SHARES = (0.6, 0.1, 0.2, 0.1)

# Fraction of the inverse's points after which a drive is committed, and fraction of these with the point's own drive
COMMITTED, THERE = 0.6, 0.7


@dataclass(frozen=True)
class Path:
    """Points in order: `op` is init, reset or step; each `drive` is inside the range; `output` is that of the
    forward operator after the call (meaningless for init); `risen` tells whether the output rose."""

    op: Bytes
    drive: NDArray[np.float64]
    output: NDArray[np.float64]
    risen: NDArray[np.bool_]


class _Textbook:
    """The plays of a model one by one, in double precision."""

    def __init__(self, tables: Tables | FixedTables) -> None:
        self.tables = tables
        self.front = reference.front(tables)
        self.kind = tables.threshold.dtype.type
        self.r = tables.threshold[1:].astype(float)
        self.begin(slots.OP_INIT)

    def begin(self, op: int) -> None:
        """The memory after init, or after reset."""
        start = np.array(self.tables.start, float) if op == slots.OP_INIT else np.zeros(1)
        states = np.broadcast_to(start, len(self.r) + 1)
        self.w, self.s = float(states[0]), states[1:].copy()
        self.drive, self.rising = np.nan, 1

    def drive_at(self, w: float, branch: int) -> float:
        """The drive that gives the plays the input w, or a drive beyond the range."""
        with plain():
            return float(self.front.front_inverse(self.tables, self.kind(w), branch if self.tables.branches else 1)[0])

    def move(self, drive: float) -> None:
        """Move to a drive."""
        if drive != self.drive and not np.isnan(self.drive):
            self.rising = int(drive > self.drive)
        self.drive = drive
        with plain():
            self.w = float(self.front.front_forward(self.tables, self.kind(drive), self.rising))
        self.s = np.clip(self.s, self.w - self.r, self.w + self.r)


def path(tables: Tables | FixedTables, real: np.dtype[Any], length: int, rng: np.random.Generator) -> Path:
    """A path through kinks of the current memory and of the memories after init and reset, each reached to within one
    last bit."""
    whole = real.kind == "i"
    low, high = (float(a) for a in tables.limits.drive[0])
    memory = _Textbook(tables)
    kinds = np.array([slots.OP_STEP, slots.OP_RESET, slots.OP_INIT], dtype=np.uint8)
    op = rng.choice(kinds, length, p=[0.9, 0.06, 0.04])
    point = rng.choice(4, length, p=SHARES)
    play, branch = rng.integers(0, max(len(memory.r), 1), length), rng.integers(0, 2, length)
    way, bits = rng.choice([-1, 1], length), rng.integers(-1, 2, length)
    drive = rng.uniform(low, high, length)
    for i in range(length):
        if op[i] != slots.OP_STEP:
            memory.begin(int(op[i]))
        to = float(drive[i])
        if point[i] == LIMIT:
            to = high if way[i] > 0 else low
        elif point[i] != ANY and len(memory.r) > 0:
            r = memory.r[play[i]]
            at = memory.w + 2 * way[i] * r if point[i] == TURNS else memory.s[play[i]] + way[i] * r
            to = memory.drive_at(float(at), int(branch[i]))
        to = min(max(to, low), high)
        to = float(real.type(np.rint(to) if whole else to))
        to += bits[i] * (1.0 if whole else float(np.spacing(np.abs(real.type(to)))))
        drive[i] = min(max(to, low), high)
        if op[i] != slots.OP_INIT:
            memory.move(float(drive[i]))
    output = _outputs(tables, op, drive)
    return Path(op, drive, output, np.diff(output, prepend=output[0]) >= 0)


def _outputs(tables: Tables | FixedTables, op: Bytes, drive: NDArray[np.float64]) -> NDArray[np.float64]:
    """The output after every call; a reset returns none, so a step with the same drive follows it."""
    times = np.where(op == slots.OP_RESET, 2, 1)
    last = np.cumsum(times) - 1
    calls = np.full(int(times.sum()), slots.OP_STEP, dtype=np.uint8)
    calls[last - times + 1] = op
    answers: NDArray[np.float64] = reference.answers(tables, False, calls, np.repeat(drive, times))[0][last]
    return answers.astype(float)


def along(
    path: Path, least: Any, inverse: bool, special: NDArray[np.float64], length: int, rng: np.random.Generator
) -> tuple[Bytes, NDArray[np.float64]]:
    """Operations and arguments that follow a path repeatedly, each time with different last bits.

    Points are approached and passed in steps of one or more last bits, in the direction of the move; some are requested
    again, or followed by a value far beyond. For the inverse, the references are the outputs along the path, and
    usually the drive of a point is committed, so that its memory stays on the path. Between init and the first sample
    there can be a commit and one of the `special` values. `least(x)`: smallest step of the type at x.
    """
    argument = path.output if inverse else path.drive
    span, room = float(np.ptp(argument)), float(np.ptp(path.drive))
    calls: list[tuple[int, float]] = []
    i = 0
    while len(calls) < length:
        at, op, drive = float(argument[i]), int(path.op[i]), float(path.drive[i])
        first, committed, again, which, there, crept = rng.random(6)
        if op == slots.OP_INIT:
            calls.append((op, at))
            if inverse and committed < 0.4:
                calls.append((slots.OP_COMMIT, drive))
            if first < 0.4:
                calls.append((slots.OP_STEP, float(rng.choice(special))))
        else:
            bit = float(least(at)) * (1 if crept < 0.6 else 2 ** int(rng.integers(1, 10)))
            steps = [int(rng.integers(-2, 3))] if first < 0.7 else list(range(-3, 4))
            for k in steps if path.risen[i] else steps[::-1]:
                calls.append((op, at + k * bit))
                op = slots.OP_STEP
            if again < 0.1:
                beyond = at + float(rng.choice([-1.0, 1.0])) * span
                calls.append((op, calls[-1][1] if which < 0.5 else beyond))
            if inverse and committed < COMMITTED:
                near = drive + float(rng.choice([-1.0, 1.0])) * room * 10.0 ** rng.uniform(-6, 0)
                calls.append((slots.OP_COMMIT, drive if there < THERE else near))
        i = (i + 1) % len(argument)
    ops, x = zip(*calls[:length], strict=True)
    return np.array(ops, dtype=np.uint8), np.array(x)
