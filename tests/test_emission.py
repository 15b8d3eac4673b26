"""Emitted C: equal bits with every compiler, no warnings in any dialect, no foreign symbols, always the same text."""

from __future__ import annotations

import csv
import functools
import itertools
import os
import re
import shutil
import subprocess
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import units
from elftools.elf.elffile import ELFFile
from mains import c_main
from modelfiles import CHAINS, FILES

import hystgen
from hystgen.arithmetic import ARITHMETICS
from hystgen.basics.names import MAX_NAME
from hystgen.cascade import PI, Cascade
from hystgen.compensator.engines import ENGINES, choose
from hystgen.emission import cost, declarations, runtime
from hystgen.emission.calls import emit_options, emitted_files
from hystgen.emission.options import read_banner
from hystgen.emission.text import literal
from hystgen.front.dead_zone.model import DeadZone
from hystgen.model import Model
from hystgen.parameters.files import parameters_sha256, parse_parameters
from hystgen.plays import slots
from hystgen.verification import comparison, compilers, host, signals, sources

GOLDEN = Path(__file__).parent / "golden"
LAYOUTS = ("self-contained", "single-header", "shared-runtime")
DIALECTS = (["-std=c99"], ["-std=c11"], ["-x", "c++", "-std=c++17"])
FIXED_PLACE = ["-fno-pic", "-fno-pie"]  # as for firmware; otherwise constant pointers go into a data section
OLDER = (["-std=gnu89"], ["-x", "c++", "-std=gnu++98"], ["-x", "c++", "-std=gnu++11"])


def model(name: str) -> Model:
    return Model(parse_parameters(FILES[name], f"{name}.yaml"))


def required_compilers() -> list[compilers.Compiler]:
    found = compilers.available()
    if os.environ.get("CI"):
        assert [c.name for c in found] == list(compilers.NAMES), "CI verifies with gcc, clang and zig"
    assert found, "no C compiler"
    return found


LENGTH = 20_000
"""Calls per record: a fifth of `verify`'s default, and enough to reveal all mutants of `test_mutants.py`."""


def check_codegen(name: str, **options: str) -> None:
    """Check that the emitted C gives the same bits as the reference."""
    required_compilers()
    report = hystgen.verify(model(name), operator="both", length=LENGTH, **options)
    assert report.ok, report.table()
    assert {row.operator for row in report.rows} == {"forward", "inverse"}


@pytest.mark.slow(one_in=9)
@pytest.mark.parametrize("engine", ["corners", "loop"])
@pytest.mark.parametrize("arithmetic", ["float32", "float64", "q31", "q15"])
@pytest.mark.parametrize("name", FILES)
@pytest.mark.thorough
def test_bits_equal(name: str, arithmetic: str, engine: str) -> None:
    check_codegen(name, arithmetic=arithmetic, engine=engine)


ROUND = {
    "fine": ([0, 20], [0, 1.25, 2.5, 3.75, 5, 6.25, 7.5, 8.75, 10], [0.7, 0.1, 0.13, 0.2, 0.15, 0.11, 0.1, 0.05, 0.02]),
    "coarse": ([2.5, 20], [0, 1.25, 5, 7.5], [0.5, 0.25, 0.1, 0.1]),
}


@pytest.mark.parametrize("arithmetic", ["float32", "float64"])
@pytest.mark.parametrize("name", ROUND)
@pytest.mark.thorough
def test_bits_equal_where_corners_end_at_the_same_drive(name: str, arithmetic: str) -> None:
    """With round numbers, rounding decides which of two corners the drive leaves first, and which play follows."""
    ends, thresholds, weights = ROUND[name]
    pi = f"{{thresholds: {thresholds}, weights: {weights}}}"
    text = f"hystgen: 1\nname: {name}\ninput_range: {ends}\nmodel:\n  pi: {pi}\n"
    one = Model(parse_parameters(text, "round.yaml"))
    report = hystgen.verify(one, arithmetic=arithmetic, engine="corners", compiler=["gcc"], length=400_000)
    assert report.ok, report.table()


# Cases that once gave different bits: a range, thresholds, weights, the rest of the model, and calls
TIES: dict[str, tuple[tuple[float, float], list[float], list[float], str, str]] = {
    "a commit leads beyond what may be asked for": (
        (-10, 10),
        [0.5 * k for k in range(17)],
        [0.7, *(0.2 / k for k in range(1, 17))],
        "",
        "commit -10 step -14.593748 step -12.064165 commit -7 step -12.161457061767578 step -11.18854 commit -10 "
        "step -12.161458015441895 step 12.064165 commit 2.5 step 12.161458",
    ),
    "a reset to what gets a limit of the drive, then the same again": (
        (0.9, 2.7),
        [0, 0.3, 0.6, 0.9],
        [0.05, 1, 0.5, 0],
        "output_offset: -0.9083760373456218",
        "reset -0.39237603545188904 step -0.39237603545188904 step 1.0866239070892334",
    ),
    "a drive of minus zero": (
        (0, 18),
        [0.3 * k for k in range(25)],
        [0.05] + 24 * [0.1],
        "initial_state: 14.805759137171366",
        "step 36.47 commit 3.5514087677001953 step 36.14939498901367 commit -0.0 step -0.0 step 36.44397735595703",
    ),
    "the next play follows by the output and not by the way to the limit": (
        (0, 7.2),
        [0.3 * k for k in range(7)],
        [0.7] + 6 * [0.1],
        "",
        "reset -0.8729999661445618 step 1.0499999523162842 step 4.364999771118164 commit 0.8999999761581421 "
        "step 0.6299999952316284 step 6.389999866485596",
    ),
    "a commit behind what the limit of references gives": (
        (1.2, 3.6),
        [0, 0.3, 0.6, 0.9, 1.2],
        [0.7, 0.2549066344143579, 0.22261852499022095, 0.7862042206858755, 0.21670804472704908],
        "",
        "reset 0.9155434370040894 commit 1.2000000476837158 step 3.794201135635376 step 3.794200897216797",
    ),
    "the same behind that answer sent twice": (
        (2, 6),
        [0, 0.25, 0.5, 0.75, 1],
        [1, 0.890760003471881, 0.46941214252315566, 0.8374753991494686, 0.7138028196989812],
        "",
        "reset 9.62220573425293 step 9.62220573425293 commit 6 commit 2.75 step 9.62220573425293",
    ),
}
OPERATIONS = {"step": slots.OP_STEP, "commit": slots.OP_COMMIT, "reset": slots.OP_RESET}


def differing(one: Model, calls: signals.Calls, folder: Path) -> list[tuple[str, int, int]]:
    """For each build on this machine: its name, its number of samples, and how many differ from the reference."""
    real = ARITHMETICS["float32"].number
    record = comparison.expected_record(one.tables("float32", "corners"), real, True, calls)
    files = sources.write(folder, one, emit_options(one, "inverse", "float32", "corners"))
    rows = host.rows(files, lambda _: [record], real, ["gcc"], folder, lambda _: None)
    return [(row.build, row.samples, row.different) for row in rows]


@pytest.mark.thorough(but_one_in=6)
@pytest.mark.parametrize("name", TIES)
def test_bits_equal_where_rounding_once_decided_otherwise(name: str, tmp_path: Path) -> None:
    ends, thresholds, weights, more, words = TIES[name]
    pi = f"{{thresholds: {thresholds}, weights: {weights}{', ' + more if 'state' in more else ''}}}"
    offset = f"  {more}\n" if "offset" in more else ""
    text = f"hystgen: 1\nname: tie\ninput_range: {list(ends)}\nmodel:\n  pi: {pi}\n{offset}"
    calls = words.split()
    op = np.array([OPERATIONS[word] for word in calls[::2]], dtype=np.uint8)
    x = np.array([float(word) for word in calls[1::2]], dtype=np.float32).astype(np.float64)
    made = differing(Model(parse_parameters(text, "tie.yaml")), ("tie", op, x), tmp_path)
    assert made == [(build, len(op), 0) for build, _ in host.BUILDS]


def of_round_numbers(rng: np.random.Generator) -> Model:
    """A model with evenly spaced thresholds, whose range is a multiple of the spacing, around, from or beyond 0."""
    n = int(rng.choice([0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 40]))
    step = float(rng.choice([0.25, 0.5, 1.0, 0.1, 0.3]))
    reach = step * max(n, 1) * float(rng.choice([0.5, 1.0, 1.25, 2.0]))
    ends = [[-reach, reach], [0.0, 2 * reach], [-0.5 * reach, 1.5 * reach], [reach, 3 * reach]][rng.integers(4)]
    followers = [n * [0.1], [0.2 / k for k in range(1, n + 1)], rng.choice([0, 0.25, 0.5, 1.0], n), rng.uniform(size=n)]
    weights = [float(rng.choice([0.05, 0.7, 1.0, 3.0])), *map(float, followers[rng.integers(4)])]
    thresholds = [round(step * k, 6) for k in range(n + 1)]
    start = f", initial_state: {float(rng.uniform(*ends))}" if rng.random() < 0.3 else ""
    offset = f"  output_offset: {float(rng.uniform(-1, 1))}\n" if rng.random() < 0.3 else ""
    pi = f"{{thresholds: {thresholds}, weights: {weights}{start}}}"
    text = f"hystgen: 1\nname: round\ninput_range: {ends}\nmodel:\n  pi: {pi}\n{offset}"
    return Model(parse_parameters(text, "round.yaml"))


ONCE = (16, 50, 72, 84, 85, 95, 112, 116, 127, 136)  # seeds of models that once gave different bits


@pytest.mark.slow(one_in=2)
@pytest.mark.thorough(but_one_in=7)
@pytest.mark.parametrize("seed", [*range(4), *ONCE])
def test_bits_equal_in_models_of_round_numbers(seed: int) -> None:
    """Ties of all kinds: 18 of 232 such models once gave different bits, each in a few of 10^6 samples."""
    rng = np.random.default_rng(seed)
    one = of_round_numbers(rng)
    arithmetic = str(rng.choice(["float32", "float32", "float64"]))
    report = hystgen.verify(one, arithmetic=arithmetic, engine="corners", compiler=["gcc"], length=60_000)
    assert report.ok, report.table()


def beside_limits(one: Model, length: int) -> signals.Calls:
    """Calls near a limit of the drive, some of which repeat earlier ones to within 16 units in the last place."""
    rng = np.random.default_rng(17)
    low, high = one.parameters.input_range
    least, most = one.cascade.output_range
    op = rng.choice([slots.OP_STEP, slots.OP_COMMIT, slots.OP_RESET], length, p=[0.88, 0.08, 0.04])
    x = np.empty(length, np.float32)
    for i in range(length):
        before = x[rng.integers(max(0, i - 20), i)] if i else np.float32(0)
        kind = rng.random()
        if op[i] == slots.OP_COMMIT:
            x[i] = rng.choice([low, high, rng.uniform(low, high)])
        elif kind < 0.4:
            x[i] = before + int(rng.integers(-16, 17)) * np.spacing(before)
        elif kind < 0.5:  # rounding may take a commit to an end of the range beyond these
            end = np.float32(rng.choice([least, most]))
            x[i] = end + int(rng.integers(-3, 4)) * np.spacing(end)
        elif kind < 0.98:
            end = rng.choice([*one.cascade.swung, least, most])
            x[i] = end + rng.normal() * 10 ** rng.uniform(-4, 0) * (most - least)
        else:
            x[i] = rng.choice([np.nan, np.inf, -np.inf])
    return "beside limits", op.astype(np.uint8), x.astype(np.float64)


@pytest.mark.thorough(but_one_in=3)
@pytest.mark.parametrize("ends", [(0, 20), (-20, 0), (-10, 10), (-3, 13), (2.5, 20), (1e-3, 9)])
def test_bits_equal_where_rounding_decides_on_a_limit(ends: tuple[float, float], tmp_path: Path) -> None:
    thresholds = np.linspace(0, 9, 17)
    weights = np.append(0.7, 0.15 * np.exp(-thresholds[1:] / 5))
    pi = f"{{thresholds: {thresholds.tolist()}, weights: {weights.tolist()}}}"
    text = f"hystgen: 1\nname: ends\ninput_range: {list(ends)}\nmodel:\n  pi: {pi}\n"
    one = Model(parse_parameters(text, "ends.yaml"))
    made = differing(one, beside_limits(one, 60_000), tmp_path)
    assert made == [(build, 60_000, 0) for build, _ in host.BUILDS]


@pytest.mark.slow(one_in=2)
@pytest.mark.parametrize("layout", LAYOUTS[1:])
@pytest.mark.parametrize("arithmetic", ["float32", "q31", "q15"])
@pytest.mark.parametrize("name", ["listed", "mixed"])
@pytest.mark.thorough
def test_bits_equal_in_other_layouts(name: str, arithmetic: str, layout: str) -> None:
    check_codegen(name, arithmetic=arithmetic, layout=layout)


@pytest.mark.slow(one_in=12)
@pytest.mark.thorough(but_one_in=24)
@pytest.mark.parametrize("engine", ["corners", "loop"])
@pytest.mark.parametrize("arithmetic", ["float32", "float64", "q31", "q15"])
@pytest.mark.parametrize("name", FILES)
def test_sanitizers_find_nothing(name: str, arithmetic: str, engine: str, tmp_path: Path) -> None:
    """The verification records cause no out-of-bounds access and no undefined behaviour."""
    gcc = next((c for c in required_compilers() if c.name == "gcc"), None)
    if gcc is None:
        pytest.skip("gcc and its sanitizers are not installed")
    one = model(name)
    hystgen.emit(one, tmp_path, operator="both", arithmetic=arithmetic, engine=engine)
    numbers, real = one.tables(arithmetic, engine), ARITHMETICS[arithmetic].number
    (tmp_path / "main.c").write_text(c_main(name))
    flags = ["-std=c99", "-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    gcc.run([*flags, "-I", tmp_path, tmp_path / "main.c", tmp_path / f"{name}.c", "-o", tmp_path / "run"])
    for op in ("forward", "inverse"):
        for record, call, x in signals.suite(numbers, real, op == "inverse", 20_000):
            calls = np.rec.fromarrays([call, x.astype(real)], dtype=[("call", "u1"), ("x", real)])
            done = subprocess.run([tmp_path / "run", op], input=calls.tobytes(), capture_output=True, check=False)
            assert done.returncode == 0, f"{op}, {record}: {done.stderr.decode()}"


ALONE = [
    (name, operator, layout)
    for name in FILES
    for operator in ("forward", "inverse", "both")
    for layout in LAYOUTS
    if operator == "both" or layout == LAYOUTS[0] or name in ("listed", "mixed")
]
"""Every layout with both operators, and each operator in one layout; for two models, all combinations."""


@pytest.mark.slow(one_in=10)
@pytest.mark.parametrize(("name", "operator", "layout"), ALONE)
@pytest.mark.thorough
def test_compiles_clean_and_alone(name: str, operator: str, layout: str, tmp_path: Path) -> None:
    arithmetic = {"bent": "float64", "curved": "float64", "mixed": "q31", "listed": "q15"}.get(name, "float32")
    engine = "loop" if operator == "forward" else "corners"
    hystgen.emit(model(name), tmp_path, operator=operator, layout=layout, arithmetic=arithmetic, engine=engine)
    if layout == "single-header":
        (tmp_path / "all.c").write_text(f'#define {name.upper()}_IMPLEMENTATION\n#include "{name}.h"\n')
    sources = sorted(tmp_path.glob("*.c"))
    for compiler in required_compilers():
        place = [] if compiler.name == "zig" else FIXED_PLACE
        for dialect in DIALECTS if compiler.name != "zig" else DIALECTS[:1]:
            warnings = compilers.WARNINGS if "c++" in dialect else compilers.C_WARNINGS
            for source in sources:
                output = tmp_path / "one.o"
                compiler.run(["-c", "-O2", *place, *dialect, *warnings, "-o", output, source])
                alone = source.stem == name or source.stem == "all"
                if alone and layout != "shared-runtime" and compiler.name != "zig":
                    symbols = subprocess.run(["nm", output], capture_output=True, text=True, check=True).stdout
                    kinds = {line.split()[-2] for line in symbols.splitlines()}
                    assert not kinds & {"U", "D", "d", "B", "b"}, symbols


@pytest.mark.slow(one_in=5)
@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("arithmetic", ["float32", "float64", "q31", "q15"])
@pytest.mark.parametrize("name", ["listed", "mixed"])
@pytest.mark.thorough
def test_compiles_in_older_dialects(name: str, arithmetic: str, layout: str, tmp_path: Path) -> None:
    """These are GNU dialects, since 64-bit integers need extensions; <float.h> and <stdint.h> hide much in them."""
    hystgen.emit(model(name), tmp_path, operator="both", layout=layout, arithmetic=arithmetic)
    if layout == "single-header":
        (tmp_path / "all.c").write_text(f'#define {name.upper()}_IMPLEMENTATION\n#include "{name}.h"\n')
    (tmp_path / "user.c").write_text(f'#include "{name}.h"\n#include "{name}_selftest.h"\n')
    for compiler in required_compilers():
        for dialect in OLDER if compiler.name != "zig" else OLDER[:1]:
            warnings = compilers.WARNINGS if "c++" in dialect else compilers.C_WARNINGS
            for source in sorted(tmp_path.glob("*.c")):
                flags = [flag for flag in warnings if flag != "-pedantic"]
                compiler.run(["-c", "-O2", *dialect, *flags, "-o", tmp_path / "one.o", source])


def test_unknown_precision_is_refused_and_says_why(tmp_path: Path) -> None:
    """Refused if neither <float.h> nor the compiler states the precision of computations, or if it is the wrong one."""
    gcc = next(compiler for compiler in required_compilers() if compiler.name == "gcc")
    hystgen.emit(model("plain"), tmp_path, layout="shared-runtime")
    run = functools.partial(gcc.run, ["-std=gnu89", "-c", "-o", tmp_path / "one.o", tmp_path / "plain.c"])
    for flag, words in (
        ("-U__FLT_EVAL_METHOD__", "compile as C99 or C[+][+]11 or later"),
        ("-D__FLT_EVAL_METHOD__=2", "compute in the precision of plain_real_t"),
    ):
        with pytest.raises(compilers.CompileError, match=words):
            gcc.run(["-w", flag, *run.args[0]])
    run()


@pytest.mark.parametrize("x", [0, 7, -(2**31), 2**31 - 1, 2**31, -(2**31) - 1, -(3 * 10**9), -(2**63), 2**63 - 1])
def test_whole_numbers_keep_their_value_in_every_dialect(x: int, tmp_path: Path) -> None:
    """Constants cause no warning on a core with 32-bit `long` either, where C90 takes 3000000000 as unsigned."""
    zig = next((compiler for compiler in required_compilers() if compiler.name == "zig"), None)
    assert zig
    half = x // 2 if x % 2 == 0 else (x - 1) // 2  # so that the test itself needs no large literal
    rest = x - 2 * half
    words = f"((long long)0x{half & (2**64 - 1):x}ULL * 2 + {rest})"
    text = f"typedef char same[(long long)({literal(x)}) == {words} ? 1 : -1];\n"
    (tmp_path / "one.c").write_text(text)
    for dialect in (["-std=gnu89"], ["-std=c99"], ["-std=c11"]):
        core = ["-target", "thumb-freestanding-eabi", "-mcpu=cortex_m0plus"]
        zig.run([*core, *dialect, "-Wall", "-Werror", "-c", "-o", tmp_path / "one.o", tmp_path / "one.c"])


@pytest.mark.parametrize("layout", ["self-contained", "shared-runtime"])
@pytest.mark.parametrize("flags", [
    "-Ofast", "-ffast-math", "-ffinite-math-only", "-funsafe-math-optimizations",
    "-fassociative-math -fno-signed-zeros -fno-trapping-math",
])  # fmt: skip
@pytest.mark.thorough
def test_flags_that_change_answers_are_refused(flags: str, layout: str, tmp_path: Path) -> None:
    """Refused at compile time, except for reordering in clang, which does not report it; fixed point is unaffected."""
    for arithmetic in ("float32", "float64", "q31"):
        folder = tmp_path / arithmetic
        hystgen.emit(model("curved"), folder, operator="both", layout=layout, arithmetic=arithmetic, engine="corners")
        for compiler in required_compilers():
            if compiler.name == "zig":  # a clang that treats -Ofast as -O3
                continue
            reported = compiler.name == "gcc" or not flags.startswith(("-funsafe", "-fassociative"))
            for source in folder.glob("*.c"):
                run = functools.partial(compiler.run, ["-c", *flags.split(), "-o", tmp_path / "one.o", source])
                if arithmetic == "q31" or not reported:
                    run()
                    continue
                with pytest.raises(compilers.CompileError, match="build without -f"):
                    run()
    header = emitted_files(model("curved"), arithmetic="float32")["curved.h"]
    banner = re.sub(r"\s+\*?\s*", " ", header)  # without line breaks
    for words in ("flush denormal", "to nearest", "-fassociative-math", "-ffp-contract=fast"):
        assert words in banner


def test_constants_in_single_precision_are_refused(tmp_path: Path) -> None:
    """With double numbers, gcc's flag would round them; other compilers have no such flag."""
    gcc = next(compiler for compiler in required_compilers() if compiler.name == "gcc")
    for arithmetic in ("float32", "float64"):
        folder = tmp_path / arithmetic
        hystgen.emit(model("curved"), folder, operator="both", layout="shared-runtime", arithmetic=arithmetic)
        for source in ("curved.c", f"hystgen_runtime_f{arithmetic[-2:]}.c"):
            run = ["-c", "-fsingle-precision-constant", "-o", tmp_path / "one.o", folder / source]
            if arithmetic == "float32":
                gcc.run(run)
                continue
            with pytest.raises(compilers.CompileError, match="constants_are_double"):
                gcc.run(run)


@pytest.mark.parametrize("arithmetic", ["float32", "float64", "q31", "q15"])
def test_no_word_of_a_parameter_file_gets_out_of_its_comment(arithmetic: str, tmp_path: Path) -> None:
    words = "*/ int evil; /* \\ ??/"
    units = f'units: {{input: "{words}", output: "µm"}}\ndescription: "{words}"'
    text = FILES["curved"].replace("units: {input: V, output: um}", units)
    assert "evil" in text
    hystgen.emit(Model(parse_parameters(text, "curved.yaml")), tmp_path, operator="both", arithmetic=arithmetic)
    for compiler in required_compilers():
        for source in tmp_path.glob("*.c"):
            compiler.run(["-c", "-std=c99", *compilers.C_WARNINGS, "-o", tmp_path / "one.o", source])
    for file in tmp_path.glob("*.[hc]"):
        assert "evil" not in re.sub(r"/\*.*?\*/", "", file.read_text(encoding="ascii"), flags=re.DOTALL)
    assert " um" in (tmp_path / "curved.h").read_text(encoding="ascii")


@pytest.mark.parametrize(
    ("name", "layout"),
    [("plain", "self-contained"), ("bent", "self-contained"), ("mixed", "self-contained"), ("mixed", "shared-runtime")],
)
@pytest.mark.parametrize("arithmetic", ["float32", "float64", "q31", "q15"])
def test_constant_tables_take_no_more_than_the_banner_says(
    name: str, arithmetic: str, layout: str, tmp_path: Path
) -> None:
    """Sizes are those of object files for a 32-bit target."""
    zig = next((compiler for compiler in required_compilers() if compiler.name == "zig"), None)
    assert zig
    hystgen.emit(model(name), tmp_path, operator="both", arithmetic=arithmetic, layout=layout)
    said = re.search(r"constant tables +(\d+) bytes", (tmp_path / f"{name}.h").read_text())
    assert said
    taken = 0
    for source in tmp_path.glob("*.c"):
        if source.stem == f"{name}_selftest":
            continue
        output = tmp_path / "one.o"
        core = ["-target", "thumb-freestanding-eabi", "-mcpu=cortex_m0plus"]
        zig.run(["-c", "-O2", "-fdata-sections", *core, "-o", output, source])
        with output.open("rb") as file:
            for section in ELFFile(file).iter_sections():
                if section.name.startswith(".rodata"):
                    taken += section["sh_size"]
    assert 0.5 * int(said[1]) < taken <= int(said[1])


TEN = """\
hystgen: 1
name: stage
input_range: [0, 30]
model:
  pi:
    thresholds: [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]
    weights: [0.5, 0.05, 0.05, 0.04, 0.03, 0.03, 0.02, 0.02, 0.01, 0.01]
"""


@pytest.mark.thorough
@pytest.mark.parametrize(("arithmetic", "lines", "most"), [
    ("float32", 360, 3600), ("q31", 360, 3500), ("q15", 360, 3500),
])  # fmt: skip
def test_ten_plays_are_read_and_stored_easily(arithmetic: str, lines: int, most: int, tmp_path: Path) -> None:
    """An inverse stays within limits of lines of C and bytes of code on two cores, without comments and tables; both
    operators together take up to 1.6 times as many bytes."""
    zig = next(compiler for compiler in required_compilers() if compiler.name == "zig").command
    gcc = ("arm-none-eabi-gcc", "-mthumb")
    builds = (
        (*gcc, "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"), (*gcc, "-mcpu=cortex-m0plus"),
        (*zig, "-target", "thumb-freestanding-eabihf", "-mcpu=cortex_m4+vfp4d16sp"),
        (*zig, "-target", "thumb-freestanding-eabi", "-mcpu=cortex_m0plus"),
    )  # fmt: skip
    taken = {}
    for operator in ("inverse", "forward", "both"):
        folder = tmp_path / operator
        hystgen.emit(Model(parse_parameters(TEN)), folder, operator=operator, arithmetic=arithmetic, engine="corners")
        if operator != "both":
            text = (folder / "stage.c").read_text()
            code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
            assert len([line for line in code.splitlines() if line.strip()]) <= lines
            assert len(text.splitlines()) <= 1.35 * lines
        for number, build in enumerate(builds):
            output = folder / "one.o"
            subprocess.run([*build, "-std=c99", "-O2", "-c", str(folder / "stage.c"), "-o", str(output)], check=True)
            with output.open("rb") as file:
                sections = [s for s in ELFFile(file).iter_sections() if s.name.startswith(".text")]
                taken[operator, number] = sum(section["sh_size"] for section in sections)
    for number in range(len(builds)):
        alone = taken["inverse", number]
        assert taken["forward", number] <= alone <= most
        assert taken["both", number] <= 1.6 * alone


@pytest.mark.thorough
@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize("name", ["plain", "two_branches"])
def test_nothing_is_copied_by_a_function_of_the_library(name: str, arithmetic: str, tmp_path: Path) -> None:
    """For a Cortex-M0+, gcc would copy structures of more than 16 bytes by a call of memcpy."""
    hystgen.emit(model(name), tmp_path, operator="both", arithmetic=arithmetic, engine="corners")
    core = ["arm-none-eabi-gcc", "-std=c99", "-mcpu=cortex-m0plus", "-mthumb"]
    for level in ("-O0", "-Os", "-O2"):
        subprocess.run([*core, level, "-c", tmp_path / f"{name}.c", "-o", tmp_path / "one.o"], check=True)
        listed = ["arm-none-eabi-nm", "-u", tmp_path / "one.o"]
        assert "memcpy" not in subprocess.run(listed, capture_output=True, text=True, check=True).stdout, level


@pytest.mark.parametrize("name", FILES)
def test_nothing_forbidden_in_the_text(name: str) -> None:
    for file, text in emitted_files(model(name), operator="both", arithmetic="float32").items():
        code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
        assert not re.search(r"\b(double|malloc|printf|memcpy)\b", code), file
        assert " / " not in re.sub(r" / 2\b(?!\.)", "", code), file  # halving is exact; compilers multiply instead
        includes = set(re.findall(r"#include <(\w+)\.h>", code))
        assert includes <= {"stdint", "stdbool", "stddef", "float"}, file


def renamed(name: str, to: str) -> Model:
    """A model under another name, with a long description."""
    text = {**FILES, **CHAINS}[name].replace(f"name: {name}\n", f"name: {to}\ndescription: {'piezo ' * 40}\n")
    return Model(parse_parameters(text, f"{name}.yaml"))


@pytest.mark.slow(one_in=2)
@pytest.mark.parametrize("name", ["x", "n" * MAX_NAME])
@pytest.mark.parametrize("kind", ["plain", "listed", "bent", "mixed"])
@pytest.mark.thorough
def test_no_line_is_longer_than_100_columns(kind: str, name: str, tmp_path: Path) -> None:
    """Statements are wrapped for names of any length. With the longest name the C still compiles without warnings."""
    one = renamed(kind, name)
    for arithmetic, engine, layout in itertools.product(ARITHMETICS, ENGINES, LAYOUTS):
        for operator in ("both", "forward", "inverse") if layout == LAYOUTS[0] else ("both",):
            folder = tmp_path / f"{arithmetic}-{engine}-{layout}-{operator}"
            hystgen.emit(one, folder, arithmetic=arithmetic, engine=engine, layout=layout, operator=operator)
            for file in sorted(folder.glob("*.[ch]")):
                for line in file.read_text().splitlines():
                    assert len(line) <= 100, f"{folder.name}, {file.suffix}: {line}"
                if file.suffix == ".c" and len(name) > 1:
                    command = ["gcc", "-std=c99", "-fsyntax-only", *compilers.C_WARNINGS, file]
                    done = subprocess.run(command, capture_output=True, text=True, check=False)
                    assert done.returncode == 0, done.stderr


EVERY_EFFECT = (
    "everything", "worn", "dashpot", "viscous", "relaxing", "dilated", "drifting", "heated", "rubbed", "quick",
    "straight", "forgetful",
)  # fmt: skip
"""Chains that together have every effect and every kind of table."""


def test_every_effect_is_among_them() -> None:
    def effects(names: Iterable[str]) -> set[str]:
        return set(re.findall(r"\{name: (\w+)", "".join(CHAINS[name] for name in names)))

    assert effects(EVERY_EFFECT) == effects(CHAINS)


@pytest.mark.slow(one_in=3)
@pytest.mark.thorough
@pytest.mark.parametrize("arithmetic", ["float64", "q31"])
@pytest.mark.parametrize("chain", EVERY_EFFECT)
def test_no_line_of_an_effect_is_longer_than_100_columns(chain: str, arithmetic: str) -> None:
    """Only float64 and q31 are checked, since they have the longest numbers."""
    for file, text in emitted_files(renamed(chain, "n" * MAX_NAME), operator="inverse", arithmetic=arithmetic).items():
        for line in text.splitlines():
            assert len(line) <= 100, f"{file}: {line}"


def test_a_banner_of_two_lines_is_read(tmp_path: Path) -> None:
    one = renamed("plain", "n" * MAX_NAME)
    hystgen.emit(one, tmp_path, arithmetic="q15", engine="loop", layout="single-header", operator="both")
    text = next(tmp_path.glob(f"{one.name}.h")).read_text()
    read = read_banner(text)
    assert read is not None
    assert " \\\n" in text[: text.index("Parameters:")]
    options = {"arithmetic": "q15", "engine": "loop", "layout": "single-header", "operator": "both"}
    assert read.options == {**options, "tables": "constant"}
    assert not read.edited


@pytest.mark.parametrize("layout", LAYOUTS)
def test_files_name_their_licence_and_headers_what_made_them(layout: str, tmp_path: Path) -> None:
    """Files have a line that licence scanners look for; headers have macros that firmware can log."""
    files = emitted_files(model("plain"), layout=layout)
    for name, text in files.items():
        assert text.splitlines()[0] == "/* SPDX-License-Identifier: 0BSD", name
        (tmp_path / name).write_text(text)
    (tmp_path / "main.c").write_text(
        '#include <stdio.h>\n#include "plain.h"\n'
        "int main(void) { return puts(PLAIN_HYSTGEN_VERSION), puts(PLAIN_PARAMS_SHA256), 0; }\n"
    )
    subprocess.run(["cc", "-I", tmp_path, "-o", tmp_path / "main", tmp_path / "main.c"], check=True)
    shown = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True).stdout.split()
    assert shown == [hystgen.__version__, parameters_sha256(model("plain").parameters)]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize("name", ["plain", "listed", "bent", "two_branches"])
def test_numbers_of_functions_have_a_name(name: str, arithmetic: str, engine: str) -> None:
    """Outside tables and macros, only counts occur more than once, and no offset of 0 is written out."""
    files = emitted_files(model(name), operator="both", arithmetic=arithmetic, engine=engine)
    code = re.sub(r"/\*.*?\*/", "", files[f"{name}.c"], flags=re.DOTALL)
    code = re.sub(r"^#(?:.*\\\n)*.*$", "", code, flags=re.MULTILINE)
    code = re.sub(r"static const [^;]*?= \{.*?\};$", "", code, flags=re.DOTALL | re.MULTILINE)
    assert f"{name}_{'inverse' if engine == 'loop' else 'forward'}_step" in code
    assert not re.search(r"[+-] 0\.0f?\b|- 0[;)]", code)
    found = re.findall(r"(?<![\w.])((?:0x[0-9a-f]+|\d+\.?\d*(?:e[+-]?\d+)?))[uLf]*(?!\w)", code)
    counts = {str(i) for i in range(17)} | {"0.0", "1.0"}
    assert [number for number in set(found) - counts if found.count(number) > 1] == []


def test_templates_hold_no_algorithm() -> None:
    """Templates are short, and those of a module's C have few conditions; those of a unit of FMI define each function
    of the standard."""
    questions = 0
    apart = ("fm", "library", "report")
    for path in runtime.data_folder("templates").rglob("*.*"):
        text = re.sub("<style>.*?</style>", "", path.read_text(), flags=re.DOTALL)
        assert len(text.splitlines()) <= (350 if path.name.startswith("fm") else 150), path.name
        tags = re.findall(r"\{[{%].*?[}%]\}", text, flags=re.DOTALL)
        if path.parent.name == "templates" and not path.name.startswith(apart):
            questions += sum(len(re.findall(r"\b(?:el)?if\b", tag)) for tag in tags)
    assert 0 < questions <= 40


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_sizes_of_declared_types_are_the_compilers(arithmetic: str, tmp_path: Path) -> None:
    """The banner takes sizes from the declarations in `c_runtime/`; this machine's compiler gives the same sizes."""
    family = runtime.FAMILIES[arithmetic]
    variants = [
        runtime.Variant(engine, family, fronts, branches)
        for engine in ("corners", "loop")
        for fronts, branches in ((False, False), (True, False), (True, True))
    ]
    names = {"hystgen_real_t": family.real, "hystgen_play_t": family.real, "hystgen_reach_t": family.real}
    names |= {f"hystgen_{own}": kind for own, kind in family.types.items()}
    lengths = {"HYSTGEN_N_PLAYS": 3, "HYSTGEN_CORNERS": 5}
    shared = [*runtime.memory_pieces(family), *runtime.table_pieces(family)]
    for number, variant in enumerate(variants):
        operators = ["forward", "inverse"]
        pieces = [*shared, *runtime.state_pieces(variant, family, operators)]
        sizes = cost.sizes(pieces, family, cost.Layout(4, 8, packed=False), lengths)
        types = [each.name for each in pieces if "typedef struct" in each.code]
        assert {"hystgen_corner_t", "hystgen_inverse_t", "hystgen_forward_t"} <= set(types)
        lines = ["#include <stdbool.h>", "#include <stdint.h>", "#include <stdio.h>"]
        lines += [f"typedef {kind} {own};" for own, kind in names.items()]
        lines += [f"#define {macro} {length}" for macro, length in lengths.items()]
        lines += [each.text for each in pieces]
        printed = [f'    printf("%zu ", sizeof({each}));' for each in types]
        lines += ["int main(void)", "{", *printed, "    return 0;", "}"]
        source = tmp_path / f"sizes_{number}.c"
        source.write_text("\n".join(lines) + "\n")
        subprocess.run(["cc", "-std=c99", source, "-o", source.with_suffix("")], check=True)
        found = subprocess.run([source.with_suffix("")], capture_output=True, text=True, check=True).stdout.split()
        assert dict(zip(types, found, strict=True)) == {
            each: str(sizes[each.removeprefix("hystgen_")][0]) for each in types
        }


CORES = {
    "gcc": cost.Layout(integer=4, pointer=8, packed=False),
    "arm-none-eabi-gcc": cost.CORE_32,
    "avr-gcc": cost.AVR,  # has no double, and so no float64
}


@pytest.mark.parametrize(("compiler", "arithmetic"), [
    (compiler, arithmetic)
    for compiler in CORES for arithmetic in ARITHMETICS if (compiler, arithmetic) != ("avr-gcc", "float64")
])  # fmt: skip
def test_sizes_of_types_of_effects_are_the_compilers(compiler: str, arithmetic: str, tmp_path: Path) -> None:
    """The banner computes sizes from declarations; compilers, on the header that is written from them."""
    if not shutil.which(compiler):
        if os.environ.get("CI"):
            pytest.fail(f"CI installs {compiler}, but it is not there")
        pytest.skip(f"{compiler} is not installed")
    family = replace(runtime.FAMILIES[arithmetic], chain=True)
    pieces = declarations.pieces(family.kind)
    sizes = cost.sizes(pieces, family, CORES[compiler], {})
    assert len(pieces) > 20
    checks = [
        f"_Static_assert(sizeof({piece.name}) == {sizes[piece.name.removeprefix('hystgen_')][0]}, \"{piece.name}\");"
        for piece in pieces
    ]
    source = tmp_path / "sizes.c"
    source.write_text("\n".join([f'#include "{runtime.CHAIN_TYPES}"', *checks]) + "\n")
    command = [compiler, "-std=c11", *units.DEFINES[arithmetic], *units.INCLUDES, "-fsyntax-only", source]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def measured(name: str) -> dict[tuple[str, ...], dict[str, int]]:
    """A table of measured costs per core, keyed by the columns before the two cores."""
    with (Path(hystgen.__file__).parent / "compensator" / name).open() as file:
        header, *rows = csv.reader(file)
    cores = header[-2:]
    return {tuple(row[:-2]): dict(zip(cores, map(int, row[-2:]), strict=True)) for row in rows}


def test_auto_takes_the_engine_that_was_measured_cheaper() -> None:
    """Checked for each operator, arithmetic and kind; between measured numbers of plays, the smaller one decides."""
    instructions, code = measured("engine_costs.csv"), measured("code_sizes.csv")
    more = measured("effect_sizes.csv")
    chosen = set()
    for kind in ("pi", "gpi", "effects", "gpi_effects"):
        counts = sorted({int(row[3]) for row in instructions if row[2] == kind})
        assert counts[0] == 1
        rows = [row[:4] for row in instructions if row[2] == kind and row[4] == "loop"]
        assert len(rows) == 2 * 4 * len(counts)
        for operator, arithmetic, _, n in rows:
            effects = kind.endswith("effects")
            costs: dict[str, dict[str, float]] = {"speed": {}, "size": {}, "auto": {}}
            for engine in ENGINES:
                spent = instructions[operator, arithmetic, kind, n, engine]
                taken = code[operator, arithmetic, "dead_zone" if kind.startswith("gpi") else "pi", engine]
                if effects:
                    added = more["any" if engine == "loop" else "any_corners", arithmetic]
                    taken = {core: size + added[core] for core, size in taken.items()}
                costs["speed"][engine] = spent["cortex-m0plus"] * spent["cortex-m4f"]
                costs["size"][engine] = taken["cortex-m0plus"] + taken["cortex-m4f"]
                costs["auto"][engine] = taken["cortex-m0plus"] / 32768 + spent["cortex-m0plus"] / 4800
            stages = (DeadZone([-0.5, 0.0, 0.5], [0.1, 0.1, 0.1]),) if kind.startswith("gpi") else ()
            for plays in (int(n), int(n) + 1) if int(n) + 1 not in counts else (int(n),):
                pi = PI(np.linspace(0, 0.5, plays + 1).tolist(), [1.0] * (plays + 1))
                cascade = Cascade(pi, stages, 0.0, (-1.0, 1.0))
                for optimize, of in costs.items():
                    cheaper = "corners" if of["corners"] < of["loop"] else "loop"
                    if effects and optimize != "speed" and arithmetic in ("q31", "q15"):
                        cheaper = "loop"  # the loop's stack is known to stay within 128 bytes
                    assert choose("auto", optimize, cascade, operator, arithmetic, effects) == cheaper
                    chosen.add((optimize, cheaper))
    assert {("speed", "loop"), ("speed", "corners"), ("auto", "loop"), ("auto", "corners"), ("size", "loop")} <= chosen
    assert choose("auto", "auto", Cascade(PI([0], [1])), "both", "q15") == "loop"
    assert choose("loop", "speed", Cascade(PI([0, 0.5], [1, 1])), "both", "q15") == "loop"


@pytest.mark.parametrize("optimize", ["speed", "size"])
def test_optimize_comes_from_the_call_or_the_file(optimize: str) -> None:
    wanted = {"speed": "corners", "size": "loop"}[optimize]
    assert emit_options(model("plain"), optimize=optimize).engine == wanted
    chosen = Model(parse_parameters(FILES["plain"] + f"emit: {{optimize: {optimize}}}\n", "plain.yaml"))
    assert emit_options(chosen).engine == wanted
    assert emit_options(chosen, engine="corners").engine == "corners"
    other = {"speed": "size", "size": "speed"}[optimize]
    assert emit_options(chosen, optimize=other).engine != wanted


def test_same_bytes_from_any_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = hystgen.emit(model("mixed"), tmp_path / "a")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "p.yaml").write_text("# a comment\n" + FILES["mixed"])
    hystgen.emit("p.yaml", "b")
    for path in first:
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()
    assert hystgen.differences("p.yaml", "b") == []
    (tmp_path / "b" / "mixed.c").write_text("stale")
    (tmp_path / "b" / "mixed.h").unlink()
    assert [p.split(" ")[1] for p in hystgen.differences("p.yaml", "b")] == ["is", "has"]


@pytest.mark.slow(one_in=2)
@pytest.mark.thorough(but_one_in=6)
@pytest.mark.parametrize("arithmetic", ["float32", "float64"])
@pytest.mark.parametrize("engine", ["corners", "loop"])
@pytest.mark.parametrize("name", FILES)
def test_error_bounds_hold(name: str, arithmetic: str, engine: str) -> None:
    """Errors are relative to the model in double precision, for drives and references inside the range."""
    from hystgen.compensator.bounds import error_bounds

    one = model(name)
    bounds = error_bounds(one.cascade, arithmetic, engine)
    rng = np.random.default_rng(5)
    low, high = one.parameters.input_range
    v = np.interp(np.linspace(0, 500, 20000), np.arange(501), rng.uniform(low, high, 501))
    v = np.clip(v.astype(arithmetic).astype(float), low, high)
    exact = one.simulate(v)
    assert np.max(np.abs(one.simulate(v, arithmetic, engine=engine) - exact)) <= bounds.forward
    u = np.clip(exact, *one.cascade.output_range).astype(arithmetic).astype(float)
    drive = one.inverse().simulate(u, clamp=True)
    assert np.max(np.abs(one.inverse().simulate(u, arithmetic, engine=engine) - drive)) <= bounds.inverse


@pytest.mark.parametrize(("name", "options"), [
    ("plain", {"operator": "inverse", "arithmetic": "float32", "engine": "corners"}),
    ("bent", {"operator": "both", "arithmetic": "float64", "engine": "loop"}),
    ("two_branches", {"operator": "inverse", "arithmetic": "float32", "layout": "single-header"}),
    ("curved", {"operator": "inverse", "arithmetic": "q15", "engine": "corners"}),
])  # fmt: skip
def test_golden(name: str, options: dict[str, str]) -> None:
    """The emitted C equals the reviewed copy; HYSTGEN_UPDATE_GOLDEN=1 renews the copy."""
    folder = GOLDEN / name
    if os.environ.get("HYSTGEN_UPDATE_GOLDEN"):
        for stale in folder.glob("*"):
            stale.unlink()
        hystgen.emit(model(name), folder, **options)
    assert hystgen.differences(model(name), folder, **options) == []
