"""The marks of tests: which tests are left out where, and that these are counted; and the count of processor time."""

from __future__ import annotations

import csv
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.thorough

CONFTEST = Path(__file__).with_name("conftest.py")
OWN = ("CI", "HYSTGEN_REQUIRE_DATA", "HYSTGEN_WHOLE", "PYTEST_ADDOPTS")
ONE_PROCESS_AND_XDIST = pytest.mark.parametrize("options", [(), ("-n", "1")], ids=["one process", "xdist"])


def call(folder: Path, tests: str, *options: str, **environment: str) -> tuple[int, str]:
    """Run these tests under the settings of the suite; return the exit code and the output."""
    for name in ("conftest.py", "processor_time.py"):
        (folder / name).write_text(CONFTEST.with_name(name).read_text())
    (folder / "pytest.ini").write_text("[pytest]\nmarkers =\n  data: needs records\n  slow: long\n  thorough: deep\n")
    (folder / "test_few.py").write_text(tests)
    kept = {k: x for k, x in os.environ.items() if k not in OWN}
    command = [sys.executable, "-m", "pytest", "-v", "-p", "no:cacheprovider", *options, str(folder)]
    done = subprocess.run(command, cwd=folder, env={**kept, **environment}, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


class TestData:
    TESTS = (
        "import pytest\n"
        "@pytest.mark.data\n@pytest.mark.parametrize('k', [1, 2])\n"
        "def test_measured(measured, k):\n    assert measured.is_dir()\n"
        "def test_plain():\n    pass\n"
    )

    @ONE_PROCESS_AND_XDIST
    @pytest.mark.parametrize("ci", [{}, {"CI": "true"}], ids=["here", "CI"])
    def test_deselected_with_a_count_and_a_reason(
        self, options: tuple[str, ...], ci: dict[str, str], tmp_path: Path
    ) -> None:
        code, text = call(tmp_path, self.TESTS, *options, HYSTGEN_DATA=str(tmp_path / "none"), **ci)
        assert code == 0, text
        assert f"2 tests deselected: marked data, and there is no folder {tmp_path / 'none'} of measured" in text
        assert "1 passed" in text
        assert "skipped" not in text

    def test_run_where_there_are_records(self, tmp_path: Path) -> None:
        code, text = call(tmp_path, self.TESTS, HYSTGEN_DATA=str(tmp_path))
        assert code == 0, text
        assert "3 passed" in text
        assert "deselected" not in text

    @pytest.mark.parametrize("ci", [{}, {"CI": "true"}], ids=["here", "CI"])
    def test_an_error_where_they_are_required(self, ci: dict[str, str], tmp_path: Path) -> None:
        code, text = call(tmp_path, self.TESTS, HYSTGEN_DATA=str(tmp_path / "none"), HYSTGEN_REQUIRE_DATA="1", **ci)
        assert code == pytest.ExitCode.USAGE_ERROR
        assert "HYSTGEN_REQUIRE_DATA is set, but there is no folder" in text
        assert "passed" not in text


class TestSlow:
    TESTS = (
        "import pytest\n"
        "@pytest.mark.slow(one_in=2)\n"
        "@pytest.mark.parametrize('engine', ['p', 'q'])\n@pytest.mark.parametrize('name', ['a', 'b', 'c'])\n"
        "def test_two_lists(name, engine):\n    pass\n"
        "@pytest.mark.slow(one_in=3)\n"
        "@pytest.mark.parametrize(('name', 'k'), [('a', 0), ('a', 1), ('b', 0), ('b', 1), ('c', 0)])\n"
        "def test_one_list(name, k):\n    pass\n"
        "@pytest.mark.slow\ndef test_exhaustive():\n    pass\n"
        "def test_plain():\n    pass\n"
    )

    @ONE_PROCESS_AND_XDIST
    def test_some_cases_run_and_the_others_are_counted(self, options: tuple[str, ...], tmp_path: Path) -> None:
        code, text = call(tmp_path, self.TESTS, *options, HYSTGEN_DATA=str(tmp_path))
        assert code == 0, text
        two_lists = {"test_two_lists[a-p]", "test_two_lists[b-q]", "test_two_lists[c-p]"}
        assert set(re.findall(r"::(test_\w+(?:\[.*?\])?)", text)) == {
            *two_lists, "test_one_list[a-0]", "test_one_list[b-1]", "test_plain",
        }  # fmt: skip
        assert "6 passed" in text
        assert "7 tests deselected: marked slow; HYSTGEN_WHOLE=1 runs all" in text

    def test_all_run_where_that_is_asked_for(self, tmp_path: Path) -> None:
        code, text = call(tmp_path, self.TESTS, HYSTGEN_DATA=str(tmp_path), HYSTGEN_WHOLE="1")
        assert code == 0, text
        assert "13 passed" in text
        assert "deselected" not in text


class TestThorough:
    TESTS = (
        "import pytest\n"
        "@pytest.mark.slow(one_in=2)\n@pytest.mark.thorough(but_one_in=4)\n"
        "@pytest.mark.parametrize('k', [0, 1, 2, 3])\n@pytest.mark.parametrize('name', ['a', 'b'])\n"
        "def test_two_lists(name, k):\n    pass\n"
        "@pytest.mark.thorough\ndef test_deep():\n    pass\n"
        "def test_plain():\n    pass\n"
    )

    @ONE_PROCESS_AND_XDIST
    def test_some_cases_stand_for_all(self, options: tuple[str, ...], tmp_path: Path) -> None:
        code, text = call(tmp_path, self.TESTS, *options, "-m", "not thorough", HYSTGEN_DATA=str(tmp_path))
        assert code == 0, text
        some = {"test_two_lists[a-0]", "test_two_lists[b-3]", "test_plain"}
        assert set(re.findall(r"::(test_\w+(?:\[.*?\])?)", text)) == some
        assert "4 tests deselected: marked slow" in text

    @ONE_PROCESS_AND_XDIST
    def test_all_run_where_nothing_is_left_out(self, options: tuple[str, ...], tmp_path: Path) -> None:
        code, text = call(tmp_path, self.TESTS, *options, HYSTGEN_DATA=str(tmp_path))
        assert code == 0, text
        assert "6 passed" in text

    @ONE_PROCESS_AND_XDIST
    def test_a_share_of_them_runs(self, options: tuple[str, ...], tmp_path: Path) -> None:
        tests = (
            "import pytest\n"
            "@pytest.mark.thorough\n@pytest.mark.parametrize('k', range(12))\ndef test_cases(k):\n    pass\n"
            "@pytest.mark.thorough(each_time=True)\n@pytest.mark.parametrize('k', [1, 2])\n"
            "def test_each(k):\n    pass\n"
            "def test_plain():\n    pass\n"
            + "".join(f"@pytest.mark.thorough\ndef test_deep_{k}():\n    pass\n" for k in range(40))
        )
        code, text = call(tmp_path, tests, *options, "--share", "4", HYSTGEN_DATA=str(tmp_path))
        assert code == 0, text
        ran = set(re.findall(r"::(test_\w+(?:\[.*?\])?)", text))
        assert {"test_each[1]", "test_each[2]", "test_plain"} <= ran
        cases = sorted(int(each.split("[")[1][:-1]) for each in ran if "cases" in each)
        assert np.diff(cases).tolist() == [4, 4]
        assert 3 <= sum("deep" in each for each in ran) <= 20
        assert f"{55 - len(ran)} tests deselected: marked thorough, and beyond the share of --share" in text
        code, text = call(tmp_path, tests, *options, "--share", "4", HYSTGEN_DATA=str(tmp_path), HYSTGEN_WHOLE="1")
        assert "55 passed" in text


class TestProcessorTime:
    TESTS = (
        "import subprocess, sys, time\n"
        "def spend(seconds):\n"
        "    until = time.process_time() + seconds\n"
        "    while time.process_time() < until:\n        pass\n"
        "def test_here():\n    spend(0.4)\n"
        "def test_below():\n"
        "    code = 'import time\\nwhile time.process_time() < 0.6:\\n    pass'\n"
        "    subprocess.run([sys.executable, '-c', code], check=True)\n"
        "def test_waits():\n    time.sleep(0.5)\n"
    )

    @ONE_PROCESS_AND_XDIST
    def test_is_counted_by_test_and_kind(self, options: tuple[str, ...], tmp_path: Path) -> None:
        code, text = call(tmp_path, self.TESTS, *options, "--cpu", str(tmp_path / "cpu.csv"))
        assert code == 0, text
        assert re.search(r"\d+ s of processor time, by file: test_few.py \d+", text)
        with (tmp_path / "cpu.csv").open(newline="") as file:
            rows = {row["test"].partition("::")[2]: row for row in csv.DictReader(file)}
        assert [*rows] == ["test_below", "test_here", "test_waits"], "the most expensive first"
        assert float(rows["test_here"]["python"]) >= 0.4
        assert float(rows["test_below"]["python -c"]) >= 0.6
        assert float(rows["test_below"]["python"]) < 0.4
        assert float(rows["test_waits"]["all"]) < 0.4
