"""Where the plays are put and how many there are."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hystgen.identification import weights
from hystgen.identification.reduction import Course, Reduced, others, travel

Array = NDArray[np.float64]

LEAST_TRAVEL = 0.15
"""The largest play still moves over this share of the drive's peak-to-peak range.

A play of threshold r moves over `p-p - 2 r` in a settled loop. As that goes to zero its weight is set by the last few
samples before each reversal and can take any value, while a slightly larger drive multiplies it by a real travel. At
15 % of the range (r = 0.85 of half the range) the weight is a slope measured over about as much drive as the gap to
the play below, and the error at the ends of the loop is already within 10 % of what plays up to 0.9 reach.
"""

COUNTS = (6, 8, 12, 16, 24)
"""Numbers of plays tried by default."""

POWERS = (1.0, 1.5, 2.0)
"""Spacings tried, `r_i = r_n (i/n)^power`: even, or denser near zero where loops bend most."""

PARSIMONY = 1.01
"""The fewest plays whose validation error is within this factor of the best are chosen."""

DENSE = 16
"""Plays of the list that other parts of a model are sought with."""

MANY = 100
"""More plays than this are spaced evenly."""

SAMPLES_A_PLAY = 8
"""The default never places more plays than one for this many samples."""


@dataclass(frozen=True)
class Candidate:
    """A list of thresholds to try, r_0 = 0 included."""

    thresholds: tuple[float, ...]

    @property
    def n(self) -> int:
        """Plays without r_0."""
        return len(self.thresholds) - 1


def largest(courses: Sequence[Course]) -> float:
    """The largest threshold whose play moves far enough in the record that moves it most.

    The movement of a play falls steadily with its threshold, so bisection finds the place; nothing is assumed about
    the waveform, and a first loading from a known start counts as what it is.
    """
    found = 0.0
    for course in courses:
        low_end, high_end = course.drive_range
        wanted = LEAST_TRAVEL * (high_end - low_end)
        if wanted == 0.0:
            continue
        low, high = 0.0, float(np.ptp(course.v))
        for _ in range(40):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if travel(course, middle) >= wanted else (low, middle)
        found = max(found, low)
    return found


def candidates(reach: float, samples: int, count: int | None = None) -> list[Candidate]:
    """The lists of thresholds to choose from: every spacing with every number of plays, or with `count` of them."""
    if count is not None:
        counts: Sequence[int] = (count,)
    else:
        counts = [n for n in COUNTS if n * SAMPLES_A_PLAY <= samples] or (max(1, samples // SAMPLES_A_PLAY),)
    lists = []
    for n in counts:
        # A single play has one place; very many leave nothing to choose
        for power in POWERS[: 1 if n < 2 or n > MANY else None]:
            places = (rounded(reach * (i / n) ** power, 6) for i in range(1, n + 1))
            lists.append(Candidate((0.0, *places)))
    return lists


def dense(reach: float, samples: int, most: int = DENSE) -> Candidate:
    """One list of `most` plays, which leaves little to wish for, to judge by what else there is in a record."""
    return candidates(reach, samples, min(most, max(1, samples // SAMPLES_A_PLAY)))[:2][-1]


def rounded(x: float, digits: int) -> float:
    """x to so many significant digits."""
    return float(f"{x:.{digits}g}") if math.isfinite(x) else x


def union(lists: Sequence[Candidate]) -> Array:
    """All thresholds that occur, each once."""
    return np.array(sorted({r for candidate in lists for r in candidate.thresholds}))


def columns(reduced: Reduced, candidate: Candidate) -> weights.Columns:
    """Where the candidate's plays are among the reduced ones."""
    return np.asarray(np.searchsorted(reduced.thresholds, candidate.thresholds))


def choose(reduced: Reduced, lists: Sequence[Candidate]) -> Candidate:
    """The fewest plays that predict blocks of the records left out of the fit about as well as any candidate does.

    Each of four consecutive blocks is predicted by weights fitted to the other three. Ties go to the smaller error.
    """
    if len(lists) == 1:
        return lists[0]
    squares = np.zeros(len(lists))
    for fold, left_out in enumerate(reduced.folds):
        training = others(reduced, fold)
        for k, candidate in enumerate(lists):
            chosen = columns(reduced, candidate)
            squares[k] += weights.residual(left_out, chosen, weights.non_negative(training, chosen))
    errors = np.sqrt(squares)
    enough = float(errors.min()) * PARSIMONY
    return min(
        (candidate for candidate, error in zip(lists, errors, strict=True) if error <= enough),
        key=lambda candidate: (candidate.n, errors[lists.index(candidate)]),
    )
