"""An 8-bit controller: a whole firmware with the self-test, built by Debian's avr-gcc and run by simavr."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hystgen.emission import cost, runtime
from hystgen.verification import compilers
from hystgen.verification.emulator import EmulatorError, program
from hystgen.verification.report import Row, failed, selftest
from hystgen.verification.sources import Sources
from hystgen.verification.targets import Board

SECONDS = 120
HERTZ = "16000000"  # simavr needs a clock; the firmware does not
REPORT = "selftest returned"
STACK = 512  # bytes for the firmware's stack and serial port; with RAM full, two branches in q31 failed below 264
CONSTANTS = (".data", ".rodata")  # both are in RAM, and their initial values in flash


@dataclass(frozen=True)
class Size:
    """The number of plays in a model, and the memory that it is expected to take."""

    plays: int
    memory: cost.MemoryBytes


@dataclass(frozen=True)
class Built:
    """Object files with their sizes in bytes: flash of the module, its constants, an instance of each operator, and RAM
    of module and self-test."""

    objects: tuple[Path, ...]
    flash: int
    constants: int
    instances: int
    with_selftest: int

    @property
    def ram(self) -> int:
        """Bytes of RAM that the module and its instances take."""
        return self.constants + self.instances


def rows(
    board: Board,
    sources: Sources,
    size: Size | None,
    compiler: Sequence[str],
    folder: Path,
    progress: Callable[[str], None],
) -> list[Row]:
    """One row: result of the self-test on the emulated board, and memory of the module. `size`: shows whether the model
    is too large for the board; None if it cannot be built for any board.
    """
    if compiler and "gcc" not in compiler:
        words = f"does not build for {board.name}; use gcc"
        return [
            failed(Row(board.name, each, "-", "-"), compilers.MissingError(f"{each} {words}")) for each in compiler
        ]
    row = Row(board.name, "gcc", "firmware", "selftest")
    missing = [command for command in (board.gcc, board.size, board.simulator) if shutil.which(command) is None]
    if missing:
        return [failed(row, compilers.uninstalled(missing))]
    progress(f"{board.name}, gcc, firmware on {board.simulator}")
    try:
        built = build(board, sources, folder / board.name)
        row = replace(row, flash=built.flash, ram=built.ram)
        if size is not None and max(built.ram, built.with_selftest + STACK) > board.ram:
            return [replace(row, error=_too_large(board, built, size))]
        words = f"RAM includes the {built.constants} bytes of constants, which are in RAM on an AVR"
        row = replace(row, note=f"{words}, and an instance of each operator")
        result = run(board, link(board, sources, built.objects, folder / board.name))
        return [selftest(row, sources.name, result)]
    except (compilers.CompileError, EmulatorError) as error:
        return [failed(row, error)]


def _too_large(board: Board, built: Built, size: Size) -> str:
    if built.ram <= board.ram:
        return (
            f"the self-test does not fit: with the module it takes {built.with_selftest} of {board.ram} bytes of RAM, "
            f"of which {STACK} are for the stack; the module alone takes {built.ram}"
        )
    fit = size.plays - -(-(built.ram - board.ram) // size.memory.play)
    return (
        f"{built.ram} bytes of RAM are needed, {built.constants} of them for constants, which are in RAM on an AVR; "
        f"{board.name} has {board.ram}: at {size.memory.play} bytes per play, at most {fit} of the "
        f"{size.plays} plays fit, fewer with a stack and other firmware; use fewer plays, or emit one operator"
    )


def _gcc(board: Board) -> compilers.Compiler:
    return compilers.Compiler("gcc", (board.gcc, *board.gcc_flags))


def build(board: Board, sources: Sources, folder: Path) -> Built:
    """Compile the emitted files in the new folder `folder`, with the same warnings as on the host. Raises
    CompileError."""
    folder.mkdir(parents=True)
    gcc = _gcc(board)
    objects = {source: folder / f"{source.stem}.o" for source in sources.emitted}
    for source, output in objects.items():
        gcc.object(source, output, compilers.USER)
    instances = folder / "instances.c"
    lines = [f'#include "{sources.name}.h"', *(f"{sources.name}_{op}_t hystgen_{op};" for op in sources.operators)]
    instances.write_text("\n".join(lines) + "\n", encoding="ascii")
    include = f"-I{sources.harness.parent}"
    gcc.run([*compilers.USER, "-fno-common", include, "-c", "-o", folder / "instances.o", instances])
    parts = sections(board, [objects[source] for source in sources.module])
    constants = sum(size for name, size in parts if name.startswith(CONSTANTS))
    flash = constants + sum(size for name, size in parts if name.startswith((".text", ".progmem")))
    taken = sum(size for name, size in sections(board, [folder / "instances.o"]) if name.startswith(".bss"))
    whole = sections(board, objects.values())
    with_selftest = sum(size for name, size in whole if name.startswith((*CONSTANTS, ".bss")))
    return Built(tuple(objects.values()), flash, constants, taken, with_selftest)


def sections(board: Board, objects: Iterable[Path]) -> list[tuple[str, int]]:
    """Names and sizes of all sections of object files."""
    done = subprocess.run([board.size, "-A", *objects], capture_output=True, text=True, check=True)
    return [(name, int(size)) for name, size in re.findall(r"^(\.\S+)\s+(\d+)\s", done.stdout, flags=re.MULTILINE)]


def link(board: Board, sources: Sources, objects: Sequence[Path], folder: Path) -> Path:
    """Link a firmware in `folder`; its main, which is never shipped, is compiled without warnings. Raises
    CompileError."""
    main = folder / "firmware.c"
    main.write_text(runtime.template("firmware_avr.c.j2", name=sources.name, report=REPORT), encoding="ascii")
    image = folder / "firmware.elf"
    _gcc(board).run([*compilers.USER, f"-I{sources.harness.parent}", "-o", image, main, *objects])
    return image


def run(board: Board, image: Path) -> int:
    """The self-test's result, which the firmware prints on its serial port. Raises EmulatorError."""
    command = [board.simulator, "-m", board.name, "-f", HERTZ, str(image)]
    done = program(f"{board.simulator} -m {board.name}", command, SECONDS)
    said = done.stdout + done.stderr
    count = re.search(rf"{REPORT} (\d+)", said)
    if count is None or done.returncode:
        raise EmulatorError(f"{board.simulator} -m {board.name} failed ({done.returncode}):\n{said.strip()}")
    return int(count[1])
