"""Text tables, read in blocks: sound blocks by numpy's C reader, the others line by line.

A file of any size thus needs little more memory than its columns, and every fault is reported with its position.
"""

from __future__ import annotations

import codecs
import contextlib
import io
import os
import re
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import IO

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import counted, printable
from hystgen.records import layout, scopes
from hystgen.records.cells import BLANKS, COMMENT, MISSING, Clock, Dialect, is_comment, shape
from hystgen.records.columns import LISTED, Column
from hystgen.records.layout import TableLayout
from hystgen.records.reading import Lines, Reading, Table
from hystgen.records.record import Array

# Bytes into text: encodings, byte order marks and line ends --------------------------------------------------


BLOCK = 1 << 20
"""[bytes] Size of the blocks read; a line longer than this does not belong to a text table."""

WIDE = {codecs.BOM_UTF8: "utf-8", codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
"""Encodings by the byte order mark that a file begins with."""

LOOKED_AT = 1 << 10
"""[bytes] How much of a file, from its start, is searched for signs of UTF-16 without a byte order mark."""


_MINUS = re.compile("(?<![^\\s,;|\"eE])\N{MINUS SIGN}(?=[.,\\d])")
"""A typographic minus sign in front of a number."""


def texts(reading: Reading, stream: IO[bytes]) -> Iterator[str]:
    """The file's text in blocks of whole lines; every line ends in a line feed, except perhaps the last."""
    latin = False
    for data in _blocks(reading, _eight_bit(reading, stream)):
        if b"\0" in data:
            raise reading.refuse("is not a text file; export CSV, .npz, .h5, Parquet or MATLAB .mat")
        try:
            text = data.decode("utf-8")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
            if not latin:
                reading.notes.append("the text is not UTF-8; it was read as Latin-1")
            latin = True
        if "\r" in text:
            text = text.replace("\r\n", "\n").replace("\r", "\n")
        if "\N{MINUS SIGN}" in text:
            text = _MINUS.sub("-", text)
        yield text


def _eight_bit(reading: Reading, stream: IO[bytes]) -> Iterator[bytes]:
    """The bytes of the file without its byte order mark; UTF-16 is converted to UTF-8."""
    data = stream.read(BLOCK)
    mark, encoding = next(((mark, name) for mark, name in WIDE.items() if data.startswith(mark)), (b"", ""))
    encoding = encoding or _wide_without_mark(data[:LOOKED_AT])
    data = data[len(mark) :]
    if not encoding.startswith("utf-16"):
        while data:
            yield data
            data = stream.read(BLOCK)
        return
    reading.understood(encoding[:6].upper())
    decoder = codecs.getincrementaldecoder(encoding)("strict")
    while True:
        try:
            text = decoder.decode(data, final=not data)
        except UnicodeDecodeError:
            raise reading.refuse("is damaged UTF-16 text; export it again, as UTF-8") from None
        if text:
            yield text.encode("utf-8", "surrogatepass")
        if not data:
            return
        data = stream.read(BLOCK)


def _wide_without_mark(start: bytes) -> str:
    """The UTF-16 encoding if nearly every other byte is zero, as in mostly ASCII text; otherwise an empty string."""
    pairs = len(start) // 2
    for encoding, zeros, others in (
        ("utf-16-le", start[1::2].count(0), start[: 2 * pairs : 2].count(0)),
        ("utf-16-be", start[: 2 * pairs : 2].count(0), start[1::2].count(0)),
    ):
        if pairs and not others and zeros > 0.9 * pairs:
            return encoding
    return ""


def _blocks(reading: Reading, chunks: Iterator[bytes]) -> Iterator[bytes]:
    rest = b""
    for data in chunks:
        data = rest + data
        # A carriage return at the end may be the first half of a CR-LF
        end = max(data.rfind(b"\n"), data.rfind(b"\r", 0, -1)) + 1
        if end:
            yield data[:end]
        rest = data[end:]
        if len(rest) > BLOCK:
            raise reading.refuse(f"has a line longer than {BLOCK >> 20} MB; export one row per line")
    if rest:
        yield rest


# Rows into columns -------------------------------------------------------------------------------------------


SAMPLE = 1 << 16
"""Characters read from the start of a file, in whole lines, to determine its layout."""

SAMPLE_LINES = 8
"""Minimum number of lines used to determine the layout, however long they are: a header, units and a few rows."""

PARAMETERS = re.compile(r"^hystgen\s*:", re.MULTILINE)
"""How a line of a parameter file begins; no line of a table begins like this."""

SAME_TIME = 0.5
"""[steps] Times of two channels that are further apart belong to different samples."""

SPARE = 1.05
"""Ratio of the number of rows allocated to the number estimated from the first block."""


def read_csv(reading: Reading, stream: IO[bytes]) -> Table:
    """Read a text file with one row per line."""
    size = 0
    with contextlib.suppress(OSError, io.UnsupportedOperation):
        size = os.fstat(stream.fileno()).st_size  # 0 for a pipe
    return read_text(reading, texts(reading, stream), size)


def read_text(reading: Reading, blocks: Iterator[str], size: int) -> Table:
    """Read a table from blocks of whole lines, with about `size` characters in all; 0 if that is not known."""
    sample = ""
    while (len(sample) < SAMPLE or sample.count("\n") < SAMPLE_LINES) and (text := next(blocks, "")):
        sample += text
    if not sample.strip():
        raise reading.refuse("is empty; record again, or give another file")
    if PARAMETERS.search(sample):
        raise reading.refuse("is a parameter file; give a recording, which is a table of time, drive and displacement")
    found = _layout(reading, sample)
    names = found.names
    units = found.units or [""] * len(names)
    also = found.also or [""] * len(names)
    columns = [
        Column(name, unit="s" if k in found.clocks else units[k], also=also[k]) for k, name in enumerate(names)
    ]
    chosen = reading.chosen(columns, line=found.header or 1, steps=found.steps)
    own = {_time_of(found, columns.index(c)) for ours, c in chosen.items() if ours != "t"}
    if found.times and len(own) == 1 and "t" in chosen:
        chosen["t"] = columns[own.pop()]
    if "t" in chosen and columns.index(chosen["t"]) in found.clocks:
        reading.understood("times of day counted in seconds from the first")
    body = _Body(reading, found, {ours: columns.index(c) for ours, c in chosen.items()}, size)
    body.take("".join(sample.split("\n", found.first - 1)[found.first - 1 :]))
    for text in blocks:
        body.take(text)
    return body.table(columns, chosen)


def _time_of(found: TableLayout, place: int) -> int:
    """The column of time in front of a channel."""
    return max((k for k in found.times if k <= place), default=0)


def _layout(reading: Reading, sample: str) -> TableLayout:
    """The layout found in the first lines; notes how the file was interpreted."""
    fewest = len("\n".join(sample.split("\n", SAMPLE_LINES)[:SAMPLE_LINES]))
    start = sample[: sample.find("\n", max(SAMPLE, fewest)) + 1]
    lines = (start or sample).split("\n")
    found = scopes.find(reading, lines) or layout.find(reading, lines)
    _refuse_wrong_delimiter(reading, found, lines)
    if found.kind:
        reading.understood(found.kind)
    dialect = found.dialect
    if not found.kind and dialect != Dialect() and (reading.delimiter is None or dialect.decimal != "."):
        between = layout.DELIMITERS.get(dialect.delimiter, f'"{printable(dialect.delimiter)}"')
        parts = [f"{between} between cells"] if len(found.names) > 1 else []
        parts += ["decimal commas"] if dialect.decimal == "," else []
        if parts:
            reading.understood(" and ".join(parts))
    if found.header is None and not found.kind:
        reading.understood("no header")
    elif found.header is not None and not found.kind and _is_below_text(lines, found.header):
        reading.understood(f"header in line {found.header}")
    if any(found.units) and not found.kind:
        named = [f"{name} [{unit}]" for name, unit in zip(found.names, found.units, strict=True) if unit]
        reading.understood(f"units {', '.join(map(printable, named[:LISTED]))}")
    return found


def _refuse_wrong_delimiter(reading: Reading, found: TableLayout, lines: Sequence[str]) -> None:
    """Raise RecordError if the given delimiter yields a single column where another one would yield a table."""
    if reading.delimiter is None or len(found.names) != 1 or not found.header:
        return
    shown = [line for line in lines[found.header - 1 :] if line.strip() and not is_comment(line)][:2]
    for mark in (mark for mark in layout.DELIMITERS if mark != BLANKS):
        widths = {len(Dialect(mark).cells(line)) for line in shown}
        if len(widths) == 1 and widths.pop() > 1:
            given = layout.DELIMITERS.get(reading.delimiter, f'"{printable(reading.delimiter)}"')
            raise reading.refuse(
                f"has {layout.DELIMITERS[mark]} between its cells, not {given}; leave out --delimiter", found.header
            )


def _is_below_text(lines: Sequence[str], header: int) -> bool:
    """Whether a header is a comment, or the lines above it are not comments."""
    above = (line for line in lines[: header - 1] if line.strip())
    return is_comment(lines[header - 1]) or not all(map(is_comment, above))


@dataclass
class _Fault:
    """Description of a fault, with its first position, number of occurrences and last line."""

    text: str
    line: int
    column: int
    times: int = 1
    last: int = 0


class _Body:
    """The rows below the header, read block by block."""

    def __init__(self, reading: Reading, layout: TableLayout, wanted: Mapping[str, int], size: int) -> None:
        self.reading = reading
        self.layout = layout
        self.names = layout.names
        self.dialect = layout.dialect
        self.wanted = frozenset(wanted.values())
        if layout.times:
            self.wanted |= {_time_of(layout, k) for k in self.wanted}
        self.size = size
        # Only the column t can hold times of day; in other columns they are text
        self.clock_column = wanted["t"] if wanted.get("t") in layout.clocks else None
        self.clock = Clock()
        self.time_column = wanted.get("t")
        # A segment header that continues in the next block; first row, line and start in seconds of each segment
        self.kept = ""
        self.segments: list[tuple[int, int, float]] = []
        # The columns that can be numeric; text columns and duplicates are not stored
        alike = Counter(self.names)
        self.stored: dict[int, Array] = {
            k: np.empty(0)
            for k, name in enumerate(self.names)
            if (name and alike[name] == 1) or k in self.wanted
        }
        self.text_columns: set[int] = set()
        # Cells at the end of a line may be missing if their columns have no name and are not needed, or end earlier
        named = [k + 1 for k, name in enumerate(self.names) if name or k in self.wanted]
        self.fewest = 1 if layout.times else max(named, default=len(self.names))
        # A row of separators alone has no cell: spreadsheets write such rows where something once was
        self.between = f" \t\f\v{layout.dialect.delimiter}"
        self.rows = 0
        self.line = layout.first - 1
        self.lines = Lines()
        self.faults: dict[tuple[str, ...], _Fault] = {}

    def take(self, text: str) -> None:
        """Take the rows of one block of whole lines, which may contain headers of further segments."""
        segments = self.layout.segments
        if segments is None:
            self._take_rows(text)
            return
        text, self.kept = self.kept + text, ""
        while (begin := segments.begin(text)) >= 0:
            self._take_rows(text[:begin])
            end = segments.end(text, begin)
            if end < 0:
                self.kept = text[begin:]
                if len(self.kept) > BLOCK:
                    raise self.reading.refuse("has a segment with an unfinished header; export it again", self.line + 1)
                return
            seconds, rows = segments.read(text[begin:end], self.line + 1)
            self.segments.append((self.rows, self.line + 1, seconds))
            if rows is not None and self.layout.rows is not None:
                self.layout.rows += rows
            self.line += text.count("\n", begin, end)
            text = text[end:]
        self._take_rows(text)

    def _take_rows(self, text: str) -> None:
        another = text.find(self.layout.another) if self.layout.another else -1
        if another >= 0:
            raise self.reading.refuse(
                f"contains a second table ({self.layout.kind}); one file is one experiment, export each separately",
                self.line + 1 + text.count("\n", 0, another),
            )
        lines = text.count("\n") + (not text.endswith("\n") and bool(text))
        if lines:
            cells = self._fast(text, lines)
            if cells is None:
                self._slow(text)
            else:
                self._room(lines, len(text))
                for k, x in zip(self.stored, cells.T, strict=True):
                    x_all = self.stored[k]
                    x_all[self.rows : self.rows + lines] = x
                self.lines.add(self.rows, self.line + 1)
                self.rows += lines
        self.line += lines

    def table(self, columns: Sequence[Column], chosen: dict[str, Column]) -> Table:
        """Everything read so far. Raises RecordError if a cell or a line was wrong."""
        reading = self.reading
        faults = list(self.faults.values())
        for fault in faults[:LISTED]:
            more = f" (and {fault.times - 1} more, the last in line {fault.last})" if fault.times > 1 else ""
            reading.problem(fault.text + more, fault.line, fault.column)
        if len(faults) > LISTED:
            more_faults = sum(fault.times for fault in faults[LISTED:])
            reading.problem(f"{more_faults} more cells and lines are wrong; correct the export")
        if self.clock.problem:
            reading.problem(self.clock.problem)
        if self.layout.rows is not None and self.rows != self.layout.rows:
            reading.notes.append(f"the file says that it has {self.layout.rows} samples, but it has {self.rows}")
        reading.refuse_if_any()
        for x in self.stored.values():
            x.resize(self.rows, refcheck=False)
        for k, factor in self.layout.scale.items():
            self.stored[k] *= factor
        self._join_segments()
        self._check_times(columns, chosen)
        reading.notes += self.clock.notes
        reading.origin = self.clock.first
        reading.left_out("without numbers", [self.names[k] for k in sorted(self.text_columns)])
        numeric = [c for k, c in enumerate(columns) if k not in self.text_columns]
        taken = {**chosen, **reading.further(numeric, chosen)}
        place = {c: k for k, c in enumerate(columns)}
        numbers = {name: self.stored[place[c]] for name, c in taken.items()}
        return reading.finished(numbers, taken, self.lines)

    def _check_times(self, columns: Sequence[Column], chosen: Mapping[str, Column]) -> None:
        """Raise RecordError if a column of time of another channel differs from that of the record."""
        for c in chosen.values():
            k = _time_of(self.layout, columns.index(c))
            if self.time_column is None or not self.layout.times or k == self.time_column:
                continue
            t, other = self.stored[self.time_column], self.stored[k]
            step = float(np.nanmedian(np.diff(t))) if len(t) > 1 else 0.0
            apart = np.abs(other - t)
            if np.isnan(other).any() != np.isnan(t).any() or float(np.nanmax(apart, initial=0.0)) > SAME_TIME * step:
                raise self.reading.refuse(
                    f"{printable(c.name)} has times of its own; export all channels with one sample "
                    "time",
                    self.layout.header,
                )

    def _join_segments(self) -> None:
        """Put the rows of all segments on a common time axis. Raises RecordError if a segment begins before another
        ends."""
        layout = self.layout.segments
        if layout is None:
            return
        if self.kept:
            self.reading.notes.append("the last segment has no rows; it was left out")
        if not self.segments:
            return
        self.reading.understood(f"{len(self.segments) + 1} segments")
        if self.time_column != layout.place:
            return
        t = self.stored[layout.place]
        ends = [row for row, _, _ in self.segments[1:]] + [self.rows]
        for (row, line, seconds), end in zip(self.segments, ends, strict=True):
            t[row:end] += seconds
            if 0 < row < end and not t[row] > t[row - 1]:
                raise self.reading.refuse(
                    f"has a segment that begins at {t[row]:g} s, but the one before it ends at {t[row - 1]:g} s; "
                    "one file is one experiment, export each separately",
                    line,
                )

    def _room(self, rows: int, size: int) -> None:
        """Make room for `rows` more rows; on the first call, for the whole file, given that these rows take `size`
        bytes."""
        needed = self.rows + rows
        have = min((len(x) for x in self.stored.values()), default=needed)
        if needed <= have:
            return
        expected = int(SPARE * rows * self.size / max(size, 1)) if not self.rows else needed + needed // 4
        for k in self.stored:
            if not self.rows:
                # resize would fill memory with zeros that may never be needed
                self.stored[k] = np.empty(max(needed, expected))
            else:
                self.stored[k].resize(max(needed, expected), refcheck=False)

    def _fast(self, text: str, lines: int) -> NDArray[np.float64] | None:
        """All cells, read by numpy's C reader; None if a line may be faulty or may have to be left out."""
        stored = list(self.stored)
        everything = len(stored) == len(self.names)
        dialect = self.dialect
        if not everything and (COMMENT.search(text) or not self._regular(text, lines)):
            return None
        if dialect.decimal != ".":
            if dialect.decimal == dialect.delimiter or "." in text:
                return None
            text = text.replace(dialect.decimal, ".")
        clock = copy(self.clock)  # goes on from here, in an attempt that may be abandoned
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                cells = np.loadtxt(
                    io.StringIO(text), delimiter=None if dialect.delimiter == BLANKS else dialect.delimiter,
                    comments=None, ndmin=2, quotechar='"', encoding=None, usecols=None if everything else stored,
                    converters=None if self.clock_column is None else {self.clock_column: clock.seconds},
                )
        except (ValueError, UserWarning):
            return None
        if cells.shape != (lines, len(stored)):
            return None
        self.clock = clock
        return cells

    def _regular(self, text: str, lines: int) -> bool:
        """Whether every line has as many cells as the header; numpy checks only the requested columns."""
        try:
            data = np.frombuffer(text.encode("latin-1"), dtype=np.uint8)
        except UnicodeEncodeError:
            return False
        ends = data == ord("\n")
        if self.dialect.delimiter == BLANKS:
            if '"' in text:
                return False
            blank = (data == ord(" ")) | (data == ord("\t")) | ends
            # Where blanks separate cells, starts of cells are counted; else delimiters, one fewer in each line
            between = ~blank & np.concatenate([[True], blank[:-1]])
            extra = 1
        else:
            between = data == ord(self.dialect.delimiter)
            extra = 0
        if '"' in text:
            quotes = data == ord('"')
            quoted = np.logical_xor.accumulate(quotes)
            before = np.concatenate([[True], (ends | between)[:-1]])
            # numpy reads quotes differently if they open in the middle of a cell, or stay open at the end of a line
            if np.any(quotes & quoted & ~before) or np.any(ends & quoted) or quoted[-1]:
                return False
            between &= ~quoted
        rows = np.append(np.flatnonzero(ends)[: lines - 1], len(data))
        found = np.diff(np.searchsorted(np.flatnonzero(between), rows), prepend=0) - extra + 1
        return bool(np.all((self.fewest <= found) & (found <= len(self.names))))

    def _slow(self, text: str) -> None:
        """Read line by line, reporting wrong cells with their positions and accepting missing ones."""
        names = self.names
        values: dict[int, list[float]] = {k: [] for k in self.stored}
        lines: list[int] = []
        for line, row in enumerate(text.split("\n"), self.line + 1):
            if not row.strip(self.between) or row == self.layout.ends or is_comment(row):
                continue
            cells = self.dialect.cells(row)
            if not self.fewest <= len(cells) <= len(names):
                count = counted(len(cells), "column")
                self._wrong(
                    f"{count} where the header has {len(names)}; complete or remove the line", (count,), line, 1
                )
                continue
            lines.append(line)
            for k, numbers in values.items():
                start, cell = cells[k] if k < len(cells) else (len(row), "")
                try:
                    number = self._number(k, cell)
                except ValueError:
                    number = float("nan")
                    if k not in self.wanted:
                        self.text_columns.add(k)
                        self.stored.pop(k, None)
                    else:
                        self._bad_cell(k, cell, line, start + 1)
                numbers.append(number)
            if len(values) > len(self.stored):
                values = {k: values[k] for k in self.stored}
        self._room(len(lines), len(text))
        for k, x in self.stored.items():
            x[self.rows : self.rows + len(lines)] = values[k]
        if lines:
            self.lines.add(self.rows, np.array(lines))
        self.rows += len(lines)

    def _number(self, column: int, cell: str) -> float:
        if column == self.clock_column and cell.strip().lower() not in MISSING:
            return self.clock.seconds(cell)
        return self.dialect.number(cell)

    def _bad_cell(self, column: int, cell: str, line: int, place: int) -> None:
        """Report a cell of a needed column that is not a number. The same fault in many cells counts as one problem."""
        name = printable(self.names[column]) or f"#{column + 1}"
        if column == self.clock_column:
            kind, what, advice = "", "a time of day", "write every time like the first one"
        else:
            what = "a number"
            kind, advice = self.dialect.fault(cell)
        self._wrong(
            f'"{printable(cell.strip())}" in column "{name}" is not {what}; {advice}',
            (kind,) if kind else (kind, name, shape(cell)),
            line,
            place,
        )

    def _wrong(self, text: str, cause: tuple[str, ...], line: int, column: int) -> None:
        fault = self.faults.get(cause)
        if fault is None:
            self.faults[cause] = _Fault(text, line, column)
        else:
            fault.times += 1
            fault.last = line
