"""Engine corners in models with effects: the bits of engine loop in fixed point, its own in floating point."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from modelfiles import BRANCHES, CHAINS, LED, PLAYS, TANH, chain, head

import hystgen
from hystgen.basics import jit
from hystgen.basics.problems import FormatError, UnsupportedEffectsError
from hystgen.compensator import reference
from hystgen.compensator.chain import bounds, tables
from hystgen.compensator.chain.layout import Compiled
from hystgen.compensator.chain.run import answers
from hystgen.compensator.chained import Compensator
from hystgen.effects import Run
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.plays import slots

T = 1e-3
FRONTS = ("", "", TANH, BRANCHES, "  memoryless: {kind: dead_zone, thresholds: [-1, 0, 1], weights: [-0.8, 3, -0.6]}\n")
SOME = (
    "name: creep, time_constants: [0.004, 0.3], weights: [0.05, 0.1]", "name: lag, time_constant: {lag}",
    "name: lag, time_constant: 2.0e-4", "name: delay, time: 2.6e-3", "name: resonance, frequency: 40, damping: 0.3",
    "name: saturation, level: 40, centre: 2", "name: saturation, shape: stops, lower: -9, upper: 8, give: 0.3",
    "name: slew_limit, rate: 900, falling_rate: 700", "name: ageing, loss: 0.02, travel: 50",
    "name: thermal, gain_per_degree: 0.002, offset_per_degree: 0.01", "name: drift, rate: 0.08",
    "name: thermal, source: self_heating, time_constant: 0.5, heating: 0.02, gain_per_degree: -0.01",
    "name: thermal, source: hysteresis, time_constant: 0.5, heating: 0.01, reach: 3, gain_per_degree: -0.01",
)  # fmt: skip


def model(text: str) -> Model:
    """The model of a text, with any noise gain allowed."""
    one = parse_parameters(text, "corners.yaml")
    how = one.emit.compensation.model_copy(update={"noise_gain": 1e9})
    return Model(one.model_copy(update={"emit": one.emit.model_copy(update={"compensation": how})}))


def drawn(rng: np.random.Generator) -> str:
    """A random model of a few plays and effects, whose start memory may lie outside its range."""
    n = int(rng.integers(1, 12))
    r = np.cumsum(rng.uniform(0.05, 1.5, n))
    p = [rng.uniform(0.3, 1.0), *rng.uniform(0.02, 0.5, n)]
    low = float(rng.choice([-4.0, -4.0, 0.0, 1.0, -6.0]))
    start = rng.choice(["0", "2.5", "-9"]) if rng.random() < 0.5 else [*rng.normal(0.0, 2.0, n + 1).round(3).tolist()]
    many = rng.integers(1, 4)
    some = {each.split(",")[0]: each for each in [*rng.choice(SOME, many, False), *SOME[1:2] * (rng.random() < 0.3)]}
    effects = "".join(f"    - {{{each.format(lag=rng.choice([2e-3, 0.01, 0.05]))}}}\n" for each in some.values())
    return (
        f"{head('drawn', low, low + 8.0)}\n  pi:\n    thresholds: {[0, *r.round(4).tolist()]}\n"
        f"    weights: {[round(float(each), 4) for each in p]}\n    initial_state: {start}\n{rng.choice(FRONTS)}"
        f"  output_offset: 0.5\n  effects:\n{effects}sample_time: 1.0e-3\n"
        "emit: {compensation: {compensate: [drift, self_heating]}}\n"
    )


def built(one: Model, arithmetic: str, engine: str) -> Compiled:
    return tables.build(one.chain, arithmetic, T, one.parameters.emit.compensation, engine=engine)


def called(rng: np.random.Generator, one: Compiled, inverse: bool, n: int) -> tuple[Any, Any]:
    """Random calls, most of them steps; their codes follow a walk, are random, lie at the ends, or repeat."""
    kinds = [slots.OP_STEP] * 30 + [slots.OP_SETTLE, slots.OP_OFFSET, slots.OP_RESET]
    if inverse:
        kinds += [slots.OP_COMMIT] * 6 + [slots.OP_CORRECT, slots.OP_EXPECTED]
        kinds += [slots.OP_PUSH] * (len(one.tables.tap) > 0)
    kinds += [slots.OP_TEMPERATURE] * ("set_temperature" in one.tables.calls)
    kinds += [slots.OP_GAIN, slots.OP_TRAVEL] * ("travel" in one.tables.calls)
    most = int(one.tables.limits.code_max[0])
    walk = 0.7 * most * np.sin(np.cumsum(rng.normal(0.0, rng.choice([0.03, 0.3]), n)))
    x = np.select(
        [rng.random(n) < 0.1, rng.random(n) < 0.1], [rng.integers(-most, most, n), rng.choice([-most - 1, 0, most], n)],
        walk,
    )  # fmt: skip
    again = rng.random(n) < 0.1
    again[0] = False
    x[again] = x[np.maximum.accumulate(np.where(again, 0, np.arange(n)))[again]]
    x[again] += rng.integers(-1, 2, n)[again] * rng.choice([0, 1, 80], n)[again]  # or a few codes away
    x = np.clip(x, -most - 1, most)
    return rng.choice(kinds, n).astype(np.uint8), np.rint(x)


@pytest.mark.parametrize("arithmetic", ["q31", "q15"])
def test_engines_agree_in_fixed_point_whatever_is_called(arithmetic: str) -> None:
    """Answers and status bits are equal for random models, and for three that refine the plays' input for a lag."""
    led = LED["led"]
    refined = [led, led.replace("0.012]\n", "0.012]\n    initial_state: -9\n", 1), led.replace(": 0.01}", ": 0.05}")]
    rng = np.random.default_rng([36, len(arithmetic), int(arithmetic == "q31")])
    compared = different = finer = 0
    for k in range(18):
        one = model(refined[k] if k < 3 else drawn(rng))
        try:
            pair = [built(one, arithmetic, engine) for engine in ("loop", "corners")]
        except FormatError:  # codes too coarse for this model
            continue
        for inverse in (False, True):
            op, x = called(rng, pair[0], inverse, 250)
            given = [reference.answers(each.tables, inverse, op, x, compiled=False) for each in pair]
            assert np.array_equal(given[0][0], given[1][0]), one.parameters
            assert np.array_equal(given[0][1], given[1][1]), one.parameters
            compared += 1
            different += len(np.unique(given[0][0]))
        finer += bool(pair[1].tables.number.arriving_bits[0])
    assert compared >= 24
    assert different > 50 * compared, "most answers are no limits"
    assert finer >= 3 * (arithmetic == "q31")


def reference_signal(one: Compiled, seed: int, n: int, share: float) -> Run:
    """A smooth reference with plateaus and turns of every size over a share of the output range, in float32."""
    rng = np.random.default_rng(seed)
    low, high = (float(end) for end in one.tables.limits.output[0])
    phase = np.cumsum(np.where(rng.random(n) < 0.2, 0.0, rng.uniform(0.0, 0.06, n)))
    u = 0.5 * (low + high) + 0.35 * share * (high - low) * (np.sin(phase) + 0.4 * np.sin(6.1 * phase))
    return Run(np.arange(n) * T, np.float32(u).astype(float), {"temperature": 20.0 + u})


@pytest.mark.parametrize("name", ["creeping", "lagging", "quick", "worn", "led"])
def test_floating_point_stays_within_its_bounds(name: str) -> None:
    """Against the compensator in double precision, which shares the code of lag and creep, and against the chain."""
    one = model({**CHAINS, **LED}[name])
    numbers = built(one, "float32", "corners")
    run = reference_signal(numbers, 3, 250, 0.9)
    with jit.plain():
        v = answers(numbers, run, True).astype(float)
        y = answers(numbers, Run(run.t, v, run.extra), False)
    ends = (float(numbers.tables.limits.drive.low[0]), float(numbers.tables.limits.drive.high[0]))
    wanted = Compensator(one.chain).drives(run, ends)
    bound = bounds.chain_bounds(numbers, "float32")
    assert np.max(np.abs(v - wanted)) <= bound.inverse
    if name not in ("lagging", "led"):  # their drives may differ by more than rounding: `bounds.condition`
        assert np.max(np.abs(v - wanted)) <= bound.rounding
    assert np.max(np.abs(y - one.simulate(v, t=run.t, extra=run.extra))) <= bound.forward


@pytest.mark.parametrize("seed", range(3))
def test_composes_with_the_forward_model_in_spite_of_commits_and_holds(seed: int) -> None:
    """Exact in double precision at every sample without a commit, a hold or a limit."""
    one = model(chain("kept", "name: creep, time_constants: [0.01, 3], weights: [0.05, 0.1]",
                      "name: saturation, level: 12", front=TANH if seed else ""))  # fmt: skip
    numbers = built(one, "float64", "corners")
    rng = np.random.default_rng(seed)
    n = 400
    run = reference_signal(numbers, seed, n, 0.8)
    other, held = rng.random(n) < 0.1, rng.random(n) < 0.05
    held[0] = False
    op, x = [], []
    for k in range(n):
        op.append(slots.OP_STEP)
        x.append(np.nan if held[k] else run.v[k])
        if other[k]:
            op += [slots.OP_COMMIT] * 2
            x += rng.uniform(-4.0, 4.0, 2).tolist()
    calls, x = np.array(op, dtype=np.uint8), np.array(x)
    found, _ = reference.answers(numbers.tables, True, calls, x, compiled=False)
    last = np.append(np.flatnonzero(calls == slots.OP_STEP)[1:], len(calls)) - 1
    v = np.where(calls[last] == slots.OP_COMMIT, x[last], found[last])  # what was applied last
    y = one.simulate(v, t=run.t)
    free = ~other & ~held & (np.abs(v) < 4.0)
    assert np.mean(free) > 0.6
    span = float(np.ptp([*numbers.tables.limits.output[0]]))
    assert np.max(np.abs(y - run.v)[free]) <= 1e-12 * span


BITS = [("creeping", "float32"), ("creeping", "q31"), ("everything", "float32"), ("everything", "q15"),
        ("aged", "float64"), ("warm", "q15"), ("led", "q31"), ("drifting_late", "float32")]  # fmt: skip


@pytest.mark.slow(one_in=3)
@pytest.mark.thorough(but_one_in=6)
@pytest.mark.parametrize(("name", "arithmetic"), BITS)
def test_c_gives_the_bits_of_the_reference(name: str, arithmetic: str) -> None:
    one = model({**CHAINS, **LED}[name])
    with jit.plain():
        report = hystgen.verify(one, arithmetic, "both", engine="corners", compiler=["gcc"], length=500)
    assert report.ok, report.table()
    assert {row.operator for row in report.rows} >= {"forward", "inverse"}


@pytest.mark.slow(one_in=3)
@pytest.mark.parametrize("arithmetic", ["q31", "float32"])
def test_a_shared_run_time_keeps_searches_to_itself(arithmetic: str) -> None:
    """The shared run time does not export its searches, so the module carries those it needs."""
    one = model(LED["led"])
    how = {"engine": "corners", "layout": "shared-runtime"}
    with jit.plain():
        report = hystgen.verify(one, arithmetic, "both", **how, compiler=["gcc"], length=100)
    assert report.ok, report.table()


@pytest.mark.slow(one_in=3)
@pytest.mark.thorough
@pytest.mark.parametrize(("name", "arithmetic"), [("everything", "float32"), ("everything", "q31"), ("led", "q31")])
def test_cores_give_the_same_bits(name: str, arithmetic: str) -> None:
    one = model({**CHAINS, **LED}[name])
    cores = ["cortex-m4f", "cortex-m0plus", "rv32imac"]
    report = hystgen.verify(one, arithmetic, "both", engine="corners", targets=cores, target_length=150)
    assert report.ok, report.table()


@pytest.mark.parametrize(("effect", "named"), [
    ("name: rate_dependence, shape: relaxation, time_constant: 5.0e-3", "rate_dependence"),
    ("name: noncongruent, shape: centre, amplitude: 0.3, centre: 0, width: 2", "noncongruent"),
    ("name: bouc_wen, weights: [-0.1], widths: [1]", "bouc_wen"),
])  # fmt: skip
def test_plays_that_an_effect_moves_or_bends_are_those_of_engine_loop(effect: str, named: str) -> None:
    one = model(chain("moved", effect, "name: creep, time_constants: [0.1], weights: [0.05]"))
    assert one.engine("auto") == "loop"
    with pytest.raises(UnsupportedEffectsError, match=rf"{named} moves, bends or joins them.*give --engine loop"):
        one.engine("corners")


def test_auto_is_the_engine_that_costs_less() -> None:
    """Cost is `FLASH / CYCLES`, including the code of effects. If asked for size, auto is engine loop, as without
    effects; in fixed point too, where loop's stack stays within 128 bytes, unless asked for speed."""
    one = model(CHAINS["creeping"])
    assert all(one.engine("auto", "inverse", each) == "corners" for each in ("float32", "float64"))
    assert all(one.engine("auto", "inverse", each) == "loop" for each in ("q31", "q15"))
    assert all(one.engine("auto", "inverse", each, "speed") == "corners" for each in ("q31", "q15"))
    assert one.engine("auto", "inverse", "float32", "size") == "loop"
    few = model(CHAINS["creeping"].replace(PLAYS, "\n  pi: {thresholds: [0, 1], weights: [2, 0.5]}\n"))
    assert few.engine("auto", "inverse", "float32") == "corners"
    u = np.linspace(0.0, 3.0, 20)
    for each in (one, few):  # and simulating an arithmetic uses the engine that is emitted
        chosen = each.engine("auto", arithmetic="float32")
        with jit.plain():
            found, same = each.inverse().simulate(u, "float32"), each.inverse().simulate(u, "float32", engine=chosen)
        assert np.array_equal(found, same)


def test_engine_corners_needs_plays() -> None:
    assert model(CHAINS["straight"]).engine("corners") == "loop", "as without effects"
