"""HDF5, with netCDF-4 and NeXus, and MATLAB `.mat` v7.3, which is HDF5 with a header of its own; uses h5py.

A record is one file: datasets behind external links, with external storage, or assembled from others (virtual) are not
read, since that would open any file named in this file.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import IO, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import printable
from hystgen.records import mat_objects
from hystgen.records.array_files import HOLDING, MATLAB_NUMBERS, Parts, list_of_structs
from hystgen.records.columns import Column, Step, from_number, is_named
from hystgen.records.reading import MASKING, Matrix, Reading, Table, in_matrix, one_dimension, without_masked

if TYPE_CHECKING:
    import h5py

SLICE = 1 << 18
"""Samples read at a time."""

_UNITS = ("units", "unit", "Units", "Unit")

LONGEST = 1 << 10
"""[characters] Longest text that may be a label or a unit; longer texts are not read."""

DEEPEST = 32
"""[levels] Nesting limit for groups, like that for structs in `mat_nesting`: 20,000 levels take minutes, since the path
of each group contains the names of all groups above it."""

_MATLAB_OWN = ("#refs#", "#subsystem#")
"""Groups in which MATLAB keeps the contents of its cell arrays and objects."""


def read_hdf5(reading: Reading, _stream: IO[bytes]) -> Table:
    """Read an HDF5 file: every dataset that is a vector of numbers, by its path."""
    return _read(reading, "an HDF5 file", matlab=False)


def read_mat_73(reading: Reading, _stream: IO[bytes]) -> Table:
    """Read a MATLAB v7.3 file: vectors, and fields of structs as `struct.field`."""
    return _read(reading, "a MATLAB v7.3 .mat file", matlab=True)


def _read(reading: Reading, kind: str, matlab: bool) -> Table:
    try:
        import h5py
    except ImportError:
        raise reading.uninstalled("MATLAB v7.3" if matlab else "HDF5", "h5py") from None
    with reading.parsing(kind), h5py.File(reading.path, "r") as file:
        columns: list[Column] = []
        ignored: list[str] = []
        outside: list[str] = []
        steps: list[Step] = []
        matrices: dict[str, Matrix] = {}
        objects: dict[str, str] = {}
        join = "." if matlab else "/"  # MATLAB writes a field of a struct with a dot

        def link(path: str, found: object) -> None:
            if isinstance(found, h5py.ExternalLink):
                outside.append(path.replace("/", join))

        def visit(path: str, found: object) -> None:
            if matlab and path.split("/")[0] in _MATLAB_OWN:
                return
            *folders, name = path.split("/")
            if len(folders) > DEEPEST:
                raise reading.refuse(f"has groups nested more than {DEEPEST} deep; export the signals into one group")
            folder = "".join(part + join for part in folders)
            if not matlab:
                of = f"{folder}{name}" if isinstance(found, h5py.Dataset) else f"{folder}{name}/"
                steps.extend(_attributes(found, of))
            if not isinstance(found, h5py.Dataset):
                kind = found.attrs.get("pandas_type", b"") if isinstance(found, h5py.Group) else b""
                if np.bytes_(kind).startswith(b"frame"):
                    raise reading.refuse(
                        f"{printable(path)} is a data frame in pandas' own layout; save it as Parquet, in Python: "
                        f"pandas.read_hdf({reading.file!r}, {path!r}).to_parquet('frame.parquet')"
                    )
                columns.extend(_list_of_structs(reading, file, found, f"{folder}{name}.") if matlab else ())
                return
            length = _length(found, matlab)
            if found.external or found.is_virtual:
                outside.append(folder + name)
            elif length and matlab and name.casefold() in HOLDING:
                texts, _ = _parts(reading, _fields(found.parent))
                columns.extend(list_of_structs(folder, [(texts, {name: (length, partial(_vector, reading, found))})]))
            elif length:
                unit = "" if matlab else _unit(found)
                columns.append(Column(name, folder, unit, length, partial(_vector, reading, found)))
            elif matlab and "MATLAB_object_decode" in found.attrs:
                objects[folder + name] = _class(found)
            elif not matlab and (fields := _of_rows(found, f"{folder}{name}/")):
                columns.extend(fields)
            elif (step := _scalar(found, name, folder, matlab)) is not None:
                steps.append(step)
            else:
                ignored.append(folder + name)
                if found.dtype.kind in "fiub" and in_matrix(found.shape or ()):
                    matrices[folder + name] = found.shape, partial(_matrix, found)

        steps.extend(_attributes(file, ""))
        file.visititems(visit)
        file.visititems_links(link)
        if objects and len(columns) < len(reading.need) and not matrices:
            raise reading.refuse(mat_objects.advice(reading, objects))
        ignored.extend(objects)
        return reading.table(columns, ignored, outside, steps, matrices)


def _class(dataset: h5py.Dataset) -> str:
    """MATLAB's class of a dataset."""
    kind = dataset.attrs.get("MATLAB_class", b"double")
    return bytes(kind).decode("ascii", "replace")


def _of_rows(dataset: h5py.Dataset, folder: str) -> list[Column]:
    """The fields of a dataset of rows that are numbers."""
    if not dataset.dtype.names or not one_dimension(dataset.shape or ()):
        return []
    kinds = {name: dataset.dtype[name] for name in dataset.dtype.names}
    return [
        Column(name, folder, "", dataset.size, lambda name=name: np.array(dataset[name], np.float64).ravel())  # type: ignore[misc]
        for name, kind in kinds.items()
        if kind.kind in "fiub" and not kind.shape
    ]


def _matrix(dataset: h5py.Dataset) -> NDArray[np.float64]:
    return without_masked(dataset[()], dataset.attrs)


def _list_of_structs(reading: Reading, file: h5py.File, group: h5py.Group, folder: str) -> list[Column]:
    """The vectors of a list of structs, which MATLAB stores as one dataset per field, with one reference per struct."""
    import h5py

    fields = {
        name: [file[each] for each in found[()].ravel() if each]
        for name, found in _fields(group).items()
        if h5py.check_ref_dtype(found.dtype) is h5py.Reference and not (found.external or found.is_virtual)
    }
    structs = [
        {name: values[k] for name, values in fields.items() if len(values) > k}
        for k in range(max(map(len, fields.values()), default=0))
    ]
    return list_of_structs(folder, [_parts(reading, struct) for struct in structs])


def _fields(group: h5py.Group) -> dict[str, h5py.Dataset]:
    """The datasets of a group; links to other files or to arbitrary paths are not followed."""
    import h5py

    own = [name for name in group if isinstance(group.get(name, getlink=True), h5py.HardLink)]
    return {name: group[name] for name in own if isinstance(group[name], h5py.Dataset)}


def _parts(reading: Reading, fields: Mapping[str, h5py.Dataset]) -> Parts:
    """The texts and vectors among the fields of a struct that are stored in the file itself."""
    import h5py

    parts: Parts = {}, {}
    texts, vectors = parts
    for name, value in fields.items():
        if not isinstance(value, h5py.Dataset) or value.external or value.is_virtual:
            continue
        if value.attrs.get("MATLAB_class") == b"char" and value.size <= LONGEST:
            texts[name] = "".join(map(chr, np.asarray(value[()]).ravel()))
        elif length := _length(value, matlab=True):
            vectors[name] = length, partial(_vector, reading, value)
    return parts


def _attributes(found: h5py.HLObject, of: str) -> list[Step]:
    """The sample rate from the attributes of a file, group or dataset."""
    numbers = {name: np.asarray(found.attrs[name]) for name in found.attrs if is_named(name)}
    steps = [
        from_number(name, float(value.ravel()[0]), of)
        for name, value in numbers.items()
        if value.dtype.kind in "fiu" and value.size == 1
    ]
    return [step for step in steps if step is not None]


def _scalar(dataset: h5py.Dataset, name: str, folder: str, matlab: bool) -> Step | None:
    """The sample rate from a single number next to the vectors."""
    if dataset.shape is None or dataset.dtype.kind not in "fiu" or dataset.size != 1 or not is_named(name):
        return None
    return from_number(name, float(np.asarray(dataset[()]).ravel()[0]), folder, "" if matlab else _unit(dataset))


def _length(dataset: h5py.Dataset, matlab: bool) -> int:
    """Length of a vector of numbers; 0 for anything else, including MATLAB's text, which is stored as numbers."""
    if dataset.shape is None or dataset.dtype.kind not in "fiub":
        return 0
    if matlab and (_class(dataset) not in MATLAB_NUMBERS or "MATLAB_empty" in dataset.attrs):
        return 0
    return one_dimension(dataset.shape)


def _unit(dataset: h5py.Dataset) -> str:
    for name in _UNITS:
        value = dataset.attrs.get(name)
        if isinstance(value, np.ndarray) and value.size == 1:
            value = value.flat[0]
        if isinstance(value, bytes):
            value = value.decode("utf-8", "replace")
        if isinstance(value, str) and value.strip():
            return value.strip()
    return ""


def _vector(reading: Reading, dataset: h5py.Dataset) -> NDArray[np.float64]:
    """A vector, read slice by slice so that HDF5's own buffers stay small and a progress bar can move."""
    axis = int(np.argmax(dataset.shape))
    length = dataset.shape[axis]
    # Whole chunks, since reading part of a compressed chunk costs as much as all of it
    chunk = dataset.chunks[axis] if dataset.chunks else 1
    step = chunk * max(1, SLICE // chunk)
    numbers = np.empty(length, dtype=np.float64)
    masked = any(name in dataset.attrs for name in MASKING)
    for start in range(0, length, step):
        where: list[int | slice] = [0] * dataset.ndim
        where[axis] = slice(start, start + step)
        part = dataset[tuple(where)]
        numbers[start : start + step] = without_masked(part, dataset.attrs) if masked else part
        reading.tick(dataset.id.get_storage_size() * part.size / length)
    return numbers
