"""Settling after a step, compared with closed forms, scipy's linear systems and a step on a fine even grid."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from modelfiles import head
from numpy.typing import NDArray
from scipy import optimize, signal, special

import hystgen
from hystgen.model import Model

Array = NDArray[np.float64]
Call = Callable[..., tuple[int, str, str]]

LOW, HIGH = -20.0, 80.0
THRESHOLDS, WEIGHTS = (0.0, 5.0, 12.0), (0.1, 0.03, 0.02)
STEP = HIGH - LOW
PLAYED = sum(p * (STEP - 2.0 * r) for p, r in zip(WEIGHTS, THRESHOLDS, strict=True))
"""Output step of the plays: each moves once the drive has moved by twice its threshold."""


def file_of(folder: Path, *effects: str, plays: bool = True) -> Path:
    path = folder / "stage.yaml"
    pi = f"{{thresholds: {list(THRESHOLDS)}, weights: {list(WEIGHTS)}}}" if plays else "{thresholds: [0], weights: [1]}"
    path.write_text(f"{head('stage', LOW, HIGH)}\n  pi: {pi}\n  effects: [{', '.join(f'{{{e}}}' for e in effects)}]\n")
    return path


def model_of(folder: Path, *effects: str, plays: bool = True) -> Model:
    return hystgen.load(file_of(folder, *effects, plays=plays))


def root(left: Callable[[float], float], longest: float = 1e4) -> float:
    """Time at which a falling function crosses 0."""
    return float(optimize.brentq(left, 1e-9, longest, xtol=1e-12))


@pytest.mark.parametrize("within", [0.1, 0.01, 1e-3, 1e-5])
def test_a_lag_is_the_logarithm_of_the_error(tmp_path: Path, within: float) -> None:
    found = model_of(tmp_path, "name: lag, time_constant: 2.0e-3", plays=False).settling(within)
    assert found.up == pytest.approx(2e-3 * math.log(1.0 / within), rel=2e-3)
    assert found.down == pytest.approx(found.up, rel=1e-9)
    assert found.error == pytest.approx(within * STEP)
    assert found.because == ("lag",)


def test_behind_a_lag_plays_follow_its_end(tmp_path: Path) -> None:
    found = model_of(tmp_path, "name: lag, time_constant: 2.0e-3").settling()
    assert found.seconds == pytest.approx(2e-3 * math.log(sum(WEIGHTS) * STEP / (0.01 * PLAYED)), rel=2e-3)


@pytest.mark.parametrize(
    ("frequency", "damping", "within"), [(350.0, 0.02, 0.01), (12.0, 0.3, 1e-3), (2e3, 0.005, 0.03), (50.0, 2.0, 0.01)]
)
def test_a_mode_settles_as_scipy_has_it(tmp_path: Path, frequency: float, damping: float, within: float) -> None:
    """The last time outside counts; a peak just above or just below the error shifts it by half a period."""
    found = model_of(tmp_path, f"name: resonance, frequency: {frequency}, damping: {damping}").settling(within)
    w0 = 2.0 * math.pi * frequency
    slowest = damping if damping < 1.0 else damping - math.sqrt(damping**2 - 1.0)
    t = np.linspace(0.0, 1.3 * math.log(1.0 / within) / (slowest * w0), 60_000)
    _, y = signal.step(([w0 * w0], [1.0, 2.0 * damping * w0, w0 * w0]), T=t)
    last = float(t[np.flatnonzero(np.abs(y - 1.0) > within)[-1]])
    assert found.seconds == pytest.approx(last, rel=2e-3, abs=0.5 / frequency if damping < 0.1 else 0.0)


def test_two_modes_and_a_lag_in_series_as_scipy_has_them(tmp_path: Path) -> None:
    effects = [f"name: resonance, frequency: {f}, damping: {z}" for f, z in ((40.0, 0.2), (55.0, 0.15))]
    found = model_of(tmp_path, *effects, "name: lag, time_constant: 5.0e-3", plays=False).settling(1e-3)
    a, b = 2.0 * math.pi * 40.0, 2.0 * math.pi * 55.0
    den = np.polymul(np.polymul([1.0, 0.4 * a, a * a], [1.0, 0.3 * b, b * b]), [5e-3, 1.0])
    t = np.linspace(0.0, 0.4, 60_000)
    _, y = signal.step(([a * a * b * b], den), T=t)
    assert found.seconds == pytest.approx(float(t[np.flatnonzero(np.abs(y - 1.0) > 1e-3)[-1]]), rel=3e-3)


def test_creep_of_a_few_states(tmp_path: Path) -> None:
    model = model_of(tmp_path, "name: creep, time_constants: [0.1, 3.0], weights: [0.05, 0.02]")
    for within in (0.02, 0.01, 1e-3):
        seconds = root(lambda t, e=within: (0.05 * math.exp(-t / 0.1) + 0.02 * math.exp(-t / 3.0)) / 1.07 - e)
        assert model.settling(within).seconds == pytest.approx(seconds, rel=1e-2)
    assert model.settling(0.07).sentence("um").endswith("at once: creep moves it by less")


def test_creep_along_the_logarithm(tmp_path: Path) -> None:
    """An even spectrum leaves `g/ln(10) (E1(t/t_max) - E1(t/t_min))` of the step at t_0."""
    spectrum = "t0: 0.1, t_min: 1.0e-4, t_max: 1.0e+3"
    model = model_of(tmp_path, f"name: creep, shape: logarithmic, per_decade: 0.02, {spectrum}")

    def late(t: float) -> float:
        return float(0.02 / math.log(10.0) * (special.exp1(t / 1e3) - special.exp1(t / 1e-4)))

    for within in (0.05, 0.01):
        seconds = root(lambda t, e=within: late(t) / (1.0 + late(0.1)) - e)
        assert model.settling(within).seconds == pytest.approx(seconds, rel=1e-2)


def test_delay_and_slew_limit_follow_each_other(tmp_path: Path) -> None:
    limits = "name: slew_limit, rate: 1.0e+3, falling_rate: 500.0"
    found = model_of(tmp_path, limits, "name: delay, time: 0.02", plays=False).settling(0.05)
    assert found.up == pytest.approx(0.02 + 0.95 * STEP / 1e3, rel=1e-3)
    assert found.down == pytest.approx(0.02 + 0.95 * STEP / 500.0, rel=1e-3)
    assert found.seconds == found.down
    assert found.because == ("slew_limit",)
    assert "115 ms upwards, 210 ms downwards, mostly because of slew_limit" in found.sentence("um")


def test_viscous_plays(tmp_path: Path) -> None:
    effect = "name: rate_dependence, shape: relaxation, time_constant: 4.0e-3"
    late = PLAYED - WEIGHTS[0] * STEP
    found = model_of(tmp_path, effect).settling()
    assert found.seconds == pytest.approx(4e-3 * math.log(late / (0.01 * PLAYED)), rel=2e-3)


def test_a_nonlinear_dashpot(tmp_path: Path) -> None:
    """With `e' = -(r_n/tau) (e/r_n)^2`, e falls as 1/t."""
    tau, r_n = 4e-3, THRESHOLDS[-1]
    found = model_of(
        tmp_path, f"name: rate_dependence, shape: relaxation, time_constant: {tau}, exponent: 2.0"
    ).settling(1e-3)

    def left(t: float) -> float:
        each = zip(WEIGHTS[1:], THRESHOLDS[1:], strict=True)
        return sum(p / (1.0 / (STEP - 2.0 * r) + t / (tau * r_n)) for p, r in each) / PLAYED - 1e-3

    assert found.seconds == pytest.approx(root(left), rel=1e-2)


@pytest.mark.parametrize(
    "effects",
    [
        (),
        ("name: ageing, shape: logarithmic, loss: 0.01, travel: 1.0e+4",),
        ("name: saturation, level: 20",),
        ("name: drift, rate: 0.5",),
        ("name: thermal, gain_per_degree: 0.01, offset_per_degree: 0.1",),
    ],
)
def test_without_dynamics_it_is_there_at_once(tmp_path: Path, effects: tuple[str, ...]) -> None:
    found = model_of(tmp_path, *effects).settling(1e-6)
    assert (found.up, found.down, found.because) == (0.0, 0.0, ())
    assert "at once: no effect of the model takes time" in found.sentence()
    moved = [each for each in effects if "drift" in each or "thermal" in each]
    assert len(found.left_out) == len(moved)


def test_creep_that_goes_on_for_longer_than_an_hour(tmp_path: Path) -> None:
    found = model_of(tmp_path, "name: creep, time_constants: [1.0e+4], weights: [0.05]").settling()
    assert found.seconds == math.inf
    assert found.sentence("um").endswith("not within 3600 s, because of creep")
    assert found.content()["up"] is None


def test_a_light_mode_that_rings_for_too_many_periods(tmp_path: Path) -> None:
    """The statement is true nevertheless: after the time that was followed, it has not settled."""
    found = model_of(tmp_path, "name: resonance, frequency: 1.0e+3, damping: 1.0e-6").settling()
    assert found.seconds == math.inf
    assert 0.0 < found.followed < math.log(100.0) / (1e-6 * 2.0 * math.pi * 1e3)


@pytest.mark.parametrize("seed", range(4))
def test_any_chain_against_a_fine_even_grid(tmp_path: Path, seed: int) -> None:
    """The same chain, stepped as a user would: at rest at the low end after a swing, then a step, in even samples."""
    rng = np.random.default_rng(seed)
    tau, f, zeta, slow = rng.uniform(2e-3, 2e-2), rng.uniform(20.0, 80.0), rng.uniform(0.05, 0.3), rng.uniform(0.1, 0.4)
    pieces = [
        f"name: lag, time_constant: {tau!r}", f"name: resonance, frequency: {f!r}, damping: {zeta!r}",
        f"name: creep, time_constants: [{slow!r}], weights: [0.03]", f"name: delay, time: {tau / 3!r}",
        f"name: slew_limit, rate: {STEP / tau!r}",
        f"name: rate_dependence, shape: relaxation, time_constant: {tau!r}",
    ]  # fmt: skip
    model = model_of(tmp_path, *rng.permutation(pieces)[: 2 + seed])
    found = model.settling(3e-3)
    even = np.linspace(0.0, 8.0, 80_001)
    for seconds, begin, end in ((found.up, LOW, HIGH), (found.down, HIGH, LOW)):
        t = np.concatenate([[-2e4, -1e4, 0.0], even + 1e-9])
        y = model.simulate(np.where(t < -1e4, end, np.where(t <= 0.0, begin, end)), t=t)
        left = np.abs(y[3:] - y[-1]) / abs(y[-1] - y[2])
        outside = np.flatnonzero(left > 3e-3)
        assert seconds == pytest.approx(float(even[outside[-1]]) if len(outside) else 0.0, rel=5e-3, abs=1e-4)


class TestCommand:
    def test_show_says_it_in_text_and_json(self, tmp_path: Path, run: Call) -> None:
        file = file_of(tmp_path, "name: lag, time_constant: 1.0e-3", "name: drift, rate: 0.1")
        code, out, _ = run("show", file, "--settle-within", "2", "--json", tmp_path / "stage.json")
        assert code == 0
        (line,) = (line for line in out.splitlines() if line.startswith("settling"))
        facts = json.loads((tmp_path / "stage.json").read_text())
        settled = facts["settling"]
        assert settled["within"] == 0.02
        assert settled["up"] == pytest.approx(1e-3 * math.log(sum(WEIGHTS) * STEP / (0.02 * PLAYED)), rel=2e-3)
        assert f"within 2 % of a step over the drive range ({settled['error']:.3g} um)" in line
        assert f"after {1e3 * settled['up']:.3g} ms, mostly because of lag; drift not counted" in line
        assert (facts["drive_range"], facts["inverse"]["exists"]) == ([LOW, HIGH], True)
        assert [effect["name"] for effect in facts["effects"]] == ["lag", "drift"]

    @pytest.mark.parametrize("percent", ["0", "100", "-1", "nan"])
    def test_a_wrong_error(self, tmp_path: Path, run: Call, percent: str) -> None:
        code, out, err = run("show", file_of(tmp_path), "--settle-within", percent)
        assert (code, out) == (2, "")
        assert "give percent of a step" in err

    @pytest.mark.parametrize("within", [0.0, 1.0, math.nan, "1 %"])
    def test_a_wrong_share(self, tmp_path: Path, within: float) -> None:
        with pytest.raises((TypeError, ValueError), match="within must be"):
            model_of(tmp_path).settling(within)
