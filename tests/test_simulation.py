"""A trajectory from the command line: its column, what is said of its speed, and its picture."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

Run = Callable[..., tuple[int, str, str]]

STEP = 5.0e-5  # s
PLAIN = """hystgen: 1
name: plain
units: {input: V, output: um}
sample_time: 5.0e-5
input_range: [0, 100]
model:
  pi: {thresholds: [0], weights: [0.1]}
"""
LIMITED = PLAIN + "  effects: [{name: slew_limit, rate: 333, falling_rate: 200}]\n"


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("plain.yaml").write_text(PLAIN)
    Path("limited.yaml").write_text(LIMITED)


def trajectory(up: float, down: float, samples: int = 1000, header: str = "t,u [um]", scale: float = 1.0) -> str:
    """A file with one triangle from 3 um up and down again, at these rates in um/s."""
    rates = np.r_[np.full(samples, up), np.full(samples, -down)]
    u = 3.0 + np.r_[0.0, np.cumsum(rates * STEP)]
    t = STEP * np.arange(len(u))
    np.savetxt("u.csv", np.column_stack([t, scale * u]), fmt="%.12g", delimiter=",", header=header, comments="")
    return "u.csv"


def drives(path: str = "out.csv") -> np.ndarray:
    return np.genfromtxt(path, delimiter=",", skip_header=1)[:, -1]


@pytest.mark.parametrize("header", ["Time [s],Position [nm]", "t,Weg (nm)", "index;Zeit / s;pos_nm"])
def test_a_position_alone_is_the_reference_in_its_own_unit(header: str, run: Run) -> None:
    path = trajectory(20.0, 20.0, header=header.replace(";", ","), scale=1000.0)
    if ";" in header:
        rows = Path(path).read_text().splitlines()
        lines = [header, *(f"{k};{row.replace(',', ';')}" for k, row in enumerate(rows[1:]))]
        Path(path).write_text("\n".join(lines) + "\n")
    code, out, err = run("simulate", "plain.yaml", path, "--operator", "inverse", "-o", "out.csv")
    assert (code, out) == (0, "out.csv\n"), err
    assert "nm] was converted to um: 1 nm is 0.001 um" in err
    values = np.genfromtxt(path, delimiter=";" if ";" in header else ",", skip_header=1)[:, -1]
    np.testing.assert_allclose(drives(), values / 1000.0 / 0.1, rtol=1e-12)


@pytest.mark.parametrize("header", ["t,Drive [V],Position [um]", "t,X [um],Position [um]", "t,status,Position [um]"])
def test_a_position_beside_other_columns_is_asked_for(header: str, run: Run) -> None:
    rows = "".join(f"{k},1,{3 + 0.1 * k}\n" for k in range(20))
    Path("u.csv").write_text(f"{header}\n{rows}")
    code, out, err = run("simulate", "plain.yaml", "u.csv", "--operator", "inverse")
    assert (code, out) == (2, "")
    assert "--columns" in err
    code, out, err = run("simulate", "plain.yaml", "u.csv", "--operator", "inverse", "--columns", "u=Position")
    assert code == 0, err
    assert len(out.splitlines()) == 21


def test_the_speed_of_the_reference_and_of_the_drive_are_told(run: Run) -> None:
    code, _, err = run("simulate", "plain.yaml", trajectory(25.0, 20.0), "--operator", "inverse", "-o", "out.csv")
    assert code == 0
    assert err == (
        "u.csv: 2001 samples at 20000 Hz, 0.1 s; reference 3 to 4.25 um, at most 25 um/s; drive 30 to 42.5 V, at most "
        "250 V/s"
    )


@pytest.mark.parametrize("arithmetic", [None, "float32"])
@pytest.mark.parametrize(("up", "down", "at_limit"), [(33.0, 19.8, 0), (40.0, 19.8, 1000), (33.0, 21.0, 1000)])
def test_moves_at_the_slew_limit_are_counted(
    up: float, down: float, at_limit: int, arithmetic: str | None, run: Run
) -> None:
    """The drive is ten times the reference; each limit is met on 1000 moves, and for the time needed to catch up."""
    how = ["--operator", "inverse", "-o", "out.csv", *(["--arithmetic", arithmetic] if arithmetic else [])]
    code, _, err = run("simulate", "limited.yaml", trajectory(up, down), *how)
    assert code == 0
    found = re.search(r"(\d+) of 2000 moves of the drive are at the .* limit, 333 up and 200 down V/s", err)
    if not at_limit:
        assert found is None, err
        return
    assert found, err
    moves = np.diff(drives())
    limited = np.abs(np.where(moves > 0, moves - 333 * STEP, moves + 200 * STEP)) < 1e-5
    assert int(found[1]) == np.count_nonzero(limited) > 0.8 * at_limit


def test_moves_beyond_the_rate_of_the_bounds_are_counted(run: Run) -> None:
    Path("limited.yaml").write_text(LIMITED + "emit: {compensation: {max_rate: 180}}\n")
    code, _, err = run("simulate", "limited.yaml", trajectory(15.0, 19.0), "--operator", "inverse", "-o", "out.csv")
    assert code == 0
    assert "warning: u.csv: 1000 of 2000 moves of the drive are faster than emit.compensation.max_rate, 180 V/s" in err
    assert "slew limit" not in err


def test_codes_have_no_rate_in_volts(run: Run) -> None:
    Path("u.csv").write_text("t,u\n" + "".join(f"{k * STEP},{100 * k}\n" for k in range(50)))
    how = ("--operator", "inverse", "--arithmetic", "q15", "-o", "out.csv", "--plot", "a.svg")
    code, out, err = run("simulate", "plain.yaml", "u.csv", *how)
    assert (code, out) == (0, "out.csv\na.svg\n")
    assert "reference 0 to 4900 codes, at most 2e+06 codes/s; drive" in err
    assert "input range" not in Path("a.svg").read_text()


@pytest.mark.parametrize("operator", ["forward", "inverse"])
def test_the_picture_has_the_signals_the_rate_and_the_limits_nearby(operator: str, run: Run) -> None:
    path = trajectory(40.0, 40.0)
    if operator == "forward":
        Path("u.csv").write_text(Path(path).read_text().replace("u [um]", "v [V]"))
    for plot in ("a.svg", "a.png"):
        code, out, err = run("simulate", "limited.yaml", path, "--operator", operator, "-o", "out.csv", "--plot", plot)
        assert (code, out) == (0, f"out.csv\n{plot}\n"), err
    assert Path("a.png").read_bytes().startswith(b"\x89PNG")
    words = Path("a.svg").read_text()
    told = {"forward": ["Output", "Output over drive"], "inverse": ["Reference", "Reference over drive", "slew limit"]}
    for word in ("Drive", "Rate of the drive", *told[operator]):
        assert f">{word}<" in words or f"<!-- {word} -->" in words, word
    assert ("slew limit" in words) == (operator == "inverse"), "3 to 5 V up and down are far slower than the limit"


def test_a_record_of_one_sample_has_no_rate(run: Run) -> None:
    Path("u.csv").write_text("t,u\n0,5\n")
    code, out, err = run("simulate", "plain.yaml", "u.csv", "--operator", "inverse", "--plot", "a.svg")
    assert (code, err.splitlines()) == (0, ["u.csv: 1 sample; reference 5 to 5 um; drive 50 to 50 V", "a.svg"])
    assert out == "t,u,v\n0.0,5.0,50.0\n"


@pytest.mark.parametrize("plot", ["a.pdf", "nowhere/a.png", "u.csv", "out.csv"])
def test_a_picture_that_cannot_be_written_is_refused_before_anything_is(plot: str, run: Run) -> None:
    path = trajectory(10.0, 10.0)
    before = Path(path).read_bytes()
    code, out, err = run("simulate", "plain.yaml", path, "--operator", "inverse", "-o", "out.csv", "--plot", plot)
    assert (code, out, len(err.splitlines())) == (2, "", 1)
    assert not Path("out.csv").exists()
    assert Path(path).read_bytes() == before
