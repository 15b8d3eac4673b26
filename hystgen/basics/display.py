"""Notebook display of results: a line, a table as text and, with matplotlib, a picture."""

from __future__ import annotations

import html
from collections.abc import Callable
from typing import TYPE_CHECKING

from hystgen.basics import drawing

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def block(line: str, table: str = "", draw: Callable[[], Figure] | None = None) -> str:
    """HTML for a line, a text table below it and, if matplotlib is installed, the figure that `draw` makes."""
    parts = [f"<p>{html.escape(line.strip('<>'))}</p>"]
    if table:
        parts.append(f"<pre>{html.escape(table)}</pre>")
    if draw is not None:
        try:
            with drawing.styled():
                parts.append(drawing.content(draw(), "svg").decode("utf-8").partition("?>")[2])
        except drawing.PlotError:
            pass
    return "".join(parts)
