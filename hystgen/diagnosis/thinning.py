"""Fewer samples to search with: those that are compared, and those without which the others would come out wrong.

What an actuator does between two samples depends on the course of the drive and of the plays alone, so a stretch over
which both are straight needs no samples in it: plays depend on turning points, and filters are exact on straight lines.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.structure import Item
from hystgen.effects.base import Run

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LONGEST = 32
"""Steps of the longest stretch without a sample in it, a power of two."""

STRAIGHT, TURNING = 0.3, 0.03
"""What a model predicts over a stretch may differ from a straight line by so many times the noise, and the drive by as
much as makes that much output; at a turning point by so many times that."""

LIKE_NOISE = 1.6
"""What the model leaves may by so many times the noise, rms: white noise differs by 1.3 times from lines through it."""

COLUMN = 0.01
"""And further columns by this share of their range, rms."""


def needed(items: Sequence[Item], errors: Sequence[Array], noise: float) -> list[Mask]:
    """Samples of each record without which what a model does at the others would differ by a part of the noise.

    `errors`: what a model leaves of the records, NaN where that is not known.
    """
    return [_needed(item, left, noise) for item, left in zip(items, errors, strict=True)]


def _needed(item: Item, left: Array, noise: float) -> Mask:
    run, known, number = item.run, np.isfinite(left), len(item.run.t)
    if np.count_nonzero(known) < 2:
        return np.ones(number, dtype=bool)
    left, predicted = (np.interp(run.t, run.t[known], x[known]) for x in (left, item.y - left))
    as_drive = float(np.ptp(run.v)) / max(float(np.ptp(predicted)), 1e-300)
    bends = [  # of signals, by how much, and whether each sample or their rms may
        (predicted, STRAIGHT * noise, False),
        (run.v, STRAIGHT * noise * as_drive, False),
        (left, LIKE_NOISE * noise, True),
        *((column, COLUMN * float(np.ptp(column)), True) for column in run.extra.values()),
    ]
    found, straight = np.zeros(number, dtype=bool), np.zeros(number, dtype=bool)
    size = LONGEST
    while size > 1:
        first = np.arange(0, number, size)
        ends, sizes = np.append(first, number - 1), np.diff(np.append(first, number))
        here = np.ones(len(first), dtype=bool)
        for x, most, typical in bends:
            off = np.abs(x - np.interp(run.t, run.t[ends], x[ends]))
            much = np.sqrt(np.add.reduceat(off**2, first) / sizes) if typical else np.maximum.reduceat(off, first)
            here &= much <= most
        now = np.repeat(here, sizes) & ~straight
        found[first[now[first]]] = True
        straight |= now
        size //= 2
    found |= ~straight
    found[[0, -1]] = True
    turns = np.flatnonzero(np.diff(np.sign(np.diff(run.v)))) + 1  # which plays remember
    kept = np.flatnonzero(found)
    beyond = np.abs(run.v[turns] - np.interp(run.t[turns], run.t[kept], run.v[kept]))
    found[turns[beyond > TURNING * noise * as_drive]] = True
    return found


def everything(groups: Sequence[Sequence[Item]]) -> list[list[Mask]]:
    """The same where no sample may be left out."""
    return [[np.ones(len(item.run.t), dtype=bool) for item in group] for group in groups]


def thinned(groups: Sequence[Sequence[Item]], most: int, masks: Sequence[Sequence[Mask]]) -> list[list[Item]]:
    """Groups of records with at most so many samples compared in each, every so many-th, beside the samples needed.

    `masks`: the needed samples of each record. Groups that need not be thinned are the same as before.
    """
    every = [max(1, -(-sum(int(np.count_nonzero(item.known)) for item in group) // most)) for group in groups]
    if max(every) == 1:
        return [list(group) for group in groups]
    kept: dict[int, Mask] = {}  # by run, since two records may be parts of one
    for group, step, needs in zip(groups, every, masks, strict=True):
        for item, mask in zip(group, needs, strict=True):
            keep = mask.copy()
            keep[::step] = True
            kept[id(item.run)] = keep | kept.get(id(item.run), False)
    sessions: dict[int, tuple[Run, Mask]] = {}
    for item in itertools.chain(*groups):
        if item.session is not None:
            _, whole = sessions.setdefault(id(item.session), (item.session, np.ones(len(item.session.t), dtype=bool)))
            whole[item.part] = kept[id(item.run)]
    picked = {key: (run.picked(np.flatnonzero(mask)), np.cumsum(mask)) for key, (run, mask) in sessions.items()}
    runs: dict[int, Run] = {}

    def less(item: Item, step: int) -> Item:
        keep = kept[id(item.run)]
        run = runs.setdefault(id(item.run), item.run.picked(np.flatnonzero(keep)))
        y = np.full_like(item.y, np.nan)
        y[::step] = item.y[::step]
        made = replace(item, run=run, y=y[keep])
        if item.session is None:
            return made
        session, number = picked[id(item.session)]
        begin = int(number[item.part.start]) - 1
        return replace(made, session=session, part=slice(begin, begin + len(run.t)))

    return [[less(item, step) for item in group] for group, step in zip(groups, every, strict=True)]
