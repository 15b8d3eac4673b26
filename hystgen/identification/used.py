"""What a fit compared of each record and what it left out, sample by sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hystgen.identification import faults
from hystgen.identification.reduction import Course
from hystgen.records import Record

Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Used:
    """What a fit made of one record; arrays are ascending indices into its samples.

    `name`: of the record; `held_out`: whether it took no part in the fit; `samples`: its length; `parts`: first and
    last sample (exclusive) of each part that was run, one where there is no gap; `skipped`: samples at the start not
    compared because that was asked for; `ignored`: at the start of a part, because its start memory was not known;
    `outliers`: of y, not compared; `stretches`: the same in drop-outs, held samples or a converter's end; `bridged`: of
    v, replaced by a straight line; `gaps`: first sample behind each gap; `left_out`: between gaps, too little to be of
    use.
    """

    name: str
    held_out: bool
    samples: int
    parts: tuple[tuple[int, int], ...]
    skipped: Indices = field(repr=False, compare=False)
    ignored: Indices = field(repr=False, compare=False)
    outliers: Indices = field(repr=False, compare=False)
    stretches: Indices = field(repr=False, compare=False)
    bridged: Indices = field(repr=False, compare=False)
    gaps: Indices = field(repr=False, compare=False)
    left_out: Indices = field(repr=False, compare=False)

    @property
    def compared(self) -> NDArray[np.bool_]:
        """Whether each sample (samples,) was compared."""
        found = np.ones(self.samples, dtype=bool)
        for masked in (self.skipped, self.ignored, self.outliers, self.stretches, self.left_out):
            found[masked] = False
        return found


    def sentences(self) -> list[str]:
        """The sentences that count isolated wrong samples."""
        return [
            faults.sentence(self.name, found, what)
            for found, what in ((self.bridged, faults.BRIDGED), (self.outliers, faults.NOT_COMPARED))
            if len(found)
        ]


def of_records(records: Sequence[Record], courses: Sequence[Course], held_out: bool) -> tuple[Used, ...]:
    """What became of the samples of `records`, given the courses that were compared in the end."""
    return tuple(
        _of_record(record, [item for item in courses if item.origin[0] == number], held_out)
        for number, record in enumerate(records)
    )


def _of_record(record: Record, courses: Sequence[Course], held_out: bool) -> Used:
    parts = tuple((item.origin[1], item.origin[1] + len(item.v)) for item in courses)
    skipped, ignored, outliers, stretches, bridged = [], [], [], [], []
    outside = np.ones(len(record), dtype=bool)
    for item, (start, stop) in zip(courses, parts, strict=True):
        outside[start:stop] = False
        skipped.append(np.arange(start, start + item.begin))
        ignored.append(np.arange(start + item.begin, start + item.first))
        known = np.isfinite(item.y)
        known[: item.first] = True
        faulty = np.zeros(len(known), dtype=bool) if item.stretches is None else item.stretches
        outliers.append(start + np.flatnonzero(~known & ~faulty))
        stretches.append(start + np.flatnonzero(~known & faulty))
        bridged.append(start + np.flatnonzero(item.v != record.v[start:stop]))
    gaps = [piece.first for piece in faults.between_gaps(record)[1:]]
    return Used(
        record.name,
        held_out,
        len(record),
        parts,
        np.concatenate(skipped),
        np.concatenate(ignored),
        np.concatenate(outliers),
        np.concatenate(stretches),
        np.concatenate(bridged),
        np.array(gaps, dtype=np.intp),
        np.flatnonzero(outside),
    )
