"""Emit, compile, run, compare."""

from __future__ import annotations

import json
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cffi
import numpy as np
from numpy.typing import NDArray

from hystgen import compiled, reference
from hystgen.api import Model, emit_options
from hystgen.emission import files, module, runtime
from hystgen.fixed import FixedTables
from hystgen.verification import compilers, signals

HOST = "host"
BUILDS = (("strict", compilers.STRICT), ("defaults", compilers.DEFAULTS))


@dataclass(frozen=True)
class Row:
    """One operator in one build: how many samples were compared and what came out."""

    target: str
    compiler: str
    build: str
    operator: str
    samples: int = 0
    different: int = 0
    max_ulp: float | None = 0.0  # None: an answer is no finite number
    first: str = ""
    ram: int | None = None
    error: str = ""

    @property
    def ok(self) -> bool:
        """Equal bits everywhere."""
        return not self.error and not self.different

    @property
    def _most(self) -> str:
        return "some not finite" if self.max_ulp is None else f"up to {self.max_ulp:.3g} ulp"

    @property
    def verdict(self) -> str:
        """What the table says about it."""
        if self.error:
            return self.error.splitlines()[0]
        return "bits equal" if self.ok else f"{self.different} differ, {self._most}; first: {self.first}"


@dataclass(frozen=True)
class Report:
    """All rows of a verification."""

    name: str
    arithmetic: str
    engine: str
    layout: str
    rows: list[Row] = field(default_factory=list)

    @property
    def ok(self) -> bool:
        """Whether everything that was asked for was built, run and equal."""
        return bool(self.rows) and all(row.ok for row in self.rows)

    def table(self) -> str:
        """A table for people."""
        head = ("target", "compiler", "build", "operator", "samples", "RAM", "result")
        lines = [
            (r.target, r.compiler, r.build, r.operator, str(r.samples), str(r.ram or "-"), r.verdict) for r in self.rows
        ]
        widths = [max(len(line[i]) for line in [head, *lines]) for i in range(len(head))]
        text = ["  ".join(word.ljust(width) for word, width in zip(line, widths, strict=True)).rstrip()
                for line in [head, *lines]]  # fmt: skip
        details = [f"\n{r.target} {r.compiler} {r.build}: {r.error}" for r in self.rows if "\n" in r.error]
        return "\n".join(text + details)

    def to_json(self) -> str:
        """The report for programs."""
        rows = [{**asdict(row), "ok": row.ok} for row in self.rows]
        about = {"name": self.name, "arithmetic": self.arithmetic, "engine": self.engine, "layout": self.layout}
        return json.dumps({"hystgen": 1, **about, "ok": self.ok, "rows": rows}, indent=2) + "\n"

    def to_junit(self) -> str:
        """The report as JUnit XML, one test case a row."""
        failures = sum(not row.ok for row in self.rows)
        suite = ElementTree.Element(
            "testsuite", name=f"hystgen verify {self.name}", tests=str(len(self.rows)), failures=str(failures)
        )
        for row in self.rows:
            where = f"{self.name}.{self.arithmetic}.{self.engine}.{self.layout}"
            case = ElementTree.SubElement(
                suite, "testcase", classname=where, name=f"{row.target} {row.compiler} {row.build} {row.operator}"
            )
            if not row.ok:
                ElementTree.SubElement(case, "failure", message=row.verdict).text = row.error or row.verdict
        return ElementTree.tostring(suite, encoding="unicode") + "\n"


@dataclass(frozen=True)
class _Expected:
    """A record and what the reference makes of it."""

    name: str
    call: NDArray[np.uint8]
    x: NDArray[Any]
    answer: NDArray[Any]
    status: NDArray[np.uint8]


def expected_records(
    numbers: reference.Tables | FixedTables, real: np.dtype[Any], inverse: bool, length: int
) -> list[_Expected]:
    """The verification records of an operator, in numbers of type `real`, with the answers of the bit reference."""
    code = compiled.reference(numbers)
    records = []
    for name, op, values in signals.suite(numbers, real, inverse, length):
        x = values.astype(numbers.threshold.dtype)
        state = reference.new_state(numbers)
        answer, status = np.zeros_like(x), np.zeros(len(x), dtype=np.int64)
        code.init(numbers, state)
        code.run(numbers, state, int(inverse), op, x, answer, status)
        records.append(
            _Expected(name, op.astype(np.uint8), x.astype(real), answer.astype(real), status.astype(np.uint8))
        )
    return records


def _ulps(a: NDArray[Any], b: NDArray[Any]) -> float:
    with np.errstate(all="ignore"):
        distance = np.abs(a.astype(np.longdouble) - b.astype(np.longdouble)) / np.spacing(np.abs(b))
    return float(np.max(np.where(np.isfinite(distance), distance, np.inf), initial=0.0))


class _Library:
    """The compiled harness of a model, called through its C interface."""

    def __init__(self, path: Path, real: str, operators: Sequence[str]) -> None:
        self._ffi = cffi.FFI()
        self._ffi.cdef("int hystgen_harness_selftest(void);")
        for op in operators:
            self._ffi.cdef(
                f"size_t hystgen_harness_{op}_size(void);"
                f"void hystgen_harness_{op}(const unsigned char *call, const {real} *x, {real} *answer,"
                " unsigned char *status, size_t count);"
            )
        self._real = real
        self._lib = self._ffi.dlopen(str(path))

    def selftest(self) -> int:
        return int(self._lib.hystgen_harness_selftest())

    def size(self, op: str) -> int:
        return int(getattr(self._lib, f"hystgen_harness_{op}_size")())

    def run(self, op: str, call: NDArray[np.uint8], x: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.uint8]]:
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

    def close(self) -> None:
        self._ffi.dlclose(self._lib)


def write_sources(folder: Path, model: Model, options: module.Options) -> list[Path]:
    """The emitted files and the harness in `folder`; returns the C files to compile."""
    texts = module.files(model.parameters, model.cascade, options)
    names = [op for op in ("forward", "inverse") if getattr(options, op)]
    calls = {"init": reference.OP_INIT, "reset": reference.OP_RESET, "commit": reference.OP_COMMIT}
    values = SimpleNamespace(
        name=model.name,
        NAME=model.name.upper(),
        single_header=options.layout == "single-header",
        operators=names,
        calls=calls,
    )
    texts["hystgen_harness.c"] = module.render("harness.c.j2", values)
    return [path for path in files.write(folder, texts) if path.suffix == ".c"]


def _check(library: _Library, op: str, records: Sequence[_Expected]) -> tuple[int, int, float | None, str]:
    samples = different = 0
    first = ""
    worst = 0.0
    for record in records:
        answer, status = library.run(op, record.call, record.x)
        bits = np.dtype(f"u{answer.itemsize}")
        wrong = (answer.view(bits) != record.answer.view(bits)) | (status != record.status)
        samples += len(answer)
        different += int(wrong.sum())
        if wrong.any():
            first = first or f"sample {int(np.argmax(wrong))} of {record.name}"
            worst = max(worst, _ulps(answer[wrong], record.answer[wrong]))
    return samples, different, worst if np.isfinite(worst) else None, first


def verify_model(
    model: Model,
    arithmetic: str | None = None,
    operator: str | None = None,
    engine: str | None = None,
    layout: str = "self-contained",
    compiler: Sequence[str] = (),
    targets: Sequence[str] = (HOST,),
    length: int = 100_000,
    progress: Callable[[str], None] = lambda _: None,
) -> Report:
    """Compile what `emit` would write and compare it, bit for bit, with the Python reference of the same arithmetic.

    On the host with every compiler that is installed (or those named in `compiler`: 'gcc', 'clang', 'zig'), each under
    the strict flags and under its own default dialect, over records of `length` calls. A compiler or target that is
    asked for and missing is a failed row. Raises what `emit` raises.
    """
    options = emit_options(model, operator, arithmetic, engine, layout)
    numbers = model.tables(options.arithmetic, options.engine)
    family = runtime.FAMILIES[options.arithmetic]
    real = np.dtype({"float": "f4", "double": "f8", "int32_t": "i4", "int16_t": "i2"}[family.real])
    operators = [op for op in ("forward", "inverse") if getattr(options, op)]
    report = Report(model.name, options.arithmetic, options.engine, options.layout)
    for target in targets:
        if target != HOST:
            report.rows.append(Row(target, "-", "-", "-", error="this version verifies on the host only"))
    if HOST not in targets:
        return report
    chosen = [(name, compilers.find(name)) for name in compiler] or [(c.name, c) for c in compilers.available()]
    if not chosen:
        message = "no C compiler found; install gcc or clang, or: pip install 'hystgen[zig]'"
        report.rows.append(Row(HOST, "-", "-", "-", error=message))
        return report
    progress("reference")
    records = {op: expected_records(numbers, real, op == "inverse", length) for op in operators}
    with tempfile.TemporaryDirectory(prefix="hystgen-verify-") as folder:
        sources = write_sources(Path(folder), model, options)
        for number, (name, found) in enumerate(chosen):
            for build, flags in BUILDS:
                progress(f"{name} {build}")
                if found is None:
                    report.rows.append(Row(HOST, name, build, "-", error=f"{name} is not installed"))
                    continue
                output = Path(folder) / f"{number}-{build}.so"
                try:
                    found.shared_library(sources, output, flags)
                except compilers.CompileError as error:
                    report.rows.append(Row(HOST, name, build, "-", error=str(error)))
                    continue
                library = _Library(output, family.real, operators)
                for op in operators:
                    samples, different, worst, first = _check(library, op, records[op])
                    report.rows.append(
                        Row(HOST, name, build, op, samples, different, worst, first, library.size(op))
                    )
                failed = library.selftest()
                library.close()
                if failed:
                    message = f"{model.name}_selftest() returned {failed}"
                    report.rows.append(Row(HOST, name, build, "selftest", error=message))
    return report
