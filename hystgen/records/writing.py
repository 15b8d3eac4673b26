"""Computed columns out, and files that are written all or nothing."""

from __future__ import annotations

import contextlib
import csv
import errno
import io
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


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


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise the OSError that `write_atomically` would end in, by a trial in the folder."""
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
    if target.exists() and not target.is_file():
        return
    if not target.parent.is_dir():
        reason = os.strerror(errno.ENOENT)
        raise FileNotFoundError(f"make the folder of this file first: {reason}: {os.fspath(path)!r}")
    try:
        with tempfile.TemporaryFile(prefix=".hystgen-", dir=target.parent):
            pass
    except OSError as failure:
        raise OSError(failure.errno, failure.strerror, os.fspath(path)) from None


def _texts(values: NDArray[Any]) -> list[str]:
    if values.ndim != 1:
        raise ValueError("a column has one dimension")
    if values.dtype == np.float64 or values.dtype.kind in "iub":
        return [repr(x) for x in values.tolist()]
    return [str(x) for x in values]
