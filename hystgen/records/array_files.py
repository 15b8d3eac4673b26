"""NumPy `.npz` archives and MATLAB `.mat` files up to v7: named arrays, structs with fields."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from hystgen.records.columns import Column, column
from hystgen.records.reading import Reading, Table, one_dimension

MATLAB_NUMBERS = frozenset(
    ("double", "single", "logical", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64")
)
"""MATLAB's classes of arrays whose values are numbers."""


def read_npz(reading: Reading, stream: IO[bytes]) -> Table:
    """Read a NumPy archive; only the arrays that the record takes are loaded."""
    with reading.parsing("a NumPy .npz archive"), np.load(stream, allow_pickle=False) as archive:
        columns = []
        ignored = []
        for name in archive.files:
            length = _npy_length(archive, name)
            if length:
                columns.append(column(name, length=length, read=partial(_npy_vector, archive, name)))
            else:
                ignored.append(name)
        return reading.table(columns, ignored)


def _npy_length(archive: Any, name: str) -> int:
    """Length of an archived vector of numbers from its header alone; 0 for anything else."""
    file = name if name in archive.zip.namelist() else f"{name}.npy"
    with archive.zip.open(file) as member:
        header: Mapping[tuple[int, int], Callable[..., Any]] = {
            (1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0,
        }  # fmt: skip
        if member.read(len(npy.MAGIC_PREFIX)) != npy.MAGIC_PREFIX:
            return 0
        member.seek(0)
        version = npy.read_magic(member)
        if version not in header:
            return 0
        shape, _, dtype = header[version](member)
    return one_dimension(shape) if dtype.kind in "fiub" else 0


def _npy_vector(archive: Any, name: str) -> NDArray[Any]:
    return np.asarray(archive[name]).ravel()


def read_mat(reading: Reading, stream: IO[bytes]) -> Table:
    """Read a MATLAB file up to v7: vectors, and fields of structs as `struct.field`."""
    from scipy.io import whosmat

    with reading.parsing("a MATLAB v5 .mat file"):
        columns: list[Column] = []
        ignored: list[str] = []
        for name, shape, kind in whosmat(stream):
            if kind == "struct":
                _fields(_mat_variable(stream, name), f"{name}.", columns, ignored)
            elif kind in MATLAB_NUMBERS and one_dimension(shape):
                columns.append(column(name, length=one_dimension(shape), read=partial(_mat_vector, stream, name)))
            else:
                ignored.append(name)
        return reading.table(columns, ignored)


def _mat_variable(stream: IO[bytes], name: str) -> Any:
    from scipy.io import loadmat

    stream.seek(0)
    return loadmat(stream, variable_names=[name])[name]


def _mat_vector(stream: IO[bytes], name: str) -> NDArray[Any]:
    return np.asarray(_mat_variable(stream, name)).ravel()


def _fields(struct: NDArray[Any], folder: str, columns: list[Column], ignored: list[str]) -> None:
    """The vectors among the fields of a struct, and of the structs in it; lists of structs have none."""
    if struct.shape != (1, 1):
        ignored.append(folder[:-1])
        return
    for name in struct.dtype.names or ():
        value = struct[name][0, 0]
        if isinstance(value, np.ndarray) and value.dtype.names:
            _fields(value, f"{folder}{name}.", columns, ignored)
        elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and one_dimension(value.shape):
            columns.append(column(name, folder, length=value.size, read=value.ravel))
        else:
            ignored.append(folder + name)
