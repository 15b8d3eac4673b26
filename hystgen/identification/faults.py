"""Faults of a recording that a fit has to be kept from: isolated wrong samples, and gaps.

Samples that are not compared have no `y` (NaN) in a course; their drive still runs through the plays.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.words import counted
from hystgen.identification.stretches import runs_of
from hystgen.records import Record, no_value

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

LONGEST = 4
"""Most samples in a row that count as an isolated fault; more are something that the actuator or the sensor did."""

FAR = 8.0
"""An outlier lies so many standard deviations of its surroundings' scatter from their median."""

LITTLE = 5e-4
"""Least scatter, as a share of the peak-to-peak output: a model of a simulation leaves next to nothing but at its
kinks, and an error of `FAR` times that in a single sample spoils no fit."""

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

FEW = 2
"""So many samples are left out of a record in any case: its first and its last."""

LOST = 25.0
"""After a gap of so many median steps the drive in between, and with it the memory, counts as unknown."""

SEEN, SIGMAS = 0.05, 4.0
"""The output takes notice of a pulse of the drive where it moves by this share of what the drive's range makes it move,
and by so many standard deviations of its noise."""

OUT_OF_SCALE = 3.0
"""Outputs that lie so many ranges of the others beyond them are wrong where the drive does nothing of the kind."""


def most(samples: int) -> int:
    """Most samples of a record that are left out as isolated."""
    return max(FEW, math.ceil(MOST * samples))


def outliers(error: Array, v: Array, swing: float) -> Flags:
    """Isolated samples of an error signal (N,) that lie far from their neighbours; NaN counts as none.

    `swing`: peak-to-peak output, against which an error may be too small to spoil anything.

    Those at a step of the drive `v` (N,) are not: a model that lacks a lag or a resonance misses them.
    """
    found = np.zeros(len(error), dtype=bool)
    stepped = _stepped(v)
    for first, last in far_from_others(error, swing):
        if not stepped[first:last].any():
            found[first:last] = True
    found &= np.isfinite(error)
    if np.count_nonzero(found) > most(int(np.count_nonzero(np.isfinite(error)))):
        found[:] = False
    return found


def far_from_others(error: Array, swing: float) -> list[tuple[int, int]]:
    """Runs [first, last) of few samples of an error signal (N,) that lie far from their neighbours; NaN is skipped.

    `swing`: as in `outliers`.

    The scatter is taken from the median absolute deviation from a running median (Hampel identifier; Pearson, Control
    Engineering Practice 2005), so that neither the outliers nor what a model misses widens it.
    """
    from scipy.ndimage import median_filter

    known = np.flatnonzero(np.isfinite(error))
    if len(known) < WINDOW:
        return []
    e = error[known]
    from_middle = np.abs(e - median_filter(e, WINDOW, mode="mirror"))
    far = from_middle > FAR * max(_scatter(from_middle, FEW), LITTLE * swing)
    return [
        (int(known[first]), int(known[last - 1]) + 1)
        for first, last in runs_of(far)
        if last - first <= LONGEST and _stands_out(e, first, last)
    ]


def _scatter(sizes: Array, faulty: int) -> float:
    """Standard deviation of a normal distribution with the same middle, or tail, as sizes of which the largest may be
    faulty: a model that misses sharp corners has wide tails, and so has a drive that makes them."""
    tail = float(np.quantile(np.sort(sizes)[:-faulty], TAIL)) / NORMAL_TAIL
    return max(1.4826 * float(np.median(sizes)), tail)


def _stepped(v: Array) -> Flags:
    """Samples around a step of the drive that is far larger than nearly all others, and a part of its range."""
    step = np.abs(np.diff(v))
    found = np.zeros(len(v), dtype=bool)
    for k in np.flatnonzero(step > max(STEP * float(np.quantile(step, TAIL)), STEP_OF_RANGE * float(np.ptp(v)))):
        found[max(k - LONGEST, 0) : k + 2 + LONGEST] = True
    return found


def _jump(x: Array, first: int, last: int) -> tuple[float, Array]:
    """The smaller one of the jumps to and from samples [first, last), and how far these lie off their neighbours' line.

    At either end of a record there is one jump only.
    """
    ends = [k for k in (first - 1, last) if 0 <= k < len(x)]
    inner = [first if k < first else last - 1 for k in ends]
    away = np.abs(x[first:last] - np.interp(np.arange(first, last), ends, x[ends]))
    return float(np.min(np.abs(x[inner] - x[ends]))), away


def _stands_out(x: Array, first: int, last: int) -> bool:
    """Whether samples [first, last) jump away and back at once, by far more than the signal moves around them.

    The tip of a triangle does not, nor a move of few samples, where a model misses what happens there.
    """
    jump, away = _jump(x, first, last)
    if jump < AT_ONCE * float(np.max(away)):
        return False
    before, after = np.diff(x[max(first - AROUND, 0) : first]), np.diff(x[last : last + AROUND])
    around = np.sort(np.abs(np.concatenate([before, after])))
    # between two others an outlier near by makes two large steps; at an end what settles is fastest
    fewer = 1 if first == 0 or last == len(x) else 3
    return len(around) >= 3 and bool(jump > CLEAR * around[-fewer])


def wrong_drive(v: Array, y: Array) -> Flags:
    """Isolated samples of the drive that jump away and back while the output (NaN: not known) takes no notice.

    A real pulse of the drive shows in the output, at once or a little later; one that does not is a fault of the
    recording. At the ends of a record the drive jumps once. Numbers that stand for no value are found in any case.
    """
    found = no_value(v)
    known = np.isfinite(y)
    if found.all() or np.count_nonzero(known) < WINDOW:
        return found
    v = bridged(v, found)
    span = _span(v)
    if span == 0.0:
        return found
    slope, noise = _span(y[known]) / span, _noise(y[known])
    pulses = np.zeros(len(v), dtype=bool)
    for first, last, jump in _pulses(v, span):
        pulse = np.zeros(len(v), dtype=bool)
        pulse[first:last] = True
        seen = max(SEEN * slope * jump, SIGMAS * noise)
        if slope * jump > 2.0 * SIGMAS * noise and _notice(slope * bridged(v, pulse), y, first, last) < seen:
            pulses |= pulse
    if np.count_nonzero(pulses) <= most(len(v)):
        found |= pulses
    return found


def returns(v: Array, first: int, last: int) -> bool:
    """Whether the drive leaves its course at samples [first, last), by a part of its range, and comes back.

    Where there is nothing to come back to, at an end, it has to stand out as well.
    """
    _, away = _jump(v, first, last)
    if first == 0 or last == len(v):
        return bool(np.max(away) > STEP_OF_RANGE * _span(v)) and _stands_out(v, first, last)
    there, back = v[first] - v[first - 1], v[last] - v[last - 1]
    enough = (1.0 - AT_ONCE) * float(np.max(away))
    return bool(np.max(away) > STEP_OF_RANGE * _span(v) and there * back < 0.0 and min(abs(there), abs(back)) > enough)


def _pulses(v: Array, span: float) -> list[tuple[int, int, float]]:
    """Runs [first, last) of samples that jump away and back, or stand apart at an end, and by how much."""
    from scipy.ndimage import rank_filter

    step = np.abs(np.diff(v))
    # three of them are not small at a sample that stands apart
    usual_bend = _scatter(np.abs(v[1:-1] - 0.5 * (v[:-2] + v[2:])), 3 * FEW)
    least = max(STEP_OF_RANGE * span, FAR * usual_bend)
    # of as many steps around the two jumps at most `LONGEST` + 1 belong to the pulse, and two to another one
    usual = rank_filter(step, -(LONGEST + 4), size=2 * (AROUND + LONGEST) + 1, mode="mirror")
    large = np.flatnonzero((step > least) & (step > CLEAR * usual))
    n = len(v)
    places = {(0, last) for last in range(1, LONGEST + 1)} | {(n - length, n) for length in range(1, LONGEST + 1)}
    places |= {(k + 1, k + 1 + length) for k in large.tolist() for length in range(1, LONGEST + 1)}
    found: list[tuple[int, int, float]] = []
    for first, last in sorted(place for place in places if place[1] <= n):
        if (found and first < found[-1][1]) or not _stands_out(v, first, last):
            continue
        jump, away = _jump(v, first, last)
        if jump > least and float(np.min(away)) >= AT_ONCE * jump:
            found.append((first, last, jump))
    return found


def _notice(follows: Array, y: Array, first: int, last: int) -> float:
    """How far the output leaves the line through its surroundings at samples [first, last), and soon after.

    `follows`: what the drive without the pulse makes the output do, about; as much is no notice of the pulse.
    """
    at_once = _bent(y[max(first - 1, 0) : last + 1])
    near = slice(max(first - 1, 0), last + LONGEST)
    return max(at_once, _bent(y[near]) - 1.5 * _bent(follows[near]))


def _bent(x: Array) -> float:
    """How far samples lie from the line between the first and the last one that are known."""
    known = np.flatnonzero(np.isfinite(x))
    if len(known) < 2:
        return 0.0
    line = np.interp(known, known[[0, -1]], x[known[[0, -1]]])
    return float(np.max(np.abs(x[known] - line)))


def wrong_output(v: Array, y: Array) -> Flags:
    """Outputs that stand for no value, and those out of all scale where the drive is not."""
    found = no_value(y)
    known = np.flatnonzero(~found)
    if len(known) < WINDOW:
        return found
    far = _beyond(y[known], OUT_OF_SCALE)
    moves = np.convolve(no_value(v) | _beyond(v, 1.0), np.ones(2 * LONGEST + 1), "same")[known] > 0.5
    found[known[far & ~moves]] = True
    return found


def smooth(record: Record) -> Record:
    """The record with straight lines across the wrong samples that show without a model, to judge it as a whole."""
    assert record.y is not None
    v, y = record.v, np.asarray(record.y, dtype=np.float64)
    wrong = wrong_output(v, y)
    lost = wrong_drive(v, np.where(wrong, np.nan, y))
    return replace(record, v=bridged(v, lost), y=bridged(y, wrong))


def _beyond(x: Array, times: float) -> Flags:
    """Samples that lie so many ranges of all but the outermost ones beyond these."""
    low, high = _ends(x)
    away = times * (high - low)
    return np.asarray((x < low - away) | (x > high + away))


def _ends(x: Array) -> tuple[float, float]:
    """Least and largest but for as many as may be isolated faults."""
    x = np.sort(x)
    return float(x[min(most(len(x)), len(x) // 2)]), float(x[max(len(x) - 1 - most(len(x)), len(x) // 2)])


def _span(x: Array) -> float:
    low, high = _ends(x)
    return high - low


def _noise(x: Array) -> float:
    """Standard deviation of white noise, robust: third differences have 20 times its variance."""
    third = np.diff(x, 3)
    return 1.4826 * float(np.median(np.abs(third - np.median(third)))) / math.sqrt(20.0)


def bridged(v: Array, wrong: Flags) -> Array:
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


def sentence(name: str, found: NDArray[np.intp], what: str) -> str:
    """The sentence that counts isolated wrong samples, given where they are."""
    return f"{name}: {counted(len(found), 'isolated sample')} of {what}; the first is sample {found[0]}"
