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
"""Movements of the plays that are remembered for a record, and the bytes of them all."""

DIFFERENCES = 12, 2**25
"""The same of what hypotheses leave of a record: those followed up in a round are compared with each other."""

COMPARISONS = 40, 2**23
"""And of the errors by which they are compared, with what each leaves free in the record."""


class Recent:
    """Arrays that were asked for lately, by what made them; no more than so many, and than so many bytes."""

    def __init__(self, most: int, most_bytes: int) -> None:
        self._most, self._most_bytes = most, most_bytes
        self._arrays: dict[object, Array] = {}

    def recalled(self, by: object) -> Array | None:
        """What is remembered by this."""
        if by not in self._arrays:
            return None
        self._arrays[by] = found = self._arrays.pop(by)  # the latest one comes last
        return found

    def remember(self, by: object, found: Array) -> None:
        """Remember it in place of what was asked for least lately."""
        arrays = self._arrays
        while arrays and (len(arrays) >= self._most or found.nbytes * (len(arrays) + 1) > self._most_bytes):
            del arrays[next(iter(arrays))]
        if found.nbytes <= self._most_bytes:
            arrays[by] = found


@dataclass(frozen=True)
class Item:
    """A record as it is compared: `y` is NaN where it is not; `history` the drive before it, None when unknown.

    `session`: all records on one time axis, where they are of one session, and `part` what of it is this record.
    `moved`: how the plays moved lately, since most numbers of a search do not change it; `left`: what was left of it;
    `errors`: that with what is free in it fitted away.
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
        """Where these are: a slice if they are evenly spread, since that picks without a copy."""
        found = np.flatnonzero(self.known)
        steps = np.diff(found)
        if not len(steps) or np.any(steps != steps[0]):
            return found
        return slice(int(found[0]), int(found[-1]) + 1, int(steps[0]))

    def picked(self, rows: Array) -> Array:
        """Of rows (k, N) those samples, with nothing between them."""
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
