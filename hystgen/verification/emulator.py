"""An emulated core, which runs functions in a flat image, counts instructions per step, and measures stack use."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import writing
from hystgen.emission import runtime
from hystgen.plays import slots
from hystgen.plays.slots import Bytes
from hystgen.verification import compilers
from hystgen.verification.cross import MemoryMap
from hystgen.verification.loading import LoadError, load
from hystgen.verification.targets import Target

RECORDS = 0x6000_0000  # address of a record's arrays
STACK = 0x0000_8000  # bytes below the top of RAM that are painted
PAINT = 0xA5
SECONDS = 600  # seconds after which a call is aborted
PAGE = 0x1000


class EmulatorError(RuntimeError):
    """The emulated core failed; the message says why."""


def program(name: str, command: list[str], seconds: int) -> subprocess.CompletedProcess[str]:
    """Run another emulator, called `name` in messages. Raises EmulatorError if it does not end in time."""
    try:
        return subprocess.run(
            command, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL, timeout=seconds
        )
    except subprocess.TimeoutExpired:
        raise EmulatorError(f"{name} did not end within {seconds} s") from None


@dataclass(frozen=True)
class Image:
    """An ELF file: its loaded parts with their addresses, symbols with their sizes, and bytes of each section."""

    segments: tuple[tuple[int, bytes], ...]
    symbols: dict[str, tuple[int, int]]
    sections: dict[str, int]

    @classmethod
    def load(cls, path: Path) -> Image:
        """Read an ELF file."""
        from elftools.elf.elffile import ELFFile

        with path.open("rb") as file:
            elf = ELFFile(file)
            segments = tuple(
                (int(part["p_vaddr"]), part.data().ljust(int(part["p_memsz"]), b"\0"))
                for part in elf.iter_segments("PT_LOAD")
                if part["p_memsz"]
            )
            symbols = {
                symbol.name: (int(symbol["st_value"]), int(symbol["st_size"]))
                for symbol in elf.get_section_by_name(".symtab").iter_symbols()
            }
            sections = {section.name: int(section["sh_size"]) for section in elf.iter_sections()}
        return cls(segments, symbols, sections)


class _Counter(ctypes.Structure):
    """`hystgen_counter_t` from templates/instruction_counter.c."""

    _fields_ = [
        ("entry", ctypes.c_uint64),
        ("caller", ctypes.c_uint64),
        ("caller_end", ctypes.c_uint64),
        ("calls", ctypes.c_uint64),
        ("capacity", ctypes.c_uint64),
        ("counts", ctypes.c_void_p),
        ("stack_pointer", ctypes.c_uint64),
        ("read_register", ctypes.c_void_p),
        ("stack_register", ctypes.c_int64),
        ("last", ctypes.c_uint64),
        ("behind", ctypes.c_uint64),
        ("back", ctypes.c_uint64),
        ("count", ctypes.c_uint32),
    ]


@functools.cache
def _hook() -> Any:
    """The counting hook as machine code for this machine. Raises EmulatorError and MissingError."""
    found = compilers.available()
    if not found:
        raise compilers.none_found()
    source = runtime.data_folder("templates") / "instruction_counter.c"
    with writing.temporary() as folder:
        library = folder / "instruction_counter.so"
        try:
            found[0].shared_library([source], library, compilers.STRICT)
        except compilers.MissingError:
            raise
        except compilers.CompileError as error:
            raise EmulatorError(f"the instruction counter: {error}") from None
        try:
            return load(library, ctypes.CDLL).hystgen_count_instruction
        except LoadError as error:
            raise EmulatorError(f"the instruction counter: {error}") from None


@dataclass(frozen=True)
class _Registers:
    arguments: list[int]  # the first also takes the result
    link: int
    stack: int
    program: int


class Core:
    """A core with an image loaded, for that image only; `counts` holds the instructions of every step so far."""

    def __init__(self, target: Target, image: Image, layout: MemoryMap = MemoryMap()) -> None:  # noqa: B008  frozen
        self._image = image
        self._thumb = target.architecture == "arm"
        self._top = layout.ram + layout.ram_size
        self._return = layout.flash + layout.flash_size - PAGE
        self._records = 0
        self._counts: list[NDArray[np.uint32]] = []
        self._lowest = self._top
        self._stack_at_step = 0
        self._registers = self._open(target)
        self._uc.mem_map(layout.flash, layout.flash_size)
        self._uc.mem_map(layout.ram, layout.ram_size)
        for address, data in image.segments:
            self._uc.mem_write(address, data)
        self._uc.mem_write(self._top - STACK, bytes([PAINT]) * STACK)

    def _open(self, target: Target) -> _Registers:
        import unicorn
        from unicorn import arm_const, riscv_const

        self._failure: type[Exception] = unicorn.UcError
        if self._thumb:
            mode = unicorn.UC_MODE_THUMB | unicorn.UC_MODE_MCLASS
            self._uc = unicorn.Uc(unicorn.UC_ARCH_ARM, mode, getattr(arm_const, target.cpu))
            arguments = [getattr(arm_const, f"UC_ARM_REG_R{i}") for i in range(4)]
            return _Registers(
                arguments, arm_const.UC_ARM_REG_LR, arm_const.UC_ARM_REG_SP, arm_const.UC_ARM_REG_PC
            )
        self._uc = unicorn.Uc(unicorn.UC_ARCH_RISCV, unicorn.UC_MODE_RISCV32, getattr(riscv_const, target.cpu))
        if target.fpu:
            self._uc.reg_write(riscv_const.UC_RISCV_REG_MSTATUS, 1 << 13)  # FS: the FPU on
        arguments = [getattr(riscv_const, f"UC_RISCV_REG_A{i}") for i in range(8)]
        return _Registers(
            arguments, riscv_const.UC_RISCV_REG_RA, riscv_const.UC_RISCV_REG_SP, riscv_const.UC_RISCV_REG_PC
        )

    @property
    def counts(self) -> NDArray[np.uint32]:
        """Instructions of every counted call made by the harness, in order."""
        return np.concatenate(self._counts) if self._counts else np.zeros(0, dtype=np.uint32)

    @property
    def stack(self) -> int:
        """Bytes that the deepest call used below the harness's frame, judged by where the paint was overwritten."""
        painted = bytes(self._uc.mem_read(self._top - STACK, STACK))
        untouched = len(painted) - len(painted.lstrip(bytes([PAINT])))
        return self._stack_at_step - (self._top - STACK + untouched)

    def call(self, function: str, *arguments: int) -> int:
        """Call a function of the image with integers and pointers; returns its result. Raises EmulatorError."""
        address, _ = self._image.symbols[function]
        uc, registers = self._uc, self._registers
        in_registers = len(registers.arguments)
        stack = self._top
        if len(arguments) > in_registers:
            rest = b"".join(word.to_bytes(4, "little") for word in arguments[in_registers:])
            stack -= -(-len(rest) // 16) * 16
            uc.mem_write(stack, rest)
        for register, argument in zip(registers.arguments, arguments, strict=False):
            uc.reg_write(register, argument)
        uc.reg_write(registers.stack, stack)
        uc.reg_write(registers.link, self._return | self._thumb)
        try:
            uc.emu_start(address, self._return, timeout=SECONDS * 1_000_000)
        except self._failure as error:
            where = uc.reg_read(registers.program)
            raise EmulatorError(f"{function}: {error} at {where:#010x}, in {self._where(where)}") from None
        if uc.reg_read(registers.program) != self._return:
            raise EmulatorError(f"{function} did not return within {SECONDS} s")
        return int(uc.reg_read(registers.arguments[0]))

    def _where(self, address: int) -> str:
        for name, (start, size) in self._image.symbols.items():
            if start & ~1 <= address < start + size:
                return name
        return "no function"

    def run(
        self, name: str, op: str, call: Bytes, x: NDArray[np.number], counted: str = "step"
    ) -> tuple[NDArray[np.number], Bytes]:
        """Let the harness of operator `op` make the calls in a record, counting the instructions of NAME_OP_step or
        NAME_OP_commit."""
        places = self._places(len(x), x.nbytes, x.nbytes, len(x))
        self._uc.mem_write(places[0], call.tobytes())
        self._uc.mem_write(places[1], x.tobytes())
        code = slots.OP_STEP if counted == "step" else slots.OP_COMMIT
        with self._counting(f"{name}_{op}_{counted}", op, int(np.count_nonzero(call & slots.OP_CALL == code))):
            self.call(f"hystgen_harness_{op}", *places, len(x))
        answer = np.frombuffer(bytes(self._uc.mem_read(places[2], x.nbytes)), dtype=x.dtype)
        status = np.frombuffer(bytes(self._uc.mem_read(places[3], len(x))), dtype=np.uint8)
        return answer, status

    def health(
        self, name: str, expected: NDArray[np.number], measured: NDArray[np.number],
        kinds: Sequence[np.dtype[np.number]],
    ) -> list[NDArray[np.number]]:
        """Let the harness watch the model's error, counting the instructions of NAME_health_update; `kinds`: types of
        the results."""
        count = len(expected)
        results = [np.empty(count, dtype=kind) for kind in kinds]
        places = self._places(*(each.nbytes for each in (expected, measured, *results)))
        for place, each in zip(places[:2], (expected, measured), strict=True):
            self._uc.mem_write(place, each.tobytes())
        with self._counting(f"{name}_health_update", "health", count):
            self.call("hystgen_harness_health", *places, count)
        return [
            np.frombuffer(bytes(self._uc.mem_read(place, each.nbytes)), dtype=each.dtype)
            for place, each in zip(places[2:], results, strict=True)
        ]

    def _places(self, *sizes: int) -> list[int]:
        """Addresses of records of these sizes in bytes, in memory that is there."""
        places, end = [], RECORDS
        for size in sizes:
            places.append(end)
            end += -(-size // 16) * 16
        needed = -(-(end - RECORDS) // PAGE) * PAGE
        if needed > self._records:
            self._uc.mem_map(RECORDS + self._records, needed - self._records)
            self._records = needed
        return places

    @contextlib.contextmanager
    def _counting(self, function: str, op: str, calls: int) -> Iterator[None]:
        """Count the instructions of a function, which is called this many times inside the context."""
        from unicorn import UC_HOOK_CODE
        from unicorn.unicorn_py3.unicorn import uc_hook_h, uclib

        counts = np.zeros(calls, dtype=np.uint32)
        caller, size = self._image.symbols[f"hystgen_harness_{op}"]
        counter = _Counter(
            entry=self._image.symbols[function][0] & ~1,
            caller=caller & ~1,
            caller_end=(caller & ~1) + size,
            capacity=calls,
            counts=counts.ctypes.data,
            read_register=ctypes.cast(uclib.uc_reg_read, ctypes.c_void_p).value,
            stack_register=self._registers.stack,
        )
        handle, hook = uc_hook_h(), ctypes.cast(_hook(), ctypes.c_void_p)
        # The binding's own hook_add would wrap a Python function; here, the address of compiled code is passed directly
        failed = uclib.uc_hook_add(
            self._uc._uch, ctypes.byref(handle), UC_HOOK_CODE, hook, ctypes.addressof(counter), 1, 0
        )
        if failed:
            raise EmulatorError(f"the emulator refused the counting hook: error {failed}")
        try:
            yield
        finally:
            uclib.uc_hook_del(self._uc._uch, handle)
        if counter.calls != calls:
            raise EmulatorError(f"counted {counter.calls} calls of {function} where {calls} were made")
        self._counts.append(counts)
        self._stack_at_step = int(counter.stack_pointer) or self._stack_at_step
