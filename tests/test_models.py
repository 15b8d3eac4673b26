"""Models and their inverses: the note's examples, composition in double, memory, and saturation."""

from __future__ import annotations

import math
from itertools import pairwise, permutations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hystgen.basics.problems import NotInvertibleError
from hystgen.cascade import PI, Cascade
from hystgen.compensator.bounds import error_bounds, largest_sum
from hystgen.compensator.reference import Session
from hystgen.front.dead_zone.model import DeadZone
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.plays import play_sum

U = 2.0**-53  # largest error of one rounding, as a share of its result

EXAMPLE_1 = PI([0, 0.45, 0.9, 1.35, 1.8, 2.25, 2.7], [0.72, 0.6, 0.48, 0.36, 0.24, 0.12, 0.012])
ESTIMATE_2 = PI(
    [0, 0.4678, 0.9178, 1.3678, 1.8178, 2.2678, 2.7178], [0.7536, 0.6192, 0.4835, 0.3637, 0.2464, 0.1410, 0.0184]
)
R4 = [0.45 * i for i in range(7)]
PI_4 = PI(R4, [0.65 * float(np.exp(-7.75e-4 * r)) for r in R4])
RHO = [0.4, 0.75, 1, 1.25, 1.5, 1.75, 2, 2.25, 2.5, 2.75, 3]
ETA = [-1.128, -1.116, -0.793, -0.598, -0.413, -0.271, -0.172, -0.106, -0.066, -0.041, -0.025]
DEAD_ZONE_4 = DeadZone([*(-r for r in RHO[::-1]), 0, *RHO], [*ETA[::-1], 4.765, *ETA])
EXAMPLE_4 = Cascade(PI_4, (DEAD_ZONE_4,), 0.0, (-5.0, 5.0))
EXAMPLE_6 = Cascade(PI_4, (TanhEnvelope((6.0, 0.4, 0.0, 0.0)),), 0.0, (-5.0, 5.0))


def brute(model: Cascade, v: np.ndarray) -> np.ndarray:
    """The note's formulas, sample by sample, with numpy's tanh; direction as in MODEL.md section 5."""
    r, p = np.array(model.pi.thresholds), np.array(model.pi.weights)
    s = np.array(model.pi.start)
    first = s[0]
    for stage in reversed(model.stages):
        if isinstance(stage, TanhEnvelope):
            a0, a1, a2, a3 = stage.ascending
            first = (np.arctanh(np.clip((first - a3) / a0, -1 + 1e-16, 1 - 1e-16)) - a2) / a1
        else:
            first = _solve(stage, first)
    last, up, y = first, True, np.empty(len(v))
    for k, x in enumerate(v):
        up = True if x > last else False if x < last else up
        last = x
        for stage in model.stages:
            if isinstance(stage, TanhEnvelope):
                a0, a1, a2, a3 = stage.ascending if up else stage.descending
                x = a0 * np.tanh(a1 * x + a2) + a3
            else:
                x = _dead_zone(stage, x)
        s = np.maximum(x - r, np.minimum(x + r, s))
        y[k] = p @ s + model.output_offset
    return y


def _dead_zone(stage: DeadZone, x: float) -> float:
    total = 0.0
    for rho, eta in zip(stage.thresholds, stage.weights, strict=True):
        total += eta * (max(x - rho, 0) if rho > 0 else min(x - rho, 0) if rho < 0 else x)
    return total


def _solve(stage: DeadZone, y: float) -> float:
    low, high = -1e3, 1e3
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if _dead_zone(stage, middle) < y else (low, middle)
    return (low + high) / 2


def test_example_1_slopes_and_width() -> None:
    np.testing.assert_allclose(EXAMPLE_1.slopes, [0.72, 1.32, 1.8, 2.16, 2.4, 2.52, 2.532], atol=1e-12)
    assert EXAMPLE_1.width == pytest.approx(1.518, abs=5e-4)


def test_example_2_inverse_parameters() -> None:
    inverse = EXAMPLE_1.inverse()
    np.testing.assert_allclose(inverse.thresholds, [0, 0.324, 0.918, 1.728, 2.7, 3.78, 4.914], atol=1e-12)
    np.testing.assert_allclose(
        inverse.weights, [1.3889, -0.6313, -0.2020, -0.0926, -0.0463, -0.0198, -0.0019], atol=5e-5
    )
    back = inverse.inverse()
    np.testing.assert_allclose(back.weights, EXAMPLE_1.weights, atol=1e-12)
    np.testing.assert_allclose(back.thresholds, EXAMPLE_1.thresholds, atol=1e-12)


def test_example_2_inverse_of_wrong_parameters() -> None:
    """The printed inverse follows from estimates printed to four digits, each off by up to half of the last digit."""
    inverse = ESTIMATE_2.inverse()
    np.testing.assert_allclose(
        inverse.thresholds, [0, 0.3525, 0.9703, 1.8056, 2.8045, 3.9144, 5.0877], rtol=0, atol=2e-4
    )
    np.testing.assert_allclose(
        inverse.weights, [1.327, -0.5985, -0.1897, -0.0883, -0.0450, -0.0219, -0.0027], rtol=0, atol=1e-4
    )


def test_example_4_inverse_parameters() -> None:
    inverse = PI_4.inverse()
    np.testing.assert_allclose(inverse.thresholds, [0, 0.293, 0.877, 1.755, 2.924, 4.386, 6.139], atol=6e-4)
    np.testing.assert_allclose(
        inverse.weights, [1.5385, -0.7691, -0.2564, -0.1282, -0.0769, -0.0513, -0.0366], atol=6e-5
    )
    tau = DEAD_ZONE_4.inverse_map().thresholds[12:]
    np.testing.assert_allclose(
        tau, [1.906, 3.179, 3.809, 4.241, 4.524, 4.704, 4.816, 4.885, 4.928, 4.954, 4.97], rtol=1e-3
    )


T = np.linspace(0, 2, 4001)
EXAMPLES = {
    "1, 2": (Cascade(EXAMPLE_1), 10 * np.sin(2 * np.pi * T)),
    "3": (Cascade(EXAMPLE_1), 5.85 * np.sin(2 * np.pi * T) + 2.35 * np.sin(10 * np.pi * T)),
    "4": (EXAMPLE_4, 15 * np.sin(2 * np.pi * T)),
    "5": (EXAMPLE_4, 8.25 * np.sin(2 * np.pi * T) + 6.75 * np.sin(10 * np.pi * T)),
    "6": (EXAMPLE_6, 10 * np.sin(2 * np.pi * T)),
}


def tolerance(model: Cascade, u: np.ndarray) -> float:
    """1e-12 of the peak-to-peak value of u up to a slope ratio of 1e3, beyond that 1e-15 times the ratio.

    Plus a rounding for each product and sum, forward and inverse, which counts where plays start far away.
    """
    inputs = np.array(model.input_range)
    for stage in model.stages:
        inputs = np.concatenate([np.atleast_1d(stage.forward(inputs, up)) for up in (True, False)])
    farthest = max(float(np.max(np.abs(model.pi.initial_state))), float(np.max(np.abs(inputs))))
    level = float(np.sum(model.pi.weights)) * farthest + abs(model.output_offset)
    roundings = 4 * (model.pi.n + 1) * 2.0**-53 * level
    return float(np.ptp(u)) * max(1e-12, 1e-15 * model.slope_ratio) + roundings


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_composition_is_the_identity(name: str) -> None:
    model, u = EXAMPLES[name]
    v = model.inverse().simulate(u)
    assert np.max(np.abs(model.simulate(v) - u)) <= tolerance(model, u)
    assert np.max(np.abs(brute(model, v) - u)) <= tolerance(model, u)


@st.composite
def play_sums(draw: st.DrawFn) -> PI:
    n = draw(st.integers(0, 12))
    scale = draw(st.sampled_from([0.01, 1.0, 30.0]))
    gaps = draw(st.lists(st.floats(0.02, 1), min_size=n, max_size=n))
    weights = draw(st.lists(st.floats(0, 1), min_size=n, max_size=n))
    p0 = draw(st.floats(0.05, 2))
    thresholds = [0.0]
    for gap in gaps:
        thresholds.append(thresholds[-1] + gap * scale)
    start = draw(
        st.one_of(st.floats(-1, 1), st.lists(st.floats(-1, 1), min_size=n + 1, max_size=n + 1))
    )
    scaled = [x * scale for x in start] if isinstance(start, list) else start * scale
    return PI(thresholds, [p0, *weights], scaled)


@st.composite
def fronts(draw: st.DrawFn) -> tuple[object, ...]:
    kind = draw(st.sampled_from(["none", "dead zone", "tanh", "branches", "both"]))
    made: list[object] = []
    if kind in ("dead zone", "both"):
        left = draw(st.integers(0, 4))
        right = draw(st.integers(0, 4))
        rho = [-(left - j) * 0.3 for j in range(left)] + [0.0] + [0.3 * (j + 1) for j in range(right)]
        slopes = draw(st.lists(st.floats(0.2, 3), min_size=left + right + 1, max_size=left + right + 1))
        eta = [slopes[j] - slopes[j + 1] for j in range(left)] + [slopes[left]]
        eta += [slopes[left + j + 1] - slopes[left + j] for j in range(right)]
        made.append(DeadZone(rho, eta))
    if kind in ("tanh", "branches", "both"):
        a1 = draw(st.floats(0.05, 0.4))
        a2 = draw(st.floats(-0.3, 0.3))
        branch = (draw(st.floats(0.5, 5)), a1, a2, draw(st.floats(-1, 1)))
        if kind == "branches":
            gap = draw(st.floats(0, 0.2))
            made.append(TanhEnvelope(branch, (branch[0], branch[1], branch[2], branch[3] + gap)))
        else:
            made.append(TanhEnvelope(branch))
    return tuple(made)


@st.composite
def models(draw: st.DrawFn) -> Cascade:
    low = draw(st.floats(-3, 0.5))
    high = low + draw(st.floats(0.5, 3))
    return Cascade(draw(play_sums()), draw(fronts()), draw(st.floats(-5, 5)), (low, high))  # type: ignore[arg-type]


def brute_plays(pi: PI, v: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Output of a play sum from its states, sample by sample."""
    r, p = np.array(pi.thresholds), np.array(pi.weights)
    y = []
    for x in v:
        states = np.maximum(x - r, np.minimum(x + r, states))
        y.append(p @ states)
    return np.array(y)


def reference_signal(model: Cascade, seed: int) -> np.ndarray:
    """A reference within reach: the brute-force output of a drive that wanders inside the range."""
    rng = np.random.default_rng(seed)
    low, high = model.input_range
    drive = np.interp(np.linspace(0, 40, 600), np.arange(41), rng.uniform(low, high, 41))
    drive[100:110] = drive[100]
    return brute(model, drive)


@settings(max_examples=150)
@given(models(), st.integers(0, 1000))
def test_forward_is_the_textbook(model: Cascade, seed: int) -> None:
    rng = np.random.default_rng(seed)
    v = np.interp(np.linspace(0, 40, 600), np.arange(41), rng.uniform(*model.input_range, 41))
    y = brute(model, v)
    assert np.max(np.abs(model.simulate(v) - y)) <= 1e-12 * (1 + np.max(np.abs(y)))


@settings(max_examples=150)
@given(models(), st.integers(0, 1000))
def test_inverse_then_forward_is_the_identity(model: Cascade, seed: int) -> None:
    u = reference_signal(model, seed)
    v = model.inverse().simulate(u, clamp=False)
    assert np.max(np.abs(model.simulate(v) - u)) <= tolerance(model, u)


@settings(max_examples=100)
@given(models(), st.integers(0, 1000))
def test_after_saturation_the_composition_is_exact_again(model: Cascade, seed: int) -> None:
    rng = np.random.default_rng(seed)
    low, high = model.output_range
    u = np.interp(np.linspace(0, 60, 900), np.arange(61), rng.uniform(low - 0.3, high + 0.3, 61))
    session = Session(model, "inverse", clamp=True)
    v, status = session.run(u)
    assert np.all(v >= model.input_range[0])
    assert np.all(v <= model.input_range[1])
    free = status == 0
    assert np.max(np.abs(brute(model, v) - u)[free], initial=0) <= tolerance(model, u)


virgins = play_sums().map(lambda pi: PI(pi.thresholds, pi.weights))
turns = st.lists(st.floats(-1, 1), min_size=2, max_size=20)


def summed(pi: PI) -> float:
    """Rounding error of a sum over all plays, as a share of its terms: that of each state, product and addition."""
    return (pi.n + 3) * U


def rounding(pi: PI, v_max: float, engine: str = "corners") -> float:
    """Largest difference between the outputs of a play sum computed by an engine and by `PI.simulate`."""
    return error_bounds(Cascade(pi, (), 0.0, (-v_max, v_max)), "float64", engine).forward


def reach(pi: PI) -> float:
    """A drive beyond which every play of the model moves."""
    return 1.5 * (pi.thresholds[-1] + 0.1)


@given(virgins)
def test_loading_curve_is_what_a_virgin_model_does(pi: PI) -> None:
    """Equations (22) and (23): its slope between two thresholds is a loop slope (33)."""
    x = np.linspace(0, 2 * reach(pi), 200)
    y = brute_plays(pi, x, np.zeros(pi.n + 1))
    np.testing.assert_allclose(pi.loading_curve(x), y, rtol=2 * summed(pi), atol=0)
    ends, virgin = np.array([*pi.thresholds, 2 * reach(pi)]), np.zeros(pi.n + 1)
    low = brute_plays(pi, 0.75 * ends[:-1] + 0.25 * ends[1:], virgin)
    high = brute_plays(pi, 0.25 * ends[:-1] + 0.75 * ends[1:], virgin)
    # errors of the outputs, of the places where they are taken (4 roundings), and of the quotient
    slopes, half = np.array(pi.slopes), np.diff(ends) / 2
    small = (summed(pi) * (low + high) + 4 * U * slopes * ends[1:]) / half + 4 * U * slopes
    assert np.all(np.abs((high - low) / half - slopes) <= small)


@given(virgins)
def test_a_loading_curve_gives_the_model_back(pi: PI) -> None:
    x = np.array([*pi.thresholds, 2 * reach(pi)])
    phi = [sum(p * max(a - r, 0) for p, r in zip(pi.weights, pi.thresholds, strict=True)) for a in x]
    back = PI.from_loading_curve(x, phi)
    # a slope has the errors of the curve at both ends, of the difference and the quotient; a weight those of two slopes
    size = np.array(phi)
    small = summed(pi) * (size[1:] + size[:-1]) / np.diff(x) + 4 * U * np.array(pi.slopes)
    assert np.all(np.abs(np.subtract(back.weights, pi.weights)) <= small + np.concatenate([[0.0], small[:-1]]))
    assert back.thresholds == pi.thresholds


def test_a_smooth_loading_curve_gives_the_density_back() -> None:
    """`p_0 = phi'(0)` and `p(r) = phi''(r)` (19), for phi = 0.7 x + 2 (x - 1 + exp(-x)), that is p = 2 exp(-r)."""
    x = np.linspace(0, 5, 501)
    pi = PI.from_loading_curve(x, 0.7 * x + 2 * (x - 1 + np.exp(-x)))
    assert 0.7 < pi.weights[0] < 0.7 + 2.0 * 0.01 / 2, "up to half a step of p(0)"
    # second differences of the exponential, h^2 / 12 off its derivative; each is of 4 values with 8 roundings
    differences = 2 * np.exp(-x[1:-1]) * (2 * np.cosh(0.01) - 2) / 0.01**2
    np.testing.assert_allclose(np.array(pi.weights[1:]) / 0.01, differences, rtol=0, atol=4 * 8 * U * 12 / 0.01**2)


@pytest.mark.parametrize(
    ("x", "phi", "message"),
    [
        ([0], [0], "as many values as points, at least two"),
        ([0, 1], [0, 1, 2], "as many values as points, at least two"),
        ([0.5, 1], [0, 1], r"start at \(0, 0\)"),
        ([0, 1], [0.5, 1], r"start at \(0, 0\)"),
        ([0, 1, 1], [0, 1, 2], "strictly rising"),
        ([0, float("nan"), 1], [0, 1, 2], "give x as finite numbers"),
        ([0, 1, float("inf")], [0, 1, 2], "give x as finite numbers"),
        ([0, 1], [0, float("nan")], "give phi as finite numbers"),
        ([0, 1e-320], [0, 1], "too steep"),
        ([0, 1e-300, 2e-300], [0, 1e8, -1e8], "too steep"),
    ],
)
def test_loading_curves_that_are_none(x: list[float], phi: list[float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        PI.from_loading_curve(x, phi)


@pytest.mark.parametrize("start", [float("nan"), float("inf"), [0.0, float("nan")]])
def test_start_states_that_are_none(start: float | list[float]) -> None:
    with pytest.raises(ValueError, match=r"give (the )?initial states? as finite numbers"):
        PI([0, 1], [1, 1], start)


@given(virgins, turns)
def test_width_is_that_of_the_largest_loop(pi: PI, middle: list[float]) -> None:
    """Equation (32), corrected: distance of the rising and falling drives of one output on a loop that moves every
    play; no history makes it larger."""
    top, r = 4 * reach(pi) + 4 * pi.width, np.array(pi.thresholds)
    up = np.unique(np.concatenate([[-top, top], 2 * r - top, top - 2 * r]))  # the branches are straight in between
    rising, falling = brute_plays(pi, up, r - top), brute_plays(pi, up[::-1], top - r)[::-1]
    width = float(np.interp(0, rising, up) - np.interp(0, falling, up))
    # in drive units: errors of both outputs and 4 roundings of an interpolation, where all plays move
    small = (summed(pi) + 4 * U) * (top + r[-1])
    assert abs(width - pi.width) <= 2 * small
    # every memory lies between the two branches; where the slope is p_0, rounding of the output counts for more
    course = brute_plays(pi, top * np.array(middle), np.zeros(pi.n + 1))
    earliest, latest = np.interp(course, falling, up), np.interp(course, rising, up)
    inside = np.abs(course) < min(rising[-1], -falling[0])
    drives = top * np.array(middle)
    small *= 2 * pi.slopes[-1] / pi.weights[0]
    assert np.all((drives >= earliest - small)[inside])
    assert np.all((drives <= latest + small)[inside])
    assert np.all((latest - earliest <= pi.width + 2 * small)[inside])


@given(play_sums(), turns)
def test_bounds_of_the_output(pi: PI, course: list[float]) -> None:
    """Every output lies in `output_range`, which lies within (30), which lies within (31)."""
    v_max = reach(pi)
    v = v_max * np.array(course)
    model = Cascade(pi, (), 0.0, (-v_max, v_max))
    low, high = model.output_range
    y = brute_plays(pi, v, np.array(pi.start))
    small = rounding(pi, v_max, "loop")
    assert low - small <= y.min()
    assert y.max() <= high + small
    ends = [brute_plays(pi, np.array([x]), np.array(pi.start))[0] for x in (-v_max, v_max)]
    np.testing.assert_allclose(model.output_range, ends, rtol=0, atol=small)
    p, r = np.array(pi.weights), np.array(pi.thresholds)
    thirty = p.sum() * v_max + p @ r
    thirty_one = (p[0] + pi.n * p[1:].max(initial=0.0)) * v_max + pi.n * p[1:].max(initial=0.0) * r[-1]
    assert max(-low, high) <= thirty + small
    assert thirty <= largest_sum(model) + small, "which counts a start outside the range too"
    assert thirty <= thirty_one + small


@given(play_sums(), turns, st.integers(0, 2**32 - 1))
def test_models_are_lipschitz_in_input_and_thresholds(pi: PI, course: list[float], seed: int) -> None:
    rng = np.random.default_rng(seed)
    v = reach(pi) * np.array(course)
    w = v + 0.1 * reach(pi) * rng.uniform(-1, 1, len(v))
    y = pi.simulate(v)
    small = rounding(pi, 1.1 * reach(pi))
    apart = np.maximum.accumulate(np.abs(v - w))
    assert np.all(np.abs(pi.simulate(w) - y) <= pi.slopes[-1] * apart + small)
    if pi.n:
        factors = np.exp(np.cumsum(rng.uniform(0, 0.05, pi.n + 1)))
        other = PI(np.array(pi.thresholds) * factors, pi.weights, pi.start[0])
        same = PI(pi.thresholds, pi.weights, pi.start[0])
        moved = np.abs(np.array(other.thresholds) - pi.thresholds)
        small = max(small, rounding(other, reach(pi)))
        assert np.all(np.abs(other.simulate(v) - same.simulate(v)) <= np.array(pi.weights) @ moved + small)


@settings(max_examples=60)
@given(models(), turns, st.integers(0, 2**32 - 1))
def test_models_and_inverses_do_not_know_the_rate(model: Cascade, course: list[float], seed: int) -> None:
    """Equation (25), also for the inverse: samples inserted on the way from one to the next change no bit.

    With two branches, the front jumps at each reversal to a place that depends on the first sample after it, so only
    repeated samples are inserted.
    """
    rng = np.random.default_rng(seed)
    low, high = model.input_range
    v = low + (high - low) * (np.array(course) + 1) / 2

    def slowed(x: np.ndarray) -> tuple[list[float], list[int]]:
        course, kept = [x[0]], [0]
        for a, b in pairwise(x):
            share = np.sort(rng.uniform(0, 1, rng.integers(0, 4))) * (not model.branches_differ)
            course += [*np.clip(a + (b - a) * share, min(a, b), max(a, b)), b]
            kept.append(len(course) - 1)
        return course, kept

    slow, kept = slowed(v)
    assert model.simulate(slow)[kept].tolist() == model.simulate(v).tolist()
    u = brute(model, v)
    slow, kept = slowed(u)
    assert model.inverse().simulate(slow)[kept].tolist() == model.inverse().simulate(u).tolist()


@given(play_sums(), turns, turns)
def test_a_larger_sweep_wipes_out_the_smaller(pi: PI, before: list[float], after: list[float]) -> None:
    """Moves inside a range leave no trace once the drive has run through the range."""
    v = reach(pi)
    inside = 0.9 * v * np.array(before)
    end = v * np.array(after)
    long = np.concatenate([[-v], inside, [v, -v], end])
    short = np.concatenate([[-v, v, -v], end])
    y = pi.simulate(long)
    assert y[-len(end) - 1 :].tolist() == pi.simulate(short)[-len(end) - 1 :].tolist()


@given(play_sums(), turns, turns, st.floats(-0.9, 0.8), st.floats(0.05, 1))
def test_loops_between_the_same_extremes_are_congruent(
    pi: PI, one: list[float], other: list[float], low: float, width: float
) -> None:
    """Loops differ only by a shift of the output, whatever went before."""
    v = reach(pi)
    loop = v * (low + min(width, 1 - low) * np.concatenate([[0, 1], np.linspace(1, 0, 9), np.linspace(0, 1, 9)]))
    found = [pi.simulate(np.concatenate([v * np.array(course), loop]))[-18:] for course in (one, other)]
    # errors of two outputs each, and of their difference
    small = 2 * rounding(pi, v) + 2 * U * np.ptp(found)
    np.testing.assert_allclose(found[0] - found[0][0], found[1] - found[1][0], rtol=0, atol=small)


@given(virgins, virgins, turns)
def test_compensation_with_a_wrong_inverse_is_a_play_sum(pi: PI, estimate: PI, course: list[float]) -> None:
    """Play sums form a group whose product is composition of loading curves, so the result of a wrong inverse is known:
    it is the play sum of the curve `phi o phi_hat^-1`, the polygon through its corners."""
    corners = np.unique(np.concatenate([[0.0], pi.thresholds[1:], estimate.thresholds[1:]]))
    corners = np.concatenate([corners, [2 * corners[-1] + 1]])

    def curve(model: PI) -> np.ndarray:
        return np.array(np.maximum(corners[:, None] - np.array(model.thresholds), 0) @ np.array(model.weights))

    wanted, got = curve(estimate), curve(pi)
    assume(np.all(np.diff(wanted) > 1e-9 * wanted[-1]))
    left = PI.from_loading_curve(wanted, got)
    u = 1.2 * wanted[-1] * np.array(course)
    y = brute_plays(pi, estimate.inverse().simulate(u), np.zeros(pi.n + 1))
    # errors of the drive: of the inverse's weights and thresholds, 3 roundings each, and of its computed output
    inverse, most = estimate.inverse(), np.abs(u).max()
    lift = np.abs(inverse.weights) @ (most + np.array(inverse.thresholds))
    small = pi.slopes[-1] * (rounding(inverse, most) + 6 * U * lift) + summed(pi) * np.abs(pi.weights) @ (
        1.2 * corners[-1] + np.array(pi.thresholds)
    )
    # errors of the other play sum: of its curve at the corners, counted twice for every turn, and of its output
    curves = summed(pi) * got[-1] + summed(estimate) * max(left.slopes) * wanted[-1]
    small += 2 * len(u) * 2 * curves + summed(left) * np.abs(left.weights) @ (most + np.array(left.thresholds))
    np.testing.assert_allclose(y, brute_plays(left, u, np.zeros(left.n + 1)), rtol=0, atol=small)


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_cascades_of_three_stages(order: tuple[int, ...]) -> None:
    stages = (
        DeadZone([-1.5, -0.5, 0, 0.4, 1], [-0.3, 0.4, 1.0, -0.4, 0.5]),
        TanhEnvelope((3.0, 0.3, 0.1, -0.2)),
        TanhEnvelope((2.5, 0.4, -0.1, 0.1), (2.5, 0.4, -0.1, 0.25)),
    )
    model = Cascade(EXAMPLE_1, tuple(stages[i] for i in order), 0.3, (-2.0, 2.0))
    assert model.inverse_problems() == []
    u = reference_signal(model, 7)
    v = model.inverse().simulate(u, clamp=False)
    assert np.max(np.abs(model.simulate(v) - u)) <= tolerance(model, u)
    assert np.max(np.abs(brute(model, v) - u)) <= tolerance(model, u)


def test_refusals_name_the_reason_and_the_range() -> None:
    with pytest.raises(NotInvertibleError, match=r"p_0 > 0"):
        PI([0, 1], [0, 1]).inverse()
    bent = Cascade(EXAMPLE_1, (DeadZone([-1, 0, 1], [-2, 1, 0.5]),), 0.0, (-3.0, 3.0))
    with pytest.raises(NotInvertibleError, match=r"between -3 and -1"):
        bent.inverse()
    assert not Cascade(EXAMPLE_1, bent.stages, 0.0, (-1.0, 3.0)).inverse_problems()
    crossed = Cascade(EXAMPLE_1, (TanhEnvelope((2, 0.5, 0, 0), (2.2, 0.5, 0, 0)),), 0.0, (-2.0, 2.0))
    with pytest.raises(NotInvertibleError, match=r"for drives between -2 and -0\.000"):
        crossed.inverse()


def test_general_weights_invert_while_every_sum_is_positive() -> None:
    inverse = PI([0, 0.5, 1], [1, -0.4, 0.2]).inverse()
    u = 3 * np.sin(np.linspace(0, 20, 500))
    v = inverse.simulate(u)
    np.testing.assert_allclose(PI([0, 0.5, 1], [1, -0.4, 0.2]).simulate(v), u, atol=1e-12)


def test_inverse_memory_follows_the_forward_memory() -> None:
    model = PI([0, 0.5, 1, 2], [1, 0.5, 0.3, 0.2], [0, 0.3, 0.1, -0.4])
    u = 2 * np.sin(np.linspace(0, 9, 300))
    v = model.inverse().simulate(u)
    np.testing.assert_allclose(v, Cascade(model).inverse().simulate(u), atol=1e-13)
    assert play_sum.is_admissible(model.inverse().start, model.inverse().thresholds, 1e-12)


def test_breaks_that_only_the_descending_branch_reaches_count() -> None:
    envelope = TanhEnvelope((1.0, 1.0, 0.0, 0.0), (1.0, 1.0, 0.0, 0.5))
    model = Cascade(PI([0], [1.0]), (envelope, DeadZone([0, 1], [1, 2])), 0.0, (-1.5, 1.5))
    v = np.array([1.0, 1.5, 1.4, 1.2, 0.9])
    for arithmetic in (None, "float64", "float32"):
        y = Session(model, "forward", arithmetic).run(v)[0]
        assert np.abs(y - brute(model, v)).max() < 1e-5


def test_a_map_that_falls_outside_the_range_is_used_inside() -> None:
    """Segments are judged inside the range only; beyond it, the forward map still follows the model."""
    stage = DeadZone([0, 1, 3], [-1, 2, 0.5])
    model = Cascade(PI([0, 0.5], [1.0, 0.5]), (stage,), 0.0, (2.0, 5.0))
    assert model.inverse_problems() == []
    v = np.array([2.0, 4.5, 3.0, 5.0, 2.5, -1.0, 0.5])
    y = model.simulate(v)
    assert np.abs(y - brute_from(model, v, np.array([0.0, 0.0]))).max() < 1e-12
    u = model.simulate(v[:5])
    assert np.abs(model.simulate(model.inverse().simulate(u)) - u).max() < 1e-12


def brute_from(model: Cascade, v: np.ndarray, s: np.ndarray) -> np.ndarray:
    r, p = np.array(model.pi.thresholds), np.array(model.pi.weights)
    y = []
    for x in v:
        for stage in model.stages:
            x = _dead_zone(stage, x)
        s = np.maximum(x - r, np.minimum(x + r, s))
        y.append(p @ s + model.output_offset)
    return np.array(y)


def test_a_start_beyond_the_range_takes_the_branch_of_the_limited_drive() -> None:
    envelope = TanhEnvelope((1.0, 1.0, 0.0, 0.0), (1.0, 1.0, 0.0, 0.3))
    model = Cascade(PI([0, 0.2], [1.0, 0.5], 0.9), (envelope,), 0.0, (-1.0, 1.0))
    u = model.simulate(np.array([0.9, 0.5, 0.95, -0.7]))
    v = model.inverse().simulate(u, clamp=True)
    assert np.abs(model.simulate(v) - u).max() < 1e-12


def test_decimal_states_of_a_history_are_no_projection() -> None:
    assert not PI([0, 0.45, 0.9], [1, 1, 1], [1, 0.55, 0.1]).projected
    assert PI([0, 0.45, 0.9], [1, 1, 1], [1, 0.55, 0.0999]).projected


def _sum_of_terms(stage: DeadZone, x: float) -> float:
    """Equation (41), summed term by term and rounded once."""
    terms = []
    for rho, eta in zip(stage.thresholds, stage.weights, strict=True):
        terms.append(eta * (max(x - rho, 0.0) if rho > 0 else min(x - rho, 0.0) if rho < 0 else x))
    return math.fsum(terms)


@settings(max_examples=200)
@given(
    st.lists(st.floats(-1e3, 1e3), max_size=12), st.lists(st.floats(-10.0, 10.0), min_size=13, max_size=13),
    st.floats(-1e4, 1e4), st.floats(0.0, 1e4),
)  # fmt: skip
def test_dead_zone_sums_are_those_of_their_terms(
    places: list[float], weights: list[float], low: float, width: float
) -> None:
    """The sums agree to the last bit, also at the breaks, and values kept between calls belong to the same range."""
    thresholds = sorted({0.0, *places})
    stage = DeadZone(thresholds, weights[: len(thresholds)])
    high = low + width
    inside = [b for b in stage.breaks if low < b < high]
    expected = [_sum_of_terms(stage, x) for x in (low, high, *inside)]
    assert stage.image(low, high) == (min(expected), max(expected))
    assert stage.over(low, high).values == tuple(_sum_of_terms(stage, b) for b in stage.over(low, high).breaks)
    for x, value in stage.anchors:
        assert value == _sum_of_terms(stage, x)


def test_a_stage_that_two_models_share_keeps_their_ranges_apart() -> None:
    stage = DeadZone([-1.0, 0.0, 1.0], [1.0, 1.0, 2.0])
    narrow, wide = (Cascade(PI([0], [1]), (stage,), 0.0, (-end, end)) for end in (0.5, 5.0))
    for model in (narrow, wide, narrow):
        v = np.linspace(*model.input_range, 7)
        assert model.front_inverse(model.front(v)) == pytest.approx(v)
    assert narrow.stage_ranges(True) == ((-0.5, 0.5),)
    assert wide.stage_ranges(False) == ((-5.0, 5.0),)
