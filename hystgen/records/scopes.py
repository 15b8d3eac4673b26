"""Headers of GW Instek oscilloscopes and of TwinCAT Scope, whose channels have a column of time each.

Each function returns None for any other file.
"""

from __future__ import annotations

from collections.abc import Sequence

from hystgen.basics.problems import printable
from hystgen.records.cells import Dialect
from hystgen.records.columns import Step
from hystgen.records.layout import TableLayout
from hystgen.records.reading import Reading

PER_DIVISION = 25.0
"""[codes] Codes of a GW Instek oscilloscope in one division of the screen, by its manual."""


def find(reading: Reading, lines: Sequence[str]) -> TableLayout | None:
    """The layout given by the header of one of these instruments."""
    return gw_instek(reading, lines) or twincat(reading, lines)


def gw_instek(reading: Reading, lines: Sequence[str]) -> TableLayout | None:
    """The layout given by the settings: `Key,value,` once for each channel, down to `Waveform Data,`.

    Rows have a time and a value for each channel in mode `Detail`, and codes of the converter in mode `Fast`, as in all
    files of older models, which write one channel per file.
    """
    header = next((number for number, line in enumerate(lines, 1) if line.startswith("Waveform Data")), None)
    if header is None or header >= len(lines):
        return None
    settings: dict[str, list[str]] = {}
    for line in lines[: header - 1]:
        cells = [cell.strip() for cell in line.split(",")]
        settings[cells[0]] = [cells[1] if len(cells) > 1 else "", *cells[3::2]]
    if not {"Memory Length", "Vertical Scale", "Sampling Period"} <= settings.keys():
        return None
    row = [cell for _, cell in Dialect().cells(lines[header])]
    channels = max(1, sum(bool(each) for each in settings["Memory Length"]))

    def of(key: str, k: int) -> str:
        values = settings.get(key, [])
        return values[k] if k < len(values) else ""

    names, units, scale = [""] * len(row), [""] * len(row), {}
    detailed = of("Mode", 0).lower() == "detail" and len(row) >= 2 * channels
    for k in range(channels):
        value = 2 * k + 1 if detailed else min(2 * k, len(row) - 1)
        names[value] = of("Label", k) or of("Source", k) or f"CH{k + 1}"
        units[value] = of("Vertical Units", k)
        if not detailed:
            scale[value] = _setting(reading, of("Vertical Scale", k), "Vertical Scale") / PER_DIVISION
    found = TableLayout(Dialect(), names, header + 1, header, units, kind="GW Instek CSV", scale=scale)
    if detailed:
        names[0] = "Time"
        units[: 2 * channels : 2] = ["s"] * channels
        found.times = tuple(range(0, 2 * channels, 2))
    else:
        step = _setting(reading, of("Sampling Period", 0), "Sampling Period")
        if step > 0.0:
            found.steps = [Step(step, f"Sampling Period {step:g} s")]
    return found


def _setting(reading: Reading, text: str, key: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise reading.refuse(f'{key} has "{printable(text)}", which is not a number; export it again') from None


def twincat(reading: Reading, lines: Sequence[str]) -> TableLayout | None:
    """The layout given by the settings: a line for each, with one cell for each channel and, in front of channels that
    share a column of time in ms, one with the name of the setting.

    `Name`, `SampleTime[ms]`, `Unit` and others follow `Starttime of export` and end with an empty line.
    """
    if not lines[0].startswith("Name") or not any(line.startswith("Starttime of export") for line in lines[:8]):
        return None
    delimiter = reading.delimiter or lines[0][4:5] or "\t"
    header = next((k for k, line in enumerate(lines, 1) if k > 2 and line.startswith(f"Name{delimiter}")), None)
    if header is None:
        return None
    settings: dict[str, list[str]] = {}
    first = header
    while first < len(lines) and lines[first - 1].strip():
        cells = lines[first - 1].split(delimiter)
        settings[cells[0].strip()] = [cell.strip() for cell in cells]
        first += 1
    while first < len(lines) and not lines[first - 1].strip():
        first += 1
    if "Name" not in settings:
        return None
    names = list(settings["Name"])
    # Above a column of times, every line repeats the name of its setting
    times = [k for k in range(len(names)) if all(cells[k : k + 1] == [key] for key, cells in settings.items())]
    said = settings.get("Unit", [])
    units = [said[k].partition(" (")[0].strip("()") if k < len(said) else "" for k in range(len(names))]
    units = ["" if unit == "None" else unit for unit in units]
    rows = [line for line in lines[first - 1 :] if line.strip()]
    decimal = "," if delimiter != "," and any("," in row for row in rows) else "."
    for k in times:
        names[k], units[k] = "", "ms"
    names[0] = "Time"
    found = TableLayout(Dialect(delimiter, decimal), names, first, header, units, kind="TwinCAT Scope", ends="EOF")
    found.times = tuple(times)
    return found
