"""A second emulator: a whole firmware image on qemu-system-arm, which runs the self-test and exits with its result."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

from hystgen.emission import runtime
from hystgen.verification.cross import CrossCompiler, MemoryMap
from hystgen.verification.emulator import EmulatorError, program
from hystgen.verification.sources import Sources
from hystgen.verification.targets import Machine, Target

QEMU = "qemu-system-arm"
SECONDS = 120
SIZES = {"flash_size": 0x0004_0000, "ram_size": 0x0000_4000}  # of the smallest board
FAULT = 255


def available(target: Target) -> Machine | None:
    """The board that runs firmware for `target`; None if there is no such board or qemu is not installed."""
    return target.machine if shutil.which(QEMU) else None


def build(
    compiler: CrossCompiler, target: Target, machine: Machine, sources: Sources, folder: Path, flags: Sequence[str]
) -> Path:
    """Compile and link the firmware in the new folder `folder`. Raises CompileError."""
    source = folder.with_name(f"{folder.name}.c")
    text = runtime.template("firmware.c.j2", name=sources.name, fpu=target.fpu, fault=FAULT)
    source.write_text(text, encoding="ascii")
    layout = MemoryMap(machine.flash, ram=machine.ram, **SIZES)
    return compiler.image(sources, folder, flags, layout, "firmware_reset", [source])


def run(machine: Machine, image: Path) -> int:
    """The self-test's result (0, or 1 + first failing index, at most 253). Raises EmulatorError.

    The exit code is one higher: 0 would mean that the emulator ran nothing.
    """
    command = [
        QEMU, "-M", machine.name, "-nographic", "-monitor", "none", "-serial", "none",
        "-semihosting-config", "enable=on,target=native", "-icount", "shift=6", "-kernel", str(image),
    ]
    done = program(f"{QEMU} -M {machine.name}", command, SECONDS)
    if done.returncode < 0 or done.stderr.strip():
        raise EmulatorError(f"{QEMU} -M {machine.name} failed ({done.returncode}):\n{done.stderr.strip()}")
    if done.returncode == FAULT:
        raise EmulatorError(f"{QEMU} -M {machine.name}: the firmware ended in a fault")
    if done.returncode == 0:
        raise EmulatorError(f"{QEMU} -M {machine.name} ended without the self-test's result")
    return done.returncode - 1
