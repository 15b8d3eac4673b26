"""What instruments and programs write is read, or asks one question; what a message advises works."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import instrument_files as made
import numpy as np
import pytest
from instrument_files import STEP, N, T, V, Y

from hystgen.records import Record, RecordError, parse_columns, read_record


class Kind(NamedTuple):
    """A kind of file: name, writer, and what `read_as` says of it; `columns`: what a user has to say."""

    file: str
    write: Callable[[Path], object]
    said: str = ""
    columns: str = ""
    fewer: int = 0
    steps: float = 1e-9


KINDS: dict[str, Kind] = {
    "npy": Kind("a.npy", made.npy, columns="1,2,3"),
    "npy with fields": Kind("a.npy", made.npy_fields),
    "xlsx": Kind("a.xlsx", made.xlsx, "sheet Run 1"),
    "xlsx with dates": Kind("a.xlsx", made.xlsx_dated, "times of day", steps=2e-6),
    "feather": Kind("a.feather", made.feather_2),
    "feather by content": Kind("a.dat", made.feather_2),
    "arrow stream": Kind("a.arrows", made.arrow_stream),
    "gzip": Kind("a.csv.gz", made.packed(made.PACKERS["gzip"])),
    "gzip by content": Kind("a.csv", made.packed(made.PACKERS["gzip"])),
    "xz": Kind("a.csv.xz", made.packed(made.PACKERS["xz"])),
    "bzip2": Kind("a.csv.bz2", made.packed(made.PACKERS["bzip2"])),
    "zip": Kind("a.zip", made.packed(made.PACKERS["zip"])),
    "tar": Kind("a.tgz", made.packed(made.PACKERS["tar.gz"])),
    "hdf5 as .hdf": Kind("a.hdf", made.hdf5),
    "hdf5 as .dat": Kind("a.dat", made.hdf5),
    "hdf5 of rows": Kind("a.h5", made.rows_of_hdf5),
    "netcdf 4": Kind("a.nc", made.netcdf_4, "t = time", fewer=1),
    "netcdf 3": Kind("a.nc", made.netcdf_3, "t = time", fewer=1),
    "nexus": Kind("a.nxs", made.nexus, "v = voltage"),
    "parquet by content": Kind("a.bin", made.parquet),
    "parquet with zones": Kind("a.parquet", made.parquet_zoned),
    "matrix with fs": Kind("a.h5", made.matrix_with_rate("fs"), "time from sample rate 500 Hz", "1,2"),
    "matrix with sample_rate": Kind("a.h5", made.matrix_with_rate("sample_rate"), "time from sample rate", "1,2"),
    "mdf 4": Kind("a.mf4", made.mdf("4.10"), "v = Drive"),
    "mdf 3": Kind("a.dat", made.mdf("3.30"), "v = Drive"),
    "mdf with invalid samples": Kind("a.mf4", made.mdf_invalid, fewer=1),
    "igor": Kind("a.ibw", made.ibw_labelled, "time from scaling", "v=Drive,y=ZSensor"),
    "universal file": Kind("a.uff", made.universal(0), "time from abscissa increment"),
    "universal file, binary": Kind("a.unv", made.universal(1), "v = Drive"),
    "json columns": Kind("a.json", made.json_of(made.COLUMNS)),
    "json of samples": Kind("a.json", made.json_of({"run": {"data": made.samples()}})),
    "json by pandas": Kind("a.json", made.json_by_row),
    "json with names": Kind("a.json", made.json_with_names),
    "json of signals": Kind("a.json", made.json_of_signals, "time from sample rate"),
    "json lines": Kind("a.jsonl", made.json_lines, "one sample per line"),
    "json lines by content": Kind("a.log", made.json_lines, "one sample per line"),
    "gw instek, detail": Kind("a.csv", made.gw_instek("Detail"), "GW Instek CSV"),
    "gw instek, fast": Kind("a.csv", made.gw_instek("Fast"), "time from Sampling Period"),
    "twincat": Kind("a.csv", made.twincat(), "TwinCAT Scope"),
    "twincat, german": Kind("a.csv", made.twincat(mark=";", decimal=","), "TwinCAT Scope"),
    "aixacct": Kind("a.dat", made.aixacct(1), "aixACCT table"),
    "rows without cells": Kind("a.csv", made.empty_rows),
    "minus signs": Kind("a.csv", made.minus_signs),
    "excel days": Kind("a.csv", made.days(45678.5), "Excel's days, of which 45678 is 2025-01-21", steps=2e-6),
    "matlab datenums": Kind("a.csv", made.days(738000.25), "MATLAB's days, of which 738000 is 2020-07-28", steps=3e-5),
    "stamps with offsets": Kind("a.csv", made.stamps("offset"), "times of day"),
    "stamps with zones": Kind("a.csv", made.stamps("name"), "times of day"),
    "stamps by java": Kind("a.csv", made.stamps("java"), "times of day"),
    "hours of autumn": Kind("a.csv", made.stamps("autumn"), "times of day"),
    "hours of spring": Kind("a.csv", made.stamps("spring"), "times of day"),
    "dates of matlab": Kind("a.csv", made.matlab_dates, "times of day"),
}  # fmt: skip


def check(record: Record, fewer: int = 0, steps: float = 1e-9) -> None:
    """The samples are those of the generator, but for `fewer` of them at sample 7."""
    kept = np.arange(N) != 7 if fewer else np.ones(N, dtype=bool)
    assert len(record) == N - fewer
    np.testing.assert_allclose(record.t - record.t[0], T[kept], rtol=0, atol=steps)
    np.testing.assert_allclose(record.v, V[kept], rtol=0, atol=2e-6)
    assert record.y is not None
    np.testing.assert_allclose(record.y, Y[kept], rtol=0, atol=2e-6)


def refused(path: Path | str, **options: Any) -> str:
    with pytest.raises(RecordError) as caught:
        read_record(path, **options)
    (problem,) = caught.value.problems
    assert "\n" not in problem
    assert problem.startswith(str(path))
    return problem.removeprefix(str(path))


@pytest.mark.parametrize("name", KINDS)
def test_kinds(tmp_path: Path, name: str) -> None:
    kind = KINDS[name]
    path = tmp_path / kind.file
    kind.write(path)
    record = read_record(path, columns=parse_columns(kind.columns) if kind.columns else None)
    check(record, kind.fewer, kind.steps)
    assert kind.said in record.read_as
    assert record.name == path.name
