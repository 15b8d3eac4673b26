"""Excel workbooks (`.xlsx`), read with openpyxl: a sheet is read as the table of text that it would be exported to."""

from __future__ import annotations

import math
from collections.abc import Iterator
from datetime import date, datetime, time, timedelta
from typing import IO, TYPE_CHECKING

from hystgen.records.csv_file import read_text
from hystgen.records.reading import Reading, Table

if TYPE_CHECKING:
    from openpyxl.cell import Cell
    from openpyxl.worksheet.worksheet import Worksheet

FEWEST = 2
"""[rows] A sheet with fewer rows of at least two numbers has no record: it is a title page or a list of settings."""

EPOCH = date(1899, 12, 30).toordinal()
"""Day number of Excel's day 0."""

EPOCH_1904 = 1462
"""[days] How much later day 0 is in workbooks that count from 1904."""

TICKS = 10**7
"""[1/s] Excel keeps times as days in a double, which resolves 0.6 us."""


def read_xlsx(reading: Reading, stream: IO[bytes]) -> Table:
    """Read the sheet of a workbook that has numbers, or the one that the user names: `book.xlsx/Sheet1`."""
    try:
        import openpyxl
    except ImportError:
        raise reading.uninstalled("Excel .xlsx", "openpyxl", "CSV") from None
    with reading.parsing("an Excel workbook"):
        book = openpyxl.load_workbook(stream, read_only=True, data_only=True)
        # openpyxl rounds times to milliseconds; without its formats of dates, it gives the numbers of days
        book._date_formats = book._timedelta_formats = set()
        late = EPOCH_1904 if book.epoch.year == 1904 else 0
        sheets = {sheet.title: list(_rows(sheet, late)) for sheet in book.worksheets}
    filled = {title: rows for title, rows in sheets.items() if _numbers(rows) >= FEWEST}
    if not filled:
        raise reading.refuse("has no sheet with rows of numbers; save the sheet with the record in it")
    title = reading.take_part("sheet", list(filled) if reading.part not in sheets else [reading.part])
    if len(sheets) > 1:
        reading.understood(f"sheet {title}")
    rows = sheets[title]
    width = max((len(row) for row in rows), default=0)
    if width > 1:
        reading.delimiter = "\t"
    lines = ["\t".join(row + [""] * (width - len(row))) for row in rows]
    return read_text(reading, iter(["\n".join(lines) + "\n"]), 0)


def _rows(sheet: Worksheet, late: int) -> Iterator[list[str]]:
    """The rows of a sheet as text, without the empty cells at their ends."""
    for row in sheet.iter_rows():
        cells = [_text(cell, late) for cell in row]
        while cells and not cells[-1]:
            cells.pop()
        yield cells


def _text(cell: Cell, late: int) -> str:
    """A cell as text: numbers with all their digits, times as in ISO 8601."""
    value = cell.value
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, int | float):
        return _moment(float(value) + late) if cell.is_date and math.isfinite(value) else repr(value)
    if isinstance(value, timedelta):
        return repr(value.total_seconds())
    if isinstance(value, datetime):
        return value.isoformat(" ")
    if isinstance(value, time):
        return value.isoformat()
    return " ".join(str(value).split())


def _moment(days: float) -> str:
    """Excel's number of days as a date and time of day, or as a time of day if it is less than one day."""
    day, ticks = divmod(round(days * 86400 * TICKS), 86400 * TICKS)
    seconds, fraction = divmod(ticks, TICKS)
    clock = f"{seconds // 3600:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}.{fraction:07d}"
    return f"{date.fromordinal(EPOCH + day).isoformat()} {clock}" if 0 < day < date.max.toordinal() - EPOCH else clock


def _numbers(rows: list[list[str]]) -> int:
    """Number of rows with at least two cells that begin as numbers do, or with one that has separators in it."""
    begins = [[cell for cell in row if cell[:1] in "+-.0123456789" and cell] for row in rows]
    return sum(len(row) >= 2 or (len(row) == 1 and any(mark in row[0] for mark in ";,\t ")) for row in begins)
