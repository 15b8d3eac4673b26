"""Find recording faults that must not reach a fit: isolated wrong samples, gaps, and bad stretches of the output.

Samples that are not compared have no `y` (NaN) in a course; their drive still runs through the plays.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.problems import counted
from hystgen.records import Record, no_value

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

LONGEST = 4
"""Longest run of samples that counts as an isolated fault; a longer one must come from the actuator or the sensor."""

OUTLYING = 8.0
"""[standard deviations of the scatter] An outlier is farther than this from the running median."""

LITTLE = 5e-4
"""Smallest scatter assumed, as a fraction of the peak-to-peak output: a model of a simulation has almost no error
except at kinks, and an error of `OUTLYING` times this in a single sample does not spoil a fit."""

WINDOW = 15
"""[samples] Length of the running median, more than twice `LONGEST`."""

AROUND, CLEAR = 6, 2.5
"""An outlier jumps away and back by more than `CLEAR` times the steps between the `AROUND` samples on either side."""

AT_ONCE = 0.7
"""Each of an outlier's two jumps covers at least this fraction of its distance from the line between its neighbours."""

TAIL, NORMAL_TAIL = 0.98, 2.326
"""Order of a quantile of the deviations, and its value for a normal distribution with standard deviation 1."""

STEP, STEP_OF_RANGE = 3.0, 0.02
"""A step of the drive exceeds `STEP` times the quantile `TAIL` of its moves, and `STEP_OF_RANGE` times its range."""

MOST_OUTLIERS = 0.01
"""Largest fraction of samples that may be rejected as outliers; if more lie far out, they are not outliers."""

FEW = 2
"""Number of samples that may be rejected in a record of any length: the first and the last."""

LONG_GAP = 25.0
"""[median steps] In a gap longer than this, the drive, and with it the memory, counts as unknown."""

SEEN, SIGMAS = 0.05, 4.0
"""The output responds to a pulse of the drive if it moves by this fraction of the expected motion and by this many
standard deviations of its noise."""

OUT_OF_SCALE = 3.0
"""Outputs outside the range of all others by this many times that range are wrong unless the drive is too."""


def most(samples: int) -> int:
    """Maximum number of samples in a record that may be rejected as isolated."""
    return max(FEW, math.ceil(MOST_OUTLIERS * samples))


def outliers(error: Array, v: Array, swing: float) -> Flags:
    """Isolated samples of an error signal (N,) that lie far from their neighbours; NaN is never flagged.

    `swing`: peak-to-peak output; errors far below `swing` do no harm. Samples at a step of the drive `v` (N,) do not
    count: a model without a lag or a resonance cannot predict them.
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
    """Short runs [first, last) of an error signal (N,) that lie far from their neighbours; NaN is skipped.

    `swing`: as in `outliers`.

    The scatter is taken from the median absolute deviation from a running median (Hampel identifier; Pearson, Control
    Engineering Practice 2005), so that neither the outliers nor systematic model errors inflate it.
    """
    from scipy.ndimage import median_filter

    known = np.flatnonzero(np.isfinite(error))
    if len(known) < WINDOW:
        return []
    e = error[known]
    from_middle = np.abs(e - median_filter(e, WINDOW, mode="mirror"))
    far = from_middle > OUTLYING * max(_scatter(from_middle, FEW), LITTLE * swing)
    return [
        (int(known[first]), int(known[last - 1]) + 1)
        for first, last in runs_of(far)
        if last - first <= LONGEST and _stands_out(e, first, last)
    ]


def _scatter(sizes: Array, faulty: int) -> float:
    """Standard deviation of a normal distribution that matches the median or the tail of `sizes` without the `faulty`
    largest, whichever is larger: errors at sharp corners have wide tails, and so does a drive with corners."""
    tail = float(np.quantile(np.sort(sizes)[:-faulty], TAIL)) / NORMAL_TAIL
    return max(1.4826 * float(np.median(sizes)), tail)


def _stepped(v: Array) -> Flags:
    """Samples around a step of the drive that is far larger than nearly all others and a sizeable part of its range."""
    step = np.abs(np.diff(v))
    found = np.zeros(len(v), dtype=bool)
    for k in np.flatnonzero(step > max(STEP * float(np.quantile(step, TAIL)), STEP_OF_RANGE * float(np.ptp(v)))):
        found[max(k - LONGEST, 0) : k + 2 + LONGEST] = True
    return found


def _jump(x: Array, first: int, last: int) -> tuple[float, Array]:
    """The smaller of the jumps to and from samples [first, last), and their distances from their neighbours' line.

    At either end of a record there is only one jump.
    """
    ends = [k for k in (first - 1, last) if 0 <= k < len(x)]
    inner = [first if k < first else last - 1 for k in ends]
    away = np.abs(x[first:last] - np.interp(np.arange(first, last), ends, x[ends]))
    return float(np.min(np.abs(x[inner] - x[ends]))), away


def _stands_out(x: Array, first: int, last: int) -> bool:
    """Whether samples [first, last) jump away and back abruptly, by far more than the signal moves around them.

    The tip of a triangle does not count, nor does a move of a few samples that a model does not predict.
    """
    jump, away = _jump(x, first, last)
    if jump < AT_ONCE * float(np.max(away)):
        return False
    before, after = np.diff(x[max(first - AROUND, 0) : first]), np.diff(x[last : last + AROUND])
    around = np.sort(np.abs(np.concatenate([before, after])))
    # inside a record, the two largest steps may be a nearby outlier's; at an end, a transient is at its fastest
    fewer = 1 if first == 0 or last == len(x) else 3
    return len(around) >= 3 and bool(jump > CLEAR * around[-fewer])


def wrong_drive(v: Array, y: Array) -> Flags:
    """Isolated samples of the drive that jump away and back without a response of the output (NaN: unknown).

    A real pulse of the drive shows in the output, at once or a little later; a pulse without a response is a recording
    fault. At either end of a record there is only one jump. Placeholders for "no value" always count as wrong.
    """
    found = no_value(v)
    known = np.isfinite(y)
    if found.all() or np.count_nonzero(known) < WINDOW:
        return found
    v = bridged(v, found)
    span = _span(v)
    if span == 0.0:
        return found
    slope, noise = _span(y[known]) / span, white_noise(y[known])
    unseen = np.zeros(len(v), dtype=bool)
    for first, last, jump in _pulses(v, span):
        pulse = flags_of([(first, last)], len(v))
        seen = max(SEEN * slope * jump, SIGMAS * noise)
        if slope * jump > 2.0 * SIGMAS * noise and _notice(slope * bridged(v, pulse), y, first, last) < seen:
            unseen |= pulse
    if np.count_nonzero(unseen) <= most(len(v)):
        found |= unseen
    return found


def pulses(v: Array) -> list[tuple[int, int]]:
    """Short runs [first, last) of the drive that jump away and back, or stand apart at an end.

    They may be real pulses or entirely wrong rows: zeros, another sample's numbers, a saturated converter. The list is
    empty if there are so many that they must be part of the drive.
    """
    span = _span(v)
    found = [(first, last) for first, last, _ in _pulses(v, span)] if span > 0.0 and len(v) > WINDOW else []
    return found if sum(last - first for first, last in found) <= most(len(v)) else []


def returns(v: Array, first: int, last: int) -> bool:
    """Whether the drive departs from its course at samples [first, last) by a sizeable part of its range, and returns.

    At an end of the record, where the drive cannot come back, it must stand out as well.
    """
    _, away = _jump(v, first, last)
    if first == 0 or last == len(v):
        return bool(np.max(away) > STEP_OF_RANGE * _span(v)) and _stands_out(v, first, last)
    there, back = v[first] - v[first - 1], v[last] - v[last - 1]
    enough = (1.0 - AT_ONCE) * float(np.max(away))
    return bool(np.max(away) > STEP_OF_RANGE * _span(v) and there * back < 0.0 and min(abs(there), abs(back)) > enough)


def _pulses(v: Array, span: float) -> list[tuple[int, int, float]]:
    """Runs [first, last) of samples that jump away and back, or stand apart at an end, and the size of the jump."""
    from scipy.ndimage import rank_filter

    step = np.abs(np.diff(v))
    # a single sample that stands apart makes three of these second differences large
    usual_bend = _scatter(np.abs(v[1:-1] - 0.5 * (v[:-2] + v[2:])), 3 * FEW)
    least = max(STEP_OF_RANGE * span, OUTLYING * usual_bend)
    # of the steps around the two jumps, at most `LONGEST` + 1 belong to this pulse and two to another pulse
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
    """Largest distance of the output from the line through its surroundings at samples [first, last) and soon after.

    `follows`: the motion of the output expected without the pulse, which does not count as a response.
    """
    at_once = _bent(y[max(first - 1, 0) : last + 1])
    near = slice(max(first - 1, 0), last + LONGEST)
    return max(at_once, _bent(y[near]) - 1.5 * _bent(follows[near]))


def _bent(x: Array) -> float:
    """Distance of samples from the line between the first and the last known samples."""
    known = np.flatnonzero(np.isfinite(x))
    if len(known) < 2:
        return 0.0
    line = np.interp(known, known[[0, -1]], x[known[[0, -1]]])
    return float(np.max(np.abs(x[known] - line)))


def wrong_output(v: Array, y: Array) -> Flags:
    """Placeholders for "no value" in the output, and outputs far outside the others' range while the drive is not."""
    found = no_value(y)
    known = np.flatnonzero(~found)
    if len(known) < WINDOW:
        return found
    far = _beyond(y[known], OUT_OF_SCALE)
    moves = np.convolve(no_value(v) | _beyond(v, 1.0), np.ones(2 * LONGEST + 1), "same")[known] > 0.5
    found[known[far & ~moves]] = True
    return found


def smooth(record: Record) -> Record:
    """The record with straight lines across obviously wrong samples, for checks of the whole record without a model."""
    assert record.y is not None
    v, y = record.v, np.asarray(record.y, dtype=np.float64)
    wrong = wrong_output(v, y)
    lost = wrong_drive(v, np.where(wrong, np.nan, y))
    return replace(record, v=bridged(v, lost), y=bridged(y, wrong))


def _beyond(x: Array, times: float) -> Flags:
    """Samples outside the range of all but the outermost samples by more than `times` that range."""
    low, high = _ends(x)
    away = times * (high - low)
    return np.asarray((x < low - away) | (x > high + away))


def _ends(x: Array) -> tuple[float, float]:
    """Smallest and largest sample, ignoring as many of the outermost as may be isolated faults."""
    x = np.sort(x)
    return float(x[min(most(len(x)), len(x) // 2)]), float(x[max(len(x) - 1 - most(len(x)), len(x) // 2)])


def _span(x: Array) -> float:
    low, high = _ends(x)
    return high - low


def white_noise(x: Array) -> float:
    """Robust estimate of the standard deviation of white noise: third differences have 20 times its variance."""
    third = np.diff(x, 3)
    return 1.4826 * float(np.median(np.abs(third - np.median(third)))) / math.sqrt(20.0)


def bridged(v: Array, wrong: Flags) -> Array:
    """The drive with straight lines across wrong samples."""
    good = np.flatnonzero(~wrong)
    return np.interp(np.arange(len(v)), good, v[good])


@dataclass(frozen=True)
class Segment:
    """A part of a record without gaps, beginning at sample `first`. `after_gap`: its start memory is unknown."""

    record: Record
    first: int
    after_gap: bool


def between_gaps(record: Record) -> list[Segment]:
    """The record, cut at gaps so long that the drive in between is unknown."""
    steps = np.diff(record.t)
    cuts = [0, *(np.flatnonzero(steps > LONG_GAP * record.sample_time) + 1).tolist(), len(record)]
    if len(cuts) == 2:
        return [Segment(record, 0, False)]
    return [
        Segment(record.section(a, b, f"{record.name} from t = {record.t[a]:.6g} s"), a, a > 0)
        for a, b in itertools.pairwise(cuts)
    ]


BRIDGED, NOT_COMPARED = "v without a response in y, bridged", "y far from the neighbours, not compared"
"""Phrases for isolated wrong samples and their treatment."""


def sentence(name: str, found: NDArray[np.intp], what: str) -> str:
    """The sentence that gives the number of isolated wrong samples; `found`: their indices."""
    return f"{name}: {counted(len(found), 'isolated sample')} of {what}; the first is sample {found[0]}"


# Stretches of the output: drop-outs, held samples, converter saturation --------------------------------------


FEWEST_HELD = 6
"""Minimum number of consecutive equal samples, while the drive moves, that count as held."""

CHANCE = 1e-6
"""A run of equal samples counts as held only if the probability of such a run by chance in the record is below this."""

RAIL = 12
"""Minimum number of consecutive samples, exactly at the end of the output's range, that count as saturated."""

SHARP, USUAL = 8.0, 0.98
"""A drop-out begins and ends with a step of `SHARP` times the quantile `USUAL` of the steps."""

SWINGS = 0.4
"""A step is part of a swing if all but one of its neighbouring steps exceed this fraction of it."""

LONGEST_DROP_OUT = 200
"""[samples] Longest drop-out, though never more than a twentieth of the record."""

SHORT = 3
"""[samples] Shorter drop-outs count as isolated samples, which the fit itself leaves out."""

MOVES_ON = 0.01
"""[fraction of its range] Minimum distance that the drive continues outwards while the output is stuck at the end of a
converter's range."""

SUDDEN = 4.0
"""Steps that reach the end of a converter's range are smaller than this many times those expected from the drive."""

GRAINS = 8.0
"""A coarse output counts as held if it stays constant while the drive should move it by this many of its steps."""

NEAR = 4
"""Equal samples are also counted over this many lengths of the run on either side: while the drive is slow, a coarse
converter repeats its codes."""

NOISE_FREE = 1e-9
"""Noise below this fraction of the output's range is rounding: in a simulation, backlash also repeats values."""


def sensitivity(y: Array, v: Array) -> float:
    """Robust sensitivity: the interquartile range of the output divided by that of the drive."""
    spread = float(np.subtract(*np.quantile(v, (0.75, 0.25))))
    return float(np.subtract(*np.quantile(y, (0.75, 0.25)))) / spread if spread > 0.0 else 0.0


def drop_outs(y: Array, v: Array) -> list[tuple[int, int]]:
    """Runs [a, b) in which the output steps away, stays there and steps back, while the drive does not.

    Ringing does not count, since it takes several steps. `y`: NaN at samples that are not compared.
    """
    known = np.flatnonzero(np.isfinite(y))
    if len(known) < 100:
        return []
    e, w = y[known], v[known]
    move = sensitivity(e, w) * np.diff(w)
    level = e - sensitivity(e, w) * w
    step = np.diff(level)
    size = np.abs(step)
    edges = np.flatnonzero(size > SHARP * float(np.quantile(size, USUAL))).tolist()
    most = min(LONGEST_DROP_OUT, len(known) // 20)
    found: list[tuple[int, int]] = []
    end = -1
    for i, k in enumerate(edges):
        if k < end:
            continue
        j = next((j for j in edges[i + 1 :] if step[j] * step[k] < 0.0), None)
        if j is None or j - k > most:
            continue
        back = abs(level[j + 1] - level[k])
        inside = (level[k + 1 : j + 1] - np.interp(np.arange(k + 1, j + 1), [k, j + 1], level[[k, j + 1]])) / step[k]
        follows = max(abs(move[k]), abs(move[j])) > 0.25 * size[k]
        beside = sorted(size[m] for m in (k - 1, k + 1, j - 1, j + 1) if 0 <= m < len(size))
        follows = follows or beside[-2] > SWINGS * size[k]
        if j - k >= SHORT and not follows and back < 0.3 * size[k] and np.min(inside) > 0.5:
            found.append((int(known[k + 1]), int(known[j]) + 1))
            end = j
    return found


def held(y: Array, v: Array) -> list[tuple[int, int]]:
    """Runs [a, b) of equal outputs while the drive moves on, too long to be due to noise and converter steps."""
    step = np.diff(y)
    same = step == 0.0
    runs = [(a, b) for a, b in runs_of(same) if b - a + 1 >= FEWEST_HELD]
    known = np.isfinite(step)
    sizes = np.abs(step[known & ~same])
    if not runs or len(sizes) < FEWEST_HELD:
        return []
    grain = float(np.min(sizes))
    noise = float(np.median(np.abs(np.diff(y[np.isfinite(y)], 3)))) / 3.0
    at = np.isfinite(y)
    real = noise > NOISE_FREE * float(np.ptp(y[at]))
    slope = sensitivity(y[at], v[at])
    long = np.zeros(len(same), dtype=bool)
    for a, b in runs:
        long[a:b] = True
    usual = known & ~long
    chance = (np.count_nonzero(same & usual) + 1) / (np.count_nonzero(usual) + 2)
    found = []
    for a, b in runs:
        moved = slope * float(np.ptp(v[a : b + 1]))
        catches_up = b < len(step) and bool(abs(step[b]) > 0.5 * moved + slope * abs(v[b + 1] - v[b]))
        if noise > grain:
            around = np.concatenate([same[max(a - NEAR * (b - a), 0) : a], same[b : b + NEAR * (b - a)]])
            likely = max(chance, float(np.mean(around))) if len(around) else chance
            wrong = likely ** (b - a) * len(y) < CHANCE and moved > 0.25 * noise and (real or catches_up)
        else:  # a sound coarse converter also repeats codes, but then moves on by a single code
            wrong = moved > GRAINS * grain and catches_up
        if wrong:
            found.append((a, b + 1))
    return found


def rails(y: Array, v: Array) -> list[tuple[str, float]]:
    """Ends of the output's range, with their levels, where many consecutive samples are equal while the drive moves on
    outwards.

    An end reached and left by a step does not count, since that is a drop-out; nor does an end at which the drive just
    turns, since that is backlash or a coarse converter.
    """
    known = np.isfinite(y)
    if not known.any():
        return []
    found = []
    step = np.abs(np.diff(y))
    grain = float(np.min(step[step > 0.0], initial=np.inf))
    low, high = float(np.min(y[known])), float(np.max(y[known]))
    between = known & (y > low) & (y < high)
    if not between.any():
        return []
    slope = sensitivity(y[between], v[between])  # samples at the ends of the range would lower the slope
    for name, end, sign in (("largest", high, 1.0), ("least", low, -1.0)):
        least = max(MOVES_ON * float(np.ptp(v)), GRAINS * grain / slope if slope > 0.0 and grain < np.inf else 0.0)
        runs = runs_of(y == end)
        if not any(b - a >= RAIL and float(np.max(sign * (v[a:b] - v[a]))) > least for a, b in runs):
            continue
        follows = np.abs(slope * np.diff(v)) + float(np.nanmedian(step))
        edges = [k for a, b in runs if b - a >= SHORT for k in (a - 1, b - 1) if 0 <= k < len(step)]
        sudden = step[edges] / np.maximum(follows[edges], np.finfo(np.float64).tiny)
        if not np.isfinite(sudden).any() or np.nanmedian(sudden) < SUDDEN:
            found.append((name, end))
    return found


def flags_of(runs: Iterable[tuple[int, int]], samples: int) -> Flags:
    """Flags (samples,) that are set in stretches [a, b)."""
    found = np.zeros(samples, dtype=bool)
    for a, b in runs:
        found[a:b] = True
    return found


def runs_of(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Stretches [a, b) in which flags are set."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
