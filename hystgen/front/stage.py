"""The interface of a memoryless stage in front of the plays, and the constants that the stages' functions need."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.front.tanh.kernels import AtanhTables, TanhTables
from hystgen.plays.slots import Counts, LimitTable, Reals

Array = NDArray[np.float64]


class Stage(Protocol):
    """A memoryless stage, strictly monotone where it can be inverted; `ascending` selects the branch."""

    @property
    def branches_differ(self) -> bool:
        """Whether the ascending and the descending branch are different curves."""

    def forward(self, x: ArrayLike, ascending: bool = True) -> Array:
        """Value of the branch at x."""

    def inverse(self, y: ArrayLike, ascending: bool = True, low: float = ..., high: float = ...) -> Array:
        """The x in [low, high] at which the branch has the value y."""

    def image(self, low: float, high: float, ascending: bool) -> tuple[float, float]:
        """Smallest and largest value over [low, high]."""

    def slope_range(self, low: float, high: float, ascending: bool) -> tuple[float, float]:
        """Smallest and largest slope over [low, high]."""

    def inverse_problems(self, low: float, high: float) -> list[str]:
        """Reasons why the stage has no inverse over [low, high]; empty if it has one."""


class StageTables(Protocol):
    """Constants of the stages in floating point, a part of `hystgen.compensator.layout.Tables`."""

    @property
    def stage_kind(self) -> Counts: ...
    @property
    def stage_first(self) -> Counts: ...
    @property
    def stage_size(self) -> Counts: ...
    @property
    def stage_data(self) -> Reals: ...
    @property
    def tanh(self) -> TanhTables: ...
    @property
    def atanh(self) -> AtanhTables: ...


class Polynomials(Protocol):
    """Curves in fixed point, as piecewise polynomials."""

    @property
    def knot(self) -> Reals: ...
    @property
    def coefficient(self) -> Reals: ...
    @property
    def scale(self) -> Reals: ...
    @property
    def first(self) -> Reals: ...
    @property
    def pieces(self) -> Reals: ...


class CurveTables(Polynomials, Protocol):
    """Constants of the stages in fixed point, a part of `hystgen.compensator.layout.FixedTables`."""

    @property
    def limits(self) -> LimitTable: ...
    @property
    def domain(self) -> Reals: ...
    @property
    def edge(self) -> Reals: ...
    @property
    def argument(self) -> Reals: ...
    @property
    def below(self) -> Reals: ...
    @property
    def fronts(self) -> int: ...
