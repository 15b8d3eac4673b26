"""Operators and memory, compared with brute force and with identities of the literature."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray

from hystgen.plays import elastoplastic, operators, play_sum

U = 2.0**-53
"""Largest relative error of one rounding of a double."""

TINY = 5e-324
"""Largest absolute error of a product near zero, where the relative one does not hold."""

numbers = st.floats(-10, 10)
signals = st.lists(numbers, min_size=1, max_size=60)
radii = st.floats(0, 5)


def brute_play(v: list[float], r: float, start: float) -> list[float]:
    out = []
    for x in v:
        start = max(x - r, min(x + r, start))
        out.append(start)
    return out


def stop_roundings(v: ArrayLike, r: float) -> NDArray[np.float64]:
    """Rounding error of two sums per sample, of a state up to r, the sample and the one before; clipping adds none."""
    size = np.abs(v)
    return np.asarray(U * np.cumsum(2 * r + 2 * size + np.concatenate([[0.0], size[:-1]])))


@given(signals, radii, numbers)
def test_play_is_its_recursion(v: list[float], r: float, start: float) -> None:
    assert operators.play(v, r, start).tolist() == brute_play(v, r, start)


@given(signals, radii, numbers)
def test_stop_and_play_add_up_to_the_input(v: list[float], r: float, start: float) -> None:
    stop = operators.stop(v, r, start)
    off = np.abs(stop + operators.play(v, r, start) - v)
    assert np.all(off <= stop_roundings(v, r) + 3 * U * (np.max(np.abs(v)) + r))  # rounding of the play, and two here
    assert np.all(np.abs(stop) <= r)


@given(signals, radii, numbers)
def test_play_stays_within_its_threshold_of_the_input(v: list[float], r: float, start: float) -> None:
    """Equation (27), and (28), which follows from it."""
    s = operators.play(v, r, start)
    assert np.all(np.abs(np.array(v) - s) <= r + 3 * U * (np.abs(v) + r))  # rounding of the play, and two here
    assert np.max(np.abs(s)) <= np.max(np.abs(v)) + r  # the right side is rounded as the play is


@given(signals, radii, numbers, st.integers(0, 2**32 - 1))
def test_rate_independence(v: list[float], r: float, start: float, seed: int) -> None:
    """Equation (24): samples inserted anywhere on the way from one sample to the next, in order, or repeated, change
    nothing."""
    rng = np.random.default_rng(seed)
    course, kept = [v[0]], [0]
    for a, b in pairwise(v):
        between = a + (b - a) * np.sort(rng.uniform(0, 1, rng.integers(0, 4)))
        samples = [*np.clip(between, min(a, b), max(a, b)), b]
        course += np.repeat(samples, rng.integers(1, 4, len(samples))).tolist()
        kept.append(len(course) - 1)
    np.testing.assert_array_equal(operators.play(course, r, start)[kept], operators.play(v, r, start))
    off = np.abs(operators.stop(course, r, start)[kept] - operators.stop(v, r, start))
    assert np.all(off <= stop_roundings(course, r)[kept] + stop_roundings(v, r) + U * 2 * r)


@given(st.lists(st.tuples(numbers, numbers), min_size=1, max_size=60), radii, numbers, numbers)
def test_play_is_lipschitz_in_input_and_start(
    pairs: list[tuple[float, float]], r: float, start: float, other: float
) -> None:
    """Equation (3), at each time with the inputs up to it; a difference of starts counts like one of inputs."""
    v, w = np.array(pairs).T
    most = np.maximum.accumulate(np.maximum(np.abs(v - w), abs(start - other)))
    rounded = U * (np.max(np.abs(pairs)) + r)  # of each play; 3 U: both differences and the last sum here
    s, t = operators.play(v, r, start), operators.play(w, r, other)
    assert np.all(np.abs(s - t) <= most + 2 * rounded + 3 * U * most)


@given(signals, radii, radii, numbers)
def test_play_is_lipschitz_in_the_threshold(v: list[float], r: float, other: float, start: float) -> None:
    """The constant is one, which is what makes a memory admissible."""
    s, t = operators.plays(v, [r, other], start)
    rounded = U * (2 * np.max(np.abs(v)) + r + other)  # of both plays; 3 U: both differences and the last sum here
    assert np.all(np.abs(s - t) <= abs(r - other) + rounded + 3 * U * abs(r - other))


@given(signals, st.floats(0.01, 5), numbers, numbers, st.floats(-1, 1))
def test_the_start_is_forgotten_after_a_sweep_of_twice_the_threshold(
    v: list[float], r: float, start: float, other: float, centre: float
) -> None:
    """Outputs agree to the last bit once the input's range reaches 2 r; a smaller range is not enough."""
    ends = zip(np.minimum.accumulate(v), np.maximum.accumulate(v), strict=True)
    swept = np.array([Fraction(high) - Fraction(low) >= 2 * Fraction(r) for low, high in ends])
    s, t = operators.play(v, r, start), operators.play(v, r, other)
    np.testing.assert_array_equal(s[swept], t[swept])
    short = centre + 0.999 * np.array([-r, r, -r, r])
    s, t = operators.play(short, r, centre - 9 * r), operators.play(short, r, centre + 9 * r)
    assert np.all(t - s >= 0.002 * r - 10 * U * (abs(centre) + 2 * r))  # four roundings of each play, and two here


@given(signals, st.one_of(st.just(0.0), st.floats(-8, 8)))
def test_dead_zone_is_what_lies_beyond_its_threshold(v: list[float], rho: float) -> None:
    """Equation (42), case by case."""
    expected = [x if rho == 0 else x - rho if 0 < rho < x or x < rho < 0 else 0.0 for x in v]
    assert operators.dead_zone(v, rho).tolist() == expected


positive = st.floats(0.05, 20)


@given(signals, positive, radii, st.floats(-1, 1))
def test_parallel_element(stress: list[float], modulus: float, r: float, strain: float) -> None:
    """Every step satisfies the relations (7)-(10), which have one solution: the play of (12)."""
    found = elastoplastic.parallel(stress, modulus, r, strain)
    # In units of `size`, a step rounds two products and the strain, and the trial, the excess and its strain, which are
    # twice as large: nine in all; the play, its start and the sum here round once each
    size = max(modulus * abs(strain), np.max(np.abs(stress)) + r)
    small = 12 * (U * size + (1 + modulus) * TINY)
    np.testing.assert_allclose(found.elastic_stress + found.plastic_stress, stress, rtol=0, atol=small)
    np.testing.assert_array_equal(found.elastic_stress, modulus * found.strain)
    assert np.all(np.abs(found.plastic_stress) <= r)
    moved = np.diff(found.strain, prepend=strain)
    np.testing.assert_array_equal(found.plastic_stress[moved != 0], r * np.sign(moved[moved != 0]))
    play = brute_play(stress, r, modulus * strain)
    np.testing.assert_allclose(modulus * found.strain, play, rtol=0, atol=small)


@given(signals, positive, radii, st.floats(-1, 1))
def test_series_element(strain: list[float], modulus: float, r: float, plastic: float) -> None:
    """Every step satisfies the relations (13)-(16), which have one solution: the stop of (17)."""
    found = elastoplastic.series(strain, modulus, r, plastic)
    # As above, with a trial that rounds twice and three roundings in the stop's input; the stop's own sums come on top
    size = max(modulus * abs(plastic), modulus * np.max(np.abs(strain)) + r)
    small = 16 * (U * size + (1 + modulus) * TINY)
    total = found.elastic_strain + found.plastic_strain
    assert np.all(np.abs(total - strain) <= 3 * U * (np.abs(found.elastic_strain) + np.abs(strain)))
    np.testing.assert_allclose(found.stress, modulus * found.elastic_strain, rtol=0, atol=small)
    assert np.all(np.abs(found.stress) <= r)
    moved = np.diff(found.plastic_strain, prepend=plastic)
    np.testing.assert_array_equal(found.stress[moved != 0], r * np.sign(moved[moved != 0]))
    stop = operators.stop(modulus * np.array(strain), r, modulus * plastic)
    assert np.all(np.abs(found.stress - stop) <= small + stop_roundings(modulus * np.array(strain), r))


@settings(max_examples=50)
@given(st.lists(numbers, min_size=1, max_size=8), positive, radii, st.floats(-1, 1))
def test_elements_take_the_least_energy(load: list[float], modulus: float, r: float, plastic: float) -> None:
    """Each element takes the slider strain of least energy, that stored in the spring and lost in the slider."""
    under_stress = elastoplastic.parallel(load, modulus, r, plastic).strain
    under_strain = elastoplastic.series(load, modulus, r, plastic).plastic_strain
    before = plastic, plastic
    for k, x in enumerate(load):
        for found, energy, last, size in (
            (under_stress[k], lambda e, x=x: (modulus * e**2 / 2, -x * e), before[0], np.max(np.abs(load))),
            (under_strain[k], lambda e, x=x: (modulus * (x - e) ** 2 / 2,), before[1], modulus * np.max(np.abs(load))),
        ):
            tried = np.concatenate([np.linspace(-250, 250, 2001), found + np.geomspace(1e-6, 1, 50), [last]])
            tried = np.concatenate([[found], tried, found - np.geomspace(1e-6, 1, 50)])
            parts = np.array([*energy(tried), r * np.abs(tried - last)])
            cost, rounded = np.sum(parts, axis=0), 6 * U * np.sum(np.abs(parts), axis=0)
            # the strain found has 12 roundings, whose cost is quadratic
            missed = (12 * U * max(modulus * abs(plastic), size + r)) ** 2 / (2 * modulus) + 12 * (1 + modulus) * TINY
            assert np.all(cost[0] - cost <= rounded[0] + rounded + missed)
        before = under_stress[k], under_strain[k]


def test_elements_that_cannot_be() -> None:
    for element in (elastoplastic.parallel, elastoplastic.series):
        with pytest.raises(ValueError, match="a modulus must be positive"):
            element([1.0], 0.0, 1.0)
        with pytest.raises(ValueError, match="a yield stress must not be negative"):
            element([1.0], 1.0, -1.0)
        with pytest.raises(ValueError, match="all samples of an input have to be finite"):
            element([0.0, float("nan")], 1.0, 1.0)
        with pytest.raises(ValueError, match="strain has to be a finite number, not nan"):
            element([1.0], 1.0, 1.0, float("nan"))


@pytest.mark.parametrize("thresholds", [[0.0, -1.0], 1.0, [[1.0]]])
def test_thresholds_that_plays_cannot_have(thresholds: object) -> None:
    with pytest.raises(ValueError, match="play thresholds must be a list of nonnegative numbers"):
        operators.plays([0.0, 1.0], thresholds)  # type: ignore[arg-type]


@given(st.lists(numbers, min_size=5, max_size=5))
def test_projected_memory_is_admissible(requested: list[float]) -> None:
    thresholds = [0, 0.5, 1, 2, 4]
    states, moved = play_sum.project(requested, thresholds)
    size = max(4.0, *map(abs, requested))
    assert play_sum.is_admissible(states, thresholds, 3 * U * size)  # rounding of a sum, and of a difference of two
    assert states[1] == requested[1]
    if not moved:  # up to the eight units in the last place by which decimal numbers may miss their sums
        np.testing.assert_allclose(states[1:], requested[1:], rtol=0, atol=16 * U * size)
    assert play_sum.project(states, thresholds)[0] == states


def test_memory_map_and_back() -> None:
    p = np.array([0.72, 0.6, 0.48, 0.36])
    r = np.array([0, 0.45, 0.9, 1.35])
    c = np.cumsum(p)
    q = np.concatenate([[1 / p[0]], -p[1:] / (c[1:] * c[:-1])])
    v = np.sin(np.linspace(0, 9, 200)) * 2
    s = operators.plays(v, r)[:, -1]
    np.testing.assert_allclose(play_sum.through(play_sum.through(s, p), q), s, atol=1e-14)


@given(signals, radii, st.lists(st.floats(0, 3), min_size=4, max_size=4))
def test_a_weighted_sum_of_plays_is_their_sum_to_the_last_digit(v: list[float], r: float, weights: list[float]) -> None:
    signal, thresholds, p = np.array(v), r * np.arange(4.0), np.array(weights)
    start = np.full(4, signal[0])
    rows = operators.plays(signal, thresholds, start)
    summed = operators.play_sum(signal, thresholds, start, p)
    assert np.array_equal(operators.weighted_sum(p, rows), summed)
    assert np.array_equal(operators.weighted_sum(p, rows[:, ::2]), summed[::2])
