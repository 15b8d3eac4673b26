"""tanh and atanh: C and Python agree bit for bit, and are as close to the true value as they claim."""

from __future__ import annotations

import functools
import importlib.util
import itertools
import math
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import cffi
import mpmath as mp
import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hystgen.front.tanh import kernels

pytestmark = pytest.mark.thorough

RUNTIME = Path(__file__).resolve().parent.parent / "c_runtime"
COMPILERS = ("gcc", "clang", "zig")
FORMATS = ("float32", "float64")
KERNELS = ("tanh", "atanh")
SUFFIX = {"float32": "f32", "float64": "f64"}
CTYPE = {"float32": "float", "float64": "double"}
BITS = {"float32": np.uint32, "float64": np.uint64}
MAX_ULP = {"tanh": kernels.TANH_MAX_ULP, "atanh": kernels.ATANH_MAX_ULP}
TABLES = {"tanh": kernels.TANH_TABLES, "atanh": kernels.ATANH_TABLES}
WARNINGS = ["-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Wsign-conversion", "-Wdouble-promotion", "-Wshadow"]
WARNINGS += ["-Wundef", "-Wcast-qual", "-Wvla", "-Werror"]
C_WARNINGS = ["-Wmissing-prototypes", "-Wstrict-prototypes"]

DRIVER = """
#include <stddef.h>
#include "hystgen_runtime.h"
void apply_tanh(const hystgen_real_t *x, hystgen_real_t *y, size_t n);
void apply_atanh(const hystgen_real_t *x, hystgen_real_t *y, size_t n);
void apply_tanh(const hystgen_real_t *x, hystgen_real_t *y, size_t n)
{
    for (size_t i = 0; i < n; ++i) { y[i] = hystgen_tanh(x[i]); }
}
void apply_atanh(const hystgen_real_t *x, hystgen_real_t *y, size_t n)
{
    for (size_t i = 0; i < n; ++i) { y[i] = hystgen_atanh(x[i]); }
}
"""

# 2^20 bit patterns spread over the format, infinities and NaN among them; the process dies on undefined behaviour
TRAP_MAIN = """
#include <string.h>
#include "hystgen_runtime.h"
int main(void)
{
    volatile hystgen_real_t sink;
    for (unsigned long i = 0; i < 1ul << 20; ++i) {
        const BITS pattern = ((BITS)i << (8 * sizeof(BITS) - 20)) + (BITS)i;
        hystgen_real_t x;
        memcpy(&x, &pattern, sizeof x);
        sink = hystgen_tanh(x);
        sink = hystgen_atanh(x);
    }
    (void)sink;
    return 0;
}
"""


def command(compiler: str, language: str = "c") -> list[str]:
    """Command of a compiler; if it is missing, the test fails in CI and is skipped elsewhere."""
    names = {"gcc": ("gcc", "g++"), "clang": ("clang", "clang++")}
    if compiler == "zig":
        if importlib.util.find_spec("ziglang"):
            return [sys.executable, "-m", "ziglang", "cc" if language == "c" else "c++"]
    else:
        path = shutil.which(names[compiler][language != "c"])
        if path:
            return [path]
    if os.environ.get("CI") == "true":
        pytest.fail(f"{compiler} is missing, and CI must have it")
    pytest.skip(f"{compiler} is not here")


def any_compiler() -> str:
    """The first compiler that is present."""
    present = [c for c in COMPILERS if (shutil.which(c) if c != "zig" else importlib.util.find_spec("ziglang"))]
    return present[0] if present else COMPILERS[0]


def real_flags(name: str) -> list[str]:
    return ["-DHYSTGEN_REAL_IS_DOUBLE"] if name == "float64" else []


def run(arguments: list[str]) -> str:
    done = subprocess.run(arguments, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{' '.join(arguments)}\n{done.stderr}"
    return done.stdout


def source(kernel: str, name: str) -> Path:
    return RUNTIME / "front" / f"{kernel}_{SUFFIX[name]}.c"


@pytest.fixture(scope="session")
def c_kernels(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., SimpleNamespace]:
    """build(compiler, format, optimisation): array functions `tanh(x)` and `atanh(x)` made of the C kernels."""
    folder = tmp_path_factory.mktemp("kernels")
    (folder / "driver.c").write_text(DRIVER)

    @functools.cache
    def build(compiler: str, name: str, optimisation: str = "-O2") -> SimpleNamespace:
        library = folder / f"{compiler}_{name}_{optimisation[1:]}.so"
        flags = ["-std=c99", optimisation, "-ffp-contract=off", "-fPIC", "-shared", f"-I{RUNTIME}", *real_flags(name)]
        if compiler == "zig":
            flags.append("-fno-sanitize=undefined")  # zig adds the sanitizer to -O0
        files = [str(folder / "driver.c"), *(str(source(kernel, name)) for kernel in KERNELS)]
        run([*command(compiler), *flags, *files, "-o", str(library)])
        ffi = cffi.FFI()
        for kernel in KERNELS:
            ffi.cdef(f"void apply_{kernel}(const {CTYPE[name]} *x, {CTYPE[name]} *y, size_t n);")
        shared = ffi.dlopen(str(library))

        def apply(kernel: str, x: np.ndarray) -> np.ndarray:
            y = np.empty_like(x)
            pointer = f"{CTYPE[name]}[]"
            getattr(shared, f"apply_{kernel}")(ffi.from_buffer(pointer, x), ffi.from_buffer(pointer, y), len(x))
            return y

        return SimpleNamespace(**{kernel: functools.partial(apply, kernel) for kernel in KERNELS})

    return build


@functools.cache
def compiled(kernel: str) -> SimpleNamespace:
    """Loops over the Python kernel, compiled by numba."""
    one = numba.njit(getattr(kernels, kernel).py_func)
    true = math.tanh if kernel == "tanh" else math.atanh

    @numba.njit(nogil=True)
    def apply(x: np.ndarray, t: Any, out: np.ndarray) -> None:
        for n in range(x.size):
            out[n] = one(x[n], t)

    @numba.njit(nogil=True)
    def judge(x: np.ndarray, y: np.ndarray, t: Any) -> tuple[float, int, int, int]:
        """For rising x >= 0 and y from C: worst error in ulp of the true value, and how often Python differs from C,
        y falls, and f(-x) is not -f(x)."""
        worst = 0.0
        differs = falls = uneven = 0
        exact = np.empty(1, np.float64)
        bits = exact.view(np.int64)
        for n in range(x.size):
            if one(x[n], t) != y[n]:
                differs += 1
            if one(-x[n], t) != -y[n]:
                uneven += 1
            if n > 0 and y[n] < y[n - 1]:
                falls += 1
            exact[0] = true(np.float64(x[n]))
            error = abs(np.float64(y[n]) - exact[0])
            if error > 0.0:
                exponent = max((bits[0] >> 52) - 1023, -126)
                bits[0] = (23 - exponent + 1023) << 52  # 1 / ulp
                worst = max(worst, error * exact[0])
        return worst, differs, falls, uneven

    return SimpleNamespace(apply=apply, judge=judge)


def numba_values(kernel: str, x: np.ndarray) -> np.ndarray:
    """The kernel in Python, compiled."""
    y = np.empty_like(x)
    compiled(kernel).apply(x, TABLES[kernel][x.dtype.name], y)
    return y


@functools.cache
def all_kinds(name: str) -> np.ndarray:
    """Arguments of every exponent and both signs, zeros, infinities and NaN, and dense where the kernels branch."""
    rng = np.random.default_rng(20240521)
    if name == "float32":
        patterns = np.arange(0, 1 << 32, 2111, dtype=np.uint64).astype(np.uint32)
    else:
        patterns = rng.integers(0, 1 << 64, 1_000_000, dtype=np.uint64, endpoint=False)
    dtype = np.dtype(name).type
    edges = []
    for kernel in KERNELS:
        t = TABLES[kernel][np.dtype(dtype).name]
        edges += [*t.bound, *t.center, *(t.knot if kernel == "tanh" else t.offset), dtype(1)]
    edges += [dtype(1) - dtype(2.0**-k) for k in range(1, 54)]
    near = np.array(edges, dtype=dtype).view(BITS[name])[:, None] + np.arange(-50, 51).astype(BITS[name])
    uniform = np.concatenate([rng.uniform(-20, 20, 200_000), rng.uniform(-1, 1, 200_000)]).astype(dtype)
    below_one = (1 - np.exp2(-rng.uniform(0, 53, 200_000))).astype(dtype)
    special = np.array([0.0, -0.0, np.inf, -np.inf, np.nan], dtype)
    return np.concatenate([patterns.view(dtype), near.ravel().view(dtype), uniform, below_one, special])


@functools.cache
def python_values(kernel: str, name: str) -> np.ndarray:
    return numba_values(kernel, all_kinds(name))


def assert_same_bits(x: np.ndarray, one: np.ndarray, other: np.ndarray) -> None:
    bits = BITS[x.dtype.name]
    differ = np.flatnonzero(one.view(bits) != other.view(bits))
    assert not differ.size, f"{differ.size} differ, first at {x[differ[0]]!r}: {one[differ[0]]!r}, {other[differ[0]]!r}"


# --- C and Python -----------------------------------------------------------------------------------------------------


@pytest.mark.slow(one_in=2)
@pytest.mark.parametrize("optimisation", ["-O0", "-O2", "-O3"])
@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("name", FORMATS)
def test_c_equals_compiled_python_bit_for_bit(
    c_kernels: Callable[..., SimpleNamespace], name: str, compiler: str, optimisation: str
) -> None:
    x = all_kinds(name)
    assert len(x) >= {"float32": 2_000_000, "float64": 1_000_000}[name]
    c = c_kernels(compiler, name, optimisation)
    for kernel in KERNELS:
        assert_same_bits(x, getattr(c, kernel)(x), python_values(kernel, name))


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("name", FORMATS)
def test_plain_python_equals_c_bit_for_bit(
    c_kernels: Callable[..., SimpleNamespace], name: str, kernel: str
) -> None:
    x = all_kinds(name)
    x = np.concatenate([x[:: len(x) // 4000], x[-5:]])
    t = TABLES[kernel][name]
    plain = [getattr(kernels, kernel).py_func(v, t) for v in x]
    assert all(type(v) is x.dtype.type for v in plain)
    assert_same_bits(x, getattr(c_kernels(any_compiler(), name), kernel)(x), np.array(plain, x.dtype))


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("kernel", KERNELS)
def test_numba_keeps_the_format(kernel: str, name: str) -> None:
    function = numba.njit(getattr(kernels, kernel).py_func)
    function(np.dtype(name).type(0.3), TABLES[kernel][name])
    assert [str(s.return_type) for s in function.nopython_signatures] == [name]


# --- accuracy ---------------------------------------------------------------------------------------------------------


def sweep(
    c_kernels: Callable[..., SimpleNamespace], kernel: str, stride: int, block: int = 1 << 22
) -> tuple[float, int, int, int]:
    """`judge` over every `stride`-th float32 from 0 to beyond saturation (tanh) or to the last below 1 (atanh)."""
    last = np.float32(9.5) if kernel == "tanh" else np.float32(1) - np.float32(2.0**-24)
    end = int(last.view(np.uint32)) + 1
    c = getattr(c_kernels(any_compiler(), "float32"), kernel)
    t = TABLES[kernel]["float32"]

    def part(start: int) -> tuple[float, int, int, int]:
        stop = min(start + (block + 1) * stride, end)  # one sample is shared with the next block, to compare y
        x = np.arange(start, stop, stride, dtype=np.uint32).view(np.float32)
        return compiled(kernel).judge(x, c(x), t)

    part(0)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        parts = list(pool.map(part, range(0, end, block * stride)))
    worst, *counts = zip(*parts, strict=True)
    return (max(worst), *(sum(count) for count in counts))


@pytest.mark.parametrize("kernel", KERNELS)
def test_float32_error_on_every_983rd_argument(c_kernels: Callable[..., SimpleNamespace], kernel: str) -> None:
    worst, differs, falls, uneven = sweep(c_kernels, kernel, 983, 1 << 16)
    assert (differs, falls, uneven) == (0, 0, 0)
    assert MAX_ULP[kernel]["float32"] / 2 < worst <= MAX_ULP[kernel]["float32"]


@pytest.mark.slow
@pytest.mark.parametrize("kernel", KERNELS)
def test_float32_error_on_every_argument(c_kernels: Callable[..., SimpleNamespace], kernel: str) -> None:
    """On every argument, C equals Python, and f never falls and is odd; the stated error is reached."""
    worst, differs, falls, uneven = sweep(c_kernels, kernel, 1)
    assert (differs, falls, uneven) == (0, 0, 0)
    assert MAX_ULP[kernel]["float32"] - 0.02 <= worst <= MAX_ULP[kernel]["float32"]


def float64_arguments(kernel: str) -> Iterator[float]:
    """More than 20 000 positive arguments: where the kernel branches, near 1/2 and 1, tiny, and spread out."""
    rng = np.random.default_rng(7)
    t = TABLES[kernel]["float64"]
    # the worst of about 10^9 random arguments
    yield {"tanh": 0.55080469212778527, "atanh": 0.7501587944095236}[kernel]
    if kernel == "tanh":
        for edge in [*t.knot, *t.bound, 0.5493061443340549]:
            yield from (edge * (1 + n * 2.0**-52) for n in range(-40, 41))
        yield from rng.uniform(0, 20, 6000)
        yield from rng.uniform(0.5, 0.7, 6000)
        yield from np.exp(rng.uniform(np.log(1e-9), 0, 6000))
    else:
        for edge in [0.5, *(0.5 + n / 16 for n in range(1, 8)), *(1 - 2.0**-k for k in range(2, 50))]:
            yield from (edge * (1 + n * 2.0**-52) for n in range(-20, 21))
        yield from (1 - n * 2.0**-53 for n in range(1, 500))
        yield from rng.uniform(0, 1, 5000)
        yield from rng.uniform(0.74, 0.78, 5000)
        yield from np.exp(rng.uniform(np.log(1e-9), 0, 5000))
        yield from 1 - np.exp2(-rng.uniform(1, 52, 5000))
    yield from np.exp2(rng.uniform(-1074, -20, 3000))


@pytest.mark.parametrize("kernel", KERNELS)
def test_float64_error(c_kernels: Callable[..., SimpleNamespace], kernel: str) -> None:
    x = np.fromiter(float64_arguments(kernel), float)
    x = x if kernel == "tanh" else x[x < 1]
    assert len(x) >= 20_000
    y = getattr(c_kernels(any_compiler(), "float64"), kernel)(x)
    with mp.workprec(140):
        true = [getattr(mp, kernel)(mp.mpf(v)) for v in x.tolist()]
        ulp = [mp.ldexp(1, max(mp.frexp(v)[1] - 53, -1074)) for v in true]
        worst = max(float(abs(v - w) / u) for v, w, u in zip(y.tolist(), true, ulp, strict=True))
    assert MAX_ULP[kernel]["float64"] - 0.05 <= worst <= MAX_ULP[kernel]["float64"]


# --- properties -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("name", FORMATS)
def test_odd(name: str, kernel: str) -> None:
    x = all_kinds(name)
    x = x[~np.isnan(x)]
    assert_same_bits(x, numba_values(kernel, -x), -numba_values(kernel, x))


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("name", FORMATS)
def test_zero_and_subnormal_arguments_come_back(name: str, kernel: str) -> None:
    info = np.finfo(name)
    subnormal = np.array([info.smallest_subnormal * n for n in (1, 2, 3, 1000, 65537)], name)
    x = np.concatenate([np.array([0.0, info.tiny, info.tiny * 1024], name), subnormal])
    x = np.concatenate([x, -x])
    assert_same_bits(x, numba_values(kernel, x), x)


@pytest.mark.parametrize("name", FORMATS)
def test_tanh_saturates_where_it_rounds_to_one(name: str) -> None:
    t = kernels.TANH_TABLES[name]
    last = t.bound[1]
    x = np.array([last, last * 2, np.finfo(name).max, np.inf], name)
    assert numba_values("tanh", x).tolist() == [1.0] * 4
    assert numba_values("tanh", -x).tolist() == [-1.0] * 4
    x = np.linspace(0, 2 * last, 100_001).astype(name)
    assert numba_values("tanh", x).max() == 1.0


@pytest.mark.parametrize("name", FORMATS)
def test_atanh_is_finite_outside_its_domain(name: str) -> None:
    x = np.array([1.0, 1.5, 1e30, np.finfo(name).max, np.inf], name)
    last = numba_values("atanh", np.nextafter(np.array([1], name), np.array([0], name)))
    assert np.isfinite(last).all()
    assert set(numba_values("atanh", x).tolist()) == set(last.tolist())
    assert set(numba_values("atanh", -x).tolist()) == set((-last).tolist())
    assert np.isfinite(numba_values("atanh", np.array([np.nan], name))).all()


@given(st.floats(min_value=-30, max_value=30), st.integers(min_value=1, max_value=10**6))
def test_float64_never_falls(x: float, ulps: int) -> None:
    for kernel, start in (("tanh", x), ("atanh", math.tanh(x))):
        if abs(start) < 1:
            step = ulps * math.ulp(start)
            t = TABLES[kernel]["float64"]
            function = getattr(kernels, kernel).py_func
            assert function(np.float64(start), t) <= function(np.float64(start + step), t)


# --- numbers ----------------------------------------------------------------------------------------------------------


@functools.cache
def fit_coefficients() -> ModuleType:
    spec = importlib.util.spec_from_file_location("fit_coefficients", RUNTIME / "front" / "fit_coefficients.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("name", FORMATS)
def test_python_tables_are_those_of_the_fit(name: str, kernel: str) -> None:
    fitted = getattr(fit_coefficients(), f"{kernel}_tables")(name)
    tables = TABLES[kernel][name]._asdict()
    assert set(tables) - set(fitted) <= {"one", "power", "number"}
    for key, values in fitted.items():
        assert tables[key].dtype == name
        assert tables[key].tolist() == values, key


def text_of(value: Any) -> str:
    return f"{value!s}f" if value.dtype == np.float32 else repr(float(value))


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("name", FORMATS)
def test_literals_in_c_are_those_of_python(name: str, kernel: str) -> None:
    text = re.sub(r"/\*.*?\*/", "", source(kernel, name).read_text(), flags=re.DOTALL)
    tables = TABLES[kernel][name]
    number = r"(?<![\w.])-?\d+\.\d*(?:e[+-]?\d+)?f?(?![\w.])|(?<![\w.])-?\d+e[+-]?\d+f?(?![\w.])"
    found = re.findall(rf"const hystgen_real_t hystgen_{kernel}_(\w+)((?:\[\d+\])+) = \{{(.*?)\}};", text, re.DOTALL)
    arrays = {key: re.findall(number, body) for key, _, body in found}
    for key, sizes, body in found:
        assert arrays[key] == [text_of(v) for v in getattr(tables, key)]
        assert math.prod(int(n) for n in re.findall(r"\d+", sizes)) == len(arrays[key])
        assert not re.sub(rf"{number}|[\s{{}},]", "", body)
    inline = set(re.findall(number, text.partition("HYSTGEN_API")[2]))
    real = np.dtype(name).type
    scale = {"float32": real(2.0**24), "float64": real(2.0**53)}[name]
    expected = {text_of(v) for v in (real(0), real(1), *tables.bound)}
    if kernel == "atanh":
        expected |= {text_of(tables.half_log2[0]), repr(float(scale)) + ("f" if name == "float32" else "")}
    assert inline == expected
    left = {key for key in tables._fields if key not in arrays}
    assert left == {"bound", "one"} | (set() if kernel == "tanh" else {"half_log2", "power", "number"})


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("name", FORMATS)
def test_stated_error_is_no_more_than_rounding_can_do(name: str, kernel: str) -> None:
    """The stated error is the bound rounded up in float64, and in float32 the error reached, which the bound covers."""
    bound = getattr(fit_coefficients(), f"{kernel}_error")(name)
    stated = MAX_ULP[kernel][name]
    if name == "float64":
        assert stated - 0.02 < bound <= stated
    else:
        assert stated - 0.01 < bound < stated + 0.1


# --- the C text -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("standard", ["c99", "c11", "c++17"])
@pytest.mark.parametrize("compiler", COMPILERS)
def test_compiles_without_a_warning(tmp_path: Path, compiler: str, standard: str) -> None:
    language = "c++" if standard.startswith("c++") else "c"
    flags = [f"-std={standard}", "-x", language, "-O2", *WARNINGS, *(C_WARNINGS if language == "c" else [])]
    for name, kernel in itertools.product(FORMATS, KERNELS):
        where = ["-c", str(source(kernel, name)), f"-I{RUNTIME}", "-o", str(tmp_path / "k.o")]
        run([*command(compiler, language), *flags, *real_flags(name), *where])


@pytest.mark.parametrize("optimisation", ["-O0", "-O2", "-O3", "-Os"])
@pytest.mark.parametrize("compiler", COMPILERS)
def test_needs_no_other_symbol(tmp_path: Path, compiler: str, optimisation: str) -> None:
    symbols = shutil.which("nm")
    if not symbols:
        if os.environ.get("CI") == "true":
            pytest.fail("nm is missing, and CI must have it")
        pytest.skip("nm is not here")
    sanitize = ["-fno-sanitize=undefined"] if compiler == "zig" else []
    for name, kernel in itertools.product(FORMATS, KERNELS):
        out = str(tmp_path / f"{kernel}.o")
        where = ["-c", str(source(kernel, name)), f"-I{RUNTIME}", "-o", out]
        run([*command(compiler), "-std=c99", optimisation, *sanitize, *real_flags(name), *where])
        lines = run([symbols, out]).split("\n")
        assert [line for line in lines if " U " in line] == []
        assert [line.split()[-1] for line in lines if " T " in line] == [f"hystgen_{kernel}"]


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("name", FORMATS)
def test_no_argument_leads_to_undefined_behaviour(tmp_path: Path, name: str, compiler: str) -> None:
    (tmp_path / "main.c").write_text(TRAP_MAIN.replace("BITS", f"uint{32 if name == 'float32' else 64}_t"))
    flags = ["-std=c99", "-O1", "-fsanitize=undefined,float-cast-overflow", "-fno-sanitize-recover=all"]
    flags += ["-fsanitize-undefined-trap-on-error" if compiler == "gcc" else "-fsanitize-trap=all"]
    files = [str(tmp_path / "main.c"), *(str(source(kernel, name)) for kernel in KERNELS)]
    out = str(tmp_path / "main")
    run([*command(compiler), *flags, f"-I{RUNTIME}", *real_flags(name), *files, "-o", out])
    run([out])


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("name", FORMATS)
def test_text_can_be_carried_into_other_files(name: str, kernel: str) -> None:
    """The file has only the kernel's own names at file scope, no macro, no division, and no double in float32."""
    _, include, text = source(kernel, name).read_text().partition('#include "hystgen_runtime.h"\n')
    assert include
    code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    assert "#" not in code
    assert "/" not in code
    assert not re.search(r"\b(?:union|memcpy|fma\w*|double|float)\b", code)
    assert code.count("HYSTGEN_API") == 1
    assert f"\nHYSTGEN_API hystgen_real_t hystgen_{kernel}(hystgen_real_t x) {{\n" in code
    scope = re.findall(r"^\S.*?(\w+)(?:\[\d+\])*(?: = \{.*|\(\w+ [xm]\) \{)$", code, re.MULTILINE)
    assert all(v == f"hystgen_{kernel}" or v.startswith(f"hystgen_{kernel}_") for v in scope)
    assert len(scope) == len(re.findall(r"^\w", code, re.MULTILINE))
    assert all(v.startswith(f"hystgen_{kernel}") or v == "hystgen_real_t" for v in re.findall(r"hystgen_\w+", code))


@pytest.mark.parametrize(("name", "limit"), [("float32", 310), ("float64", 1250)])
@pytest.mark.parametrize("kernel", KERNELS)
def test_tables_stay_small(kernel: str, name: str, limit: int) -> None:
    sizes = re.findall(r"hystgen_real_t hystgen_\w+?((?:\[\d+\])+) = ", source(kernel, name).read_text())
    numbers = sum(math.prod(int(n) for n in re.findall(r"\d+", size)) for size in sizes)
    assert numbers * np.dtype(name).itemsize <= limit
