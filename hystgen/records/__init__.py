"""Measured data in, computed columns out: one file is one experiment.

Text tables (`t` time, `v` drive, `y` measured, any further columns) as instruments and programs export them, and the
files of NumPy, MATLAB, Excel and others that `formats` lists, packed or not. All problems in a file are reported at
once, each with its position; small faults in a recording are repaired and counted in `Record.notes`.

`formats` chooses the reader of a file by its first bytes. For a text file, `layout` determines how the table is
written, `csv_file` splits it into lines and reads the rows, and `cells` reads single cells. For every format, `columns`
finds the requested columns and the sample rate, and `reading` turns them into the record.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from typing import TYPE_CHECKING, cast

from hystgen.basics import arguments, console
from hystgen.basics.problems import RecordError, printable
from hystgen.basics.progress import Progress
from hystgen.basics.writing import write_atomically
from hystgen.records import formats, joined, packed
from hystgen.records.columns import LISTED, agreed_units, headers, parse_columns
from hystgen.records.memory import Columns, in_memory
from hystgen.records.memory import read as read_memory
from hystgen.records.reading import LARGEST, SHORTEST, Reading, Table, no_value, repaired
from hystgen.records.record import Record
from hystgen.records.told import time_without_unit
from hystgen.records.units import converted, wanted
from hystgen.records.writing import columns_text, write_columns

if TYPE_CHECKING:
    from hystgen.parameters.schema import Units

Source = Record | str | os.PathLike[str] | Columns
"""A record, the path of a data file, or its samples in memory."""

def read_records(
    sources: Source | Iterable[Source], columns: Mapping[str, str] | None = None, sample_time: float | None = None,
    delimiter: str | None = None, need: Sequence[str] = ("v", "y"), progress: bool = False, points: bool = False,
) -> list[Record]:
    """Read several data files as `read_record` does; records already in memory are kept.

    Samples in memory are called `record`, or `record 1`, `record 2`, .. if there are several. `points`: accept samples
    without a time and treat them as points taken one by one.

    `progress`: report once on stderr how files were interpreted ("read as: .."), with a progress bar on a terminal if
    reading takes more than a second. Raises RecordError with every problem in all files, ValueError and TypeError for
    unusable arguments.
    """
    everything = several(sources)
    _check_options(columns, sample_time, delimiter)
    found: list[Record] = []
    unnamed = [k for k, source in enumerate(everything) if not isinstance(source, Record | str | os.PathLike)]
    refused: list[str] = []
    ways: dict[str, list[str]] = {}
    kept = [source for source in everything if isinstance(source, Record)]
    with Progress(sum(_size(source) for source in everything), progress, "reading") as bar:
        for k, source in enumerate(everything):
            try:
                if isinstance(source, Record):
                    _check_arrays(source)
                    record = source
                elif isinstance(source, str | os.PathLike):
                    path = arguments.path("a record", source)
                    record = _read(path, columns, sample_time, delimiter, need, bar.tick, points)
                else:
                    name = f"record {unnamed.index(k) + 1}" if len(unnamed) > 1 else "record"
                    record = read_memory(source, name, columns, sample_time, need)
                if record.read_as and record is not source:  # an existing record has been announced already
                    ways.setdefault(record.read_as, []).append(record.name)
                found.append(record)
            except RecordError as error:
                refused.extend(error.problems)
    if progress:
        for way, names in ways.items():
            more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
            console.note(f"read as: {', '.join(names[:LISTED])}{more}: {way}")
        if said := time_without_unit([each for each in found if not any(each is own for own in kept)], sample_time):
            console.note(f"warning: {said}")
    if refused:
        raise RecordError(refused)
    return found


def read_record(
    path: Source, columns: Mapping[str, str] | None = None, sample_time: float | None = None,
    delimiter: str | None = None, need: Sequence[str] = ("v", "y"),
) -> Record:
    """Read one data file, or make a record from samples in memory.

    `path`: path of a file; or a mapping or data frame of columns, an array (N, 3) or a tuple of arrays (N,) in the
    order t, v, y. `columns`: maps our column names to the file's (`{"t": "Time"}`). A column of the file can be given
    by its whole name (`session1/drive` in HDF5, `data.v` for the field of a MATLAB struct), by the last part of the
    name, with or without a unit, if only one column matches; or by its number, `#2`. `t`, `v` and `y` are found the
    same way, or else by meaning, if only one column has such a name (`Drive (V)`, `Zeit [ms]`). `sample_time`: seconds,
    for a file without time; `delimiter`: one character, by default the one found in the file; `need`: the columns that
    must be present. If `need` includes `y`, the record is meant for a fit: it must then have at least 16 samples and a
    drive that moves. Samples without a value in `t` or a needed column, and samples whose time does not increase, are
    dropped with a note, up to 5 % of the record. A time in another unit is converted to seconds.

    Raises RecordError with every problem in the file.
    """
    return read_records([path], columns, sample_time, delimiter, need)[0]


def in_units(
    records: Iterable[Record], model: Units | None = None, *, need: Sequence[str] = ("v", "y"),
    file: tuple[str, Mapping[str, str] | None] = ("", None),
    named: tuple[str, Mapping[str, str] | None] = ("units", None), sources: Sequence[object] = (),
) -> list[Record]:
    """The records with each column in `need`, and temperatures, in a single unit; each conversion adds a note to the
    record.

    The target units are the user's (`named`: the option's name and the units of `input` and `output`), else those of a
    parameter file (`file`: its path and units), else those of `model`; if there are none, the first record with a unit
    decides. Columns without a unit are assumed to be in the target unit. `sources`: the records as given, for messages.
    Raises RecordError naming every column that holds a different quantity or has an unknown unit.
    """
    everything = list(records)
    if not any(record.units for record in everything):
        return everything
    goals = wanted(model, (file[0], file[1] or {}), (named[0], named[1] or {}))
    return converted(everything, goals, need, sources, named[0] if model is None else "")


def several(sources: Source | Iterable[Source]) -> list[Source]:
    """One record source, or several, as a list. Raises TypeError for anything else."""
    if isinstance(sources, Record | str | os.PathLike):
        return [sources]
    listed = isinstance(sources, list) or (isinstance(sources, tuple) and not sources)
    if not listed and in_memory(sources):
        return [sources]
    stream = isinstance(sources, bytes) or hasattr(sources, "readline")  # iterating over it would give lines
    found = [] if stream or not isinstance(sources, Iterable) else cast(list[Source], list(sources))
    strange = [each for each in found if not (isinstance(each, Record | str | os.PathLike) or in_memory(each))]
    if stream or strange or not isinstance(sources, Iterable):
        of = f" with {arguments.kind(strange[0])} in it" if strange else ""
        raise TypeError(
            f"give a path, a hystgen.records.Record, a data frame, a dict of arrays {{'t': .., 'v': .., 'y': ..}}, a "
            f"tuple of arrays (t, v, y), or a list of these, not {arguments.kind(sources)}{of}"
        )
    return found


def _check_options(columns: object, sample_time: object, delimiter: object) -> None:
    """Raise TypeError for options of `read_record` that have the wrong type."""
    if columns is not None:
        arguments.texts("columns", columns, (), "{'t': 'Time', 'v': 'U', 'y': 'Pos'}")
    if sample_time is not None:
        arguments.real("sample_time", sample_time, "seconds")
    if delimiter is not None and not isinstance(delimiter, str):
        raise TypeError(f"delimiter has to be a character such as ';', not {arguments.kind(delimiter)}")


def _check_arrays(record: Record) -> None:
    """Raise ValueError or TypeError unless a record consists of one-dimensional arrays of numbers."""
    if not isinstance(record.name, str):
        raise TypeError(f"a record's name must be text, not {arguments.kind(record.name)}; Record(name, t, v, y)")
    for name, values in record.columns().items():
        found = arguments.signal(f"{name} of {record.name}", values)
        if name not in ("v", "y") and len(found) != len(record.t):
            raise ValueError(f"{record.name} has {len(record.t)} samples of t and {len(found)} of {name}")
    if len(record.v) not in (0, len(record.t)):
        raise ValueError(f"{record.name} has {len(record.t)} samples of t and {len(record.v)} of v")


def files(source: object) -> list[str]:
    """The paths of the files that a record is read from; none for samples in memory."""
    if not isinstance(source, str | os.PathLike):
        return []
    path = os.fspath(source)
    return [packed.location(each)[0] for each in (joined.files(path) if joined.MARK in path else [path])]


def stem(source: str) -> str:
    """The name of a record for files made from it: that of its file without suffixes, of several files all of them."""
    return joined.MARK.join(packed.stem(each) for each in joined.files(source))


def suffixes() -> tuple[str, ...]:
    """Suffixes of the files that are records, in lower case."""
    return (".csv", ".tsv", ".lvm", *packed.PACKED, *formats.BY_SUFFIX)


def _read(
    file: str, columns: Mapping[str, str] | None, sample_time: float | None, delimiter: str | None, need: Sequence[str],
    tick: Callable[[float], None], points: bool,
) -> Record:
    reading = Reading(file, columns or {}, sample_time, delimiter, tuple(need), tick, points)
    mark = reading.delimiter
    if mark is not None and (len(mark) != 1 or mark in "\"'.\r\n" or mark.isalnum()):
        reading.problem(f'the delimiter "{printable(mark)}" is not usable; give a single character such as ;')
    if sample_time is not None and not (0.0 < sample_time < float("inf")):
        reading.problem(f"the sample time {sample_time:g} is not positive; give seconds per sample")
    reading.refuse_if_any()
    channels = joined.files(file) if joined.MARK in file else [file]
    if len(channels) == 1:
        return repaired(reading, _table(reading))
    reading.name = " + ".join(os.path.basename(each) for each in channels)
    times = {"t": reading.columns["t"]} if "t" in reading.columns else {}
    # Without the given sample time, since the times that files do have show whether they start together
    parts = [Reading(each, times, None, delimiter, (), tick, channel=True) for each in channels]
    tables, refused = [], []
    for part in parts:
        try:
            tables.append(_table(part))
        except RecordError as error:
            refused.extend(error.problems)
    if refused:
        raise RecordError(refused)
    return repaired(reading, joined.joined(reading, parts, tables))


def _table(reading: Reading) -> Table:
    """The content of one file."""
    reading.path, reading.part = packed.location(reading.file)
    with ExitStack() as stack:
        stream, start, suffix = packed.opened(reading, stack)
        if not start:
            raise reading.refuse("is empty; record again, or give another file")
        read = formats.reader(reading, start, suffix)
        if reading.part and read not in formats.WITH_PARTS:
            part = printable(reading.part)
            raise reading.refuse(f"has no parts, so it cannot contain {part}; give the path of the file alone")
        return read(reading, stream)


def _size(source: Source) -> int:
    """Bytes to read; 0 for a missing file, which is reported when it is opened."""
    if not isinstance(source, str | os.PathLike):
        return 0
    return sum(os.stat(path).st_size for path in files(source) if os.path.exists(path))


MARK = joined.MARK

__all__ = [
    "LARGEST",
    "MARK",
    "SHORTEST",
    "Record",
    "RecordError",
    "Source",
    "agreed_units",
    "columns_text",
    "files",
    "headers",
    "in_units",
    "no_value",
    "parse_columns",
    "read_record",
    "read_records",
    "several",
    "stem",
    "suffixes",
    "write_atomically",
    "write_columns",
]
