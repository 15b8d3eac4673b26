"""Packages for build tools: a folder for each model, and for a shared run time, with the C and the tools' files.

The folder is complete: a tool may copy it elsewhere. Each tool's files are the same whichever other tools are
requested.
"""

from __future__ import annotations

import errno
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from hystgen.basics.version import __version__
from hystgen.emission import interface
from hystgen.emission.module import WHAT, Module
from hystgen.emission.options import read_banner, seal
from hystgen.emission.runtime import template

CONFIG = {"CMakeLists.txt": "CMakeLists.txt.j2", "cmake/NAMEConfig.cmake": "Config.cmake.j2"}
SELFTEST = {"test/main.c": "main.c.j2"}
FILES = {
    "cmake": CONFIG | SELFTEST,
    "meson": {"meson.build": "meson.build.j2"} | SELFTEST,
    "conan": CONFIG | SELFTEST | {
        "conanfile.py": "conanfile.py.j2", "test_package/conanfile.py": "test_package.py.j2",
        "test_package/CMakeLists.txt": "test_package.cmake.j2",
    },
    "platformio": {"library.json": ""},
    "arduino": {
        "library.properties": "library.properties.j2", "examples/NAME_selftest/NAME_selftest.ino": "selftest.ino.j2",
    },
    "zephyr": {
        "zephyr/module.yml": "module.yml.j2", "zephyr/CMakeLists.txt": "zephyr.cmake.j2",
        "zephyr/Kconfig": "Kconfig.j2",
    },
    "espidf": CONFIG | SELFTEST | {"idf_component.yml": "idf_component.yml.j2"},
}
"""Files of each tool within a package, and their templates; none for JSON. NAME stands for the package's name."""

WITH_SELFTEST = ("test/", "test_package/", "examples/")
"""Package folders that a shared run time lacks, since it has no self-test."""

RESERVED = (
    "all", "benchmark", "c", "clean", "dist", "dl", "edit_cache", "gcc", "help", "install", "m", "package",
    "package_source", "rebuild_cache", "rt", "test", "uninstall", "util",
)
"""Names of targets that the tools make themselves, and of system libraries, which a model's library would hide."""


@dataclass(frozen=True)
class Package:
    """A folder for build tools: its `name`, `what` it contains in words, C files by name, the package that it `needs`,
    the `command` that writes it without the tool, and the hash of the parameters."""

    name: str
    what: str
    code: Mapping[str, str]
    needs: str
    command: str
    sha256: str

    @property
    def selftest(self) -> bool:
        """Whether it contains a self-test, as that of a model does."""
        return f"{self.name}_selftest.c" in self.code


def name_problem(name: str, tools: Sequence[str]) -> str | None:
    """Why these tools can have no package of a model with this name; None if they can."""
    if name.lower() in RESERVED:
        reason = "build tools or systems use that name themselves"
    elif len(name) == 1 and "conan" in tools:
        reason = "conan requires two characters"
    else:
        return None
    return f"no --integration for a model called {name}: {reason}; rename it, for example axis_{name}"


def files(module: Module, code: Mapping[str, str]) -> dict[str, str]:
    """Paths and text of the packages of a model, whose C files are `code`; what a run time's package contains is the
    same for all models. Raises ValueError for a name that the tools cannot use."""
    one = module.compensator
    name, options = one.names.name, one.options
    if problem := name_problem(name, options.integration):
        raise ValueError(problem)
    shared = {file: text for file, text in code.items() if file.startswith("hystgen_")}
    own = {file: text for file, text in code.items() if file not in shared}
    needs = next((PurePosixPath(file).stem for file in shared), "")
    what = f"Hysteresis compensator {name}: {WHAT[options.operator]} in {options.arithmetic}"
    command = interface.command(one.model.parameters, options)
    packages = [Package(name, what, own, needs, command, module.sha256)]
    if shared:
        what = f"Run time shared by all {options.arithmetic} hysteresis compensators"
        packages.append(Package(needs, what, shared, "", *interface.runtime_origin(options.arithmetic)))
    return {path: text for each in packages for path, text in _package(each, options.integration)}


def _package(package: Package, tools: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Paths of a package's files, and their text."""
    name, code = package.name, dict(package.code)
    if f"{name}.c" not in code:  # a single header
        file = f"{name}_implementation.c"
        code[file] = _written(package, "implementation.c.j2", file, "cmake")
    for file, text in code.items():
        yield f"{name}/src/{file}", text
    listed = {
        "sources": [f"src/{file}" for file in code if file.endswith(".c")],
        "headers": [f"src/{file}" for file in code if file.endswith(".h")],
    }
    written = set[str]()
    for tool, names in FILES.items():
        for path, source in names.items():
            if path in written or (path.startswith(WITH_SELFTEST) and not package.selftest):
                continue
            written.add(path)
            if any(path in FILES[asked] for asked in tools):
                file = path.replace("NAME", name)
                yield f"{name}/{file}", _written(package, source, file, tool, **listed)


def _written(package: Package, source: str, file: str, tool: str, **listed: Sequence[str]) -> str:
    """The text of one file; its banner has the command for the first `tool` that needs it."""
    about, command = f"{package.name} for {tool}", f"{package.command} --integration {tool}"
    banner = interface.banner(PurePosixPath(file).name, about, command, package.sha256)
    if not source:
        return seal(_json(package, banner))
    if not file.endswith((".c", ".ino")):
        banner = re.sub(r"(?m)^(?:/\*| \*)", "#", banner.removesuffix("\n */"))
    text = template(
        f"integration/{source}", package=package, name=package.name, NAME=package.name.upper(), banner=banner,
        version=__version__, quoted=lambda words: ", ".join(f"'{word}'" for word in words), **listed,
    )
    return seal(text)


def _json(package: Package, banner: str) -> str:
    """The manifest of PlatformIO; JSON has no comments, so its banner is a list of lines."""
    lines = re.sub(r" \\\n \* +", " ", banner).splitlines()
    entries = {
        "name": package.name, "version": __version__, "description": package.what, "license": "0BSD",
        "headers": [f"{package.name}.h"], "frameworks": "*", "platforms": "*",
        "generated": [line.removeprefix(" * ") for line in lines if line.startswith(" * ")],
    }
    return json.dumps(entries, indent=2) + "\n"


def check_replaced(folder: Path, files: Iterable[str]) -> None:
    """Raise FileExistsError if a file of a package exists and hystgen did not write it."""
    for name in files:
        path = folder / name
        if "/" in name and path.is_file():
            text = path.read_bytes().decode("utf-8", "surrogateescape").replace("\r\n", "\n")
            if read_banner(text) is None:
                what = "exists, and hystgen did not write it; move it, or give another folder"
                raise FileExistsError(errno.EEXIST, what, str(path))


def places(folder: Path) -> Iterator[Path]:
    """Files in the packages in `folder`, in order: existing ones under a path that a package may have."""
    known = {path for names in FILES.values() for path in names} | {"src/*.c", "src/*.h"}
    for inner in sorted(folder.iterdir()):
        if re.fullmatch(r"\w+", inner.name) and inner.is_dir():
            for path in sorted(path.replace("NAME", inner.name) for path in known):
                yield from sorted(inner.glob(path))
