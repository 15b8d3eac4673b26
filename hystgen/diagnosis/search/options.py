"""Extensions of a hypothesis: every shape of every effect of the catalogue, and fronts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen import effects
from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.search import acceptance
from hystgen.diagnosis.search.fits import Fitted
from hystgen.diagnosis.search.structure import Part, Structure
from hystgen.effects.base import About, Effect
from hystgen.identification.fronts import Bent, DeadZones, Ends, Front, Tanh, even_breaks

Array = NDArray[np.float64]

PLACES = 201
"""Drives at which the slope of a front is judged."""


@dataclass(frozen=True)
class Option:
    """One way to extend a hypothesis. `front`: it adds a memoryless part in front, which is named once it is fitted.

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
        """The shape of the whole hypothesis with these numbers of the extension; the others stay."""
        front_shape, _ = now.structure.pieces(now.shape)
        if self.front:
            return np.concatenate([numbers, now.shape[len(front_shape) :]])
        return np.concatenate([now.shape, numbers])


def about(items: Sequence[Item], thresholds: Array) -> About:
    """Ranges, rates and times of the records, from which effects choose their candidates."""
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
        found += _fronts(structure, held, known.drive)
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


def _fronts(structure: Structure, held: Structure, drive: tuple[float, float]) -> list[Option]:
    """The memoryless parts that may be added in front."""

    def one(label: str, front: Front, starts: Sequence[Array], beyond: str = "") -> Option:
        pair = replace(structure, front=front), replace(held, front=front)
        return Option(label, "asymmetry", *pair, tuple(starts), True, beyond)

    one_way, both_ways = Bent(drive, 1), Bent(drive, 2)
    dead_zones, finer = (DeadZones(drive, even_breaks(drive, n)) for n in (acceptance.BREAKS, acceptance.FINER_BREAKS))
    tanh = Tanh(drive)
    sides = (-acceptance.TANH_SIDE, acceptance.TANH_SIDE)
    bent = [np.array([acceptance.TANH_BEND, side]) for side in sides]  # one way over the whole range
    # a limit outside the range does nothing, nor does a small change of it: start inside
    limiters = [np.array([share, share, -2.0]) for share in acceptance.LIMITERS]
    return [
        one("front that bends one way", one_way, [one_way.straight]),
        one("front that bends both ways", both_ways, [both_ways.straight]),
        one("front of dead zones", dead_zones, [dead_zones.straight]),
        one("front of more dead zones", finer, [finer.straight], "front of dead zones"),
        one("front of one tanh", tanh, [tanh.straight, *bent]),
        one("front with flatter ends", Ends(drive), limiters),
    ]


def front_names(front: Front, shape: Array, drive: tuple[float, float]) -> tuple[str, ...]:
    """`saturation` for a front that is straight between flatter ends, or bends alike at both; else `asymmetry`.

    Both names where one end alone is a little flatter: a soft limit there and a bent actuator give the same front.
    """
    v = np.linspace(*drive, PLACES)
    w = v
    for stage in front.stages(shape):
        w = stage.forward(w)
    slopes = np.diff(w) / np.diff(v)
    middle, near = float(np.median(slopes)), acceptance.LIMITER_NEAR * float(np.ptp(slopes))
    flatter, other = sorted(float(end.mean()) for end in (slopes[: PLACES // 16], slopes[-PLACES // 16 :]))
    straight = float(np.mean(np.abs(slopes - middle) <= near)) >= acceptance.LIMITER_STRAIGHT
    if straight and other <= middle + near and flatter < middle - near:
        sure = flatter < acceptance.LIMITER_SLOPE * middle or other < middle - near
        return ("saturation",) if sure else ("saturation", "asymmetry")
    bent = w - np.polyval(np.polyfit(v, w, 1), v)
    odd, even = 0.5 * (bent - bent[::-1]), 0.5 * (bent + bent[::-1])
    ends = 0.5 * (slopes[: PLACES // 8].mean() + slopes[-PLACES // 8 :].mean())
    odd_wins = np.sum(odd**2) > acceptance.ODD_FRONT * np.sum(even**2)
    return ("saturation",) if odd_wins and ends < slopes[PLACES // 3 : -PLACES // 3].mean() else ("asymmetry",)
