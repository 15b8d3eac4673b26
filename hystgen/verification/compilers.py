"""C compilers on this machine and the flags that emitted code has to be clean under."""

from __future__ import annotations

import functools
import importlib.util
import platform
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

WARNINGS = [
    "-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Wsign-conversion", "-Wdouble-promotion", "-Wshadow", "-Wundef",
    "-Wcast-qual", "-Wvla", "-Werror",
]  # fmt: skip
C_WARNINGS = [*WARNINGS, "-Wmissing-prototypes", "-Wstrict-prototypes"]

# The strict build, and the one a user makes who passes nothing: gcc's and clang's default dialect, in which they may
# contract a * b + c to one rounding. Where the CPU's baseline has no such instruction, its own set has to be asked for
STRICT = ["-std=c99", "-O2", "-ffp-contract=off"]
USER = ["-std=gnu11", "-O2"]
DEFAULTS = [*USER, *(["-march=native"] if platform.machine() in ("x86_64", "AMD64") else [])]

NAMES = ("gcc", "clang", "zig")


class CompileError(RuntimeError):
    """The compiler refused; the message holds its output."""


@dataclass(frozen=True)
class Compiler:
    """A C compiler: a name from NAMES and the command that starts it."""

    name: str
    command: tuple[str, ...]

    def run(self, arguments: Sequence[str | Path]) -> None:
        """Run the compiler. Raises CompileError with what it printed."""
        done = subprocess.run(
            [*self.command, *map(str, arguments)], capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL
        )
        if done.returncode:
            raise CompileError(f"{self.name} failed:\n{(done.stderr or done.stdout).strip()}")

    def shared_library(self, sources: Sequence[Path], output: Path, flags: Sequence[str]) -> None:
        """Build a shared library from C sources."""
        self.run(["-shared", "-fPIC", *flags, *C_WARNINGS, "-o", output, *sources])

    def object(self, source: Path, output: Path, flags: Sequence[str]) -> None:
        """Compile one C file."""
        self.run(["-c", *flags, *C_WARNINGS, "-o", output, source])


@functools.cache
def find(name: str) -> Compiler | None:
    """The compiler of that name, or None where it is not installed."""
    if name == "zig":
        if importlib.util.find_spec("ziglang"):
            return Compiler("zig", (sys.executable, "-m", "ziglang", "cc"))
        path = shutil.which("zig")
        return Compiler("zig", (path, "cc")) if path else None
    path = shutil.which(name)
    return Compiler(name, (path,)) if path else None


def available() -> list[Compiler]:
    """Every compiler of NAMES that is installed."""
    return [compiler for compiler in map(find, NAMES) if compiler]
