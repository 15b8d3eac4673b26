"""The C files of `c_runtime/` and of effects, as they are before emission.

They compile without warnings, alone and in units, and give the textbook model and the bits of the reference.
"""

from __future__ import annotations

import ast
import importlib
import itertools
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import cffi
import numpy as np
import pytest
import units

from hystgen.arithmetic import ARITHMETICS
from hystgen.compensator import reference, step, step_fixed, step_float
from hystgen.compensator.chain import step as chain_step
from hystgen.compensator.chain import step_fixed as chain_step_fixed
from hystgen.compensator.chain import step_float as chain_step_float
from hystgen.emission import chain, declarations, runtime
from hystgen.emission.calls import emitted_files
from hystgen.plays import fixed, loop, slots
from hystgen.verification import signals
from hystgen.verification.compilers import C_WARNINGS, WARNINGS

pytestmark = pytest.mark.thorough

RUNTIME = Path(__file__).resolve().parent.parent / "c_runtime"

SOFT = "-D__SOFTFP__"
"""As on a core without FPU, where engine corners compares floats by their bits."""

DRIVER = """
#include "hystgen_runtime.h"
void loop(const double *r, const double *p, const double *lift, const double *inverse, unsigned short n, int invert,
          const double *x, double *y, int count);
void loop(const double *r, const double *p, const double *lift, const double *inverse, unsigned short n, int invert,
          const double *x, double *y, int count)
{
    hystgen_tables_t t;
    double play[65];
    int i;
    t.threshold = r; t.weight = p; t.lift = lift; t.inverse_slope = inverse; t.n = n;
    hystgen_loop_rest(&t, play, 0);
    for (i = 0; i < count; ++i) {
        double w = invert ? hystgen_loop_solve(&t, play, hystgen_loop_output(&t, play), x[i]) : x[i];
        hystgen_loop_absorb(&t, play, w);
        y[i] = invert ? w : hystgen_loop_output(&t, play);
    }
}
void corners(const double *segment, double falling, double rising, unsigned short n, const double *x, double *y,
             int count);
void corners(const double *segment, double falling, double rising, unsigned short n, const double *x, double *y,
             int count)
{
    static const double center[1][2] = {{0, 0}};
    const hystgen_curve_t t = {(const hystgen_segment_t *)segment, {DBL_MAX, DBL_MAX}, {DBL_MAX, DBL_MAX},
                               {DBL_MAX, DBL_MAX}};
    const hystgen_start_t start = {center, 0, n, {0, {falling, rising}, (unsigned short)(n + 1), 2}};
    hystgen_plays_t m;
    hystgen_corner_t corner[66];
    int i;
    hystgen_start(&t, &m, corner, &start);
    for (i = 0; i < count; ++i) {
        y[i] = hystgen_plays_step(&t, &m, corner, x[i]);
    }
}
"""


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize(
    "real", [[], [SOFT], ["-DHYSTGEN_REAL_IS_DOUBLE"], ["-DHYSTGEN_FIXED"]], ids=["float", "soft", "double", "fixed"]
)
@pytest.mark.parametrize("dialect", ["-std=c99", "-std=c11", "-x c++ -std=c++17"])
def test_compiles_clean_without_undefined_symbols(compiler: str, real: list[str], dialect: str, tmp_path: Path) -> None:
    flags = WARNINGS if "c++" in dialect else C_WARNINGS
    for level in ("-O0", "-O2"):
        output = tmp_path / "runtime.o"
        source = RUNTIME / "hystgen_runtime.c"
        command = [compiler, *dialect.split(), level, *real, *flags, "-ffp-contract=off", f"-I{RUNTIME}"]
        done = subprocess.run([*command, "-c", source, "-o", output], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        symbols = subprocess.run(["nm", str(output)], capture_output=True, text=True, check=True).stdout
        kinds = {line.split()[-2] for line in symbols.splitlines()}
        assert not kinds & {"U", "D", "d", "B", "b"}, symbols


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> tuple[cffi.FFI, object]:
    folder = tmp_path_factory.mktemp("runtime")
    (folder / "driver.c").write_text(DRIVER)
    compiler = shutil.which("gcc")
    assert compiler
    subprocess.run(
        [compiler, "-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-DHYSTGEN_REAL_IS_DOUBLE",
         f"-I{RUNTIME}", str(folder / "driver.c"), str(RUNTIME / "hystgen_runtime.c"), "-o", str(folder / "driver.so")],
        check=True,
    )  # fmt: skip
    ffi = cffi.FFI()
    ffi.cdef(
        "void loop(const double *, const double *, const double *, const double *, unsigned short, int, const double *,"
        "double *, int); void corners(const double *, double, double, unsigned short, const double *, double *, int);"
    )
    return ffi, ffi.dlopen(str(folder / "driver.so"))


def brute_output(v: np.ndarray, r: np.ndarray, p: np.ndarray) -> np.ndarray:
    s = np.zeros_like(r)
    y = np.empty_like(v)
    for k, x in enumerate(v):
        s = np.maximum(x - r, np.minimum(x + r, s))
        y[k] = p @ s
    return y


@pytest.mark.parametrize("seed", range(30))
def test_engines_are_the_textbook_model_and_its_inverse(library: tuple[cffi.FFI, object], seed: int) -> None:
    ffi, lib = library
    rng = np.random.default_rng(seed)
    n = int(rng.integers(0, 65)) if seed else 0
    r = np.concatenate([[0], np.cumsum(rng.uniform(0.01, 0.3, n))])
    p = rng.uniform(0.05, 1, n + 1)
    c, q = np.cumsum(p), np.cumsum(p * r)
    lift, reciprocal = np.concatenate([[0], q]), np.concatenate([[0], 1 / c])
    walk = np.cumsum(rng.normal(0, 0.3, 3000))
    turns = np.interp(np.linspace(0, 300, 3000), np.arange(301), rng.uniform(-1, 1, 301)) * (r[-1] + 1)
    v = np.concatenate([walk, turns, np.repeat(rng.uniform(-2, 2, 200), 3)])
    never = np.array([[1e300, 1e300, 0, 0]])

    def pointer(a: np.ndarray) -> object:
        return ffi.cast("double *", a.ctypes.data)

    def run(loop: int, invert: int, x: np.ndarray) -> np.ndarray:
        y = np.empty_like(x)
        if loop:
            lib.loop(*map(pointer, (r, p, lift, reciprocal)), n, invert, pointer(x), pointer(y), len(x))
            return y
        drive, output = 2 * r, 2 * (r * c - q)
        columns = (output, drive, 1 / c, c) if invert else (drive, output, c, 1 / c)
        segments = np.concatenate([np.column_stack(columns), never])
        bottom = -q[-1] if invert else q[-1] / c[-1]
        lib.corners(pointer(segments), bottom, bottom, n, pointer(x), pointer(y), len(x))
        return y

    y = brute_output(v, r, p)
    scale = np.max(np.abs(y))
    for engine in (0, 1):
        np.testing.assert_allclose(run(engine, 0, v), y, rtol=0, atol=1e-13 * scale)
        drive = run(engine, 1, y)
        np.testing.assert_allclose(brute_output(drive, r, p), y, rtol=0, atol=1e-13 * scale)


@pytest.mark.slow(one_in=3)
@pytest.mark.parametrize("unit", units.UNITS, ids=map("-".join, units.UNITS))
def test_operators_as_they_stand_give_the_bits_of_the_reference(unit: tuple[str, str, str], tmp_path: Path) -> None:
    """gcc and clang compile the files without warnings, with nothing renamed and nothing left out; engine corners in
    float32 also as for a core without FPU."""
    name, arithmetic, engine = unit
    source = units.write(tmp_path, *unit)
    flags = ["-std=c99", "-O2", "-fPIC", "-shared", *C_WARNINGS, *units.FLAGS, *units.DEFINES[arithmetic]]
    one, real = units.model(name), ARITHMETICS[arithmetic].number
    numbers = one.tables(arithmetic, engine)
    number = {"f4": "float", "f8": "double", "i4": "int32_t", "i2": "int16_t"}[real.str[1:]]
    records = {}
    for op, record in (("forward", "resets"), ("inverse", "commits")):
        _, call, x = next(c for c in signals.suite(numbers, real, op == "inverse", 2000) if c[0] == record)
        values = x.astype(real).astype(numbers.threshold.dtype)
        records[op] = call, values, reference.answers(numbers, op == "inverse", call, values)
    soft = [("gcc", SOFT)] * (arithmetic == "float32" and engine == "corners")
    for number_of_build, compiler in enumerate((("gcc",), ("clang",), *soft)):
        binary = tmp_path / f"{number_of_build}.so"
        command = [*compiler, *flags, *units.INCLUDES, str(source), "-o", str(binary)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        ffi = cffi.FFI()
        for op in ("forward", "inverse"):
            ffi.cdef(
                f"void hystgen_{op}_init(void *); void hystgen_{op}_reset(void *, {number}); "
                f"{number} hystgen_{op}_step(void *, {number}); unsigned hystgen_{op}_status(void *);"
            )
        ffi.cdef(f"void hystgen_inverse_commit(void *, {number});")
        library = ffi.dlopen(str(binary))
        for op, (call, values, (expected, bits)) in records.items():
            self = ffi.new("double[]", 4096)
            found, status = np.zeros(len(values), real), np.zeros(len(values), np.uint8)
            own = (getattr(library, f"hystgen_{op}_{word}") for word in ("init", "reset", "step", "status"))
            init, reset, step, read = own
            init(self)
            for i, (kind, value) in enumerate(zip(call & slots.OP_CALL, values.tolist(), strict=True)):
                if kind == slots.OP_STEP:
                    found[i] = step(self, value)
                elif kind == slots.OP_COMMIT:
                    library.hystgen_inverse_commit(self, value)
                elif kind == slots.OP_RESET:
                    reset(self, value)
                else:
                    init(self)
                status[i] = 0 if call[i] & slots.OP_UNREAD else read(self)
            assert found.tobytes() == expected.astype(real).tobytes(), (compiler, op)
            assert status.tolist() == bits.tolist(), (compiler, op)


def test_bits_compare_as_their_numbers(tmp_path: Path) -> None:
    """On a core without FPU; NaNs lie beyond all numbers, each on the side of its sign."""
    source = tmp_path / "above.c"
    text = "int above(float a, float b);\nint above(float a, float b) { return hystgen_above(a, b); }\n"
    source.write_text(f'#include "arithmetic/numbers.h"\n{text}')
    command = ["gcc", "-std=c99", "-O2", "-fPIC", "-shared", *C_WARNINGS, SOFT, f"-I{RUNTIME}"]
    subprocess.run([*command, source, "-o", tmp_path / "above.so"], check=True)
    ffi = cffi.FFI()
    ffi.cdef("int above(float, float);")
    above = ffi.dlopen(str(tmp_path / "above.so")).above
    sizes = np.array([0, 1, 2, 0x7FFFFF, 0x800000, 0x3F7FFFFF, 0x3F800000, 0x7F7FFFFF, 0x7F800000], dtype=np.uint32)
    numbers = [float(x) for x in np.concatenate([sizes, sizes | np.uint32(1 << 31)]).view(np.float32)]
    assert [[bool(above(a, b)) for b in numbers] for a in numbers] == [[a > b for b in numbers] for a in numbers]
    assert all(above(np.nan, x) and above(x, -np.nan) for x in numbers)
    assert not any(above(x, np.nan) or above(-np.nan, x) for x in numbers)


def test_every_line_is_in_a_unit() -> None:
    """Each line is also in an analysed unit, of both kinds of arithmetic if it is in units of both."""
    found = set().union(*(units.lines(*unit) for unit in units.ANALYSED))
    for coded in (False, True):
        analysed = set().union(*(units.lines(*unit) for unit in units.ANALYSED if ARITHMETICS[unit[1]].fixed == coded))
        others = [unit for unit in units.UNITS if unit not in units.ANALYSED and ARITHMETICS[unit[1]].fixed == coded]
        assert set().union(*(units.lines(*unit) for unit in others)) - analysed == set()
    whole = {units.RUNTIME / "hystgen_runtime.c", units.EFFECTS / "resonance" / "part.c"}
    memory = {units.RUNTIME / "plays" / f"state_{kind}.h" for kind in ("float", "fixed")}  # of kernels, in all units
    files = [path for path in units.standing() if path.suffix == ".c" or "state" in path.stem.split("_")]
    expected = {
        (units.relative(path), number)
        for path in {*files} - whole - memory
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if not line.startswith("#")
    }
    assert expected - found == set()


def opened(path: Path) -> tuple[list[str | Path], str]:
    """Arguments that compile a file as an editor opens it, and the standard input, which includes a header."""
    if path.suffix == ".c":
        return [path], ""
    return ["-x", "c", "-"], f'#include "{units.relative(path)}"\nextern int unit;\n'


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("path", units.standing(), ids=units.relative)
def test_a_file_compiles_as_it_is_opened(compiler: str, path: Path) -> None:
    source, text = opened(path)
    command = [compiler, "-std=c99", *C_WARNINGS, *units.FLAGS, *units.INCLUDES, "-fsyntax-only", *source]
    done = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("folder", [units.RUNTIME, units.EFFECTS], ids=lambda folder: folder.name)
def test_editors_are_told_how_to_compile(folder: Path) -> None:
    """`compile_flags.txt` has the flags of the test above; clang runs in the folder that has the file."""
    flags = (folder / "compile_flags.txt").read_text(encoding="ascii").split()
    places = {(folder / flag.removeprefix("-I")).resolve() for flag in flags if flag.startswith("-I")}
    assert places == {units.RUNTIME.resolve(), units.EFFECTS.parent.resolve()}
    for path in units.standing():
        if path.is_relative_to(folder) and path.suffix == ".c":
            done = subprocess.run(["clang", *flags, "-fsyntax-only", "-Werror", path], cwd=folder, check=False)
            assert done.returncode == 0, path


@pytest.mark.parametrize("path", units.standing(), ids=units.relative)
def test_a_file_opens_with_a_paragraph(path: Path) -> None:
    """The paragraph says what the file does, and comes before its first line of code."""
    text = path.read_text(encoding="ascii")
    assert re.match(r"/\*(?:[^*]|\*(?!/)){20,}\*/\n", text) or path.name == "part.c"


def types_of_effects() -> str:
    """The header with the types of models with effects, from their declarations; those that are the same class in every
    arithmetic appear once."""
    texts = [{piece.name: piece.text for piece in declarations.pieces(kind)} for kind in ("fixed", "float")]
    found = [
        "/* The types of models with effects, written from the structures in Python that the reference uses:\n"
        "   HYSTGEN_UPDATE_GOLDEN=1 pytest tests/test_runtime.py -k declared */",
        "#ifndef HYSTGEN_CHAIN", "#define HYSTGEN_CHAIN", "#endif", '#include "arithmetic/numbers.h"',
        "#ifndef HYSTGEN_CHAIN_TYPES_H", "#define HYSTGEN_CHAIN_TYPES_H", "",
    ]
    names = dict.fromkeys(name for text in texts for name in text)
    for alike, group in itertools.groupby(names, lambda name: texts[0].get(name) == texts[1].get(name)):
        of_group = list(group)
        if alike:
            found += [texts[0][name] for name in of_group]
        else:
            fixed, floating = ([text[name] for name in of_group if name in text] for text in texts)
            found += ["#ifdef HYSTGEN_FIXED", *fixed, *["#else"] * bool(floating), *floating, "#endif", ""]
    found += ["#if defined(HYSTGEN_N_PLAYS) && !defined(HYSTGEN_CONFIGURED)", *either_operator(), "#endif", ""]
    return "\n".join([*found, "#endif", ""])


def either_operator() -> list[str]:
    """The type of either operator of a model with every effect: the members of both, first those in every engine and
    arithmetic."""
    engines = {engine: (members("q31", engine), members("float32", engine)) for engine in ("corners", "loop")}
    every = [each for sides in engines.values() for each in sides]
    common = {text: None for text in every[0] if all(text in each for each in every)}
    found = ["/* Either operator: the members of both. */", "typedef struct {", *common]
    for condition, sides in zip(("#ifdef HYSTGEN_HAS_CORNERS", "#else"), engines.values(), strict=True):
        alike = [text for text in sides[0] if text in sides[1]]
        own = ([text for text in side if text not in alike] for side in sides)
        found += [condition, *(text for text in alike if text not in common)]
        found += ["#ifdef HYSTGEN_FIXED", *next(own), "#else", *next(own), "#endif"]
    return [*found, "#endif", "} hystgen_operator_t;"]


def members(arithmetic: str, engine: str) -> list[str]:
    """The members of both operators in an engine; in loop, of plays that are bent and of plays that are not."""
    family = replace(runtime.FAMILIES[arithmetic], chain=True)
    form = importlib.import_module(f"hystgen.emission.{family.form}").FORM
    whole = runtime.Variant(
        engine, family, fronts=True, branches=True, chain=True, slew=True, braked=True, quiet=True, turning=True,
        waiting=3, taps=3, elements=2 * (engine == "loop"),
    )
    moved = [replace(whole, moves="dashpot", bends="centre"), replace(whole, moves="play")]
    variants = [whole] if engine == "corners" else moved
    fields = [runtime.Field("braked_t", "braked_1"), runtime.Field("ageing_t", "ageing_1")]
    fields += [each for t in variants for op in runtime.OPERATORS for each in chain.instance(op, t, (), form, 6)]
    return [each.text() for each in {each.name: each for each in reversed(fields)}.values()][::-1]


def test_the_header_of_types_is_what_is_declared() -> None:
    """It is for editors; emission writes the same declarations."""
    path = RUNTIME / runtime.CHAIN_TYPES
    if os.environ.get("HYSTGEN_UPDATE_GOLDEN"):
        path.write_text(types_of_effects(), encoding="ascii")
        subprocess.run([Path(sys.executable).with_name("clang-format"), "-i", path], check=True)
    assert path.read_text(encoding="ascii").split() == types_of_effects().split()


FORMS = """#ifndef HYSTGEN_A_C
#ifdef HYSTGEN_FIXED
fixed
#ifdef HYSTGEN_SOFT_FLOAT
soft
#else
hard
#endif
#elif defined(HYSTGEN_HAS_DELAY) && !defined(HYSTGEN_CHAIN)
delayed
#else
plain
#ifndef HYSTGEN_HAS_DELAY
at once
#endif
#endif
#endif
"""


@pytest.mark.parametrize(("facts", "kept"), [
    (["FIXED"], ["fixed", "#ifdef HYSTGEN_SOFT_FLOAT", "soft", "#else", "hard", "#endif"]),
    (["FIXED", "HAS_DELAY"], ["fixed", "#ifdef HYSTGEN_SOFT_FLOAT", "soft", "#else", "hard", "#endif"]),
    (["HAS_DELAY"], ["delayed"]),
    (["HAS_DELAY", "CHAIN"], ["plain"]),
    ([], ["plain", "at once"]),
])  # fmt: skip
def test_conditions_on_facts_choose_and_others_stay(facts: list[str], kept: list[str]) -> None:
    found = runtime.chosen(FORMS, {f"HYSTGEN_{fact}" for fact in facts})
    assert found.splitlines() == ["#ifndef HYSTGEN_A_C", *kept, "#endif"]


@pytest.mark.parametrize(("name", "arithmetic"), [("everything", "q31"), ("plain", "float64")])
def test_neither_facts_nor_the_default_model_are_emitted(name: str, arithmetic: str) -> None:
    for layout in ("self-contained", "shared-runtime"):
        files = emitted_files(units.model(name), operator="both", arithmetic=arithmetic, layout=layout)
        macros = {macro for text in files.values() for macro in re.findall(r"\bHYSTGEN_\w+", text)}
        assert macros
        assert not {macro for macro in macros if runtime.FACTS.fullmatch(macro) or macro == "HYSTGEN_CONFIGURED"}


def test_functions_of_engine_loop_have_one_name_in_c_and_python() -> None:
    """Functions that both operators share have a prefix only in C; Python has no status function, as a run reads it."""
    modules = (loop, fixed, step, step_float, step_fixed, chain_step, chain_step_float, chain_step_fixed)
    trees = (ast.parse(Path(module.__file__).read_text(encoding="utf-8")) for module in modules)
    own = {node.name for tree in trees for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    steps = [RUNTIME / "compensator" / "drive.c", *(RUNTIME / "compensator" / "chain").glob("chain*.c")]
    texts = [path.read_text() for path in (*RUNTIME.rglob("loop*.c"), *steps)]
    written = {piece.name.removeprefix("hystgen_") for text in texts for piece in runtime.split_pieces(text)}
    names = {re.sub("^operator_", f"{op}_", name) for name in written for op in runtime.OPERATORS}
    assert len(names) > 20
    start = {"loop_init"}  # in two C files, of which one is chosen; Python asks how long the list is
    parts = {"played", "passed_on", "next", "limited", "wanted"}  # of a step: inline in Python, calls in C for stack
    others = {re.sub("^(forward|inverse)_", "", n) for n in names if n not in own}
    assert others - own == start | parts
