"""Elements in parallel with the plays along a record, whose start is usually unknown.

Elements forget their start as their input travels, unlike plays, which forget it once the input turns far enough out.
Any start is the result of an approach: the input came to the first sample from some other value, with the elements at
rest there. From far above or far below, the elements are at a limit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hystgen.effects.base import Effect
from hystgen.identification import pi, reduction
from hystgen.identification.reduction import Course

Array = NDArray[np.float64]

FAR = 50.0
"""[drive ranges] Distance from which the input comes to bring the elements to a limit: they are at most as wide as the
range, and exp(-50) is 2e-22."""

NEAR = 1e-3
"""[drive ranges] Scale of the approaches that are tried: far above it their distances grow geometrically."""

TRIES = 60
"""[evaluations] Maximum number in the search for an approach; 20 to 30 are usual."""

PRECISE = 1e-7
"""[logarithms of `FAR` over `NEAR`] Approaches are found to this precision: to 1e-6 of an element's limit."""

LOOPS = 4
"""[turns] Smallest number of turns between smaller loops that shows whether loops close: two loops have four. The turns
where a record begins and ends belong to none."""

SMALLER = 0.9
"""[times the widest] Largest span of a smaller loop: drifts and overshoots change a span by less."""

SPEEDS = 1.5
"""[ratio] Smallest ratio of the fastest turn's speed to the slowest's that tells travel from time."""


def shown(courses: Sequence[Course], steps: Sequence[float]) -> bool:
    """Whether records can tell elements from plays, by smaller loops, and from effects of time, by speeds; `steps`:
    seconds from sample to sample in each record."""
    turns = [(turn, steps[item.origin[0]]) for item in courses for turn in pi.turns_of(item)]
    widest = max((turn.span for turn, _ in turns), default=0.0)
    smaller = sum(turn.span < SMALLER * widest for turn, _ in turns)
    speeds = [turn.speed / step for turn, step in turns]
    return smaller >= LOOPS and max(speeds) >= SPEEDS * min(speeds)


def term(inner: Course, parallel: Effect) -> Array:
    """The term (N,) in parallel with the plays along a course behind the front."""
    before = np.array([inner.v[0] + inner.approach] if inner.visited is None else inner.visited)
    return parallel.parallel(np.concatenate([before, inner.v]))[len(before) :]


def forgotten(inner: Course, parallel: Effect) -> int:
    """First sample from which the term depends on an unknown start by less than `reduction.AS_FAR` of the output range.

    At every sample, the term is between those of approaches from far above and from far below, whatever the start. If
    more than half of the samples depend on the start, those from the middle on are compared.
    """
    if inner.visited is not None:
        return 0
    far = FAR * float(np.ptp(inner.v))
    above, below = (term(replace(inner, approach=way * far), parallel) for way in (1.0, -1.0))
    late = np.flatnonzero(np.abs(above - below) > reduction.AS_FAR * inner.output_range)
    end = int(late[-1]) + 1 if len(late) else 0
    return min(end, (inner.begin + inner.last) // 2)


def approached(inner: Course, parallel: Effect, thresholds: Array, weights: Array) -> Course:
    """The course with the approach that explains its samples best, given the plays and their weights."""
    from scipy.optimize import minimize_scalar

    if inner.visited is not None:
        return inner
    rest = inner.y - reduction.prediction(inner.v, None, thresholds, weights)
    begin = replace(inner, forgotten=forgotten(inner, parallel)).resettled(float(thresholds[-1])).first
    near = NEAR * float(np.ptp(inner.v))
    most = math.log1p(FAR / NEAR)

    def approach(x: float) -> float:
        return math.copysign(near * math.expm1(abs(x) * most), x)

    def error(x: float) -> float:
        left = (rest - term(replace(inner, approach=approach(x)), parallel))[begin : inner.last]
        return float(np.nanvar(left))

    search = {"xatol": PRECISE, "maxiter": TRIES}
    found = minimize_scalar(error, bounds=(-1.0, 1.0), method="bounded", options=search)
    return replace(inner, approach=approach(float(found.x)))
