"""Numbers and arrays as C text: exact literals, wrapped lines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

WIDTH = 110


def literal(x: Any) -> str:
    """The C literal that gives exactly this float32, float64 or whole number back, the shortest one."""
    if isinstance(x, np.integer | int):
        return str(x)
    if not np.isfinite(x):
        raise ValueError("only finite numbers have a literal")
    return f"{np.float32(x)!s}f" if isinstance(x, np.float32) else repr(float(x))


def operand(x: Any) -> str:
    """A literal that can stand in an expression."""
    text = literal(x)
    return f"({text})" if text.startswith("-") else text


def table(kind: str, name: str, values: Sequence[Any]) -> str:
    """A constant array of literals."""
    lines = [f"static const {kind} {name}[{len(values)}] = {{", "   "]
    for i, value in enumerate(values):
        item = " " + literal(value) + ("u" if kind == "uint32_t" else "") + ("," if i + 1 < len(values) else "")
        if len(lines[-1]) + len(item) > WIDTH:
            lines.append("   ")
        lines[-1] += item
    return "\n".join([*lines, "};"]) + "\n"
