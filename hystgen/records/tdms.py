"""TDMS files from LabVIEW and other NI programs, read with npTDMS: channels in groups, with their units and sample
rates."""

from __future__ import annotations

from functools import partial
from typing import IO, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hystgen.records.columns import Column, Step
from hystgen.records.parquet import SINCE_YEAR_1
from hystgen.records.reading import Reading, Table

if TYPE_CHECKING:
    from nptdms import TdmsChannel

_UNITS = ("unit_string", "NI_UnitDescription")

NANO = 1e9


def read_tdms(reading: Reading, stream: IO[bytes]) -> Table:
    """Read a TDMS file: its numeric channels, named `group/channel`; time stamps become seconds from the first one."""
    try:
        from nptdms import TdmsFile
    except ImportError:
        raise reading.uninstalled("TDMS", "npTDMS") from None
    with reading.parsing("a TDMS file"), TdmsFile.open(stream) as file:
        columns: list[Column] = []
        ignored: list[str] = []
        steps: list[Step] = []
        for group in file.groups():
            for channel in group.channels():
                folder = f"{group.name}/"
                stamps = channel.dtype.kind == "M"
                if len(channel) < 2 or not (stamps or channel.dtype.kind in "fiub"):
                    ignored.append(folder + channel.name)
                    continue
                unit = "s" if stamps else _unit(channel)
                read = partial(_vector, reading, channel)
                columns.append(Column(channel.name, folder, unit, len(channel), read))
                steps += _steps(channel, folder + channel.name)
        return reading.table(columns, ignored, steps=steps)


def _unit(channel: TdmsChannel) -> str:
    return next((str(channel.properties[key]).strip() for key in _UNITS if channel.properties.get(key)), "")


def _steps(channel: TdmsChannel, name: str) -> list[Step]:
    """The sample time of a waveform; in other channels the increment is 0 or missing."""
    seconds = channel.properties.get("wf_increment")
    if not isinstance(seconds, float | int) or not 0.0 < seconds < float("inf"):
        return []
    start = channel.properties.get("wf_start_time", "")
    offset = channel.properties.get("wf_start_offset", 0.0)
    begins = f"{start}{f' + {offset:g} s' if offset else ''}"
    return [Step(float(seconds), f"wf_increment {seconds:g} s ({name})", name, begins)]


def _vector(reading: Reading, channel: TdmsChannel) -> NDArray[np.generic]:
    numbers = np.asarray(channel[:])
    if numbers.dtype.kind != "M":
        return numbers
    reading.notes.append(f"{channel.name} holds times of day; it was converted to seconds since the first")
    reading.origin = int(numbers[0].astype("datetime64[ns]").astype(np.int64)) + SINCE_YEAR_1
    seconds: NDArray[np.float64] = (numbers - numbers[0]).astype("timedelta64[ns]").astype(np.int64) / NANO
    return seconds
