"""What a record has to be: small faults of a table are repaired and counted, larger ones refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.words import counted
from hystgen.records.reading import Reading, Table
from hystgen.records.record import Array, Record

SHORTEST = 16
"""Fewest samples of a record that a model is fitted to."""

REPAIRABLE = 0.05
"""Largest share of samples that is dropped with a note; beyond it a file is refused."""

GAP = 3.0
"""A step longer than this many median steps is a gap."""


def repaired(reading: Reading, table: Table) -> Record:
    """The record of a table, which is used up. Raises RecordError with every problem."""
    columns = table.numbers
    length = len(next(iter(columns.values()), ()))
    keep = np.ones(length, dtype=bool)
    needed = [name for name in reading.need if name in columns]
    if "t" in columns:
        needed.append("t")
    for name in dict.fromkeys(needed):
        keep &= np.isfinite(columns[name])
    fills = "; ".join(said for name, said in reading.fills.items() if name in needed)
    which = f"without a value in {' or '.join(dict.fromkeys(needed))}{f' ({fills})' if fills else ''}"
    _drop(reading, table, length, ~keep, which)
    reading.notes += [f"{name}: {said}" for name, said in reading.fills.items() if name not in needed]
    if "t" in columns and _repeats(columns["t"][keep]):
        columns["t"] = _even(reading, table, columns["t"], keep)
    elif "t" in columns:
        keep = _rising(reading, table, columns["t"], keep)
    samples = int(np.count_nonzero(keep))
    if samples < length:
        # One at a time, so that only one column is there twice
        for name in columns:
            columns[name] = columns[name][keep]
    fit = "y" in reading.need
    shortest = SHORTEST if fit else 1
    if samples < shortest and not reading.problems:
        reading.problem(f"has {counted(samples, 'sample')}, at least {shortest} are needed; record for longer")
    elif fit and samples and not reading.problems and "v" in columns and float(np.ptp(columns["v"])) == 0.0:
        reading.problem(
            f"the drive v is {columns['v'][0]:g} throughout; a fit needs a drive that moves, check the columns"
        )
    reading.refuse_if_any()
    t: Array
    if "t" in columns:
        t = columns.pop("t")
        step = _step(reading, t)
    else:
        step = reading.sample_time or 1.0
        t = np.arange(samples, dtype=np.float64) * step
    v: Array = columns.pop("v", np.empty(0, dtype=np.float64))
    y = columns.pop("y", None)
    name, read_as = Path(reading.file).name, "; ".join(reading.read_as)
    return Record(name, t, v, y, columns, step, tuple(reading.notes), table.units, read_as)


def _drop(reading: Reading, table: Table, length: int, wrong: NDArray[np.bool_], which: str) -> None:
    """Note the samples that are dropped, or refuse when they are too many."""
    number = int(np.count_nonzero(wrong))
    if not number:
        return
    row = int(np.argmax(wrong))
    line = table.line(row)
    first = f"the first at index {row}" if line is None else f"the first in line {line}"
    if number > REPAIRABLE * length:
        reading.problem(
            f"{number} of {length} samples are {which}, {first}; more than {100 * REPAIRABLE:g} % is not repaired, "
            "record or export again",
            line,
        )
    else:
        reading.notes.append(f"{counted(number, 'sample')} {which} dropped, {first}")


def _repeats(t: Array) -> bool:
    """Whether a time that never goes back stands still too often to be repaired: it is written with too few digits."""
    steps = np.diff(t)
    if not len(steps) or float(steps.min()) != 0.0 or float(steps.max()) == 0.0:
        return False
    return int(np.count_nonzero(steps == 0.0)) > REPAIRABLE * len(t)


def _even(reading: Reading, table: Table, t: Array, keep: NDArray[np.bool_]) -> Array:
    """Times at the sample time given in place of times that repeat, as long as these do not speak against it."""
    rows = np.flatnonzero(keep)
    steps = np.diff(t[rows])
    finest = float(np.min(steps[steps > 0.0]))
    row = int(rows[int(np.argmin(steps)) + 1])
    given = reading.sample_time
    if given is None:
        mean = float(t[rows[-1]] - t[rows[0]]) / float(rows[-1] - rows[0])
        reading.problem(
            f"the time repeats in {np.count_nonzero(steps == 0.0)} of {len(t)} samples, it is written in steps of "
            f"{finest:.3g} s; give --sample-time (here about {mean:.3g}), or export it with more digits",
            table.line(row),
        )
        return t
    even: Array = np.arange(len(t)) * given + t[rows[0]]
    # Rounding to such steps moves a time by up to one of them; a sample may be counted to either neighbour
    apart = float(np.ptp(even[rows] - t[rows]))
    if apart > finest + given:
        reading.problem(
            f"the sample time {given:g} s given does not fit the time of the file: over the record they come apart by "
            f"{apart:.3g} s; correct it, or export the time with more digits",
            table.line(row),
        )
    else:
        reading.notes.append(f"t is written in steps of {finest:.3g} s; the sample time {given:g} s given was used")
    return even


def _rising(reading: Reading, table: Table, t: Array, keep: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Keep the samples whose time is later than all before them."""
    if len(t) < 2 or (keep.all() and np.all(t[1:] > t[:-1])):
        return keep
    latest = np.where(keep, t, -np.inf)
    np.maximum.accumulate(latest, out=latest)
    late = np.zeros(len(t), dtype=bool)
    late[1:] = keep[1:] & (t[1:] <= latest[:-1])
    _drop(reading, table, int(np.count_nonzero(keep)), late, "not later than the sample before")
    return keep & ~late


def _step(reading: Reading, t: Array) -> float:
    """Median time step; gaps are noted."""
    if len(t) < 2:
        return reading.sample_time or 1.0
    steps = np.diff(t)
    step = float(np.median(steps, overwrite_input=True))
    number = int(np.count_nonzero(steps > GAP * step))
    if number:
        np.subtract(t[1:], t[:-1], out=steps)  # the median has put them in another order
        worst = int(np.argmax(steps))
        reading.notes.append(
            f"{counted(number, 'gap')} longer than {GAP:g} median steps kept, the largest {steps[worst]:.4g} s "
            f"at t = {t[worst]:.6g} s"
        )
    given = reading.sample_time
    if given is not None and abs(given - step) > 0.01 * step:
        reading.notes.append(
            f"the file has its own time with a step of {step:.6g} s; the sample time {given:g} s given was not used"
        )
    return step
