"""Text tables of instruments, whose headers say how they are laid out.

Each function gives the layout that a header describes, None for any other file.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from hystgen.basics.problems import printable
from hystgen.records.cells import BLANKS, Dialect
from hystgen.records.columns import Step
from hystgen.records.layout import Layout
from hystgen.records.reading import Reading

# LabVIEW measurement files (`.lvm`) --------------------------------------------------------------------------


END = "***End_of_Header***"

_SPECIAL = ("***Start_Special***", "***End_Special***")


def labview(reading: Reading, lines: Sequence[str]) -> Layout | None:
    """The layout that the tags give, by NI's "Specification for the LabVIEW Measurement File (.lvm)".

    Tags of the file, then those of a segment, each up to `***End_of_Header***`, then names and rows. A file with
    several segments is several experiments and refused.
    """
    if not lines[0].startswith("LabVIEW Measurement"):
        return None
    ends = [number for number, line in enumerate(lines, 1) if line.startswith(END)]
    if len(ends) < 2:
        raise reading.refuse("is a LabVIEW measurement file without a segment; record again or export it anew", 1)
    delimiter = "," if any(line.startswith("Separator,") for line in lines[: ends[0]]) else "\t"
    file = _tags(lines[: ends[0]], delimiter)
    segment = _tags(lines[ends[0] : ends[1]], delimiter)
    dialect = Dialect(delimiter, (file.get("Decimal_Separator") or ["."])[0] or ".")
    header = ends[1] + 1
    names = [cell.strip() for _, cell in dialect.cells(lines[header - 1])] if len(lines) >= header else []
    if len(names) < 2:
        raise reading.refuse("has no names of channels below the header of the segment; export it again", ends[1])
    return _of_segment(reading, dialect, file, segment, names, header)


def _of_segment(
    reading: Reading,
    dialect: Dialect,
    file: dict[str, list[str]],
    segment: dict[str, list[str]],
    names: list[str],
    header: int,
) -> Layout:
    found = Layout(dialect, names, header + 1, header, kind="LabVIEW measurement file", another=END)
    # The comment at the end of a row is no channel, and may be missing
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
    if kept == "One" and places:
        found.units[places[0]] = unit
        return found
    steps = [_number(reading, dialect, text, "Delta_X", header) for text in segment.get("Delta_X", ()) if text]
    starts = [_number(reading, dialect, text, "X0", header) for text in segment.get("X0", ()) if text]
    if len(set(steps)) > 1 or len(set(starts)) > 1:
        raise reading.refuse(
            "its channels have times of their own (X0, Delta_X); export them with one time, X_Columns One", header
        )
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


def _tags(lines: Sequence[str], delimiter: str) -> dict[str, list[str]]:
    """Tags and their values, those of special blocks left out."""
    tags: dict[str, list[str]] = {}
    special = False
    for line in lines:
        if line.startswith(_SPECIAL):
            special = line.startswith(_SPECIAL[0])
        elif not special and line.strip():
            tag, *values = line.split(delimiter)
            # A separator may stand behind the last value
            tags[tag.strip()] = [value.strip() for value in values]
    return tags


def _number(reading: Reading, dialect: Dialect, text: str, tag: str, line: int) -> float:
    try:
        # Versions differ in whether tags follow the decimal separator of the rows
        return float(text.replace(dialect.decimal, "."))
    except ValueError:
        raise reading.refuse(f'{tag} has "{printable(text)}", which is no number; export it again', line) from None


# GCS arrays of Physik Instrumente ----------------------------------------------------------------------------


MOST = 1 << 16
"""Numbers of columns and codes of characters are smaller."""

_ENTRY = re.compile(r"\s*#\s*(\w+)\s*(?:=\s*(.*?))?\s*")


def pi_gcs(reading: Reading, lines: Sequence[str]) -> Layout | None:
    """The layout that the header of a GCS array gives, as controllers send it (`DRR?`) and PIMikroMove saves it.

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
    found = Layout(Dialect(BLANKS if separator.isspace() and separator != "\t" else separator), names,
                   entries["END_HEADER"][0] + 1, header, kind="PI GCS array", another="END_HEADER")  # fmt: skip
    if "NDATA" in entries:
        found.rows = _whole(reading, entries, "NDATA")
    if "SAMPLE_TIME" in entries:
        place, text = entries["SAMPLE_TIME"]
        try:
            seconds = float(text)
        except ValueError:
            seconds = 0.0
        if not 0.0 < seconds < float("inf"):
            raise reading.refuse("SAMPLE_TIME is no number of seconds; correct it, or export the table again", place)
        found.steps = [Step(seconds, f"SAMPLE_TIME {seconds:g} s (line {place})")]
    return found


def _whole(reading: Reading, entries: dict[str, tuple[int, str]], key: str) -> int:
    line, text = entries[key]
    if not text.isdecimal() or (key != "NDATA" and not 0 < int(text) < MOST):
        raise reading.refuse(f"{key} is no whole number that can be; correct it, or export the table again", line)
    return int(text)


# CSV of Tektronix oscilloscopes ------------------------------------------------------------------------------


_SETTINGS = ("Sample Interval", "Record Length", "Vertical Units")
"""Settings that tell these files from others with a column TIME."""


def tektronix(reading: Reading, lines: Sequence[str]) -> Layout | None:
    """The layout that the settings give: one a line and one cell a channel, then `TIME,CH1,CH2` and the rows.

    They have what the header lacks: units of time and of each channel, and the label that a user gave it.
    """
    delimiter = reading.delimiter or next((mark for mark in ",;\t" if f"TIME{mark}" in "\n".join(lines)), ",")
    dialect = Dialect(delimiter, "," if delimiter != "," and _decimal_commas(lines, delimiter) else ".")
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
    return Layout(
        dialect,
        ["TIME", *(labels if labelled else values)],
        header + 1,
        header,
        [next(iter(settings.get("Horizontal Units", ())), "") or "s", *units],
        ["", *values] if labelled else [],
        kind="Tektronix CSV",
    )


def _decimal_commas(lines: Sequence[str], delimiter: str) -> bool:
    return any(line.startswith(f"Sample Interval{delimiter}") and "," in line for line in lines)
