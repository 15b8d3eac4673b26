"""GCS arrays, as controllers of Physik Instrumente send what they record (`DRR?`) and PIMikroMove saves it.

`# KEY = VALUE` up to `# END_HEADER`: SEPARATOR is the code of a character, SAMPLE_TIME is in seconds, NAME0 and so on
are the names of the DIM columns of NDATA rows.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from hystgen.records.cells import BLANKS, Dialect
from hystgen.records.layout import Layout
from hystgen.records.reading import Reading
from hystgen.records.sampling import Step

MOST = 1 << 16
"""Numbers of columns and codes of characters are smaller."""

_ENTRY = re.compile(r"\s*#\s*(\w+)\s*(?:=\s*(.*?))?\s*")


def layout(reading: Reading, lines: Sequence[str]) -> Layout | None:
    """The layout that the header gives; None for any other file."""
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
