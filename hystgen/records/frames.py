"""Signals of calls: samples, or a data frame or mapping with a column of them, and answers of the same kind."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics import arguments, foreign
from hystgen.basics.problems import RecordError
from hystgen.records import memory

if TYPE_CHECKING:
    from hystgen.parameters.schema import Units

Array = NDArray[np.generic]


def _array(values: Array) -> Array:
    return values


@dataclass(frozen=True)
class Given:
    """The signal of a call: `samples` (N,), `t` (N,) in s or None, further columns, and `answer`, which turns the
    result (N,) into the kind of object that was given; `notes`: conversions of units, one sentence each."""

    samples: ArrayLike
    t: ArrayLike | None = None
    extra: Mapping[str, ArrayLike] | None = None
    answer: Callable[[Array], Array] = _array
    notes: tuple[str, ...] = ()

    def tell(self) -> None:
        """Warn of every conversion, at the call of the user's code."""
        for note in self.notes:
            warnings.warn(note, stacklevel=3)


def given(
    column: str, answer: str, source: object, t: ArrayLike | None, extra: Mapping[str, ArrayLike] | None,
    units: Units | None = None,
) -> Given:
    """The signal `column` of a call, with the time and the further columns that a frame brings along.

    `source`: samples, a series, or a frame or mapping of columns, found and converted to `units` as for a record,
    except that no sample is dropped; `units`: the model's, None for codes; `answer`: name of the result. `t` and
    `extra` take precedence over those of a frame. Raises TypeError and ValueError.
    """
    foreign.refuse(column, source)
    like = partial(foreign.alike, source, answer) if foreign.package(source) else _array
    names = getattr(source, "columns", getattr(source, "column_names", None))
    columnar = names is not None and not callable(names)  # a Record has a method of that name
    if isinstance(source, Mapping) or columnar:
        try:
            found = memory.whole(source, column, units)  # type: ignore[arg-type]
        except RecordError as error:
            raise ValueError(_unclear(column, error.problems)) from None
        columns = found.columns()
        samples, times = columns.pop(column), columns.pop("t")
        t = times if t is None and found.timed else t
        return Given(samples, t, {**columns, **(extra or {})}, like, found.notes)
    if like is _array:
        return Given(source, t, extra)  # type: ignore[arg-type]
    return Given(_numbers(column, source), _times(source) if t is None else t, extra, like)


def _unclear(column: str, problems: Sequence[str]) -> str:
    """The message for a frame whose columns cannot be used, with advice that a call of `simulate` can follow."""
    plain = [each.partition(": error: ")[2] or each for each in problems]
    own = [each for each in plain if f'"{column}"' in each] or plain
    said = "; ".join(each.partition("; ")[0] for each in own)
    return f"{said}; rename the columns to {column} and t, or pass the samples themselves, and the time as t="


def _times(source: object) -> Array | None:
    """The times in s, from the first on, in the index of a series or the coordinates of an array; None without any."""
    index = getattr(source, "index", None)
    if index is None or callable(index):
        (dim,) = getattr(source, "dims", None) or (None,)
        index = source.coords[dim].values if dim in getattr(source, "coords", ()) else None  # type: ignore[attr-defined]
    return memory.numbers_of(index) if getattr(getattr(index, "dtype", None), "kind", "") in ("m", "M") else None


def _numbers(name: str, source: object) -> Array:
    """The samples of a series, with NaN for missing ones."""
    found = np.asarray(source)
    if found.dtype.kind == "O":
        with contextlib.suppress(TypeError, ValueError):
            return np.asarray(source, dtype=np.float64)
    return arguments.signal(name, source)
