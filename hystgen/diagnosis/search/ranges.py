"""Parameters at an end of their search range, and the wider range tried for them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.findings.result import AtEnd
from hystgen.diagnosis.search import acceptance, fits
from hystgen.diagnosis.search.fits import Fitted, ends_of
from hystgen.diagnosis.search.hypothesis import Part
from hystgen.diagnosis.search.screening import Records
from hystgen.effects.base import Candidate, Effect
from hystgen.identification.joint import DIFFERENCE

Array = NDArray[np.float64]

BISECTIONS = 4
"""Bisections of a widening that the schema does not allow in full: they locate the limit to a sixteenth of the
widening, which affects only how far a search may go."""

LEAST, LARGEST = "least", "largest"

BEYOND, NO_LESS, LIMIT, FIRM, NOISE = "beyond", "no less", "limit", "firm", "noise"
"""Why a parameter is at an end: a wider range was better; a wider range was not better; the schema allows none; the
range is fixed; only noise remains, so none was tried."""


@dataclass(frozen=True)
class End:
    """A parameter at or beyond an end of its range, as in `AtEnd`; `part`, `name`: index and name of its effect."""

    part: int
    name: str
    found: AtEnd


def wider(now: Fitted, records: Records) -> Fitted | None:
    """The hypothesis fitted with wider ranges for parameters at an end of theirs; None if the schema allows no wider
    range."""
    if not _parts_at_an_end(now):
        return None
    numbers, thresholds = now.structure.pieces(now.shape)[1], tuple(now.structure.thresholds.tolist())
    found = [widened(part, x, thresholds) for part, x in zip(now.structure.parts, numbers, strict=True)]
    if all(new is part for new, part in zip(found, now.structure.parts, strict=True)):
        return None
    structure = replace(now.structure, parts=tuple(found))
    return records.restarted(fits.fit(structure, records.quick, now.shape, now.weights))


def _parts_at_an_end(now: Fitted) -> list[int]:
    return [k for k in range(len(now.structure.parts)) if fits.part_at_an_end(now, k)]


def widened(part: Part, numbers: Array, thresholds: tuple[float, ...]) -> Part:
    """The part with its range widened by `acceptance.WIDER` usual widths beyond each end that a parameter has reached.

    It is widened only as far as the schema allows; if the schema allows no widening, the part itself is returned.
    """
    if part.firm:
        return part
    candidate, usual = part.candidate, part.ordinary
    low, high = candidate.low.copy(), candidate.high.copy()
    for j, largest in ends_of(candidate, numbers):
        way = acceptance.WIDER * (usual.high[j] - usual.low[j]) * (1.0 if largest else -1.0)
        share = _allowed(candidate, numbers, j, way, thresholds)
        (high if largest else low)[j] += share * way
    if np.array_equal(low, candidate.low) and np.array_equal(high, candidate.high):
        return part
    return replace(part, candidate=replace(candidate, low=low, high=high), usual=usual)


def _allowed(candidate: Candidate, numbers: Array, j: int, way: float, thresholds: tuple[float, ...]) -> float:
    """Largest fraction of a move `way` of parameter j that changes the effect and that the schema allows.

    The schema must allow a little more, so that a search can form differences there.
    """
    here = _made(candidate, numbers, thresholds)

    def differs(share: float) -> bool:
        moved = numbers.copy()
        moved[j] += share * way + math.copysign(DIFFERENCE, way)
        there = _made(candidate, moved, thresholds)
        return there is not None and there != here

    if differs(1.0):
        return 1.0
    inside, step = 0.0, 1.0
    for _ in range(BISECTIONS):
        step *= 0.5
        if differs(inside + step):
            inside += step
    return inside


def _made(candidate: Candidate, numbers: Array, thresholds: tuple[float, ...]) -> dict[str, object] | None:
    """The keys of the effect with these parameters; None if the schema does not allow it."""
    try:
        made = candidate.build(numbers)
        checked = type(made).model_validate(made.model_dump())
    except (ValueError, ArithmeticError):  # pydantic's errors are ValueErrors
        return None
    return None if any(True for _ in checked.problems(thresholds)) else fits.entry(checked)


class WiderRange(NamedTuple):
    """Held-out rms errors with the widest range that failed, and with the range kept instead."""

    leaves: float
    kept: float


def ends(now: Fitted, failed: WiderRange | None, only_noise: bool) -> tuple[End, ...]:
    """The parameters at or beyond an end of their usual range; `failed`: errors if a wider range was tried and
    failed."""
    found = []
    for k in _parts_at_an_end(now):
        part, x = now.structure.parts[k], now.structure.pieces(now.shape)[1][k]
        thresholds = tuple(now.structure.thresholds.tolist())
        usual, there = part.ordinary, dict(ends_of(part.candidate, x))
        reach = widened(part, x, thresholds).candidate
        for j, largest in ends_of(usual, x):
            end, far = (usual.high, reach.high) if largest else (usual.low, reach.low)
            build = part.candidate.build
            key, value = _number(build, x, j, largest, x[j])
            tried = failed if j in there and far[j] != x[j] else None
            beyond = bool(x[j] > end[j]) if largest else bool(x[j] < end[j])
            why = BEYOND if beyond else NOISE if only_noise else FIRM if part.firm else NO_LESS if tried else LIMIT
            at_end = AtEnd(
                key, value, LARGEST if largest else LEAST, _number(build, x, j, largest, end[j])[1],
                _number(build, x, j, largest, far[j])[1] if tried else None,
                tried.leaves if tried else None, tried.kept if tried else None, why,
            )
            found.append(End(k, part.name, at_end))
    return tuple(found)


def _number(
    build: Callable[[Array], Effect], numbers: Array, j: int, largest: bool, value: float
) -> tuple[str, float]:
    """The parameter file's key of parameter j, which is at an end of its range, and its entry for a `value` of j."""
    at, near = numbers.copy(), numbers.copy()
    at[j], near[j] = value, numbers[j] - (DIFFERENCE if largest else -DIFFERENCE)
    here, there = build(numbers), build(near)
    keys = [key for key in type(here).model_fields if key not in here.settled]
    key = next((key for key in keys if getattr(here, key) != getattr(there, key)), "")
    if not key:
        return "", float(value)
    found, other, made = getattr(here, key), getattr(there, key), getattr(build(at), key)
    if isinstance(found, int | float):
        return key, float(made)
    flat, moved, values = _flat(found), _flat(other), _flat(made)
    changed = [i for i, pair in enumerate(zip(flat, moved, strict=True)) if pair[0] != pair[1]]
    most = max(changed, key=lambda i: abs(values[i]))
    return (f"{key} {most + 1}" if len(changed) == 1 and len(flat) > 1 else key), values[most]


def _flat(value: Any) -> list[float]:
    if isinstance(value, Sequence):
        return [x for each in value for x in _flat(each)]
    return [float(value)]
