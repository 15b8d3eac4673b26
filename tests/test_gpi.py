"""Identification with a memoryless part in front, compared with plants written as loops and with other solvers."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from recordings import (
    brute_output,
    brute_plays,
    columns,
    error_figures,
    noisy,
    part_of_file,
    record,
    wander,
    write_csv,
    written,
)
from scipy.optimize import minimize
from scipy.signal import lfilter

import hystgen
from hystgen.identification import Fit, pi, reduction
from hystgen.identification.pi import IdentificationError
from hystgen.records import Record
from hystgen.verification import compilers

Array = NDArray[np.float64]
Run = Callable[..., tuple[int, str, str]]

THRESHOLDS = (0.0, 2.0, 5.0, 10.0, 20.0, 35.0)
WEIGHTS = (0.6, 0.1, 0.1, 0.08, 0.06, 0.05)
SWING = float(np.ptp(brute_output(wander(1), THRESHOLDS, WEIGHTS, 0.0)))
NOISE = 1e-3 * SWING
BREAKS = (20.0, 40.0, 60.0, 80.0)


def bent(v: Array) -> Array:
    """A piecewise linear front over 0 .. 100 with mean slope 1, given by its points."""
    return np.asarray(np.interp(v, [0, 20, 40, 60, 80, 100], np.array([0, 27, 50, 66, 81, 100])))


def tanh_front(v: Array, a1: float = 0.018, middle: float = 35.0) -> Array:
    """An S-shaped front over 0 .. 100 through both ends of the diagonal."""
    low, high = np.tanh(-a1 * middle), np.tanh(a1 * (100.0 - middle))
    return np.asarray(100.0 * (np.tanh(a1 * (v - middle)) - low) / (high - low))


def branched(v: Array, lift: float = 3.0) -> Array:
    """The S-shaped front while the drive rises, a higher one while it falls; a constant drive keeps the last one."""
    w, rising = np.empty_like(v), True
    for k, x in enumerate(v):
        if k and x != v[k - 1]:
            rising = x > v[k - 1]
        up = float(tanh_front(x))
        w[k] = up if rising else up + lift * (1.0 + 0.2 * np.tanh(0.02 * (x - 50.0)))
    return w


def plant(front: Callable[[Array], Array], seed: int, noise: float = NOISE) -> tuple[Array, Array]:
    v = wander(seed)
    return v, noisy(brute_output(front(v), THRESHOLDS, WEIGHTS, 0.0), noise, seed + 100)


def held_out(fit: Fit, front: Callable[[Array], Array], seed: int = 77) -> float:
    """rms error on another, noise-free record of the same plant."""
    v, y = plant(front, seed, 0.0)
    known = fit.settled(record(v, y))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the record may slightly exceed the fitted range
        error = (y - fit.predict(record(v, y)))[known:]
    return float(np.std(error))


def pieces(fit: Fit) -> Array:
    """Slopes of the five pieces of the dead-zone sum between 0 and 100."""
    (stage,) = fit.parameters.model.memoryless
    v = np.array([10.0, 30.0, 50.0, 70.0, 90.0])
    value = np.zeros((2, len(v)))
    for side in (0, 1):
        x = v - 1.0 + 2.0 * side
        for rho, eta in zip(stage.thresholds, stage.weights, strict=True):
            beyond = np.maximum(x - rho, 0.0) if rho > 0.0 else np.minimum(x - rho, 0.0)
            value[side] += eta * (beyond if rho else x)
    return np.asarray((value[1] - value[0]) / 2.0)


class TestDeadZone:
    @pytest.mark.parametrize("history", [None, ()])
    def test_same_model_without_noise(self, history: tuple[float, ...] | None) -> None:
        v, y = plant(bent, 3, 0.0)
        fit = hystgen.identify(
            record(v, y), model="gpi-deadzone", thresholds=THRESHOLDS, breaks=BREAKS, history=history, p0_floor=0.0
        )
        np.testing.assert_allclose(fit.parameters.model.pi.weights, WEIGHTS, rtol=0, atol=1e-6)
        np.testing.assert_allclose(pieces(fit), [27 / 20, 23 / 20, 16 / 20, 15 / 20, 19 / 20], rtol=0, atol=1e-6)

    def test_same_model_with_noise(self) -> None:
        v, y = plant(bent, 3)
        fit = hystgen.identify(record(v, y), model="gpi-deadzone", thresholds=THRESHOLDS, breaks=BREAKS)
        # noise and model error together are at most 1.1 times the noise
        assert held_out(fit, bent) <= np.sqrt(1.1**2 - 1.0) * NOISE

    def test_everything_chosen(self) -> None:
        v, y = plant(bent, 3)
        plain = hystgen.identify(record(v, y))
        fit = hystgen.identify(record(v, y), model="gpi-deadzone")
        assert held_out(plain, bent) > 10.0 * NOISE
        assert held_out(fit, bent) < 1.0 * NOISE
        assert len(fit.parameters.model.memoryless[0].thresholds) == 5

    def test_range_on_both_sides_of_zero(self) -> None:
        v, y = plant(bent, 5)
        fit = hystgen.identify(record(v - 50.0, y), model="gpi-deadzone", breaks=(-30.0, -10.0, 10.0, 30.0))
        w, z = plant(bent, 6, 0.0)
        error = (z - fit.predict(record(w - 50.0, z)))[fit.settled(record(w - 50.0, z)) :]
        assert np.std(error) < 2.0 * NOISE
        (stage,) = fit.parameters.model.memoryless
        assert stage.thresholds == (-30.0, -10.0, 0.0, 10.0, 30.0)

    def test_breaks_outside_the_drive(self) -> None:
        v, y = plant(bent, 3)
        with pytest.raises(IdentificationError, match="breaks have to lie inside the drive range"):
            hystgen.identify(record(v, y), model="gpi-deadzone", breaks=(50.0, 120.0))

    def test_from_the_command_line_to_equal_bits(self, tmp_path: Path, run: Run) -> None:
        v, y = plant(bent, 3)
        data, target = write_csv(tmp_path / "data.csv", v, y), tmp_path / "stage.yaml"
        code, out, err = run("identify", data, "--model", "gpi-deadzone", "--breaks", "4", "-o", target)
        assert (code, err) == (0, "")
        assert "written" in out
        assert written(target)["model"]["memoryless"][0]["kind"] == "dead_zone"
        report = hystgen.verify(
            hystgen.load(target), operator="both", compiler=(compilers.available()[0].name,), length=3000
        )
        assert report.ok, report.table()


class TestTanh:
    def test_one_branch(self) -> None:
        v, y = plant(tanh_front, 3)
        fit = hystgen.identify(record(v, y), model="gpi-tanh", thresholds=THRESHOLDS)
        assert held_out(fit, tanh_front) <= np.sqrt(1.1**2 - 1.0) * NOISE
        (stage,) = fit.parameters.model.memoryless
        assert stage.ascending == stage.descending
        assert stage.ascending.a1 == pytest.approx(0.018, rel=0.01)
        assert -stage.ascending.a2 / stage.ascending.a1 == pytest.approx(35.0, abs=0.5)

    def test_two_branches(self) -> None:
        v, y = plant(branched, 3)
        single = hystgen.identify(record(v, y), model="pi", thresholds=THRESHOLDS)
        fit = hystgen.identify(record(v, y), model="gpi-tanh", thresholds=THRESHOLDS)
        (stage,) = fit.parameters.model.memoryless
        assert stage.ascending != stage.descending
        assert held_out(fit, branched) < 0.5 * NOISE
        assert held_out(single, branched) > 20.0 * NOISE
        places = np.linspace(*fit.parameters.input_range, 5001)
        up, down = (b.a0 * np.tanh(b.a1 * places + b.a2) + b.a3 for b in (stage.ascending, stage.descending))
        assert np.all(down >= up)

    def test_held_out_records_choose_between_one_branch_and_two(self) -> None:
        """Two branches fit the single loop of plays behind a curved sensor better; smaller loops show them to be wrong.

        Without the smaller loops nothing speaks against two branches, and they are chosen.
        """

        def swings(fade: float, seed: int) -> tuple[Array, Array]:
            t = np.linspace(0.0, 6.0, 2000)
            v = 50.0 - 50.0 * (1.0 - fade * t / 6.0) * np.cos(2.0 * np.pi * t)
            h = brute_output(v, THRESHOLDS, WEIGHTS, 0.0) / SWING
            return v, noisy(SWING * (h + 0.2 * (h - 0.5) ** 2), NOISE, seed)

        loop, smaller = record(*swings(0.0, 3), "loop"), record(*swings(0.9, 53), "smaller")
        alone = hystgen.identify(loop, model="gpi-tanh")
        judged = hystgen.identify(loop, model="gpi-tanh", holdout=[smaller])
        two, one = alone.parameters.model.memoryless[0], judged.parameters.model.memoryless[0]
        assert two.ascending != two.descending
        assert one.ascending == one.descending
        assert smaller.y is not None
        errors = [np.std((smaller.y - fit.predict(smaller))[fit.settled(smaller) :]) for fit in (alone, judged)]
        assert errors[1] < 0.75 * errors[0]

    def test_branches_never_cross(self) -> None:
        """A plant whose falling branch lies below the rising one has no such model; the fitted one is invertible."""
        v, y = plant(lambda x: branched(x, -3.0), 3)
        fit = hystgen.identify(record(v, y), model="gpi-tanh", thresholds=THRESHOLDS)
        (stage,) = fit.parameters.model.memoryless
        places = np.linspace(*fit.parameters.input_range, 5001)
        up, down = (
            b.a0 * np.tanh(b.a1 * places + b.a2) + b.a3 for b in (stage.ascending, stage.descending or stage.ascending)
        )
        assert np.all(down >= up - 1e-9)

    def test_from_the_command_line_to_equal_bits(self, tmp_path: Path, run: Run) -> None:
        v, y = plant(branched, 3)
        data, target = write_csv(tmp_path / "data.csv", v, y), tmp_path / "stage.yaml"
        code, _, err = run("identify", data, "--model", "gpi-tanh", "--thresholds", "6", "-o", target)
        assert (code, err) == (0, "")
        report = hystgen.verify(
            hystgen.load(target), operator="both", compiler=(compilers.available()[0].name,), length=3000
        )
        assert report.ok, report.table()


@pytest.mark.thorough(but_one_in=3)
@pytest.mark.parametrize(("volts", "metres"), [(436.9, 1e-6), (1e6, 1e-9), (1e-6, 1e6)])
@pytest.mark.parametrize(("front", "kind"), [(bent, "gpi-deadzone"), (branched, "gpi-tanh")])
def test_units_do_not_matter(front: Callable[[Array], Array], kind: str, volts: float, metres: float) -> None:
    """Drives in converter codes and outputs in metres are fitted as well as V and um.

    The sum of squares is flat around its minimum, so errors are compared, not parameters: a search ends once a step
    lowers the sum by less than noise of 0.1 % of the output can reveal.
    """
    v, y = plant(front, 3)
    plain, other = (hystgen.identify(r, model=kind) for r in (record(v, y), record(v * volts, y * metres)))
    assert len(other.parameters.model.pi.thresholds) == len(plain.parameters.model.pi.thresholds)
    assert [x.rms_percent for x in other.rows] == pytest.approx([x.rms_percent for x in plain.rows], rel=5e-3)


KERNELS = (
    {"OPENBLAS_CORETYPE": "Haswell"},
    {"OPENBLAS_CORETYPE": "Nehalem", "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4"},
)
"""Environments in which OpenBLAS and numpy choose the kernels of processors from different years."""


@pytest.mark.thorough
def test_the_same_bytes_on_another_processor(tmp_path: Path) -> None:
    """Searches for a front and for effects end in the same numbers although the last bits of sums differ."""
    if platform.machine() not in ("x86_64", "AMD64"):
        (pytest.fail if os.environ.get("CI") else pytest.skip)("the kernels are those of x86 processors")
    v, y = plant(branched, 3)
    write_csv(tmp_path / "loops.csv", v, y)
    found = []
    for kernels in KERNELS:
        here = tmp_path / kernels["OPENBLAS_CORETYPE"]
        here.mkdir()
        for command in (
            ["identify", "../loops.csv", "--model", "auto", "--name", "stage", "-o", "stage.yaml"],
            ["diagnose", "stage.yaml", "../loops.csv", "-o", "found"],
        ):
            subprocess.run([sys.executable, "-m", "hystgen", *command], cwd=here, env=os.environ | kernels, check=True)
        found.append(
            [(here / name).read_text() for name in ("stage.yaml", "found/params.yaml", "found/diagnosis.json")]
        )
    assert found[0] == found[1]


class TestAuto:
    @pytest.mark.parametrize(
        ("front", "kind"),
        [(np.asarray, "pi"), (bent, "gpi-deadzone"), (tanh_front, "gpi-tanh"), (branched, "gpi-tanh, two branches")],
        ids=lambda value: value if isinstance(value, str) else "",
    )
    def test_the_plant_tells(self, front: Callable[[Array], Array], kind: str) -> None:
        v, y = plant(front, 3)
        w, z = plant(front, 4)
        fit = hystgen.identify(record(v, y, "a"), model="auto", holdout=[record(w, z, "b")])
        rows = [row for row in fit.rows if row.part == "candidate"]
        assert [row.model.partition(",")[0] for row in rows] == ["pi", "gpi-deadzone", "gpi-tanh", "bouc_wen"]
        assert {row.records for row in rows} == {("b",)}
        (chosen,) = [row for row in fit.rows if row.part == "held out"]
        assert chosen.rms == next(row.rms for row in rows if row.model == kind)
        assert chosen.rms <= 1.03 * min(row.rms for row in rows)
        assert bool(fit.parameters.model.memoryless) == (kind != "pi")

    def test_without_held_out_records_the_ends_tell(self) -> None:
        v, y = plant(bent, 3)
        fit = hystgen.identify(record(v, y), model="auto")
        assert [row.part for row in fit.rows] == ["candidate"] * 4 + ["fit", "held out", "all"]
        assert fit.parameters.model.memoryless[0].kind == "dead_zone"
        assert "candidate" in fit.table()
        assert "candidate" in fit.text()


@pytest.mark.data
def test_dead_zones_of_a_150_v_actuator(measured: Path, tmp_path: Path, run: Run) -> None:
    """Fitted to two periods of a sine after a step that rings, and compared with the later periods."""
    source = measured / "piezo_150v_step_then_1hz.csv"
    data = part_of_file(source, tmp_path / "first.csv", 17500, 27500)
    held = part_of_file(source, tmp_path / "later.csv", 27500)
    target = tmp_path / "piezo.yaml"
    code, _, err = run("identify", data, "--holdout", held, "--model", "gpi-deadzone", "-o", target)
    assert code == 0, err
    model = written(target)["model"]
    (stage,) = model["memoryless"]
    _, v, y = columns(held)
    w = np.zeros_like(v)
    for rho, eta in zip(stage["thresholds"], stage["weights"], strict=True):
        w += eta * (v if rho == 0.0 else np.maximum(v - rho, 0.0) if rho > 0.0 else np.minimum(v - rho, 0.0))
    predicted = brute_output(w, model["pi"]["thresholds"], model["pi"]["weights"], float(w[0]))
    first = max(int(np.argmax(v)), int(np.argmin(v)))
    assert error_figures(y, predicted, first)[2] <= 0.23


class TestSolvers:
    @pytest.mark.parametrize("seed", range(20))
    def test_least_squares_under_inequalities(self, seed: int) -> None:
        """Solutions agree with those of sequential quadratic programming."""
        rng = np.random.default_rng(seed)
        k, m = int(rng.integers(2, 8)), int(rng.integers(1, 10))
        matrix, target = rng.normal(size=(3 * k, k)), rng.normal(size=3 * k)
        inside = rng.normal(size=k)
        bounds = rng.normal(size=(m, k))
        limits = bounds @ inside - rng.uniform(0.0, 0.5, m)
        found = pi.least_squares(matrix, target, bounds, limits)
        assert np.all(bounds @ found >= limits - 1e-8)
        other = minimize(
            lambda x: float(np.sum((matrix @ x - target) ** 2)),
            inside,
            jac=lambda x: 2.0 * matrix.T @ (matrix @ x - target),
            constraints=[{"type": "ineq", "fun": lambda x: bounds @ x - limits, "jac": lambda _: bounds}],
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 500},
        )
        np.testing.assert_allclose(found, other.x, rtol=0, atol=1e-5)

    def test_inequalities_that_contradict_each_other(self) -> None:
        with pytest.raises(pi.InfeasibleError):
            pi.least_squares(np.eye(1), np.zeros(1), np.array([[1.0], [-1.0]]), np.array([1.0, 1.0]))

    @pytest.mark.parametrize("height", [1e6, 1e7, 1e8, 1e9])
    def test_inequalities_that_meet_far_away(self, height: float) -> None:
        """For two lines that meet at (0, height), the error stays within what rounding their angle causes."""
        lines = np.array([[1.0, 1.0 / height], [-1.0, 1.0 / height]])
        x, y = pi.least_squares(np.eye(2), np.zeros(2), lines, np.ones(2))
        eps = np.finfo(np.float64).eps
        assert abs(x) <= 4.0 * eps * height**2
        assert y == pytest.approx(height, rel=16.0 * eps * height)

    @pytest.mark.parametrize("noise", [0.0, 0.4])
    @pytest.mark.parametrize("start", [0.0, 40.0])
    def test_rows_of_segments_have_the_same_normal_equations(self, noise: float, start: float) -> None:
        rng = np.random.default_rng(5)
        v = np.repeat(wander(8, turns=20), rng.integers(1, 3, 761)) + start
        v = v + noise * rng.normal(size=len(v))
        y = rng.normal(size=len(v)) + 0.3 * v
        states = np.full(len(THRESHOLDS), start)
        expected = np.column_stack([np.ones(len(v)), brute_plays(v, THRESHOLDS, start), y])
        parts = []
        for a, b in ((0, 100), (100, 101), (101, len(v))):
            parts.append(reduction.segment_rows(v[a:b], y[a:b], np.array(THRESHOLDS), states, True))
        found = np.concatenate(parts)
        np.testing.assert_allclose(found.T @ found, expected.T @ expected, rtol=1e-11)
        assert len(found) <= len(v) + 3
        if not noise:
            assert len(found) < 0.5 * len(v)
        np.testing.assert_allclose(states, expected[-1, 1:-1], rtol=0, atol=1e-12)


class TestFaults:
    def spoilt(self, seed: int = 4, fraction: int = 40) -> tuple[Array, Array, Array]:
        v, y = plant(np.asarray, seed)
        wrong = np.random.default_rng(seed).choice(np.arange(200, len(v) - 10), len(v) // 10 // fraction, replace=False)
        y[wrong] += np.random.default_rng(seed).choice([-1.0, 1.0], len(wrong)) * 0.3 * SWING
        return v, y, np.unique(wrong)

    def test_outliers_are_left_out_and_counted(self) -> None:
        v, y, wrong = self.spoilt()
        fit = hystgen.identify(record(v, y), thresholds=THRESHOLDS)
        assert f"made: {len(wrong)} isolated samples of y far from the neighbours" in " ".join(fit.warnings)
        assert f"the first is sample {wrong[0]}" in " ".join(fit.warnings)
        assert held_out(fit, np.asarray) <= np.sqrt(1.1**2 - 1.0) * NOISE

    def test_there_are_none_in_plain_noise(self) -> None:
        for seed in range(20):
            v, y = plant(bent, seed)
            assert hystgen.identify(record(v, y)).warnings == ()

    def test_there_are_none_at_steps_that_the_output_follows_late(self) -> None:
        v = np.concatenate([wander(4)[:800], np.repeat(np.random.default_rng(2).uniform(0.0, 100.0, 30), 80)])
        y = noisy(brute_output(lfilter([0.6], [1.0, -0.4], v), THRESHOLDS, WEIGHTS, 0.0), NOISE)
        fit = hystgen.identify(record(v, y), thresholds=THRESHOLDS)
        assert not any("isolated" in text for text in fit.warnings)

    def test_spikes_of_the_drive_that_the_output_does_not_see(self) -> None:
        v, y = plant(np.asarray, 4)
        wrong = [300, 900, 901, 1500]
        spoilt = v.copy()
        spoilt[wrong] = 170.0
        fit = hystgen.identify(record(spoilt, y), thresholds=THRESHOLDS)
        assert "made: 4 isolated samples of v without a response in y, bridged" in " ".join(fit.warnings)
        assert held_out(fit, np.asarray) <= np.sqrt(1.1**2 - 1.0) * NOISE
        assert fit.parameters.input_range[1] <= 100.0

    def test_a_real_pulse_stays(self) -> None:
        v = wander(4)
        v[[300, 900, 901]] = 170.0
        y = noisy(brute_output(v, THRESHOLDS, WEIGHTS, 0.0), NOISE)
        fit = hystgen.identify(record(v, y), thresholds=THRESHOLDS)
        assert not any("isolated" in text for text in fit.warnings)
        assert fit.parameters.input_range[1] == 170.0

    def test_behind_a_gap_the_memory_is_unknown(self) -> None:
        v, y = plant(np.asarray, 4)
        keep = np.r_[0:1200, 1500 : len(v)]
        t = np.arange(len(v)) * 0.001
        cut = Record("cut", t[keep], v[keep], y[keep], sample_time=0.001)
        fit = hystgen.identify(cut, thresholds=THRESHOLDS, history=())
        assert "cut: cut at 1 gap of more than 25 steps" in " ".join(fit.warnings)
        assert held_out(fit, np.asarray) <= np.sqrt(1.1**2 - 1.0) * NOISE
        before, behind = fit.used[0].starts
        assert before is None, "its history is given"
        assert behind is not None, "estimated, as for any record without a history"


class TestIntervals:
    TRIALS = 200

    def covered(self, colour: float) -> tuple[Array, float]:
        """Share of trials in which the intervals contain each true weight, and the share for the true loop width."""
        truth, r = np.array(WEIGHTS), np.array(THRESHOLDS)
        width = 2.0 * (truth @ r) / truth.sum()
        hits, wide = np.zeros(len(truth)), 0
        for seed in range(self.TRIALS):
            v = wander(seed)
            noise = np.random.default_rng(seed + 1000).normal(size=len(v) + 500)
            noise = lfilter([1.0], [1.0, -colour], noise)[500:] * NOISE * np.sqrt(1.0 - colour**2)
            y = brute_output(v, THRESHOLDS, WEIGHTS, 0.0) + noise
            sure = hystgen.identify(record(v, y), thresholds=THRESHOLDS, p0_floor=0.0, holdout=record(v, y)).intervals
            low, high = np.transpose(sure.weights)
            hits += (low <= truth) & (truth <= high)
            wide += sure.width[0] <= width <= sure.width[1]
        return hits / self.TRIALS, wide / self.TRIALS

    @pytest.mark.slow(one_in=2)
    @pytest.mark.parametrize("colour", [0.0, 0.8])
    @pytest.mark.thorough
    def test_they_hold_the_truth_as_often_as_they_say(self, colour: float) -> None:
        weights, width = self.covered(colour)
        assert 0.90 <= np.mean(weights) <= 0.99
        assert 0.90 <= width <= 0.99
        assert np.min(weights) >= (0.86 if colour else 0.90)  # two standard deviations of 200 trials below 0.9
        assert colour or np.max(weights) <= 0.99

    def test_the_held_out_error(self) -> None:
        v, y = plant(np.asarray, 3)
        w, z = plant(np.asarray, 4)
        sure = hystgen.identify(record(v, y), thresholds=THRESHOLDS, holdout=record(w, z)).intervals
        assert sure.held_out is not None
        low, high = sure.held_out
        assert low < NOISE < high
        assert high - low < 0.15 * NOISE

    def test_in_the_file(self) -> None:
        v, y = plant(np.asarray, 3)
        text = hystgen.identify(record(v, y), thresholds=THRESHOLDS).text()
        assert "# 95 % intervals from a bootstrap by blocks of" in text
        assert "    # 95 %: 0." in text


@pytest.mark.slow(one_in=2)
@pytest.mark.parametrize("front", [np.asarray, bent])
@pytest.mark.thorough
def test_an_unknown_history_costs_little(front: Callable[[Array], Array]) -> None:
    """An unknown history raises the mean held-out error over twenty plants by at most 10 %."""
    kind = "pi" if front is np.asarray else "gpi-deadzone"
    known, unknown = [], []
    for seed in range(20):
        v, y = plant(front, seed)
        w, z = plant(front, seed + 40)
        for history, errors in (((), known), (None, unknown)):
            breaks = BREAKS if kind == "gpi-deadzone" else None
            fit = hystgen.identify(record(v, y), model=kind, thresholds=THRESHOLDS, breaks=breaks, history=history)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # the record may slightly exceed the fitted range
                # the memory of the held-out record is known for both
                predicted = fit.predict(record(w, z), history=())
            errors.append(float(np.std(z - predicted)))
    assert np.mean(unknown) <= 1.1 * np.mean(known)


class TestLoadingCurve:
    """Identification from `phi`, the output of a virgin actuator on its first rise."""

    def curve(self, x: Array) -> Array:
        """Loading curve of the density 0.02 exp(-r/20) and p_0 = 0.5, integrated twice by hand."""
        return np.asarray(0.5 * x + 0.4 * (x + 20.0 * (np.exp(-x / 20.0) - 1.0)))

    def test_the_model_of_a_density(self, tmp_path: Path, run: Run) -> None:
        v = np.linspace(0.0, 100.0, 1001)
        target = tmp_path / "stage.yaml"
        data = write_csv(tmp_path / "curve.csv", v, noisy(self.curve(v), 0.005))
        code, _, err = run("identify", data, "--loading-curve", "--thresholds", "16", "-o", target)
        assert (code, err) == (0, "")
        part = written(target)["model"]["pi"]
        r, p = np.array(part["thresholds"]), np.array(part["weights"])
        assert part.get("initial_state", 0.0) == 0.0
        x = np.linspace(0.0, 95.0, 200)
        np.testing.assert_allclose(np.maximum(x[:, None] - r, 0.0) @ p, self.curve(x), rtol=0, atol=0.1)
        # the loop that the curve alone determines, here from a fine sum over the density
        u = 45.0 * np.sin(np.linspace(0.0, 4.0 * np.pi, 400))
        fine = (np.arange(400) + 0.5) * 0.25
        plant = brute_output(u, [0.0, *fine], [0.5, *(0.02 * np.exp(-fine / 20.0) * 0.25)], 0.0)
        np.testing.assert_allclose(brute_output(u, r, p, 0.0), plant, rtol=0, atol=0.15)

    def test_same_thresholds(self) -> None:
        v = np.linspace(0.0, 40.0, 801)
        y = np.maximum(v[:, None] - np.array(THRESHOLDS), 0.0) @ np.array(WEIGHTS)
        fit = hystgen.identify(record(v, y), loading_curve=True, thresholds=THRESHOLDS, p0_floor=0.0)
        np.testing.assert_allclose(fit.parameters.model.pi.weights, WEIGHTS, rtol=0, atol=1e-6)
        assert [row.part for row in fit.rows] == ["fit"]

    def test_a_record_that_turns_is_none(self) -> None:
        v, y = plant(np.asarray, 3)
        with pytest.raises(IdentificationError, match="is not an initial loading curve"):
            hystgen.identify(record(v, y), loading_curve=True)
        with pytest.raises(ValueError, match="exclude each other"):
            hystgen.identify(record(v, y), loading_curve=True, history=(5.0,))
