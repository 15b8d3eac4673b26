"""The C of models with effects: its bits, its composition with the forward model, its bounds and its refusals."""

from __future__ import annotations

import itertools
import math
import re
import subprocess
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from modelfiles import ALLOWED, BRAKED, BRANCHES, CALM, CHAINS, CREEP, FILES, INVERSE_ALONE, LED, STEADY, TANH, chain
from scipy import signal
from scipy.integrate import solve_ivp

import hystgen
from hystgen.basics import jit
from hystgen.basics.problems import EffectsError, FormatError, UnsupportedEffectsError
from hystgen.compensator import reference
from hystgen.compensator.chain import bounds, layout, measured, preview, tables
from hystgen.compensator.chain.run import answers
from hystgen.compensator.chained import Compensator
from hystgen.effects import Run
from hystgen.effects.ageing import compensator as ageing
from hystgen.effects.drift import compensator as drift
from hystgen.effects.rate_dependence import compensator as dashpot
from hystgen.effects.rate_dependence.model import RelaxingPlays
from hystgen.effects.resonance import compensator as resonance
from hystgen.effects.resonance.model import Resonance
from hystgen.effects.thermal import compensator as thermal
from hystgen.effects.thermal.model import HysteresisHeating
from hystgen.emission import module
from hystgen.emission.calls import emit_options, emitted_files
from hystgen.model import Model
from hystgen.parameters.files import canonical_json, dump_parameters, parameters_sha256, parse_parameters
from hystgen.parameters.schema import Compensation
from hystgen.plays import slots

T, N = 1e-3, 1500


pytestmark = pytest.mark.usefixtures("brief")


def model(name: str, text: str | None = None) -> Model:
    return Model(parse_parameters(text or CHAINS[name], f"{name}.yaml"))


def noisy(name: str) -> Model:
    """A model that allows any noise gain in fixed point."""
    return with_options(name, noise_gain=1e9)


def operator(name: str) -> str:
    return "inverse" if name in INVERSE_ALONE else "both"


def compiled(one: Model, arithmetic: str) -> tables.Compiled:
    return tables.build(one.chain, arithmetic, T)


def record(one: tables.Compiled, seed: int, n: int = N, share: float = 1.0) -> Run:
    """A smooth reference with plateaus, over a fraction of the output range, at rates for which the bounds hold."""
    rng = np.random.default_rng(seed)
    low, high = (float(end) for end in one.tables.limits.output[0])
    still = rng.random(n) < 0.2
    still[n // 2 : n // 2 + 100] = True
    phase = np.cumsum(np.where(still, 0.0, rng.uniform(0.0, 0.03, n)))
    u = 0.5 * (low + high) + 0.5 * share * (high - low) * np.sin(phase)
    return Run(np.arange(n) * T, np.clip(np.float32(u).astype(float), low, high), {"temperature": 20.0 + u})


@pytest.mark.slow(one_in=8)
@pytest.mark.thorough(but_one_in=24)
@pytest.mark.parametrize("name", CHAINS)
@pytest.mark.parametrize("arithmetic", ["float32", "float64", "q31", "q15"])
def test_c_gives_the_bits_of_the_reference(name: str, arithmetic: str, brief: bool) -> None:
    """Records are short; `test_mutants.py` compiles the reference and runs long ones.

    Each model runs in one arithmetic; with HYSTGEN_WHOLE=1, in all four."""
    how = {"compiler": ["gcc"], "length": 30 if brief else 200}
    with jit.plain():
        report = hystgen.verify(noisy(name), arithmetic, operator(name), "loop", **how)
    assert report.ok, report.table()
    assert {row.operator for row in report.rows} >= ({"inverse"} if operator(name) == "inverse" else {"forward"})


@pytest.mark.slow(one_in=12)
@pytest.mark.thorough
@pytest.mark.parametrize("core", ["cortex-m4f", "cortex-m0plus", "cortex-m7", "cortex-m33", "rv32imac"])
@pytest.mark.parametrize(
    ("name", "arithmetic"),
    [("everything", "float32"), ("viscous", "float32"), ("aged", "float32"),
     ("everything", "q15"), ("heated", "float32"), ("drifting_late", "float32"), ("everything", "q31"),
     ("worn", "q15"), ("quick", "q15"), ("soft_dashpot", "q31"), ("dilated", "q15"), ("heated", "q15"),
     ("rubbed", "float32"), ("rubbed", "q15")],
)  # fmt: skip
def test_cores_give_the_same_bits(name: str, arithmetic: str, core: str) -> None:
    """Each model runs on one core, each core runs at least two models; HYSTGEN_WHOLE=1 runs all models on all cores."""
    with jit.plain():
        report = hystgen.verify(noisy(name), arithmetic, operator(name), "loop", targets=[core], target_length=150)
    assert report.ok, report.table()


AT_REST = {"calm": CALM, "steady": STEADY}
"""Models with special treatment of a drive at rest."""


@pytest.mark.parametrize(("name", "arithmetic"), [("calm", "float32"), ("calm", "q15"), ("steady", "q31")])
def test_c_of_a_drive_at_rest_gives_the_bits_of_the_reference(name: str, arithmetic: str, brief: bool) -> None:
    how = {"compiler": ["gcc"], "length": 30 if brief else 1500}
    report = hystgen.verify(model(name, AT_REST[name]), arithmetic, "inverse", **how)
    assert report.ok, report.table()


@pytest.mark.slow(one_in=4)
@pytest.mark.thorough
@pytest.mark.parametrize("name", AT_REST)
@pytest.mark.parametrize("arithmetic", ["float32", "float64", "q31", "q15"])
def test_cores_give_the_bits_of_a_drive_at_rest(name: str, arithmetic: str) -> None:
    cores = ["host", "cortex-m4f", "cortex-m0plus"]
    one, how = model(name, AT_REST[name]), {"length": 500, "target_length": 150}
    with jit.plain():
        report = hystgen.verify(one, arithmetic, "inverse", compiler=["gcc"], targets=cores, **how)
    assert report.ok, report.table()


LAG = "name: lag, time_constant: 0.01"
FAST = "name: creep, time_constants: [0.004, 0.015, 0.03], weights: [0.02, 0.03, 0.05]"
SETTLED = {"q31": 700}
"""[samples] Time until a drive has settled, 400 if not listed: ten times the slowest of these time constants, plus 100.
In q31 it takes twenty time constants until the tail of the lead is less than one code of 2^32."""
QUIETED = {
    "lag": chain("lag", LAG),
    "lag_and_creep": chain("lag_and_creep", LAG, FAST, front=TANH),
    "short_lag": chain("short_lag", "name: lag, time_constant: 4.0e-4", FAST),
    "late": chain("late", LAG, "name: delay, time: 2.6e-3", FAST),
    "braked": chain("braked", LAG, "name: slew_limit, rate: 700, falling_rate: 400", FAST),
    "creep_alone": chain("creep_alone", "name: creep, shape: logarithmic, per_decade: 0.02, t0: 0.1, t_min: 1.0e-3, "
                         "t_max: 1.0e4", front=TANH),
}  # fmt: skip


@pytest.mark.parametrize("arithmetic", ["float32", "float64", "q31", "q15"])
@pytest.mark.parametrize("name", QUIETED)
def test_a_quiet_drive_stands_still(name: str, arithmetic: str) -> None:
    """After a move down and one up only creep moves the drive, reversing at most once; without creep it stands still.
    The displacement, from the model in double precision, is as close as the held drive allows."""
    rng = np.random.default_rng([len(name), len(arithmetic)])
    one = model(name, QUIETED[name] + "emit: {compensation: {quiet: true}}\n")
    numbers = tables.build(one.chain, arithmetic, T, one.parameters.emit.compensation)
    low, high = (float(end) for end in numbers.tables.limits.output[0])
    down, up = low + (high - low) * rng.uniform(0.2, 0.8, 2)
    way = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 60))
    moves = [low + (high - low) * way, high + (down - high) * way, down + (up - down) * way]
    held = SETTLED.get(arithmetic, 400) + 100
    u = np.concatenate([*moves[:2], np.full(held, down), moves[2], np.full(held, up)])
    u = np.rint(u) if numbers.codes else np.float32(u).astype(float)
    t = np.arange(len(u)) * T
    with jit.plain():
        v = answers(numbers, Run(t, u, {}), True).astype(float)
    drive, output, unit = 1.0, 1.0, 1.0
    if numbers.codes:
        drive, output = float(numbers.codes.drive_lsb), float(numbers.codes.output_lsb)
        unit = drive / 2.0 ** int(numbers.tables.number.drive_bits[0])
    error = np.abs(one.simulate(v * drive, t=t) / output - u)
    kept = 2.0 * unit * float(numbers.tables.number.dither[0]) + 0.5 * drive * (numbers.codes is not None)
    allowed = 1.1 * one.cascade.pi.slopes[-1] * one.cascade.front_slopes[1] * kept / output  # creep adds 10 %
    allowed += 2e-8 * (high - low) + np.max(np.abs(np.diff(u, 2))) / 8.0 * (name == "late")  # interpolation error
    for end in (120 + held, len(u)):
        still = slice(end - 100, end - numbers.ahead)
        way = np.sign(np.diff(v[still]))
        way = way[way != 0.0]
        assert np.count_nonzero(np.diff(way)) <= (name != "lag")
        assert name != "lag" or not len(way)
        assert np.max(error[still]) < allowed
    if name in ("creep_alone", "short_lag"):  # their bound does not require the same drives
        codes = numbers.codes
        bound = codes.inverse_error * drive if codes else bounds.chain_bounds(numbers, arithmetic).inverse
        assert np.max(np.abs(v * drive - one.inverse().simulate(u * output, t=t, clamp=True))) <= bound


def test_a_quiet_drive_moves_when_the_reference_does() -> None:
    """If the reference moves by a code or the offset jumps while the drive rests, the lag is compensated at once."""
    one = model("lag", QUIETED["lag"] + "emit: {compensation: {quiet: true}}\n")
    numbers = tables.build(one.chain, "q15", T, one.parameters.emit.compensation)
    step, offset = slots.OP_STEP, slots.OP_OFFSET
    op = np.array([*[step] * 100, *[step] * 3, *[step] * 97, offset, *[step] * 3], dtype=np.uint8)
    x = np.array([*[5000] * 100, *[5001] * 100, 300, *[5001] * 3])
    v, status = reference.answers(numbers.tables, True, op, x, compiled=False)
    assert len(set(v[60:100].tolist())) == 1
    assert v[100] > v[99] + 5
    assert len(set(v[160:200].tolist())) == 1
    assert numbers.codes
    code = float(numbers.codes.output_lsb / numbers.codes.drive_lsb) / one.cascade.pi.slopes[-1]
    assert v[201] < v[199] - 5 * 300 * code, "five times what it comes to at rest"
    assert not np.any(status), "and no status tells of it"


@pytest.mark.parametrize(("lsb", "changes"), [(8.0 / 4095.0, False), (None, True)])
def test_a_quiet_drive_knows_the_step_of_a_converter(lsb: float | None, changes: bool) -> None:
    """In floating point, the firmware commits each drive as a 12-bit converter rounds it."""
    one = model("lag_and_creep", QUIETED["lag_and_creep"] + "emit: {compensation: {quiet: true}}\n")
    t = tables.build(one.chain, "float32", T, one.parameters.emit.compensation, (lsb, None)).tables
    code, state = reference.operations(t, True), reference.new_state(t, True)
    u = np.concatenate([3.0 * np.sin(np.linspace(0.0, 4.0, 80)), np.full(600, -1.234)])
    answer, status, sent = np.zeros(1, np.float32), np.zeros(1, np.uint8), []
    step, commit = (np.array([each], np.uint8) for each in (slots.OP_STEP, slots.OP_COMMIT))
    with jit.plain():
        code.init(t, state)
        for x in np.float32(u):
            code.run(t, state, step, np.array([x]), answer, status)
            sent.append(np.rint(float(answer[0]) * 4095.0 / 8.0))
            code.run(t, state, commit, np.array([sent[-1] * 8.0 / 4095.0], np.float32), answer, status)
    assert np.any(np.diff(sent[-200:])) == changes


def test_two_branches_are_not_quiet() -> None:
    one = model("lagging", CHAINS["lagging"] + "emit: {compensation: {quiet: true}}\n")
    with pytest.raises(UnsupportedEffectsError, match="with one lag the drive comes to rest anyway"):
        emitted_files(one)


EXACT = dict.fromkeys(("creeping", "logarithmic", "warm", "quick", "dilated", "bumpy", "drifting"), 1e-12) | {
    "viscous": 2e-4, "relaxing": 2e-4, "dashpot": 1e-4, "soft_dashpot": 2e-3,
}  # fmt: skip
"""[fraction of the output range] Largest error. For viscous plays it is due to contacts inside a step; for dashpots, to
where in a step the input counts as standing still, which matters if plays catch up within the step."""


@pytest.mark.slow(one_in=3)
@pytest.mark.thorough(but_one_in=6)
@pytest.mark.parametrize("name", EXACT)
@pytest.mark.parametrize("seed", range(3))
def test_composes_with_the_forward_model_that_shares_no_code(name: str, seed: int) -> None:
    """Exact wherever the drive is not limited. Each model runs with one seed; with HYSTGEN_WHOLE=1, with all three."""
    one = model(name)
    numbers = compiled(one, "float64")
    run = record(numbers, seed, share=0.6)
    v = answers(numbers, run, True)
    y = one.simulate(v, t=run.t, extra=run.extra)
    low, high = one.cascade.input_range
    moved = np.diff(v, prepend=v[:1])
    slew = next((effect for effect in one.effects if effect.name == "slew_limit"), None)
    up, down = (np.inf, np.inf) if slew is None else (slew.rate * T, slew.falling_rate * T)
    free = (v > low) & (v < high) & (moved < up * (1.0 - 1e-9)) & (moved > -down * (1.0 - 1e-9))
    span = float(np.ptp([*numbers.tables.limits.output[0]]))
    assert np.mean(free) > 0.8
    assert np.max(np.abs(y - run.v)[free]) <= EXACT[name] * span


@pytest.mark.parametrize("name", CHAINS)
def test_an_inverse_simulated_twice_begins_at_the_start_memory_both_times(name: str) -> None:
    one = model(name).inverse()
    run = record(compiled(model(name), "float64"), 1, 60, share=0.4)
    first, again = (one.simulate(run.v, t=run.t, extra=run.extra, clamp=True) for _ in range(2))
    assert np.array_equal(first, again)


@pytest.mark.parametrize("arithmetic", ["float32", "float64", "q31", "q15"])
def test_a_lag_behind_a_slew_limit_does_not_overshoot(arithmetic: str) -> None:
    """The reference steps over half the range, up and down; the actuator is the model in double precision."""
    lag, slew = "name: lag, time_constant: 0.01", "name: slew_limit, rate: 700, falling_rate: 400"
    one = model("braked", chain("braked", lag, slew))
    numbers = compiled(one, arithmetic)
    low, high = (float(end) for end in numbers.tables.limits.output[0])
    near, far = np.rint(0.75 * low + 0.25 * high), np.rint(0.25 * low + 0.75 * high)
    u = np.repeat([near, far, near], [3, 150, 150])
    with jit.plain():
        v = answers(numbers, Run(np.arange(len(u)) * T, u, {}), True).astype(float)
    codes = numbers.codes
    drive, output = (1.0, 1.0) if codes is None else (float(codes.drive_lsb), float(codes.output_lsb))
    y = one.simulate(v * drive, t=np.arange(len(u)) * T) / output
    step = u[3] - u[0]
    assert np.max(y) < u[3] + 1e-3 * step
    assert np.min(y) > u[0] - 1e-3 * step
    for end in (153, 303):
        assert np.max(np.abs(y[end - 50 : end] - u[end - 1])) < 1e-3 * step, "it has arrived"


SLEWED = chain("slewed", CREEP, "name: slew_limit, rate: 500, falling_rate: 300")


@pytest.mark.parametrize("arithmetic", ["float32", "float64"])
@pytest.mark.parametrize("text", [SLEWED, BRAKED, STEADY, CALM], ids=["slewed", "braked", "steady", "calm"])
def test_a_held_sample_stays_within_the_slew_limit(text: str, arithmetic: str) -> None:
    """After a commit or `settle` far from the last drive, the answers return to it at the amplifier's rate."""
    one = model("held", text)
    numbers = compiled(one, arithmetic)
    slew = next(effect for effect in one.effects if effect.name == "slew_limit")
    up, down, (low, high) = slew.rate * T, slew.falling_rate * T, one.cascade.input_range
    step, commit, settle = slots.OP_STEP, slots.OP_COMMIT, slots.OP_SETTLE
    calls = [(step, 2.0)] * 60
    far, near = low + 0.1 * (high - low), low + 0.9 * (high - low)
    for op, drive in ((commit, near), (settle, far), (commit, near), (settle, far)):
        calls += [(op, drive), (step, math.nan), (step, math.nan)]
    op, x = (np.array(each) for each in zip(*calls, strict=True))
    found, status = reference.answers(numbers.tables, True, op.astype(np.uint8), x)
    last, applied = float(found[59]), 0.0
    for i in range(60, len(calls)):
        if op[i] != step:
            applied = float(x[i])
            continue
        limited = not -down <= last - applied <= up
        last = applied + min(max(last - applied, -down), up)
        assert abs(float(found[i]) - last) <= 2 * np.finfo(found.dtype).eps * max(abs(low), abs(high))
        assert status[i] == slots.HELD | slots.SLEW_LIMITED * limited
        applied = float(found[i])


@pytest.mark.parametrize("name", ["late", "straight", "everything"])
def test_the_forward_operator_waits_and_rings_like_the_model(name: str) -> None:
    """The drive jumps and holds, which makes a mode ring the longest."""
    one = model(name, CHAINS[name].replace(BRANCHES, "").replace("rate: 3000", "rate: 30000"))
    low, high = one.cascade.input_range
    v = np.repeat(np.random.default_rng(4).uniform(0.3 * low, 0.3 * high, 4), 60)
    t = np.arange(len(v)) * T
    warm = {"temperature": 20.0 + 0.1 * np.arange(len(v))}
    y = one.simulate(v, t=t, extra=warm)
    for arithmetic in ("float64", "float32", "q31", "q15"):
        found = compiled(one, arithmetic)
        if found.codes is None:
            drive, output, bound = 1.0, 1.0, bounds.chain_bounds(found, arithmetic).forward
            given = v.astype(np.float32).astype(float)
        else:
            drive, output = float(found.codes.drive_lsb), float(found.codes.output_lsb)
            given, bound = np.rint(v / drive), found.codes.forward_error
        with jit.plain():
            answered = answers(found, Run(t, given, warm), False).astype(float)
        wanted = one.simulate(given * drive, t=t, extra=warm) / output
        most = np.inf if found.codes is None else float(found.tables.limits.code_max[0])
        assert np.max(np.abs(answered - np.clip(wanted, -most, most))) <= bound
        assert bound < 1e-2 * np.ptp(y) / output
    assert np.ptp(y) > 2.0
    assert np.max(np.abs(y - one.without([e for e in one.effects if e.name in ("delay", "resonance")])
                         .simulate(v, t=t, extra=warm))) > 0.5, "what they are worth"  # fmt: skip


@pytest.mark.parametrize(("frequency", "damping"), [(0.5, 0.3), (30.0, 0.05), (333.0, 1.0), (700.0, 0.01), (5.0, 4.0)])
def test_sums_over_a_mode_are_those_of_its_recursion(frequency: float, damping: float) -> None:
    """The sums of absolute responses used in bounds equal those of the sample-by-sample recursion."""
    effect = Resonance(name="resonance", frequency=frequency, damping=damping)
    one = resonance.numbers(effect, T)
    keep, turn, swing, lead, push = one.table
    step = np.array([[1.0 + keep, turn], [-turn, 1.0 + swing]])
    n = 40_000

    def responses(state: Any, change: float = 0.0) -> tuple[float, float]:
        """Sums of the absolute output and rate after an input pulse at the first sample."""
        state = np.array(state) + change * np.array([lead, push])
        total, rates = abs(change + state[0]), abs(state[1])
        for k in range(n):
            state = step @ state - (change * np.array([lead, push]) if k == 0 else 0.0)
            total, rates = total + abs(state[0]), rates + abs(state[1])
        return total, rates

    assert responses((0.0, 0.0), 1.0) == pytest.approx((one.largest, one.fastest), rel=1e-6)
    assert responses((1.0, 0.0)) == pytest.approx((one.off_after, one.turned), rel=1e-6)
    assert responses((0.0, 1.0)) == pytest.approx((one.rate_after, one.slowed), rel=1e-6)


def test_drift_is_compensated_ahead_of_time() -> None:
    """References are whole samples ahead of the motion, while the drift continues."""
    text = chain("ahead", "name: drift, rate: -0.08", "name: delay, time: 3.0e-3", CREEP, compensate="drift")
    one = model("ahead", text)
    numbers = compiled(one, "float64")
    t = np.arange(N) * T
    u = 0.5 + 1.5 * t
    v = answers(numbers, Run(t, u, {}), True)
    known = N - numbers.ahead
    assert np.max(np.abs(one.simulate(v, t=t) - u)[numbers.ahead : known]) < 1e-12
    assert np.ptp(one.effects[0].added(Run(t, u))) > 0.1, "what it is worth"


def test_drift_is_counted_from_set_offset_on_and_survives_a_correction() -> None:
    one = model("drifting")
    numbers = compiled(one, "float64")
    calls: list[tuple[int, float]] = [(slots.OP_STEP, 1.0)] * 2001
    drifted = 0.05 * 2.0 + 0.005 * 2.0**2
    answer, status = run_calls(one, [*calls, (slots.OP_SETTLE, 1.0), (slots.OP_EXPECTED, 0.0)])
    fresh, _ = run_calls(one, [(slots.OP_SETTLE, 1.0), (slots.OP_EXPECTED, 0.0)])
    counted = 2.001
    assert float(answer[-1] - fresh[-1]) == pytest.approx(0.05 * counted + 0.005 * counted**2, abs=1e-12)
    assert not np.any(status)
    anew, _ = run_calls(one, [*calls, (slots.OP_SETTLE, 1.0), (slots.OP_OFFSET, 0.25), (slots.OP_EXPECTED, 0.0)])
    assert float(anew[-1] - fresh[-1]) == pytest.approx(0.25, abs=1e-12), "the clock begins anew"
    held, _ = run_calls(one, [*calls, (slots.OP_SETTLE, 1.0), (slots.OP_OFFSET, math.nan), (slots.OP_EXPECTED, 0.0)])
    assert float(held[-1]) == float(answer[-1]), "no number changes nothing"
    trimmed, _ = run_calls(one, [*calls, (slots.OP_SETTLE, 1.0), (slots.OP_CORRECT, float(answer[-1])),
                                 (slots.OP_EXPECTED, 0.0)])  # fmt: skip
    assert float(trimmed[-1]) == float(answer[-1]), "a sensor that sees what is expected changes nothing"
    assert drifted > 0.1
    span = float(numbers.tables.number.farthest_offset[0])
    far = chain("far", "name: drift, rate: 1.0e+4", compensate="drift")
    late, _ = run_calls(model("far", far), [(slots.OP_STEP, 0.0)] * 50 + [(slots.OP_EXPECTED, 0.0)])
    none, _ = run_calls(model("far", far), [(slots.OP_STEP, 0.0), (slots.OP_EXPECTED, 0.0)])
    assert abs(float(late[-1])) <= abs(float(none[-1])) + 3.0 * span, "drift stays within what can be set"


def test_a_clock_counts_beyond_the_digits_of_a_float() -> None:
    one = compiled(model("drifting"), "float32").tables
    state = drift.ClockState.zeros(1, np.float32)
    with jit.plain():
        for start in (0.0, 2.0**24 - 2.0):
            state[0] = 0.0, start, 0.0
            for _ in range(5):
                drift.clock_tick(one.of("clock"), state, 0, 0.0, 0.0)
            assert float(state.high[0]) * 2.0**24 + float(state.low[0]) == start + 5.0
        seconds = (2.0**24 + 3.0) * T
        limited = min(0.05 * seconds + 0.005 * seconds**2, float(one.of("clock").farthest[0]))
        assert float(drift.clock_drift(one.of("clock"), state, 0, np.float32(0.0))) == pytest.approx(limited, rel=1e-6)


def test_own_heat_leaves_the_gain_of_one_sample() -> None:
    """The forward operator computes the heat exactly; the inverse uses the gain before the last move."""
    one = model("heated")
    numbers = compiled(one, "float64")
    run = record(numbers, 5, share=0.6)
    v = answers(numbers, run, True)
    left = np.abs(one.simulate(v, t=run.t) - run.v)
    heat = one.effects[0]
    rises = heat.above(Run(run.t, v))  # type: ignore[attr-defined]
    most = np.max(np.abs(np.diff(rises)))
    loss = 1.0 - math.exp(-T / 0.5)
    sample = 0.05 * loss * np.max(np.abs(np.diff(v * np.abs(v)))) / (4.0 * T)
    assert sample >= most
    size = float(np.max(np.abs(one.without([heat]).simulate(v) - 0.5)))
    assert 0.0 < np.max(left) <= (0.02 * size + 0.1) * sample * 1.001
    assert np.max(rises) > 0.5, "it has warmed"
    plain = one.without([heat]).inverse().simulate(run.v)
    assert np.max(np.abs(one.simulate(plain, t=run.t) - run.v)) > 20.0 * np.max(left), "what it is worth"
    forward = answers(numbers, Run(run.t, v, {}), False)
    assert np.max(np.abs(forward - one.simulate(v, t=run.t))) < 1e-12
    exact = one.inverse().simulate(run.v, t=run.t)
    assert np.max(np.abs(one.simulate(exact, t=run.t) - run.v)) < 1e-12, "in double precision the drive is sought"


def test_heat_of_loops_leaves_the_gain_of_one_sample_and_what_few_plays_miss() -> None:
    """The model has all rubbing plays. The drive alternates between large loops and small loops whose centre moves."""
    one = model("rubbed")
    heat = one.effects[0]
    assert isinstance(heat, HysteresisHeating)
    t = np.arange(N) * T
    size = np.where(np.arange(N) % 500 < 250, 3.5, 0.8)
    v = size * np.sin(2.0 * np.pi * 9.0 * t) * (1.0 - np.exp(-t / 0.05)) + np.sin(2.0 * np.pi * 0.8 * t) / 2.0
    u = one.simulate(v, t=t)
    found = answers(compiled(one, "float64"), Run(t, u, {}), True)
    left = np.max(np.abs(one.simulate(found, t=t) - u))
    ends, move = one.cascade.input_range, float(np.max(np.abs(np.diff(found))))
    degrees = thermal.most_at_once(heat, ends, move, T) + thermal.coarseness(heat, ends, move, T)
    cold = one.without([heat])
    output = float(np.max(np.abs(cold.simulate(v) - one.cascade.output_offset)))
    assert left <= (0.02 * output + 0.1) * degrees
    plain = cold.inverse().simulate(u, clamp=True)
    assert np.max(np.abs(one.simulate(plain, t=t) - u)) > 50.0 * left, "what it is worth"
    exact = one.inverse().simulate(u, t=t)
    assert np.max(np.abs(one.simulate(exact, t=t) - u)) < 1e-12, "in double precision the drive is sought"


def test_few_plays_warm_like_many() -> None:
    """Eight plays are compared with 4000 for drives of all kinds, including loops that eight plays resolve worst."""
    reach, seconds, ends, move = 3.0, T, (-4.0, 4.0), 0.25
    heat = HysteresisHeating(name="thermal", source="hysteresis", time_constant=2.0, heating=0.05, reach=reach)
    allowed = thermal.coarseness(heat, ends, move, seconds)
    per = thermal.per_amount(heat, ends, seconds)
    cell, rng, worst = reach / thermal.FRICTION_PLAYS, np.random.default_rng(3), 0.0
    widths = [*(cell * np.array([0.25, 0.5, 0.909, 1.5, 2.7])), 3.9]
    for wide in [*widths, *4 * [-1.0]]:
        knots = rng.uniform(-4.0, 4.0, 40) if wide < 0.0 else np.tile([wide, -wide], math.ceil(1000.0 * move / wide))
        knots = np.append(0.0, knots)
        v = np.concatenate([
            np.linspace(a, b, max(math.ceil(abs(b - a) / move), 1), endpoint=False)
            for a, b in itertools.pairwise(knots)
        ])  # fmt: skip
        rises = []
        few, many = np.array(thermal.thresholds(heat, ends)), (np.arange(4000) + 0.5) * reach / 4000
        odd = 2.0 * np.arange(thermal.FRICTION_PLAYS) + 1.0
        for r, weight in ((few, odd), (many, many * (reach / 4000) * heat.heating / (seconds * per))):
            z, rise, found = np.full(len(r), v[0]), 0.0, []
            for x in v[1:]:
                moved = np.clip(z, x - r, x + r)
                rise = thermal.risen(heat, rise, per * float(weight @ np.abs(moved - z)), seconds)
                z = moved
                found.append(rise)
            rises.append(np.array(found))
        worst = max(worst, float(np.max(np.abs(rises[0] - rises[1]))))
        assert np.max(np.abs(rises[0] - rises[1])) <= allowed
    assert worst > 0.25 * allowed
    assert allowed < 0.01 * heat.heating * 0.5 * reach**2 * move / seconds, "of the warmest rise"


def test_ageing_leaves_the_gain_of_one_sample() -> None:
    one = model("worn")
    numbers = compiled(one, "float64")
    run = record(numbers, 5, share=0.6)
    v = answers(numbers, run, True)
    left = np.max(np.abs(one.simulate(v, t=run.t) - run.v))
    step = np.max(np.abs(np.diff(v)))
    steep = max(abs(ageing.steepness(one.effects[0], x)) for x in (0.0, 5.0))  # type: ignore[arg-type]
    assert 0.0 < left <= np.max(np.abs(run.v)) * (steep * step + ageing.TABLE_ERROR)


@pytest.mark.slow(one_in=4)
@pytest.mark.thorough(but_one_in=4)
@pytest.mark.parametrize("name", CHAINS)
@pytest.mark.parametrize("seed", [11, 12])
def test_stays_within_its_bounds(name: str, seed: int) -> None:
    """float32 against double precision: the inverse against the compensator, the forward operator against the chain."""
    one = model(name)
    numbers = compiled(one, "float32")
    bound = bounds.chain_bounds(numbers, "float32")
    run = record(numbers, seed)
    ends = tuple(float(end) for end in numbers.tables.limits.drive[0])
    v = answers(numbers, run, True).astype(float)
    wanted = Compensator(one.chain, one.parameters.emit.compensation).drives(run, ends)  # type: ignore[arg-type]
    known = N - numbers.ahead
    assert np.max(np.abs(v - wanted)[:known]) <= bound.inverse
    if operator(name) == "both":
        forward = answers(numbers, Run(run.t, v, run.extra), False).astype(float)
        slew = [effect.rate * T for effect in one.effects if effect.name == "slew_limit"]
        last_bit = float(np.finfo(np.float32).eps) * max(map(abs, ends))
        assert not slew or np.max(np.abs(np.diff(v))) <= max(slew) + last_bit
        assert np.max(np.abs(forward - one.simulate(v, t=run.t, extra=run.extra))) <= bound.forward


@pytest.mark.parametrize("arithmetic", ["float32", "float64", "q31", "q15"])
@pytest.mark.parametrize("name", ["led", "wider"])
def test_other_references_find_no_more_than_ten_times_the_error_stated(name: str, arithmetic: str) -> None:
    """For other smooth references with plateaus, the error is at most ten times the stated one."""
    one = model(name, {**CHAINS, **LED}[name])
    how = one.parameters.emit.compensation
    numbers, ends = compiled(one, arithmetic), one.cascade.input_range
    stated = measured.measured(numbers, one.chain, how).error
    drive, output = (1.0, 1.0) if numbers.codes is None else (numbers.codes.drive_lsb, numbers.codes.output_lsb)
    worst = 0.0
    for seed in (21, 22):
        run = record(numbers, seed, 600)
        if numbers.codes:
            run = Run(run.t, np.rint(run.v), {})
        v = answers(numbers, run, True).astype(float)
        wanted = Compensator(one.chain, how).drives(Run(run.t, run.v * float(output), {}), ends) / float(drive)
        worst = max(worst, float(np.max(np.abs(v - wanted))))
    assert stated / 10.0 <= worst <= 10.0 * stated


def test_what_emissions_share_of_the_search_for_an_error_is_computed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The drives in double precision serve both engines, but no other model, arithmetic or settings; the error found
    serves every emission with the same tables, until another model is emitted."""
    made: list[Run] = []
    drives = Compensator.drives

    def counted(self: Compensator, references: Run, ends: tuple[float, float]) -> Any:
        made.append(references)
        return drives(self, references, ends)

    monkeypatch.setattr(Compensator, "drives", counted)
    monkeypatch.setattr(measured, "SAMPLES", 100)
    led = LED["led"]
    assert led.count("time_constant: 0.01") == 1
    other = led.replace("time_constant: 0.01", "time_constant: 0.011")
    cases = [
        (led, "q31", "loop", 6), (led, "q31", "corners", 0), (led, "q31", "loop", 0), (other, "q31", "loop", 6),
        (led, "q15", "loop", 6),
    ]  # fmt: skip

    def found(text: str, arithmetic: str, engine: str) -> measured.Measured:
        one = model("led", text)
        numbers = tables.build(one.chain, arithmetic, T, engine=engine)
        return measured.measured(numbers, one.chain, one.parameters.emit.compensation)

    def forget() -> None:
        monkeypatch.setattr(measured, "_kept", {})

    forget()
    kept = []
    for *case, times in cases:
        made.clear()
        kept.append(found(*case))
        assert found(*case) == kept[-1]
        assert len(made) == times
    for result, (*case, _) in zip(kept, cases, strict=True):
        forget()
        assert found(*case) == result


@pytest.mark.parametrize("name", ["lagging", "everything", "dilated", "wider"])
def test_answers_like_double_precision_that_saw_the_same_drives(name: str) -> None:
    """float32 stays within its bound of float64 tables to which its drives are committed; no more is promised here."""
    one = model(name, CHAINS[name].replace(BRANCHES, ""))
    numbers, double = compiled(one, "float32"), compiled(one, "float64")
    bound = bounds.chain_bounds(numbers, "float32")
    assert bounds.condition(numbers)
    run = record(numbers, 3, 400, 1.0)
    warm = "set_temperature" in numbers.tables.calls
    pairs = [(slots.OP_TEMPERATURE, 20.0)] * warm + [(slots.OP_PUSH, float(u)) for u in run.v[: numbers.ahead]]
    pairs += [(slots.OP_STEP, float(u)) for u in run.v[numbers.ahead :]]
    with jit.plain():
        op, x = (np.array(column) for column in zip(*pairs, strict=True))
        v, _ = reference.answers(numbers.tables, True, op.astype(np.uint8), x)
        seen = []
        for (call, value), answer in zip(pairs, v.tolist(), strict=True):
            seen += [(call, value)] + [(slots.OP_COMMIT, answer)] * (call == slots.OP_STEP)
        op_seen, x_seen = (np.array(column) for column in zip(*seen, strict=True))
        w, _ = reference.answers(double.tables, True, op_seen.astype(np.uint8), x_seen)
    steps = op == slots.OP_STEP
    assert np.max(np.abs(v[steps] - w[op_seen == slots.OP_STEP])) <= bound.rounding
    assert bound.rounding < 0.1 * np.ptp(one.cascade.input_range), "it says more than the range"


@pytest.mark.thorough
def test_slow_states_neither_stall_nor_drift() -> None:
    """With tau/T = 2^28, the state after a step of the drive moves as far as it would without rounding."""
    seconds, tau = 1e-3, 2.0**28 * 1e-3
    text = chain("slow", f"name: creep, time_constants: [{tau}], weights: [0.1]")
    one = model("slow", text)
    numbers = compiled(one, "float32")
    n = 1_000_000
    calls = np.full(n, slots.OP_STEP, dtype=np.uint8)
    v = np.full(n, 3.0)
    v[0] = -3.0
    y, _ = reference.answers(numbers.tables, False, calls, v)
    state = 1.0 - math.exp(-(n - 1) * seconds / tau)
    h = one.without(one.effects).simulate(v) - one.cascade.output_offset
    moved = 0.1 * float(h[-1] - h[0]) * state
    assert abs((float(y[-1]) - float(y[1])) - moved) <= 0.02 * abs(moved) + 2 * float(np.spacing(np.float32(y[-1])))


@pytest.mark.thorough
def test_a_play_with_a_dashpot_creeps_on_to_where_it_would_go_without_rounding() -> None:
    """The drive stands still for 1e6 samples; in single precision, the last moves are 1e-4 of the last bit."""
    one = model("dashpot")
    n = 1_000_000
    calls = np.full(n, slots.OP_STEP, dtype=np.uint8)
    v = np.full(n, 3.0)
    v[:100] = np.linspace(-3.0, 3.0, 100)
    y, _ = reference.answers(compiled(one, "float32").tables, False, calls, v)
    t = np.append(np.arange(100) * T, (n - 1) * T)
    wanted = one.simulate(np.append(v[:100], 3.0), t=t)
    crept = float(wanted[-1] - wanted[-2])
    assert crept > 0.1
    assert abs(float(y[-1]) - float(wanted[-1])) <= 1e-3 * crept
    assert abs(float(y[-1]) - float(y[n // 2])) > 10.0 * float(np.spacing(y[-1]))


@pytest.mark.parametrize("exponent", [0.1, 0.25, 0.5, 0.95, 1.05, 2.0, 4.0, 10.0])
@pytest.mark.parametrize("tau", [1e-4, 3e-3, 0.2])
def test_what_a_dashpot_yields_in_a_step(exponent: float, tau: float) -> None:
    """The pieces of the solution are few, begin in rising order and agree with a general ODE solver."""
    scale, top = 3.0, 30.0
    effect = RelaxingPlays(name="rate_dependence", shape="relaxation", time_constant=tau, exponent=exponent)
    rows = dashpot.pieces(effect, scale, T, top)
    assert len(rows) <= 64
    assert np.all(np.diff(rows[:, dashpot.BEGIN]) > 0.0)

    def law(_: float, e: Any) -> Any:
        return -scale / tau * (np.maximum(e, 0.0) / scale) ** exponent

    for x in np.geomspace(1e-3, top, 23):
        left = solve_ivp(law, (0.0, T), [x], method="LSODA", rtol=1e-10, atol=1e-12 * scale).y[0, -1]
        begin, *c = rows[np.searchsorted(rows[:, dashpot.BEGIN], x, side="right") - 1]
        yields = np.polynomial.polynomial.polyval(x - begin, c)
        assert yields == pytest.approx(x - max(left, 0.0), rel=1.1 * dashpot.YIELD_ERROR, abs=1e-9)


def run_calls(one: Model, calls: list[tuple[int, float]], arithmetic: str = "float64") -> tuple[Any, Any]:
    numbers = compiled(one, arithmetic)
    op, x = zip(*calls, strict=True)
    return reference.answers(numbers.tables, True, np.array(op, dtype=np.uint8), np.array(x))


def test_commits_and_holds_leave_no_trace() -> None:
    """The next reference is reached whatever was applied before."""
    one = model("creeping")
    rng = np.random.default_rng(3)
    u = 3.0 * np.sin(0.02 * np.arange(800))
    calls: list[tuple[int, float]] = []
    applied: list[float] = []
    for k, each in enumerate(u):
        calls.append((slots.OP_STEP, float(each) if rng.random() > 0.03 else math.nan))
        if k % 7 == 3:
            calls.append((slots.OP_COMMIT, float(rng.uniform(-3, 3))))
    answer, _ = run_calls(one, calls)
    free = []
    for i, (op, x) in enumerate(calls):
        if op == slots.OP_STEP:
            committed = i + 1 < len(calls) and calls[i + 1][0] == slots.OP_COMMIT
            applied.append(calls[i + 1][1] if committed else float(answer[i]))
            free.append(not committed and not math.isnan(x))
    y = one.simulate(applied)
    assert np.max(np.abs(y - u)[np.array(free)]) < 1e-12


def test_settle_and_reset_start_at_rest() -> None:
    one = model("creeping")
    calls = [(slots.OP_STEP, 2.0)] * 5 + [(slots.OP_SETTLE, 1.0), (slots.OP_EXPECTED, 0.0)] + [(slots.OP_STEP, 1.5)] * 3
    answer, _ = run_calls(one, calls)
    rest = one.simulate([float(answer[0]), 1.0])[0]
    assert rest == pytest.approx(2.0, abs=1e-12), "the first sample is a settled one"
    h = one.without(one.effects).simulate([float(answer[0]), 1.0])[1] - 0.5
    assert float(answer[6]) == pytest.approx(1.1 * h + 0.5, abs=1e-12), "rest at a drive: d + sum c_i"
    again, _ = run_calls(one, [*calls, (slots.OP_RESET, 2.0), (slots.OP_EXPECTED, 0.0)])
    fresh, _ = run_calls(one, [(slots.OP_RESET, 2.0), (slots.OP_EXPECTED, 0.0)])
    assert again[-1] == fresh[-1]


def test_a_sensor_trims_the_offset_and_settings_are_limited() -> None:
    one = model("creeping")
    calls = []
    for _ in range(200):  # the plant's output is 0.7 above the model's
        calls += [(slots.OP_STEP, 1.0), (slots.OP_EXPECTED, 0.0)]
    answer, _ = run_calls(one, calls)
    offset = 0.0
    for _ in range(200):
        offset += layout.VERIFIED_SHARE * (0.7 - offset)
    corrected = []
    for _ in range(200):
        corrected += [(slots.OP_STEP, 1.0), (slots.OP_CORRECT, 1.7)]
    numbers = compiled(one, "float64")
    op, x = zip(*corrected, (slots.OP_EXPECTED, 0.0), strict=True)
    found, _ = reference.answers(numbers.tables, True, np.array(op, dtype=np.uint8), np.array(x))
    assert float(found[-1]) == pytest.approx(1.7, abs=0.02), "what is expected comes to what is measured"
    assert float(answer[-2]) > float(found[-3]), "the drive has gone down by what the plant lies above"
    span = float(np.ptp([*numbers.tables.limits.output[0]]))
    _, status = run_calls(one, [(slots.OP_OFFSET, 3 * span), (slots.OP_OFFSET, math.nan), (slots.OP_OFFSET, 0.1)])
    assert status.tolist() == [slots.LIMITED_SETTING, slots.HELD, 0]


def test_a_temperature_is_compensated_from_the_next_step_on() -> None:
    one = model("warm")
    u = 4.0
    answer, status = run_calls(
        one, [(slots.OP_TEMPERATURE, 60.0), (slots.OP_STEP, u), (slots.OP_TEMPERATURE, 1e9), (slots.OP_STEP, u)]
    )
    y = one.simulate([float(answer[1])], extra={"temperature": [60.0]})
    assert y[0] == pytest.approx(u, abs=1e-12)
    assert status[2] & slots.LIMITED_SETTING
    assert np.isfinite(answer).all()


def test_preview_reads_ahead_what_is_late() -> None:
    """With a delay of 2.6 samples and a mode, references are read four samples ahead, with weights that sum to 1."""
    numbers = compiled(model("late"), "float64")
    assert numbers.ahead == 4
    assert numbers.taps is not None
    assert math.fsum(numbers.taps.weights) == pytest.approx(1.0, abs=1e-12)
    assert preview.taps(2.5 * T, [], T) == (2, pytest.approx([0.5, 0.5]))
    late = model("late")
    text = module.files(module.of(late, emit_options(late)))["late.h"]
    assert "#define LATE_PREVIEW 4 " in text
    assert "late_inverse_push(" in text
    assert "LATE_SAMPLE_TIME 0.001f" in text


def with_options(name: str, **options: Any) -> Model:
    one = model(name).parameters
    how = one.emit.compensation.model_copy(update=Compensation(**options).model_dump(exclude_unset=True))
    return Model(one.model_copy(update={"emit": one.emit.model_copy(update={"compensation": how})}))


def header(one: Model, macro: str) -> str:
    text = module.files(module.of(one, emit_options(one)))[f"{one.name}.h"]
    found = re.search(rf"#define {one.name.upper()}_{macro} (\S+)", text)
    assert found
    return found[1]


def test_noise_gain_is_that_of_an_impulse() -> None:
    """Without plays all is linear: the gain is the peak of the impulse response's spectrum over the static gain."""
    one = model("straight")
    numbers = compiled(one, "float64")
    n = 1 << 15
    u = np.full(n, 0.5)
    u[200] += 1e-3
    x = answers(numbers, Run(np.arange(n) * T, u, {}), True)
    gain = np.abs(np.fft.rfft(x - x[0])) / 1e-3
    rest = 1.0 / (2.0 * 1.1)  # weight 2, and finally 10 % creep
    assert numbers.noise_gain == pytest.approx(float(np.max(gain)) / rest, rel=1e-4)
    assert numbers.noise_gain > 50.0
    assert float(header(one, "NOISE_GAIN").rstrip("f")) == pytest.approx(numbers.noise_gain, rel=1e-6)


def test_five_references_leave_less_of_a_mode_than_three() -> None:
    left = []
    one = model("mode", chain("mode", "name: resonance, frequency: 20, damping: 0.1"))
    for number in (3, 5):
        numbers = tables.build(one.chain, "float64", T, Compensation(taps=number))
        u = 0.5 + 1.5 * np.sin(0.05 * np.arange(2000))
        v = answers(numbers, Run(np.arange(2000) * T, u, {}), True)
        left.append(float(np.std((one.simulate(v) - u)[1500:1990])))
    assert left[1] < 0.3 * left[0] < 1e-3, "what is left are the corners where plays turn"


@pytest.mark.thorough
def test_preview_hold_corner_and_rate_are_options() -> None:
    assert header(with_options("late"), "PREVIEW") == "4"
    assert header(with_options("late", preview=1), "PREVIEW") == "1"
    assert header(with_options("late", preview=9), "PREVIEW") == "9"
    assert header(with_options("late", taps=5), "PREVIEW") == "5"
    assert header(with_options("late", resonance="none"), "PREVIEW") == "3"
    assert header(with_options("creeping", drive_hold="held"), "PREVIEW") == "1"
    assert header(with_options("creeping", corner=5), "PREVIEW") == "6"
    assert header(with_options("creeping", max_rate=12.5), "MAX_RATE") == "12.5f"
    for options in ({"preview": 9}, {"corner": 4}, {"drive_hold": "held"}, {"taps": 5, "corner": 3}):
        one = with_options("late", **options)
        found = tables.build(one.chain, "float64", T, one.parameters.emit.compensation).taps
        assert found is not None
        assert math.fsum(found.weights) == pytest.approx(1.0, abs=1e-12)
        report = hystgen.verify(one, compiler=["gcc"], length=800)
        assert report.ok, report.table()
    ramp = preview.taps(0.0, [], T, corner=4)
    middle = math.fsum((ramp.first + k) * w for k, w in enumerate(ramp.weights))
    assert middle == pytest.approx(0.0, abs=1e-12), "rounding corners moves nothing in time"


MODES = [(20.0, 1e-3), (20.0, 0.02), (77.0, 0.1), (150.0, 0.3), (310.0, 0.05), (3.0, 0.69)]


@pytest.mark.parametrize("by", ["shaper", "notch"])
@pytest.mark.parametrize(("frequency", "damping"), MODES)
def test_a_shaped_step_does_not_ring(frequency: float, damping: float, by: preview.By) -> None:
    """For a drive that is linear between samples, scipy's mode is at rest once the last weight has acted."""
    mode = Resonance(name="resonance", frequency=frequency, damping=damping)
    found = preview.taps(0.0, [mode], T, by=by)
    w0 = 2.0 * np.pi * frequency
    assert found.ahead == 0
    assert math.fsum(found.weights) == pytest.approx(1.0, abs=1e-12)
    if by == "shaper":
        assert np.min(found.weights) >= 0.0, "no step is larger than that of the reference"
    else:
        assert len(found.weights) <= 4.0 / (w0 * T) + 6.0, "over in four of the mode's 1/w0"
    v = np.append(np.zeros(len(found.weights) - 1), np.cumsum(found.weights[::-1]))
    v = np.append(v, np.ones(300))
    y = signal.lsim(([w0**2], [1.0, 2.0 * damping * w0, w0**2]), v, T * np.arange(len(v)))[1]
    assert np.max(np.abs(y - 1.0)[2 * len(found.weights) :]) < 1e-9
    assert np.max(y) <= 1.0 + 1e-9


@pytest.mark.parametrize(("frequency", "damping"), MODES[:3])
def test_a_notch_is_two_poles_that_come_to_an_end(frequency: float, damping: float) -> None:
    """Compared with a double pole `exp(-w0 T)`, the mean delay is longer by at most part of a sample, the gain at half
    the sample rate is no higher, and the averages end while the poles still miss over 5 % of a step."""
    mode = Resonance(name="resonance", frequency=frequency, damping=damping)
    found = preview.taps(0.0, [mode], T, by="notch")
    pole = math.exp(-2.0 * math.pi * frequency * T)
    a1, a2 = mode.denominator(T)
    zeros = np.array([1.0, a1, a2]) / (1.0 + a1 + a2)
    both = signal.lfilter(zeros * (1.0 - pole) ** 2, np.convolve([1.0, -pole], [1.0, -pole]), np.eye(1, 4000)[0])
    ages = np.arange(len(found.weights))
    part = 0.25 / (1.0 + 2.0 * pole / (1.0 - pole))
    assert 0.0 <= found.weights[::-1] @ ages - both @ np.arange(4000) <= part
    assert 1.0 - np.sum(both[: len(ages)]) > 0.05
    gains = [np.abs(np.fft.rfft(each, 8192))[-1] for each in (found.weights, both)]
    assert gains[0] <= gains[1] * (1.0 + 1e-9)


@pytest.mark.parametrize(("by", "left"), [("shaper", 0.147), ("notch", 0.135)])
def test_a_mode_that_is_not_as_identified_rings(by: preview.By, left: float) -> None:
    """A mode 10 % too low rings by the fraction of a step that the docs state, and a mode 10 % too high by no more."""
    found = preview.taps(0.0, [Resonance(name="resonance", frequency=20.0, damping=0.02)], 1e-4, by=by)
    v = np.concatenate([[0.0], np.cumsum(found.weights[::-1]), np.ones(1500)])
    rings = []
    for w0 in (2.0 * np.pi * 18.0, 2.0 * np.pi * 22.0):
        y = signal.lsim(([w0**2], [1.0, 0.04 * w0, w0**2]), v, 1e-4 * np.arange(len(v)))[1]
        rings.append(np.max(np.abs(y - 1.0)[len(found.weights) :]))
    assert rings[0] == pytest.approx(left, abs=5e-4)
    assert rings[1] <= rings[0]


@pytest.mark.thorough(but_one_in=2)
@pytest.mark.parametrize("by", ["shaper", "notch"])
def test_what_shapes_is_emitted_with_the_bits_of_the_reference(by: str) -> None:
    one = with_options("late", resonance=by)
    with jit.plain():
        for arithmetic in ("float32", "float64", "q31", "q15"):
            report = hystgen.verify(one, arithmetic, compiler=["gcc"], length=200)
            assert report.ok, report.table()
    slow = CHAINS["late"].replace("frequency: 30", "frequency: 0.4")
    one = model("slow", slow + f"emit: {{compensation: {{resonance: {by}}}}}\n")
    what = {
        "shaper": r"half a period of 0\.4 Hz is 125. samples, and the C keeps 1000 at most",
        "notch": r"a notch for 0\.4 Hz takes 1594 samples, and the C keeps 1000 at most",
    }[by]
    with pytest.raises(FormatError, match=what):
        tables.build(one.chain, "float32", T, one.parameters.emit.compensation)
    modes = [Resonance(name="resonance", frequency=frequency, damping=0.02) for frequency in (0.9, 1.1)]
    with pytest.raises(FormatError, match=r"the modes take 1\d\d\d samples in series, and the C keeps 1000"):
        preview.taps(0.0, modes, T, by=by)
    assert len(preview.taps(0.0, modes[1:], T, by=by).weights) <= 1000


@pytest.mark.parametrize("by", ["shaper", "notch"])
def test_what_shapes_says_how_late_it_is(by: str) -> None:
    """The stated delay and error agree with the stage's motion along a ramp and a sine."""
    one = with_options("straight", resonance=by)
    how = one.parameters.emit.compensation
    numbers, plain = tables.build(one.chain, "float64", T, how), compiled(model("straight"), "float64")
    text = module.files(module.of(one, emit_options(one)))["straight.h"].replace("\n * ", " ")
    form = r"the motion ([0-9.]+) samples late, and the error of a sine at 200 samples .* is ([0-9.]+) %"
    found = re.search(form, text)
    assert found
    assert "which is" in text
    k = np.arange(900)
    for u in (np.interp(k, [200, 900], [0.0, 3.0]), np.sin(2.0 * np.pi * k / 200.0)):
        with jit.plain():
            y, exact = (one.simulate(answers(each, Run(k * T, u, {}), True), t=k * T) for each in (numbers, plain))
        if u[-1] > 2.0:
            late = np.mean((exact - y)[700:890]) / (u[-1] - u[-2])
            assert late == pytest.approx(float(found[1]), rel=5e-3)
            assert numbers.late == pytest.approx(late, rel=2e-3)
        else:
            tone = np.exp(-2j * np.pi * k[400:800] / 200.0)
            missed = np.abs(np.sum(tone * (y - exact)[400:800]) / np.sum(tone * exact[400:800]))
            assert 100.0 * missed == pytest.approx(float(found[2]), rel=2e-2)


DOUBTFUL = 'not_separable: [[asymmetry, sensor_nonlinearity], [creep, drift]]\n'


def test_a_front_that_may_be_the_sensor_s_is_emitted_with_a_warning(
    tmp_path: Path, run: Callable[..., tuple[int, str, str]]
) -> None:
    for name, text, wanted in (
        ("logarithmic", CHAINS["logarithmic"] + DOUBTFUL, True),
        ("logarithmic", CHAINS["logarithmic"], False),
        ("logarithmic", CHAINS["logarithmic"] + DOUBTFUL.replace("asymmetry", "saturation"), False),
        ("creeping", CHAINS["creeping"] + DOUBTFUL, False),
        ("curved", FILES["curved"] + DOUBTFUL, True),
    ):
        path = tmp_path / "one.yaml"
        path.write_text(text)
        code, out, err = run("emit", path, "-o", tmp_path / "out")
        assert code == 0, err
        assert (f"warning: {name}: the memoryless part was diagnosed as asymmetry" in err) == wanted
        assert ("nested loops" in err) == wanted
        assert ("the inverse bends the true motion" in err) == wanted
        assert f"{name}.c" in out
    parameters = parse_parameters(CHAINS["creeping"] + DOUBTFUL, "f")
    assert parse_parameters(dump_parameters(parameters), "f") == parameters
    plain = parse_parameters(CHAINS["creeping"], "f")
    assert parameters_sha256(parameters) != parameters_sha256(plain)
    assert "not_separable" not in canonical_json(plain)


@pytest.mark.parametrize("name", ["aged", "warm", "late", "drifting", "everything"])
def test_the_self_test_calls_the_settings_of_the_model(name: str) -> None:
    """The self-test calls each setting, and one with a value beyond its limits."""
    one = model(name)
    text = emitted_files(one, operator=operator(name))
    calls = set(re.findall(rf"{name}_inverse_(push|settle|set_\w+)\(", text[f"{name}.h"]))
    tested = dict(re.findall(rf"kind == '(\w)'\) {{\n +{name}_inverse_(\w+)\(", text[f"{name}_selftest.c"]))
    assert set(tested.values()) == calls | {"reset", "commit"}
    samples = text[f"{name}_selftest.c"].partition("_selftest_inverse[")[2].partition("};")[0]
    counts = Counter(re.findall(r"{'(\w)'", samples))
    assert all(counts[letter] >= 1 for letter in tested)
    # only settings set this bit, but a later call may be the first to report it
    assert any(int(status) & slots.LIMITED_SETTING for status in re.findall(r", (\d+)u}", samples))


def test_only_what_the_model_has_is_emitted() -> None:
    one = model("creeping")
    text = module.files(module.of(one, emit_options(one)))["creeping.h"]
    calls = set(re.findall(r"creeping_inverse_(\w+)\(", text))
    assert calls == {"init", "reset", "step", "commit", "status", "settle", "set_offset", "expected", "correct"}
    one = model("aged")
    text = module.files(module.of(one, emit_options(one)))["aged.h"]
    calls = set(re.findall(r"aged_inverse_(\w+)\(", text))
    assert {"travel", "set_travel", "set_gain"} <= calls


@pytest.mark.slow(one_in=7)
@pytest.mark.thorough(but_one_in=12)
@pytest.mark.parametrize("name", CHAINS)
@pytest.mark.parametrize("arithmetic", ["float32", "q31", "q15"])
def test_memory_in_the_banner_is_that_of_the_compiler(name: str, arithmetic: str, tmp_path: Path) -> None:
    """Memory is checked with the cheaper engine, then with the loop engine."""
    one = noisy(name)
    for engine in dict.fromkeys([one.engine("auto", operator(name), arithmetic), "loop"]):
        memory_is_that_of_the_compiler(one, arithmetic, engine, tmp_path / engine)


def memory_is_that_of_the_compiler(one: Model, arithmetic: str, engine: str, tmp_path: Path) -> None:
    name = one.name
    whole = module.of(one, emit_options(one, operator(name), arithmetic, engine))
    instances = whole.cost.memory.instances
    tmp_path.mkdir()
    (tmp_path / f"{name}.h").write_text(module.files(whole)[f"{name}.h"])
    sizes = "".join(f'    printf("%u ", (unsigned)sizeof({name}_{op}_t));\n' for op, _ in instances)
    main = f"int main(void)\n{{\n{sizes}    return 0;\n}}\n"
    (tmp_path / "size.c").write_text(f'#include "{name}.h"\n#include <stdio.h>\n{main}')
    subprocess.run(["gcc", "-std=c99", "-I", tmp_path, tmp_path / "size.c", "-o", tmp_path / "size"], check=True)
    found = subprocess.run([tmp_path / "size"], capture_output=True, text=True, check=True).stdout.split()
    assert found == [str(size) for _, size in instances]


REFUSED = {
    "name: drift, rate: 0.1": "a clock that runs by itself",
    "name: thermal, source: self_heating, time_constant: 60, heating: 1.0e-5, gain_per_degree: 0.001": "own heat",
    "name: noncongruent, coefficients: [[9], [9], [9], [9], [9], [9]]": "there is no inverse",
    "name: bouc_wen, weights: [-9], widths: [1]": "right after a turn the output falls as the drive rises",
}


@pytest.mark.parametrize(("effect", "reason"), REFUSED.items())
def test_what_has_no_inverse_is_refused_or_left_out_and_named(effect: str, reason: str) -> None:
    one = model("part", chain("part", effect, CHAINS["creeping"].split("- {")[1].split("}")[0]))
    with pytest.raises((UnsupportedEffectsError, hystgen.NotInvertibleError), match=reason):
        emit_options(one)
    options = emit_options(one, allow_partial=True)
    assert len(options.left_out) == 1
    assert reason in options.left_out[0]
    text = emitted_files(one, allow_partial=True)["part.h"]
    said = " ".join(text.split("*/")[0].replace("\n *", " ").split())
    assert "Not compensated: " + effect.split(",")[0].removeprefix("name: ") in said
    assert "um rms over sweeps" in said
    assert "--allow-partial" in said
    assert "part_creep" in emitted_files(one, allow_partial=True)["part.c"], "what there is stays"


def test_bent_plays_may_be_too_steep_for_thresholds_that_grow_with_the_rate() -> None:
    wider = "name: rate_dependence, betas: [1.09e-3, 0, 0, 0, 0, 0]"
    for amplitude, refused in ((11.0, False), (13.0, True)):
        bump = f"name: noncongruent, shape: centre, amplitude: {amplitude}, centre: 0, width: 2"
        one = model("steep", chain("steep", wider, bump))
        if not refused:
            assert emit_options(one, operator="inverse").operator == "inverse"
            continue
        for arithmetic in ("float32", "q31"):
            with pytest.raises(UnsupportedEffectsError, match=r"fall in a step as the drive rises, by 0\.0"):
                emit_options(one, operator="inverse", arithmetic=arithmetic)


def test_needs_a_sample_time_and_room(tmp_path: Path) -> None:
    text = CHAINS["creeping"].replace("sample_time: 1.0e-3\n", "")
    with pytest.raises(EffectsError, match="needs sample_time"):
        emit_options(model("creeping", text))
    with pytest.raises(UnsupportedEffectsError, match=r"62010 codes .* moves the drive by 5.3 % of its range"):
        emit_options(model("straight", CHAINS["straight"].replace(ALLOWED, "")), arithmetic="q15")
    for rate, slow, arithmetic, finer in (
        ("1.0e-3", "1.0e-7", "q15", "q31"), ("1.0e-4", "1.0e-6", "float32", "float64"),
    ):  # fmt: skip
        compiled(model("slow", chain("slow", f"name: slew_limit, rate: {rate}")), arithmetic)
        slower = f"name: slew_limit, rate: {slow}"
        with pytest.raises(FormatError, match=rf"its range in \S+ samples, too slow for {arithmetic}; use {finer}, or"):
            compiled(model("slow", chain("slow", slower)), arithmetic)
    with pytest.raises(FormatError, match="creep: states and constants do not fit q31"):
        compiled(model("slow", chain("slow", "name: creep, time_constants: [1.0e+7], weights: [9.0]")), "q31")
    with pytest.raises(FormatError, match="a lag: states and constants do not fit q31"):
        compiled(model("slow", chain("slow", "name: lag, time_constant: 1.0e9")), "q31")
    long = model("remote", chain("remote", "name: delay, time: 33"))
    with pytest.raises(UnsupportedEffectsError, match="33000 samples, and the forward operator keeps 32768 at most"):
        emit_options(long, operator="both")
    assert emit_options(long).operator == "inverse", "a preview of any length"
    with pytest.raises(FormatError, match="too large for float32"):
        compiled(model("huge", chain("huge", "name: lag, time_constant: 1.0e30")), "float32")
    assert list(tmp_path.iterdir()) == []


def test_simulate_in_an_arithmetic_takes_even_times() -> None:
    one = model("creeping")
    u = np.sin(0.01 * np.arange(300))
    exact = one.inverse().simulate(u, clamp=True)
    assert np.max(np.abs(one.inverse().simulate(u, "float32") - exact)) < 1e-4
    assert np.max(np.abs(one.simulate(exact, "float64") - one.simulate(exact))) < 1e-12
    with pytest.raises(EffectsError, match=re.escape("a sample every sample_time = 0.001 s")):
        one.inverse().simulate(u, "float32", t=np.arange(300) * 2e-3)


@pytest.mark.thorough
def test_a_constant_reference_stays_within_the_bound() -> None:
    """The reference rests for 10^6 samples after a move; the slowest time constant is a third of that."""
    one = model("creeping")
    numbers, double = compiled(one, "float32"), compiled(one, "float64")
    n = 1_000_000
    u = np.where(np.arange(n) < 50, 0.0, 2.5)
    op = np.full(n, slots.OP_STEP, dtype=np.uint8)
    single, _ = reference.answers(numbers.tables, True, op, u)
    exact, _ = reference.answers(double.tables, True, op, u)
    assert np.max(np.abs(single.astype(float) - exact)) <= bounds.chain_bounds(numbers, "float32").inverse
