"""Text tables as programs and instruments export them: what is read without an option, asked for, refused."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from hystgen import cli
from hystgen.records import Record, RecordError, parse_columns, read_record, read_records
from hystgen.records.cells import Clock, Dialect, is_time
from hystgen.records.columns import unit_alone

N = 60
T = np.arange(N) * 0.0005
V = np.round(40.0 * np.sin(0.2 * np.arange(N)), 4)
Y = np.round(0.3 * V + 1.5, 5)


def table(join: str = ",", time: float = 1.0, digits: str = ".5f", columns: int = 3) -> list[str]:
    """Rows of t, v, y; of v, y; or of t, v, y and a row number."""
    picked = {2: (V, Y), 3: (T * time, V, Y), 4: (T * time, V, Y, np.arange(N, dtype=float))}[columns]
    return [join.join(f"{x:{digits}}" for x in row) for row in zip(*picked, strict=True)]


def comma(rows: list[str]) -> list[str]:
    return [row.replace(".", ",") for row in rows]


def put(path: Path, *lines: str, encoding: str = "utf-8", end: str = "\n") -> Path:
    path.write_bytes((end.join(lines) + end).encode(encoding))
    return path


def check(record: Record, time: bool = True) -> None:
    assert len(record) == N
    assert record.t - record.t[0] == pytest.approx(T, abs=1e-12)
    assert np.array_equal(record.v, V)
    assert record.y is not None
    assert np.array_equal(record.y, Y)
    assert not time or record.sample_time == pytest.approx(0.0005)


def problems(path: Path, **options: Any) -> list[str]:
    with pytest.raises(RecordError) as caught:
        read_record(path, **options)
    return [problem.removeprefix(str(path)) for problem in caught.value.problems]


def aligned() -> list[str]:
    return [f"{t:12.5f} {v:12.5f} {y:12.5f}" for t, v, y in zip(T, V, Y, strict=True)]


@pytest.mark.parametrize(
    ("join", "units", "decimal_commas"), [(",", True, False), (";", False, True), ("\t", True, True)]
)
def test_a_header_longer_than_what_is_looked_at(tmp_path: Path, join: str, units: bool, decimal_commas: bool) -> None:
    """The header of 15 000 columns alone exceeds 64 Ki characters; the lines after it show units and decimals."""
    more = 15_000
    head = ["t", "v", "y", *(f"c{k}" for k in range(more))]
    rows = [row + (join + "1.5") * more for row in table(join)]
    lines = [join.join(head), *([join.join(["s", "V", "um", *["mV"] * more])] if units else [])]
    path = put(tmp_path / "wide.txt", *lines, *(comma(rows) if decimal_commas else rows))
    assert len(lines[0]) > 1 << 16
    record = read_record(path)
    check(record)
    assert len(record.extra) == more


def isoformat(minute: int = 59, rest: str = "") -> list[str]:
    """Times that pass a full minute, hour or day on their way."""
    start = np.datetime64(f"2024-03-05T23:{minute}:59.985")
    return [f"{start + np.timedelta64(500 * k, 'us')}{rest}" for k in range(N)]


STYLES: dict[str, list[str]] = {
    "semicolons": ["t;v;y", *table(";")],
    "semicolons, decimal commas": ["t;v;y", *comma(table(";"))],
    "tabs, decimal commas": ["t\tv\ty", *comma(table("\t"))],
    "blanks, decimal commas": ["t v y", *comma(table("  "))],
    "quoted decimal commas": ['"t","v","y"', *(",".join(f'"{c}"' for c in r.split(";")) for r in comma(table(";")))],
    "quoted cells": ['"t";"v";"y"', *(";".join(f'"{c}"' for c in r.split(";")) for r in table(";"))],
    "bars": ["t|v|y", *table("|")],
    "commas and blanks": ["t, v, y", *table(", ")],
    "aligned": ["           t            v            y", *aligned()],
    "comment header": ["# made by a logger", "# t v y", *table(" ")],
    "comment header with commas": ["# t, v, y", *table(" ")],
    "percent comment header": ["% model: stage", "% t [s]  v [V]  y [um]", *aligned()],
    "comment header and units": ["# stage X, run 3", "#  time  drive  disp", "#  [s]  [V]  [um]", *aligned()],
    "units row": ["Time,Drive,Displacement", "s,V,um", *table()],
    "units row in parentheses": ["Time,Drive,Displacement", "(s),(V),(µm)", *table()],
    "units row of ms": ["Time;Drive;Displacement", "ms;V;nm", *table(";", 1000)],
    "time in the header in us": ["Time (us);Drive (V);Position (nm)", *table(";", 1e6)],
    "German": ["Zeit [ms];Spannung [V];Weg [µm]", *comma(table(";", 1000))],
    "preamble": ["Logger 7", "Operator: Jane, Joe", "", "Range,10,V", "", "t,v,y", *table()],
    "preamble that looks like rows": ["Serial,17", "Gain,2.5", "Note,none", "t,v,y", *table()],
    "ruled": ["t   v   y", "---------", *aligned()],
    "last cell without a name": ["t;v;y;", *(row + ";" for row in table(";"))],
    "last cell only in the rows": ["t;v;y", *(row + ";" for row in table(";"))],
    "last cell only in the header": ["t;v;y;", *table(";")],
    "no values at the start": ["t,v,y,T", *(f"{row},{'' if k < 9 else 20}" for k, row in enumerate(table()))],
    "ISO": ["time,v,y", *(f"{t},{r}" for t, r in zip(isoformat(), table(columns=2), strict=True))],
    "ISO with zone": ["timestamp,v,y", *(f"{t}Z,{r}" for t, r in zip(isoformat(), table(columns=2), strict=True))],
    "clock": ["time;v;y", *(f"{t[11:]};{r}" for t, r in zip(isoformat(), table(";", columns=2), strict=True))],
    "clock, decimal commas": [
        "time;v;y", *comma([f"{t[11:]};{r}" for t, r in zip(isoformat(), table(";", columns=2), strict=True)])
    ],
    "day first": [
        "time;v;y", *(f"05.03.2024 {t[11:]};{r}" for t, r in zip(isoformat(10), table(";", columns=2), strict=True))
    ],
    "afternoon": [
        "time,v,y",
        *(f"3/5/2024 11{t[13:]} PM,{r}" for t, r in zip(isoformat(10), table(columns=2), strict=True)),
    ],
    "pymeasure": [
        "#Procedure: <__main__.Sweep>", "#Parameters:", "#\tDelay: 0.1 s", "#\tSteps: 60", "#Data:",
        "Time (s),Voltage (V),Displacement (um)", *table(),
    ],
}  # fmt: skip


@pytest.mark.parametrize("style", STYLES)
def test_styles_of_text(tmp_path: Path, style: str) -> None:
    check(read_record(put(tmp_path / "a.txt", *STYLES[style])))


@pytest.mark.parametrize(
    ("encoding", "said"),
    [("utf-8", ""), ("utf-8-sig", ""), ("utf-16", "UTF-16"), ("utf-16-le", "UTF-16"), ("utf-16-be", "UTF-16"),
     ("latin-1", "")],
)  # fmt: skip
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_encodings_and_line_ends(tmp_path: Path, encoding: str, said: str, end: str) -> None:
    lines = ["Zeit [s];Spannung [V];Weg [µm]", *comma(table(";"))]
    record = read_record(put(tmp_path / "a.csv", *lines, encoding=encoding, end=end))
    check(record)
    assert record.units == {"t": "s", "v": "V", "y": "µm"}
    assert record.read_as.startswith(said)
    assert any("Latin-1" in note for note in record.notes) == (encoding == "latin-1")


def test_columns_by_their_numbers(tmp_path: Path) -> None:
    three, two = put(tmp_path / "3.dat", *table("\t")), put(tmp_path / "2.dat", *table("  ", columns=2))
    check(read_record(three, parse_columns("1,2,3")))
    check(read_record(three, parse_columns("t=1,v=2,y=3")))
    check(read_record(two, parse_columns("1,2"), sample_time=0.0005))
    assert np.array_equal(read_record(three, parse_columns("1,3,2")).v, Y)
    # A name takes precedence over a number; a number with # is never a name
    named = put(tmp_path / "n.csv", "t,2,3", *table())
    check(read_record(named, {"v": "2", "y": "3"}))
    check(read_record(named, parse_columns("1,2,3")))
    for path, option in ((three, "--columns 1,2,3 (time, drive, measured)"), (two, "--columns 1,2 --sample-time")):
        (problem,) = problems(path)
        assert option in problem
    assert "there is no column" in problems(three, columns=parse_columns("1,2,4"))[0]


@pytest.mark.parametrize("text", ["1", "1,2,3,4", "1,1", "0,1,2"])
def test_numbers_that_name_no_columns(text: str) -> None:
    with pytest.raises(ValueError, match="number"):
        parse_columns(text)


@pytest.mark.parametrize(
    "line",
    ["# sample rate: 2000 Hz", "Sampling frequency [kHz],2", "fs = 2 kHz", "Sample Interval;0.5;ms",
     "dt_ms: 0.5", "SampleRate\t2000", "# gain = 3, fs = 2e3, range = 10", "Sample time (us): 500", "Abtastrate: 2 kHz",
     "T_s = 0.0005", "# Sample Rate: 2 kS/s", '"Sample rate","2000","Hz"'],
)  # fmt: skip
def test_sample_rates_above_the_numbers(tmp_path: Path, line: str) -> None:
    record = read_record(put(tmp_path / "a.csv", line, "v,y", *table(columns=2)))
    check(record)
    assert record.sample_time == pytest.approx(0.0005)
    assert "(line 1" in record.read_as
    # A time column, and the user's option, take precedence
    own = put(tmp_path / "b.csv", line.replace("2", "7").replace("5", "7"), "t,v,y", *table())
    check(read_record(own))
    assert read_record(tmp_path / "a.csv", sample_time=0.25).sample_time == 0.25


def test_sample_rates_that_say_nothing_or_two_things(tmp_path: Path) -> None:
    for line in (
        "Sample rate: 20 rpm", "Sample rate,20,rpm", "offset = 2000 Hz", "offs = 2000", "Sample rate: 0 Hz",
        "Sample rate: 2,000 Hz",
    ):  # fmt: skip
        (problem,) = problems(put(tmp_path / "a.csv", line, "v,y", *table(columns=2)))
        assert "give --sample-time" in problem
    (problem,) = problems(put(tmp_path / "b.csv", "fs: 2000 Hz", "dt: 1 ms", "v,y", *table(columns=2)))
    assert "sample rate 2000 Hz (line 1) and sample time 1 ms (line 2); give --sample-time" in problem


def test_decimal_commas_that_may_be_thousands_marks(tmp_path: Path) -> None:
    rows = [f"{k};{1 + k % 9},{100 + k};{2 + k % 7},000" for k in range(N)]
    (problem,) = problems(put(tmp_path / "a.csv", "t;v;y", *rows))
    assert problem == (
        ':2:3: error: "1,100" may be 1.100 or 1100; export numbers without thousands marks and with decimal points'
    )
    # One number that can only be a decimal decides for all
    record = read_record(put(tmp_path / "b.csv", "t;v;y", *rows, "60;0,5;1,000"))
    assert record.v[:2].tolist() == [1.1, 2.101]
    # With a point after it, the comma is not a decimal comma, and the file is refused
    rows = [f'{k},"{1 + k % 9},{100 + k}.5",{k % 7}' for k in range(N)]
    (problem,) = problems(put(tmp_path / "c.csv", "t,v,y", *rows))
    assert ':2:3: error: "1,100.5" in column "v" is not a number; export numbers without thousands marks' in problem
    assert problem.endswith("(and 59 more, the last in line 61)")


def test_a_point_among_decimal_commas_is_not_read_as_one(tmp_path: Path) -> None:
    rows = comma(table(";"))
    rows[20] = rows[20].replace(rows[20].split(";")[1], "1.234")
    (problem,) = problems(put(tmp_path / "a.csv", "t;v;y", *rows))
    assert problem.startswith(f":22:{rows[20].index('1.234') + 1}: error: \"1.234\"")
    rows[20] = rows[20].replace("1.234", "1.234,5")
    assert "export numbers without thousands marks" in problems(put(tmp_path / "a.csv", "t;v;y", *rows))[0]


def test_one_cause_one_message(tmp_path: Path) -> None:
    rows = [row.split(",") for row in table()]
    for k in range(10, 40):
        rows[k][1] = "OVER"
    rows[50][2] = "n.a"
    for k in range(10):
        rows[k][2] = f"0x{16 * k + 1:02x}"
    rows[51] = rows[51][:2]
    rows[55] = rows[55][:2]
    found = problems(put(tmp_path / "a.csv", "t,v,y", *(",".join(row) for row in rows)))
    column = len(",".join(rows[50][:2])) + 2
    assert found.pop(0).split('"')[1] == "0x01"
    assert len(found) <= 4
    found = [problem for problem in found if "0x" not in problem]
    assert [problem.split(": error: ")[0] for problem in found] == [":12:9", f":52:{column}", ":53:1"]
    assert found[0].endswith("if there is no value (and 29 more, the last in line 41)")
    assert found[2].endswith("complete or remove the line (and 1 more, the last in line 57)")


@pytest.mark.parametrize(
    ("header", "named"),
    [("Time,Drive,Position", "tvy"), ("Zeit,Ansteuerung,Weg", "tvy"), ("t,U,s [um]", "tv"), ("time,ch1,ch2", "t"),
     ("time,Voltage,Sensor Voltage", "tvy"), ("time,Output Voltage,pos", "ty"), ("time,Voltage 1,Voltage 2", "t"),
     ("time,Target Position,Position", "ty"), ("time,drive,position error", "tv"), ("T,v,y", "vy"),
     ("time [V],v,y", "vy"), ("time,Control Voltage of OutputChan1,Current Position of Axis1", "tvy"),
     ("Elapsed Time (ms),driveVoltage,sensor_um", "tvy"), ("x [ms],v,y", "tvy"), ("v [V],v [mV],y", "y")],
)  # fmt: skip
def test_what_names_mean(tmp_path: Path, header: str, named: str) -> None:
    """Columns are found by the meaning of their names only if a single column may be meant."""
    path = put(tmp_path / "a.csv", header, *table())
    if named == "tvy":
        record = read_record(path)
        assert np.array_equal(record.v, V)
        assert record.y is not None
        assert np.array_equal(record.y, Y)
    else:
        text = " ".join(problems(path))
        for ours in "tvy":
            assert (f'"{ours}"' in text) == (ours not in named), text


def test_names_of_ours_come_before_meanings(tmp_path: Path) -> None:
    rows = table(columns=4)
    record = read_record(put(tmp_path / "a.csv", "t,drive,position,v", *rows))
    assert record.v.tolist() == list(range(N))
    assert list(record.extra) == ["drive"]
    check(read_record(tmp_path / "a.csv", {"v": "drive"}))
    # y is not needed, so it is not looked for
    record = read_record(put(tmp_path / "b.csv", "t,v,position,k", *rows), need=("v",))
    assert record.y is None
    assert list(record.extra) == ["position", "k"]


def test_what_was_understood_is_said_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = put(tmp_path / "a.csv", *STYLES["units row of ms"])
    two = put(tmp_path / "b.csv", *STYLES["units row of ms"])
    plain = put(tmp_path / "c.csv", "t [s],v [V],y [um]", *table())
    read_records([one, plain, two], progress=True)
    assert capsys.readouterr().err == (
        "read as: a.csv, b.csv: semicolons between cells; units Time [ms], Drive [V], Displacement [nm]; t = Time, v = "
        "Drive, y = Displacement\n"
    )
    read_records([one])
    assert capsys.readouterr().err == ""
    assert read_record(plain).read_as == ""


def test_a_header_in_a_comment_below_a_line_that_looks_like_one(tmp_path: Path) -> None:
    check(read_record(put(tmp_path / "a.txt", "a,b,c", "# t,v,y", *table())))
    record = read_record(put(tmp_path / "b.txt", "t,v,y", "# paused, once, only", *table()))
    check(record)


def test_every_command_reads_alike(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    v = np.concatenate([np.linspace(0, 40, 60), np.linspace(40, -40, 120), np.linspace(-40, 40, 120)])
    y, state = [], 0.0
    for x in v.tolist():
        state = max(x - 5.0, min(x + 5.0, state))
        y.append(0.5 * x + state)
    rows = [f"{k * 0.01:.2f};{a:.6f};{b:.6f}".replace(".", ",") for k, (a, b) in enumerate(zip(v, y, strict=True))]
    put(Path("one.csv"), "Zeit [s];Spannung [V];Weg [µm]", *rows)
    Path("units").mkdir()
    put(Path("units/u1.csv"), "Zeit [s];Spannung [V];Weg [µm]", *rows)
    run: Callable[..., Any] = lambda *words: CliRunner().invoke(cli.main, words, catch_exceptions=False)  # noqa: E731
    said = "semicolons between cells and decimal commas; t = Zeit [s], v = Spannung [V]"
    found = run("identify", "one.csv", "-o", "m.yaml", "--thresholds", "2")
    assert found.exit_code == 0, found.stderr
    assert found.stderr.count("read as:") == 1
    assert f"read as: one.csv: {said}, y = Weg [µm]" in found.stderr
    found = run("simulate", "m.yaml", "one.csv", "-o", "out.csv")
    assert found.exit_code == 0, found.stderr
    assert f"read as: one.csv: {said}" in found.stderr
    found = run("identify", "--batch", "units", "-o", "params", "--thresholds", "2")
    assert found.exit_code == 0, found.stderr
    assert Path("params/u1.yaml").exists()


# Times ----------------------------------------------------------------------------------------------------------------


def test_times_of_day() -> None:
    clock = Clock()
    cells = ["2024-03-05T13:59:59.9999999", "2024-03-05 14:00:00,0000001+00:00", "2024-03-05T15:00:01+01:00"]
    assert [clock.seconds(cell) for cell in cells] == [0.0, 2e-7, 1.0000001]
    clock = Clock()
    assert [clock.seconds(cell) for cell in ("23:59:59", "0:00:00.5", "00:00:01")] == [0.0, 1.5, 2.0]
    clock = Clock()
    assert [clock.seconds(cell) for cell in ("11:59:59 am", "12:00:00 PM", "1:00:00 p.m.")] == [0.0, 1.0, 3601.0]
    clock = Clock()
    assert [clock.seconds(cell) for cell in ("05/03/2024 14:21:05:123", "05/03/2024 14:21:05:250")] == [0.0, 0.127]
    clock = Clock()
    for cell in ("25:00:00", "12:60:00", "2024-02-30T12:00:00", "13:00:00 PM", "12:00", "1.5"):
        with pytest.raises(ValueError, match=r"\S"):
            clock.seconds(cell)
    for cell in ("1.5", "12", "12:30", "2024-03-05", "a 12:00:00", ""):
        assert not is_time(cell)


def test_dates_that_may_be_read_in_two_ways(tmp_path: Path) -> None:
    rows = table(columns=2)
    lines = [f"0{4 + k // 30}/03/2024 {(23 + k // 30) % 24:02}:00:{k:02},{row}" for k, row in enumerate(rows)]
    (problem,) = problems(put(tmp_path / "a.csv", "time,v,y", *lines))
    assert "may begin with the day or with the month" in problem
    # With points, the day comes first everywhere
    lines = [line.replace("/", ".") for line in lines]
    record = read_record(put(tmp_path / "b.csv", "time,v,y", *lines))
    assert record.t[30] == 3630.0


def test_a_broken_time_of_day_has_a_place(tmp_path: Path) -> None:
    lines = list(STYLES["ISO"])
    lines[30] = "soon," + lines[30].split(",", 1)[1]
    (problem,) = problems(put(tmp_path / "a.csv", *lines))
    assert problem == ':31:1: error: "soon" in column "time" is not a time of day; write every time like the first one'
    lines[30] = "," + lines[30].split(",", 1)[1]
    assert len(read_record(put(tmp_path / "a.csv", *lines))) == N - 1


def test_times_since_1970(tmp_path: Path) -> None:
    """Numbers this large cannot be seconds, so milliseconds, microseconds and nanoseconds need a written unit."""
    rows = table(columns=2)

    def stamps(name: str, factor: int) -> Path:
        times = [f"{1709640000 * factor + factor // 1000 * k}" for k in range(N)]
        return put(tmp_path / "a.csv", f"{name},v,y", *(f"{t},{r}" for t, r in zip(times, rows, strict=True)))

    for factor in (10**3, 10**6, 10**9):
        for name in ("timestamp", "t"):
            text = f'the numbers of "{name}" are too large to be seconds, and it has no unit; give one, --columns '
            assert text in problems(stamps(name, factor))[0]
    assert read_record(stamps("timestamp [ms]", 10**3)).sample_time == pytest.approx(0.001, rel=1e-3)


def test_times_with_too_few_digits(tmp_path: Path) -> None:
    path = put(tmp_path / "a.csv", "t,v,y", *(f"{t:.2f},{v},{y}" for t, v, y in zip(T, V, Y, strict=True)))
    (problem,) = problems(path)
    assert problem.startswith(":3:1: error: the time repeats in 56 of 60 samples, because it was written in steps of ")
    assert "steps of 0.01 s; " in problem
    assert "give --sample-time (here about 0.0005" in problem
    record = read_record(path, sample_time=0.0005)
    check(record)
    assert record.notes == ("t is written in steps of 0.01 s; the given sample time 0.0005 s was used",)
    (problem,) = problems(path, sample_time=0.001)
    assert "does not fit the time of the file" in problem


# Cells ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "unit"),
    [("s", "s"), ("[um]", "um"), ("(µm)", "µm"), ("Volt", "Volt"), ("second", "second"), ("", ""), ("-", ""),
     ("[arb. units]", "arb. units"), ("Drive", None), ("1.5", None), ("[1]", None), ("(raw)", None), ("V/um", "V/um")],
)  # fmt: skip
def test_units_alone(text: str, unit: str | None) -> None:
    assert unit_alone(text) == unit


def test_cells_of_a_line() -> None:
    assert Dialect(" ").cells("  1.5   2 3 ") == [(2, "1.5"), (8, "2"), (10, "3")]
    assert Dialect(";").cells('1;"a;b";"c""d"') == [(0, "1"), (2, "a;b"), (8, 'c"d')]
    assert Dialect(";", ",").number("-1,5e3") == -1500.0
    for cell in ("1,5", "1_0", "1.2.3"):
        with pytest.raises(ValueError, match=r"\S"):
            Dialect().number(cell)
    for cell in ("1.5", "1,2,3"):
        with pytest.raises(ValueError, match=r"\S"):
            Dialect(";", ",").number(cell)


# Any style ------------------------------------------------------------------------------------------------------------


def styled(seed: int) -> tuple[str, np.ndarray[Any, Any]]:
    """A table in a style drawn at random, with the numbers t, v, y that its digits mean."""
    rng = random.Random(seed)
    size = rng.choice([16, 40, 200])
    scale = rng.choice([1e-3, 1.0, 10.0, 100.0, 1000.0, 5000.0, 1e5])
    digits = rng.choice([".0f", ".1f", ".3f", ".6f", "g", ".4e"])
    delimiter = rng.choice([",", ";", "\t", "|", " ", "   "])
    quoted = rng.random() < 0.2
    decimal = rng.choice(".,") if delimiter != "," or quoted else "."
    whole = rng.random() < 0.2
    cells = [
        [str(k) if whole else f"{0.01 * k:.4f}", format(scale * np.sin(0.3 * k + 1), digits),
         format(scale * np.cos(0.3 * k), digits)]
        for k in range(size)
    ]  # fmt: skip
    order = rng.sample(range(3), 3)
    units = [("s", "V", "um")[k] for k in order]
    names = rng.choice([("t", "v", "y"), ("Time", "Drive", "Position"), ("Zeit", "Spannung", "Weg")])
    header = [names[k] for k in order]
    remarks = ["ok", "off"] if rng.random() < 0.3 else []
    rows = [[row[k].replace(".", decimal) for k in order] + remarks[:1] for row in cells]
    if quoted:
        rows = [[f'"{cell}"' for cell in row] for row in rows]
    above = [
        "Logger 7", "Serial,17", "Gain;2.5", "a,b,c", "Range,10,V", "# note", "Date: 2024-03-05 14:00:00", "1,5", "",
    ]  # fmt: skip
    lines = [rng.choice(above) for _ in range(rng.choice([0, 1, 3]))]
    style = rng.choice(["plain", "units", "brackets", "comment", "none"])
    if style == "brackets" and delimiter.strip():
        header = [f"{name} [{unit}]" for name, unit in zip(header, units, strict=True)]
    if style != "none":
        lines.append(("# " if style == "comment" else "") + delimiter.join(header + ["state"] * bool(remarks)))
    if style == "units":
        lines.append(delimiter.join(units + ["-"] * bool(remarks)))
    lines += [delimiter.join(row) for row in rows]
    return "\n".join(lines) + "\n", np.array([[float(cell) for cell in row] for row in cells])


def test_tables_in_any_style_are_read_right_or_refused(tmp_path: Path) -> None:
    """A wrong reading is worse than a refusal; of the tables with a header, hardly any is refused."""
    read = refused = 0
    for seed in range(200):
        text, numbers = styled(seed)
        (tmp_path / "a.csv").write_text(text)
        try:
            record = read_record(tmp_path / "a.csv", need=("v", "y", "t"))
        except RecordError as error:
            refused += not any(
                reason in str(error) for reason in ("has numbers, not names", "above the numbers has", "throughout")
            )
        else:
            read += 1
            assert record.y is not None
            assert np.array_equal(np.transpose([record.t, record.v, record.y]), numbers), text[:300]
    assert read > 140
    assert refused < 10
