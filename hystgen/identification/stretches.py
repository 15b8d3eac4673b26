"""Stretches of an output that are plainly wrong: drop-outs, held samples, a converter at its end.

Of the output, y is NaN where it is not compared.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HELD = 6
"""Fewest equal samples in a row, while the drive moves, that count as held."""

CHANCE = 1e-6
"""Largest probability of a run of equal samples by chance, in a whole record."""

RAIL = 12
"""Fewest samples at the very end of the output's range that count as saturated."""

SHARP, USUAL = 8.0, 0.98
"""A drop-out begins and ends with a step of so many times this quantile of the steps."""

SWINGS = 0.4
"""A step beside steps of more than this share of it, but for one, is part of a swing."""

LONGEST = 200
"""Most samples of a drop-out, and of what is masked as one no more than a twentieth of the record."""

SHORT = 3
"""Fewer samples are isolated ones, which the fit leaves out by itself."""

MOVES_ON = 0.01
"""Least share of its range by which the drive goes on outwards while the output stands at a converter's end."""

SUDDEN = 4.0
"""A converter's end is reached in steps of less than so many times what the drive makes."""

GRAINS = 8.0
"""A coarse output is held where the drive moves it by so many of its steps."""

NEAR = 4
"""How common equal samples are is asked of so many times the run on either side too: a drive that is slow there alone
repeats a coarse converter's codes there alone."""

ROUNDING = 1e-9
"""Noise below this share of the output's range is rounding: a simulation, in which backlash repeats a number too."""


def sensitivity(y: Array, v: Array) -> float:
    """Robust sensitivity: the output's spread over the drive's, from quartiles."""
    spread = float(np.subtract(*np.quantile(v, (0.75, 0.25))))
    return float(np.subtract(*np.quantile(y, (0.75, 0.25)))) / spread if spread > 0.0 else 0.0


def drop_outs(y: Array, v: Array) -> list[tuple[int, int]]:
    """Runs [a, b) over which the output leaves at a step, stays away and comes back at a step, as the drive does not.

    What rings does so in several steps.

    `y`: NaN where it is not compared.
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
    most = min(LONGEST, len(known) // 20)
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
    """Runs [a, b) of equal outputs while the drive moves on, longer than noise and a converter's steps make them."""
    step = np.diff(y)
    same = step == 0.0
    runs = [(a, b) for a, b in runs_of(same) if b - a + 1 >= HELD]
    known = np.isfinite(step)
    sizes = np.abs(step[known & ~same])
    if not runs or len(sizes) < HELD:
        return []
    grain = float(np.min(sizes))
    noise = float(np.median(np.abs(np.diff(y[np.isfinite(y)], 3)))) / 3.0
    at = np.isfinite(y)
    real = noise > ROUNDING * float(np.ptp(y[at]))
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
        else:  # a coarse converter repeats codes without any fault, and then moves on by one of them
            wrong = moved > GRAINS * grain and catches_up
        if wrong:
            found.append((a, b + 1))
    return found


def rails(y: Array, v: Array) -> list[tuple[str, float]]:
    """Ends of the output, with their level, at which many samples in a row are equal while the drive moves on outwards.

    An end that is reached and left at a step is none: those are drop-outs. Nor is one where the drive only turns: that
    is backlash, or a coarse converter.
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
    slope = sensitivity(y[between], v[between])  # samples at either end would flatten it
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


def runs_of(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Stretches [a, b) over which flags are set."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
