"""Emit, compile, run, compare."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

from hystgen.arithmetic import ARITHMETICS
from hystgen.basics import arguments, writing
from hystgen.emission import module
from hystgen.emission.calls import emit_options, emitted_model
from hystgen.model import ModelSource, as_model
from hystgen.parameters.files import parameters_sha256
from hystgen.verification import avr, cores, host, sources
from hystgen.verification.comparison import (
    Expected,
    ExpectedCodes,
    ExpectedHealth,
    expected_codes,
    expected_health,
    expected_records,
)
from hystgen.verification.report import Report, Row
from hystgen.verification.targets import AVR, HOST, Board, find

CODES = 3_000
"""[samples] Maximum number of steps from code to code; the reference takes about 0.1 ms for each."""

WINDOWS = 12
"""[windows] Least number of windows over which the watch over the model's error is compared."""


@arguments.checked
def verify(
    source: ModelSource,
    arithmetic: str | None = None,
    operator: str | None = None,
    engine: str | None = None,
    layout: str = "self-contained",
    compiler: Sequence[str] = (),
    targets: Sequence[str] = (HOST,),
    length: int = 100_000,
    target_length: int | None = None,
    optimize: str | None = None,
    allow_partial: bool = False,
    health: bool = False,
    tables: str = "constant",
    progress: Callable[[str], None] = lambda _: None,
) -> Report:
    """Compile what `emit` would write and compare it, bit for bit, with the Python reference of the same arithmetic.

    `source`: a model, a parameter file, or a result of `identify` or `diagnose`. On the host it uses every compiler
    that is installed (or those named in `compiler`: 'gcc', 'clang', 'zig'), each under the strict flags and under its
    own default dialect, over records of `length` calls. On the cores of `verification.targets` it uses zig and, if
    installed, Debian's cross gcc, emulated, over records of `target_length` calls (default: as many as the speed of
    that core allows), and counts the instructions of every sample. On the AVR only the emitted self-test runs. Names
    given twice are used once. A requested tool that is missing on this machine gives a row marked `missing`.
    With `health` the watch over the model's error is compared too, on the host.
    `hystgen.verification.Reports` joins the reports of several models. Raises what `emit` raises, and ValueError for a
    target that does not exist.

    >>> import hystgen
    >>> model = hystgen.load("examples/note/example_1.yaml")
    >>> report = hystgen.verify(model, arithmetic="q15", length=1000)
    >>> report.ok
    True
    """
    compiler = tuple(dict.fromkeys(arguments.words("compiler", compiler, "gcc")))
    targets = tuple(dict.fromkeys(arguments.words("targets", targets, HOST)))
    arguments.whole("length", length, "calls", 1)
    if target_length is not None:
        arguments.whole("target_length", target_length, "calls", 1)
    model = as_model(source)
    options = emit_options(
        model, operator, arithmetic, engine, layout, optimize, allow_partial, health=health, tables=tables
    )
    parameters = parameters_sha256(model.parameters)
    model = emitted_model(model, options)
    numbers = model.tables(options.arithmetic, options.engine, options.operator)
    real = ARITHMETICS[options.arithmetic].number
    known = {HOST: None, AVR.name: AVR}
    chosen = [known[name] if name in known else find(name) for name in targets]

    @functools.cache
    def records(length: int, op: str) -> list[Expected]:
        progress(f"reference, {op}")
        return expected_records(numbers, real, op == "inverse", length)

    @functools.cache
    def codes() -> ExpectedCodes | None:
        conversion = model.conversion(options.arithmetic, options.engine) if options.inverse else None
        return None if conversion is None else expected_codes(numbers, real, conversion, min(length, CODES))

    @functools.cache
    def watched(length: int) -> ExpectedHealth | None:
        if not health:
            return None
        watch = model.watch(options.arithmetic, options.engine, bool(options.left_out))
        lsb = model.units_per_code(options.arithmetic, options.engine)[1] if real.kind == "i" else 1.0
        return expected_health(real, watch, lsb, max(length, WINDOWS * watch.band.window))

    with writing.temporary() as folder:
        written = sources.write(folder, model, options, parameters)
        sha256 = {"parameters": parameters, **written.sha256}
        report = Report(model.name, options.arithmetic, options.engine, options.layout, sha256=sha256)
        for target in chosen:
            begun = time.perf_counter()
            if target is None:
                wanted = functools.partial(records, length)
                found = host.rows(written, wanted, real, compiler, folder, progress, codes(), watched(length))
                report.rows.extend(_timed(begun, found))
            elif isinstance(target, Board):
                memory = module.of(model, options).cost.avr
                size = None if memory is None else avr.Size(model.cascade.pi.n, memory)
                report.rows.extend(_timed(begun, avr.rows(target, written, size, compiler, folder, progress)))
            else:
                wanted = functools.partial(records, target_length or target.calls)
                checked = watched(target_length or target.calls)
                found = cores.rows(target, written, wanted, compiler, folder, progress, checked)
                report.rows.extend(_timed(begun, found))
    return report


def _timed(begun: float, rows: Iterable[Row]) -> Iterator[Row]:
    """The rows with the time that each took, the first one since `begun`."""
    for row in rows:
        now = time.perf_counter()
        yield replace(row, seconds=now - begun)
        begun = now
