"""A self-contained HTML page: text, tables and figures, and one script to zoom; no external files."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from hystgen.emission import runtime
from hystgen.report import viewer
from hystgen.report.viewer import Viewer


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
