"""The inverse of models with effects: composed with the forward model, which shares no code with it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal

import hystgen
from hystgen.basics import jit
from hystgen.basics.problems import EffectsError, NotInvertibleError
from hystgen.cascade import PI, Cascade
from hystgen.chain.chain import Chain
from hystgen.compensator.chained import Compensator
from hystgen.effects import Run, shapes
from hystgen.effects.base import Array
from hystgen.front.tanh.model import TanhEnvelope

T, N = 1e-3, 900
R = np.linspace(0.0, 27.0, 10)
PLAYS = PI(R.tolist(), [0.24, *[0.02] * 9], (np.linspace(0.0, 9.0, 10)).tolist())
WIDE = (-math.inf, math.inf)
BENT = TanhEnvelope((60.0, 0.02, 0.1, -5.0), (60.0, 0.02, 0.1, -5.0))
BRANCHES = TanhEnvelope((60.0, 0.02, 0.1, -5.0), (60.0, 0.02, 0.1, -4.0))
FRONTS: dict[str, tuple[Any, ...]] = {"plays": (), "front": (BENT,), "two branches": (BRANCHES,)}


def effect(name: str, which: int = 0, **numbers: Any) -> Any:
    return shapes(name)[which](name=name, **numbers)


CREEP = effect("creep", time_constants=(0.01, 0.1, 30.0), weights=(0.02, 0.03, 0.05))
LOGARITHMIC = effect("creep", 1, shape="logarithmic", per_decade=0.02, t0=0.1, t_min=1e-3, t_max=1e4)
TANH = effect("saturation", level=60.0)
OFF_CENTRE = effect("saturation", level=45.0, centre=20.0)
STOPS = effect("saturation", 2, shape="stops", lower=6.0, upper=12.0, give=0.1)
THERMAL = effect("thermal", gain_per_degree=-0.002, offset_per_degree=0.01)
BUMP = effect("noncongruent", 1, shape="centre", amplitude=0.4, centre=30.0, width=15.0)
POLYNOMIALS = effect("noncongruent", coefficients=((0.05, -0.01),) * 9)
RELAXING = effect("rate_dependence", 1, shape="relaxation", time_constant=5e-3)
NONLINEAR = effect("rate_dependence", 1, shape="relaxation", time_constant=5e-3, exponent=2.0)
BETAS = effect("rate_dependence", betas=(2e-4,) * 9)
AGEING = [
    effect("ageing", loss=0.01, travel=50.0),
    effect("ageing", 1, shape="exponential", loss=0.05, travel=100.0),
    effect("ageing", 2, shape="exponentials", losses=(0.02, 0.03), travels=(10.0, 200.0)),
]
SLEW = effect("slew_limit", rate=5000.0, falling_rate=4000.0)
FAST_LAG = effect("lag", time_constant=0.2 * T)

EXACT = {
    "creep": [CREEP], "creep, logarithmic": [LOGARITHMIC], "tanh": [TANH], "off centre": [OFF_CENTRE],
    "stops": [STOPS], "thermal": [THERMAL],
    "loop centre": [BUMP], "play functions": [POLYNOMIALS], "relaxation": [RELAXING], "dashpot": [NONLINEAR],
    "thresholds": [BETAS], "slew": [SLEW], "fast lag": [FAST_LAG],
    **{f"ageing {i}": [each] for i, each in enumerate(AGEING)},
    "all": [FAST_LAG, SLEW, RELAXING, BUMP, LOGARITHMIC, THERMAL, AGEING[0], TANH],
    "other shapes": [BETAS, POLYNOMIALS, CREEP, THERMAL, AGEING[2], STOPS],
    "without lag": [SLEW, RELAXING, BUMP, LOGARITHMIC, THERMAL, TANH],
}  # fmt: skip
BLURRED = {name for name, effects in EXACT.items() if any(each.name in ("lag", "ageing") for each in effects)}
"""Cases that are not exact at single samples with two branches: behind a lag, rounding alone turns the drive where the
reference holds, and if the gain depends on the drive, neither branch may have a solution at a turn."""


def times(uneven: bool = False) -> Array:
    """Sample times, even or uneven."""
    return np.cumsum(T * np.random.default_rng(4).uniform(0.5, 1.5, N)) if uneven else T * np.arange(N)


def smooth(t: Array) -> Array:
    """A reference that begins at rest, holds and returns."""
    s = np.interp(t, [0.0, 0.02, 0.6, 0.8, 2.0], [0.0, 0.0, 0.58, 0.58, 1.78])
    return 5.0 + 9.0 * (0.5 - 0.3 * np.cos(4.0 * np.pi * s) + 0.2 * np.sin(3.0 * s) ** 3)


def both(effects: list[Any], stages: tuple[Any, ...], t: Array, u: Array) -> tuple[Array, Array]:
    """Drives of the inverse, and the outputs of the forward model for them."""
    chain = Chain(Cascade(PLAYS, stages, 1.0, (0.0, 100.0)), effects)
    warm = {"temperature": 20.0 + 3.0 * np.sin(5.0 * t)}
    v = Compensator(chain).drives(Run(t, u, warm), WIDE)
    return v, chain.simulate([Run(t, v, warm)])[0]


@pytest.mark.slow(one_in=3)
@pytest.mark.thorough(but_one_in=4)
@pytest.mark.parametrize("uneven", [False, True])
@pytest.mark.parametrize("front", FRONTS)
@pytest.mark.parametrize("name", EXACT)
def test_what_is_promised_exactly_comes_out_at_every_sample(name: str, front: str, uneven: bool) -> None:
    t = times(uneven)
    _, y = both(EXACT[name], FRONTS[front], t, smooth(t))
    wrong = np.abs(y - smooth(t)) > 1e-12 * 9.0
    assert np.mean(wrong) <= 0.05 * (front == "two branches" and name in BLURRED)


def arrived(v: Array, step: float, lag: float) -> tuple[float, int]:
    """Overshoot of a lag of `lag` samples, as a share of the step, and number of samples until it is within 0.1 %; the
    drive is straight between samples."""
    numerator, denominator, _ = signal.cont2discrete(([1.0], [lag, 1.0]), 1.0, "foh")
    y = signal.lfilter(np.ravel(numerator), denominator, v)
    left = np.flatnonzero(np.abs(y - step) > 1e-3 * step)
    return float(np.max(y)) / step - 1.0, int(left[-1]) + 1


@pytest.mark.thorough(but_one_in=5)
@pytest.mark.parametrize(
    ("lag", "moves", "back"),
    [(20.0, 25.0, 1.0), (20.0, 5.0, 1.0), (2.0, 8.0, 2.0), (100.0, 12.0, 0.5), (60.0, 4.0, 1.0)],
)
def test_a_lag_behind_a_slew_limit_does_not_overshoot(lag: float, moves: float, back: float) -> None:
    """A step of `moves` samples at full rate settles no more than two samples later than the best drive that rises and
    then returns at full rate."""
    step, rate = 50.0, 50.0 / moves
    slew = effect("slew_limit", rate=rate / T, falling_rate=back * rate / T)
    chain = Chain(Cascade(PI([0.0], [1.0], [0.0]), (), 0.0, (0.0, 100.0)), [effect("lag", time_constant=lag * T), slew])
    n = int(8.0 * lag + 6.0 * moves)
    u = np.where(np.arange(n) < 3, 0.0, step)
    v = Compensator(chain).drives(Run(T * np.arange(n), u), WIDE)
    over, settled = arrived(v, step, lag)
    assert over < 1e-9
    k = np.arange(n) - 2.0
    up = [np.maximum(np.minimum(k.clip(0) * rate, a * rate - (k - a) * back * rate), np.minimum(k.clip(0) * rate, step))
          for a in range(int(moves), n - 3)]  # fmt: skip
    best = min(found for over, found in (arrived(each, step, lag) for each in up) if over < 1e-3)
    assert settled <= best + 2


def test_only_a_drive_that_a_limit_has_kept_short_is_braked() -> None:
    """If the limit is never reached, the drive is that of the lag alone, whatever the reference does."""
    lag = effect("lag", time_constant=20.0 * T)
    t = times()
    u = smooth(t) + np.where(t > 0.3, 0.2, 0.0)
    plain, _ = both([lag], (), t, u)
    fast = float(np.max(np.abs(np.diff(plain)))) / T
    limited, _ = both([lag, effect("slew_limit", rate=1.001 * fast)], (), t, u)
    assert np.array_equal(limited, plain)


@pytest.mark.parametrize("name", ["creep", "creep, logarithmic", "relaxation", "loop centre", "tanh"])
def test_steps_of_the_reference_are_taken_at_once(name: str) -> None:
    t = times()
    u = smooth(t) + np.where((t % 0.1) < 0.03, 2.0, 0.0)
    _, y = both(EXACT[name], (), t, u)
    assert float(np.max(np.abs(y - u))) <= 1e-12 * 9.0


def test_a_lag_leaves_its_share_of_the_second_difference() -> None:
    t, tau = times(), 10.0 * T
    v, y = both([effect("lag", time_constant=tau)], (), t, smooth(t))
    chain = Chain(Cascade(PLAYS, (), 1.0, (0.0, 100.0)), [])
    wanted = Compensator(chain).drives(Run(t, smooth(t), {}), WIDE)  # the drive behind the lag
    theta = (1.0 - np.exp(-T / tau)) ** -1 * (tau / T * -np.expm1(-T / tau) - np.exp(-T / tau))
    most = float(np.sum(PLAYS.weights)) * theta**2 * float(np.max(np.abs(np.diff(wanted, 2))))
    assert 1e-4 < float(np.max(np.abs(y - smooth(t)))) <= most
    static = chain.simulate([Run(t, _lagged(wanted, tau), {})])[0]
    assert float(np.std(y - smooth(t))) < 0.01 * float(np.std(static - smooth(t)))
    assert np.all(np.isfinite(v))


def _lagged(v: Array, tau: float) -> Array:
    """`tau a' + a = v` for straight v, by 200 small steps per sample."""
    a, out = v[0], [v[0]]
    for before, after in itertools.pairwise(v):
        for k in range(200):
            a += (before + (after - before) * (k + 0.5) / 200 - a) * T / 200 / tau
        out.append(a)
    return np.array(out)


def test_a_lag_answers_limits_without_a_trace() -> None:
    """The lag's memory follows the limited drives, so soon after the last of them no error is left."""
    t = times()
    chain = Chain(Cascade(PLAYS, (), 1.0, (0.0, 100.0)), [effect("lag", time_constant=3.0 * T)])
    u = np.where(t < 0.7, 3.0, 6.0)
    v = Compensator(chain).drives(Run(t, u, {}), (0.0, 30.0))
    y = chain.simulate([Run(t, v, {})])[0]
    limited = np.flatnonzero(v == 30.0)
    assert 0 < len(limited) < 20
    assert float(np.max(np.abs(y - u)[limited[-1] + 5 :])) < 1e-12 * 9.0
    assert float(np.max(y)) < 6.0 + 0.25 * 3.0  # a step's second difference times theta^2, as without limits


@pytest.mark.parametrize("shift", [0.0, 2.6, 7.0])
def test_a_delay_is_met_ahead_of_time(shift: float) -> None:
    t = times()
    _, y = both([effect("delay", time=shift * T), CREEP], (), t, smooth(t))
    inside = slice(0, N - 9)  # the last drives are for a reference beyond the end
    curvature = float(np.max(np.abs(np.diff(both([CREEP], (), t, smooth(t))[0], 2))))
    slope = 1.1 * float(np.sum(PLAYS.weights))
    assert float(np.max(np.abs(y - smooth(t))[inside])) <= slope * curvature / 4 * (shift % 1 > 0) + 1e-12 * 9.0


def test_a_mode_arrives_as_the_mean_of_three_samples() -> None:
    t = times()
    mode = effect("resonance", frequency=20.0, damping=0.02)
    _, y = both([mode], (), t, smooth(t))
    sides = np.pad(smooth(t), 1, mode="edge")
    expected = (sides[:-2] + 4.0 * sides[1:-1] + sides[2:]) / 6.0
    assert float(np.max(np.abs(y - expected))) < 2e-3 * 9.0
    static = both([], (), t, smooth(t))[0]
    rung = Chain(Cascade(PLAYS, (), 1.0, (0.0, 100.0)), [mode]).simulate([Run(t, static, {})])[0]
    assert float(np.std(y - smooth(t))) < 0.02 * float(np.std(rung - smooth(t)))
    with pytest.raises(EffectsError, match="evenly spaced"):
        both([mode], (), times(uneven=True), smooth(times(uneven=True)))


FILE = """\
hystgen: 1
name: stage_x
sample_time: 0.001
input_range: [0, 100]
model:
  pi: {thresholds: [0, 5, 10, 20], weights: [0.1, 0.02, 0.02, 0.03]}
  effects:
"""


@pytest.fixture
def model(tmp_path: Path) -> Callable[[str], hystgen.Model]:
    def of(effects: str) -> hystgen.Model:
        (tmp_path / "stage_x.yaml").write_text(FILE + effects)
        return hystgen.load(tmp_path / "stage_x.yaml")

    return of


RUNG = """\
    - {name: resonance, frequency: 20, damping: 0.02}
    - {name: delay, time: 2.6e-3}
    - {name: lag, time_constant: 0.01}
emit: {compensation: {%s}}
"""


@pytest.mark.parametrize(
    "options",
    [
        "resonance: notch", "resonance: shaper", "resonance: none", "taps: 5", "noise_gain: 8",
        "noise_gain: 8, preview: 0", "preview: 0", "preview: 9", "corner: 6", "drive_hold: held", "quiet: true",
        "resonance: notch, corner: 7, preview: 2, drive_hold: held",
    ],
)  # fmt: skip
def test_the_reference_is_read_as_the_c_reads_it(options: str, model: Callable[[str], hystgen.Model]) -> None:
    """Double precision against the bit-exact reference in float64, whose rounding is below 1e-11 with a lead of 250."""
    one = model(RUNG % (options if "noise_gain" in options else f"{options}, noise_gain: 10000"))
    rng = np.random.default_rng(0)
    u = np.concatenate([np.full(20, 7.0), 7.0 + np.cumsum(0.02 * rng.normal(size=180))])
    with jit.plain():
        emitted = one.inverse().simulate(u, "float64")
    assert float(np.max(np.abs(one.inverse().simulate(u, clamp=True) - emitted))) < 1e-10
    usual = model(RUNG % "").inverse().simulate(u, clamp=True)
    assert np.array_equal(one.inverse().simulate(u, clamp=True), usual) == (options in ("quiet: true", "preview: 9"))


@pytest.mark.parametrize("by", ["notch", "shaper"])
def test_a_step_that_is_shaped_or_notched_leaves_no_ringing(by: str, model: Callable[[str], hystgen.Model]) -> None:
    """The plays move one way only in the first step, so it does not ring; unshaped it rings by over half the step."""
    mode = f"    - {{name: resonance, frequency: 20, damping: 0.02}}\nemit: {{compensation: {{resonance: {by}}}}}\n"
    one = model(mode)
    u = np.where(np.arange(300) < 20, 1.0, 6.0)
    y = one.simulate(one.inverse().simulate(u))
    assert float(np.max(np.abs(y - u)[100:])) < 1e-12 * 5.0
    still = model(mode.replace(by, "none"))
    assert float(np.max(np.abs(still.simulate(still.inverse().simulate(u)) - u)[100:])) > 0.5 * 5.0


def test_options_that_count_samples_need_them_at_even_times(model: Callable[[str], hystgen.Model]) -> None:
    lag = "    - {name: lag, time_constant: 0.01}\nemit: {compensation: {%s}}\n"
    t = times(uneven=True)
    with pytest.raises(EffectsError, match=r"emit\.compensation needs evenly spaced samples; resample"):
        model(lag % "corner: 4").inverse().simulate(smooth(t), t=t)
    with pytest.raises(EffectsError, match=r"leave a noise gain of 1, more than emit\.compensation\.noise_gain = 0\.5"):
        model(lag % "noise_gain: 0.5").inverse().simulate(smooth(times()), t=times())
    assert np.all(np.isfinite(model(lag % "quiet: true").inverse().simulate(smooth(t), t=t)))


def test_references_before_a_record_are_its_first(run: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    """Drives before a record are not references; a linear stage does not remember them either."""
    shaped = RUNG.replace("    - {name: lag, time_constant: 0.01}\n", "") % "resonance: shaper"
    text = (FILE + shaped).replace("[0, 5, 10, 20], weights: [0.1, 0.02, 0.02, 0.03]", "[0], weights: [0.2]")
    (tmp_path / "stage_x.yaml").write_text(text)
    t, path = times(), tmp_path / "u.csv"
    np.savetxt(path, np.column_stack([t, smooth(t)]), delimiter=",", header="t,u", comments="")
    found = []
    for history in ((), ("--history", "80,20")):
        code, out, err = run("simulate", tmp_path / "stage_x.yaml", path, "--operator", "inverse", *history)
        assert (code, err[:7], "\n" in err) == (0, "u.csv: ", False), "only how fast it moves"
        found.append(out)
    assert found[0] == found[1]


def test_thresholds_that_grow_too_fast_are_stood_in_for() -> None:
    """Their own inverse would chatter; with the stand-in, drives are about as smooth as those of the static inverse."""
    t = times()
    fast = effect("rate_dependence", betas=(5.0 * T,) * 9)
    v, y = both([fast], (), t, smooth(t))
    static = both([], (), t, smooth(t))[0]
    rough = [float(np.max(np.abs(np.diff(each, 2)))) for each in (v, static)]
    assert rough[0] < 2.0 * rough[1]
    plain = Chain(Cascade(PLAYS, (), 1.0, (0.0, 100.0)), [fast]).simulate([Run(t, static, {})])[0]
    assert float(np.std(y - smooth(t))) < 0.3 * float(np.std(plain - smooth(t)))


def test_what_has_no_inverse_says_why(model: Callable[[str], hystgen.Model]) -> None:
    for effects, kind, said in (
        ("    - {name: drift, rate: 1}\n", EffectsError, r"cannot include drift \(a clock"),
        (
            "    - {name: thermal, source: self_heating, time_constant: 10, heating: 1.0e-5}\n",
            EffectsError, "own heat",
        ),
        (
            "    - {name: creep, shape: logarithmic, per_decade: 0.3, t0: 1000, t_min: 1.0e-3, t_max: 1000}\n",
            NotInvertibleError, "nothing of a step arrives at once",
        ),
    ):  # fmt: skip
        with pytest.raises(kind, match=said):
            model(effects).inverse()
        assert np.all(np.isfinite(model(effects).simulate([0.0, 1.0, 2.0])))


def test_records_are_one_session(run: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    """Drives of `simulate --operator inverse`, simulated forwards, give the references; nothing is limited."""
    (tmp_path / "stage_x.yaml").write_text(FILE + "    - {name: creep, time_constants: [0.2], weights: [0.05]}\n")
    t = T * np.arange(400)
    references = []
    for k, name in enumerate(("one.csv", "two.csv")):
        u = 6.0 + 4.0 * np.sin(20.0 * t + k) * t
        references.append(u)
        np.savetxt(tmp_path / name, np.column_stack([t, u]), delimiter=",", header="t,u", comments="", fmt="%.17g")
    files = [tmp_path / "one.csv", tmp_path / "two.csv"]
    code, _, err = run(
        "simulate", tmp_path / "stage_x.yaml", *files, "--operator", "inverse", "-o", tmp_path / "v", "--history",
        "50,0", "--rest", "0.1",
    )  # fmt: skip
    said = [line.partition(",")[0] for line in err.splitlines()]
    assert (code, said) == (0, [f"{file.name}: 400 samples at {1.0 / T:g} Hz" for file in files])
    made = [tmp_path / "v" / file.name for file in files]
    code, _, err = run(
        "simulate", tmp_path / "stage_x.yaml", *made, "-o", tmp_path / "y", "--history", "50,0", "--rest", "0.1"
    )
    assert (code, err) == (0, "")
    for file, u in zip(files, references, strict=True):
        y = np.loadtxt(tmp_path / "y" / file.name, delimiter=",", skiprows=1)
        assert float(np.max(np.abs(y[:, -1] - u))) < 1e-6 * 9.0
