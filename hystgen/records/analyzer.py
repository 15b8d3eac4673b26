"""Tables of aixACCT's TF Analyzer (`.dat`): a summary, then one table per measured loop.

Each table begins with a line `Table 3` and `Key: value` lines; its header is the first line with tabs.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import partial
from typing import IO

import numpy as np

from hystgen.basics.problems import printable
from hystgen.records.columns import Column
from hystgen.records.csv_file import texts
from hystgen.records.reading import Reading, Table

_TABLE = re.compile(r"(?:Data )?Table\s+\[?\d[\d.]*\]?")

DRIVE, MEASURED = "V+", "D1"
"""Columns of the drive and of the displacement, of which the instrument has several."""


@dataclass
class _Loop:
    """One table: its `name`, the `line` with its `header`, and its rows."""

    name: str
    line: int
    header: list[str]
    rows: list[list[str]] = field(default_factory=list)


def read_aixacct(reading: Reading, stream: IO[bytes]) -> Table:
    """Read one loop of an aixACCT file, which the user names if there are several: `loops.dat/Table 2`."""
    lines = "".join(texts(reading, stream)).split("\n")
    loops = {loop.name: loop for loop in _loops(lines)}
    if not loops:
        raise reading.refuse("is an aixACCT file without a table of samples; export the measured curves with it")
    name = reading.take_part("table", list(loops), "one file is one experiment; append its name to the path")
    loop = loops[name]
    reading.understood(f"aixACCT {name}" if len(loops) > 1 else "aixACCT table")
    columns = []
    for k, text in enumerate(loop.header):
        numbers = np.array([_number(reading, loop, row, k) for row in range(len(loop.rows))])
        label = text.partition(" [")[0]
        also = {DRIVE: "v", MEASURED: "y"}.get(label, "")
        if text:
            columns.append(Column(text, length=len(numbers), read=partial(np.array, numbers), also=also))
    reading.refuse_if_any()
    return reading.table(columns, [])


def _loops(lines: list[str]) -> list[_Loop]:
    """The tables with a column of time or voltage; the summary in front of them has neither."""
    found: list[_Loop] = []
    name, loop = "", None
    for number, line in enumerate(lines, 1):
        text = line.strip()
        if not text:
            loop = None
        elif _TABLE.fullmatch(text):
            name, loop = text, None
        elif loop is not None:
            loop.rows.append([cell.strip() for cell in line.split("\t")])
        elif "\t" in line.strip() and line.startswith(("Time [", "Voltage [")) and name:
            loop = _Loop(name, number, [cell.strip() for cell in line.rstrip().split("\t")])
            found.append(loop)
    return found


def _number(reading: Reading, loop: _Loop, row: int, k: int) -> float:
    cell = loop.rows[row][k] if k < len(loop.rows[row]) else ""
    try:
        return float(cell) if cell else float("nan")
    except ValueError:
        reading.problem(
            f'"{printable(cell)}" in column "{printable(loop.header[k])}" is not a number; export it again',
            loop.line + 1 + row,
        )
        return float("nan")
