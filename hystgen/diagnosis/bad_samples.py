"""Samples that are plainly wrong: drop-outs, held samples, a converter at its end. They are told with place and count,
and left out of the comparison."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.structure import Item
from hystgen.identification import stretches
from hystgen.identification.stretches import runs_of

Array = NDArray[np.float64]

BEYOND = 0.01
"""Share of the output's range by which a converter's end may be passed in another record."""


def without_faults(
    items: Sequence[Item], repaired: Sequence[dict[str, Any]]
) -> tuple[list[Item], list[dict[str, Any]]]:
    """The items without wrong samples, and what they were; `repaired`: what is known of the records already.

    A level that is a drop-out or the converter's end in one record is the same in all others.
    """
    ends = {each["level"] for each in repaired if each["kind"] == "saturated"}
    dropped = [stretches.drop_outs(item.y, item.run.v) for item in items]
    lost = {level for item, runs in zip(items, dropped, strict=True) for level in _levels(item.y, runs)} - ends
    kept, told = [], []
    for item, away in zip(items, dropped, strict=True):
        y = item.y.copy()
        levelled = {level: [run for run in runs_of(y == level) if run[1] - run[0] > 1] for level in ends | lost}
        full = sorted(run for level in ends for run in levelled[level])
        away = sorted({*away, *(run for level in lost for run in levelled[level])})
        for kind, runs in (("saturated", full), ("drop_outs", away), ("held_samples", None)):
            if runs is None:
                runs = stretches.held(y, item.run.v)
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
    return {float(y[a]) for a, b in runs if b - a >= stretches.SHORT and np.nanmin(y[a:b]) == np.nanmax(y[a:b])}


def _told(kind: str, item: Item, y: Array, runs: Sequence[tuple[int, int]]) -> dict[str, Any]:
    values = np.concatenate([y[a:b] for a, b in runs])
    samples = int(np.count_nonzero(np.isfinite(values)))
    found = {"kind": kind, "record": item.name, "first": float(item.run.t[runs[0][0]])}
    if kind != "held_samples" and np.nanmax(values) == np.nanmin(values):
        found["level"] = float(np.nanmin(values))
    return {**found, "count": samples} if kind == "saturated" else {**found, "count": len(runs), "samples": samples}


