"""Faults of a recording that a fit has to be kept from: isolated wrong samples, and gaps.

Samples that are not compared have no `y` (NaN) in a course; their drive still runs through the plays.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hystgen.records import Record
from hystgen.words import counted

Array = NDArray[np.float64]

LONGEST = 4
"""Most samples in a row that count as an isolated fault; more are something that the actuator or the sensor did."""

FAR = 8.0
"""An outlier lies so many standard deviations of its surroundings' scatter from their median."""

WINDOW = 15
"""Samples of the running median, more than twice `LONGEST`."""

AROUND, CLEAR = 6, 2.5
"""It jumps away and back by more than so many times what so many samples on either side move in a step."""

AT_ONCE = 0.7
"""Each of the two jumps is at least so much of how far the samples lie from the line between their neighbours."""

TAIL, NORMAL_TAIL = 0.98, 2.326
"""A quantile of the deviations, and what it is for normal ones of standard deviation one."""

STEP, STEP_OF_RANGE = 3.0, 0.02
"""A step of the drive is so many times nearly all of its moves (`TAIL`), and such a share of its range."""

MOST = 0.01
"""Largest share of samples that is left out as outliers; beyond it they are no outliers."""

LOST = 25.0
"""After a gap of so many median steps the drive in between, and with it the memory, counts as unknown."""

ALONE = 20.0
"""A drive spike jumps by so many times what the drive moves in a step elsewhere (its 99th percentile)."""


def outliers(error: Array, v: Array) -> NDArray[np.bool_]:
    """Isolated samples of an error signal (N,) that lie far from their neighbours; NaN counts as none.

    Those at a step of the drive `v` (N,) are not: a model that lacks a lag or a resonance misses them.

    The scatter is taken from the median absolute deviation from a running median (Hampel identifier; Pearson, Control
    Engineering Practice 2005), so that neither the outliers nor what a model misses widens it.
    """
    from scipy.ndimage import median_filter

    known = np.flatnonzero(np.isfinite(error))
    found = np.zeros(len(error), dtype=bool)
    if len(known) < 4 * WINDOW:
        return found
    e = error[known]
    from_middle = np.abs(e - median_filter(e, WINDOW, mode="nearest"))
    # the quantile of a normal distribution with the same tail: a model that misses sharp corners has wide tails too
    scatter = max(1.4826 * float(np.median(from_middle)), float(np.quantile(from_middle, TAIL)) / NORMAL_TAIL)
    far = from_middle > FAR * max(scatter, 1e-9 * float(np.max(np.abs(e))))
    stepped = _stepped(v)
    for first, last in _runs(far):
        if last - first <= LONGEST and not stepped[known[first:last]].any() and _stands_out(e, first, last):
            found[known[first:last]] = True
    if np.count_nonzero(found) > MOST * len(known):
        found[:] = False
    return found


def _stepped(v: Array) -> NDArray[np.bool_]:
    """Samples around a step of the drive that is far larger than nearly all others, and a part of its range."""
    step = np.abs(np.diff(v))
    found = np.zeros(len(v), dtype=bool)
    for k in np.flatnonzero(step > max(STEP * float(np.quantile(step, TAIL)), STEP_OF_RANGE * float(np.ptp(v)))):
        found[max(k - LONGEST, 0) : k + 2 + LONGEST] = True
    return found


def _stands_out(e: Array, first: int, last: int) -> bool:
    """Whether samples [first, last) jump away and back at once, by far more than the signal moves around them.

    The tip of a triangle does not, nor a move of few samples, where a model misses what happens there.
    """
    if first == 0 or last == len(e):
        return False
    jump = min(abs(e[first] - e[first - 1]), abs(e[last] - e[last - 1]))
    line = np.interp(np.arange(first, last), [first - 1, last], [e[first - 1], e[last]])
    if jump < AT_ONCE * float(np.max(np.abs(e[first:last] - line))):
        return False
    before, after = np.diff(e[max(first - AROUND, 0) : first]), np.diff(e[last : last + AROUND])
    around = np.sort(np.abs(np.concatenate([before, after])))
    # another outlier near by makes two large steps
    return len(around) > 2 and bool(jump > CLEAR * around[-3])


def drive_spikes(v: Array, y: Array) -> NDArray[np.bool_]:
    """Isolated samples of the drive that jump away and back while the output takes no notice.

    A real pulse of the drive shows in the output; one that does not is a fault of the recording.
    """
    found = np.zeros(len(v), dtype=bool)
    step = np.abs(np.diff(v))
    if len(step) < 4 * WINDOW:
        return found
    usual = float(np.quantile(step, 0.99))
    jumps = np.flatnonzero(step > ALONE * usual)
    if len(jumps) > MOST * len(v):
        return found
    slope = float(np.ptp(y) / np.ptp(v))
    for k in jumps:
        for length in range(1, LONGEST + 1):
            back = k + 1 + length
            if back < len(v) and abs(v[back] - v[k]) <= 0.05 * step[k] + usual * (length + 1):
                inside = slice(k + 1, back)
                line = np.interp(np.arange(k + 1, back), [k, back], [y[k], y[back]])
                if np.max(np.abs(y[inside] - line)) < 0.05 * slope * step[k]:
                    found[inside] = True
                break
    return found


def bridged(v: Array, wrong: NDArray[np.bool_]) -> Array:
    """The drive with straight lines across wrong samples."""
    good = np.flatnonzero(~wrong)
    return np.interp(np.arange(len(v)), good, v[good])


@dataclass(frozen=True)
class Piece:
    """A part of a record without a gap in it, from sample `first` on. `after_gap`: its start memory is unknown."""

    record: Record
    first: int
    after_gap: bool


def between_gaps(record: Record) -> list[Piece]:
    """The record, cut where so much time is missing that nothing is known of the drive in between."""
    steps = np.diff(record.t)
    cuts = [0, *(np.flatnonzero(steps > LOST * record.sample_time) + 1).tolist(), len(record)]
    if len(cuts) == 2:
        return [Piece(record, 0, False)]
    return [
        Piece(record.section(a, b, f"{record.name} from t = {record.t[a]:.6g} s"), a, a > 0)
        for a, b in itertools.pairwise(cuts)
    ]


BRIDGED, NOT_COMPARED = "v jump away and back unseen by y, bridged", "y far from their neighbours, not compared"
"""What is done about isolated wrong samples."""


def told(name: str, found: NDArray[np.intp], what: str) -> str:
    """The sentence that counts isolated wrong samples, given where they are."""
    return f"{name}: {counted(len(found), 'isolated sample')} of {what}; the first is sample {found[0]}"


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
