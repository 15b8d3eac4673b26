"""A self-contained HTML page: text, tables and figures, and one script to zoom; no external files."""

from __future__ import annotations

import base64
import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ParamSpec, TypeVar

from markupsafe import Markup

from hystgen.basics import drawing
from hystgen.basics.presented import Presented
from hystgen.emission import runtime
from hystgen.report import viewer
from hystgen.report.viewer import Viewer

if TYPE_CHECKING:
    from matplotlib.figure import Figure

P = ParamSpec("P")
R = TypeVar("R", bound=Presented)


def presented(find: Callable[P, R], page: Callable[[R], str], draw: Callable[[R], Figure]) -> Callable[P, R]:
    """`find`, whose results get this page and this picture."""

    @functools.wraps(find)
    def found(*given: P.args, **named: P.kwargs) -> R:
        made = find(*given, **named)
        return replace(made, page=functools.partial(page, made), draw=functools.partial(draw, made))

    return found


@dataclass(frozen=True)
class Text:
    """A paragraph; `command` is set below it as code."""

    text: str
    command: str = ""
    kind: str = "text"


@dataclass(frozen=True)
class Listing:
    """A bulleted list."""

    items: Sequence[str]
    kind: str = "listing"


@dataclass(frozen=True)
class HtmlTable:
    """`rows[0]` is the head; columns in `words` hold text, the others numbers; row `marked` is highlighted."""

    rows: Sequence[Sequence[str]]
    words: Sequence[int]
    marked: int | None = None
    kind: str = "table"


@dataclass(frozen=True)
class Picture:
    """A picture as SVG, in one layout for wide pages and one for phones; `alt` is its text description."""

    name: str
    wide: bytes
    narrow: bytes
    caption: str
    alt: str
    kind: str = "figure"


def drawn(
    name: str, draw: Callable[[float], Figure], widths: tuple[float, float], caption: str, alt: str
) -> Picture:
    """The picture that `draw` makes at the width of a screen and of a phone, in inches. Raises PlotError."""
    with drawing.styled():
        wide, narrow = (drawing.content(draw(width), "svg") for width in widths)
    return Picture(name, wide, narrow, caption, alt)


@dataclass(frozen=True)
class Details:
    """Preformatted text that opens when its summary is clicked."""

    summary: str
    text: str
    kind: str = "details"


@dataclass(frozen=True)
class Folded:
    """Blocks that open when their summary is clicked."""

    summary: str
    blocks: Sequence[Text | HtmlTable]
    kind: str = "folded"


@dataclass(frozen=True)
class Section:
    """A heading and its content."""

    title: str
    blocks: Sequence[Text | Listing | HtmlTable | Picture | Details | Folded | Viewer]


def page(title: str, lead: Sequence[Text], sections: Sequence[Section]) -> str:
    """The page: `title`, a `lead` with the main result in a few words, and the sections.

    The page's content security policy allows no script but that of the viewers, known by its hash.
    """
    template = runtime.environment().overlay(autoescape=True).get_template("report.html.j2")
    zooms = any(isinstance(block, Viewer) for section in sections for block in section.blocks)
    return template.render(
        title=title,
        lead=lead,
        sections=sections,
        data_uri=_data_uri,
        script=Markup(viewer.script()) if zooms else "",
        script_hash=viewer.script_hash(),
    )


def _data_uri(svg: bytes) -> Markup:
    return Markup("data:image/svg+xml;base64," + base64.b64encode(svg).decode("ascii"))
