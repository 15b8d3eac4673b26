"""Hysteresis that is not a play sum is reported first and told apart from effects of time; calm and wild inverses."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from recordings import brute_output, noisy

import hystgen
from hystgen.cascade import PI, Cascade
from hystgen.diagnosis import Diagnosis
from hystgen.diagnosis.data import preparing, signals
from hystgen.diagnosis.search import forgetting, harm, hypothesis, screening, selection
from hystgen.diagnosis.search.selection import Outcome
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.plants import Duhem
from hystgen.records import Record

pytestmark = pytest.mark.thorough

Array = NDArray[np.float64]
Stage = Callable[[Array], Array]

STEP, NOISE = 1e-3, 0.03
THRESHOLDS, WEIGHTS = (0.0, 3.0, 8.0, 16.0, 30.0), (1.0, 0.1, 0.15, 0.1, 0.1)


def element(v: Array, width: float, balance: float, parts: int = 8) -> Array:
    """`dz = dv (1 - (b sgn(z dv) + 1 - b) |z|/width)` by the midpoint rule in small parts of every move."""
    z, out = 0.0, np.zeros(len(v))

    def slope(z: float, dv: float) -> float:
        return 1.0 - (balance * np.sign(z * dv) + 1.0 - balance) * abs(z) / width

    for k, dv in enumerate(np.diff(v) / parts, 1):
        if dv != 0.0:
            for _ in range(parts):
                z += dv * slope(z + 0.5 * dv * slope(z, dv), dv)
        out[k] = z
    return out


def dahl(v: Array) -> Array:
    return 1.1 * v - 0.5 * element(v, 14.0, 1.0)


def bouc_wen(v: Array) -> Array:
    return 1.6 * v - 0.6 * element(v, 15.0, 0.5)


def duhem(v: Array) -> Array:
    return Duhem.coleman_hodgdon(0.06, lambda x: x, lambda x: 0.5 + 3e-3 * x).simulate(v)


def plays(v: Array) -> Array:
    return brute_output(v, THRESHOLDS, WEIGHTS, 0.0)


def creeping(v: Array) -> Array:
    h = plays(v)
    x, out = 0.0, np.zeros(len(v))
    for k in range(len(v)):
        x += (h[k] - x) * -np.expm1(-STEP / 0.4)
        out[k] = h[k] + 0.06 * x
    return out


def lagging(v: Array) -> Array:
    a = np.array(v)
    for k in range(1, len(v)):
        a[k] = a[k - 1] + (v[k] - a[k - 1]) * -np.expm1(-STEP / 0.01)
    return plays(a)


def drifting(v: Array) -> Array:
    return plays(v) + 0.5 * np.arange(len(v)) * STEP


def records(stage: Stage, speeds: tuple[float, ...], seed: int = 3) -> list[Record]:
    """Four records of moves between random turns, each move at one of the speeds, in drive units per second."""
    rng, made = np.random.default_rng(seed), []
    for number in range(4):
        turns = [0.0, 100.0, 0.0, 100.0, *rng.uniform(0.0, 100.0, 12)]
        parts = []
        for a, b in itertools.pairwise(turns):
            n = max(2, round(abs(b - a) / (rng.choice(speeds) * STEP)))
            parts.append(np.linspace(a, b, n, endpoint=False))
        v = np.concatenate(parts)
        t = np.arange(len(v)) * STEP + 20.0 * number
        y = noisy(stage(v), NOISE, number)
        made.append(Record(f"record {number}", t, v, y, sample_time=STEP))
    return made


def searched(made: list[Record]) -> tuple[Outcome, screening.Records]:
    """The refitted plays without any effect, and the records of a search."""
    ready = preparing.prepare(made[:3], made[3:], None, 0.0)
    base, start = hypothesis.structure_of(Cascade(PI(THRESHOLDS, WEIGHTS), (), (0.0, 100.0)), [], ready)
    refitted = selection.refit(base, ready.to_fit, start)
    return Outcome(refitted, refitted, (), ()), screening.Records.of(ready.to_fit, ready.held, refitted, NOISE)


@pytest.mark.parametrize("stage", [dahl, bouc_wen])
@pytest.mark.parametrize("speeds", [(800.0,), (400.0, 1600.0)])
def test_plants_that_are_no_play_sum(stage: Stage, speeds: tuple[float, ...]) -> None:
    found = forgetting.forgets(*searched(records(stage, speeds)))
    assert found is not None
    assert found.after < 1.3 * NOISE < found.before
    assert found.shows_speed == (len(speeds) > 1)
    # the same loop as in `docs/plants.md`, on the plant itself
    fine = [np.linspace(a, b, 400) for a, b in itertools.pairwise((0.0, 100.0, 0.0, 60.0, 50.0, 60.0))]
    y = stage(np.concatenate(fine))
    top, bottom, end = (y[400 * k - 1] for k in (3, 4, 5))
    assert found.open == pytest.approx(abs(end - top) / (top - bottom), rel=0.15)


@pytest.mark.parametrize("stage", [plays, creeping, lagging, drifting])
def test_play_sums_with_what_depends_on_time_are_play_sums(stage: Stage) -> None:
    """At several speeds, the distance that the drive travels cannot stand in for time."""
    assert forgetting.forgets(*searched(records(stage, (400.0, 1600.0)))) is None


def test_moves_of_equal_length_at_two_speeds() -> None:
    slow, fast = records(plays, (100.0,))[:1], records(plays, (400.0,))[:1]
    ready = preparing.prepare(slow, slow, None, 0.0)
    assert not signals.shows_speed(ready.to_fit)
    ready = preparing.prepare(slow, fast, None, 0.0)
    assert signals.shows_speed([*ready.to_fit, *ready.held])


def diagnosed(stage: Stage, speed: float) -> Diagnosis:
    made = records(stage, (speed,))
    return hystgen.diagnose(hystgen.identify(made[:3], holdout=made[3:], model="pi"), made[:3], holdout=made[3:])


def test_at_one_speed_no_name_takes_its_place() -> None:
    found = diagnosed(dahl, 800.0)
    assert found.content["effects"] == []
    first = found.content["unexplained"][0]
    assert first["kind"] == "not_a_play_sum"
    assert first["in_place_of"]
    assert found.sentence().startswith("The hysteresis is not a play sum: minor loops stay open")
    assert any("docs/plants.md" in text for text in found.content["advice"])
    assert found.parameters.model.effects == ()
    refused = [each["refused"] for each in found.content["ranking"][0] if each["name"] in first["in_place_of"]]
    assert all(refused)


@pytest.mark.parametrize(("stage", "shape", "tilt"), [(dahl, "dahl", 0.0), (duhem, "duhem", 3e-3 / -0.5)])
def test_elements_are_named_with_a_tilt_where_there_is_one(stage: Stage, shape: str, tilt: float) -> None:
    made = records(stage, (400.0, 1600.0))
    start = hystgen.identify(made[:3], holdout=made[3:], model="pi")
    (found,) = hystgen.diagnose(start, made[:3], holdout=made[3:]).parameters.model.effects
    assert found.shape == shape
    assert found.leans[0] == pytest.approx(tilt, rel=0.01)


@pytest.mark.parametrize(("stage", "name"), [(creeping, "creep"), (lagging, "lag")])
def test_at_one_speed_right_names_stand(stage: Stage, name: str) -> None:
    found = diagnosed(stage, 800.0)
    assert [each["name"] for each in found.content["effects"]] == [name]
    assert all(each["kind"] != "not_a_play_sum" for each in found.content["unexplained"])


# The inverse of each model in front of the other -------------------------------------------------------------


def crossed(time_constant: float) -> harm.Wild | None:
    """Verdict on a lag of this time constant, given the gain of the right one, on a stage that lags by 10 ms."""
    made = records(lagging, (400.0, 1600.0))
    ready = preparing.prepare(made[:3], made[3:], None, 0.0)
    gain = float(np.std(lagging(np.asarray(made[3].v)) - plays(np.asarray(made[3].v))))
    extended, plain = (Model(parse_parameters(f"{MODEL}{effects}}}\n")) for effects in (
        f", effects: [{{name: lag, time_constant: {time_constant}}}]", ""
    ))  # fmt: skip
    return harm.wild(extended, plain, ready.held, gain, NOISE)


MODEL = (
    "hystgen: 1\nname: made\ninput_range: [0, 100]\nsample_time: 0.001\n"
    "model: {pi: {thresholds: [0, 3, 8, 16, 30], weights: [1, 0.1, 0.15, 0.1, 0.1]}"
)


def test_an_inverse_that_does_more_than_records_bear_out() -> None:
    found = crossed(0.1)
    assert found is not None
    assert found.moves == pytest.approx(10.0 * found.gain, rel=0.35)  # a lead of ten times the lag
    assert crossed(0.01) is None
