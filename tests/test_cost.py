"""The operations that the banner promises, counted by running the bit-exact reference in Python on counting numbers."""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from hystgen.arithmetic import ARITHMETICS
from hystgen.basics import jit
from hystgen.basics.structures import Factor, Struct
from hystgen.compensator import reference
from hystgen.compensator.chain import moving_fixed, moving_float
from hystgen.effects.noncongruent import compensator as bends
from hystgen.emission import cost
from hystgen.front.tanh import compensator as envelopes
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.plays import fixed, slots

pytestmark = pytest.mark.thorough

FRONTS = {
    "plays": "",
    "envelope": "  memoryless: {kind: tanh, ascending: {a0: 20, a1: 0.1, a2: 0.1, a3: 0.2}}\n",
    "branches": "  memoryless:\n    kind: tanh\n    ascending: {a0: 20, a1: 0.1, a2: 0.1, a3: 0.2}\n"
    "    descending: {a0: 20, a1: 0.1, a2: 0.1, a3: 0.5}\n",
}
SAMPLES = 600

INDICES = {
    "shift", "first", "pieces", "ascending", "below", "scale", "counts", "top", "rose", "stage_first", "stage_size",
}  # fmt: skip
"""Arrays of indices and bit counts; comparing them is not an operation on the model's numbers."""


class Number:
    """A number that counts its multiplications and comparisons."""

    products = comparisons = 0

    def __init__(self, value: Any) -> None:
        self.value = value.value if isinstance(value, Number) else value

    def __float__(self) -> float:
        return float(self.value)

    def __index__(self) -> int:
        return operator.index(self.value)

    def __neg__(self) -> Number:
        return Number(-self.value)

    def __invert__(self) -> Number:
        return Number(~self.value)


def plain(x: Any) -> Any:
    return x.value if isinstance(x, Number) else x


def arithmetic(name: str) -> tuple[Callable[[Number, Any], Number], Callable[[Number, Any], Number]]:
    of = getattr(operator, name)

    def left(a: Number, b: Any) -> Number:
        Number.products += name == "mul"
        return Number(of(a.value, plain(b)))

    def right(a: Number, b: Any) -> Number:
        Number.products += name == "mul"
        return Number(of(plain(b), a.value))

    return left, right


def comparison(name: str) -> Callable[[Number, Any], bool]:
    of = getattr(operator, name)

    def compare(a: Number, b: Any) -> bool:
        Number.comparisons += 1
        return bool(of(a.value, plain(b)))

    return compare


for each in ("add", "sub", "mul", "truediv", "floordiv", "lshift", "rshift", "and_"):
    for prefix, function in zip(("__", "__r"), arithmetic(each), strict=True):
        setattr(Number, prefix + each.strip("_") + "__", function)
for each in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(Number, f"__{each}__", comparison(each))


PLACES = {"bool", "uint8_t", "uint_least8_t", "uint_least16_t"}
"""Types of members that are flags, indices or bit counts."""


def counting_layout(kind: type[Struct], given: np.dtype[np.void]) -> np.dtype[np.void]:
    """Structured type of a structure with counting numbers; `given`: its type in an arithmetic."""
    fields: list[Any] = []
    for name in given.names or ():
        word, length = kind.members()[name][:2]
        if given[name].names:
            fields.append((name, counting_layout(word if isinstance(word, type) else Factor, given[name])))
        else:
            number = np.int64 if word in PLACES or name in INDICES else object
            fields.append((name, number, (length,) if length else ()))
    return np.dtype(fields)


def count_in(out: Struct, x: Struct) -> Struct:
    """Copy a structure into one with counting numbers."""
    for name in x.dtype.names or ():
        if isinstance(getattr(x, name), Struct):
            count_in(getattr(out, name), getattr(x, name))
        else:
            counts = getattr(out, name).dtype == object
            getattr(out, name)[...] = counting(np.asarray(getattr(x, name))) if counts else getattr(x, name)
    return out


def counting(x: Any, name: str = "") -> Any:
    """Tables or memory with counting numbers."""
    if isinstance(x, Struct):
        return count_in(np.zeros(x.shape, counting_layout(type(x), x.dtype)).view(type(x)), x)
    if isinstance(x, np.ndarray) and name not in INDICES and (x.dtype.kind == "f" or x.dtype == np.int64):
        out = np.empty(x.shape, dtype=object)
        for place in np.ndindex(*x.shape):
            out[place] = Number(x[place].item())
        return out
    if hasattr(x, "_fields"):
        return type(x)(*(counting(getattr(x, field), field) for field in x._fields))
    return x


def model(front: str, n: int, more: str = "") -> Model:
    r = np.linspace(0.0, 5.0, n + 1)
    weights = [0.7, *(0.15 * np.exp(-r[1:] / 5.0)).tolist()]
    text = f"hystgen: 1\nname: m\ninput_range: [-10, 10]\nmodel:\n  pi:\n    thresholds: {r.tolist()}\n"
    return Model(parse_parameters(f"{text}    weights: {weights}\n{FRONTS[front]}{more}", "m.yaml"))


@pytest.fixture(autouse=True)
def _as_written(monkeypatch: pytest.MonkeyPatch) -> None:
    """Interpret functions as they stand in their modules, so that tests can replace the functions they call."""
    monkeypatch.setattr(jit.Jit, "interpreted", property(lambda one: one.py_func))


def dearest(one: Model, name: str, engine: str, inverse: bool, samples: int = SAMPLES) -> tuple[int, int]:
    """Most multiplications and comparisons of a step, for jumps of all sizes, also beyond the limits, with commits."""
    tables = one.tables(name, engine)
    code, counted = reference.operations(tables, inverse), counting(tables)
    state = counting(reference.new_state(tables, inverse))
    rng = np.random.default_rng(0)
    x: Any = rng.uniform(-10.5, 10.5, samples) * rng.choice([1.0, 0.5, 0.1, 0.02], samples)
    x[rng.random(samples) < 0.02] = 11.0
    if ARITHMETICS[name].fixed:
        most = ARITHMETICS[name].code_max
        x = np.clip(np.rint(x / 10.0 * most), -most, most).astype(np.int64)
    elif inverse:
        x = x * one.cascade.output_range[1] / 10.0
    call = np.where(inverse & (rng.random(samples) < 0.1), slots.OP_COMMIT, slots.OP_STEP).astype(np.uint8)
    arguments, answer, status = counting(x), counting(x[:1]), np.zeros(1, np.uint8)
    found = []
    with jit.plain():
        code.init(counted, state)
        for k in range(samples):
            Number.products = Number.comparisons = 0
            code.run(counted, state, call[k : k + 1], arguments[k : k + 1], answer, status)
            found.append((Number.products, Number.comparisons) if call[k] == slots.OP_STEP else (0, 0))
    return max(a for a, _ in found), max(b for _, b in found)


GAIN = "  effects: [{name: thermal, gain_per_degree: 0.001}]\nsample_time: 1.0e-3\n"
LAG = GAIN.replace("thermal, gain_per_degree: 0.001", "lag, time_constant: 0.01")


@pytest.mark.parametrize("n", [1, 64])
@pytest.mark.parametrize(("name", "front", "effect"), [
    ("float64", "plays", GAIN), ("float64", "branches", GAIN), ("q31", "plays", GAIN), ("q31", "branches", GAIN),
    ("q31", "plays", LAG),
])  # fmt: skip
def test_nor_does_one_of_engine_corners_with_an_effect(
    name: str, front: str, effect: str, n: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The banner prints an effect's multiplications apart from those of the plays; a lag needs a finer solution."""
    for kernel, of in (("tanh", math.tanh), ("atanh", math.atanh)):
        monkeypatch.setattr(envelopes, kernel, lambda x, _, of=of: Number(of(float(x))))
    one = model(front, n, effect)
    tables = one.tables(name, "corners")
    words = cost.worst_case(n, "inverse", True, tables)
    promised = [int(number) for number in re.findall(r"(\d+) (?:multiplications|comparisons)", words)]
    promised[0] += cost.chain_products(tables)["inverse"]
    for met, most in zip(dearest(one, name, "corners", True), promised, strict=True):
        assert met <= most <= 2 * met, (words, met)


EFFECTS = {
    "gain": "name: thermal, gain_per_degree: 0.001",
    "creep": "name: creep, time_constants: [0.01, 0.1], weights: [0.05, 0.05]",
    "lag": "name: lag, time_constant: 0.01",
    "exact lag": "name: lag, time_constant: 3.0e-4",
    "braked lag": "name: lag, time_constant: 0.01}, {name: slew_limit, rate: 500, falling_rate: 300",
    "ageing": "name: ageing, loss: 0.01, travel: 50.0",
    "heat": "name: thermal, source: self_heating, time_constant: 10, heating: 1.0e-5, gain_per_degree: 0.001",
    "drift": "name: drift, rate: 1.0e-3",
    "tanh": "name: saturation, level: 60.0",
    "stops": "name: saturation, shape: stops, lower: -6.0, upper: 6.0, give: 0.1",
    "mode": "name: resonance, frequency: 50, damping: 0.05",
    "part of a mode": "name: resonance, shape: part, share: 0.1, frequency: 50, damping: 0.05",
    "delay": "name: delay, time: 2.6e-3",
}
PLAY_EFFECTS = {
    "relaxation": "name: rate_dependence, shape: relaxation, time_constant: 0.01",
    "dashpot": "name: rate_dependence, shape: relaxation, time_constant: 0.01, exponent: 2.0",
    "thresholds": "name: rate_dependence, betas: [1.0e-4, 1.0e-4, 1.0e-4, 1.0e-4, 1.0e-4]",
    "loop centre": "name: noncongruent, shape: centre, amplitude: 0.3, centre: 0, width: 5",
    "polynomials": "name: noncongruent, coefficients: [[0.05], [0.05], [0.05], [0.05], [0.05]]",
    "elements": "name: bouc_wen, weights: [-0.1, 0.1], widths: [2, 0.7], exponent: 1.6, balance: 1.3",
    "relaxation and centre": "name: rate_dependence, shape: relaxation, time_constant: 0.01}, "
    "{name: noncongruent, shape: centre, amplitude: 0.3, centre: 0, width: 5",
}


@pytest.mark.slow(one_in=4)
@pytest.mark.parametrize("name", ["float64", "q31"])
@pytest.mark.parametrize("effect", EFFECTS | PLAY_EFFECTS)
def test_nor_does_one_of_engine_loop_with_an_effect(effect: str, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Comparisons are printed only for plays, also for plays that an effect bends or moves. No jump makes a search use
    all its tries, so its steps are set to 0 here."""
    reciprocal = moving_float.inverse
    monkeypatch.setattr(moving_float, "inverse", lambda t, slope: reciprocal(t, slope) * 0)
    monkeypatch.setattr(moving_fixed, "quotient", lambda x, y, bits: (found := fixed.quotient(x, y, bits)) - found)
    for module, kernel, of in ((envelopes, "tanh", math.tanh), (envelopes, "atanh", math.atanh),
                               (bends, "tanh", math.tanh)):  # fmt: skip
        monkeypatch.setattr(module, kernel, lambda x, _, of=of: Number(of(float(x))))
    how = "emit: {compensation: {compensate: [drift, self_heating], noise_gain: 1.0e+9}}\n"
    written = (EFFECTS | PLAY_EFFECTS)[effect]
    one = model("plays", 5, f"  effects: [{{{written}}}]\nsample_time: 1.0e-3\n{how}")
    tables = one.tables(name, "loop")
    if len(tables.moving.elements.element):  # nor does one land early
        monkeypatch.setattr(moving_fixed, "smooth", lambda _: False)
        if name == "float64":
            tables.moving.number.smooth[0] = 0.0
            assert one.tables(name, "loop").moving.number.smooth[0] == 0.0
    for operation in ("forward", "inverse"):
        words = cost.worst_case(5, operation, False, tables)
        products, comparisons = (int(each) for each in re.findall(r"(\d+) (?:multiplications|comparisons)", words))
        products += cost.chain_products(tables)[operation]
        met = dearest(one, name, "loop", operation == "inverse", 60)
        assert met[0] <= products <= 2 * met[0], (words, met)
        if effect in PLAY_EFFECTS:
            assert met[1] <= comparisons <= 2 * met[1], (words, met)


@pytest.mark.slow(one_in=3)
@pytest.mark.parametrize("n", [1, 16, 64])
@pytest.mark.parametrize("operation", ["forward", "inverse"])
@pytest.mark.parametrize("front", FRONTS)
@pytest.mark.parametrize("engine", ["corners", "loop"])
@pytest.mark.parametrize("name", ["float64", "q31", "q15"])
def test_no_step_takes_more_than_the_banner_says_nor_far_less(
    name: str, engine: str, front: str, operation: str, n: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Random jumps take at least half of the promised operations; kernels of tanh and atanh are not counted."""
    for kernel, of in (("tanh", math.tanh), ("atanh", math.atanh)):
        monkeypatch.setattr(envelopes, kernel, lambda x, _, of=of: Number(of(float(x))))
    one = model(front, n)
    words = cost.worst_case(n, operation, engine == "corners", one.tables(name, engine))
    promised = [int(number) for number in re.findall(r"(\d+) (?:multiplications|comparisons)", words)]
    for met, most in zip(dearest(one, name, engine, operation == "inverse"), promised, strict=True):
        assert met <= most <= 2 * met, (words, met)
