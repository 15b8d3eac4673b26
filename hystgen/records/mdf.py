"""Measurements of vehicles and test benches (`.mf4`, `.mdf`), read with asammdf: channels in groups, each group with a
time of its own."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable, Sequence
from functools import partial
from typing import IO, TYPE_CHECKING, Protocol, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from hystgen.records.columns import Column
from hystgen.records.reading import Reading, Table, unlogged

if TYPE_CHECKING:
    from asammdf import MDF
    from asammdf.blocks.v4_blocks import Channel, ChannelGroup

    class _Group(Protocol):
        channel_group: ChannelGroup
        channels: list[Channel]


File = TypeVar("File")


def read_mdf(reading: Reading, _stream: IO[bytes]) -> Table:
    """Read an MDF file of version 3 or 4: its numeric channels; samples marked invalid become NaN."""
    try:
        from asammdf import MDF
    except ImportError:
        raise reading.uninstalled("MDF", "asammdf", "CSV", "instruments") from None
    with unlogged("asammdf"):
        opened = _opened(MDF, reading.path)
    if opened is None:
        raise reading.refuse("is an MDF file that is damaged or cut off; export it again")
    with reading.parsing("an MDF file"), unlogged("asammdf"), opened as file:
        columns: list[Column] = []
        ignored: list[str] = []
        groups = cast("list[_Group]", file.groups)  # of one of two classes, by the version
        many = _apart(file, groups)
        reading.same_length = (
            f'resample them in Python, asammdf.MDF({reading.file!r}).resample(SECONDS).save("resampled.mf4")'
        )
        for number, group in enumerate(groups):
            folder = f"{number}/" if many else ""
            length = int(group.channel_group.cycles_nr)
            master = file.masters_db.get(number)
            for place, channel in enumerate(group.channels):
                if place == master and not many and any(c.unit == "s" for c in columns):
                    continue  # the same times as those of an earlier group
                first = file.get(group=number, index=place, record_count=1, ignore_invalidation_bits=True)
                if length < 2 or first.samples.dtype.kind not in "fiub" or first.samples.ndim != 1:
                    ignored.append(folder + channel.name)
                    continue
                unit = str(first.unit or "") or ("s" if place == master else "")
                read = partial(_samples, file, number, place)
                columns.append(Column(channel.name, folder, unit, length, read))
        return reading.table(columns, ignored)


def _apart(file: MDF, groups: Sequence[_Group]) -> bool:
    """Whether the channels are in several groups with times of their own, or with equal names."""
    filled = [k for k, group in enumerate(groups) if group.channel_group.cycles_nr > 1]
    if len(filled) < 2:
        return False
    names = [c.name for k in filled for place, c in enumerate(groups[k].channels) if place != file.masters_db.get(k)]
    first, *others = (file.get_master(k) for k in filled)
    return len(set(names)) < len(names) or not all(np.array_equal(first, each) for each in others)


def _opened(library: Callable[[str], File], path: str) -> File | None:
    """The file; None if it is damaged: the library's object then fails again on deletion, here in silence."""
    hook, sys.unraisablehook = sys.unraisablehook, lambda _: None
    try:
        return library(path)
    except Exception:  # of any type, with a text about the library's own objects
        return None
    finally:
        gc.collect()
        sys.unraisablehook = hook


def _samples(file: MDF, group: int, place: int) -> NDArray[np.float64]:
    signal = file.get(group=group, index=place, ignore_invalidation_bits=True)
    numbers = np.array(signal.samples, dtype=np.float64)
    if signal.invalidation_bits is not None:
        numbers[np.asarray(signal.invalidation_bits, dtype=bool)] = np.nan
    return numbers
