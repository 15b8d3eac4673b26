"""Lines of a text table into cells, and cells into numbers, once it is known how a file separates and writes them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from hystgen.records.clock import is_time

MISSING = frozenset(("", "nan", "na", "n/a", "null", "none", "inf", "+inf", "-inf", "infinity", "-infinity"))
"""Cells, in lower case, that hold no value."""

BLANKS = " "
"""The delimiter of columns that any number of blanks separates, as aligned ones."""

COMMENT = re.compile(r"^[^\S\n]*(?:#|%|//)", re.MULTILINE)
"""How a line begins that is a comment."""

_THOUSANDS = (
    re.compile(r"[+-]?\d{1,3}(?:(?P<mark>[,' \u00a0\u202f\u2019])\d{3})(?:(?P=mark)\d{3})*(?:\.\d*)?"),
    re.compile(r"[+-]?\d{1,3}(?:(?P<mark>[.' \u00a0\u202f\u2019])\d{3})(?:(?P=mark)\d{3})*(?:,\d*)?"),
)

_EITHER = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
"""A number whose comma may be a decimal comma or a thousands mark."""

_MINUTES = re.compile(r"\d+:\d{2}(?:[.,]\d+)?")

_WORD = re.compile(r"\S+")


@dataclass(frozen=True)
class Dialect:
    """How a file separates its cells and writes the decimals of its numbers."""

    delimiter: str = ","
    decimal: str = "."

    def cells(self, line: str) -> list[tuple[int, str]]:
        """Cells of a line with the position at which each starts; quotes are taken off."""
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
        """The number of a cell, NaN where it holds none. Raises ValueError for anything else."""
        if cell.strip().lower() in MISSING:
            return float("nan")
        if "_" in cell or (self.decimal != "." and "." in cell):
            raise ValueError("no number")
        return float(cell if self.decimal == "." else cell.replace(self.decimal, "."))

    def weight(self, cell: str) -> int:
        """1 for a cell with a number or a time of day, 0 for one without a value, -1 for text."""
        if cell.strip().lower() in MISSING:
            return 0
        try:
            self.number(cell)
        except ValueError:
            return 1 if is_time(cell) else -1
        return 1

    def either(self, cell: str) -> bool:
        """Whether a decimal comma of this cell may as well be a thousands mark."""
        return _EITHER.fullmatch(cell.strip()) is not None

    def fault(self, cell: str) -> tuple[str, str]:
        """What is wrong with a cell that is no number: a kind of fault, empty for a single one, and what to do."""
        text = cell.strip()
        if self.either(text):
            return "comma", "its comma may be a decimal comma or a thousands mark, write decimals with a point"
        if "," in text and self.decimal == "." and _reads(text.replace(",", ".", 1)):
            return "decimal comma", "write decimals with a point"
        if any(marks.fullmatch(text) for marks in _THOUSANDS):
            return "thousands marks", "thousands marks are not read, export numbers without them"
        if "." in text and self.decimal != "." and _reads(text):
            return "decimal point", "the file has decimal commas, write every number with one"
        if _MINUTES.fullmatch(text):
            return "minutes", "write times as hours, minutes and seconds, 0:01:30.5, or in seconds"
        return "", "write a number, or nothing where there is no value"


def shape(cell: str) -> str:
    """What cells with the same fault have in common: a word itself, of text with digits what kinds of signs it has."""
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
