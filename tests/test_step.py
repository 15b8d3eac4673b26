"""Steps, commits and resets do what the contract says, which is played out here with plain plays and bisection."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from modelfiles import FILES

from hystgen.basics.jit import plain
from hystgen.cascade import Cascade
from hystgen.compensator import reference, tables
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.model import Model, cascade_of
from hystgen.parameters.files import parse_parameters
from hystgen.plays import slots

pytestmark = pytest.mark.thorough

CLOSE = 1e-7


class Actuator:
    """The plant as the contract describes it: textbook plays of w = G[v] and the direction of the drive."""

    def __init__(self, model: Cascade) -> None:
        self.model = model
        self.r, self.p = np.array(model.pi.thresholds), np.array(model.pi.weights)
        self.low, self.high = model.input_range

    def front(self, v: float, up: bool) -> float:
        for stage in self.model.stages:
            if isinstance(stage, TanhEnvelope):
                a0, a1, a2, a3 = stage.ascending if up else stage.descending
                v = a0 * math.tanh(a1 * v + a2) + a3
            else:
                v = sum(
                    eta * (max(v - rho, 0.0) if rho > 0 else min(v - rho, 0.0) if rho < 0 else v)
                    for rho, eta in zip(stage.thresholds, stage.weights, strict=True)
                )
        return v

    def front_inverse(self, w: float) -> float:
        if not any(isinstance(stage, TanhEnvelope) for stage in self.model.stages):
            # the map outside the range does not matter: its ends go on straight
            for end, inside in ((self.low, self.low + 1e-3), (self.high, self.high - 1e-3)):
                slope = (self.front(end, True) - self.front(inside, True)) / (end - inside)
                if (w - self.front(end, True)) / slope * (end - inside) >= 0:
                    return end + (w - self.front(end, True)) / slope
            return bisect(lambda v: self.front(v, True), w, self.low, self.high)
        return bisect(lambda v: self.front(v, True), w, -50.0, 50.0)

    def set(self, plays: np.ndarray) -> None:
        self.plays, self.up = plays.copy(), True
        self.drive = self.front_inverse(float(plays[0]))

    def direction(self, v: float) -> bool:
        return True if v > self.drive else False if v < self.drive else self.up

    def moved(self, v: float, up: bool) -> np.ndarray:
        w = self.front(v, up)
        return np.maximum(w - self.r, np.minimum(w + self.r, self.plays))

    def would_give(self, v: float, up: bool) -> float:
        return float(self.p @ self.moved(v, up)) + self.model.output_offset

    def go(self, v: float) -> None:
        self.up = self.direction(v)
        self.plays = self.moved(v, self.up)
        self.drive = v

    def output(self) -> float:
        return float(self.p @ self.plays) + self.model.output_offset


def bisect(rising: object, value: float, low: float, high: float) -> float:
    for _ in range(60):
        middle = (low + high) / 2
        if rising(middle) < value:  # type: ignore[operator]
            low = middle
        else:
            high = middle
    return (low + high) / 2


class Compensator:
    """The inverse operator in the contract's words. `sure` is False where rounding may decide a status bit."""

    def __init__(self, model: Cascade, out: tuple[float, float]) -> None:
        self.plant, self.out = Actuator(model), out
        self.set(np.array(model.pi.start))

    def set(self, plays: np.ndarray) -> None:
        self.plant.set(plays)
        self.pending: float | None = None
        self.answer = self.held_before_any_step()
        self.stepped = False
        self.level = self.plant.output()
        self.asked: float | None = None
        self.bits, self.sure = 0, True

    def held_before_any_step(self) -> float:
        return min(max(self.plant.drive, self.plant.low), self.plant.high)

    def commit(self, v: float) -> int:
        if not math.isfinite(v):
            return slots.HELD
        self.pending = min(max(v, self.plant.low), self.plant.high)
        self.asked = None
        return slots.INPUT_CLAMPED if self.pending != v else 0

    def step(self, u: float) -> tuple[float, int, bool]:
        if self.pending is not None:
            self.plant.go(self.pending)
        sure, self.fresh = True, False
        if not math.isfinite(u):
            bits = slots.HELD
            if not self.stepped:  # a committed first drive is where the actuator is
                self.answer = self.held_before_any_step()
        elif self.asked is not None and u == self.asked:
            bits, sure = self.bits, self.sure
        else:
            bits, sure = self.solve(u)
            self.fresh = True
            self.asked, self.bits, self.sure = u, bits, sure
        self.pending, self.stepped = self.answer, True
        return self.answer, bits, sure

    def solve(self, u: float) -> tuple[int, bool]:
        bits = 0
        limited = min(max(u, self.out[0]), self.out[1])
        if limited != u:
            bits |= slots.INPUT_CLAMPED
        a = self.plant
        first = True if limited > self.level else False if limited < self.level else a.up
        self.level = limited
        # With one curve, both directions meet at the present drive; with two, each extends down or up to its own end
        ways = {True: (a.drive, max(a.drive, a.high) + 0.9), False: (min(a.drive, a.low) - 0.9, a.drive)}
        if not self.plant.model.branches_differ:
            first = limited >= a.would_give(a.drive, a.up)
        for up in (first, not first):
            low, high = ways[up]
            # a reference beyond all that a branch gives needs a drive beyond the range, in the branch's own direction
            if limited >= a.would_give(low, up) - CLOSE if up else limited <= a.would_give(high, up) + CLOSE:
                v = bisect(lambda x, up=up: a.would_give(x, up), limited, low, high)
                break
        else:
            v = a.drive
        self.answer = min(max(v, a.low), a.high)
        if self.answer != v:
            bits |= slots.OUTPUT_CLAMPED
        return bits, min(abs(v - a.low), abs(v - a.high)) > CLOSE


def load(name: str) -> Cascade:
    return cascade_of(parse_parameters(FILES[name], name))


@st.composite
def calls(draw: st.DrawFn) -> list[tuple[int, float]]:
    """Operations with arguments as shares of the range; some are NaN, infinite, repeated or out of range, and some
    leave the status unread."""
    length = draw(st.integers(1, 60))
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    made: list[tuple[int, float]] = []
    for _ in range(length):
        kind = rng.choice(
            [slots.OP_STEP, slots.OP_COMMIT, slots.OP_RESET, slots.OP_INIT], p=[0.75, 0.2, 0.03, 0.02]
        )
        part = rng.uniform(-0.1, 1.1)
        if rng.random() < 0.08:
            part = rng.choice([np.nan, np.inf, -np.inf])
        elif made and rng.random() < 0.25:
            part = made[-1][1]
        made.append((int(kind) | (slots.OP_UNREAD if rng.random() < 0.4 else 0), float(part)))
    return made


def run(model: Cascade, engine: str, inverse: bool, made: list[tuple[int, float]]) -> tuple[np.ndarray, ...]:
    numbers = tables.build(model, "float64", engine)
    code, state = reference.operations(numbers, inverse), reference.new_state(numbers, inverse)
    low, high = numbers.limits.output[0] if inverse else numbers.limits.drive[0]
    drive_low, drive_high = model.input_range
    op = np.array([kind for kind, _ in made], dtype=np.uint8)
    x = np.array(
        [
            drive_low + part * (drive_high - drive_low)
            if kind & slots.OP_CALL == slots.OP_COMMIT
            else low + part * (high - low)
            for kind, part in made
        ]
    )
    answers, status = np.zeros(len(x)), np.zeros(len(x), np.int64)
    with plain():
        code.init(numbers, state)
        code.run(numbers, state, op, x, answers, status)
    return x, answers, status, np.array([low, high])


@pytest.mark.slow(one_in=2)
@pytest.mark.parametrize("engine", ["corners", "loop"])
@pytest.mark.parametrize("name", FILES)
@settings(max_examples=50)
@given(made=calls())
def test_inverse_does_what_the_contract_says(name: str, engine: str, made: list[tuple[int, float]]) -> None:
    model = load(name)
    x, answers, status, out = run(model, engine, True, made)
    spec = Compensator(model, (float(out[0]), float(out[1])))
    gathered, unsure = 0, slots.DOMAIN
    for i, (each, _) in enumerate(made):
        kind, sure = each & slots.OP_CALL, True
        if kind == slots.OP_COMMIT:
            expected = spec.commit(x[i])
        elif kind == slots.OP_INIT:
            spec.set(np.array(model.pi.start))
            expected = 0
        else:
            if kind == slots.OP_RESET:
                spec.set(np.zeros(model.pi.n + 1))
            v, expected, sure = spec.step(x[i])
            if kind == slots.OP_STEP:
                assert answers[i] == pytest.approx(v, abs=CLOSE, rel=0), (i, kind, x[i])
                if spec.fresh:
                    # Go on from the same drive, or differences of rounding would add up
                    spec.answer = spec.pending = float(answers[i])
        if kind in (slots.OP_INIT, slots.OP_RESET):
            gathered, unsure = 0, slots.DOMAIN
        gathered, unsure = gathered | expected, unsure | (0 if sure else slots.OUTPUT_CLAMPED)
        if each & slots.OP_UNREAD:
            assert status[i] == 0
        else:
            assert status[i] & ~unsure == gathered & ~unsure, (i, kind, x[i], status[i], gathered)
            gathered, unsure = 0, slots.DOMAIN


@pytest.mark.slow(one_in=2)
@pytest.mark.parametrize("engine", ["corners", "loop"])
@pytest.mark.parametrize("name", FILES)
@settings(max_examples=50)
@given(made=calls())
def test_forward_does_what_the_contract_says(name: str, engine: str, made: list[tuple[int, float]]) -> None:
    model = load(name)
    made = [(kind, part) for kind, part in made if kind & slots.OP_CALL != slots.OP_COMMIT]
    x, answers, status, out = run(model, engine, False, made)
    plant = Actuator(model)
    plant.set(np.array(model.pi.start))
    gathered = 0
    for i, (each, _) in enumerate(made):
        kind, expected = each & slots.OP_CALL, 0
        if kind in (slots.OP_INIT, slots.OP_RESET):
            gathered = 0
        if kind == slots.OP_INIT:
            plant.set(np.array(model.pi.start))
        else:
            if kind == slots.OP_RESET:
                plant.set(np.zeros(model.pi.n + 1))
            if math.isfinite(x[i]):
                limited = min(max(x[i], out[0]), out[1])
                expected = slots.INPUT_CLAMPED if limited != x[i] else 0
                plant.go(float(limited))
            else:
                expected = slots.HELD
            if kind == slots.OP_STEP:
                assert answers[i] == pytest.approx(plant.output(), abs=CLOSE, rel=0)
        gathered |= expected
        if each & slots.OP_UNREAD:
            assert status[i] == 0
        else:
            assert status[i] == gathered
            gathered = 0


@pytest.mark.parametrize("arithmetic", ["float32", "float64"])
@pytest.mark.parametrize("name", FILES)
def test_the_same_input_again_gives_the_same_bits(name: str, arithmetic: str) -> None:
    model = Model(parse_parameters(FILES[name], name))
    low, high = model.cascade.output_range
    u = np.repeat(np.random.default_rng(5).uniform(low, high, 500), 4)
    v = model.inverse().simulate(u, arithmetic=arithmetic).reshape(-1, 4)
    assert (v == v[:, :1]).all()


@pytest.mark.parametrize("name", FILES)
def test_output_range_is_what_histories_can_reach(name: str) -> None:
    """No drive history leaves the range, and some histories come arbitrarily close to its ends."""
    model = load(name)
    low, high = model.output_range
    a = Actuator(model)
    rng = np.random.default_rng(7)
    seen = []
    for _ in range(300):
        a.set(np.array(model.pi.start))
        ends = rng.uniform(*model.input_range, rng.integers(0, 4))
        for v in (*ends, *rng.choice(model.input_range, 2)):
            a.go(float(v))
            seen.append(a.output())
            for nudge in (1e-9, -1e-9):  # a reversal at the rail shows the other branch
                if a.low <= v + nudge <= a.high:
                    seen.append(a.would_give(v + nudge, a.direction(v + nudge)))
    tolerance = 1e-7 * (high - low)
    assert low - tolerance <= min(seen) <= low + tolerance
    assert high - tolerance <= max(seen) <= high + tolerance


def test_saturation_does_not_corrupt_the_memory() -> None:
    """After references far beyond the range, the plant follows exactly as soon as they return."""
    model = load("plain")
    low, high = model.output_range
    k = np.linspace(0, 12 * np.pi, 3000)
    u = (low + high) / 2 + 0.8 * (high - low) * np.sin(k) * np.linspace(1, 0.2, 3000)
    v = Model(parse_parameters(FILES["plain"], "plain")).inverse().simulate(u, clamp=True)
    a = Actuator(model)
    a.set(np.array(model.pi.start))
    got = []
    for drive in v:
        a.go(float(drive))
        got.append(a.output())
    inside = (v > model.input_range[0]) & (v < model.input_range[1])
    assert (~inside).sum() > 100
    assert sum(b and not c for b, c in pairwise(inside)) >= 2
    assert np.abs(np.array(got)[inside] - u[inside]).max() < 1e-12 * (high - low)
