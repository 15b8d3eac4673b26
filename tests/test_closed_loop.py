"""Closed loops against what is known without the package: formulas, an ODE solver, a loop written out here."""

from __future__ import annotations

import doctest
import math
import os
import re
import runpy
import subprocess
import sys
from collections.abc import Iterator, Sequence
from decimal import Decimal, localcontext
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from modelfiles import FILES
from numpy.typing import NDArray
from scipy import integrate, linalg, signal

import hystgen
from hystgen import PI, Cascade, DeadZone, Model, closed_loop
from hystgen.basics.problems import EffectsError
from hystgen.closed_loop import BitReference, CompiledC, Loop, PIController, Response
from hystgen.compensator.bounds import error_bounds
from hystgen.emission.calls import emitted_files
from hystgen.parameters.files import parse_parameters
from hystgen.verification import compilers

Array = NDArray[np.float64]

# The note's (38), Examples 1 and 2, and the numbers of its Figure 16
NUMERATOR, DENOMINATOR = [8.8e16], [1.0, 1.6e4, 6.6e8, 5.3e12, 8.8e16]
GAINS = PIController(0.185, 185.0)
R = [0.0, 0.45, 0.9, 1.35, 1.8, 2.25, 2.7]
P = [0.72, 0.6, 0.48, 0.36, 0.24, 0.12, 0.012]
R_OFF = [0.0, 0.4678, 0.9178, 1.3678, 1.8178, 2.2678, 2.7178]
P_OFF = [0.7536, 0.6192, 0.4835, 0.3637, 0.2464, 0.1410, 0.0184]
T = 5e-5

STAGE = PI(R, P)
NOTE = "hystgen: 1\nname: note\ninput_range: [-6, 6]\nmodel:\n  pi:\n" f"    thresholds: {R}\n    weights: {P}\n"


def wanted(t: float) -> float:
    return 4.0 * math.sin(2.0 * math.pi * t)


def model(text: str) -> Model:
    return Model(parse_parameters(text))


def signals(response: Response) -> Array:
    names = ("output", "error", "control", "drive", "displacement")
    return np.array([getattr(response, name) for name in names])


# ---------------------------------------------------------------- 50 digits, and bounds on the roundings of doubles

U = 2.0**-53
"""Largest relative change by one rounding of a double."""

Decimals = NDArray[np.object_]
Plant = tuple[Decimals, Decimals, Decimals, Decimal]


@pytest.fixture(autouse=True)
def fifty_digits() -> Iterator[None]:
    with localcontext(prec=50):
        yield


def decimals(x: Any) -> Decimals:
    return np.array([Decimal(number) for number in np.ravel(x).tolist()], dtype=object).reshape(np.shape(x))


def distance(x: Array, exact: Decimals) -> float:
    return float(np.max(np.abs(decimals(x) - exact)))


def in_decimals(loop: Loop) -> Plant:
    a, b, c, d = loop.sampled_plant
    return decimals(a), decimals(b), decimals(c), Decimal(d)


def exponential(
    sample_time: float, numerator: Sequence[float] = NUMERATOR, denominator: Sequence[float] = DENOMINATOR
) -> Plant:
    """A plant of order 4 with a held input and states y, y', y'', y''', by a power series with 80 digits."""
    with mpmath.workdps(80):
        a = mpmath.zeros(5)
        for i in range(3):
            a[i, i + 1] = 1
        for i in range(4):
            a[3, i] = -mpmath.mpf(denominator[4 - i])
        a[3, 4] = mpmath.mpf(numerator[0])
        grown = mpmath.expm(a * mpmath.mpf(sample_time), method="taylor")
        digits = [[Decimal(mpmath.nstr(grown[i, j], 50)) for j in range(5)] for i in range(4)]
    exact = np.array(digits, dtype=object)
    return exact[:, :4], exact[:, 4], decimals([1.0, 0.0, 0.0, 0.0]), Decimal(0)


def moved(plant: Plant, displacement: Decimals) -> Decimals:
    """Output of a plant that starts at rest, for an input given at each sample."""
    a, b, c, d = plant
    x, held, output = decimals(np.zeros(len(b))), Decimal(0), []
    for h in displacement:
        output.append(c @ x + d * held)
        x, held = a @ x + b * h, h
    return np.array(output, dtype=object)


def linear(plant: Plant, gains: PIController, sample_time: float, reference: Array) -> Decimals:
    """Output of the loop without hysteresis, written out."""
    a, b, c, d = plant
    kp, g = Decimal(gains.kp), Decimal(gains.ki) * Decimal(sample_time)
    x, h, integral, output = decimals(np.zeros(len(b))), Decimal(0), Decimal(0), []
    for wanted in decimals(reference):
        output.append(c @ x + d * h)
        e = wanted - output[-1]
        integral += g * e
        h = kp * e + integral
        x = a @ x + b * h
    return np.array(output, dtype=object)


def accumulated(step: Array, each: Array, count: int) -> Array:
    """Bound on the sum of errors up to `each` in every sample of the recursion x = step x: sum of |step^k| each."""
    total, power = np.zeros(len(each)), np.eye(len(each))
    for _ in range(count):
        total += np.abs(power) @ each
        power = step @ power
    return total


def closed(plant: tuple[Array, Array, Array, float], kp: float, g: float) -> Array:
    """The closed loop's matrix for the plant's state, its held input and the integral."""
    a, b, c, d = plant
    seen = np.concatenate([c, [d, 0.0]])
    control = -(kp + g) * seen + np.eye(len(seen))[-1]
    integral = -g * seen + np.eye(len(seen))[-1]
    state = np.hstack([a, np.zeros((len(b), 2))]) + np.outer(b, control)
    return np.vstack([state, control, integral])


def exponential_roundings(a: Array, b: Array) -> tuple[Array, Array]:
    """Error of a Pade approximant p(-M)^-1 p(M) of exp M, M = [[A, B], [0, 0]] T of n rows: the smaller of two bounds.

    By norm: at most ten products and solutions, n roundings each, and the squarings, times the condition of the
    exponential. By entries, for small M: powers up to 13 of M and a solution take under 20 n roundings, each squaring
    twice as many, and no term is larger than those of exp |M| and exp |M| |exp M|.
    """
    n = len(b) + 1
    unit = float(np.max(np.abs(b)))  # unit of the input; it changes no rounding
    whole = np.vstack([np.hstack([a, b[:, None] / unit]), np.eye(n)[-1]])
    m = linalg.logm(whole).real
    squarings = max(0, math.ceil(math.log2(np.max(np.sum(np.abs(m), axis=0)))))
    missed = np.minimum(
        (10 + squarings) * n * U * linalg.expm_cond(m) * np.linalg.norm(whole),
        2**squarings * 20 * n * U * linalg.expm(np.abs(m)) @ (np.eye(n) + np.abs(whole)),
    )
    return missed[:-1, :-1], missed[:-1, -1] * unit


def balanced(exact: Plant) -> tuple[Array, Array, Array]:
    """A, B and C in doubles, with states scaled so that the exponential loses the fewest digits."""
    a, (scale, _) = linalg.matrix_balance(exact[0].astype(float), permute=False, separate=True)
    return a, exact[1].astype(float) / scale, exact[2].astype(float) * scale


def is_sampled(loop: Loop, exact: Plant) -> bool:
    """Whether the first samples after an impulse are the exact plant's, except for roundings of the exponential."""
    a, b, c = balanced(exact)
    impulse = decimals([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    found, expected = moved(in_decimals(loop), impulse), moved(exact, impulse)
    of_a, of_b = exponential_roundings(a, b)
    state = [np.abs(np.linalg.matrix_power(a, k) @ b) for k in range(5)]
    seen = [np.abs(c @ np.linalg.matrix_power(a, k)) for k in range(5)]
    missed = [seen[k] @ of_b + sum(seen[i] @ of_a @ state[k - 1 - i] for i in range(k)) for k in range(5)]
    return found[0] == expected[0] and bool(np.all(np.abs(found[1:] - expected[1:]) <= decimals(missed)))


def plant_roundings(loop: Loop, displacement: Array) -> tuple[Array, float]:
    """Bounds on the roundings of the plant's state and output in one sample: one for each term added up."""
    a, b, c, d = loop.sampled_plant
    largest, h = largest_state(a, b, displacement), float(np.max(np.abs(displacement)))
    state = (len(b) + 1) * U * (np.abs(a) @ largest + np.abs(b) * h)
    return state, (len(b) + 1) * U * float(np.abs(c) @ largest + abs(d) * h)


def largest_state(a: Array, b: Array, displacement: Array) -> Array:
    largest, x = np.zeros(len(b)), np.zeros(len(b))
    for h in displacement:
        x = a @ x + b * h
        largest = np.maximum(largest, np.abs(x))
    return largest


def allowed(loop: Loop, gains: PIController, response: Response, disturbance: float = 0.0) -> float:
    """How far roundings and a disturbance of the displacement in every sample can move the output of a linear loop."""
    _, b, c, d = loop.sampled_plant
    kp, g = gains.kp, gains.ki * loop.sample_time
    state, output = plant_roundings(loop, response.displacement)
    e, u = float(np.max(np.abs(response.error))), float(np.max(np.abs(response.control)))
    error = output + U * e
    integral = g * error + U * (2.0 * g * e + u + kp * e)  # roundings of g, of the product and of the sum
    control = kp * error + integral + U * (kp * e + u) + disturbance
    each = np.concatenate([state + np.abs(b) * control, [control, integral]])
    total = accumulated(closed(loop.sampled_plant, kp, g), each, len(response.t))
    return float(np.abs([*c, d, 0.0]) @ total) + output


class Plays:
    """The textbook sum of plays, in decimal."""

    def __init__(self, r: Sequence[Decimal], p: Sequence[Decimal]) -> None:
        self.r, self.p, self.s = r, p, [Decimal(0)] * len(r)

    def step(self, v: Decimal) -> Decimal:
        self.s = [max(v - r, min(v + r, s)) for r, s in zip(self.r, self.s, strict=True)]
        return sum((p * s for p, s in zip(self.p, self.s, strict=True)), Decimal(0))


def textbook_inverse(r: list[float], p: list[float]) -> Plays:
    r_, p_ = decimals(r), decimals(p)
    z = [sum((p_[g] * (r_[i] - r_[g]) for g in range(i)), Decimal(0)) for i in range(len(r))]
    c = np.cumsum(p_)
    return Plays(z, [1 / p_[0], *(-p_[i] / (c[i] * c[i - 1]) for i in range(1, len(p)))])


# ---------------------------------------------------------------- without hysteresis


def test_without_hysteresis_the_sampled_loop_is_its_difference_equation() -> None:
    loop = Loop((NUMERATOR, DENOMINATOR), GAINS, T)
    response = loop.run(wanted, 0.1)
    assert response.reference.tolist() == [wanted(k * T) for k in range(2000)]
    exact = linear(in_decimals(loop), GAINS, T, response.reference)
    assert distance(response.output, exact) <= allowed(loop, GAINS, response)
    np.testing.assert_array_equal(response.error, response.reference - response.output)
    np.testing.assert_array_equal(response.drive, response.control)
    np.testing.assert_array_equal(response.displacement, response.control)


def test_the_plant_moves_as_the_differential_equation_says() -> None:
    """solve_ivp integrates the plant between samples; sensor, controller and hold are written out here."""
    loop = Loop((NUMERATOR, DENOMINATOR), GAINS, 1e-4)
    response = loop.run(wanted, 0.02)
    rate = 1e4  # states in units of the time in which they change
    poly = [a / rate**i for i, a in enumerate(DENOMINATOR)]

    def moving(_: float, x: Array, held: float) -> list[float]:
        pull = poly[4] * (held - x[0]) - poly[3] * x[1] - poly[2] * x[2] - poly[1] * x[3]
        return [rate * x[1], rate * x[2], rate * x[3], rate * pull]

    rtol, atol = 1e-13, 1e-15
    x, integral, output, missed = np.zeros(4), 0.0, [], np.zeros(4)
    for k in range(200):
        output.append(x[0])
        e = wanted(k * 1e-4) - x[0]
        integral += 185.0 * 1e-4 * e
        held = 0.185 * e + integral
        solved = integrate.solve_ivp(moving, (0, 1e-4), x, "DOP853", args=(held,), rtol=rtol, atol=atol)
        # in every step the solver keeps the root mean square of the four states' errors within the tolerance
        missed = np.maximum(missed, 2.0 * np.sum(atol + rtol * np.abs(solved.y), axis=1))
        x = solved.y[:, -1]
    a, b, c = (x.astype(float) for x in exponential(1e-4)[:3])
    unit = rate ** np.arange(4)
    step = closed((a * unit / unit[:, None], b / unit, c, 0.0), 0.185, 185.0 * 1e-4)
    solver = accumulated(step, np.concatenate([missed, [0.0, 0.0]]), 200)[0]
    a, b, c = balanced(exponential(1e-4))
    of_a, of_b = exponential_roundings(a, b)
    inexact = of_a @ largest_state(a, b, response.displacement) + of_b * np.max(np.abs(response.displacement))
    step = closed((a, b, c, 0.0), 0.185, 185.0 * 1e-4)
    sampling = np.abs(c) @ accumulated(step, np.concatenate([inexact, [0.0, 0.0]]), 200)[:4]
    assert np.max(np.abs(response.output)) > 0.2
    assert np.max(np.abs(response.output - output)) <= solver + sampling + 2.0 * allowed(loop, GAINS, response)


@pytest.mark.parametrize("sample_time", [1e-6, 1e-5, 1e-4])
def test_the_sampled_plant_keeps_its_digits(sample_time: float) -> None:
    """Without balancing, the matrix exponential of (38) would be off by 5e-8 at 1 us."""
    assert is_sampled(Loop((NUMERATOR, DENOMINATOR), GAINS, sample_time), exponential(sample_time))


def test_a_plant_with_feedthrough_is_read_before_the_drive_moves() -> None:
    loop, gains = Loop(([1.0, 5.0], [1.0, 2.0]), 0.4, 0.01), PIController(0.4, 0.0)
    response = loop.run(np.ones(50))
    decay = (-2 * Decimal(loop.sample_time)).exp()
    plant = decimals([[0.0]]) + decay, decimals([0.0]) + 1 - decay, decimals([1.5]), Decimal(1)  # 1 + 3 / (s + 2)
    assert is_sampled(loop, plant)
    exact = linear(in_decimals(loop), gains, loop.sample_time, response.reference)
    assert distance(response.output, exact) <= allowed(loop, gains, response)
    assert Loop(([2.0], [1.0]), 1.0, 0.01).run([1.0, 1.0, 1.0]).output.tolist() == [0.0, 2.0, -2.0]


def test_systems_of_scipy_and_written_out_forms_are_the_same_plant() -> None:
    """Poles at -1, -2 and -1 +- 1j, for which every form has exact numbers."""
    zpk: tuple[list[float], list[complex], float] = [], [-1.0, -2.0, -1.0 + 1.0j, -1.0 - 1.0j], 4.0
    fraction = [4.0], [1.0, 5.0, 10.0, 10.0, 4.0]
    space = signal.lti(*fraction).to_ss()
    plants = [
        fraction, signal.TransferFunction(*fraction), zpk, signal.ZerosPolesGain(*zpk),
        space, (space.A, space.B, space.C, space.D), signal.lti(*zpk).to_ss().to_discrete(0.25),
    ]  # fmt: skip
    assert all(is_sampled(Loop(plant, GAINS, 0.25), exponential(0.25, *fraction)) for plant in plants)


def test_a_discrete_system_is_a_controller() -> None:
    system = signal.dlti([0.185 + 185.0 * T, -0.185], [1.0, -1.0], dt=T)
    plant = (NUMERATOR, DENOMINATOR)
    ours, theirs = Loop(plant, GAINS, T), Loop(plant, system, T).run(wanted, 0.05)
    exact = linear(in_decimals(ours), GAINS, T, theirs.reference)
    assert distance(theirs.output, exact) <= allowed(ours, GAINS, theirs)
    late = signal.dlti([0.185 + 185.0 * T, -0.185], [1.0, -1.0, 0.0], dt=T)  # times 1/z
    delayed = Loop(plant, late, T).run(np.ones(20))
    assert delayed.control[:2].tolist() == [0.0, 0.185 + 185.0 * T]


# ---------------------------------------------------------------- with hysteresis


@pytest.mark.thorough
def test_figure_16_is_what_the_model_page_says() -> None:
    """Largest errors of the second period. The note claims that both inverses far surpass none; they do not."""
    cases = {
        "none": (None, 0.102),
        "exact": (STAGE.inverse(), 0.136),
        "approximate": (PI(R_OFF, P_OFF).inverse(), 0.139),
        "scale": (1.0 / 2.05, 0.206),
        "scale of the gain in this loop": (1.0 / 1.69, 0.171),
    }
    for name, (compensator, expected) in cases.items():
        response = Loop((NUMERATOR, DENOMINATOR), GAINS, T, STAGE, compensator).run(wanted, 2.0)
        assert round(response.max_error(start=1.0), 3) == expected, name


@pytest.mark.thorough
def test_the_uncompensated_loop_rings_where_its_slope_is_beyond_the_stability_limit() -> None:
    """With an actuator of slope m, the roots of s den + m (kp s + ki) num lie on the left up to m = 1.28."""

    def damped(slope: float) -> bool:
        closed = np.polyadd([*DENOMINATOR, 0.0], slope * NUMERATOR[0] * np.array([0.185, 185.0]))
        return bool(np.max(np.roots(closed).real) < 0.0)

    def ripple(**parts: object) -> float:
        response = Loop((NUMERATOR, DENOMINATOR), GAINS, 1e-5, **parts).run(wanted, 0.98)  # type: ignore[arg-type]
        return float(np.ptp(np.diff(response.error[-5000:], 2)))

    assert damped(sum(P[:2]) * 0.97)
    assert not damped(sum(P[:2]))
    assert ripple(hysteresis=STAGE) > 1e3 * ripple(hysteresis=STAGE, compensator=STAGE.inverse())
    assert ripple(hysteresis=1.25) < 1e-3 < 1e3 < ripple(hysteresis=1.33)


def within(pi: PI, signal: Array) -> Cascade:
    """The play sum with the range of a signal in the loop, which its bounds depend on."""
    largest = float(np.max(np.abs(signal)))
    return Cascade(pi, input_range=(-largest, largest))


def check_linear(loop: Loop, response: Response, stage: Cascade) -> None:
    """A model behind its inverse passes its input on, except for roundings, to which the loop responds as to any input.

    The inverse amplifies by the sum of |q_i| (37), so the bound on its drive is divided by that sum.
    """
    bounds = error_bounds(stage, "float64", "corners")
    gain = (2.0 / stage.pi.weights[0] - 1.0 / stage.pi.slopes[-1]) / stage.front_slopes[0]
    missed = float(np.max(np.abs(response.displacement - response.control)))
    assert missed <= bounds.forward + bounds.rounding / gain
    exact = linear(in_decimals(loop), GAINS, T, response.reference)
    assert distance(response.output, exact) <= allowed(loop, GAINS, response, missed)


def check_blocks(loop: Loop, response: Response) -> None:
    """Check each signal against the one before it, except the drive, which is left to the test."""
    np.testing.assert_array_equal(response.error, response.reference - response.output)
    # control: u = kp e + I, I = I + g e; g, two products and two sums are rounded
    kp, g = Decimal(GAINS.kp), Decimal(GAINS.ki) * Decimal(loop.sample_time)
    e, u = decimals(response.error), decimals(response.control)
    before = [decimals(np.concatenate([[0.0], x[:-1]])) for x in (response.error, response.control)]
    missed = np.abs(u - before[1] - kp * (e - before[0]) - g * e)
    roundings = 2 * (np.abs(u) + kp * np.abs(e) + g * np.abs(e)) + np.abs(before[1]) + kp * np.abs(before[0])
    assert np.all(missed <= Decimal(U) * roundings)
    # displacement: the sum of plays
    plays = Plays(decimals(R).tolist(), decimals(P).tolist())
    exact = np.array([plays.step(v) for v in decimals(response.drive)], dtype=object)
    bound = error_bounds(within(STAGE, response.drive), "float64", "corners").forward
    assert distance(response.displacement, exact) <= bound
    # output: the plant, whose roundings decay like its state
    state, output = plant_roundings(loop, response.displacement)
    a, _, c, _ = loop.sampled_plant
    bound = np.abs(c) @ accumulated(a, state, len(response.t)) + output
    assert distance(response.output, moved(in_decimals(loop), decimals(response.displacement))) <= bound


def check_inverse(response: Response, bound: float, r: list[float] = R, p: list[float] = P) -> None:
    inverse = textbook_inverse(r, p)
    exact = np.array([inverse.step(u) for u in decimals(response.control)], dtype=object)
    assert distance(response.drive, exact) <= bound


@pytest.mark.parametrize("case", ["none", "exact", "approximate", "scale"])
def test_every_signal_is_that_of_the_loop_written_out(case: str) -> None:
    """Checked block by block, because hysteresis in the loop may drive two close trajectories apart."""
    scale, off = 1.0 / 2.05, PI(R_OFF, P_OFF).inverse()
    compensators = {"none": None, "exact": Cascade(STAGE).inverse(), "approximate": off, "scale": scale}
    loop = Loop((NUMERATOR, DENOMINATOR), GAINS, T, STAGE, compensators[case])
    response = loop.run(wanted, 1.0)
    check_blocks(loop, response)
    if case == "exact":
        check_inverse(response, error_bounds(within(STAGE, response.drive), "float64", "corners").rounding)
    elif case == "approximate":
        # its thresholds and weights have at most five roundings
        inexact = 5 * U * sum(map(abs, off.weights)) * (np.max(np.abs(response.control)) + off.thresholds[-1])
        forward = error_bounds(within(off, response.control), "float64", "corners").forward
        check_inverse(response, forward + inexact, R_OFF, P_OFF)
    else:
        np.testing.assert_array_equal(response.drive, (scale if case == "scale" else 1.0) * response.control)


def test_with_the_exact_inverse_the_hysteresis_is_gone() -> None:
    loop = Loop((NUMERATOR, DENOMINATOR), GAINS, T, STAGE, STAGE.inverse())
    response = loop.run(wanted, 0.5)
    check_linear(loop, response, within(STAGE, response.drive))
    assert np.max(np.abs(response.drive - response.control)) > 1.0


@pytest.mark.thorough
def test_generalized_models_stand_in_a_loop() -> None:
    bent = Cascade(STAGE, (DeadZone([-1.0, -0.4, 0, 0.4, 1.0], [-1.1, -0.9, 4.8, -1.1, -1.1]),), 0.0, (-3.0, 3.0))
    loop = Loop((NUMERATOR, DENOMINATOR), GAINS, T, bent, bent.inverse())
    check_linear(loop, loop.run(wanted, 0.5), bent)
    for name in ("curved", "two_branches", "mixed"):
        stage = model(FILES[name])
        low, high = stage.cascade.output_range
        middle, swing = (low + high) / 2, 0.3 * (high - low)
        reference = middle + swing * np.sin(np.arange(4000) / 150)
        loop = Loop((NUMERATOR, DENOMINATOR), GAINS, T, stage, stage.inverse())
        check_linear(loop, loop.run(reference), stage.cascade)


def test_the_compensator_of_a_model_keeps_the_drive_in_its_range() -> None:
    stage = model(NOTE)
    response = Loop(([1.0], [1e-3, 1.0]), GAINS, T, stage, stage.inverse()).run(np.full(4000, 50.0))
    assert 6.0 - np.spacing(6.0) <= np.max(response.drive) <= 6.0  # the drive for the largest output, which rounds
    assert response.control[-1] > stage.cascade.output_range[1]


# ---------------------------------------------------------------- the emitted C in the loop


@pytest.mark.parametrize("compiler", [None, *compilers.NAMES])
def test_compiled_float64_gives_the_bits_of_the_reference(compiler: str | None) -> None:
    if compiler and compilers.find(compiler) is None and not os.environ.get("CI"):
        pytest.skip(f"{compiler} is not installed")
    stage = model(NOTE)
    parts = BitReference(stage, arithmetic="float64"), CompiledC(stage, arithmetic="float64", compiler=compiler)
    loops = [Loop((NUMERATOR, DENOMINATOR), GAINS, T, stage, part) for part in parts]
    reference, compiled = [loop.run(wanted, 0.5) for loop in loops]
    assert signals(compiled).tobytes() == signals(reference).tobytes()
    check_blocks(loops[1], compiled)
    check_inverse(compiled, error_bounds(within(STAGE, compiled.drive), "float64", "corners").rounding)


@pytest.mark.parametrize("effect", [
    "name: creep, time_constants: [0.01], weights: [0.3]",
    "name: bouc_wen, weights: [0.06], widths: [9.0]",
    "name: bouc_wen, weights: [-0.015], widths: [9.0]",
])  # fmt: skip
@pytest.mark.parametrize("operator", ["forward", "inverse"])
def test_effects_that_change_the_output_range_change_its_codes(effect: str, operator: str) -> None:
    """In fixed point too, the whole range is reached, in physical units, as in double precision."""
    stage = Model(parse_parameters(
        "hystgen: 1\nname: s\ninput_range: [0, 100]\nsample_time: 1.0e-3\n"
        f"model: {{pi: {{thresholds: [0, 5], weights: [0.04, 0.01]}}, effects: [{{{effect}}}]}}\n"
    ))  # fmt: skip
    k = np.arange(1500)
    v = np.concatenate([[0.0], 50.0 - 50.0 * np.cos(0.02 * k) * (1.0 - k / 3000.0)])
    y = stage.simulate(v)
    given, wanted = (v, y) if operator == "forward" else (y, v)
    compiled = CompiledC(stage, operator, "q31")
    compiled.reset()
    found = np.array([compiled.step(x) for x in given.tolist()])
    assert np.max(np.abs(found - wanted)) < 1e-7 * np.ptp(wanted)



@pytest.mark.slow(one_in=2)
@pytest.mark.parametrize("name", ["listed", "two_branches"])
@pytest.mark.parametrize("arithmetic", ["float32", "q31", "q15"])
@pytest.mark.parametrize("operator", ["inverse", "forward"])
@pytest.mark.thorough
def test_compiled_c_gives_the_bits_of_the_reference(name: str, arithmetic: str, operator: str) -> None:
    stage = model(FILES[name])
    parts = BitReference(stage, operator, arithmetic), CompiledC(stage, operator, arithmetic)
    hysteresis = stage if operator == "inverse" else 1.0
    loops = [Loop((NUMERATOR, DENOMINATOR), GAINS, T, hysteresis, part) for part in parts]
    reference, compiled = [loop.run(wanted, 0.25) for loop in loops]
    assert signals(compiled).tobytes() == signals(reference).tobytes()
    assert np.ptp(compiled.drive) > 1.0
    again = loops[1].run(wanted, 0.25)
    assert signals(again).tobytes() == signals(compiled).tobytes(), "every run starts anew"


@pytest.mark.parametrize("arithmetic", ["float32", "q31", "q15"])
def test_a_coarser_arithmetic_moves_the_drive_by_no_more_than_its_header_states(arithmetic: str) -> None:
    """The C in the loop and the textbook inverse outside of it answer the same demand."""
    stage = model(NOTE)
    compiled = CompiledC(stage, arithmetic=arithmetic)
    response = Loop((NUMERATOR, DENOMINATOR), GAINS, T, stage, compiled).run(wanted, 1.0)
    header = emitted_files(stage, arithmetic=arithmetic)["note.h"]
    stated = {
        line.split()[1]: float(line.split()[2].strip("()f"))
        for line in header.splitlines()
        if line.startswith("#define NOTE_") and ("MAX_ERROR" in line or "_LSB" in line)
    }
    # the demand is first rounded to a code or float32; the inverse, of slope 1/p_0 at most, amplifies that by 2/p_0
    if arithmetic == "float32":
        bound, half = stated["NOTE_INVERSE_MAX_ERROR"], float(np.spacing(np.float32(16.0)) / 2)
    else:
        bound = stated["NOTE_INVERSE_MAX_ERROR_LSB"] * stated["NOTE_DRIVE_LSB"]
        half = stated["NOTE_OUTPUT_LSB"] / 2
    inverse = textbook_inverse(R, P)
    exact = np.array([inverse.step(u) for u in decimals(response.control)], dtype=object)
    worst = distance(response.drive, exact)
    assert 0.0 < worst <= bound + 2.0 / P[0] * half


@pytest.mark.thorough
def test_codes_are_the_nearest_and_saturate() -> None:
    coarse = "  pi: {thresholds: [0, 1], weights: [1, 2]}\nemit: {drive_lsb: 0.25, output_lsb: 0.5}\n"
    stage = model("hystgen: 1\nname: coarse\ninput_range: [-6, 6]\nmodel:\n" + coarse)
    for part in (BitReference(stage, "forward", "q15"), CompiledC(stage, "forward", "q15")):
        part.reset()
        near = [part.step(v) for v in (0.0, 0.874, 0.875, -0.874)]
        part.reset()
        at_codes = [part.step(v) for v in (0.0, 0.75, 1.0, -0.75)]
        assert near == at_codes
        assert all(y % 0.5 == 0.0 for y in near)
        assert part.step(1e30) == part.step(6.0) == part.step(math.inf)
        top = part.step(math.nan)
        assert top == part.step(6.0)


# ---------------------------------------------------------------- users' parts, errors


class Bang:
    """A user's controller with memory and without a base class."""

    def __init__(self) -> None:
        self.resets, self.sum = 0, 0.0

    def reset(self) -> None:
        self.resets, self.sum = self.resets + 1, 0.0

    def step(self, error: float) -> float:
        self.sum += math.copysign(0.01, error)
        return self.sum


def test_users_own_controllers_and_functions() -> None:
    bang = Bang()
    loop = Loop(([1.0], [1.0]), bang, 0.1, hysteresis=abs, compensator=lambda u: 2.0 * u)
    first, second = loop.run(np.full(5, 1.0)), loop.run(np.full(5, 1.0))
    assert bang.resets == 2
    np.testing.assert_array_equal(first.output, second.output)
    np.testing.assert_array_equal(first.control, np.cumsum(np.full(5, 0.01)))
    np.testing.assert_array_equal(first.drive, 2.0 * first.control)
    np.testing.assert_array_equal(first.output, [0.0, *first.drive[:-1]])


def test_errors_of_a_response() -> None:
    response = Loop(([1.0], [1.0]), 1.0, 0.1).run([3.0, 1.0, 1.0, -1.0])
    assert response.error.tolist() == [3.0, -2.0, 3.0, -4.0]
    assert response.max_error() == 4.0
    assert response.rms_error(0.1 + 0.2) == 4.0
    assert response.rms_error(0.2) == math.sqrt(12.5)
    with pytest.raises(ValueError, match=r"the response ends at 0\.3 s, before 0\.5 s"):
        response.max_error(0.5)


def test_a_loop_that_diverges_says_so_in_its_numbers() -> None:
    response = Loop(([1.0], [1.0, -1.0]), -1e3, 0.5, STAGE, CompiledC(model(NOTE), arithmetic="q15")).run(
        np.ones(2000)
    )
    assert abs(response.output[20]) > 1e3
    assert not np.isfinite(response.output[-1])


TWICE = Bang()


@pytest.mark.parametrize(
    ("change", "error", "said"),
    [
        ({"sample_time": 0.0}, ValueError, "the sample time 0.0 is not positive; give seconds per sample"),
        ({"sample_time": math.nan}, ValueError, "not positive"),
        ({"sample_time": "a"}, ValueError, "the sample time 'a' is not positive"),
        ({"plant": ([1.0, 0.0, 0.0], [1.0, 1.0])}, ValueError, "the plant is not proper"),
        ({"plant": 5.0}, ValueError, "the plant is not a system of scipy.signal; give one, or"),
        ({"plant": (np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)))}, ValueError, "2 inputs and 2 outputs"),
        ({"plant": ([math.inf], [1.0, 1.0])}, ValueError, "non-finite coefficients"),
        ({"plant": ([], [-1.0, -1.0 + 1.0j], 1.0)}, ValueError, "the plant has complex coefficients"),
        ({"plant": ([1j], [1.0, 1.0])}, ValueError, "the plant has complex coefficients"),
        ({"plant": signal.dlti([1.0], [1.0, 0.5], dt=0.2)}, ValueError, "sample time of 0.2 s, but the loop has 0.1 s"),
        ({"plant": signal.dlti([1.0], [1.0, 0.5]), "sample_time": 1.0}, ValueError, "has no sample time; give its dt"),
        ({"controller": math.nan}, ValueError, "the controller has to be a finite number, not nan"),
        ({"controller": TWICE, "compensator": TWICE}, ValueError, "the same block, with one memory, is used in two"),
        ({"controller": signal.dlti([1.0], [1.0, 0.5], dt=0.2)}, ValueError, "the controller has a sample time of 0.2"),
        ({"controller": None}, TypeError, "a loop needs a controller"),
        ({"controller": signal.lti([1.0], [1.0, 0.0])}, TypeError, "the controller is a continuous system"),
        ({"compensator": "inverse"}, TypeError, "the compensator cannot be a part of a loop"),
        ({"hysteresis": PI}, TypeError, "the hysteresis cannot be a part"),
    ],
)
def test_what_cannot_be_a_loop(change: dict[str, object], error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        Loop(**{"plant": ([1.0], [1.0, 1.0]), "controller": 1.0, "sample_time": 0.1, **change})  # type: ignore[arg-type]


def test_loops_compare_by_identity() -> None:
    one, other = (Loop((np.eye(1), [[1.0]], [[1.0]], [[0.0]]), 1.0, 0.1) for _ in range(2))
    assert one != other
    assert len({one, other}) == 2


@pytest.mark.parametrize(("kp", "ki", "name"), [(math.nan, 1.0, "kp"), ("a", 1.0, "kp"), (1.0, None, "ki")])
def test_gains_that_are_none(kp: float, ki: float, name: str) -> None:
    with pytest.raises(ValueError, match=f"{name} has to be a finite number"):
        PIController(kp, ki)


def test_operators_come_from_parameter_files(tmp_path: Path) -> None:
    file = tmp_path / "note.yaml"
    file.write_text(NOTE, encoding="utf-8")
    for make in (BitReference, CompiledC):
        assert make(file).step(1.5) == make(str(file)).step(1.5) == make(model(NOTE)).step(1.5)
        with pytest.raises(TypeError, match="PI"):
            make(STAGE)  # type: ignore[arg-type]


def test_what_cannot_be_a_reference_or_an_operator(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = Loop(([1.0], [1.0, 1.0]), 1.0, 0.1)
    for reference, duration, said in (
        (wanted, None, "needs a duration"),
        (wanted, 0.01, "needs a duration"),
        ([1.0], 1.0, "has its own duration"),
        ([], None, "at least one sample, and all samples must be finite"),
        ([1.0, math.nan], None, "at least one sample, and all samples must be finite"),
        ([[1.0]], None, "at least one sample, and all samples must be finite"),
        ("abc", None, "at least one sample, and all samples must be finite"),
        ([1j, 2.0], None, "at least one sample, and all samples must be finite"),
        (np.array([1j, 2.0]), None, "at least one sample, and all samples must be finite"),
    ):
        with pytest.raises(ValueError, match=said):
            loop.run(reference, duration)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="operator 'both' is neither inverse nor forward"):
        CompiledC(model(NOTE), "both")
    with pytest.raises(ValueError, match="compiler 'ls' is not one of gcc, clang, zig"):
        CompiledC(model(NOTE), compiler="ls")
    with monkeypatch.context() as patch:
        patch.setattr(compilers, "find", lambda _: None)
        with pytest.raises(compilers.CompileError, match="clang is not installed; on Debian: apt install clang"):
            CompiledC(model(NOTE), compiler="clang")
    creeping = model(NOTE + "  effects: [{name: lag, time_constant: 0.01}]\n")
    for make in (CompiledC, BitReference, lambda stage: Loop(([1.0], [1.0]), 1.0, 0.1, stage)):
        with pytest.raises(EffectsError, match="lag"):
            make(creeping)


def test_importing_the_package_does_not_import_loops() -> None:
    code = (
        "import sys, hystgen; assert not {'scipy', 'hystgen.closed_loop'} & set(sys.modules); "
        "hystgen.closed_loop.Loop; assert 'hystgen.closed_loop' in sys.modules and 'scipy' not in sys.modules; "
        "hystgen.plants.EverettTable, hystgen.density.from_table, hystgen.elastoplastic.series; "
        "assert {'plants', 'closed_loop', 'Model'} <= set(hystgen.__all__)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(hystgen.__file__).parents[1])


def test_the_example_of_the_module_runs() -> None:
    result = doctest.testmod(closed_loop)
    assert result.failed == 0
    assert result.attempted > 3


def test_the_example_of_the_page_runs(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    root = Path(__file__).parents[1]
    block = re.search(r"```python\n(.*?)```", (root / "docs/howto/closed-loop.md").read_text("utf-8"), re.DOTALL)
    assert block
    monkeypatch.chdir(root)
    exec(block[1], {})
    shown = re.findall(r"print\(.*# (\S+)", block[1])
    assert shown
    assert capsys.readouterr().out.split() == shown


@pytest.mark.thorough
def test_the_example_of_the_note_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The example checks the errors of its four cases itself; C in float32 has the exact inverse's error."""
    example = Path(__file__).parents[1] / "examples" / "note" / "closed_loop.py"
    monkeypatch.syspath_prepend(str(example.parent))  # as Python does when it runs a file
    runpy.run_path(str(example))["make"](tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["figure_15.svg", "figure_16.svg"]
    lines = {line[2:42].strip(): line.split()[-3:] for line in capsys.readouterr().out.splitlines()}
    assert lines["emitted C, float32"] == lines["exact inverse"] == ["0.1357", "0.0960", "0.0000"]
