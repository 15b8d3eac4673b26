"""Identification compared with brute force, other solvers, other plants, and measured records.

Expected values are computed here, by loops and relays that share no code with the package.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from recordings import (
    brute_output,
    brute_plays,
    columns,
    error_figures,
    first_exact,
    noisy,
    part_of_file,
    record,
    wander,
    write_csv,
    written,
)
from scipy.optimize import lsq_linear, minimize

import hystgen
from hystgen.basics.problems import NotInvertibleError
from hystgen.identification import Fit, IdentificationError, identifier_from
from hystgen.records import Record, RecordError
from hystgen.verification import compilers

Array = NDArray[np.float64]
Run = Callable[..., tuple[int, str, str]]

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"

THRESHOLDS = (0.0, 4.0, 9.0, 17.0, 30.0, 38.0)
WEIGHTS = (0.05, 0.02, 0.04, 0.01, 0.03, 0.02)


# -- plants, drives and brute force ------------------------------------------------------------------------------------


def relay_output(v: Array, thresholds: Sequence[float], weights: Sequence[float], low: float, high: float) -> Array:
    """A plane of relays: for each half width r, relays that switch up at c + r and down at c - r, all down at first.

    They are one grid step apart in c, so that a play of threshold r is matched to within half a step.
    """
    step = 0.05
    y = np.zeros(len(v))
    for r, p in zip(thresholds, weights, strict=True):
        centre = np.arange(low - r + step / 2.0, high + r, step)
        up = np.zeros(len(centre), dtype=bool)
        for k, x in enumerate(v.tolist()):
            up |= x >= centre + r
            up &= ~(x <= centre - r)
            y[k] += p * step * np.count_nonzero(up)
    return y


def fitted(fit: Fit) -> tuple[Array, Array]:
    part = fit.parameters.model.pi
    return np.array(part.thresholds), np.array(part.weights)


def row(fit: Fit, part: str, model: str = "written") -> Any:
    (found,) = [r for r in fit.rows if (r.part, r.model) == (part, model)]
    return found


def table_of(out: str) -> dict[str, dict[str, str]]:
    """The fit table as printed, for the written model: part -> column -> cell."""
    lines = out.splitlines()
    head = lines[0].split()
    assert head == ["part", "model", "samples", "ignored", "rms", "rms", "%", "max", "max", "%", "records"]
    found = {}
    for line in lines[1:]:
        cells = line.rsplit(None, 8) if "  " in line else []
        if len(cells) == 9 and cells[1] == "written":
            names = ("part", "model", "samples", "ignored", "rms", "rms %", "max", "max %", "records")
            found[cells[0].strip()] = dict(zip(names, cells, strict=True))
    return found


def check_predicts(path: Path, data: Path, skip: int = 0) -> tuple[float, float, float]:
    """Error figures of the written model on a file, run freely by brute force from rest at the first drive."""
    pi = written(path)["model"]["pi"]
    _, v, y = columns(data)
    first = max(first_exact(v, pi["thresholds"][-1]), skip)
    return error_figures(y, brute_output(v, pi["thresholds"], pi["weights"], float(v[0])), first)


def check_verifies(path: Path) -> None:
    """The C of the identified model gives the bits of the reference."""
    compiler = compilers.available()[0].name
    report = hystgen.verify(hystgen.load(path), operator="both", compiler=(compiler,), length=5000)
    assert report.ok, report.table()
    assert {line.operator for line in report.rows} == {"forward", "inverse"}


# -- measured records --------------------------------------------------------------------------------------------------


@pytest.mark.data
class TestMeasured:
    def test_flexure_stage(self, measured: Path, tmp_path: Path, run: Run) -> None:
        """P-885 stack, fitted to a sine and judged on a fading sine and hold, both without their start-up transient."""
        data = part_of_file(measured / "p885_sine_1hz.csv", tmp_path / "sine.csv", 300)
        held = part_of_file(measured / "p885_fades_and_hold.csv", tmp_path / "fades.csv", 300)
        target = tmp_path / "p885.yaml"
        code, out, err = run("identify", data, "--holdout", held, "-o", target)
        assert code == 0, err
        assert len(written(target)["model"]["pi"]["weights"]) <= 13
        figures = check_predicts(target, held)
        assert figures[2] <= 1.5
        printed = table_of(out)["held out"]
        assert float(printed["rms"]) == pytest.approx(figures[0], rel=1e-3)
        assert float(printed["max"]) == pytest.approx(figures[1], rel=1e-3)
        assert float(printed["rms %"]) == pytest.approx(figures[2], abs=6e-4)
        assert check_predicts(target, measured / "p885_fades_and_hold.csv")[2] <= 1.5
        assert written(target)["input_range"] == [0.0, 3.6]
        assert hystgen.load(target).cascade.pi.weights[0] > 0.0
        check_verifies(target)

    def test_flexure_stage_beyond_the_fitted_range(self, measured: Path, tmp_path: Path, run: Run) -> None:
        """A play near the largest drive seen must not get a weight that ruins a slightly larger motion."""
        data = part_of_file(measured / "p885_fades_and_hold.csv", tmp_path / "fades.csv", 300)
        larger = part_of_file(measured / "p885_sine_1hz.csv", tmp_path / "sine.csv", 300)
        target = tmp_path / "p885.yaml"
        code, _, err = run("identify", data, "--holdout", larger, "-o", target, "--thresholds", 24)
        assert code == 0, err
        _, v, _ = columns(data)
        low, high = written(target)["input_range"]
        assert (low, high) == (v.min(), v.max())
        beyond = int(np.sum((columns(larger)[1] < low) | (columns(larger)[1] > high)))
        assert beyond > 1000
        assert f"sine.csv: {beyond} samples have a drive outside the fitted range" in err
        assert check_predicts(target, larger)[2] <= 1.5

    def test_150_v_actuator(self, measured: Path, tmp_path: Path, run: Run) -> None:
        """Fitted to two periods of a sine after a step that rings, and compared with the later periods."""
        source = measured / "piezo_150v_step_then_1hz.csv"
        data = part_of_file(source, tmp_path / "first.csv", 17500, 27500)
        held = part_of_file(source, tmp_path / "later.csv", 27500)
        target = tmp_path / "piezo.yaml"
        code, out, err = run("identify", data, "--holdout", held, "-o", target)
        assert code == 0, err
        figures = check_predicts(target, held)
        assert figures[2] <= 0.25
        assert float(table_of(out)["held out"]["rms %"]) == pytest.approx(figures[2], abs=6e-4)
        check_verifies(target)

    def test_150_v_actuator_in_one_file(self, measured: Path, tmp_path: Path, run: Run) -> None:
        """--skip leaves out the rest, the step and its ringing, which still move the plays."""
        source = measured / "piezo_150v_step_then_1hz.csv"
        data = part_of_file(source, tmp_path / "first.csv", 0, 27500)
        held = part_of_file(source, tmp_path / "later.csv", 27500)
        target = tmp_path / "piezo.yaml"
        code, _, err = run("identify", data, "--skip", 3.5, "-o", target)
        assert code == 0, err
        assert check_predicts(target, held)[2] <= 0.25


# -- weights -----------------------------------------------------------------------------------------------------------


def centred_system(parts: Sequence[tuple[Array, Array]], thresholds: Sequence[float]) -> tuple[Array, Array]:
    """Plays and outputs of several pieces, less the mean of each piece, which stands for its free offset."""
    a = np.concatenate([plays - plays.mean(axis=0) for plays, _ in parts])
    b = np.concatenate([y - y.mean() for _, y in parts])
    assert a.shape == (len(b), len(thresholds))
    return a, b


class TestWeights:
    @pytest.mark.parametrize("history", [None, (80.0, -20.0)])
    def test_least_squares_solution_of_another_solver(self, history: tuple[float, ...] | None) -> None:
        """Two records have separate offsets and some constraints are active; the optimality conditions hold too."""
        # Plays 2 and 4 pull the other way, which a model with non-negative weights cannot follow
        crooked = (0.05, 0.02, -0.03, 0.05, -0.02, 0.06)
        before = 0.0 if history is None else brute_plays(history, THRESHOLDS, 0.0)[-1]
        records, parts = [], []
        for seed, offset in ((1, 5.0), (2, -40.0)):
            v = wander(seed)
            plays = brute_plays(v, THRESHOLDS, before)
            y = noisy(plays @ np.array(crooked) + offset, 0.02, seed)
            first = first_exact(v, THRESHOLDS[-1]) if history is None else 0
            records.append(record(v, y))
            parts.append((plays[first:], y[first:]))
        fit = hystgen.identify(records, thresholds=THRESHOLDS, history=history, p0_floor=0.0, holdout=records[:1])
        assert fit.rows[0].samples == sum(len(y) for _, y in parts)
        a, b = centred_system(parts, THRESHOLDS)
        p = fitted(fit)[1]
        expected = lsq_linear(a, b, bounds=(0.0, np.inf), tol=1e-14, method="bvls").x
        assert np.sum(expected == 0.0) >= 1
        assert np.sum(expected > 0.0) >= 3
        assert p == pytest.approx(expected, rel=1e-7, abs=1e-12)
        gradient = a.T @ (a @ p - b) / (np.linalg.norm(a, axis=0) * np.linalg.norm(b))
        assert np.abs(gradient[p > 0.0]).max() < 1e-8
        assert gradient[p == 0.0].min() > 0.0
        assert row(fit, "fit").rms == pytest.approx(float(np.sqrt(np.mean((a @ p - b) ** 2))), rel=1e-9)

    def test_known_plant_of_relays(self) -> None:
        v = wander(3, turns=40)
        y = relay_output(v, THRESHOLDS, WEIGHTS, 0.0, 100.0)
        fit = hystgen.identify(record(v, y + 7.0), thresholds=THRESHOLDS, holdout=record(v, y))
        assert fitted(fit)[1] == pytest.approx(WEIGHTS, rel=0.01)
        assert row(fit, "fit").rms_percent < 0.05

    def test_known_plant_with_noise(self) -> None:
        """Each weight is within five standard deviations, which come from the covariance of the data."""
        sigma = 0.02
        v = wander(4)
        plays = brute_plays(v, THRESHOLDS, 0.0)
        y = noisy(plays @ np.array(WEIGHTS), sigma)
        fit = hystgen.identify(record(v, y), thresholds=THRESHOLDS, history=())
        a, _ = centred_system([(plays, y)], THRESHOLDS)
        deviation = sigma * np.sqrt(np.diag(np.linalg.inv(a.T @ a)))
        assert deviation.max() < 0.05 * min(WEIGHTS)
        assert np.all(np.abs(fitted(fit)[1] - WEIGHTS) < 5.0 * deviation)
        assert row(fit, "all").rms == pytest.approx(sigma, rel=0.05)

    def test_known_plant_with_thresholds_of_our_own_choice(self) -> None:
        v = wander(5, turns=120)
        fit = hystgen.identify(record(v, noisy(brute_output(v, THRESHOLDS, WEIGHTS, 0.0), 0.01)))
        r, p = fitted(fit)
        assert p.min() > 0.0  # a play without weight is not a part of the model
        other = wander(6)
        y = brute_output(other, THRESHOLDS, WEIGHTS, 0.0)
        first = first_exact(other, float(r[-1]))
        assert error_figures(y, brute_output(other, r, p, float(other[0])), first)[2] < 0.25
        # the initial loading curve, integral of the slopes
        x = np.linspace(0.0, 40.0, 81)
        curve, known = (
            np.maximum(x[:, None] - np.array(places), 0.0) @ np.array(slopes)
            for places, slopes in ((r, p), (THRESHOLDS, WEIGHTS))
        )
        assert np.max(np.abs(curve - known)) < 0.01 * known[-1]

    @pytest.mark.parametrize("scale", [1e-15, 1e-6, 1e9])
    @pytest.mark.parametrize("volts", [1e-6, 1.0, 1e6])
    def test_units_do_not_matter(self, volts: float, scale: float) -> None:
        v = wander(7, turns=20)
        y = noisy(brute_output(v, THRESHOLDS, WEIGHTS, 0.0), 0.05)
        plain, other = hystgen.identify(record(v, y)), hystgen.identify(record(v * volts, y * scale))
        (r, p), (r_other, p_other) = fitted(plain), fitted(other)
        assert r_other == pytest.approx(r * volts, rel=1e-5)
        assert p_other == pytest.approx(p * scale / volts, rel=1e-4, abs=1e-6 * scale / volts * p.sum())
        assert [x.rms_percent for x in other.rows] == pytest.approx([x.rms_percent for x in plain.rows], rel=1e-4)

    def test_a_small_p0_is_raised_where_the_data_hardly_tell(self) -> None:
        """The fit is the best one under p_0 >= 5 % of the sum, as found by a general minimiser."""
        v = wander(8)
        plays = brute_plays(v, THRESHOLDS, 0.0)
        y = noisy(plays @ np.array((0.0, *WEIGHTS[1:])), 0.2)
        fit = hystgen.identify(record(v, y), thresholds=THRESHOLDS, history=())
        free = hystgen.identify(record(v, y), thresholds=THRESHOLDS, history=(), p0_floor=0.0)
        p, p_free = fitted(fit)[1], fitted(free)[1]
        assert p_free[0] < 0.04 * p_free.sum()
        assert p[0] == pytest.approx(0.05 * p.sum(), rel=1e-6)
        a, b = centred_system([(plays, y)], THRESHOLDS)
        gram, right = a.T @ a / len(b), a.T @ b / len(b)

        def cost(x: Array) -> float:
            return float(x @ gram @ x - 2.0 * right @ x + b @ b / len(b))

        best = minimize(
            cost,
            np.full(len(p), 0.02),
            jac=lambda x: 2.0 * (gram @ x - right),
            bounds=[(0.0, None)] * len(p),
            constraints={"type": "ineq", "fun": lambda x: x[0] - 0.05 * x.sum()},
            method="SLSQP",
            options={"ftol": 1e-15, "maxiter": 1000},
        )
        assert cost(p) == pytest.approx(best.fun, rel=1e-7)
        assert np.sqrt(cost(p)) <= 1.05 * np.sqrt(cost(p_free))
        (warned,) = [text for text in fit.warnings if "p_0" in text]
        assert warned.startswith(f"p_0 was raised from {p_free[0]:.3g} to {p[0]:.3g} so that the model has a usable")
        assert not any("raised" in text for text in free.warnings)

    @pytest.mark.parametrize("sigma", [0.0, 0.02])
    def test_real_backlash_stays(self, sigma: float, tmp_path: Path) -> None:
        """Raising p_0 to 5 % would cost a third more error here."""
        v = wander(8)
        y = noisy(brute_output(v, THRESHOLDS, (0.0, *WEIGHTS[1:]), 0.0), sigma)
        fit = hystgen.identify(record(v, y), thresholds=THRESHOLDS, history=())
        assert fitted(fit)[1][0] == 0.0
        (warned,) = fit.warnings
        assert warned.startswith("p_0 is 0: after each reversal the output does not move")
        fit.write(tmp_path / "a.yaml")
        with pytest.raises(NotInvertibleError):
            hystgen.load(tmp_path / "a.yaml").inverse()

    def test_a_small_p0_that_the_data_show_is_told(self) -> None:
        v = wander(8)
        y = brute_output(v, THRESHOLDS, (0.0005, *WEIGHTS[1:]), 0.0)
        fit = hystgen.identify(record(v, y), thresholds=THRESHOLDS, history=())
        assert fitted(fit)[1][0] == pytest.approx(0.0005, rel=1e-5)
        assert fit.warnings == ("p_0 is small: the inverse amplifies small movements 241 times as much as large ones",)

    def test_output_that_falls_with_the_drive_is_refused(self) -> None:
        v = wander(8)
        with pytest.raises(IdentificationError, match="y does not rise with v; if the sensor counts the other way"):
            hystgen.identify(record(v, -brute_output(v, THRESHOLDS, WEIGHTS, 0.0)))


class TestThresholds:
    @pytest.mark.parametrize("count", [None, 40])
    @pytest.mark.parametrize("history", [None, (), (60.0, -90.0)])
    @pytest.mark.parametrize("shape", ["sine", "offset sine", "wander", "growing"])
    def test_every_play_moves(self, shape: str, history: tuple[float, ...] | None, count: int | None) -> None:
        """By brute force, every play travels over 15 % of the drive's range or more within the samples compared."""
        k = np.arange(1200)
        v = {
            "sine": 50.0 * np.sin(k / 40.0),
            "offset sine": 900.0 + 50.0 * np.sin(k / 40.0),
            "wander": wander(11, -30.0, 50.0, turns=31),
            "growing": k / 24.0 * np.sin(k / 40.0),
        }[shape]
        y = noisy(brute_output(v, (0.0, 5.0, 20.0), (0.5, 0.3, 0.2), float(v[0])), 0.05)
        fit = hystgen.identify(record(v, y), history=history, thresholds=count)
        r, p = fitted(fit)
        assert r[0] == 0.0
        assert np.all(np.diff(r) > 0.0)
        assert len(p) == len(r)
        assert count is None or len(r) == count + 1
        first = first_exact(v, float(r[-1])) if history is None else 0
        assert row(fit, "all").ignored == (0 if shape == "growing" else first)  # `growing`: the start is estimated
        states = brute_plays(history or [0.0], r, 0.0)[-1] if history is not None else float(v[0])
        moved = np.ptp(brute_plays(v, r, states)[first:], axis=0)
        assert moved.min() >= 0.149 * np.ptp(v[first:])
        if history is None:
            assert r[-1] <= 0.43 * np.ptp(v)

    def test_fewest_plays_that_do(self) -> None:
        """A plant of two plays is fitted with few plays."""
        v = wander(12)
        y = noisy(brute_output(v, (0.0, 10.0), (0.5, 0.5), 0.0), 0.5)
        assert len(fitted(hystgen.identify(record(v, y)))[0]) - 1 <= 8

    @pytest.mark.parametrize("count", [0, 1, 5, 24])
    def test_number_given_on_the_command_line(self, count: int, tmp_path: Path, run: Run) -> None:
        target = tmp_path / "a.yaml"
        code, out, err = run("identify", EXAMPLES / "stage_recording.csv", "-o", target, "--thresholds", count)
        assert code == 0, err
        pi = written(target)["model"]["pi"]
        assert len(pi["thresholds"]) == len(pi["weights"]) == count + 1
        assert pi["thresholds"][0] == 0.0
        assert f"{count} play{'' if count == 1 else 's'}. Errors of a free run" in out

    @pytest.mark.parametrize("wanted", [-1, 1001, 2.5, True, "8", [0.0, 2.0, 2.0], [-1.0, 2.0], [0.0, float("nan")]])
    def test_unusable(self, wanted: Any) -> None:
        with pytest.raises(ValueError, match="threshold"):
            hystgen.identify(record(wander(1), wander(1)), thresholds=wanted)


# -- start memory and offsets ------------------------------------------------------------------------------------------


class TestStartMemory:
    @pytest.mark.parametrize("history", [(), (0.0,), (50.0,), (100.0, -100.0), (5.0, -9.0, 3.0), (-35.0, 60.0, -8.0)])
    def test_history_is_walked_through(self, history: tuple[float, ...], tmp_path: Path, run: Run) -> None:
        """The memory written is that of virgin plays after the history, and the fit starts from it."""
        before = brute_plays([0.0, *history], THRESHOLDS, 0.0)[-1]
        v = wander(13, -60.0, 80.0)
        y = brute_output(v, THRESHOLDS, WEIGHTS, before) + 3.25
        fit = hystgen.identify(record(v, y), thresholds=THRESHOLDS, history=history)
        assert fitted(fit)[1] == pytest.approx(WEIGHTS, rel=1e-8)
        assert row(fit, "all").ignored == 0
        assert row(fit, "all").max < 1e-7
        fit.write(tmp_path / "a.yaml")
        content = written(tmp_path / "a.yaml")
        state = content["model"]["pi"].get("initial_state", 0.0)
        states = state if isinstance(state, list) else [state] * len(before)
        assert states[1:] == pytest.approx(before[1:], abs=1e-12)
        assert content["model"]["output_offset"] == pytest.approx(3.25, abs=1e-7)
        model = hystgen.load(tmp_path / "a.yaml")
        assert not model.cascade.pi.projected
        assert np.max(np.abs(model.simulate(v) - y)) < 1e-6
        if history:
            data = write_csv(tmp_path / "a.csv", v, y)
            text = ",".join(str(x) for x in history)
            code, _, err = run("identify", data, "--history", text, "-o", tmp_path / "b.yaml", "--thresholds", 6)
            assert code == 0, err
            pi = written(tmp_path / "b.yaml")["model"]["pi"]
            expected = brute_plays(history, pi["thresholds"], 0.0)[-1]
            found = pi.get("initial_state", 0.0)
            assert (found[1:] if isinstance(found, list) else [found] * 6) == pytest.approx(expected[1:], abs=1e-12)

    def test_every_record_begins_with_the_history(self) -> None:
        history = (70.0, -50.0)
        before = brute_plays(history, THRESHOLDS, 0.0)[-1]
        drives = [wander(seed, -60.0, 80.0, turns=12) for seed in (14, 15)]
        records = [record(v, brute_output(v, THRESHOLDS, WEIGHTS, before) + 4.0 * k) for k, v in enumerate(drives)]
        fit = hystgen.identify(records, thresholds=THRESHOLDS, history=history)
        assert row(fit, "all").max < 1e-7
        assert fit.parameters.model.output_offset == pytest.approx(0.0, abs=1e-7)

    def test_a_history_that_cannot_be_is_told(self) -> None:
        v = wander(16)
        y = noisy(brute_output(v, THRESHOLDS, WEIGHTS, brute_plays([-100.0], THRESHOLDS, 0.0)[-1]), 0.001)
        right = hystgen.identify(record(v, y), thresholds=THRESHOLDS, history=(-100.0,))
        wrong = hystgen.identify(record(v, y), thresholds=THRESHOLDS, history=(150.0,))
        assert not any("the history may be wrong" in text for text in right.warnings)
        assert any(text.startswith("history goes to -100, outside the drive of all") for text in right.warnings)
        assert any("the history may be wrong" in text for text in wrong.warnings)

    @pytest.mark.parametrize("start", [-38.0, 0.0, 25.0])
    def test_unknown_start_is_ignored(self, start: float) -> None:
        """The model depends neither on the plant's start memory nor on the output before that memory was wiped out."""
        places = [40.0, 60.0, 20.0, 100.0, 0.0, 75.0, 10.0, 90.0, 45.0, 55.0, 5.0, 100.0, 0.0, 50.0]
        v = np.interp(np.arange(521) / 40.0, np.arange(14), places)
        memory = [min(max(start, v[0] - r), v[0] + r) for r in THRESHOLDS]
        y = brute_output(v, THRESHOLDS, WEIGHTS, memory) + 2.0
        settled = first_exact(v, THRESHOLDS[-1])
        assert v[settled] == pytest.approx(96.0)  # the rise from 20 has swept twice the largest threshold
        fit = hystgen.identify(record(v, y), thresholds=THRESHOLDS, holdout=record(v, y))
        assert row(fit, "fit").ignored == row(fit, "held out").ignored == settled
        assert row(fit, "fit").samples == len(v) - settled
        assert fitted(fit)[1] == pytest.approx(WEIGHTS, rel=1e-8)
        assert fit.parameters.model.output_offset == pytest.approx(2.0, abs=1e-7)
        assert fit.parameters.model.pi.initial_state == 0.0
        garbage = y.copy()
        garbage[:settled] = 1e3
        again = hystgen.identify(record(v, garbage), thresholds=THRESHOLDS, holdout=record(v, y))
        assert again.parameters == fit.parameters
        garbage[settled : settled + 8] += 1.0  # too many in a row to count as a fault of the recording
        spoilt = hystgen.identify(record(v, garbage), thresholds=THRESHOLDS, holdout=record(v, y))
        assert spoilt.parameters != fit.parameters

    @pytest.mark.parametrize("seed", range(6))
    @pytest.mark.parametrize("noise", [0.0003, 0.01])
    def test_noise_of_the_drive_does_not_choose_among_turns(self, seed: int, noise: float) -> None:
        """The drive begins and ends at its least value, and its first rise makes the memory known, noise or not."""
        rng = np.random.default_rng(seed)
        at = np.arange(3001)
        v = 50.0 * (1.0 - np.cos(2.0 * np.pi * 3.0 * at / 3000)) * (1.0 - at / 6000)
        y = noisy(brute_output(v, THRESHOLDS, WEIGHTS, 0.0), 0.02)
        fit = hystgen.identify(record(v + rng.normal(0.0, noise, len(v)), y), thresholds=THRESHOLDS)
        assert row(fit, "all").ignored == pytest.approx(first_exact(v, THRESHOLDS[-1]), abs=5)
        known = hystgen.identify(record(v, y), thresholds=THRESHOLDS, history=(0.0,))
        assert fitted(fit)[1] == pytest.approx(fitted(known)[1], abs=0.03 * sum(WEIGHTS))

    def test_until_both_ends_where_a_play_reaches_further(self) -> None:
        """A play that never moves once both ends are known counts as a constant, whatever its place."""
        v = np.interp(np.arange(1001) / 40.0, np.arange(26), [50.0, *([90.0, 10.0] * 12), 50.0])
        y = brute_output(v, (0.0, 10.0, 60.0), (0.5, 0.3, 0.2), [50.0, 45.0, 20.0])
        fit = hystgen.identify(record(v, y), thresholds=(0.0, 10.0, 60.0), holdout=record(v, y))
        assert row(fit, "fit").ignored == 80 == int(np.argmin(v))
        assert fitted(fit)[1] == pytest.approx((0.5, 0.3, 0.0), abs=1e-8)
        assert any("1 play above" in text for text in fit.warnings)

    def test_skipped_samples_still_move_the_plays(self) -> None:
        v = wander(17)
        y = brute_output(v, THRESHOLDS, WEIGHTS, 0.0)
        garbage = y.copy()
        garbage[:700] = -5.0
        fit = hystgen.identify(record(v, garbage), thresholds=THRESHOLDS, history=(), skip=0.7)
        assert fitted(fit)[1] == pytest.approx(WEIGHTS, rel=1e-8)
        assert (row(fit, "all").samples, row(fit, "all").ignored) == (len(v) - 700, 0)

    def test_rest_changes_nothing(self) -> None:
        v = wander(18)
        made = record(v, noisy(brute_output(v, THRESHOLDS, WEIGHTS, 0.0), 0.05))
        assert hystgen.identify(made, history=(9.0,), rest=6.4) == hystgen.identify(made, history=(9.0,))


class TestOffsets:
    def test_a_constant_in_y_changes_the_offset_only(self) -> None:
        v, w = wander(19), wander(20)
        y = noisy(brute_output(v, THRESHOLDS, WEIGHTS, 0.0), 0.05, 1)
        z = noisy(brute_output(w, THRESHOLDS, WEIGHTS, 0.0), 0.05, 2)
        fits = [
            hystgen.identify([record(v, y + a), record(w, z + b)]) for a, b in ((0.0, 0.0), (12.5, 0.0), (0.0, -300.0))
        ]
        r, p = fitted(fits[0])
        offsets = [fit.parameters.model.output_offset for fit in fits]
        for fit in fits[1:]:
            assert np.array_equal(fitted(fit)[0], r)
            assert fitted(fit)[1] == pytest.approx(p, rel=1e-6, abs=1e-10)
            assert [x.rms for x in fit.rows] == pytest.approx([x.rms for x in fits[0].rows], rel=1e-7)
            assert fit.parameters.input_range == fits[0].parameters.input_range
        assert offsets[1] - offsets[0] == pytest.approx(12.5, abs=1e-7)
        assert offsets[2] - offsets[0] == pytest.approx(0.0, abs=1e-7)

    def test_the_offset_written_is_the_first_records(self) -> None:
        v, w = wander(21), wander(22)
        y, z = (brute_output(x, THRESHOLDS, WEIGHTS, 0.0) for x in (v, w))
        for first, second in (((v, y + 1.0), (w, z - 8.0)), ((w, z - 8.0), (v, y + 1.0))):
            fit = hystgen.identify([record(*first), record(*second)], thresholds=THRESHOLDS, history=())
            expected = 1.0 if first[0] is v else -8.0
            assert fit.parameters.model.output_offset == pytest.approx(expected, abs=1e-7)


# -- figures -----------------------------------------------------------------------------------------------------------


class TestFigures:
    def test_shipped_recording(self, tmp_path: Path, run: Run) -> None:
        """Errors are below 1 % on both shipped files, and every printed figure is recomputed from the written model."""
        data, held = EXAMPLES / "stage_recording.csv", EXAMPLES / "stage_holdout.csv"
        target = tmp_path / "stage.yaml"
        code, out, err = run("identify", data, "--holdout", held, "-o", target)
        assert code == 0, err
        assert err == ""
        # While fitting, plays up to 85 % of half the drive's range are tried; the largest need not be written
        ends = {"fit": 0.85 * 50.0, "held out": written(target)["model"]["pi"]["thresholds"][-1]}
        for name, part in ((data, "fit"), (held, "held out")):
            printed = table_of(out)[part]
            assert printed["records"] == name.name
            _, v, _ = columns(name)
            first = first_exact(v, ends[part])
            figures = check_predicts(target, name, skip=first)
            assert figures[2] < 1.0
            assert (int(printed["ignored"]), int(printed["samples"])) == (first, len(v) - first)
            assert float(printed["rms"]) == pytest.approx(figures[0], rel=1e-3)
            assert float(printed["max"]) == pytest.approx(figures[1], rel=1e-3)
            assert float(printed["rms %"]) == pytest.approx(figures[2], abs=6e-4)
        check_verifies(target)

    def test_several_records_in_a_row(self) -> None:
        drives = [wander(seed, 0.0, top, turns=20) for seed, top in ((23, 100.0), (24, 60.0))]
        outputs = [noisy(relay_output(v, (0.0, 15.0), (0.3, 0.2), 0.0, 100.0), 0.1) for v in drives]
        held = [record(v, y) for v, y in zip(drives, outputs, strict=True)]
        fit = hystgen.identify(held[0], holdout=held, thresholds=5)
        r, p = fitted(fit)
        errors, ignored, swings = [], 0, []
        for v, y in zip(drives, outputs, strict=True):
            first = first_exact(v, float(r[-1]))
            swings.append(np.ptp(y[first:]))
            error = (y - brute_output(v, r, p, float(v[0])))[first:]
            errors.append(error - error.mean())
            ignored += first
        error = np.concatenate(errors)
        found = row(fit, "held out")
        assert (found.samples, found.ignored) == (len(error), ignored)
        assert found.rms == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-6)
        assert found.max == pytest.approx(np.abs(error).max(), rel=1e-6)
        assert found.output_range == max(swings)
        assert found.rms_percent == pytest.approx(100.0 * found.rms / found.output_range)

    def test_last_quarter_is_held_out_from_the_trial(self) -> None:
        v = wander(25, turns=101)
        y = noisy(relay_output(v, (0.0, 8.0, 25.0), (0.3, 0.2, 0.1), 0.0, 100.0), 0.1)
        split = round(0.75 * len(v))
        fit = hystgen.identify(record(v, y))
        alone = hystgen.identify(record(v[:split], y[:split]), holdout=record(v, y))
        assert [(x.part, x.model) for x in fit.rows] == [("fit", "trial"), ("held out", "trial"), ("all", "written")]
        assert row(fit, "fit", "trial").rms == pytest.approx(row(alone, "fit").rms, rel=1e-9)
        r, p = fitted(alone)
        figures = error_figures(y, brute_output(v, r, p, float(v[0])), split)
        found = row(fit, "held out", "trial")
        assert (found.samples, found.ignored) == (len(v) - split, 0)
        assert (found.rms, found.max) == pytest.approx(figures[:2], rel=1e-6)
        whole = np.ptp(y[first_exact(v, float(r[-1])) :])
        assert [row(fit, part, "trial").output_range for part in ("fit", "held out")] == [whole] * 2

    def test_held_out_records_take_no_part(self) -> None:
        v, w = wander(26), wander(27)
        made = record(v, noisy(brute_output(v, THRESHOLDS, WEIGHTS, 0.0), 0.05))
        fits = [hystgen.identify(made, holdout=record(w, y)) for y in (w, np.sin(w))]
        models = [each.parameters.model_copy(update={"residual": None}) for each in fits]
        assert models[0] == models[1]
        assert row(fits[0], "fit") == row(fits[1], "fit")
        assert row(fits[0], "held out").rms != row(fits[1], "held out").rms

    def test_a_held_out_record_that_shows_nothing_is_refused(self) -> None:
        """A single sample with a free offset would have an error of 0."""
        v = wander(28)
        made = record(v, brute_output(v, THRESHOLDS, WEIGHTS, 0.0))
        ramp = np.linspace(20.0, 60.0, 300)
        with pytest.raises(IdentificationError, match="ramp is held out, but only 1 of its 300 samples"):
            hystgen.identify(made, holdout=record(ramp, ramp, "ramp"))
        fit = hystgen.identify(made, holdout=record(ramp, ramp, "ramp"), history=())
        assert row(fit, "held out").samples == 300

    def test_a_record_of_which_nothing_is_left_is_told(self) -> None:
        v = wander(28)
        made = record(v, brute_output(v, THRESHOLDS, WEIGHTS, 0.0))
        ramp = np.linspace(20.0, 60.0, 300)
        fit = hystgen.identify([made, record(ramp, 0.1 * ramp, "ramp")])
        assert "ramp: only 1 sample is left once its start memory is known; it carries little weight" in fit.warnings

    def test_predict(self) -> None:
        history = (90.0, 10.0)
        v, w = wander(29), wander(30, 10.0, 60.0)
        before = brute_plays(history, THRESHOLDS, 0.0)[-1]
        fit = hystgen.identify(
            record(v, brute_output(v, THRESHOLDS, WEIGHTS, before) + 1.5), thresholds=THRESHOLDS, history=history
        )
        y = brute_output(w, THRESHOLDS, WEIGHTS, before) + 1.5
        assert fit.predict(record(w, y)) == pytest.approx(y, abs=1e-7)
        assert fit.predict(record(w, y - 20.0), free_offset=True) == pytest.approx(y - 20.0, abs=1e-7)
        virgin = brute_output(w, THRESHOLDS, WEIGHTS, 0.0) + 1.5
        assert fit.predict(record(w, y), history=()) == pytest.approx(virgin, abs=1e-7)
        with pytest.warns(UserWarning, match="outside the fitted range 0 to 100"):
            fit.predict(record(w + 50.0, y))


# -- what is written ---------------------------------------------------------------------------------------------------


class TestWritten:
    def test_the_file(self, tmp_path: Path, run: Run) -> None:
        v, w = wander(31, 5.0, 95.0), wander(32, 1.0, 90.0)
        y, z = (noisy(brute_output(x, THRESHOLDS, WEIGHTS, 0.0), 0.05) for x in (v, w))
        one, two = write_csv(tmp_path / "one.csv", v, y + 6.0), write_csv(tmp_path / "two.csv", w, z)
        target = tmp_path / "axis-1.yaml"
        code, out, err = run("identify", one, two, "-o", target, "--units", "V,um")
        assert code == 0, err
        assert out.splitlines()[-1] == str(target)
        content = written(target)
        assert list(content) == ["hystgen", "name", "units", "recorded_at", "input_range", "residual", "model"]
        assert content["name"] == "axis_1"
        assert content["units"] == {"input": "V", "output": "um"}
        assert list(content["model"]) == ["pi", "output_offset"]
        assert list(content["model"]["pi"]) == ["thresholds", "weights"]
        pi = content["model"]["pi"]
        assert len(pi["thresholds"]) == len(pi["weights"]) > 1
        # the drive range of the samples compared
        starts = [first_exact(x, pi["thresholds"][-1]) for x in (v, w)]
        compared = np.concatenate([v[starts[0] :], w[starts[1] :]])
        assert content["input_range"] == [compared.min(), compared.max()]
        residue = (y + 6.0 - brute_output(v, pi["thresholds"], pi["weights"], float(v[0])))[starts[0] :]
        assert content["model"]["output_offset"] == pytest.approx(residue.mean(), abs=1e-6)
        text = target.read_text()
        assert "sample_time" not in text
        assert "one.csv, two.csv" in text
        assert str(tmp_path) not in text
        model = hystgen.load(target)
        assert model.name == "axis_1"
        assert model.cascade.pi.thresholds == tuple(pi["thresholds"])
        expected = brute_output(v, pi["thresholds"], pi["weights"], 0.0) + content["model"]["output_offset"]
        assert model.simulate(v) == pytest.approx(expected, abs=1e-9)

    def test_same_data_same_bytes(self, tmp_path: Path, run: Run) -> None:
        for name in ("a", "b"):
            (tmp_path / name).mkdir()
            assert run("identify", EXAMPLES / "stage_recording.csv", "-o", tmp_path / name / "s.yaml")[0] == 0
        assert (tmp_path / "a" / "s.yaml").read_bytes() == (tmp_path / "b" / "s.yaml").read_bytes()

    def test_names_in_comments_stay_comments(self, tmp_path: Path) -> None:
        v = wander(33)
        name = "a\nname: other\u2028input_range: [0, 1]\x85#.csv"
        fit = hystgen.identify(record(v, brute_output(v, THRESHOLDS, WEIGHTS, 0.0), name))
        fit.write(tmp_path / "a.yaml")
        assert hystgen.load(tmp_path / "a.yaml").parameters == fit.parameters

    @pytest.mark.parametrize(
        ("text", "name"),
        [("axis-1", "axis_1"), ("1st", "stage_1st"), ("", "stage"), ("int", "stage_int"), ("\u00e4", "stage")],
    )
    def test_identifier(self, text: str, name: str) -> None:
        assert identifier_from(text) == name


SINE = 50.0 + 50.0 * np.sin(np.arange(400) / 20.0)
NOTHING = np.full(400, np.nan)


class TestRefused:
    @pytest.mark.parametrize(
        ("v", "y", "options", "message"),
        [
            (SINE[:15], SINE[:15], (), "{path}: error: has 15 samples, but at least 16 are needed; record for longer"),
            (
                SINE * 0.0 + 5.0,
                SINE,
                (),
                "{path}: error: the drive v is 5 throughout, but a fit needs a drive that moves; check the columns",
            ),
            (SINE, SINE * 0.0, (), "data.csv: the measured output is constant; is y the right column?"),
            (
                SINE,
                np.where(np.arange(400) < 30, np.nan, SINE),
                (),
                "{path}:2:1: error: 30 of 400 samples are without a value in y, the first in line 2; more than 5 % is "
                "too much to repair; export every column at one sample rate, with a number in each row",
            ),
            (
                np.arange(400.0),
                SINE,
                (),
                "data.csv: the drive no longer moves once the start memory is known; record more cycles, or "
                "give --history",
            ),
            (
                SINE,
                -SINE,
                (),
                "no play has a positive weight: y does not rise with v; if the sensor counts the other way, change "
                "the sign of y (--columns y=-y), otherwise check which column is which",
            ),
            (
                SINE, SINE, ("--skip", "0.39"),
                "data.csv has 400 samples, of which 390 are to be skipped, but at least 16 are needed; skip less, or "
                "record more",
            ),
            (
                SINE[:60],
                SINE[:60],
                ("--thresholds", "100", "--history", "1"),
                "60 samples can be compared, but 100 plays need at least 102; record more cycles, give --history, or "
                "use fewer thresholds",
            ),
            (
                SINE,
                SINE,
                ("--history", "1,nan"),
                "--history '1,nan' is not a list of numbers; write --history 100,-100",
            ),
        ],
        ids=lambda value: value if isinstance(value, str) else "",
    )
    def test_one_message_and_nothing_written(
        self, v: Array, y: Array, options: tuple[str, ...], message: str, tmp_path: Path, run: Run
    ) -> None:
        path = write_csv(tmp_path / "data.csv", v, y)
        code, out, err = run("identify", path, "-o", tmp_path / "a.yaml", *options)
        assert (code, out) == (2, "")
        (line,) = err.splitlines()
        assert line.removeprefix("error: ") == message.format(path=path)
        assert [p.name for p in tmp_path.iterdir()] == ["data.csv"]

    @pytest.mark.parametrize("option", ["--skip", "--thresholds", "--rest"])
    def test_negative_options(self, option: str, tmp_path: Path, run: Run) -> None:
        code, out, err = run("identify", EXAMPLES / "stage_recording.csv", "-o", tmp_path / "a.yaml", option, "-1")
        assert (code, out) == (2, "")
        assert option[2:] in err
        assert list(tmp_path.iterdir()) == []

    def test_an_older_file_stays_and_no_traceback(self, tmp_path: Path) -> None:
        """The command is run as from a shell."""
        path = write_csv(tmp_path / "data.csv", SINE[:5], SINE[:5])
        (tmp_path / "a.yaml").write_text("older\n")
        command = [sys.executable, "-m", "hystgen.cli", "identify", str(path), "-o", str(tmp_path / "a.yaml")]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stdout) == (2, "")
        assert "Traceback" not in done.stderr
        assert "has 5 samples, but at least 16 are needed" in done.stderr
        assert (tmp_path / "a.yaml").read_text() == "older\n"

    def test_a_folder_that_is_not_there(self, tmp_path: Path, run: Run) -> None:
        target = tmp_path / "none" / "a.yaml"
        code, _, err = run("identify", EXAMPLES / "stage_recording.csv", "-o", target, "--thresholds", 2)
        assert code == 2
        what = f"the folder {target.parent} does not exist; create it, or choose another output"
        assert err.splitlines()[-1] == f"error: {target}: {what}"
        assert list(tmp_path.iterdir()) == []

    def test_all_unusable_files_at_once(self, tmp_path: Path) -> None:
        short = write_csv(tmp_path / "short.csv", SINE[:9], SINE[:9])
        still = write_csv(tmp_path / "still.csv", SINE * 0.0, SINE)
        with pytest.raises(RecordError) as caught:
            hystgen.identify([short, EXAMPLES / "stage_recording.csv"], holdout=still)
        assert [problem.split(": ")[0] for problem in caught.value.problems] == [str(short), str(still)]

    @pytest.mark.parametrize(
        "options",
        [
            {"history": [float("inf")]},
            {"p0_floor": 1.0},
            {"model": "preisach"},
            {"skip": -1},
            {"rest": -1.0},
            {"rest": float("nan")},
            {"thresholds": -1},
            {"breaks": 3},
            {"breaks": 0, "model": "gpi-deadzone"},
            {"breaks": [5.0, 3.0], "model": "gpi-deadzone"},
            {"breaks": [50.0, float("nan")], "model": "gpi-deadzone"},
        ],
        ids=str,
    )
    def test_arguments(self, options: dict[str, Any]) -> None:
        with pytest.raises(ValueError, match=next(iter(options))):
            hystgen.identify(record(SINE, SINE), **options)

    def test_arrays(self) -> None:
        for v, y, warned in (
            (SINE, None, "no measured column y"),
            (SINE, SINE[1:], "400 samples of v and 399 of y"),
            (SINE, NOTHING, "samples without a value"),
            (SINE * 0.0, SINE, "the drive is constant"),
        ):
            with pytest.raises(IdentificationError, match=warned):
                hystgen.identify(Record("made", np.arange(400.0), v, y))
        with pytest.raises(ValueError, match="there is no record to fit"):
            hystgen.identify([])
