"""Memoryless maps of the output, behind everything with a memory: what a compensator needs to know of such an effect,
and its functions in fixed point, curves made of polynomials or linear pieces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from hystgen.arithmetic.factors import error as missed
from hystgen.arithmetic.factors import times
from hystgen.basics.jit import inside, jit
from hystgen.basics.structures import Factor, Int64, Struct
from hystgen.effects.base import Array, Effect, Run
from hystgen.effects.bend import Bends, bend
from hystgen.plays.slots import DEAD_ZONE, TANH, Counts


class MapErrors(NamedTuple):
    """Errors of the last maps of a chain: the ends of the output in front of them, the slope of their inverse there,
    the error of that inverse in terms of its result, and the error of the maps."""

    ends: Array
    slope: float
    back: float
    there: float


class FittedCurve(Protocol):
    """A curve fitted in fixed point; `error`: its error in signals, given its largest slope."""

    def error(self, slope: float, /) -> float: ...


class Wanted(NamedTuple):
    """A curve to be fitted in fixed point, in output codes: function, ends of its argument, largest value."""

    function: Callable[[float], float]
    low: float
    high: float
    largest: float


class Whole(NamedTuple):
    """Units in fixed point: a signal in output codes, and an output code (`lsb`); and the largest output in codes."""

    signal: float
    lsb: float
    output: float


class Map:
    """An effect that maps the output: between two ends nothing changes, and beyond them the slope differs, unless a
    subclass overrides that. Sizes in fixed point are in output codes of `lsb`."""

    def __init__(self, effect: Effect, lower: float = 0.0, upper: float = 0.0, give: float = 0.0) -> None:
        self.effect, self.lower, self.upper, self.give = effect, lower, upper, give

    def mapped(self, y: Array) -> Array:
        """The output (N,) behind it, which does not depend on the run."""
        return self.effect.mapped(y, Run(y, y))

    def undone(self, y: Array) -> Array:
        """The input (N,) that gives the output `y` (N,), or the nearest output within reach."""
        inside = np.clip(y, self.lower, self.upper)
        return inside if self.give == 0.0 else np.asarray(inside + (y - inside) / self.give)

    def stage(self, largest: float) -> tuple[int, int, list[float]]:
        """Kind, size and data as in `hystgen.front.stage.StageTables`; `largest`: the largest number below 1."""
        ends, anchors, give = [self.lower, self.upper], [self.lower, self.lower, self.upper], self.give
        over = 1.0 / give if give else 0.0
        return DEAD_ZONE, 2, [*ends, *ends, *anchors, *anchors, give, 1.0, give, over, 1.0, over]

    def errors(self, found: MapErrors, u: float, kind: str) -> MapErrors:
        """The errors `found` of the maps behind it plus those of this map, in floating point with unit roundoff `u`."""
        size, give = float(np.max(np.abs(found.ends))), self.give
        slope = found.slope / (give if 0.0 < give < 1.0 else 1.0)
        return MapErrors(found.ends, slope, found.back + 8.0 * u * size * slope, found.there + 8.0 * u * size)

    def grown(self, size: float, lsb: float) -> float:
        """Largest output for inputs of magnitude up to `size`."""
        return size

    def asked(
        self, back: float, ends: tuple[float, float], still: float, lsb: float
    ) -> tuple[float, tuple[float, float] | None]:
        """Largest input for outputs of magnitude up to `back`, and the ends of the input if a curve inverts the map;
        `ends`: of the settled input, `still`: its largest magnitude."""
        return back / self.give if self.give else max(abs(self.lower), abs(self.upper)) / lsb, None

    def curves(self, size: float, ends: tuple[float, float] | None, lsb: float) -> list[Wanted]:
        """Its curve for inputs up to `size`, and that of its inverse for results within `ends`, if it has curves."""
        return []

    def whole_errors(self, found: MapErrors, curves: Sequence[FittedCurve], unit: Whole) -> MapErrors:
        """As `errors` in fixed point, in output codes."""
        give, (ends, slope, back, there) = self.give, found
        over = 1.0 / give if 0.0 < give < 1.0 else 1.0
        slope, back = slope * over, back * over
        if give:
            size = max(map(abs, ends.tolist())) / unit.lsb
            back += (0.5 + over) * unit.signal + missed(1.0 / give) * size
            there += 1.0 * unit.signal + missed(give) * unit.output
        return MapErrors(ends, slope, back, there)


@dataclass(frozen=True)
class MapPart:
    """Effects that map the output: `takes` tells whether an effect is one of them, and `of` makes its map."""

    takes: Callable[[Effect], bool]
    of: Callable[..., Map]


# ---------------------------------------------------------------- maps.c


class FixedStops(Struct):
    """Stops, and the slope beyond them."""

    lower: Int64
    upper: Int64
    give: Factor
    inverse_give: Factor


class MapTables(NamedTuple):
    """All maps, in order from the plays.

    `kind` (k,): TANH for a curve, or DEAD_ZONE for linear pieces with `stops` (k,); `bends`: two curves for each map,
    forward and inverse.
    """

    kind: Counts
    stops: FixedStops
    bends: Bends

    @property
    def kinds(self) -> list[int]:
        """The kind of each map."""
        return list(map(int, self.kind))

    @property
    def products(self) -> int:
        """Multiplications of a curve."""
        return int(self.bends.coefficient.shape[1])


@jit
def straight(t: MapTables, j: int, x: int, slope: Factor) -> int:
    """x, with another slope beyond the stops."""
    within = inside(x, t.stops.lower[j], t.stops.upper[j])
    return within + times(x - within, slope.mantissa[j], slope.shift[j])


@jit
def maps_forward(t: MapTables, x: int) -> int:
    """The output of all maps for x."""
    y = x
    for j in range(len(t.kind)):
        if t.kind[j] == TANH:
            y, _ = bend(t.bends, 2 * j, y)
        else:
            y = straight(t, j, y, t.stops.give)
    return y


@jit
def maps_inverse(t: MapTables, y: int) -> tuple[int, int]:
    """The input of all maps for the output y, and whether no input gives it."""
    x = y
    limited = 0
    for j in range(len(t.kind) - 1, -1, -1):
        if t.kind[j] == TANH:
            x, one = bend(t.bends, 2 * j + 1, x)
            limited = limited | one
        else:
            x = straight(t, j, x, t.stops.inverse_give)
    return x, limited
