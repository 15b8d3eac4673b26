"""Settings that `identify` keeps from the parameter file that it replaces, and its checks before a fit."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import hystgen
from hystgen import identification
from hystgen.parameters.files import load_parameters

Run = Callable[..., tuple[int, str, str]]
RECORDING = Path(__file__).resolve().parents[1] / "examples" / "stage_recording.csv"
OLD = """hystgen: 1
name: axis_x
description: P-885 stack
units: {input: kV, output: nm}
sample_time: 5.0e-5
input_range: [0, 1]
model:
  pi: {thresholds: [0], weights: [1]}
emit: {operator: both, arithmetic: q15, engine: loop}
"""
EFFECTS = "  effects:\n    - {name: lag, time_constant: 0.01}\n    - {name: 'user:own', gain: 2}\n"


def identified(target: Path, run: Run, *more: object, record: Path = RECORDING) -> tuple[Any, str]:
    """The parameters written, and the messages."""
    code, _, err = run("identify", record, "-o", target, "--thresholds", 4, *more)
    assert code == 0, err
    return load_parameters(target), err


def test_settings_of_a_replaced_file_are_kept_and_reported(tmp_path: Path, run: Run) -> None:
    record = tmp_path / "named.csv"
    record.write_text("\n".join(["t,v [V],y [um]", *RECORDING.read_text().splitlines()[1:]]) + "\n")
    fresh, said = identified(tmp_path / "stage.yaml", run, record=record)
    assert "kept" not in said
    target = tmp_path / "other.yaml"
    target.write_text(OLD)
    old = load_parameters(target)
    found, said = identified(target, run, record=record)
    assert (found.description, found.sample_time, found.emit, found.name) == (
        old.description, old.sample_time, old.emit, old.name
    )  # fmt: skip
    assert (found.units.input, found.units.output) == ("kV", "nm"), "the records are converted to them"
    assert found.input_range == pytest.approx([1e-3 * end for end in fresh.input_range])
    assert found.model.pi.weights == pytest.approx([1e6 * weight for weight in fresh.model.pi.weights], rel=1e-6)
    assert f"{target}: name, units, description, sample_time, emit kept from the existing file" in said
    bytes_now = target.read_bytes()
    assert identified(target, run, record=record)[0] == found
    assert target.read_bytes() == bytes_now


def test_what_is_given_goes_first(tmp_path: Path, run: Run) -> None:
    target = tmp_path / "other.yaml"
    target.write_text(OLD)
    found, said = identified(target, run)  # a record without units
    assert (found.units.input, found.units.output) == ("kV", "nm")
    assert "name, units, description" in said
    target.write_text(OLD)
    found, said = identified(target, run, "--name", "axis_y", "--units", "V,um")
    assert (found.name, found.units.input, found.units.output) == ("axis_y", "V", "um")
    assert f"{target}: description, sample_time, emit kept" in said


def test_effects_of_the_file_that_is_replaced_are_left_out_aloud(tmp_path: Path, run: Run) -> None:
    """A user effect, which only --effects could define, is left out as well."""
    target = tmp_path / "other.yaml"
    target.write_text(OLD.replace("emit:", EFFECTS + "emit:"))
    found, said = identified(target, run)
    assert not found.model.effects
    assert found.sample_time == 5e-5
    assert "(lag, user:own) are left out" in said


@pytest.mark.parametrize(("text", "words"), [
    ("t,v,y\n1,2,3\n", "the top level must be a mapping"),
    ("hystgen: 1\nsample_time: -1\n", "sample_time"),
])  # fmt: skip
def test_a_file_that_is_no_parameter_file_is_replaced_aloud(text: str, words: str, tmp_path: Path, run: Run) -> None:
    target = tmp_path / "other.yaml"
    target.write_text(text)
    found, said = identified(target, run)
    assert found.sample_time is None
    assert f"{target}: nothing kept from the old file" in said
    assert words in said


def test_an_empty_file_is_no_news(tmp_path: Path, run: Run) -> None:
    (tmp_path / "other.yaml").touch()
    assert "kept" not in identified(tmp_path / "other.yaml", run)[1]


def test_a_fleet_keeps_them_too(tmp_path: Path, run: Run) -> None:
    """Settings written into a unit's file are kept, reach its C, and cause no further refit."""
    (tmp_path / "units").mkdir()
    for name in ("one", "two"):
        (tmp_path / "units" / f"{name}.csv").write_bytes(RECORDING.read_bytes())
    command = ("identify", "--batch", tmp_path / "units", "-o", tmp_path / "out", "--thresholds", 3, "--jobs", 1)
    assert run(*command)[0] == 0
    file = tmp_path / "out" / "one.yaml"
    file.write_text(file.read_text() + "sample_time: 2.0e-5\nemit: {arithmetic: q15}\n")
    code, _, err = run(*command)
    assert code == 0
    assert "2 done (1 by an earlier call)" in err
    assert "sample_time, emit kept from the existing parameter files of 1 units" in err
    found = load_parameters(file)
    assert (found.sample_time, found.emit.arithmetic) == (2e-5, "q15")
    assert hystgen.differences(file, tmp_path / "out" / "one") == []
    assert "arithmetic q15" in (tmp_path / "out" / "one" / "one.h").read_text()
    assert "2 done (2 by an earlier call)" in run(*command)[2]


@pytest.fixture
def no_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fail if a record is fitted."""

    @functools.wraps(identification.identify)
    def identify(*_: object, **__: object) -> None:
        raise AssertionError("fitted first")

    monkeypatch.setattr(identification, "identify", identify)


def unwritable(tmp_path: Path) -> list[Path]:
    """Folders in which no file can be made."""
    (tmp_path / "file").touch()
    (tmp_path / "closed").mkdir()
    (tmp_path / "closed").chmod(0o500)
    found = [tmp_path / "file", Path("/proc/self/fdinfo")]  # the second one refuses root too
    return found if os.geteuid() == 0 else [*found, tmp_path / "closed"]


@pytest.mark.usefixtures("no_fit")
def test_what_cannot_be_written_is_found_before_the_fit(tmp_path: Path, run: Run) -> None:
    """The exit code is 2, and the message names the place."""
    good = tmp_path / "a.yaml"
    for folder in unwritable(tmp_path):
        plot, report = ("--plot", folder / "a.svg"), ("--report", folder / "fit")
        for options in (("-o", folder / "a.yaml"), ("-o", good, *plot), ("-o", good, *report)):
            code, out, err = run("identify", RECORDING, *options)
            assert (code, out) == (2, ""), err
            assert str(folder) in err
        code, _, err = run("identify", "--batch", RECORDING, "-o", folder / "out")
        assert code == 2, err
    code, _, err = run("identify", RECORDING, "-o", tmp_path / "no" / "such" / "a.yaml")
    assert code == 2
    assert "create it, or choose another output" in err
    assert not good.exists()
    assert not (tmp_path / "no").exists()
