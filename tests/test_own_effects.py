"""User effects from a folder outside the package: simulated, diagnosed, inverted, and emitted as C."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from modelfiles import BRANCHES, CREEP, PLAYS, head

import hystgen
from hystgen.basics import jit
from hystgen.basics.problems import EffectsError, UnsupportedEffectsError
from hystgen.compensator.chain import bounds, own, tables
from hystgen.compensator.chain.parts import PARTS
from hystgen.compensator.chain.run import answers
from hystgen.compensator.chained import Compensator
from hystgen.compensator.reference import answers as computed
from hystgen.effects import Run, load_user_effects
from hystgen.effects.base import Array
from hystgen.effects.kinds import BlockKind
from hystgen.emission import own as emitted_own
from hystgen.emission import runtime
from hystgen.emission.calls import emit_options, emitted_files
from hystgen.model import Model
from hystgen.plays import slots

EXAMPLE = Path(__file__).parents[1] / "examples" / "my_effect"
T = 1e-3
DROOP = "name: user:droop, share: 0.05, time_constant: 0.7"
Call = Callable[..., tuple[int, str, str]]

# A drive stage in front of the plays, with its own C file
FOLDER = Path(__file__).with_name("follower")
STAGE, STAGE_C = ((FOLDER / name).read_text() for name in ("model.py", "follower.c"))
FOLLOWER = "name: user:follower, bandwidth: 700"

# A catalogue effect whose block is of the same kind
PART = "name: resonance, shape: part, frequency: 30, damping: 0.1, share: 0.2"


def written(folder: Path, *effects: str, name: str = "stage") -> Path:
    """A parameter file with these effects."""
    listed = "".join(f"    - {{{each}}}\n" for each in effects)
    path = folder / f"{name}.yaml"
    path.write_text(head(name) + PLAYS + f"  output_offset: 0.5\n  effects:\n{listed}sample_time: {T}\n")
    return path


def outside(folder: Path, python: str = STAGE, c: str | None = STAGE_C) -> Path:
    """A folder with an effect that the package does not know; a copy if its texts differ from the original."""
    if (python, c) == (STAGE, STAGE_C):
        return FOLDER
    own_folder = folder / "follower"
    own_folder.mkdir()
    (own_folder / "model.py").write_text(python)
    if c is not None:
        (own_folder / "follower.c").write_text(c)
    return own_folder


def both(folder: Path, *more: str) -> Model:
    """A model with an effect on either side of the plays, both from outside the package."""
    return hystgen.load(written(folder, DROOP, FOLLOWER, *more), [EXAMPLE, outside(folder)])


def reference(one: Model, arithmetic: str, seed: int, n: int = 1500) -> tuple[tables.Compiled, Run]:
    compiled = tables.build(one.chain, arithmetic, T)
    low, high = (float(end) for end in compiled.tables.limits.output[0])
    phase = np.cumsum(np.random.default_rng(seed).uniform(0.0, 0.02, n))
    u = np.float32(0.5 * (low + high) + 0.4 * (high - low) * np.sin(phase))
    return compiled, Run(np.arange(n) * T, u.astype(float))


def test_the_forward_model_is_the_integral_of_its_equation(tmp_path: Path) -> None:
    """The droop's output agrees with an integration in steps a hundredth as long."""
    one = hystgen.load(written(tmp_path, DROOP), [EXAMPLE])
    t = np.cumsum(np.random.default_rng(1).uniform(0.5 * T, 2.0 * T, 400))
    v = 3.0 * np.sin(9.0 * t)
    h = one.without(one.effects).simulate(v) - 0.5
    state, wanted = 0.05 * h[0], [0.95 * h[0]]
    for k in range(1, len(t)):
        step = (t[k] - t[k - 1]) / 100
        for part in range(100):
            state += step / 0.7 * (0.05 * (h[k - 1] + (h[k] - h[k - 1]) * (part + 0.5) / 100) - state)
        wanted.append(h[k] - state)
    assert np.max(np.abs(one.simulate(v, t=t) - 0.5 - wanted)) < 1e-5


@pytest.mark.parametrize("even", [True, False])
def test_the_inverse_composes_with_the_forward_model(tmp_path: Path, even: bool) -> None:
    one = both(tmp_path, CREEP, PART)
    t = np.cumsum(np.full(500, T) if even else np.random.default_rng(2).uniform(0.5 * T, 2.0 * T, 500))
    u = 0.5 + 4.0 * np.sin(5.0 * t)
    v = one.inverse().simulate(u, t=t)
    assert np.max(np.abs(one.simulate(v, t=t) - u)) < 1e-12
    if even:
        with jit.plain():
            assert np.max(np.abs(one.inverse().simulate(u, "float64") - v)) < 1e-11


def test_a_drive_that_may_not_come_to_rest_is_warned_of(tmp_path: Path) -> None:
    """The drive may swing between two branches, which only the catalogue's lag approaches from one side."""
    path = written(tmp_path, FOLLOWER)
    path.write_text(path.read_text().replace("  output_offset", BRANCHES + "  output_offset"))
    with pytest.warns(UserWarning, match=r"may swing between them, by up to [0-9.]+ V; make the effect a lag"):
        emitted_files(hystgen.load(path, [outside(tmp_path)]))


@pytest.mark.thorough
def test_c_gives_the_bits_of_the_reference(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The reference is compiled here, unlike in the other tests."""
    monkeypatch.setattr(jit, "SHORT", 0)
    report = hystgen.verify(both(tmp_path, CREEP, PART), "float32", "both", compiler=["gcc"], length=1000)
    assert report.ok, report.table()
    assert {row.operator for row in report.rows} >= {"inverse", "forward"}


@pytest.mark.thorough
def test_c_gives_the_same_bits_on_cores_and_beside_a_shared_run_time(tmp_path: Path) -> None:
    one = both(tmp_path)
    report = hystgen.verify(one, operator="both", targets=["cortex-m0plus", "cortex-m4f"], target_length=150)
    assert report.ok, report.table()
    report = hystgen.verify(one, operator="both", layout="shared-runtime", compiler=["gcc"], length=500)
    assert report.ok, report.table()
    for arithmetic in ("q31", "q15"):
        with jit.plain():
            report = hystgen.verify(one, arithmetic, "both", targets=["cortex-m0plus", "cortex-m4f"], target_length=20)
        assert report.ok, report.table()


def after_the_same(one: Model, u: Array, sent: Array) -> Array:
    """Drives in double precision, each after the drives that were sent before it."""
    op = np.tile(np.array([slots.OP_STEP, slots.OP_COMMIT], dtype=np.uint8), len(u))
    double = tables.build(one.chain, "float64", T)
    found, _ = computed(double.tables, True, op, np.column_stack([u, sent]).ravel(), compiled=False)
    low, high = double.tables.limits.drive[0]
    return np.asarray(np.clip(found[::2], low, high))


@pytest.mark.parametrize(
    ("arithmetic", "effects"),
    [("float32", (DROOP, FOLLOWER, CREEP)), ("float64", (DROOP, CREEP)), ("float32", (PART, CREEP)),
     ("float64", (PART, CREEP))],
)  # fmt: skip
def test_errors_stay_within_the_bounds_that_follow_from_the_functions(
    tmp_path: Path, arithmetic: str, effects: tuple[str, ...]
) -> None:
    one = hystgen.load(written(tmp_path, *effects), [EXAMPLE, outside(tmp_path)])
    for seed in range(3):
        compiled, run = reference(one, arithmetic, seed)
        bound = bounds.chain_bounds(compiled, arithmetic)
        with jit.plain():
            v = answers(compiled, run, True).astype(float)
            y = answers(compiled, Run(run.t, v), False).astype(float)
        ends = tuple(float(end) for end in compiled.tables.limits.drive[0])
        if bounds.condition(compiled):
            wanted = after_the_same(one, run.v, v)
        else:
            wanted = Compensator(one.chain).drives(run, ends)  # type: ignore[arg-type]
            assert bound.rounding == bound.inverse
        assert np.max(np.abs(v - wanted)) <= bound.rounding < (0.1 if arithmetic == "float32" else 1e-9)
        assert np.max(np.abs(y - one.simulate(v))) <= bound.forward


FIXED = {
    "droop": (DROOP,),
    "fast droop": ("name: user:droop, share: 0.3, time_constant: 5.0e-3",),
    "slow droop": ("name: user:droop, share: 0.3, time_constant: 50",),
    "follower": (FOLLOWER,),
    "slow follower": ("name: user:follower, bandwidth: 30", CREEP),
    "both": (DROOP, FOLLOWER, CREEP, "name: saturation, level: 12"),
    "part of a mode": (PART, CREEP),
    "ringing part": ("name: resonance, shape: part, frequency: 60, damping: 0.01, share: 0.05",),
}
RINGS = 1024.0
"""[output codes] Limit for a mode that rings for 265 samples, over which errors of its rounded factors add up."""


@pytest.mark.parametrize("effects", FIXED.values(), ids=list(FIXED))
@pytest.mark.parametrize("arithmetic", ["q31", "q15"])
def test_fixed_point_stays_within_its_bounds(tmp_path: Path, arithmetic: str, effects: tuple[str, ...]) -> None:
    """Errors are against double precision, for smooth references, jumps across the output range, and noise.

    A block in front of the plays keeps the difference of two drives that are limited to the same value. With such a
    block, answers are compared with those of double precision after the same drives.
    """
    one = hystgen.load(written(tmp_path, *effects), [EXAMPLE, outside(tmp_path)])
    compiled = tables.build(one.chain, arithmetic, T)
    codes, limits = compiled.codes, compiled.tables.limits
    assert codes is not None
    low, high, most = map(float, (*limits.output[0], limits.code_max[0]))
    drive, displacement = float(codes.drive_lsb), float(codes.output_lsb)
    n = 200
    t, op = np.arange(n) * T, np.full(n, slots.OP_STEP, dtype=np.uint8)
    phase = np.cumsum(np.random.default_rng(6).uniform(0.0, 0.04, n))
    noise = np.clip(np.cumsum(np.random.default_rng(7).normal(0.0, 0.02, n)), -1.0, 1.0)
    for shape in (0.5 * np.sin(phase), np.sign(np.sin(3.0 * phase)), noise):
        u = np.rint(0.5 * (low + high) + 0.5 * (high - low) * shape)
        v = computed(compiled.tables, True, op, u, compiled=False)[0].astype(float)
        ends = float(limits.drive.low[0]) * drive, float(limits.drive.high[0]) * drive
        if codes.condition:
            assert codes.inverse_error == limits.drive.high[0] - limits.drive.low[0]
            wanted = np.clip(after_the_same(one, u * displacement, v * drive), *ends)
        else:
            wanted = Compensator(one.chain).drives(Run(t, u * displacement), ends)
            assert codes.inverse_error == codes.inverse_rounding
        assert np.max(np.abs(v - wanted / drive)) <= codes.inverse_rounding < 1e-2 * (high - low)
        y = computed(compiled.tables, False, op, v, compiled=False)[0].astype(float)
        exact = np.clip(one.simulate(v * drive, t=t) / displacement, -most - 1.0, most)
        assert np.max(np.abs(y - exact)) <= codes.forward_error < (64.0 if effects != FIXED["ringing part"] else RINGS)


@pytest.mark.parametrize("arithmetic", ["float64", "q31", "q15"])
def test_c_gives_the_bits_of_the_reference_in_every_arithmetic(tmp_path: Path, arithmetic: str) -> None:
    with jit.plain():
        report = hystgen.verify(both(tmp_path, CREEP, PART), arithmetic, "both", compiler=["gcc"], length=100)
    assert report.ok, report.table()
    assert {row.operator for row in report.rows} == {"inverse", "forward"}


def test_the_noise_gain_is_that_of_an_impulse(tmp_path: Path) -> None:
    """Without plays, the whole chain is linear."""
    path = written(tmp_path, DROOP, FOLLOWER)
    path.write_text(path.read_text().replace(PLAYS, "\n  pi: {thresholds: [0], weights: [2]}\n"))
    one = hystgen.load(path, [EXAMPLE, outside(tmp_path)])
    compiled = tables.build(one.chain, "float64", T)
    u = np.full(1 << 14, 0.5)
    u[200] += 1e-3
    with jit.plain():
        x = answers(compiled, Run(np.arange(len(u)) * T, u), True)
    gain = np.max(np.abs(np.fft.rfft(x - x[0]))) / 1e-3
    assert compiled.noise_gain == pytest.approx(float(gain) * 2.0 * 0.95, rel=1e-2)
    assert compiled.noise_gain > 1.5


def test_it_is_diagnosed_and_goes_into_the_c(tmp_path: Path, run: Call) -> None:
    """Records of plays and droop, made from the equation alone, go through the commands of the docstring."""
    plain = written(tmp_path, name="plain")
    plain.write_text(plain.read_text().replace("  effects:\n", ""))
    static = hystgen.load(plain)
    rng = np.random.default_rng(4)
    names = []
    for number in range(5):
        n = 3000
        t = np.arange(n) * T + 4.0 * number
        v = np.interp(np.arange(n), np.arange(0, n + 60, 60), rng.uniform(-3.9, 3.9, n // 60 + 1))
        h = static.simulate(v) - 0.5
        state, y = 0.06 * h[0], []
        for each in h:
            state += (1.0 - np.exp(-T / 0.4)) * (0.06 * each - state)
            y.append(each - state + 0.5)
        names.append(tmp_path / f"record_{number}.csv")
        table = np.column_stack([t, v, np.array(y) + 2e-3 * rng.normal(size=n)])
        np.savetxt(names[-1], table, delimiter=",", header="t,v,y", comments="")
    own_folder = tmp_path / "my_effect"
    shutil.copytree(EXAMPLE, own_folder, ignore=shutil.ignore_patterns("__pycache__"))
    given = ["--effects", own_folder]
    words = [*names[:3], "--holdout", names[3], "--holdout", names[4], "-o", tmp_path / "out"]
    code, _, err = run("diagnose", plain, *words, *given)
    assert code == 0, err
    (found,) = json.loads((tmp_path / "out" / "diagnosis.json").read_text())["effects"]
    assert found["name"] == "user:droop"
    assert found["parameters"]["share"] == pytest.approx(0.06, rel=0.1)
    extended = tmp_path / "out" / "params.yaml"
    code, _, err = run("emit", extended, "-o", tmp_path / "firmware", *given)
    assert code == 0, err
    assert "stage_user" not in (tmp_path / "firmware" / "plain.h").read_text()
    assert "--effects my_effect" in (tmp_path / "firmware" / "plain.h").read_text()
    assert "static plain_real_t plain_user_droop_absorb(" in (tmp_path / "firmware" / "plain.c").read_text()
    code, out, _ = run("emit", extended, "-o", tmp_path / "firmware", "--check", *given)
    assert code == 0, out
    code, out, err = run("track", extended, names[3], *given)
    assert code == 0, err
    plays, whole = (
        float(re.findall(rf"{which} +(\d+\.\d+)", out)[0]) for which in ("plays alone", "whole model")
    )
    assert whole < 0.5 * plays, "what the droop is worth"


def test_without_a_compensator_it_is_refused_by_name(tmp_path: Path, run: Call) -> None:
    path = written(tmp_path, "name: user:neighbour, amplitude: 0.1, period: 60")
    neighbour = Path(__file__).parent / "neighbour.py"
    one = hystgen.load(path, [neighbour])
    with pytest.raises(UnsupportedEffectsError, match="an effect of your own, which has no compensator"):
        one.inverse()
    code, _, err = run("emit", path, "--effects", neighbour, "-o", tmp_path / "out")
    assert code == 1
    assert "user:neighbour: an effect of your own, which has no compensator" in err
    assert not (tmp_path / "out").exists()
    assert "user:neighbour" in emitted_files(one, allow_partial=True)["stage.h"]


TABLE = "hystgen_user_follower_table_t"
STEP, MEMORY, VOID = "self->reached + hystgen_product", "hystgen_signal_t reached;", "    (void)t;\n    self"
SECOND = "typedef struct {\n    hystgen_signal_t reached"
RATES = "hystgen_number_t rate;\n    hystgen_number_t inverse_rate;"
BAD_C = {
    "number": (STEP, f"0.5f * {STEP}", ":39: a number with a fraction; put it in the table"),
    "division": ("y - self->reached)", "y / self->reached)", ":32: a division; put the reciprocal in the table"),
    "directive": (SECOND, f"#include <math.h>\n{SECOND}", ":8: a preprocessor line; only #include"),
    "call": ("return self->reached;", "return sin(self->reached);", ":40: sin is called but not defined"),
    "type": (MEMORY, "double reached;", ":9: double; write hystgen_signal_t"),
    "field": (MEMORY, "hystgen_real_t seen;", ":8: hystgen_user_follower_t is declared differently; write typedef"),
    "swapped": (RATES, RATES.replace("rate", "other_rate", 1), f":3: {TABLE} is declared differently"),
    "global": (SECOND, f"static int count;\n{SECOND}", ":8: 'static int count;' is not part of a type"),
    "verb": ("follower_absorb(", "follower_absrb(", ":1: has no hystgen_user_follower_absorb; write static"),
    "comment": (VOID, "    (void)t; /* open\n    self", ":16: a comment that does not end"),
    "slashes": (VOID, "    (void)t; // unused\n    self", ":16: a comment with //; write /* */"),
    "long": (VOID, f"    (void)t; /* {95 * 'x'} */\n    self", ":16: 114 columns, more than 100"),
    "letters": (VOID, "    (void)t; /* \u00e9 */\n    self", ":16: '\u00e9' is not printable ASCII"),
    "end": ("    return self->reached;\n}\n", "    return self->reached;\n}\nint x", ":42: 'int x' is not part of"),
    "bare": ("hystgen_product(&t->rate, x - self->reached)", "t->rate * (x - self->reached)", ":39: t->rate by itself"),
    "foreign": ("self->reached = x;", "self->reached = hystgen_tanh(x);", ":17: hystgen_tanh is not in the file"),
    "joined": (VOID, "    (void)t; /* hidden *\\\n/ (void)system(0); /* */\n    self", ":16: a backslash, which joins"),
    "joined word": (VOID, "    (void)t; sys\\\ntem(0);\n    self", ":16: a backslash, which joins"),
    "joined slashes": (VOID, "    (void)t; /* */ /\\\n/ x\n    self", ":16: a backslash, which joins"),
    "named letter": (VOID, "    (void)t; \\u0073elf;\n    self", ":16: a backslash, which joins"),
    "trigraph": (VOID, "    (void)t; /* hidden *?" "?/\n/ (void)system(0); /* */\n    self", ":16: two question marks"),
    "digraph": (VOID, "    (void)t; self<:0:>.reached = x;\n    self", ":16: <:, a digraph"),
    "directive digraph": (SECOND, f"%:include <math.h>\n{SECOND}", ":8: %:, a digraph"),
    "comment in a text": (VOID, '    (void)"/*"; system(0); (void)"*/";\n    self', ":16: a string or a character"),
    "comment in a character": (VOID, "    (void)'/*'; system(0);\n    (void)'*/';\n    self", ":16: a string or"),
    "comment in slashes": (VOID, "    // /*\n    system(0);\n    // */\n    self", ":16: a comment with //"),
    "call beside a comment": ("return self->reached;", "return sin/* of */\n(self->reached);", ":40: sin is called"),
    "call in parentheses": ("return self->reached;", "return ((sin)) (self->reached);", ":40: (sin) is called"),
    "call of a pointer": ("return self->reached;", "return (*self->reached)(x);", ":40: *self->reached is called"),
    "call of an answer": ("y - self->reached);", "y - self->reached)(x);", ":32: the result of hystgen_product is"),
    "late include": (SECOND, f'#include "hystgen_runtime.h"\n{SECOND}', ":8: a preprocessor line"),
    "other characters": (VOID, "    (void)t; a$b = x;\n    self", ":16: $ is not a character of C"),
    "return": (VOID, "    (void)t;\r    self", r":16: '\\r' is not printable ASCII"),
    "escape": ("    (void)t;\n    return y;", "    (void)t; }\nint y(void) {\n    return 0;", ":25: 'int y(void)"),
}  # fmt: skip


@pytest.mark.parametrize("wrong", BAD_C)
def test_a_wrong_c_file_is_refused_with_its_place(tmp_path: Path, run: Call, wrong: str) -> None:
    before, after, said = BAD_C[wrong]
    assert before in STAGE_C
    folder = outside(tmp_path, c=STAGE_C.replace(before, after))
    code, _, err = run("emit", written(tmp_path, FOLLOWER), "--effects", folder, "-o", tmp_path / "out")
    assert code == 2
    assert said in err
    assert re.search(r"follower\.c:(\d+:)? ", err)
    assert "Traceback" not in err
    assert not (tmp_path / "out").exists()


TOLD = ("\\", "\\\n", "?" "?/", "//", '"', "'", "#", "%:", "<:", "<%", "$")
UNTOLD = ("/*", "*/", "*", "\n", " ", "evil", ";", "x", "/**/", "?", "/*", "*/")


@pytest.mark.skipif(
    not os.environ.get("CI") and shutil.which("gcc") is None, reason="the oracle is gcc's preprocessor"
)
def test_the_check_sees_what_a_compiler_sees(tmp_path: Path) -> None:
    """For random texts whose lines pass the check, it strips the same comments as gcc -E."""
    rng = np.random.default_rng(0)
    texts = {"".join(rng.choice([*UNTOLD, *rng.choice(TOLD, 1)], 9)) for _ in range(4000)}
    passed = [text for text in sorted(texts) if not list(emitted_own._of_lines(text))]
    assert 500 < len(passed) < 0.5 * len(texts)
    mark = "boundary;"
    (tmp_path / "all.c").write_text("".join(f"\n{text}\n{mark}" for text in passed))
    command = ["gcc", "-E", "-P", "-std=c99", "-trigraphs", str(tmp_path / "all.c")]
    seen = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split(mark)
    for text, code in zip(passed, seen, strict=False):
        assert "".join(emitted_own._code(text).split()) == "".join(code.split()), repr(text)


def test_a_comment_stands_above_its_function_as_a_whole(tmp_path: Path) -> None:
    """Even a comment with an empty line in it stays whole."""
    above = "/* The first half.\n\n   The second one. */\n"
    head_of = "static hystgen_signal_t hystgen_user_follower_absorb("
    assert "*/\nstatic" not in STAGE_C
    text = STAGE_C.replace(head_of, above + head_of)
    emitted = emitted_files(hystgen.load(written(tmp_path, FOLLOWER), [outside(tmp_path, c=text)]))["stage.c"]
    assert above in emitted


def test_a_missing_c_file_is_named(tmp_path: Path, run: Call) -> None:
    code, _, err = run("emit", written(tmp_path, FOLLOWER), "--effects", outside(tmp_path, c=None), "-o", tmp_path)
    assert code == 2
    assert "follower.c: cannot be read (No such file" in err


SOLVED, NUMBERS = "    return s[0] + product", "return [rate, 1.0 / rate]"
PRECISE = "does not have the precision of the C; put it in the table"
BAD_PYTHON = {
    "number": (SOLVED, "    return 1.0 + s[0] + product", f":24: the number 1.0 in solve {PRECISE}"),
    "named number": (SOLVED, "    return RATE + product", f":24: the number RATE in solve {PRECISE}"),
    "call": ("    return s[0] + product", "    return np.abs(s[0]) + product", ":24: solve has np.abs(s[0]); write it"),
    "times": (SOLVED, "    return s[0] * s[0] + product", ":24: solve has s[0] * s[0]; write it with +, -, product"),
    "product": ("y - s[0])", "y - s[0]) + product(y, s[0])", ":24: solve has product(y, s[0]); give a table entry"),
    "place": ("Place.DRIVE", "Place.OUTPUT", "class Follower has place output, so it has to define mapped"),
    "side": ("order: ClassVar[int] = 2", "order: ClassVar[int] = 0", "in front of the slew limit; give it an order"),
    "name": ("user:follower", "user:My-Follower", "user:My-Follower cannot name it in C"),
    "word": ('("reached",)', '("while",)', "has 'while' among the names of its table and state"),
    "file": ('"follower.c"', '"../follower.c"', "has '../follower.c' as its C file"),
    "numbers": (NUMBERS, "return [rate]", "2 finite numbers were expected, rate, inverse_rate"),
    "infinite": (NUMBERS, "return [rate, np.inf]", "2 finite numbers were expected"),
    "fails": (NUMBERS, "return [rate, 1 / 0]", "failed in numbers: ZeroDivisionError"),
    "not linear": ("    return s[0]\n\n\nclass", "    return s[0] + t[RATE]\n\n\nclass", "its block is not linear"),
    "moves at rest": ("    s[0] = x\n", "    s[0] = x + x\n", "does not stay at rest"),
    "other at rest": ("\n    return y", "\n    return product(t[RATE], y)", "they must be inverse"),
    "gain": ("    return s[0]\n\n\nclass", "    return s[0] + s[0]\n\n\nclass", "does not stay at rest"),
    "grows": ("- np.exp(", "- 3.0 * np.exp(", "its block keeps"),
}  # fmt: skip


@pytest.mark.parametrize("wrong", BAD_PYTHON)
def test_a_wrong_block_is_refused_by_name(tmp_path: Path, run: Call, wrong: str) -> None:
    before, after, said = BAD_PYTHON[wrong]
    assert before in STAGE
    folder = outside(tmp_path, STAGE.replace(before, after))
    slew = "name: slew_limit, rate: 500"
    name = "My-Follower" if wrong == "name" else "follower"
    path = written(tmp_path, f"name: user:{name}, bandwidth: 700", slew)
    code, _, err = run("emit", path, "--effects", folder, "-o", tmp_path / "out")
    assert code in (1, 2)
    assert said in err
    assert "Traceback" not in err
    assert not (tmp_path / "out").exists()


SOFT = ("    return s[0] + product(t[INVERSE_RATE], y - s[0])", "    return y")  # solve returns the drive itself
ONLY_FLOAT = {
    "another input": ([SOFT], "its solve does not return the input for which absorb returns the requested output"),
    "memory": ([("    return s[0] + product", "    s[1] = y\n    return s[0] + product"),
                ('("reached",)', '("reached", "asked")'),
                ("    s[0] = x\n    return x", "    s[0] = x\n    s[1] = x\n    return x"),
                ("    return s[0]\n\n\nclass", "    s[1] = s[0]\n    return s[0]\n\n\nclass")],
               "its solve changes the memory, but fixed point bounds only what absorb and rest do"),
}  # fmt: skip


@pytest.mark.parametrize("what", ONLY_FLOAT)
def test_what_only_floating_point_takes_is_refused_elsewhere(tmp_path: Path, what: str) -> None:
    changes, said = ONLY_FLOAT[what]
    python = STAGE
    for before, after in changes:
        assert before in python
        python = python.replace(before, after)
    one = hystgen.load(written(tmp_path, FOLLOWER), [outside(tmp_path, python)])
    assert not one.refusals("inverse", "float32")
    ((_, reason),) = one.refusals("inverse", "q15")
    assert said in reason


STYLES = {
    "in one line": STAGE_C.replace("\n{\n    (void)t;\n    return y;\n}", " { (void)t; return y; }"),
    "braces behind": re.sub(r"\n {20,}", "\n    ", STAGE_C).replace(")\n{", ") {"),
    "a helper": STAGE_C.replace(
        "static hystgen_signal_t hystgen_user_follower_absorb(",
        "/* The rest of the way. */\nstatic hystgen_signal_t\n"
        "hystgen_user_follower_way(hystgen_signal_t a, hystgen_signal_t b)\n"
        "{\n    /* from b to a */\n    return a -\n        b; /* either sign */\n}\n\n"
        "static hystgen_signal_t hystgen_user_follower_absorb(", 1,
    ).replace("&t->rate, x - self->reached", "&t->rate,\n        hystgen_user_follower_way(x, self->reached)"),
    "a loop": STAGE_C.replace(
        "    self->reached = self->reached + hystgen_product",
        "    unsigned int i;\n    for (i = 0; i < 3u; ++i) {\n        if (i == 2u)\n            break;\n    }\n"
        "    self->reached = self->reached + hystgen_product",
    ),
    "windows": STAGE_C.replace("\n", "\r\n"),
}  # fmt: skip


@pytest.mark.parametrize("style", STYLES)
def test_c_may_be_written_in_any_style(tmp_path: Path, style: str) -> None:
    assert STYLES[style] != STAGE_C
    one = hystgen.load(written(tmp_path, FOLLOWER), [outside(tmp_path, c=STYLES[style])])
    hystgen.emit(one, tmp_path / "out", operator="both")
    for source in ("stage.c", "stage_selftest.c"):
        command = ["gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-c", source, "-o", "object.o"]
        subprocess.run(command, cwd=tmp_path / "out", check=True)
    assert max(map(len, (tmp_path / "out" / "stage.c").read_text().splitlines())) <= 100


def test_two_names_that_are_one_in_c_are_refused(tmp_path: Path) -> None:
    """The memory of `user:droop_table` would have the name of the table of `user:droop`."""
    other = tmp_path / "other"
    shutil.copytree(EXAMPLE, other, ignore=shutil.ignore_patterns("__pycache__"))
    for file in ("model.py", "droop.c"):
        text = (other / file).read_text().replace("user:droop", "user:droop_table")
        text = text.replace("hystgen_user_droop", "hystgen_user_droop_table")
        (other / file).write_text(re.sub(r"\n {20,}", "\n    ", text))
    path = written(tmp_path, DROOP, DROOP.replace("user:droop", "user:droop_table"))
    with pytest.raises(EffectsError, match="two effects of your own have the name hystgen_user_droop_table_t in C"):
        emitted_files(hystgen.load(path, [EXAMPLE, other]))


@pytest.mark.parametrize("keeps", [0.5, 0.99, 0.999])
@pytest.mark.parametrize("apart", [0.0, 1e-13, 1e-9, 1e-4])
def test_sums_over_samples_are_no_smaller_than_they_are(keeps: float, apart: float) -> None:
    """Bounds for two low-passes in series, equal or nearly so, are compared with the sums themselves."""
    a = np.array([[keeps, 0.0], [1.0 - keeps, keeps * (1.0 - apart)]])
    b, c = np.array([1.0 - keeps, 0.0]), np.array([0.3, 1.0])
    system = own.System(a, b, c, 0.0)
    power, states, after, once = np.eye(2), np.zeros(2), np.zeros(2), np.zeros(2)
    for _ in range(int(40.0 / (1.0 - keeps))):
        states += np.abs(power @ b)
        after += np.abs(c @ power)
        once = np.maximum(once, np.abs(c @ power))
        power = a @ power
    before = float(after @ np.abs(b))  # all are positive
    pairs = (system.states(), states), (system.after(), after), (system.once(), once), (system.before(), before)
    for bound, exact in pairs:
        assert np.all(bound >= exact * (1.0 - 1e-9))
    if apart < 1e-6:
        assert all(np.all(bound <= 2.0 * exact) for bound, exact in (*pairs[:2], pairs[3]))


def test_two_folders_give_one_file_of_both(tmp_path: Path) -> None:
    text = emitted_files(both(tmp_path), operator="both")
    assert "stage_user_droop_absorb" in text["stage.c"]
    assert "stage_user_follower_absorb" in text["stage.c"]
    assert max(map(len, text["stage.c"].splitlines())) <= 100


@pytest.mark.parametrize(
    ("kind", "family"),
    [
        pytest.param(kind, family, id=f"{kind.name}-{name}")
        for name, family in runtime.FAMILIES.items()
        if name in ("float32", "q31")
        for part in PARTS
        for kind in (part.coded() if name == "q31" else part.floating).kinds
    ],
)
def test_the_catalogue_s_blocks_have_their_functions_in_c(kind: BlockKind, family: runtime.Family) -> None:
    functions = {piece.name for piece in runtime._pieces(family.chain_blocks, family.facts)}
    assert {f"hystgen_{kind.name}_{verb}" for verb in kind.own} <= functions


def test_a_block_says_what_it_does_to_signals() -> None:
    """The figures of a block agree with sums over a long record."""
    (effect,) = load_user_effects(EXAMPLE)
    one = own.linear(effect.model_validate({"name": "user:droop", "share": 0.05, "time_constant": 0.02}), T)
    a, b, c = one.forward.a, one.forward.b, one.forward.c
    powers = [c @ np.linalg.matrix_power(a, k) for k in range(2000)]
    assert one.forward.before() == pytest.approx(sum(abs(p @ b) for p in powers), rel=1e-9)
    assert np.all(one.forward.after() >= np.sum(np.abs(powers), axis=0) * (1.0 - 1e-9))
    assert one.rest == pytest.approx(0.95)
    assert one.exact
    with pytest.raises(EffectsError, match="failed in numbers"):
        own.linear(effect.model_construct(name="user:droop", share=0.05, time_constant=None), T)


def test_emit_options_take_it(tmp_path: Path) -> None:
    one = hystgen.load(written(tmp_path, DROOP), [EXAMPLE])
    assert emit_options(one).left_out == ()
    assert emit_options(one, arithmetic="q15").left_out == ()
