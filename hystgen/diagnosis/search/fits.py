"""Joint fits: the weights of the plays and all other numbers of a hypothesis, on the free-run error of whole records.

The output is linear in the weights wherever no output map bends it, so each step solves for the weights and for the
change of all other numbers at once (`identification.joint`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen.diagnosis.data.items import Item
from hystgen.diagnosis.search.actuator import Actuator, NotFiniteError, Sums
from hystgen.diagnosis.search.structure import Structure
from hystgen.identification import joint, reduction, weights
from hystgen.identification.constrained import root_mean_square
from hystgen.identification.joint import DIFFERENCE, Shaped
from hystgen.identification.reduction import Reduced
from hystgen.plays import operators

Array = NDArray[np.float64]

POLISHED = 1e-5
"""A search ends with a step that lowers the error by a smaller share: far below any difference that decides."""


class _Block:
    """A record's part of the system about a shape and weights: plays and measured output, reduced; then derivatives.

    The reflections of the reduction are kept, so that the columns of the derivatives are reduced alone.
    """

    def __init__(self, here: Actuator, item: Item, p: Array) -> None:
        self._item, self._p = item, p
        self._level = np.zeros(1)
        offset = None
        rows, constant = here.columns(item)
        h = operators.weighted_sum(p, rows) + constant
        measured = item.y[item.compared]
        if here.bends:
            self._level, moved = here.level(h, item)
            offset = here.compared(moved, item)
            bent = here.mapped(h, self._level, item)
            step = DIFFERENCE * max(float(np.ptp(h)), 1e-12)
            slope = (here.mapped(h + step, self._level, item) - bent) / step
            rows = here.compared(rows * slope, item)
            h = here.compared(bent, item)
            target = measured - h + p @ rows
        else:
            target = measured - constant
        added = here.added(item)
        self._sum = h + added
        self.samples = len(h)
        free = here.nuisances(item, offset)
        self._free = len(free)
        table = np.empty((len(free) + len(rows) + 1, len(h))).T
        table[:, : len(free)] = free.T
        table[:, len(free) : -1] = rows.T
        table[:, -1] = target - added
        self._reduced = [reduction.reflected(part) for part in self._cut(table)]

    def _cut(self, table: Array) -> list[Array]:
        """Chunks of a few thousand samples, which stay in the cache while they are reduced."""
        if len(table) <= reduction.CHUNK:
            return [table]
        return [table[k : k + reduction.CHUNK] for k in range(0, len(table), reduction.CHUNK)]

    def system(self, varied: Sequence[Actuator] = ()) -> Array:
        """The triangle of plays, measured output and derivatives, without the free components of the record."""
        if not varied:
            return self._without_free([part.triangle for part in self._reduced])
        table = np.empty((len(varied), self.samples)).T
        sums: Sums = {}
        for j, other in enumerate(varied):
            table[:, j] = (self._of(other, sums) - self._sum) / DIFFERENCE
        parts = zip(self._reduced, self._cut(table), strict=True)
        return self._without_free([part.extended(columns) for part, columns in parts])

    def _of(self, other: Actuator, sums: Sums) -> Array:
        """The prediction of other numbers with the same weights and offset."""
        rows, constant = other.columns(self._item, self._p, sums)
        moved = rows[0] + constant
        if other.bends:
            moved = other.compared(other.mapped(moved, self._level, self._item), self._item)
        return np.asarray(moved + other.added(self._item))

    def _without_free(self, triangles: Sequence[Array]) -> Array:
        whole = triangles[0] if len(triangles) == 1 else reduction.triangle(*triangles)
        return whole[self._free :, self._free :]


def linear(structure: Structure, items: Sequence[Item], shape: Array, p: Array) -> Shaped:
    """The best weights of a shape, and the linear system about the shape and about weights `p` close to them."""
    n1 = len(structure.thresholds)
    here = structure.actuator(shape)
    try:
        blocks = [_Block(here, item, p) for item in items if item.known.any()]
    except NotFiniteError:
        return Shaped(shape, p, math.inf, p, 1, lambda: Reduced(structure.thresholds, np.empty((0, 0)), (), ()))
    samples = sum(block.samples for block in blocks)

    def derived() -> Reduced:
        varied = structure.varied(shape, here)
        whole = reduction.triangle(*(block.system(varied) for block in blocks))
        measured_last = [*range(n1), *range(n1 + 1, whole.shape[1]), n1]
        return Reduced(structure.thresholds, whole[:, measured_last], (), (samples,))

    whole = reduction.triangle(*(block.system() for block in blocks))
    if not np.isfinite(whole).all():  # the numbers are far out
        return Shaped(shape, p, math.inf, p, samples, derived)
    columns = np.arange(n1)
    best = weights.non_negative(whole, columns)
    return Shaped(shape, p, root_mean_square(weights.residual(whole, columns, best), samples), best, samples, derived)


@dataclass(frozen=True)
class Fitted:
    """A structure with its numbers and weights, and the rms error of the fit."""

    structure: Structure
    shape: Array
    weights: Array
    rms: float

    @property
    def actuator(self) -> Actuator:
        """The actuator of the shape."""
        return self.structure.actuator(self.shape)

    @property
    def reach(self) -> float:
        """The largest threshold, input units."""
        return float(self.structure.thresholds[-1])

    @property
    def bare(self) -> bool:
        """Whether there is neither a front nor an effect."""
        return not self.structure.parts and not self.actuator.stages

    def errors(self, items: Sequence[Item], like: Fitted | None = None) -> list[Array]:
        """Error signals over records; `like`: with the free components of another model."""
        actuator = self.actuator
        other = None if like is None else (like.actuator, like.weights)
        return [actuator.error(item, self.weights, other) for item in items]


@dataclass(frozen=True, eq=False)
class Search:
    """The state of a search for the numbers of a structure, from which it can continue."""

    structure: Structure
    items: Sequence[Item]
    now: Shaped
    damping: float = joint.DAMPING

    def further(self, steps: int = joint.MOST_STEPS, little: float = POLISHED) -> Search:
        """At most `steps` further, until one lowers the error by a smaller share than `little`."""
        now, damping = joint.search(
            lambda shape, p: linear(self.structure, self.items, shape, p),
            self.structure,
            self.now,
            steps,
            little,
            self.damping,
        )
        return replace(self, now=now, damping=damping)

    def found(self, otherwise: Array) -> Fitted:
        """The fit; `otherwise`: its weights if the numbers are too far out to solve for them."""
        best = self.now.best if math.isfinite(self.now.rms) else otherwise
        return Fitted(self.structure, self.now.shape, best, self.now.rms)


def begun(structure: Structure, items: Sequence[Item], start: Array, p: Array) -> Search:
    """A search at its start; `p`: weights close to the best ones."""
    return Search(structure, items, linear(structure, items, np.clip(start, *structure.bounds), p))


def fit(structure: Structure, items: Sequence[Item], start: Array, p: Array) -> Fitted:
    """The end of a search from a start; `p`: weights close to the best ones."""
    return begun(structure, items, start, p).further().found(p)


def invertible(fitted: Fitted, items: Sequence[Item], floor: float) -> tuple[Fitted, weights.Weights]:
    """A hypothesis with p_0 raised to a share `floor` of the sum of weights if the records allow it, and its weights.

    As in `identify` (`weights.fit`); all other numbers stay.
    """
    p, here = fitted.weights, fitted.actuator
    kept = weights.Weights(p, fitted.rms)
    if len(p) < 2 or p[0] >= floor * float(np.sum(p)):
        return fitted, kept
    blocks = [_Block(here, item, p) for item in items if item.known.any()]
    whole = reduction.triangle(*(block.system() for block in blocks))
    samples = sum(block.samples for block in blocks)
    system = Reduced(fitted.structure.thresholds, whole, (), (samples,))
    made = weights.fit(system, np.arange(len(p)), floor)
    if made.free_p0 is None:
        return fitted, kept
    return replace(fitted, weights=made.p, rms=made.rms), replace(made, free_p0=float(p[0]))
