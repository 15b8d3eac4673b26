"""Split lines of a text table into cells, and convert cells to numbers or times in the file's notation."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date

# Times of day: ISO 8601, `5.3.2024 14:21:05.5`, `14:21:05`, `2:21:05 PM` -------------------------------------


MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")

ZONES = {
    "UTC": 0, "GMT": 0, "BST": 1, "WEST": 1, "WET": 0, "CEST": 2, "CET": 1, "EEST": 3, "EET": 2, "MSK": 3, "JST": 9,
    "EST": -5, "EDT": -4, "CST": -6, "CDT": -5, "MST": -7, "MDT": -6, "PST": -8, "PDT": -7,
}
"""[h] Names of time zones, and by how much each is ahead of UTC; only the change within a record matters."""

_TIME = re.compile(
    rf"""(?:(?P<date>\d{{4}}([-/.])\d{{1,2}}\2\d{{1,2}}|\d{{1,2}}([-/.])\d{{1,2}}\3\d{{4}}
        |\d{{1,2}}[-\ ](?P<month>{"|".join(MONTHS)})[a-z]*[-\ ]\d{{4}})(?:\s*,?\s+|[Tt]))?
    (?P<hour>\d{{1,2}}):(?P<minute>\d{{2}}):(?P<second>\d{{2}})(?:[.,:](?P<fraction>\d+))?
    \s*(?P<half>[AaPp]\.?[Mm]\.?)?
    \s*(?P<zone>[Zz]|{"|".join(ZONES)}|(?:UTC|GMT)?[+-]\d{{1,2}}(?::?\d{{2}})?)?(?:\s*\[[\w/+-]+\])?""",
    re.VERBOSE,
)

DAY = 86400

NANO = 10**9

HOUR = 3600 * NANO

SLOWEST = 600 * NANO
"""[ns] A change of summer time is looked for only at steps below this, where an hour cannot be a pause."""

CHANGED_WITHIN = 3
"""[steps] How long after the full hour the first time after a change of summer time may be."""

PAST_MIDNIGHT = 0.5
"""[days] A clock without a date that jumps back by at least this much has passed midnight."""


def is_time(cell: str) -> bool:
    """Whether a cell is a time of day, with or without a date."""
    return _TIME.fullmatch(cell.strip()) is not None


class Clock:
    """Reads the times of one column, in file order, as seconds from the first time.

    `problem`: why the times cannot be trusted; empty if they can be; `notes`: what was corrected; `first`: nanoseconds
    from year 1 to the first time, None if the times have no date.
    """

    def __init__(self) -> None:
        self._first: int | None = None
        self._latest = 0
        self._step = 0
        self._shift = 0
        self.notes: tuple[str, ...] = ()
        self.first: int | None = None
        self._midnights = 0
        self._dates: frozenset[str] = frozenset()
        self.problem = ""

    def seconds(self, cell: str) -> float:
        """Seconds from the column's first time. Raises ValueError for a cell that is not a time."""
        match = _TIME.fullmatch(cell.strip())
        if match is None:
            raise ValueError("not a time of day")
        hour, minute, second = int(match["hour"]), int(match["minute"]), int(match["second"])
        if match["half"]:
            if not 1 <= hour <= 12:
                raise ValueError("not an hour of a twelve-hour clock")
            hour = hour % 12 + 12 * (match["half"][0] in "pP")
        if hour > 23 or minute > 59 or second > 60:
            raise ValueError("not a time of day")
        fraction = int((match["fraction"] or "")[:9].ljust(9, "0"))
        time = ((hour * 60 + minute) * 60 + second - _offset(match["zone"])) * NANO + fraction
        if match["date"]:
            time += self._day(match["date"]) * DAY * NANO
            if not match["zone"]:
                time = self._summer_time(time)
        else:
            time += self._midnights * DAY * NANO
            if self._first is not None and time < self._latest - PAST_MIDNIGHT * DAY * NANO:
                self._midnights += 1
                time += DAY * NANO
        if self._first is None:
            self._first = time
            self.first = time if match["date"] else None
        elif time > self._latest:
            self._step = time - self._latest
        self._latest = time
        # The difference is an integer, so only the division rounds
        return (time - self._first) / NANO

    def _summer_time(self, time: int) -> int:
        """A local time of a date as the time that would have passed without changes between summer and winter time."""
        told, time = time, time + self._shift
        after = time - self._latest
        for change, said in ((HOUR, "back"), (-HOUR, "forward")):
            step = after + change
            near = 0 < step <= CHANGED_WITHIN * self._step and told % HOUR < step
            if self._first is not None and near and self._step < SLOWEST:
                self._shift += change
                self.notes += (f"the clock was set {said} by an hour; the times were read as if it had not been",)
                return time + change
        return time

    def _day(self, text: str) -> int:
        """Day number of a date. Which of its numbers is the month matters only if the date changes."""
        if month := next((k for k, name in enumerate(MONTHS, 1) if name in text), 0):
            day, *_, year = re.split("[- ]", text)
            return date(int(year), month, int(day)).toordinal()
        one, two, three = (int(part) for part in re.split("[-/.]", text))
        if one > 31:
            return date(one, two, three).toordinal()
        if "." in text or one > 12:
            return date(three, two, one).toordinal()
        if two <= 12 and one != two:
            self._dates |= {text}
        if len(self._dates) > 1:
            self.problem = (
                f'the date "{text}" may begin with the day or with the month, and the date changes; export ISO dates '
                "such as 2024-03-05, or seconds"
            )
        return date(three, one, two).toordinal()


def _offset(zone: str | None) -> int:
    """Seconds by which a clock is ahead of UTC."""
    if not zone or zone in "Zz":
        return 0
    if zone in ZONES:
        return 3600 * ZONES[zone]
    sign, digits = zone.removeprefix("UTC").removeprefix("GMT")[0], re.sub(r"\D", "", zone)
    hours, minutes = (digits, "0") if len(digits) <= 2 else (digits[:-2], digits[-2:])
    return (-60 if sign == "-" else 60) * (60 * int(hours) + int(minutes))


# Numbers and cell separators ---------------------------------------------------------------------------------


MISSING = frozenset(
    ("", "nan", "na", "n/a", "null", "none", "inf", "+inf", "-inf", "infinity", "-infinity", "\N{INFINITY}",
     "+\N{INFINITY}", "-\N{INFINITY}")
)
"""Cells, in lower case, that stand for a missing value."""

BLANKS = " "
"""The delimiter for columns separated by any number of blanks, for example to align them."""

COMMENT = re.compile(r"^[^\S\n]*(?:#|%|//)", re.MULTILINE)
"""The beginning of a comment line."""

_THOUSANDS = (
    re.compile(r"[+-]?\d{1,3}(?:(?P<mark>[,' \u00a0\u202f\u2019])\d{3})(?:(?P=mark)\d{3})*(?:\.\d*)?"),
    re.compile(r"[+-]?\d{1,3}(?:(?P<mark>[.' \u00a0\u202f\u2019])\d{3})(?:(?P=mark)\d{3})*(?:,\d*)?"),
)

_EITHER = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
"""A number with a comma that may be a decimal comma or a thousands mark."""

_MINUTES = re.compile(r"\d+:\d{2}(?:[.,]\d+)?")

_WORD = re.compile(r"\S+")


@dataclass(frozen=True)
class Dialect:
    """How a file separates its cells and writes its decimals."""

    delimiter: str = ","
    decimal: str = "."

    def cells(self, line: str) -> list[tuple[int, str]]:
        """Cells of a line with the position at which each starts; quotes are removed."""
        if '"' in line:
            return list(_quoted_cells(line, self.delimiter))
        if self.delimiter == BLANKS:
            return [(match.start(), match[0]) for match in _WORD.finditer(line)]
        cells = []
        start = 0
        for cell in line.split(self.delimiter):
            cells.append((start, cell))
            start += len(cell) + 1
        return cells

    def number(self, cell: str) -> float:
        """The number in a cell, NaN if the cell is empty or marks a missing value. Raises ValueError for anything
        else."""
        if cell.strip().lower() in MISSING:
            return float("nan")
        if "_" in cell or (self.decimal != "." and "." in cell):
            raise ValueError("not a number")
        return float(cell if self.decimal == "." else cell.replace(self.decimal, "."))

    def weight(self, cell: str) -> int:
        """1 for a cell with a number or a time of day, 0 for a cell without a value, -1 for text."""
        if cell.strip().lower() in MISSING:
            return 0
        try:
            self.number(cell)
        except ValueError:
            return 1 if is_time(cell) else -1
        return 1

    def either(self, cell: str) -> bool:
        """Whether the decimal comma in this cell may also be a thousands mark."""
        return _EITHER.fullmatch(cell.strip()) is not None

    def fault(self, cell: str) -> tuple[str, str]:
        """The fault in a cell that is not a number: its kind (empty if it has none), and advice."""
        text = cell.strip()
        if self.either(text):
            return "comma", "its comma may be a decimal comma or a thousands mark: write decimals with a point"
        if "," in text and self.decimal == "." and _reads(text.replace(",", ".", 1)):
            return "decimal comma", "write decimals with a point"
        if any(marks.fullmatch(text) for marks in _THOUSANDS):
            return "thousands marks", "export numbers without thousands marks, which are not read"
        if "." in text and self.decimal != "." and _reads(text):
            return "decimal point", "the file uses decimal commas, so write every number with a comma"
        if _MINUTES.fullmatch(text):
            return "minutes", "write times as hours, minutes and seconds, 0:01:30.5, or in seconds"
        return "", "write a number, or leave the cell empty if there is no value"


def shape(cell: str) -> str:
    """A key shared by cells with the same fault: the word itself, or for text with digits its character classes."""
    text = cell.strip()
    if not any(map(str.isdigit, text)):
        return text
    return re.sub("[^\\W\\d_]+", "a", re.sub("\\d+", "0", text))


def _reads(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def is_comment(line: str) -> bool:
    """Whether a line is a comment."""
    return COMMENT.match(line) is not None


def _quoted_cells(line: str, delimiter: str) -> Iterator[tuple[int, str]]:
    start = 0
    quoted = False
    blanks = delimiter == BLANKS
    for k in range(len(line) + 1):
        if k == len(line) or ((line[k] == delimiter or (blanks and line[k].isspace())) and not quoted):
            cell = line[start:k].strip()
            if len(cell) >= 2 and cell[0] == cell[-1] == '"':
                cell = cell[1:-1].replace('""', '"')
            if not blanks or k > start:
                yield start, cell
            start = k + 1
        elif line[k] == '"':
            quoted = not quoted
