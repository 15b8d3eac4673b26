"""One experiment in memory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class Record:
    """One experiment: arrays of N samples.

    `name`: file name without its folder; `t`: seconds, strictly increasing; `v`: drive (empty if the file has no such
    column and none was needed); `y`: measured displacement or None; `extra`: further numeric columns by name;
    `sample_time`: median step of `t`; `notes`: repairs and omissions, one sentence each; `units`: the file's units by
    column (`{"t": "s", "v": "V"}`), in which `v` and `y` are kept; `read_as`: how the file was interpreted, empty for
    plain CSV or arrays under our names; `timed`: whether `t` is a time rather than a count of points taken one by one.
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
        """Every column by name: t, v, y if present, then the others."""
        found = {"t": self.t}
        if len(self.v) or not len(self.t):
            found["v"] = self.v
        if self.y is not None:
            found["y"] = self.y
        return {**found, **self.extra}

    def section(self, first: int | None = None, last: int | None = None, name: str | None = None) -> Record:
        """Samples `first` to `last` (exclusive, both as in a slice) as a separate record."""
        part = slice(first, last)
        return replace(
            self,
            name=name or self.name,
            t=self.t[part],
            v=self.v[part],
            y=None if self.y is None else self.y[part],
            extra={key: values[part] for key, values in self.extra.items()},
        )
