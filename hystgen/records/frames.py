"""Signals of calls: samples, or a data frame or mapping with a column of them, and answers in their kind."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
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
    if not (isinstance(source, Mapping) or hasattr(source, "columns") or hasattr(source, "column_names")):
        return Given(_numbers(column, source) if like is not _array else source, t, extra, like)  # type: ignore[arg-type]
    try:
        found = memory.whole(source, column, units)  # type: ignore[arg-type]
    except RecordError as error:
        raise ValueError("\n".join(error.problems)) from None
    columns = found.columns()
    samples, time = columns.pop(column), columns.pop("t") if found.timed else None
    columns.pop("t", None)
    return Given(samples, time if t is None else t, {**columns, **(extra or {})}, like, found.notes)


def _numbers(name: str, source: object) -> Array:
    """The samples of a series, with NaN for missing ones."""
    found = np.asarray(source)
    if found.dtype.kind == "O":
        with contextlib.suppress(TypeError, ValueError):
            found = np.asarray(source, dtype=np.float64)
    return arguments.signal(name, found)
