"""An 8-bit controller: a whole firmware with the self-test, built by Debian's avr-gcc and run by simavr."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace

from hystgen.emission import module
from hystgen.verification import compilers
from hystgen.verification.emulator import EmulatorError
from hystgen.verification.report import Row, failed, selftest
from hystgen.verification.sources import Sources
from hystgen.verification.targets import Board

SECONDS = 120
HERTZ = "16000000"  # simavr asks for a clock; the firmware needs none
TELLS = "selftest returned"


def rows(
    board: Board, sources: Sources, compiler: Sequence[str], folder: Path, progress: Callable[[str], None]
) -> list[Row]:
    """One row: what the self-test says on the emulated board."""
    if compiler and "gcc" not in compiler:
        words = f"does not build for {board.name}; use gcc"
        return [Row(board.name, each, "-", "-", error=f"{each} {words}") for each in compiler]
    row = Row(board.name, "gcc", "firmware", "selftest")
    missing = [command for command in (board.gcc, board.simulator) if shutil.which(command) is None]
    if missing:
        return [failed(row, f"{' and '.join(missing)} not installed")]
    progress(f"{board.name}, gcc, firmware on {board.simulator}")
    try:
        return [selftest(row, sources.name, run(board, build(board, sources, folder / board.name)))]
    except (compilers.CompileError, EmulatorError) as error:
        return [failed(row, error)]


def build(board: Board, sources: Sources, folder: Path) -> Path:
    """Compile and link the firmware in the new folder `folder`. Raises CompileError.

    The emitted files have to be clean under the warnings of the host; the main, which is never shipped, need not be.
    """
    folder.mkdir(parents=True)
    main = folder / "firmware.c"
    values = SimpleNamespace(name=sources.name, tells=TELLS)
    main.write_text(module.render("firmware_avr.c.j2", values), encoding="ascii")
    gcc = compilers.Compiler("gcc", (board.gcc, *board.gcc_flags))
    objects = []
    for source in sources.emitted:
        output = folder / f"{source.stem}.o"
        gcc.object(source, output, compilers.USER)
        objects.append(output)
    image = folder / "firmware.elf"
    gcc.run([*compilers.USER, f"-I{sources.harness.parent}", "-o", image, main, *objects])
    return image


def run(board: Board, image: Path) -> int:
    """The self-test's result, which the firmware tells on its serial port. Raises EmulatorError."""
    command = [board.simulator, "-m", board.name, "-f", HERTZ, str(image)]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL, timeout=SECONDS
        )
    except subprocess.TimeoutExpired:
        raise EmulatorError(f"{board.simulator} -m {board.name} did not end within {SECONDS} s") from None
    said = done.stdout + done.stderr
    told = re.search(rf"{TELLS} (\d+)", said)
    if told is None or done.returncode:
        raise EmulatorError(f"{board.simulator} -m {board.name} failed ({done.returncode}):\n{said.strip()}")
    return int(told[1])
