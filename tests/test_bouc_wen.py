"""Elements in parallel with the plays: against their equation, and against plants that share nothing with them."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from modelfiles import BRANCHES, CREEP, TANH, chain
from numpy.typing import NDArray

import hystgen
from hystgen import plants
from hystgen.basics import jit
from hystgen.basics.problems import EffectsError, ParameterError
from hystgen.cascade import PI, Cascade
from hystgen.chain.chain import Chain
from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.search.hypothesis import Actuator
from hystgen.effects import About, Effect, Run, shapes
from hystgen.effects.bouc_wen.compensator import DEGREE, EXACT
from hystgen.effects.bouc_wen.curve import distance, halves, size
from hystgen.effects.bouc_wen.pieces import extremes, pieces
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters

Array = NDArray[np.float64]

LAWS = [(1.0, 1.0), (1.0, 0.5), (1.0, 2.0), (1.1, 0.7), (1.5, 4.0), (2.0, 1.0), (2.7, 1.43), (5.5, 0.6), (10.0, 4.0)]
law = pytest.mark.parametrize(("exponent", "balance"), LAWS)

THRESHOLDS, WEIGHTS = (0.0, 0.45, 0.9), (0.72, 0.6, 0.48)


def make(**keys: Any) -> Effect:
    """An effect built from its keys in a parameter file."""
    at = ("bouc_wen", "dahl", "duhem").index(keys.get("shape", "bouc_wen"))
    return shapes("bouc_wen")[at].model_validate({"name": "bouc_wen", **keys})


def wave(n: int, seed: int, size: float = 2.0) -> Array:
    """A smooth drive of random amplitude and bias with about 20 reversals, at 0 first."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, n)
    parts = [rng.normal() * (np.sin(2 * np.pi * (f * t + a)) - np.sin(2 * np.pi * a))
             for f, a in zip((0.6, 2.1, 5.3, 9.7), rng.uniform(size=4), strict=True)]
    return np.asarray(size * np.sum(parts, axis=0))


def integrated(w: Array, width: float, exponent: float, balance: float, parts: int, tilt: float = 0.0) -> Array:
    """z at the inputs `w`, by the classical Runge-Kutta method with `parts` steps from each input to the next."""

    def slope(x: float, z: float, sign: float) -> float:
        return 1.0 + tilt * x - (balance * np.sign(z * sign) + 1.0 - balance) * abs(z / width) ** exponent

    z, found = 0.0, [0.0]
    for start, move in zip(w[:-1].tolist(), np.diff(w).tolist(), strict=True):
        h, sign = move / parts, float(np.sign(move))
        for k in range(parts if move else 0):
            x = start + k * h
            a = slope(x, z, sign)
            b = slope(x + 0.5 * h, z + 0.5 * h * a, sign)
            c = slope(x + 0.5 * h, z + 0.5 * h * b, sign)
            d = slope(x + h, z + h * c, sign)
            z += h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        found.append(z)
    return np.array(found)


@law
def test_the_curve_is_its_equation(exponent: float, balance: float) -> None:
    """`d = int dm/(1 - c m^n)`, by quadrature in `m^(1/6)`, in which the integrand is smooth at 0 for all exponents."""
    for half, c in zip(halves(exponent, balance), (1.0, 1.0 - 2.0 * balance), strict=True):
        m = np.concatenate([np.linspace(0.0, 0.98, 50), 1.0 - np.logspace(-2, -12, 11), [1.0] if c <= 0.0 else []])
        u = m ** (1.0 / 6.0)
        places, shares = np.polynomial.legendre.leggauss(40)
        v = 0.5 * (u[1:, None] + u[:-1, None] + np.diff(u)[:, None] * places)
        pieces = 0.5 * np.diff(u) * ((6.0 * v**5 / (1.0 - c * v ** (6.0 * exponent))) @ shares)
        d = np.concatenate([[0.0], np.cumsum(pieces)])
        assert np.max(np.abs(np.array([size(half, x) for x in d]) - m)) < 2e-14
        back = np.array([distance(half, x) for x in m])
        assert np.max(np.abs(back - d) * (1.0 - c * m**exponent)) < 2e-14


@law
def test_an_element_is_its_equation(exponent: float, balance: float) -> None:
    """The error of the integration is the difference between two of its step sizes, of which the finer is used."""
    w, width = wave(301, 3), 0.8
    found = make(weights=(1.0,), widths=(width,), exponent=exponent, balance=balance).parallel(w)
    fine, coarse = (integrated(w, width, exponent, balance, parts) for parts in (100, 50))
    assert np.max(np.abs(found - fine)) < 2.0 * np.max(np.abs(fine - coarse)) + 1e-13
    assert np.max(np.abs(fine - coarse)) < 2e-5
    assert np.max(np.abs(found)) <= width


@pytest.mark.parametrize(("width", "tilt"), [(0.8, 0.1), (0.8, -0.1), (4.0, -0.07), (0.2, 0.11)])
def test_a_tilted_element_is_its_equation(width: float, tilt: float) -> None:
    """The same for Duhem's elements, whose input stays where `|tilt| width < 1 + tilt w`."""
    w = wave(301, 3)
    effect = make(shape="duhem", weights=(1.0,), widths=(width,), tilts=(tilt,))
    assert not [*effect.problems_within(float(np.min(w)), float(np.max(w)))]
    fine, coarse = (integrated(w, width, 1.0, 1.0, parts, tilt) for parts in (100, 50))
    assert np.max(np.abs(effect.parallel(w) - fine)) < 2.0 * np.max(np.abs(fine - coarse)) + 1e-13
    assert np.max(np.abs(fine - coarse)) < 2e-5


@pytest.mark.parametrize(("alpha", "a", "c", "d"), [(0.06, 0.1, 0.06, 2e-4), (0.1, 0.1, 0.15, -4e-4)])
def test_a_duhem_plant_is_an_element(alpha: float, a: float, c: float, d: float) -> None:
    """`dy = alpha |dv| (a v - y) + (c + d v) dv`: the difference is the tolerance of the plant's integration."""
    along = wave(1500, 5)
    v = np.concatenate([[0.0], 50.0 + 50.0 * along / np.max(np.abs(along))])
    effect = make(shape="duhem", weights=(c - a,), widths=(1.0 / alpha,), tilts=(d / (c - a),))
    assert not [*effect.problems_within(0.0, 100.0)]
    plant = plants.Duhem.coleman_hodgdon(alpha, lambda x: a * x, lambda x: c + d * x)
    found = Chain(Cascade(PI([0.0], [a])), [effect]).output(Run(np.arange(len(v)) * 1e-3, v))
    assert np.max(np.abs(found - plant.simulate(v))) < 1e-8


@pytest.mark.parametrize(("beta", "gamma", "n"), [(0.5, 0.5, 1.0), (0.6, -0.3, 1.0), (0.6, 0.3, 2.0), (0.4, -0.2, 2.0)])
def test_a_bouc_wen_plant_is_an_element(beta: float, gamma: float, n: float) -> None:
    """`D dz/dv = 1 - (beta sgn + gamma) |z|^n` in the plant's units; the element's has `|z| <= width`."""
    alpha, k, scale = 1.6, 0.1, 0.7
    v = wave(4000, 5)
    plant = plants.BoucWen(alpha=alpha, k=k, D=scale, beta=beta, gamma=gamma, n=n)
    width = scale * (beta + gamma) ** (-1.0 / n)
    effect = make(weights=((1.0 - alpha) * k,), widths=(width,), exponent=n, balance=beta / (beta + gamma))
    found = Chain(Cascade(PI([0.0], [alpha * k])), [effect]).output(Run(np.arange(len(v)) * 1e-3, v))
    assert np.max(np.abs(found - plant.simulate(v))) < 1e-12


def test_a_dahl_plant_is_an_element() -> None:
    """Dahl's force rises with slope `sigma` from 0 to `limit`."""
    plant = plants.Dahl(limit=0.6, sigma=1.5)
    v = wave(4000, 6)
    found = make(shape="dahl", weights=(1.5,), widths=(0.4,)).parallel(v)
    assert np.max(np.abs(found - plant.simulate(v))) < 1e-12


def test_dahl_is_bouc_wen_with_exponent_and_balance_1() -> None:
    w = wave(500, 7)
    keys = {"weights": (0.3, -0.1), "widths": (0.5, 2.0)}
    assert np.array_equal(make(**keys).parallel(w), make(shape="dahl", **keys).parallel(w))


def test_many_small_reversals_of_a_tilted_element_leave_no_error_behind() -> None:
    """The same with Duhem's law, by which z shrinks by `z/width` per distance, while the tilt cancels in each pair."""
    pairs, d, width, tilt = 200_000, 1e-9, 1.0, 0.2
    w = np.concatenate([np.linspace(0.0, 0.3, 50), np.tile([0.3 + d, 0.3], pairs)])
    z = make(shape="duhem", weights=(1.0,), widths=(width,), tilts=(tilt,)).parallel(w)
    moved = pairs * d * 2.0 * z[49] / width
    assert abs(z[49] - z[-1] - moved) < 1e-3 * moved + 1e-11


@law
def test_many_small_reversals_leave_no_error_behind(exponent: float, balance: float) -> None:
    """A dithered rest: exact moves of one last bit either way change z by as much, and nothing accumulates.

    From z = 0.3 width, each pair of moves d reduces s by `d (2 b s^n)/width`, to first order in d.
    """
    pairs, d, width = 200_000, 1e-9, 1.0
    w = np.concatenate([np.linspace(0.0, 0.3, 50), np.tile([0.3 + d, 0.3], pairs)])
    z = make(weights=(1.0,), widths=(width,), exponent=exponent, balance=balance).parallel(w)
    s = z[49] / width
    moved = pairs * d * 2.0 * balance * s**exponent
    assert abs(z[49] - z[-1] - moved) < 1e-3 * moved + pairs * d * d + 1e-11


def test_the_sum_goes_through_what_follows_the_plays() -> None:
    """Creep, gains and modes see the sum of plays and elements: linear parts of the chain act on each alone."""
    v = wave(2000, 8)
    run = Run(np.arange(len(v)) * 1e-3, v, {"temperature": 20.0 + np.sin(np.arange(len(v)) * 0.01)})
    effect = make(weights=(-0.2, 0.3), widths=(0.7, 1.4), exponent=2.0, balance=0.7)
    creep = shapes("creep")[0].model_validate({"name": "creep", "time_constants": (0.02, 0.3), "weights": (0.05, 0.1)})
    thermal = shapes("thermal")[0].model_validate({"name": "thermal", "gain_per_degree": 0.01, "reference": 19.0})
    plays = Cascade(PI(THRESHOLDS, WEIGHTS), (), 0.3)
    together = Chain(plays, [thermal, effect, creep]).output(run)
    alone = Chain(plays, [thermal, creep]).output(run)
    extra = thermal.gain(run) * creep.filtered(effect.parallel(v), run)
    assert np.max(np.abs(together - alone - extra)) < 1e-13
    assert np.max(np.abs(extra)) > 0.1


BEHIND: dict[str, dict[str, Any]] = {
    "creep": {"time_constants": (0.02,), "weights": (0.1,)}, "resonance": {"frequency": 40.0, "damping": 0.1},
    "thermal": {"gain_per_degree": 0.01, "reference": 19.0}, "saturation": {"level": 4.0},
}


@pytest.mark.parametrize(
    ("others", "history"),
    [
        ((), None), (("creep",), None), (("creep", "resonance"), ()), (("thermal", "resonance"), ()),
        (("saturation",), ()), ((), (1.5, -0.7)), (("saturation",), (1.5, -0.7)),
    ],
)
def test_a_hypothesis_is_the_chain(others: tuple[str, ...], history: tuple[float, ...] | None) -> None:
    """The diagnosis predicts what the chain simulates after the same history, up to an offset."""
    effects = [make(weights=(-0.2,), widths=(0.7,), exponent=1.7)]
    effects += [shapes(name)[0].model_validate({"name": name, **BEHIND[name]}) for name in others]
    v = np.concatenate([history or (), wave(800, 9)])
    warm = {"temperature": np.full(len(v), 21.0)}
    whole = Run(np.arange(len(v)) * 1e-3, v, warm)
    run = whole.picked(np.arange(len(history or ()), len(v)))
    run = Run(run.t, run.v, dict(run.extra))
    y = Chain(Cascade(PI(THRESHOLDS, WEIGHTS)), effects).output(whole)[-len(run.t) :]
    actuator = Actuator(np.array(THRESHOLDS), (), tuple(effects))
    for weights in (None, np.array(WEIGHTS)):
        rows, constant = actuator.columns(Item("a record", run, y, history, 1.0), weights)
        found = (np.array(WEIGHTS) @ rows if weights is None else rows[0]) + constant
        assert np.ptp(actuator.mapped(found, 0.0, run) - y) < 1e-12


def test_candidates_are_effects_and_contain_none() -> None:
    about = About((-1.0, 4.0), 8.0, 1e-3, 2.0, 2.0, 50.0, 30.0, THRESHOLDS)
    found = [each for kind in shapes("bouc_wen") for each in kind.candidates(about)]
    assert len({each.label for each in found}) == len(found) == 5
    w = wave(300, 2)
    for each in found:
        for x in (each.low, each.high, each.start, *each.others):
            assert np.all(np.abs(each.build(x).parallel(w)) <= 3 * 2 * 5.0 * 8.0)
        assert each.none is not None
        assert not np.any(each.build(each.none).parallel(w))
        widths = {tuple(each.build(x).model_dump()["widths"]) for x in (each.start, *each.others)}
        assert len(widths) == 5


REFUSED = {
    "weights: [1], widths: [1, 2]": "widths: has 2 values for 1 in weights; give as many as weights",
    "weights: [1, 1, 1, 1], widths: [1, 1, 1, 1]": "weights: has 4 values, more than 3; shorten the list",
    "weights: [1], widths: [0]": "widths[0]: must be above 0",
    "weights: [1], widths: [1], exponent: 0.9": "exponent: must be at least 1",
    "weights: [1], widths: [1], exponent: 11": "exponent: must be at most 10",
    "weights: [1], widths: [1], balance: 0.4": "balance: must be at least 0.5",
    "weights: [1], widths: [1], balance: 5": "balance: must be at most 4",
    "shape: dahl, weights: [1], widths: [1], exponent: 1": "exponent: unknown key",
    "shape: dahl, weights: [1]": "widths: is missing",
    "shape: duhem, weights: [1], widths: [1]": "tilts: is missing",
    "shape: duhem, weights: [1], widths: [1], tilts: [0, 0]": "tilts: has 2 values for 1 in weights; give as many as",
}


@pytest.mark.parametrize("keys", REFUSED)
def test_wrong_keys_are_refused(keys: str, tmp_path: Path) -> None:
    head = "hystgen: 1\nname: x\ninput_range: [0, 1]\nmodel:\n  pi: {thresholds: [0], weights: [1]}\n"
    path = tmp_path / "x.yaml"
    path.write_text(f"{head}  effects: [{{name: bouc_wen, {keys}}}]\n")
    with pytest.raises(ParameterError) as caught:
        hystgen.load(path)
    assert f"model.effects[0].{REFUSED[keys]}" in str(caught.value)


@pytest.mark.parametrize("keys", [
    {"shape": "dahl", "widths": (2.0,)}, {"widths": (9.0,), "exponent": 2.0, "balance": 0.7},
    {"shape": "duhem", "widths": (2.0,), "tilts": (-0.1,)}, {"shape": "duhem", "widths": (9.0,), "tilts": (0.07,)},
    {"shape": "duhem", "widths": (1.0,), "tilts": (-0.16,)}, {"shape": "duhem", "widths": (30.0,), "tilts": (-0.027,)},
])  # fmt: skip
def test_no_history_exceeds_the_extremes(keys: dict[str, Any]) -> None:
    """z and its slope after random moves within the range, and after the moves that lead to the extremes."""
    low, high = -2.0, 5.0
    effect = make(weights=(1.0,), **keys)
    assert not [*effect.problems_within(low, high)]
    (width,), (tilt,) = effect.widths, effect.leans
    ends, steepest = extremes((width, tilt), effect.law, low, high)
    rng, slopes, reached = np.random.default_rng(7), [], []
    grid = np.linspace(low, high, 141)
    begun = [[low, high], [high, low], *([low, x] for x in grid), *([high, x] for x in grid)]
    for turns in (*begun, *(rng.uniform(low, high, 12) for _ in range(200))):
        w = np.concatenate([[turns[0]], *(np.linspace(a, b, 60)[1:] for a, b in itertools.pairwise(turns))])
        back = np.clip(w[-1] - 1e-6 * np.sign(w[-1] - w[-2]), low, high)
        z = effect.parallel(np.append(w, back))
        slopes.append((z[-1] - z[-2]) / (back - w[-1]) if back != w[-1] else 0.0)
        reached.append((-z[:-1][w == low], z[:-1][w == high]))
    for end, found in zip(ends, zip(*reached, strict=True), strict=True):
        assert max(float(np.max(each, initial=0.0)) for each in found) == pytest.approx(end, rel=1e-12)
    assert max(slopes) <= steepest + 1e-6
    assert max(slopes) == pytest.approx(steepest, rel=2e-3)


@pytest.mark.parametrize("effect", [
    "weights: [0.3], widths: [6]", "shape: dahl, weights: [0.3], widths: [3]",
    "shape: duhem, weights: [0.3], widths: [3], tilts: [-0.1]",
    "shape: duhem, weights: [-0.1], widths: [3], tilts: [0.1]",
])  # fmt: skip
def test_the_output_range_is_reached_and_not_exceeded(effect: str) -> None:
    """From rest at one end of the range, in one move to the other: no history leads further."""
    one = model("one", f"name: bouc_wen, {effect}")
    limits = one.compiled("float64").tables.limits.output
    low, high = one.cascade.input_range
    rng, ends = np.random.default_rng(3), []
    for turns in ([low, high], [high, low], [low], [high], *(rng.uniform(low, high, 8) for _ in range(50))):
        y = one.simulate(np.concatenate([[turns[0]], *(np.linspace(a, b, 40) for a, b in itertools.pairwise(turns))]))
        ends.append((float(np.min(y)), float(np.max(y))))
    assert min(each[0] for each in ends) == pytest.approx(float(limits.low[0]), abs=1e-9)
    assert max(each[1] for each in ends) == pytest.approx(float(limits.high[0]), abs=1e-9)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ("weights: [1], widths: [3], tilts: [-0.25]", "tilts[0] must be above -0.25, not -0.25: for inputs of the "
         "plays w = 0 .. 1, 1 + tilt w has to exceed |tilt| times the width"),
        ("weights: [1, 1], widths: [1, 0.5], tilts: [0.99, 2]", "tilts[1] must be below 2, not 2: for"),
        ("weights: [-0.7], widths: [0.1], tilts: [-0.3]", "right after a turn the output falls as the drive rises"),
    ],
)
def test_tilts_without_a_limit_or_an_inverse_are_refused_at_emission(keys: str, said: str, tmp_path: Path) -> None:
    head = "hystgen: 1\nname: x\nsample_time: 1.0\ninput_range: [0, 1]\nmodel:\n  pi: {thresholds: [0], weights: [1]}\n"
    path = tmp_path / "x.yaml"
    path.write_text(f"{head}  effects: [{{name: bouc_wen, shape: duhem, {keys}}}]\n")
    with pytest.raises(EffectsError) as caught:
        hystgen.emit(hystgen.load(path), tmp_path)
    assert said in str(caught.value)


# In the C ----------------------------------------------------------------------------------------------------

ARITHMETICS = ("float32", "float64", "q31", "q15")

TWO = "name: bouc_wen, weights: [-0.2, 0.1], widths: [2, 0.7], exponent: 1.6, balance: 1.3"
DAHL = "name: bouc_wen, shape: dahl, weights: [-0.15], widths: [1]"
TILTED = "name: bouc_wen, shape: duhem, weights: [-0.2, 0.1], widths: [2, 0.7], tilts: [-0.06, 0.08]"
SOFT = "name: bouc_wen, weights: [3], widths: [0.5], exponent: 2"

COMBINED = {
    "alone": (TWO,),
    "soft": (SOFT,),
    "tilted": (TILTED,),
    "dilated": (DAHL, "name: rate_dependence, betas: [1.0e-4, 1.0e-4, 1.0e-4, 2.0e-4, 2.0e-4, 2.0e-4]"),
    "dashpot": (TWO, "name: rate_dependence, shape: relaxation, time_constant: 5.0e-3, exponent: 2.5"),
    "relaxing": (DAHL, "name: rate_dependence, shape: relaxation, time_constant: 5.0e-3"),
    "polynomials": (TWO, "name: noncongruent, coefficients: [[0.05, -0.01], [0.02], [0.01], [0.05], [0.05], [0.05]]"),
    "lagged": (DAHL, "name: lag, time_constant: 0.01", CREEP, "name: slew_limit, rate: 3000"),
    "late": (TWO, "name: delay, time: 2.6e-3", "name: resonance, frequency: 40, damping: 0.3",
             "name: saturation, level: 12"),
    "warm": (DAHL, "name: thermal, gain_per_degree: 0.001", "name: ageing, loss: 0.01, travel: 100"),
}
ALLOWED = "emit: {compensation: {noise_gain: 1.0e+4}}\n"


def model(name: str, *effects: str, front: str = "") -> Model:
    return Model(parse_parameters(chain(name, *effects, front=front) + ALLOWED, f"{name}.yaml"))


@pytest.mark.slow(one_in=3)
@pytest.mark.thorough(but_one_in=9)
@pytest.mark.parametrize("more", [0, 2])
@pytest.mark.parametrize("name", COMBINED)
def test_the_c_gives_the_bits_of_the_reference(name: str, more: int) -> None:
    """Every combination in one floating-point and one fixed-point arithmetic, and behind different fronts."""
    at = list(COMBINED).index(name) + more
    one = model(name, *COMBINED[name], front=("", TANH, BRANCHES)[at % 3])
    with jit.plain():
        report = hystgen.verify(one, ARITHMETICS[at % 4], "both", "loop", compiler=["gcc"], length=100)
    assert report.ok, report.table()


def codes(one: Model, arithmetic: str) -> tuple[float, float]:
    """Drive and output units of an arithmetic."""
    found = one.compiled(arithmetic).codes
    return (1.0, 1.0) if found is None else (float(found.drive_lsb), float(found.output_lsb))


def answers(one: Model, x: Array, arithmetic: str, inverse: bool = False) -> Array:
    """Answers of the bit-exact reference in output or drive units, for inputs that the arithmetic can hold."""
    asked = one.inverse() if inverse else one
    units = codes(one, arithmetic)
    there, back = units[::-1] if inverse else units
    given = x if there == 1.0 else np.rint(x / there).astype(np.int64)
    return np.asarray(asked.simulate(given, arithmetic=arithmetic), dtype=np.float64) * back


def held(one: Model, x: Array, arithmetic: str, unit: int) -> Array:
    """The inputs as the arithmetic holds them."""
    step = codes(one, arithmetic)[unit]
    return np.float32(x).astype(float) if step == 1.0 else np.rint(x / step) * step


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize("effect", [TWO, DAHL, TILTED, SOFT])
def test_both_operators_follow_the_model(effect: str, arithmetic: str) -> None:
    """Errors are a few roundings: in floating point of the largest output, in fixed point of the codes."""
    one = model("one", effect)
    low, high = one.cascade.input_range
    v = 0.5 * (low + high) + 0.45 * (high - low) * np.sin(np.cumsum(np.random.default_rng(4).uniform(0.0, 0.1, 3000)))
    v = held(one, v, arithmetic, 0)
    y = one.simulate(v)
    size, slopes = float(np.max(np.abs(y))), 2.0  # the sum of all weights is below 2.6, the least slope above 0.5
    units = codes(one, arithmetic)
    unit = {"float32": 2.0**-24 * size, "float64": 2.0**-53 * size}.get(arithmetic, units[1])
    allowed = 16.0 * unit
    if (effect, arithmetic) == (TILTED, "float64"):
        # the model has this curve as an exponential, the C as polynomials, whose errors are not roundings alone
        curve, found = pieces(1.0, 1.0, DEGREE, EXACT), one.compiled(arithmetic).tables.moving.elements.element
        allowed = (curve.error + curve.slip) * float(np.sum(np.abs(found.amplitude)))
    found = answers(one, v, arithmetic)
    assert np.max(np.abs(found - y)) < allowed
    references = held(one, y, arithmetic, 1)
    sent = answers(one, references, arithmetic, inverse=True)
    assert np.max(np.abs(one.simulate(sent) - references)) < allowed + slopes * units[0] * (units[0] < 1.0)


@pytest.mark.slow(one_in=2)
@pytest.mark.thorough(but_one_in=6)
@pytest.mark.parametrize("arithmetic", ["float32", "q31", "q15"])
@pytest.mark.parametrize("effect", [TWO, TILTED])
def test_a_dithered_rest_gathers_no_error(effect: str, arithmetic: str) -> None:
    """A million moves of a last bit either way: the exact law then relaxes z by as much as the arithmetic does."""
    one = model("one", effect)
    low, high = one.cascade.input_range
    drive, output = codes(one, arithmetic)
    bit = drive if drive < 1.0 else 2.0**-23 * 2.0
    begin = held(one, np.linspace(low, low + 0.7 * (high - low), 400), arithmetic, 0)
    v = np.concatenate([begin, begin[-1] + np.tile([bit, 0.0], 500_000)])
    v = held(one, v, arithmetic, 0)
    y = one.simulate(v)
    found = answers(one, v, arithmetic)
    unit = output if drive < 1.0 else 2.0**-24 * float(np.max(np.abs(y)))
    assert np.max(np.abs(found - y)) < 16.0 * unit
