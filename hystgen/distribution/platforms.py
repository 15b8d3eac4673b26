"""The platforms that shared libraries are built for, and how zig links for each."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Platform:
    """A platform: its `name` on the command line, zig's name `zig`, the `ending` of its libraries, the `linking` flags;
    `system`: what programs need from it; `fmi2`, `fmi3`: names of its folder in co-simulation units, empty for a
    platform that has none."""

    name: str
    zig: str
    ending: str
    linking: tuple[str, ...]
    system: tuple[str, ...] = ()
    fmi2: str = ""
    fmi3: str = ""


_SHARED = ("-shared", "-fPIC", "-nostdlib")

PLATFORMS = {
    each.name: each
    for each in (
        Platform(
            "x86_64-linux", "x86_64-linux-gnu", "so", (*_SHARED, "-Wl,-soname,{file}"), (), "linux64", "x86_64-linux"
        ),
        Platform(
            "x86_64-windows", "x86_64-windows-gnu", "dll", ("-shared", "-nostdlib"), ("-lkernel32",), "win64",
            "x86_64-windows",
        ),
        # FMI 2.0 names no folder for it; programs that know it take FMI 3.0's name
        Platform(
            "aarch64-linux", "aarch64-linux-gnu", "so", (*_SHARED, "-Wl,-soname,{file}"), (), "aarch64-linux",
            "aarch64-linux",
        ),
        # macOS loads no library without libSystem. FMI 2.0 has one folder for both processors: a universal library
        Platform(
            "x86_64-macos", "x86_64-macos", "dylib", (*_SHARED, "-Wl,-install_name,@rpath/{file}", "-lSystem"), (),
            "darwin64", "x86_64-darwin",
        ),
        Platform(
            "aarch64-macos", "aarch64-macos", "dylib", (*_SHARED, "-Wl,-install_name,@rpath/{file}", "-lSystem"), (),
            "darwin64", "aarch64-darwin",
        ),
        Platform("wasm32", "wasm32-freestanding", "wasm", ("-nostdlib", "-Wl,--no-entry", "-Wl,--export=__heap_base")),
    )
}
"""The platforms by name. None links a C library, so no version of one is required."""


def find(name: str) -> Platform:
    """The platform of that name. Raises ValueError."""
    from hystgen.basics import arguments

    arguments.choice("target", name, tuple(PLATFORMS))
    return PLATFORMS[name]
