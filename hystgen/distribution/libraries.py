"""Shared libraries of the emitted C for programs on other machines: LabVIEW, ctypes, C#, a browser."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from hystgen.basics import arguments, writing
from hystgen.basics.progress import Progress
from hystgen.distribution import platforms
from hystgen.distribution.platforms import PLATFORMS, Platform
from hystgen.emission.calls import emitted_files
from hystgen.emission.runtime import template
from hystgen.model import ModelSource, as_model
from hystgen.verification import compilers

LAYOUT = "self-contained"
"""Layout of the C in a binary: all functions but the public ones are static, so only those are exported."""

SUPPORT = "shared-library.c"
"""File of the functions beside the emitted C; the hyphen keeps its name from being that of a model."""

# Without debug information and symbols nothing depends on the folder in which zig runs. STRICT computes the bits of the
# reference
FLAGS = (*compilers.STRICT, "-g0", "-s", "-fno-unwind-tables", "-fno-asynchronous-unwind-tables")


@dataclass(frozen=True)
class Library:
    """What `build` wrote: `paths`, and the C prototypes that every library exports."""

    paths: tuple[Path, ...]
    exports: tuple[str, ...]


def zig() -> compilers.Compiler:
    """The zig compiler. Raises MissingError."""
    found = compilers.find("zig")
    if found is None:
        raise compilers.missing("zig")
    return found


def linked(
    platform: Platform, folder: Path, files: Mapping[str, str], name: str, more: Sequence[str] = ()
) -> bytes:
    """A library for a platform, from C files written into `folder`, which must be new; `more`: flags for zig.

    Raises CompileError.
    """
    folder.mkdir()
    sources = [path for path in writing.write_files(folder, files) if path.suffix == ".c"]
    output = folder / f"{name}.{platform.ending}"
    linking = [flag.format(file=output.name) for flag in platform.linking]
    flags = ["-target", platform.zig, *FLAGS, *compilers.C_WARNINGS, "-fno-builtin", *linking, *more]
    zig().run([*flags, "-o", output, *sources, *platform.system])
    return output.read_bytes()


def exports(name: str, header: str) -> list[str]:
    """Prototypes of the functions that a library of this emitted header exports, without semicolons."""
    found = re.findall(rf"^\w[\w ]*? \*?{name}_(?:forward|inverse)_\w+\([^)]*\)(?=;)", header, re.MULTILINE)
    operators = _operators(name, found)
    return [*(" ".join(each.split()) for each in found), *(f"size_t {name}_{op}_size(void)" for op in operators)]


def _operators(name: str, prototypes: Sequence[str]) -> list[str]:
    words = " ".join(prototypes)
    return [op for op in ("forward", "inverse") if f"{name}_{op}_init(" in words]


@arguments.checked
def build(
    source: ModelSource,
    output: str | os.PathLike[str] = ".",
    targets: Sequence[str] = tuple(PLATFORMS),
    operator: str | None = None,
    arithmetic: str | None = None,
    engine: str | None = None,
    optimize: str | None = None,
    allow_partial: bool = False,
    progress: bool = False,
) -> Library:
    """Compile the emitted C of a model into shared libraries, with zig, and write them to `output`/TARGET.

    Each folder gets NAME.so, .dll, .dylib or .wasm, and the header NAME.h. `targets`: names from
    `hystgen.distribution.platforms`; `progress`: whether to show a bar on a terminal; the other options are those of
    `emit`. A library exports the functions of its header, and for each operator `size_t NAME_OP_size(void)`, the bytes
    of an instance. It needs no C library. Raises what `emit` raises, ValueError for an unknown target, and CompileError
    if zig is missing or fails; nothing is written then.
    """
    folder = Path(arguments.path("output", output))
    chosen = [platforms.find(name) for name in dict.fromkeys(arguments.words("targets", targets, "x86_64-linux"))]
    if not chosen:
        raise ValueError(f"no target is given; use {', '.join(PLATFORMS)}")
    model = as_model(source)
    texts = emitted_files(
        model, operator=operator, arithmetic=arithmetic, engine=engine, optimize=optimize, allow_partial=allow_partial,
        layout=LAYOUT,
    )
    name, header = model.name, f"{model.name}.h"
    public = exports(name, texts[header])
    beside = template("library.c.j2", name=name, operators=_operators(name, public))
    sources = {header: texts[header], f"{name}.c": texts[f"{name}.c"], SUPPORT: beside}
    calls = re.findall(rf"{name}_\w+(?=\()", "\n".join(public))
    made: dict[str, dict[str, str | bytes]] = {}
    for each in chosen:
        writing.check_files(folder / each.name, [f"{name}.{each.ending}", header])
    with writing.temporary() as work, Progress(len(chosen), progress, "compiling") as bar:
        for each in chosen:
            wanted = [f"-Wl,--export={call}" for call in calls] if each.ending == "wasm" else []
            library = linked(each, work / each.name, sources, name, wanted)
            made[each.name] = {f"{name}.{each.ending}": library, header: texts[header]}
            bar.tick(1)
    paths = [path for each, files in made.items() for path in writing.write_files(folder / each, files)]
    return Library(tuple(paths), tuple(public))
