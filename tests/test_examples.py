"""What `make demo` installs, and the examples that it and the pages run."""

from __future__ import annotations

import importlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import hystgen

ROOT = Path(__file__).resolve().parents[1]


# make demo -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("compilers", "zig"),
    [
        ({}, True),
        ({"gcc": "cat > /dev/null; exit 1"}, True),  # without the headers of the C library, say
        ({"cc": "exit 0", "tcc": "exit 0"}, True),  # `verify` looks for gcc and clang
        ({"gcc": "exit 0"}, False),
        ({"clang": "exit 0"}, False),
        ({"gcc": "exit 1", "clang": "exit 0"}, False),
    ],
)
def test_the_demo_installs_zig_only_where_no_compiler_works(
    compilers: dict[str, str], zig: bool, tmp_path: Path
) -> None:
    for tool in ("sh", "mktemp", "rm", "cat"):
        (tmp_path / tool).symlink_to(shutil.which(tool) or "")
    for name, script in compilers.items():
        (tmp_path / name).write_text(f"#!/bin/sh\n{script}\n")
        (tmp_path / name).chmod(0o755)
    command = [shutil.which("make") or "make", "-n", "demo", "VENV=nowhere"]
    done = subprocess.run(
        command, cwd=ROOT, env={"PATH": str(tmp_path)}, capture_output=True, text=True, check=True
    )
    (asked,) = re.findall(r"pip install .*'\.\[(.*)\]'", done.stdout)
    assert asked.split(",") == ["fit", "plot", *["zig"] * zig], done.stdout
    assert done.stderr == ""


def test_the_demo_takes_a_real_compiler() -> None:
    if not (shutil.which("gcc") or shutil.which("clang")):
        (pytest.fail if os.environ.get("CI") else pytest.skip)("neither gcc nor clang is installed")
    done = subprocess.run(["make", "-n", "demo", "VENV=nowhere"], cwd=ROOT, capture_output=True, text=True, check=True)
    assert "pip install" in done.stdout
    assert "zig" not in done.stdout
    last = [line for line in done.stdout.splitlines() if "examples/out" in line][-2:]
    assert all("examples/out/story/" in line for line in last)


# The stories ---------------------------------------------------------------------------------------------


def example(*arguments: object) -> str:
    """What an example prints; warnings are errors."""
    command = [sys.executable, "-W", "error::hystgen.SampleWarning", *map(str, arguments)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, env={**os.environ})
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def story(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder that examples/from_gap_to_firmware writes, and what it prints."""
    folder = tmp_path_factory.mktemp("story")
    return folder, example("examples/from_gap_to_firmware", "-o", folder)


@pytest.mark.thorough(each_time=True)
def test_from_a_gap_to_firmware(story: tuple[Path, str]) -> None:
    """The figures of the pages, and the files that the demo names."""
    folder, said = story
    assert "Missing: asymmetry, creep." in said
    errors = [float(number) for number in re.findall(r"([\d.]+) % of the motion, rms", said)]
    # rounded to two digits on the pages, to three places in what is printed
    np.testing.assert_allclose(errors, [6.88, 0.85, 0.02], rtol=0.0, atol=0.005 + 0.0005)
    assert (folder / "tracking.png").read_bytes().startswith(b"\x89PNG")
    assert "creep" in (folder / "diagnosis" / "report.html").read_text()
    assert {path.name for path in (folder / "firmware").iterdir()} >= {"plain.c", "extended.c"}


@pytest.mark.thorough(each_time=True)
def test_a_raster_through_the_compiled_c(story: tuple[Path, str]) -> None:
    """The figures of docs/howto/trajectory.md; its trajectories are what `simulate` takes."""
    folder, _ = story
    said = example("examples/raster.py", "-o", folder)
    found = re.findall(r"(?m)^([a-z ]+?) {2,}([\d. ]+)$", said)
    rows = {name: [float(x) for x in numbers.split()] for name, numbers in found}
    assert list(rows) == ["linear scale", "plays", "whole model"], said
    assert all(whole < plays / 10 < linear / 20 for linear, plays, whole in zip(*rows.values(), strict=True))
    page = (ROOT / "docs" / "howto" / "trajectory.md").read_text()
    for name, errors in rows.items():
        stated = re.search(rf"\| {name} \|([\d. |]+)\|\n", page)
        assert stated
        np.testing.assert_allclose(errors, [float(x) for x in stated[1].split("|")], rtol=0.2)
    assert (folder / "raster.png").read_bytes().startswith(b"\x89PNG")
    fast, slow = (hystgen.records.read_record(folder / f"{name}.csv", need=("u",)) for name in ("fast", "slow"))
    assert (len(fast), fast.units["u"]) == (600 + 2400, "um")
    places = (fast.t[600:] - fast.t[600] + 0.005) % 1.0
    triangle = 8.0 + 20.0 * np.minimum(places, 1.0 - places)
    np.testing.assert_allclose(fast.columns()["u"][600:], triangle, atol=1e-4)
    lines = np.floor(fast.t[600:] - fast.t[600] + 1e-6)
    np.testing.assert_allclose(slow.columns()["u"][600:], 8.0 + 10.0 * lines / 24, atol=1e-4)


def test_a_ramp_of_the_slow_axis(monkeypatch: pytest.MonkeyPatch) -> None:
    """It climbs by one line during each, from the same place and after the same sweep."""
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    raster = importlib.import_module("raster")
    (fast, stairs), (other, ramp) = raster.raster("staircase"), raster.raster("ramp")
    assert np.array_equal(fast, other)
    assert np.array_equal(stairs[:600], ramp[:600])
    np.testing.assert_allclose(np.diff(ramp[600:]), 10.0 / 2400)
    assert np.all((ramp - stairs)[600:] >= 0.0)
    assert np.array_equal(ramp[600::100], stairs[600::100])
