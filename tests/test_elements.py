"""Identification of elements in parallel with the plays, from plants in closed form that share no code with them."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from numpy.typing import NDArray
from recordings import brute_output

import hystgen
from hystgen.identification import Fit, elements
from hystgen.identification.reduction import Course
from hystgen.plants import BoucWen, Dahl, Duhem
from hystgen.records import Record

Array = NDArray[np.float64]
Plant = Callable[[Array], Array]

PLAYS = (0.0, 4.0, 9.0, 16.0, 26.0), (0.10, 0.03, 0.025, 0.02, 0.015)


def along(corners: Sequence[float], samples: int = 300) -> Array:
    """Half cosines from corner to corner, all of the same duration, so that small moves are slow."""
    k = 0.5 - 0.5 * np.cos(np.pi * np.arange(samples) / samples)
    return np.concatenate([a + (b - a) * k for a, b in itertools.pairwise(corners)])


def loops(seed: int) -> Array:
    """Two sweeps of 0 .. 100, loops of random sizes inside them, and another sweep."""
    inside = np.random.default_rng(seed).uniform(5.0, 95.0, 14).tolist()
    return along([50.0, 0.0, 100.0, 0.0, 100.0, *inside, 0.0, 100.0, 50.0])


def identified(plant: Plant, noise: float = 0.0, drive: Callable[[int], Array] = loops, **options: object) -> Fit:
    """The model that `auto` chooses; `noise`: its standard deviation, as a share of the output's range."""
    made = []
    for seed in (0, 1):
        v = drive(seed)
        y = plant(v)
        y = y + noise * float(np.ptp(y)) * np.random.default_rng(100 + seed).standard_normal(len(v))
        made.append(Record(f"record {seed}", 1e-3 * np.arange(len(v)), v, y, sample_time=1e-3))
    return hystgen.identify(made[0], holdout=made[1], model="auto", **options)


def held_out(fit: Fit) -> float:
    """The held-out rms error in % of the range."""
    return next(row.rms_percent for row in fit.rows if row.part == "held out")


def friction(v: Array) -> Array:
    return 0.1 * v - Dahl(sigma=0.035, limit=0.4).simulate(v)


def hardening(v: Array) -> Array:
    return BoucWen(alpha=1.6, k=0.1, D=8.0, beta=0.6, gamma=0.3).simulate(v)


def softening(v: Array) -> Array:
    return BoucWen(alpha=0.4, k=0.1, D=8.0, beta=0.6, gamma=0.3).simulate(v)


def sharp(v: Array) -> Array:
    return BoucWen(alpha=1.5, k=0.1, D=15.0, beta=0.7, gamma=0.3, n=2.0).simulate(v)


def sloping(v: Array) -> Array:
    return Duhem.coleman_hodgdon(0.06, lambda x: 0.1 * x, lambda x: 0.06 + 2e-4 * x).simulate(v)


def beside_plays(v: Array) -> Array:
    return brute_output(v, *PLAYS, 0.0) - Dahl(sigma=0.02, limit=0.3).simulate(v)


WIDE = 8.0 / 0.9
"""Width of `softening` and `hardening`, D A/(beta + gamma)."""


@pytest.mark.parametrize(("plant", "weight", "width", "exponent", "balance"), [
    (friction, -0.035, 0.4 / 0.035, 1.0, 1.0),
    (hardening, -0.06, WIDE, 1.0, 2.0 / 3.0),
    (softening, 0.06, WIDE, 1.0, 2.0 / 3.0),
    (sharp, -0.05, 15.0, 2.0, 0.7),
])  # fmt: skip
def test_without_noise_the_plant_is_found(
    plant: Plant, weight: float, width: float, exponent: float, balance: float
) -> None:
    """An element alone, of either sign, with no play beside it."""
    fit = identified(plant)
    (found,) = fit.parameters.model.effects
    assert held_out(fit) < 1e-4
    assert fit.parameters.model.pi.thresholds == (0.0,)
    made = np.array([found.weights[0], found.widths[0], *found.law])
    assert np.max(np.abs(made / [weight, width, exponent, balance] - 1.0)) < 1e-4


def test_a_duhem_plant_is_found() -> None:
    """`y = a v + k z` with k = c - a and the tilt d/k; the tolerance of the plant's integration is left."""
    fit = identified(sloping)
    (found,) = fit.parameters.model.effects
    assert held_out(fit) < 1e-4
    assert fit.parameters.model.pi.thresholds == (0.0,)
    made = np.array([found.weights[0], found.widths[0], found.tilts[0]])
    assert np.max(np.abs(made / [-0.04, 1.0 / 0.06, -0.005] - 1.0)) < 1e-4


@pytest.mark.parametrize("noise", [0.0, 1e-3, 2e-3])
def test_noise_does_not_tilt_dahl_s_element(noise: float) -> None:
    (found,) = identified(friction, noise).parameters.model.effects
    assert found.shape == "dahl"


def test_beside_plays() -> None:
    """Thresholds come from a grid, so the plays are not exact: the element takes its part, and the error is small."""
    fit = identified(beside_plays)
    (found,) = fit.parameters.model.effects
    assert held_out(fit) < 0.05
    assert found.weights[0] == pytest.approx(-0.02, rel=0.15)
    plain = min(row.rms_percent for row in fit.rows if row.part == "candidate" and row.model != "bouc_wen")
    assert held_out(fit) < 0.5 * plain


@pytest.mark.parametrize(
    ("plant", "noise"), [(friction, 2e-3), (softening, 2e-3), (beside_plays, 5e-4), (sloping, 2e-3)]
)
def test_with_noise_the_noise_is_left(plant: Plant, noise: float) -> None:
    fit = identified(plant, noise)
    assert [effect.name for effect in fit.parameters.model.effects] == ["bouc_wen"]
    assert held_out(fit) < 1.2 * 100.0 * noise


def lagging(v: Array) -> Array:
    """Plays, whose output follows with a lag in time."""
    y, h = np.empty(len(v)), brute_output(v, *PLAYS, 0.0)
    y[0] = h[0]
    for k in range(1, len(v)):
        y[k] = y[k - 1] + 0.05 * (h[k] - y[k - 1])
    return y


def creeping(v: Array) -> Array:
    """Plays with slow creep in time."""
    h = brute_output(v, *PLAYS, 0.0)
    total = h.copy()
    for weight, share in ((0.05, 0.02), (0.05, 0.002)):
        x = h[0]
        for k in range(len(v)):
            x += share * (h[k] - x)
            total[k] += weight * x
    return total


def curved(v: Array) -> Array:
    """Plays behind a bent front."""
    return brute_output(v + 12.0 * np.sin(np.pi * v / 100.0), *PLAYS, 0.0)


def play_sum(v: Array) -> Array:
    return brute_output(v, *PLAYS, 0.0)


@pytest.mark.parametrize("noise", [pytest.param(0.0, marks=pytest.mark.slow), 1e-3])
@pytest.mark.parametrize("plant", [play_sum, lagging, creeping, curved])
def test_other_plants_get_no_element(plant: Plant, noise: float) -> None:
    assert not identified(plant, noise).parameters.model.effects


def test_records_of_one_loop_or_one_speed_are_not_asked() -> None:
    """One loop cannot stay open, and at one speed travel is time."""

    def shown(v: Array) -> bool:
        return elements.shown([Course("", v, v, None, 0, len(v))], [1e-3])

    steady = np.concatenate([np.linspace(a, b, round(10 * abs(b - a))) for a, b in itertools.pairwise(
        [50.0, 0.0, 100.0, 0.0, 60.0, 20.0, 50.0, 30.0, 70.0, 40.0, 100.0])])  # fmt: skip
    assert shown(loops(0))
    assert not shown(along([50.0, *[0.0, 100.0] * 5]))
    assert not shown(steady)
    assert not identified(friction, drive=lambda _: along([50.0, *[0.0, 100.0] * 5])).parameters.model.effects


@pytest.mark.parametrize("begin", [20.0, 85.0])
def test_an_unknown_start_is_found(begin: float) -> None:
    """The plant has come to the first sample from elsewhere, and is not at rest there."""

    def plant(v: Array) -> Array:
        return friction(np.concatenate([[begin], v]))[1:]

    fit = identified(plant)
    assert held_out(fit) < 1e-4
    assert all(len(used.ignored) < 0.1 * used.samples for used in fit.used)


def test_predictions_are_the_model_s() -> None:
    fit = identified(beside_plays)
    v = loops(2)
    record = Record("other", 1e-3 * np.arange(len(v)), v, beside_plays(v), sample_time=1e-3)
    predicted = fit.predict(record, free_offset=True)
    assert float(np.std((predicted - record.y)[600:])) < 5e-4 * float(np.ptp(record.y))
    along_record = fit.along(fit.records[0], fit.used[0])
    assert float(np.nanstd((along_record - fit.records[0].y)[600:])) < 5e-4 * float(np.ptp(record.y))
    simulated = fit.model.simulate(v, t=record.t)
    assert float(np.std((simulated - predicted)[600:])) < 1e-9


def test_a_plant_that_leads_is_told_of_its_other_column() -> None:
    assert any("elements with positive weights follow the lead" in text for text in identified(softening).warnings)
    assert not any("clockwise" in text or "no hysteresis" in text for text in identified(friction).warnings)


def clockwise(v: Array) -> Array:
    """A damper's force over its displacement, which no play follows: an element without any plays is all of it."""
    return Dahl(sigma=0.05, limit=0.4).simulate(v)


@pytest.mark.parametrize("held", [False, True])
def test_elements_that_leave_the_plays_no_slope_are_left_out(held: bool) -> None:
    made = [Record(f"record {k}", 1e-3 * np.arange(len(v)), v, clockwise(v), sample_time=1e-3)
            for k, v in enumerate(map(loops, (0, 1)))]  # fmt: skip
    fit = hystgen.identify(made[0], holdout=made[1] if held else (), model="auto")
    assert [row.model for row in fit.rows if row.part == "candidate"] == ["pi", "gpi-deadzone", "gpi-tanh"]
    assert not fit.parameters.model.effects
