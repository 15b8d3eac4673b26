"""Universal files (`.uff`, `.unv`) of modal analysis, read with pyuff: each dataset 58 is a channel."""

from __future__ import annotations

import contextlib
import io
import warnings
from collections.abc import Mapping
from functools import partial
from typing import IO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.records.columns import Column, Step
from hystgen.records.reading import Reading, Table

Dataset = Mapping[str, ArrayLike]
"""A dataset as pyuff gives it: texts, numbers and arrays by name."""

TIME_RESPONSE = (0, 1)
"""Types of functions that are samples in the order of time: general, and time response."""

DIRECTIONS = {1: "+X", 2: "+Y", 3: "+Z", -1: "-X", -2: "-Y", -3: "-Z", 4: "+RX", 5: "+RY", 6: "+RZ"}


def read_universal(reading: Reading, _stream: IO[bytes]) -> Table:
    """Read a universal file: real functions of time of its datasets 58, with their labels and units."""
    try:
        import pyuff
    except ImportError:
        raise reading.uninstalled("universal", "pyuff", "CSV", "instruments") from None
    with reading.parsing("a universal file"), warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        file = pyuff.UFF(reading.path)
        kinds = np.atleast_1d(file.get_set_types())
        sets = [file.read_sets(int(k)) for k in np.flatnonzero(kinds == 58)]
    columns: list[Column] = []
    ignored: list[str] = []
    steps: list[Step] = []
    names = _names(sets)
    for name, each in zip(names, sets, strict=True):
        data = np.asarray(each["data"])
        if each["func_type"] not in TIME_RESPONSE or np.iscomplexobj(data) or len(data) < 2:
            ignored.append(name)
            continue
        unit = str(each.get("ordinate_axis_units_lab", "")).strip()
        unit = "" if unit.upper() == "NONE" else unit
        columns.append(Column(name, "", unit, len(data), partial(np.array, data, dtype=np.float64)))
        steps += _steps(each, name)
    if not columns:
        raise reading.refuse("has no real function of time (dataset 58); export the time signals")
    times = [each for name, each in zip(names, sets, strict=True) if name not in ignored]
    if not steps and times and not any(each["abscissa_spacing"] for each in times):
        x: NDArray[np.float64] = np.asarray(times[0]["x"], dtype=np.float64)
        if all(np.array_equal(x, each["x"]) for each in times):
            columns.append(Column("Time", "", "s", len(x), partial(np.array, x)))
    return reading.table(columns, ignored, steps=steps)


def _steps(each: Dataset, name: str) -> list[Step]:
    step = float(np.ravel(each.get("abscissa_inc", 0.0))[0])
    if not each["abscissa_spacing"] or not 0.0 < step < float("inf"):
        return []
    start = float(np.ravel(each.get("abscissa_min", 0.0))[0])
    return [Step(step, f"abscissa increment {step:g} s ({name})", name, f"{start:g} s")]


def _names(sets: list[Dataset]) -> list[str]:
    """The label of each channel if all labels differ; else its node and direction."""
    for key in ("ordinate_axis_lab", "rsp_ent_name", "id1", "id2"):
        labels = [" ".join(str(each.get(key, "")).split()) for each in sets]
        if all(label and label.upper() != "NONE" for label in labels) and len(set(labels)) == len(labels):
            return labels
    directions = [DIRECTIONS.get(int(np.ravel(each.get("rsp_dir", 0))[0]), "") for each in sets]
    places = [f"{each.get('rsp_node', '')}{direction}" for each, direction in zip(sets, directions, strict=True)]
    return places if len(set(places)) == len(places) else [f"{k}: {place}" for k, place in enumerate(places, 1)]
