"""How a text table is laid out: what separates its cells, where its header, its units and its numbers are.

The numbers show it: of all ways to separate cells and to write decimals the one that makes numbers of most cells of the
first lines is that of the file. Header and units are then the lines above them with as many cells.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from hystgen.records import columns
from hystgen.records.cells import BLANKS, Dialect, is_comment
from hystgen.records.columns import STANDARD, column, meaning, unit_alone
from hystgen.records.reading import Reading

DELIMITERS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": '"|"', BLANKS: "blanks"}
"""What may separate cells, the less ambiguous first, and in words."""

_RULE = re.compile(r"\s*([-=_*~])\1{2,}[\s\-=_*~+]*")
"""A line that is drawn, not written."""

_MARKS = re.compile(r"^[\s#%/]+")

EXAMPLES = {1: "v=#1", 2: "1,2 --sample-time SECONDS"}
"""How to name columns by their numbers in a table of this many columns."""

EXAMPLE = "1,2,3"
"""The same for every wider table."""


@dataclass
class Layout:
    """A text table: `names` and `units` of its columns, in lines counted from 1.

    `also`: second names of columns; `header`: line of the names, None where there is none; `first`: line from which on
    there are rows; `steps`: what the lines above say of the sample rate; `kind`: the instrument's format, empty for
    text in general; `clocks`: columns of times of day; `rows`: number of rows the file says it has; `another`: text
    that would begin another table.
    """

    dialect: Dialect
    names: list[str]
    first: int
    header: int | None = None
    units: list[str] = field(default_factory=list)
    also: list[str] = field(default_factory=list)
    steps: list[columns.Step] = field(default_factory=list)
    kind: str = ""
    clocks: frozenset[int] = frozenset()
    rows: int | None = None
    another: str = ""


@dataclass(frozen=True)
class _Line:
    number: int
    text: str
    comment: bool


@dataclass(frozen=True)
class _View:
    """The lines as one dialect sees them: rows of `width` cells, `score` more of them numbers than text."""

    dialect: Dialect
    width: int
    score: int
    numeric: frozenset[int]
    start: int


def find(reading: Reading, lines: Sequence[str]) -> Layout:
    """The layout of a table by its first lines. Raises RecordError where nothing or more than one thing fits."""
    seen = [
        _Line(number, text, is_comment(text))
        for number, text in enumerate(lines, 1)
        if text.strip() and not _RULE.fullmatch(text)
    ]
    dialects = _dialects(reading, lines)
    views = [view for dialect in dialects if (view := _view(dialect, seen)) is not None]
    if not views:
        return _without_numbers(reading, seen, dialects)
    best: tuple[_View, Layout | None] | None = None
    for view in sorted(views, key=lambda each: (each.width < 2, -each.score)):
        layout = _with_header(reading, view, seen)
        if best is None or (best[1] is None and layout is not None):
            best = view, layout
    assert best is not None
    view, layout = best
    _decided(reading, view, seen)
    if layout is None:
        layout = _headerless(reading, view, seen)
    above = [(line.number, line.text) for line in seen if line.number < layout.first and line.number != layout.header]
    layout.steps = columns.from_lines(above, layout.dialect.decimal)
    layout.clocks = _clocks(view, seen)
    return layout


def _dialects(reading: Reading, lines: Sequence[str]) -> list[Dialect]:
    """Everything that may separate cells, with either mark of decimals."""
    quoted = any('"' in line for line in lines)
    delimiters = [reading.delimiter] if reading.delimiter else list(DELIMITERS)
    found = []
    for delimiter in delimiters:
        if delimiter == BLANKS or reading.delimiter or any(delimiter in line for line in lines):
            found.append(Dialect(delimiter))
            if delimiter != "," or quoted:
                found.append(Dialect(delimiter, ","))
    return found


def _view(dialect: Dialect, lines: Sequence[_Line]) -> _View | None:
    """The lines seen by a dialect; None where they are no table of numbers then."""
    rows = [[cell for _, cell in dialect.cells(line.text)] if not line.comment else [] for line in lines]
    weights = [[dialect.weight(cell) for cell in row] for row in rows]
    widths = Counter(len(row) for row in weights if 1 in row)
    if not widths:
        return None
    most = max(widths.values())
    width = max(width for width, number in widths.items() if number == most)
    body = [row for row in weights if len(row) == width and 1 in row]
    score = sum(map(sum, body))
    numeric = frozenset(k for k in range(width) if sum(row[k] for row in body) > 0)
    clean = [
        k for k, row in enumerate(weights) if len(row) == width and 1 in row and all(row[c] >= 0 for c in numeric)
    ]
    if score <= 0 or not clean:
        return None
    return _View(dialect, width, score, numeric, clean[0])


def _with_header(reading: Reading, view: _View, lines: Sequence[_Line]) -> Layout | None:
    """The layout with the header in plain text, or that in a comment right above the numbers where it means more."""
    plain, comment = _plain_header(view, lines), _comment_header(view, lines)
    if plain is None or comment is None:
        return plain or comment

    def known(found: Layout) -> int:
        columns = [column(name, unit=unit) for name, unit in zip(found.names, found.units, strict=True)]
        asked = {*STANDARD, "u", *reading.columns.values()}
        return sum(bool({c.name, c.label} & asked or meaning(c)) for c in columns)

    return comment if known(comment) > known(plain) else plain


def _plain_header(view: _View, lines: Sequence[_Line]) -> Layout | None:
    """The layout with a header that is no comment; None where there is none."""
    block = []
    for k in range(view.start - 1, -1, -1):
        if lines[k].comment:
            continue
        names = _names(view, lines[k].text)
        if names is not None:
            block.append((lines[k], names))
        elif all(view.dialect.weight(cell) <= 0 for _, cell in view.dialect.cells(lines[k].text)):
            break
    # The lowest line without a number is the header, or the units below it; others are rows with faults
    for place, (line, names) in enumerate(block):
        if not any(view.dialect.weight(name) > 0 for name in names):
            if _are_units(names) and place + 1 < len(block) and _may_be_names(view, block[place + 1][1]):
                above, upper = block[place + 1]
                return _made(view, upper, above.number, _next(lines, line), names)
            return _made(view, names, line.number, _next(lines, line))
    if block and _may_be_names(view, block[-1][1]):
        line, names = block[-1]
        return _made(view, names, line.number, _next(lines, line))
    return None


def _next(lines: Sequence[_Line], above: _Line) -> int:
    """Number of the line below one that has rows below it."""
    return next(line.number for line in lines if line.number > above.number)


def _made(view: _View, names: list[str], header: int, first: int, units: Sequence[str] = ()) -> Layout:
    of = [unit_alone(unit) or "" for unit in units] or [""] * len(names)
    return Layout(view.dialect, names, first, header, of)


def _names(view: _View, text: str) -> list[str] | None:
    """Cells of a line that has as many as the rows have; None for any other line.

    A last cell without a name may be missing in the header or in the rows.
    """
    names = [cell.strip() for _, cell in view.dialect.cells(text)]
    if view.dialect.delimiter == BLANKS and len(names) != view.width:
        names = [cell.strip() for cell in re.split(r"\t+|\s{2,}", text.strip())]
        if len(names) != view.width:
            names = re.sub(r"\s+(?=[\[(])", "\0", text.strip()).split()
            names = [name.replace("\0", " ") for name in names]
    if len(names) == view.width + 1 and not names[-1]:
        names.pop()
    if len(names) == view.width - 1 and len(names) > 1 and view.width - 1 not in view.numeric:
        names.append("")
    return names if len(names) == view.width else None


def _comment_header(view: _View, lines: Sequence[_Line]) -> Layout | None:
    """The header that stands in the comments right above the numbers."""
    comments: list[_Line] = []
    for line in reversed(lines[: view.start]):
        if not line.comment or len(comments) == 2:
            break
        comments.append(line)
    found = []
    for line in comments:
        text = _MARKS.sub("", line.text)
        names = _names(view, text)
        for delimiter in DELIMITERS:
            if names is None:
                names = _names(_View(Dialect(delimiter), view.width, 0, view.numeric, 0), text)
        if names is None or any(view.dialect.weight(name) > 0 for name in names):
            break
        found.append((line, names))
    if not found:
        return None
    first = lines[view.start].number
    line, names = found[0]
    if len(found) == 2 and _are_units(names) and not _are_units(found[1][1]):
        above, upper = found[1]
        return _made(view, upper, above.number, first, names)
    return _made(view, names, line.number, first)


def _headerless(reading: Reading, view: _View, lines: Sequence[_Line]) -> Layout:
    """The layout of a table whose columns are called by their numbers. Raises RecordError when they are not."""
    start = view.start
    while start and not lines[start - 1].comment and len(view.dialect.cells(lines[start - 1].text)) == view.width:
        start -= 1
    first = lines[start].number
    if not any(theirs.lstrip("#").isdecimal() for theirs in reading.columns.values()):
        above = [line for line in lines[:start] if not line.comment]
        if above and view.width > 1:
            cells = len(view.dialect.cells(above[-1].text))
            if cells > 1:
                raise reading.refuse(
                    f"the line above the numbers has {cells} cells, they have {view.width}; correct the header, or "
                    f"name columns by their numbers with --columns {EXAMPLES.get(view.width, EXAMPLE)}",
                    above[-1].number,
                )
        of = {1: "drive", 2: "drive, measured"}.get(view.width, "time, drive, measured")
        raise reading.refuse(
            f"the first line has numbers, not names; say which columns they are with --columns "
            f"{EXAMPLES.get(view.width, EXAMPLE)} ({of}), or put a header such as t,v,y above them",
            first,
        )
    return Layout(view.dialect, [str(k + 1) for k in range(view.width)], first)


def _without_numbers(reading: Reading, lines: Sequence[_Line], dialects: Sequence[Dialect]) -> Layout:
    """The layout of a file without a row of numbers: its first line is the header."""
    header = next((line for line in lines if not line.comment), None)
    if header is None:
        raise reading.refuse(
            "has no header row; the first line names the columns, for example t,v,y"
            if lines
            else "is empty; record again or give another file"
        )
    dialect = max(dialects, key=lambda each: len(each.cells(header.text)), default=Dialect())
    if reading.delimiter is None and len(Dialect().cells(header.text)) > 1:
        dialect = Dialect()
    names = [cell.strip() for _, cell in dialect.cells(header.text)]
    return Layout(dialect, names, header.number + 1, header.number)


def _decided(reading: Reading, view: _View, lines: Sequence[_Line]) -> None:
    """Refuse decimal commas all of which may be thousands marks."""
    if view.dialect.decimal == ".":
        return
    place, doubtful = None, ""
    for line in lines[view.start :]:
        cells = view.dialect.cells(line.text) if not line.comment else []
        for k, (start, cell) in enumerate(cells if len(cells) == view.width else []):
            if k in view.numeric and "," in cell:
                if not view.dialect.either(cell):
                    return
                place, doubtful = place or (line.number, start + 1), doubtful or cell.strip()
    if place is not None:
        reading.problem(
            f'"{doubtful}" may be {doubtful.replace(",", ".")} or {doubtful.replace(",", "")}; export numbers without '
            "thousands marks and with decimal points",
            *place,
        )
        reading.refuse_if_any()


def _clocks(view: _View, lines: Sequence[_Line]) -> frozenset[int]:
    """The columns whose first cells are times of day and no numbers."""
    cells = [cell for _, cell in view.dialect.cells(lines[view.start].text)]
    found = set()
    for k in view.numeric:
        try:
            view.dialect.number(cells[k])
        except ValueError:
            found.add(k)
    return frozenset(found)


def _are_units(cells: Sequence[str]) -> bool:
    """Whether cells are units and nothing else, at least half of them."""
    units = [unit_alone(cell) for cell in cells if cell]
    return None not in units and 2 * len(units) >= len(cells) > 0


def _may_be_names(view: _View, cells: Sequence[str]) -> bool:
    """Whether a line may hold names, some of which are numbers, as those of channels."""
    text = {cell for cell in cells if view.dialect.weight(cell) < 0}
    numbers = all(cell in text or cell.isdecimal() for cell in cells if cell)
    return numbers and cells[0] in text and not _are_units(cells)
