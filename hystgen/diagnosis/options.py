"""What can be added to a hypothesis: every shape of every effect of the catalogue, and fronts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen import effects
from hystgen.diagnosis.structure import Fitted, Item, Part, Structure
from hystgen.effects.base import About, Effect
from hystgen.identification.fronts import DeadZones, Front, Tanh, even_breaks

Array = NDArray[np.float64]

BREAKS, FINER = 4, 8
"""Breaks of the dead-zone sum that an asymmetry is sought with, and of the one that is tried where it helps."""

BENT, ASIDE = 0.3, 2.0
"""Curvature and place of tanh envelopes from which a search starts too: bent one way all over the range."""

PLACES = 201


@dataclass(frozen=True)
class Option:
    """One way to extend a hypothesis. `front`: it puts a memoryless part in front, which is named once found.

    `structure`: with all numbers to find; `alone`: with those of the extension alone, from `starts`. `beyond`: label of
    the simpler one that it contains, and without which it is not tried; `grown`: a start from the numbers of that.
    """

    label: str
    name: str
    structure: Structure
    alone: Structure
    starts: tuple[Array, ...]
    front: bool = False
    beyond: str = ""
    grown: Callable[[Array], Array] | None = None

    def joined(self, now: Fitted, numbers: Array) -> Array:
        """The shape of all, where the extension has these numbers and the rest is as it was."""
        front_shape, _ = now.structure.pieces(now.shape)
        if self.front:
            return np.concatenate([numbers, now.shape[len(front_shape) :]])
        return np.concatenate([now.shape, numbers])


def about(items: Sequence[Item], thresholds: Array) -> About:
    """What the records are like, for the shapes that are worth trying."""
    low = min(float(item.run.v.min()) for item in items)
    high = max(float(item.run.v.max()) for item in items)
    finest = min(float(np.median(np.diff(item.run.t))) for item in items)
    rates = [float(np.max(np.abs(np.diff(item.run.v) / np.diff(item.run.t)))) for item in items]
    columns = set(items[0].run.extra)
    for item in items:
        columns &= set(item.run.extra)
    begin, end = min(float(item.run.t[0]) for item in items), max(float(item.run.t[-1]) for item in items)
    return About(
        (low, high),
        max(item.output_range for item in items),
        finest,
        max(float(np.ptp(item.run.t)) for item in items),
        end - begin,
        max(rates),
        float(sum(np.sum(np.abs(np.diff(item.run.v))) for item in items)),
        tuple(float(r) for r in thresholds),
        frozenset(columns),
    )


def options(now: Fitted, known: About, user: Sequence[type[Effect]] = ()) -> list[Option]:
    """Every extension of a hypothesis by one effect."""
    structure, held = now.structure, now.structure.held(now.shape)
    there = [part.name for part in structure.parts]
    moved = any(effect.moves_plays() for effect in structure.effects(now.shape))
    found = []
    if not held.front.stages(np.empty(0)):
        tanh = Tanh(known.drive)
        dead_zones, finer = (DeadZones(known.drive, even_breaks(known.drive, n)) for n in (BREAKS, FINER))
        bent = [np.array([BENT, side]) for side in (-ASIDE, ASIDE)]
        fronts: list[tuple[str, Front, tuple[Array, ...], str]] = [
            ("front of dead zones", dead_zones, (dead_zones.straight,), ""),
            ("front of more dead zones", finer, (finer.straight,), "front of dead zones"),
            ("front of one tanh", tanh, (tanh.straight, *bent), ""),
        ]
        for label, front, starts, beyond in fronts:
            pair = replace(structure, front=front), replace(held, front=front)
            found.append(Option(label, "asymmetry", *pair, starts, True, beyond))
    kinds = [(name, kind) for name in effects.CATALOGUE for kind in effects.shapes(name)]
    kinds += [(kind.model_fields["name"].annotation.__args__[0], kind) for kind in user]  # type: ignore[union-attr]
    for name, kind in kinds:
        if (name in there and not kind.repeatable) or not known.columns.issuperset(kind.columns):
            continue
        if moved and kind.moves_plays():
            continue
        for candidate in kind.candidates(known):
            part = Part(name, candidate)
            pair = replace(structure, parts=(*structure.parts, part)), replace(held, parts=(*held.parts, part))
            starts = (candidate.start, *candidate.others)
            found.append(Option(candidate.label, name, *pair, starts, False, candidate.beyond, candidate.grown))
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
