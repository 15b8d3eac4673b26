"""The inverse in Python limits the drive as the C does, keeps the memory of the limited drive, and warns."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

import hystgen
from hystgen import simulation
from hystgen.cascade import PI, Cascade
from hystgen.compensator.chain.run import with_status
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.plays import slots
from hystgen.records import Record

Array = NDArray[np.float64]
R, P = np.array([0.0, 5.0, 20.0]), np.array([120.0, 20.0, 30.0])
OFFSET, HIGH, PERIOD, TAU, SHARE = 7.0, 100.0, 1e-3, 0.05, 0.02
PLAIN = f"""hystgen: 1
name: stage
sample_time: {PERIOD}
input_range: [0, {HIGH}]
model:
  pi: {{thresholds: {R.tolist()}, weights: {P.tolist()}}}
  output_offset: {OFFSET}
"""
CREEP = f"{PLAIN}  effects: [{{name: creep, time_constants: [{TAU}], weights: [{SHARE}]}}]\n"


def plays(v: Array) -> Array:
    """Play sum (1), sample by sample, from a virgin memory."""
    s, y = np.zeros(len(R)), []
    for x in v:
        s = np.maximum(x - R, np.minimum(x + R, s))
        y.append(float(P @ s))
    return np.array(y)


def crept(v: Array) -> Array:
    """The plays with creep of one spring and damper, at rest at the first sample; scipy too interpolates linearly."""
    h = plays(v)
    late = signal.lsim(([SHARE], [TAU, 1.0]), h - h[0], PERIOD * np.arange(len(h)))[1]
    return np.asarray(h + late + SHARE * h[0] + OFFSET)


ACTUATORS: dict[str, tuple[str, Callable[[Array], Array]]] = {
    "plain": (PLAIN, lambda v: plays(v) + OFFSET), "creep": (CREEP, crept)
}  # fmt: skip


def model(text: str) -> Model:
    return Model(parse_parameters(text))


def reference(samples: int = 300) -> Array:
    """A reference that covers the range and goes far beyond both ends."""
    turns = np.random.default_rng(5).uniform(-0.4, 1.4, 21) * float(P.sum()) * HIGH
    return np.interp(np.linspace(0.0, 20.0, samples), np.arange(21.0), turns)


def told(run: Callable[[], Array]) -> tuple[Array, dict[str, int]]:
    """The samples of a run, and how many of them warnings report, by what was done to them."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = run()
    counts = {}
    for each in caught:
        assert each.category is hystgen.SampleWarning, str(each.message)
        assert each.filename == __file__, "it names the caller's line"
        text = str(each.message)
        match = re.match(r"(\d+) of (\d+) (references|drives|samples) .*?(extrapolated|limited|held)", text)
        assert match is not None, text
        assert int(match[2]) == len(found)
        counts[f"{match[3]} {match[4]}"] = counts.get(f"{match[3]} {match[4]}", 0) + int(match[1])
    return found, counts


@pytest.mark.parametrize("name", ACTUATORS)
def test_the_drive_stays_in_range_and_is_exact_wherever_it_is_not_limited(name: str) -> None:
    text, actuator = ACTUATORS[name]
    u = reference()
    v, counts = told(lambda: model(text).inverse().simulate(u))
    assert np.min(v) == 0.0
    assert np.max(v) == HIGH
    off = np.abs(actuator(v) - u) > 1e-9 * float(P.sum()) * HIGH
    assert 20 < np.count_nonzero(off) < 250
    assert set(counts) <= {"references limited", "drives limited"}
    assert sum(counts.values()) == np.count_nonzero(off)
    top = float(P @ (HIGH - R)) * (1.0 + SHARE * (name == "creep")) + OFFSET  # settled at the largest drive
    ends = (v == 0.0) | (v == HIGH) | (u > top) | (u < OFFSET)
    assert np.all(ends[off]), "where it misses, it is at an end, or the reference is beyond one"
    assert off[:-1][~off[1:]].any(), "the sample behind a limited one is exact again"


@pytest.mark.parametrize("name", ACTUATORS)
def test_it_limits_as_the_c_does(name: str) -> None:
    """It agrees with the bit-exact reference in float64, which has the bits of the C."""
    one = model(ACTUATORS[name][0]).inverse()
    u = reference()
    u[[50, 51, 200]] = np.nan, np.inf, -np.inf
    v, counts = told(lambda: one.simulate(u))
    bits, those_of_c = told(lambda: one.simulate(u, "float64"))
    assert np.max(np.abs(v - bits)) < 1e-9 * HIGH
    assert counts["samples held"] == those_of_c["samples held"] == 3
    assert v[50] == v[51] == v[49]
    assert v[200] == v[199]
    assert {"references limited", "drives limited"} & set(those_of_c)


@pytest.mark.parametrize("arithmetic", ["float32", "q15"])
def test_every_arithmetic_says_what_it_limits(arithmetic: str) -> None:
    drive, output = (0.005, 0.6) if arithmetic == "q15" else (1.0, 1.0)
    one = model(PLAIN + "emit: {drive_lsb: 0.005, output_lsb: 0.6}\n" * (arithmetic == "q15")).inverse()
    u = np.clip(np.rint(reference() / output), -32768, 32767) if arithmetic == "q15" else reference()
    v, counts = told(lambda: one.simulate(u, arithmetic))
    off = np.abs(plays(v * drive) + OFFSET - u * output) > 0.01 * float(P.sum()) * HIGH
    assert max(counts.values()) <= np.count_nonzero(off) + 5
    assert sum(counts.values()) >= np.count_nonzero(off)
    if arithmetic == "float32":
        u[7] = np.nan
        v, counts = told(lambda: one.simulate(u, arithmetic))
        assert (counts["samples held"], v[7]) == (1, v[6])


@pytest.mark.parametrize("name", ACTUATORS)
def test_nothing_is_said_where_the_ends_are_only_touched(name: str) -> None:
    """Outputs of drives that go just to both ends can be reached, whatever rounding does to them."""
    text, actuator = ACTUATORS[name]
    v = np.concatenate([[0.0], np.clip(reference() / float(P.sum()), 0.0, HIGH)])
    again, counts = told(lambda: model(text).inverse().simulate(actuator(v)))
    assert counts == {}
    assert np.max(np.abs(again - v)) < 1e-10 * HIGH


def test_without_a_limit_on_demand() -> None:
    u = reference()
    v, counts = told(lambda: model(PLAIN).inverse().simulate(u, clamp=False))
    assert counts == {}
    assert np.max(v) > 1.2 * HIGH
    assert np.max(np.abs(plays(v) + OFFSET - u)) < 1e-9 * float(P.sum()) * HIGH


@pytest.mark.parametrize("name", ACTUATORS)
def test_the_forward_model_tells_of_drives_outside_and_of_none(name: str) -> None:
    text, actuator = ACTUATORS[name]
    v = reference() / float(P.sum())
    v[[0, 40]] = np.nan
    held = v.copy()
    held[[0, 40]] = 0.0, v[39]
    y, counts = told(lambda: model(text).simulate(v))
    assert np.max(np.abs(y - actuator(held))) < 1e-9 * float(np.max(np.abs(y)))
    outside = np.count_nonzero((held < 0.0) | (held > HIGH)) - int(not 0.0 <= v[39] <= HIGH)
    assert counts == {"samples extrapolated": outside, "samples held": 2}
    _, counts = told(lambda: model(text).simulate(v, clamp=True))
    assert counts == {"samples limited": outside, "samples held": 2}


def test_a_pure_cascade_keeps_its_range_and_a_play_sum_has_none() -> None:
    u = reference()
    pi = PI(R.tolist(), P.tolist())
    v, counts = told(lambda: Cascade(pi, (), OFFSET, (0.0, HIGH)).inverse().simulate(u))
    assert (np.min(v), np.max(v)) == (0.0, HIGH)
    assert set(counts) <= {"references limited", "drives limited"}
    assert counts
    free, counts = told(lambda: Cascade(pi).inverse().simulate(u))
    assert counts == {}
    assert np.max(np.abs(plays(free) - u)) < 1e-9 * float(np.max(u))
    assert told(lambda: pi.simulate(free))[1] == {}


@pytest.mark.parametrize(
    "effect",
    ["name: slew_limit, rate: 5000", f"name: creep, time_constants: [{TAU}], weights: [{SHARE}]",
     "name: rate_dependence, shape: relaxation, time_constant: 0.005"],
)  # fmt: skip
def test_a_reference_out_of_range_is_limited_at_once_as_in_the_c(effect: str) -> None:
    """Even while a slew limit keeps the drive far from its end; those told of are those that the C marks, and the
    drives are those of the C."""
    one = model(f"{PLAIN}  effects: [{{{effect}}}]\n")
    u = np.concatenate([np.zeros(3), np.full(4, 1e5), np.full(200, OFFSET + 2000.0), np.full(3, -1e5)])
    v, counts = told(lambda: one.inverse().simulate(u))
    compiled = one.compiled("float64", one.engine(arithmetic="float64"))
    bits, status = with_status(compiled, one.run(u), True)
    assert counts["references limited"] == np.count_nonzero(status & slots.INPUT_CLAMPED)
    assert counts["references limited"] >= 7
    top = float(P @ (HIGH - R)) * (1.0 + SHARE * ("creep" in effect)) + OFFSET
    by_hand, _ = told(lambda: one.inverse().simulate(np.clip(u, OFFSET, top)))
    assert v == pytest.approx(by_hand, abs=1e-9 * HIGH)
    if "relaxation" not in effect:  # the C moves plays that relax in steps
        assert np.max(np.abs(v - bits)) < 1e-9 * HIGH
    record = Record("u.csv", one.run(u).t, u, extra={"u": u})
    ((recorded, said),) = simulation.simulate_records(one, [record], "inverse")
    assert np.array_equal(recorded, v)
    assert said[0].startswith(f"u.csv: {counts['references limited']} of {len(u)} references lie outside")
    free, counts = told(lambda: one.inverse().simulate(u, clamp=False))
    assert counts == {}
    if "slew" in effect:
        assert np.max(v[:7]) < 0.5 * HIGH, "none of these drives is at its end"
    else:
        assert np.max(free) > 5.0 * HIGH
