"""Fixed point: both engines give the same codes, errors stay inside their bounds, and some formats are refused."""

from __future__ import annotations

import math
import re
import time
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st
from modelfiles import FILES

from hystgen.basics.jit import plain
from hystgen.basics.problems import FormatError
from hystgen.cascade import PI, Cascade
from hystgen.cli import main
from hystgen.compensator import fixed_tables, reference
from hystgen.compensator.layout import FixedTables
from hystgen.compensator.reference import Session
from hystgen.emission.calls import emitted_files
from hystgen.front.dead_zone.model import DeadZone
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.model import Model, cascade_of
from hystgen.parameters.files import parse_parameters
from hystgen.plays import fixed, slots

pytestmark = pytest.mark.thorough

ARITHMETICS = ("q31", "q15")


def load(name: str) -> Cascade:
    return cascade_of(parse_parameters(FILES[name], name))


def records(low: int, high: int, seed: int) -> np.ndarray:
    """Codes of a shrinking swing, nested loops, random jumps and both rails."""
    rng = np.random.default_rng(seed)
    k = np.linspace(0, 1, 1500)
    swing = (low + high) / 2 + (high - low) / 2 * np.sin(300 * k) * (1 - 0.9 * k)
    loops = np.interp(np.arange(1500), np.arange(0, 1500, 12), rng.uniform(low, high, 125))
    rails = rng.choice([low, high], 60)
    jumps = rng.uniform(low, high, 600)
    return np.rint(np.concatenate([swing, loops, rails, jumps, rails[::-1]])).astype(np.int64)


@st.composite
def models(draw: st.DrawFn) -> Cascade:
    """Valid models with every kind of front; spacings of thresholds span two decades, weights one and a half."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n = draw(st.integers(0, 24))
    low = draw(st.sampled_from([-1.0, 0.0, -0.2]))
    scale = draw(st.sampled_from([1.0, 100.0, 1e-3]))
    r = np.concatenate([[0.0], np.cumsum(10 ** rng.uniform(-2, 0, n) * 2 / max(n, 1))]) * scale
    p = 10 ** rng.uniform(-1, 0.5, n + 1)
    kind = draw(st.sampled_from(["none", "none", "tanh", "branches", "dead zone"]))
    stages: tuple[object, ...] = ()
    if kind == "tanh":
        stages = (TanhEnvelope((1.3 * scale, 0.9 / scale, 0.1, 0.05 * scale)),)
    elif kind == "branches":
        up = (1.3 * scale, 0.9 / scale, 0.1, 0.0)
        stages = (TanhEnvelope(up, (*up[:3], 0.2 * scale)),)
    elif kind == "dead zone":
        stages = (DeadZone([-0.3 * scale, 0, 0.2 * scale, 0.6 * scale], [0.4, 1.0, -0.5, 0.9]),)
    offset = float(rng.uniform(-1, 1)) * scale * draw(st.sampled_from([0, 1]))
    return Cascade(PI(r.tolist(), p.tolist()), stages, offset, (low * scale, scale))  # type: ignore[arg-type]


def built(model: Cascade, arithmetic: str, engine: str = "corners") -> tuple[FixedTables, fixed_tables.Format]:
    return fixed_tables.build(model, arithmetic, engine)


def double(model: Cascade, operator: str, form: fixed_tables.Format, codes: np.ndarray) -> np.ndarray:
    """Answers of the model in double precision, in codes."""
    into, out = form.drive_lsb, form.output_lsb
    if operator == "inverse":
        into, out = out, into
    return Session(model, operator, clamp=True).run(codes * float(into))[0] / float(out)


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@settings(max_examples=60)
@given(model=models(), seed=st.integers(0, 1000))
def test_errors_stay_inside_the_bound_and_engines_agree(arithmetic: str, model: Cascade, seed: int) -> None:
    try:
        tables, form = built(model, arithmetic)
    except FormatError:
        return
    for operator, ends, bound in (
        ("forward", tables.limits.drive[0], form.forward_error),
        ("inverse", tables.limits.output[0], form.inverse_error),
    ):
        assert bound is not None
        codes = records(*map(int, ends), seed)
        most = 2 ** {"q31": 31, "q15": 15}[arithmetic] - 1
        codes = np.concatenate([codes, np.random.default_rng(seed).choice([-most - 1, *codes[:9], most], 60)])
        answers = Session(model, operator, arithmetic, "corners").run(codes)[0]
        assert (answers == Session(model, operator, arithmetic, "loop").run(codes)[0]).all()
        assert np.abs(answers - double(model, operator, form, codes)).max() <= bound


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_the_bound_covers_codes_beyond_a_range_that_ends_between_codes(arithmetic: str) -> None:
    """Codes beyond the range are limited to the last code inside; the double model goes on to the end of the range."""
    model = Cascade(PI([0, 0.5, 2], [0.5, 0.7, 0.3], 1.0), (), 0.0, (2.0, 10.0))
    _, form = built(model, arithmetic)
    most = 2 ** {"q31": 31, "q15": 15}[arithmetic] - 1
    codes = np.random.default_rng(2).choice([-most - 1, 0, most // 2, most], 200)
    error = np.abs(Session(model, "forward", arithmetic).run(codes)[0] - double(model, "forward", form, codes)).max()
    assert 0.5 < error <= form.forward_error


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_bounds_are_not_slack(arithmetic: str) -> None:
    """The error of one model reaches a quarter of its bound, forward and inverse."""
    model = Cascade(PI([0, 0.1], [0.7, 0.05]), (), 0.0, (-1.0, 1.0))
    tables, form = built(model, arithmetic)
    codes = records(*(int(x) for x in tables.limits.drive[0]), 1)
    error = np.abs(Session(model, "forward", arithmetic).run(codes)[0] - double(model, "forward", form, codes)).max()
    assert error >= form.forward_error / 4
    codes = records(*(int(x) for x in tables.limits.output[0]), 1)
    error = np.abs(Session(model, "inverse", arithmetic).run(codes)[0] - double(model, "inverse", form, codes)).max()
    assert form.inverse_error is not None
    assert error >= form.inverse_error / 4


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize(
    "down", [(6.0, 0.3, -1.4, 5.6), (6.0, 0.3, -1.2, 5.3), (6.0, 0.3, -1.0, 6.0)], ids=["lifted", "shifted", "far"]
)
def test_rounding_of_the_inverse_is_apart_from_what_another_branch_makes(
    arithmetic: str, down: tuple[float, float, float, float]
) -> None:
    """The bound of the rounding holds while both arithmetics are on one branch, however far away the other one is."""
    pi, ends = PI([0, 0.5, 1.2, 2], [0.7, 0.2, 0.1, 0.05]), (0.0, 10.0)
    up = (6.0, 0.3, -1.4, 5.3)
    model = Cascade(pi, (TanhEnvelope(up, down),), 0.0, ends)
    tables, form = built(model, arithmetic)
    assert form.inverse_rounding is not None
    single = [Cascade(pi, (TanhEnvelope(branch),), 0.0, ends) for branch in (up, down)]
    alone = [built(each, arithmetic)[1].inverse_rounding or 0.0 for each in single]
    # the bound uses the steepest and flattest slope of both branches, and a step once or twice as long as one branch's
    slopes = [each.front_slopes for each in single]
    both = max(s[1] for s in slopes) / min(s[0] for s in slopes)
    assert form.inverse_rounding <= 2 * max(b * both / (s[1] / s[0]) for b, s in zip(alone, slopes, strict=True))
    low, high = (int(x) for x in tables.limits.output[0])
    k = np.linspace(0, 1, 3000)
    codes = np.rint((low + high) / 2 + (high - low) / 2 * np.sin(30 * k) * (1 - 0.9 * k)).astype(np.int64)
    ours, exact = Session(model, "inverse", arithmetic), Session(model, "inverse", clamp=True)
    errors = []
    for code in codes:
        answer = ours.run([code])[0][0]
        errors.append(abs(answer - exact.run([code * float(form.output_lsb)])[0][0] / float(form.drive_lsb)))
        assert ours.state.step.ascending[0] == exact.state.step.ascending[0]
    assert 0 < max(errors) <= form.inverse_rounding


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize("name", FILES)
def test_no_sum_exceeds_the_stated_bound(name: str, arithmetic: str) -> None:
    """The reference runs in plain Python integers, which cannot overflow; sums and inputs are checked at each step."""
    model = load(name)
    tables, form = built(model, arithmetic)
    assert form.largest_sum < 2**62
    whole = tables._replace(
        **{
            field: getattr(tables, field).astype(object)
            for field in ("threshold", "weight", "slope", "start_level", "way", "reach", "reciprocal", "shift", "start",
                          "zero", "applied", "knot", "coefficient", "scale", "domain", "edge", "argument",
                          "below")
        },
        limits=slots.LimitTable.of(tables.limits.tolist(), object),
    )  # fmt: skip
    for inverse in (False, True):
        state, operations = reference.new_state(whole, inverse), reference.operations(tables, inverse)
        with plain():
            operations.init(whole, state)
        codes = records(*map(int, tables.limits.output[0] if inverse else tables.limits.drive[0]), 3)[::7]
        answers = []
        for code in codes.tolist():
            with plain():
                answers.append(operations.step(whole, state, code))
            assert max(map(abs, [state.here.output[0], *state.corner.output])) <= form.largest_sum
            assert max(map(abs, [state.here.input[0], *state.corner.input])) < 2**31
        steps = np.full(len(codes), slots.OP_STEP)
        assert answers == reference.answers(tables, bool(inverse), steps, codes, compiled=False)[0].tolist()


@given(
    x=st.integers(-(2**61), 2**61),
    bits=st.integers(0, 50),
)
def test_nearest_rounds_ties_away_from_zero(x: int, bits: int) -> None:
    exact = Fraction(x, 2**bits)
    expected = math.floor(exact + Fraction(1, 2)) if exact >= 0 else -math.floor(-exact + Fraction(1, 2))
    assert fixed.nearest.py_func(x, bits) == expected


@given(d=st.integers(0, 2**61), seed=st.integers(0, 1000))
def test_the_reciprocal_divides_to_the_nearest(d: int, seed: int) -> None:
    tables, _ = built(load("plain"), "q31" if seed % 2 else "q15")
    for k in range(1, len(tables.slope)):
        slope = int(tables.slope[k])
        if d // slope < 2**32:
            allowed = Fraction(1, 2) + Fraction(d, slope * 2**31) + Fraction(1, 2**8)
            assert abs(int(fixed.divide_by_slope.py_func(tables, np.int64(d), k)) - Fraction(d, slope)) <= allowed


@pytest.mark.parametrize("name", ["curved", "two_branches", "mixed", "bent", "behind"])
@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_curves_are_the_memoryless_part(name: str, arithmetic: str) -> None:
    """The kernel's curve agrees with the model's own functions at every code of q15 and at 20 001 codes of q31."""
    model = load(name)
    tables, form = built(model, arithmetic)
    low, high = (int(x) for x in tables.limits.drive[0])
    codes = np.arange(low, high + 1) if arithmetic == "q15" else np.linspace(low, high, 20001).astype(np.int64)
    front = reference.front(tables)
    lsb = fixed_tables.lsbs(model, arithmetic)
    builder = fixed_tables.Builder(model, arithmetic, "corners", lsb, (False, False))
    builder.build()
    for up in (1, 0) if tables.branches else (1,):
        exact = np.asarray(model.front(codes * float(form.drive_lsb), bool(up)))
        w = np.array([front.front_forward(tables, code, up) for code in codes])
        gap = np.abs(w * float(builder.step) - exact).max() / float(builder.step)
        assert gap <= builder.front[1 - up].error + 1e-4
        back = np.array([front.front_inverse(tables, x, up)[0] for x in w])
        slopes = np.abs(np.diff(exact)) / float(form.drive_lsb)
        slack = (builder.front[3 - up].error / 2.0 ** int(tables.below[2])) + 0.5
        per_code = builder.front[1 - up].error * float(builder.step) / (slopes.min() * float(form.drive_lsb))
        assert np.abs(back - codes).max() <= slack + per_code * max(1, high - low) / len(codes)


def test_converter_formats_are_honoured() -> None:
    text = FILES["plain"] + "\nemit: {arithmetic: q15, drive_lsb: 0.001, output_lsb: 0.002}\n"
    model = Model(parse_parameters(text, "plain.yaml"))
    header = emitted_files(model)["plain.h"]  # type: ignore[attr-defined]
    assert "PLAIN_DRIVE_LSB 0.001 " in header
    assert "PLAIN_OUTPUT_LSB 0.002" in header
    assert "PLAIN_DRIVE_MAX 4000" in header
    y = model.simulate(np.array([1000, 4000, -4000]), arithmetic="q15")
    assert np.abs(y * 0.002 - model.simulate(np.array([1.0, 4.0, -4.0]))).max() <= 0.003


@pytest.mark.parametrize(
    ("arithmetic", "pi", "ends", "lsb", "message"),
    [
        ("q15", ([0, 1], [1, 1]), (0, 100), (0.001, None), "emit.drive_lsb: 0.001 is too small: input_range reaches"),
        ("q15", ([0, 1], [1, 1]), (0, 100), (None, 1e-5), "emit.output_lsb: 1e-05 is too small: the output range"),
        ("q15", ([0, 1e-3], [1, 1]), (0, 100), (None, None), "model.pi.thresholds[1]: 0.001 is narrower than one code"),
        ("q15", ([0, 1, 2], [1, 1e-7, 1]), (0, 100), (None, None), "model.pi.weights[1]: 1e-07 moves the output by"),
        ("q15", ([0], [1]), (0, 100), (80, None), "emit.drive_lsb: leaves 2 codes in range; make it smaller"),
        ("q15", ([0, 1e-3], [1, 1]), (0, 100), (None, None), "model.pi.thresholds[1]: 0.001 is narrower than one code "
         "in q15 with 0.00305185 a drive code; use a finer arithmetic, or leave"),
        ("q15", ([0, 4], [1, 1]), (0, 100), (5, None), "model.pi.thresholds[1]: 4 is narrower than one code in q15 "
         "with 5 a drive code; use a smaller emit.drive_lsb or a finer arithmetic, or leave"),
        ("q15", ([0], [1]), (1e9, 1e9 + 100), (None, None), "input_range: lies so far from 0 that q15 has 1 code for "),
    ],
)
def test_formats_that_cannot_be_are_refused(
    arithmetic: str, pi: tuple[list[float], list[float]], ends: tuple[float, float],
    lsb: tuple[float | None, float | None], message: str,
) -> None:  # fmt: skip
    model = Cascade(PI(*pi), (), 0.0, ends)
    with pytest.raises(FormatError) as caught:
        fixed_tables.build(model, arithmetic, "corners", *lsb)
    assert str(caught.value).startswith(message)


def test_the_least_lsb_in_the_message_is_enough() -> None:
    for arithmetic in ("q15", "q31"):
        for high in (100.0, 4.0, 0.7, 12345.678, 3e-9):
            model = Cascade(PI([0, high / 4], [1, 1]), (), 0.0, (0.0, high))
            with pytest.raises(FormatError) as caught:
                fixed_tables.build(model, arithmetic, "corners", high * 1e-12, high * 1e-12)
            told = [float(x) for x in re.findall(r"at least ([\d.e+-]+);", str(caught.value))]
            assert len(told) == 2
            fixed_tables.build(model, arithmetic, "corners", *told)


NARROW = """hystgen: 1
name: narrow
input_range: [0, 100]
model:
  pi:
    thresholds: [0, 0.001, 0.002, 1]
    weights: [1, 1, 1, 1e-7]
emit: {arithmetic: q15}
"""


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("", ""), [
            "6:21: error: model.pi.thresholds[1]: 0.001 is narrower than one code in q15",
            "6:28: error: model.pi.thresholds[2]: 0.002 is narrower than one code in q15",
            "7:24: error: model.pi.weights[3]: 1e-07 moves the output by less than half a code",
        ]),
        (("q15", "q15, drive_lsb: 1e-5, output_lsb: 1e-6"), [
            "8:36: error: emit.drive_lsb: 1e-05 is too small: input_range reaches 100",
            "8:54: error: emit.output_lsb: 1e-06 is too small: the output range reaches 299.997",
        ]),
        (("q15", "q15, drive_lsb: 80, output_lsb: 300"), [
            "8:36: error: emit.drive_lsb: leaves 2 codes in range",
            "8:52: error: emit.output_lsb: leaves 1 code in range",
        ]),
        (("thresholds: [0, 0.001, 0.002, 1]", "density: {formula: '1', p0: 1, r_max: 0.002, n: 2}"), [
            "6:5: error: model.pi.thresholds[1]: 0.00", "6:5: error: model.pi.thresholds[2]: 0.00",
        ]),
    ],
)  # fmt: skip
def test_a_refused_format_says_where(tmp_path: Path, change: tuple[str, str], said: list[str]) -> None:
    """All problems are reported in one run, each at its place in the file, and nothing is written."""
    text = NARROW.replace(*change)
    if "density" in text:
        text = text.replace("    weights: [1, 1, 1, 1e-7]\n", "")
    file = tmp_path / "narrow.yaml"
    file.write_text(text)
    done = CliRunner().invoke(main, ["emit", str(file), "-o", str(tmp_path / "out")])
    assert done.exit_code == 2, done.output
    lines = done.stderr.splitlines()
    assert len(lines) == len(said), done.stderr
    for line, expected in zip(lines, said, strict=True):
        assert line.startswith(f"{file}:{expected}"), line
        assert "; " in line
    assert not (tmp_path / "out").exists()
    shown = CliRunner().invoke(main, ["show", str(file)])
    assert all(expected.partition(" error: ")[2] in shown.stdout for expected in said), shown.stdout


def test_simulating_takes_codes() -> None:
    model = Model(parse_parameters(FILES["plain"], "plain.yaml"))
    with pytest.raises(ValueError, match="integers from -32768 to 32767"):
        model.simulate(np.array([0.5]), arithmetic="q15")
    with pytest.raises(ValueError, match="codes, integers"):
        model.simulate(np.array([40000]), arithmetic="q15")


def test_simulating_on_the_command_line_speaks_of_codes(tmp_path: Path) -> None:
    (tmp_path / "plain.yaml").write_text(FILES["plain"])
    (tmp_path / "codes.csv").write_text("t,v\n0,0\n1,32767\n2,-32768\n")
    (tmp_path / "volts.csv").write_text("t,v\n0,0.5\n1,2\n")
    words = ["simulate", str(tmp_path / "plain.yaml"), "--arithmetic", "q15"]
    done = CliRunner().invoke(main, [*words, str(tmp_path / "codes.csv"), "--history", "1000,-2000"])
    assert done.exit_code == 0, done.output
    assert "1 of 3 samples lies outside input_range -32767 to 32767, limited to it" in done.stderr
    answers = [int(line.split(",")[2]) for line in done.stdout.splitlines()[1:]]
    session = Session(load("plain"), "forward", "q15")
    session.visit([1000, -2000])
    assert answers == session.run([0, 32767, -32768])[0].tolist()
    for extra in ([str(tmp_path / "volts.csv")], [str(tmp_path / "codes.csv"), "--history", "0.5"]):
        done = CliRunner().invoke(main, [*words, *extra])
        assert done.exit_code == 2
        assert "fixed point takes codes, integers from -32768 to 32767" in done.stderr


def test_no_entry_of_a_curve_passes_its_type() -> None:
    """Two branches are so close that the inverse of one passes the last code of the drive's range by some codes."""
    up, down = (3016.367098, 0.0009851513036, -0.04454608924, 134.2785509), (
        3016.461353, 0.0009842729487, 0.04718115382, 131.2839223
    )  # fmt: skip
    pi = PI([0.0, 637.5, 1133.33], [158.9869585, 49.79632194, 302.9958729])
    numbers, _ = built(Cascade(pi, (TanhEnvelope(up, down),), -68125.91212, (-3000.0, 3000.0)), "q31")
    assert len(numbers.coefficient) > 100
    assert np.abs(numbers.coefficient).max() <= 2**31 - 1


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_an_output_that_stays_0_is_refused(arithmetic: str) -> None:
    still = Cascade(PI([0.0, 3.0], [0.0, 1.0]), (), 0.0, (-1.0, 1.0))
    with pytest.raises(FormatError, match="no play moves over this range of the drive, and the output stays 0; widen"):
        built(still, arithmetic)


def straight(breaks: int, stages: int) -> Cascade:
    """Dead-zone sums with many breaks, each of which bends the curve only slightly."""
    half = breaks // 2
    thresholds = [k / breaks for k in range(-half, half + 1)]
    weights = [1.0 if r == 0.0 else math.copysign(0.1, r) / breaks for r in thresholds]
    return Cascade(PI([0.0, 0.5], [1.0, 1.0]), (DeadZone(thresholds, weights),) * stages, 0.0, (0.0, 1.0))


def test_thousands_of_breaks_take_seconds() -> None:
    """The work is proportional to the breaks; 64 in each of two stages used to take 15 s, and thousands took hours."""
    start = time.process_time()
    for arithmetic in ("q31", "q15"):
        fixed_tables.build(straight(400, 2), arithmetic, "loop", None, None)
    assert time.process_time() - start < 30.0


def test_more_breaks_than_fixed_point_takes_are_refused_at_once() -> None:
    start = time.process_time()
    with pytest.raises(FormatError) as caught:
        fixed_tables.build(straight(4094, 2), "q31", "loop", None, None)
    assert time.process_time() - start < 15.0
    ((path, message),) = caught.value.problems
    assert path == ("model", "memoryless")
    assert message == (
        "has 4094 kinks inside input_range, and fixed point takes at most 2000; thin out the thresholds or use float32"
    )
