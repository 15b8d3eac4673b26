"""Models and their inverses: the note's examples, composition in double, memory, and saturation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hystgen import memory
from hystgen.models import PI, Cascade, DeadZone, NotInvertibleError, TanhEnvelope
from hystgen.simulation import Session

EXAMPLE_1 = PI([0, 0.45, 0.9, 1.35, 1.8, 2.25, 2.7], [0.72, 0.6, 0.48, 0.36, 0.24, 0.12, 0.012])
R4 = [0.45 * i for i in range(7)]
PI_4 = PI(R4, [0.65 * float(np.exp(-7.75e-4 * r)) for r in R4])
RHO = [0.4, 0.75, 1, 1.25, 1.5, 1.75, 2, 2.25, 2.5, 2.75, 3]
ETA = [-1.128, -1.116, -0.793, -0.598, -0.413, -0.271, -0.172, -0.106, -0.066, -0.041, -0.025]
DEAD_ZONE_4 = DeadZone([*(-r for r in RHO[::-1]), 0, *RHO], [*ETA[::-1], 4.765, *ETA])
EXAMPLE_4 = Cascade(PI_4, (DEAD_ZONE_4,), 0.0, (-5.0, 5.0))
EXAMPLE_6 = Cascade(PI_4, (TanhEnvelope((6.0, 0.4, 0.0, 0.0)),), 0.0, (-5.0, 5.0))


def brute(model: Cascade, v: np.ndarray) -> np.ndarray:
    """The note's formulas, sample by sample, with numpy's tanh; direction as MODEL.md section 5 has it."""
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
    """1e-12 of the peak to peak of u up to a slope ratio of 1e3, beyond that 1e-15 times the ratio."""
    return float(np.ptp(u)) * max(1e-12, 1e-15 * model.slope_ratio)


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


def reference_signal(model: Cascade, seed: int) -> np.ndarray:
    """A reference that some drive inside the range gives: the brute-force output of a wandering drive."""
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
    v = model.inverse().simulate(u)
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
    assert memory.is_admissible(model.inverse().start, model.inverse().thresholds, 1e-12)


def test_breaks_that_only_the_descending_branch_reaches_count() -> None:
    envelope = TanhEnvelope((1.0, 1.0, 0.0, 0.0), (1.0, 1.0, 0.0, 0.5))
    model = Cascade(PI([0], [1.0]), (envelope, DeadZone([0, 1], [1, 2])), 0.0, (-1.5, 1.5))
    v = np.array([1.0, 1.5, 1.4, 1.2, 0.9])
    for arithmetic in (None, "float64", "float32"):
        y = Session(model, "forward", arithmetic).run(v)[0]
        assert np.abs(y - brute(model, v)).max() < 1e-5


def test_a_map_that_falls_outside_the_range_is_used_inside() -> None:
    """Segments are judged inside the range, and beyond it the forward map is still the map."""
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
