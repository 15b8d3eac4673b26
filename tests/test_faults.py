"""Wrong samples do not change a fit: wherever they are, it is that of the record without them.

The oracle is a fit to the clean record with the sample deleted; predictions are computed by brute force.
"""

from __future__ import annotations

import csv
import functools
import json
import re
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from numpy.typing import NDArray
from recordings import brute_output, columns, noisy, record, wander, write_csv, written

import hystgen
from hystgen.basics.problems import RecordError
from hystgen.diagnosis.search import fits, hypothesis
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.identification import IdentificationError, faults, prepared
from hystgen.identification.joint import Tanh
from hystgen.records import Record, no_value, read_record

pytestmark = pytest.mark.thorough

Array = NDArray[np.float64]
Run = Callable[..., tuple[int, str, str]]

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
THRESHOLDS, WEIGHTS = (0.0, 5.0, 15.0, 30.0, 45.0), (0.12, 0.03, 0.03, 0.02, 0.02)
NOISE = 0.01
OTHER = wander(99)
"""Drive over which fits are compared."""


def triangle(samples: int, period: float) -> Array:
    x = np.arange(samples) / period % 1.0
    return np.asarray(100.0 * np.where(x < 0.5, 2.0 * x, 2.0 - 2.0 * x))


def sine(samples: int, period: float, end: float = 1.0) -> Array:
    return np.asarray(50.0 - 50.0 * np.cos(2.0 * np.pi * np.arange(samples) / period) * np.linspace(1.0, end, samples))


DRIVES = {"lines": wander(4), "fading": sine(2000, 200, 0.3), "coarse": sine(150, 40), "coarser": triangle(100, 24)}


def output(v: Array, noise: float = NOISE) -> Array:
    return noisy(brute_output(v, THRESHOLDS, WEIGHTS, 0.0), noise)


def less(given: Record, samples: list[int]) -> Record:
    keep = np.setdiff1d(np.arange(len(given)), samples)
    assert given.y is not None
    return Record(given.name, given.t[keep], given.v[keep], given.y[keep], sample_time=given.sample_time)


def predicted(fit: Any) -> Array:
    part = fit.parameters.model.pi
    return brute_output(OTHER, part.thresholds, part.weights, 0.0)


def apart(one: Any, other: Any) -> float:
    """Largest difference between the predictions of two fits, as a share of their span."""
    a, b = predicted(one), predicted(other)
    return float(np.max(np.abs(a - b)) / np.ptp(a))


GIVEN: dict[str, Any] = {"history": [0.0], "thresholds": THRESHOLDS}


@functools.cache
def fit_without(name: str, k: int | None) -> Any:
    """The fit to the record of a drive without sample k, or with all; cached because many cases need the same one."""
    whole = record(DRIVES[name], output(DRIVES[name]))
    return hystgen.identify(whole if k is None else less(whole, [k]), **GIVEN)


@functools.cache
def shipped() -> Any:
    """The fit to the shipped recording."""
    _, v, y = columns(EXAMPLES / "stage_recording.csv")
    return hystgen.identify(record(v, y))


def row(fit: Any, part: str) -> Any:
    (found,) = [each for each in fit.rows if (each.part, each.model) == (part, "written")]
    return found


class TestOneWrongSample:
    @pytest.mark.slow(one_in=3)
    @pytest.mark.parametrize("name", DRIVES)
    @pytest.mark.parametrize("channel", ["v", "y"])
    @pytest.mark.parametrize("place", ["first", "second", "last but one", "last", "inside"])
    def test_the_fit_is_that_of_the_record_without_it(self, name: str, channel: str, place: str) -> None:
        v = DRIVES[name]
        y = output(v)
        rng = np.random.default_rng([len(name), len(channel), len(place)])
        for _ in range(3):
            inside, n = int(rng.integers(8, len(v) - 8)), len(v)
            k = {"first": 0, "second": 1, "last but one": n - 2, "last": n - 1, "inside": inside}[place]
            if place == "inside" and name == "coarser" and min(v[k], 100.0 - v[k]) < 20.0:
                k += 4  # deleting a tip would change the record
            by = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.4, 3.0))
            wrong = {"v": v.copy(), "y": y.copy()}
            wrong[channel][k] += by * np.ptp(wrong[channel])
            fit = hystgen.identify(record(wrong["v"], wrong["y"]), **GIVEN)
            # without its first drive the record would begin elsewhere
            clean = fit_without(name, None if (place, channel) == ("first", "y") else k)
            assert apart(fit, clean) < 0.005, (k, by)
            assert fit.parameters.input_range == pytest.approx(clean.parameters.input_range, abs=0.6), (k, by)
            figures = [row(each, "all").rms_percent for each in (fit, clean)]
            assert figures[0] == pytest.approx(figures[1], rel=0.15), (k, by)
            assert any("1 isolated sample" in text for text in fit.warnings)

    @pytest.mark.parametrize("place", [0, 1, -2, -1, 700])
    @pytest.mark.parametrize(("channel", "value"), [("v", 118.0), ("v", -30.0), ("y", 40.0), ("y", -200.0)])
    def test_of_the_shipped_recording(self, place: int, channel: str, value: float) -> None:
        _, v, y = (x.copy() for x in columns(EXAMPLES / "stage_recording.csv"))
        clean = shipped()
        {"v": v, "y": y}[channel][place] = value
        fit = hystgen.identify(record(v, y))
        assert fit.parameters.input_range == (0.0, 100.0)
        weights = [each.parameters.model.pi.weights for each in (fit, clean)]
        assert weights[0][0] == pytest.approx(weights[1][0], rel=0.003)
        assert row(fit, "all").rms_percent == pytest.approx(row(clean, "all").rms_percent, rel=0.01)
        assert fit.parameters.model.pi.weights[0] == pytest.approx(0.1195, rel=0.003)

    @pytest.mark.parametrize(("channel", "value"), [("v", 118.0), ("y", -200.0), ("y", 9.91e37), ("v", 1e300)])
    def test_in_a_held_out_record(self, channel: str, value: float) -> None:
        given, other = record(DRIVES["lines"], output(DRIVES["lines"])), wander(7)
        held = {"v": other.copy(), "y": output(other)}
        clean = hystgen.identify(given, holdout=record(held["v"], held["y"]))
        for k in (0, 1, 500, -2, -1):
            wrong = {name: x.copy() for name, x in held.items()}
            wrong[channel][k] = value
            fit = hystgen.identify(given, holdout=record(wrong["v"], wrong["y"]))
            assert {**vars(fit.parameters), "residual": None} == {**vars(clean.parameters), "residual": None}
            found, expected = row(fit, "held out"), row(clean, "held out")
            assert (found.rms, found.max) == pytest.approx((expected.rms, expected.max), rel=0.05)
            assert found.rms_percent == pytest.approx(expected.rms_percent, rel=0.05)
            assert not any("outside the fitted range" in text for text in fit.warnings)

    def test_a_pulse_that_the_output_follows_stays(self) -> None:
        """The output follows at once, or late behind a lag of several samples."""
        for k in (600, len(DRIVES["fading"]) - 60):
            for lag in (0.0, 0.5, 0.8):
                v = DRIVES["fading"].copy()
                v[k] = 118.0
                late = v.copy()
                for j in range(1, len(v)):
                    late[j] = lag * late[j - 1] + (1.0 - lag) * v[j]
                y = output(late)
                assert not faults.wrong_drive(v, y).any()
                (item,), _ = prepared.courses([record(v, y)], None, 0)
                assert np.array_equal(item.v, v)

    def test_the_row_that_was_wrong_is_no_part_of_any_verdict(self, tmp_path: Path) -> None:
        """A drive spike and an outlier in held-out records leave a diagnosis as it is."""
        hystgen.identify(record(DRIVES["lines"], output(DRIVES["lines"]))).write(tmp_path / "stage.yaml")
        drives = [wander(seed) for seed in (11, 12, 13)]
        clean = [record(v, output(v), f"r{k}") for k, v in enumerate(drives)]
        spoilt = [record(each.v.copy(), np.array(each.y), each.name) for each in clean]
        assert spoilt[2].y is not None
        spoilt[2].v[[0, 900]] = 140.0
        spoilt[2].y[[400, -1]] = -300.0
        one, other = (
            hystgen.diagnose(tmp_path / "stage.yaml", each[:2], holdout=each[2:]).content for each in (clean, spoilt)
        )
        assert one["verdict"] == other["verdict"]
        assert other["output_range"] == pytest.approx(one["output_range"], rel=3e-3)
        assert other["gap"]["after"]["holdout"] == pytest.approx(one["gap"]["after"]["holdout"], rel=0.02)
        faulty = [each for each in other["unexplained"] if each["kind"] == "isolated_samples"]
        assert [(each["record"], each["channel"], each["count"]) for each in faulty] == [("r2", "v", 2), ("r2", "y", 2)]


class TestOneWrongRow:
    """Drive and output are both wrong: a lost packet, a row of another time, exchanged cells, values at an end."""

    KINDS: ClassVar[dict[str, Callable[[Array, Array, int], tuple[float, float]]]] = {
        "zeros": lambda _v, _y, _k: (0.0, 0.0),
        "another's": lambda v, y, k: (v[k - 311], y[k - 311]),
        "exchanged": lambda v, y, k: (y[k], v[k]),
        "ends": lambda v, y, _k: (np.max(v), np.max(y)),
        "beyond": lambda v, y, _k: (np.max(v) + 0.3 * np.ptp(v), np.max(y) + 0.3 * np.ptp(y)),
    }

    @pytest.mark.slow(one_in=3)
    @pytest.mark.parametrize("name", ["lines", "fading"])
    @pytest.mark.parametrize("kind", KINDS)
    def test_the_fit_is_that_of_the_record_without_it(self, name: str, kind: str) -> None:
        """The row is inside a record, where a real pulse of the drive would have left its memory, or at its end."""
        v = DRIVES[name]
        y = output(v)
        rng = np.random.default_rng([len(name), len(kind)])
        n, tried = len(v), 0
        for k in (n - 1, n - 2, *rng.integers(320, n - 100, 24)):
            wrong_v, wrong_y = v.copy(), y.copy()
            wrong_v[k], wrong_y[k] = self.KINDS[kind](v, y, k)
            left = np.abs(output(wrong_v, 0.0) - output(v, 0.0))[k + 1 :]
            stands_apart = abs(wrong_v[k] - v[k]) > 0.3 * np.ptp(v)
            if not stands_apart or (k < n - 2 and np.count_nonzero(left > 10.0 * NOISE) < 20):
                continue
            tried += 1
            fit = hystgen.identify(record(wrong_v, wrong_y), **GIVEN)
            clean = fit_without(name, k)
            assert apart(fit, clean) < 0.005, k
            assert fit.parameters.input_range == pytest.approx(clean.parameters.input_range, abs=0.6), k
            figures = [row(each, "all").rms_percent for each in (fit, clean)]
            assert figures[0] == pytest.approx(figures[1], rel=0.15), k
            assert any("of v without a response in y, bridged" in text for text in fit.warnings), k
        assert tried > 2

    @pytest.mark.parametrize("history", [(0.0,), None])
    def test_at_the_end_it_hides_no_memory(self, history: tuple[float, ...] | None) -> None:
        """If the wrong drive, the largest, counted as real, the memory would be known only in the last rows."""
        v = DRIVES["fading"]
        y = output(v)
        clean = hystgen.identify(record(v[:-2], y[:-2]), history=history)
        for k in (len(v) - 1, len(v) - 2):
            wrong_v, wrong_y = v.copy(), y.copy()
            wrong_v[k], wrong_y[k] = 140.0, 30.0
            fit = hystgen.identify(record(wrong_v, wrong_y), history=history)
            assert apart(fit, clean) < 0.005
            assert fit.parameters.input_range == clean.parameters.input_range

    @pytest.mark.parametrize("name", ["lines", "fading"])
    def test_a_pulse_that_left_its_memory_stays(self, name: str) -> None:
        rng = np.random.default_rng(len(name))
        for k in rng.integers(320, len(DRIVES[name]) - 100, 6):
            v = DRIVES[name].copy()
            v[k] = rng.choice([0.0, 100.0, 125.0])
            courses, _ = prepared.courses([record(v, output(v))], (0.0,), 0)
            prepared.mask_outliers(courses, [], None, 0.05)
            assert np.array_equal(courses[0].v, v), k
            assert np.isfinite(courses[0].y).all(), k


class TestNoneInCleanRecords:
    @pytest.mark.slow(one_in=3)
    @pytest.mark.parametrize("noise", [0.0, 0.003, 0.1])
    @pytest.mark.parametrize("grain", [0.0, 0.08, 0.3])
    def test_of_all_kinds(self, noise: float, grain: float) -> None:
        """Triangles and sines of few samples, staircases, random drives and sweeps; fine and coarse converters."""
        rng = np.random.default_rng(5)
        t = np.arange(3000)
        drives = {
            **DRIVES,
            "few": triangle(20, 9),
            "staircase": np.repeat(rng.uniform(0.0, 100.0, 40), 50),
            "steps and lines": np.concatenate([wander(3), np.repeat([0.0, 80.0, 20.0, 100.0], 300)]),
            "random": rng.uniform(0.0, 100.0, 600),
            "multisine": 50.0 + 15.0 * sum(np.sin(2.0 * np.pi * t * f + rng.uniform(0, 6)) for f in (0.11, 0.23, 0.37)),
            "chirp": 50.0 - 50.0 * np.cos(2.0 * np.pi * t * t * 5e-5),
            "coarse drive": np.round(DRIVES["lines"] / 3.0) * 3.0,
        }
        for name, v in drives.items():
            y = output(np.asarray(v), noise)
            y = np.round(y / grain) * grain if grain else y
            (item,), reported = prepared.courses([record(np.asarray(v), y)], [0.0], 0)
            assert reported == [], name
            assert np.array_equal(item.v, v), name
            assert np.isfinite(item.y).all(), name
            courses = [item]
            prepared.mask_outliers(courses, [], None, 0.05)
            assert np.array_equal(courses[0].v, v), name
            assert np.isfinite(courses[0].y).all(), name

    def test_stick_slip_and_backlash(self) -> None:
        v = DRIVES["fading"]
        sticks = np.floor(output(v, 0.0) / 0.4) * 0.4 + np.random.default_rng(1).normal(0.0, NOISE, len(v))
        backlash = brute_output(v, (0.0, 8.0), (0.0, 0.2), 0.0)
        for y in (sticks, backlash):
            (item,), reported = prepared.courses([record(v, y)], [0.0], 0)
            assert reported == []
            assert np.isfinite(item.y).all()

    @pytest.mark.data
    def test_measured_ones(self, measured: Path) -> None:
        """No sample of the measured records or the examples is taken for wrong."""
        files = [*sorted(measured.glob("*.csv")), *sorted((measured / "more").glob("*.csv"))]
        assert len(files) > 3
        for path in [*files, *EXAMPLES.glob("*.csv")]:
            given = read_record(path)
            made, reported = prepared.courses([given], (0.0,), 0)
            assert reported == [], path.name
            assert all(np.isfinite(each.y).all() for each in made), path.name
            assert not any(faults.pulses(each.v) for each in made), path.name
            assert np.array_equal(np.concatenate([each.v for each in made]), given.v), path.name


class TestFigures:
    @pytest.mark.parametrize("value", [-200.0, 9.91e37, -9.9e37, -999999.0])
    def test_percentages_are_of_what_was_compared(self, value: float, tmp_path: Path, run: Run) -> None:
        """This holds in the table, in the comments of the file and in the summary of a fleet."""
        v, other = DRIVES["lines"], wander(7)
        clean, spoilt = output(v, 0.1), output(v, 0.1)
        spoilt[900] = value
        data, held = write_csv(tmp_path / "unit.csv", v, spoilt), write_csv(tmp_path / "held.csv", other, output(other))
        code, out, _ = run("identify", data, "--holdout", held, "-o", tmp_path / "unit.yaml", "--history=0")
        assert code == 0
        (line,) = [each.split() for each in out.splitlines() if each.startswith("fit ")]
        expected = 100.0 * float(line[4]) / float(np.ptp(np.delete(clean, 900)))
        assert float(line[5]) == pytest.approx(expected, rel=2e-3)
        assert f"rms {line[4]} ({float(line[5]):.3g} %)" in (tmp_path / "unit.yaml").read_text()
        code, *_ = run("identify", "--batch", data, "-o", tmp_path / "fleet", "--no-emit", "--history=0")
        with (tmp_path / "fleet" / "summary.csv").open(newline="") as stream:
            (unit,) = csv.DictReader(stream)
        assert code == 0
        expected = 100.0 * float(unit["fit_rms"]) / float(np.ptp(np.delete(clean, 900)))
        assert float(unit["fit_rms_percent"]) == pytest.approx(expected, rel=1e-4)

    def test_of_a_start_that_is_not_compared_nothing_counts(self) -> None:
        v = DRIVES["lines"]
        y = output(v)
        y[:5] += np.array([50.0, 40.0, 30.0, 20.0, 10.0])  # settles
        fit = hystgen.identify(record(v, y))
        found = row(fit, "all")
        (used,) = fit.used
        assert not used.compared[:5].any()
        assert found.output_range == pytest.approx(np.ptp(y[used.compared]), rel=1e-12)


class TestNoValue:
    @pytest.mark.parametrize(
        "value",
        [9.9e37, -9.9e37, 9.91e37, -9.91e37, 1e300, -1e30, 3.4e38, -999.0, -9999.0, 999999.0, -99999.9, 65535.0,
         -32768.0, 2147483647.0],
    )  # fmt: skip
    def test_whatever_its_sign_and_place(self, value: float) -> None:
        rng = np.random.default_rng(2)
        for places in ([0], [-1], [0, 1, 2, -1], [40, 60]):
            x = rng.normal(5.0, 1.0, 200)
            x[places] = value
            expected = np.zeros(200, dtype=bool)
            expected[places] = True
            assert np.array_equal(no_value(x), expected)

    def test_numbers_that_a_column_passes_are_values(self) -> None:
        ends = np.linspace(-40000.0, 40000.0, 9)
        for x in (np.arange(-1200.0, 1201.0), np.arange(0.0, 70000.0), ends, np.full(5, 999.0)):
            assert not no_value(x).any()
        for codes in ([0.0, 32767.0, -32768.0], [0.0] * 9 + [32767.0] * 9):
            assert not no_value(np.array(codes)).any()
        assert no_value(np.array([1.0, np.nan, np.inf])).tolist() == [False, True, True]

    @pytest.mark.slow(one_in=4)
    @pytest.mark.parametrize("value", ["9.91E+37", "-9.9E37", "-999999", "1e300"])
    @pytest.mark.parametrize("line", [2, 3, 1000, -1])
    @pytest.mark.parametrize("column", [1, 2])
    def test_in_a_file(self, value: str, line: int, column: int, tmp_path: Path, run: Run) -> None:
        lines = write_csv(tmp_path / "a.csv", DRIVES["lines"], output(DRIVES["lines"])).read_text().splitlines()
        cells = lines[line].split(",")
        cells[column] = value
        lines[line] = ",".join(cells)
        (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
        code, _, err = run("identify", tmp_path / "a.csv", "-o", tmp_path / "a.yaml", "--history=0")
        assert code == 0
        place = len(lines) if line < 0 else line + 1
        name = "vy"[column - 1]
        assert err == (
            f"warning: a.csv: 1 sample without a value in {name} ({float(value):.6g} in {name} counts as no "
            f"value) dropped, the first in line {place}"
        )
        low, high = written(tmp_path / "a.yaml")["input_range"]
        assert (low, high) == pytest.approx((0.0, 100.0), abs=3.0)


def scaled(channel: str, factor: float) -> Callable[[Array, Array], tuple[Array, Array]]:
    return lambda v, y: (v * factor, y) if channel == "v" else (v, y * factor)


class TestSizes:
    """Numbers of any size give a model or a message of one line, and nothing else on stderr."""

    @pytest.mark.slow(one_in=5)
    @pytest.mark.parametrize("command", ["identify", "diagnose"])
    @pytest.mark.parametrize(
        ("channel", "factor", "code"),
        [("y", 1e300, 2), ("v", 1e298, 2), ("y", 1e35, 2), ("v", 1e33, 2), ("y", 1e-300, 2), ("v", 1e-300, 2),
         ("y", 1e15, 0), ("v", 1e12, 0), ("y", 1e-15, 0), ("v", 1e-15, 0)],
    )  # fmt: skip
    def test_units(self, command: str, channel: str, factor: float, code: int, tmp_path: Path) -> None:
        v, y = scaled(channel, factor)(DRIVES["fading"] + 0.01, output(DRIVES["fading"]))
        data = write_csv(tmp_path / "a.csv", v, y)
        assert self.answer(command, data, tmp_path) == code

    @pytest.mark.parametrize("command", ["identify", "diagnose"])
    @pytest.mark.parametrize("level", [14.0, 9.0, 2.0, 0.05])
    def test_a_sensor_at_its_end(self, command: str, level: float, tmp_path: Path) -> None:
        """Part of the record is at the sensor's end, or most, or nearly all of it."""
        data = write_csv(tmp_path / "a.csv", DRIVES["fading"], np.minimum(output(DRIVES["fading"]), level))
        assert self.answer(command, data, tmp_path) == (0 if level > 5.0 else 2)

    def answer(self, command: str, data: Path, folder: Path) -> int:
        """Exit code of a command with RuntimeWarning as an error; a model that it writes can be loaded."""
        model, out = folder / "model.yaml", folder / "out"
        hystgen.identify(record(DRIVES["lines"], output(DRIVES["lines"]))).write(model)
        words = {"identify": ["identify", str(data), "-o", str(folder / "new.yaml")],
                 "diagnose": ["diagnose", str(model), str(data), "-o", str(out)]}[command]  # fmt: skip
        program = "import sys; from hystgen.cli import main; sys.exit(main(sys.argv[1:]))"
        done = subprocess.run(
            [sys.executable, "-W", "error::RuntimeWarning", "-c", program, *words], capture_output=True, text=True
        )
        said = [line for line in done.stderr.splitlines() if not line.startswith(("warning:", "compiling"))]
        assert "unexpected" not in done.stderr
        assert "validation error" not in done.stderr
        if done.returncode == 0:
            assert said == []
            hystgen.load(folder / "new.yaml" if command == "identify" else out / "params.yaml")
        else:
            assert len(said) == 1, "\n".join(said)
            assert "error: " in said[0]
        return done.returncode

    def test_records_in_memory(self) -> None:
        """Without a file no sample is dropped on reading; the fit leaves them out itself."""
        v, y = DRIVES["fading"], output(DRIVES["fading"])
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            clean = hystgen.identify(record(v, y), history=[0.0])
            for k in (0, 77, -1):
                for value in (1e300, -1e300, 9.91e37):
                    for channel in ("v", "y"):
                        wrong = {"v": v.copy(), "y": y.copy()}
                        wrong[channel][k] = value
                        fit = hystgen.identify(record(wrong["v"], wrong["y"]), history=[0.0])
                        assert apart(fit, clean) < 0.005
            with pytest.raises(IdentificationError, match=r"2000 of 2000 samples of y stand for a missing .*convert y"):
                hystgen.identify(record(v, (y + 10.0) * 1e300))


class TestConverterAtItsEnd:
    @pytest.mark.parametrize("level", [18.0, 12.0])
    def test_identify_leaves_it_out(self, level: float) -> None:
        """The model is that of the record without those samples, and its range ends where the sensor did."""
        v = DRIVES["fading"]
        y = output(v)
        fit = hystgen.identify(record(v, np.minimum(y, level)), thresholds=THRESHOLDS, history=[0.0])
        at = np.flatnonzero(y >= level)
        (used,) = fit.used
        assert used.stretches.tolist() == at.tolist()
        assert any(f"{len(at)} samples of y at the limit of the converter" in text for text in fit.warnings)
        assert fit.parameters.model.pi.weights[:2] == pytest.approx(WEIGHTS[:2], abs=0.003)
        assert fit.parameters.input_range[1] == np.max(v[y < level])

    @pytest.mark.parametrize(("low", "high"), [(6.0, 12.0), (6.0, 8.0), (12.0, 18.0)])
    def test_both_ends(self, low: float, high: float) -> None:
        """Samples at one end do not hide those at the other, however many they are."""
        v = DRIVES["fading"]
        y = output(v)
        fit = hystgen.identify(record(v, np.clip(y, low, high)), thresholds=THRESHOLDS, history=[0.0])
        (used,) = fit.used
        assert used.stretches.tolist() == np.flatnonzero((y <= low) | (y >= high)).tolist()
        for count, end in ((np.count_nonzero(y >= high), "largest"), (np.count_nonzero(y <= low), "least")):
            said = f"{count} samples of y at the limit of the converter, the {end}"
            assert any(said in text for text in fit.warnings)
        assert fit.rows[0].rms < 0.01 * (high - low)

    def test_backlash_is_none(self) -> None:
        """With backlash too the output stands at its largest value while the drive moves."""
        v = DRIVES["fading"]
        y = brute_output(v, (0.0, 20.0), (0.0, 0.2), 0.0)
        fit = hystgen.identify(record(v, y), thresholds=[0.0, 20.0], history=[0.0])
        assert fit.used[0].compared.all()
        assert fit.parameters.model.pi.weights == pytest.approx((0.0, 0.2), abs=1e-9)


class TestTanh:
    def test_no_shape_divides_by_zero(self) -> None:
        """Within the bounds a branch may be flat to the last digit and have no length; its slack is then negative."""
        rng = np.random.default_rng(3)
        for branches in (1, 2):
            front = Tanh((0.0, 3.6), branches)
            low, high = front.bounds
            for _ in range(3000):
                shape = rng.uniform(low, high)
                slack = front.slack(shape)
                assert np.isfinite(slack).all()
                flat = any(shape[2 * b] * (1.0 + abs(shape[2 * b + 1])) > 3.0 for b in range(branches))
                assert (np.min(slack[:branches]) < 0.0) == flat

    def test_a_nominal_front_is_met_or_kept(self) -> None:
        """A search begins at the nominal front, or the front is kept unchanged if no search may begin there."""
        rng = np.random.default_rng(4)
        searched = 0
        for _ in range(300):
            size, curvature = rng.uniform(5.0, 40.0, 2), 10.0 ** rng.uniform(-2.0, 1.0, 2)
            up, down = ((size[k], curvature[k], rng.uniform(-4.0, 4.0), 0.0) for k in (0, 1))
            stage = TanhEnvelope(up, down if rng.random() < 0.5 else None)
            front, shape = hypothesis.front_of([stage], (0.0, 3.6))
            (made,) = front.stages(shape)
            assert isinstance(made, TanhEnvelope)
            searched += isinstance(front, Tanh)
            if not isinstance(front, Tanh):
                assert made == stage
        assert 20 < searched < 280

    def test_intervals_of_a_front_at_its_limit(self) -> None:
        """Shapes drawn around a barely admissible one are moved to admissible ones."""
        front = Tanh((0.0, 3.6), 2)
        shape = front.doubled(np.array([0.1, 5.9]))

        class Found:
            structure = front

        Found.shape = shape  # type: ignore[attr-defined]
        rng = np.random.default_rng(6)
        low, high = front.bounds
        for _ in range(200):
            drawn = np.clip(shape + rng.normal(0.0, 4.0, len(shape)), low, high)
            near = fits._admissible(Found, drawn)  # type: ignore[arg-type]
            assert np.all(front.slack(near) >= np.minimum(front.slack(shape), 0.0))
            front.stages(near)


class TestInverse:
    """Every model that `diagnose` writes can be inverted, or a warning says why not."""

    def nominal_model(self, folder: Path) -> Path:
        hystgen.identify(record(DRIVES["lines"], output(DRIVES["lines"]))).write(folder / "stage.yaml")
        return folder / "stage.yaml"

    def test_p_0_is_raised_where_the_records_hardly_tell(self, tmp_path: Path, run: Run) -> None:
        """The plant has p_0 = 0 but a play with a small threshold, and noise hides the difference."""
        rng, paths = np.random.default_rng(8), []
        for k in range(3):
            v = wander(20 + k)
            whole = brute_output(v, (0.0, 2.0, 15.0, 30.0), (0.0, 0.12, 0.05, 0.04), 0.0)
            paths.append(write_csv(tmp_path / f"r{k}.csv", v, whole + rng.normal(0.0, 0.4, len(v))))
        out = tmp_path / "out"
        words = [self.nominal_model(tmp_path), *paths[:2], "--holdout", paths[2], "-o", out, "--history=0"]
        code, _, err = run("diagnose", *words)
        assert code == 0
        content = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
        weights = np.array(written(tmp_path / "out" / "params.yaml")["model"]["pi"]["weights"])
        assert weights[0] == pytest.approx(0.05 * np.sum(weights), rel=1e-6)
        (said,) = content["inverse"]["warnings"]
        assert content["inverse"]["exists"]
        assert re.match(rf"p_0 was raised from \S+ to {weights[0]:.3g} so that the model has a usable inverse", said)
        assert f"warning: {said}" in err.splitlines()
        assert said in (tmp_path / "out" / "report.html").read_text()
        assert "p_0 was raised" in (tmp_path / "out" / "params.yaml").read_text()
        low, high = hystgen.load(tmp_path / "out" / "params.yaml").cascade.output_range
        u = np.linspace(low, high, 50)
        drive = hystgen.load(tmp_path / "out" / "params.yaml").inverse().simulate(u)
        assert np.isfinite(drive).all()

    def test_real_backlash_is_said_loudly(self, tmp_path: Path, run: Run) -> None:
        paths = []
        for k in range(3):
            v = wander(30 + k)
            y = noisy(brute_output(v, (0.0, 8.0, 20.0), (0.0, 0.12, 0.08), 0.0), 0.005, k)
            paths.append(write_csv(tmp_path / f"r{k}.csv", v, y))
        out = tmp_path / "out"
        words = [self.nominal_model(tmp_path), *paths[:2], "--holdout", paths[2], "-o", out, "--history=0"]
        code, _, err = run("diagnose", *words)
        assert code == 0
        content = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
        assert not content["inverse"]["exists"]
        (said,) = content["inverse"]["warnings"]
        assert said.startswith("p_0 is 0: after each reversal the output does not move (series backlash). The mod")
        assert f"warning: {said}" in err.splitlines()
        page = (tmp_path / "out" / "report.html").read_text()
        assert page.index("About the inverse: p_0 is 0") < page.index("How the gap shrinks")
        with pytest.raises(hystgen.NotInvertibleError):
            hystgen.load(tmp_path / "out" / "params.yaml").inverse()

    def test_the_gap_is_that_of_the_model_that_is_written(self, tmp_path: Path) -> None:
        rng, records = np.random.default_rng(8), []
        for k in range(3):
            v = wander(20 + k)
            y = brute_output(v, (0.0, 2.0, 15.0, 30.0), (0.0, 0.12, 0.05, 0.04), 0.0) + rng.normal(0.0, 0.4, len(v))
            records.append(record(v, y, f"r{k}"))
        found = hystgen.diagnose(self.nominal_model(tmp_path), records[:2], holdout=records[2:], history=[0.0])
        part = found.parameters.model.pi
        assert found.verdict == "nothing_missing"
        errors = []
        for each in records[2:]:
            error = np.asarray(each.y) - brute_output(each.v, part.thresholds, part.weights, 0.0)
            errors.append(error - error.mean())
        rms = float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
        assert found.content["gap"]["after"]["holdout"] == pytest.approx(rms, rel=1e-6)
        assert found.content["gap"]["refitted"] == found.content["gap"]["after"]


def test_a_false_history_that_the_fit_could_bend_to(tmp_path: Path) -> None:
    """The model is not bent to fit starts that the history spoils; it is fitted to samples that do not depend on it."""
    hystgen.identify(record(DRIVES["lines"], output(DRIVES["lines"]))).write(tmp_path / "stage.yaml")
    virgin = []
    for k in range(4):
        v = np.concatenate([np.linspace(0.0, 90.0, 400), wander(40 + k, turns=12)])
        virgin.append(record(v, output(v, 0.02), f"r{k}"))
    right, false, none = (
        hystgen.diagnose(tmp_path / "stage.yaml", virgin[:3], holdout=virgin[3:], history=history).content
        for history in ([0.0], [100.0, 0.0], None)
    )
    assert [each["kind"] for each in right["unexplained"]] == []
    assert [each["kind"] for each in false["unexplained"]] == ["history"]
    assert false["gap"] == none["gap"]


def test_what_a_file_without_values_is_called(tmp_path: Path) -> None:
    v, y = DRIVES["fading"], output(DRIVES["fading"])
    with pytest.raises(RecordError, match=r"2000 of 2000 samples are without a value.*such as .* count as no value"):
        read_record(write_csv(tmp_path / "a.csv", v, (y + 10.0) * 1e300))
    with pytest.raises(IdentificationError, match=r"y moves by .* which is too little in any unit; convert it"):
        prepared.course_of(record(v, y * 1e-300), None, 0)
