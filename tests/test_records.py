"""Data files: what is read, what is repaired with a count, what is refused and where."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import numpy as np
import pytest

from hystgen.records import Record, RecordError, parse_columns, read_record, write_columns

N = 40


def rows(n: int = N) -> list[list[str]]:
    return [[repr(k * 0.001), repr(0.25 * k), repr(0.125 * k * k)] for k in range(n)]


def write(path: Path, cells: list[list[str]], header: str = "t,v,y", end: str = "\n", join: str = ",") -> Path:
    path.write_bytes(end.join([header, *(join.join(row) for row in cells)]).encode() + end.encode())
    return path


def problems(path: Path, **options: object) -> list[str]:
    with pytest.raises(RecordError) as caught:
        read_record(path, **options)  # type: ignore[arg-type]
    assert str(caught.value) == "\n".join(caught.value.problems)
    for problem in caught.value.problems:
        assert "\n" not in problem
        assert problem.startswith(str(path))
        assert ": error: " in problem
    return [problem.removeprefix(str(path)) for problem in caught.value.problems]


class TestRead:
    def test_a_good_file(self, tmp_path: Path) -> None:
        record = read_record(write(tmp_path / "a.csv", rows()))
        assert record.name == "a.csv"
        assert np.array_equal(record.t, np.arange(N) * 0.001)
        assert np.array_equal(record.v, 0.25 * np.arange(N))
        assert record.y is not None
        assert np.array_equal(record.y, 0.125 * np.arange(N) ** 2)
        assert record.sample_time == pytest.approx(0.001)
        assert record.notes == ()
        assert len(record) == N
        assert list(record.columns()) == ["t", "v", "y"]

    @pytest.mark.parametrize("mark", ["\ufeff", ""])
    @pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
    def test_byte_order_mark_and_line_ends(self, tmp_path: Path, mark: str, end: str) -> None:
        record = read_record(write(tmp_path / "a.csv", rows(), mark + "t,v,y", end))
        assert np.array_equal(record.v, 0.25 * np.arange(N))

    def test_scientific_notation_quotes_blank_lines_and_comments(self, tmp_path: Path) -> None:
        text = '# logger 7\n\n"t" , "v","y"\n' + "".join(
            f'{k}e-3, "{k}.5E+0",-1.25e{k % 3}\n\n# {k}\n' for k in range(N)
        )
        (tmp_path / "a.csv").write_text(text)
        record = read_record(tmp_path / "a.csv")
        assert record.t[3] == 3e-3
        assert record.v[3] == 3.5
        assert record.y is not None
        assert record.y[4] == -12.5

    def test_the_fast_and_the_careful_way_agree_to_the_bit(self, tmp_path: Path) -> None:
        values = np.random.default_rng(1).normal(0, 1e3, (200, 2)) ** 3
        cells = [[repr(k * 1e-4), *(repr(x) for x in row.tolist())] for k, row in enumerate(values)]
        fast = read_record(write(tmp_path / "fast.csv", cells))
        slow = read_record(write(tmp_path / "slow.csv", [*cells, ["# not for numpy"]]))
        for name, column in fast.columns().items():
            assert np.array_equal(column, slow.columns()[name])
        assert np.array_equal(fast.v, values[:, 0])

    def test_mapped_columns_delimiter_and_extra(self, tmp_path: Path) -> None:
        cells = [[*row, "21.5", "ok"] for row in rows()]
        path = write(tmp_path / "a.csv", cells, "Time [s];U;Pos;temperature;state", join=";")
        record = read_record(path, parse_columns("t=Time [s],v=U,y=Pos"), delimiter=";")
        assert record.v[2] == 0.5
        assert list(record.extra) == ["temperature"]
        assert record.extra["temperature"][0] == 21.5
        assert record.notes == ("columns without numbers were left out: state",)

    def test_swapped_names(self, tmp_path: Path) -> None:
        record = read_record(write(tmp_path / "a.csv", rows()), {"y": "v", "v": "y"})
        assert record.v[4] == 2.0  # the file's y
        assert record.y is not None
        assert record.y[4] == 1.0

    def test_a_column_with_a_taken_name_gives_way(self, tmp_path: Path) -> None:
        path = write(tmp_path / "a.csv", [[*row, str(k)] for k, row in enumerate(rows())], "t,v,y,U")
        record = read_record(path, {"v": "U"})
        assert record.v[4] == 4.0
        assert "v" not in record.extra

    def test_no_time(self, tmp_path: Path) -> None:
        path = write(tmp_path / "a.csv", [row[1:] for row in rows()], "v,y")
        record = read_record(path, sample_time=0.02)
        assert record.sample_time == 0.02
        assert np.array_equal(record.t, np.arange(N) * 0.02)
        (problem,) = problems(path)
        assert problem == ':1:1: error: there is no column "t" among v, y; give --sample-time'

    def test_own_time_wins_over_a_given_sample_time(self, tmp_path: Path) -> None:
        record = read_record(write(tmp_path / "a.csv", rows()), sample_time=0.5)
        assert record.sample_time == pytest.approx(0.001)
        assert "the given sample time 0.5 s was not used" in record.notes[0]

    def test_references_for_the_inverse(self, tmp_path: Path) -> None:
        path = write(tmp_path / "a.csv", [["0", "1"], ["1", "1"], ["2", "nan"]], "t,u")
        with pytest.raises(RecordError):
            read_record(path, need=("u",))
        path = write(tmp_path / "b.csv", [["0", "1", ""], ["1", "1", "3"], ["2", "1", "4"]], "t,u,y")
        record = read_record(path, need=("u",))
        assert len(record.v) == 0
        assert np.array_equal(record.extra["u"], [1.0, 1.0, 1.0])
        assert record.y is not None
        assert np.isnan(record.y[0])  # y is not needed, so no sample is dropped for it

    def test_npz_and_mat(self, tmp_path: Path) -> None:
        from scipy.io import savemat

        t, v, y = (np.array([float(row[k]) for row in rows()]) for k in range(3))
        y[5] = np.nan
        np.savez(tmp_path / "a.npz", t=t, v=v, y=y, temperature=v, comment=np.array("x"), other=np.arange(3))
        savemat(tmp_path / "a.mat", {"t": t, "v": v.reshape(-1, 1), "y": y, "temperature": v, "comment": "x"})
        for name in ("a.npz", "a.mat"):
            record = read_record(tmp_path / name)
            assert np.array_equal(record.v, np.delete(v, 5))
            assert list(record.extra) == ["temperature"]
            assert "1 sample without a value in y dropped, the first at index 5" in record.notes
            assert any("comment" in note for note in record.notes)

    def test_section(self, tmp_path: Path) -> None:
        record = read_record(write(tmp_path / "a.csv", [[*row, "3"] for row in rows()], "t,v,y,temperature"))
        part = record.section(10, -5, name="part")
        assert isinstance(part, Record)
        assert part.name == "part"
        assert all(len(column) == N - 15 for column in part.columns().values())
        assert part.t[0] == record.t[10]

    def test_latin_1_is_read_with_a_note(self, tmp_path: Path) -> None:
        path = tmp_path / "a.csv"
        path.write_bytes(b"t,v,y,T \xb0C\n" + "".join(",".join([*row, "1"]) + "\n" for row in rows()).encode())
        record = read_record(path)
        assert list(record.extra) == ["T \xb0C"]
        assert "Latin-1" in record.notes[0]


class TestRepair:
    def test_missing_values_are_dropped_and_counted(self, tmp_path: Path) -> None:
        cells = rows(100)
        cells[7][1] = ""
        cells[8][2] = "NaN"
        cells[50][2] = "inf"
        record = read_record(write(tmp_path / "a.csv", cells))
        assert len(record) == 97
        assert np.isfinite(record.v).all()
        assert record.notes[0] == "3 samples without a value in v or y dropped, the first in line 9"
        assert "1 gap" not in record.notes[0]

    def test_time_that_does_not_rise_is_dropped_and_counted(self, tmp_path: Path) -> None:
        cells = rows(100)
        cells[20][0] = cells[19][0]
        cells[60][0] = cells[40][0]
        record = read_record(write(tmp_path / "a.csv", cells))
        assert len(record) == 98
        assert (np.diff(record.t) > 0).all()
        assert record.notes == ("2 samples not later than the sample before dropped, the first in line 22",)

    def test_gaps_are_kept_and_counted(self, tmp_path: Path) -> None:
        cells = rows(100)
        for k in range(30, 100):
            cells[k][0] = repr(k * 0.001 + 0.05)
        for k in range(80, 100):
            cells[k][0] = repr(k * 0.001 + 0.06)
        record = read_record(write(tmp_path / "a.csv", cells))
        assert len(record) == 100
        assert record.sample_time == pytest.approx(0.001)
        assert record.notes == ("2 gaps longer than 3 median steps kept, the largest 0.051 s at t = 0.029 s",)

    def test_more_than_a_twentieth_is_refused(self, tmp_path: Path) -> None:
        cells = rows(100)
        for k in range(10, 15):
            cells[k][2] = "nan"
        assert len(read_record(write(tmp_path / "a.csv", cells))) == 95
        cells[15][2] = "nan"
        (problem,) = problems(write(tmp_path / "b.csv", cells))
        assert problem == (
            ":12:1: error: 6 of 100 samples are without a value in y, the first in line 12; more than 5 % is too much "
            "to repair; export every column at one sample rate, with a number in each row"
        )
        values = {name: column.copy() for name, column in zip("tvy", np.array(cells, dtype=float).T, strict=True)}
        np.savez(tmp_path / "b.npz", **values)
        (problem,) = problems(tmp_path / "b.npz")
        assert problem.startswith(": error: 6 of 100 samples are without a value in y, the first at index 10;")

    def test_time_that_goes_back_for_good_is_refused(self, tmp_path: Path) -> None:
        cells = rows(100)
        cells[10][0] = "1e6"
        (problem,) = problems(write(tmp_path / "a.csv", cells))
        assert problem == (
            ":13:1: error: 89 of 100 samples are not later than the sample before, the first in line 13; more than 5 % "
            "is too much to repair; correct the time there, or, if it starts again, give each run a file of its own"
        )

    def test_lines_count_comments_and_blank_lines(self, tmp_path: Path) -> None:
        cells = rows(100)
        cells[20][0] = cells[19][0]
        lines = ["# logger", "", "t,v,y", *(",".join(row) for row in cells)]
        lines[10:10] = ["", "# paused", ""]
        (tmp_path / "a.csv").write_text("\n".join(lines))
        place = lines.index(",".join(cells[20])) + 1
        assert place == 20 + 4 + 3
        assert read_record(tmp_path / "a.csv").notes == (
            f"1 sample not later than the sample before dropped, the first in line {place}",
        )


class TestRefuse:
    def test_no_such_file(self, tmp_path: Path) -> None:
        assert problems(tmp_path / "no.csv") == [
            ": error: cannot be read (No such file or directory); give the path of a data file"
        ]
        assert "cannot be read" in problems(tmp_path)[0]

    def test_empty(self, tmp_path: Path) -> None:
        (tmp_path / "a.csv").write_text("\n \n")
        assert problems(tmp_path / "a.csv") == [": error: is empty; record again, or give another file"]
        (tmp_path / "b.csv").write_text("# only a comment\n")
        assert "has no header row" in problems(tmp_path / "b.csv")[0]
        (tmp_path / "c.csv").write_text("t,v,y\n")
        assert "has 0 samples, but at least 16 are needed" in problems(tmp_path / "c.csv")[0]

    def test_numbers_for_a_header(self, tmp_path: Path) -> None:
        (problem,) = problems(write(tmp_path / "a.csv", rows(), "0,1,2"))
        assert problem == (
            ":1:1: error: the first line has numbers, not names; say which columns they are with --columns 1,2,3 "
            "(time, drive, measured), or put a header such as t,v,y above them"
        )

    def test_missing_columns_all_at_once_with_what_may_be_meant(self, tmp_path: Path) -> None:
        path = write(tmp_path / "a.csv", rows(), "Time [s],Voltage (V),Chan3")
        assert problems(path) == [
            ':1:1: error: there is no column "y" among Time [s], Voltage (V), Chan3; name it with --columns '
            '"y=COLUMN", for example --columns "y=Chan3"'
        ]
        assert len(read_record(path, {"y": "Chan3"})) == N
        other = write(tmp_path / "b.csv", rows(), "step,Drive voltage error (V),Chan3")
        assert problems(other) == [
            ':1:1: error: there is no column "v" among step, Drive voltage error (V), Chan3; did you mean --columns '
            '"v=Drive voltage error (V)"?',
            ':1:1: error: there is no column "t" among step, Drive voltage error (V), Chan3; give --sample-time',
            ':1:1: error: there is no column "y" among step, Drive voltage error (V), Chan3; name it with --columns '
            '"y=COLUMN"',
        ]
        (problem,) = problems(path, columns={"t": "Time [s]", "v": "voltage (V)", "y": "Chan3"})
        assert 'there is no column "voltage (V)"' in problem
        assert 'did you mean --columns "v=Voltage (V)"?' in problem

    @pytest.mark.parametrize(("join", "option"), [(";", '";"'), ("\t", "tab"), ("|", '"|"')])
    def test_another_delimiter(self, tmp_path: Path, join: str, option: str) -> None:
        path = write(tmp_path / "a.csv", rows(), join.join("tvy"), join=join)
        for delimiter in (None, option.strip('"')):
            record = read_record(path, delimiter=delimiter)
            assert np.array_equal(record.v, 0.25 * np.arange(N))
        assert "between cells" in read_record(path).read_as

    def test_unusable_delimiter_and_sample_time(self, tmp_path: Path) -> None:
        reported = problems(write(tmp_path / "a.csv", rows()), delimiter=";;", sample_time=-1.0)
        assert len(reported) == 2
        assert 'the delimiter ";;" is not usable' in reported[0]
        assert "the sample time -1 is not positive" in reported[1]

    def test_cells_that_are_no_numbers_each_with_its_place(self, tmp_path: Path) -> None:
        cells = rows()
        cells[4][1] = "abc"
        cells[9][2] = " 1_000"
        cells[11] = ["1"]
        path = write(tmp_path / "a.csv", cells)
        column = len(cells[4][0]) + 2
        reported = problems(path)
        assert reported[0] == (
            f':6:{column}: error: "abc" in column "v" is not a number; write a number, or leave the cell '
            "empty if there is no value"
        )
        assert reported[1].startswith(f":11:{len(','.join(cells[9][:2])) + 2}: error: ")
        assert reported[2] == ":13:1: error: 1 column where the header has 3; complete or remove the line"
        assert len(reported) == 3

    def test_decimal_commas(self, tmp_path: Path) -> None:
        cells = [[cell.replace(".", ",") for cell in row] for row in rows()]
        for delimiter in (None, ";"):
            record = read_record(write(tmp_path / "a.csv", cells, "t;v;y", join=";"), delimiter=delimiter)
            assert np.array_equal(record.v, 0.25 * np.arange(N))
            assert "decimal commas" in record.read_as

    def test_control_characters_do_not_reach_the_terminal(self, tmp_path: Path) -> None:
        cells = rows()
        cells[0][1] = "\x1b[31mred" + "x" * 100
        (problem,) = problems(write(tmp_path / "a.csv", cells))
        assert "\x1b" not in problem
        assert "x" * 61 not in problem

    def test_a_column_twice(self, tmp_path: Path) -> None:
        (problem,) = problems(write(tmp_path / "a.csv", [[*row, "1"] for row in rows()], "t,v,y,v"))
        assert problem == ':1:1: error: 2 columns are called "v"; give them different names'

    def test_too_short_and_constant(self, tmp_path: Path) -> None:
        (problem,) = problems(write(tmp_path / "a.csv", rows(15)))
        assert problem == ": error: has 15 samples, but at least 16 are needed; record for longer"
        assert len(read_record(write(tmp_path / "b.csv", rows(16)))) == 16
        still = [[row[0], "5", row[2]] for row in rows()]
        (problem,) = problems(write(tmp_path / "c.csv", still))
        assert "the drive v is 5 throughout" in problem
        assert len(read_record(write(tmp_path / "c.csv", still[:2]), need=("v",))) == 2

    def test_damaged_archives(self, tmp_path: Path) -> None:
        (tmp_path / "b.mat").write_bytes(b"\x00\x01garbage" * 30)
        assert "is not a MATLAB v5 .mat file" in problems(tmp_path / "b.mat")[0]
        (tmp_path / "c.npz").write_bytes(b"PK garbage")
        assert "is not a NumPy .npz archive" in problems(tmp_path / "c.npz")[0]
        np.savez(tmp_path / "d.npz", t=np.arange(20.0), v=np.arange(20.0), y=np.arange(19.0))
        assert problems(tmp_path / "d.npz") == [
            ": error: the columns differ in length: v has 20, y has 19, t has 20 samples; export them with one length"
        ]
        np.savez(tmp_path / "e.npz", t=np.arange(20.0), v=np.array([{}] * 20))
        assert problems(tmp_path / "e.npz")[0] == (
            ': error: "v" is not a column of numbers; export a vector of numbers, or name another column with '
            '--columns "v=COLUMN"'
        )
        (tmp_path / "f.npz").write_bytes((tmp_path / "e.npz").read_bytes()[:99])
        assert "is not a NumPy .npz archive" in problems(tmp_path / "f.npz")[0]

    def test_binary_and_utf_16(self, tmp_path: Path) -> None:
        (tmp_path / "a.csv").write_bytes(b"t,v\0,y\n")
        assert "is not a text file" in problems(tmp_path / "a.csv")[0]
        (tmp_path / "b.csv").write_bytes("t,v,y\n".encode("utf-16"))
        assert "has 0 samples" in problems(tmp_path / "b.csv")[0]
        (tmp_path / "c.csv").write_bytes("t,v,y\n".encode("utf-16") + b"1")
        assert problems(tmp_path / "c.csv") == [": error: is damaged UTF-16 text; export it again, as UTF-8"]


class TestParseColumns:
    def test_good(self) -> None:
        assert parse_columns("t=Time, v=U,y=Pos [um]") == {"t": "Time", "v": "U", "y": "Pos [um]"}
        assert parse_columns("v=a=b") == {"v": "a=b"}

    @pytest.mark.parametrize("text", ["", "t", "t=", "=U", "t=A,t=B", "t=A,v=A", "1x=A", "t=A,,v=B"])
    def test_bad(self, text: str) -> None:
        with pytest.raises(ValueError, match=r"\S"):
            parse_columns(text)


class TestWriteColumns:
    def test_what_is_written_reads_back_to_the_bit(self, tmp_path: Path) -> None:
        rng = np.random.default_rng(3)
        v = rng.normal(0, 1, 100) * 10.0 ** rng.integers(-300, 20, 100)
        write_columns(tmp_path / "a.csv", ("t", "v", "y"), (np.arange(100) * 0.1, v, v[::-1]))
        record = read_record(tmp_path / "a.csv")
        assert np.array_equal(record.v, v)
        assert (tmp_path / "a.csv").read_text().splitlines()[:2] == ["t,v,y", f"0.0,{float(v[0])!r},{float(v[-1])!r}"]

    def test_other_types_and_names(self, tmp_path: Path) -> None:
        write_columns(
            tmp_path / "a.csv",
            ("a,b", "n"),
            (np.array([0.1, 1e-30], dtype=np.float32), np.array([1, -2], dtype=np.int16)),
        )
        assert (tmp_path / "a.csv").read_text() == '"a,b",n\n0.1,1\n1e-30,-2\n'

    def test_all_or_nothing(self, tmp_path: Path) -> None:
        target = tmp_path / "a.csv"
        target.write_text("old")
        with pytest.raises(ValueError, match="equal length"):
            write_columns(target, ("a", "b"), (np.zeros(2), np.zeros(3)))
        (tmp_path / "folder").mkdir()
        with pytest.raises(OSError, match=r"\S"):
            write_columns(tmp_path / "folder", ("a",), (np.zeros(2),))
        lost = tmp_path / "none" / "a.csv"
        with pytest.raises(OSError, match=r"\S") as caught:
            write_columns(lost, ("a",), (np.zeros(2),))
        what = f"the folder {lost.parent} does not exist; create it, or choose another output"
        assert str(caught.value) == f"[Errno 2] {what}: '{lost}'"
        assert target.read_text() == "old"
        assert sorted(p.name for p in tmp_path.iterdir()) == ["a.csv", "folder"]

    def test_a_link_stays_a_link(self, tmp_path: Path) -> None:
        (tmp_path / "real.csv").write_text("old")
        (tmp_path / "link.csv").symlink_to("real.csv")
        write_columns(tmp_path / "link.csv", ("a",), (np.zeros(1),))
        assert (tmp_path / "link.csv").is_symlink()
        assert (tmp_path / "real.csv").read_text() == "a\n0.0\n"

    def test_a_pipe_is_written_to_and_not_replaced(self, tmp_path: Path) -> None:
        pipe = tmp_path / "pipe"
        os.mkfifo(pipe)
        reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
        try:
            write_columns(pipe, ("a",), (np.zeros(1),))
            assert os.read(reader, 100) == b"a\n0.0\n"
        finally:
            os.close(reader)
        assert pipe.is_fifo()

    def test_usual_rights(self, tmp_path: Path) -> None:
        (tmp_path / "plain").write_text("")
        write_columns(tmp_path / "a.csv", ("a",), (np.zeros(2),))
        assert stat.S_IMODE((tmp_path / "a.csv").stat().st_mode) == stat.S_IMODE((tmp_path / "plain").stat().st_mode)
