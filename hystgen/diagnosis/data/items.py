"""A record as a diagnosis compares it, and arrays remembered for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hystgen.effects.base import Run

Array = NDArray[np.float64]
Samples = slice | NDArray[np.intp]

MOVEMENTS = 5, 2**25
"""Play movements that are remembered for a record, and their bytes in all."""

DIFFERENCES = 12, 2**25
"""The same for errors before the free offsets are fitted: hypotheses of a round are compared with each other."""

COMPARISONS = 40, 2**23
"""The same for errors with the free offsets and start states fitted."""


class Recent:
    """The arrays used last, by key: at most `most` of them and `most_bytes` in all."""

    def __init__(self, most: int, most_bytes: int) -> None:
        self._most, self._most_bytes = most, most_bytes
        self._arrays: dict[object, Array] = {}

    def recalled(self, by: object) -> Array | None:
        """The array under a key, None without one."""
        if by not in self._arrays:
            return None
        self._arrays[by] = found = self._arrays.pop(by)  # the one used last comes last
        return found

    def remember(self, by: object, found: Array) -> None:
        """Remember an array; the ones unused for longest give way."""
        arrays = self._arrays
        while arrays and (len(arrays) >= self._most or found.nbytes * (len(arrays) + 1) > self._most_bytes):
            del arrays[next(iter(arrays))]
        if found.nbytes <= self._most_bytes:
            arrays[by] = found


@dataclass(frozen=True)
class Item:
    """A record as it is compared: `y` is NaN where it is not; `history` the drive before it, None when unknown.

    `session`: all records of a session on one time axis, if they are of one, and `part` this record's samples of it.
    `moved`: the last movements of the plays, which most numbers of a search do not change; `left`: the last errors
    before the free offsets are fitted; `errors`: the same behind that.
    """

    name: str
    run: Run
    y: Array
    history: tuple[float, ...] | None
    output_range: float
    session: Run | None = None
    part: slice = field(default_factory=lambda: slice(None))
    moved: Recent = field(default_factory=lambda: Recent(*MOVEMENTS), init=False, repr=False, compare=False)
    left: Recent = field(default_factory=lambda: Recent(*DIFFERENCES), init=False, repr=False, compare=False)
    errors: Recent = field(default_factory=lambda: Recent(*COMPARISONS), init=False, repr=False, compare=False)

    @cached_property
    def known(self) -> NDArray[np.bool_]:
        """The samples that are compared."""
        return np.isfinite(self.y)

    @cached_property
    def compared(self) -> Samples:
        """Their places: a slice if they are evenly spaced, which picks without a copy."""
        found = np.flatnonzero(self.known)
        steps = np.diff(found)
        if not len(steps) or np.any(steps != steps[0]):
            return found
        return slice(int(found[0]), int(found[-1]) + 1, int(steps[0]))

    def picked(self, rows: Array) -> Array:
        """The compared samples of rows (k, N), contiguous."""
        if isinstance(self.compared, slice):
            return np.ascontiguousarray(rows[:, self.compared])
        return rows.take(self.compared, axis=1)


def rms(errors: Sequence[Array]) -> float:
    """rms over all compared samples of all records."""
    joined = np.concatenate(list(errors))
    joined = joined[np.isfinite(joined)]
    return float(np.sqrt(np.mean(joined**2))) if len(joined) else float("nan")


class Model(Protocol):
    """A fitted model, as far as the records are judged by it."""

    @property
    def reach(self) -> float:
        """The largest threshold, input units."""

    def errors(self, items: Sequence[Item]) -> list[Array]:
        """Measured less predicted, (N,) a record, NaN where it is not compared."""
