"""Records without what rules their errors and is none of the actuator: mains hum, which hides effects, and what a
sensor adds over the position, which would be taken for effects and for stick-slip."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hystgen.diagnosis import periodic, told
from hystgen.diagnosis.believed import Prepared
from hystgen.diagnosis.floor import HOLD, still
from hystgen.diagnosis.held_out import ENOUGH
from hystgen.diagnosis.structure import Fitted, Item

ROUNDS = 3
"""A model that was fitted to a ripple stands beside the positions that the ripple is seen over; without it, it comes
nearer to them."""

SAME = 0.05
"""A line is the rest of a stronger one whose pitch or frequency differs by a smaller share."""


@dataclass(frozen=True)
class Cleaned:
    """Records as they were measured, and without the lines that are told of them."""

    measured: Prepared
    clean: Prepared
    told: list[dict[str, Any]]

    def seen_by(self, fitted: Fitted) -> Cleaned:
        """Without the lines that a model leaves, over the positions that it predicts."""
        measured, clean = _items(self.measured), _items(self.clean)
        errors = [
            error + (item.y - without.y)
            for item, without, error in zip(measured, clean, fitted.errors(clean), strict=True)
        ]
        found, left = periodic.ruling(measured, errors)
        items = [
            replace(item, y=item.y - (error - rest)) for item, error, rest in zip(measured, errors, left, strict=True)
        ]
        number = len(self.measured.to_fit)
        lines = [{**line, "repaired": True} for k, line in enumerate(found) if not is_told(line, found[:k])]
        return replace(self, clean=replace(self.measured, to_fit=items[:number], held=items[number:]), told=lines)

    def left_by(self, fitted: Fitted) -> bool:
        """Whether more such lines are in what a model leaves."""
        clean = _items(self.clean)
        return bool(periodic.ruling(clean, fitted.errors(clean))[0])

    def notes(self, unit: str | None) -> list[str]:
        """What was done to the records."""
        return [told.sentence(each, unit) for each in self.told]


def none_in(ready: Prepared) -> Cleaned:
    """Records of which no disturbance is known."""
    return Cleaned(ready, ready, [])


def taken_out(found: Cleaned, fitted: Fitted, refit: Callable[[Prepared], Fitted]) -> Cleaned:
    """Records without the lines that a model shows which is fitted anew to what is left of them."""
    for _ in range(ROUNDS):
        seen = found.seen_by(fitted)
        if not seen.told:
            break
        found, fitted = seen, refit(_moving(seen.clean))
    return found


def _moving(ready: Prepared) -> Prepared:
    """The records without their holds: there a ripple is an offset that the model would be bent to meet, and one that
    is wrong is not seen."""

    def without_holds(item: Item) -> Item:
        y = item.y.copy()
        for first, last in still(item.run.v, HOLD):
            y[first + 1 : last] = np.nan
        return replace(item, y=y) if np.count_nonzero(np.isfinite(y)) > ENOUGH else item

    return replace(ready, to_fit=[without_holds(item) for item in ready.to_fit])


def is_told(line: dict[str, Any], others: Sequence[dict[str, Any]]) -> bool:
    """Whether a line is the rest of one that is told already."""
    place = {"ripple": "pitch", "line": "frequency"}[line["kind"]]
    return any(each["kind"] == line["kind"] and abs(line[place] / each[place] - 1.0) < SAME for each in others)


def _items(ready: Prepared) -> list[Item]:
    return [*ready.to_fit, *ready.held]
