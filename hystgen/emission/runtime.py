"""The hand-written kernels of `c_runtime/`, as text to be carried by emitted files.

A kernel file is a sequence of top-level pieces (functions, tables, types). Only the pieces that a model needs are
carried, under the model's own prefix.
"""

from __future__ import annotations

import functools
import itertools
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

VERSION = 1  # of the interface between emitted models and a shared run time

FLOAT_KERNELS = (
    "tanh_{bits}.c",
    "atanh_{bits}.c",
    "envelope_forward.c",
    "envelope_inverse.c",
    "dead_zone_forward.c",
    "dead_zone_inverse.c",
    "corners_float.c",
    "loop_absorb.c",
    "loop_solve.c",
)
FIXED_KERNELS = (
    "over_slope.c",
    "corners_fixed.c",
    "loop_absorb.c",
    "loop_solve_fixed.c",
    "curve.c",
)


@dataclass(frozen=True)
class Family:
    """How an arithmetic appears in C: `bits` names it, `real` is the type of inputs and answers.

    In floating point every number has that type, and `real_max` is its largest; in fixed point `reach` is that of where
    plays start to follow.
    """

    bits: str
    real: str
    real_max: str = ""
    reach: str = ""

    @property
    def fixed(self) -> bool:
        """Whether it is fixed point."""
        return bool(self.reach)

    @property
    def half(self) -> str:
        """1/2 as a number of a floating type."""
        return "0.5f" if self.real == "float" else "0.5"

    @property
    def tables(self) -> tuple[str, ...]:
        """The headers of the run time that have the types of its tables."""
        if self.fixed:
            return ("hystgen_corners_fixed_tables.h", "hystgen_tables_fixed.h")
        return ("hystgen_corners_tables.h", "hystgen_tables_float.h")

    @property
    def states(self) -> tuple[str, ...]:
        """The headers of the run time that have the types of its memory."""
        return ("hystgen_corners_fixed_state.h",) if self.fixed else ("hystgen_corners_state.h",)


FAMILIES = {
    "float32": Family("f32", "float", "FLT_MAX"),
    "float64": Family("f64", "double", "DBL_MAX"),
    "q31": Family("q31", "int32_t", reach="int64_t"),
    "q15": Family("q15", "int16_t", reach="int32_t"),
}


SOFT = {
    "f32": "(defined(__arm__) && !defined(__ARM_FP))"
    " || (defined(__riscv) && !defined(__riscv_flen)) || defined(__AVR__)",
    "f64": "(defined(__arm__) && (!defined(__ARM_FP) || (__ARM_FP & 8) == 0))"
    " || (defined(__riscv) && (!defined(__riscv_flen) || __riscv_flen < 64)) || defined(__AVR__)",
}
"""HYSTGEN_SOFT_FLOAT: where each operation of a number is a call of a library."""


def data_folder(name: str) -> Path:
    """`templates` or `c_runtime`: inside the installed package, or at the top of the checkout."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "_data" / name
    return installed if installed.is_dir() else package.parent / name


@dataclass(frozen=True)
class Piece:
    """A top-level piece of C with the comment above it."""

    name: str
    text: str
    uses: frozenset[str]


def split_pieces(source: str) -> list[Piece]:
    """The top-level pieces of a kernel file, preprocessor lines left out."""
    pieces = []
    lines: list[str] = []
    depth = 0
    comment = False
    for line in source.splitlines():
        inside, comment = comment, False
        code = line
        if inside:
            _, comment_ends, code = line.partition("*/")
            comment = not comment_ends
        code = re.sub(r"/\*.*?\*/", "", code)
        if "/*" in code:
            code, comment = code.partition("/*")[0], True
        if not depth and (line.startswith("#") or (not lines and not line.strip())):
            continue
        lines.append(line)
        depth += code.count("{") - code.count("}")
        if not depth and re.search(r"[};]\s*$", code):
            text = "\n".join(lines) + "\n"
            names = re.findall(r"\bhystgen_\w+", re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL))
            own = _defined_name(text)
            pieces.append(Piece(own, text, frozenset(names) - {own}))
            lines = []
    return pieces


def _defined_name(text: str) -> str:
    code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    typedef = re.search(r"}\s*(hystgen_\w+);\s*$", code)
    if typedef and "typedef" in code:
        return typedef.group(1)
    declared = re.search(r"(hystgen_\w+)\s*[\[(]", code)
    assert declared, f"no name in: {text}"
    return declared.group(1)


@functools.cache
def _read(name: str) -> str:
    return (data_folder("c_runtime") / name).read_text(encoding="utf-8")


def kernel_pieces(family: Family) -> list[Piece]:
    """Every piece of every kernel file of an arithmetic, callees before callers."""
    files = FIXED_KERNELS if family.fixed else FLOAT_KERNELS
    return [piece for name in files for piece in split_pieces(_read(name.format(bits=family.bits)))]


def needed(pieces: Iterable[Piece], roots: Iterable[str]) -> list[Piece]:
    """The pieces that `roots` lead to, in file order. Raises KeyError for a root that no piece defines."""
    by_name = {piece.name: piece for piece in pieces}
    wanted: set[str] = set()
    queue = list(roots)
    for root in queue:
        by_name[root]
    while queue:
        name = queue.pop()
        if name in by_name and name not in wanted:
            wanted.add(name)
            queue.extend(by_name[name].uses)
    return [piece for piece in by_name.values() if piece.name in wanted]


def render(pieces: Iterable[Piece], prefix: str, family: Family, static: bool) -> str:
    """The pieces as C text under `prefix`; `static` for files that carry them as their own."""
    text = "\n".join(piece.text for piece in pieces)
    text = text.replace("HYSTGEN_API ", "static " if static else "")
    text = text.replace("HYSTGEN_KERNEL ", "HYSTGEN_APART " if static else "")
    return _named(text, prefix, family)


OPERATOR = re.compile(r"\bhystgen_((?:inverse|forward|front|clamp_drive|code|model)\w*)")
"""What belongs to a model and not to a run time that models may share."""


def operators(files: Sequence[str], name: str, corners: int, prefix: str, family: Family) -> str:
    """Operators of files of the run time as C text of the model `name`; their kernels are named after `prefix`."""
    pieces = [piece for file in files for piece in split_pieces(_read(file))]
    text = OPERATOR.sub(rf"{name}_\1", "\n".join(piece.text for piece in pieces))
    text = text.replace("HYSTGEN_APART_IN_FLOAT ", "static " if family.fixed else "HYSTGEN_APART ")
    return _named(text.replace("HYSTGEN_CORNERS", str(corners)), prefix, family, name)


def _named(text: str, prefix: str, family: Family, name: str | None = None) -> str:
    if not family.fixed:  # one type for everything
        text = re.sub(r"\(hystgen_(play|reach|sum)_t\)", "", text)
        text = re.sub(r"hystgen_(play|reach|sum)_t", "hystgen_real_t", text)
        text = text.replace("HYSTGEN_REAL_MAX", family.real_max).replace("HYSTGEN_HALF", family.half)
        text = text.replace("#if HYSTGEN_SOFT_FLOAT", f"#if {SOFT[family.bits]}")
    return aligned(text.replace("hystgen_", prefix + "_").replace("HYSTGEN_", (name or prefix).upper() + "_"))


def aligned(text: str) -> str:
    """C text whose lines inside parentheses begin below the first character in them, as before names were put in."""
    lines = []
    opened: list[int] = []  # columns behind the parentheses that are open
    comment = False
    for line in text.splitlines():
        written = " " * opened[-1] + line.lstrip() if opened and not comment else line
        lines.append(written)
        for at, pair in enumerate(itertools.pairwise(written + " ")):
            if comment:
                comment = pair != ("*", "/")
            elif pair == ("/", "*"):
                comment = True
            elif pair[0] == "(":
                opened.append(at + 1)
            elif pair[0] == ")":
                opened.pop()
    return "\n".join(lines) + "\n" if text.endswith("\n") else "\n".join(lines)


def types(file: str, wanted: Iterable[str], prefix: str, family: Family) -> str:
    """Type definitions of a header of the run time, those named in `wanted` (all of them when empty)."""
    pieces = split_pieces(_read(file))
    chosen = set(wanted) or {piece.name for piece in pieces}
    return _named("\n".join(piece.text for piece in pieces if piece.name in chosen), prefix, family)


def prototypes(prefix: str, family: Family) -> str:
    """Prototypes of all kernels."""
    _, _, text = _read("hystgen_runtime.h").partition('#include "hystgen_tables_fixed.h"')
    fixed, _, others = text.partition("#else")
    _, _, others = others.partition('#include "hystgen_tables_float.h"')
    floating, _, both = others.partition("#endif")
    pieces = split_pieces((fixed if family.fixed else floating) + both)
    return _named("".join(piece.text for piece in pieces), prefix, family)
