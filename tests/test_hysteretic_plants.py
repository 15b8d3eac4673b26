"""The plants of `hystgen.plants` agree with other integrators, with brute force, and with their literature."""

from __future__ import annotations

import csv
import importlib.util
import math
import sys
from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import accumulate, pairwise
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
import scipy.integrate
from numpy.typing import NDArray
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import hystgen
from hystgen import plants
from hystgen.cascade import PI
from hystgen.emission.calls import emitted_files
from hystgen.plants import EverettTable, integration
from hystgen.plants.jiles_atherton import langevin, langevin_slope
from hystgen.records import Record

pytestmark = pytest.mark.thorough

Array = NDArray[np.float64]
EPS = float(np.finfo(np.float64).eps)
U = EPS / 2.0  # largest error of one rounding, as a share of its result

CORNERS = [0.0, 3.0, -2.0, 1.5, -0.5, 1.0, 0.25, 2.5, -4.0, 4.0, 0.0, 3.5, 3.5, 1.0, -1.0]


def path(corners: list[float] = CORNERS, samples: int = 25) -> Array:
    """Samples on straight lines between the corners, which are samples themselves."""
    return np.concatenate([np.linspace(a, b, samples, endpoint=False) for a, b in pairwise(corners)] + [corners[-1:]])


def over_input(
    slope: Callable[[float, float, float], float], v: Array, start: float, atol: float
) -> tuple[Array, float]:
    """State at the samples by scipy, integrated move by move; slope(v, y, direction).

    Also the sum of the errors allowed to its steps: the error at the end where moves bring states together.
    """
    states, y, last, allowed = [], start, 0.0, 0.0
    for x in v:
        if x != last:
            sign = math.copysign(1.0, x - last)
            found = solve_ivp(
                lambda u, s, sign=sign: [slope(u, s[0], sign)], (last, x), [y], method="DOP853", rtol=1e-11, atol=atol
            )
            y = float(found.y[0, -1])
            allowed += len(found.t) * (1e-11 * float(np.max(np.abs(found.y))) + atol)
        states.append(y)
        last = x
    return np.array(states), allowed


@pytest.fixture
def allowed(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Error that the steps of LSODA up to each sample are allowed, for all that a plant integrates from here on."""
    found: list[float] = []
    odeint = scipy.integrate.odeint

    def counted(slope: Any, start: float, v: Array, *, rtol: float, atol: float, **kwargs: Any) -> Any:
        assert rtol <= 1e-11
        y, told = odeint(slope, start, v, rtol=rtol, atol=atol, **kwargs)
        taken = np.where(v[1:] == v[0], 0, told["nst"])  # `nst` is not set before the first step
        steps, size = np.diff(taken, prepend=0), np.max(np.abs([y[:-1, 0], y[1:, 0]]), axis=0)
        found.extend((steps * (rtol * size + atol)).tolist())
        return y, told

    monkeypatch.setattr(scipy.integrate, "odeint", counted)
    return found


def added_up(added: float | Array, kept: Array) -> Array:
    """Error after every sample: each keeps a share of the error before it and adds its own."""
    steps = zip(kept, np.broadcast_to(added, len(kept)), strict=True)
    return np.array([*accumulate(steps, lambda error, step: step[0] * error + step[1], initial=0.0)][1:])


# -- all plants --------------------------------------------------------------------------------------------------------

SURFACE = EverettTable.of_density(np.linspace(-5.0, 5.0, 41).tolist(), lambda a, b: np.exp(b - a - (a + b) ** 2 / 20))
EVERY: dict[str, Any] = {
    "BoucWen": plants.BoucWen(1.5, 2.0, D=1.3),
    "Dahl": plants.Dahl(2.0, 1.5),
    "Duhem": plants.Duhem.coleman_hodgdon(0.7, lambda v: 2.0 * math.tanh(v), lambda _: 0.5),
    "JilesAtherton": plants.JilesAtherton(2.0, 1.0, 0.8, 0.5, 0.2),
    "KrasnoselskiiPokrovskii": plants.KrasnoselskiiPokrovskii.on_grid(-5.0, 5.0, 12, lambda p1, p2: np.exp(p1 - p2)),
    "MaxwellSlip": plants.MaxwellSlip([1.0, 2.0], [0.5, 3.0], 0.5),
    "Preisach": plants.Preisach(SURFACE, -5.0, 5.0),
}
# All closed forms, and parameters whose sums are rounded
REPEATED: dict[str, Any] = {
    **EVERY,
    "BoucWen, n = 1.7": plants.BoucWen(1.5, 2.0, D=1.3, beta=0.6, gamma=0.3, n=1.7),
    "BoucWen, n = 2": plants.BoucWen(1.5, 2.0, D=1.3, beta=0.6, gamma=0.3, n=2.0),
    "Dahl, exponent 0.5": plants.Dahl(2.0, 1.5, 0.5),
    "Dahl, exponent 2": plants.Dahl(2.0, 1.5, 2.0),
    "MaxwellSlip, decimals": plants.MaxwellSlip([0.7, 0.3], [0.9, 1.1], 0.1),
}


def test_the_registry_holds_every_plant() -> None:
    assert sorted(EVERY) == sorted(plants.PLANTS)
    for name, plant in EVERY.items():
        assert type(plant) is getattr(plants, name)
    with pytest.raises(AttributeError, match="no attribute 'Ising'"):
        plants.Ising  # noqa: B018


def bouc_wen_roundings(plant: plants.BoucWen, v: Array) -> Array:
    """Rounding error of the closed form for n = 1, in output units: 10 roundings of numbers up to the bound of z take a
    state back to 0 and 10 take it on; a move on from 0 shrinks earlier errors by the exponential of its length."""
    z, way = plant.hysteretic(v), np.diff(v, prepend=0.0)
    on = np.sign(way) * np.concatenate([[plant.start], z[:-1]]) >= 0.0
    kept = np.where(on, np.exp(-(plant.beta + plant.gamma) * np.abs(way) / plant.D), 1.0)
    scale = abs(1.0 - plant.alpha) * plant.k * plant.D
    # plus the sum of two products of two and three factors
    return scale * added_up(20.0 * U * plant.bound, kept) + 4.0 * U * (plant.alpha * plant.k * np.abs(v) + scale)


def dahl_roundings(plant: plants.Dahl, v: Array) -> Array:
    """Rounding error of the closed form for exponent 1: of 1 - F / F_c <= 2 from a division and a difference, of its
    product with an exponential, whose argument has three roundings that count for at most 1 / e, and of F from it."""
    per_sample = (1.0 + 2.0 + 2.0 * (3.0 / math.e + 2.0 + 1.0) + 1.0 + 1.0) * U * plant.limit
    return added_up(per_sample, np.exp(-plant.sigma * np.abs(np.diff(v, prepend=0.0)) / plant.limit))


ROUNDINGS: dict[str, Callable[[Any, Array], Array]] = {"BoucWen": bouc_wen_roundings, "Dahl": dahl_roundings}


def spread(plant: object) -> float:
    """Largest factor by which moves spread states: 1 where the slope falls with the state in the direction of the move.
    That of M_irr does, and M moves by (1 - c) / (1 - c alpha dM_an/dH_e) of it, with dM_an/dH_e in (0, Ms / 3 a]."""
    if not isinstance(plant, plants.JilesAtherton):
        return 1.0
    return 1.0 / (1.0 - plant.c * plant.alpha * plant.Ms / (3.0 * plant.a))


@pytest.mark.parametrize("name", EVERY)
def test_only_the_corners_of_the_input_matter(name: str, allowed: list[float]) -> None:
    """Rate independence: any sampling between the same corners gives the same output at them; in every bit for plants
    of extrema (Preisach), of clipping (KP) or of sums that are exact for these numbers (Maxwell-slip)."""
    plant, v = EVERY[name], path(samples=32)
    coarse, fine = plant.simulate(CORNERS), plant.simulate(v)[::32]
    apart = np.full(len(CORNERS), sum(allowed) * spread(plant))
    if name in ROUNDINGS:
        apart += ROUNDINGS[name](plant, v)[::32] + ROUNDINGS[name](plant, np.array(CORNERS))
    assert np.all(np.abs(fine - coarse) <= apart)


@pytest.mark.parametrize("name", REPEATED)
def test_a_repeated_sample_moves_nothing(name: str) -> None:
    plant = REPEATED[name]
    assert plant.simulate(np.repeat(CORNERS, 8)).tolist() == np.repeat(plant.simulate(CORNERS), 8).tolist()


@pytest.mark.parametrize("name", EVERY)
def test_inputs_that_are_none_are_refused(name: str) -> None:
    assert EVERY[name].simulate([]).shape == (0,)
    with pytest.raises(ValueError, match="finite"):
        EVERY[name].simulate([0.0, math.nan])
    with pytest.raises(ValueError, match="one dimension"):
        EVERY[name].simulate(np.zeros((2, 2)))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: plants.BoucWen(-0.1, 1.0), "alpha has to be at least 0"),
        (lambda: plants.BoucWen(0.5, 0.0), "k has to be positive"),
        (lambda: plants.BoucWen(0.5, 1.0, n=0.9), "n has to be at least 1"),
        (lambda: plants.BoucWen(0.5, 1.0, beta=0.3, gamma=0.4), "gamma has to be above -beta"),
        (lambda: plants.BoucWen(0.5, 1.0, beta=0.3, gamma=-0.3), "gamma has to be above -beta"),
        (lambda: plants.BoucWen(0.5, 1.0, start=1.1), "within the bound 1 of z"),
        (lambda: plants.BoucWen(math.nan, 1.0), "alpha has to be a finite number"),
        (lambda: plants.Dahl(1.0, 0.0), "limit has to be positive"),
        (lambda: plants.Dahl(1.0, 1.0, -0.5), "exponent has to be at least 0"),
        (lambda: plants.Dahl(1.0, 1.0, start=1.5), "within the limit 1.0"),
        (lambda: plants.Duhem(min, max, scale=0.0), "scale has to be positive"),
        (lambda: plants.Duhem.coleman_hodgdon(-1.0, math.tanh, math.tanh), "alpha has to be positive"),
        (lambda: plants.Duhem(lambda _, y: y * y, lambda _, y: y * y, 1.0).simulate([2.0]), "runs away"),
        (lambda: plants.MaxwellSlip([1.0], [1.0, 2.0]), "1 stiffnesses but 2 slip forces"),
        (lambda: plants.MaxwellSlip([1.0], [0.0]), "have to be positive"),
        (lambda: plants.MaxwellSlip([], []), "at least one"),
        (lambda: plants.MaxwellSlip([1.0], [1.0], -1.0), "the spring not negative"),
        (lambda: plants.Preisach(SURFACE, 1.0, 1.0), "has to be below high"),
        (lambda: plants.Preisach(lambda a, b: a - b + 1.0, 0.0, 1.0), "0 for alpha = beta"),
        (lambda: plants.Preisach(lambda a, b: (a - b) * (1.5 - (a - b)), 0.0, 1.0), "increases in alpha"),
        (lambda: EverettTable([0.0, 1.0], [[0.0, 0.0]]), "2 edges but 1 rows"),
        (lambda: EverettTable([0.0, 1.0], 3.0), "2 edges but 0 rows"),  # type: ignore[arg-type]
        (lambda: EverettTable([0.0, 0.0], [[0.0, 0.0]] * 2), "strictly increasing"),
        (lambda: EverettTable([0.0, 1.0], [[0.0, 0.0], [0.0]]), "every row has 2 values"),
        (lambda: EverettTable([0.0, 1.0], [[0.0, 0.0], [1.0, 0.5]]), "0 on the diagonal"),
        (lambda: EverettTable([0.0, 1.0], [[0.0, 0.0], [math.nan, 0.0]]), "values up to the diagonal as finite"),
        (lambda: plants.Preisach(SURFACE, -5.0, 9.0), "from -5 to 5 has no values outside"),
        (lambda: plants.Preisach(SURFACE, -5.1, 5.0), "from -5 to 5 has no values outside"),
        (lambda: SURFACE(np.array([0.0]), np.array([0.1])), "nor for alpha < beta"),
        (lambda: plants.KrasnoselskiiPokrovskii([0.0], [1.0], [1.0], 0.0), "ramp has to be positive"),
        (lambda: plants.KrasnoselskiiPokrovskii([2.0], [1.0], [1.0], 1.0), "not be above its upper one"),
        (lambda: plants.KrasnoselskiiPokrovskii([0.0], [1.0], [1.0, 2.0], 1.0), "but 2 weights"),
        (lambda: plants.KrasnoselskiiPokrovskii([0.0], [1.0], [1.0], 1.0, 2.0), "between -1 and 1"),
        (lambda: plants.KrasnoselskiiPokrovskii.on_grid(1.0, 0.0, 5, np.minimum), "low = 1.0 has to be below high"),
        (lambda: plants.KrasnoselskiiPokrovskii.on_grid(0.0, 1.0, 1, np.minimum), "divisions has to be a whole number"),
        (lambda: plants.KrasnoselskiiPokrovskii.on_grid(0.0, 1.0, 2.5, np.minimum), "at least 2, not 2.5"),  # type: ignore[arg-type]
        (lambda: plants.KrasnoselskiiPokrovskii.on_grid(0.0, 1.0, 2, lambda *_: [1.0]), "3 upper positions but 1 w"),
        (lambda: plants.JilesAtherton(1.0, 0.0, 1.0), "a has to be positive"),
        (lambda: plants.JilesAtherton(1.0, 1.0, 1.0, 0.0, 1.0), "c has to be at least 0 and below 1"),
        (lambda: plants.JilesAtherton(1.0, 1.0, 1.0, 3.0), "below 3 a / Ms = 3"),
        (lambda: plants.JilesAtherton(1.0, 1.0, 1.0, "a"), "alpha has to be a finite number, not 'a'"),  # type: ignore[arg-type]
        (lambda: plants.MaxwellSlip(1.0, 1.0), "give stiffnesses as finite numbers"),  # type: ignore[arg-type]
    ],
)
def test_parameters_that_are_wrong_are_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()


# -- Bouc-Wen ----------------------------------------------------------------------------------------------------------

BOUC_WEN = [(1.0, 0.5, 0.5), (1.0, 0.6, -0.3), (2.0, 0.6, 0.3), (2.0, 0.5, 0.5), (2.0, 0.4, -0.2), (1.7, 0.6, 0.3),
            (4.0, 0.7, 0.1)]  # fmt: skip


@pytest.mark.parametrize(("n", "beta", "gamma"), BOUC_WEN)
@pytest.mark.parametrize("pace", [1.0, 3.0])
def test_bouc_wen_is_its_equation_in_time(
    n: float, beta: float, gamma: float, pace: float, allowed: list[float]
) -> None:
    """`D z' = A v' - beta |v'| |z|^(n-1) z - gamma v' |z|^n` (Wen 1976), integrated by scipy at two varying paces."""
    amplitude, distance = 0.9, 1.3
    plant = plants.BoucWen(0.3, 2.0, D=distance, A=amplitude, beta=beta, gamma=gamma, n=n, start=0.2)
    corners = [0.0, 3.0, -2.0, 1.5, -0.5, 2.0]
    z, expected, by_scipy, kept = 0.2, [0.2], [], []
    for a, b in pairwise(corners):

        def slope(t: float, state: Array, a: float = a, b: float = b) -> list[float]:
            v_dot = (b - a) * 2.0 * t * pace**2  # v = a + (b - a) (pace t)^2
            z = state[0]
            return [
                (amplitude * v_dot - beta * abs(v_dot) * abs(z) ** (n - 1.0) * z - gamma * v_dot * abs(z) ** n)
                / distance
            ]

        found = solve_ivp(slope, (0.0, 1.0 / pace), [z], method="DOP853", rtol=1e-11, atol=1e-13)
        by_scipy.append(len(found.t) * (1e-11 * float(np.max(np.abs(found.y))) + 1e-13))
        # a move scales an initial difference by the ratio of the slopes at its end and its begin
        end = float(found.y[0, -1])
        kept.append(slope(1.0, np.array([end]))[0] / slope(1.0, np.array([z]))[0])
        z = end
        expected.append(z)
    off = np.abs(plant.hysteretic(corners) - expected)
    own = np.array(allowed[1:] or [20.0 * U * plant.bound] * len(kept))  # integrated, or the roundings of a closed form
    apart = np.array([0.0, *added_up(own + by_scipy, np.array(kept))])
    assert np.all(off <= apart)
    forces = 0.3 * 2.0 * np.array(corners) + 0.7 * 2.0 * distance * np.array(expected)
    assert np.all(np.abs(plant.simulate(corners) - forces) <= 0.7 * 2.0 * distance * apart + 8.0 * U * np.abs(forces))


@pytest.mark.parametrize(("n", "beta", "gamma"), BOUC_WEN)
def test_bouc_wen_stays_in_its_bound_and_ends_in_its_limit_cycle(
    n: float, beta: float, gamma: float, allowed: list[float]
) -> None:
    """|z| <= (A / (beta + gamma))^(1/n), and a periodic input makes z cycle between -z_m and z_m, which lie one swing
    of the input apart (Ikhouane and Rodellar 2007, chapter 3)."""
    amplitude, distance, swing = 1.1, 0.8, 1.9
    plant = plants.BoucWen(0.5, 1.0, D=distance, A=amplitude, beta=beta, gamma=gamma, n=n)
    bound = (amplitude / (beta + gamma)) ** (1.0 / n)
    assert plant.bound == bound
    far = plant.hysteretic([100.0, -100.0])
    # 1 - x^n >= 1 - x: the gap to the bound decays at least as fast as exp(-(A / bound) (v / D))
    left = bound * math.exp(-amplitude / bound * 100.0 / distance)
    assert np.all(np.abs(np.abs(far) - bound) <= left + sum(allowed) + 8.0 * U * bound)
    assert np.max(np.abs(plant.hysteretic(path(samples=200)))) <= bound * (1.0 + 4.0 * EPS)

    close = {"epsabs": 0.0, "epsrel": 1e-12}

    def way(z: float) -> tuple[float, float]:
        back, back_error = quad(lambda x: 1.0 / (amplitude - (gamma - beta) * x**n), 0.0, z, **close)
        on, on_error = quad(lambda x: 1.0 / (amplitude - (gamma + beta) * x**n), 0.0, z, **close)
        return back + on, back_error + on_error

    limit = brentq(lambda z: way(z)[0] - swing / distance, 0.0, 0.999 * bound, xtol=1e-15)
    begin, end = amplitude - (gamma - beta) * limit**n, amplitude - (gamma + beta) * limit**n  # slopes of a move
    allowed.clear()
    z = plant.hysteretic([5.0, 0.3, *[0.3 + swing, 0.3] * 60])
    # a move scales a difference by end / begin; brentq's tolerances are 1e-15 and its least rtol, 4 EPS
    kept = end / begin
    assert kept**120 * 2.0 * bound < U
    own = max(allowed, default=20.0 * U * bound)
    found_to = way(limit)[1] / (1.0 / begin + 1.0 / end) + 1e-15 + 4.0 * EPS * limit
    np.testing.assert_allclose(z[-2:], [limit, -limit], rtol=0, atol=own / (1.0 - kept) + found_to)


@pytest.mark.parametrize("n", [30.0, 2000.0])
def test_bouc_wen_of_a_large_exponent(n: float) -> None:
    """A rise from rest ends at the z with `v = int_0^z dx / (1 - x^n)`; long moves end at the bound, here 1."""
    plant = plants.BoucWen(0.5, 1.0, n=n)
    for v in (0.5, 0.95):
        (z,) = plant.hysteretic([v])
        assert quad(lambda x: 1.0 / (1.0 - x**n), 0.0, z, epsabs=1e-12)[0] == pytest.approx(v, abs=1e-8)
    np.testing.assert_allclose(plant.hysteretic([3.0, -3.0]), [1.0, -1.0], rtol=0, atol=1e-9)


# -- Duhem and Dahl ----------------------------------------------------------------------------------------------------


def test_dahl_is_an_exponential_for_exponent_one() -> None:
    """The exponential is computed with 30 digits, so that only the rounding of the plant remains."""
    plant, v = plants.Dahl(2.0, 1.5, 1.0, 0.3), path()
    force, last, expected = mpmath.mpf(0.3), 0.0, []
    with mpmath.workdps(30):
        for x in v.tolist():
            end = mpmath.mpf(math.copysign(1.5, x - last))
            force = end + (force - end) * mpmath.exp(-2 * abs(mpmath.mpf(x) - last) / mpmath.mpf(1.5))
            last = x
            expected.append(force)
        off = np.array([float(abs(y - exact)) for y, exact in zip(plant.simulate(v).tolist(), expected, strict=True)])
    assert np.all(off <= dahl_roundings(plant, v))


def test_dahl_is_the_stop_operator_for_exponent_zero() -> None:
    """Elastic up to the limit, then sliding: `F_k = clip(F_(k-1) + sigma dv, -F_c, F_c)`, computed in fractions."""
    v = path()
    force, last, exact = Fraction(0), Fraction(0), []
    for x in map(Fraction, v.tolist()):
        force = min(max(force + 2 * (x - last), Fraction(-3, 2)), Fraction(3, 2))
        last = x
        exact.append(force)
    found = [Fraction(x) for x in plants.Dahl(2.0, 1.5, 0.0).simulate(v).tolist()]
    off = np.array([float(abs(a - b)) for a, b in zip(found, exact, strict=True)])
    # in units of the limit, a sample rounds F once, 1 - F and the sum, both up to 2, the move thrice and F twice;
    # sliding discards earlier errors
    way = 2.0 / 1.5 * np.max(np.abs(np.diff(v)))
    kept = np.where([abs(x) == Fraction(3, 2) for x in exact], 0.0, 1.0)
    assert np.all(off <= added_up((1.0 + 2.0 + 2.0 + 3.0 * way + 2.0) * U * 1.5, kept))


@pytest.mark.parametrize("exponent", [0.5, 1.0, 1.5, 2.0, 3.0])
def test_dahl_is_a_duhem_model(exponent: float, allowed: list[float]) -> None:
    """The closed form agrees with its equation as solved by the general integrator and by scipy."""
    sigma, limit = 2.0, 1.5

    def slope(force: float, sign: float) -> float:
        return float(sigma * max(1.0 - sign * force / limit, 0.0) ** exponent)

    v = path(samples=12)
    exact = plants.Dahl(sigma, limit, exponent).simulate(v)
    duhem = plants.Duhem(lambda _, f: slope(f, 1.0), lambda _, f: slope(f, -1.0), scale=limit)
    # moves bring forces together, so the error is at most the sum allowed to the steps; rounding is negligible
    found = duhem.simulate(v)
    np.testing.assert_allclose(found, exact, rtol=0, atol=sum(allowed))
    by_scipy, error = over_input(lambda _, f, s: slope(f, s), v, 0.0, 1e-13)
    np.testing.assert_allclose(by_scipy, exact, rtol=0, atol=error)
    assert np.max(np.abs(exact)) <= limit


def test_duhem_is_its_equation(allowed: list[float]) -> None:
    v = path(samples=12)

    def rising(x: float, y: float) -> float:
        return 1.0 / (1.0 + x * x) + 0.5 * math.cos(x) - 0.4 * y

    def falling(x: float, y: float) -> float:
        return 0.8 + 0.3 * y - 0.1 * x

    expected, error = over_input(lambda x, y, s: rising(x, y) if s > 0 else falling(x, y), v, 0.4, 1e-12)
    found = plants.Duhem(rising, falling, 0.4).simulate(v)
    # moves bring outputs together, so errors do not grow
    np.testing.assert_allclose(found, expected, rtol=0, atol=sum(allowed) + error)


def test_coleman_and_hodgdon_have_their_closed_form(allowed: list[float]) -> None:
    """With f = b v and g = c, every long rise (-) or fall (+) ends in `y = b v -/+ (b - c) / alpha`."""
    alpha, b, c = 0.8, 1.5, 0.6
    plant = plants.Duhem.coleman_hodgdon(alpha, lambda v: b * v, lambda _: c)
    y, last, v, expected = 0.0, 0.0, path(), []
    for x in v:
        sign = math.copysign(1.0, x - last)
        gap = y - b * last + sign * (b - c) / alpha
        y = b * x - sign * (b - c) / alpha + gap * math.exp(-alpha * abs(x - last))
        last = x
        expected.append(y)
    off = np.abs(plant.simulate(v) - expected)
    assert np.all(off <= added_up(np.array(allowed), np.exp(-alpha * np.abs(np.diff(v, prepend=0.0)))))


@pytest.mark.parametrize("apart", [1e-12, 1e-15, -1e-12, -1e-15])
def test_dahl_goes_over_into_the_exponential(apart: float) -> None:
    """dF / d(exponent) is below 1 along these moves, so forces differ by `apart` and rounding only."""
    v = [0.3, -0.4, 1.0]
    near, at = (plants.Dahl(1.0, 1.0, exponent).simulate(v) for exponent in (1.0 + apart, 1.0))
    np.testing.assert_allclose(near, at, rtol=0, atol=abs(apart) + 40.0 * U)


def test_dahl_of_a_large_exponent() -> None:
    """Powers leave the range of double precision here, so the expected forces come from mpmath."""
    import mpmath

    exponent, v, force, expected = 2000, [0.3, -0.4, 1.0], mpmath.mpf(0), []
    for last, x in pairwise([0.0, *v]):
        sign = 1 if x > last else -1
        power = (1 - sign * force) ** (1 - exponent) + (exponent - 1) * abs(mpmath.mpf(x) - last)
        force = sign * (1 - power ** (mpmath.mpf(1) / (1 - exponent)))
        expected.append(float(force))
    np.testing.assert_allclose(plants.Dahl(1.0, 1.0, exponent).simulate(v), expected, rtol=0, atol=40.0 * U)


def test_duhem_asks_for_its_slope_along_the_input_alone(allowed: list[float]) -> None:
    """The square roots in its slopes are real only between the inputs."""
    plant = plants.Duhem(lambda v, y: math.sqrt(1.0 - v) - y, lambda v, y: math.sqrt(v + 1.0) + y)
    found = plant.simulate([0.4, 1.0, 1.0, 0.2, -1.0, -1.0])[[1, 4]]
    turns = np.array([1.0, -1.0])
    exact, error = over_input(lambda v, y, s: math.sqrt(max(1.0 - s * v, 0.0)) - s * y, turns, 0.0, 1e-12)
    np.testing.assert_allclose(found, exact, rtol=0, atol=error + sum(allowed))


def test_coleman_and_hodgdon_of_a_small_output() -> None:
    """With the output in other units, which `scale` states, every digit of the output is the same."""
    size = 2.0**-30
    whole, small = (
        plants.Duhem.coleman_hodgdon(0.8, lambda v, s=s: s * 1.5 * v, lambda _, s=s: s * 0.6, scale=s)
        for s in (1.0, size)
    )
    assert (small.simulate(path()) / size).tolist() == whole.simulate(path()).tolist()


@pytest.mark.parametrize("name", ["BoucWen", "Duhem", "JilesAtherton"])
def test_an_integration_that_fails_says_so(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    plant = plants.BoucWen(1.5, 2.0, n=3.0) if name == "BoucWen" else EVERY[name]
    assert plant.simulate([0.0, 0.0]).tolist() == [0.0, 0.0]
    monkeypatch.setattr(integration, "MOST_STEPS", 2)
    with pytest.raises(ValueError, match="the integration fails between the inputs 0 and 3"):
        plant.simulate([1.0, 3.0, -1.0])


# -- Maxwell-slip ------------------------------------------------------------------------------------------------------


def test_maxwell_slip_is_every_element_for_itself_and_a_play_sum() -> None:
    """Elements are blocks dragged by springs; two yield after the same distance, so the play sum has one play fewer.
    All numbers are sums of powers of two, which no operation rounds."""
    stiffnesses, slips, spring = [1.0, 0.5, 2.0, 0.25], [0.375, 0.9375, 3.75, 0.625], 0.3125
    v = path(samples=64)
    blocks, expected = np.zeros(4), []
    for x in v:
        for i in range(4):
            reach = slips[i] / stiffnesses[i]
            if x - blocks[i] > reach:
                blocks[i] = x - reach
            elif x - blocks[i] < -reach:
                blocks[i] = x + reach
        expected.append(spring * x + sum(k * (x - block) for k, block in zip(stiffnesses, blocks, strict=True)))
    plant = plants.MaxwellSlip(stiffnesses, slips, spring)
    pi = plant.play_sum()
    assert pi.n == 3
    assert pi.slopes[-1] == spring
    assert plant.simulate(v).tolist() == expected
    assert pi.simulate(v).tolist() == expected


# -- Preisach ----------------------------------------------------------------------------------------------------------


def relays(v: Array, alpha: Array, beta: Array, weights: Array) -> Array:
    """Sum of relays, computed one by one; all are down before the first sample."""
    up = np.zeros(len(alpha), dtype=bool)
    found = []
    for x in v:
        up = (up | (x >= alpha)) & ~(x <= beta)
        found.append(float(weights[up].sum()))
    return np.array(found)


@pytest.mark.parametrize("seed", range(4))
def test_preisach_is_a_sum_of_relays(seed: int) -> None:
    """Outputs are equal for the Everett surface of relays at random places, on a walk that also leaves the range.
    The weights are sums of powers of two, so that no order of adding them rounds."""
    rng = np.random.default_rng(seed)
    places = np.sort(rng.uniform(-3.0, 3.0, (400, 2)))
    beta, alpha = places[:, 0], places[:, 1]
    weights = rng.integers(1, 1024, 400) / 1024.0

    def everett(a: Array, b: Array) -> Array:
        return np.asarray(((alpha <= a[..., None]) & (beta >= b[..., None])) @ weights)

    walk = np.cumsum(rng.normal(0.0, 0.4, 700))
    v = np.concatenate([rng.uniform(-3.5, 3.5, 300), walk, path(), [9.0, 0.0, -9.0, 0.3]])
    found = plants.Preisach(everett, -3.0, 3.0).simulate(v)
    assert found.tolist() == relays(v, alpha, beta, weights).tolist()


def test_preisach_is_a_play_sum_for_its_everett_surface() -> None:
    """`E(a, b) = sum p_i max(a - b - 2 r_i, 0)`; relays all down correspond to plays after a fall from far above to the
    lowest input. All numbers are sums of powers of two, which no operation rounds."""
    r, p = [0.0, 0.5, 1.125, 2.3125], [0.6875, 0.5, 0.3125, 0.875]

    def everett(a: Array, b: Array) -> Array:
        return np.asarray(sum(w * np.maximum(a - b - 2.0 * t, 0.0) for w, t in zip(p, r, strict=True)))

    low = -6.0
    start = [low + t for t in r]
    plant = plants.Preisach(everett, low, 6.0, offset=sum(w * s for w, s in zip(p, start, strict=True)))
    v = path(samples=64)
    plays, expected = np.array(start), []
    for x in v:
        plays = np.clip(plays, x - np.array(r), x + np.array(r))
        expected.append(float(p @ plays))
    assert plant.simulate(v).tolist() == expected
    np.testing.assert_allclose(PI(r, p, start).simulate(v), expected, rtol=0, atol=1e-14)


def test_preisach_wipes_out_and_is_congruent() -> None:
    """A passed extremum leaves no trace, and loops between the same inputs have the same shape whatever came before,
    but another shape at another place (Mayergoyz 1991)."""
    plant = EVERY["Preisach"]
    tail = path([4.0, -2.0, 1.0], 20)
    one, other = plant.simulate([3.0, -1.0, 2.0, 0.5, *tail]), plant.simulate([-4.5, 1.0, *tail])
    assert one[-len(tail) :].tolist() == other[-len(tail) :].tolist()

    loop = path([0.5, 1.5, 0.5], 20)
    befores = ([4.0], [4.0, -4.0, 1.5], [-1.0, 2.0, 0.0, 1.5])
    shapes = [plant.simulate([*before, *loop])[-len(loop) :] for before in befores]
    assert shapes[0][0] - shapes[1][0] > 0.1
    # each shape rounds two outputs, one of which builds on the other, and their difference
    atol = 2.0 * 3.0 * U * np.max(np.abs(shapes))
    for shape in shapes:
        np.testing.assert_allclose(shape - shape[0], shapes[0] - shapes[0][0], rtol=0, atol=atol)
    moved = plant.simulate([4.0, *(loop + 2.0)])[-len(loop) :]
    assert np.ptp(moved) < 0.9 * np.ptp(shapes[0])


def test_preisach_starts_after_its_history() -> None:
    before = (3.0, -2.0, 1.0)
    later = plants.Preisach(SURFACE, -5.0, 5.0, 0.7, before).simulate(path())
    whole = plants.Preisach(SURFACE, -5.0, 5.0, 0.7).simulate([*before, *path()])
    assert later.tolist() == whole[3:].tolist()
    of_array = plants.Preisach(SURFACE, -5.0, 5.0, 0.7, np.array(before))  # type: ignore[arg-type]
    assert of_array.simulate(path()).tolist() == later.tolist()


def test_an_everett_table_is_the_integral_of_its_density() -> None:
    """The table is exact at the edges for a density that is constant in cells, bilinear between, 0 on the diagonal.
    All numbers are sums of powers of two, which no operation rounds."""
    edges = [0.0, 1.0, 2.5, 3.0]

    def density(alpha: Array, beta: Array) -> Array:
        return np.where(alpha > 2.5, 2.0, 1.0) * np.where(beta < 1.0, 3.0, 1.0)

    table = EverettTable.of_density(edges, density)

    def at(alpha: float, beta: float) -> float:
        return float(table(np.array([alpha]), np.array([beta]))[0])

    assert at(1.0, 0.0) == 3.0 * 0.5
    assert at(2.5, 0.0) == 3.0 * 0.5 + 3.0 * 1.5 + 1.5**2 / 2.0
    assert at(3.0, 1.0) == 1.5**2 / 2.0 + 2.0 * 0.5 * 1.5 + 2.0 * 0.5**2 / 2.0
    assert at(1.375, 0.0) == at(1.0, 0.0) + (at(2.5, 0.0) - at(1.0, 0.0)) / 4.0
    assert at(1.75, 1.375) == (0.5 - 0.25) * at(2.5, 1.0)
    assert at(2.2, 2.2) == at(0.0, 0.0) == at(3.0, 3.0) == 0.0
    assert EverettTable([0.0, 2.0], [[0.0, math.nan], [3.0, 0.0]])(np.array([2.0]), np.array([0.0])) == 3.0


# -- Krasnosel'skii-Pokrovskii -----------------------------------------------------------------------------------------


def kp_kernel(v: Array, p1: float, p2: float, ramp: float, start: float) -> Array:
    """The kernel of Banks, Kurdila and Webb (1997): the value of the last turn, limited by the direction's ridge."""

    def ridge(x: float) -> float:
        return -1.0 if x < 0.0 else 1.0 if x > ramp else -1.0 + 2.0 * x / ramp

    kept = min(max(start, ridge(v[0] - p2)), ridge(v[0] - p1))
    found, rising, last = [kept], True, kept
    for before, x in pairwise(v):
        if x != before and (x > before) != rising:
            rising, kept = x > before, last
        last = max(kept, ridge(x - p2)) if rising else min(kept, ridge(x - p1))
        found.append(last)
    return np.array(found)


@pytest.mark.parametrize("start", [-1.0, 0.3125])
def test_kp_is_its_kernels(start: float) -> None:
    """All numbers are sums of powers of two, and the ramp is a power of two, so that no operation rounds."""
    rng = np.random.default_rng(5)
    places = np.sort(rng.integers(-4096, 3072, (60, 2)) / 1024.0)
    weights = rng.integers(-1024, 1024, 60) / 1024.0
    v = np.concatenate([path(samples=32), rng.integers(-4096, 4096, 300) / 1024.0])
    plant = plants.KrasnoselskiiPokrovskii(places[:, 0].tolist(), places[:, 1].tolist(), weights.tolist(), 0.5, start)
    expected = sum(w * kp_kernel(v, a, b, 0.5, start) for w, (a, b) in zip(weights, places, strict=True))
    assert plant.simulate(v).tolist() == np.asarray(expected).tolist()


def test_kp_with_narrow_ramps_is_preisach() -> None:
    """Relays of -1 and 1; no sample lies in a ramp, and no order of adding the weights rounds."""
    rng = np.random.default_rng(6)
    places = np.sort(rng.uniform(-3.0, 3.0, (80, 2)))
    weights = rng.integers(1, 1024, 80) / 1024.0
    ramp = 1e-6
    v = rng.uniform(-3.2, 3.2, 1000)
    assert np.min(np.abs(v[:, None] - places.ravel())) > ramp
    plant = plants.KrasnoselskiiPokrovskii(places[:, 0].tolist(), places[:, 1].tolist(), weights.tolist(), ramp)
    expected = 2.0 * relays(v, places[:, 1], places[:, 0], weights) - weights.sum()
    assert plant.simulate(v).tolist() == expected.tolist()


def test_a_kp_kernel_with_a_wide_ramp_is_a_play() -> None:
    """Inside its ramp it is `2 / ramp` times the play of threshold (p_2 - p_1) / 2 about the middle, exactly."""
    p1, p2, ramp = -6.0, -4.375, 16.0
    v = path(samples=32)
    middle, r = (p1 + p2 + ramp) / 2.0, (p2 - p1) / 2.0
    state, expected = -math.inf, []
    for x in v - middle:
        state = max(x - r, min(x + r, state))
        expected.append(2.0 / ramp * state)
    found = plants.KrasnoselskiiPokrovskii([p1], [p2], [1.0], ramp).simulate(v)
    assert found.tolist() == expected


def test_a_grid_of_kp_kernels() -> None:
    plant = plants.KrasnoselskiiPokrovskii.on_grid(0.0, 4.0, 4, lambda p1, p2: p2 - p1 + 1.0)
    assert plant.ramp == 1.0
    pairs = list(zip(plant.lower, plant.upper, plant.weights, strict=True))
    assert len(pairs) == 10
    assert (0.0, 3.0, 4.0) in pairs
    assert plant.simulate([-1.0, 4.0]).tolist() == [-sum(plant.weights), sum(plant.weights)]
    assert plants.KrasnoselskiiPokrovskii.on_grid(0.0, 4.0, 4, lambda *_: 0.5).weights == (0.5,) * 10


# -- Jiles-Atherton ----------------------------------------------------------------------------------------------------

# Parameters of Jiles and Atherton 1986, in A/m
MS, A, K, ALPHA, C = 1.6e6, 1100.0, 400.0, 1.6e-3, 0.2
IRON = plants.JilesAtherton(MS, A, K, ALPHA, C)


def anhysteretic(field: float, magnetization: float, ms: float = MS, a: float = A, alpha: float = ALPHA) -> float:
    x = (field + alpha * magnetization) / a
    return ms * (1.0 / math.tanh(x) - 1.0 / x) if abs(x) > 1e-3 else ms * x / 3.0


def test_langevin_has_all_its_digits() -> None:
    """Values agree with mpmath at 40 digits, on both sides of the change to the series."""
    with mpmath.workdps(40):
        for x in (1e-9, 1e-3, 0.02, 0.0499, 0.0501, 0.3, 2.0, 39.0, 41.0, 1e4):
            exact = mpmath.coth(x) - 1 / mpmath.mpf(x)
            slope = 1 / mpmath.mpf(x) ** 2 - 1 / mpmath.sinh(x) ** 2
            # the difference cancels to x / 3, which magnifies rounding by 3 / x^2
            slack = 4.0 * EPS * (1.0 + 3.0 / max(x, 0.05) ** 2)
            for sign in (1.0, -1.0):
                assert abs(langevin(sign * x) - sign * exact) <= slack * abs(exact)
                assert abs(langevin_slope(sign * x) - slope) <= slack * slope
    assert langevin(0.0) == 0.0
    assert langevin_slope(0.0) == 1.0 / 3.0


def test_jiles_atherton_is_its_equations(allowed: list[float]) -> None:
    """Expected: M_irr by scipy, and M from `M = (1 - c) M_irr + c M_an(H + alpha M)` by root finding, not dM/dH."""

    def total(field: float, irreversible: float) -> float:
        return float(
            brentq(
                lambda m: (1.0 - C) * irreversible + C * anhysteretic(field, m) - m, -1.1 * MS, 1.1 * MS, xtol=1e-6
            )
        )

    def slope(field: float, irreversible: float, sign: float) -> float:
        apart = anhysteretic(field, total(field, irreversible)) - irreversible
        return apart / (sign * K - ALPHA * apart) if sign * apart > 0.0 else 0.0

    v = path([0.0, 2000.0, -3000.0, 1500.0, -200.0, 900.0, 0.0], 8)
    irreversible, error = over_input(slope, v, 0.0, 1e-4)
    expected = [total(x, m) for x, m in zip(v, irreversible, strict=True)]
    found = IRON.simulate(v)
    np.testing.assert_allclose(found, expected, rtol=0, atol=(sum(allowed) + error) * spread(IRON) + 1e-6)


def test_jiles_atherton_has_the_published_coercivity_remanence_and_susceptibility(allowed: list[float]) -> None:
    """The relations of Jiles, Thoelke and Devine (1992) between k and values read from a loop hold.

    At the coercive field, with its slope X: `k = M_an/(1-c) (alpha + (1-c) / (X - c dM_an/dH))`; at the remanence
    `M_r = M_an + k / (alpha/(1-c) + 1 / (X - c dM_an/dH))`; at the origin dM/dH = c dM_an/dH, about c M_s / 3a.
    """
    field = np.concatenate([path([0.0, 20000.0, -20000.0], 40000), path([-20000.0, 20000.0], 40000)])
    m = IRON.simulate(field)
    rise, h = m[-40001:], field[-40001:]

    def at(k: int, step: int) -> tuple[float, float, float]:
        """M_an - M, dM/dH and dM_an/dH at a sample, as differences over some steps to either side."""
        near, far = (anhysteretic(float(h[j]), float(rise[j])) for j in (k - step, k + step))
        here = anhysteretic(float(h[k]), float(rise[k])) - float(rise[k])
        way = float(h[k + step] - h[k - step])
        return here, float(rise[k + step] - rise[k - step]) / way, (far - near) / way

    def pinning(k: int, step: int) -> float:
        apart, x, reversible = at(k, step)
        return apart / (1.0 - C) * (ALPHA + (1.0 - C) / (x - C * reversible))

    def remanence(k: int, step: int) -> float:
        # on a rise through field 0 the remanence is negative, and so are M_an and the term of k
        _, x, reversible = at(k, step)
        return anhysteretic(0.0, float(rise[k])) - K / (ALPHA / (1.0 - C) + 1.0 / (x - C * reversible))

    # differences over two steps have four times the error of those over one step, which is a third of the change
    coercive, without = int(np.argmin(np.abs(rise))), int(np.argmin(np.abs(h)))
    assert 0.0 < h[coercive] < 1.5 * K
    assert abs(pinning(coercive, 1) - K) <= 0.5 * abs(pinning(coercive, 2) - pinning(coercive, 1))
    assert h[without] == 0.0
    assert rise[without] < -0.1 * MS
    assert abs(remanence(without, 1) - rise[without]) <= 0.5 * abs(remanence(without, 2) - remanence(without, 1))

    allowed.clear()
    step = 1e-3
    first = IRON.simulate([step])[0] / step
    reversible = C * MS / (3.0 * A)
    slope = reversible / (1.0 - ALPHA * reversible)
    # M_irr lags behind M_an by at most all of it; that lag over k is added to the slope
    ahead = MS / (3.0 * A - ALPHA * MS) * step / K
    assert -sum(allowed) / step <= first - slope <= ahead + sum(allowed) / step


def test_jiles_atherton_without_pinning_is_anhysteretic(allowed: list[float]) -> None:
    """`|M - M_an| <= k dM/dH`, which vanishes as k goes to 0; the initial slope is `M_s / (3 a - alpha M_s)` (1992)."""
    k = 0.05
    plant = plants.JilesAtherton(MS, A, k, ALPHA, C)
    v = path([0.0, 4000.0, -4000.0, 1000.0], 400)
    m = plant.simulate(v)
    steepest = MS / (3.0 * A - ALPHA * MS)
    gap = np.abs([anhysteretic(float(x), float(y)) - y for x, y in zip(v, m, strict=True)])
    assert gap.max() > 0.0
    assert np.all(gap <= k * steepest)
    # the field is off by k, and the cubic term of M_an is a share x^2 / 15 of it
    x = (20.0 + ALPHA * steepest * 20.0) / A
    allowed.clear()
    first = plant.simulate([20.0])[0]
    least = steepest * (20.0 - k - A * x**3 / 15.0)
    assert least - sum(allowed) <= first <= steepest * 20.0


def test_jiles_atherton_never_has_a_negative_slope() -> None:
    """The guard of Deane (1994): without it, M goes on rising after the field has turned."""
    field = path([0.0, 1500.0, 800.0, 1500.0, -1500.0, 200.0], 300)
    assert np.all(np.diff(IRON.simulate(field)) * np.diff(field) >= 0.0)


# -- compensated by an identified inverse in C -------------------------------------------------------------------------

EXAMPLE = Path(__file__).parents[1] / "examples" / "compensate_plants.py"


@pytest.fixture(scope="module")
def example() -> Iterator[Any]:
    spec = importlib.util.spec_from_file_location("compensate_plants", EXAMPLE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look up their module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


@pytest.mark.parametrize("name", ["Preisach, surface of a play sum", "Maxwell-slip"])
def test_plants_that_are_play_sums_are_linearised_to_the_rounding(example: Any, name: str) -> None:
    """Given their thresholds, identification finds these plants exactly; only the error of the arithmetic remains.

    A float32 compensator rounds reference, sum and drive, and a plant's steepest slope is a few times its mean slope:
    8 units in the last place of full scale cover all of that. Weights are written with 10 digits and found as exactly;
    the weighted plays add up to less than twice the output range, and the steepest slope multiplies their error.
    """
    (case,) = (case for case in example.cases() if case.name == name and case.thresholds)
    result = example.measure(case)
    written = 100.0 * 2.0 * 1e-9
    assert result.held_out <= written
    assert result.compensated[1] <= 100.0 * 8.0 * 2.0**-23
    assert result.fixed_point[1] <= 100.0 * 8.0 * 2.0**-31 + 4.0 * written
    assert result.scaled[0] > 1.0


def test_other_plants_are_linearised_about_as_well_as_they_are_identified(example: Any) -> None:
    """On a Preisach plant that is not a play sum, a GPI inverse leaves the error of its model: on another record up to
    a few times the held-out error (docs/plants.md: 1.3 to 2.2 times), a tenth of the error with a straight line."""
    name = "Preisach, bell-shaped density"
    cases = zip(example.cases(), page_rows()[1:], strict=True)
    ((case, kept),) = (both for both in cases if both[0].name == name and both[0].model == "auto")
    result = example.measure(case)
    assert result.model != "PI"
    assert result.compensated[0] <= 4.0 * result.held_out
    assert result.compensated[0] <= 0.1 * result.scaled[0]
    row = example.row(result)
    assert [*row[:3], row[-1]] == [*kept[:3], kept[-1]]
    # to the digits shown, which another machine may round otherwise
    np.testing.assert_allclose([float(x) for x in row[3:-1]], [float(x) for x in kept[3:-1]], rtol=0.11)


def page_rows() -> list[list[str]]:
    """Lines of the tables in docs/plants.md, headers once."""
    text = (EXAMPLE.parents[1] / "docs" / "plants.md").read_text(encoding="utf-8")
    lines = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("|")]
    return [line for k, line in enumerate(lines) if not line[0].startswith("---") and line not in lines[:k]]


def test_the_page_of_the_plants_is_the_table_of_the_example(example: Any) -> None:
    with open(EXAMPLE.parents[1] / "docs" / "plants.csv", newline="", encoding="utf-8") as file:
        assert [*csv.reader(file)] == page_rows()
    header, *rows = page_rows()
    assert header == [*example.HEADER]
    cases = example.cases()
    assert [(row[0], row[-1]) for row in rows] == [(case.name, case.remark) for case in cases]


def test_what_the_page_says_of_its_table(example: Any) -> None:
    header, *rows = page_rows()
    held_out, in_c, line = (header.index(name) for name in ("held-out rms %", "C rms %", "scaled rms %"))
    errors = [[float(row[k]) for k in (held_out, in_c, line)] for row in rows]
    shown = [(case, *found) for case, found in zip(example.cases(), errors, strict=True)]
    chosen = {case.name: found for case, *found in shown if case.model == "auto"}
    found = {case.name: row[1] for case, row in zip(example.cases(), rows, strict=True) if case.model == "auto"}
    with_element = {name for name, model in found.items() if "element" in model}
    assert with_element == {
        "Dahl friction in a positioner", "Bouc-Wen, alpha = 1.6", "Bouc-Wen, alpha = 0.4", "Duhem, Coleman-Hodgdon"
    }
    assert all(max(chosen[name][:2]) <= example.LEAST for name in with_element)
    ratios = {name: round(after / before, 1) for name, (before, after, _) in chosen.items() if name not in with_element}
    assert ratios.pop("Maxwell-slip") == 0.8
    assert (min(ratios.values()), max(ratios.values())) == (1.3, 2.2)
    many = [(case.name, after, straight) for case, _, after, straight in shown if case.thresholds == 32]
    assert len(many) == 8
    for name, after, straight in many:
        assert name in with_element or 0.95 * chosen[name][1] <= after <= 1.1 * chosen[name][1]
        assert 0.2 <= round(after / straight, 1) <= (1.0 if name == "Bouc-Wen, alpha = 0.4" else 0.5)


def test_friction_of_more_than_half_the_spring_has_no_inverse(example: Any) -> None:
    """After a reversal the slope is the spring's, 0.05, less up to twice the friction's, 0.07 (docs/plants.md)."""
    friction = plants.Dahl(sigma=0.035, limit=0.4)
    v = 100.0 * example.training()
    y = 0.05 * v - friction.simulate(v)
    fit = hystgen.identify(Record("friction", 1e-3 * np.arange(len(v)), v, y, sample_time=1e-3), name="plant")
    assert fit.parameters.model.pi.weights[0] == 0.0
    assert any("p_0 is 0" in word for word in fit.warnings)
    with pytest.raises(hystgen.NotInvertibleError, match="p_0 > 0"):
        emitted_files(hystgen.Model(fit.parameters))


def test_what_a_play_sum_cannot_do_is_distinguished(example: Any) -> None:
    """Spread over places, dependence on history and openness of minor loops are 0 for a play sum, and each kind of
    plant shows the ones that its remark names."""
    cases = {case.name: case for case in example.cases()}
    traits = {name: example.memory(case) for name, case in cases.items()}

    def rounding(name: str, each: int) -> float:
        """Rounding error of a loop's height in %, if every output has at most `each` roundings of the largest size."""
        y = np.abs(cases[name].plant(example.in_range(np.array([0.5, 0.0, 1.0, 0.45, 0.55]), cases[name].drive)))
        return float(100.0 * 4.0 * each * U * np.max(y) / abs(y[-1] - y[-2]))

    # each output of a surface adds up at most 5 values, each with 8 roundings of the surface and two of an input
    assert max(traits["Preisach, surface of a play sum"]) <= rounding("Preisach, surface of a play sum", 50)
    # 6 samples with two roundings in each of 4 stops and two of an input, then a sum of 5 products
    assert max(traits["Maxwell-slip"]) <= rounding("Maxwell-slip", 24)
    for name, each in (("Preisach, bell-shaped density", 50), ("Krasnosel'skii-Pokrovskii", 820 + 2)):
        assert traits[name][0] > 10.0
        assert traits[name][1] <= rounding(name, each)
    for name in ("Preisach, surface of a play sum", "Preisach, bell-shaped density", "Krasnosel'skii-Pokrovskii"):
        assert traits[name][2] == 0.0, "the corner that a loop returns to is the one that it left"
    for name in ("Dahl friction in a positioner", "Bouc-Wen, alpha = 1.6", "Duhem, Coleman-Hodgdon", "Jiles-Atherton"):
        assert min(traits[name]) > 1.0
