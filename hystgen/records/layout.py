"""The layout of a text table: its separator, header lines, units and number format.

The layout is inferred from the numbers: the separator and decimal mark are those that turn the most cells of the first
lines into numbers. Header and units are then the lines above with the same number of cells. Files of some instruments
state their layout in a header.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from hystgen.basics.problems import printable
from hystgen.records import columns
from hystgen.records.cells import BLANKS, Clock, Dialect, is_comment
from hystgen.records.columns import STANDARD, Column, Step, meaning, unit_alone
from hystgen.records.reading import Reading

DELIMITERS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": '"|"', BLANKS: "blanks"}
"""Cell separators, least ambiguous first, and their names."""

_RULE = re.compile(r"\s*([-=_*~])\1{2,}[\s\-=_*~+]*")
"""A ruled line, made of dashes and the like."""

_MARKS = re.compile(r"^[\s#%/]+")

EXAMPLES = {1: "v=#1", 2: "1,2 --sample-time SECONDS"}
"""How to name columns by number in a table with this many columns."""

EXAMPLE = "1,2,3"
"""How to name columns by number in any wider table."""


@dataclass
class TableLayout:
    """A text table: `names` and `units` of its columns; lines are numbered from 1.

    `also`: second names for columns; `header`: line with the names, None if there is none; `first`: first line of the
    rows; `steps`: sample rates given in the lines above; `kind`: the instrument's format, empty for any other text;
    `clocks`: columns with times of day; `rows`: number of rows stated in the file; `another`: text that would begin
    another table; `segments`: further headers among the rows, after which the table continues; `ends`: a line behind
    the rows; `times`: the columns of time, if each is that of the channels behind it; `scale`: factors for columns of
    codes.
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
    segments: Segments | None = None
    ends: str = ""
    times: tuple[int, ...] = ()
    scale: dict[int, float] = field(default_factory=dict)


@dataclass(frozen=True)
class _Line:
    number: int
    text: str
    comment: bool


@dataclass(frozen=True)
class _View:
    """The lines as read in one dialect, in rows of `width` cells; `score`: number cells minus text cells."""

    dialect: Dialect
    width: int
    score: int
    numeric: frozenset[int]
    start: int


def find(reading: Reading, lines: Sequence[str]) -> TableLayout:
    """The layout of a table: from its header if an instrument wrote it, else from the numbers.

    Raises RecordError if no layout fits, or more than one does.
    """
    said = (header(reading, lines) for header in (labview, pi_gcs, tektronix, rigol, yokogawa))
    return next((layout for layout in said if layout is not None), None) or _shown(reading, lines)


def _shown(reading: Reading, lines: Sequence[str]) -> TableLayout:
    """The layout inferred from the numbers."""
    seen = [
        _Line(number, text, is_comment(text))
        for number, text in enumerate(lines, 1)
        if text.strip() and not _RULE.fullmatch(text)
    ]
    dialects = _dialects(reading, lines)
    views = [view for dialect in dialects if (view := _view(dialect, seen)) is not None]
    if not views:
        return _without_numbers(reading, seen, dialects)
    ranked = sorted(views, key=lambda each: (each.width < 2, -each.score))
    found = [(view, _with_header(reading, view, seen)) for view in ranked]
    view, layout = next((each for each in found if each[1] is not None), found[0])
    _decided(reading, view, seen)
    if layout is None:
        layout = _headerless(reading, view, seen)
    above = [(line.number, line.text) for line in seen if line.number < layout.first and line.number != layout.header]
    layout.steps = columns.from_lines(above, layout.dialect.decimal)
    layout.clocks = _clocks(view, seen)
    return layout


def _dialects(reading: Reading, lines: Sequence[str]) -> list[Dialect]:
    """Every possible cell separator, with either decimal mark."""
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
    """The lines as read by a dialect; None if they do not form a table of numbers."""
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


def _with_header(reading: Reading, view: _View, lines: Sequence[_Line]) -> TableLayout | None:
    """The layout with the plain header, or with a commented header above the numbers if it names more of our
    columns."""
    plain, comment = _plain_header(view, lines), _comment_header(view, lines)
    if plain is None or comment is None:
        return plain or comment

    def known(found: TableLayout) -> int:
        columns = [Column(name, unit=unit) for name, unit in zip(found.names, found.units, strict=True)]
        asked = {*STANDARD, "u", *reading.columns.values()}
        return sum(bool({c.name, c.label} & asked or meaning(c)) for c in columns)

    return comment if known(comment) > known(plain) else plain


def _plain_header(view: _View, lines: Sequence[_Line]) -> TableLayout | None:
    """The layout with a header that is not a comment; None if there is no such header."""
    block = []
    for k in range(view.start - 1, -1, -1):
        if lines[k].comment:
            continue
        names = _names(view, lines[k].text)
        if names is not None:
            block.append((lines[k], names))
        elif all(view.dialect.weight(cell) <= 0 for _, cell in view.dialect.cells(lines[k].text)):
            break
    # The lowest line without a number is the header, or the units below it; lines with numbers are faulty rows
    for place, (line, names) in enumerate(block):
        if not any(view.dialect.weight(name) > 0 for name in names):
            more = block[place + 1 : place + 3]
            if len(more) == 2 and not _are_units(names) and _are_units(more[0][1]) and _may_be_names(view, more[1][1]):
                made = _made(view, more[1][1], more[1][0].number, _next(lines, line), more[0][1])
                made.also = names  # Origin writes three lines: long names, units, comments
                return made
            if _are_units(names) and place + 1 < len(block) and _may_be_names(view, block[place + 1][1]):
                above, upper = block[place + 1]
                return _made(view, upper, above.number, _next(lines, line), names)
            return _made(view, names, line.number, _next(lines, line))
    if block and _may_be_names(view, block[-1][1]):
        line, names = block[-1]
        return _made(view, names, line.number, _next(lines, line))
    return None


def _next(lines: Sequence[_Line], above: _Line) -> int:
    """Number of the next line below `above` that is neither blank nor a rule."""
    return next(line.number for line in lines if line.number > above.number)


def _made(view: _View, names: list[str], header: int, first: int, units: Sequence[str] = ()) -> TableLayout:
    of = [unit_alone(unit) or "" for unit in units] or [""] * len(names)
    return TableLayout(view.dialect, names, first, header, of)


def _names(view: _View, text: str) -> list[str] | None:
    """Cells of a line with as many cells as the rows; None for any other line.

    The last cell may be missing in the header, or in the rows if it has no name.
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


def _comment_header(view: _View, lines: Sequence[_Line]) -> TableLayout | None:
    """The header found in the comments right above the numbers."""
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


def _headerless(reading: Reading, view: _View, lines: Sequence[_Line]) -> TableLayout:
    """The layout of a table without a header. Raises RecordError unless the user names its columns by number."""
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
                    f"the line above the numbers has {cells} cells, but rows have {view.width}; correct the header, or "
                    f"name columns by their numbers with --columns {EXAMPLES.get(view.width, EXAMPLE)}",
                    above[-1].number,
                )
        if reading.channel and view.width > 1:
            raise reading.refuse(
                "the first line has numbers, not names; say which column is the time with --columns t=#1", first
            )
        of = {1: "drive", 2: "drive, measured"}.get(view.width, "time, drive, measured")
        if not reading.channel:
            raise reading.refuse(
                f"the first line has numbers, not names; say which columns they are with --columns "
                f"{EXAMPLES.get(view.width, EXAMPLE)} ({of}), or put a header such as t,v,y above them",
                first,
            )
    return TableLayout(view.dialect, [str(k + 1) for k in range(view.width)], first)


def _without_numbers(reading: Reading, lines: Sequence[_Line], dialects: Sequence[Dialect]) -> TableLayout:
    """The layout of a file without a row of numbers: its first line is the header."""
    header = next((line for line in lines if not line.comment), None)
    if header is None:
        raise reading.refuse(
            "has no header row; the first line has to name the columns, for example t,v,y"
            if lines
            else "is empty; record again, or give another file"
        )
    dialect = max(dialects, key=lambda each: len(each.cells(header.text)), default=Dialect())
    if reading.delimiter is None and len(Dialect().cells(header.text)) > 1:
        dialect = Dialect()
    names = [cell.strip() for _, cell in dialect.cells(header.text)]
    return TableLayout(dialect, names, header.number + 1, header.number)


def _decided(reading: Reading, view: _View, lines: Sequence[_Line]) -> None:
    """Refuse decimal commas if every one of them may be a thousands mark."""
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
    """The columns whose first cells are times of day and not numbers."""
    cells = [cell for _, cell in view.dialect.cells(lines[view.start].text)]
    found = set()
    for k in view.numeric:
        try:
            view.dialect.number(cells[k])
        except ValueError:
            found.add(k)
    return frozenset(found)


def _are_units(cells: Sequence[str]) -> bool:
    """Whether all cells are units or empty, with at least half of them units."""
    units = [unit_alone(cell) for cell in cells if cell]
    return None not in units and 2 * len(units) >= len(cells) > 0


def _may_be_names(view: _View, cells: Sequence[str]) -> bool:
    """Whether a line may hold names, even if some are numbers, such as channel numbers."""
    text = {cell for cell in cells if view.dialect.weight(cell) < 0}
    numbers = all(cell in text or cell.isdecimal() for cell in cells if cell)
    return numbers and cells[0] in text and not _are_units(cells)


# Instrument headers; each function returns None for any other file -------------------------------------------


# LabVIEW measurement files (`.lvm`) --------------------------------------------------------------------------


END = "***End_of_Header***"

_SEGMENT = re.compile(r"^(?:Channels\b|\*\*\*Start_Special)", re.MULTILINE)
"""How the header of a further segment begins."""

_OWN_TIMES = "its channels have separate times (X0, Delta_X); export them with a common time, X_Columns One"

_SPECIAL = ("***Start_Special***", "***End_Special***")


def labview(reading: Reading, lines: Sequence[str]) -> TableLayout | None:
    """The layout given by the tags, according to NI's "Specification for the LabVIEW Measurement File (.lvm)".

    The file's tags, then a segment's, each list ending in `***End_of_Header***`, come before the names and rows.
    Further segments continue the rows (see `Segments`); without a time column they are refused.
    """
    if not lines[0].startswith("LabVIEW Measurement"):
        return None
    ends = [number for number, line in enumerate(lines, 1) if line.startswith(END)]
    if len(ends) < 2:
        raise reading.refuse("is a LabVIEW measurement file without a segment; record or export it again", 1)
    delimiter = "," if any(line.startswith("Separator,") for line in lines[: ends[0]]) else "\t"
    file = _tags(lines[: ends[0]], delimiter)
    segment = _tags(lines[ends[0] : ends[1]], delimiter)
    dialect = Dialect(delimiter, (file.get("Decimal_Separator") or ["."])[0] or ".")
    header = ends[1] + 1
    names = [cell.strip() for _, cell in dialect.cells(lines[header - 1])] if len(lines) >= header else []
    if len(names) < 2:
        raise reading.refuse("has no channel names below the header of the segment; export it again", ends[1])
    return _of_segment(reading, dialect, file, segment, names, header)


def _of_segment(
    reading: Reading,
    dialect: Dialect,
    file: dict[str, list[str]],
    segment: dict[str, list[str]],
    names: list[str],
    header: int,
) -> TableLayout:
    found = TableLayout(dialect, names, header + 1, header, kind="LabVIEW measurement file", another=END)
    written = names.copy()
    # The comment at the end of a row is not a channel, and may be missing
    if names[-1] in ("Comment", ""):
        names[-1] = ""
    places = [k for k, name in enumerate(names) if name == "X_Value"]
    channels = [k for k, name in enumerate(names) if name and k not in places]
    found.units = [""] * len(names)
    for k, unit in zip(channels, segment.get("Y_Unit_Label", ()), strict=False):
        found.units[k] = unit
    unit = next(iter(segment.get("X_Unit_Label", ())), "") or (
        "s" if next(iter(segment.get("X_Dimension", ())), "Time") == "Time" else ""
    )
    samples = {text for text in segment.get("Samples", ()) if text}
    if len(samples) == 1 and (only := samples.pop()).isdecimal():
        found.rows = int(only)
    kept = next(iter(file.get("X_Columns", ())), "One")
    absolute = next(iter(file.get("Time_Pref", ())), "") == "Absolute"
    if places and unit == "s" and kept in ("One", "Multi"):
        found.segments = Segments(reading, dialect, places[0], written, segment, absolute)
        found.another = ""
    if kept == "One" and places:
        found.units[places[0]] = unit
        return found
    steps = [_number(reading, dialect, text, "Delta_X", header) for text in segment.get("Delta_X", ()) if text]
    starts = [_number(reading, dialect, text, "X0", header) for text in segment.get("X0", ()) if text]
    if len(set(steps)) > 1 or len(set(starts)) > 1:
        raise reading.refuse(_OWN_TIMES, header)
    if kept == "Multi" and places:
        found.units[places[0]] = unit
        for k in places[1:]:
            names[k] = ""
        return found
    for k in places:
        names[k] = ""
    if steps and unit == "s" and steps[0] > 0.0:
        found.steps = [Step(steps[0], f"Delta_X {steps[0]:g} s")]
    return found


@dataclass
class Segments:
    """Segments of a LabVIEW file after the first: rows of the same channels, each segment under its own header.

    By NI's specification, times are seconds since the date and time of the segment if `Time_Pref` is `Relative`, and
    since the same instant throughout the file if it is `Absolute`. `place`: the time column; `names`, `tags`: names and
    tags of the first segment.
    """

    reading: Reading
    dialect: Dialect
    place: int
    names: list[str]
    tags: dict[str, list[str]]
    absolute: bool

    def begin(self, text: str) -> int:
        """Start of the next header; -1 if there is none."""
        found = _SEGMENT.search(text)
        return found.start() if found else -1

    def end(self, text: str, begin: int) -> int:
        """Start of the rows below a header; -1 if the text ends before them."""
        mark = text.find(END, begin)
        names = text.find("\n", mark) + 1 if mark >= 0 else 0
        return text.find("\n", names) + 1 or -1 if names else -1

    def read(self, header: str, line: int) -> tuple[float, int | None]:
        """Seconds from the first segment to this one, and the number of rows that its header states, or None.

        Raises RecordError if its channels differ from those of the first segment.
        """
        *lines, last = header.rstrip("\n").split("\n")
        tags = _tags(lines, self.dialect.delimiter)
        names = [cell.strip() for _, cell in self.dialect.cells(last)]
        units = [[text for text in each.get("Y_Unit_Label", ()) if text] for each in (tags, self.tags)]
        if [name for name in names if name] != [name for name in self.names if name] or units[0] != units[1]:
            raise self.reading.refuse(
                f"has a segment with other channels ({printable(', '.join(filter(None, names)))}) than the first; one "
                "file is one experiment, export each separately",
                line,
            )
        several = any(len({text for text in tags.get(tag, ()) if text}) > 1 for tag in ("X0", "Delta_X"))
        if several and names.count("X_Value") > 1:
            raise self.reading.refuse(_OWN_TIMES, line)
        rows = {text for text in tags.get("Samples", ()) if text}
        return self._since(tags, line), int(text) if len(rows) == 1 and (text := rows.pop()).isdecimal() else None

    def _since(self, tags: dict[str, list[str]], line: int) -> float:
        """Seconds from the date and time of the first segment to those of another; 0 if either has none."""
        parts = [[next(iter(each.get(tag, ())), "") for tag in ("Date", "Time")] for each in (self.tags, tags)]
        stamps = [" ".join(each).replace(",", ".") if all(each) else "" for each in parts]
        if self.absolute or not all(stamps):
            return 0.0
        clock = Clock()
        try:
            return [clock.seconds(stamp) for stamp in stamps][1]
        except ValueError:
            said = " or ".join(f'"{printable(stamp)}"' for stamp in stamps)
            raise self.reading.refuse(f"{said} is not a date and time; export the file again", line) from None


def _tags(lines: Sequence[str], delimiter: str) -> dict[str, list[str]]:
    """Tags and their values, except those in special blocks."""
    tags: dict[str, list[str]] = {}
    special = False
    for line in lines:
        if line.startswith(_SPECIAL):
            special = line.startswith(_SPECIAL[0])
        elif not special and line.strip():
            tag, *values = line.split(delimiter)
            # The last value may be followed by a separator
            tags[tag.strip()] = [value.strip() for value in values]
    return tags


def _number(reading: Reading, dialect: Dialect, text: str, tag: str, line: int) -> float:
    try:
        # Versions differ in whether tags use the decimal separator of the rows
        return float(text.replace(dialect.decimal, "."))
    except ValueError:
        raise reading.refuse(f'{tag} has "{printable(text)}", which is not a number; export it again', line) from None


# GCS arrays from Physik Instrumente --------------------------------------------------------------------------


LARGEST_CODE = 1 << 16
"""Column counts and character codes are smaller than this."""

_ENTRY = re.compile(r"\s*#\s*(\w+)\s*(?:=\s*(.*?))?\s*")


def pi_gcs(reading: Reading, lines: Sequence[str]) -> TableLayout | None:
    """The layout given by the header of a GCS array, as controllers send it (`DRR?`) and PIMikroMove saves it.

    `# KEY = VALUE` up to `# END_HEADER`: SEPARATOR is the code of a character, SAMPLE_TIME is in seconds, NAME0 and so
    on are the names of the DIM columns of NDATA rows.
    """
    entries: dict[str, tuple[int, str]] = {}
    for number, line in enumerate(lines, 1):
        match = _ENTRY.fullmatch(line)
        if match is None and line.strip() and not line.lstrip().startswith("#"):
            return None
        if match is not None:
            entries.setdefault(match[1], (number, match[2] or ""))
            if match[1] == "END_HEADER":
                break
    if not {"END_HEADER", "SEPARATOR", "DIM"} <= entries.keys():
        return None
    width = _whole(reading, entries, "DIM")
    separator = chr(_whole(reading, entries, "SEPARATOR"))
    names = [entries.get(f"NAME{k}", (0, ""))[1] or str(k + 1) for k in range(width)]
    header = entries.get("NAME0", entries["END_HEADER"])[0]
    found = TableLayout(Dialect(BLANKS if separator.isspace() and separator != "\t" else separator), names,
                   entries["END_HEADER"][0] + 1, header, kind="PI GCS array", another="END_HEADER")
    if "NDATA" in entries:
        found.rows = _whole(reading, entries, "NDATA")
    if "SAMPLE_TIME" in entries:
        place, text = entries["SAMPLE_TIME"]
        try:
            seconds = float(text)
        except ValueError:
            seconds = 0.0
        if not 0.0 < seconds < float("inf"):
            raise reading.refuse("SAMPLE_TIME is not a number of seconds; correct it, or export the table again", place)
        found.steps = [Step(seconds, f"SAMPLE_TIME {seconds:g} s (line {place})")]
    return found


def _whole(reading: Reading, entries: dict[str, tuple[int, str]], key: str) -> int:
    line, text = entries[key]
    if not text.isdecimal() or (key != "NDATA" and not 0 < int(text) < LARGEST_CODE):
        raise reading.refuse(f"{key} is not a valid whole number; correct it, or export the table again", line)
    return int(text)


# CSV from Tektronix oscilloscopes ----------------------------------------------------------------------------


_SETTINGS = ("Sample Interval", "Record Length", "Vertical Units")
"""Settings that distinguish these files from others with a TIME column."""


def tektronix(reading: Reading, lines: Sequence[str]) -> TableLayout | None:
    """The layout given by the settings: one per line and one cell per channel, then `TIME,CH1,CH2` and the rows.

    The settings hold what the header lacks: the units of time and of each channel, and the channels' labels, if given.
    """
    delimiter = reading.delimiter or next((mark for mark in ",;\t" if f"TIME{mark}" in "\n".join(lines)), ",")
    commas = any(line.startswith(f"Sample Interval{delimiter}") and "," in line for line in lines)
    dialect = Dialect(delimiter, "," if delimiter != "," and commas else ".")
    settings: dict[str, list[str]] = {}
    header = next((number for number, line in enumerate(lines, 1) if line.startswith(f"TIME{delimiter}")), None)
    if header is None:
        return None
    for line in lines[: header - 1]:
        key, *cells = (cell.strip() for _, cell in dialect.cells(line))
        settings[key] = cells
    if not all(name in settings for name in _SETTINGS):
        return None
    values = [cell.strip() for _, cell in dialect.cells(lines[header - 1])][1:]
    channels = len(values)
    labels = (settings.get("Label") or [])[:channels]
    labelled = len(labels) == channels and all(labels) and len(set(labels)) == channels
    units = [*settings["Vertical Units"], *[""] * channels][:channels]
    return TableLayout(
        dialect,
        ["TIME", *(labels if labelled else values)],
        header + 1,
        header,
        [next(iter(settings.get("Horizontal Units", ())), "") or "s", *units],
        ["", *values] if labelled else [],
        kind="Tektronix CSV",
    )


# CSV from Rigol oscilloscopes --------------------------------------------------------------------------------


_RIGOL_NEW = re.compile(r"(?P<names>.*?),\s*t0\s*=\s*(?P<start>[^,]*?)\s*,\s*tInc\s*=\s*(?P<step>[^,]*?)\s*,*\s*")

_RIGOL_CHANNEL = re.compile(r"(CH\d+|MATH\d*)(V|A|W)")


def rigol(reading: Reading, lines: Sequence[str]) -> TableLayout | None:
    """The layout of a table without a time column, whose first lines give the start and increment of time instead.

    `X,CH1,CH2,Start,Increment`, `Sequence,Volt,Volt,-0.2,0.001`; in newer files `CH1V,CH2V,t0 = -0.2, tInc = 0.001`.
    """
    cells = [cell.strip() for cell in lines[0].split(",")]
    below = [cell.strip() for cell in lines[1].split(",")] if len(lines) > 1 else []
    new = _RIGOL_NEW.fullmatch(lines[0])
    if new is not None:
        names = [name.strip() for name in new["names"].split(",")]
        channels = [_RIGOL_CHANNEL.fullmatch(name) for name in names]
        units = [channel[2] if channel else "" for channel in channels]
        step, line, tag = new["step"], 1, "tInc"
        names = [channel[1] if channel else name for name, channel in zip(names, channels, strict=True)]
    elif cells[:1] == ["X"] and {"Start", "Increment"} <= set(cells[: len(below)]) and below[:1] == ["Sequence"]:
        names = ["", *cells[1 : cells.index("Start")]]
        units = below[: len(names)]
        step, line, tag = below[cells.index("Increment")], 2, "Increment"
    else:
        return None
    seconds = _number(reading, Dialect(), step, tag, line)
    blank = [""] * (len(cells) - len(names))
    return TableLayout(Dialect(), [*names, *blank], line + 1, 1, [*units, *blank], kind="Rigol CSV",
                  steps=[Step(seconds, f"{tag} {seconds:g} s (line {line})")] if seconds > 0.0 else [])


# CSV from Yokogawa's ScopeCorders and oscilloscopes -----------------------------------------------------------


def yokogawa(reading: Reading, lines: Sequence[str]) -> TableLayout | None:
    """The layout given by the settings, one per line and one cell per channel; rows begin with an empty cell.

    There is no time column. `"TraceName","CH1","CH2"` gives the names, `VUnit` the units, and `HResolution` the time
    between rows.
    """
    dialect = Dialect()
    settings: dict[str, tuple[int, list[str]]] = {}
    first = None
    for number, line in enumerate(lines, 1):
        key, *cells = (cell.strip() for _, cell in dialect.cells(line))
        if not key and cells and dialect.weight(cells[0]) > 0:
            first = number
            break
        settings.setdefault(key, (number, cells))
    if first is None or not {"TraceName", "HResolution"} <= settings.keys():
        return None
    header, names = settings["TraceName"]
    place, steps = settings["HResolution"]
    blank = [""] * len(names)
    found = TableLayout(
        dialect, ["", *names], first, header, ["", *(settings.get("VUnit", (0, []))[1] + blank)[: len(names)]],
        kind="Yokogawa CSV",
    )
    seconds = {_number(reading, dialect, step, "HResolution", place) for step in steps if step}
    if len(seconds) > 1:
        raise reading.refuse("its channels have different sample rates; export them with one rate", place)
    if settings.get("HUnit", (0, ["s"]))[1][:1] == ["s"] and seconds and min(seconds) > 0.0:
        step = seconds.pop()
        found.steps = [Step(step, f"HResolution {step:g} s (line {place})")]
    return found
