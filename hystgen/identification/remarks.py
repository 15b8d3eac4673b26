"""What the user should know about a fit, one sentence each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.words import counted
from hystgen.identification import pi, reduction
from hystgen.identification.pi import Solution
from hystgen.identification.reduction import Course
from hystgen.identification.report import Row
from hystgen.identification.weights import Weights
from hystgen.records import Record

AMPLIFIES = 100.0
"""Ratio of the largest slope to p_0 beyond which the inverse is called hard to use."""

SMALL_REACH = 0.1
"""Largest threshold, as a share of the drive range, below which a record is said to show little hysteresis."""

STARTS, UNLIKE = 8, 3.0
"""A start of so many samples whose rms error is so many times that of the rest tells of a wrong history."""


def about_model(
    solution: Solution, wanted: int | tuple[float, ...] | None, compared: Sequence[Course], own: Row
) -> list[str]:
    """What the user should know about the model itself."""
    reported = about_inverse(solution.weights, solution.fitted)
    low = min(item.drive_range[0] for item in compared)
    high = max(item.drive_range[1] for item in compared)
    if solution.reach < SMALL_REACH * (high - low):
        reported.append(
            f"the records tell little about hysteresis: no play above {solution.reach:.3g} moves enough in them; "
            "record full cycles, several times, or give --history"
        )
    if isinstance(wanted, tuple):
        beyond = [r for r in wanted if r > solution.reach * (1.0 + 1e-9)]
        if beyond:
            reported.append(
                f"{counted(len(beyond), 'threshold')} above {solution.reach:.6g} hardly move in "
                "these records; their weights are not to be trusted for larger drives"
            )
    outputs = [y[np.isfinite(y)] for y in (item.y[item.first : item.last] for item in compared)]
    spread = sum(float(np.sum((y - np.mean(y)) ** 2)) for y in outputs) / own.samples
    share = 1.0 - own.rms**2 / spread
    if share < 0.9:
        reported.append(
            f"the model explains only {100 * max(share, 0.0):.0f} % of the measured variance; check which column is "
            "which, and the units"
        )
    return reported


def about_inverse(p: NDArray[np.float64], made: Weights) -> list[str]:
    """What the user should know about p_0, which the inverse divides by; `p` as written, `made` as fitted."""
    if made.free_p0 is not None and made.free_rms is not None:
        return [
            f"p_0 was raised from {made.free_p0:.3g} to {p[0]:.3g} so that the model has a usable inverse; the data "
            f"hardly tell: rms error {made.free_rms:.4g} before, {made.rms:.4g} after. A lag in the measurement lowers "
            "p_0: record more slowly if you can"
        ]
    if p[0] == 0.0:
        return [
            "p_0 is 0: after each reversal the output stands still (series backlash). The model has no inverse and is "
            "of use forward only. If the actuator has no backlash, record more slowly or with more samples a second"
        ]
    if np.sum(p) > AMPLIFIES * p[0]:
        return [
            f"p_0 is small: the inverse amplifies small movements {np.sum(p) / p[0]:.0f} times as much as large ones"
        ]
    return []


def about_start(errors: pi.Errors, largest: float) -> str:
    """Whether a record's start disagrees with the history it was given."""
    item = errors.course
    end = reduction.settled(item.v, largest) - item.first
    if item.history is None or end < STARTS or len(errors.error) - end < STARTS:
        return ""
    start, rest = (float(np.sqrt(np.nanmean(part**2))) for part in (errors.error[:end], errors.error[end:]))
    if start <= UNLIKE * rest:
        return ""
    return (
        f"{item.name}: the first {end} samples, whose output depends on the history, are off by {start:.3g} rms "
        f"against {rest:.3g} for the rest; the history may not be what the actuator saw. Leave it out if in doubt"
    )


def repeated(to_fit: Sequence[Record], held: Sequence[Record]) -> list[str]:
    """Of records that were measured once and given twice."""
    reported = []
    for k, record in enumerate([*to_fit, *held]):
        for other in to_fit[: min(k, len(to_fit))]:
            if np.array_equal(record.v, other.v) and np.array_equal(np.asarray(record.y), np.asarray(other.y)):
                if k < len(to_fit):
                    reported.append(f"{record.name}: fitted twice, as {other.name} too; leave one of them out")
                else:
                    reported.append(
                        f"{record.name}: held out and, as {other.name}, fitted too, so that it judges nothing; leave "
                        "it out of the one or the other"
                    )
                break
    return reported


def outside(name: str, v: NDArray[np.float64], allowed: tuple[float, float]) -> str:
    number = int(np.count_nonzero((v < allowed[0]) | (v > allowed[1])))
    if not number:
        return ""
    return (
        f"{name}: {number} samples have a drive outside the fitted range {allowed[0]:.6g} to {allowed[1]:.6g}; "
        "the model is a guess there"
    )


