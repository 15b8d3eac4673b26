"""Classic netCDF files, read with scipy; netCDF-4 is HDF5."""

from __future__ import annotations

from functools import partial
from typing import IO, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hystgen.records.columns import Column, Step, from_number, is_named
from hystgen.records.reading import Matrix, Reading, Table, in_matrix, one_dimension, without_masked

if TYPE_CHECKING:
    from scipy.io import netcdf_variable


def read_netcdf(reading: Reading, stream: IO[bytes]) -> Table:
    """Read a classic netCDF file: its variables of numbers, with fill values as missing ones."""
    try:
        from scipy.io import netcdf_file
    except ImportError:
        raise reading.uninstalled("netCDF", "scipy", "CSV or .npz") from None
    with reading.parsing("a netCDF file"), netcdf_file(stream, "r", mmap=False) as file:
        columns: list[Column] = []
        ignored: list[str] = []
        steps: list[Step] = []
        matrices: dict[str, Matrix] = {}
        for of, owner in (("", file), *file.variables.items()):
            for name, value in owner._attributes.items():
                if is_named(name) and np.size(value) == 1 and np.asarray(value).dtype.kind in "fiu":
                    steps.append(from_number(name, float(np.ravel(value)[0]), of) or Step(0.0, ""))
        for name, variable in file.variables.items():
            read = partial(_numbers, variable)
            if variable.data.dtype.kind not in "fiub":
                ignored.append(name)
            elif length := one_dimension(variable.shape):
                columns.append(Column(name, "", _unit(variable), length, lambda read=read: read().ravel()))  # type: ignore[misc]
            elif variable.data.size == 1 and (step := from_number(name, float(read().ravel()[0]))):
                steps.append(step)
            else:
                ignored.append(name)
                if in_matrix(variable.shape):
                    matrices[name] = variable.shape, read
        return reading.table(columns, ignored, (), [step for step in steps if step.seconds > 0.0], matrices)


def _unit(variable: netcdf_variable) -> str:
    value = variable._attributes.get("units", b"")
    return value.decode("utf-8", "replace").strip() if isinstance(value, bytes) else ""


def _numbers(variable: netcdf_variable) -> NDArray[np.float64]:
    return without_masked(np.array(variable.data), variable._attributes)
