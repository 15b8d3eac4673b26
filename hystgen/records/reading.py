"""Code shared by all formats: the request, the problems found, the columns chosen, and the record made from them."""

from __future__ import annotations

import io
import logging
import math
import os
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from json import JSONDecodeError
from pathlib import Path, PurePosixPath
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import extras
from hystgen.basics.problems import RecordError, counted, printable
from hystgen.records.columns import (
    DOUBTFUL,
    LISTED,
    STANDARD,
    Column,
    Finder,
    Step,
    counted_days,
    further_names,
    to_seconds,
)
from hystgen.records.record import Array, Record

SAME_STEP = 1e-6
"""Largest relative difference between sample times that count as equal: files write seven digits or a round number."""

BESIDE = 2
"""[times] Memory needed to read a record, relative to that of its numbers; sorted copies and masks take the rest.
Measured: 1.7 with 2e7 samples from an HDF5 file (2026-11-26)."""

IN_SECONDS = " in seconds, as it has no unit"

NO_SECONDS = 1e11
"""Times this large are not seconds: seconds since 1970 reach this number in the year 5138, milliseconds did in 1973."""


def _memory() -> float:
    """Bytes of memory on this machine; unlimited if the system does not say."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return math.inf


class Lines:
    """The line of the file from which each row of a table came, stored as runs of rows."""

    def __init__(self) -> None:
        self._rows: list[int] = []
        self._lines: list[int | NDArray[np.int64]] = []

    def add(self, first_row: int, lines: int | NDArray[np.int64]) -> None:
        """Add rows from `first_row` on with their lines, or with the first line if the others are consecutive."""
        self._rows.append(first_row)
        self._lines.append(lines)

    def line(self, row: int) -> int:
        """Line of a row, counted from 1."""
        stretch = bisect_right(self._rows, row) - 1
        lines = self._lines[stretch]
        after = row - self._rows[stretch]
        return lines + after if isinstance(lines, int) else int(lines[after])


Matrix = tuple[tuple[int, ...], Callable[[], NDArray[np.generic]]]
"""Shape of an array with several dimensions, and how to read it."""


@dataclass
class Table:
    """The content of a file before it is checked: columns under our names, NaN for missing values.

    `units`: the units in the file; `lines`: present if the file has lines.
    """

    numbers: dict[str, Array]
    units: dict[str, str] = field(default_factory=dict)
    lines: Lines | None = None

    def line(self, row: int) -> int | None:
        """Line of the file that a row came from; None if the file has no lines."""
        return None if self.lines is None else self.lines.line(row)


@dataclass
class Reading:
    """A file being read: the request, and the problems and notes so far.

    `delimiter`: the cell separator, None to infer it from the file; `fills`: for each column with numbers that stand
    for "no value", a phrase naming them; `points`: whether the file may lack a time; `read_as`: interpretations that
    the file does not state plainly; `channel`: whether the file holds one channel of a record in several files;
    `name`: the record's; `path`: the file with the bytes to read, which differs from `file` for one that had to be
    unpacked; `part`: the table, sheet or member that the user appends to the path; `origin`: nanoseconds since year 1
    of the first time, if the file has dates; `start`: the time of a waveform's first sample, as the file states it;
    `negated`: our names of the columns whose sign is to be changed, `y=-Position`; `same_length`: advice about columns
    of different lengths.
    """

    file: str
    columns: Mapping[str, str]
    sample_time: float | None
    delimiter: str | None
    need: tuple[str, ...]
    tick: Callable[[float], None]
    points: bool = False
    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    fills: dict[str, str] = field(default_factory=dict)
    read_as: list[str] = field(default_factory=list)
    channel: bool = False
    name: str = ""
    path: str = ""
    part: str = ""
    origin: int | None = None
    start: str = ""
    negated: Set[str] = frozenset()
    same_length: str = "export them with one length"

    def __post_init__(self) -> None:
        self.name, self.path = self.name or Path(self.file).name, self.path or self.file
        self.negated = {ours for ours, theirs in self.columns.items() if theirs[:1] == "-" != theirs}
        self.columns = {ours: theirs[ours in self.negated :] for ours, theirs in self.columns.items()}
        if self.delimiter in ("\\t", "tab"):
            self.delimiter = "\t"

    def understood(self, text: str) -> None:
        """Add to the line that reports how the file was interpreted."""
        self.read_as.append(text)

    def problem(self, text: str, line: int | None = None, column: int | None = None) -> None:
        """Add a problem for which the file is refused, with its position if the file has lines."""
        place = self.file if line is None else f"{self.file}:{line}:{column or 1}"
        self.problems.append(f"{place}: error: {text}")

    def refuse(self, text: str, line: int | None = None) -> RecordError:
        """The error to raise for a problem that ends the reading."""
        self.problem(text, line)
        return RecordError(self.problems)

    def refuse_at(self, text: str, failure: JSONDecodeError, line: int = 0) -> RecordError:
        """The error to raise for text that is not JSON, in this line, or else in that of the failure."""
        self.problem(text, line or failure.lineno, failure.colno)
        return RecordError(self.problems)

    def uninstalled(
        self, files: str, package: str, others: str = "CSV, .npz or MATLAB .mat (v7)", extra: str = "formats"
    ) -> RecordError:
        """The error to raise for files whose package is not installed; `others`: formats that do not need it."""
        return self.refuse(f"{files} files need the package {package}; {extras.install(extra)}, or export {others}")

    def take_part(self, what: str, names: Sequence[str], advice: str = "append its name to the path") -> str:
        """The one of several tables in a file that is to be read: the only one, or the one that the user names.

        Raises RecordError with all names if it is not clear which.
        """
        if self.part in names or (len(names) == 1 and not self.part):
            return self.part or names[0]
        if not names:
            raise self.refuse(f"has no {what}s")
        shown = ", ".join(map(printable, names[:LISTED])) + (f" and {len(names) - LISTED} more" * (len(names) > LISTED))
        base = self.file.removesuffix(f"/{self.part}") if self.part else self.file
        wrong = f"no {what} {printable(self.part)} among" if self.part else f"{len(names)} {what}s:"
        suffixes = [PurePosixPath(name).suffix for name in names]
        last = next(name for name in names[::-1] if PurePosixPath(name).suffix == max(suffixes, key=suffixes.count))
        raise self.refuse(f"has {wrong} {shown}; {advice}, as in {base}/{printable(last)}")

    def refuse_if_any(self) -> None:
        """Raise RecordError with the problems found so far, if any."""
        if self.problems:
            raise RecordError(self.problems)

    @contextmanager
    def parsing(self, kind: str) -> Iterator[None]:
        """Report any error raised by a library that cannot read a file as a problem with the file."""
        try:
            yield
        except RecordError:
            raise
        except MemoryError:
            raise self.refuse("needs more memory than is available; export fewer samples or columns") from None
        except Exception as failure:
            raise self.refuse(f"is not {kind} ({printable(str(failure))}); export it again") from None

    def chosen(
        self,
        columns: Sequence[Column],
        ignored: Sequence[str] = (),
        outside: Sequence[str] = (),
        line: int | None = None,
        steps: Sequence[Step] = (),
    ) -> dict[str, Column]:
        """The requested columns, keyed by our names. Raises RecordError for missing columns.

        `steps`: sample rates in the file, used if there is neither a time nor `sample_time`.
        """
        finder = Finder(columns, self.columns, ignored, outside)
        found = finder.find(self.need, self.sample_time is not None, steps, self.points, self.channel)
        if finder.problems:
            self._check_lengths(found)
        for text in finder.problems:
            self.problem(text, line)
        if len({step.start for step in finder.stated}) > 1:
            starts = " and ".join(f"{printable(step.of)} at {step.start}" for step in finder.stated)
            self.problem(f"the columns start at different times: {starts}; export them with a common time", line)
        steps = finder.steps
        self.start = next((step.start for step in finder.stated), "")
        if any(abs(step.seconds - steps[0].seconds) > SAME_STEP * steps[0].seconds for step in steps):
            said = " and ".join(dict.fromkeys(step.said for step in steps))
            self.problem(f"there is no time, but the file has {said}; give --sample-time", line)
        self.refuse_if_any()
        if finder.understood:
            no_unit = "t" in finder.understood and not found["t"].unit
            self.understood(
                ", ".join(
                    f"{ours} = {printable(c.own)}{IN_SECONDS if ours == 't' and no_unit else ''}"
                    for ours, c in sorted(found.items(), key=lambda entry: (*STANDARD, entry[0]).index(entry[0]))
                )
            )
        if steps:
            self.sample_time = steps[0].seconds
            self.understood(f"time from {steps[0].said}")
        return found

    def _check_lengths(self, chosen: Mapping[str, Column]) -> None:
        """Raise RecordError if columns differ in length."""
        if len({c.length for c in chosen.values()}) > 1:
            parts = ", ".join(f"{c.name} has {c.length}" for c in chosen.values())
            raise self.refuse(f"the columns differ in length: {parts} samples; {self.same_length}")

    def further(self, columns: Sequence[Column], chosen: Mapping[str, Column]) -> dict[str, Column]:
        """The columns not requested, keyed by the names they get; a column whose name is taken is noted."""
        used = {c.name for c in chosen.values()}
        others = [c for c in columns if c.name not in used]
        names = further_names(others, list(chosen))
        kept = {c.name for c in names.values()}
        self.left_out("whose name is taken", [c.name for c in others if c.name not in kept and c.name])
        return names

    def left_out(self, which: str, names: Sequence[str]) -> None:
        """Note columns that are left out of the record."""
        if names:
            more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
            self.notes.append(f"columns {which} were left out: {', '.join(map(printable, names[:LISTED]))}{more}")

    def table(
        self,
        columns: Sequence[Column],
        ignored: Sequence[str],
        outside: Sequence[str] = (),
        steps: Sequence[Step] = (),
        matrices: Mapping[str, Matrix] = MappingProxyType({}),
        together: bool = False,
    ) -> Table:
        """The table of a file whose columns are read one by one.

        The table has the requested columns and, from the groups that hold them, all others of the same length, except
        those that are not numeric (`ignored`) or whose numbers are stored outside the file (`outside`). `matrices`:
        shapes and readers by name; in a file without vectors, a single matrix is the record. `together`: the groups
        form one record.
        """
        if not columns and len(matrices) == 1:
            ((name, (shape, read)),) = matrices.items()
            steps = [replace(step, of="") if step.of == name else step for step in steps]
            columns = self._of_matrix(name, shape, read, steps)
            ignored = [each for each in ignored if each != name]
        chosen = self.chosen(columns, ignored, outside, steps=steps)
        self._check_lengths(chosen)
        lengths = {c.length for c in chosen.values()} or {max((c.length for c in columns), default=0)}
        folders = {c.folder for c in (columns if together or not chosen else chosen.values())}
        self.left_out("without numbers", ignored)
        self.left_out("stored outside the file", outside)
        self.left_out("of other groups", [c.name for c in columns if c.folder not in folders])
        near = [c for c in columns if c.folder in folders]
        self.left_out("of another length", [c.name for c in near if c.length not in lengths])
        taken = {**chosen, **self.further([c for c in near if c.length in lengths], chosen)}
        if BESIDE * 8 * len(taken) * next(iter(lengths)) > _memory():
            raise MemoryError  # a system that overcommits memory would only kill the process later
        numbers: dict[str, Array] = {}
        for name, c in taken.items():
            assert c.read is not None
            numbers[name] = np.require(c.read(), np.float64, ("C", "W"))
        return self.finished(numbers, taken)

    def address(self, c: Column) -> str:
        """How to refer to a column in `--columns`: as the user did, or by its name."""
        return self.columns.get("t", "").partition(" [")[0] or printable(c.name)

    def _of_matrix(
        self, name: str, shape: tuple[int, ...], read: Callable[[], NDArray[np.generic]], steps: Sequence[Step]
    ) -> list[Column]:
        """The columns of a matrix. Raises RecordError unless the user names them by number."""
        width = in_matrix(shape)
        if not any(theirs.lstrip("#").isdecimal() for theirs in self.columns.values()):
            example = "1,2,3 (time, drive, measured)"
            if width == 2 or steps:
                example = f"1,2{'' if steps else ' --sample-time SECONDS'} (drive, measured)"
            raise self.refuse(
                f"{printable(name)} is a matrix of {width} columns; say which they are with --columns {example}"
            )
        across = shape.index(width)
        return [
            Column(str(k + 1), length=max(shape), read=lambda k=k: np.take(read(), k, across))  # type: ignore[misc]
            for k in range(width)
        ]

    def finished(self, numbers: dict[str, Array], taken: Mapping[str, Column], lines: Lines | None = None) -> Table:
        """A table with NaN for every missing value, time in seconds, and units by column name."""
        for name, x in numbers.items():
            wrong = no_value(x)
            written = np.unique(x[wrong & np.isfinite(x)])
            if len(written):
                several, s = ("numbers such as ", "") if len(written) > 1 else ("", "s")
                self.fills[name] = f"{several}{written[0]:.6g} in {name} count{s} as no value"
            x[wrong] = np.nan
            if name in self.negated:
                np.negative(x, out=x)
                self.understood(f"{name} = {printable(taken[name].own)} with its sign changed")
        units = {name: taken[name].unit for name in numbers if taken[name].unit}
        if "t" in numbers and "t" not in units and np.any(numbers["t"] >= NO_SECONDS):
            raise self.refuse(
                f'the numbers of "{printable(taken["t"].own)}" are too large to be seconds, and it has no unit; give '
                f'one, --columns "t={self.address(taken["t"])} [ms]" for milliseconds, or write it after its name'
            )
        if "t" in numbers and "t" not in units and (counts := counted_days(numbers["t"], taken["t"].own)):
            if counts == DOUBTFUL:
                address = self.address(taken["t"])
                raise self.refuse(
                    f'the numbers of "{printable(taken["t"].own)}", from {numbers["t"][0]:.10g} on, may be seconds or '
                    f'days since 1900, and it has no unit; give it one, --columns "t={address} [d]" for days or '
                    f'--columns "t={address} [s]" for seconds'
                )
            self.read_as = [said.replace(IN_SECONDS, "") for said in self.read_as]
            self.understood(counts)
            units["t"] = "d"
        if "t" in units:
            numbers["t"], note = to_seconds(numbers["t"], units["t"])
            if note:
                self.notes.append(note)
            units["t"] = "s"
        return Table(numbers, units, lines)


MOST_TOGETHER = 64
"""Largest number of columns in a matrix that may be a record; a wider one is an image or a map."""


MASKING = ("_FillValue", "missing_value", "valid_min", "valid_max", "valid_range", "scale_factor", "add_offset")
"""Attributes by which stored numbers differ from those meant."""


def without_masked(numbers: NDArray[np.generic], attributes: Mapping[str, object]) -> NDArray[np.float64]:
    """Numbers as the attributes of netCDF's conventions say: NaN for fill values and for those outside the valid range,
    then scaled; unchanged without such attributes."""
    if not any(name in attributes for name in MASKING):
        return np.asarray(numbers, dtype=np.float64)

    def of(*names: str) -> NDArray[np.float64]:
        found = [np.ravel(np.asarray(attributes[name])) for name in names if name in attributes]
        return np.concatenate([each for each in found if each.dtype.kind in "fiub"] or [np.empty(0)]).astype(np.float64)

    x = np.asarray(numbers, dtype=np.float64)
    low, high = of("valid_min"), of("valid_max")
    span = of("valid_range")
    if len(span) == 2:
        low, high = span[:1], span[1:]
    wrong = np.isin(x, of("_FillValue", "missing_value"))
    for ends, outside in ((low, np.less), (high, np.greater)):
        if len(ends):
            wrong |= outside(x, ends[0])
    x = np.where(wrong, np.nan, x)
    factor, offset = of("scale_factor"), of("add_offset")
    if len(factor) == 1:
        x *= factor[0]
    if len(offset) == 1:
        x += offset[0]
    return x


def in_matrix(shape: tuple[int, ...]) -> int:
    """Number of columns in a matrix that may be a record, in either orientation; 0 for anything else."""
    two = len(shape) == 2 and shape[0] != shape[1]
    return min(shape) if two and 2 <= min(shape) <= MOST_TOGETHER else 0


def one_dimension(shape: tuple[int, ...]) -> int:
    """Length of a vector, whether a row, a column or one-dimensional; 0 for anything else."""
    length = int(np.prod(shape, dtype=np.int64))
    return length if length > 1 and length == max(shape) else 0


@contextmanager
def unlogged(library: str) -> Iterator[None]:
    """Keep a library from logging what is wrong with a file, which is reported once, as a problem."""
    logger = logging.getLogger(library)
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        logger.setLevel(level)


class CountingFile(io.FileIO):
    """A file that reports how many bytes were read from it."""

    def __init__(self, file: str, tick: Callable[[float], None]) -> None:
        super().__init__(file)
        self._tick = tick

    def readinto(self, buffer: bytearray | memoryview) -> int | None:  # type: ignore[override]
        """Read as usual, and report the number of bytes."""
        number = super().readinto(buffer)
        self._tick(number or 0)
        return number


# From a table to a record: small faults are repaired and counted, others refused -----------------------------


SHORTEST = 16
"""Minimum number of samples in a record that a model can be fitted to."""

REPAIRABLE = 0.05
"""Largest fraction of samples that may be dropped with a note; if more are faulty, the file is refused."""

NOTED_GAP = 3.0
"""A step longer than this many median steps is a gap."""


def repaired(reading: Reading, table: Table) -> Record:
    """The record made from a table, which is consumed. Raises RecordError with every problem."""
    columns = table.numbers
    _cut(columns, {*reading.need, "t"} & columns.keys())
    length = len(next(iter(columns.values()), ()))
    keep = np.ones(length, dtype=bool)
    needed = [name for name in reading.need if name in columns]
    if "t" in columns:
        needed.append("t")
    lacking = []
    for name in dict.fromkeys(needed):
        present = np.isfinite(columns[name])
        keep &= present
        lacking += [] if np.all(present) else [name]
    fills = "; ".join(said for name, said in reading.fills.items() if name in needed)
    which = f"without a value in {' or '.join(lacking)}{f' ({fills})' if fills else ''}"
    _drop(reading, table, length, ~keep, which, EXPORT_WHOLE)
    reading.notes += [f"{name}: {said}" for name, said in reading.fills.items() if name not in needed]
    if "t" in columns and _repeats(columns["t"][keep]):
        columns["t"] = _even(reading, table, columns["t"], keep)
    elif "t" in columns:
        keep = _rising(reading, table, columns["t"], keep)
    samples = int(np.count_nonzero(keep))
    if samples < length:
        # One column at a time, so that only one of them exists twice
        for name in columns:
            columns[name] = columns[name][keep]
    fit = "y" in reading.need
    shortest = SHORTEST if fit else 1
    if samples < shortest and not reading.problems:
        reading.problem(f"has {counted(samples, 'sample')}, but at least {shortest} are needed; record for longer")
    elif fit and samples and not reading.problems and "v" in columns and float(np.ptp(columns["v"])) == 0.0:
        reading.problem(
            f"the drive v is {columns['v'][0]:g} throughout, but a fit needs a drive that moves; check the columns"
        )
    reading.refuse_if_any()
    t: Array
    timed = "t" in columns or reading.sample_time is not None
    if not timed:
        reading.notes.append("no time: read as points taken one by one; give --sample-time if they are evenly spaced")
    if "t" in columns:
        t = columns.pop("t")
        if reading.sample_time and "t" not in table.units and _counts(t):
            t *= reading.sample_time
            reading.understood(f"t counts samples, {reading.sample_time:g} s each")
        step = _step(reading, t)
    else:
        step = reading.sample_time or 1.0
        t = np.arange(samples, dtype=np.float64) * step
    v: Array = columns.pop("v", np.empty(0, dtype=np.float64))
    y = columns.pop("y", None)
    read_as = "; ".join(reading.read_as)
    return Record(reading.name, t, v, y, columns, step, tuple(reading.notes), table.units, read_as, timed)


def _cut(columns: dict[str, Array], needed: Set[str]) -> None:
    """Cut the rows at the end without any needed number: those of other, longer columns."""
    if not needed or any(not len(columns[name]) or math.isfinite(columns[name][-1]) for name in needed):
        return
    last = max(int(np.flatnonzero(np.isfinite(columns[name]))[-1:].sum()) for name in needed)
    for name in columns:
        columns[name] = columns[name][: last + 1]


EXPORT_WHOLE = "export every column at one sample rate, with a number in each row"

SPLIT = "correct the time there, or, if it starts again, give each run a file of its own"


def _drop(
    reading: Reading, table: Table, length: int, wrong: NDArray[np.bool_], which: str, advice: str = SPLIT
) -> None:
    """Note the dropped samples, or refuse the file with `advice` if there are too many."""
    number = int(np.count_nonzero(wrong))
    if not number:
        return
    row = int(np.argmax(wrong))
    line = table.line(row)
    first = f"the first at index {row}" if line is None else f"the first in line {line}"
    if number > REPAIRABLE * length:
        reading.problem(
            f"{number} of {length} samples {'is' if number == 1 else 'are'} {which}, {first}; more than "
            f"{100 * REPAIRABLE:g} % is too much to repair; {advice}",
            line,
        )
    else:
        reading.notes.append(f"{counted(number, 'sample')} {which} dropped, {first}")


def _counts(t: Array) -> bool:
    """Whether a time without a unit is a number of samples, 0, 1, 2 and so on, of which a few may be missing."""
    return len(t) > 1 and not np.any(t % 1.0) and float(np.median(np.diff(t))) == 1.0


def _repeats(t: Array) -> bool:
    """Whether a non-decreasing time repeats too often to be repaired because it was written with too few digits."""
    steps = np.diff(t)
    if not len(steps) or float(steps.min()) != 0.0 or float(steps.max()) == 0.0:
        return False
    return int(np.count_nonzero(steps == 0.0)) > REPAIRABLE * len(t)


def _even(reading: Reading, table: Table, t: Array, keep: NDArray[np.bool_]) -> Array:
    """Replace repeated times with times at the given sample time, unless the repeated times contradict it."""
    rows = np.flatnonzero(keep)
    steps = np.diff(t[rows])
    finest = float(np.min(steps[steps > 0.0]))
    row = int(rows[int(np.argmin(steps)) + 1])
    given = reading.sample_time
    if given is None:
        # Between two changes of the written time, samples are counted to one; the record does not end at a change
        rises = np.flatnonzero(steps > 0.0) + 1
        first, last = (rises[0], rises[-1]) if len(rises) > 1 else (0, -1)
        span = float(t[rows[last]] - t[rows[first]])
        mean = span / float(rows[last] - rows[first])
        digits = 3 + max(0, math.ceil(math.log10(span / finest)))  # so that over the record it is off by a small part
        reading.problem(
            f"the time repeats in {np.count_nonzero(steps == 0.0)} of {len(t)} samples, because it was written in "
            f"steps of {finest:.3g} s; give --sample-time (here about {mean:.{digits}g}), or export it with more "
            "digits",
            table.line(row),
        )
        return t
    even: Array = np.arange(len(t)) * given + t[rows[0]]
    # Rounding to such steps moves a time by up to one step; a sample may be assigned to either neighbour
    apart = float(np.ptp(even[rows] - t[rows]))
    if apart > finest + given:
        reading.problem(
            f"the given sample time {given:g} s does not fit the time of the file: over the record they diverge by "
            f"{apart:.3g} s; correct it, or export the time with more digits",
            table.line(row),
        )
    else:
        reading.notes.append(f"t is written in steps of {finest:.3g} s; the given sample time {given:g} s was used")
    return even


def _rising(reading: Reading, table: Table, t: Array, keep: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Keep the samples that are later than all samples before them."""
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
    number = int(np.count_nonzero(steps > NOTED_GAP * step))
    if number:
        np.subtract(t[1:], t[:-1], out=steps)  # the median has reordered them
        worst = int(np.argmax(steps))
        reading.notes.append(
            f"{counted(number, 'gap')} longer than {NOTED_GAP:g} median steps kept, the largest {steps[worst]:.4g} s "
            f"at t = {t[worst]:.6g} s"
        )
    given = reading.sample_time
    if given is not None and abs(given - step) > 0.01 * step:
        reading.notes.append(
            f"the file has its own time with a step of {step:.6g} s; the given sample time {given:g} s was not used"
        )
    return step


# Numbers that stand for "no value": placeholders that instruments write, and impossible readings ---------------


LARGEST = 1e20
"""Numbers of this magnitude or more are not readings, whatever the unit.

Some instruments write 9.9E37 for an overload and 9.91E37 for "not a number" (SCPI-99, volume 1, section 7.2.1.4 and 5),
others the largest float32 or 1e30; counters end at 1.8e19. Parameter files allow numbers up to 1e30, and the rate of a
drive, in units per second, may be 1e10 times the drive itself.
"""

NINES = 3
"""Minimum number of digits in a fill value made of nines, such as -999 or 99999.9."""

ENDS_OF_INTEGERS = frozenset(
    float(x) for bits in (16, 32, 64) for x in (2 ** (bits - 1) - 1, 2 ** (bits - 1), 2**bits - 1)
)
"""Magnitudes of the extremes of integer types."""


def no_value(x: Array) -> NDArray[np.bool_]:
    """Whether each number (N,) in a column stands for "no value", as every non-finite number does.

    A number below `LARGEST` stands for "no value" if it is a usual fill value (all nines, the extreme of an integer
    type) and lies farther from the rest of the column than their spread, since a column may also pass through -999. The
    extreme of an integer type counts only in a column with fractions; in a column of codes it is an ordinary code.
    """
    wrong = ~np.isfinite(x) | (x >= LARGEST) | (x <= -LARGEST)
    rest, fills = x[~wrong] if wrong.any() else x, []
    while len(rest):
        ends = [end for end in (float(np.min(rest)), float(np.max(rest))) if _fill(end, rest)]
        if not ends:
            break
        fills += ends
        rest = rest[~np.isin(rest, ends)]
    if fills and len(rest):
        low, high = float(np.min(rest)), float(np.max(rest))
        away = [fill for fill in fills if not 2.0 * low - high <= fill <= 2.0 * high - low]
        wrong |= np.isin(x, away)
    return wrong


def _fill(number: float, column: Array) -> bool:
    """Whether a number in a column looks like a fill value."""
    digits = f"{abs(number):.10g}".replace(".", "")
    if len(digits) >= NINES and set(digits) == {"9"}:
        return True
    return abs(number) in ENDS_OF_INTEGERS and not np.array_equal(column, np.rint(column))
