"""One experiment in memory, and numbers in it that stand for no value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class Record:
    """One experiment: arrays of N samples.

    `name`: file name without its folder; `t`: seconds, strictly rising; `v`: drive (empty when the file has no such
    column and none was needed); `y`: measured displacement or None; `extra`: further numeric columns by name;
    `sample_time`: median step of `t`; `notes`: what was repaired or left out, one sentence each; `units`: the units
    that the file gives, by column (`{"t": "s", "v": "V"}`), the numbers of `v` and `y` as they are in the file;
    `read_as`: how the file was understood, empty where it is plain CSV or arrays under our names; `timed`: whether `t`
    is a time, and no mere count of points taken one by one.
    """

    name: str
    t: Array
    v: Array
    y: Array | None = None
    extra: Mapping[str, Array] = field(default_factory=dict)
    sample_time: float = 1.0
    notes: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    read_as: str = ""
    timed: bool = True

    def __repr__(self) -> str:
        span = f", {self.t[0]:.6g} to {self.t[-1]:.6g} s" if len(self) else ""
        return f"<Record {self.name}: {len(self)} samples{span}; {', '.join(self.columns())}>"

    def __len__(self) -> int:
        return len(self.t)

    def columns(self) -> dict[str, Array]:
        """Every column by name: t, v, y where there, then the further ones."""
        found = {"t": self.t}
        if len(self.v) or not len(self.t):
            found["v"] = self.v
        if self.y is not None:
            found["y"] = self.y
        return {**found, **self.extra}

    def section(self, first: int | None = None, last: int | None = None, name: str | None = None) -> Record:
        """Samples `first` to `last` (exclusive, both as in a slice) as a record of their own."""
        part = slice(first, last)
        return replace(
            self,
            name=name or self.name,
            t=self.t[part],
            v=self.v[part],
            y=None if self.y is None else self.y[part],
            extra={key: values[part] for key, values in self.extra.items()},
        )


# Numbers that stand for no value: what instruments write in place of a reading, what no reading can be -------


LARGEST = 1e20
"""Numbers from here on are no reading, in whatever unit.

Instruments write 9.9E37 for an overload and 9.91E37 for no number at all (SCPI-99, volume 1, section 7.2.1.4 and 5),
others the largest float32 or 1e30; counters end at 1.8e19. Parameter files end at 1e30, and the rate of a drive, in
units a second, may be 1e10 times the drive itself.
"""

NINES = 3
"""Fewest digits of a fill value that is written in nines, as -999 or 99999.9."""

ENDS_OF_INTEGERS = frozenset(
    float(x) for bits in (16, 32, 64) for x in (2 ** (bits - 1) - 1, 2 ** (bits - 1), 2**bits - 1)
)
"""Sizes of the numbers at which integer types end."""


def no_value(x: Array) -> NDArray[np.bool_]:
    """Whether each number (N,) of a column stands for no value; what is not finite does.

    A number below `LARGEST` does where it is a usual fill value (all nines, the end of an integer type) that lies
    farther from all others of the column than these spread: a column may pass through -999 as well. The end of an
    integer type does in a column with fractions only; in one of codes it is a code.
    """
    wrong = ~np.isfinite(x) | (x >= LARGEST) | (x <= -LARGEST)
    rest, fills = x[~wrong] if wrong.any() else x, []
    while len(rest):
        ends = [end for end in (float(np.min(rest)), float(np.max(rest))) if _fill(end, rest)]
        if not ends:
            break
        fills += ends
        rest = rest[~np.isin(rest, ends)]
    if fills and len(rest):
        low, high = float(np.min(rest)), float(np.max(rest))
        away = [fill for fill in fills if not 2.0 * low - high <= fill <= 2.0 * high - low]
        wrong |= np.isin(x, away)
    return wrong


def _fill(number: float, column: Array) -> bool:
    """Whether a number of a column looks like a fill value."""
    digits = f"{abs(number):.10g}".replace(".", "")
    if len(digits) >= NINES and set(digits) == {"9"}:
        return True
    return abs(number) in ENDS_OF_INTEGERS and not np.array_equal(column, np.rint(column))
