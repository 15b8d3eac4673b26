"""CSV of Tektronix oscilloscopes: settings, one a line and one cell a channel, then `TIME,CH1,CH2` and the rows.

The settings have what the header lacks: units of time and of each channel, and the label that a user gave it.
"""

from __future__ import annotations

from collections.abc import Sequence

from hystgen.records.cells import Dialect
from hystgen.records.layout import Layout
from hystgen.records.reading import Reading

_SETTINGS = ("Sample Interval", "Record Length", "Vertical Units")
"""Settings that tell these files from others with a column TIME."""


def layout(reading: Reading, lines: Sequence[str]) -> Layout | None:
    """The layout that the settings give; None for any other file."""
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
