"""Sensors whose curve is not a polynomial: the curve itself, and its diagnosis."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from recordings import brute_output, noisy
from scipy.interpolate import PchipInterpolator

import hystgen
from hystgen.effects.base import Run
from hystgen.effects.sensor_nonlinearity.model import SensorCurve
from hystgen.records import Record

Array = NDArray[np.float64]

NOISE = 0.02


def curve(knots: tuple[float, ...], values: tuple[float, ...]) -> SensorCurve:
    return SensorCurve(name="sensor_nonlinearity", shape="curve", knots=knots, values=values)


def test_the_curve_is_that_of_another_library() -> None:
    """With even knots, scipy's slopes are the same harmonic means, except at both ends."""
    knots, values = np.linspace(-3.0, 5.0, 9), np.cumsum([0.0, 1.0, 0.2, 3.0, 0.7, 0.7, 2.0, 0.1, 1.0])
    y = np.linspace(knots[1], knots[-2], 1001)
    shown = curve(tuple(knots.tolist()), tuple(values.tolist())).mapped(y, Run(y, y))
    np.testing.assert_allclose(shown, PchipInterpolator(knots, values)(y), rtol=0.0, atol=1e-13)


def test_the_curve_rises_everywhere_and_is_straight_beyond_its_ends() -> None:
    sensor = curve((0.0, 1.0, 1.5, 4.0), (0.0, 0.01, 7.0, 7.5))
    y = np.linspace(-10.0, 20.0, 3001)
    shown = sensor.mapped(y, Run(y, y))
    assert np.all(np.diff(shown) > 0.0)
    np.testing.assert_allclose(np.diff(shown[y < -0.01], 2), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.diff(shown[y > 4.02], 2), 0.0, atol=1e-12)
    np.testing.assert_allclose(sensor.mapped(np.array(sensor.knots), Run(y, y)), sensor.values, rtol=1e-15)


@pytest.mark.parametrize(
    ("knots", "values", "message"),
    [
        ((0.0, 1.0, 1.0), (0.0, 1.0, 2.0), "has to be above 1, the previous entry"),
        ((0.0, 1.0, 2.0), (0.0, 3.0, 2.0), "has to be above 3, the previous entry"),
        ((0.0, 1.0, 2.0), (0.0, 3.0), "has 2 values for 3 in knots"),
    ],
)
def test_a_curve_that_is_none(knots: tuple[float, ...], values: tuple[float, ...], message: str) -> None:
    assert any(message in said for _, said in curve(knots, values).problems((0.0,)))


SENSORS: dict[str, Callable[[Array], Array]] = {
    "tanh": lambda x: np.tanh(1.6 * x) / 1.6,
    "arctangent": lambda x: np.arctan(2.0 * x) / 2.0,
    "root": lambda x: 2.0 * np.sqrt(0.85 + 0.5 * x),
}
"""Sensor curves, for an output between -1 and 1."""

R = np.linspace(0.0, 45.0, 61)
P = np.concatenate([[1.0], 0.03 * np.exp(-(((R[1:] - 8.0) / 14.0) ** 2))])


def recorded(sensor: Callable[[Array], Array], number: int) -> Record:
    ends = [(80.0, 10.0, 60.0, 20.0, 100.0, 0.0, 50.0, 0.0), (5.0, 35.0, 5.0, 35.0, 65.0, 95.0, 65.0, 95.0)]
    rng = np.random.default_rng(number)
    turns = [0.0, 100.0, 0.0, *(ends[number] if number < 2 else rng.uniform(0.0, 100.0, 20))]
    v = np.concatenate([
        np.linspace(a, b, max(2, int(abs(b - a) / 0.6)), endpoint=False) for a, b in itertools.pairwise(turns)
    ])  # fmt: skip
    y = brute_output(v, R, P, 0.0)
    x = y / (0.5 * float(np.sum(P)) * 100.0) - 1.0
    t = np.arange(len(v)) * 1e-3 + 10.0 * number
    return Record(f"record {number}", t, v, noisy(50.0 * sensor(x), NOISE, number), sample_time=1e-3)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("name", "named"), [("tanh", "saturation"), ("arctangent", "sensor_nonlinearity"), ("root", "sensor_nonlinearity")]
)
def test_a_sensor_with_any_curve_is_named(name: str, named: str) -> None:
    """A tanh is the catalogue's own limit, which a sensor may have too; no effect that bends the plays is named."""
    made = [recorded(SENSORS[name], number) for number in range(4)]
    found = hystgen.diagnose(hystgen.identify(made[:3], holdout=made[3:], model="pi"), made[:3], holdout=made[3:])
    assert [each["name"] for each in found.content["effects"]] == [named]
    assert found.content["gap"]["refitted"]["holdout"] > 20.0 * NOISE
    assert found.content["gap"]["after"]["holdout"] < 1.5 * NOISE
