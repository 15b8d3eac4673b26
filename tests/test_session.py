"""A session at one rate: what the converter plays, how a recording is cut, and the example that does both."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from modelfiles import head
from numpy.typing import NDArray

import hystgen
from hystgen.basics.problems import ParameterError, PlanError
from hystgen.planning.session import Session
from hystgen.records import Record
from hystgen.report import diagnosis as report
from hystgen.report.plan import Plan

Array = NDArray[np.float64]
Call = Callable[..., tuple[int, str, str]]

EXAMPLE = Path(__file__).parents[1] / "examples" / "acquire"
CLEAN = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Wsign-conversion", "-Wshadow", "-Werror"]
RATE = 50.0
LOW, HIGH = -20.0, 120.0


def file_of(folder: Path, low: float = LOW, high: float = HIGH) -> Path:
    path = folder / "stage.yaml"
    path.write_text(head("stage", low, high) + "\n  pi: {thresholds: [0, 1], weights: [1, 0.5]}\n")
    return path


def made(folder: Path, **options: Any) -> Plan:
    found: Plan = hystgen.plan(file_of(folder), **{"rate": RATE, **options})
    return found


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """A plan for a 12-bit DAC whose lowest code is 0 and whose range is wider than the drive's."""
    return made(tmp_path_factory.mktemp("played"), dac_bits=12, dac_range=(-40.0, 160.0))


def parts_of(plan: Plan) -> Session:
    assert plan.session is not None
    return plan.session


def whole(plan: Plan) -> tuple[Array, Array]:
    assert plan.whole is not None
    return plan.whole.t, plan.whole.v


class TestDrives:
    @pytest.mark.parametrize(
        ("bits", "ends", "coding", "least"),
        [
            (None, None, "straight", 0),
            (8, (-20.0, 120.0), "straight", 0),
            (12, (-150.0, 150.0), "twos-complement", -(2**11)),
            (16, (-150.0, 150.0), "straight", 0),
            (24, (-21.0, 200.0), "twos-complement", -(2**23)),
            (32, (-100.0, 121.0), "straight", 0),
        ],
    )
    def test_they_are_the_plan_s_to_a_code(
        self, tmp_path: Path, bits: int | None, ends: tuple[float, float] | None, coding: str, least: int
    ) -> None:
        """Drives are as long as those of the plan without a rate, and straight between their samples, to a code."""
        found = made(tmp_path, max_rate=2e3, dac_bits=bits, dac_range=ends, dac_coding=coding)
        plain = hystgen.plan(file_of(tmp_path), sample_time=1.0 / RATE, max_rate=2e3)
        code = 1e-6 * (HIGH - LOW) if ends is None or bits is None else (ends[1] - ends[0]) / 2**bits
        for drive, ideal in zip(found.drives, plain.drives, strict=True):
            assert (drive.name, drive.held_out) == (ideal.name, ideal.held_out)
            np.testing.assert_allclose(np.diff(drive.t), 1.0 / RATE, rtol=1e-9)
            since = drive.t - drive.t[0]
            assert since[-1] == pytest.approx(ideal.t[-1] - ideal.t[0], rel=1e-12)
            assert np.max(np.abs(drive.v - np.interp(since, ideal.t - ideal.t[0], ideal.v))) <= 1.001 * code
            assert np.max(np.abs(np.diff(drive.v))) <= 2e3 / RATE + code
            assert drive.v.min() > LOW
            assert drive.v.max() < HIGH
            assert (drive.codes is None) == (bits is None)
            if drive.codes is not None and bits is not None and ends is not None:
                np.testing.assert_allclose(drive.v, ends[0] + (drive.codes - least) * code, rtol=1e-12, atol=1e-12)
                assert drive.codes.min() >= least
                assert drive.codes.max() < least + 2**bits

    def test_one_file_has_all_in_order_with_rests(self, played: Plan) -> None:
        session, (t, v) = parts_of(played), whole(played)
        top, bottom = session.history
        np.testing.assert_allclose(t, np.arange(session.samples) / RATE, rtol=1e-12)
        assert [part.name for part in session.records] == [drive.name for drive in played.drives]
        before = 0
        for part, drive in zip(session.records, played.drives, strict=True):
            assert np.array_equal(v[part.first : part.first + part.samples], drive.v)
            assert t[part.first] == drive.t[0]
            rest = v[part.first - round(session.rest * RATE) : part.first]
            assert np.array_equal(rest, np.full(len(rest), bottom)), "and it is there that the record before ends"
            between = v[before : part.first]
            assert not before or np.ptp(between) == 0.0
            before = part.first + part.samples
        lead = v[: session.records[0].first]
        assert (lead.max(), lead[0], lead[-1]) == (top, bottom, bottom)
        assert before == session.samples

    def test_files(self, played: Plan) -> None:
        tables = played.tables()
        codes = np.array([int(line) for line in tables["session_codes.txt"].splitlines()])
        rows = np.loadtxt(tables["session.csv"].splitlines()[1:], delimiter=",")
        assert tables["session.csv"].splitlines()[0] == "t [s],v [V],code"
        assert np.array_equal(rows[:, 2], codes)
        assert np.array_equal(rows[:, 1], -40.0 + codes * 200.0 / 4096), "exact in binary"
        single = np.loadtxt(tables["03_fast_steps.csv"].splitlines()[1:], delimiter=",")
        part = parts_of(played).records[2]
        assert np.array_equal(single, rows[part.first : part.first + part.samples])
        assert [*tables, "plan.html"] == list(played.names)

    @pytest.mark.parametrize(("bits", "coding"), [(8, "straight"), (16, "twos-complement"), (32, "straight")])
    def test_firmware_plays_the_same_codes(self, tmp_path: Path, bits: int, coding: str) -> None:
        """The player of the documentation, compiled as C, plays the codes from a header that has only the corners."""
        found = made(tmp_path, dac_bits=bits, dac_range=(-25.0, 125.0), dac_coding=coding)
        tables = found.tables()
        page = (Path(hystgen.__file__).parents[1] / "docs" / "howto" / "acquire.md").read_text()
        (player,) = re.findall(r"```c\n(.*?)```", page, re.DOTALL)
        main = """
#include <stdio.h>
static void print(int64_t code) { printf("%lld\\n", (long long)code); }
int main(void) { play(print); return 0; }
"""
        (tmp_path / "stage_session.h").write_text(tables["stage_session.h"])
        for ours, theirs in (("plan/", ""), ("stage_x", "stage"), ("STAGE_X", "STAGE")):
            player = player.replace(ours, theirs)
        (tmp_path / "play.c").write_text(player + main)
        command = ["cc", *CLEAN, "-O1", "-o", str(tmp_path / "play"), str(tmp_path / "play.c")]
        subprocess.run(command, check=True)
        out = subprocess.run([tmp_path / "play"], capture_output=True, text=True, check=True).stdout
        assert out == tables["session_codes.txt"]

    def test_the_page_says_time_memory_and_resolution(self, played: Plan, tmp_path: Path) -> None:
        played.write(tmp_path / "plan")
        page = (tmp_path / "plan" / "plan.html").read_text()
        words = re.sub(r"\s+", " ", re.sub(r"<[^>]*>", "", page))
        samples = parts_of(played).samples
        assert f"{samples} samples in {samples / RATE / 60.0:.1f} min" in words
        assert f"{samples} codes, {2 * samples / 1e6:.3g} MB of memory at 2 bytes each" in words
        assert "12-bit DAC over -40 to 160 V, straight binary: one code is 0.04883 V" in words
        assert "--session" in words
        assert sorted(path.name for path in (tmp_path / "plan").iterdir()) == sorted(played.names)


class TestCut:
    @pytest.mark.parametrize(("rate", "early"), [(RATE, 0.0), (73.0, 4.2), (211.0, -0.3)])
    def test_a_recording_on_another_clock(self, played: Plan, rate: float, early: float) -> None:
        """Recordings start before the drive or just after its first sample, at another rate, with noise and a gain."""
        session, (t, v) = parts_of(played), whole(played)
        clock = np.arange(-early, t[-1] + 1.0, 1.0 / rate)
        drive = 1.01 * np.interp(clock, t, v) + np.random.default_rng(1).normal(0.0, 0.05, len(clock))
        recording = Record("all.csv", clock + 100.0, drive, 0.1 * drive, sample_time=1.0 / rate)
        to_fit, held = session.cut(recording)
        planned = {each.name: each for each in played.drives}
        assert [record.name for record in held] == [each.name for each in played.drives if each.held_out]
        assert len(to_fit) + len(held) == len(played.drives)
        for record in (*to_fit, *held):
            ideal = planned[record.name]
            assert record.t[0] - 100.0 == pytest.approx(ideal.t[0], abs=1.1 / rate + 0.01)
            assert record.t[-1] - 100.0 == pytest.approx(ideal.t[-1], abs=1.1 / rate + 0.01)
            assert record.y is not None
            np.testing.assert_allclose(record.y, 0.1 * record.v)

    @pytest.mark.parametrize(
        ("change", "said"),
        [
            (lambda t, v: (t[:-500], v[:-500]), "record the session to its end"),
            (lambda t, v: (t, v / 15.0), "give the drive in the units of the model"),
            (lambda t, v: (1.2 * t, v), "is it a recording of this session, at this rate?"),
            (lambda t, v: (t[len(t) // 3 :], v[len(t) // 3 :]), "the drive is"),
            (lambda t, v: (t, np.sort(v)[::-1]), "the drive never rises"),
        ],
    )
    def test_a_recording_of_something_else(
        self, played: Plan, change: Callable[[Array, Array], tuple[Array, Array]], said: str
    ) -> None:
        t, v = change(*whole(played))
        with pytest.raises(PlanError, match=re.escape(said)):
            parts_of(played).cut(Record("all.csv", t, v, v, sample_time=float(t[1] - t[0])))

    @pytest.mark.parametrize(
        ("change", "said"),
        [
            ({"rate": "50"}, ['3:11: error: rate: has to be a number above 0, not the text "50"; give the session']),
            ({"rate": -50.0, "hystgen": 2}, [":2:14: error: hystgen: has to be 1, not 2", "rate: has to be a number"]),
            ({"rate": True}, ["rate: has to be a number above 0, not true"]),
            ({"samples": 1e9}, ["samples: has to be a whole number, at least 2, not 1000000000.0"]),
            ({"history": [1.0]}, ["history: has to be the highest and the lowest drive"]),
            ({"history": [0.0, 1.0]}, ["history: has to be the highest and the lowest drive"]),
            (
                {"rest": None, "rise": "x"},
                ["rest: has to be a number of at least 0, not nothing", "rise: has to be a num"],
            ),
            ({"speed": 1}, ["speed: this key is unknown"]),
            ({"records": []}, ["records: has to be a list of records, not a list"]),
            ({"records": [1, {"name": "a"}]}, ["records[0]: has to be a record, not 1", "records[1].first: is missing",
                                               "records[1].samples: is missing", "records[1].held_out: is missing"]),
            ({"records": [{"name": "", "first": -1, "samples": 2, "held_out": 1, "more": 0}]},
             ["records[0].name: has to be text", "records[0].first: has to be", "records[0].held_out: has to be true",
              "records[0].more: this key is unknown"]),
            ({"records": [{"name": "a", "first": 0, "samples": 20, "held_out": False}] * 2},
             ["records[1].name: the text \"a\" is the name", "records[1].first: begins within the previous record"]),
            ({"records": [{"name": "a", "first": 0, "samples": 10**8, "held_out": False}]},
             ["records[0].samples: ends at sample 100000000"]),
            ({"dac": {"bits": 99, "low": 1, "high": 0, "coding": "straight"}}, ["has 99 bits", "not increasing"]),
            ({"dac": {"bits": 16, "low": 0, "coding": "gray"}}, ["dac.high: is missing", "dac.coding: has to be"]),
            ({"dac": 3}, ["dac: has to be a mapping or null, not 3"]),
        ],
    )  # fmt: skip
    def test_every_wrong_value_is_told(
        self, played: Plan, tmp_path: Path, change: dict[str, Any], said: list[str]
    ) -> None:
        content = {**json.loads(parts_of(played).to_json()), **change}
        (tmp_path / "session.json").write_text(json.dumps(content, indent=2))
        with pytest.raises(ParameterError) as refused:
            Session.read(tmp_path / "session.json")
        assert len(refused.value.problems) == len(said)
        for text in said:
            assert text in str(refused.value)

    def test_every_missing_key_is_told(self, played: Plan, tmp_path: Path) -> None:
        keys = json.loads(parts_of(played).to_json()).keys()
        (tmp_path / "session.json").write_text("{}")
        with pytest.raises(ParameterError) as refused:
            Session.read(tmp_path / "session.json")
        assert sorted(problem.path for problem in refused.value.problems) == sorted(keys)

    @pytest.mark.parametrize(
        ("content", "said"),
        [
            (b"[" * 200_000, "nested more than 16 deep"),
            (b'{"a":' * 200_000, "nested more than 16 deep"),
            (b"[]", "the top level must be a mapping"),
            (b"", "the file is empty"),
            (b'{"hystgen": 1', "not valid YAML"),
            (b'{"hystgen": "\xff"}', "is not UTF-8; give the session.json"),
            (b" " * (1 << 21), "more than 1048576 bytes; give the session.json"),
            (b'{"hystgen": 1, "hystgen": 1}', "this key is given twice"),
        ],
    )
    def test_a_file_that_is_no_session(self, run: Call, tmp_path: Path, content: bytes, said: str) -> None:
        (tmp_path / "s.json").write_bytes(content)
        (tmp_path / "a.csv").write_text("t,v,y\n")
        code, out, err = run("diagnose", file_of(tmp_path), tmp_path / "a.csv", "-o", tmp_path / "out", "--session",
                             tmp_path / "s.json")  # fmt: skip
        assert (code, out) == (2, "")
        assert said in err
        assert not (tmp_path / "out").exists()

    def test_the_file_is_read_back(self, played: Plan, tmp_path: Path) -> None:
        (tmp_path / "session.json").write_text(parts_of(played).to_json())
        assert Session.read(tmp_path / "session.json") == parts_of(played)


class TestCommand:
    def test_the_command_of_the_plan_cuts_the_recording(
        self, tmp_path: Path, run: Call, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Every record is fitted or held out as the plan says, with its history and rest."""
        folder = tmp_path / "plan"
        words = ["--rate", RATE, "--dac-bits", "16", "--dac-range", "-30,130", "--dac-coding", "twos-complement"]
        code, _, err = run("diagnose", "--plan", file_of(tmp_path), *words, "-o", folder)
        assert code == 0, err
        assert "16-bit DAC over -30 to 130 V, two's complement" in err
        command = err.splitlines()[-1].removeprefix("then run: hystgen ").split()
        rows = (folder / "session.csv").read_text().splitlines()
        (folder / "recording.csv").write_text("t,v,y\n" + "\n".join(row.rsplit(",", 1)[0] + ",1.0" for row in rows[1:]))
        seen: dict[str, Any] = {}

        def diagnose(_model: object, records: list[Record], **options: Any) -> None:
            seen.update(options, records=records)
            raise ValueError("enough")

        monkeypatch.setattr(report, "diagnose", diagnose)
        assert run(*command)[0] == 2
        content = json.loads((folder / "session.json").read_text())
        parts = {part["name"]: part for part in content["records"]}
        assert [record.name for record in seen["holdout"]] == [name for name in parts if parts[name]["held_out"]]
        assert [record.name for record in seen["records"]] == [name for name in parts if not parts[name]["held_out"]]
        assert all(len(record) == parts[record.name]["samples"] for record in (*seen["records"], *seen["holdout"]))
        assert (list(seen["history"]), seen["rest"]) == (content["history"], content["rest"])

    @pytest.mark.parametrize(
        ("words", "said"),
        [
            (["--plan", "FILE", "--rate", "0"], "the rate 0.0 is not a number above 0"),
            (["--plan", "FILE", "--rate", "50", "--sample-time", "0.02"], "give only one of them"),
            (["--plan", "FILE", "--rate", "1e6"], "give a rate of 30000 Hz or less"),
            (["--plan", "FILE", "--rate", "50", "--dac-bits", "16"], "need its bits and its range"),
            (["--plan", "FILE", "--dac-bits", "16", "--dac-range", "-20,120"], "the rate at which they are played"),
            (["--plan", "FILE", "--rate", "50", "--dac-bits", "6", "--dac-range", "-20,120"], "give 8 to 32"),
            (["--plan", "FILE", "--rate", "50", "--dac-bits", "16", "--dac-range", "0,120"], "behind the amplifier"),
            (["--plan", "FILE", "--rate", "50", "--dac-bits", "16", "--dac-range", "9,1"], "is not increasing"),
            (["--plan", "FILE", "--rate", "50", "--dac-bits", "16", "--dac-range", "1"], "has 1 numbers; give two"),
            (["--plan", "FILE", "--rate", "50", "--dac-bits", "16", "--dac-range", "a,b"], "is not a list of numbers"),
            (["--plan", "FILE", "--rate", "50", "--dac-bits", "8", "--dac-range", "-2e3,2e3"], "fewer than 100 codes"),
            (["--plan", "FILE", "--rate", "50", "--dac-coding", "straight"], "give --dac-bits and --dac-range with it"),
            (["--plan", "FILE", "--session", "s.json"], "leave out --session"),
            (["FILE", "a.csv", "--rate", "50"], "--rate is for drives; give --plan with it"),
            (["FILE", "a.csv", "b.csv", "--session", "s.json"], "give one, not 2"),
            (["FILE", "a.csv", "--session", "s.json", "--rest", "3"], "leave out --rest, which it contains"),
            (["FILE", "a.csv", "--session", "none.json"], "none.json: No such file or directory"),
        ],
    )
    def test_wrong_use(self, tmp_path: Path, run: Call, words: list[str], said: str) -> None:
        file = str(file_of(tmp_path))
        code, out, err = run("diagnose", *(file if word == "FILE" else word for word in words), "-o", tmp_path / "out")
        assert (code, out) == (2, "")
        assert said in re.sub(r"\s+", " ", err)
        assert "Traceback" not in err
        assert [path.name for path in tmp_path.iterdir()] == ["stage.yaml"]


def test_from_a_plan_to_a_diagnosis_in_one_run(tmp_path: Path) -> None:
    """The example runs unchanged: codes pass the two functions of its hardware, and the creep of its bench is found."""
    command = [sys.executable, str(EXAMPLE), "-o", str(tmp_path / "out"), "--rate", "100"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    plan, found = done.stdout.splitlines()
    assert "the session takes 6.7 min" in plan
    assert found.startswith("Missing: creep.")
    (effect,) = json.loads((tmp_path / "out" / "diagnosis" / "diagnosis.json").read_text())["effects"]
    after = np.geomspace(0.05, 60.0, 50)

    def crept(pairs: Any) -> Any:
        return sum(weight * -np.expm1(-after / tau) for tau, weight in pairs)

    numbers = effect["parameters"]
    named = crept(zip(numbers["time_constants"], numbers["weights"], strict=True))
    np.testing.assert_allclose(named, crept([(0.3, 0.03), (6.0, 0.03)]), atol=0.001)
    assert "Settling" in (tmp_path / "out" / "diagnosis" / "report.html").read_text()
