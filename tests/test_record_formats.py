"""Data files by format: HDF5, MATLAB v5 and v7.3, Parquet, units, large files, and the progress bar while reading.

The files are written with each format's own library, never by the package.
"""

from __future__ import annotations

import csv
import io
import json
import os
import pty
import re
import struct
import subprocess
import sys
import time
import zipfile
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io
import scipy.sparse
from click.testing import CliRunner
from numpy.typing import NDArray
from ruamel.yaml import YAML

from hystgen import cli, identify
from hystgen.basics import extras
from hystgen.basics.progress import Progress
from hystgen.records import (
    LARGEST,
    Record,
    RecordError,
    agreed_units,
    csv_file,
    hdf5,
    mat_nesting,
    parquet,
    parse_columns,
    read_record,
    reading,
)
from hystgen.records import headers as with_units
from hystgen.records.columns import split_unit

N = 50
T = np.arange(N) * 0.001
V = np.sin(np.arange(N) * 0.3) * 40.0
Y = V**3 / 7.0

Columns = dict[str, NDArray[Any]]


def problems(path: Path, **options: Any) -> list[str]:
    with pytest.raises(RecordError) as caught:
        read_record(path, **options)
    for problem in caught.value.problems:
        assert "\n" not in problem
        assert problem.startswith(f"{path}: error: ") or problem.startswith(f"{path}:1:1: error: ")
    return [problem.removeprefix(f"{path}: error: ") for problem in caught.value.problems]


def check(record: Record, t: Any = T, v: Any = V, y: Any = Y) -> None:
    assert np.array_equal(record.t, t)
    assert np.array_equal(record.v, v)
    assert record.y is not None
    assert np.array_equal(record.y, y)
    for column in record.columns().values():
        assert column.dtype == np.float64
        assert column.flags.c_contiguous
        assert column.flags.writeable


# The same record in every format ---------------------------------------------------------------------------


def write_csv(path: Path, columns: Columns) -> None:
    with path.open("w", newline="") as out:
        table = csv.writer(out)
        table.writerow(columns)
        table.writerows(zip(*(x.tolist() for x in columns.values()), strict=True))


def write_npz(path: Path, columns: Columns) -> None:
    np.savez(path, **columns)


def write_mat(path: Path, columns: Columns) -> None:
    scipy.io.savemat(path, columns)


def write_h5(path: Path, columns: Columns) -> None:
    with h5py.File(path, "w") as file:
        for name, x in columns.items():
            file[name] = x


def write_mat_73(path: Path, columns: Columns) -> None:
    """Write as MATLAB's `save -v7.3` does: a header of 512 bytes, 1xN rows stored transposed, a class for each."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, x in columns.items():
            matlab(file, name, x)
        matlab(file, "comment", np.frombuffer(b"x" * N, np.uint8).astype(np.uint16), "char")
        cell = file.create_dataset("labels", (1, 2), dtype=h5py.ref_dtype)
        cell.attrs["MATLAB_class"] = np.bytes_("cell")
        matlab(file.create_group("#refs#"), "a", np.arange(N, dtype=np.float64))
        cell[0, 0] = file["#refs#/a"].ref
    with path.open("r+b") as file:
        header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Jan  1 00:00:00 2024 HDF5 schema 1.00 ."
        file.write(header.ljust(116) + b"\0" * 8 + b"\x00\x02" + b"IM")


def matlab(group: Any, name: str, x: NDArray[Any], kind: str = "double") -> None:
    dataset = group.create_dataset(name, data=np.atleast_2d(x))
    dataset.attrs["MATLAB_class"] = np.bytes_(kind)
    if kind == "char":
        dataset.attrs["MATLAB_int_decode"] = np.int32(2)


def write_parquet(path: Path, columns: Columns) -> None:
    pq.write_table(pa.table(columns), path)


WRITERS: dict[str, tuple[str, Callable[[Path, Columns], None]]] = {
    "csv": ("a.csv", write_csv),
    "npz": ("a.npz", write_npz),
    "mat": ("a.mat", write_mat),
    "mat73": ("a.mat", write_mat_73),
    "h5": ("a.h5", write_h5),
    "hdf5": ("A.HDF5", write_h5),
    "parquet": ("a.parquet", write_parquet),
    "pq": ("a.pq", write_parquet),
}

every_format = pytest.mark.parametrize(("name", "write"), WRITERS.values(), ids=WRITERS)


@every_format
def test_the_same_record_in_every_format(tmp_path: Path, name: str, write: Callable[..., None]) -> None:
    write(tmp_path / name, {"t": T, "v": V, "y": Y, "temperature": T + 20.0})
    record = read_record(tmp_path / name)
    check(record)
    assert record.name == name
    assert list(record.extra) == ["temperature"]
    assert np.array_equal(record.extra["temperature"], T + 20.0)
    assert record.units == {}
    assert [note for note in record.notes if "without numbers" not in note] == []


@every_format
def test_names_are_mapped_and_faults_counted_in_every_format(
    tmp_path: Path, name: str, write: Callable[..., None]
) -> None:
    v, t = V.copy(), T.copy()
    v[7] = np.nan
    t[20] = t[19]
    write(tmp_path / name, {"Time": t, "U": v, "Pos": Y})
    record = read_record(tmp_path / name, parse_columns("t=Time,v=U,y=Pos"))
    kept = np.delete(np.arange(N), [7, 20])
    check(record, t[kept], v[kept], Y[kept])
    where = ("in line 9", "in line 22") if name == "a.csv" else ("at index 7", "at index 20")
    reported = [note for note in record.notes if "dropped" in note]
    assert reported == [
        f"1 sample without a value in v dropped, the first {where[0]}",
        f"1 sample not later than the sample before dropped, the first {where[1]}",
    ]


@every_format
def test_files_without_time_in_every_format(tmp_path: Path, name: str, write: Callable[..., None]) -> None:
    write(tmp_path / name, {"v": V, "y": Y})
    check(read_record(tmp_path / name, sample_time=0.25), np.arange(N) * 0.25)
    (problem,) = problems(tmp_path / name)
    assert 'there is no column "t" among v, y; give --sample-time' in problem


@pytest.mark.parametrize("kind", [kind for kind in WRITERS if kind != "csv"])
@pytest.mark.parametrize("kept", [0, 3, 40, 700])
def test_a_file_that_is_cut_off(tmp_path: Path, kind: str, kept: int) -> None:
    name, write = WRITERS[kind]
    write(tmp_path / name, {"t": T, "v": V, "y": Y})
    data = (tmp_path / name).read_bytes()[:kept]
    (tmp_path / name).write_bytes(data)
    assert problems(tmp_path / name)


@pytest.mark.parametrize("name", ["a.h5", "a.parquet", "a.npz", "a.mat"])
def test_a_file_that_is_something_else(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"t,v,y\n" + b"0,1,2\n" * 100)
    (problem,) = problems(tmp_path / name)
    assert problem.startswith("is not a")
    assert problem.endswith("; export it again")


@pytest.mark.parametrize("type_", ["float32", "int16", "uint8", ">f8", "bool"])
@pytest.mark.parametrize("name", ["npz", "h5", "parquet", "mat"])
def test_other_types_of_number(tmp_path: Path, name: str, type_: str) -> None:
    file, write = WRITERS[name]
    if (name, type_) == ("parquet", ">f8"):
        type_ = "float64"
    v = (np.arange(N) % 2).astype(type_)
    write(tmp_path / file, {"t": T, "v": v, "y": Y})
    check(read_record(tmp_path / file), v=(np.arange(N) % 2).astype(float))


# HDF5 ------------------------------------------------------------------------------------------------------


def sessions(path: Path) -> None:
    with h5py.File(path, "w") as file:
        for k in (1, 2):
            for name, x in (("t", T), ("drive", V * k), ("y", Y * k), ("temperature", T)):
                file[f"session{k}/{name}"] = x
        file["session1/photo"] = np.zeros((N, 2))
        file["session1/title"] = "a text"
        file["calibration/gain"] = np.arange(3.0)
        file["session1/drive"].attrs["units"] = "V"
        file["session1/y"].attrs["unit"] = np.array([b"um"])
        file["only/here"] = V


def test_datasets_by_path_and_by_their_last_name(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    sessions(path)
    record = read_record(path, parse_columns("t=session1/t,v=session1/drive,y=session1/y"))
    check(record)
    assert list(record.extra) == ["temperature"]
    assert record.units == {"v": "V", "y": "um"}
    assert record.notes == (
        "columns without numbers were left out: session1/photo, session1/title",
        "columns of other groups were left out: calibration/gain, only/here, session2/drive, session2/t, "
        "session2/temperature, session2/y",
    )
    record = read_record(path, parse_columns("t=session2/t,v=here,y=session2/y"))
    check(record, y=2 * Y)
    reported = problems(path, columns={"v": "drive"})
    assert reported[0] == (
        '2 columns may be meant by "drive": session1/drive, session2/drive; name one with --columns '
        '"v=session1/drive"'
    )
    assert len(reported) == 3
    (problem,) = problems(path, columns=parse_columns("t=session1/t,v=session1/title,y=session1/y"))
    assert problem.startswith('"session1/title" is not a column of numbers; ')
    (problem,) = problems(path, columns=parse_columns("t=session1/t,v=session1/driev,y=session1/y"))
    assert 'did you mean --columns "v=session1/drive"?' in problem
    check(read_record(path, parse_columns("t=/session1/t,v=/session1/drive,y=/session1/y")))
    (problem,) = problems(path, columns=parse_columns("t=session1/t,v=here,y=gain"))
    assert problem == (
        "the columns differ in length: only/here has 50, calibration/gain has 3, session1/t has 50 samples; export "
        "them with one length"
    )
    (problem,) = problems(path, columns=parse_columns("t=session1/t,v=here,y=only/here"))
    assert problem == 'column "only/here" is given two names; name it once'


def outside_link(file: h5py.File, name: str, other: Path) -> None:
    file[name] = h5py.ExternalLink(str(other.with_suffix(".h5")), "y")


def outside_storage(file: h5py.File, name: str, other: Path) -> None:
    file.create_dataset(name, shape=Y.shape, dtype="f8", external=[(str(other.with_suffix(".raw")), 0, Y.nbytes)])


def outside_layout(file: h5py.File, name: str, other: Path) -> None:
    layout = h5py.VirtualLayout(shape=Y.shape, dtype="f8")
    layout[:] = h5py.VirtualSource(str(other.with_suffix(".h5")), "y", shape=Y.shape)
    file.create_virtual_dataset(name, layout)


@pytest.mark.parametrize("keep", [outside_link, outside_storage, outside_layout])
@pytest.mark.parametrize("name", ["a.h5", "a.mat"])
def test_what_a_file_keeps_elsewhere_is_not_read(
    tmp_path: Path, name: str, keep: Callable[[h5py.File, str, Path], None]
) -> None:
    """The numbers exist, and h5py can read them, but the package does not open another file."""
    other = tmp_path / "other"
    write_h5(other.with_suffix(".h5"), {"y": Y})
    Y.tofile(other.with_suffix(".raw"))
    with h5py.File(tmp_path / name, "w", userblock_size=512) as file:
        keep(file, "y", other)
        keep(file, "run/pos", other)
        file["t"], file["v"] = T, V
        assert np.array_equal(file["y"][()], Y)
    refusal = (
        "is stored outside this file, and no other file is opened; copy its numbers into this one, or name another "
        'column with --columns "y=COLUMN"'
    )
    assert problems(tmp_path / name) == [f'"y" {refusal}']
    path = "run.pos" if name == "a.mat" else "run/pos"
    for asked in ("pos", path):
        assert problems(tmp_path / name, columns={"y": asked}) == [f'"{path}" {refusal}']
    with h5py.File(tmp_path / name, "a") as file:
        del file["y"]
        file["y"] = Y
    record = read_record(tmp_path / name)
    check(record)
    assert record.notes == (f"columns stored outside the file were left out: {path}",)


def test_a_group_that_lies_in_another_file_is_not_read(tmp_path: Path) -> None:
    write_h5(tmp_path / "other.h5", {"y": Y})
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t"], file["v"], file["run"] = T, V, h5py.ExternalLink("other.h5", "/")
    (problem,) = problems(tmp_path / "a.h5", columns={"y": "run/y"})
    assert problem.startswith('"run" is stored outside this file, ')


@pytest.mark.parametrize("shape", [(N,), (N, 1), (1, N), (1, N, 1)])
@pytest.mark.parametrize("chunks", [None, True])
def test_rows_and_columns_of_hdf5(tmp_path: Path, shape: tuple[int, ...], chunks: bool | None) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, x in (("t", T), ("v", V), ("y", Y)):
            file.create_dataset(name, data=x.reshape(shape), chunks=chunks, compression="gzip" if chunks else None)
    check(read_record(tmp_path / "a.h5"))


def test_slices_fit_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hdf5, "SLICE", 16)
    monkeypatch.setattr(parquet, "BATCH", 7)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t"] = T
        file.create_dataset("v", data=V, chunks=(6,))
        file.create_dataset("y", data=Y.reshape(1, N), chunks=(1, 20))
    check(read_record(tmp_path / "a.h5"))
    pq.write_table(pa.table({"t": T, "v": V, "y": Y}), tmp_path / "a.pq", row_group_size=11)
    check(read_record(tmp_path / "a.pq"))


def test_empty_and_scalar_datasets_are_no_columns(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t"], file["v"], file["y"] = T, V, Y
        file["none"] = h5py.Empty("f8")
        file["one"] = 3.0
        file["zero"] = np.zeros(0)
        file["again"] = h5py.SoftLink("/gone")
        file["table"] = np.zeros(N, dtype=[("a", "S8"), ("b", "f8", 3)])
    record = read_record(tmp_path / "a.h5")
    check(record)
    assert record.notes == ("columns without numbers were left out: none, one, table, zero",)


def test_a_damaged_block_in_hdf5_and_parquet(tmp_path: Path) -> None:
    """Values that fail their checksum are refused, though the file's structure is sound."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t"], file["y"] = T, Y
        file.create_dataset("v", data=V, chunks=(N,), fletcher32=True)
        place = file["v"].id.get_chunk_info(0).byte_offset
    with (tmp_path / "a.h5").open("r+b") as damaged:
        damaged.seek(place + 16)
        damaged.write(b"\xff\x00\xff")
    (problem,) = problems(tmp_path / "a.h5")
    assert problem.startswith("is not an HDF5 file (")
    pq.write_table(pa.table({"t": T, "v": V, "y": Y}), tmp_path / "a.pq", compression="zstd", use_dictionary=False)
    place = pq.ParquetFile(tmp_path / "a.pq").metadata.row_group(0).column(1).data_page_offset
    with (tmp_path / "a.pq").open("r+b") as damaged:
        damaged.seek(place)
        damaged.write(b"\xff" * 60)
    (problem,) = problems(tmp_path / "a.pq")
    assert problem.startswith("is not a Parquet file (")


# MATLAB ----------------------------------------------------------------------------------------------------


def test_fields_of_structs_in_both_kinds_of_mat(tmp_path: Path) -> None:
    scipy.io.savemat(
        tmp_path / "v5.mat",
        {
            "t": T,
            "data": {"v": V.reshape(-1, 1), "y": Y, "info": {"serial": 3.0, "v": 2 * V}, "name": "stage"},
            "list": [{"a": 1.0}, {"a": 2.0}],
            "label": "text",
            "gain": np.arange(3.0),
        },
    )
    path = tmp_path / "v73.mat"
    write_mat_73(path, {"t": T})
    with h5py.File(path, "r+") as file:
        for group, columns in (("data", {"v": V, "y": Y}), ("data/info", {"serial": 3.0, "v": 2 * V})):
            struct = file.require_group(group)
            struct.attrs["MATLAB_class"] = np.bytes_("struct")
            for name, x in columns.items():
                matlab(struct, name, np.asarray(x).reshape(-1, 1))
        matlab(file["data"], "name", np.frombuffer(b"stage", np.uint8).astype(np.uint16), "char")
        matlab(file, "gain", np.arange(3.0))
        nothing = file.create_dataset("none", data=np.array([0, N], dtype=np.uint64))
        nothing.attrs["MATLAB_class"] = np.bytes_("double")
        nothing.attrs["MATLAB_empty"] = np.uint8(1)
    for name in ("v5.mat", "v73.mat"):
        reported = problems(tmp_path / name)
        assert reported == [
            '2 columns may be meant by "v": data.info.v, data.v; name one with --columns "v=data.info.v"'
            if name == "v73.mat"
            else '2 columns may be meant by "v": data.v, data.info.v; name one with --columns "v=data.v"'
        ]
        record = read_record(tmp_path / name, {"v": "data.v"})
        check(record)
        assert record.extra == {}
        assert record.notes[1:] == (
            "columns of other groups were left out: data.info.v",
            "columns of another length were left out: gain",
        )
        for left_out in ("data.name", "data.info.serial"):
            assert left_out in record.notes[0]
        assert "#refs#" not in record.notes[0]
        check(read_record(tmp_path / name, {"v": "data.info.v"}), v=2 * V)


def test_text_of_matlab_is_no_column_though_it_is_stored_as_numbers(tmp_path: Path) -> None:
    write_mat_73(tmp_path / "a.mat", {"t": T, "v": V, "y": Y})
    (problem,) = problems(tmp_path / "a.mat", columns={"y": "comment"})
    assert problem.startswith('"comment" is not a column of numbers')


def test_hdf5_under_the_name_of_a_mat_file(tmp_path: Path) -> None:
    write_h5(tmp_path / "a.mat", {"t": T, "v": V, "y": Y})
    check(read_record(tmp_path / "a.mat"))


# Parquet ---------------------------------------------------------------------------------------------------


def test_nulls_and_text_in_parquet(tmp_path: Path) -> None:
    v = [None if k == 7 else float(x) for k, x in enumerate(V)]
    table = pa.table({"t": T, "v": v, "y": Y, "state": ["ok"] * N, "n": pa.array([k % 5 or None for k in range(N)])})
    pq.write_table(table, tmp_path / "a.parquet")
    record = read_record(tmp_path / "a.parquet")
    check(record, *(np.delete(x, 7) for x in (T, V, Y)))
    assert list(record.extra) == ["n"]
    assert np.isnan(record.extra["n"][0])
    assert record.notes[0] == "columns without numbers were left out: state"
    assert "1 sample without a value in v dropped, the first at index 7" in record.notes
    (problem,) = problems(tmp_path / "a.parquet", columns={"v": "state"})
    assert problem.startswith('"state" is not a column of numbers')


def test_columns_called_alike_in_parquet(tmp_path: Path) -> None:
    pq.write_table(pa.Table.from_arrays([pa.array(T), pa.array(V), pa.array(Y)], ["t", "v", "v"]), tmp_path / "a.pq")
    reported = problems(tmp_path / "a.pq")
    assert reported[0] == '2 columns are called "v"; give them different names'


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
def test_time_stamps_and_durations_in_parquet(tmp_path: Path, unit: str) -> None:
    step = {"s": 1.0, "ms": 0.001, "us": 0.001, "ns": 0.001}[unit]
    counts = np.arange(N) * round(step * {"s": 1, "ms": 1e3, "us": 1e6, "ns": 1e9}[unit])
    origin = 1_700_000_000 * {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[unit] + 1
    for kind, first in ((pa.timestamp(unit), origin), (pa.duration(unit), 0)):
        t = pa.array(counts.astype(np.int64) + first).cast(kind)
        pq.write_table(pa.table({"t": t, "v": V, "y": Y}), tmp_path / "a.parquet")
        record = read_record(tmp_path / "a.parquet")
        check(record, counts / {"s": 1, "ms": 1e3, "us": 1e6, "ns": 1e9}[unit])
        assert record.units == {"t": "s"}
        assert bool(record.notes) == (first != 0)


def test_an_archive_with_more_than_arrays(tmp_path: Path) -> None:
    others = {"people": np.array(["a", "b"]), "objects": np.array([{}])}
    np.savez(tmp_path / "a.npz", t=T, v=V.reshape(1, N), y=Y.reshape(N, 1), **others)
    with zipfile.ZipFile(tmp_path / "a.npz", "a") as archive:
        archive.writestr("readme.txt", "measured on a bench")
    record = read_record(tmp_path / "a.npz")
    check(record)
    assert record.notes == ("columns without numbers were left out: people, objects, readme.txt",)


MANY = 20_000
"""Columns of a wide file: one channel per sensor of an array, or spectra side by side."""

WIDE = {"text": "on", "numbers": "{}.5", "gaps": "{}.5", "quoted": '"{}.5"'}
"""Format of a cell of the k-th further column; with gaps, one cell per row is empty."""


@pytest.mark.parametrize("kind", WIDE)
@pytest.mark.thorough
def test_a_table_of_many_columns_takes_seconds(tmp_path: Path, kind: str) -> None:
    with (tmp_path / "a.csv").open("w") as file:
        file.write(",".join(["t", "v", "y", *(f"c{k}" for k in range(MANY))]) + "\n")
        for row in range(N):
            own = [repr(float(x[row])) for x in (T, V, Y)]
            cells = [WIDE[kind].format(k) if kind != "gaps" or k != row else "" for k in range(MANY)]
            file.write(",".join([*own, *cells]) + "\n")
    started = time.process_time()
    record = read_record(tmp_path / "a.csv")
    # this takes 1 to 3 s; it took a minute before names were counted in one pass
    assert time.process_time() - started < 15.0
    check(record)
    assert len(record.extra) == (0 if kind == "text" else MANY)
    if kind == "numbers":
        assert all(np.array_equal(record.extra[f"c{k}"], np.full(N, k + 0.5)) for k in range(MANY))


def test_many_columns_in_every_format(tmp_path: Path) -> None:
    """As many columns as the writers make in a moment; the time to read them is proportional to their number."""
    further = {f"c{k}": np.full(N, k + 0.5) for k in range(1500)}
    for file, write in WRITERS.values():
        write(tmp_path / file, {"t": T, "v": V, "y": Y, **further})
        started = time.process_time()
        record = read_record(tmp_path / file)
        assert time.process_time() - started < 15.0, file
        check(record)
        assert record.extra.keys() == further.keys(), file
        assert all(np.array_equal(record.extra[name], x) for name, x in further.items()), file


# Missing libraries -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "kind", "package"),
    [("h5", "HDF5", "h5py"), ("mat73", "MATLAB v7.3", "h5py"), ("parquet", "Parquet", "pyarrow")],
)
def test_without_the_library_of_a_format(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, kind: str, package: str
) -> None:
    file, write = WRITERS[name]
    write(tmp_path / file, {"t": T, "v": V, "y": Y})
    for module in [key for key in sys.modules if key.split(".")[0] == package]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, package, None)
    result = CliRunner().invoke(cli.main, ["identify", str(tmp_path / file), "-o", str(tmp_path / "new.yaml")])
    assert result.exit_code == 2
    assert result.stderr == (
        f"{tmp_path / file}: error: {kind} files need the package {package}; {extras.install('formats')}, or export "
        "CSV, .npz or MATLAB .mat (v7)\n"
    )
    assert not (tmp_path / "new.yaml").exists()


def test_more_samples_than_memory(tmp_path: Path) -> None:
    """HDF5 stores nothing for values that were never written, so a file of a few bytes can claim any length."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in "tvy":
            file.create_dataset(name, shape=(1 << 50,), chunks=(1 << 20,), dtype="f8")
    assert problems(tmp_path / "a.h5") == ["needs more memory than is available; export fewer samples or columns"]


@pytest.mark.parametrize("write", [write_h5, write_npz, write_mat])
def test_more_samples_than_memory_of_a_system_that_promises_any(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, write: Callable[[Path, Columns], None]
) -> None:
    """A system that promises any memory grants every request, and ends the process when the memory is used."""
    path = tmp_path / write.__name__.replace("write_", "a.")
    write(path, {"t": T, "v": V, "y": Y})
    monkeypatch.setattr(reading, "_memory", lambda: 2.0 * 8.0 * 3.0 * len(T))
    assert len(read_record(path)) == len(T)
    monkeypatch.setattr(reading, "_memory", lambda: 2.0 * 8.0 * 3.0 * len(T) - 1.0)
    assert problems(path) == ["needs more memory than is available; export fewer samples or columns"]


@pytest.mark.skipif(not Path("/proc/meminfo").exists(), reason="the other account of the memory")
def test_memory_of_this_machine() -> None:
    said = re.search(r"MemTotal: +(\d+) kB", Path("/proc/meminfo").read_text())
    assert said is not None
    assert reading._memory() == pytest.approx(1024.0 * float(said[1]), rel=1e-3)


def test_the_libraries_are_imported_late() -> None:
    code = "import sys, hystgen.records; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "hystgen.records.hdf5" in loaded
    assert not {"h5py", "pyarrow", "scipy", "rich"} & set(loaded)


# Sample rates beside the columns ---------------------------------------------------------------------------


def beside_npz(path: Path, columns: Columns, name: str, value: float) -> None:
    np.savez(path, **columns, **{name: np.float64(value)})


def beside_mat(path: Path, columns: Columns, name: str, value: float) -> None:
    scipy.io.savemat(path, {**columns, name: value})


def beside_struct(path: Path, columns: Columns, name: str, value: float) -> None:
    scipy.io.savemat(path, {"data": {**columns, name: value}, "fs": 7.0 if name != "fs" else value})


def beside_h5(path: Path, columns: Columns, name: str, value: float) -> None:
    with h5py.File(path, "w") as file:
        for key, x in columns.items():
            file[f"run1/{key}"] = x
        file[f"run1/{name}"] = value
        file["run2/drive"], file[f"run2/{name}"] = V[:-1], 77.0


def beside_mat_73(path: Path, columns: Columns, name: str, value: float) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        for key, x in columns.items():
            matlab(file, key, x.reshape(1, -1))
        matlab(file, name, np.full((1, 1), value))
    with path.open("r+b") as start:
        start.write(b"MATLAB 7.3 MAT-file, Platform: test".ljust(124) + b"\x00\x02IM")


def attribute_h5(where: str) -> Callable[..., None]:
    def write(path: Path, columns: Columns, name: str, value: float) -> None:
        with h5py.File(path, "w") as file:
            for key, x in columns.items():
                file[f"run1/{key}"] = x
            file["run2/pos"] = V[:-1]
            file["run2"].attrs[name] = 77.0
            file[where].attrs[name] = value

    return write


@pytest.mark.parametrize(("key", "value"), [("fs", 1000.0), ("SampleRate", 1000.0), ("dt", 0.001), ("dt_ms", 1.0)])
@pytest.mark.parametrize(
    ("file", "write"),
    [("a.npz", beside_npz), ("a.mat", beside_mat), ("73.mat", beside_mat_73), ("a.h5", beside_h5),
     ("f.h5", attribute_h5("/")), ("g.h5", attribute_h5("run1")), ("d.h5", attribute_h5("run1/v"))],
)  # fmt: skip
def test_a_sample_rate_beside_the_columns(
    tmp_path: Path, file: str, write: Callable[..., None], key: str, value: float
) -> None:
    """A sample rate applies to the columns that it belongs to, and only if they have no time of their own."""
    write(tmp_path / file, {"v": V, "y": Y}, key, value)
    record = read_record(tmp_path / file)
    check(record)
    assert record.sample_time == pytest.approx(0.001)
    assert "time from sample" in record.read_as
    assert not any(key in note for note in record.notes)
    assert read_record(tmp_path / file, sample_time=0.5).sample_time == 0.5
    write(tmp_path / file, {"t": T, "v": V, "y": Y}, key, 3 * value)
    check(read_record(tmp_path / file))


def test_sample_rates_of_structs(tmp_path: Path) -> None:
    for name, said in (("Fs", "data.Fs"), ("sampleRate", "data.sampleRate")):
        scipy.io.savemat(tmp_path / "a.mat", {"data": {"drive": V, "position": Y, name: 1000.0}})
        record = read_record(tmp_path / "a.mat")
        check(record)
        assert record.read_as == f"v = drive, y = position; time from sample rate 1000 Hz ({said}, without a unit)"
    beside_struct(tmp_path / "b.mat", {"v": V, "y": Y}, "Fs", 1000.0)
    (problem,) = problems(tmp_path / "b.mat")
    assert "sample rate 7 Hz (fs, without a unit)" in problem
    assert "give --sample-time" in problem


def test_names_of_arrays_are_understood(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, x in (("Time", np.arange(N) * 1000.0), ("Drive", V), ("Sensor", Y)):
            file[f"scan/{name}"] = x
        file["scan/Time"].attrs["unit"] = "us"
        file["scan/fs"] = "fast"
    record = read_record(tmp_path / "a.h5")
    check(record, np.arange(N) / 1000.0)
    assert record.read_as == "t = Time, v = Drive, y = Sensor"
    with h5py.File(tmp_path / "c.h5", "w") as file:
        for name in ("one", "two"):
            file[f"{name}/time"], file[f"{name}/drive"], file[f"{name}/pos"] = T, V, Y
    found = problems(tmp_path / "c.h5")
    assert len(found) == 3
    assert all("2 columns may be meant by" in problem for problem in found)


# Units -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("V [V]", "V", "V"), ("pos (um)", "pos", "um"), ("time_s", "time", "s"), ("y[µm]", "y", "µm"),
        ("U / V", "U", "V"), ("t/ms", "t", "ms"), ("t_min", "t", "min"), ("T [°C]", "T", "°C"),
        ("gain (um/V)", "gain", "um/V"), ("a (m/s^2)", "a", "m/s^2"), ("y (counts)", "y", "counts"),
        ("y [-]", "y", ""), ("pressure [mbar abs.]", "pressure", "mbar abs."),
        # Names that only look as if they had a unit
        ("y (raw)", "y (raw)", ""), ("y_min", "y_min", ""), ("v_in", "v_in", ""), ("y_m", "y_m", ""),
        ("channel [1]", "channel [1]", ""), ("ch (2)", "ch (2)", ""), ("dy/dt", "dy/dt", ""), ("[V]", "[V]", ""),
        ("_s", "_s", ""), ("v [" + "x" * 41 + "]", "v [" + "x" * 41 + "]", ""),
    ],
)  # fmt: skip
def test_units_in_headers(header: str, name: str, unit: str) -> None:
    assert split_unit(header) == (name, unit)
    assert with_units([name], {name: unit}) == [f"{name} [{unit}]" if unit else name]


@every_format
def test_names_with_units_are_understood(tmp_path: Path, name: str, write: Callable[..., None]) -> None:
    # MATLAB allows letters, digits and underscores in names
    columns = {"t_s": T, "v_V": V, "y_um": Y, "temperature_degC": T}
    if "mat" not in name and name != "A.HDF5":
        columns = {"t [s]": T, "v [V]": V, "y (um)": Y, "temperature [degC]": T}
    write(tmp_path / name, columns)
    record = read_record(tmp_path / name)
    check(record)
    assert record.units == {"t": "s", "v": "V", "y": "um", "temperature": "degC"}
    assert list(record.extra) == ["temperature"]
    assert record.section(3, 30).units == record.units


def test_a_plain_name_comes_before_one_with_a_unit(tmp_path: Path) -> None:
    write_csv(tmp_path / "a.csv", {"t": T, "v": V, "v [mV]": Y, "y": Y})
    record = read_record(tmp_path / "a.csv")
    check(record)
    assert list(record.extra) == ["v [mV]"]
    assert record.units == {"v [mV]": "mV"}
    write_csv(tmp_path / "a.csv", {"t": T, "v [V]": V, "v [mV]": V, "y": Y})
    (problem,) = problems(tmp_path / "a.csv")
    assert '2 columns may be meant by "v": v [V], v [mV]; name one with --columns "v=v [V]"' in problem
    check(read_record(tmp_path / "a.csv", {"v": "v [mV]"}))


def test_a_mapping_needs_no_units_and_nothing_is_left_out_in_silence(tmp_path: Path) -> None:
    write_csv(tmp_path / "a.csv", {"t [s]": T, "v": Y, "U [V]": V, "y": Y})
    record = read_record(tmp_path / "a.csv", {"v": "U"})
    check(record)
    assert record.units == {"t": "s", "v": "V"}
    assert record.notes == ("columns whose name is taken were left out: v",)


@pytest.mark.parametrize(
    ("unit", "scale"),
    [("ms", 1000.0), ("us", 1e6), ("µs", 1e6), ("ns", 1e9), ("min", 1 / 60), ("h", 1 / 3600), ("milliseconds", 1e3)],
)
def test_time_is_converted_to_seconds(tmp_path: Path, unit: str, scale: float) -> None:
    seconds = np.arange(N) * 7.2
    t = np.round(seconds * scale, 9)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t"], file["v"], file["y"] = t, V, Y
        file["t"].attrs["units"] = unit
    write_csv(tmp_path / "a.csv", {f"t [{unit}]": t, "v": V, "y": Y})
    for name in ("a.h5", "a.csv"):
        record = read_record(tmp_path / name)
        assert np.allclose(record.t, seconds, rtol=1e-14)
        # The division gives the double next to the time that the file's digits mean
        assert scale < 1.0 or record.t[1] == 7.2
        assert record.notes == (f"t is in {unit}; it was converted to seconds",)
        assert record.units == {"t": "s"}


def test_seconds_by_other_names_and_unknown_units_of_time(tmp_path: Path) -> None:
    for unit in ("s", "sec", "Seconds", "seconds since 2026-01-01T00:00:00.000000+00:00"):
        with h5py.File(tmp_path / "a.h5", "w") as file:
            file["t"], file["v"], file["y"] = T, V, Y
            file["t"].attrs["units"] = unit
        record = read_record(tmp_path / "a.h5")
        check(record)
        assert record.notes == ()
    write_csv(tmp_path / "a.csv", {"t [samples]": T, "v": V, "y": Y})
    record = read_record(tmp_path / "a.csv")
    check(record)
    assert record.notes == ('the unit "samples" of t is not a known unit of time; t was read as seconds',)


def test_units_of_parquet_fields(tmp_path: Path) -> None:
    fields = [
        pa.field("t", pa.float64(), metadata={"units": "ms"}), pa.field("v [mV]", pa.float64(), metadata={"unit": "V"}),
        pa.field("y", pa.float64()),
    ]  # fmt: skip
    pq.write_table(pa.table([T * 1000, V, Y], schema=pa.schema(fields)), tmp_path / "a.parquet")
    record = read_record(tmp_path / "a.parquet")
    assert np.allclose(record.t, T, rtol=1e-15)
    assert record.units == {"t": "s", "v": "V"}, "the file's own unit wins over the name's"
    assert record.notes == ("t is in ms; it was converted to seconds",)


def test_units_that_records_agree_on() -> None:
    def record(name: str, **units: str) -> Record:
        return Record(name, T, V, Y, units=units)

    assert agreed_units([]) == ({}, [])
    assert agreed_units([record("a", v="V"), record("b", y="µm"), record("c", y="um")]) == (
        {"input": "V", "output": "µm"},
        [],
    )
    assert agreed_units([record("a", v="V", y="um")], {"input": "V", "output": ""})[0] == {"input": "V", "output": "um"}
    units, reported = agreed_units([record("a.csv", v="µm", y="V")])
    assert units == {"input": "µm", "output": "V"}
    assert len(reported) == 1
    assert "which suggests that they are exchanged" in reported[0]
    for v, y in (("um", "nm"), ("m", ""), ("V", "um")):
        assert agreed_units([], {"input": v, "output": y})[1] == []
    units, reported = agreed_units([record("a.csv", v="x" * 41, y="a\nb")])
    assert units == {}
    assert len(reported) == 2


def swept(path: Path, header: Sequence[str]) -> Path:
    """A drive that sweeps, and half of it plus a play of threshold 5."""
    v = np.concatenate([np.linspace(0, 40, 60), np.linspace(40, -40, 120), np.linspace(-40, 40, 120)])
    y, state = [], 0.0
    for x in v.tolist():
        state = max(x - 5.0, min(x + 5.0, state))
        y.append(0.5 * x + state)
    write_csv(path, dict(zip(header, (np.arange(len(v)) * 0.01, v, np.array(y)), strict=True)))
    return path


def test_identify_takes_the_units_of_the_records(tmp_path: Path) -> None:
    one = swept(tmp_path / "one.csv", ["t [s]", "v [V]", "y [um]"])
    two = swept(tmp_path / "two.csv", ["t [s]", "v [mV]", "y"])
    target = tmp_path / "new.yaml"

    def run(*words: object) -> tuple[dict[str, Any], str]:
        result = CliRunner().invoke(
            cli.main, ["identify", *map(str, words), "-o", str(target), "--thresholds", "2"], catch_exceptions=False
        )
        assert result.exit_code == 0, result.stderr
        return YAML(typ="safe").load(target.read_text()), result.stderr

    content, reported = run(one)
    assert content["units"] == {"input": "V", "output": "um"}
    assert "unit" not in reported
    content, reported = run(one, "--holdout", two)
    assert content["units"] == {"input": "V", "output": "um"}
    assert "warning: two.csv: column v [mV] was converted to V: 1 mV is 0.001 V" in reported
    content, reported = run(one, "--units", "V,nm")
    assert content["units"] == {"input": "V", "output": "nm"}
    assert "warning: one.csv: column y [um] was converted to nm: 1 um is 1000 nm" in reported
    fit = identify(one, thresholds=2)
    assert (fit.parameters.units.input, fit.parameters.units.output) == ("V", "um")


def test_identify_from_hdf5(tmp_path: Path) -> None:
    with (swept(tmp_path / "one.csv", "tvy")).open() as text:
        rows = np.array([[float(cell) for cell in row] for row in list(csv.reader(text))[1:]])
    with h5py.File(tmp_path / "one.h5", "w") as file:
        for name, x, unit in zip(("time", "drive", "sensor"), rows.T, ("ms", "V", "um"), strict=True):
            file[f"run1/{name}"] = x * 1000 if unit == "ms" else x
            file[f"run1/{name}"].attrs["units"] = unit
    written = []
    for name, option, value in (
        ("one.h5", "--columns", "t=run1/time,v=drive,y=run1/sensor"),
        ("one.csv", "--units", "V,um"),
    ):
        command = ["identify", str(tmp_path / name), "-o", str(tmp_path / "stage.yaml"), "--thresholds", "2"]
        command += [option, value]
        result = CliRunner().invoke(cli.main, command, catch_exceptions=False)
        assert result.exit_code == 0, result.stderr
        assert ("t is in ms" in result.stderr) == (name == "one.h5")
        written.append(YAML(typ="safe").load((tmp_path / "stage.yaml").read_text()))
    assert written[0] == written[1]


def test_simulate_writes_the_units_back(tmp_path: Path) -> None:
    path = swept(tmp_path / "one.csv", ["t [ms]", "v (V)", "y [um]"])
    model = tmp_path / "m.yaml"
    model.write_text(
        "hystgen: 1\nname: stage\ninput_range: [-40, 40]\nmodel: {pi: {thresholds: [0, 5], weights: [0.5, 1]}}\n"
    )
    result = CliRunner().invoke(cli.main, ["simulate", str(model), str(path)])
    assert result.exit_code == 0, result.stderr
    rows = list(csv.DictReader(io.StringIO(result.stdout)))
    assert list(rows[0]) == ["t [s]", "v [V]", "y_measured [um]", "y"], "the model does not say in which unit"
    assert float(rows[5]["t [s]"]) == 0.00005


# Large files -----------------------------------------------------------------------------------------------


def written(cells: Sequence[Sequence[str]], header: str, end: str = "\n") -> bytes:
    return (end.join([header, *(",".join(row) for row in cells)]) + end).encode()


def awkward(samples: int) -> list[list[str]]:
    """Numbers that a decimal reader gets wrong if it rounds twice, and all kinds of digits."""
    rng = np.random.default_rng(5)
    values = rng.integers(0, 2**63, samples * 2, dtype=np.uint64).view(np.float64)
    values = np.where(np.abs(values) < LARGEST, values, 1.0)  # larger numbers stand for missing values
    texts = [repr(x) for x in values.tolist()]
    hard = ["9007199254740993", "1.00000000000000011102230246251565", "2.2250738585072011e-308", "4.9e-324", "+1.5E-3",
            ".5", "7.", "0.1e1", "12345678901234567890.1234567890", "8.988465674311580e-307"]  # fmt: skip
    texts[: len(hard)] = hard
    return [[repr(k * 0.001), *texts[2 * k : 2 * k + 2]] for k in range(samples)]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("block", [150, 1000, 1 << 20])
def test_blocks_of_any_size_give_the_same_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, block: int, end: str
) -> None:
    cells = awkward(400)
    cells = [row for row in cells if max(map(len, row)) < 25]
    (tmp_path / "a.csv").write_bytes(b"# one" + end.encode() + written(cells, "t,v,y", end))
    monkeypatch.setattr(csv_file, "BLOCK", block)
    record = read_record(tmp_path / "a.csv")
    check(record, *(np.array([float(row[k]) for row in cells]) for k in range(3)))
    assert len(cells) > 390


def test_both_ways_through_a_block_round_as_python_does(tmp_path: Path) -> None:
    cells = awkward(2000)
    meant = [np.array([float(row[k]) for row in cells]) for k in range(3)]
    (tmp_path / "fast.csv").write_bytes(written(cells, "t,v,y"))
    (tmp_path / "slow.csv").write_bytes(written(cells, "t,v,y") + b"# careful\n")
    for name in ("fast.csv", "slow.csv"):
        check(read_record(tmp_path / name), *meant)


def test_faults_far_into_a_file_of_many_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The places reported are those in the file, whichever blocks they are in."""
    monkeypatch.setattr(csv_file, "BLOCK", 256)
    cells = [[repr(k * 0.001), repr(float(k % 7)), repr(float(k % 5)), "ok"] for k in range(2000)]
    header = "t,v,y,state"
    (tmp_path / "good.csv").write_bytes(written(cells, header))
    record = read_record(tmp_path / "good.csv")
    assert len(record) == 2000
    assert record.notes == ("columns without numbers were left out: state",)
    some = [list(row) for row in cells]
    some[1200][1] = ""
    some[1500][0] = some[1499][0]
    lines = [header, *(",".join(row) for row in some)]
    lines[700:700] = ["", "# paused", ""]
    (tmp_path / "some.csv").write_text("\n".join(lines))
    record = read_record(tmp_path / "some.csv")
    assert len(record) == 1998
    assert record.notes[1:] == (
        f"1 sample without a value in v dropped, the first in line {1200 + 2 + 3}",
        f"1 sample not later than the sample before dropped, the first in line {1500 + 2 + 3}",
    )
    some[900][2] = "fault"
    some[1800] = ["1"]
    some[1900].append("2")
    (tmp_path / "bad.csv").write_bytes(written(some, header))
    with pytest.raises(RecordError) as caught:
        read_record(tmp_path / "bad.csv")
    column = len(",".join(some[900][:2])) + 2
    assert caught.value.problems == [
        f'{tmp_path / "bad.csv"}:902:{column}: error: "fault" in column "y" is not a number; write a number, or '
        "leave the cell empty if there is no value",
        f"{tmp_path / 'bad.csv'}:1802:1: error: 1 column where the header has 4; complete or remove the line",
        f"{tmp_path / 'bad.csv'}:1902:1: error: 5 columns where the header has 4; complete or remove the line",
    ]


def test_a_column_that_turns_out_to_be_text_late(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(csv_file, "BLOCK", 256)
    cells = [[repr(k * 0.001), repr(float(k % 7)), str(k), repr(float(k % 5))] for k in range(500)]
    cells[300][2] = "fault, \u00b5"
    cells[300][2] = '"' + cells[300][2] + '"'
    (tmp_path / "a.csv").write_bytes(written(cells, "t,v,state,y"))
    record = read_record(tmp_path / "a.csv")
    check(record, *(np.array([float(row[k]) for row in cells]) for k in (0, 1, 3)))
    assert record.extra == {}
    assert record.notes == ("columns without numbers were left out: state",)


@pytest.mark.parametrize(
    "text", ["plain", '"a,b"', '"a""b"', '"a,""b"', ' "a,b"', 'a"b,c"d', '"', '"a"b', 'a""', '""', '"a","b', "#1"]
)
def test_text_between_the_columns_does_not_move_them(tmp_path: Path, text: str) -> None:
    """The text is in the middle, so a delimiter too many would move y; the csv module confirms the refusals."""
    cells = [[repr(k * 0.001), repr(float(k % 7)), "ok", repr(float(k % 5))] for k in range(100)]
    cells[0][2] = "ok"
    cells[50][2] = text
    (tmp_path / "a.csv").write_bytes(written(cells, "t,v,state,y"))
    (row,) = csv.reader([",".join(cells[50])])
    try:
        record = read_record(tmp_path / "a.csv")
    except RecordError as error:
        (problem,) = error.problems
        assert f"{tmp_path / 'a.csv'}:52:" in problem
        assert len(row) != 4 or not row[3].replace(".", "").isdigit()
    else:
        check(record, *(np.array([float(row[k]) for row in cells]) for k in (0, 1, 3)))


def test_a_row_too_long_and_one_too_short_do_not_make_up_for_each_other(tmp_path: Path) -> None:
    cells = [[repr(k * 0.001), repr(float(k % 7)), repr(float(k % 5)), "ok"] for k in range(100)]
    cells[50].append("1")
    cells[51].pop()
    (tmp_path / "a.csv").write_bytes(written(cells, "t,v,y,state"))
    with pytest.raises(RecordError) as caught:
        read_record(tmp_path / "a.csv")
    assert [problem.split(":")[-4:-2] for problem in caught.value.problems] == [["52", "1"], ["53", "1"]]


def test_latin_1_and_binary_parts_far_into_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(csv_file, "BLOCK", 256)
    text = written([[repr(k * 0.001), repr(float(k % 7)), repr(float(k % 5))] for k in range(500)], "t,v,y")
    (tmp_path / "a.csv").write_bytes(text + b"# 20 \xb0C\n# 21 \xb0C\n")
    record = read_record(tmp_path / "a.csv")
    assert len(record) == 500
    assert record.notes == ("the text is not UTF-8; it was read as Latin-1",)
    (tmp_path / "b.csv").write_bytes(text + b"\0\0\0\n")
    assert "is not a text file" in problems(tmp_path / "b.csv")[0]
    (tmp_path / "c.csv").write_bytes(text + b"1" * 600)
    assert "has a line longer than" in problems(tmp_path / "c.csv")[0]


def test_a_pipe_is_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    write_csv(tmp_path / "a.csv", {"t": T, "v": V, "y": Y})
    with subprocess.Popen(["sh", "-c", f"cat '{tmp_path / 'a.csv'}' > '{tmp_path / 'pipe'}'"]):
        check(read_record(tmp_path / "pipe"))


@pytest.mark.slow(one_in=2)
@pytest.mark.skipif(sys.platform != "linux", reason="the high-water mark of memory is read as Linux gives it")
@pytest.mark.parametrize("file", ["record.csv", "faults.csv", "record.npz", "record.mat", "compressed.h5",
                                  "one_group.parquet"])  # fmt: skip
@pytest.mark.thorough
def test_memory_stays_below_three_times_what_is_kept(large: dict[str, dict[str, Any]], file: str) -> None:
    found = large[file]
    assert found["samples"] == 1_000_000
    assert found["peak"] < 3.0
    # The two faults are extra rows, so all intended rows are there
    assert found["sum"] == pytest.approx(found["meant"], abs=1e-6)
    assert len(found["notes"]) == (2 if file == "faults.csv" else 0)


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    """Memory that reading 10^6 samples takes, by file; `benchmarks/record_memory.py` measures 10^7 the same way."""
    benchmark = Path(__file__).resolve().parent.parent / "benchmarks" / "record_memory.py"
    code = (
        "import importlib.util, json, sys\nfrom pathlib import Path\n"
        "spec = importlib.util.spec_from_file_location('record_memory', sys.argv[1])\n"
        "m = importlib.util.module_from_spec(spec); spec.loader.exec_module(m)\n"
        "meant = float(m.columns(1_000_000)['y'].sum())\n"
        "print(json.dumps({p.name: {**m.measure(p), 'meant': meant}\n"
        "                  for p in m.write_files(1_000_000, Path(sys.argv[2]))}))"
    )
    folder = tmp_path_factory.mktemp("large")
    done = subprocess.run(
        [sys.executable, "-c", code, str(benchmark), str(folder)], capture_output=True, text=True, check=True
    )
    found: dict[str, dict[str, Any]] = json.loads(done.stdout)
    return found


# The progress bar ------------------------------------------------------------------------------------------

PATIENT = "import sys, hystgen.basics.progress as p; p.PATIENCE = {}; from hystgen import cli; cli.main(sys.argv[1:])"


@every_format
def test_every_format_counts_the_bytes_it_reads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, write: Callable[..., None]
) -> None:
    t = np.arange(100_000) * 0.001
    write(tmp_path / name, {"t": t, "v": np.sin(t), "y": np.cos(t)})
    ticks: list[float] = []
    monkeypatch.setattr(Progress, "tick", lambda _bar, work: ticks.append(work))
    assert len(read_record(tmp_path / name)) == len(t)
    assert 0.9 < sum(ticks) / (tmp_path / name).stat().st_size < 1.1
    assert len(ticks) >= 3


@pytest.mark.thorough
def test_a_bar_while_reading_on_a_terminal(tmp_path: Path) -> None:
    file = "a.csv"
    write_csv(tmp_path / file, {"t": T, "v": V, "y": Y})
    (tmp_path / "m.yaml").write_text(
        "hystgen: 1\nname: stage\ninput_range: [-40, 40]\nmodel: {pi: {thresholds: [0, 5], weights: [0.5, 1]}}\n"
    )
    shown = {}
    for patience in (0.0, 1000.0):
        ours, theirs = pty.openpty()
        command = [sys.executable, "-c", PATIENT.format(patience), "simulate", "m.yaml", file]
        with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=theirs) as process:
            os.close(theirs)
            shown[patience] = terminal(ours)
        assert process.returncode == 0, shown[patience]
    assert "reading" in shown[0.0]
    assert "%" in shown[0.0]
    assert "reading" not in shown[1000.0], "nothing for what takes less than a second"
    done = subprocess.run(
        [sys.executable, "-c", PATIENT.format(0.0), "simulate", "m.yaml", file],
        cwd=tmp_path, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert "reading" not in done.stderr, "nothing where stderr is not a terminal"


def terminal(ours: int) -> str:
    """Everything that is written to a terminal until it is closed."""
    text = b""
    while True:
        try:
            part = os.read(ours, 4096)
        except OSError:  # Linux raises it when the last writer is gone
            part = b""
        if not part:
            os.close(ours)
            return text.decode("utf-8", "replace")
        text += part


# Nesting ------------------------------------------------------------------------------------------------------


def element(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", kind, len(data)) + data + b"\0" * (-len(data) % 8)


def array(sort: int, name: bytes, inside: bytes) -> bytes:
    """A MATLAB array of 1 x 1, by the description of the format."""
    head = element(6, struct.pack("<II", sort, 0)) + element(5, struct.pack("<ii", 1, 1)) + element(1, name)
    return element(14, head + inside)


def nested(sort: int, depth: int, packed: bool) -> bytes:
    """A .mat file of nested structs or cells, built from the inside out."""
    fields = struct.pack("<HHi", 5, 4, 8) + element(1, b"a".ljust(8, b"\0"))
    found = array(6, b"", element(9, struct.pack("<d", 1.0)))
    for level in range(depth):
        found = array(sort, b"s" if level == depth - 1 else b"", (fields if sort == 2 else b"") + found)
    if packed:
        data = zlib.compress(found)
        found = struct.pack("<II", 15, len(data)) + data
    return b"MATLAB 5.0 MAT-file".ljust(124) + b"\0\1IM" + found


class TestNesting:
    """Files that a library reads by recursion in C, which crashes the process."""

    @pytest.mark.parametrize("packed", [False, True])
    @pytest.mark.parametrize("sort", [1, 2])
    def test_structs_and_cells(self, tmp_path: Path, sort: int, packed: bool) -> None:
        path = tmp_path / "deep.mat"
        for depth in (33, 6000):
            path.write_bytes(nested(sort, depth, packed))
            (said,) = problems(path)
            assert said.endswith("has structs or cells nested more than 32 deep; export the signals as vectors")
        path.write_bytes(nested(sort, 31, packed))
        assert 'there are no columns "v" and "y"' in problems(path)[-1]
        assert scipy.io.whosmat(path)[0][0] == "s", "a file that scipy reads"

    @pytest.mark.parametrize("packed", [False, True])
    def test_the_walk_goes_through_every_class(self, tmp_path: Path, packed: bool) -> None:
        """A struct of everything that scipy writes, in structs and cells; its depth is counted in what scipy reads."""
        everything: Any = {
            "numbers": np.arange(5.0), "imaginary": np.arange(3) * 1j, "text": "abc", "words": ["a", "bcd"],
            "short": np.int8([1, 2, 3]), "none": np.zeros((0, 0)), "sparse": scipy.sparse.eye(3).tocsc(),
            "imaginary_sparse": scipy.sparse.eye(3).tocsc() * 1j, "yes": True,
            "list": np.array([{"u": 1.0}, {"u": 2.0}], dtype=object), "a_name_that_is_longer": 3,
        }  # fmt: skip
        for _ in range(3):
            everything = {"in": everything, "cell": np.array([everything, 0.0], dtype=object), "last": 1.0}
        path = tmp_path / "all.mat"
        scipy.io.savemat(path, {"v": V, "s": everything, "y": Y}, do_compression=packed, long_field_names=True)

        def depth_of(found: Any) -> int:
            if not isinstance(found, np.ndarray) or found.dtype.kind not in "OV":
                return 1
            inner = [x[name] for x in found.ravel() for name in found.dtype.names] if found.dtype.names else found.flat
            return 1 + max(map(depth_of, inner), default=0)

        wanted = depth_of(scipy.io.loadmat(path)["s"])
        assert wanted > 8
        with path.open("rb") as stream:
            for most in (wanted, wanted - 1):
                with pytest.MonkeyPatch.context() as patch:
                    patch.setattr(mat_nesting, "MOST", most)
                    assert bool(mat_nesting.problem(stream)) == (most < wanted)

    def test_a_damaged_file_is_left_to_its_library(self, tmp_path: Path) -> None:
        whole, rng = nested(2, 20, packed=False), np.random.default_rng(0)
        for k in range(60):
            data = bytearray(whole[: int(rng.integers(100, len(whole)))] if k % 2 else whole)
            for place in rng.integers(120, len(data), 3):
                data[place] = int(rng.integers(256))
            (tmp_path / "damaged.mat").write_bytes(data)
            assert problems(tmp_path / "damaged.mat")

    def test_a_count_without_content(self, tmp_path: Path) -> None:
        """The file claims two billion structs without fields, in 136 bytes."""
        fields = struct.pack("<HHi", 5, 4, 8) + element(1, b"")
        data = array(2, b"s", fields).replace(struct.pack("<ii", 1, 1), struct.pack("<ii", 2**31 - 1, 1))
        (tmp_path / "many.mat").write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\0\1IM" + data)
        assert problems(tmp_path / "many.mat")[0].endswith("structs or cells; export the signals as vectors")

    def test_groups(self, tmp_path: Path) -> None:
        with h5py.File(tmp_path / "deep.h5", "w") as file:
            group = file
            for _ in range(33):
                group = group.create_group("a")
            group["b"] = 1.0
        assert problems(tmp_path / "deep.h5")[0].endswith("nested more than 32 deep; export the signals into one group")

    def test_lists_in_parquet_and_headers_of_arrays(self, tmp_path: Path) -> None:
        kind = pa.int32()
        for _ in range(500):
            kind = pa.struct([("a", kind)])
        pq.write_table(pa.table({"x": pa.nulls(1, kind)}), tmp_path / "deep.parquet", store_schema=False)
        assert len(problems(tmp_path / "deep.parquet")) == 1
        for head in ("(" * 9000, "-" * 9000 + "1", "[" * 200_000, "{'descr':" + "~" * 4000 + "1}"):
            with zipfile.ZipFile(tmp_path / "deep.npz", "w") as archive:
                archive.writestr("v.npy", b"\x93NUMPY\x02\0" + struct.pack("<I", len(head)) + head.encode())
            assert len(problems(tmp_path / "deep.npz")) == 1

    def test_a_fleet_goes_on(self, tmp_path: Path) -> None:
        (tmp_path / "units").mkdir()
        (tmp_path / "units" / "a.mat").write_bytes(nested(2, 6000, packed=False))
        v = 50.0 - 50.0 * np.cos(np.linspace(0.0, 4.0 * np.pi, 200))
        np.savetxt(tmp_path / "units" / "b.csv", np.column_stack([0.01 * np.arange(200), v, 0.1 * v]), "%.6g", ",",
                   header="t,v,y", comments="")  # fmt: skip
        words = ["identify", "--batch", f"{tmp_path}/units/*", "-o", f"{tmp_path}/out", "--jobs", "1", "--no-emit"]
        run = CliRunner().invoke(cli.main, words)
        assert "nested more than 32 deep" in run.output
        assert (tmp_path / "out" / "b.yaml").is_file()


@pytest.mark.parametrize("header", ["t,v,", "t,v,,", ",,,"])
def test_columns_without_a_name_by_their_number(tmp_path: Path, header: str) -> None:
    cells = [f"{0.01 * k:.2f},{k % 9},{k % 7}" + ",7" * (header.count(",") - 2) for k in range(40)]
    (tmp_path / "a.csv").write_text("\n".join([header, *cells]))
    record = read_record(tmp_path / "a.csv", {"t": "#1", "v": "#2", "y": "#3"})
    assert record.v.tolist() == [k % 9 for k in range(40)]
    assert record.y is not None
    assert record.y.tolist() == [k % 7 for k in range(40)]


def test_a_column_without_a_name_is_offered_by_its_number(tmp_path: Path) -> None:
    """The answer that the message offers is read as it stands; with a named column left, the nameless one is not
    offered."""
    cells = [f"{0.01 * k:.2f},{k % 9},{k % 7}" for k in range(40)]
    (tmp_path / "a.csv").write_text("\n".join(["t,v,", *cells]))
    with pytest.raises(RecordError, match=r'for example --columns "y=#3"$'):
        read_record(tmp_path / "a.csv")
    record = read_record(tmp_path / "a.csv", {"y": "#3"})
    assert record.y is not None
    assert record.y.tolist() == [k % 7 for k in range(40)]
    (tmp_path / "b.csv").write_text("\n".join(["t,v,Spalte,", *(f"{row},1" for row in cells)]))
    with pytest.raises(RecordError, match=r'for example --columns "y=Spalte"$'):
        read_record(tmp_path / "b.csv")
