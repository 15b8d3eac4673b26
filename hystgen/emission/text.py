"""Numbers and arrays as C text: exact literals, wrapped lines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

WIDTH = 100


def literal(x: Any) -> str:
    """The C literal that gives exactly this float32, float64 or whole number back, the shortest one.

    Whole numbers keep their value in every dialect: without the suffix C90 and C++98 take one beyond `long` as
    unsigned, and the smallest number of a type is no literal in any.
    """
    if isinstance(x, np.integer | int):
        return _whole(int(x))
    if not np.isfinite(x):
        raise ValueError("only finite numbers have a literal")
    return f"{np.float32(x)!s}f" if isinstance(x, np.float32) else repr(float(x))


def _whole(x: int) -> str:
    if x in (-(1 << 31), -(1 << 63)):
        return f"({_whole(x + 1)} - 1)"
    return f"{x}LL" if abs(x) >= 1 << 31 else str(x)


def operand(x: Any) -> str:
    """A literal that can stand in an expression."""
    text = literal(x)
    return f"({text})" if text.startswith("-") else text


def _wrapped(values: Sequence[Any], suffix: str, indent: str) -> list[str]:
    """Lines of literals."""
    lines = [indent]
    for i, value in enumerate(values):
        item = " " + (f"{value}{suffix}" if suffix else literal(value)) + ("," if i + 1 < len(values) else "")
        if len(lines[-1]) + len(item) > WIDTH:
            lines.append(indent)
        lines[-1] += item
    return lines


def constant(declared: str, lines: Sequence[str]) -> str:
    """A constant with these lines between its braces, in one line where there is room."""
    whole = f"static const {declared} = {{{lines[0].strip()}}};"
    if len(lines) == 1 and len(whole) <= WIDTH:
        return whole + "\n"
    return "\n".join([f"static const {declared} = {{", *lines, "};"]) + "\n"


def table(kind: str, name: str, values: Sequence[Any]) -> str:
    """A constant array of literals."""
    lines = _wrapped(values, "u" if kind == "uint32_t" else "", "   ")
    return constant(f"{kind} {name}[{len(values)}]", lines)


def structure(kind: str, name: str, columns: Sequence[tuple[str, Sequence[Any]]]) -> str:
    """Constant arrays of literals in one structure, so that compilers reach all of them from one address."""
    members = [f"    {kind} {own}[{len(values)}];" for own, values in columns]
    lines = []
    for i, (own, values) in enumerate(columns):
        end = "    }" + ("," if i + 1 < len(columns) else "")
        lines += [f"    {{ /* {own} */", *_wrapped(values, "", "       "), end]
    return "\n".join(["static const struct {", *members, f"}} {name} = {{", *lines, "};"]) + "\n"
