"""The fit table: which model was fitted to what, and how far off it is on what."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One line of the fit table.

    `part`: 'fit', 'held out' or 'all'; `model`: 'written' or 'trial'; `samples` were compared, `ignored` were not;
    `rms`, `max`: errors in output units with a free offset a record; `output_range`: the largest peak-to-peak output
    that was compared of one of the row's records, of which `rms_percent` and `max_percent` are taken; for a trial that
    of both its rows.
    """

    part: str
    model: str
    records: tuple[str, ...]
    samples: int
    ignored: int
    rms: float
    max: float
    output_range: float

    @property
    def rms_percent(self) -> float:
        """rms error in % of the output range."""
        return 100.0 * self.rms / self.output_range if self.output_range else 0.0

    @property
    def max_percent(self) -> float:
        """Largest error in % of the output range."""
        return 100.0 * self.max / self.output_range if self.output_range else 0.0

    def sentence(self) -> str:
        """The row as a sentence, for a comment."""
        return (
            f"{self.part}, {self.model} model ({', '.join(self.records)}; {self.samples} samples, "
            f"{self.ignored} ignored): rms {self.rms:.4g} ({self.rms_percent:.3g} %), "
            f"max {self.max:.4g} ({self.max_percent:.3g} %)"
        )


LEFT = (0, 1, 8)
"""Columns of the table that hold words."""


def cells(rows: Sequence[Row], unit: str) -> list[tuple[str, ...]]:
    """The table's head and rows."""
    suffix = f" [{unit}]" if unit else ""
    head = ("part", "model", "samples", "ignored", f"rms{suffix}", "rms %", f"max{suffix}", "max %", "records")
    body = [
        (
            row.part,
            row.model,
            str(row.samples),
            str(row.ignored),
            f"{row.rms:.4g}",
            f"{row.rms_percent:.3f}",
            f"{row.max:.4g}",
            f"{row.max_percent:.3f}",
            ", ".join(row.records),
        )
        for row in rows
    ]
    return [head, *body]


def table(rows: Sequence[Row], unit: str, remarks: Sequence[str]) -> str:
    """The rows in aligned columns, remarks below."""
    content = cells(rows, unit)
    widths = [max(len(line[k]) for line in content) for k in range(len(content[0]))]
    lines = [
        "  ".join(line[k].ljust(width) if k in LEFT else line[k].rjust(width) for k, width in enumerate(widths))
        for line in content
    ]
    return "\n".join([*(line.rstrip() for line in lines), *remarks]) + "\n"
