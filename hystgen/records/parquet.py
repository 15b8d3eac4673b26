"""Parquet files, read with pyarrow."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import IO, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hystgen.records.columns import Column
from hystgen.records.reading import Reading, Table

if TYPE_CHECKING:
    import pyarrow
    from pyarrow import parquet

BATCH = 1 << 18
"""Samples read at a time."""

SINCE_YEAR_1 = 719163 * 86400 * 10**9
"""[ns] From the first day of year 1, as day numbers count, to the beginning of 1970."""

_UNITS = (b"units", b"unit")

_PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


def read_parquet(reading: Reading, stream: IO[bytes]) -> Table:
    """Read a Parquet file: its numeric columns, with times and durations in seconds; nulls become NaN."""
    try:
        import pyarrow.parquet as pq
    except ImportError:
        raise reading.uninstalled("Parquet", "pyarrow") from None
    with reading.parsing("a Parquet file"), pq.ParquetFile(stream, pre_buffer=False) as file:
        columns: list[Column] = []
        ignored: list[str] = []
        for field in file.schema_arrow:
            if is_number(field.type):
                length = file.metadata.num_rows
                columns.append(Column(field.name, "", unit_of(field), length, partial(_vector, reading, file, field)))
            else:
                ignored.append(field.name)
        return reading.table(columns, ignored)


def is_number(kind: pyarrow.DataType) -> bool:
    """Whether the values of a type are numbers, times or durations."""
    from pyarrow import types

    return any(
        test(kind)
        for test in (
            types.is_integer, types.is_floating, types.is_decimal, types.is_boolean, types.is_timestamp,
            types.is_duration,
        )
    )


def unit_of(field: pyarrow.Field) -> str:
    """The unit in a field's metadata; seconds for times and durations."""
    from pyarrow import types

    if types.is_timestamp(field.type) or types.is_duration(field.type):
        return "s"
    metadata = field.metadata or {}
    return next((metadata[key].decode("utf-8", "replace").strip() for key in _UNITS if key in metadata), "")


def _vector(reading: Reading, file: parquet.ParquetFile, field: pyarrow.Field) -> NDArray[np.float64]:
    """A column, read batch by batch."""
    batches = file.iter_batches(BATCH, columns=[field.name], use_threads=False)
    return numbers(reading, field, file.metadata.num_rows, (batch.column(0) for batch in batches))


def numbers(
    reading: Reading, field: pyarrow.Field, length: int, batches: Iterable[pyarrow.Array]
) -> NDArray[np.float64]:
    """The numbers of a column in batches; time stamps count from the first in the column."""
    import pyarrow as pa
    from pyarrow import compute, types

    found = np.empty(length, dtype=np.float64)
    timed = types.is_timestamp(field.type) or types.is_duration(field.type)
    origin = None if types.is_timestamp(field.type) else 0
    row = 0
    for values in batches:
        if timed:
            values = values.cast(pa.int64())
            if origin is None and values.null_count < len(values):
                origin = values.drop_null()[0].as_py()
                reading.origin = round(origin * 1e9 / _PER_SECOND[field.type.unit]) + SINCE_YEAR_1
                reading.notes.append(f"{field.name} holds times of day; it was converted to seconds since the first")
            if origin:
                # Subtract before rounding to a double: nanoseconds since 1970 need more than 53 bits
                values = compute.subtract_checked(values, origin)
        part = values.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
        if timed:
            part = part / _PER_SECOND[field.type.unit]
        found[row : row + len(part)] = part
        row += len(part)
    return found
