"""The microcontroller cores that emitted C is built for and run on; adding one means adding an entry to TARGETS."""

from __future__ import annotations

from typing import NamedTuple

HOST = "host"


class Machine(NamedTuple):
    """A qemu-system-arm board that a whole firmware image runs on, with its memory map."""

    name: str
    flash: int
    ram: int


class Target(NamedTuple):
    """A core: its names for compilers, and the emulator's processor.

    `fpu`: floating point in hardware, where a user's flags can contract a product and a sum to one rounding. `calls`:
    calls per verification record; a core without FPU needs hundreds of instructions where others need one.
    """

    name: str
    architecture: str  # "arm" (M profile, Thumb) or "riscv"
    cpu: str  # unicorn's name of the processor
    zig: tuple[str, ...]
    gcc: str  # the command, Debian's name
    gcc_flags: tuple[str, ...]
    fpu: bool
    calls: int
    machine: Machine | None = None


class Board(NamedTuple):
    """A controller whose core the emulator of `Target` lacks: gcc alone builds it, and another emulator runs it.

    It is 8-bit with a 16-bit `int`, which exposes expressions that rely on a wider one. `ram`: in bytes.
    """

    name: str
    gcc: str
    gcc_flags: tuple[str, ...]
    simulator: str
    size: str  # the command that lists the sections of an object file
    ram: int


ARM_GCC, RISCV_GCC = "arm-none-eabi-gcc", "riscv64-unknown-elf-gcc"

# Without "+vfp4d16sp" and the like, zig's M4, M7 and M33 have no FPU and call the soft-float library, even under eabihf
TARGETS = (
    Target(
        "cortex-m0plus", "arm", "UC_CPU_ARM_CORTEX_M0",
        ("-target", "thumb-freestanding-eabi", "-mcpu=cortex_m0plus"),
        ARM_GCC, ("-mthumb", "-mcpu=cortex-m0plus", "-mfloat-abi=soft"),
        fpu=False, calls=3000, machine=Machine("microbit", 0x0000_0000, 0x2000_0000),
    ),
    Target(
        "cortex-m4f", "arm", "UC_CPU_ARM_CORTEX_M4",
        ("-target", "thumb-freestanding-eabihf", "-mcpu=cortex_m4+vfp4d16sp"),
        ARM_GCC, ("-mthumb", "-mcpu=cortex-m4", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"),
        fpu=True, calls=10_000, machine=Machine("mps2-an386", 0x0000_0000, 0x2000_0000),
    ),
    Target(
        "cortex-m7", "arm", "UC_CPU_ARM_CORTEX_M7",
        ("-target", "thumb-freestanding-eabihf", "-mcpu=cortex_m7+fp_armv8d16sp"),
        ARM_GCC, ("-mthumb", "-mcpu=cortex-m7", "-mfloat-abi=hard", "-mfpu=fpv5-sp-d16"),
        fpu=True, calls=10_000, machine=Machine("mps2-an500", 0x0000_0000, 0x2000_0000),
    ),
    Target(
        "cortex-m33", "arm", "UC_CPU_ARM_CORTEX_M33",
        ("-target", "thumb-freestanding-eabihf", "-mcpu=cortex_m33+fp_armv8d16sp"),
        ARM_GCC, ("-mthumb", "-mcpu=cortex-m33", "-mfloat-abi=hard", "-mfpu=fpv5-sp-d16"),
        fpu=True, calls=10_000, machine=Machine("mps2-an505", 0x1000_0000, 0x3800_0000),
    ),
    Target(
        "rv32imac", "riscv", "UC_CPU_RISCV32_SIFIVE_E31",
        ("-target", "riscv32-freestanding-none", "-mcpu=generic_rv32+m+a+c"),
        RISCV_GCC, ("-march=rv32imac", "-mabi=ilp32"),
        fpu=False, calls=3000,
    ),
    Target(
        "rv32imafc", "riscv", "UC_CPU_RISCV32_ANY",
        ("-target", "riscv32-freestanding-none", "-mcpu=generic_rv32+m+a+f+c"),
        RISCV_GCC, ("-march=rv32imafc", "-mabi=ilp32f"),
        fpu=True, calls=10_000,
    ),
)

AVR = Board("atmega1284p", "avr-gcc", ("-mmcu=atmega1284p",), "simavr", "avr-size", 0x4000)

NAMES = (HOST, *(target.name for target in TARGETS), AVR.name)


def find(name: str) -> Target:
    """The core of that name. Raises ValueError for an unknown name."""
    for target in TARGETS:
        if target.name == name:
            return target
    from hystgen.basics import arguments

    arguments.choice("target", name, NAMES)
    raise ValueError(f"target {name!r} is not an emulated core")
