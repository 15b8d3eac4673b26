"""Closed loops against what is known without the package: formulas, an ODE solver, a loop written out here."""

from __future__ import annotations

import doctest
import math
import runpy
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import mpmath
import numpy as np
import pytest
from modelfiles import FILES
from numpy.typing import NDArray
from scipy import integrate, signal

import hystgen
from hystgen import PI, Cascade, DeadZone, Model, closed_loop
from hystgen.closed_loop import BitReference, CompiledC, Loop, PIController, Response
from hystgen.params import parse_parameters
from hystgen.problems import UnsupportedEffectsError
from hystgen.verification import compilers

Array = NDArray[np.float64]

# The note's (38), Examples 1 and 2, and what goes with its Figure 16
NUMERATOR, DENOMINATOR = [8.8e16], [1.0, 1.6e4, 6.6e8, 5.3e12, 8.8e16]
GAINS = PIController(0.185, 185.0)
R = [0.0, 0.45, 0.9, 1.35, 1.8, 2.25, 2.7]
P = [0.72, 0.6, 0.48, 0.36, 0.24, 0.12, 0.012]
Q = [1.3889, -0.6313, -0.2020, -0.0926, -0.0463, -0.0198, -0.0019]
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


class Plays:
    """The textbook sum of plays."""

    def __init__(self, r: list[float], p: list[float]) -> None:
        self.r, self.p, self.s = r, p, [0.0] * len(r)

    def step(self, v: float) -> float:
        self.s = [max(v - r, min(v + r, s)) for r, s in zip(self.r, self.s, strict=True)]
        return math.fsum(p * s for p, s in zip(self.p, self.s, strict=True))


def textbook_inverse(r: list[float], p: list[float]) -> Plays:
    z = [sum(p[g] * (r[i] - r[g]) for g in range(i)) for i in range(len(r))]
    c = np.cumsum(p)
    return Plays(z, [1 / p[0], *(-p[i] / (c[i] * c[i - 1]) for i in range(1, len(p)))])


def exponential(sample_time: float) -> tuple[Array, Array, Array]:
    """The note's plant with a held input, by a power series with 60 digits, in the phase variables y, y', y'', y'''."""
    with mpmath.workdps(60):
        a = mpmath.zeros(5)
        for i in range(3):
            a[i, i + 1] = 1
        for i in range(4):
            a[3, i] = -mpmath.mpf(DENOMINATOR[4 - i])
        a[3, 4] = mpmath.mpf(NUMERATOR[0])
        grown = mpmath.expm(a * mpmath.mpf(sample_time), method="taylor")
        # states in units of the time in which they change, so that doubles will do
        unit = [mpmath.mpf(1e4) ** i for i in range(4)] + [mpmath.mpf(1)]
        scaled = np.array([[float(grown[i, j] * unit[j] / unit[i]) for j in range(5)] for i in range(4)])
    return scaled[:, :4], scaled[:, 4], np.array([1.0, 0.0, 0.0, 0.0])


def brute(compensator: Callable[[float], float] | None, count: int) -> Array:
    """The loop of Figure 15 written out: rows output, error, control, drive, displacement."""
    a, b, c = exponential(T)
    x, integral, plays = np.zeros(4), 0.0, Plays(R, P)
    rows = []
    for k in range(count):
        y = float(c @ x)
        e = wanted(k * T) - y
        integral += e
        u = 0.185 * e + 185.0 * T * integral
        v = u if compensator is None else compensator(u)
        h = plays.step(v)
        x = a @ x + b * h
        rows.append((y, e, u, v, h))
    return np.array(rows).T


# ---------------------------------------------------------------- without hysteresis


def test_without_hysteresis_the_sampled_loop_is_its_transfer_function() -> None:
    loop = Loop((NUMERATOR, DENOMINATOR), GAINS, T)
    response = loop.run(wanted, 0.1)
    num, den, _ = signal.cont2discrete((NUMERATOR, DENOMINATOR), T)
    c_num, c_den = np.array([0.185 + 185.0 * T, -0.185]), np.array([1.0, -1.0])
    open_num, open_den = np.convolve(num[0], c_num), np.convolve(den, c_den)
    closed = signal.lfilter(open_num, open_num + open_den, response.reference)
    assert len(response.t) == 2000
    np.testing.assert_allclose(response.output, closed, atol=1e-9)
    np.testing.assert_array_equal(response.error, response.reference - response.output)
    np.testing.assert_array_equal(response.drive, response.control)
    np.testing.assert_array_equal(response.displacement, response.control)


def test_the_plant_moves_as_the_differential_equation_says() -> None:
    """Between samples solve_ivp integrates the plant itself; sensor, controller and hold are written out here."""
    response = Loop((NUMERATOR, DENOMINATOR), GAINS, 1e-4).run(wanted, 0.02)
    rate = 1e4  # states in units of the time in which they change
    poly = [a / rate**i for i, a in enumerate(DENOMINATOR)]

    def moved(_: float, x: Array, held: float) -> list[float]:
        pull = poly[4] * (held - x[0]) - poly[3] * x[1] - poly[2] * x[2] - poly[1] * x[3]
        return [rate * x[1], rate * x[2], rate * x[3], rate * pull]

    x, integral, output = np.zeros(4), 0.0, []
    for k in range(200):
        output.append(x[0])
        e = wanted(k * 1e-4) - x[0]
        integral += 185.0 * 1e-4 * e
        held = 0.185 * e + integral
        x = integrate.solve_ivp(moved, (0, 1e-4), x, "DOP853", args=(held,), rtol=1e-11, atol=1e-13).y[:, -1]
    assert np.max(np.abs(response.output)) > 0.2
    np.testing.assert_allclose(response.output, output, atol=1e-9)


@pytest.mark.parametrize("sample_time", [1e-6, 1e-5, 1e-4])
def test_the_sampled_plant_keeps_its_digits(sample_time: float) -> None:
    """Unbalanced, the matrix exponential of (38) is off by 5e-8 at 1 us."""
    a, b, c, d = Loop((NUMERATOR, DENOMINATOR), GAINS, sample_time).sampled_plant
    a_exact, b_exact, c_exact = exponential(sample_time)
    x, exact = b, b_exact
    for _ in range(5):
        assert c @ x == pytest.approx(c_exact @ exact, rel=1e-11)
        x, exact = a @ x, a_exact @ exact
    assert d == 0.0


def test_a_plant_with_feedthrough_is_read_before_the_drive_moves() -> None:
    response = Loop(([1.0, 5.0], [1.0, 2.0]), 0.4, 0.01).run(np.ones(50))
    state, held, output = 0.0, 0.0, []  # (s + 5) / (s + 2) = 1 + 3 / (s + 2)
    for _ in range(50):
        output.append(held + state)
        held = 0.4 * (1.0 - output[-1])
        state = math.exp(-0.02) * state + 1.5 * (1.0 - math.exp(-0.02)) * held
    np.testing.assert_allclose(response.output, output, rtol=1e-12)
    assert Loop(([2.0], [1.0]), 1.0, 0.01).run([1.0, 1.0, 1.0]).output.tolist() == [0.0, 2.0, -2.0]


def test_systems_of_scipy_and_written_out_forms_are_the_same_plant() -> None:
    zpk = signal.tf2zpk(NUMERATOR, DENOMINATOR)
    space = signal.lti(NUMERATOR, DENOMINATOR).to_ss()
    plants = [
        (NUMERATOR, DENOMINATOR), signal.TransferFunction(NUMERATOR, DENOMINATOR), zpk, signal.ZerosPolesGain(*zpk),
        space, (space.A, space.B, space.C, space.D), signal.lti(*zpk).to_ss().to_discrete(T),
    ]  # fmt: skip
    first, *others = [Loop(plant, GAINS, T).run(wanted, 0.05).output for plant in plants]
    for other in others:
        np.testing.assert_allclose(other, first, atol=1e-8)


def test_a_discrete_system_is_a_controller() -> None:
    system = signal.dlti([0.185 + 185.0 * T, -0.185], [1.0, -1.0], dt=T)
    plant = (NUMERATOR, DENOMINATOR)
    ours, theirs = Loop(plant, GAINS, T).run(wanted, 0.05), Loop(plant, system, T).run(wanted, 0.05)
    np.testing.assert_allclose(theirs.control, ours.control, atol=1e-10)
    late = signal.dlti([0.185 + 185.0 * T, -0.185], [1.0, -1.0, 0.0], dt=T)  # times 1/z
    delayed = Loop(plant, late, T).run(np.ones(20))
    assert delayed.control[0] == 0.0
    assert delayed.control[1] == pytest.approx(0.185 + 185.0 * T)


# ---------------------------------------------------------------- with hysteresis


def test_figure_16_is_what_the_model_page_says() -> None:
    """Second period; the note claims that either inverse is greatly better than none, which does not come out."""
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


def test_the_uncompensated_loop_rings_where_its_slope_is_beyond_the_stability_limit() -> None:
    """With a slope m of the actuator, s den + m (kp s + ki) num has its roots on the left up to m = 1.28."""

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


@pytest.mark.parametrize("case", ["none", "exact", "approximate", "scale"])
def test_every_signal_is_that_of_the_loop_written_out(case: str) -> None:
    scale = 1.0 / 2.05
    parts: dict[str, tuple[object, Callable[[float], float] | None]] = {
        "none": (None, None),
        "exact": (Cascade(STAGE).inverse(), textbook_inverse(R, P).step),
        "approximate": (PI(R_OFF, P_OFF).inverse(), textbook_inverse(R_OFF, P_OFF).step),
        "scale": (scale, lambda u: scale * u),
    }
    compensator, textbook = parts[case]
    response = Loop((NUMERATOR, DENOMINATOR), GAINS, T, STAGE, compensator).run(wanted, 1.5)
    np.testing.assert_allclose(signals(response), brute(textbook, 30000), atol=1e-9)


def test_with_the_exact_inverse_the_hysteresis_is_gone() -> None:
    linear = Loop((NUMERATOR, DENOMINATOR), GAINS, T).run(wanted, 0.5)
    response = Loop((NUMERATOR, DENOMINATOR), GAINS, T, STAGE, STAGE.inverse()).run(wanted, 0.5)
    np.testing.assert_allclose(response.output, linear.output, atol=1e-11)
    assert np.max(np.abs(response.drive - response.control)) > 1.0


def test_generalized_models_stand_in_a_loop() -> None:
    bent = Cascade(STAGE, (DeadZone([-1.0, -0.4, 0, 0.4, 1.0], [-1.1, -0.9, 4.8, -1.1, -1.1]),), 0.0, (-3.0, 3.0))
    linear = Loop((NUMERATOR, DENOMINATOR), GAINS, T).run(wanted, 0.5)
    response = Loop((NUMERATOR, DENOMINATOR), GAINS, T, bent, bent.inverse()).run(wanted, 0.5)
    np.testing.assert_allclose(response.output, linear.output, atol=1e-10)
    for name in ("curved", "two_branches", "mixed"):
        stage = model(FILES[name])
        low, high = stage.cascade.output_range
        middle, swing = (low + high) / 2, 0.3 * (high - low)
        reference = middle + swing * np.sin(np.arange(4000) / 150)
        free = Loop((NUMERATOR, DENOMINATOR), GAINS, T).run(reference)
        held = Loop((NUMERATOR, DENOMINATOR), GAINS, T, stage, stage.inverse()).run(reference)
        np.testing.assert_allclose(held.output, free.output, atol=1e-8, err_msg=name)


def test_the_compensator_of_a_model_keeps_the_drive_in_its_range() -> None:
    stage = model(NOTE)
    response = Loop(([1.0], [1e-3, 1.0]), GAINS, T, stage, stage.inverse()).run(np.full(4000, 50.0))
    assert np.max(response.drive) == 6.0
    assert response.control[-1] > stage.cascade.output_range[1]


# ---------------------------------------------------------------- the emitted C in the loop


@pytest.mark.parametrize("compiler", [None, *(found.name for found in compilers.available())])
def test_compiled_float64_gives_the_bits_of_the_reference(compiler: str | None) -> None:
    stage = model(NOTE)
    parts = BitReference(stage, arithmetic="float64"), CompiledC(stage, arithmetic="float64", compiler=compiler)
    reference, compiled = [Loop((NUMERATOR, DENOMINATOR), GAINS, T, stage, part).run(wanted, 0.5) for part in parts]
    assert signals(compiled).tobytes() == signals(reference).tobytes()
    exact = brute(textbook_inverse(R, P).step, 10000)
    np.testing.assert_allclose(signals(compiled), exact, atol=1e-9)


@pytest.mark.parametrize("name", ["listed", "two_branches"])
@pytest.mark.parametrize("arithmetic", ["float32", "q31", "q15"])
@pytest.mark.parametrize("operator", ["inverse", "forward"])
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
    """The same demand, answered by the C in the loop and by the textbook inverse outside of it."""
    stage = model(NOTE)
    compiled = CompiledC(stage, arithmetic=arithmetic)
    response = Loop((NUMERATOR, DENOMINATOR), GAINS, T, stage, compiled).run(wanted, 1.0)
    header = hystgen.api.emitted_files(stage, arithmetic=arithmetic)["note.h"]
    stated = {
        line.split()[1]: float(line.split()[2].strip("()f"))
        for line in header.splitlines()
        if line.startswith("#define NOTE_") and ("MAX_ERROR" in line or "_LSB" in line)
    }
    # the demand is rounded to a code or float32 first; the inverse's slope is 1/p_0 at most, and it amplifies by 2/p_0
    if arithmetic == "float32":
        bound, half = stated["NOTE_INVERSE_MAX_ERROR"], float(np.spacing(np.float32(16.0)) / 2)
    else:
        bound = stated["NOTE_INVERSE_MAX_ERROR_LSB"] * stated["NOTE_DRIVE_LSB"]
        half = stated["NOTE_OUTPUT_LSB"] / 2
    textbook = textbook_inverse(R, P)
    exact = np.array([textbook.step(u) for u in response.control])
    worst = float(np.max(np.abs(response.drive - exact)))
    assert 0.0 < worst <= bound + 2.0 / P[0] * half


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
    """A controller with memory that is nobody's class."""

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
    np.testing.assert_allclose(first.control, [0.01, 0.02, 0.03, 0.04, 0.05])
    np.testing.assert_allclose(first.drive, 2.0 * first.control)
    np.testing.assert_allclose(first.output, [0.0, 0.02, 0.04, 0.06, 0.08])


def test_errors_of_a_response() -> None:
    response = Loop(([1.0], [1.0]), 1.0, 0.1).run([3.0, 1.0, 1.0, -1.0])
    assert response.error.tolist() == [3.0, -2.0, 3.0, -4.0]
    assert response.max_error() == 4.0
    assert response.rms_error(0.1 + 0.2) == 4.0
    assert response.rms_error(0.2) == pytest.approx(math.sqrt(12.5))
    with pytest.raises(ValueError, match=r"the response ends at 0\.3 s, before 0\.5 s"):
        response.max_error(0.5)


def test_a_loop_that_diverges_says_so_in_its_numbers() -> None:
    response = Loop(([1.0], [1.0, -1.0]), -1e3, 0.5, STAGE, CompiledC(model(NOTE), arithmetic="q15")).run(
        np.ones(2000)
    )
    assert abs(response.output[20]) > 1e3
    assert not np.isfinite(response.output[-1])


@pytest.mark.parametrize(
    ("change", "error", "said"),
    [
        ({"sample_time": 0.0}, ValueError, "the sample time 0.0 is not positive; give seconds per sample"),
        ({"sample_time": math.nan}, ValueError, "not positive"),
        ({"plant": ([1.0, 0.0, 0.0], [1.0, 1.0])}, ValueError, "the plant is not proper"),
        ({"plant": 5.0}, ValueError, "the plant is no system of scipy.signal; give one, or"),
        ({"plant": (np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)))}, ValueError, "2 inputs and 2 outputs"),
        ({"plant": ([math.inf], [1.0, 1.0])}, ValueError, "coefficients that are not finite"),
        ({"plant": signal.dlti([1.0], [1.0, 0.5], dt=0.2)}, ValueError, "sample time of 0.2 s, the loop 0.1 s"),
        ({"controller": signal.dlti([1.0], [1.0, 0.5], dt=0.2)}, ValueError, "the controller has a sample time of 0.2"),
        ({"controller": None}, TypeError, "a loop needs a controller"),
        ({"controller": signal.lti([1.0], [1.0, 0.0])}, TypeError, "the controller is a continuous system"),
        ({"compensator": "inverse"}, TypeError, "the compensator is none of the parts that a loop can have"),
        ({"hysteresis": PI}, TypeError, "the hysteresis is none of the parts"),
    ],
)
def test_what_cannot_be_a_loop(change: dict[str, object], error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        Loop(**{"plant": ([1.0], [1.0, 1.0]), "controller": 1.0, "sample_time": 0.1, **change})  # type: ignore[arg-type]


def test_what_cannot_be_a_reference_or_an_operator() -> None:
    loop = Loop(([1.0], [1.0, 1.0]), 1.0, 0.1)
    for reference, duration, said in (
        (wanted, None, "needs a duration"),
        (wanted, 0.01, "needs a duration"),
        ([1.0], 1.0, "has its own duration"),
        ([], None, "one finite number a sample"),
        ([1.0, math.nan], None, "one finite number a sample"),
        ([[1.0]], None, "one finite number a sample"),
    ):
        with pytest.raises(ValueError, match=said):
            loop.run(reference, duration)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="operator 'both' is neither inverse nor forward"):
        CompiledC(model(NOTE), "both")
    with pytest.raises(compilers.CompileError, match="tcc is not installed; install gcc or clang"):
        CompiledC(model(NOTE), compiler="tcc")
    creeping = model(NOTE + "  effects: [{name: lag, time_constant: 0.01}]\n")
    for make in (CompiledC, BitReference, lambda stage: Loop(([1.0], [1.0]), 1.0, 0.1, stage)):
        with pytest.raises(UnsupportedEffectsError, match="lag"):
            make(creeping)


def test_importing_the_package_does_not_import_loops() -> None:
    code = (
        "import sys, hystgen; assert not {'scipy', 'hystgen.closed_loop'} & set(sys.modules); "
        "hystgen.closed_loop.Loop; assert 'scipy.signal' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(hystgen.__file__).parents[1])


def test_the_example_of_the_module_runs() -> None:
    result = doctest.testmod(closed_loop)
    assert result.failed == 0
    assert result.attempted > 3


def test_the_example_of_the_note_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It checks the four cases' errors itself; C in float32 keeps the exact inverse's error."""
    example = Path(__file__).parents[1] / "examples" / "note" / "closed_loop.py"
    monkeypatch.syspath_prepend(str(example.parent))  # as Python does for a file that it is given
    runpy.run_path(str(example))["make"](tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["figure_15.svg", "figure_16.svg"]
    lines = {line[2:42].strip(): line.split()[-3:] for line in capsys.readouterr().out.splitlines()}
    assert lines["emitted C, float32"] == lines["exact inverse"] == ["0.1357", "0.0960", "0.0000"]
