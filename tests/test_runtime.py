"""The hand-written C kernels on their own: they compile clean, and the corner list is the textbook model."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import cffi
import numpy as np
import pytest

from hystgen.verification.compilers import C_WARNINGS, WARNINGS

RUNTIME = Path(__file__).resolve().parent.parent / "c_runtime"

DRIVER = """
#include "hystgen_runtime.h"
void drive(const hystgen_real_t *r, const hystgen_real_t *p, const hystgen_real_t *slope, const hystgen_real_t *lift,
           const hystgen_real_t *start_level, const hystgen_real_t *inverse, unsigned short n, int loop, int invert,
           const hystgen_real_t *x, hystgen_real_t *y, int count);
void drive(const hystgen_real_t *r, const hystgen_real_t *p, const hystgen_real_t *slope, const hystgen_real_t *lift,
           const hystgen_real_t *start_level, const hystgen_real_t *inverse, unsigned short n, int loop, int invert,
           const hystgen_real_t *x, hystgen_real_t *y, int count)
{
    hystgen_tables_t t;
    hystgen_memory_t m;
    hystgen_corner_t corner[64];
    hystgen_real_t play[65];
    int i;
    t.threshold = r; t.weight = p; t.slope = slope; t.lift = lift; t.start_level = start_level;
    t.inverse_slope = inverse; t.all_lift = lift[n + 1]; t.n = n;
    hystgen_corners_rest(&t, &m, corner, 0);
    hystgen_loop_rest(&t, play, 0);
    for (i = 0; i < count; ++i) {
        hystgen_real_t w = x[i];
        if (invert) {
            w = loop ? hystgen_loop_solve(&t, play, w) : hystgen_corners_solve(&t, &m, corner, w);
        }
        if (loop) {
            hystgen_loop_absorb(&t, play, w);
        } else {
            hystgen_corners_absorb(&t, &m, corner, w);
        }
        y[i] = invert ? w : loop ? hystgen_loop_output(&t, play) : hystgen_corners_output(&t, &m);
    }
}
"""


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize(
    "real", [[], ["-DHYSTGEN_REAL_IS_DOUBLE"], ["-DHYSTGEN_FIXED"]], ids=["float", "double", "fixed"]
)
@pytest.mark.parametrize("dialect", ["-std=c99", "-std=c11", "-x c++ -std=c++17"])
def test_compiles_clean_without_undefined_symbols(compiler: str, real: list[str], dialect: str, tmp_path: Path) -> None:
    flags = WARNINGS if "c++" in dialect else C_WARNINGS
    for level in ("-O0", "-O2"):
        output = tmp_path / "runtime.o"
        source = RUNTIME / "hystgen_runtime.c"
        command = [compiler, *dialect.split(), level, *real, *flags, "-ffp-contract=off", "-c", str(source)]
        done = subprocess.run([*command, "-o", str(output)], capture_output=True, text=True, check=False)
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
        "void drive(const double *, const double *, const double *, const double *, const double *, const double *,"
        "unsigned short, int, int, const double *, double *, int);"
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
    slope = np.concatenate([[0], np.cumsum(p)])
    lift = np.concatenate([[0], np.cumsum(p * r)])
    z = r * slope[:-1] - lift[:-1]
    inverse = np.concatenate([[0], 1 / slope[1:]])
    walk = np.cumsum(rng.normal(0, 0.3, 3000))
    turns = np.interp(np.linspace(0, 300, 3000), np.arange(301), rng.uniform(-1, 1, 301)) * (r[-1] + 1)
    v = np.concatenate([walk, turns, np.repeat(rng.uniform(-2, 2, 200), 3)])

    def run(loop: int, invert: int, x: np.ndarray) -> np.ndarray:
        y = np.empty_like(x)
        arrays = [ffi.cast("double *", a.ctypes.data) for a in (r, p, slope, lift, z, inverse)]
        signals = [ffi.cast("double *", a.ctypes.data) for a in (x, y)]
        lib.drive(*arrays, n, loop, invert, *signals, len(x))
        return y

    y = brute_output(v, r, p)
    scale = np.max(np.abs(y))
    for loop in (0, 1):
        np.testing.assert_allclose(run(loop, 0, v), y, rtol=0, atol=1e-13 * scale)
        drive = run(loop, 1, y)
        np.testing.assert_allclose(brute_output(drive, r, p), y, rtol=0, atol=1e-13 * scale)
