"""NumPy `.npy` and `.npz` files and MATLAB `.mat` files up to v7: named arrays, structs with fields."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import IO, TYPE_CHECKING

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from hystgen.records import mat_nesting, mat_objects
from hystgen.records.columns import Column, Step, from_number, is_named
from hystgen.records.reading import Matrix, Reading, Table, in_matrix, one_dimension

if TYPE_CHECKING:
    from numpy.lib.npyio import NpzFile

MATLAB_NUMBERS = frozenset(
    ("double", "single", "logical", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64")
)
"""MATLAB's numeric array classes."""

TOGETHER = 1 << 20
"""Samples loaded from a .mat file at a time; short vectors are loaded together up to this number."""

MOST_TOGETHER = 1000
"""Maximum number of vectors loaded at a time: scipy compares every name in the file with each requested name."""


def read_npy(reading: Reading, stream: IO[bytes]) -> Table:
    """Read a NumPy array: a matrix, one channel, or a structured array, whose fields are columns."""
    with reading.parsing("a NumPy .npy file"):
        try:
            array = np.load(stream, allow_pickle=False)
        except ValueError as failure:
            if "allow_pickle" not in str(failure):
                raise
            raise reading.refuse("holds Python objects; save arrays of numbers, with numpy.savez") from None
        if array.dtype.names:
            fields = {name: array[name] for name in array.dtype.names}
            columns = [
                Column(name, length=x.size, read=partial(np.array, x.ravel()))
                for name, x in fields.items()
                if x.dtype.kind in "fiub" and one_dimension(x.shape)
            ]
            kept = {c.name for c in columns}
            return reading.table(columns, [name for name in fields if name not in kept])
        if array.dtype.kind not in "fiub":
            raise reading.refuse("holds no real numbers; save an array of real numbers")
        name = "array"
        if length := one_dimension(array.shape):
            return reading.table([Column(name, length=length, read=partial(np.array, array.ravel()))], [])
        matrices: dict[str, Matrix] = {name: (array.shape, lambda: array)} if in_matrix(array.shape) else {}
        return reading.table([], [name], matrices=matrices)


def read_npz(reading: Reading, stream: IO[bytes]) -> Table:
    """Read a NumPy archive; only the arrays that the record needs are loaded."""
    with reading.parsing("a NumPy .npz archive"), np.load(stream, allow_pickle=False) as archive:
        columns = []
        ignored = []
        steps: list[Step] = []
        matrices: dict[str, Matrix] = {}
        members = frozenset(archive.zip.namelist())
        for name in archive.files:
            shape = _npy_shape(archive, name if name in members else f"{name}.npy")
            length = one_dimension(shape)
            if length:
                columns.append(Column(name, length=length, read=partial(_npy_vector, archive, name)))
            elif not _scalar(name, "", partial(_npy_vector, archive, name), shape, steps):
                ignored.append(name)
                if in_matrix(shape):
                    matrices[name] = shape, partial(archive.__getitem__, name)
        return reading.table(columns, ignored, steps=steps, matrices=matrices)


def _scalar(
    name: str, of: str, read: Callable[[], NDArray[np.generic]], shape: tuple[int, ...], steps: list[Step]
) -> bool:
    """Whether an array is a single number that gives the vectors' sample rate; it is then added to `steps`."""
    if int(np.prod(shape)) != 1 or not is_named(name):
        return False
    step = from_number(name, float(np.ravel(read())[0]), of)
    steps += [step] if step else []
    return step is not None


def _npy_shape(archive: NpzFile, file: str) -> tuple[int, ...]:
    """Shape of an archived array of numbers, from its header alone; (0,) for anything else."""
    assert archive.zip is not None, "open"
    with archive.zip.open(file) as member:
        header: Mapping[tuple[int, int], Callable[[IO[bytes]], tuple[tuple[int, ...], bool, np.dtype]]] = {
            (1, 0): npy.read_array_header_1_0,
            (2, 0): npy.read_array_header_2_0,
        }
        if member.read(len(npy.MAGIC_PREFIX)) != npy.MAGIC_PREFIX:
            return (0,)
        member.seek(0)
        version = npy.read_magic(member)
        if version not in header:
            return (0,)
        shape, _, dtype = header[version](member)
    return tuple(shape) if dtype.kind in "fiub" else (0,)


def _npy_vector(archive: NpzFile, name: str) -> NDArray[np.generic]:
    return np.asarray(archive[name]).ravel()


def read_mat(reading: Reading, stream: IO[bytes]) -> Table:
    """Read a MATLAB file up to v7: vectors, and fields of structs as `struct.field`."""
    try:
        from scipy.io import whosmat
    except ImportError:
        raise reading.uninstalled("MATLAB .mat", "scipy", "CSV or .npz") from None
    with reading.parsing("a MATLAB v5 .mat file"):
        if wrong := mat_nesting.problem(stream):
            raise reading.refuse(f"has {wrong}; export the signals as vectors")
        stream.seek(0)
        columns: list[Column] = []
        ignored: list[str] = []
        steps: list[Step] = []
        matrices: dict[str, Matrix] = {}
        vectors = _MatVectors(stream)
        objects = mat_nesting.objects(stream)
        stream.seek(0)
        for name, shape, kind in _listed(stream) if objects else whosmat(stream):
            if kind == "struct":
                _fields(_mat_variables(stream, [name])[name], f"{name}.", columns, ignored, steps)
            elif kind in MATLAB_NUMBERS and one_dimension(shape):
                vectors.add(name, one_dimension(shape))
                columns.append(Column(name, length=one_dimension(shape), read=partial(vectors.read, name)))
            elif kind not in MATLAB_NUMBERS or not _scalar(name, "", partial(_mat_matrix, stream, name), shape, steps):
                ignored.append(name)
                if kind in MATLAB_NUMBERS and in_matrix(shape):
                    matrices[name] = shape, partial(_mat_matrix, stream, name)
        if objects and len(columns) < len(reading.need) and not matrices:
            raise reading.refuse(mat_objects.advice(reading, objects))
        ignored += objects
        return reading.table(columns, ignored, steps=steps, matrices=matrices)


def _listed(stream: IO[bytes]) -> list[tuple[str, tuple[int, ...], str]]:
    """Variables with their shapes and classes, of a file with objects, which scipy cannot list."""
    from scipy.io import loadmat

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # all objects have the same name
        everything = loadmat(stream)
    found = {name: x for name, x in everything.items() if isinstance(x, np.ndarray) and not name.startswith("__")}
    kinds = {
        name: "double" if x.dtype.kind in "fiub" else "struct" if x.dtype.names else "" for name, x in found.items()
    }
    opaque = {name for name, x in found.items() if type(x).__name__ == "MatlabOpaque"}
    return [(name, x.shape, kinds[name]) for name, x in found.items() if name not in opaque and name != "None"]


def _mat_variables(stream: IO[bytes], names: Sequence[str]) -> dict[str, NDArray[np.generic]]:
    from scipy.io import loadmat

    stream.seek(0)
    found: dict[str, NDArray[np.generic]] = loadmat(stream, variable_names=names)
    return found


def _mat_matrix(stream: IO[bytes], name: str) -> NDArray[np.generic]:
    return _mat_variables(stream, [name])[name]


class _MatVectors:
    """Vectors in a file; each search begins at the file's start, so neighbouring vectors are loaded together."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream
        self._groups: list[list[str]] = []
        self._group: dict[str, int] = {}
        self._samples = 0
        self._loaded: tuple[int, dict[str, NDArray[np.generic]]] = (-1, {})

    def add(self, name: str, length: int) -> None:
        """Add a vector; called in file order."""
        if not self._groups or self._samples + length > TOGETHER or len(self._groups[-1]) == MOST_TOGETHER:
            self._groups.append([])
            self._samples = 0
        self._groups[-1].append(name)
        self._group[name] = len(self._groups) - 1
        self._samples += length

    def read(self, name: str) -> NDArray[np.generic]:
        """The vector called `name`."""
        group = self._group[name]
        if self._loaded[0] != group:
            self._loaded = group, _mat_variables(self._stream, self._groups[group])
        return np.asarray(self._loaded[1].pop(name)).ravel()


Parts = tuple[dict[str, str], dict[str, tuple[int, Callable[[], NDArray[np.generic]]]]]
"""Fields of one struct in a list: its texts, and for each vector its length and a function that reads it."""

_LABELS, _UNITS = ("label", "name"), ("unit", "units")

HOLDING = ("data", "values")
"""Names of the fields that hold a struct's numbers; the struct's label says what these are."""


def list_of_structs(folder: str, structs: Sequence[Parts]) -> list[Column]:
    """The vectors in a list of structs, named by the text next to them: Simulink signals, ControlDesk traces.

    Vectors without a text of their own are named by their position in the list, `(2).values`.
    """

    def beside(texts: dict[str, str], keys: Sequence[str]) -> str:
        return next((text for name, text in texts.items() if name.casefold() in keys), "")

    labels = [beside(texts, _LABELS) for texts, _ in structs]
    columns = []
    for number, ((texts, vectors), label) in enumerate(zip(structs, labels, strict=True), 1):
        own = label if labels.count(label) == 1 else ""
        for field, (length, read) in vectors.items():
            if own and len(vectors) == 1:
                name = own
            else:
                name = field if len(structs) == 1 else f"{own or f'({number})'}.{field}"
            columns.append(Column(name, folder, beside(texts, _UNITS), length, read))
    return columns


def _parts(struct: NDArray[np.generic], place: int) -> Parts:
    parts: Parts = {}, {}
    texts, vectors = parts
    for name in struct.dtype.names or ():
        value = struct.ravel()[place][name]
        if not isinstance(value, np.ndarray):
            continue
        if value.dtype.kind == "U" and value.size == 1:
            texts[name] = str(value.ravel()[0])
        elif value.dtype.kind in "fiub" and one_dimension(value.shape):
            vectors[name] = value.size, value.ravel
    return parts


def _fields(
    struct: NDArray[np.generic], folder: str, columns: list[Column], ignored: list[str], steps: list[Step]
) -> None:
    """The vectors among the fields of a struct, and of the structs inside it."""
    alone = struct.shape == (1, 1)
    if not alone or [name.casefold() for name in _parts(struct, 0)[1]] in ([each] for each in HOLDING):
        listed = list_of_structs(folder, [_parts(struct, k) for k in range(struct.size)])
        columns += listed
        ignored += [] if listed else [folder[:-1]]
        return
    for name in struct.dtype.names or ():
        value = struct[0, 0][name]
        if isinstance(value, np.ndarray) and value.dtype.names:
            _fields(value, f"{folder}{name}.", columns, ignored, steps)
            continue
        numbers = isinstance(value, np.ndarray) and value.dtype.kind in "fiub"
        if numbers and one_dimension(value.shape):
            columns.append(Column(name, folder, length=value.size, read=value.ravel))
        elif not numbers or not _scalar(name, folder, value.ravel, value.shape, steps):
            ignored.append(folder + name)
