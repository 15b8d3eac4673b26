"""Notebook display of results: a line, a text or a table and, with matplotlib, a picture."""

from __future__ import annotations

import html
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from hystgen.basics import drawing

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def block(
    line: str, text: str = "", draw: Callable[[], Figure] | None = None, rows: Sequence[Sequence[str]] = ()
) -> str:
    """HTML for a line; below it a table, if there are `rows`, the first of which is the head; text with its line
    breaks; and, if matplotlib is installed, the figure that `draw` makes."""
    parts = [f"<p>{html.escape(line.strip('<>'))}</p>"]
    if rows:
        parts.append(table(rows))
    if text:
        parts.append(f'<pre style="white-space: pre-wrap">{html.escape(text)}</pre>')
    if draw is not None:
        try:
            with drawing.styled():
                parts.append(drawing.content(draw(), "svg").decode("utf-8").partition("?>")[2])
        except drawing.PlotError:
            pass
    return "".join(parts)


def table(rows: Sequence[Sequence[str]]) -> str:
    """An HTML table; the first row is its head, and columns of numbers are aligned to the right."""
    head, *body = rows
    numbers = [bool(body) and all(_is_number(row[k]) for row in body) for k in range(len(head))]

    def line(row: Sequence[str], tag: str) -> str:
        sides = ("right" if number else "left" for number in numbers)
        cells = zip(row, sides, strict=True)
        return "".join(f'<{tag} style="text-align: {side}">{html.escape(cell)}</{tag}>' for cell, side in cells)

    below = "".join(f"<tr>{line(row, 'td')}</tr>" for row in body)
    return f"<table><thead><tr>{line(head, 'th')}</tr></thead><tbody>{below}</tbody></table>"


def _is_number(cell: str) -> bool:
    """Whether a cell holds a number, or nothing in place of one."""
    try:
        float(cell.rstrip("% ") or "0")
    except ValueError:
        return cell == "-"
    return True
