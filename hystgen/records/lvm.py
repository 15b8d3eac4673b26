"""LabVIEW measurement files (`.lvm`), by NI's "Specification for the LabVIEW Measurement File (.lvm)".

Tags of the file, then those of a segment, each up to `***End_of_Header***`, then names and rows. A file with several
segments is several experiments and refused.
"""

from __future__ import annotations

from collections.abc import Sequence

from hystgen.basics.problems import printable
from hystgen.records.cells import Dialect
from hystgen.records.layout import Layout
from hystgen.records.reading import Reading
from hystgen.records.sampling import Step

END = "***End_of_Header***"

_SPECIAL = ("***Start_Special***", "***End_Special***")


def layout(reading: Reading, lines: Sequence[str]) -> Layout | None:
    """The layout that the tags give; None for any other file."""
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
