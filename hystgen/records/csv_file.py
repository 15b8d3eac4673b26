"""CSV with a header row, read in blocks: numpy's C reader takes those that are sound, the others go line by line.

A file of any size then needs little more memory than its columns, and every fault is told with its place.
"""

from __future__ import annotations

import io
import os
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import IO

import numpy as np
from numpy.typing import NDArray

from hystgen.problems import printable
from hystgen.records.columns import LISTED, Column, column
from hystgen.records.reading import Lines, Reading, Table
from hystgen.records.record import Array
from hystgen.words import counted

BLOCK = 1 << 20
"""Bytes read at a time; a longer line is none of a CSV file."""

MISSING = frozenset(("", "nan", "na", "n/a", "null", "none", "inf", "+inf", "-inf", "infinity", "-infinity"))
"""Cells, in lower case, that hold no value."""

SPARE = 1.05
"""Rows are set aside for a file of so many times the rows that its first block makes expect."""


def read_csv(reading: Reading, stream: IO[bytes]) -> Table:
    """Read a text file with one row a line."""
    blocks = _texts(reading, stream)
    skipped = 0
    blank = True
    for text in blocks:
        above, header, body = _split_header(text)
        skipped += above
        if header is not None:
            break
        blank = blank and not text.strip()
    else:
        raise reading.refuse(
            "is empty; record again or give another file"
            if blank
            else "has no header row; the first line names the columns, for example t,v,y"
        )
    line = skipped + 1
    names = _header(reading, header, line)
    columns = [column(name) for name in names]
    chosen = reading.chosen(columns, line=line)
    body_reader = _Body(reading, names, [names.index(c.name) for c in chosen.values()], line, _size(stream))
    body_reader.take(body)
    for text in blocks:
        body_reader.take(text)
    return body_reader.table(columns, chosen)


def _texts(reading: Reading, stream: IO[bytes]) -> Iterator[str]:
    """The file's text in blocks of whole lines that end in a line feed, as every line does but perhaps the last."""
    first = True
    latin = False
    for data in _blocks(reading, stream):
        if first and data[:2] in (b"\xff\xfe", b"\xfe\xff"):
            raise reading.refuse("is UTF-16 text; save it as UTF-8")
        if b"\0" in data:
            raise reading.refuse("is not a text file; export CSV, .npz, .h5, Parquet or MATLAB .mat")
        try:
            text = data.decode("utf-8-sig" if first else "utf-8")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
            if not latin:
                reading.notes.append("the text is not UTF-8; it was read as Latin-1")
            latin = True
        if "\r" in text:
            text = text.replace("\r\n", "\n").replace("\r", "\n")
        first = False
        yield text


def _blocks(reading: Reading, stream: IO[bytes]) -> Iterator[bytes]:
    rest = b""
    while data := stream.read(BLOCK):
        data = rest + data
        # A carriage return at the end may be the first half of a line end
        end = max(data.rfind(b"\n"), data.rfind(b"\r", 0, -1)) + 1
        if end:
            yield data[:end]
        rest = data[end:]
        if len(rest) > BLOCK:
            raise reading.refuse(f"has a line of more than {BLOCK >> 20} MB; export one row a line")
    if rest:
        yield rest


def _size(stream: IO[bytes]) -> int:
    """Bytes of the file; 0 for a pipe."""
    return os.fstat(stream.fileno()).st_size


def _split_header(text: str) -> tuple[int, str | None, str]:
    """Number of lines above the header (blank, or comments that begin with #), the header, and what follows it."""
    start = 0
    skipped = 0
    while start < len(text):
        end = text.find("\n", start)
        end = len(text) if end < 0 else end
        line = text[start:end]
        if line.strip() and not line.lstrip().startswith("#"):
            return skipped, line, text[end + 1 :]
        skipped += 1
        start = end + 1
    return skipped, None, ""


def _header(reading: Reading, header: str, line: int) -> list[str]:
    """Names of the columns. Raises RecordError where the line names none, or is separated by something else."""
    names = [cell.strip() for _, cell in _cells(header, reading.delimiter)]
    if all(_is_number(name) for name in names if name):
        raise reading.refuse("the first line has numbers, not names; put a header such as t,v,y above them", line)
    if len(names) == 1 and reading.delimiter not in header:
        for other, option in ((";", '";"'), ("\t", "tab"), ("|", '"|"'), (" ", '" "'), (",", '","')):
            if other in header.strip() and other != reading.delimiter:
                raise reading.refuse(
                    f"the header is one column, {printable(names[0])}; if its columns are separated otherwise, use "
                    f"--delimiter {option}",
                    line,
                )
    return names


class _Body:
    """The rows below the header, as they come in."""

    def __init__(self, reading: Reading, names: list[str], wanted: Sequence[int], line: int, size: int) -> None:
        self.reading = reading
        self.names = names
        self.wanted = frozenset(wanted)
        self.size = size
        # Columns of numbers, as far as is known; those with text, and those called alike, are not stored
        alike = Counter(names)
        self.stored: dict[int, Array] = {
            k: np.empty(0) for k, name in enumerate(names) if name and (alike[name] == 1 or k in self.wanted)
        }
        self.text_columns: set[int] = set()
        self.rows = 0
        self.line = line
        self.lines = Lines()
        self.bad = 0

    def take(self, text: str) -> None:
        """Rows of one block of whole lines."""
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
        """Everything read so far. Raises RecordError when a cell or a line was wrong."""
        reading = self.reading
        if self.bad > LISTED:
            reading.problem(f"{self.bad - LISTED} more cells and lines are wrong; correct the export")
        reading.refuse_if_any()
        for x in self.stored.values():
            x.resize(self.rows, refcheck=False)
        reading.left_out("without numbers", [self.names[k] for k in sorted(self.text_columns)])
        numeric = [c for k, c in enumerate(columns) if k not in self.text_columns]
        taken = {**chosen, **reading.further(numeric, chosen)}
        place = {name: k for k, name in enumerate(self.names) if k in self.stored}
        numbers = {name: self.stored[place[c.name]] for name, c in taken.items()}
        return reading.finished(numbers, taken, self.lines)

    def _room(self, rows: int, size: int) -> None:
        """Make room for so many more rows, at once for all that may come when these have `size` bytes."""
        needed = self.rows + rows
        have = min((len(x) for x in self.stored.values()), default=needed)
        if needed <= have:
            return
        expected = int(SPARE * rows * self.size / max(size, 1)) if not self.rows else needed + needed // 4
        for k in self.stored:
            if not self.rows:
                # Not by resize, which fills with zeros what may never be needed
                self.stored[k] = np.empty(max(needed, expected))
            else:
                self.stored[k].resize(max(needed, expected), refcheck=False)

    def _fast(self, text: str, lines: int) -> NDArray[np.float64] | None:
        """All cells by numpy's C reader; None when a line may have to be left out or told."""
        stored = list(self.stored)
        everything = len(stored) == len(self.names)
        if not everything and ("#" in text or not self._regular(text, lines)):
            return None
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                cells = np.loadtxt(
                    io.StringIO(text), delimiter=self.reading.delimiter, comments=None, ndmin=2, quotechar='"',
                    usecols=None if everything else stored,
                )  # fmt: skip
        except (ValueError, UserWarning):
            return None
        return cells if cells.shape == (lines, len(stored)) else None

    def _regular(self, text: str, lines: int) -> bool:
        """Whether every line has as many cells as the header; numpy looks only at those it is asked for."""
        try:
            data = np.frombuffer(text.encode("latin-1"), dtype=np.uint8)
        except UnicodeEncodeError:
            return False
        ends, between = data == ord("\n"), data == ord(self.reading.delimiter)
        if '"' in text:
            quotes = data == ord('"')
            quoted = np.logical_xor.accumulate(quotes)
            before = np.concatenate([[True], (ends | between)[:-1]])
            # Quotes that open in the middle of a cell, or stay open at the end of a line, are read differently by numpy
            if np.any(quotes & quoted & ~before) or np.any(ends & quoted) or quoted[-1]:
                return False
            between &= ~quoted
        rows = np.append(np.flatnonzero(ends)[: lines - 1], len(data))
        found = np.searchsorted(np.flatnonzero(between), rows)
        return bool(np.all(np.diff(found, prepend=0) == len(self.names) - 1))

    def _slow(self, text: str) -> None:
        """Line by line: finds what is wrong and where, and takes what is merely missing."""
        names, delimiter = self.names, self.reading.delimiter
        values: dict[int, list[float]] = {k: [] for k in self.stored}
        lines: list[int] = []
        for line, row in enumerate(text.split("\n"), self.line + 1):
            if not row.strip() or row.lstrip().startswith("#"):
                continue
            cells = _cells(row, delimiter)
            if len(cells) != len(names):
                self._wrong(f"{counted(len(cells), 'column')} where the header has {len(names)}; complete or remove "
                            "the line", line, 1)  # fmt: skip
                continue
            lines.append(line)
            for k, numbers in values.items():
                start, cell = cells[k]
                try:
                    number = float(cell)
                    if "_" in cell:
                        raise ValueError
                except ValueError:
                    number = float("nan")
                    if cell.strip().lower() not in MISSING:
                        if k not in self.wanted:
                            self.text_columns.add(k)
                            self.stored.pop(k, None)
                        else:
                            self._wrong(
                                f'"{printable(cell.strip())}" in column "{printable(names[k])}" is no number; '
                                + _cell_advice(cell),
                                line,
                                start + 1,
                            )
                numbers.append(number)
            if len(values) > len(self.stored):
                values = {k: values[k] for k in self.stored}
        self._room(len(lines), len(text))
        for k, x in self.stored.items():
            x[self.rows : self.rows + len(lines)] = values[k]
        if lines:
            self.lines.add(self.rows, np.array(lines))
        self.rows += len(lines)

    def _wrong(self, text: str, line: int, column: int) -> None:
        self.bad += 1
        if self.bad <= LISTED:
            self.reading.problem(text, line, column)


def _cells(line: str, delimiter: str) -> list[tuple[int, str]]:
    """Cells of a line with the position at which each starts; quotes are taken off."""
    if '"' not in line:
        cells = []
        start = 0
        for cell in line.split(delimiter):
            cells.append((start, cell))
            start += len(cell) + 1
        return cells
    return list(_quoted_cells(line, delimiter))


def _quoted_cells(line: str, delimiter: str) -> Iterator[tuple[int, str]]:
    start = 0
    quoted = False
    for k in range(len(line) + 1):
        if k == len(line) or (line[k] == delimiter and not quoted):
            cell = line[start:k].strip()
            if len(cell) >= 2 and cell[0] == cell[-1] == '"':
                cell = cell[1:-1].replace('""', '"')
            yield start, cell
            start = k + 1
        elif line[k] == '"':
            quoted = not quoted


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return text.strip().lower() not in MISSING


def _cell_advice(cell: str) -> str:
    if "," in cell and _is_number(cell.replace(",", ".", 1)):
        return "write decimals with a point"
    return "write a number, or nothing where there is no value"
