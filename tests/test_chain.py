"""The C of models with effects: its bits, what it composes to with the forward model, its bounds, its refusals."""

from __future__ import annotations

import math
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from modelfiles import CHAINS, FLOAT_ALONE, INVERSE_ALONE, chain

import hystgen
from hystgen.basics.problems import EffectsError, FormatError, UnsupportedEffectsError
from hystgen.compensator import reference
from hystgen.compensator.chain import bounds, preview, tables
from hystgen.compensator.chain.run import answers
from hystgen.compensator.chained import Compensator
from hystgen.effects import Run
from hystgen.effects.ageing import compensator as ageing
from hystgen.emission import module
from hystgen.emission.calls import emit_options, emitted_files
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.parameters.schema import Compensation
from hystgen.plays import slots

T, N = 1e-3, 1500


def model(name: str, text: str | None = None) -> Model:
    return Model(parse_parameters(text or CHAINS[name], f"{name}.yaml"))


FIXED = [name for name in CHAINS if name not in FLOAT_ALONE]
EVERY = [(name, arithmetic) for name in CHAINS for arithmetic in ("float32", "float64")] + [
    (name, arithmetic) for name in FIXED for arithmetic in ("q31", "q15")
]


def noisy(name: str) -> Model:
    """A model of which fixed point may make any noise."""
    return with_options(name, noise_gain=1e9)


def operator(name: str) -> str:
    return "inverse" if name in INVERSE_ALONE else "both"


def compiled(one: Model, arithmetic: str) -> tables.Compiled:
    return tables.build(one.chain, arithmetic, T)


def record(one: tables.Compiled, seed: int, n: int = N, share: float = 1.0) -> Run:
    """A smooth reference with plateaus, over a share of the output range, no faster than what bounds hold for."""
    rng = np.random.default_rng(seed)
    low, high = (float(end) for end in one.tables.limits[slots.OUTPUT_MIN : slots.OUTPUT_MAX + 1])
    still = rng.random(n) < 0.2
    still[n // 2 : n // 2 + 100] = True
    phase = np.cumsum(np.where(still, 0.0, rng.uniform(0.0, 0.03, n)))
    u = 0.5 * (low + high) + 0.5 * share * (high - low) * np.sin(phase)
    return Run(np.arange(n) * T, np.clip(np.float32(u).astype(float), low, high), {"temperature": 20.0 + u})


@pytest.mark.parametrize(("name", "arithmetic"), EVERY)
def test_c_gives_the_bits_of_the_reference(name: str, arithmetic: str) -> None:
    report = hystgen.verify(noisy(name), arithmetic, operator(name), compiler=["gcc"], length=1500)
    assert report.ok, report.table()
    assert {row.operator for row in report.rows} >= ({"inverse"} if operator(name) == "inverse" else {"forward"})


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("name", "arithmetic"),
    [("everything", "float32"), ("viscous", "float32"), ("aged", "float32"), ("everything", "q31"),
     ("everything", "q15"), ("worn", "q15"), ("quick", "q15")],
)  # fmt: skip
def test_cores_give_the_same_bits(name: str, arithmetic: str) -> None:
    cores = ["cortex-m4f", "cortex-m0plus", "cortex-m7", "cortex-m33", "rv32imac", "mips32"]
    known = [core for core in cores if core in hystgen.verification.targets.NAMES]
    report = hystgen.verify(noisy(name), arithmetic, operator(name), targets=known, target_length=150)
    assert report.ok, report.table()


EXACT = dict.fromkeys(("creeping", "logarithmic", "warm", "quick", "dilated", "bumpy"), 1e-12) | {
    "viscous": 2e-4, "relaxing": 2e-4,
}  # fmt: skip


@pytest.mark.parametrize("name", EXACT)
@pytest.mark.parametrize("seed", range(3))
def test_composes_with_the_forward_model_that_shares_no_code(name: str, seed: int) -> None:
    """Of the output range at every sample that no limit acts on; viscous plays but for contacts inside a step."""
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
    span = float(np.ptp(numbers.tables.limits[slots.OUTPUT_MIN : slots.OUTPUT_MAX + 1]))
    assert np.mean(free) > 0.8
    assert np.max(np.abs(y - run.v)[free]) <= EXACT[name] * span


def test_ageing_leaves_the_gain_of_one_sample() -> None:
    one = model("worn")
    numbers = compiled(one, "float64")
    run = record(numbers, 5, share=0.6)
    v = answers(numbers, run, True)
    left = np.max(np.abs(one.simulate(v, t=run.t) - run.v))
    step = np.max(np.abs(np.diff(v)))
    steep = max(abs(ageing.steepness(one.effects[0], x)) for x in (0.0, 5.0))  # type: ignore[arg-type]
    assert 0.0 < left <= np.max(np.abs(run.v)) * (steep * step + ageing.TABLE_ERROR)


@pytest.mark.parametrize("name", CHAINS)
@pytest.mark.parametrize("seed", [11, 12])
def test_stays_within_its_bounds(name: str, seed: int) -> None:
    """float32 against the compensator in double precision, and forward against the chain."""
    one = model(name)
    numbers = compiled(one, "float32")
    bound = bounds.chain_bounds(numbers, "float32")
    run = record(numbers, seed)
    ends = tuple(float(end) for end in numbers.tables.limits[:2])
    v = answers(numbers, run, True).astype(float)
    wanted = Compensator(one.chain).drives(run, ends)  # type: ignore[arg-type]
    known = N - numbers.ahead
    assert np.max(np.abs(v - wanted)[:known]) <= bound.inverse
    if operator(name) == "both":
        forward = answers(numbers, Run(run.t, v, run.extra), False).astype(float)
        slew = [effect.rate * T for effect in one.effects if effect.name == "slew_limit"]
        assert not slew or np.max(np.abs(np.diff(v))) <= max(slew) * (1 + 1e-6)
        assert np.max(np.abs(forward - one.simulate(v, t=run.t, extra=run.extra))) <= bound.forward


def test_slow_states_neither_stall_nor_drift() -> None:
    """tau/T of 2^28: after a step of the drive the state goes where it would go without rounding."""
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


def run_calls(one: Model, calls: list[tuple[int, float]], arithmetic: str = "float64") -> tuple[Any, Any]:
    numbers = compiled(one, arithmetic)
    op, x = zip(*calls, strict=True)
    return reference.answers(numbers.tables, True, np.array(op, dtype=np.uint8), np.array(x))


def test_commits_and_holds_leave_no_trace() -> None:
    """Whatever was applied, the next reference is reached."""
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
    for _ in range(200):  # the plant lies 0.7 above the model
        calls += [(slots.OP_STEP, 1.0), (slots.OP_EXPECTED, 0.0)]
    answer, _ = run_calls(one, calls)
    offset = 0.0
    for _ in range(200):
        offset += tables.VERIFIED_SHARE * (0.7 - offset)
    corrected = []
    for _ in range(200):
        corrected += [(slots.OP_STEP, 1.0), (slots.OP_CORRECT, 1.7)]
    numbers = compiled(one, "float64")
    op, x = zip(*corrected, (slots.OP_EXPECTED, 0.0), strict=True)
    found, _ = reference.answers(numbers.tables, True, np.array(op, dtype=np.uint8), np.array(x))
    assert float(found[-1]) == pytest.approx(1.7, abs=0.02), "what is expected comes to what is measured"
    assert float(answer[-2]) > float(found[-3]), "the drive has gone down by what the plant lies above"
    span = float(np.ptp(numbers.tables.limits[slots.OUTPUT_MIN : slots.OUTPUT_MAX + 1]))
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
    """A delay of 2.6 samples and a mode: four samples ahead, weights that sum to 1."""
    numbers = compiled(model("late"), "float64")
    assert numbers.ahead == 4
    assert numbers.taps is not None
    assert math.fsum(numbers.taps.weights) == pytest.approx(1.0, abs=1e-12)
    assert preview.taps(2.5 * T, [], T) == (2, pytest.approx([0.5, 0.5]))
    text = module.files(model("late").parameters, model("late").cascade, emit_options(model("late")))["late.h"]
    assert "#define LATE_PREVIEW 4 " in text
    assert "late_inverse_push(" in text
    assert "LATE_SAMPLE_TIME 0.001f" in text


def with_options(name: str, **options: Any) -> Model:
    one = model(name).parameters
    how = Compensation(**options)
    return Model(one.model_copy(update={"emit": one.emit.model_copy(update={"compensation": how})}))


def header(one: Model, macro: str) -> str:
    text = module.files(one.parameters, one.cascade, emit_options(one))[f"{one.name}.h"]
    found = re.search(rf"#define {one.name.upper()}_{macro} (\S+)", text)
    assert found
    return found[1]


def test_noise_gain_is_that_of_an_impulse() -> None:
    """Without plays everything is linear: the spectrum of the answer to an impulse, over that at rest."""
    one = model("straight")
    numbers = compiled(one, "float64")
    n = 1 << 15
    u = np.full(n, 0.5)
    u[200] += 1e-3
    x = answers(numbers, Run(np.arange(n) * T, u, {}), True)
    gain = np.abs(np.fft.rfft(x - x[0])) / 1e-3
    rest = 1.0 / (2.0 * 1.1)  # weight 2, and creep of 10 % in the end
    assert numbers.noise_gain == pytest.approx(float(np.max(gain)) / rest, rel=1e-2)
    assert numbers.noise_gain > 50.0
    assert float(header(one, "NOISE_GAIN").rstrip("f")) == pytest.approx(numbers.noise_gain, rel=1e-6)
    allowed = with_options("straight", noise_gain=2.0 * numbers.noise_gain)
    assert emit_options(allowed).engine == "loop"
    with pytest.raises(UnsupportedEffectsError, match="noise gain of"):
        emit_options(with_options("straight", noise_gain=0.5 * numbers.noise_gain))
    rounded = with_options("straight", corner=9, noise_gain=0.5 * numbers.noise_gain)
    assert emit_options(rounded).engine == "loop", "rounded corners hold less noise"


def test_five_references_leave_less_of_a_mode_than_three() -> None:
    left = []
    one = model("mode", chain("mode", "name: resonance, frequency: 20, damping: 0.1"))
    for number in (3, 5):
        numbers = tables.build(one.chain, "float64", T, Compensation(taps=number))
        u = 0.5 + 1.5 * np.sin(0.05 * np.arange(2000))
        v = answers(numbers, Run(np.arange(2000) * T, u, {}), True)
        left.append(float(np.std((one.simulate(v) - u)[1500:1990])))
    assert left[1] < 0.3 * left[0] < 1e-3, "what is left are the corners where plays turn"


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


def test_only_what_the_model_has_is_emitted() -> None:
    one = model("creeping")
    text = module.files(one.parameters, one.cascade, emit_options(one))["creeping.h"]
    calls = set(re.findall(r"creeping_inverse_(\w+)\(", text))
    assert calls == {"init", "reset", "step", "commit", "status", "settle", "set_offset", "expected", "correct"}
    one = model("aged")
    text = module.files(one.parameters, one.cascade, emit_options(one))["aged.h"]
    calls = set(re.findall(r"aged_inverse_(\w+)\(", text))
    assert {"travel", "set_travel", "set_gain"} <= calls


@pytest.mark.parametrize(("name", "arithmetic"), [pair for pair in EVERY if pair[1] != "float64"])
def test_memory_in_the_banner_is_that_of_the_compiler(name: str, arithmetic: str, tmp_path: Path) -> None:
    one = noisy(name)
    options = emit_options(one, operator(name), arithmetic)
    cost = module.cost_of(one.parameters, one.cascade, options)
    hystgen.emit(one, tmp_path, operator=operator(name), arithmetic=arithmetic)
    sizes = "".join(f'    printf("%u ", (unsigned)sizeof({name}_{op}_t));\n' for op, _ in cost.memory.instances)
    main = f"int main(void)\n{{\n{sizes}    return 0;\n}}\n"
    (tmp_path / "size.c").write_text(f'#include "{name}.h"\n#include <stdio.h>\n{main}')
    subprocess.run(["gcc", "-std=c99", "-I", tmp_path, tmp_path / "size.c", "-o", tmp_path / "size"], check=True)
    found = subprocess.run([tmp_path / "size"], capture_output=True, text=True, check=True).stdout.split()
    assert found == [str(size) for _, size in cost.memory.instances]


REFUSED = {
    "name: drift, rate: 0.1": "a clock that runs alone",
    "name: thermal, source: self_heating, time_constant: 60, heating: 1.0e-5, gain_per_degree: 0.001": "own heat",
    "name: rate_dependence, shape: relaxation, time_constant: 0.01, exponent: 2": "exponent other than 1",
    "name: noncongruent, coefficients: [[9], [9], [9], [9], [9], [9]]": "there is no inverse",
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


def test_needs_a_sample_time_and_room(tmp_path: Path) -> None:
    text = CHAINS["creeping"].replace("sample_time: 1.0e-3\n", "")
    with pytest.raises(EffectsError, match="needs sample_time"):
        emit_options(model("creeping", text))
    for name in FLOAT_ALONE:
        with pytest.raises(UnsupportedEffectsError, match="in fixed point there is no C for plays that"):
            emit_options(model(name), arithmetic="q15", operator="inverse")
    assert emit_options(model("viscous"), arithmetic="q31", allow_partial=True).left_out
    with pytest.raises(UnsupportedEffectsError, match=r"of the 62010 codes .* moves the drive by 5.3 % of its range"):
        emit_options(model("straight"), arithmetic="q15")
    with pytest.raises(FormatError, match=r"slew_limit: 0\.819 drive codes a sample are less than one"):
        compiled(model("slow", chain("slow", "name: slew_limit, rate: 0.1")), "q15")
    with pytest.raises(FormatError, match="creep: its states and constants do not fit q31"):
        compiled(model("slow", chain("slow", "name: creep, time_constants: [1.0e+7], weights: [9.0]")), "q31")
    with pytest.raises(FormatError, match="a lag: its states and constants do not fit q31"):
        compiled(model("slow", chain("slow", "name: lag, time_constant: 1.0e9")), "q31")
    with pytest.raises(UnsupportedEffectsError, match="only the inverse has it"):
        emit_options(model("late"), operator="both")
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


def test_a_constant_reference_stays_within_the_bound() -> None:
    """10^6 samples at rest after a move, the slowest state a third of a second of them."""
    one = model("creeping")
    numbers, double = compiled(one, "float32"), compiled(one, "float64")
    n = 1_000_000
    u = np.where(np.arange(n) < 50, 0.0, 2.5)
    op = np.full(n, slots.OP_STEP, dtype=np.uint8)
    single, _ = reference.answers(numbers.tables, True, op, u)
    exact, _ = reference.answers(double.tables, True, op, u)
    assert np.max(np.abs(single.astype(float) - exact)) <= bounds.chain_bounds(numbers, "float32").inverse
