"""Models with effects in q31 and q15: bounds hold, no call overflows, and states neither stall nor cycle."""

from __future__ import annotations

import itertools
import math
import re
import subprocess
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from granted import clock, granted_states
from modelfiles import BRAKED, CALM, CHAINS, INVERSE_ALONE, STEADY, TANH, chain

from hystgen.arithmetic import ARITHMETICS, factors
from hystgen.basics import jit
from hystgen.compensator import reference
from hystgen.compensator.chain import bounds, moving, tables
from hystgen.compensator.chain.fixed_tables import TEMPERATURE_BITS
from hystgen.compensator.chain.layout import Codes, Compiled
from hystgen.compensator.chain.run import answers
from hystgen.compensator.chained import Compensator
from hystgen.effects import Run
from hystgen.effects.base import Array
from hystgen.effects.drift import fixed as drift
from hystgen.effects.drift.model import CurvedDrift
from hystgen.effects.noncongruent import fixed as bent_fixed
from hystgen.effects.rate_dependence import compensator as dashpot
from hystgen.effects.rate_dependence import fixed as dashpot_fixed
from hystgen.effects.rate_dependence.model import RelaxingPlays
from hystgen.effects.thermal import compensator as thermal
from hystgen.effects.thermal import fixed as thermal_fixed
from hystgen.effects.thermal.model import HysteresisHeating, OwnHeat, SelfHeating
from hystgen.emission import module
from hystgen.emission.calls import emit_options, emitted_files
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.parameters.schema import Compensation
from hystgen.plays import slots
from hystgen.verification import sources

T, N = 1e-3, 1500
BOTH = pytest.mark.parametrize("arithmetic", ["q31", "q15"])


pytestmark = pytest.mark.usefixtures("brief")


def model(text: str) -> Model:
    one = parse_parameters(text, "fixed.yaml")
    how = one.emit.compensation.model_copy(update={"noise_gain": 1e9})
    return Model(one.model_copy(update={"emit": one.emit.model_copy(update={"compensation": how})}))


def compiled(one: Model, arithmetic: str) -> tuple[Compiled, Codes]:
    found = tables.build(one.chain, arithmetic, T)
    assert found.codes is not None
    return found, found.codes


def test_factors_are_multiplied_like_fractions() -> None:
    rng = np.random.default_rng(1)
    for _ in range(3000):
        exact = float(rng.choice([-1.0, 1.0]) * 2.0 ** rng.uniform(-60.0, 9.99))
        mantissa, shift = factors.factor(exact)
        assert abs(Fraction(mantissa, 2**shift) - Fraction(exact)) <= Fraction(abs(exact)) / 2**31 + Fraction(1, 2**83)
        x = int(rng.choice([-1, 1])) * (int(2.0 ** rng.uniform(0.0, 51.0)) - 1)
        with jit.plain():
            found = int(factors.times(np.int64(x), np.int64(mantissa), np.int64(shift)))
        assert abs(found - x * Fraction(mantissa, 2**shift)) <= Fraction(1, 2)
    with pytest.raises(OverflowError, match="1024 is not a factor below 1024"):
        factors.factor(1024.0)


def record(one: Compiled, codes: Codes, seed: int, share: float) -> tuple[Run, Run]:
    """A smooth reference with plateaus over a fraction of the output range, in codes and in physical units."""
    rng = np.random.default_rng(seed)
    low, high = (float(end) for end in one.tables.limits.output[0])
    still = rng.random(N) < 0.2
    still[N // 2 : N // 2 + 100] = True
    phase = np.cumsum(np.where(still, 0.0, rng.uniform(0.0, 0.03, N)))
    u = np.rint(0.5 * (low + high) + 0.5 * share * (high - low) * np.sin(phase))
    y = u * float(codes.output_lsb)
    degree = 2.0 ** TEMPERATURE_BITS[int(one.tables.limits.code_max[0]).bit_length()]
    extra = {"temperature": np.rint((20.0 + y) * degree) / degree}
    t = np.arange(N) * T
    return Run(t, u, extra), Run(t, y, extra)


STILL = {
    "creep": ("name: creep, time_constants: [0.01, 0.1, 0.3], weights: [0.02, 0.03, 0.05]",),
    "lag": ("name: lag, time_constant: 0.01",),
    "exact": ("name: lag, time_constant: 4.0e-4",),
    "lag_and_creep": ("name: lag, time_constant: 0.01", "name: creep, time_constants: [0.1], weights: [0.05]"),
}

CONDITIONAL = ("lagging", "quick", "straight", "everything", "wider", "dilated", "forgetful", "gliding", "sloping")
"""Chains for whose inverse no bound is known, except under a condition."""

BRANCHED = ("lagging", "aged", "everything", "relaxing")
"""Chains whose memoryless part has two branches: fixed point is sometimes on the other branch for a sample."""


@pytest.mark.slow(one_in=5)
@pytest.mark.thorough(but_one_in=8)
@pytest.mark.parametrize("name", CHAINS)
@BOTH
@pytest.mark.parametrize(("seed", "share"), [(11, 1.0), (12, 0.5)])
def test_stays_within_its_bounds(name: str, arithmetic: str, seed: int, share: float) -> None:
    """Errors from the compensator and the chain in double precision, which share no code with fixed point."""
    one = model(CHAINS[name])
    numbers, codes = compiled(one, arithmetic)
    given, exact = record(numbers, codes, seed, share)
    drive = float(codes.drive_lsb)
    v = answers(numbers, given, True).astype(float)
    ends = tuple(float(end) * drive for end in numbers.tables.limits.drive[0])
    wanted = Compensator(one.chain, one.parameters.emit.compensation).drives(exact, ends) / drive  # type: ignore[arg-type]
    left = np.abs(v - wanted)[: N - numbers.ahead]
    assert np.max(left) <= codes.inverse_error
    assert bool(codes.condition) == (name in CONDITIONAL)
    if name not in BRANCHED and not codes.condition:
        assert np.max(left) <= codes.inverse_rounding
    if name not in INVERSE_ALONE:
        forward = answers(numbers, Run(given.t, v, given.extra), False).astype(float)
        y = one.simulate(v * drive, t=given.t, extra=exact.extra) / float(codes.output_lsb)
        most = int(numbers.tables.limits.code_max[0])
        y = np.clip(y, -most - 1, most)  # a ringing mode may leave the range of codes
        assert np.max(np.abs(forward - y)) <= codes.forward_error


def shaken(one: Compiled, n: int, rate: float) -> Array:
    """Ramp to mid-range in the largest steps that bounds allow, then back and forth by one, rising by `rate` of it."""
    low, high = one.static.input_range
    step = 0.999 * one.largest_step
    up = np.arange(low, 0.5 * (low + high), step)
    k = np.arange(n)
    return np.clip(np.append(up, up[-1] + step * (rate * k - k % 2)), low, high)


def wrong(one: Model, arithmetic: str, numbers: Compiled, v: Array) -> tuple[float, float]:
    """Largest error of the forward operator for a drive, and its bound, both in output units."""
    codes, t = numbers.codes, np.arange(len(v)) * T
    drive, output = (1.0, 1.0) if codes is None else (float(codes.drive_lsb), float(codes.output_lsb))
    bound = bounds.chain_bounds(numbers, arithmetic).forward if codes is None else codes.forward_error * output
    given = np.float32(v).astype(float) if codes is None else np.rint(v / drive)
    left = answers(numbers, Run(t, given), False).astype(float) * output - one.simulate(given * drive, t=t)
    return float(np.max(np.abs(left))), bound


@pytest.mark.thorough
@pytest.mark.parametrize("arithmetic", ["float32", "q15"])
@pytest.mark.parametrize(
    ("name", "n", "rate"),
    [("viscous", 2000, 0.025), ("relaxing", 2000, 0.025), ("soft_dashpot", 2000, 0.025), ("dashpot", 100_000, 0.0)],
)
def test_bounds_of_viscous_plays_hold_for_a_shaken_drive_and_are_reached(
    name: str, n: int, rate: float, arithmetic: str
) -> None:
    """Plays gain and lose contact within each step, where errors of the C's approximation of the law add up."""
    one = model(CHAINS[name])
    numbers = tables.build(one.chain, arithmetic, T)
    worst, bound = wrong(one, arithmetic, numbers, shaken(numbers, n, rate))
    assert worst <= bound < 4.0 * worst


LINEAR = "name: rate_dependence, shape: relaxation, time_constant: 0.02"
SOFT = "name: rate_dependence, shape: relaxation, time_constant: 2.0e-3, exponent: 0.5"


@pytest.mark.thorough
@pytest.mark.parametrize("arithmetic", ["float32", "q15"])
@pytest.mark.parametrize(
    "text", [CHAINS["viscous"], chain("linear", LINEAR), chain("soft", SOFT)], ids=["viscous", "linear", "soft"]
)
def test_bounds_of_inverses_of_viscous_plays_hold_for_such_drives_and_are_reached(text: str, arithmetic: str) -> None:
    """With the model's own output as its reference, the inverse undoes part of its plays' error."""
    one = model(text)
    numbers = tables.build(one.chain, arithmetic, T)
    codes = numbers.codes
    drive, output = (1.0, 1.0) if codes is None else (float(codes.drive_lsb), float(codes.output_lsb))
    bound = bounds.chain_bounds(numbers, arithmetic).rounding if codes is None else codes.inverse_rounding * drive
    worst = 0.0
    for rate in (0.01, 0.015, 0.06):
        v = shaken(numbers, 2000, rate)
        v = np.float32(v).astype(float) if codes is None else np.rint(v / drive) * drive
        u = one.simulate(v, t=np.arange(len(v)) * T)
        asked = np.float32(u).astype(float) if codes is None else np.rint(u / output)
        left = answers(numbers, Run(np.arange(len(v)) * T, asked), True).astype(float) * drive - v
        worst = max(worst, float(np.max(np.abs(left))))
    assert worst <= bound < 4.0 * worst


def found_input(p: Array, d: Array, shift: Array, rate: Array) -> tuple[float, Array]:
    """e with `p_0 e + sum p_i d_i = 0` after each play has moved by the fraction `rate` towards e plus its shift."""
    kept = (1.0 - rate) * d + rate * shift
    e = -float(p[1:] @ kept) / float(p[0] + p[1:] @ rate)
    return e, kept + rate * e


def test_the_inverse_undoes_shifts_of_the_plays_input() -> None:
    """Three plays, then two, then one are shifted, in all combinations of signs; then plays follow only in part."""
    rng = np.random.default_rng(8)
    for _ in range(6):
        p = 10.0 ** rng.uniform(-1.0, 0.5, 4)
        slopes = np.cumsum(p)
        ones, reached = np.ones(3), 0.0
        signs = [np.array(each) for each in itertools.product((-1.0, 1.0), repeat=3)]
        for first, second, third in itertools.product(signs, repeat=3):
            e, d = 0.0, np.zeros(3)
            for level, sign in ((3, first), (2, second), (1, third)):
                e, d = found_input(p, d, sign, (np.arange(3) < level).astype(float))
            reached = max(reached, abs(e))
        assert reached == pytest.approx(float(np.sum(p[1:] * (2.0 / slopes[1:] - 1.0 / slopes[-1]))))
        bound = moving.found_shifted(p, p, ones, True)
        assert reached < bound < 2.0 * reached
        assert bound <= moving.found_shifted(p, p, ones, False)
        d = np.zeros(3)
        for _ in range(3000):
            rate = 10.0 ** rng.uniform(-2.0, 0.0) * (np.arange(3) < rng.integers(0, 4))
            e, d = found_input(p, d, rng.choice(signs), rate)
            assert abs(e) <= bound


@pytest.mark.thorough(but_one_in=2)
@pytest.mark.parametrize("arithmetic", ["float32", "q15"])
def test_bounds_of_dashpots_are_those_of_a_step_whatever_the_law(arithmetic: str) -> None:
    """The laws range from those that yield fully within a step to those that hardly yield in a whole record."""
    rng = np.random.default_rng(17)
    for _ in range(8):
        tau, exponent = 10.0 ** rng.uniform(-4.0, 1.0), rng.uniform(0.3, 4.0)
        law = f"name: rate_dependence, shape: relaxation, time_constant: {tau:.4g}, exponent: {exponent:.3g}"
        one = model(chain("law", law, front=TANH))
        numbers = tables.build(one.chain, arithmetic, T)
        worst, bound = wrong(one, arithmetic, numbers, shaken(numbers, 500, 0.01))
        assert worst <= bound < 1.5 * sum(one.cascade.pi.weights[1:]) * numbers.largest_way


def swept(one: Compiled, n: int) -> Array:
    """Drive back and forth over the whole range from its lower end, in the largest steps that bounds allow."""
    low, high = one.static.input_range
    way = 0.999 * one.largest_step * np.arange(n)
    return high - np.abs(way % (2.0 * (high - low)) - (high - low))


@pytest.mark.parametrize("arithmetic", ["float32", "q15"])
def test_bounds_hold_however_much_own_heat_there_is(arithmetic: str) -> None:
    """At the fastest rate that bounds allow, the gain stays within its limits, here for eight time constants."""
    heat = "name: thermal, source: self_heating, time_constant: 0.5, heating: 0.4, gain_per_degree: -0.02"
    one = model(chain("hot", heat, compensate="self_heating"))
    numbers = tables.build(one.chain, arithmetic, T)
    v = swept(numbers, 4000)
    worst, bound = wrong(one, arithmetic, numbers, v)
    assert worst <= bound
    plain = one.without(one.effects).simulate(v)
    assert np.max(np.abs(one.simulate(v) - plain)) > 0.1 * np.ptp(plain), "what it is worth"


@BOTH
@pytest.mark.parametrize("name", ["heated", "rubbed"])
def test_bounds_of_own_heat_hold_at_the_fastest_rate_and_are_reached(name: str, arithmetic: str) -> None:
    """The inverse uses the gain before the last move, which matters most where the drive turns at an end. Half of the
    bound for the heat of loops covers the error of few plays, which peaks only for one order of nested loops."""
    one = model(CHAINS[name])
    numbers, codes = compiled(one, arithmetic)
    v = swept(numbers, N)
    t, output, drive = np.arange(N) * T, float(codes.output_lsb), float(codes.drive_lsb)
    ends = numbers.tables.limits.output[0]
    u = np.rint(np.clip(one.simulate(v, t=t) / output, *ends))
    range_of_drive = tuple(float(end) * drive for end in numbers.tables.limits.drive[0])
    compensator = Compensator(one.chain, one.parameters.emit.compensation)
    wanted = compensator.drives(Run(t, u * output), range_of_drive) / drive  # type: ignore[arg-type]
    worst = float(np.max(np.abs(answers(numbers, Run(t, u), True) - wanted)))
    assert worst <= codes.inverse_error < (4.0 if name == "heated" else 6.0) * worst


@pytest.mark.parametrize("name", ["lag", "exact", "lag_and_creep"])
@BOTH
def test_leads_as_double_precision_does(name: str, arithmetic: str) -> None:
    """With a lag compensated, the answers are those of double precision after the same drives."""
    one = model(chain("led", *STILL[name]))
    numbers, codes = compiled(one, arithmetic)
    drive = float(codes.drive_lsb)
    ends = tuple(float(end) * drive for end in numbers.tables.limits.drive[0])
    for seed in range(3):
        given, exact = record(numbers, codes, seed, 0.5)
        v = answers(numbers, given, True).astype(float)
        if codes.condition:
            double = tables.build(one.chain, "float64", T)
            op = np.tile(np.array([slots.OP_STEP, slots.OP_COMMIT], dtype=np.uint8), N)
            seen, _ = reference.answers(double.tables, True, op, np.column_stack([exact.v, v * drive]).ravel())
            wanted = seen[::2] / drive
        else:
            wanted = Compensator(one.chain).drives(exact, ends) / drive  # type: ignore[arg-type]
        assert np.max(np.abs(v)) < 0.9 * numbers.tables.limits.drive.high[0]
        assert np.max(np.abs(v - wanted)) <= codes.inverse_rounding < 1e-2 * numbers.tables.limits.drive.high[0]


@pytest.mark.slow(one_in=3)
@pytest.mark.thorough(but_one_in=8)
@pytest.mark.parametrize("name", [name for name in CHAINS if name not in BRANCHED])
@BOTH
def test_answers_like_double_precision_that_saw_the_same_drives(name: str, arithmetic: str) -> None:
    """Even where drives are limited, answers agree with the float64 tables to which the same drives were committed."""
    one = model(CHAINS[name])
    numbers, codes = compiled(one, arithmetic)
    double = tables.build(one.chain, "float64", T)
    given, exact = record(numbers, codes, 7, 1.2)
    op, x, y = [], [], []
    v = np.empty(N)
    ahead = numbers.ahead
    bits = int(numbers.tables.limits.code_max[0]).bit_length()
    for k in range(N):
        warm = "set_temperature" in numbers.tables.calls
        degree = exact.extra["temperature"][k]
        rows = [(slots.OP_TEMPERATURE, degree * 2.0 ** TEMPERATURE_BITS[bits], degree)] * warm
        rows += [(slots.OP_PUSH if k < ahead else slots.OP_STEP, given.v[k], exact.v[k])]
        for row in rows:
            op.append(row[0])
            x.append(row[1])
            y.append(row[2])
    calls = np.array(op, dtype=np.uint8)
    v, _ = reference.answers(numbers.tables, True, calls, np.array(x))
    drive = float(codes.drive_lsb)
    asked, given_to = [], []
    for call, value, answer in zip(op, y, v.tolist(), strict=True):
        asked.append(call)
        given_to.append(value)
        if call == slots.OP_STEP:
            asked.append(slots.OP_COMMIT)
            given_to.append(answer * drive)
    w, _ = reference.answers(double.tables, True, np.array(asked, dtype=np.uint8), np.array(given_to))
    low, high = numbers.tables.limits.drive[0]
    wanted = np.clip(w[np.array(asked) == slots.OP_STEP] / drive, low, high)
    assert np.max(np.abs(v[calls == slots.OP_STEP] - wanted)) <= codes.inverse_rounding


@BOTH
def test_branches_are_mostly_the_same(arithmetic: str) -> None:
    """With two branches, nine tenths of the samples are within the rounding bound for a single branch."""
    one = model(CHAINS["lagging"])
    numbers, codes = compiled(one, arithmetic)
    given, exact = record(numbers, codes, 5, 0.5)
    drive = float(codes.drive_lsb)
    ends = tuple(float(end) * drive for end in numbers.tables.limits.drive[0])
    wanted = Compensator(one.chain).drives(exact, ends)  # type: ignore[arg-type]
    left = np.abs(answers(numbers, given, True) - wanted / drive)
    assert np.quantile(left, 0.9) <= codes.inverse_rounding < 0.1 * codes.inverse_error


OPERATIONS = {
    "settle": slots.OP_SETTLE, "set_offset": slots.OP_OFFSET, "set_temperature": slots.OP_TEMPERATURE,
    "set_gain": slots.OP_GAIN, "set_travel": slots.OP_TRAVEL, "travel": slots.OP_TRAVELLED,
    "expected": slots.OP_EXPECTED, "correct": slots.OP_CORRECT, "push": slots.OP_PUSH,
}  # fmt: skip

MAIN = """#include <stdio.h>
#include <stdlib.h>
void not_granted(int line);
void not_granted(int line)
{{
    fprintf(stderr, "beyond what the range analysis says: line %d", line);
    exit(1);
}}
#include "{name}.h"
void hystgen_harness_{op}(const unsigned char *call, const {name}_real_t *x, {name}_real_t *answer,
    unsigned char *status, size_t count);
int main(int count, char **given)
{{
    const size_t n = (size_t)atol(given[count - 1]);
    unsigned char *call = malloc(n), *status = malloc(n);
    {name}_real_t *x = malloc(n * sizeof *x), *answer = malloc(n * sizeof *answer);
    if (fread(call, 1, n, stdin) != n || fread(x, sizeof *x, n, stdin) != n) {{
        return 2;
    }}
    hystgen_harness_{op}(call, x, answer, status, n);
    fwrite(answer, sizeof *answer, n, stdout);
    fwrite(status, 1, n, stdout);
    return 0;
}}
"""


def wild(rng: np.random.Generator, kinds: list[int], real: np.dtype[Any], n: int) -> tuple[Any, Any]:
    """Calls in random order; codes are random, near 0 or the ends, at either end, or from a random walk."""
    op = rng.choice(kinds, n).astype(np.uint8)
    op[rng.random(n) < 0.0005] = slots.OP_INIT
    info = np.iinfo(real)
    walk = (info.max * np.sin(np.cumsum(rng.normal(0.0, 0.1, n)))).astype(np.int64)
    ends = np.array([info.min, info.min + 1, -1, 0, 1, info.max - 1, info.max])
    kind = (np.arange(n) // 1000) % 4
    x = np.select(
        [kind == 0, kind == 1, kind == 2],
        [rng.integers(info.min, info.max, n, endpoint=True), rng.choice(ends, n), rng.choice(ends[[0, -1]], n)],
        walk,
    )
    return op, x.astype(real)


def checked(
    folder: Path, one: Model, arithmetic: str, flags: list[str], wrong: str = ""
) -> Iterator[tuple[str, Array, Array, subprocess.CompletedProcess[bytes]]]:
    """For each operator: its name, random calls, their arguments, and the run of the compiled C with the checks of
    `granted_states`; `wrong` names a bound to be divided by 64, so that a check fails."""
    own, n = one.name, 20_000
    options = emit_options(one, "inverse" if own in INVERSE_ALONE else "both", arithmetic, "loop")
    written = sources.write(folder, one, options)
    source = folder / f"{own}.c"
    source.write_text(granted_states(source.read_text(), compiled(one, arithmetic)[0], own, wrong))
    calls = module.of(one, options).compensator.calls
    for op in written.operators:
        (folder / f"main_{op}.c").write_text(MAIN.format(name=own, op=op))
        files = [*written.module, written.harness, folder / f"main_{op}.c"]
        subprocess.run(["gcc", "-std=c99", "-g", "-O1", *flags, "-I", folder, *files, "-o", folder / op], check=True)
        kinds = [slots.OP_STEP] * 6 + [slots.OP_RESET] + [OPERATIONS[call] for call in calls[op]]
        kinds += [slots.OP_COMMIT] * (op == "inverse")
        call, x = wild(np.random.default_rng(5), kinds, ARITHMETICS[arithmetic].number, n)
        given = call.tobytes() + x.tobytes()
        yield op, call, x, subprocess.run([folder / op, str(n)], input=given, capture_output=True, check=False)


REPEATED = 8000
"""[calls] Number that the reference repeats in plain Python, at 0.1 ms each."""

PROVED = CHAINS | {"braked": BRAKED, "calm": CALM, "steady": STEADY}


@pytest.mark.slow(one_in=6)
@pytest.mark.thorough
@pytest.mark.parametrize("name", PROVED)
@BOTH
def test_nothing_overflows_whatever_is_called(name: str, arithmetic: str, tmp_path: Path) -> None:
    """States stay within the ranges for which their formats were chosen and which the proof assumes. The reference
    repeats the first calls, two of each kind of argument that `wild` makes; the C makes all."""
    one, real = model(PROVED[name]), ARITHMETICS[arithmetic].number
    numbers = one.tables(arithmetic, "loop")
    flags = ["-fsanitize=undefined", "-fno-sanitize-recover=all"]
    for op, call, x, done in checked(tmp_path, one, arithmetic, flags):
        assert done.returncode == 0, done.stderr.decode()
        answer = np.frombuffer(done.stdout, real, len(x))
        status = np.frombuffer(done.stdout[answer.nbytes :], np.uint8)
        wanted, bits = reference.answers(numbers, op == "inverse", call[:REPEATED], x[:REPEATED])
        assert np.array_equal(answer[:REPEATED], wanted.astype(real))
        assert np.array_equal(status[:REPEATED], bits)


@pytest.mark.slow(one_in=4)
@pytest.mark.parametrize(
    ("name", "fact"),
    [("creeping", "CREEP"), ("creeping", "SIGNAL"), ("drifting", "PART"), ("aged", "INVERSE"),
     ("heated", "RISE"), ("rubbed", "RUBBED"), ("relaxing", "PLAY"), ("dashpot", "LOST"), ("dashpot", "INPUT"),
     ("late", "MODE"), ("braked", "ASKED"), ("braked", "COARSE"), ("steady", "MOVED")],
)  # fmt: skip
def test_what_proofs_take_for_granted_is_looked_at(name: str, fact: str, tmp_path: Path) -> None:
    runs = checked(tmp_path, model(PROVED[name]), "q31", [], fact)
    assert any("beyond what the range analysis says" in done.stderr.decode() for *_, done in runs)


@BOTH
@pytest.mark.parametrize("name", ["everything", "worn", "quick", "warm"])
def test_products_get_numbers_of_their_size(name: str, arithmetic: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """In Python integers, every factor of a product stays below 2^51 and every sum below 2^63."""
    one = model(CHAINS[name])
    numbers = one.tables(arithmetic, "loop")
    inverse = name in INVERSE_ALONE
    kinds = [slots.OP_STEP] * 6 + [slots.OP_RESET, slots.OP_SETTLE, slots.OP_OFFSET]
    kinds += [slots.OP_TEMPERATURE] * ("set_temperature" in numbers.calls)
    kinds += [slots.OP_GAIN, slots.OP_TRAVEL] * ("travel" in numbers.calls)
    call, x = wild(np.random.default_rng(8), kinds, ARITHMETICS[arithmetic].number, 4000)
    plain = factors.times.py_func
    largest = 0

    def watched(value: Any, mantissa: Any, shift: Any) -> Any:
        nonlocal largest
        largest = max(largest, abs(int(value)))
        return plain(value, mantissa, shift)

    monkeypatch.setattr(factors.times, "py_func", watched)
    monkeypatch.setattr(jit.Jit, "interpreted", property(lambda one: one.py_func))  # every kernel is run through it
    with np.errstate(over="raise"):
        reference.answers(numbers, inverse, call, x, compiled=False)
    assert 2**30 < largest < factors.LARGEST


@pytest.mark.thorough
@BOTH
@pytest.mark.parametrize("bits", [20, 28])
def test_slow_states_neither_stall_nor_drift(arithmetic: str, bits: int) -> None:
    """With tau/T of 2^20 and 2^28, a step of the drive moves the state as far as it would without rounding."""
    tau = 2.0**bits * T
    one = model(chain("slow", f"name: creep, time_constants: [{tau}], weights: [0.1]"))
    numbers, codes = compiled(one, arithmetic)
    n = 1_000_000
    v = np.full(n, round(3.0 / float(codes.drive_lsb)))
    v[0] = -v[0]
    y, _ = reference.answers(numbers.tables, False, np.full(n, slots.OP_STEP, dtype=np.uint8), v)
    h = one.without(one.effects).simulate(v * float(codes.drive_lsb)) - one.cascade.output_offset
    moved = -0.1 * float(h[-1] - h[0]) * math.expm1(-(n - 1) * T / tau) / float(codes.output_lsb)
    assert moved > 10.0
    assert abs((float(y[-1]) - float(y[1])) - moved) <= 1.0 + 2e-6 * moved


@pytest.mark.slow(one_in=2)
@pytest.mark.thorough(but_one_in=8)
@BOTH
@pytest.mark.parametrize("name", STILL)
def test_a_constant_reference_comes_to_rest(name: str, arithmetic: str) -> None:
    """With creep alone, the drive comes to rest within rounding; with a lag it may still vary by a code either way."""
    one = model(chain("still", *STILL[name]))
    numbers, _ = compiled(one, arithmetic)
    low, high = (int(end) for end in numbers.tables.limits.output[0])
    n = 12_000
    allowed = {"creep": 0, "lag": 2, "exact": 1, "lag_and_creep": 2}[name]
    for share in np.random.default_rng(0).uniform(0.15, 0.85, 6):
        u = np.full(n, int(low + (high - low) * share))
        u[:200] = (low + (high - low) * (0.5 + 0.3 * np.sin(0.1 * np.arange(200)))).astype(int)
        v, _ = reference.answers(numbers.tables, True, np.full(n, slots.OP_STEP, dtype=np.uint8), u)
        assert np.ptp(v[-2000:]) <= allowed


def test_a_drift_is_counted_without_rounding() -> None:
    """Drifts that reverse, stop or hardly move agree with exact fractions up to the sample at which the clock stops."""
    rng = np.random.default_rng(0)
    for _ in range(200):
        rate = float(rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-6, -1))
        change = float(rng.choice([-1.0, 0.0, 1.0]) * 10.0 ** -rng.uniform(0, 5))
        effect = CurvedDrift(name="drift", shape="curved", rate=rate, change=change)
        signal, ahead = Fraction(10) / 2 ** int(rng.integers(15, 44)), int(rng.integers(0, 20))
        far = float(20 / signal)
        one = drift.numbers(effect, T, signal, far, ahead)
        slope, twice, samples, _, bits, *_ = one.table
        turn = max(-slope // twice, 0) if twice else 0
        most, farthest = clock(one.table), 0
        for n in (0, 1, 1000, 10**6, min(turn, samples), samples, 2 * samples):
            counted = min(n, samples)
            if n > samples == drift.MOST_SAMPLES:
                continue
            total = slope * counted + twice * (counted * (counted - 1) // 2)
            whole, gained = total >> bits, twice * counted
            assert abs(whole) <= most["WHOLE"]
            assert abs(gained) <= most["GAINED"]
            farthest = max(farthest, abs(whole))
            state = drift.FixedClockState.of([(whole, total - (whole << bits), 0, gained, counted)])
            for lead in (0, ahead):
                table = drift.FixedClockTable.of([one.table])
                with jit.plain(), np.errstate(over="raise"):
                    found = int(drift.clock_drift(table, state, 0, np.int64(lead)))
                t = (n + lead) * Fraction(T)
                exact = (Fraction(rate) + Fraction(change) / 2 * t) * t / signal
                assert abs(found - min(max(exact, -Fraction(far)), Fraction(far))) <= one.error
        assert farthest >= 0.999 * most["WHOLE"] - 2 or samples == drift.MOST_SAMPLES
        state = drift.FixedClockState.zeros(1)
        with jit.plain():
            for _ in range(20):
                drift.clock_tick(drift.FixedClockTable.of([one.table]), state, 0, 0, 0)
        counted = min(20, samples)
        total = slope * counted + twice * (counted * (counted - 1) // 2)
        assert int(state.whole[0]) * 2**bits + int(state.part[0]) == total


@BOTH
def test_what_was_committed_is_in_the_memory(arithmetic: str) -> None:
    """The next reference is reached to within the forward bound and one drive code, whatever drive was committed."""
    one = model(CHAINS["creeping"])
    numbers, codes = compiled(one, arithmetic)
    rng = np.random.default_rng(3)
    u = np.rint(3.0 * np.sin(0.02 * np.arange(800)) / float(codes.output_lsb)).astype(np.int64)
    calls: list[tuple[int, int]] = []
    low, high = (int(end) for end in numbers.tables.limits.drive[0])
    for k, each in enumerate(u.tolist()):
        calls.append((slots.OP_STEP, each))
        if k % 7 == 3:
            calls.append((slots.OP_COMMIT, int(rng.integers(low, high) * 3 // 4)))
    op, x = (np.array(column) for column in zip(*calls, strict=True))
    answer, _ = reference.answers(numbers.tables, True, op.astype(np.uint8), x)
    applied, free = [], []
    for i, (each, _) in enumerate(calls):
        if each == slots.OP_STEP:
            committed = i + 1 < len(calls) and calls[i + 1][0] == slots.OP_COMMIT
            applied.append(float(calls[i + 1][1] if committed else answer[i]))
            free.append(not committed)
    y = one.simulate(np.array(applied) * float(codes.drive_lsb)) / float(codes.output_lsb)
    slope = one.cascade.pi.slopes[-1] * float(codes.drive_lsb / codes.output_lsb)
    assert np.max(np.abs(y - u)[np.array(free)]) <= codes.forward_error + slope


def test_the_reference_takes_codes_and_degrees() -> None:
    one = Model(parse_parameters(CHAINS["warm"], "warm.yaml"))
    with pytest.raises(ValueError, match="fixed point takes codes, integers from -32768 to 32767"):
        one.simulate([0.5], "q15", extra={"temperature": [20.0]})
    numbers, codes = compiled(one, "q15")
    y = one.inverse().simulate([8000, 8000], "q15", extra={"temperature": [20.0, 60.0]}) * float(codes.drive_lsb)
    exact = one.inverse().simulate([8000 * float(codes.output_lsb)] * 2, extra={"temperature": [20.0, 60.0]})
    assert np.max(np.abs(y - exact)) <= codes.inverse_error * float(codes.drive_lsb)
    assert numbers.tables.fixed


@BOTH
def test_the_selftest_goes_all_over_the_range(arithmetic: str) -> None:
    text = emitted_files(model(CHAINS["lagging"]), arithmetic=arithmetic)["lagging_selftest.c"]
    codes = [int(each) for each in re.findall(r"\{'s', \(?(-?\d+)", text)]
    most = ARITHMETICS[arithmetic].code_max
    assert len(set(codes)) > 100
    assert max(codes) > 0.9 * most
    assert min(codes) < -0.9 * most


@BOTH
@pytest.mark.parametrize("name", ["bumpy", "viscous"])
def test_bent_plays_contribute_what_the_model_has(name: str, arithmetic: str) -> None:
    """The polynomials agree with the effect's own formula wherever plays can be."""
    one = model(CHAINS[name])
    numbers, _ = compiled(one, arithmetic)
    static, t = one.cascade, numbers.tables
    assert numbers.codes is not None
    step = float(numbers.codes.drive_lsb) / 2 ** int(t.plays.limits.fine[0])
    end = int(t.moving.bump.domain[0, 1])
    degree = ARITHMETICS[arithmetic].degree
    error = moving.bumps(static, numbers.parts.plays, step, end, degree).error
    effect = next(each for each in one.effects if each.bends_plays())
    z = np.random.default_rng(2).integers(-end, end, 400, endpoint=True)
    n = static.pi.n
    exact = effect.bent(np.tile(z * step, (n + 1, 1)), np.array(static.pi.thresholds)) / step
    with jit.plain():
        found = [[int(bent_fixed.bent(t.moving, t.plays, i, each)) for each in z] for i in range(1, n + 1)]
    left = np.max(np.abs(np.array(found) - exact[1:]))
    assert 0.05 * error < left <= error


@BOTH
@pytest.mark.parametrize(("exponent", "ratio"), [(2.5, 5.0), (0.5, 2.0), (3.0, 2.0**28), (1.5, 0.1)])
def test_what_a_dashpot_yields_in_fixed_point(exponent: float, ratio: float, arithmetic: str) -> None:
    """Stretches of all sizes yield as the exact law does, to within a thousandth, a step, the yield of the table's
    smallest stretch, and 2^-40 of the stretch. No stretch yields more than its length."""
    text = f"name: rate_dependence, shape: relaxation, time_constant: {ratio * T}, exponent: {exponent}"
    one = model(chain("yields", text))
    numbers, codes = compiled(one, arithmetic)
    t, step = numbers.tables.moving, float(codes.drive_lsb) / 2 ** int(numbers.tables.plays.limits.fine[0])
    effect, scale = one.effects[0], one.cascade.pi.thresholds[-1]
    assert isinstance(effect, RelaxingPlays)
    least = dashpot.LEAST_STRETCH * scale
    for x in np.unique(np.geomspace(1, t.stretch, 300).astype(np.int64)):
        law, slope = dashpot.yielded(effect, scale, T, float(x) * step)
        with jit.plain():
            found = int(dashpot_fixed.yields(t, x)) / 2.0**t.yield_bits * step
        unit = 3.0 * step * 2.0 ** (int(t.yields.lift.max()) - t.yield_bits)
        assert found <= x * step
        stuck = dashpot.LEAST_YIELD * x * step
        assert abs(found - law) <= dashpot.YIELD_ERROR * law + slope * (least + step) + unit + stuck


@BOTH
@pytest.mark.parametrize("rubs", [False, True])
@pytest.mark.parametrize("bits", [0, 10, 28])
def test_own_heat_neither_stalls_nor_drifts(arithmetic: str, bits: int, rubs: bool) -> None:
    """For time constants up to 2^28 samples, the rise agrees with the same recursion in units of 2^-100 degrees."""
    about = ARITHMETICS[arithmetic]
    largest, lsb, seconds = about.code_max, 4.0 / about.code_max, 1e-3
    tau, ends = 0.7 * seconds * 2.0**bits, (-4.0, 4.0)
    effect: OwnHeat = (
        HysteresisHeating(name="thermal", source="hysteresis", time_constant=tau, heating=0.5, reach=3.0)
        if rubs else SelfHeating(name="thermal", source="self_heating", time_constant=tau, heating=0.05)
    )  # fmt: skip
    effect = effect.model_copy(update={"gain_per_degree": -0.002, "offset_per_degree": 0.01})
    row, thresholds = thermal.heat_numbers(effect, ends, 20.0, seconds), thermal.thresholds(effect, ends)
    one = thermal_fixed.heat(row, 4, thresholds, largest, lsb, 2.0**20, about.code_bits)
    t, verbs = thermal_fixed.heat_tables([one]), thermal_fixed.HEAT_ARITHMETIC.verbs
    assert verbs.reset
    assert verbs.move
    state = verbs.memory(t, np.int64)
    rng = np.random.default_rng(bits)
    steps = rng.integers(-largest // 50, largest // 50, 2000)
    v = np.cumsum(2 * np.abs(steps) if rubs else steps)  # small loops cause hardly any friction
    v = np.abs((v + largest) % (4 * largest) - 2 * largest) - largest
    v[1000:] = v[1000]
    rate, heated = Fraction(row[0]), Fraction(row[1]) * Fraction(lsb) ** (2 - rubs)
    warmest = float(heated) * 2 * (256 * largest if rubs else largest**2) / row[0]
    unit = 2.0 ** (math.ceil(math.log2(warmest)) - thermal_fixed.RISE_BITS)
    rise, before, peak, worst = 0, 0, 0, 0.0
    r, z = np.array(thresholds) / lsb, np.zeros(len(thresholds))
    with jit.plain():
        verbs.reset(t, state, 0)
        for each in v.tolist():
            verbs.move(t, state, 0, np.int64(before), np.int64(each))
            way = abs(each * abs(each) - before * abs(before))
            if rubs:
                moved = np.clip(z, each - r, each + r)
                way, z = Fraction(float((2 * np.arange(len(r)) + 1) @ np.abs(moved - z))), moved
            rise += round(way * heated * 2**100 - rise * rate)
            worst = max(worst, abs(int(state.block.high[0]) * unit - rise / 2**100))
            peak, before = max(peak, rise), each
        assert worst <= one.error < 0.1 * peak / 2**100
        warmest = 2 ** (thermal_fixed.RISE_BITS + 1) - 1  # the state then stays in the range that proofs assume
        state.block.high[0] = warmest
        verbs.move(t, state, 0, np.int64(-largest), np.int64(largest))
        assert 0 <= state.block.high[0] <= warmest


@pytest.mark.parametrize(("level", "centre"), [(15.0, 4.0), (6.0, -8.0)])
@pytest.mark.parametrize("arithmetic", ["float32", "q31", "q15"])
def test_status_tells_at_either_end_that_a_saturation_has_no_input(
    arithmetic: str, level: float, centre: float
) -> None:
    """The limits may lie around any output, even on the same side of 0; an offset moves a reference past them."""
    one = model(chain("limited", f"name: saturation, level: {level:g}, centre: {centre:g}"))
    numbers = tables.build(one.chain, arithmetic, T)
    scale = 1.0 if numbers.codes is None else 1.0 / float(numbers.codes.output_lsb)
    limits = np.array([*numbers.tables.limits.output[0]], dtype=float)
    for way, u in zip((-level, level), limits.tolist(), strict=True):
        to_limit = u - (centre + way + 0.5) * scale
        for share, seen in ((0.0, False), (1.001, True)):
            x = np.array([share * to_limit, u])
            op = np.array([slots.OP_OFFSET, slots.OP_STEP], dtype=np.uint8)
            given = x if numbers.codes is None else np.rint(x)
            _, status = reference.answers(numbers.tables, True, op, given, compiled=False)
            assert not status[0], "the offset may be set"
            assert bool(status[1] & slots.DOMAIN) == seen


@BOTH
@pytest.mark.parametrize("options", [{"resonance": "notch"}, {"resonance": "shaper"}, {"noise_gain": 4.0}])
def test_weights_of_the_reference_stay_within_bounds_and_come_to_rest(arithmetic: str, options: dict[str, Any]) -> None:
    """Answers are those of float64 tables with the same weights; after a step of the reference, all comes to rest."""
    one = model(chain("weighed", "name: resonance, frequency: 30, damping: 0.05"))
    how = Compensation(**options)
    numbers, double = (tables.build(one.chain, each, T, how) for each in (arithmetic, "float64"))
    codes = numbers.codes
    assert codes is not None
    assert numbers.taps is not None
    given, exact = record(numbers, codes, 5, 0.9)
    v = answers(numbers, given, True) * float(codes.drive_lsb)
    wanted = answers(double, exact, True)
    assert np.max(np.abs(v - wanted)) <= codes.inverse_error * float(codes.drive_lsb)
    low, high = numbers.tables.limits.output[0].tolist()
    step = np.repeat([0.2 * low, 0.7 * high], [5, 200]).round()
    v = answers(numbers, Run(np.arange(205) * T, step, {}), True)
    assert len(set(v[5 + len(numbers.taps.weights) :].tolist())) == 1
