"""Records from data in memory: named columns, data frames, parallel arrays.

A data frame is recognised by its interface (`columns` or `column_names`, and columns by name), so that pandas, polars
and Arrow tables can be read without importing those packages. Names and the units in them, missing values and times
are treated as in a file.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics import arguments, foreign
from hystgen.basics.problems import RecordError
from hystgen.records.columns import STANDARD, Column
from hystgen.records.reading import Reading, Table, one_dimension, repaired
from hystgen.records.record import Record
from hystgen.records.units import converted, wanted

if TYPE_CHECKING:
    from hystgen.parameters.schema import Units


class Frame(Protocol):
    """The part of a data frame's interface that we use."""

    @property
    def columns(self) -> Any:
        """Names of the columns."""

    def __getitem__(self, name: object, /) -> Any:
        """A column by its name."""


Columns = Mapping[str, ArrayLike] | Frame | NDArray[np.generic] | tuple[ArrayLike, ...]
"""Samples in memory: a mapping or data frame of named columns; or an array (N, 2) or (N, 3), or a tuple of arrays (N,),
of drive and displacement, preceded by the time if there are three columns."""

_OPTION = re.compile(r'--columns "([^"]*)"|--sample-time|--columns')
"""Options named in messages about files, which become arguments of the call in messages about data in memory."""


def in_memory(source: object) -> TypeGuard[Columns]:
    """Whether something holds the samples of one record, judged by its type alone."""
    foreign.refuse("a record", source, record=True)
    if isinstance(source, Mapping | np.ndarray) or _names(source) is not None:
        return True
    # A list may contain paths or records, so only tuples hold arrays
    return isinstance(source, tuple) and bool(source) and all(_is_samples(each) for each in source)


def _is_samples(each: object) -> bool:
    kind = getattr(each, "dtype", None)
    return kind is not None or (isinstance(each, list) and bool(each) and isinstance(each[0], int | float))


def _names(source: object) -> list[Any] | None:
    """Names of the columns of a data frame; None for anything else."""
    if not hasattr(source, "__getitem__") or isinstance(source, type):
        return None
    for attribute in ("column_names", "columns"):
        found = getattr(source, attribute, None)
        if found is not None and not callable(found):
            return list(found)
    return None


def read(
    source: Columns, name: str, columns: Mapping[str, str] | None, sample_time: float | None, need: Sequence[str]
) -> Record:
    """The record made from samples in memory, called `name` in messages; the other arguments are as in `read_record`.

    Raises RecordError with every problem; ValueError and TypeError for arrays of the wrong shape or type.
    """
    reading = Reading(name, columns or {}, sample_time, None, tuple(need), lambda _: None)
    try:
        return repaired(reading, _table(reading, _named(source, name, sample_time)))
    except RecordError as error:
        raise RecordError(map(_as_call, error.problems)) from None


def whole(source: Columns, column: str, units: Units | None) -> Record:
    """Every sample of a frame, NaN where a value is missing, as a record for a model that answers to `column`.

    `units`: those to which it is converted, None for codes, which have no unit. Raises RecordError, ValueError and
    TypeError as `read` does; the record has no time (`timed`) if the frame has none.
    """
    reading = Reading("the frame", {}, None, None, (column,), lambda _: None, points=True)
    try:
        table = _table(reading, _named(source, "the frame", None))
    except RecordError as error:
        raise RecordError(map(_as_call, error.problems)) from None
    numbers, timed = dict(table.numbers), "t" in table.numbers
    t = numbers.pop("t", np.arange(len(numbers[column]), dtype=np.float64))
    if units is None and (unit := table.units.get(column)):
        raise ValueError(f"column {column} is in {unit}, but fixed point takes codes; pass codes, without a unit")
    v = numbers.pop("v", np.empty(0))
    record = Record("the frame", t, v, numbers.pop("y", None), numbers, units=table.units, timed=timed)
    if units is None:
        return record
    return converted([record], wanted(units, ("", {}), ("units", {})), (column,), (), "")[0]


def _as_call(problem: str) -> str:
    """A message about a file, reworded to name arguments of a call instead of options."""
    problem = re.sub("name the files .* with --join DRIVE MEASURED", "give the drive and the measured signal", problem)

    def argument(option: re.Match[str]) -> str:
        if option[1] is None:
            return option[0].removeprefix("--").replace("-", "_")
        return f"columns={dict(pair.split('=', 1) for pair in option[1].split(','))}"

    return _OPTION.sub(argument, problem)


def _named(source: Columns, name: str, sample_time: float | None) -> dict[str, object]:
    """The columns by name."""
    if isinstance(source, Mapping):
        return {str(key): values for key, values in source.items()}
    if isinstance(source, np.ndarray) or (isinstance(source, tuple) and _names(source) is None):
        names = _by_place(source, name, sample_time)
        return dict(zip(names, source if isinstance(source, tuple) else source.T, strict=True))
    names = _names(source) or []
    doubled = sorted({str(each) for each in names if names.count(each) > 1})
    if doubled:
        raise ValueError(f'{name} has several columns called "{doubled[0]}"; give them different names')
    found = {str(each): source[each] for each in names}
    index = getattr(source, "index", None)  # the pandas index, which often holds the time
    kind = getattr(getattr(index, "dtype", None), "kind", "")
    label = getattr(index, "name", None)
    if (kind in "mM" and kind) or (label is not None and kind in "fiu"):
        found.setdefault(str(label or "t"), index)
    return found


def _by_place(source: NDArray[np.generic] | tuple[object, ...], name: str, sample_time: float | None) -> Sequence[str]:
    """Our names for unnamed columns."""
    number = len(source) if isinstance(source, tuple) else source.shape[1] if source.ndim == 2 else 0
    if number == 3 or (number == 2 and sample_time is not None):
        return STANDARD[-number:]
    if number == 2:
        raise ValueError(f"{name} has two columns, drive and displacement, and no time; give sample_time, or (t, v, y)")
    got = f"{number} arrays" if isinstance(source, tuple) else arguments.kind(source)
    raise ValueError(
        f"{name} is {got}; give columns t, v and y as (t, v, y) or an array of shape (N, 3), or name them in a "
        "dict {'t': .., 'v': .., 'y': ..}"
    )


def _table(reading: Reading, named: Mapping[str, object]) -> Table:
    columns: list[Column] = []
    ignored: list[str] = []
    for name, values in named.items():
        numbers, timed = timed_numbers(values)
        length = 0 if numbers is None else numbers.size if numbers.ndim == 1 else one_dimension(numbers.shape)
        if numbers is not None and length:
            unit = "s" if timed else ""
            columns.append(Column(name, unit=unit, length=length, read=partial(np.array, numbers.ravel())))
        else:
            ignored.append(name)
    return reading.table(columns, ignored)


def _kind(values: object) -> str:
    """The kind of an array's or a series' values as numpy names it; zoned stamps, too, are M."""
    kind = getattr(getattr(values, "dtype", None), "kind", None)
    return kind if isinstance(kind, str) else np.asarray(values).dtype.kind


def numbers_of(values: object) -> NDArray[np.generic] | None:
    """An array of real numbers, NaN where masked, with times as seconds from the first; None for anything else."""
    return timed_numbers(values)[0]


def timed_numbers(values: object) -> tuple[NDArray[np.generic] | None, bool]:
    """`numbers_of`, and whether the numbers are times."""
    try:
        found = np.asarray(values, dtype="datetime64[ns]" if _kind(values) == "M" else None)  # a zoned stamp in UTC
    except ValueError:  # lists of different lengths
        return None, False
    if isinstance(values, np.ma.MaskedArray) and found.dtype.kind in "fiub":
        return np.ma.filled(values.astype(np.float64), np.nan), False
    if found.dtype.kind == "O" and isinstance(next(iter(found.ravel().tolist()), None), datetime):
        found = np.asarray(_in_utc(found), dtype="datetime64[ns]")
    if found.dtype.kind in "mM":
        known = found[~np.isnat(found)]
        origin = known[0] if found.dtype.kind == "M" and len(known) else np.timedelta64(0, "s")
        return np.asarray((found - origin) / np.timedelta64(1, "s"), dtype=np.float64), True
    if found.dtype.kind == "O":
        try:
            # A data frame knows which of its values are missing
            return np.asarray(values, dtype=np.float64), False
        except (TypeError, ValueError):
            return None, False
    return (found if found.dtype.kind in "fiub" else None), False


def _in_utc(times: NDArray[np.generic]) -> list[object]:
    """Times without their time zones, which numpy does not know."""
    return [
        each.astimezone(UTC).replace(tzinfo=None) if isinstance(each, datetime) and each.tzinfo else each
        for each in times.ravel().tolist()
    ]
