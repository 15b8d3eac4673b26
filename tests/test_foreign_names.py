"""Emitted C next to other headers: none of its names is one of their macros, and it compiles after them."""

from __future__ import annotations

import functools
import itertools
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from foreign_names import NAMES, words
from modelfiles import BRAKED, CHAINS, FILES

import hystgen
from hystgen.emission.calls import emitted_files
from hystgen.model import Model
from hystgen.parameters.files import parse_parameters
from hystgen.verification import compilers, targets

pytestmark = pytest.mark.thorough

REQUIRED = bool(os.environ.get("CI"))
ARITHMETICS = ("float32", "float64", "q31", "q15")
KEYWORDS = words(
    """
    auto bool break case char const continue default do double else enum extern false float for goto if inline int
    long register return short signed sizeof static struct switch true typedef union unsigned void volatile while
    """
)
STANDARD = "".join(f"#include <{name}.h>\n" for name in ("float", "stdbool", "stddef", "stdint"))
C_HEADERS = (
    "assert complex ctype errno fenv inttypes limits locale math setjmp signal stdarg stdio stdlib string tgmath time "
    "wchar wctype"
)
POSIX_HEADERS = (
    "dirent dlfcn fcntl netdb netinet/in poll pthread semaphore sys/param sys/socket sys/stat sys/sysmacros sys/time "
    "sys/types termios unistd"
)
AVR_HEADERS = "avr/io avr/pgmspace avr/interrupt avr/sleep avr/eeprom util/delay util/atomic math stdlib string stdio"
ZIG = (sys.executable, "-m", "ziglang", "cc")

HEADERS: dict[str, tuple[Sequence[str], str, bool]] = {  # compiler, headers to include, whether only CI must have it
    "windows": ((*ZIG, "-target", "x86_64-windows-gnu"), "winsock2 windows objbase math complex", False),
    "avr": (("avr-gcc", *targets.AVR.gcc_flags, "-std=gnu99", "-DF_CPU=16000000", "-O1"), AVR_HEADERS, True),
    "newlib": (("arm-none-eabi-gcc", "-std=gnu11"), C_HEADERS, True),
    "posix": (("gcc", "-std=gnu11", "-D_GNU_SOURCE"), f"{C_HEADERS} {POSIX_HEADERS}", True),
}


def model(name: str) -> Model:
    return Model(parse_parameters({**FILES, **CHAINS, "braked": BRAKED}[name], f"{name}.yaml"))


def identifiers(text: str, own: str) -> set[str]:
    """The identifiers of a C text, except those that begin with `own` or the prefix of the run time."""
    text = re.sub(r"/\*.*?\*/", " ", text, flags=re.DOTALL)
    text = re.sub(r"^#\s*(error|include|pragma)\b.*$", " ", text, flags=re.MULTILINE)
    text = re.sub(r'"[^"\n]*"|\'[^\'\n]*\'', " ", text)
    text = re.sub(r"(?<!\w)\.?\d[\w.]*", " ", text)
    found = set(re.findall(r"[A-Za-z_]\w*", text))
    return {word for word in found - KEYWORDS if not word.lower().startswith((f"{own}_", "hystgen_"))}


EFFECTS = ("braked", "lagging", "soft_dashpot", "dilated", "viscous", "rubbed", "heated", "worn", "drifting", "late")
"""Models that together have all effects."""


@functools.cache
def emitted() -> frozenset[str]:
    """The identifiers of every kind of model, arithmetic, engine and layout."""
    found: set[str] = set()
    kinds = ("listed", "below", "outside", "two_branches", "mixed", "linear")  # every case that templates distinguish
    layouts = ("self-contained", "shared-runtime")  # a single header is the first of these in one file
    for name, arithmetic, engine, layout in itertools.product(kinds, ARITHMETICS, ("corners", "loop"), layouts):
        options = {"operator": "both", "arithmetic": arithmetic, "engine": engine, "layout": layout}
        for text in emitted_files(model(name), **options).values():
            found |= identifiers(text, name)
    for name, arithmetic in itertools.product(EFFECTS, ("float32", "q31")):
        for text in emitted_files(model(name), arithmetic=arithmetic, engine="loop").values():
            found |= identifiers(text, name)
    return frozenset(found)


def macros(compiler: Sequence[str], text: str) -> set[str]:
    """Names of the macros that are defined after a C text."""
    done = subprocess.run(
        [*compiler, "-dM", "-E", "-x", "c", "-"], input=text, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return set(re.findall(r"^#define (\w+)", done.stdout, flags=re.MULTILINE))


def includes(names: str) -> str:
    return STANDARD + "".join(f"#include <{name}.h>\n" for name in names.split())


def compiler_and_headers(kind: str) -> tuple[Sequence[str], str]:
    compiler, names, optional = HEADERS[kind]
    if optional and not REQUIRED and shutil.which(compiler[0]) is None:
        pytest.skip(f"{compiler[0]} is not installed")
    return compiler, names


def test_names_are_seen_where_a_compiler_sees_them() -> None:
    text = 'bool near; /* far */ x.most = 1.5e3f; "huge"; own_small(I);\n#error small\n#define HYSTGEN_X PI\n'
    assert identifiers(text, "own") == {"near", "x", "most", "I", "define", "PI"}
    assert {"self", "status", "reference", "corner", "uint_least16_t"} <= emitted()
    assert {"near", "far", "min", "B0", "B00000000", "PI", "BIT31", "TIM2", "F"} <= NAMES


def test_no_emitted_name_is_one_of_other_headers() -> None:
    assert not emitted() & NAMES


@pytest.mark.parametrize("kind", HEADERS)
def test_no_emitted_name_is_a_macro_of_these_headers(kind: str) -> None:
    compiler, names = compiler_and_headers(kind)
    theirs = macros(compiler, includes(names)) - macros(compiler, STANDARD)
    assert len(theirs) > 500, "the headers were read"
    assert not emitted() & theirs


def test_limits_and_constants_of_stdint_are_not_used() -> None:
    """C++98 has them only if a macro such as __STDC_LIMIT_MACROS is defined before <stdint.h> is first included."""
    assert not {name for name in emitted() if re.fullmatch(r"U?INT\w*_(MAX|MIN|C)|SIZE_MAX", name)}


@pytest.mark.slow(one_in=2)
@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize("kind", ["list", *HEADERS])
def test_compiles_behind_other_headers(kind: str, arithmetic: str, tmp_path: Path) -> None:
    """The C compiles after the headers themselves, and where every listed name is a macro of invalid code."""
    if kind == "avr" and arithmetic == "float64":
        pytest.skip("a double of the AVR is a float")
    for layout in ("single-header", "shared-runtime"):
        folder = tmp_path / layout
        hystgen.emit(model("mixed"), folder, operator="both", arithmetic=arithmetic, engine="corners", layout=layout)
        if layout == "single-header":
            (folder / "mixed.c").write_text('#define MIXED_IMPLEMENTATION\n#include "mixed.h"\n')
        before = folder / "before.h"
        if kind == "list":
            poison = "".join(f"#undef {name}\n#define {name} @{name}\n" for name in sorted(NAMES))
            before.write_text(STANDARD + poison)
            commands = [[*c.command, "-std=c99"] for c in compilers.available()]
        else:
            command, names = compiler_and_headers(kind)
            before.write_text(includes(names))
            commands = [list(command)]
        for command in commands:
            for source in sorted(folder.glob("*.c")):
                done = subprocess.run(
                    [*command, "-Wall", "-Werror", "-include", before, "-c", "-o", folder / "one.o", source],
                    capture_output=True, text=True, check=False,
                )  # fmt: skip
                assert done.returncode == 0, done.stderr
