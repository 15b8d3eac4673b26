"""Igor binary waves (`.ibw`), as Igor Pro and atomic force microscopes write them, read with igor2."""

from __future__ import annotations

import io
import math
import struct
from collections.abc import Mapping
from functools import partial
from typing import IO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.records.columns import Column, Step, is_time_unit
from hystgen.records.reading import Matrix, Reading, Table, in_matrix, unlogged

HEADERS = {2: 126, 3: 130, 5: 384}
"""[bytes] Size of the header by the version of a file."""


def read_igor(reading: Reading, stream: IO[bytes]) -> Table:
    """Read an Igor binary wave: one channel, or a matrix whose columns may have labels; its scaling gives the time."""
    try:
        from igor2 import binarywave
    except ImportError:
        raise reading.uninstalled("Igor", "igor2", "CSV", "instruments") from None
    with reading.parsing("an Igor binary wave"), unlogged("igor2"):
        data = stream.read()
        if not is_igor(data) or not _is_whole(data):  # igor2 would allocate any size that the file states
            raise reading.refuse("is an Igor binary wave that is damaged or cut off; save it again")
        wave = binarywave.load(io.BytesIO(data))["wave"]
        head = wave["wave_header"]
        numbers = np.asarray(wave["wData"])
        name = _text(head["bname"]) or "wave"
        if numbers.dtype.kind not in "fiub":
            raise reading.refuse(f"{name} holds no real numbers; save it as a wave of real numbers")
        steps = _steps(head, name)
        labels = [_text(label) for label in wave.get("labels", [[], []])[1]][1:] if numbers.ndim == 2 else []
        if numbers.ndim == 1:
            columns = [Column(name, "", _text(head.get("dataUnits", b"")), len(numbers), partial(np.array, numbers))]
            return reading.table(columns, [], steps=steps)
        if numbers.ndim == 2 and len(labels) == numbers.shape[1] and all(labels) and len(set(labels)) == len(labels):
            length = len(numbers)
            columns = [Column(label, "", "", length, partial(_column, numbers, k)) for k, label in enumerate(labels)]
            return reading.table(columns, [], steps=steps)
        matrices: dict[str, Matrix] = {name: (numbers.shape, lambda: numbers)} if in_matrix(numbers.shape) else {}
        return reading.table([], [name], steps=steps, matrices=matrices)


def is_igor(start: bytes) -> bool:
    """Whether a file begins with the header of an Igor binary wave, whose 16-bit words add up to zero."""
    for order in "<>":
        for version, size in HEADERS.items():
            if start[:2] == struct.pack(f"{order}h", version) and len(start) >= size:
                return not sum(struct.unpack(f"{order}{size // 2}h", start[:size])) & 0xFFFF
    return False


def _is_whole(data: bytes) -> bool:
    """Whether a file has as many bytes as its header states for its parts, of which there are 15 in version 5."""
    order = "<" if data[1] == 0 else ">"
    (version,) = struct.unpack(f"{order}h", data[:2])
    if version != 5:
        (size,) = struct.unpack(f"{order}i", data[2:6])
        return bool(0 <= size <= len(data))
    sizes = struct.unpack(f"{order}15i", data[4:64])
    rows = struct.unpack(f"{order}4i", data[132:148])
    samples = math.prod(max(1, each) for each in rows)
    return bool(min(*sizes, *rows) >= 0 and sum(sizes) <= len(data) and samples <= len(data))


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
