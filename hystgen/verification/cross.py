"""C compilers for the cores of `targets`: zig from its wheel, and Debian's cross gcc if installed."""

from __future__ import annotations

import functools
import importlib.util
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hystgen.basics import extras
from hystgen.emission import runtime
from hystgen.verification import compilers
from hystgen.verification.sources import Sources
from hystgen.verification.targets import Target

EXTRA = "targets"
NAMES = ("zig", "gcc")

# Flags of every firmware: no hosted library, no unwind tables
FREESTANDING = ["-ffreestanding", "-fno-unwind-tables", "-fno-asynchronous-unwind-tables", "-g0"]


@dataclass(frozen=True)
class MemoryMap:
    """Where an image is placed in memory."""

    flash: int = 0x0800_0000
    flash_size: int = 0x0100_0000
    ram: int = 0x2000_0000
    ram_size: int = 0x0004_0000


@dataclass(frozen=True)
class CrossCompiler:
    """A compiler with the flags that name the core."""

    compiler: compilers.Compiler
    flags: tuple[str, ...]
    libraries: tuple[str, ...]

    @property
    def name(self) -> str:
        """zig or gcc."""
        return self.compiler.name

    def image(
        self,
        sources: Sources,
        folder: Path,
        flags: Sequence[str],
        layout: MemoryMap,
        entry: str,
        more: Sequence[Path] = (),
    ) -> Path:
        """Compile and link a flat image in `folder`, which must be new. Raises CompileError.

        The emitted files must compile with the host's warning flags and no warning; `more` is never shipped and need
        not.
        """
        folder.mkdir(parents=True)
        common = [*self.flags, *flags, *FREESTANDING]
        objects = []
        for source in (*sources.all, *more):
            output = folder / f"{source.stem}.o"
            warnings = compilers.C_WARNINGS if source not in more else []
            self.compiler.run(["-c", *common, *warnings, "-o", output, source])
            objects.append(output)
        script = folder / "image.ld"
        text = runtime.template(
            "image.ld.j2",
            **vars(layout),
            module=[f"{path.stem}.o" for path in sources.module],
            harness=[f"{path.stem}.o" for path in (*sources.all, *more) if path not in sources.module],
        )
        script.write_text(text, encoding="ascii")
        image = folder / "image.elf"
        linking = ["-nostartfiles", f"-Wl,-T,{script}", f"-Wl,-e,{entry}", "-Wl,--gc-sections"]
        self.compiler.run([*common, *linking, "-o", image, *objects, *self.libraries])
        return image


@functools.cache
def find(target: Target, name: str) -> CrossCompiler:
    """The compiler 'zig' or 'gcc' for `target`. Raises MissingError."""
    if name == "zig":
        found = compilers.find("zig")
        if found is None:
            raise compilers.MissingError(f"zig is not installed: {extras.install(EXTRA)}")
        return CrossCompiler(found, target.zig, ())
    if name == "gcc":
        path = shutil.which(target.gcc)
        if path is None:
            raise compilers.uninstalled([target.gcc])
        # Only the compiler's own library: emitted code needs no other
        return CrossCompiler(compilers.Compiler("gcc", (path,)), (*target.gcc_flags, "-nostdlib"), ("-lgcc",))
    raise compilers.MissingError(f"{name} does not build for {target.name}; use {' or '.join(NAMES)}")


def chosen(target: Target, compiler: Sequence[str]) -> tuple[str, ...]:
    """Names of the compilers to use: the requested ones, else zig and, if installed, gcc.

    A requested compiler that builds only for the host is skipped if one for cores is requested too.
    """
    if compiler:
        return tuple(name for name in compiler if name in NAMES) or tuple(compiler)
    return NAMES if shutil.which(target.gcc) else NAMES[:1]


def check_wheels() -> None:
    """Raise MissingError if the emulator's wheels cannot be used."""
    wheels = {"unicorn": "unicorn", "elftools": "pyelftools"}
    missing = [wheel for package, wheel in wheels.items() if importlib.util.find_spec(package) is None]
    if missing:
        raise compilers.MissingError(f"{', '.join(missing)} not installed: {extras.install(EXTRA)}")
    for package, wheel in wheels.items():
        try:
            importlib.import_module(package)
        except Exception as error:
            raise compilers.MissingError(f"{wheel} cannot be loaded: {type(error).__name__}: {error}") from None
