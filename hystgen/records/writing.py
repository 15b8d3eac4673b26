"""Writing computed columns."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics.writing import write_atomically


def columns_text(header: Sequence[str], arrays: Sequence[ArrayLike]) -> str:
    """Columns of equal length as CSV, written with the fewest digits that read back as the same number."""
    columns = [_texts(np.asarray(values)) for values in arrays]
    if len(columns) != len(header) or len({len(column) for column in columns}) > 1:
        raise ValueError("a CSV table needs one name per column and columns of equal length")
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(header)
    text.writelines(",".join(row) + "\n" for row in zip(*columns, strict=True))
    return text.getvalue()


def write_columns(path: str | os.PathLike[str], header: Sequence[str], arrays: Sequence[ArrayLike]) -> None:
    """Write `columns_text` to a file, completely or not at all."""
    write_atomically(path, columns_text(header, arrays))


def _texts(values: NDArray[np.generic]) -> list[str]:
    if values.ndim != 1:
        raise ValueError("a column must have one dimension")
    if values.dtype == np.float64 or values.dtype.kind in "iub":
        return [repr(x) for x in values.tolist()]
    return [str(x) for x in values]
