"""Drives planned for a diagnosis: they keep their limits, are reproducible and explained, and tell effects apart."""

from __future__ import annotations

import hashlib
import json
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from modelfiles import head

import hystgen
from benchmarks.plants.__main__ import main as plants
from benchmarks.plants.case import in_turn
from hystgen import effects
from hystgen.basics.problems import PlanError
from hystgen.planning import waveforms
from hystgen.report.plan import Plan

pytestmark = pytest.mark.thorough

Call = Callable[..., tuple[int, str, str]]

SAMPLE = ("asymmetry", "delay", "slew_limit", "thermal")
"""Effects hidden in every run of the tests; `benchmarks.plants` says how to hide them all."""


def file_of(folder: Path, low: float = -20.0, high: float = 120.0, more: str = "") -> Path:
    path = folder / "stage.yaml"
    text = head("stage", low, high) + "\n  pi: {thresholds: [0, 1], weights: [1, 0.5]}\n" + more
    path.write_text(text)
    return path


def made(folder: Path, low: float = -20.0, high: float = 120.0, more: str = "", **options: Any) -> Plan:
    found: Plan = hystgen.plan(file_of(folder, low, high, more), **options)
    return found


RANGES = [(0.0, 10.0), (-1.0, 150.0), (2.0, 5.0), (-100.0, -99.9), (1e-7, 3e-6), (-3e9, 1e12)]


class TestLimits:
    @pytest.mark.parametrize(("low", "high"), RANGES)
    @pytest.mark.parametrize("spans_a_second", [None, 0.05, 1.0, 37.0, 1e3, 1e9])
    @pytest.mark.parametrize("sample_time", [None, 5e-5, 0.01])
    def test_inside_range_and_rate(
        self, tmp_path: Path, low: float, high: float, spans_a_second: float | None, sample_time: float | None
    ) -> None:
        limit = None if spans_a_second is None else spans_a_second * (high - low)
        found = made(tmp_path, low, high, max_rate=limit, sample_time=sample_time)
        shortest = sample_time or 1e-4
        limit = limit or (high - low) / (8 * shortest)
        assert found.max_rate == pytest.approx(limit, rel=1e-12)
        clock = -np.inf
        for drive in found.drives:
            assert low < drive.v.min()
            assert drive.v.max() < high
            assert np.ptp(drive.v) > 0.9 * (high - low)
            steps = np.diff(drive.t)
            # with the smallest time step that the printed decimals may stand for
            assert np.all(np.abs(np.diff(drive.v)) <= limit * (steps - 4.0 * np.spacing(drive.t[1:])))
            assert steps.min() > 0.999 * shortest
            assert drive.t[0] > clock
            clock = drive.t[-1]
        assert found.duration == found.drives[-1].t[-1]
        assert 10_000 < found.samples < 20_000

    @pytest.mark.parametrize("spans_a_second", [10.0, 1e3, 1e6])
    def test_a_few_minutes(self, tmp_path: Path, spans_a_second: float) -> None:
        assert made(tmp_path, 0.0, 10.0, max_rate=10.0 * spans_a_second).duration < 7 * 60.0

    @pytest.mark.parametrize("spans_a_second", [0.5, 40.0, 1e3, 1e9])
    def test_edges_are_resolved(self, tmp_path: Path, spans_a_second: float) -> None:
        """At least three samples lie inside every move, full-scale steps included; sweeps and multisines are exempt."""
        for drive in made(tmp_path, 0.0, 10.0, max_rate=10.0 * spans_a_second).drives:
            if "sweep" in drive.name or "multisine" in drive.name:
                continue
            moving = np.abs(np.diff(drive.v)) > 0.0
            edges = np.flatnonzero(np.diff(np.concatenate([[False], moving, [False]]).astype(int)))
            assert min(b - a for a, b in zip(edges[::2], edges[1::2], strict=True)) >= 4

    def test_the_clock_has_rests(self, tmp_path: Path) -> None:
        found = made(tmp_path)
        for before, after in zip(found.drives, found.drives[1:], strict=False):
            assert after.t[0] - before.t[-1] == pytest.approx(found.rest)
            assert after.v[0] == before.v[-1]

    def test_the_history_is_true(self, tmp_path: Path) -> None:
        """Every record ends with moves to the top and to the bottom, where the next one begins."""
        found = made(tmp_path)
        top, bottom = found.history
        assert top == max(drive.v.max() for drive in found.drives)
        assert bottom == min(drive.v.min() for drive in found.drives)
        for drive in found.drives:
            last_top = np.flatnonzero(drive.v == top)[-1]
            assert drive.v[0] == drive.v[-1] == bottom
            assert np.all(np.diff(drive.v[last_top:]) <= 0.0)

    def test_the_sample_time_of_the_file(self, tmp_path: Path) -> None:
        given = made(tmp_path, more="sample_time: 2.0e-4\n")
        assert given.sample_time == 2e-4
        assert "parameter file's" in given.defaults[0]
        assert made(tmp_path).sample_time == 1e-4
        assert made(tmp_path, more="sample_time: 2.0e-4\n", sample_time=1e-3, max_rate=10.0).defaults == ()


class TestContent:
    def test_every_effect_is_shown_by_two_records(self, tmp_path: Path) -> None:
        """At least one record to fit shows each effect, and at least one more record, held out or to fit."""
        found = made(tmp_path)
        shown = [(drive.held_out, name) for drive in found.drives for name in drive.shows]
        for name in (*effects.CATALOGUE, "asymmetry"):
            assert (False, name) in shown
            assert sum(each == name for _, each in shown) >= 2
        assert {name for _, name in shown} == {*effects.CATALOGUE, "asymmetry"}

    def test_rates_differ(self, tmp_path: Path) -> None:
        """The same loops run at rates three decades apart, and most samples to fit are a sample time apart."""
        found = made(tmp_path)
        rates = [drive.fastest for drive in found.drives]
        assert max(rates) > 1e3 * min(rates)
        steps = np.concatenate([np.diff(drive.t) for drive in found.drives if not drive.held_out])
        assert np.median(steps) == pytest.approx(found.sample_time, rel=1e-6)

    def test_small_loops_are_equal_and_at_three_biases(self, tmp_path: Path) -> None:
        (minor,) = (drive for drive in made(tmp_path, 0.0, 100.0).drives if "slow_minor" in drive.name)
        turns = minor.v[1:-1][np.sign(np.diff(minor.v))[1:] * np.sign(np.diff(minor.v))[:-1] <= 0]
        for low in (0.02, 0.375, 0.73):
            ends = (1.0 + 98.0 * low, 1.0 + 98.0 * (low + 0.25))
            assert all(np.count_nonzero(np.abs(turns - end) < 0.01) >= 3 for end in ends)

    def test_multisine_has_equal_periods_and_odd_lines(self, tmp_path: Path) -> None:
        (wave,) = (drive for drive in made(tmp_path, 0.0, 100.0).drives if "multisine" in drive.name)
        period = 240
        starts = [k for k in range(40) if np.array_equal(wave.v[k : k + period], wave.v[k + period : k + 2 * period])]
        assert starts
        lines = np.abs(np.fft.rfft(wave.v[starts[-1] : starts[-1] + period]))[1:40]
        assert lines[1::2].max() < 1e-4 * lines[::2].max()

    def test_sine(self) -> None:
        x = np.linspace(-3.0, 3.0, 5001)
        assert np.max(np.abs([waveforms.sine(float(each)) - np.sin(2.0 * np.pi * each) for each in x])) < 1e-13

    def test_same_bytes_everywhere(self, tmp_path: Path) -> None:
        """The digest of the CSV files depends neither on the machine nor on its libraries."""
        text = "".join(made(tmp_path, more="sample_time: 5.0e-5\n").tables().values())
        assert hashlib.sha256(text.encode()).hexdigest() == DIGEST


DIGEST = "c35a11533e6f22d6bd87b3bb900000ad060ff39fb19535855310aefaf4692c77"


class TestCommand:
    def test_files_and_page(self, tmp_path: Path, run: Call) -> None:
        file = file_of(tmp_path)
        code, out, err = run("diagnose", "--plan", file, "-o", tmp_path / "plan", "--max-rate", "20000")
        assert code == 0, err
        names = [Path(line).name for line in out.splitlines()]
        assert names == [*sorted(names[:-1]), "plan.html"]
        assert sorted(path.name for path in (tmp_path / "plan").iterdir()) == sorted(names)
        first = (tmp_path / "plan" / names[0]).read_text().splitlines()
        assert first[0] == "t [s],v [V]"
        last = (tmp_path / "plan" / names[-2]).read_text().splitlines()[-1]
        assert "sample time of 0.0001 s" in err
        assert f"takes {float(last.split(',')[0]) / 60.0:.1f} min" in err
        page = (tmp_path / "plan" / "plan.html").read_text()
        assert page.count('<img src="data:image/svg+xml;base64,') == 1
        assert not re.search("https?:", re.sub(r"base64,[^\"]*", "", page))
        assert "<script" not in page
        assert all(name in page for name in names[:-1])
        assert all(name in page for name in (*effects.CATALOGUE, "asymmetry"))
        before = [path.read_bytes() for path in sorted((tmp_path / "plan").iterdir())]
        assert run("diagnose", "--plan", file, "-o", tmp_path / "plan", "--max-rate", "20000")[0] == 0
        assert [path.read_bytes() for path in sorted((tmp_path / "plan").iterdir())] == before

    def test_the_command_of_the_page_runs(self, tmp_path: Path, run: Call) -> None:
        """With measured records where the page says, the command of the page makes a diagnosis."""
        folder = tmp_path / "my plan"
        _, _, err = run("diagnose", "--plan", file_of(tmp_path), "-o", folder)
        words = shlex.split(err.splitlines()[-1].removeprefix("then run: "))
        (folder / "measured").mkdir()
        for drive in folder.glob("*.csv"):
            t, v = np.loadtxt(drive, delimiter=",", skiprows=1, unpack=True)
            y = 1.5 * v + np.random.default_rng(len(t)).normal(0.0, 0.05, len(t))
            rows = "\n".join(f"{a!r},{b!r},{c!r}" for a, b, c in zip(t.tolist(), v.tolist(), y.tolist(), strict=True))
            (folder / "measured" / drive.name).write_text(f"t,v,y\n{rows}\n")
        assert words[0] == "hystgen"
        code, _, err = run(*words[1:])
        assert code == 0, err
        assert json.loads((folder / "diagnosis" / "diagnosis.json").read_text())["effects"] == []

    @pytest.mark.parametrize(
        ("words", "said"),
        [
            (["--plan", "FILE"], "Missing option '-o'"),
            (["--plan", "FILE", "drive.csv", "-o", "out"], "leave out DATA, or leave out --plan"),
            (["--plan", "FILE", "--holdout", "drive.csv", "--history", "1,2", "-o", "out"], "--holdout, --history"),
            (["FILE", "-o", "out"], "--plan writes drive records"),
            (["FILE", "drive.csv"], "Missing option '-o'"),
            (["FILE", "drive.csv", "--max-rate", "5", "-o", "out"], "give --plan with it"),
            (["--plan", "FILE", "--max-rate", "1e-9", "-o", "out"], "give a larger max rate"),
            (["--plan", "none.yaml", "-o", "out"], "none.yaml"),
            (["--plan", "FILE", "-o", "FILE"], "is a file"),
        ],
    )
    def test_wrong_use(self, tmp_path: Path, run: Call, words: list[str], said: str) -> None:
        place = {"FILE": str(file_of(tmp_path)), "out": str(tmp_path / "out")}
        code, out, err = run("diagnose", *(place.get(word, word) for word in words))
        assert (code, out) == (2, "")
        assert said in err
        assert "Traceback" not in err
        assert [path.name for path in tmp_path.iterdir()] == ["stage.yaml"]

    def test_every_problem_at_once(self, tmp_path: Path, run: Call) -> None:
        words = ["diagnose", "--plan", file_of(tmp_path), "--max-rate", "-1", "--sample-time", "nan"]
        code, _, err = run(*words, "-o", tmp_path / "out")
        assert code == 2
        assert err.splitlines() == [
            "error: the max rate -1.0 is not a number above 0; give input units per second",
            "error: the sample time nan is not a number above 0; give seconds",
        ]

    def test_files_of_another_session_are_named(self, tmp_path: Path, run: Call) -> None:
        left = [tmp_path / "out" / name for name in ("session.csv", "session.json")]
        left[0].parent.mkdir()
        assert hystgen.plan(file_of(tmp_path)).left_over(left[0].parent) == []
        for path in left:
            path.touch()
        assert hystgen.plan(tmp_path / "stage.yaml", rate=50.0).left_over(left[0].parent) == []
        _, _, err = run("diagnose", "--plan", tmp_path / "stage.yaml", "-o", left[0].parent)
        assert f"from an earlier plan, with other drives: {left[0]}, {left[1]}; remove" in err

    @pytest.mark.parametrize(
        ("dac", "problems"),
        [
            ({"dac_bits": 4, "dac_range": (150.0, 0.0)}, ["need a rate", "the DAC has 4 bits", "150 to 0 is not incr"]),
            ({"dac_bits": 40}, ["need a rate", "its bits and its range", "the DAC has 40 bits"]),
            ({"dac_range": (9.0, 1.0), "rate": 50.0}, ["its bits and its range", "9 to 1 is not increasing"]),
            ({"dac_bits": 4, "dac_range": (1, 2, 3), "rate": 0.0}, ["the rate 0.0", "has 3 numbers", "the DAC has 4"]),
        ],
    )
    def test_every_problem_of_a_converter_at_once(
        self, tmp_path: Path, dac: dict[str, Any], problems: list[str]
    ) -> None:
        with pytest.raises(PlanError) as refused:
            hystgen.plan(file_of(tmp_path), **dac)
        assert len(refused.value.problems) == len(problems)
        assert all(said in found for said, found in zip(problems, refused.value.problems, strict=True))

    def test_a_range_too_narrow_for_its_numbers(self, tmp_path: Path) -> None:
        with pytest.raises(PlanError, match="too narrow"):
            made(tmp_path, 1e9, 1e9 + 1.0)

    def test_no_input_is_written_over(self, tmp_path: Path, run: Call) -> None:
        file = file_of(tmp_path)
        own = tmp_path / "01_slow.csv"
        own.write_text(file.read_text())
        code, _, err = run("diagnose", "--plan", own, "-o", tmp_path)
        assert code == 2
        assert "would be overwritten" in err
        assert own.read_text() == file.read_text()


class TestSeparation:
    """Plants that share no code with the package, driven as planned, each with one hidden effect."""

    @pytest.mark.slow(one_in=2)
    @pytest.mark.parametrize("name", SAMPLE)
    def test_the_hidden_effect_is_named_first(self, tmp_path: Path, name: str) -> None:
        found = made(tmp_path)
        found.write(tmp_path / "plan")
        seed = in_turn().index(name)
        words = ["generate", "--block", "tune", "--kind", "single", "--seeds", str(seed), "--no-rivals"]
        words += ["--drives", str(tmp_path / "plan"), "-o", str(tmp_path)]
        assert not plants([*words, *(word for d in found.drives if d.held_out for word in ("--holdout", d.name))])
        (case,) = (tmp_path / "cases").iterdir()
        label = json.loads((tmp_path / "labels" / f"{case.name}.json").read_text())
        assert [effect["name"] for effect in label["effects"]] == [name]
        spec = json.loads((case / "session.json").read_text())
        assert [d.held_out for d in found.drives] == [f"r{k:02d}.csv" in spec["holdout"] for k in range(1, 16)]
        assert tuple(spec["history"]) == found.history
        assert spec["rest"] == pytest.approx(found.rest)
        content = hystgen.diagnose(
            case / "params.yaml",
            [case / each for each in spec["fit"]],
            holdout=[case / each for each in spec["holdout"]],
            history=found.history,
            rest=found.rest,
        ).content
        assert content["effects"][0]["name"] == name
        assert content["gap"]["after"]["holdout"] < 0.5 * content["gap"]["refitted"]["holdout"]
