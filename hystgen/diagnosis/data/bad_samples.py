"""Samples that are plainly wrong: drop-outs, held samples, a converter at its end.

They are reported with place and count, and left out of the comparison.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.findings.kinds import DropOuts, Finding, HeldSamples, Saturated
from hystgen.diagnosis.search import acceptance
from hystgen.identification import stretches
from hystgen.identification.stretches import runs_of

Array = NDArray[np.float64]
Runs = Sequence[tuple[int, int]]
Kind = TypeVar("Kind", bound=Finding)


def without_faults(items: Sequence[Item], repaired: Sequence[Finding]) -> tuple[list[Item], list[Finding]]:
    """The items without wrong samples, and these; `repaired`: what is known of the records already.

    A level that is a drop-out or the converter's end in one record is the same in all others.
    """
    ends = {each.level for each in repaired if isinstance(each, Saturated) and each.level is not None}
    dropped = [stretches.drop_outs(item.y, item.run.v) for item in items]
    lost = {level for item, runs in zip(items, dropped, strict=True) for level in _levels(item.y, runs)} - ends
    kept: list[Item] = []
    found: list[Finding] = []
    for item, away in zip(items, dropped, strict=True):
        y = item.y.copy()
        levelled = {level: [run for run in runs_of(y == level) if run[1] - run[0] > 1] for level in ends | lost}
        full = sorted(run for level in ends for run in levelled[level])
        away = sorted({*away, *(run for level in lost for run in levelled[level])})
        for kind, runs in ((Saturated, full), (DropOuts, away), (HeldSamples, None)):
            if runs is None:
                runs = stretches.held(y, item.run.v)
            wrong = np.zeros(len(y), dtype=bool)
            for a, b in runs:
                wrong[a:b] = True
            if np.isfinite(y[wrong]).any():
                found.append(_finding(kind, item, y, runs))
            y[wrong] = np.nan
        changed = np.isfinite(item.y) & ~np.isfinite(y)
        known = y[np.isfinite(y)]
        kept.append(replace(item, y=y, output_range=float(np.ptp(known))) if changed.any() and len(known) else item)
    return kept, found


def merged(findings: Sequence[Kind]) -> list[Kind]:
    """One finding a kind and record: a record whose end is held out was examined in two parts."""
    found: dict[object, Kind] = {}
    for each in findings:
        key = type(each), *(getattr(each, name, None) for name in ("record", "channel", "end"))
        if key in found:
            numbers = [name for name in ("count", "samples") if hasattr(each, name)]
            each = replace(found[key], **{name: getattr(found[key], name) + getattr(each, name) for name in numbers})
        found[key] = each
    return list(found.values())


def not_at_the_end(repaired: Sequence[Finding], items: Sequence[Item]) -> list[Finding]:
    """What was repaired, with samples as held, not saturated, where another record goes beyond their level."""
    highest, lowest = (f([float(f(item.y[item.known])) for item in items if item.known.any()]) for f in (max, min))
    span = highest - lowest
    found: list[Finding] = []
    for each in repaired:
        if isinstance(each, Saturated) and each.level is not None:
            beyond = highest - each.level if each.end == "largest" else each.level - lowest
            if beyond > acceptance.RAIL_PASSED * span:
                each = HeldSamples(each.record, None, 1, each.count)
        found.append(each)
    return found


def _levels(y: Array, runs: Runs) -> set[float]:
    """Levels of runs with one value."""
    return {float(y[a]) for a, b in runs if b - a >= stretches.SHORT and np.nanmin(y[a:b]) == np.nanmax(y[a:b])}


def _finding(kind: type[Finding], item: Item, y: Array, runs: Runs) -> Finding:
    values = np.concatenate([y[a:b] for a, b in runs])
    samples = int(np.count_nonzero(np.isfinite(values)))
    first = float(item.run.t[runs[0][0]])
    level = float(np.nanmin(values)) if np.nanmax(values) == np.nanmin(values) else None
    if kind is Saturated:
        return Saturated(item.name, first, None, level, samples)
    if kind is DropOuts:
        return DropOuts(item.name, first, level, len(runs), samples)
    return HeldSamples(item.name, first, len(runs), samples)
