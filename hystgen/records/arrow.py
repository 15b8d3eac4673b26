"""Feather and Arrow files (`.feather`, `.arrow`, `.arrows`), read with pyarrow."""

from __future__ import annotations

from functools import partial
from typing import IO

from hystgen.records.columns import Column
from hystgen.records.parquet import is_number, numbers, unit_of
from hystgen.records.reading import Reading, Table


def read_arrow(reading: Reading, stream: IO[bytes]) -> Table:
    """Read an Arrow file or stream, or a Feather file of either version: its numeric columns, as in a Parquet file."""
    try:
        from pyarrow import feather, ipc
    except ImportError:
        raise reading.uninstalled("Arrow", "pyarrow") from None
    start = stream.read(8)
    stream.seek(0)
    with reading.parsing("an Arrow file"):
        if start.startswith(b"FEA1"):
            table = feather.read_table(stream)
        else:
            opened = ipc.open_file(stream) if start.startswith(b"ARROW1") else ipc.open_stream(stream)
            table = opened.read_all()
        columns: list[Column] = []
        ignored: list[str] = []
        for k, field in enumerate(table.schema):
            if is_number(field.type):
                read = partial(numbers, reading, field, table.num_rows, table.column(k).chunks)
                columns.append(Column(field.name, "", unit_of(field), table.num_rows, read))
            else:
                ignored.append(field.name)
        return reading.table(columns, ignored)
