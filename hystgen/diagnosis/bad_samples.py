"""Samples that are plainly wrong: drop-outs, held samples, a converter at its end. They are told with place and count,
and left out of the comparison."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.structure import Item

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

BEYOND = 0.01
"""Share of the output's range by which a converter's end may be passed in another record."""

SUDDEN = 4.0
"""A converter's end is reached in steps of less than so many times what the drive makes."""

GRAINS = 8.0
"""A coarse output is held where the drive moves it by so many of its steps."""


def without_faults(
    items: Sequence[Item], repaired: Sequence[dict[str, Any]]
) -> tuple[list[Item], list[dict[str, Any]]]:
    """The items without wrong samples, and what they were; `repaired`: what is known of the records already.

    A level that is a drop-out or the converter's end in one record is the same in all others.
    """
    ends = {each["level"] for each in repaired if each["kind"] == "saturated"}
    dropped = [drop_outs(item.y, item.run.v) for item in items]
    lost = {level for item, runs in zip(items, dropped, strict=True) for level in _levels(item.y, runs)} - ends
    kept, told = [], []
    for item, away in zip(items, dropped, strict=True):
        y = item.y.copy()
        levelled = {level: [run for run in _runs(y == level) if run[1] - run[0] > 1] for level in ends | lost}
        full = sorted(run for level in ends for run in levelled[level])
        away = sorted({*away, *(run for level in lost for run in levelled[level])})
        for kind, runs in (("saturated", full), ("drop_outs", away), ("held_samples", None)):
            if runs is None:
                runs = held(y, item.run.v)
            wrong = np.zeros(len(y), dtype=bool)
            for a, b in runs:
                wrong[a:b] = True
            if np.isfinite(y[wrong]).any():
                told.append(_told(kind, item, y, runs))
            y[wrong] = np.nan
        changed = np.isfinite(item.y) & ~np.isfinite(y)
        known = y[np.isfinite(y)]
        kept.append(replace(item, y=y, output_range=float(np.ptp(known))) if changed.any() and len(known) else item)
    return kept, told


def merged(entries: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """One entry a kind and record: a record whose end is held out was looked at in two parts."""
    found: dict[tuple[str, ...], dict[str, Any]] = {}
    for each in entries:
        key = each["kind"], each["record"], each.get("channel", ""), each.get("end", "")
        if key in found:
            for number in ("count", "samples"):
                if number in each:
                    found[key][number] += each[number]
        else:
            found[key] = dict(each)
    return list(found.values())


def not_at_the_end(repaired: Sequence[dict[str, Any]], items: Sequence[Item]) -> list[dict[str, Any]]:
    """What was repaired, with samples held and not saturated where another record goes beyond their level."""
    highest, lowest = (f([float(f(item.y[item.known])) for item in items if item.known.any()]) for f in (max, min))
    span = highest - lowest
    found = []
    for each in repaired:
        if each["kind"] == "saturated":
            beyond = highest - each["level"] if each["end"] == "largest" else each["level"] - lowest
            if beyond > BEYOND * span:
                each = {"kind": "held_samples", "record": each["record"], "count": 1, "samples": each["count"]}
        found.append(each)
    return found


def _levels(y: Array, runs: Sequence[tuple[int, int]]) -> set[float]:
    """Levels of runs with one value."""
    return {float(y[a]) for a, b in runs if b - a >= SHORT and np.nanmin(y[a:b]) == np.nanmax(y[a:b])}


def _told(kind: str, item: Item, y: Array, runs: Sequence[tuple[int, int]]) -> dict[str, Any]:
    values = np.concatenate([y[a:b] for a, b in runs])
    samples = int(np.count_nonzero(np.isfinite(values)))
    found = {"kind": kind, "record": item.name, "first": float(item.run.t[runs[0][0]])}
    if kind != "held_samples" and np.nanmax(values) == np.nanmin(values):
        found["level"] = float(np.nanmin(values))
    return {**found, "count": samples} if kind == "saturated" else {**found, "count": len(runs), "samples": samples}


def _slope(y: Array, v: Array) -> float:
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
    move = _slope(e, w) * np.diff(w)
    level = e - _slope(e, w) * w
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
    runs = [(a, b) for a, b in _runs(same) if b - a + 1 >= HELD]
    known = np.isfinite(step)
    sizes = np.abs(step[known & ~same])
    if not runs or len(sizes) < HELD:
        return []
    grain = float(np.min(sizes))
    noise = float(np.median(np.abs(np.diff(y[np.isfinite(y)], 3)))) / 3.0
    at = np.isfinite(y)
    slope = _slope(y[at], v[at])
    long = np.zeros(len(same), dtype=bool)
    for a, b in runs:
        long[a:b] = True
    usual = known & ~long
    chance = (np.count_nonzero(same & usual) + 1) / (np.count_nonzero(usual) + 2)
    found = []
    for a, b in runs:
        moved = slope * float(np.ptp(v[a : b + 1]))
        if noise > grain:
            wrong = chance ** (b - a) * len(y) < CHANCE and moved > 0.25 * noise
        else:  # a coarse converter repeats codes without any fault, and then moves on by one of them
            wrong = moved > GRAINS * grain and b < len(step) and bool(abs(step[b]) > 0.5 * moved)
        if wrong:
            found.append((a, b + 1))
    return found


def rails(y: Array, v: Array) -> list[tuple[str, float]]:
    """Ends of the output, with their level, at which many samples in a row are equal while the drive moves on.

    An end that is reached and left at a step is none: those are drop-outs.
    """
    known = np.isfinite(y)
    found = []
    for name, end in (("largest", float(np.max(y[known]))), ("least", float(np.min(y[known])))):
        runs = _runs(y == end)
        first, last = max(runs, key=lambda run: run[1] - run[0])
        if last - first < RAIL or float(np.ptp(v[first:last])) <= 0.01 * float(np.ptp(v)):
            continue
        step = np.abs(np.diff(y))
        follows = np.abs(_slope(y[known], v[known]) * np.diff(v)) + float(np.nanmedian(step))
        edges = [k for a, b in runs if b - a >= SHORT for k in (a - 1, b - 1) if 0 <= k < len(step)]
        if not edges or np.nanmedian(step[edges] / follows[edges]) < SUDDEN:
            found.append((name, end))
    return found


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
