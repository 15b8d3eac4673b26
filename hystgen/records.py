"""Measured data in, computed columns out: one file is one experiment.

CSV with a header row (`t` in seconds, `v` drive, `y` measured, any further columns), `.npz` and MATLAB `.mat` (v5)
with the same names. What is wrong with a file is refused, all of it at once and each with its place; small faults of
a recording are repaired and counted in `Record.notes`.
"""

from __future__ import annotations

import contextlib
import csv
import difflib
import io
import os
import tempfile
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.problems import RecordError, printable

Array = NDArray[np.float64]

SHORTEST = 16
"""Fewest samples of a record that a model is fitted to."""

REPAIRABLE = 0.05
"""Largest share of samples that is dropped with a note; beyond it a file is refused."""

GAP = 3.0
"""A step longer than this many median steps is a gap."""

LISTED = 20
"""Bad cells named one by one before the rest is only counted."""

MISSING = frozenset(("", "nan", "na", "n/a", "null", "none", "inf", "+inf", "-inf", "infinity", "-infinity"))
"""Cells, in lower case, that hold no value."""

STANDARD = ("t", "v", "y")

ALIASES = {
    "t": ("t", "time", "times", "zeit", "timestamp"),
    "v": ("v", "voltage", "volt", "drive", "input", "u", "command"),
    "y": ("y", "displacement", "position", "pos", "output", "measured", "sensor", "disp"),
    "u": ("u", "reference", "ref", "setpoint", "target"),
}


@dataclass(frozen=True)
class Record:
    """One experiment: arrays of N samples.

    `name`: file name without its folder; `t`: seconds, strictly rising; `v`: drive (empty when the file has no such
    column and none was needed); `y`: measured displacement or None; `extra`: further numeric columns by name;
    `sample_time`: median step of `t`; `notes`: what was repaired or left out, one sentence each.
    """

    name: str
    t: Array
    v: Array
    y: Array | None = None
    extra: Mapping[str, Array] = field(default_factory=dict)
    sample_time: float = 1.0
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.t)

    def columns(self) -> dict[str, Array]:
        """Every column by name: t, v, y where there, then the further ones."""
        found = {"t": self.t}
        if len(self.v) or not len(self.t):
            found["v"] = self.v
        if self.y is not None:
            found["y"] = self.y
        return {**found, **self.extra}

    def section(self, first: int | None = None, last: int | None = None, name: str | None = None) -> Record:
        """Samples `first` to `last` (exclusive, both as in a slice) as a record of their own."""
        part = slice(first, last)
        return replace(
            self,
            name=name or self.name,
            t=self.t[part],
            v=self.v[part],
            y=None if self.y is None else self.y[part],
            extra={key: values[part] for key, values in self.extra.items()},
        )


def parse_columns(text: str) -> dict[str, str]:
    """Mapping of our names to a file's: `t=Time,v=U,y=Pos`. Raises ValueError with what is wrong with it."""
    mapping: dict[str, str] = {}
    for part in text.split(","):
        ours, equals, theirs = (piece.strip() for piece in part.partition("="))
        if not equals or not ours or not theirs:
            raise ValueError(f'"{printable(part.strip())}" is no NAME=COLUMN; write t=Time,v=U,y=Pos')
        if not ours.isidentifier():
            raise ValueError(f'"{printable(ours)}" is no column name; the names on the left are t, v, y, u, ...')
        if ours in mapping:
            raise ValueError(f"{ours} is given twice; name one column for it")
        if theirs in mapping.values():
            raise ValueError(f'column "{printable(theirs)}" is given two names; name it once')
        mapping[ours] = theirs
    return mapping


def read_records(
    sources: Iterable[Record | str | os.PathLike[str]],
    columns: Mapping[str, str] | None = None,
    sample_time: float | None = None,
    delimiter: str | None = None,
    need: Sequence[str] = ("v", "y"),
) -> list[Record]:
    """Read several data files as `read_record` does; records that are in memory already are kept.

    Raises RecordError with every problem in all files.
    """
    found: list[Record] = []
    refused: list[str] = []
    for source in sources:
        try:
            if not isinstance(source, Record):
                source = read_record(source, columns, sample_time, delimiter, need)
            found.append(source)
        except RecordError as error:
            refused.extend(error.problems)
    if refused:
        raise RecordError(refused)
    return found


def read_record(
    path: str | os.PathLike[str],
    columns: Mapping[str, str] | None = None,
    sample_time: float | None = None,
    delimiter: str | None = None,
    need: Sequence[str] = ("v", "y"),
) -> Record:
    """Read one data file.

    `columns`: our names to the file's (`{"t": "Time"}`); `sample_time`: seconds, for a file without time; `delimiter`:
    one character, default a comma; `need`: the columns that must be there. When `y` is among them the record is meant
    for a fit: it then has at least 16 samples and a drive that moves. Samples without a value in `t` or a needed
    column, and samples whose time does not rise, are dropped with a note up to 5 % of the record.

    Raises RecordError with every problem in the file.
    """
    file = os.fspath(path)
    reader = _Reader(file, dict(columns or {}), sample_time, delimiter or ",", tuple(need))
    return reader.read()


def columns_text(header: Sequence[str], arrays: Sequence[ArrayLike]) -> str:
    """Columns of equal length as CSV: shortest digits that read back to the same number."""
    columns = [_texts(np.asarray(values)) for values in arrays]
    if len(columns) != len(header) or len({len(column) for column in columns}) > 1:
        raise ValueError("a CSV table takes one name a column and columns of equal length")
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(header)
    text.writelines(",".join(row) + "\n" for row in zip(*columns, strict=True))
    return text.getvalue()


def write_columns(path: str | os.PathLike[str], header: Sequence[str], arrays: Sequence[ArrayLike]) -> None:
    """Write `columns_text` to a file, all or nothing."""
    write_atomically(path, columns_text(header, arrays))


def write_atomically(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file so that it is either the old one or complete.

    A link stays a link, and what is no regular file (a pipe, a terminal) is written to in place. Raises OSError.
    """
    target = Path(os.path.realpath(path))
    if target.exists() and not target.is_file():
        target.write_bytes(text.encode())
        return
    try:
        handle, temporary = tempfile.mkstemp(prefix=".hystgen-", dir=target.parent)
    except OSError as failure:
        # Name the file that was asked for, not the temporary one
        raise OSError(failure.errno, failure.strerror, os.fspath(path)) from None
    try:
        with os.fdopen(handle, "wb") as out:
            out.write(text.encode())
        # mkstemp makes files for the owner alone; give the one that stays the usual rights
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(temporary, 0o666 & ~mask)
        os.replace(temporary, target)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise


def _texts(values: NDArray[Any]) -> list[str]:
    if values.ndim != 1:
        raise ValueError("a column has one dimension")
    if values.dtype == np.float64 or values.dtype.kind in "iub":
        return [repr(x) for x in values.tolist()]
    return [str(x) for x in values]


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


class _Table:
    """What a file holds before it is judged: names, and columns of numbers with NaN where there is no value.

    `lines`: the line of each row, where the file has lines and something may have to be said about one of them.
    """

    def __init__(
        self, numbers: dict[str, Array], ignored: Sequence[str] = (), lines: Sequence[int] | None = None
    ) -> None:
        self.numbers = numbers
        self.ignored = list(ignored)
        self._lines = lines

    def line(self, row: int) -> int | None:
        """Line of the file that a row came from; None where the file has no lines."""
        return None if self._lines is None else int(self._lines[row])


class _Reader:
    def __init__(
        self, file: str, columns: dict[str, str], sample_time: float | None, delimiter: str, need: tuple[str, ...]
    ) -> None:
        self.file = file
        self.columns = columns
        self.sample_time = sample_time
        self.delimiter = "\t" if delimiter in ("\\t", "tab") else delimiter
        self.need = need
        self.problems: list[str] = []
        self.notes: list[str] = []

    def problem(self, text: str, line: int | None = None, column: int | None = None) -> None:
        place = self.file if line is None else f"{self.file}:{line}:{column or 1}"
        self.problems.append(f"{place}: error: {text}")

    def refuse_if_any(self) -> None:
        if self.problems:
            raise RecordError(self.problems)

    # -- the file's own form -----------------------------------------------------------------------------------------

    def read(self) -> Record:
        if len(self.delimiter) != 1 or self.delimiter in "\"'.\r\n" or self.delimiter.isalnum():
            self.problem(f'the delimiter "{printable(self.delimiter)}" is not usable; give one character such as ;')
        if self.sample_time is not None and not (0.0 < self.sample_time < float("inf")):
            self.problem(f"the sample time {self.sample_time:g} is not positive; give seconds per sample")
        self.refuse_if_any()
        suffix = Path(self.file).suffix.lower()
        if suffix in (".h5", ".hdf5", ".parquet", ".pq"):
            kind = "Parquet" if suffix in (".parquet", ".pq") else "HDF5"
            self.problem(f"{kind} files are not read by this version; export CSV, .npz or MATLAB .mat (v5)")
        self.refuse_if_any()
        try:
            data = Path(self.file).read_bytes()
        except OSError as failure:
            self.problem(f"cannot be read ({failure.strerror or failure}); give the path of a data file")
        self.refuse_if_any()
        if not data.strip():
            self.problem("is empty; record again or give another file")
        self.refuse_if_any()
        if suffix == ".npz":
            table = self._arrays(_npz_arrays, data, "a NumPy .npz archive")
        elif suffix == ".mat":
            table = self._arrays(_mat_arrays, data, "a MATLAB v5 .mat file")
        else:
            table = self._csv(data)
        self.refuse_if_any()
        return self._record(table)

    def _arrays(self, open_arrays: Any, data: bytes, kind: str) -> _Table:
        try:
            found = open_arrays(data)
        except NotImplementedError:
            self.problem("is a MATLAB v7.3 file; save it with -v7 or export CSV")
        except Exception as failure:
            self.problem(f"is not {kind} ({printable(str(failure))}); export it again")
        self.refuse_if_any()
        numbers: dict[str, Array] = {}
        ignored = []
        lengths: dict[str, int] = {}
        for name, values in found.items():
            flat = np.asarray(values)
            vector = flat.size > 1 and flat.size == max(flat.shape, default=0)
            if not vector or flat.dtype.kind not in "fiub":
                ignored.append(str(name))
                continue
            numbers[str(name)] = np.ascontiguousarray(flat.ravel(), dtype=np.float64)
            lengths[str(name)] = flat.size
        names = self._find(list(numbers), None)
        self.refuse_if_any()
        chosen = {lengths[theirs] for theirs in names.values()}
        if len(chosen) > 1:
            told = ", ".join(f"{theirs} has {lengths[theirs]}" for theirs in names.values())
            self.problem(f"the columns differ in length: {told} samples; export them with one length")
            self.refuse_if_any()
        length = chosen.pop()
        ignored += [name for name in numbers if lengths[name] != length]
        kept = self._renamed({name: x for name, x in numbers.items() if lengths[name] == length}, names)
        for name, x in kept.items():
            x[~np.isfinite(x)] = np.nan
            kept[name] = x
        return _Table(kept, ignored)

    def _csv(self, data: bytes) -> _Table:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
                self.problem("is UTF-16 text; save it as UTF-8")
                self.refuse_if_any()
            text = data.decode("latin-1")
            self.notes.append("the text is not UTF-8; it was read as Latin-1")
        if "\0" in text:
            self.problem("is not a text file; export CSV, .npz or MATLAB .mat (v5)")
            self.refuse_if_any()
        if "\r" in text:
            text = text.replace("\r\n", "\n").replace("\r", "\n")
        skipped, header, body = _split_header(text)
        if header is None:
            self.problem("has no header row; the first line names the columns, for example t,v,y")
            self.refuse_if_any()
        assert header is not None
        names = [cell.strip() for _, cell in _cells(header, self.delimiter)]
        line = skipped + 1
        chosen = self._find(names, line, header)
        self.refuse_if_any()
        table = self._fast(body, names, chosen)
        if table is None:
            table = self._slow(body, names, chosen, line)
        return table

    def _find(self, names: list[str], line: int | None, header: str = "") -> dict[str, str]:
        """Our names to the file's for every column that is asked for and there; problems for the others."""
        if line is not None and names and all(_is_number(name) for name in names if name):
            self.problem("the first line has numbers, not names; put a header such as t,v,y above them", line, 1)
            return {}
        there = ", ".join(printable(name) or '""' for name in names) or "none"
        if line is not None and len(names) == 1 and self.delimiter not in header:
            for other, option in ((";", '";"'), ("\t", "tab"), ("|", '"|"'), (" ", '" "'), (",", '","')):
                if other in header.strip() and other != self.delimiter:
                    self.problem(
                        f"the header is one column, {there}; if its columns are separated otherwise, use "
                        f"--delimiter {option}",
                        line,
                        1,
                    )
                    return {}
        wanted = dict.fromkeys([*self.need, *STANDARD])
        found: dict[str, str] = {}
        for ours in [*wanted, *(key for key in self.columns if key not in wanted)]:
            theirs = self.columns.get(ours, ours)
            required = ours in self.need or ours in self.columns
            if ours == "t" and "t" not in self.columns:
                required = self.sample_time is None
            matches = names.count(theirs)
            if matches == 1:
                found[ours] = theirs
            elif matches > 1:
                self.problem(f'{matches} columns are called "{printable(theirs)}"; give them different names', line)
            elif required:
                advice = self._advice(ours, names)
                if ours == "t" and "t" not in self.columns:
                    advice = "give --sample-time" + (f", or {advice}" if "did you mean" in advice else "")
                self.problem(f'there is no column "{printable(theirs)}" among {there}; {advice}', line)
        return found

    def _advice(self, ours: str, names: Sequence[str]) -> str:
        """Which column may be meant, by its name without units, else how to name one."""
        words = {name: name.casefold().replace("[", " ").replace("(", " ").replace("_", " ").split() for name in names}
        for alias in ALIASES.get(ours, (ours,)):
            for name, parts in words.items():
                if parts and parts[0] == alias and self.columns.get(ours) != name:
                    return f'did you mean --columns "{ours}={printable(name)}"?'
        wanted = self.columns.get(ours, ours).casefold()
        close = difflib.get_close_matches(wanted, [name.casefold() for name in names], 1)
        for name in names:
            if close and name.casefold() == close[0]:
                return f'did you mean --columns "{ours}={printable(name)}"?'
        return f'name it with --columns "{ours}=COLUMN"'

    def _renamed(self, numbers: Mapping[str, Array], chosen: Mapping[str, str]) -> dict[str, Array]:
        """Columns under our names; a column of the file that happens to bear a taken name gives way."""
        theirs = set(chosen.values())
        others = {name: x for name, x in numbers.items() if name not in theirs and name and name not in chosen}
        return {**{ours: numbers[name] for ours, name in chosen.items()}, **others}

    def _fast(self, body: str, names: list[str], chosen: Mapping[str, str]) -> _Table | None:
        """All cells at once by numpy's C reader; None when there is anything that has to be dropped or told."""
        if len(set(names)) != len(names) or "#" in body:
            return None
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                cells = np.loadtxt(io.StringIO(body), delimiter=self.delimiter, comments=None, ndmin=2)
        except (ValueError, UserWarning):
            return None
        if cells.shape[1] != len(names) or not np.isfinite(cells).all():
            return None
        numbers = self._renamed({n: np.ascontiguousarray(cells[:, k]) for k, n in enumerate(names)}, chosen)
        rises = "t" not in numbers or bool(np.all(np.diff(numbers["t"]) > 0.0))
        return _Table(numbers) if rises else None

    def _slow(self, body: str, names: list[str], chosen: Mapping[str, str], line: int) -> _Table:
        """Line by line: finds what is wrong and where, and takes what is merely missing."""
        wanted = {names.index(theirs) for theirs in chosen.values()}
        unique = [k for k, name in enumerate(names) if name and names.count(name) == 1]
        values: dict[int, list[float]] = {k: [] for k in unique}
        text_columns: set[int] = set()
        lines: list[int] = []
        bad = 0
        for row in body.split("\n"):
            line += 1
            if not row.strip() or row.lstrip().startswith("#"):
                continue
            cells = _cells(row, self.delimiter)
            if len(cells) != len(names):
                bad += 1
                if bad <= LISTED:
                    found = _count(len(cells), "column")
                    self.problem(f"{found} where the header has {len(names)}; complete or remove the line", line)
                continue
            lines.append(line)
            for k, column in values.items():
                start, cell = cells[k]
                try:
                    number = float(cell)
                    if "_" in cell:
                        raise ValueError
                except ValueError:
                    number = float("nan")
                    if cell.strip().lower() not in MISSING:
                        if k in wanted:
                            bad += 1
                            if bad <= LISTED:
                                self.problem(
                                    f'"{printable(cell.strip())}" in column "{printable(names[k])}" is no number; '
                                    + _cell_advice(cell),
                                    line,
                                    start + 1,
                                )
                        else:
                            text_columns.add(k)
                column.append(number)
        if bad > LISTED:
            self.problem(f"{bad - LISTED} more cells and lines are wrong; correct the export")
        self.refuse_if_any()
        numbers = {}
        for k in unique:
            if k not in text_columns:
                numbers[names[k]] = np.array(values[k], dtype=np.float64)
                numbers[names[k]][~np.isfinite(numbers[names[k]])] = np.nan
        return _Table(self._renamed(numbers, chosen), [names[k] for k in sorted(text_columns)], lines)

    # -- what a record has to be -------------------------------------------------------------------------------------

    def _record(self, table: _Table) -> Record:
        if table.ignored:
            self.notes.append("columns without numbers were left out: " + ", ".join(map(printable, table.ignored)))
        columns = table.numbers
        length = len(next(iter(columns.values()), ()))
        keep = np.ones(length, dtype=bool)
        needed = [name for name in self.need if name in columns]
        if "t" in columns:
            needed.append("t")
        for name in dict.fromkeys(needed):
            keep &= np.isfinite(columns[name])
        self._dropped(table, length, ~keep, "without a value in " + " or ".join(dict.fromkeys(needed)))
        if "t" in columns:
            keep = self._rising(table, columns["t"], keep)
        kept = {name: np.ascontiguousarray(x[keep]) for name, x in columns.items()}
        fit = "y" in self.need
        samples = int(np.count_nonzero(keep))
        shortest = SHORTEST if fit else 1
        if samples < shortest and not self.problems:
            self.problem(f"has {_count(samples, 'sample')}, at least {shortest} are needed; record for longer")
        elif fit and samples and "v" in kept and float(np.ptp(kept["v"])) == 0.0:
            self.problem(
                f"the drive v is {kept['v'][0]:g} throughout; a fit needs a drive that moves, check the columns"
            )
        self.refuse_if_any()
        t: Array
        if "t" in kept:
            t = kept.pop("t")
            step = self._step(t)
        else:
            step = self.sample_time or 1.0
            t = np.arange(samples, dtype=np.float64) * step
        v: Array = kept.pop("v", np.empty(0, dtype=np.float64))
        y = kept.pop("y", None)
        return Record(Path(self.file).name, t, v, y, kept, step, tuple(self.notes))

    def _dropped(self, table: _Table, length: int, wrong: NDArray[np.bool_], which: str) -> None:
        """Note the samples that are dropped, or refuse when they are too many."""
        number = int(np.count_nonzero(wrong))
        if not number:
            return
        row = int(np.argmax(wrong))
        line = table.line(row)
        first = f"the first at index {row}" if line is None else f"the first in line {line}"
        if number > REPAIRABLE * length:
            self.problem(
                f"{number} of {length} samples are {which}, {first}; more than {100 * REPAIRABLE:g} % is not repaired, "
                "record or export again",
                line,
            )
        else:
            self.notes.append(f"{_count(number, 'sample')} {which} dropped, {first}")

    def _rising(self, table: _Table, t: Array, keep: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Keep the samples whose time is later than all before them."""
        rows = np.flatnonzero(keep)
        if len(rows) < 2:
            return keep
        before = np.maximum.accumulate(t[rows])[:-1]
        late = np.zeros(len(t), dtype=bool)
        late[rows[1:]] = t[rows[1:]] <= before
        self._dropped(table, len(rows), late, "not later than the sample before")
        return keep & ~late

    def _step(self, t: Array) -> float:
        """Median time step; gaps are noted."""
        if len(t) < 2:
            return self.sample_time or 1.0
        steps = np.diff(t)
        step = float(np.median(steps))
        gaps = steps > GAP * step
        number = int(np.count_nonzero(gaps))
        if number:
            worst = int(np.argmax(steps))
            self.notes.append(
                f"{_count(number, 'gap')} longer than {GAP:g} median steps kept, the largest {steps[worst]:.4g} s "
                f"at t = {t[worst]:.6g} s"
            )
        if self.sample_time is not None and abs(self.sample_time - step) > 0.01 * step:
            self.notes.append(
                f"the file has its own time with a step of {step:.6g} s; the sample time {self.sample_time:g} s given "
                "was not used"
            )
        return step


def _npz_arrays(data: bytes) -> dict[str, Any]:
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}


def _mat_arrays(data: bytes) -> dict[str, Any]:
    if data[:19] == b"MATLAB 7.3 MAT-file" or data[:8] == b"\x89HDF\r\n\x1a\n":
        raise NotImplementedError
    from scipy.io import loadmat

    found: dict[str, Any] = loadmat(io.BytesIO(data), squeeze_me=False)
    return {name: values for name, values in found.items() if not name.startswith("__")}


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
