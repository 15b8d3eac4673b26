"""A self-contained HTML page: text, tables and figures, without scripts or external files."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from hystgen.emission import runtime


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


@dataclass(frozen=True)
class Details:
    """Preformatted text that opens when its summary is clicked."""

    summary: str
    text: str
    kind: str = "details"


@dataclass(frozen=True)
class Section:
    """A heading and its content."""

    title: str
    blocks: Sequence[Text | Listing | HtmlTable | Picture | Details]


def page(title: str, lead: Sequence[Text], sections: Sequence[Section]) -> str:
    """The page: `title`, a `lead` with the main result in a few words, and the sections."""
    template = runtime.environment().overlay(autoescape=True).get_template("report.html.j2")
    return template.render(title=title, lead=lead, sections=sections, data_uri=_data_uri)


def _data_uri(svg: bytes) -> Markup:
    return Markup("data:image/svg+xml;base64," + base64.b64encode(svg).decode("ascii"))
