"""Records without disturbances that rule their errors: mains hum, and a sensor's ripple over the position.

Hum hides effects; a ripple would be taken for effects and for stick-slip.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from hystgen.diagnosis.data import periodic
from hystgen.diagnosis.data.items import Item, Model
from hystgen.diagnosis.data.noise_floor import still
from hystgen.diagnosis.data.preparing import Prepared
from hystgen.diagnosis.findings.kinds import Line, Ripple
from hystgen.diagnosis.search import acceptance

Fitted = TypeVar("Fitted", bound=Model)

ROUNDS = 3
"""Rounds of removal: a model fitted to a ripple is off the positions over which the ripple is seen, and comes nearer to
them without it."""


@dataclass(frozen=True)
class Cleaned:
    """Records as they were measured, the same without their lines, and these lines."""

    measured: Prepared
    clean: Prepared
    lines: tuple[Line | Ripple, ...] = ()

    def seen_by(self, fitted: Model) -> Cleaned:
        """The measured records without the lines that a model leaves, over the positions that it predicts."""
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
        lines = tuple(replace(line, repaired=True) for k, line in enumerate(found) if not is_known(line, found[:k]))
        return replace(self, clean=replace(self.measured, to_fit=items[:number], held=items[number:]), lines=lines)

    def left_by(self, fitted: Model) -> bool:
        """Whether a model leaves further such lines."""
        clean = _items(self.clean)
        return bool(periodic.ruling(clean, fitted.errors(clean))[0])

    def notes(self, unit: str | None) -> list[str]:
        """What was done to the records, one sentence each."""
        return [line.sentence(unit) for line in self.lines]


def taken_out(found: Cleaned, fitted: Fitted, refit: Callable[[Prepared], Fitted]) -> Cleaned:
    """The records without the lines that a model shows, which is refitted to what is left of them each time."""
    for _ in range(ROUNDS):
        seen = found.seen_by(fitted)
        if not seen.lines:
            break
        found, fitted = seen, refit(_moving(seen.clean))
    return found


def _moving(ready: Prepared) -> Prepared:
    """The records without their holds, where a ripple is an offset to which the model would be fitted unnoticed."""

    def without_holds(item: Item) -> Item:
        y = item.y.copy()
        for first, last in still(item.run.v, acceptance.HOLD_SAMPLES):
            y[first + 1 : last] = np.nan
        return replace(item, y=y) if np.count_nonzero(np.isfinite(y)) > acceptance.COMPARED_SAMPLES else item

    return replace(ready, to_fit=[without_holds(item) for item in ready.to_fit])


def is_known(line: Line | Ripple, others: Sequence[Line | Ripple]) -> bool:
    """Whether a line is the remainder of one that is known already."""
    return any(
        each.kind == line.kind and abs(line.place / each.place - 1.0) < acceptance.SAME_LINE for each in others
    )


def _items(ready: Prepared) -> list[Item]:
    return [*ready.to_fit, *ready.held]
