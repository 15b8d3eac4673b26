"""Every effect against closed forms, ODE solvers, scipy.signal and plain loops that share nothing with it."""

from __future__ import annotations

import itertools
import math
import os
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from decimal import Context, Decimal, localcontext
from fractions import Fraction
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import integrate, interpolate, signal, special

import hystgen
from hystgen import effects
from hystgen.basics import parallel
from hystgen.basics.problems import EffectsError
from hystgen.cascade import PI, Cascade
from hystgen.chain.chain import VISIT, Chain, in_order, join
from hystgen.effects import About, Effect, Place, Run
from hystgen.effects.base import Compensated
from hystgen.effects.rate_dependence import model as rate_dependence
from hystgen.front.dead_zone.model import DeadZone
from hystgen.front.tanh.model import TanhEnvelope

Array = NDArray[np.float64]

THRESHOLDS = np.array([0.0, 0.45, 0.9, 1.35])
WEIGHTS = np.array([0.72, 0.6, 0.48, 0.36])
CASCADE = Cascade(PI(THRESHOLDS.tolist(), WEIGHTS.tolist()), (), 0.3, (-4.0, 4.0))


def make(name: str, **keys: Any) -> Effect:
    """An effect built from its keys in a parameter file."""
    shapes = effects.shapes(name)
    selector = shapes[0].selector
    known = {shape.model_fields[selector].annotation.__args__[0]: shape for shape in shapes} if selector in keys else {}  # type: ignore[union-attr]
    return known.get(keys.get(selector), shapes[0]).model_validate({"name": name, **keys})


EVERY = [
    make("creep", time_constants=(0.02, 0.3), weights=(0.05, 0.1)),
    make("creep", shape="logarithmic", per_decade=0.03),
    make("rate_dependence", betas=(0.01, 0.02, 0.03)),
    make("rate_dependence", shape="relaxation", time_constant=0.01),
    make("rate_dependence", shape="relaxation", time_constant=0.01, exponent=1.7),
    make("resonance", frequency=40.0, damping=0.05),
    make("resonance", frequency=40.0, damping=2.0),
    make("lag", time_constant=0.01),
    make("delay", time=0.0137),
    make("slew_limit", rate=30.0, falling_rate=20.0),
    make("saturation", level=2.0),
    make("saturation", shape="hard", level=2.0),
    make("thermal", gain_per_degree=0.01, offset_per_degree=0.02, reference=21.0),
    make("thermal", source="self_heating", gain_per_degree=0.01, time_constant=2.0, heating=0.2),
    make("thermal", source="hysteresis", gain_per_degree=0.01, time_constant=2.0, heating=0.2, reach=1.0),
    make("influence", column="load", offset=0.02, gain=0.01, reference=1.0, time_constant=0.1, curve=(0.01, -0.002),
         plays={"thresholds": (0.0, 0.5), "weights": (0.01, 0.02)}),
    make("drift", rate=0.5),
    make("drift", shape="curved", rate=0.5, change=-0.1),
    make("ageing", loss=0.1, travel=20.0),
    make("ageing", shape="exponential", loss=0.1, travel=20.0),
    make("ageing", shape="exponentials", losses=(0.1, 0.05), travels=(20.0, 3.0)),
    make("sensor_nonlinearity", coefficients=(0.05, -0.02), scale=3.0),
    make("sensor_nonlinearity", shape="curve", knots=(-3.0, -1.0, 0.5, 4.0), values=(-3.0, -1.5, 1.0, 3.0)),
    make("noncongruent", coefficients=((0.1,), (0.05, 0.02), (-0.1,))),
    make("noncongruent", shape="centre", amplitude=0.4, centre=0.5, width=1.2),
    make("saturation", shape="stops", lower=-0.5, upper=2.0, give=0.2),
    make("saturation", level=2.0, centre=-0.7),
    make("resonance", shape="part", frequency=40.0, damping=0.05, share=0.3),
    make("slew_limit", shape="sudden", rate=30.0, falling_rate=20.0),
    make("bouc_wen", weights=(-0.2, 0.1), widths=(0.7, 2.0), exponent=1.6, balance=1.4),
    make("bouc_wen", shape="dahl", weights=(-0.3,), widths=(0.6,)),
    make("bouc_wen", shape="duhem", weights=(-0.3,), widths=(0.6,), tilts=(-0.1,)),
]


def label(effect: Effect) -> str:
    return f"{effect.name}-{getattr(effect, effect.selector, '')}"


each = pytest.mark.parametrize("effect", EVERY, ids=label)


def drive(n: int = 2000, seed: int = 0) -> tuple[Array, Array]:
    """A smooth random drive at even times over one second."""
    rng = np.random.default_rng(seed)
    t = np.arange(n) / n
    parts = [rng.normal() * np.sin(2 * np.pi * (f * t + rng.uniform())) for f in (1, 2.3, 5.1, 11.7)]
    return t, 1.2 * np.sum(parts, axis=0)


def uneven(n: int = 1500, seed: int = 1) -> tuple[Array, Array]:
    """Random corners of a broken line, at random times over one second."""
    rng = np.random.default_rng(seed)
    t = np.concatenate([[0.0], np.sort(rng.uniform(0, 1, n - 1))])
    return t, np.cumsum(rng.normal(size=n)) * 0.15


def rounding(steps: int, size: float) -> float:
    """Bound on the roundings of a linear filter that remembers this number of steps, for numbers up to `size`.

    A step rounds its states and the output 12 times at most, each time by half the spacing of numbers at `size`, and a
    stable filter does not amplify earlier errors (Higham, Accuracy and Stability of Numerical Algorithms, 2002,
    section 3.1).
    """
    return 12 * steps * 0.5 * float(np.finfo(float).eps) * size


def record(t: Array, v: Array) -> Run:
    return Run(t, v, {"temperature": 20.0 + 3.0 * np.sin(t), "load": 1.5 * np.cos(9.0 * t)})


def of(effect: Effect, t: Array, v: Array) -> Array:
    return Chain(CASCADE, [effect]).simulate([record(t, v)])[0]


# What holds for every effect ------------------------------------------------------------------------------


def test_the_catalogue_is_complete() -> None:
    assert {effect.name for effect in EVERY} == set(effects.CATALOGUE)
    assert {type(effect) for effect in EVERY} == {shape for name in effects.CATALOGUE for shape in effects.shapes(name)}
    for effect in EVERY:
        for key, field in type(effect).model_fields.items():
            assert field.description, (effect.name, key)
        assert effect.compensation
        assert effect.compensated in set(get_args(Compensated)) - {"not known"}
        assert (type(effect).__doc__ or "").strip()


@pytest.mark.usefixtures("brief")
def test_without_effects_the_chain_is_the_model() -> None:
    t, v = drive()
    fronts = (DeadZone([-1, 0, 0.4], [0.3, 1.2, -0.2]), TanhEnvelope((6, 0.4, 0.1, 0.2), (6, 0.4, 0.1, 0.5)))
    for stages in ((), fronts[:1], fronts[1:], fronts):
        cascade = Cascade(PI(THRESHOLDS.tolist(), WEIGHTS.tolist(), [0, 0.3, 0.1, 0.4]), stages, 0.3, (-4.0, 4.0))
        for x in (v, -v, np.array([1.0, 1.0, 1.0, 0.5, 0.5])):
            (y,) = Chain(cascade, []).simulate([Run(t[: len(x)], x)])
            assert np.max(np.abs(y - cascade.simulate(x))) < 1e-13


NOTHING = [
    make("creep", time_constants=(0.1,), weights=(0.0,)),
    make("creep", shape="logarithmic", per_decade=0.0),
    make("rate_dependence", betas=(0.0, 0.0, 0.0)),
    make("rate_dependence", shape="relaxation", time_constant=0.0, exponent=2.0),
    make("lag", time_constant=0.0),
    make("delay", time=0.0),
    make("slew_limit", rate=1e30),
    make("saturation", level=1e30),
    make("saturation", shape="hard", level=1e30),
    make("saturation", shape="stops", lower=-1e30, upper=1e30),
    make("saturation", shape="stops", lower=-0.5, upper=0.5, give=1.0),
    make("thermal"),
    make("thermal", source="self_heating", gain_per_degree=0.1, time_constant=1.0, heating=0.0),
    make("thermal", source="hysteresis", gain_per_degree=0.1, time_constant=1.0, heating=0.0, reach=1.0),
    make("drift", rate=0.0),
    make("drift", shape="curved", rate=0.0, change=0.0),
    make("ageing", loss=0.0, travel=1.0),
    make("ageing", loss=0.0, travel=5e-324),
    make("ageing", shape="exponential", loss=0.0, travel=1.0),
    make("ageing", shape="exponentials", losses=(0.0, 0.0), travels=(1.0, 2.0)),
    make("sensor_nonlinearity", coefficients=(0.0, 0.0), scale=1.0),
    make("noncongruent", coefficients=((0.0,), (0.0,), (0.0,))),
    make("noncongruent", shape="centre", amplitude=0.0, centre=1.0, width=1.0),
    make("bouc_wen", weights=(0.0, 0.0), widths=(0.7, 5e-324), exponent=1.6, balance=1.4),
    make("bouc_wen", shape="dahl", weights=(0.0,), widths=(1e30,)),
    make("bouc_wen", shape="duhem", weights=(0.0,), widths=(2.0,), tilts=(0.1,)),
]


@pytest.mark.parametrize("effect", NOTHING, ids=label)
def test_no_strength_changes_nothing(effect: Effect) -> None:
    for t, v in (drive(), uneven()):
        assert np.max(np.abs(of(effect, t, v) - CASCADE.simulate(v))) < 1e-13


@each
def test_strength_changes_something(effect: Effect) -> None:
    t, v = drive()
    assert np.max(np.abs(of(effect, t, v) - CASCADE.simulate(v))) > 1e-3


@each
def test_a_record_in_pieces_is_the_record(effect: Effect) -> None:
    for t, v in (drive(), uneven()):
        chain = Chain(CASCADE, [effect])
        whole = record(t, v)
        cuts = (0, 317, 318, 900, len(t))
        parts = [
            Run(t[a:b], v[a:b], {name: column[a:b] for name, column in whole.extra.items()})
            for a, b in itertools.pairwise(cuts)
        ]
        assert np.array_equal(np.concatenate(chain.simulate(parts)), chain.simulate([whole])[0])


@each
def test_finer_samples_give_the_same(effect: Effect) -> None:
    """Samples at random times give the same as a fine even grid that contains them."""
    rng = np.random.default_rng(4)
    fine, dense = drive(120_001)
    kept = np.unique(np.concatenate([[0, len(fine) - 1], rng.integers(0, len(fine), 30_000)]))
    here, there = of(effect, fine[kept], dense[kept]), of(effect, fine, dense)[kept]
    first_order = isinstance(effect, type(EVERY[2]))  # in the step: the rate is that of the sample before
    assert np.max(np.abs(here - there)) < (5e-3 if first_order else 3e-4) * np.ptp(there)


STRAIGHT = [e for e in EVERY if e.name in ("slew_limit", "lag", "creep", "resonance")]
STRAIGHT = [e for e in STRAIGHT if label(e) != "slew_limit-sudden"]
"""Effects that take the drive as straight between samples at any times."""


@pytest.mark.parametrize("effect", STRAIGHT, ids=label)
def test_filters_are_exact_between_corners(effect: Effect) -> None:
    """On a broken line, further samples between its corners change nothing."""
    rng = np.random.default_rng(4)
    t, v = uneven(400)
    fine = np.sort(np.concatenate([t, rng.uniform(0, t[-1], 5000)]))
    dense = np.interp(fine, t, v)
    ask = effect.drive if effect.place is Place.DRIVE else effect.filtered
    assert np.max(np.abs(ask(v, Run(t, v)) - ask(dense, Run(fine, dense))[np.searchsorted(fine, t)])) < 1e-10


@pytest.mark.parametrize("effect", [e for e in EVERY if e.place is Place.LINEAR], ids=label)
def test_linear_effects_are_linear_and_keep_rows_apart(effect: Effect) -> None:
    t, h = uneven()
    other = np.sin(7 * t)
    run = record(t, h)
    rows = np.stack([h, other, 2.0 * h - 3.0 * other, h**2, other**2, h * other])
    found = effect.filtered(rows, run)
    # Resonances fade within 120 steps; creep remembers all 1500, but in states that round 5 times and add only 0.2
    size = float(np.max(2.0 * np.abs(found[0]) + 3.0 * np.abs(found[1]) + np.abs(found[2])))
    assert np.max(np.abs(found[2] - (2.0 * found[0] - 3.0 * found[1]))) < rounding(150, size)
    for alone, beside in zip(rows, found, strict=True):
        assert np.array_equal(beside, effect.filtered(alone, run))
    constant = effect.filtered(np.full(50, 2.0), Run(t[:50], t[:50]))
    assert np.max(np.abs(constant - constant[0])) <= rounding(50, float(constant[0])), "at rest at the first sample"


@each
def test_candidates_build_effects_over_all_their_bounds(effect: Effect) -> None:
    t, v = drive(400)
    speed, travel = np.max(np.abs(np.diff(v) / np.diff(t))), np.sum(np.abs(np.diff(v)))
    columns, ends = frozenset({"temperature", "load"}), {"load": (-1.5, 1.5)}
    about = About(
        (-4.0, 4.0), 8.0, t[1], 1.0, 1.0, speed, travel, tuple(THRESHOLDS), columns, ends, output=(-5.0, 3.0)
    )
    rng = np.random.default_rng(5)
    found = type(effect).candidates(about)
    assert found
    for candidate in found:
        n = len(candidate.low)
        assert candidate.low.shape == candidate.high.shape == candidate.start.shape == (n,)
        assert np.all(candidate.low < candidate.high)
        assert np.all((candidate.low <= candidate.start) & (candidate.start <= candidate.high))
        tried = [candidate.low, candidate.high, candidate.start]
        tried += [candidate.low + (candidate.high - candidate.low) * rng.uniform(size=n) for _ in range(8)]
        for x in tried:
            built = candidate.build(x)
            assert isinstance(built, type(effect))
            type(built).model_validate(built.model_dump())
            y = of(built, t, v)
            assert np.all(np.isfinite(y))
            near = of(candidate.build(x + 1e-9 * (candidate.high - x)), t, v)
            assert np.max(np.abs(near - y)) < 1e-4 * (1.0 + np.max(np.abs(y))), "continuous"
        if candidate.none is not None:
            nothing = of(candidate.build(candidate.none), t, v)
            tolerance = 2e-6 if effect.name == "saturation" else 1e-12
            assert np.max(np.abs(nothing - CASCADE.simulate(v))) < tolerance


@pytest.mark.parametrize("session", [0.05, 0.15, 8.0, 1e6])
def test_a_start_from_a_simpler_shape_lies_within_bounds(session: float) -> None:
    """This holds for sessions of any length, and wherever the search for the simpler shape has ended."""
    columns = frozenset({"temperature"})
    about = About(
        (-4.0, 4.0), 8.0, 1e-3, session, session, 50.0, 30.0, tuple(THRESHOLDS), columns, output=(-5.0, 3.0)
    )
    found = {each.label: each for kind in dict.fromkeys(map(type, EVERY)) for each in kind.candidates(about)}
    grown = [each for each in found.values() if each.grown]
    assert len(grown) >= 8
    rng = np.random.default_rng(6)
    for candidate in grown:
        simple = found[candidate.beyond]
        shares = [0.0, 1.0, *rng.uniform(size=8)]
        for x in (simple.low + (simple.high - simple.low) * share for share in shares):
            start = candidate.grown(x)  # type: ignore[misc]
            assert np.all((candidate.low <= start) & (start <= candidate.high)), candidate.label


def test_what_no_record_shows_ringing_is_no_resonance() -> None:
    """With less than three samples per period, or without a peak, records only show a delay or a lag."""
    about = About((0.0, 1.0), 10.0, 1e-3, 1.0, 1.0, 5.0, 3.0, (0.0,), ringing=(200.0, 450.0))
    for candidate in effects.shapes("resonance")[0].candidates(about):
        fastest = candidate.build(candidate.high)
        assert isinstance(fastest, effects.shapes("resonance")[0])
        assert fastest.frequency * about.sample_time <= 1 / 3 + 1e-12
        assert fastest.damping < math.sqrt(0.5)


@pytest.mark.parametrize(("slope", "end"), [(-1.0, 0.0), (1.0, 1.0)])
@pytest.mark.parametrize("rounding", [-1e-13, 0.0, 1e-13])
def test_an_even_density_has_its_bump_at_the_higher_end(slope: float, end: float, rounding: float) -> None:
    """The density is as far above its middle at one end as below it at the other; rounding does not decide the end."""
    about = About((0.0, 90.0), 10.0, 1e-3, 1.0, 1.0, 5.0, 3.0, (0.0, 10.0))
    (candidate,) = effects.shapes("noncongruent")[1].candidates(about)
    assert candidate.grown is not None
    amplitude, place, _ = candidate.grown(np.array([slope, rounding]))
    assert place == end
    assert amplitude > 0.0


def test_candidates_without_plays_or_temperature_are_left_out() -> None:
    about = About((0.0, 1.0), 1.0, 1e-3, 1.0, 1.0, 5.0, 3.0, (0.0,))
    for name in ("rate_dependence", "noncongruent"):
        assert not any(shape.candidates(about) for shape in effects.shapes(name))
    assert not effects.shapes("thermal")[0].candidates(about)


positive = st.floats(0, 1e30, exclude_min=True)
times = st.floats(0, 1e30)
share = st.floats(-1e30, 1e30)
VALID: dict[str, st.SearchStrategy[dict[str, Any]]] = {
    "creep": st.one_of(
        st.builds(lambda a, b: {"time_constants": (a,), "weights": (b,)}, positive, times),
        st.builds(
            lambda g, t0, a, b: {"shape": "logarithmic", "per_decade": g, "t0": t0, "t_min": a, "t_max": a * b},
            times, positive, st.floats(1e-15, 1e15), st.floats(1.001, 1e12),
        ),
    ),
    "rate_dependence": st.one_of(
        st.builds(lambda b: {"betas": (b, 0.0, b)}, times),
        st.builds(
            lambda tau, m: {"shape": "relaxation", "time_constant": tau, "exponent": m},
            times, st.floats(0.1, 10.0),
        ),
    ),
    "influence": st.builds(
        lambda o, g, tau, c, r: {
            "column": "load", "offset": o, "gain": g, "time_constant": tau, "curve": (c,),
            "plays": {"thresholds": (r,), "weights": (o,)},
        },
        share, share, times, share, positive,
    ),
    "resonance": st.builds(lambda f, z: {"frequency": f, "damping": z}, positive, st.floats(0, 10, exclude_min=True))
    | st.builds(lambda f, x: {"shape": "part", "frequency": f, "damping": x, "share": x}, positive,
                st.floats(0, 1, exclude_min=True, exclude_max=True)),
    "lag": st.builds(lambda tau: {"time_constant": tau}, times),
    "delay": st.builds(lambda time: {"time": time}, times),
    "slew_limit": st.builds(lambda a, b: {"rate": a, "falling_rate": b}, positive, positive),
    "saturation": st.builds(lambda s, x: {"shape": s, "level": x}, st.sampled_from(["tanh", "hard"]), positive)
    | st.builds(
        lambda a, b, give: {"shape": "stops", "lower": -a, "upper": b, "give": give},
        positive, positive, st.floats(0, 1),
    ),
    "thermal": st.one_of(
        st.builds(lambda a, b, c: {"gain_per_degree": a, "offset_per_degree": b, "reference": c}, share, share, share),
        st.builds(
            lambda a, b, c: {"source": "self_heating", "gain_per_degree": a, "time_constant": b, "heating": c},
            share, positive, times,
        ),
        st.builds(
            lambda a, b, c, r: {
                "source": "hysteresis", "gain_per_degree": a, "time_constant": b, "heating": c, "reach": r,
            },
            share, positive, times, positive,
        ),
    ),
    "drift": st.one_of(
        st.builds(lambda rate: {"rate": rate}, share),
        st.builds(lambda rate, change: {"shape": "curved", "rate": rate, "change": change}, share, share),
    ),
    "ageing": st.builds(
        lambda s, a, b: {"shape": s, "loss": a, "travel": b},
        st.sampled_from(["logarithmic", "exponential"]), share, positive,
    )
    | st.builds(
        lambda a, b, d, e: {"shape": "exponentials", "losses": (a, b), "travels": (d, e)},
        share, share, positive, positive,
    ),
    "sensor_nonlinearity": st.builds(
        lambda a, b, s: {"coefficients": (a, b), "scale": s}, share, share, st.floats(1e-30, 1e30)
    )
    | st.builds(
        lambda x, y: {"shape": "curve", "knots": tuple(sorted(x)), "values": tuple(sorted(y))},
        st.sets(st.integers(-1000, 1000), min_size=3, max_size=3).map(lambda found: [float(k) for k in found]),
        st.sets(st.integers(-1000, 1000), min_size=3, max_size=3).map(lambda found: [float(k) for k in found]),
    ),
    "noncongruent": st.one_of(
        st.builds(lambda a, b: {"coefficients": ((a,), (a, b), (b,))}, share, share),
        st.builds(
            lambda a, c, w: {"shape": "centre", "amplitude": a, "centre": c, "width": w},
            st.floats(-1, 1e30, exclude_min=True), share, positive,
        ),
    ),
    "bouc_wen": st.builds(
        lambda k, d, n, b: {"weights": (k,), "widths": (d,), "exponent": n, "balance": b},
        share, positive, st.floats(1, 10), st.floats(0.5, 4),
    )
    | st.builds(
        lambda k, d, e: {"shape": "dahl", "weights": (k, k), "widths": (d, e)}, share, positive, positive
    )
    | st.builds(
        lambda k, d, t: {"shape": "duhem", "weights": (k,), "widths": (d,), "tilts": (t / d,)},
        share, positive, st.floats(-1, 1),
    ).filter(lambda keys: abs(keys["tilts"][0]) <= 1e30),
}  # fmt: skip


@pytest.mark.parametrize("name", effects.CATALOGUE)
@settings(max_examples=60)
@given(st.data())
def test_no_valid_parameters_make_nan(name: str, data: st.DataObject) -> None:
    effect = make(name, **data.draw(VALID[name]))
    steps = data.draw(st.lists(st.sampled_from([1e-9, 1e-4, 0.5, 1e6]), min_size=1, max_size=12))
    v = np.array(data.draw(st.lists(st.floats(-1e3, 1e3), min_size=len(steps) + 1, max_size=len(steps) + 1)))
    with np.errstate(all="ignore"):
        y = of(effect, np.concatenate([[0.0], np.cumsum(steps)]), v)
    assert not np.any(np.isnan(y))


# Lag, delay, slew limit -----------------------------------------------------------------------------------


def test_lag_step_and_ramp() -> None:
    tau = 0.05
    lag = make("lag", time_constant=tau)
    t = np.array([0.0, 1e-9, 0.01, 0.013, 0.05, 0.4, 3.0])
    step = lag.drive(np.where(t > 0, 1.0, 0.0), Run(t, t))
    assert np.allclose(step[1:], 1.0 - np.exp(-t[1:] / tau), atol=2e-8)
    ramp = lag.drive(3.0 * t, Run(t, t))
    assert np.allclose(ramp, 3.0 * (t - tau * (1.0 - np.exp(-t / tau))), rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("tau", [1e-5, 1e-3, 0.2, 50.0])
def test_lag_against_scipy(tau: float) -> None:
    t, v = drive()
    expected = v[0] + signal.lsim(([1.0], [tau, 1.0]), v - v[0], t)[1]
    assert np.max(np.abs(make("lag", time_constant=tau).drive(v, Run(t, v)) - expected)) < 1e-10


def test_delay_shifts_a_band_limited_signal() -> None:
    t = np.arange(4000) * 1e-3
    run = Run(t, t)
    for time in (0.0, 1e-3, 0.0125, 0.01234):
        found = make("delay", time=time).drive(np.sin(2 * np.pi * 5 * t), run)
        late = t > time + 1e-9
        assert np.max(np.abs(found[late] - np.sin(2 * np.pi * 5 * (t[late] - time)))) < (2 * np.pi * 5e-3) ** 2 / 8
    step = make("delay", time=0.0105).drive((t >= 1.0).astype(float), run)
    assert np.array_equal(step[np.abs(t - 1.0105) > 1.1e-3], (t >= 1.0105).astype(float)[np.abs(t - 1.0105) > 1.1e-3])


def test_slew_limit_against_a_loop() -> None:
    """The loop's steps are so short that it hardly matters where in a step the limited drive meets the drive."""
    t, v = uneven(300)
    up, down, parts = 12.0, 7.0, 2000
    a, expected, longest = v[0], [v[0]], 0.0
    for k in range(len(v) - 1):
        dt = (t[k + 1] - t[k]) / parts
        longest = max(longest, abs(v[k + 1] - v[k]) / parts, up * dt)
        for b in (v[k] + (v[k + 1] - v[k]) * np.arange(1, parts + 1) / parts).tolist():
            a = a + min(up * dt, b - a) if b > a else a - min(down * dt, a - b)
        expected.append(a)
    found = make("slew_limit", rate=up, falling_rate=down).drive(v, Run(t, v))
    assert np.max(np.abs(found - expected)) < 4.0 * longest
    slopes = np.diff(found) / np.diff(t)
    assert slopes.max() <= up * (1 + 1e-6)
    assert slopes.min() >= -down * (1 + 1e-6)
    assert make("slew_limit", rate=up) == make("slew_limit", rate=up, falling_rate=up)


def converted(fine: Array, per: int) -> Array:
    """Samples of a converter that averages over each sample, which is `per` fine steps long."""
    return np.asarray(fine.reshape(-1, per).mean(axis=1))


@pytest.mark.parametrize("where", [0.0, 0.2, 0.5, 0.7])
def test_sudden_edges_against_a_generator_that_steps(where: float) -> None:
    """Edges go up and down, anywhere in a sample. The limited drive arrives on time, where taking an edge as straight
    makes it early by up to a sample. Means over samples with an edge or a corner of the limited drive are right too."""
    per, rate, samples = 400, 7.0, 60
    fine = np.repeat([0.0, 1.0], (samples // 3 * per + round(where * per), 2 * samples // 3 * per - round(where * per)))
    fine -= np.where(np.arange(len(fine)) >= 40 * per + round(where * per), 0.6, 0.0)
    behind, most = np.empty_like(fine), rate / samples / per
    a = behind[0] = fine[0]
    for k in range(1, len(fine)):
        a = behind[k] = a + min(max(fine[k] - a, -most), most)
    t, v, expected = (converted(x, per) for x in ((np.arange(len(fine)) + 0.5) / per / samples, fine, behind))
    beside = np.isin(np.arange(samples), [20, 21, 40, 41])  # a converter shows a mean over the edge
    off = {
        shape: np.abs(make("slew_limit", shape=shape, rate=rate).drive(v, Run(t, v)) - expected)
        for shape in ("sudden", "straight")
    }
    assert np.max(off["sudden"]) < 4.0 * most  # the loop starts within one of its steps, the mean within two
    assert np.max(off["straight"][~beside]) > 0.4 * rate / samples


@pytest.mark.parametrize("edge", [0.0, 0.3, 1.0])
def test_edges_are_where_a_converter_takes_its_commands(edge: float) -> None:
    """The converter takes each command at a share `edge` of the step before it; outputs are those at the samples."""
    per, rate, samples = 1000, 7.0, 60
    t = np.arange(samples) / samples
    v = np.repeat([0.0, 1.0, 0.4], samples // 3)
    at = np.arange((samples - 1) * per + 1) / per  # in samples; command k acts from k - 1 + edge on
    fine = v[np.minimum(np.ceil(at - edge), samples - 1).astype(int).clip(0)]
    most = rate / samples / per
    a, expected = 0.0, []
    for k, each in enumerate(fine.tolist()):
        if k % per == 0:
            expected.append(a)
        a += min(max(each - a, -most), most)
    got = make("slew_limit", shape="sudden", rate=rate, edge=edge).drive(v, Run(t, v))
    assert np.max(np.abs(got - np.array(expected))) < 2.0 * most


def test_sudden_edges_leave_other_drives_alone() -> None:
    """Ramps, sines, corners, a single outlier and edges over three samples count as straight between samples."""
    t = np.arange(200.0)
    corners = np.interp(t, [0, 20, 50, 120, 199], [0.0, 1.0, -1.0, 2.0, 2.0])
    for v in (t, np.sin(0.9 * t), corners, np.where(t == 90, 1.0, 0.0), np.clip((t - 60.0) / 3.0, 0.0, 1.0)):
        straight = make("slew_limit", rate=0.2).drive(v, Run(t, v))
        for edge in (0.0, 0.5, 1.0):
            assert np.array_equal(make("slew_limit", shape="sudden", rate=0.2, edge=edge).drive(v, Run(t, v)), straight)


# Creep ----------------------------------------------------------------------------------------------------


def test_creep_states_against_an_ode_solver() -> None:
    tau, weights = (0.01, 0.2), (0.3, 0.5)
    t, h = uneven(300)
    states = [np.full(2, h[0])]
    for k in range(len(t) - 1):
        slope = (h[k + 1] - h[k]) / (t[k + 1] - t[k])

        def rate(s: float, x: Array, k: int = k, slope: float = slope) -> Array:
            return np.asarray((h[k] + slope * (s - t[k]) - x) / np.array(tau))

        states.append(integrate.solve_ivp(rate, t[k : k + 2], states[-1], rtol=1e-11, atol=1e-12).y[:, -1])
    expected = h + np.array(weights) @ np.array(states).T
    assert np.max(np.abs(make("creep", time_constants=tau, weights=weights).filtered(h, Run(t, h)) - expected)) < 1e-8


def test_logarithmic_creep_is_straight_over_log_t() -> None:
    g, t0 = 0.02, 0.1
    effect = make("creep", shape="logarithmic", per_decade=g, t0=t0, t_min=1e-3, t_max=1e5)
    since = np.logspace(-2, 3, 200)
    t = np.concatenate([[-1e-9, 0.0], since])
    h = np.concatenate([[0.0], np.ones(len(t) - 1)])
    y = effect.filtered(h, Run(t, h))[2:]
    middle = (since > 0.1) & (since < 101)
    slopes = np.diff(y[middle]) / np.diff(np.log10(since[middle]))
    assert np.all(np.abs(slopes / g - 1.0) < 0.015)
    assert np.max(np.abs(y[middle] - (1.0 + g * np.log10(since[middle] / t0)))) < 0.01 * g
    # The continuous spectrum has the closed form of an exponential integral
    inside = special.exp1(since / 1e5) - special.exp1(since / 1e-3) + math.log(1e8)
    at_t0 = special.exp1(t0 / 1e5) - special.exp1(t0 / 1e-3) + math.log(1e8)
    reference = 1.0 - g / math.log(10) * ((math.log(1e8) - inside) - (math.log(1e8) - at_t0)) * -1.0
    assert np.max(np.abs(y - reference)) < 0.05 * g


def test_creep_forgets_its_start_as_its_transients_do() -> None:
    effect = make("creep", time_constants=(0.05, 0.4), weights=(0.3, 0.2))
    t, h = drive()
    longer = np.concatenate([[5.0 - h[0]], h])  # an earlier sample with another start
    before = np.concatenate([[-0.3], t])
    difference = effect.filtered(longer, Run(before, longer))[1:] - effect.filtered(h, Run(t, h))
    rows = effect.transients(Run(t, h))
    share, *_ = np.linalg.lstsq(rows.T, difference, rcond=None)
    assert np.max(np.abs(difference - share @ rows)) < 1e-10
    assert np.max(np.abs(difference)) > 0.1


# Resonance ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("damping", [0.005, 0.3, 1.0, 1.0 + 1e-9, 4.0])
@pytest.mark.parametrize("frequency", [0.05, 3.0, 80.0, 4000.0])
def test_resonance_against_scipy(frequency: float, damping: float) -> None:
    t, h = drive()
    w = 2 * np.pi * frequency
    system = ([w * w], [1.0, 2 * damping * w, w * w])
    expected = h[0] + signal.lsim(system, h - h[0], t)[1]
    found = make("resonance", frequency=frequency, damping=damping).filtered(h, Run(t, h))
    assert np.max(np.abs(found - expected)) < 1e-8


@pytest.mark.parametrize("share", [0.01, 0.4, 0.99])
def test_a_part_of_a_resonance_against_scipy(share: float) -> None:
    """The mode and the rest as one transfer function, with zeros where they cancel."""
    t, h = drive()
    w, damping = 2 * np.pi * 30.0, 0.02
    poles = np.array([1.0, 2 * damping * w, w * w])
    expected = h[0] + signal.lsim((poles - share * np.array([*poles[:2], 0.0]), poles), h - h[0], t)[1]
    mode = make("resonance", shape="part", frequency=30.0, damping=damping, share=share)
    assert np.max(np.abs(mode.filtered(h, Run(t, h)) - expected)) < 1e-8


@pytest.mark.parametrize("ratio", [0.2, 1.0, 1.7])
def test_resonance_gain_and_phase(ratio: float) -> None:
    f0, zeta = 50.0, 0.05
    t = np.arange(40_000) * 5e-5
    phase = 2 * np.pi * f0 * ratio * t
    y = make("resonance", frequency=f0, damping=zeta).filtered(np.sin(phase), Run(t, t))[20_000:]
    basis = np.stack([np.sin(phase), np.cos(phase)])[:, 20_000:]
    a, b = np.linalg.lstsq(basis.T, y, rcond=None)[0]
    response = 1.0 / (1.0 - ratio**2 + 2j * zeta * ratio)
    assert abs(complex(a, b) - response) < 2e-3 * abs(response)


def test_resonance_rings_at_its_damped_frequency() -> None:
    f0, zeta = 30.0, 0.02
    t = np.arange(20_000) * 5e-5
    h = np.where(t > 0, 1.0, 0.0)
    y = make("resonance", frequency=f0, damping=zeta).filtered(h, Run(t, h))
    peak = np.argmax(y)
    root = math.sqrt(1 - zeta**2)
    assert y[peak] == pytest.approx(1 + math.exp(-math.pi * zeta / root), abs=1e-4)
    assert t[peak] == pytest.approx(0.5 / (f0 * root), rel=5e-3)
    rows = make("resonance", frequency=f0, damping=zeta).transients(Run(t, h))
    share, *_ = np.linalg.lstsq(rows[:, 1:].T, (y - h)[1:], rcond=None)
    assert np.max(np.abs(y - h - share @ rows)[1:]) < 1e-9


# Plays ----------------------------------------------------------------------------------------------------


def test_threshold_rate_against_a_loop() -> None:
    betas = (0.01, 0.0, 0.05, 0.02, 0.01, 0.0)
    t, w = uneven()
    start, thresholds = np.array([0.0, 0.2, -0.3, 0.1, 0.0, -0.1, 0.2]), np.linspace(0.0, 0.9, 7)
    found = make("rate_dependence", betas=betas).plays(w, Run(t, w), thresholds, start)
    state, expected = list(start), []
    for k in range(len(w)):
        rate = abs((w[k] - w[k - 1]) / (t[k] - t[k - 1])) if k else 0.0
        row = [w[k]]
        for i in range(1, 7):
            r = thresholds[i] + betas[i - 1] * rate
            state[i] = max(w[k] - r, min(w[k] + r, state[i]))
            row.append(state[i])
        expected.append(row)
    assert np.max(np.abs(found - np.array(expected).T)) < 1e-12


@pytest.mark.slow(one_in=3)
@pytest.mark.thorough(but_one_in=6)
@pytest.mark.parametrize(("exponent", "tolerance"), [(1.0, 1e-7), (0.4, 2e-5), (2.0, 2e-5), (3.0, 2e-5)])
@pytest.mark.parametrize("tau", [5e-3, 0.03, 1.0])
def test_relaxing_plays_against_the_ode(tau: float, exponent: float, tolerance: float) -> None:
    rng = np.random.default_rng(3)
    t = np.concatenate([[0.0], np.sort(rng.uniform(0, 1, 25))])
    w = rng.normal(size=26) * 2.0
    z = np.clip(np.zeros(4), w[0] - THRESHOLDS, w[0] + THRESHOLDS)
    scale, pieces = THRESHOLDS[-1], 3000

    def rate(x: float, z: Array) -> Array:
        gap = x - z
        beyond = np.maximum(np.abs(gap) - THRESHOLDS, 0.0)
        return np.asarray(np.sign(gap) * scale / tau * (beyond / scale) ** exponent)

    expected = [z]
    for k in range(25):  # Runge-Kutta of order 4; contacts are not located, but steps are short
        h = (t[k + 1] - t[k]) / pieces
        for part in range(pieces):
            x, y = (w[k] + (w[k + 1] - w[k]) * (part + shift) / pieces for shift in (0.0, 1.0))
            a = rate(x, z)
            b = rate((x + y) / 2, z + h / 2 * a)
            c = rate((x + y) / 2, z + h / 2 * b)
            z = z + h / 6 * (a + 2 * b + 2 * c + rate(y, z + h * c))
        expected.append(z)
    effect = make("rate_dependence", shape="relaxation", time_constant=tau, exponent=exponent)
    found = effect.plays(w, Run(t, w), THRESHOLDS, np.zeros(4))
    assert np.array_equal(found[0], w)
    assert np.max(np.abs(found - np.array(expected).T)[1:]) < tolerance * np.max(np.abs(w))


@pytest.mark.parametrize("part", range(6))
def test_any_relaxation_against_an_ode_solver(part: int) -> None:
    """Slow to stiff relaxations over straight moves, some of them fast, against a solver that is not told of plays."""
    from scipy.integrate import solve_ivp

    rng = np.random.default_rng(part)
    for _ in range(100):
        tau, m = float(10.0 ** rng.uniform(-4, 1)), float(10.0 ** rng.uniform(0, 1))
        w = np.concatenate([[0.0], np.cumsum(rng.uniform(-2.0, 2.0, 5))])
        t = np.concatenate([[0.0], np.cumsum(10.0 ** rng.uniform(-5, 0, 5))])

        def rate(now: float, z: Array, w: Array = w, t: Array = t, tau: float = tau, m: float = m) -> Array:
            gap = np.interp(now, t, w) - z
            return np.asarray(np.sign(gap) / tau * np.maximum(np.abs(gap) - 1.0, 0.0) ** m)

        z, expected = np.zeros(1), [0.0]
        for k in range(5):
            z = solve_ivp(rate, (t[k], t[k + 1]), z, method="LSODA", rtol=1e-10, atol=1e-11).y[:, -1]
            expected.append(float(z[0]))
        effect = make("rate_dependence", shape="relaxation", time_constant=tau, exponent=m)
        found = effect.plays(w, Run(t, w), np.array([0.0, 1.0]), np.zeros(2))[1]
        assert np.max(np.abs(found - expected)) < 1e-5, (tau, m, w)


def test_relaxing_plays_that_threads_share_are_those_computed_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    t = np.arange(3000) * 1e-3
    w, thresholds = 3.0 * np.sin(40.0 * t) * np.exp(-t), np.arange(12) / 10.0
    in_threads, shared = parallel.in_threads, []

    def seen(work: Callable[[slice], None], parts: Sequence[slice]) -> None:
        shared.extend(parts)
        in_threads(work, parts)

    monkeypatch.setattr(parallel, "in_threads", seen)
    effect = make("rate_dependence", shape="relaxation", time_constant=4e-3, exponent=1.4)
    found = effect.plays(w, Run(t, w), thresholds, np.zeros(12))
    assert len(shared) > 1
    for i in range(1, 12):
        expected = np.empty((1, 3000))
        rate_dependence.relaxing_plays(
            w, np.diff(t), thresholds[i : i + 1], 4e-3, 1.4, float(thresholds[-1]), np.zeros(1), expected
        )
        assert np.array_equal(found[i], expected[0])


@pytest.mark.parametrize("exponent", [0.5, 1.0, 3.0])
def test_a_relaxation_over_moves_of_some_roundings(exponent: float) -> None:
    """A play that releases a tiny stretch may catch up when hardly anything is left of the move. Then nothing moves,
    and its distance from the input exceeds neither its threshold nor what it was before."""
    r, tau = 0.375662, 0.0006880369858470095
    moves = [(-8.45397949219, -8.453979492189998, -8.078317492189814)]
    rng = np.random.default_rng(4)
    for side in rng.choice([-1.0, 1.0], 2000):
        x = rng.uniform(-10.0, 10.0)
        state = x - side * (r + rng.integers(-3, 1000) * 1.8e-15)
        moves.append((x, x + rng.integers(-3, 4) * 1.8e-15, state))
    for x, target, state in moves:
        left = float(rate_dependence.relaxed(x, target, 0.01, r, tau, exponent, 2.0, state))
        assert abs(target - left) <= max(r, abs(x - state)) + 2e-14


def test_fast_relaxation_is_the_play() -> None:
    t, w = drive()
    effect = make("rate_dependence", shape="relaxation", time_constant=1e-9)
    expected = make("rate_dependence", betas=(0.0,) * 3).plays(w, Run(t, w), THRESHOLDS, np.zeros(4))
    assert np.max(np.abs(effect.plays(w, Run(t, w), THRESHOLDS, np.zeros(4)) - expected)) < 1e-6


def brute_plays(w: Array) -> Array:
    state, rows = np.zeros(4), []
    for x in w:
        state = np.maximum(x - THRESHOLDS, np.minimum(x + THRESHOLDS, state))
        rows.append(state)
    return np.array(rows).T


def test_play_functions_against_sums() -> None:
    _, w = drive()
    terms = ((0.1,), (0.05, 0.02), (-0.1, 0.0, 0.03))
    found = make("noncongruent", coefficients=terms).bent(brute_plays(w), THRESHOLDS)
    plain, scale = brute_plays(w), THRESHOLDS[-1]
    expected = plain.copy()
    for i, coefficients in enumerate(terms, 1):
        for power, c in enumerate(coefficients, 2):
            expected[i] = expected[i] + scale * c * (plain[i] / scale) ** power
    assert np.max(np.abs(found - expected)) < 1e-12


def test_loop_centre_against_a_sum_of_relays() -> None:
    """A play is half the sum of relays over all centres; the parameters give the density of the relays."""
    amplitude, centre, width = 0.6, 0.4, 0.7
    t, w = drive(600)
    found = make("noncongruent", shape="centre", amplitude=amplitude, centre=centre, width=width)
    rows, relays = found.bent(brute_plays(w), THRESHOLDS), np.array([w] * 4)
    spacing = 1e-3
    centres = np.arange(-8, 8, spacing) + spacing / 2
    density = 1.0 + amplitude / np.cosh((centres - centre) / width) ** 2
    for i in (1, 2, 3):
        relay = np.where(centres < 0.0, 1.0, -1.0)  # the virgin state
        expected = []
        for x in w:
            relay = np.where(x >= centres + THRESHOLDS[i], 1.0, np.where(x <= centres - THRESHOLDS[i], -1.0, relay))
            expected.append(0.5 * spacing * np.sum(density * (relay - np.where(centres < 0.0, 1.0, -1.0))))
        assert np.max(np.abs(rows[i] - expected)) < 3e-3
        relays[i] = expected
    y = Chain(CASCADE, [found]).simulate([Run(t, w)])[0]
    assert np.max(np.abs(y - CASCADE.output_offset - WEIGHTS @ relays)) < 3e-3 * WEIGHTS[1:].sum()


@pytest.mark.parametrize("effect", [e for e in EVERY if e.name == "noncongruent"], ids=label)
def test_congruency_fails_while_rate_independence_holds(effect: Effect) -> None:
    def loop(centre: float, with_effect: bool) -> Array:
        """A minor loop about `centre`, relative to its start."""
        minor = centre + np.concatenate([np.linspace(-1, 1, 200), np.linspace(1, -1, 200)[1:]])
        v = np.concatenate([[0.0, -4.0], minor, minor])
        y = Chain(CASCADE, [effect] if with_effect else []).simulate([Run(np.arange(len(v)) * 1.0, v)])[0][-399:]
        return y - y[0]

    assert np.max(np.abs(loop(0.0, False) - loop(1.0, False))) < 1e-12
    assert np.max(np.abs(loop(0.0, True) - loop(1.0, True))) > 1e-2
    t, v = drive()
    assert np.array_equal(of(effect, t, v), of(effect, t**3 + 5 * t, v))
    repeated = np.repeat(v, 3)
    assert np.array_equal(of(effect, np.arange(len(repeated)) * 1.0, repeated)[::3], of(effect, t, v))


def test_rate_dependence_and_noncongruency_act_together() -> None:
    t, w = drive()
    rate = make("rate_dependence", betas=(0.01, 0.02, 0.03))
    bent = make("noncongruent", shape="centre", amplitude=0.4, centre=0.5, width=1.2)
    rows = Chain(CASCADE, [bent, rate]).plays(w, Run(t, w))
    dilated = rate.plays(w, Run(t, w), THRESHOLDS, np.zeros(4))
    lift = 0.4 * 1.2 * (np.tanh((dilated - 0.5) / 1.2) + np.tanh(0.5 / 1.2))
    lift[0] = 0.0
    assert np.max(np.abs(rows - dilated - lift)) < 1e-12


# Gain, output, drift --------------------------------------------------------------------------------------


def test_ageing_against_the_distance_travelled() -> None:
    """Against 50 digits. A distance of k moves and its quotient have k + 2 roundings, of which `exp(-x)` passes on at
    most 1/e and `log10(1 + x)` 1/ln 10. Library functions are within 4 units in the last place, and each product and
    sum rounds once."""
    t, v = uneven()
    u, k, loss = 2.0**-53, len(v), 0.05
    moves = [abs(Fraction(b) - Fraction(a)) for a, b in itertools.pairwise(v.tolist())]

    def off(numbers: dict[str, Any], law: Callable[[Decimal], Decimal]) -> float:
        got = make("ageing", **numbers).gain(Run(t, v)).tolist()
        return max(abs(float(Decimal(g) - law(d))) for g, d in zip(got, exact, strict=True))

    def allowed(losses: list[float], most: float) -> float:
        passed = 0.5 * (k + 2) * u + (8 * most + 2) * u
        return 1.01 * (sum(map(abs, losses)) * (passed + most * u) + 2 * len(losses) * u)

    def worn(loss: float, travel: int, d: Decimal) -> Decimal:
        return Decimal(loss) * (1 - (-d / travel).exp())

    with localcontext(Context(prec=50)):
        distances = itertools.accumulate(moves, initial=Fraction(0))
        exact = [Decimal(d.numerator) / Decimal(d.denominator) for d in distances]
        decades = float((1 + exact[-1] / 3).log10())
        straight = {"loss": loss, "travel": 3.0}
        assert off(straight, lambda d: 1 - Decimal(loss) * (1 + d / 3).log10()) < allowed([loss], decades)
        one = {"shape": "exponential", "loss": 0.05, "travel": 3.0}
        assert off(one, lambda d: 1 - worn(0.05, 3, d)) < allowed([0.05], 1.0)
        two = {"shape": "exponentials", "losses": (0.05, -0.02), "travels": (3.0, 7.0)}
        assert off(two, lambda d: 1 - worn(0.05, 3, d) - worn(-0.02, 7, d)) < allowed([0.05, -0.02], 1.0)
        assert allowed([0.05, -0.02], max(decades, 1.0)) < 1e-14
    still = make("ageing", loss=0.05, travel=3.0).gain(Run(t, np.ones(len(t))))
    assert np.array_equal(still, np.ones(len(t)))


def test_curved_drift_is_a_changing_rate() -> None:
    """Against the exact number: there are three roundings, since halving is exact."""
    t, v = drive()
    rate, change = 0.4, -0.3
    y = make("drift", shape="curved", rate=rate, change=change).added(Run(t, v))
    rounding = (1 + Fraction(1, 2**53)) ** 3 - 1
    for at, got in zip(map(Fraction, t), map(Fraction, y), strict=True):
        straight, bend = Fraction(rate) * at, Fraction(change) * at**2 / 2
        assert abs(got - (straight + bend)) <= rounding * (abs(straight) + abs(bend))


def test_logged_temperature() -> None:
    t, v = drive()
    temperature = 20 + 5 * np.sin(3 * t)
    effect = make("thermal", gain_per_degree=-0.01, offset_per_degree=0.2, reference=22.0)
    (y,) = Chain(CASCADE, [effect]).simulate([Run(t, v, {"temperature": temperature})])
    h = CASCADE.simulate(v) - 0.3
    assert np.allclose(y, (1 - 0.01 * (temperature - 22)) * h + 0.2 * (temperature - 22) + 0.3, atol=1e-12)
    with pytest.raises(EffectsError, match="the effect thermal needs the column temperature"):
        Chain(CASCADE, [effect]).simulate([Run(t, v)])


@pytest.mark.parametrize("arithmetic", [None, "float32", "q31"])
@pytest.mark.parametrize("inverse", [False, True])
def test_a_logged_temperature_has_to_be_given(arithmetic: str | None, inverse: bool) -> None:
    model = model_of("    - {name: thermal, gain_per_degree: 0.01}\nsample_time: 0.001\n")
    with pytest.raises(EffectsError, match="the effect thermal needs the column temperature, which a record lacks"):
        (model.inverse() if inverse else model).simulate([0.1, 0.2, 0.3], arithmetic)


@pytest.mark.thorough
def test_self_heating_against_an_ode_solver() -> None:
    tau, heating = 0.3, 0.7
    t, v = drive(1500)
    line = interpolate.interp1d(t, v)
    slopes = np.diff(v) / np.diff(t)

    def rate(s: float, rise: Array) -> Array:
        slope = slopes[min(np.searchsorted(t, s, side="right") - 1, len(slopes) - 1)]
        return np.asarray((heating * abs(float(line(min(s, t[-1]))) * slope) / 2 - rise) / tau)

    solved = integrate.solve_ivp(rate, (0, t[-1]), [0.0], t_eval=t, rtol=1e-8, atol=1e-10, max_step=t[1])
    effect = make("thermal", source="self_heating", gain_per_degree=1.0, time_constant=tau, heating=heating)
    rise = effect.gain(Run(t, v)) - 1.0
    # The effect spreads the heat over each step, which makes a difference of second order in the step
    assert np.max(np.abs(rise - solved.y[0])) < 2e-3 * np.max(rise)


@pytest.mark.parametrize("shape", [np.sin, lambda x: signal.sawtooth(x + np.pi / 2, 0.5)])
def test_self_heating_is_frequency_times_amplitude_squared(shape: Callable[[Array], Array]) -> None:
    amplitude, frequency, heating = 3.0, 50.0, 0.2
    t = np.arange(200_000) * 1e-4
    effect = make("thermal", source="self_heating", gain_per_degree=1.0, time_constant=1.0, heating=heating)
    rise = effect.gain(Run(t, amplitude * shape(2 * np.pi * frequency * t))) - 1.0
    assert np.mean(rise[-2000:]) == pytest.approx(heating * frequency * amplitude**2, rel=2e-3)


def test_heat_of_hysteresis_is_what_many_plays_lose() -> None:
    rng = np.random.default_rng(8)
    v = np.concatenate([[0.4], rng.uniform(-3.0, 3.0, 400), np.linspace(-3.0, 3.0, 50), 2.0 * np.sin(np.arange(300.0))])
    v[100:103] = v[100]  # a rest
    t = np.arange(len(v)) * 0.1
    plays, tau, heating, reach = 4000, 5.0, 0.3, 1.7
    z, lost, unsure = np.full(plays, v[0]), np.empty(len(v) - 1), np.empty(len(v) - 1)
    r = (np.arange(plays) + 0.5) * (reach / plays)
    for k, x in enumerate(v[1:].tolist()):
        moved = np.minimum(np.maximum(z, x - r), x + r)
        slip = np.abs(moved - z)
        lost[k] = np.sum(r * slip) * (reach / plays)
        # Between kinks the slip is straight in r, with slopes up to 2. The midpoint rule misses h^3/24 times a second
        # derivative of 4 in each cell, and h^2/8 times a jump of 4 r at a kink, which shows in second differences
        kinks = np.count_nonzero(np.abs(np.diff(slip, 2)) > 1e-9) + 1
        unsure[k] = (reach / plays) ** 2 * reach * (4.0 / 24.0 + kinks * 4.0 / 8.0)
        z = moved

    def warmed(heat: Array) -> Array:
        rise = [0.0]
        for q in heat / 0.1:
            rise.append(rise[-1] * math.exp(-0.1 / tau) + heating * q * -math.expm1(-0.1 / tau))
        return np.array(rise)

    effect = make(
        "thermal", source="hysteresis", gain_per_degree=1.0, time_constant=tau, heating=heating, reach=reach
    )
    off, allowed = np.abs(effect.gain(Run(t, v)) - 1.0 - warmed(lost)), warmed(unsure)
    assert np.all(off[1:] < allowed[1:])
    assert np.max(allowed) < 1e-6 * np.max(warmed(lost))


def test_heat_of_small_loops_grows_with_the_cube_of_the_amplitude() -> None:
    amplitude, frequency, heating = 3.0, 50.0, 0.2
    t = np.arange(200_000) * 1e-4
    v = 70.0 + amplitude * np.sin(2 * np.pi * frequency * t)
    effect = make(
        "thermal", source="hysteresis", gain_per_degree=1.0, time_constant=1.0, heating=heating, reach=10.0
    )
    rise = effect.gain(Run(t, v)) - 1.0
    # samples hit the turning points, so the mean over whole periods is exact except for the approach to it
    left = 2.0 * math.exp(-t[-2000])
    assert np.mean(rise[-2000:]) == pytest.approx(heating * frequency * 2 / 3 * amplitude**3, rel=left)


def test_sensor_polynomial_and_saturation_and_their_order() -> None:
    t, v = drive()
    h = WEIGHTS @ brute_plays(v)
    parts = [
        make("drift", rate=0.5),
        make("sensor_nonlinearity", coefficients=(0.05, -0.02), scale=3.0),
        make("saturation", level=2.0),
    ]
    limited = 2.0 * np.tanh(h / 2.0) + 0.3
    expected = limited + 3.0 * (0.05 * (limited / 3) ** 2 - 0.02 * (limited / 3) ** 3) + 0.5 * t
    assert np.max(np.abs(Chain(CASCADE, parts).simulate([Run(t, v)])[0] - expected)) < 1e-12
    around = 0.7 - 1.5 * np.tanh((0.7 - h) / 1.5) + 0.3
    assert np.max(np.abs(of(make("saturation", level=1.5, centre=0.7), t, v) - around)) < 1e-12
    hard = make("saturation", shape="hard", level=1.0)
    assert np.max(np.abs(of(hard, t, v) - (np.minimum(np.maximum(h, -1), 1) + 0.3))) < 1e-12
    stops = make("saturation", shape="stops", lower=-0.4, upper=0.9, give=0.25)
    beyond = [0.9 + 0.25 * (x - 0.9) if x > 0.9 else -0.4 + 0.25 * (x + 0.4) if x < -0.4 else x for x in h.tolist()]
    assert max(beyond) > 1.0
    assert min(beyond) < -0.5
    assert np.max(np.abs(of(stops, t, v) - (np.array(beyond) + 0.3))) < 1e-12


def test_order_of_the_chain_is_not_that_of_the_file() -> None:
    rng = np.random.default_rng(0)
    names = [
        "delay", "slew_limit", "lag", "rate_dependence", "noncongruent", "bouc_wen", "creep", "ageing", "thermal",
        "resonance", "saturation", "sensor_nonlinearity", "drift",
    ]  # fmt: skip
    first = {effect.name: effect for effect in reversed(EVERY)}
    del first["influence"]  # it and `thermal` act in the order of the file
    listed = list(first.values())
    for _ in range(20):
        rng.shuffle(listed)  # type: ignore[arg-type]
        found = [effect.name for effect in in_order(listed)]
        assert [name for name in found if name != "ageing"] == [name for name in names if name != "ageing"]
    t, v = drive()
    several = Chain(CASCADE, listed).simulate([record(t, v)])[0]
    assert np.array_equal(several, Chain(CASCADE, listed[::-1]).simulate([record(t, v)])[0])


def test_creep_comes_before_gains_and_resonances_after() -> None:
    t, v = drive()
    run = record(t, v)
    parts = [EVERY[5], EVERY[12], EVERY[0]]
    creep, mode, thermal = EVERY[0], EVERY[5], EVERY[12]
    h = creep.filtered(WEIGHTS @ brute_plays(v), run)
    y = mode.filtered(thermal.gain(run) * h + thermal.offset(run), run) + 0.3
    assert np.max(np.abs(Chain(CASCADE, parts).simulate([run])[0] - y)) < 1e-12


# Sessions -------------------------------------------------------------------------------------------------


def test_records_keep_session_time_and_others_follow_their_rest() -> None:
    t = np.arange(5) * 0.1
    own = join([Run(t, t), Run(t + 7.0, t)])
    assert np.allclose(own.run.t, [*t, 6.9, *(t + 7.0)])
    assert np.allclose(own.run.v, [*t, t[-1], *t])
    assert own.parts == (slice(0, 5), slice(6, 11))
    follow = join([Run(t, t), Run(t, -t, rest=2.0)])
    assert np.allclose(follow.run.t, [*t, 2.4, *(2.5 + t)])
    assert np.allclose(follow.run.v, [*t, 0.4, *-t])
    after = join([Run(t, t, rest=3.0)], [2.0, -1.0])
    assert after.run.t[after.parts[0]][0] == 0.0
    assert after.run.v[0] == 2.0
    assert after.run.t[0] == pytest.approx(-0.1 - 3.0 - VISIT)
    before = after.run.t < -0.05
    assert np.all(after.run.v[(after.run.t > -3.1) & before] == -1.0)
    for nothing in ([], [Run(t[:0], t[:0])]):
        with pytest.raises(ValueError, match="no record may be empty"):
            join(nothing)


def test_history_sets_the_memory_and_a_rest_lets_creep_fade() -> None:
    t, v = np.arange(100) * 0.01, np.zeros(100)
    effect = make("creep", time_constants=(2.0,), weights=(0.5,))
    plays = np.clip(0.0, *(np.array([4.0]) + s * THRESHOLDS[:, None] for s in (-1, 1)))[:, 0]
    for x in (-4.0, 0.0):
        plays = np.clip(plays, x - THRESHOLDS, x + THRESHOLDS)
    settled = 1.5 * float(WEIGHTS @ plays) + 0.3
    errors = []
    for rest in (0.0, 5.0, 50.0):
        (y,) = Chain(CASCADE, [effect]).simulate([Run(t, v, rest=rest)], [4.0, -4.0, 0.0])
        errors.append(abs(y[0] - settled))
    assert errors[0] > 0.1
    assert errors[1] == pytest.approx(errors[0] * math.exp(-2.5), rel=1e-2)
    assert errors[2] < 1e-9
    (static,) = Chain(CASCADE, []).simulate([Run(t, v, rest=7.0)], [4.0, -4.0, 0.0])
    assert static[0] == pytest.approx(float(WEIGHTS @ plays) + 0.3, abs=1e-12)


# The model ------------------------------------------------------------------------------------------------

FILE = """hystgen: 1
name: stage
input_range: [-4, 4]
model:
  pi: {thresholds: [0, 0.45, 0.9, 1.35], weights: [0.72, 0.6, 0.48, 0.36]}
  output_offset: 0.3
  effects:
"""


def model_of(text: str, head: str = FILE) -> hystgen.Model:
    from hystgen.parameters.files import parse_parameters

    return hystgen.Model(parse_parameters(head + text))


def test_model_simulate_takes_time_columns_or_the_sample_time() -> None:
    t, v = drive()
    lag = "    - {name: lag, time_constant: 0.02}\n"
    model = model_of(lag)
    y = model.simulate(v, t=t)
    assert np.array_equal(y, of(make("lag", time_constant=0.02), t, v))
    period = model_of(lag, FILE.replace("input_range", f"sample_time: {t[1]}\ninput_range"))
    assert np.max(np.abs(period.simulate(v) - y)) < 1e-12
    with pytest.raises(EffectsError, match=r"the effects \(lag\) need time; give t, or sample_time"):
        model.simulate(v)
    assert np.array_equal(model.simulate(v, t=t, clamp=True), model.simulate(np.clip(v, -4, 4), t=t))
    warm = model_of("    - {name: thermal, gain_per_degree: 0.01}\n")
    cold = warm.simulate(v, extra={"temperature": np.full(len(v), 20.0)})
    assert np.allclose(cold, CASCADE.simulate(v), atol=1e-12)
    for wrong, said in (
        ({"t": t[::-1]}, "t must increase"), ({"t": t[1:]}, "t must have 2000 finite"),
        ({"t": t, "extra": {"temperature": [1.0]}}, "temperature must have 2000"),
    ):  # fmt: skip
        with pytest.raises(EffectsError, match=said):
            warm.simulate(v, **wrong)
    static = model_of("", FILE.replace("effects:\n", "effects: []\n"))
    assert np.array_equal(static.simulate(v, t=t), static.simulate(v))


@pytest.mark.parametrize(("ask", "said"), [
    (lambda m: m.inverse().simulate([0.0], "q15"), "codes in q15 moves the drive by 7 % of its range; use q31"),
    (lambda m: hystgen.emit(m, "nowhere", arithmetic="q15"), "codes in q15 moves the drive by 7 % of its range"),
    (lambda m: hystgen.verify(m, arithmetic="q15"), "codes in q15 moves the drive by 7 % of its range"),
    (lambda m: m.session(), r"of a model with effects \(lag, creep\) is not supported yet"),
])  # fmt: skip
def test_what_effects_do_not_have_yet_is_refused_by_name(ask: Callable[[hystgen.Model], Any], said: str) -> None:
    model = model_of("    - {name: lag, time_constant: 1}\n    - {name: creep, time_constants: [1], weights: [0.1]}\n")
    timed = model.parameters.model_copy(update={"sample_time": 1e-3})
    with pytest.raises(EffectsError, match=said):
        ask(hystgen.Model(timed))


def test_loading_a_plain_model_imports_no_effect() -> None:
    code = (
        "import sys, hystgen.parameters.files as p; p.parse_parameters('hystgen: 1\\nname: a\\ninput_range: [0, 1]\\n"
        "model: {pi: {thresholds: [0], weights: [1]}}'); print(*sys.modules)"
    )
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "hystgen.effects" in loaded
    assert not {"hystgen.effects.base", "hystgen.effects.lag.model", "numpy", "numba", "scipy"} & set(loaded)


def test_a_model_imports_the_folders_of_its_effects_alone(tmp_path: Path) -> None:
    """This holds from the file to the simulated displacement; the inverse of a chain still imports every block."""
    path = tmp_path / "a.yaml"
    path.write_text(
        "hystgen: 1\nname: a\ninput_range: [0, 1]\nmodel:\n  pi: {thresholds: [0, 0.2], weights: [1, 1]}\n"
        "  effects:\n    - {name: creep, time_constants: [1], weights: [0.1]}\n"
    )
    code = f"import sys, hystgen; hystgen.load({str(path)!r}).simulate([0.0, 0.5], t=[0.0, 1.0]); print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[2] for name in run.stdout.split() if name.startswith("hystgen.effects.")}
    assert loaded & set(effects.CATALOGUE) == {"creep"}
    assert not {name for name in run.stdout.split() if name.startswith("hystgen.compensator.chain")}


# Effects of the user's own --------------------------------------------------------------------------------

EXAMPLE = Path(__file__).parent / "neighbour.py"
OWN = """from typing import ClassVar, Literal
import numpy as np
from hystgen.effects import Effect, Place, Run

class Own(Effect):
    name: Literal["user:own"]
    height: float
    place: ClassVar[Place] = Place.ADDED

    def added(self, run: Run):
        return self.height * np.ones(len(run.t))
"""


def test_an_own_effect_in_a_model(tmp_path: Path) -> None:
    path = tmp_path / "stage.yaml"
    listed = "    - {name: user:neighbour, amplitude: 0.5, period: 2.0}\n    - {name: lag, time_constant: 0.02}\n"
    path.write_text(FILE + listed)
    model = hystgen.load(path, effects=[EXAMPLE])
    t, v = drive()
    y = model.simulate(v, t=t)
    assert np.max(np.abs(y - of(make("lag", time_constant=0.02), t, v) - 0.25 * (1 - np.cos(np.pi * t)))) < 1e-12
    (neighbour,) = effects.load_user_effects(EXAMPLE)
    about = About((-4.0, 4.0), 8.0, 1e-3, 1.0, 1.0, 50.0, 30.0, (0.0, 1.0))
    (candidate,) = neighbour.candidates(about)
    assert np.array_equal(candidate.build(candidate.none).added(Run(t, v)), np.zeros(len(t)))
    assert effects.load_user_effects(EXAMPLE) == (neighbour,), "loaded once"
    from hystgen.basics.problems import ParameterError
    from hystgen.parameters.files import dump_parameters, load_parameters, parse_parameters

    text = dump_parameters(model.parameters)
    assert parse_parameters(text, "f", [neighbour]) == model.parameters
    with pytest.raises(ParameterError, match=r"stage.yaml:8:14: .*user:neighbour is not defined in any given file"):
        load_parameters(path)
    path.write_text(FILE + "    - {name: user:neighbour, amplitude: 0.5, perod: 2.0}\n")
    with pytest.raises(ParameterError) as caught:
        hystgen.load(path, effects=[EXAMPLE])
    assert [p.message for p in caught.value.problems] == [
        "is missing; add `period: 0.0`", "unknown key; did you mean period?",
    ]  # fmt: skip


@pytest.mark.parametrize(("text", "said"), [
    (None, r"own.py: cannot be read (No such file or directory); give a folder with model.py"),
    ("def (", r"own.py:1: SyntaxError: invalid syntax"),
    ("import nowhere_at_all\n", r"own.py:1: ModuleNotFoundError: No module named 'nowhere_at_all'"),
    ("x = 1\nraise SystemExit(3)\n", r"own.py:2: SystemExit: 3"),
    ("x = 1\n", r"own.py: defines no effect; write a class of hystgen.effects.Effect"),
    (OWN.replace("user:own", "own"), r'own.py: class Own needs a name of its own; write name: Literal["user:my_'),
    (OWN.replace("Literal[\"user:own\"]", "str"), r"own.py: class Own needs a name of its own"),
    (OWN.replace("    place: ClassVar[Place] = Place.ADDED\n", ""), r"own.py: class Own needs a place; write place: "),
    (OWN.replace("def added", "def addd"), r"own.py: class Own has place added, so it has to define added"),
    (OWN.replace("height: float", "height: nothing"), r"own.py:7: NameError: name 'nothing' is not defined"),
])  # fmt: skip
def test_a_wrong_file_gives_one_message(tmp_path: Path, text: str | None, said: str) -> None:
    path = tmp_path / "own.py"
    if text is not None:
        path.write_text(text)
    with pytest.raises(EffectsError, match=re.escape(said)) as caught:
        effects.load_user_effects(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("answer", "said"), [
    ("1 / 0", "the effect user:own failed in added: ZeroDivisionError: division by zero"),
    ("run.v[:-1]", "the effect user:own answered float64 of shape (1999,) in added; numbers of shape (2000,)"),
    ("'text'", "the effect user:own answered <U4 of shape () in added"),
])  # fmt: skip
@pytest.mark.parametrize("inherited", [False, True])
def test_an_own_effect_that_fails_is_named(tmp_path: Path, answer: str, said: str, inherited: bool) -> None:
    path = tmp_path / "own.py"
    text = OWN.replace("self.height * np.ones(len(run.t))", answer)
    if inherited:
        text = text.replace("class Own(", "class _Part(").replace('    name: Literal["user:own"]\n', "")
        text += '\nclass Own(_Part):\n    name: Literal["user:own"]\n'
    path.write_text(text)
    (own,) = effects.load_user_effects(path)
    t, v = drive()
    with pytest.raises(EffectsError, match=re.escape(said)):
        of(own.model_validate({"name": "user:own", "height": 1.0}), t, v)


CANDIDATES = OWN.replace("from hystgen.effects import", "from hystgen.effects import Candidate,") + """
    @classmethod
    def candidates(cls, about):
        return {}
"""
GOOD = "Candidate('own', np.zeros(1), np.ones(1), np.zeros(1), lambda x: cls(name='user:own', height=float(x[0])))"


@pytest.mark.parametrize(("answer", "said"), [
    ("[1 / 0]", "the effect user:own failed in candidates: ZeroDivisionError: division by zero"),
    ("5", "the effect user:own failed in candidates: TypeError: 'int' object is not iterable"),
    (f"[{GOOD.replace('cls(', 'dict(')}]", "the effect user:own answered dict in build of 'own'"),
    (f"[{GOOD.replace('x[0]', 'x[3]')}]", "the effect user:own failed in build of 'own': IndexError: index 3 is out"),
    (f"[{GOOD.replace('np.ones(1)', 'np.ones(2)')}]", "the effect user:own has a candidate 'own' whose low, start"),
    (f"[{GOOD.replace('np.ones(1)', '-np.ones(1)')}]", "the effect user:own has a candidate 'own' whose low, start"),
])  # fmt: skip
def test_an_own_effect_with_wrong_candidates_is_named(tmp_path: Path, answer: str, said: str) -> None:
    about = About((0.0, 1.0), 1.0, 1e-3, 1.0, 1.0, 1.0, 1.0, (0.0,))
    path = tmp_path / "own.py"
    path.write_text(CANDIDATES.format(f"[{GOOD}]"))
    (own,) = effects.load_user_effects(path)
    assert [each.label for each in own.candidates(about)] == ["own"]
    path.write_text(CANDIDATES.format(answer))
    (own,) = effects.load_user_effects(path)
    with pytest.raises(EffectsError, match=re.escape(said)):
        own.candidates(about)


def test_an_edit_that_keeps_second_and_size_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    path = tmp_path / "own.py"
    seen = []
    for edition in (1, 2):
        path.write_text(f"{OWN}EDITION = {edition}\n")
        os.utime(path, (1e9, 1e9))
        (own,) = effects.load_user_effects(path)
        seen.append(vars(sys.modules[own.__module__])["EDITION"])
    assert seen == [1, 2]


def test_an_output_that_is_not_finite_is_refused() -> None:
    t, v = drive()
    with pytest.raises(EffectsError, match="the output is not finite; check the parameters of sensor_nonlinearity"):
        Chain(CASCADE, [make("sensor_nonlinearity", coefficients=(1e30,) * 16, scale=1e-30)]).simulate([Run(t, v)])


MOVER = """from typing import ClassVar, Literal
import numpy as np
from hystgen import operators
from hystgen.effects import Effect, Place

class Own(Effect):
    name: Literal["user:own"] = "user:own"
    place: ClassVar[Place] = Place.PLAYS

    def plays(self, w, run, thresholds, start):
        return operators.plays(w, 2.0 * thresholds, start)
"""


def test_an_own_effect_may_move_the_plays_and_others_bend_them(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(MOVER)
    path = tmp_path / "stage.yaml"
    head = "hystgen: 1\nname: stage\ninput_range: [-4, 4]\nmodel:\n  pi: {thresholds: [0, 1], weights: [1.5, 0.75]}\n"
    path.write_text(head + "  effects: [{name: noncongruent, coefficients: [[0.5]]}, {name: user:own}]\n")
    model = hystgen.load(path, effects=[tmp_path / "own.py"])
    v = 4.0 * np.sin(np.arange(500) / 40)
    play = 0.0
    for y, x in zip(model.simulate(v, t=np.arange(500.0)), v, strict=True):
        play = min(max(play, x - 2.0), x + 2.0)
        # six roundings on either side, each of a number no larger than the sum of these terms
        exact, size = 1.5 * x + 0.75 * (play + 0.5 * play * play), 1.5 * abs(x) + 0.75 * abs(play) * (1 + abs(play))
        assert abs(y - exact) <= 12 * 2.0**-53 * size


def test_one_effect_says_how_the_plays_move(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(MOVER)
    path = tmp_path / "stage.yaml"
    path.write_text(FILE + "    - {name: rate_dependence, betas: [0.1, 0.1, 0.1]}\n    - {name: user:own}\n")
    from hystgen.basics.problems import ParameterError

    with pytest.raises(ParameterError, match="user:own sets how the plays move, and so does rate_dependence") as caught:
        hystgen.load(path, effects=[tmp_path / "own.py"])
    assert [p.path for p in caught.value.problems] == ["model.effects[1].name"]
    (own,) = effects.load_user_effects(tmp_path / "own.py")
    both = [make("rate_dependence", betas=(0.1, 0.1, 0.1)), own.model_validate({"name": "user:own"})]
    with pytest.raises(EffectsError, match="effect can set how the plays move, not rate_dependence and user:own"):
        Chain(CASCADE, both)


# The command line -----------------------------------------------------------------------------------------


def written(folder: Path, name: str, t: Array, v: Array, **further: Array) -> str:
    path = folder / name
    columns = {"t": t, "v": v, **further}
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    path.write_text("\n".join([",".join(columns), *(",".join(map(repr, row)) for row in rows)]) + "\n")
    return str(path)


def test_simulate_runs_a_session_with_history_and_rest(
    run: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    path = tmp_path / "stage.yaml"
    own = "    - {name: user:neighbour, amplitude: 1, period: 9}\n"
    path.write_text(FILE + "    - {name: creep, time_constants: [0.5], weights: [0.1]}\n" + own)
    t, v = drive(300)
    files = [written(tmp_path, "a.csv", t, v), written(tmp_path, "b.csv", t, -v)]
    code, _, err = run(
        "simulate", path, *files, "-o", tmp_path / "out", "--effects", EXAMPLE, "--history", "4,-4", "--rest", 2
    )
    assert code == 0, err
    model = hystgen.load(path, effects=[EXAMPLE])
    expected = model.chain.simulate([Run(t, v, rest=2.0), Run(t, -v, rest=2.0)], [4.0, -4.0])
    for name, y in zip("ab", expected, strict=True):
        found = np.genfromtxt(tmp_path / "out" / f"{name}.csv", delimiter=",", names=True)
        assert np.array_equal(found["y"], y)
    assert not np.array_equal(expected[0], model.chain.simulate([Run(t, v)], [4.0, -4.0])[0])
    code, out, err = run("simulate", path, files[0])
    assert (code, out) == (2, "")
    assert "user:neighbour is not defined in any given file" in err
    code, out, err = run("simulate", path, files[0], "--effects", tmp_path / "none.py")
    said = "cannot be read (No such file or directory); give a folder with model.py, or a Python file"
    assert (code, out, err) == (2, "", f"error: {tmp_path}/none.py: {said}")


def test_simulate_warns_outside_the_range_and_needs_its_columns(
    run: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    path = tmp_path / "stage.yaml"
    path.write_text(FILE + "    - {name: thermal, gain_per_degree: 0.01}\n")
    t, v = drive(300)
    v = 3 * v
    code, _, err = run("simulate", path, written(tmp_path, "a.csv", t, v))
    assert (code, err) == (2, "error: the effect thermal needs the column temperature, which a record lacks")
    code, _, err = run("simulate", path, written(tmp_path, "a.csv", t, v, temperature=20 + t))
    outside = int(np.count_nonzero(np.abs(v) > 4))
    assert (code, err) == (
        0, f"warning: a.csv: {outside} of 300 samples lie outside input_range -4 to 4, extrapolated, not limited",
    )  # fmt: skip


def test_commands_that_do_not_cover_effects_name_them(run: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    path = tmp_path / "stage.yaml"
    path.write_text(FILE + "    - {name: lag, time_constant: 1}\n    - {name: slew_limit, rate: 1}\n")
    data = written(tmp_path, "a.csv", *drive(20), u=np.zeros(20))
    out = tmp_path / "out"
    for words in (
        ("emit", path, "-o", out), ("emit", path, "-o", out, "--check"), ("verify", path),
        ("simulate", path, data, "--operator", "inverse", "--arithmetic", "float32"),
        ("simulate", path, data, "--arithmetic", "q31"),
    ):  # fmt: skip
        code, said, err = run(*words)
        assert (code, said) == (2, "")
        assert err == (
            "error: C for a model with effects (lag, slew_limit) needs sample_time in the parameter file; add "
            "`sample_time: SECONDS`, the time in s between two calls of step"
        )
        assert not out.exists()
    moved = "    - {name: rate_dependence, shape: relaxation, time_constant: 0.1}\nsample_time: 1.0e-3\n"
    path.write_text(path.read_text() + moved + "emit: {compensation: {noise_gain: 10}}\n")
    code, said, err = run("emit", path, "-o", out, "--engine", "corners")
    assert (code, said) == (1, "")
    assert err.startswith(f"{path}: error: ")
    assert "engine loop" in err
    assert not out.exists()


def test_show_lists_effects_and_what_they_mean(run: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    path = tmp_path / "stage.yaml"
    rate = "    - {name: rate_dependence, betas: [0.3, 0.2, 0.1]}\n"
    path.write_text(FILE + "    - {name: lag, time_constant: 0.0125}\n" + rate)
    code, out, err = run("show", path, "--plot", tmp_path / "stage.svg")
    assert (code, err) == (0, "")
    assert "lag\n        time_constant = 0.0125: tau, s; 0 for no lag\n        compensation: a lead, exact on" in out
    assert "rate_dependence, threshold\n        betas = [0.3, 0.2, 0.1]: " in out
    assert "thresholds stay in order up to |w'| = 4.5 per second" in out
    assert "inverse  " not in out
    assert (tmp_path / "stage.svg").stat().st_size > 1000


def test_show_says_how_the_inverse_reads_the_reference(
    run: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    path = tmp_path / "stage.yaml"
    mode = "    - {name: resonance, frequency: 20, damping: 0.02}\nsample_time: 1.0e-3\n"
    path.write_text(FILE + mode)
    _, out, _ = run("show", path)
    usual = "samples of the reference on either side"
    assert f"compensation: {usual} of the present one: no ringing, no delay" in out.splitlines()[-1]
    for option, said, last in (
        ("resonance: notch", "a notch, see below", "    Resonance: after a step of the reference the stage does not"),
        ("resonance: none", "none, as emit.compensation.resonance sets", "        compensation: none"),
        ("noise_gain: 8", usual, "    Noise: references are averaged twice over"),
        ("quiet: true, noise_gain: 1000", usual, "    Quiet: after 34 equal references"),
    ):
        path.write_text(f"{FILE}{mode}emit: {{compensation: {{{option}}}}}\n")
        code, out, err = run("show", path)
        assert (code, err) == (0, "")
        assert f"compensation: {said}" in out
        assert out.splitlines()[-1].startswith(last)


@settings(max_examples=400, deadline=None)
@given(
    st.floats(1e-30, 1e6), st.floats(-1e6, 1e6), st.floats(1e-9, 1e3), st.floats(1e-9, 1e3),
    st.sampled_from([1.0, 1.25, 2.0, 3.0]), st.floats(1e-3, 1e3),
)
@example(4.900758611054568, 2.2482751908462538e-20, 1.0, 0.00011925250598222254, 1.0, 1.0)  # rounds to below zero
@example(5.0, -1e-300, 1.0, 1e-3, 1.0, 1.0)
def test_a_stretch_ends_at_or_above_zero(
    e: float, speed: float, duration: float, tau: float, exponent: float, scale: float
) -> None:
    """As compiled functions and as Python, which refuses logarithms and powers that compiled code lets pass."""
    for function in (rate_dependence.stretch, rate_dependence.stretch.interpreted):
        after, left = function(e, speed, duration, tau, exponent, scale)
        assert 0.0 <= after <= e + abs(speed) * duration + 1e-9 * scale
        assert 0.0 <= left <= duration
        assert speed < 0.0 or left == 0.0
