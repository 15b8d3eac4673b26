"""Verification on this machine: a shared library, called through cffi."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import cffi
import numpy as np
from numpy.typing import NDArray

from hystgen.arithmetic import ARITHMETICS
from hystgen.plays.slots import Bytes
from hystgen.verification import compilers
from hystgen.verification.comparison import (
    Expected,
    ExpectedCodes,
    ExpectedHealth,
    compare,
    compare_codes,
    compare_health,
)
from hystgen.verification.loading import LoadError, load
from hystgen.verification.report import Row, failed, selftest
from hystgen.verification.sources import Sources
from hystgen.verification.targets import HOST

BUILDS = (("strict", compilers.STRICT), ("defaults", compilers.DEFAULTS))
C_TYPES = {each.number: each.c_type for each in ARITHMETICS.values()}


class _Library:
    """The compiled harness of a model, called through its C interface."""

    def __init__(self, path: Path, sources: Sources, dtype: np.dtype[np.number]) -> None:
        self._ffi = cffi.FFI()
        self._real = C_TYPES[dtype]
        self._selftest = f"{sources.name}_selftest"
        self._ffi.cdef(f"int {self._selftest}(void);")
        for op in sources.operators:
            self._ffi.cdef(
                f"size_t hystgen_harness_{op}_size(void);"
                f"void hystgen_harness_{op}(const unsigned char *call, const {self._real} *x, {self._real} *answer,"
                " unsigned char *status, size_t count);"
            )
        if sources.coded:
            self._ffi.cdef(f"void hystgen_harness_codes({', '.join(['void *'] * 6)}, size_t count);")
        if sources.watched:
            self._ffi.cdef(f"void hystgen_harness_health({', '.join(['void *'] * 5)}, size_t count);")
        self._lib = load(path, self._ffi.dlopen)

    def selftest(self) -> int:
        return int(getattr(self._lib, self._selftest)())

    def size(self, op: str) -> int:
        return int(getattr(self._lib, f"hystgen_harness_{op}_size")())

    def run(self, op: str, call: Bytes, x: NDArray[np.number]) -> tuple[NDArray[np.number], Bytes]:
        answer, status = np.empty_like(x), np.empty(len(x), dtype=np.uint8)
        cast = self._ffi.cast
        getattr(self._lib, f"hystgen_harness_{op}")(
            cast("unsigned char *", call.ctypes.data),
            cast(f"{self._real} *", x.ctypes.data),
            cast(f"{self._real} *", answer.ctypes.data),
            cast("unsigned char *", status.ctypes.data),
            len(x),
        )
        return answer, status

    def codes(self, x: NDArray[np.int32]) -> list[NDArray[np.number]]:
        """The harness's results for codes `x`: references, drives, codes of these, codes sent, and status bits."""
        real = next(dtype for dtype, name in C_TYPES.items() if name == self._real)
        kinds = (real, real, np.dtype("int32"), np.dtype("int32"), np.dtype("uint8"))
        found = [np.zeros(len(x), dtype=kind) for kind in kinds]
        self._lib.hystgen_harness_codes(
            *(self._ffi.cast("void *", each.ctypes.data) for each in (x, *found)), len(x)
        )
        return found

    def health(
        self, expected: NDArray[np.number], measured: NDArray[np.number], kinds: Sequence[np.dtype[np.number]]
    ) -> list[NDArray[np.number]]:
        """The harness's results, of these types, for a watch over the model's error."""
        found = [np.zeros(len(expected), dtype=kind) for kind in kinds]
        self._lib.hystgen_harness_health(
            *(self._ffi.cast("void *", each.ctypes.data) for each in (expected, measured, *found)), len(expected)
        )
        return found

    def close(self) -> None:
        self._ffi.dlclose(self._lib)


def rows(
    sources: Sources,
    records: Callable[[str], Sequence[Expected]],
    dtype: np.dtype[np.number],
    compiler: Sequence[str],
    folder: Path,
    progress: Callable[[str], None],
    codes: ExpectedCodes | None = None,
    health: ExpectedHealth | None = None,
) -> Iterator[Row]:
    """One row per operator, compiler and build, one for `codes` of converters and one for the watch over the model's
    error; compilers: the given ones, else all that are installed."""
    chosen = [(name, compilers.find(name)) for name in compiler] or [(c.name, c) for c in compilers.available()]
    if not chosen:
        yield failed(Row(HOST, "-", "-", "-"), compilers.none_found())
        return
    for number, (name, found) in enumerate(chosen):
        for build, flags in BUILDS:
            progress(f"{name} {build}")
            if found is None:
                yield failed(Row(HOST, name, build, "-"), compilers.missing(name))
                continue
            output = folder / f"{number}-{build}.so"
            try:
                found.shared_library(sources.all, output, flags)
                library = _Library(output, sources, dtype)
            except (compilers.CompileError, LoadError) as error:
                yield failed(Row(HOST, name, build, "-"), error)
                continue
            for op in sources.operators:
                outcome = compare(functools.partial(library.run, op), records(op))
                yield Row(HOST, name, build, op, **vars(outcome), ram=library.size(op))
            if codes is not None:
                yield Row(HOST, name, build, "codes", **vars(compare_codes(library.codes, codes)))
            if health is not None:
                yield Row(HOST, name, build, "health", **vars(compare_health(library.health, health)))
            row = selftest(Row(HOST, name, build, "selftest"), sources.name, library.selftest())
            library.close()
            if not row.ok:
                yield row
