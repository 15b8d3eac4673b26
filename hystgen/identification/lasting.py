"""Lasting steps of the output: an interferometer that slips by a fringe, a counter that wraps.

From one sample to the next the output moves by far more than its surroundings and the drive explain, and it stays
there. A model's offset would have to change at that sample; instead, the output from there on is shifted back. A
drop-out returns; an actuator's own jump goes where the drive pushes it and is undone on the way back. Neither is a
lasting step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import parallel
from hystgen.basics.problems import counted
from hystgen.identification import faults, pi
from hystgen.plays import operators
from hystgen.records import Record

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

AROUND = 7
"""[samples] Neighbours on either side with which a step is compared: a few more than an isolated fault has."""

CLEAR = 3.0
"""A lasting step is larger than this many times the largest bend among its neighbours. Set by: the records of
`benchmarks/` and of other makers, none of which has a lasting step."""

GRAINS = 4.0
"""[steps of the recorded numbers] A smaller step may come from the converter alone."""

EXPLAINED = 0.25
"""[fraction of the step] If a jump of the drive accounts for more than this, the step is the actuator's response."""

AGREES = 0.5
"""[fraction of the step] A step lasts if a fit to the whole record finds it as large as its neighbours do, within this,
and is not off by more than this inverted elsewhere: an isolated fault has 0 there, and so has a jump that is later
undone."""

RATE, USUAL = 0.5, 0.9
"""Where the drive's rate changes by more than this fraction of its quantile `USUAL`, a step may be due to that."""

ALONG = 0.9
"""More than this fraction of the actuator's own jumps go with the drive, up and down."""

NEARBY, RECURS = 0.1, 0.25
"""[fraction of the drive's range] The actuator's own jumps recur within this distance of each other, in more than a
quarter of the drive's passes: some are missing where a smaller loop does not undo the jump before."""

MOST = 50
"""Largest number of steps in a record; more belong to the actuator, or to a useless sensor."""

PLAYS = 12
"""Number of plays in the fit to the whole record."""
ROWS = 4000
"""[samples] Number compared in that fit."""

NEAR = 30
"""[samples] The size of a step comes from this many errors of that fit on either side, or fewer up to the next step or
turn."""

WHOLE_RANGE = 0.5
"""[fraction of the output's range] Larger jumps may be those of a wrapped counter."""

MODULUS = 0.02
"""[fraction of the range that a counter wraps at] Jumps whose sizes differ by more than this do not come from one
counter."""

LEFT = 0.25
"""[fraction of the rms error] A fit to the unwrapped output leaves less than this of the error with the jumps."""

WORDS = range(8, 49)
"""[bits] Lengths of counters that are named."""


@dataclass(frozen=True)
class Steps:
    """Lasting steps of one record: `at`, the first sample after each, `sizes` (k,), and the counter's `modulus`, None
    if it is not a counter that wraps."""

    at: Indices
    sizes: Array
    modulus: float | None = None

    def bridged(self, y: Array) -> Array:
        """The output (N,) with everything after each step shifted back."""
        moved = np.zeros(len(y))
        moved[self.at] = self.sizes
        return np.asarray(y - np.cumsum(moved))

    def sentence(self, record: Record) -> str:
        """The place and kind of the steps, and the correction."""
        unit = f" {record.units['y']}" if record.units.get("y") else ""
        first = int(self.at[0])
        place = f"sample {first} (t = {record.t[first]:.6g} s)" if record.timed else f"sample {first}"
        if self.modulus is not None:
            bits = _bits(self.modulus)
            named = f"a counter of {bits} bits" if bits else f"a counter that holds {self.modulus:.6g}{unit}"
            return (
                f"y wraps around {counted(len(self.at), 'time')}, by {self.modulus:.6g}{unit} as {named} does, the "
                f"first time at {place}; unwrapped"
            )
        sizes = [f"{size:+.4g}{unit}" for size in self.sizes]
        if len(self.at) == 1:
            what = f"y steps by {sizes[0]} at {place} and stays there"
        else:
            some = [f"{size} at sample {k}" for size, k in zip(sizes[1:4], self.at[1:4].tolist(), strict=True)]
            more = f" and {len(self.at) - 4} more" if len(self.at) > 4 else ""
            what = f"y steps by {sizes[0]} at {place}, {', '.join(some)}{more}, and stays there"
        return (
            f"{what} although the drive moves on evenly, as when a sensor slips by a fringe or is re-zeroed; "
            "bridged by an offset after each step"
        )


def bridged(record: Record) -> Record:
    """The record with lasting steps of y bridged and noted, or as it is if there are none."""
    found = steps(record)
    if found is None:
        return record
    assert record.y is not None
    y = found.bridged(np.asarray(record.y, dtype=np.float64))
    return replace(record, y=y, notes=(*record.notes, found.sentence(record)))


def steps(record: Record) -> Steps | None:
    """The lasting steps of a record's output, None if there are none."""
    if record.y is None or len(record.y) != len(record.v) or len(record) < 4 * AROUND:
        return None
    v, y = np.asarray(record.v, dtype=np.float64), np.asarray(record.y, dtype=np.float64)
    if not (np.isfinite(v).all() and np.isfinite(y).all()) or np.ptp(v) == 0.0 or np.ptp(y) == 0.0:
        return None
    move = np.diff(y)
    return _wrapped(v, y, move) or _slips(v, y, move, record.extra)


# A counter that wraps ------------------------------------------------------------------------------------------


def _wrapped(v: Array, y: Array, move: Array) -> Steps | None:
    """The jumps of a counter that wraps: from one end of its range to the other, against the motion, all of one size.

    A loop that switches from one end to the other jumps with the motion.
    """
    span = float(np.ptp(y))
    at = np.flatnonzero(np.abs(move) > WHOLE_RANGE * span)
    if not len(at) or len(at) > len(move) // AROUND:
        return None
    usual = _local(move, at)
    sizes = np.abs(move[at] - usual)
    modulus = float(np.median(sizes))
    if np.max(np.abs(sizes - modulus)) > MODULUS * modulus or span > (1.0 + MODULUS) * modulus:
        return None
    if np.array_equal(y, np.rint(y)):
        bits = _bits(modulus, MODULUS)
        modulus = 2.0**bits if bits else modulus
    clear = np.abs(usual) > 2.0 * float(np.median(np.abs(np.diff(move)))) / np.sqrt(AROUND)
    against = np.sign(usual) != np.sign(move[at])
    if not (clear & against).any() or np.count_nonzero(clear & ~against) > (1.0 - ALONG) * len(at):
        return None
    found = Steps(at + 1, np.sign(move[at]) * modulus, modulus)
    before, after = _Whole.of(v, y, np.empty(0, dtype=np.intp)), _Whole.of(v, found.bridged(y), at[:0])
    return found if after.rms < LEFT * before.rms else None


def _bits(modulus: float, within: float = 1e-9) -> int:
    """Length of the counter that wraps at this number, 0 if there is none."""
    return next((bits for bits in WORDS if abs(modulus / 2.0**bits - 1.0) <= within), 0)


def _local(x: Array, at: Indices) -> Array:
    """Median of x (N,) over the neighbours of samples `at`, without these."""
    return _median(x, at[:, None] + np.concatenate([np.arange(-AROUND, 0), np.arange(1, AROUND + 1)]))


def _median(x: Array, places: Indices) -> Array:
    """Median of x (N,) over each row of places, without those outside."""
    if not len(places):
        return np.empty(0)
    inside = (places >= 0) & (places < len(x))
    return np.asarray(np.nanmedian(np.where(inside, x[np.clip(places, 0, len(x) - 1)], np.nan), axis=1))


# Slips of a fringe ---------------------------------------------------------------------------------------------


def _slips(v: Array, y: Array, move: Array, columns: Mapping[str, Array]) -> Steps | None:
    at = _sudden(v, y, move)
    at = at[~_logged(at, columns)]
    at = _without_returns(at, move, len(y))
    if not 0 < len(at) <= MOST or _its_own(at, v, y, move):
        return None
    sudden = len(at)
    while True:
        whole, local = _Whole.of(v, y, at), move[at] - _local(move, at)
        lasting = np.abs(whole.sizes - local) < AGREES * np.abs(local)
        lasting &= np.abs(local) > AGREES * whole.rms
        if lasting.all():
            break
        at = at[lasting]
        if len(at) <= 0.5 * sudden:  # most jumps are undone later, so the others may be too
            return None
    found = Steps(at + 1, _sizes(v, y, at))
    # the rest must be a motion; an output that only jumps leaves none
    return found if float(np.sum(np.abs(found.sizes))) < float(np.ptp(found.bridged(y))) else None


def _logged(at: Indices, columns: Mapping[str, Array]) -> NDArray[np.bool_]:
    """The steps at which a logged column steps too, which may cause them: a load put on, another axis that moves."""
    beside = np.concatenate([np.arange(-AROUND, 0), np.arange(1, AROUND + 1)])
    found = np.zeros(len(at), dtype=np.bool_)
    for column in columns.values():
        size = np.abs(np.diff(np.asarray(column, dtype=np.float64)))
        around = np.max(size[np.clip(at[:, None] + beside, 0, len(size) - 1)], axis=1)
        found |= size[at] > CLEAR * around
    return found


def _its_own(at: Indices, v: Array, y: Array, move: Array) -> bool:
    """Whether steps of both signs all go where the drive pushes the output, and most times that it passes there, as an
    actuator's own jumps do."""
    signs = np.sign(move[at] - _local(move, at))
    drive = _local(np.diff(v), at)
    pushed = np.sign(faults.sensitivity(y, v) * drive)
    if len(np.unique(signs)) < 2 or float(np.mean(signs == pushed)) <= ALONG:
        return False
    often = []
    for k, here in enumerate(at.tolist()):
        alike = (signs == signs[k]) & (np.abs(v[at] - v[here]) < NEARBY * float(np.ptp(v)))
        above = v > v[here] if drive[k] > 0.0 else v < v[here]
        often.append(int(np.count_nonzero(alike)) / max(int(np.count_nonzero(above[1:] & ~above[:-1])), 1))
    return float(np.mean(often)) > RECURS


def _sudden(v: Array, y: Array, move: Array) -> Indices:
    """Moves of y from one sample to the next that stand out from all and from their neighbours, unlike the drive's."""
    size = np.abs(move)
    grain = float(np.min(size[size > 0.0], initial=np.inf))
    # a sudden step bends the course of y twice, by its own size, wherever the drive turns smoothly
    bend = np.abs(np.diff(move))
    usual = max(1.4826 * float(np.median(bend)), float(np.quantile(bend, faults.TAIL)) / faults.NORMAL_TAIL)
    least = max(0.5 * faults.OUTLYING * usual, GRAINS * grain, faults.LITTLE * float(np.ptp(y)))
    some = np.flatnonzero(np.maximum(np.append(bend, 0.0), np.insert(bend, 0, 0.0)) > least)
    some = some[(some > 0) & (some < len(move) - 1)]
    if not len(some) or len(some) > len(move) // 4:
        return some[:0]
    excess = np.abs(move[some] - _local(move, some))
    beside = np.concatenate([np.arange(-AROUND, 0), np.arange(1, AROUND + 1)])
    places = some[:, None] + beside
    inside = (places >= 0) & (places < len(move))
    others = np.where(inside, np.abs(move[np.clip(places, 0, len(move) - 1)] - _local(move, some)[:, None]), 0.0)
    slope = faults.sensitivity(y, v)
    drive = np.diff(v)
    pushed = np.abs(slope * (drive[some] - _local(drive, some)))
    sudden = (excess > least) & (excess > CLEAR * np.max(others, axis=1)) & (pushed < EXPLAINED * excess)
    at = some[sudden]
    # where the drive's rate jumps, a rate-dependent output does too, as the voltage of a cell when its current reverses
    ahead, behind = (_median(drive, at[:, None] + side) for side in (np.arange(-AROUND, 0), np.arange(1, AROUND + 1)))
    return np.asarray(at[np.abs(behind - ahead) < RATE * float(np.quantile(np.abs(drive), USUAL))])


def _without_returns(at: Indices, move: Array, samples: int) -> Indices:
    """The steps without those that a step of the same size soon reverses, as at the end of a drop-out."""
    soon = min(faults.LONGEST_DROP_OUT, samples // 20)
    kept, k = [], 0
    while k < len(at):
        if k + 1 < len(at) and at[k + 1] - at[k] <= soon:
            both = move[at[k]] + move[at[k + 1]]
            if abs(both) < EXPLAINED * abs(move[at[k]]):
                k += 2
                continue
        kept.append(at[k])
        k += 1
    return np.array(kept, dtype=np.intp)


@dataclass(frozen=True)
class _Whole:
    """A fit to a whole record of plays, a drift and a step after each sample `at`: the steps' `sizes` (k,), and the
    `rms` error."""

    sizes: Array
    rms: float

    @classmethod
    def of(cls, v: Array, y: Array, at: Indices) -> _Whole:
        """The fit; the plays start at rest, and their start is left out if a step is not in it."""
        r = np.linspace(0.0, pi.loop_reach(float(np.ptp(v))), PLAYS + 1)
        rows = operators.plays(v, r, np.full(len(r), v[0]))
        swept = np.maximum.accumulate(v) - np.minimum.accumulate(v) >= 2.0 * r[-1]
        settled = int(np.argmax(swept)) if swept[-1] else 0
        first = settled if settled < len(v) // 2 and (not len(at) or at[0] > settled + NEAR) else 0
        some = np.unique(np.linspace(first, len(v) - 1, ROWS).astype(np.intp))
        ones, drift = np.ones(len(v)), np.linspace(-1.0, 1.0, len(v))
        behind = np.arange(len(v)) > at[:, None]
        table = np.vstack([rows, ones, drift, behind])
        with parallel.one_thread():
            weights, *_ = np.linalg.lstsq(table[:, some].T, y[some], rcond=pi.SENSED_RANK)
        errors = y[some] - weights @ table[:, some]
        most = float(np.max(np.abs(errors)))  # squares of errors in an odd unit could overflow
        rms = most * float(np.sqrt(np.mean((errors / most) ** 2))) if most > 0.0 else 0.0
        return cls(np.asarray(weights[len(table) - len(at) :], dtype=np.float64), rms)


def _sizes(v: Array, y: Array, at: Indices) -> Array:
    """The size of each step, beside a smooth course of the output over time and drive up to the next turn or step."""
    steps = np.concatenate([[-1], at, [len(y) - 1]])
    edges = np.sort(np.concatenate([steps, pi.corners(v)]))
    found = []
    for k, here in enumerate(at.tolist(), start=1):
        least = (min(AROUND, here - int(steps[k - 1])), min(AROUND, int(steps[k + 1]) - here))
        first = here + 1 - max(least[0], min(NEAR, here - int(np.max(edges[edges < here]))))
        stop = here + 1 + max(least[1], min(NEAR, int(np.min(edges[edges > here])) - here))
        place = np.linspace(-1.0, 1.0, stop - first)
        drive = v[first:stop] - v[here]
        behind = np.arange(first, stop) > here
        table = np.column_stack([np.ones(len(place)), place, place**2, drive, behind])
        weights, *_ = np.linalg.lstsq(table, y[first:stop], rcond=pi.SENSED_RANK)
        found.append(weights[-1])
    return np.array(found)
