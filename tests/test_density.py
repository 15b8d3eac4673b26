"""Densities: the formula language, and play sums whose error on the initial loading curve is bounded."""

# Exact messages are not wrapped.
# ruff: noqa: E501

from __future__ import annotations

import contextlib
import math
import re
import time
from collections.abc import Callable
from itertools import pairwise

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from hystgen.parameters.files import parse_parameters
from hystgen.plays.density import DensityError, Discretisation, from_formula, from_table, parse_formula

pytestmark = pytest.mark.thorough

Curve = Callable[[float], float]
U = 2.0**-53  # largest relative error of one rounding


def loading_curve(plays: Discretisation, x: np.ndarray) -> np.ndarray:
    """(22) of the note: sum of p_g (x - r_g) over the thresholds below x."""
    r, p = np.array(plays.thresholds), np.array(plays.weights)
    return np.array([np.sum(p * np.maximum(xi - r, 0.0)) for xi in x])


def refused(text: str, r_max: float = 10.0) -> str:
    with pytest.raises(DensityError) as caught:
        from_formula(parse_formula(text), r_max)
    assert caught.value.part == "formula"
    return str(caught.value)


# Formulas ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty; a number, r, a function or ( is expected at the end"),
        (" \t", "is empty; a number, r, a function or ( is expected at the end"),
        ("r+", "ends too early; a number, r, a function or ( is expected at the end"),
        ("exp(", "ends too early; a number, r, a function or ( is expected at the end"),
        ("exp", "ends too early; a number, r, a function or ( is expected at the end"),
        ("r)", "unexpected ')' at character 2; remove it or open the bracket"),
        ("(r", "'(' is not closed at character 1; add )"),
        ("1 + sin((r)", "'(' is not closed at character 8; add )"),
        ("()", "unexpected ')' at character 2; a number, r, a function or ( is expected there"),
        ("exp()", "unexpected ')' at character 5; a number, r, a function or ( is expected there"),
        ("*r", "unexpected '*' at character 1; a number, r, a function or ( is expected there"),
        ("r*/2", "unexpected '/' at character 3; a number, r, a function or ( is expected there"),
        ("r***2", "unexpected '*' at character 4; a number, r, a function or ( is expected there"),
        ("exp r", "exp without its argument at character 1; write it in ( )"),
        ("2 r", "unexpected r at character 3; put an operator in front of it"),
        ("r(2)", "unexpected '(' at character 2; put an operator in front of it"),
        ("2exp(r)", "unexpected exp at character 2; put an operator in front of it"),
        ("1..2", "unexpected .2 at character 3; put an operator in front of it"),
        ("2*R", "unknown name R at character 3; the variable is r, the functions are exp, log, sqrt, sin, cos and tanh"),
        (
            "__import__('os')",
            "unknown name __import__ at character 1; the variable is r, the functions are exp, log, sqrt, sin, cos and tanh",
        ),
        ("r^2", "unexpected '^' at character 2; a power is written **"),
        ("r,2", "unexpected ',' at character 2; use + - * / ** ( ), numbers and r"),
        ("r\u200b", "unexpected character U+200B at character 2; use + - * / ** ( ), numbers and r"),
        ("1e400", "number 1e400 out of range at character 1; keep to 1e-300 .. 1e300"),
        ("1e-400*r", "number 1e-400 out of range at character 1; keep to 1e-300 .. 1e300"),
        ("r" * 1001, "has 1001 characters, more than 1000; shorten it"),
    ],
)
def test_syntax(text: str, message: str) -> None:
    assert refused(text) == message


@pytest.mark.parametrize(
    ("text", "r_max", "message"),
    [
        ("1/r", 1, "has no real value at r = 0; correct the formula or r_max"),
        ("r**-0.5", 1, "has no real value at r = 0; correct the formula or r_max"),
        ("sqrt(1-r)", 2, "has no real value at r = 1.03125; correct the formula or r_max"),
        ("(-8)**(1/3)", 1, "has no real value at r = 0.015625; correct the formula or r_max"),
        ("log(r)", 1, "is not finite at r = 0; correct the formula or r_max"),
        ("5-log(r)", 1, "is not finite at r = 0; correct the formula or r_max"),
        ("10**10**10**10", 1, "is not finite at r = 0.015625; correct the formula or r_max"),
        ("exp(exp(exp(exp(exp(r)))))", 1, "is not finite at r = 0.015625; correct the formula or r_max"),
        ("1-r", 2, "p(r) is negative, -1 at r = 2; change the formula or r_max so that p(r) >= 0"),
        ("0-1", 2, "p(r) is negative, -1 at r = 0; change the formula or r_max so that p(r) >= 0"),
        (
            "(r-3)**2-0.0001",
            10,
            "p(r) is negative, -9.27802e-05 at r = 2.99731; change the formula or r_max so that p(r) >= 0",
        ),
        ("1/(r-0.3)**2", 1, "cannot be integrated: no smooth function near r = 0.3; remove the pole or the fast oscillation"),
        ("((r-0.3)**2)**-0.5", 1, "cannot be integrated: no smooth function near r = 0.3; remove the pole or the fast oscillation"),
        ("1+sin(1e7*r)", 1, "cannot be integrated: no smooth function near r = 0.000128746; remove the pole or the fast oscillation"),
    ],
)
def test_unusable(text: str, r_max: float, message: str) -> None:
    start = time.perf_counter()
    assert refused(text, r_max) == message
    assert time.perf_counter() - start < 20


@pytest.mark.parametrize(
    "text",
    ["2**-r", "-r**2", "2**-r**2*3", "2-3-r", "8/4/2", "2**3**2", "-2**-r", "1-2*-3+r", "(1+r)*-(2-r)**2/3", "- - r", "+r", "2*(r+(3))", "-r*-r", "1e-3+.5*2.", "\tr\n+1", "r**r**r"],
)  # fmt: skip
def test_precedence(text: str) -> None:
    assert float(parse_formula(text)(0.75)) == pytest.approx(eval(" ".join(text.split()), {"r": 0.75}), rel=1e-14)


NAMES = {name: getattr(math, name) for name in ("exp", "log", "sqrt", "sin", "cos", "tanh")}
expressions = st.recursive(
    st.sampled_from(["r", "0.5", "2", "3.25e-1", "1."]),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(["+", " - ", "*", "/ ", "**"]), inner).map("".join),
        inner.map(lambda a: f"({a})"),
        inner.map(lambda a: f"-{a}"),
        st.tuples(st.sampled_from(sorted(NAMES)), inner).map(lambda pair: f"{pair[0]}({pair[1]})"),
    ),
    max_leaves=8,
)


def sine(x: mpmath.mpf, of: Callable[[mpmath.mpf], mpmath.mpf]) -> mpmath.mpf:
    if abs(x) > 1e6:
        raise ValueError("the digits are lost there")
    return of(x)


@settings(deadline=None, max_examples=300)
@given(expressions, st.floats(0.1, 2))
def test_formulas_mean_what_python_means(text: str, r: float) -> None:
    python = re.sub(r"[0-9][0-9.]*(e-[0-9]+)?", r"mpf('\g<0>')", text)
    with mpmath.workdps(60):
        names = {name: getattr(mpmath, name) for name in (*NAMES, "mpf")}
        names["sin"], names["cos"] = (lambda x: sine(x, mpmath.sin)), (lambda x: sine(x, mpmath.cos))
        try:
            expected = eval(python, {"r": mpmath.mpf(r), **names})
        except (ZeroDivisionError, ValueError, OverflowError, TypeError):
            return
        if not isinstance(expected, mpmath.mpf) or not abs(expected) < 1e30:
            return
    try:
        got = parse_formula(text)(r)
    except DensityError as error:  # an intermediate value out of range
        assert "is not finite" in str(error) or "no real value" in str(error)  # noqa: PT017
        return
    assert float(got) == pytest.approx(float(expected), rel=1e-12, abs=1e-12)


@settings(deadline=None, max_examples=300)
@given(st.text(st.sampled_from("r12.e+-*/()exp sincostanhlogsqrt^_'\n\u0660"), max_size=40))
def test_any_text_is_parsed_or_refused(text: str) -> None:
    try:
        formula = parse_formula(text)
    except DensityError:
        return
    assert formula.text == text


def test_deep_nesting_is_flat() -> None:
    assert float(parse_formula("(" * 499 + "r" + ")" * 499)(2.0)) == 2.0
    assert float(parse_formula("-" * 999 + "r")(2.0)) == -2.0
    assert float(parse_formula("sqrt(" * 160 + "r" + ")" * 160)(2.0)) == 1.0


# Discretisation ------------------------------------------------------------------------------------------

A, B = 0.8, 0.3
KNOWN: dict[str, tuple[str, Curve, Curve]] = {
    "exp": ("0.8*exp(-0.3*r)", lambda r: A * math.exp(-B * r), lambda x: A * (x / B - (1 - math.exp(-B * x)) / B**2)),
    "constant": ("0.25", lambda _: 0.25, lambda x: 0.125 * x * x),
    "linear": ("2-0.2*r", lambda r: 2 - 0.2 * r, lambda x: x * x - x**3 / 30),
    "sqrt": ("sqrt(r)", lambda r: math.sqrt(r), lambda x: x**2.5 * (2 / 3 - 2 / 5)),
    "kink": ("sqrt((r-5)**2)", lambda r: abs(r - 5), lambda x: 2.5 * x * x - x**3 / 6 + (max(x - 5, 0) ** 3) / 3),
}


@pytest.mark.parametrize("n", [1, 2, 7, 12, 64])
@pytest.mark.parametrize("label", KNOWN)
def test_formula_against_the_exact_loading_curve(label: str, n: int) -> None:
    text, p, phi = KNOWN[label]
    plays = from_formula(parse_formula(text), 10.0).discretise(0.7, n)
    assert len(plays.thresholds) == len(plays.weights) == n + 1
    assert plays.thresholds[0] == 0
    assert plays.weights[0] == 0.7
    assert all(10 * i / n < r < 10 * (i + 1) / n for i, r in enumerate(plays.thresholds[1:]))
    for i in range(n):
        a, b = 10 * i / n, 10 * (i + 1) / n
        mass, _ = quad(p, a, b, points=[5.0] if a < 5 < b else None, epsabs=0, epsrel=1e-12)
        moment, _ = quad(lambda r: r * p(r), a, b, points=[5.0] if a < 5 < b else None, epsabs=0, epsrel=1e-12)
        assert plays.weights[i + 1] == pytest.approx(mass, rel=1e-11)
        assert plays.thresholds[i + 1] == pytest.approx(moment / mass, rel=1e-11)
    x = np.unique(np.concatenate([np.linspace(0, 10, 5001), plays.thresholds]))
    gap = np.array([0.7 * xi + phi(xi) for xi in x]) - loading_curve(plays, x)
    rounding = 1e-13 * (0.7 * 10 + phi(10.0))
    assert gap.min() >= -rounding, "the play sum lies below"
    assert gap.max() <= plays.error + rounding
    assert gap.max() >= 0.99 * plays.error, "and the bound is reached"
    edges = np.linspace(0, 10, n + 1)
    exact = np.array([0.7 * xi + phi(xi) for xi in edges])
    assert np.abs(loading_curve(plays, edges) - exact).max() <= rounding


def test_beyond_the_last_threshold() -> None:
    plays = from_formula(parse_formula("0.8*exp(-0.3*r)"), 10.0).discretise(0.7, 12)
    phi = KNOWN["exp"][2]
    slope = A / B * (1 - math.exp(-B * 10))
    x = np.array([10.0, 12.0, 50.0])
    assert loading_curve(plays, x) == pytest.approx(0.7 * x + phi(10.0) + slope * (x - 10), rel=1e-13)


@pytest.mark.parametrize(
    ("r", "p", "n"),
    [
        ([0, 10], [2, 0], 12), ([0, 10], [0, 3], 5), ([0, 1, 4, 10], [1, 0.2, 0.7, 0], 9), ([2, 5, 6], [0, 1, 0], 8), ([0.5, 1], [3, 3], 1),
        ([0, 1, 2, 3], [0, 0, 1, 0], 6), ([0, 1e-3, 10], [1e6, 1, 1], 20),
    ],
)  # fmt: skip
def test_table(r: list[float], p: list[float], n: int) -> None:
    plays = from_table(r, p).discretise(0.5, n)
    end = r[-1]

    def density(x: float) -> float:
        return float(np.interp(x, r, p, left=0.0, right=0.0))

    def integral(f: Curve, a: float, b: float) -> float:
        breaks = [a, *(k for k in r if a < k < b), b]
        return sum(quad(f, lo, hi, epsabs=1e-14)[0] for lo, hi in pairwise(breaks))

    for i in range(n):
        a, b = end * i / n, end * (i + 1) / n
        mass = integral(density, a, b)
        assert plays.weights[i + 1] == pytest.approx(mass, rel=1e-9, abs=1e-12 * max(p) * end)
        if mass == 0:
            assert plays.weights[i + 1] == 0
            assert plays.thresholds[i + 1] == pytest.approx((a + b) / 2, rel=1e-15)
        else:
            assert plays.thresholds[i + 1] == pytest.approx(integral(lambda x: x * density(x), a, b) / mass, rel=1e-8)
    x = np.unique(np.concatenate([np.linspace(0, end, 300), plays.thresholds]))
    exact = np.array([0.5 * xi + integral(lambda q, xi=xi: (xi - q) * density(q), 0, xi) if xi else 0.0 for xi in x])  # type: ignore[misc]
    gap = exact - loading_curve(plays, x)
    rounding = 1e-9 * exact.max()
    assert gap.min() >= -rounding
    assert gap.max() <= plays.error + rounding
    assert gap.max() >= 0.99 * plays.error - rounding


def test_linear_table_exactly() -> None:
    plays = from_table([0, 3], [6, 0]).discretise(1.0, 3)
    assert plays.weights == (1.0, 5.0, 3.0, 1.0)
    assert plays.thresholds == pytest.approx((0, 7 / 15, 13 / 9, 7 / 3), rel=1e-15)


@pytest.mark.parametrize("tolerance", [10.0, 0.5, 0.061, 1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("label", ["exp", "constant", "linear"])
def test_fewest_plays_for_a_tolerance(label: str, tolerance: float) -> None:
    density = from_formula(parse_formula(KNOWN[label][0]), 10.0)
    plays = density.discretise_to(0.7, tolerance)
    n = len(plays.thresholds) - 1
    assert plays.error <= tolerance
    assert plays == density.discretise(0.7, n)
    assert n == 1 or density.discretise(0.7, n - 1).error > tolerance


def test_tolerance_out_of_reach() -> None:
    density = from_formula(parse_formula("1"), 1.0)
    with pytest.raises(DensityError) as caught:
        density.discretise_to(1.0, 1e-9)
    assert caught.value.part == "tolerance"
    assert str(caught.value) == "1e-09 is not reached with 4096 thresholds; ask for 7.49e-09 or more"
    assert len(density.discretise_to(1.0, 7.49e-9).thresholds) <= 4097


def test_no_density_at_all() -> None:
    plays = from_formula(parse_formula("0*r"), 4.0).discretise(0.7, 2)
    assert plays == Discretisation((0.0, 1.0, 3.0), (0.7, 0.0, 0.0), 0.0, 0.0)


def test_thresholds_that_coincide() -> None:
    with pytest.raises(DensityError, match=r"two of 4 thresholds coincide at r = .*; take fewer, or a wider density"):
        from_table([0, 5e-324], [1, 1]).discretise(1.0, 4)


def test_the_same_on_every_machine() -> None:
    """Values are rounded only once, from 40 digits, so they are the correctly rounded ones."""
    plays = from_formula(parse_formula("0.8*exp(-0.3*r)"), 10.0).discretise(0.7, 12)
    with mpmath.workdps(60):
        a, b = mpmath.mpf("0.8"), mpmath.mpf("0.3")
        for i in range(12):
            lo, hi = mpmath.mpf(10 * i) / 12, mpmath.mpf(10 * (i + 1)) / 12
            mass = a / b * (mpmath.exp(-b * lo) - mpmath.exp(-b * hi))
            moment = a / b * ((lo + 1 / b) * mpmath.exp(-b * lo) - (hi + 1 / b) * mpmath.exp(-b * hi))
            assert plays.weights[i + 1] == float(mass)
            assert plays.thresholds[i + 1] == float(moment / mass)


def test_global_precision_is_left_alone() -> None:
    before = mpmath.mp.dps
    with mpmath.workdps(5):
        plays = from_formula(parse_formula("exp(-r)"), 3.0).discretise(1.0, 3)
        assert mpmath.mp.dps == 5
    assert mpmath.mp.dps == before
    assert plays.weights[1] == pytest.approx(1 - math.exp(-1), rel=1e-15)


SLOW = {
    "power of a huge whole exponent": "1e-300**1e300",
    "many of them": "+".join(["1e-300**1e300"] * 71),
    "negative exponent": "1e300**-1e300",
    "base near 1": "+".join(["(1-1e-38)**1e40"] * 58),
    "base below 1": "+".join(["0.999**1e300"] * 70),
    "long sum": "r" + "+r" * 499,
    "signs": "-" * 998 + "r",
    "brackets": "(" * 499 + "r" + ")" * 499,
    "powers of r": "+".join(["r**r"] * 190),
    "tower": "1" + "**r" * 333,
    "nested sines": "sin(" * 198 + "r" + ")" * 198 + "+2",
    "nested roots": "sqrt(" * 165 + "r" + ")" * 165,
    "nested tanh": "tanh(" * 165 + "r" + ")" * 165,
    "nested logarithms": "log(" * 150 + "9" + ")" * 150,
    "sines of huge numbers": "+".join(["sin(1e300*r)**2"] * 58),
    "roots with kinks": "+".join(f"sqrt((r-{k / 7.1:.3f})**2)" for k in range(45)),
    "steps": "+".join(f"1+tanh(1e6*(r-{k}.1))" for k in range(40)),
    "poles": "+".join(f"1/(r-{k}.1)**2" for k in range(60)),
    "fast oscillations": "+".join(f"1+sin({k}*r)" for k in range(900, 968)),
    "digits": "0." + "3" * 990 + "*r",
}
"""The slowest formulas of each kind found within the permitted length; without a limit they took up to 20 min."""


@pytest.mark.slow(one_in=5)
@pytest.mark.parametrize("label", SLOW)
def test_no_formula_computes_for_long(label: str) -> None:
    assert len(SLOW[label]) <= 1000
    start = time.process_time()
    with contextlib.suppress(DensityError):
        from_formula(parse_formula(SLOW[label]), 10.0)
    assert time.process_time() - start < 25.0  # 5 s on an idle machine


def test_a_formula_that_takes_too_long_says_so() -> None:
    advice = "; shorten it, or give the density as a table"
    assert refused(SLOW["long sum"]) == f"has 999 operations, too many to integrate{advice}"
    assert refused(SLOW["roots with kinks"]) == (
        f"takes too long to integrate: 314 operations at too many values of r{advice}"
    )


@pytest.mark.parametrize("n", [16, 4096])
def test_the_most_that_fits_into_a_formula_is_taken(n: int) -> None:
    """A sum of 29 bell curves, whose integrals are known."""
    curves = [(i, i / 3.1, 0.3) for i in range(1, 30)]
    text = "+".join(f"{a}*exp(-((r-{b:.4f})/{c})**2)" for a, b, c in curves)
    start = time.process_time()
    plays = from_formula(parse_formula(text), 10.0).discretise(1.0, n)
    assert time.process_time() - start < 25.0
    total = sum(
        a * c * math.sqrt(math.pi) / 2 * (math.erf((10.0 - round(b, 4)) / c) + math.erf(round(b, 4) / c))
        for a, b, c in curves
    )
    assert math.fsum(plays.weights[1:]) == pytest.approx(total, rel=1e-12)


@pytest.mark.parametrize(
    ("base", "exponent"),
    [
        ("(1-1e-30)", "1e32"), ("(1+1e-30)", "-1e32"), ("0.99999", "1000000"), ("1.00001", "65537"),
        ("(-1)", "1e300"), ("1", "1e300"), ("(-0.9999)", "1e5"), ("0.9999", "100000.5"), ("2", "-4000"), ("2", "999"),
    ],
)  # fmt: skip
def test_large_powers_are_those_of_another_precision(base: str, exponent: str) -> None:
    with mpmath.workdps(120):
        names = {"__builtins__": {}}
        number = re.compile(r"[0-9.]+(?:e-?[0-9]+)?")
        a, b = (
            eval(number.sub(lambda m: f"mpf('{m[0]}')", text), {**names, "mpf": mpmath.mpf})
            for text in (base, exponent)
        )
        expected = mpmath.power(a, b)
        found = parse_formula(f"{base}**({exponent})")(1.0)
        # the base has 40 digits, and the power multiplies its relative error by the exponent
        allowed = (abs(b) * mpmath.mpf(10) ** -39 + mpmath.mpf(10) ** -36) * abs(expected)
        assert abs(mpmath.mpf(found) - expected) <= allowed


@pytest.mark.parametrize("text", ["0.5**1e300", "2**-1e300", "(-0.5)**1e300", "0.999**1e9", "1e-300**1e300"])
def test_powers_that_vanish_are_0(text: str) -> None:
    assert parse_formula(text)(1.0) == 0


@pytest.mark.parametrize("text", ["2**1e300", "0.5**-1e300", "(-2)**1e300", "1.001**1e9", "(1+1e-30)**1e40"])
def test_powers_beyond_every_number_are_refused(text: str) -> None:
    with pytest.raises(DensityError, match="is not finite at r = 1; correct the formula or r_max"):
        parse_formula(text)(1.0)


@pytest.mark.slow
def test_any_tolerance_takes_seconds() -> None:
    density = from_formula(parse_formula("sqrt((r-3.333)**2)"), 10.0)
    finest = density.discretise(0.7, 4096).error
    start = time.process_time()
    for share in (1.0, 1.02, 1.5, 1e9):
        assert density.discretise_to(0.7, share * finest).error <= share * finest
    for tolerance in (1e-300, 0.5 * finest):
        with pytest.raises(DensityError, match="is not reached with 4096 thresholds; ask for"):
            density.discretise_to(0.7, tolerance)
    assert time.process_time() - start < 60.0


def test_speed() -> None:
    start = time.perf_counter()
    from_formula(parse_formula("0.8*exp(-0.3*r)+0.1*sin(r)**2"), 10.0).discretise(0.7, 64)
    assert time.perf_counter() - start < 1


@pytest.mark.parametrize(
    ("p0", "n", "message"),
    [
        (1.0, 0, "n has to be a whole number, at least 1, not 0"),
        (1.0, 2.5, "n has to be a whole number, at least 1, not 2.5"),
        (math.nan, 2, "p0 has to be a finite number, not nan"),
    ],
)
def test_what_cannot_be_discretised(p0: float, n: int, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        from_table([0, 1], [1, 1]).discretise(p0, n)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, math.nan])
def test_tolerances_that_are_none(tolerance: float) -> None:
    with pytest.raises(ValueError, match="tolerance has to be"):
        from_table([0, 1], [1, 1]).discretise_to(1.0, tolerance)


# Output, any history ------------------------------------------------------------------------------------

knots = st.lists(st.floats(0.05, 2.0), min_size=1, max_size=6)
heights = st.lists(st.floats(0.0, 3.0), min_size=7, max_size=7).filter(lambda p: max(p) > 0.1)


def continuous_output(r: list[float], p: list[float], p0: float, v: list[float], start: float) -> float:
    """(18) after the drives v. Between its kinks the play is straight in r, so Simpson's rule is exact."""
    turns = [start, *v]
    kinks = {abs(a - b) / 2 for a in v for b in turns} | {abs(a - start) for a in v} | set(r)
    places = np.array(sorted(x for x in kinks if r[0] <= x <= r[-1]))
    nodes = np.sort(np.concatenate([places, (places[1:] + places[:-1]) / 2]))
    state = np.full(len(nodes), start)
    for x in v:
        state = np.maximum(x - nodes, np.minimum(x + nodes, state))
    value = state * np.interp(nodes, r, p)
    simpson = np.diff(places) @ (value[:-2:2] + 4 * value[1:-1:2] + value[2::2]) / 6
    return p0 * v[-1] + float(simpson)


def discrete_output(plays: Discretisation, v: list[float], start: float) -> float:
    r = np.array(plays.thresholds)
    state = np.full(len(r), start)
    for x in v:
        state = np.maximum(x - r, np.minimum(x + r, state))
    return float(np.array(plays.weights) @ state)


def output_rounding(plays: Discretisation, r: list[float], p: list[float], v: list[float]) -> float:
    """Roundings of both outputs: each adds a term per play or place between kinks, with at most 20 roundings a term."""
    places = len(v) * (len(v) + 3) // 2 + len(r)
    return (len(plays.weights) + places + 20) * U * r[-1] * (0.7 + max(p) * r[-1])


@settings(max_examples=200)
@given(
    knots,
    heights,
    st.booleans(),
    st.integers(1, 12),
    st.lists(st.floats(-1, 1), min_size=1, max_size=12),
    st.floats(-1, 1),
)
def test_output_of_any_history(
    gaps: list[float], p: list[float], from_zero: bool, n: int, v: list[float], start: float
) -> None:
    r = np.cumsum([0.0, *gaps]).tolist()
    r, p = (r if from_zero else [x + 0.3 for x in r]), p[: len(r)]
    plays = from_table(r, p).discretise(0.7, n)
    end = r[-1]
    v, start = [x * end for x in v], start * end
    gap = abs(continuous_output(r, p, 0.7, v, start) - discrete_output(plays, v, start))
    assert gap <= plays.output_error + output_rounding(plays, r, p, v)


@settings(max_examples=50)
@given(knots, heights, st.integers(1, 12))
def test_some_history_reaches_the_bound_of_the_output(gaps: list[float], p: list[float], n: int) -> None:
    """The history turns at every threshold and every boundary of a cell, from the outermost inwards."""
    r = np.cumsum([0.0, *gaps]).tolist()
    p = p[: len(r)]
    plays = from_table(r, p).discretise(0.7, n)
    end = r[-1]
    v = [-end]
    for i in range(n, 0, -1):
        v.append(v[-1] + 2 * plays.thresholds[i])
        v.append(v[-1] - 2 * end * (i - 1) / n)
    gap = continuous_output(r, p, 0.7, v, 0.0) - discrete_output(plays, v, 0.0)
    assert abs(gap - plays.output_error) <= output_rounding(plays, r, p, v)


@settings(max_examples=25)
@given(st.lists(st.floats(0.0, 2.0), min_size=3, max_size=3), st.floats(0.1, 3.0), st.floats(0.5, 20.0), st.integers(1, 20))
def test_random_formulas_against_the_exact_loading_curve(c: list[float], b: float, end: float, n: int) -> None:
    """The density `a0 + a1 exp(-b r) + a2 r**2` is integrated twice by hand."""
    text = f"{c[0]!r} + {c[1]!r}*exp(-{b!r}*r) + {c[2]!r}*r**2"
    plays = from_formula(parse_formula(text), end).discretise(0.7, n)
    x = np.unique(np.concatenate([np.linspace(0, end, 400), plays.thresholds]))
    exact = 0.7 * x + c[0] * x**2 / 2 + c[1] * (x / b + np.expm1(-b * x) / b**2) + c[2] * x**4 / 12
    gap = exact - loading_curve(plays, x)
    # 12 roundings of a term, n additions, and cancellation in the exponential's part
    rounding = U * ((n + 12) * exact.max() + 8 * c[1] * (end / b + 1 / b**2))
    assert gap.min() >= -rounding
    assert gap.max() <= plays.error + rounding
    assert gap.max() >= 0.99 * plays.error - rounding


# In parameter files --------------------------------------------------------------------------------------


def test_parameters_are_filled() -> None:
    head = "hystgen: 1\nname: a\ninput_range: [0, 10]\nmodel: {pi: {density: {formula: 0.8*exp(-0.3*r), p0: 0.7, r_max: 10, "
    pi = parse_parameters(head + "n: 12}}}").model.pi
    plays = from_formula(parse_formula("0.8*exp(-0.3*r)"), 10.0).discretise(0.7, 12)
    assert (pi.thresholds, pi.weights, pi.density_error, pi.density_output_error) == (
        plays.thresholds, plays.weights, plays.error, plays.output_error
    )
    assert pi.density is not None
    assert pi.density.formula == "0.8*exp(-0.3*r)"
    pi = parse_parameters(head + "tolerance: 0.01}}}").model.pi
    assert pi.density_error is not None
    assert 0.009 < pi.density_error <= 0.01
    table = "hystgen: 1\nname: a\ninput_range: [0, 10]\nmodel: {pi: {density: {table: {r: [0, 3], p: [6, 0]}, p0: 1, n: 3}}}"
    assert parse_parameters(table).model.pi.weights == (1.0, 5.0, 3.0, 1.0)
