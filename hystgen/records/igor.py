"""Igor binary waves (`.ibw`), as Igor Pro and atomic force microscopes write them, read with igor2."""

from __future__ import annotations

import io
from collections.abc import Mapping
from functools import partial
from typing import IO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.records.columns import Column, Step, is_time_unit
from hystgen.records.reading import Matrix, Reading, Table, in_matrix


def read_igor(reading: Reading, stream: IO[bytes]) -> Table:
    """Read an Igor binary wave: one channel, or a matrix whose columns may have labels; its scaling gives the time."""
    try:
        from igor2 import binarywave
    except ImportError:
        raise reading.uninstalled("Igor", "igor2", "CSV", "instruments") from None
    with reading.parsing("an Igor binary wave"):
        wave = binarywave.load(io.BytesIO(stream.read()))["wave"]
        head = wave["wave_header"]
        data = np.asarray(wave["wData"])
        name = _text(head["bname"]) or "wave"
        if data.dtype.kind not in "fiub":
            raise reading.refuse(f"{name} holds no real numbers; save it as a wave of real numbers")
        steps = _steps(head, name)
        labels = [_text(label) for label in wave.get("labels", [[], []])[1]][1:] if data.ndim == 2 else []
        if data.ndim == 1:
            columns = [Column(name, "", _text(head.get("dataUnits", b"")), len(data), partial(np.array, data))]
            return reading.table(columns, [], steps=steps)
        if data.ndim == 2 and len(labels) == data.shape[1] and all(labels) and len(set(labels)) == len(labels):
            columns = [Column(label, "", "", len(data), partial(_column, data, k)) for k, label in enumerate(labels)]
            return reading.table(columns, [], steps=steps)
        matrices: dict[str, Matrix] = {name: (data.shape, lambda: data)} if in_matrix(data.shape) else {}
        return reading.table([], [name], steps=steps, matrices=matrices)


def _column(data: NDArray[np.generic], k: int) -> NDArray[np.generic]:
    return np.array(data[:, k])


def _text(raw: object) -> str:
    """Text from a field of fixed length: bytes, or an array of single characters."""
    if isinstance(raw, np.ndarray):
        raw = b"".join(raw.ravel().tolist())
    return raw.split(b"\0")[0].decode("latin-1").strip() if isinstance(raw, bytes) else ""


def _steps(head: Mapping[str, ArrayLike], name: str) -> list[Step]:
    """The sample time from the scaling of the rows, if that is a time."""
    if "sfA" in head:
        step, units = float(np.ravel(head["sfA"])[0]), _text(np.asarray(head["dimUnits"])[0])
    else:
        step, units = float(np.ravel(head["hsA"])[0]), _text(head["xUnits"])
    if not is_time_unit(units) or not 0.0 < step < float("inf"):
        return []
    return [Step(step, f"scaling {step:g} {units} ({name})")] if units == "s" else []
