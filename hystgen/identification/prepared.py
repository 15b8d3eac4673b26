"""Records as a fit compares them: cut at gaps, spikes of the drive bridged, outliers of the output left out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hystgen.identification import faults, pi
from hystgen.identification.pi import IdentificationError
from hystgen.identification.reduction import Course
from hystgen.records import Record
from hystgen.words import counted


def courses(
    records: Sequence[Record], history: tuple[float, ...] | None, skip: int
) -> tuple[list[Course], list[str]]:
    """The courses of the records and what was done to them, one sentence each.

    `history` precedes every record; behind a gap the memory is unknown again. Raises IdentificationError.
    """
    made: list[Course] = []
    told: list[str] = []
    for number, record in enumerate(records):
        pieces = faults.between_gaps(record)
        if len(pieces) == 1:
            made.append(replace(pi.course(record, history, skip), origin=(number, 0)))
            continue
        found = []
        for piece in pieces:
            try:
                before = None if piece.after_gap else history
                course = pi.course(piece.record, before, max(skip - piece.first, 0))
                found.append(replace(course, origin=(number, piece.first)))
            except IdentificationError as failure:
                told.append(f"left out: {failure}")
        if not found:
            raise IdentificationError(f"{record.name}: no part between its gaps can be used; record without gaps")
        told.append(
            f"{record.name}: cut at {counted(len(pieces) - 1, 'gap')} of more than "
            f"{faults.LOST:g} steps; what the drive did in them is not known, so that each part starts anew"
        )
        made += found
    return [bridged(item) for item in made], told


def bridged(item: Course) -> Course:
    """The course with straight lines in place of isolated spikes of its drive."""
    spikes = faults.drive_spikes(item.v, item.y)
    if not spikes.any():
        return item
    # a spike is no extreme of the drive: the start memory is known at another sample than it looked
    return pi.resettled(replace(item, v=faults.bridged(item.v, spikes)), math.inf)


def mask_outliers(
    to_fit: list[Course], held: list[Course], wanted: int | tuple[float, ...] | None, floor: float
) -> None:
    """Leave isolated samples of y out that lie far from what a play sum makes of their neighbours.

    Those at the start too: how much of it is compared is known only in the end.
    """
    solution, _ = pi.solve(to_fit, wanted, floor)
    for group in (to_fit, held):
        for k, item in enumerate(group):
            error = pi.compare(replace(item, first=0), solution.thresholds, solution.weights).error
            wrong = faults.outliers(error, item.v)
            if wrong.any():
                group[k] = replace(item, y=np.where(wrong, np.nan, item.y))
