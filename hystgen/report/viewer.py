"""The part of a page in which a reader zooms into the records: their samples, packed for the script `viewer.js`."""

from __future__ import annotations

import base64
import functools
import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hystgen.basics import drawing
from hystgen.report.panels import straight_line

Array = NDArray[np.float64]

FINE = 1e-6
"""[fraction of a channel's span] Values are rounded to a step of 1, 2 or 5 times a power of ten of at most this, less
than a tenth of a code of a converter with 16 bits, so that reading is never coarser than recording."""

MOST_SAMPLES = 1_000_000
"""Samples in one page, of all records together. A sample takes 4 to 9 bytes, so the page grows by at most 9 MB. Records
with more samples are reduced to the extremes of the error in blocks, as the page says. Set by: the records of
`tests/test_viewer.py` and `p885_sine_1hz.csv`."""

UNEVEN = 1e-3
"""[steps] Sample times closer to an even grid than this are stored as that grid."""


@dataclass(frozen=True)
class Viewed:
    """A record to zoom into, N samples: time (s), drive, measured displacement (NaN where faulty), and the models'
    displacement by name (NaN where not compared). `role`: `fit` or `held out`."""

    name: str
    role: str
    t: Array
    v: Array
    y: Array
    models: Mapping[str, Array]


@dataclass(frozen=True)
class Viewer:
    """The records of a page, all with the same models; `units`: of the drive and of the displacement, or None;
    `words`: for the displacement that the models are compared with, and for its difference from a model."""

    records: Sequence[Viewed]
    units: tuple[str | None, str | None]
    noise: float | None = None
    words: tuple[str, str] = ("measured", "error")
    kind: str = "viewer"

    def packed(self) -> str:
        """The records as JSON, for the script."""
        return json.dumps(
            {
                "units": [unit or "" for unit in self.units],
                "noise": None if self.noise is None else _short(self.noise),
                "words": self.words,
                "models": [*self.records[0].models],
                "records": [_packed(each, self._share) for each in self.records],
            },
            allow_nan=False,
            separators=(",", ":"),
        )

    @property
    def _share(self) -> int:
        """Maximum number of samples of a record."""
        counts = sorted(len(each.t) for each in self.records)
        left = MOST_SAMPLES
        for k, count in enumerate(counts):
            if count * (len(counts) - k) > left:
                return left // (len(counts) - k)
            left -= count
        return counts[-1]

    @property
    def caption(self) -> str:
        """What is shown and how to use it."""
        total = sum(len(each.t) for each in self.records)
        thinned = max(len(each.t) for each in self.records) > self._share
        how_many = (
            f"{total} samples are too many for a page: records of more than {self._share} are reduced to the samples "
            "with the extremes of the error in each block."
            if thinned
            else f"All {total} samples are in this page."
        )
        return (
            f"{how_many} Drag to move, pinch or hold Ctrl and turn the wheel to zoom. With the keyboard, after a click "
            "on the plot or Tab: the arrow keys move the cursor, + and - zoom, Home shows the whole record. The "
            "vertical scales follow what is in the window; values are read to a millionth of their span."
        )


@functools.cache
def script() -> str:
    """The script that draws every viewer of a page."""
    return Path(__file__).with_name("viewer.js").read_text(encoding="utf-8")


@functools.cache
def script_hash() -> str:
    """The script's hash, as a content security policy gives it."""
    return "sha256-" + base64.b64encode(hashlib.sha256(script().encode("utf-8")).digest()).decode("ascii")


def _packed(record: Viewed, most: int) -> dict[str, object]:
    models = [*record.models.values()]
    chosen = np.arange(len(record.t))
    if len(chosen) > most:
        chosen = drawing.kept(0, len(record.t), record.y - models[-1], blocks=most // 4)
    t, spacing = record.t - record.t[0], float(np.median(np.diff(record.t)))
    grid = spacing * np.arange(len(t))
    even = len(chosen) == len(t) and float(np.max(np.abs(t - grid))) <= UNEVEN * spacing
    tick = _round(0.01 * spacing)
    return {
        "name": record.name,
        "role": record.role,
        "count": len(chosen),
        "first": 0.0,
        "spacing": spacing if len(chosen) == len(t) else float(np.median(np.diff(t[chosen]))),
        "tick": tick,
        "time": None if even else channel(t[chosen], tick),
        "line": [_short(number) for number in straight_line(record.v, record.y)],
        "channels": [channel(each[chosen]) for each in (record.v, record.y, *models)],
    }


def _short(number: float) -> float:
    """A number of nine digits."""
    return float(f"{number:.9g}")


def _round(step: float) -> float:
    """The largest number of 1, 2 or 5 times a power of ten up to `step`."""
    power = 10.0 ** math.floor(math.log10(step))
    return max(float(f"{m * power:.1e}") for m in (0.5, 1.0, 2.0, 5.0) if m * power <= step * (1.0 + 1e-9))


def channel(values: Array, step: float | None = None) -> dict[str, object]:
    """Values (N,) as integers times a step, in the form with the fewest bytes.

    `order`: number of times that the integers were differenced; each is then doubled, less one if it was negative, and
    written in groups of seven bits, the lowest first, with the eighth bit set in all but the last. `holes`: stretches
    [first, last) of NaN.
    """
    known = np.isfinite(values)
    edges = np.flatnonzero(np.diff(np.concatenate(([True], known, [True])).astype(np.int8)))
    holes = edges.reshape(-1, 2).tolist()
    there = np.maximum.accumulate(np.where(known, np.arange(len(values)), 0))
    filled = values[there]
    filled[~np.isfinite(filled)] = values[known][0] if known.any() else 0.0
    span = float(np.ptp(filled))
    if step is None:
        step = _round(FINE * span) if span > 0.0 else 1.0
    # whole steps: compiled and interpreted functions differ in the last bit, which must not show
    zero = float(np.rint(filled.min() / step) * step) if span > 0.0 else float(filled[0])
    whole = np.rint((filled - zero) / step).astype(np.int64)
    forms = [_bytes(np.diff(whole, n=order, prepend=np.zeros(order, dtype=np.int64))) for order in (0, 1, 2)]
    order = min((0, 1, 2), key=lambda k: len(forms[k]))
    data = base64.b64encode(forms[order]).decode("ascii")
    return {"zero": zero, "step": step, "order": order, "holes": holes, "data": data}


def _bytes(whole: NDArray[np.int64]) -> bytes:
    left = np.where(whole < 0, -2 * whole - 1, 2 * whole).astype(np.uint64)
    groups = []
    more = np.ones(len(left), dtype=bool)
    while more.any():
        group = (left & 127).astype(np.int16)
        left = left >> np.uint64(7)
        group[left > 0] |= 128
        group[~more] = -1
        groups.append(group)
        more = left > 0
    table = np.stack(groups, axis=1)
    return table[table >= 0].astype(np.uint8).tobytes()
