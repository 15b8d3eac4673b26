"""Records of instruments that write one file per channel: `drive.csv+sensor.csv`, which `--join` makes."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from hystgen.basics.problems import printable
from hystgen.records.columns import SECONDS, Column, meaning
from hystgen.records.packed import location
from hystgen.records.reading import SAME_STEP, Reading, Table
from hystgen.records.record import Array

MARK = "+"
"""Separator between the files of one record."""

WITHIN = 0.5
"""[steps] Largest difference between the times of two channels: further apart, they are of different samples."""


_SAME = "export the same samples of each"


def files(source: str) -> list[str]:
    """The files of a record: one, or several with a plus sign between them if no file has the whole name."""
    if MARK not in source or os.path.lexists(source):
        return [source]
    parts = source.split(MARK)
    for k in range(len(parts) - 1, 0, -1):  # names may have a plus sign themselves
        rest = files(MARK.join(parts[k:]))
        found = [MARK.join(parts[:k]), *rest]
        if all(os.path.lexists(location(each)[0]) for each in found):
            return found
    return [source]


def joined(reading: Reading, channels: Sequence[Reading], tables: Sequence[Table]) -> Table:
    """One table from those of the channels, given in the order drive, measured.

    `reading`: the request for the whole record. Raises RecordError if the channels differ in length, in their first
    times or in their steps.
    """
    names = [os.path.basename(channel.file) for channel in channels]
    for name, channel in zip(names, channels, strict=True):
        reading.notes += [f"{name}: {note}" for note in channel.notes]
    understood = {name: ", ".join(channel.read_as) for name, channel in zip(names, channels, strict=True)}
    if len(set(understood.values())) == 1:
        understood = {"": next(iter(understood.values()))}
    reading.read_as += [f"{name}: {text}".removeprefix(": ") for name, text in understood.items() if text]
    rows = [len(next(iter(table.numbers.values()), ())) for table in tables]
    if len(set(rows)) > 1:
        raise reading.refuse(f"the files differ in length: {_each(names, rows)} samples; {_SAME}")
    _check_origins(reading, names, channels)
    given = reading.sample_time
    steps = {name: each.sample_time for name, each in zip(names, channels, strict=True) if each.sample_time}
    slow, fast = (max(steps.values()), min(steps.values())) if steps and given is None else (0.0, 0.0)
    times = {name: table.numbers["t"] for name, table in zip(names, tables, strict=True) if "t" in table.numbers}
    if slow - fast > SAME_STEP * slow:
        said = _each(list(steps), [f"{seconds:g} s" for seconds in steps.values()])
        raise reading.refuse(f"the files have different sample times: {said}; record both with one sample rate")
    _check_times(reading, times, rows[0])
    columns = []
    if times:
        columns.append(Column("t", unit="s", length=rows[0], read=partial(np.array, next(iter(times.values())))))
    elif steps:
        reading.sample_time = given or next(iter(steps.values()))
    for name, table in zip(names, tables, strict=True):
        for column, numbers in table.numbers.items():
            if column != "t":
                unit = table.units.get(column, "")
                columns.append(Column(column, f"{name}/", unit, len(numbers), partial(np.array, numbers)))
    reading.columns = _in_order(reading, columns, len(names))
    return reading.table(columns, [], together=True)


def _each(names: Sequence[str], of: Sequence[object]) -> str:
    return ", ".join(f"{printable(name)} has {value}" for name, value in zip(names, of, strict=True))


def _check_origins(reading: Reading, names: Sequence[str], channels: Sequence[Reading]) -> None:
    """Raise RecordError if the files state different dates and times of their first samples."""
    stated = {name: each.start for name, each in zip(names, channels, strict=True) if each.start}
    origins = {name: each.origin for name, each in zip(names, channels, strict=True) if each.origin is not None}
    for starts in (list(stated.values()), list(origins.values())):
        if len(starts) == len(names) and len(set(starts)) > 1:
            if starts[0] in stated.values():
                said = " and ".join(f"{printable(name)} at {start}" for name, start in stated.items())
            else:
                said = f"{(int(starts[1]) - int(starts[0])) / 1e9:g} s apart"
            raise reading.refuse(f"the files start at different times: {said}; {_SAME}")


def _check_times(reading: Reading, times: Mapping[str, Array], rows: int) -> None:
    """Raise RecordError if the times of two files differ."""
    (first, t), *others = times.items() if times else [("", np.empty(0))]
    step = float(np.nanmedian(np.diff(t))) if len(t) > 1 else 0.0
    for name, other in others:
        if rows and abs(other[0] - t[0]) > WITHIN * step:
            raise reading.refuse(
                f"the files start at different times: {printable(first)} at {t[0]:g} s and {printable(name)} at "
                f"{other[0]:g} s; {_SAME}"
            )
        apart = np.nan_to_num(np.abs(other - t))
        if rows and apart.max() > WITHIN * step:
            row = int(np.argmax(apart > WITHIN * step))
            raise reading.refuse(
                f"the times of the files differ from sample {row} on: {printable(first)} has {t[row]:g} s and "
                f"{printable(name)} {other[row]:g} s; record both with one sample rate"
            )


def _in_order(reading: Reading, columns: Sequence[Column], files_: int) -> Mapping[str, str]:
    """The user's columns; else, if each of two files has one channel without a telling name, the first is the drive."""
    channels = [c for c in columns if c.own != "t" and c.unit not in SECONDS]
    chosen = {ours: theirs for ours, theirs in reading.columns.items() if ours != "t"}
    if chosen or len(channels) != files_ or files_ != 2:
        return chosen
    meant = [meaning(c) for c in channels]
    if sorted(meant) == ["v", "y"] or sorted(c.label for c in channels) == ["v", "y"]:
        return {}
    reading.understood(f"v = {printable(channels[0].name)}, y = {printable(channels[1].name)}, in the order given")
    return {"v": channels[0].name, "y": channels[1].name}
