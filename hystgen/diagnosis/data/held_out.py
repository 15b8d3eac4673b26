"""Which records are fitted and which are held out to judge, and whether they are enough for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.words import counted
from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.search import acceptance
from hystgen.identification.reduction import Course
from hystgen.records import Record

JUDGE = "judge by"
"""The purpose of held-out records, in words."""


def enough(courses: Sequence[Course], share: float = 1.0) -> bool:
    """Whether a share of any of them is enough to compare."""
    return any(share * course.used > acceptance.COMPARED_SAMPLES for course in courses)


def too_little(courses: Sequence[Course], what: str, share: float = 1.0) -> str:
    """The message where there is not; `what`: the purpose they are too short for."""
    names = ", ".join(course.name for course in courses)
    most, least = max(course.used for course in courses), acceptance.COMPARED_SAMPLES / share
    return (
        f"{names}: there is too little to {what}: {counted(most, 'sample')} at most in a record behind the start, "
        f"whose memory is not known, and more than {least:.0f} are needed; give --history, "
        "or records that sweep their range again"
    )


def hardly_compared(items: Sequence[Item]) -> list[str]:
    """Notes on records that show nothing beside others that do, and on those that are mostly not compared."""
    known: dict[str, NDArray[np.bool_]] = {}
    for item in items:  # the two ends of a record are two items
        known[item.name] = item.known | known.get(item.name, np.zeros(len(item.known), dtype=bool))
    notes = []
    for name, compared in known.items():
        number = int(np.count_nonzero(compared))
        if number <= acceptance.COMPARED_SAMPLES:
            notes.append(
                f"{name}: says next to nothing, {counted(number, 'sample')} compared; where its start memory is not "
                "known give --history, or let it sweep its range again"
            )
        elif np.argmax(compared) > len(compared) // 2:
            notes.append(
                f"{name}: {number} of {len(compared)} samples are compared, those behind the largest and the least "
                "drive, from where its memory is known; more with --history"
            )
    return notes


def set_aside(records: Sequence[Record]) -> list[int]:
    """Numbers of the records to hold out: every third one, shifted where that gives both sides fast and wide drives.

    What a fast edge shows cannot be found where none is fitted, nor judged where none is held out.
    """
    rates = np.array([float(np.max(np.abs(np.diff(record.v) / np.diff(record.t)))) for record in records])
    swings = np.array([float(np.ptp(record.v)) for record in records])
    least = acceptance.FAST_RECORD
    showing = [{k for k, x in enumerate(found) if x >= least * np.max(found)} for found in (rates, swings)]

    def shared(aside: Sequence[int]) -> int:
        return sum(bool(some.intersection(aside)) and bool(some.difference(aside)) for some in showing)

    counts = [list(range(first, len(records), 3)) for first in (2, 1, 0)]
    others = [[*aside[:k], aside[k] - 1, *aside[k + 1 :]] for aside in counts for k in range(len(aside)) if aside[k]]
    return max(counts + others, key=shared)


def parted(items: Sequence[Item]) -> tuple[list[Item], list[Item]]:
    """Every item twice: its beginning to be fitted, its end to be held out."""
    beginnings, ends = [], []
    for item in items:
        known = np.flatnonzero(item.known)
        split = int(known[int((1.0 - acceptance.SET_ASIDE) * len(known))])
        front, end = item.y.copy(), item.y.copy()
        front[split:], end[:split] = np.nan, np.nan
        beginnings.append(replace(item, y=front))
        ends.append(replace(item, y=end))
    return beginnings, ends
