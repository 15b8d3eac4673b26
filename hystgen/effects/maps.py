"""Memoryless maps of the output, behind everything with a memory: what such an effect tells a compensator, and its
functions in fixed point, curves of polynomials and straight pieces."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from hystgen.arithmetic.factors import times
from hystgen.basics.jit import jit
from hystgen.effects.base import Array, Effect
from hystgen.effects.bend import Bends, bend
from hystgen.plays.slots import TANH, Counts, Reals


class MapErrors(NamedTuple):
    """Errors of maps from the last one on: the ends of the output in front of them, the slope of their inverse there,
    the error of that inverse as one of its result, and that of the maps."""

    ends: Array
    slope: float
    back: float
    there: float


class Fitted(Protocol):
    """A curve as fitted in fixed point."""

    def error(self, slope: float, /) -> float:
        """Its error in signals, for the largest slope."""


class Wanted(NamedTuple):
    """A curve to be fitted in fixed point, in output codes: its function, the ends of its argument, and its largest
    value."""

    function: Callable[[float], float]
    low: float
    high: float
    largest: float


class Whole(NamedTuple):
    """Units in fixed point: of a signal in output codes, of an output code, and the largest output in codes."""

    signal: float
    lsb: float
    output: float


@dataclass(frozen=True)
class Map(ABC):
    """One such effect; sizes in fixed point are in output codes of `lsb`."""

    effect: Any

    def mapped(self, y: Array) -> Array:
        """The output (N,) behind it."""
        found: Array = self.effect.mapped(y, None)
        return found

    @abstractmethod
    def undone(self, y: Array) -> Array:
        """The input (N,) that gives the output `y` (N,); for an output out of reach, of the nearest within reach."""

    @abstractmethod
    def stage(self, largest: float) -> tuple[int, int, list[float]]:
        """Kind, size and data as in `hystgen.front.stage.StageTables`; `largest`: the largest number below 1."""

    @abstractmethod
    def errors(self, found: MapErrors, u: float, kind: str) -> MapErrors:
        """Those of the maps behind it and of this one, in floating point with roundings `u`."""

    @abstractmethod
    def grown(self, size: float, lsb: float) -> float:
        """Largest output for inputs within a size."""

    @abstractmethod
    def asked(
        self, back: float, ends: tuple[float, float], still: float, lsb: float
    ) -> tuple[float, tuple[float, float] | None]:
        """Largest input to which an output within `back` is inverted, and the least and largest one if a curve does
        that; `ends`: of the settled input, `still`: the largest one."""

    @abstractmethod
    def curves(self, size: float, ends: tuple[float, float] | None, lsb: float) -> list[Wanted]:
        """Its curve for inputs within a size, and that of its inverse for results within `ends`, if it has any."""

    def pieces(self) -> tuple[float, float, float]:
        """If it has no curves: the ends between which nothing changes, and the slope beyond them."""
        return 0.0, 0.0, 0.0

    @abstractmethod
    def whole_errors(self, found: MapErrors, curves: Sequence[Fitted], unit: Whole) -> MapErrors:
        """As `errors` in fixed point, in output codes."""


@dataclass(frozen=True)
class MapPart:
    """Effects that map the output: `takes` tells whether an effect is one, and `of` makes its map."""

    takes: Callable[[Effect], bool]
    of: Callable[[Any], Map]


# ---------------------------------------------------------------- in fixed point: bend.c, stops.c

LOWER, UPPER, GIVE, INVERSE_GIVE = 0, 1, 2, 4


class MapTables(NamedTuple):
    """All maps, in order from the plays.

    `kind` (k,): TANH for a curve, or DEAD_ZONE for straight pieces; `piece` (k, 6): for straight pieces, the ends
    between which nothing changes, the slope beyond them and 1 over it, as factors. `bends`: two curves for each k,
    forward and inverse.
    """

    kind: Counts
    piece: Reals
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
def straight(t: MapTables, j: int, x: Any, slope: int) -> Any:
    """x, with another slope beyond the ends."""
    inside = x
    if inside < t.piece[j, LOWER]:
        inside = t.piece[j, LOWER]
    elif inside > t.piece[j, UPPER]:
        inside = t.piece[j, UPPER]
    return inside + times(x - inside, t.piece[j, slope], t.piece[j, slope + 1])


@jit
def maps_forward(t: MapTables, x: Any) -> Any:
    """x behind all maps."""
    y = x
    for j in range(len(t.kind)):
        if t.kind[j] == TANH:
            y, _ = bend(t.bends, 2 * j, y)
        else:
            y = straight(t, j, y, GIVE)
    return y


@jit
def maps_inverse(t: MapTables, y: Any) -> tuple[Any, int]:
    """The input of all maps for the output y, and whether no input gives it."""
    x = y
    limited = 0
    for j in range(len(t.kind) - 1, -1, -1):
        if t.kind[j] == TANH:
            x, one = bend(t.bends, 2 * j + 1, x)
            limited = limited | one
        else:
            x = straight(t, j, x, INVERSE_GIVE)
    return x, limited
