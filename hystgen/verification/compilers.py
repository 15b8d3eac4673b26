"""C compilers on this machine, and the flags under which emitted code must compile without warnings."""

from __future__ import annotations

import atexit
import contextlib
import functools
import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hystgen.basics import extras, writing

WARNINGS = [
    "-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Wsign-conversion", "-Wdouble-promotion", "-Wshadow", "-Wundef",
    "-Wcast-qual", "-Wvla", "-Werror",
]
C_WARNINGS = [*WARNINGS, "-Wmissing-prototypes", "-Wstrict-prototypes"]

# The strict build, and a user's build without flags: in their default dialect, gcc and clang may contract a * b + c to
# one rounding. If the CPU's baseline has no such instruction, the native instruction set must be enabled
STRICT = ["-std=c99", "-O2", "-ffp-contract=off"]
USER = ["-std=gnu11", "-O2"]
DEFAULTS = [*USER, *(["-march=native"] if platform.machine() in ("x86_64", "AMD64") else [])]

NAMES = ("gcc", "clang", "zig")


DEBIAN = {
    "gcc": "gcc", "clang": "clang", "arm-none-eabi-gcc": "gcc-arm-none-eabi",
    "riscv64-unknown-elf-gcc": "gcc-riscv64-unknown-elf", "avr-gcc": "gcc-avr avr-libc", "avr-size": "binutils-avr",
    "simavr": "simavr",
}
"""Debian packages that provide the commands a verification calls."""


class CompileError(RuntimeError):
    """The compiler failed; the message contains its output."""


class MissingError(CompileError):
    """A requested tool cannot be used on this machine; the message says what to install."""


@dataclass(frozen=True)
class Compiler:
    """A C compiler: a name from NAMES and the command that starts it."""

    name: str
    command: tuple[str, ...]

    def run(self, arguments: Sequence[str | Path]) -> None:
        """Run the compiler; its temporary files go where its output goes. Raises CompileError with the compiler's
        output."""
        folder = Path(arguments[list(arguments).index("-o") + 1]).parent
        try:
            done = subprocess.run(
                [*self.command, *map(str, arguments)], capture_output=True, encoding="utf-8", errors="replace",
                check=False, stdin=subprocess.DEVNULL, env={**os.environ, **_own(self.name), "TMPDIR": str(folder)},
            )
        except OSError as failure:
            raise MissingError(f"{self.name} cannot be started: {failure.strerror}; reinstall it") from None
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
    """The compiler of that name, or None if it is not installed.

    Any other name is a command in shell syntax, with words and quotes: `ccache gcc`, `gcc -m32`. Raises ValueError for
    an unclosed quote or an empty command.
    """
    if name.split() in (["zig"], ["zig", "cc"]):
        # The wheel's program itself: to start it, `python -m ziglang` takes as long as a small file takes to compile
        wheel = importlib.util.find_spec("ziglang")
        folders = os.pathsep.join((wheel and wheel.submodule_search_locations) or ())
        path = (shutil.which("zig", path=folders) if folders else None) or shutil.which("zig")
        return Compiler("zig", (path, "cc")) if path else None
    path = shutil.which(name)  # unsplit first: a path may have spaces
    if path:
        return Compiler(name, (path,))
    try:
        words = shlex.split(name)
    except ValueError as failure:
        raise ValueError(f"the compiler {name!r} is not a command: {failure}; correct it") from None
    if not words:
        raise ValueError("a compiler is given as a command; write gcc, clang, zig or another")
    path = shutil.which(words[0])
    return Compiler(name, (path, *words[1:])) if path else None


def missing(name: str) -> MissingError:
    """The error for a compiler that `find` does not find."""
    command = shlex.split(name)[0]
    if command == "zig":
        return MissingError(f"zig is not installed; install it with: {extras.install('zig')}")
    if command in DEBIAN:
        return uninstalled([command])
    return MissingError(f"{command} is not installed; install it, or name another compiler: {', '.join(NAMES)}")


def uninstalled(commands: Sequence[str]) -> MissingError:
    """The error for commands that are not installed, with the Debian packages that provide them."""
    packages = " ".join(DEBIAN[command] for command in commands if command in DEBIAN)
    advice = f"; on Debian: apt install {packages}" if packages else "; install them"
    are = "are" if len(commands) > 1 else "is"
    return MissingError(f"{' and '.join(commands)} {are} not installed{advice}")


def none_found() -> MissingError:
    """The error for a machine without a compiler."""
    return MissingError(f"no C compiler found; install gcc or clang, or: {extras.install('zig')}")


@functools.cache
def _own(name: str) -> dict[str, str]:
    """Environment variables that a compiler needs: for zig, a cache folder if the home folder cannot hold it."""
    if not name.startswith("zig") or "ZIG_GLOBAL_CACHE_DIR" in os.environ:
        return {}
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    # zig creates this folder, or hangs if that fails (under /proc, say), which permissions alone do not reveal
    with contextlib.suppress(OSError):
        os.makedirs(os.path.join(home, "zig"), exist_ok=True)
        with tempfile.TemporaryFile(dir=os.path.join(home, "zig")):
            return {}
    instead = contextlib.ExitStack()
    atexit.register(instead.close)
    return {"ZIG_GLOBAL_CACHE_DIR": str(instead.enter_context(writing.temporary()))}


def available() -> list[Compiler]:
    """Every compiler of NAMES that is installed."""
    return [compiler for compiler in map(find, NAMES) if compiler]
