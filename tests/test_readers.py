"""What instruments and programs write is read, or asks one question; what a message advises works."""

from __future__ import annotations

import contextlib
import re
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import asammdf
import h5py
import instrument_files as made
import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from instrument_files import STEP, N, T, V, Y

from hystgen import cli
from hystgen.basics import extras
from hystgen.records import Record, RecordError, packed, parse_columns, read_record
from hystgen.records.cells import Clock


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
    "twincat, groups": Kind("a.csv", made.twincat_groups(True), "TwinCAT Scope"),
    "twincat, groups of short rows": Kind("a.csv", made.twincat_groups(False), "TwinCAT Scope"),
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


@pytest.mark.parametrize("name", KINDS)
def test_kinds_packed(tmp_path: Path, name: str) -> None:
    """Whatever is read is read from an archive too, though its suffix says nothing."""
    kind = KINDS[name]
    path = tmp_path / kind.file
    kind.write(path)
    (tmp_path / "packed").write_bytes(made.zipped({"data": path.read_bytes()}))
    record = read_record(tmp_path / "packed", columns=parse_columns(kind.columns) if kind.columns else None)
    check(record, kind.fewer, kind.steps)
    assert kind.said in record.read_as
    assert record.name == "packed"


# What remains to be asked, and what a file cannot give ----------------------------------------------------------------


def test_one_of_several_parts_is_named_behind_the_file(tmp_path: Path) -> None:
    runs = {"a.csv": made.csv_text().encode(), "b/c.csv": made.csv_text(columns=(T, 2 * V, Y)).encode()}
    book, loops = tmp_path / "book.xlsx", tmp_path / "loops.dat"
    (tmp_path / "runs.zip").write_bytes(made.zipped(runs))
    (tmp_path / "runs.tgz").write_bytes(made.tarred(runs))
    made.xlsx_two(book)
    made.aixacct(2)(loops)
    for file, names in (
        ("runs.zip", "2 files: a.csv, b/c.csv"), ("runs.tgz", "2 files: a.csv, b/c.csv"),
        ("book.xlsx", "2 sheets: Run 1, Run 2"), ("loops.dat", "2 tables: Table 1, Table 2"),
    ):  # fmt: skip
        said = refused(tmp_path / file)
        assert f": error: has {names}; " in said
        advised = said.rpartition(", as in ")[2]  # the question is answered as it says
        record = read_record(advised)
        np.testing.assert_allclose(record.v, 2 * V, rtol=0, atol=2e-6)
        assert names.split()[-1] in record.read_as
        assert "no " in refused(f"{tmp_path / file}/nothing")
    (tmp_path / "books.zip").write_bytes(made.zipped({"book.xlsx": book.read_bytes(), "a.csv": runs["a.csv"]}))
    check(read_record(tmp_path / "books.zip" / "book.xlsx" / "Run 1"))
    (tmp_path / "a.csv").write_bytes(runs["a.csv"])
    assert "has no parts, so it cannot contain Run 1" in refused(tmp_path / "a.csv" / "Run 1")


@pytest.mark.parametrize("write", [made.mat_with, made.mat_73_with])
@pytest.mark.parametrize(
    ("kind", "typed"),
    [
        ("table", 's = table2struct(T, "ToScalar", true); save("a_columns.mat", "-struct", "s")'),
        ("timetable", "T = timetable2table(T); T.(1) = seconds(T.(1) - T.(1)(1));"),
        ("timeseries", "s.t = T.Time; s.y = squeeze(T.Data);"),
        ("MyClass", 's.v = ..; s.y = ..; save("a_columns.mat", "-struct", "s")'),
    ],
)
def test_objects_of_matlab(tmp_path: Path, write: Callable[..., Any], kind: str, typed: str) -> None:
    path = tmp_path / "a.mat"
    write({"T": kind})(path)
    said = refused(path)
    assert f"in MATLAB objects, which only MATLAB can read: T ({kind}); in MATLAB, type: " in said
    assert typed in said


def test_vectors_beside_objects_of_matlab(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    made.mat_with({"info": "table", "when": "datetime"}, t=T, v=V, y=Y)(path)
    record = read_record(path)
    check(record)
    assert record.notes == ("columns without numbers were left out: info, when",)
    made.mat_with({"when": "datetime"}, v=V)(path)
    assert "when (datetime)" in refused(path)


def test_starts_of_waveforms_are_checked_whatever_is_given(tmp_path: Path) -> None:
    made.tdms(0.0)(tmp_path / "a.tdms")
    check(read_record(tmp_path / "a.tdms"))
    made.tdms(3.0)(tmp_path / "b.tdms")
    for step in (None, STEP):
        said = refused(tmp_path / "b.tdms", sample_time=step)
        assert "the columns start at different times: AI/Drive at 2025-03-01T10:00:00" in said


def test_times_of_another_channel(tmp_path: Path) -> None:
    """Channels of a scope with a column of time each: they have to agree to half a step."""
    made.twincat(0.4 * STEP)(tmp_path / "a.csv")
    check(read_record(tmp_path / "a.csv"))
    made.twincat(0.6 * STEP)(tmp_path / "b.csv")
    assert ":7:1: error: Position has times of its own; export all channels with" in refused(tmp_path / "b.csv")
    made.twincat_groups(True)(tmp_path / "b.csv")
    said = refused(tmp_path / "b.csv", columns={"y": "slow"})
    assert ":5:1: error: " in said
    assert "has times of its own; export all channels with one sample time" in said
    made.twincat()(tmp_path / "b.csv")
    (tmp_path / "b.csv").write_text((tmp_path / "b.csv").read_text().replace("\t6.000\t", "\tsix\t"))
    assert ':20:17: error: "six" in column "#3" is not a number' in refused(tmp_path / "b.csv")
    made.mdf("4.10")(tmp_path / "c.mf4")
    said = refused(tmp_path / "c.mf4", columns={"y": "stage_temperature"})
    assert "the columns differ in length: 1/stage_temperature has 9, 0/Drive has 60 samples" in said


@pytest.mark.parametrize(
    ("file", "data", "said"),
    [
        ("a.csv.gz", made.PACKERS["gzip"](made.csv_text().encode())[:200], "is a damaged gzip file"),
        ("a.csv.xz", made.PACKERS["xz"](made.csv_text().encode())[:200], "is a damaged xz file"),
        ("a.zip", made.zipped({"notes/": b"", ".hidden": b"1"}), "is a zip file without a data file in it"),
        ("a.gz", made.packed_often(6), "is packed more than 4 times"),
        ("a.xls", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(500), "save it as .xlsx or CSV"),
        ("a.ods", made.zipped({"mimetype": b"application/vnd.oasis.opendocument.spreadsheet"}), "save it as .xlsx"),
        ("a.wfm", b"\x0f\x0f:WFM#003" + bytes(99), "save the waveforms as CSV"),
        ("a.trc", b"#9000100359WAVEDESC" + bytes(99), "save the waveforms as CSV"),
        ("a.csv.zst", b"\x28\xb5\x2f\xfd" + bytes(99), "unpack it with zstd -d"),
        ("a.tdms_index", b"TDSh" + bytes(99), "give the .tdms file beside it"),
        ("a.npy", made.pickled(), "holds Python objects; save arrays of numbers"),
        ("a.json", b'{"t": [1, 2,\n  3}', ":2:4: error: is not JSON"),
        ("a.jsonl", b'{"t": 1, "v": 2}\n{"t": 2, "v"}\n', ":2:13: error: is not JSON"),
        ("a.json", b'{"a": ' + b"[" * 100000 + b"]" * 100000 + b"}", "is nested too deeply"),
        ("a.mf4", b"MDF     4.10    " + bytes(99), "is an MDF file that is damaged"),
        ("a.ibw", b"\5\0" + bytes(382), "is an Igor binary wave that is damaged"),
        ("a.uff", b"    -1\n    58\nrun 3\n", "has no real function of time"),
        ("a.xlsx", made.zipped({"xl/workbook.xml": b"<"}), "is not an Excel workbook"),
        ("a.feather", b"ARROW1\0\0" + bytes(99), "is not an Arrow file"),
        ("a.nc", b"CDF\x01" + bytes(4), "netCDF file"),
        ("a.dat", b"PiezoResult\nTable 1\nTable No [#]\tA [V]\n1\t2\n", "without a table of samples"),
    ],
)
def test_what_cannot_be_read(tmp_path: Path, file: str, data: bytes, said: str) -> None:
    path = tmp_path / file
    path.write_bytes(data)
    assert said in refused(path)


@pytest.mark.slow(one_in=3)
@pytest.mark.parametrize("name", KINDS)
def test_a_kind_that_is_cut_or_damaged(tmp_path: Path, name: str) -> None:
    """Whatever is wrong in a file, there is a record or a message."""
    kind = KINDS[name]
    path = tmp_path / kind.file
    kind.write(path)
    data = path.read_bytes()
    for wrong in (data[: len(data) * 3 // 5], data[:40], data[:200] + b"\xff" * 9 + data[209:]):
        path.write_bytes(wrong)
        with contextlib.suppress(RecordError):
            assert len(read_record(path, columns=parse_columns(kind.columns) if kind.columns else None)) <= N


def test_a_file_with_a_password_and_one_larger_than_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.zip"
    path.write_bytes(made.with_password(made.zipped({"a.csv": made.csv_text().encode()})))
    assert "is a zip file with a password; unpack it" in refused(path)
    monkeypatch.setattr(packed, "ROOM", 1e-12)
    path.write_bytes(made.PACKERS["gzip"](made.csv_text().encode()))
    assert "more than 0% of the free disk space; unpack it" in refused(path)


def test_nothing_unpacked_is_left_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    for pack in made.PACKERS.values():
        (tmp_path / "a").write_bytes(pack(made.csv_text().encode()))
        check(read_record(tmp_path / "a"))
    (tmp_path / "a").write_bytes(made.PACKERS["gzip"](made.csv_text().encode())[:99])
    refused(tmp_path / "a")
    assert list((tmp_path / "temporary").iterdir()) == []


@pytest.mark.parametrize(
    ("name", "package"),
    [
        ("xlsx", "openpyxl"), ("feather", "pyarrow"), ("mdf 4", "asammdf"), ("igor", "igor2"),
        ("universal file", "pyuff"),
    ],
)
def test_without_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, package: str) -> None:
    kind = KINDS[name]
    kind.write(tmp_path / kind.file)
    monkeypatch.setitem(sys.modules, package, None)
    extra = "formats" if package in ("openpyxl", "pyarrow") else "instruments"
    said = refused(tmp_path / kind.file)
    assert f"files need the package {package}; {extras.install(extra)}, or export CSV" in said


# Times ----------------------------------------------------------------------------------------------------------------


class TestDays:
    """Numbers that may count days or seconds: the steps tell, or the user."""

    @pytest.mark.parametrize("zero", [45678.5, 738000.25])
    def test_steps_tell(self, tmp_path: Path, zero: float) -> None:
        path = tmp_path / "a.csv"
        made.days(zero, 0.08)(path)  # 0.93 us if it is seconds
        assert read_record(path).sample_time == pytest.approx(0.08, rel=1e-3)
        made.days(zero, 10.5)(path)  # 122 us if it is seconds: a session that has run for half a day
        assert read_record(path).sample_time == pytest.approx(10.5 / 86400, rel=1e-3)

    def test_the_user_is_asked(self, tmp_path: Path) -> None:
        path = tmp_path / "a.csv"
        made.days(45678.5, 1.0)(path)
        said = refused(path)
        assert 'the numbers of "Time", from 45678.5 on, may be seconds or days since 1900' in said
        days, seconds = re.findall(r'--columns "([^"]*)"', said)
        assert read_record(path, columns=parse_columns(days)).sample_time == pytest.approx(1.0, rel=1e-4)
        assert read_record(path, columns=parse_columns(seconds)).sample_time == pytest.approx(1 / 86400, rel=1e-4)
        made.days(45678.5, 1.0, "Datum")(path)
        assert read_record(path, columns={"t": "Datum"}).sample_time == pytest.approx(1.0, rel=1e-4)

    @pytest.mark.parametrize("zero", [0.0, 1e4, 1e5, 1e6])
    def test_no_date(self, tmp_path: Path, zero: float) -> None:
        path = tmp_path / "a.csv"
        path.write_text(made.csv_text(columns=([f"{zero + 1e-6 * k:.9f}" for k in range(N)], V, Y)))
        assert read_record(path).sample_time == pytest.approx(1e-6, rel=1e-3)

    def test_units_of_days(self, tmp_path: Path) -> None:
        path = tmp_path / "a.csv"
        for name in ("t [d]", "t [days]", "t [days since 2024-03-05]"):
            path.write_text(made.csv_text((name, "v", "y"), (T / 86400, V, Y)))
            check(read_record(path), steps=1e-12)


def test_summer_time_is_not_seen_where_there_is_none() -> None:
    """A pause of an hour, or times out of order, are not a change of the clock; that is one with stamps of whole hours,
    forward or back by an hour and the usual step."""
    for stamps, seconds, notes in (
        (["00:30:00", "00:30:01", "01:30:02"], [0, 1, 3602], 0),
        (["01:59:58", "01:59:59", "03:00:00"], [0, 1, 2], 1),
        (["01:59:58", "01:59:59", "03:00:05"], [0, 1, 3607], 0),
        (["02:59:58", "02:59:59", "02:00:00", "02:00:01"], [0, 1, 2, 3], 1),
        (["02:59:58", "02:59:59", "02:30:00"], [0, 1, -1798], 0),
        (["01:40:00", "02:50:00", "02:00:00"], [0, 4200, 1200], 0),
    ):
        clock = Clock()
        assert [clock.seconds(f"2025-10-26 {each}") for each in stamps] == seconds
        assert len(clock.notes) == notes
    zoned = Clock()
    named = ("02:59:59 CEST", "02:00:00 CET", "01:00:01 UTC")
    assert [zoned.seconds(f"2025-10-26 {each}") for each in named] == [0, 1, 2]
    assert [zoned.seconds(f"2025-10-26 {each}") for each in ("02:00:02 GMT+1", "06:30:03 +05:30")] == [3, 4]


def test_changes_of_the_clock_are_told(tmp_path: Path) -> None:
    for season, said in (("autumn", "back"), ("spring", "forward")):
        made.stamps(season)(tmp_path / "a.csv")
        notes = read_record(tmp_path / "a.csv").notes
        assert notes == (f"the clock was set {said} by an hour; the times were read as if it had not been",)


# In memory ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("unit", ["ns", "us", "ms"])
@pytest.mark.parametrize("name", ["time", "time [ms]"])
def test_zoned_times_in_memory(unit: str, name: str) -> None:
    start = pd.Timestamp("2025-10-26 00:59:59.9", tz="UTC").tz_convert("Europe/Berlin")
    index = (start + pd.to_timedelta(2 * np.arange(N), unit="ms")).as_unit(unit)
    check(read_record(pd.DataFrame({"v": V, "y": Y}, index=pd.Index(index, name=name))))
    for times in (index, index.to_pydatetime(), list(index.tz_convert(None).to_pydatetime())):
        check(read_record(pd.DataFrame({name: times, "v": V, "y": Y})))
        check(read_record({name: times, "v": V, "y": Y}))


def test_masks_in_memory() -> None:
    mask = np.arange(N) == 7
    hidden = np.ma.MaskedArray(np.where(mask, 99.0, Y), mask=mask)
    for v, y in ((V, hidden), (np.ma.MaskedArray(V, mask=mask), Y)):
        record = read_record((T, v, y))
        check(read_record({"t": T, "v": v, "y": y}), fewer=1)
        check(record, fewer=1)
        which = "v" if isinstance(v, np.ma.MaskedArray) else "y"
        assert record.notes == (f"1 sample without a value in {which} dropped, the first at index 7",)
    with pytest.raises(RecordError, match="give the drive and the measured signal"):
        read_record({"t": T, "drive": V})


# One file a channel ---------------------------------------------------------------------------------------------------


class TestJoin:
    """`--join DRIVE MEASURED`, or `DRIVE+MEASURED` where a file is named."""

    def files(self, folder: Path, start: float = 0.0, more: int = 0, step: float = 1.0) -> tuple[Path, Path]:
        first, second = folder / "C1.csv", folder / "C2.csv"
        first.write_text(made.channel(V))
        lines = made.channel(Y, start=start).split("\n")
        if step != 1.0:
            rows = [line.split(",") for line in lines[5:] if line]
            lines[5:] = [f"{float(t) * step:.6f},{y}" for t, y in rows] + [""]
        second.write_text("\n".join(lines[: len(lines) - 1 - more]) + "\n")
        return first, second

    def test_two_files_are_one_record(self, tmp_path: Path) -> None:
        record = read_record("+".join(map(str, self.files(tmp_path))))
        check(record)
        assert record.name == "C1.csv + C2.csv"
        assert record.read_as.endswith("v = C1.csv/Ampl, y = C2.csv/Ampl, in the order given")

    def test_names_go_before_order(self, tmp_path: Path) -> None:
        for name, x in (("sensor", Y), ("drive", V)):
            (tmp_path / f"{name}.ibw").write_bytes(made.ibw(x, name, order=">"))
        check(read_record(f"{tmp_path}/sensor.ibw+{tmp_path}/drive.ibw"))

    def test_codes_of_an_old_scope(self, tmp_path: Path) -> None:
        made.gw_instek_old(tmp_path / "A1.CSV", V)
        made.gw_instek_old(tmp_path / "A2.CSV", Y)
        record = read_record(f"{tmp_path}/A1.CSV+{tmp_path}/A2.CSV")
        check(record)
        assert record.units == {"v": "V", "y": "V"}

    def test_other_columns_and_names(self, tmp_path: Path) -> None:
        made.csv(tmp_path / "a+b.csv")
        (tmp_path / "c.csv").write_text(made.csv_text(("t", "load"), (T, V + 1)))
        record = read_record(f"{tmp_path}/a+b.csv+{tmp_path}/c.csv")
        check(record)
        np.testing.assert_allclose(record.extra["load"], V + 1)
        check(read_record(tmp_path / "a+b.csv"))
        both = f"{tmp_path}/c.csv+{tmp_path}/a+b.csv"
        np.testing.assert_allclose(read_record(both, columns={"v": "load"}).v, V + 1)

    def test_members_of_an_archive(self, tmp_path: Path) -> None:
        path = tmp_path / "scope.zip"
        path.write_bytes(made.zipped({"C1.csv": made.channel(V).encode(), "C2.csv": made.channel(Y).encode()}))
        check(read_record(f"{path}/C1.csv+{path}/C2.csv"))

    @pytest.mark.parametrize(
        ("start", "more", "step", "said"),
        [
            (3.0, 0, 1.0, "the files start at different times: C1.csv at 0 s and C2.csv at 3 s"),
            (0.6 * STEP, 0, 1.0, "the files start at different times: C1.csv at 0 s and C2.csv at 0.0012 s"),
            (0.0, 5, 1.0, "the files differ in length: C1.csv has 60, C2.csv has 55 samples"),
            (0.0, 0, 1.01, "the times of the files differ from sample 51 on: C1.csv has 0.102 s and C2.csv 0.10302 s"),
        ],
    )
    def test_starts_lengths_and_steps(self, tmp_path: Path, start: float, more: int, step: float, said: str) -> None:
        assert f": error: {said}" in refused("+".join(map(str, self.files(tmp_path, start, more, step))))

    def test_dates_of_starts(self, tmp_path: Path) -> None:
        """Times of day are counted from the first in each file, whose dates must agree."""
        for name, x, second in (("a", V, 5), ("b", Y, 5), ("c", Y, 8)):
            stamps = [f"2024-03-05 14:21:{second + t:09.6f}" for t in T]
            (tmp_path / f"{name}.csv").write_text(made.csv_text(("Time", name), (stamps, x)))
        check(read_record(f"{tmp_path}/a.csv+{tmp_path}/b.csv"))
        assert "start at different times: 3 s apart" in refused(f"{tmp_path}/a.csv+{tmp_path}/c.csv")
        made.tdms(0.0)(tmp_path / "d.tdms")
        made.tdms(3.0)(tmp_path / "e.tdms")

    def test_steps_of_waves(self, tmp_path: Path) -> None:
        (tmp_path / "a.ibw").write_bytes(made.ibw(V, "drive"))
        (tmp_path / "b.npy").write_bytes(made.vector(Y))
        record = read_record(f"{tmp_path}/a.ibw+{tmp_path}/b.npy")
        check(record)
        made.gw_instek_old(tmp_path / "c.csv", Y)
        text = (tmp_path / "c.csv").read_text()
        (tmp_path / "c.csv").write_text(text.replace("Period,2.000E-03", "Period,2.000E-04"))
        said = refused(f"{tmp_path}/a.ibw+{tmp_path}/c.csv")
        assert "the files have different sample times: a.ibw has 0.002 s, c.csv has 0.0002 s" in said

    def test_every_command_joins(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        """`identify`, `track` and `simulate` print the same for two files as for one; `diagnose` reads them as well."""
        monkeypatch.chdir(tmp_path)
        drive = np.concatenate([np.linspace(0, top, 40) for top in (90, 0, 60, 20, 80)])
        drive += np.tile(np.linspace(0, 9, 40), 5)
        t, y = np.arange(200) * STEP, 0.1 * drive + 0.002 * np.maximum.accumulate(drive)
        Path("one.csv").write_text(made.csv_text(("t [s]", "v", "y"), (t, drive, y)))
        Path("a.csv").write_text(made.csv_text(("t", "CH1"), (t, drive)))
        Path("b.csv").write_text(made.csv_text(("t", "CH1"), (t, y)))
        printed = []
        for where in (["one.csv"], ["--join", "a.csv", "b.csv"]):
            run = CliRunner().invoke(cli.main, ["identify", *where, "-o", "m.yaml", "--thresholds", "2"])
            assert run.exit_code == 0, run.output
            outputs = [model := Path("m.yaml").read_text()]
            for command in (["track", "m.yaml"], ["simulate", "m.yaml", "-o", "out.csv"]):
                run = CliRunner().invoke(cli.main, [*command, *where])
                assert run.exit_code == 0, run.output
                outputs.append(run.stdout)
            outputs.append(Path("out.csv").read_text())
            printed.append([re.sub(" +", " ", re.sub(r"a\.csv \+ b\.csv|one\.csv", "DATA", text)) for text in outputs])
            Path("m.yaml").unlink()
        for one, other in zip(*printed, strict=True):
            assert one == other
        Path("m.yaml").write_text(model)
        run = CliRunner().invoke(cli.main, ["diagnose", "m.yaml", "--join", "a.csv", "c.csv", "-o", "out"])
        assert run.exit_code == 2
        assert "error: --join c.csv: there is no such file; give the files of two channels" in run.output
        run = CliRunner().invoke(cli.main, ["simulate", "m.yaml"])
        assert (run.exit_code, "Missing argument 'DATA...'" in run.output) == (2, True)
        run = CliRunner().invoke(cli.main, ["simulate", "m.yaml", "--join", "a.csv", "b.csv", "-o", "b.csv"])
        assert "b.csv is an input and would be overwritten" in run.output


def mdf_groups(path: Path, step: int = 1) -> None:
    file = asammdf.MDF()
    file.append([asammdf.Signal(V, T, name="Voltage", unit="V")])
    file.append([asammdf.Signal(Y[::step], T[::step], name="Position", unit="um")])
    file.save(path, overwrite=True)


def test_groups_with_equal_times_are_one_record(tmp_path: Path) -> None:
    mdf_groups(tmp_path / "a.mf4")
    record = read_record(tmp_path / "a.mf4")
    check(record)
    assert record.units == {"t": "s", "v": "V", "y": "um"}


def test_groups_with_two_rates_are_refused_with_what_to_type(tmp_path: Path) -> None:
    mdf_groups(tmp_path / "a.mf4", 2)
    with pytest.raises(RecordError, match="the columns differ in length") as refused:
        read_record(tmp_path / "a.mf4", columns={"t": "0/time"})
    typed = str(refused.value).partition("in Python, ")[2].replace("SECONDS", repr(made.STEP))
    eval(typed.replace("resampled.mf4", str(tmp_path / "resampled.mf4")), {"asammdf": asammdf})
    record = read_record(tmp_path / "resampled.mf4")
    np.testing.assert_allclose(record.v, V[: len(record)], atol=1e-9)
    np.testing.assert_allclose(record.y[::2], Y[: len(record)][::2], atol=1e-9)  # type: ignore[index]


def test_single_columns_without_a_header_are_joined(tmp_path: Path) -> None:
    for name, x in (("v.txt", V), ("y.txt", Y)):
        np.savetxt(tmp_path / name, x, "%.6f")
    check(read_record(f"{tmp_path / 'v.txt'}+{tmp_path / 'y.txt'}", sample_time=made.STEP))


def test_a_frame_of_pandas_is_refused_with_what_to_type(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["run/block0_values"] = np.column_stack([T, V, Y])
        file["run/axis1"] = np.arange(len(T))
        file["run"].attrs["pandas_type"] = np.bytes_(b"frame")
    with pytest.raises(RecordError, match=r"pandas\.read_hdf\('[^']*a\.h5', 'run'\)\.to_parquet\("):
        read_record(tmp_path / "a.h5")


def test_a_part_of_an_archive_is_proposed_among_the_most_frequent_kind(tmp_path: Path) -> None:
    text = made.csv_text().encode()
    (tmp_path / "a.zip").write_bytes(made.zipped({"1.csv": text, "2.csv": text, "notes.txt": b"hello"}))
    with pytest.raises(RecordError, match=r"as in .*a\.zip/2\.csv$"):
        read_record(tmp_path / "a.zip")


def test_a_sample_time_does_not_hide_that_joined_files_start_apart(tmp_path: Path) -> None:
    for name, x, start in (("v.csv", V, 0.0), ("y.csv", Y, 0.5), ("same.csv", Y, 0.0)):
        (tmp_path / name).write_text(made.channel(x, start=start))
    assert "start at different times" in refused(f"{tmp_path / 'v.csv'}+{tmp_path / 'y.csv'}", sample_time=STEP)
    check(read_record(f"{tmp_path / 'v.csv'}+{tmp_path / 'same.csv'}", sample_time=STEP))
