"""Records as a fit compares them: cut at gaps, spikes of the drive bridged, outliers of the output left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hystgen.identification import faults, pi
from hystgen.identification.pi import IdentificationError
from hystgen.identification.reduction import Course
from hystgen.records import Record


def courses(
    records: Sequence[Record], history: tuple[float, ...] | None, skip: int
) -> tuple[list[Course], list[str]]:
    """The courses of the records and what was done to them, one sentence each.

    `history` precedes every record; behind a gap the memory is unknown again. Raises IdentificationError.
    """
    made: list[Course] = []
    told: list[str] = []
    for record in records:
        pieces = faults.between_gaps(record)
        if len(pieces) == 1:
            made.append(pi.course(record, history, skip))
            continue
        found = []
        for piece in pieces:
            try:
                before = None if piece.after_gap else history
                found.append(pi.course(piece.record, before, max(skip - piece.first, 0)))
            except IdentificationError as failure:
                told.append(f"left out: {failure}")
        if not found:
            raise IdentificationError(f"{record.name}: no part between its gaps can be used; record without gaps")
        told.append(
            f"{record.name}: cut at {len(pieces) - 1} gap{'' if len(pieces) == 2 else 's'} of more than "
            f"{faults.LOST:g} steps; what the drive did in them is not known, so that each part starts anew"
        )
        made += found
    for k, item in enumerate(made):
        spikes = faults.drive_spikes(item.v, item.y)
        if spikes.any():
            made[k] = replace(item, v=faults.bridged(item.v, spikes))
            told.append(faults.told(item.name, spikes, "v jump away and back unseen by y, bridged"))
    return made, told


def mask_outliers(
    to_fit: list[Course], held: list[Course], wanted: int | tuple[float, ...] | None, floor: float, skip: int
) -> list[str]:
    """Leave isolated samples of y out that lie far from what a play sum makes of their neighbours; say how many."""
    solution, _ = pi.solve(to_fit, wanted, floor, skip)
    told = []
    for group in (to_fit, held):
        for k, item in enumerate(group):
            error = pi.compare(replace(item, first=0), solution.thresholds, solution.weights).error
            wrong = faults.outliers(error)
            wrong[: item.first] = False
            if wrong.any():
                group[k] = replace(item, y=np.where(wrong, np.nan, item.y))
                told.append(faults.told(item.name, wrong, "y far from their neighbours, not compared"))
    return told
