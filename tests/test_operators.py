"""Operators and memory against brute force and against the identities of the literature."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hystgen import memory, operators

numbers = st.floats(-10, 10)
signals = st.lists(numbers, min_size=1, max_size=60)
radii = st.floats(0, 5)


def brute_play(v: list[float], r: float, start: float) -> list[float]:
    out = []
    for x in v:
        start = max(x - r, min(x + r, start))
        out.append(start)
    return out


@given(signals, radii, numbers)
def test_play_is_its_recursion(v: list[float], r: float, start: float) -> None:
    assert operators.play(v, r, start).tolist() == brute_play(v, r, start)


@given(signals, radii, numbers)
def test_stop_and_play_add_up_to_the_input(v: list[float], r: float, start: float) -> None:
    stop = operators.stop(v, r, start)
    np.testing.assert_allclose(stop + operators.play(v, r, start), v, rtol=0, atol=1e-12)
    assert np.all(np.abs(stop) <= r)


@given(signals, radii, numbers)
def test_rate_independence(v: list[float], r: float, start: float) -> None:
    slow = np.repeat(v, 3)
    assert operators.play(slow, r, start)[2::3].tolist() == operators.play(v, r, start).tolist()


@given(st.lists(numbers, min_size=5, max_size=5))
def test_projected_memory_is_admissible(requested: list[float]) -> None:
    thresholds = [0, 0.5, 1, 2, 4]
    states, moved = memory.project(requested, thresholds)
    assert memory.is_admissible(states, thresholds, 1e-12)
    assert states[1] == requested[1]
    if not moved:
        assert list(states[1:]) == requested[1:]
    assert memory.project(states, thresholds)[0] == states


def test_memory_map_and_back() -> None:
    p = np.array([0.72, 0.6, 0.48, 0.36])
    r = np.array([0, 0.45, 0.9, 1.35])
    c = np.cumsum(p)
    q = np.concatenate([[1 / p[0]], -p[1:] / (c[1:] * c[:-1])])
    v = np.sin(np.linspace(0, 9, 200)) * 2
    s = operators.plays(v, r)[:, -1]
    np.testing.assert_allclose(memory.through(memory.through(s, p), q), s, atol=1e-14)
