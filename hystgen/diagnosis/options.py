"""What can be added to a hypothesis: every shape of every effect of the catalogue, and fronts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen import effects
from hystgen.diagnosis.structure import Fitted, Item, Part, Structure
from hystgen.effects.base import About, Effect
from hystgen.identification.fronts import DeadZones, Front, Straight, Tanh, even_breaks

Array = NDArray[np.float64]

BREAKS = 4
"""Breaks of the dead-zone sum that an asymmetry is sought with."""

PLACES = 201


@dataclass(frozen=True)
class Option:
    """One way to extend a hypothesis. `front`: it puts a memoryless part in front, which is named once found."""

    label: str
    structure: Structure
    starts: tuple[Array, ...]
    name: str
    front: bool = False


def about(items: Sequence[Item], thresholds: Array) -> About:
    """What the records are like, for the shapes that are worth trying."""
    low = min(float(item.run.v.min()) for item in items)
    high = max(float(item.run.v.max()) for item in items)
    steps = np.concatenate([np.diff(item.run.t) for item in items])
    rates = [float(np.max(np.abs(np.diff(item.run.v) / np.diff(item.run.t)))) for item in items]
    columns = set(items[0].run.extra)
    for item in items:
        columns &= set(item.run.extra)
    begin, end = min(float(item.run.t[0]) for item in items), max(float(item.run.t[-1]) for item in items)
    return About(
        (low, high),
        max(item.output_range for item in items),
        float(np.median(steps)),
        max(float(np.ptp(item.run.t)) for item in items),
        end - begin,
        max(rates),
        float(sum(np.sum(np.abs(np.diff(item.run.v))) for item in items)),
        tuple(float(r) for r in thresholds),
        frozenset(columns),
    )


def options(now: Fitted, known: About, user: Sequence[type[Effect]] = ()) -> list[Option]:
    """Every extension of a hypothesis by one effect."""
    structure = now.structure
    there = [part.name for part in structure.parts]
    found = []
    front_shape, _ = structure.pieces(now.shape)
    if isinstance(structure.front, Straight):
        fronts: list[tuple[str, Front]] = [
            ("front of dead zones", DeadZones(known.drive, even_breaks(known.drive, BREAKS))),
            ("front of one tanh", Tanh(known.drive)),
        ]
        for label, front in fronts:
            start = np.concatenate([front.straight, now.shape[len(front_shape) :]])
            found.append(Option(label, replace(structure, front=front), (start,), "asymmetry", True))
    kinds = [(name, kind) for name in effects.CATALOGUE for kind in effects.shapes(name)]
    kinds += [(kind.model_fields["name"].annotation.__args__[0], kind) for kind in user]  # type: ignore[union-attr]
    for name, kind in kinds:
        if (name in there and not kind.repeatable) or not known.columns.issuperset(kind.columns):
            continue
        for candidate in kind.candidates(known):
            part = Part(name, candidate)
            starts = tuple(np.concatenate([now.shape, one]) for one in (candidate.start, *candidate.others))
            found.append(Option(candidate.label, replace(structure, parts=(*structure.parts, part)), starts, name))
    return found


def front_name(front: Front, shape: Array, drive: tuple[float, float]) -> str:
    """`saturation` for a front that bends alike at both ends and flattens there, else `asymmetry`."""
    v = np.linspace(*drive, PLACES)
    w = v
    for stage in front.stages(shape):
        w = stage.forward(w)
    bent = w - np.polyval(np.polyfit(v, w, 1), v)
    odd, even = 0.5 * (bent - bent[::-1]), 0.5 * (bent + bent[::-1])
    slopes = np.diff(w)
    ends = 0.5 * (slopes[: PLACES // 8].mean() + slopes[-PLACES // 8 :].mean())
    odd_wins = np.sum(odd**2) > 2.0 * np.sum(even**2)
    return "saturation" if odd_wins and ends < slopes[PLACES // 3 : -PLACES // 3].mean() else "asymmetry"
