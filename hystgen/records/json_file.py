"""JSON: columns of numbers, a list of samples, or one sample a line (JSON lines)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import partial
from typing import IO, TypeAlias

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import printable
from hystgen.records.cells import Clock, is_time
from hystgen.records.columns import Column, Step, from_number, is_named
from hystgen.records.csv_file import texts
from hystgen.records.reading import Matrix, Reading, Table, in_matrix, one_dimension

Json: TypeAlias = object
"""A value of JSON."""

_NAMES = ("name", "label", "id", "channel")
_UNITS = ("unit", "units")
_VALUES = ("values", "data", "samples", "y")
_COLUMNS = ("columns", "fields", "header", "headers", "names")
_ROWS = ("data", "rows", "values")

DEEPEST = 16
"""[levels] Objects nested more deeply than this are not searched for columns."""


def read_json(reading: Reading, stream: IO[bytes]) -> Table:
    """Read a JSON file: objects of columns, at any level, lists of samples, or one sample a line."""
    text = "".join(texts(reading, stream))
    found = _Contents()
    try:
        found.add(_parsed(reading, text), "", 0)
    except RecursionError:
        raise reading.refuse("is nested too deeply; export columns of numbers") from None
    reading.notes += found.notes
    reading.origin = found.origin
    return reading.table(found.columns, found.ignored, steps=found.steps, matrices=found.matrices)


def _parsed(reading: Reading, text: str) -> Json:
    """The content of a file, with the samples of JSON lines in a list."""
    try:
        return json.loads(text)
    except json.JSONDecodeError as failure:
        if "Extra data" not in failure.msg:
            raise reading.refuse_at(f"is not JSON ({failure.msg}); export it again", failure) from None
    samples = []
    for number, line in enumerate(text.split("\n"), 1):
        if not line.strip():
            continue
        try:
            samples.append(json.loads(line))
        except json.JSONDecodeError as failure:
            raise reading.refuse_at(f"is not JSON ({failure.msg}); export it again", failure, number) from None
    reading.understood("one sample per line")
    return samples


class _Contents:
    """The columns in a JSON value, and what is left out."""

    def __init__(self) -> None:
        self.columns: list[Column] = []
        self.ignored: list[str] = []
        self.steps: list[Step] = []
        self.matrices: dict[str, Matrix] = {}
        self.notes: list[str] = []
        self.origin: int | None = None

    def add(self, value: Json, folder: str, depth: int, unit: str = "") -> None:
        """Add the columns in a value; `folder`: the names of the objects around it, each with a slash."""
        name = folder[:-1].rpartition("/")[2]
        above = folder[: len(folder) - len(name) - 1] if name else ""
        if isinstance(value, Mapping) and depth < DEEPEST:
            self._object(value, folder, depth)
        elif isinstance(value, list) and value and all(isinstance(each, Mapping) for each in value):
            self._objects(value, folder, depth)
        elif isinstance(value, list) and value and isinstance(value[0], list) and _are_names(value[0]):
            self._rows(value[0], value[1:], folder)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            step = from_number(name, float(value), above) if is_named(name) else None
            self.steps += [step] if step else []
        else:
            self._array(value, name or "data", above, unit)

    def _object(self, value: Mapping[str, Json], folder: str, depth: int) -> None:
        lists = {key: each for key, each in value.items() if isinstance(each, list)}
        names = next((lists[key] for key in _COLUMNS if _are_names(lists.get(key))), None)
        rows = next((lists[key] for key in _ROWS if key in lists), None)
        if names and rows and isinstance(rows[0], list) and len(rows[0]) == len(names):
            self._rows(names, rows, folder)
            return
        if value and all(key.isdecimal() for key in value):  # a data frame's column by row number
            self.add(list(value.values()), folder, depth + 1)
            return
        given = value.get("units")
        units = given if isinstance(given, Mapping) else {}
        numbers = next((lists[key] for key in _VALUES if key in lists), None)
        unit = next((each for key in _UNITS if isinstance(each := value.get(key), str)), "")
        if folder and unit and numbers is not None:
            self.add(numbers, folder, depth + 1, unit)
            return
        for key, each in value.items():
            if each is not given or given is not units:
                self.add(each, f"{folder}{key}/", depth + 1, str(units.get(key, "")))

    def _objects(self, samples: list[Mapping[str, Json]], folder: str, depth: int) -> None:
        """The columns in a list of samples, or of channels that each have a name and values."""
        name = next((key for key in _NAMES if all(isinstance(each.get(key), str) for each in samples)), None)
        held = next((key for key in _VALUES if all(isinstance(each.get(key), list) for each in samples)), None)
        if name and held:
            for each in samples:
                unit = next((str(each[key]) for key in _UNITS if each.get(key)), "")
                self.add(each[held], f"{folder}{each[name]}/", depth + 1, unit)
                rest = {key: x for key, x in each.items() if is_named(key)}
                for key, x in rest.items():
                    self.add(x, f"{folder}{key}/", depth + 1)
            return
        for key in dict.fromkeys(key for each in samples for key in each):
            column = [each.get(key) for each in samples]
            if any(isinstance(each, Mapping) for each in column):
                self._objects([each if isinstance(each, Mapping) else {} for each in column], f"{folder}{key}/", depth)
            else:
                self.add(column, f"{folder}{key}/", depth + 1)

    def _rows(self, names: list[Json], rows: list[Json], folder: str) -> None:
        for k, name in enumerate(names):
            cells = [row[k] if isinstance(row, list) and len(row) > k else None for row in rows]
            self.add(cells, f"{folder}{name}/", DEEPEST)

    def _array(self, value: Json, name: str, folder: str, unit: str) -> None:
        numbers = _numbers(value)
        if numbers is None and isinstance(value, list) and value and _are_times(value):
            numbers, unit = self._times(value, name), "s"
        shape = () if numbers is None else numbers.shape
        if numbers is not None and (length := one_dimension(shape)):
            self.columns.append(Column(name, folder, unit, length, partial(np.array, numbers.ravel())))
            return
        self.ignored.append(folder + name)
        if numbers is not None and in_matrix(shape):
            self.matrices[folder + name] = shape, partial(np.array, numbers)

    def _times(self, value: list[str | None], name: str) -> NDArray[np.float64]:
        clock = Clock()
        seconds = [float("nan") if each is None else clock.seconds(each) for each in value]
        said = f"{printable(name)} holds times of day; it was converted to seconds since the first"
        self.notes += [said, *clock.notes]
        self.origin = clock.first
        return np.array(seconds)


def _are_names(value: Json) -> bool:
    return isinstance(value, list) and len(value) > 1 and all(isinstance(each, str) for each in value)


def _are_times(value: list[Json]) -> bool:
    return all(each is None or (isinstance(each, str) and is_time(each)) for each in value) and value[0] is not None


def _numbers(value: Json) -> NDArray[np.float64] | None:
    """An array of numbers with NaN for null, true and false as 1 and 0; None for anything else."""
    if not isinstance(value, list) or any(isinstance(each, str) for each in value):
        return None
    try:
        return np.asarray(value, dtype=np.float64)
    except (ValueError, TypeError):
        return None
