"""Verification on a microcontroller core: built for it, run on an emulated one, compared and measured."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from hystgen.verification import compilers, cross, emulator, firmware
from hystgen.verification.comparison import Expected, ExpectedHealth, compare, compare_health
from hystgen.verification.report import Row, failed, selftest
from hystgen.verification.sources import Sources
from hystgen.verification.targets import Target

_fresh = itertools.count()  # zig's cache may answer for an output path that it knows; these are always new


def rows(
    target: Target,
    sources: Sources,
    records: Callable[[str], Sequence[Expected]],
    compiler: Sequence[str],
    folder: Path,
    progress: Callable[[str], None],
    health: ExpectedHealth | None = None,
) -> Iterator[Row]:
    """One row per operator, compiler and build, and one for the watch over the model's error. For a core with an FPU,
    there is also a build without flags, in which compilers may contract a product and a sum, with a row for the
    self-test; if qemu is installed, the self-test also
    runs as a whole firmware.
    """
    try:
        cross.check_wheels()
    except compilers.MissingError as error:
        yield failed(Row(target.name, "-", "-", "-"), error)
        return
    for name in cross.chosen(target, compiler):
        try:
            found = cross.find(target, name)
        except compilers.MissingError as error:
            yield failed(Row(target.name, name, "-", "-"), error)
            continue
        builds = [("strict", compilers.STRICT)] + ([("defaults", compilers.USER)] if target.fpu else [])
        for build, flags in builds:
            progress(f"{target.name}, {name} {build}")
            place = folder / f"{target.name}-{name}-{build}-{next(_fresh)}"
            yield from _emulated(target, found, build, flags, sources, records, place, health)
        machine = firmware.available(target)
        if machine:
            progress(f"{target.name}, {name}, firmware on {machine.name}")
            row = Row(target.name, name, "firmware", "selftest")
            try:
                place = folder / f"firmware-{target.name}-{name}-{next(_fresh)}"
                image = firmware.build(found, target, machine, sources, place, compilers.USER)
                yield selftest(row, sources.name, firmware.run(machine, image))
            except (compilers.CompileError, emulator.EmulatorError) as error:
                yield failed(row, error)


def _emulated(
    target: Target,
    compiler: cross.CrossCompiler,
    build: str,
    flags: Sequence[str],
    sources: Sources,
    records: Callable[[str], Sequence[Expected]],
    folder: Path,
    health: ExpectedHealth | None,
) -> Iterator[Row]:
    try:
        path = compiler.image(sources, folder, flags, cross.MemoryMap(), f"{sources.name}_selftest")
        image = emulator.Image.load(path)
    except compilers.CompileError as error:
        yield failed(Row(target.name, compiler.name, build, "-"), error)
        return
    for op in sources.operators:
        row = Row(target.name, compiler.name, build, op)
        try:
            core = emulator.Core(target, image)
            size = core.call(f"hystgen_harness_{op}_size")
            outcome = compare(functools.partial(core.run, sources.name, op), records(op))
        except (compilers.MissingError, emulator.EmulatorError) as error:
            yield failed(row, error)
            continue
        yield Row(
            target.name,
            compiler.name,
            build,
            op,
            **vars(outcome),
            mean_instructions=round(float(core.counts.mean()), 2),
            max_instructions=int(core.counts.max()),
            flash=image.sections[".module"],
            library=image.sections.get(".library", 0),
            ram=size,
            stack=core.stack,
        )
    if health is not None:
        row = Row(target.name, compiler.name, build, "health")
        try:
            core = emulator.Core(target, image)
            outcome = compare_health(functools.partial(core.health, sources.name), health)
            mean, most = round(float(core.counts.mean()), 2), int(core.counts.max())
            yield replace(row, **vars(outcome), mean_instructions=mean, max_instructions=most)
        except (compilers.MissingError, emulator.EmulatorError) as error:
            yield failed(row, error)
    row = Row(target.name, compiler.name, build, "selftest")
    try:
        row = selftest(row, sources.name, emulator.Core(target, image).call(f"{sources.name}_selftest"))
    except (compilers.MissingError, emulator.EmulatorError) as error:
        row = failed(row, error)
    if build == "defaults" or not row.ok:
        yield row
