"""Tanh envelopes: a saturating map in front of the plays, with a branch for each direction of the drive."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics.arguments import finite_numbers
from hystgen.front.tanh import kernels

Array = NDArray[np.float64]


Branch = tuple[float, float, float, float]


def _tanh(x: float) -> float:
    """The value that compiled code computes, with the same bits on every machine."""
    return float(kernels.tanh.py_func(float(x), kernels.SCALAR[0]))


def _atanh(x: float) -> float:
    """The value that compiled code computes, with the same bits on every machine."""
    return float(kernels.atanh.py_func(float(x), kernels.SCALAR[1]))


@dataclass(frozen=True)
class TanhEnvelope:
    """Envelope `a0 tanh(a1 x + a2) + a3` with an ascending and a descending branch (45)-(47).

    Each branch is (a0, a1, a2, a3) with a0 a1 > 0; `descending` defaults to `ascending`. Raises ValueError otherwise.
    """

    ascending: Branch
    descending: Branch | None = None

    def __post_init__(self) -> None:
        for name, value in (("ascending", self.ascending), ("descending", self.descending or self.ascending)):
            branch = finite_numbers(value, f"the {name} branch's a0 .. a3")
            if len(branch) != 4 or not branch[0] * branch[1] > 0.0:
                raise ValueError(f"the {name} branch needs four numbers a0 .. a3 with a0 a1 > 0")
            object.__setattr__(self, name, branch)

    @property
    def branches_differ(self) -> bool:
        """Whether the two branches are different curves."""
        return self.ascending != self.descending

    def branch(self, ascending: bool) -> Branch:
        """(a0, a1, a2, a3) of one branch."""
        return self.ascending if ascending or self.descending is None else self.descending

    def forward(self, x: ArrayLike, ascending: bool = True) -> Array:
        """Value of the branch at x. A single float gives the same result on every machine."""
        a0, a1, a2, a3 = self.branch(ascending)
        if isinstance(x, float):
            return np.asarray(a0 * _tanh(a1 * x + a2) + a3)
        return np.asarray(a0 * np.tanh(a1 * np.asarray(x, dtype=np.float64) + a2) + a3)

    def inverse(
        self, y: ArrayLike, ascending: bool = True, low: float = -math.inf, high: float = math.inf
    ) -> Array:
        """The x at which the branch has the value y (58); a y that the branch never reaches is replaced by the nearest
        value that it does reach."""
        a0, a1, a2, a3 = self.branch(ascending)
        edge = float(np.nextafter(1.0, 0.0))
        if isinstance(y, float):
            return np.asarray((_atanh(min(max((y - a3) / a0, -edge), edge)) - a2) / a1)
        arguments = np.clip((np.asarray(y, dtype=np.float64) - a3) / a0, -edge, edge)
        return np.asarray((np.arctanh(arguments) - a2) / a1)

    def image(self, low: float, high: float, ascending: bool) -> tuple[float, float]:
        """Values at the ends, since the branch rises everywhere."""
        return float(self.forward(float(low), ascending)), float(self.forward(float(high), ascending))

    def slope_range(self, low: float, high: float, ascending: bool) -> tuple[float, float]:
        """Extremes of `a0 a1 / cosh(a1 x + a2)^2`, which is largest where the argument is nearest to zero."""
        a0, a1, a2, _ = self.branch(ascending)
        ends = sorted((a1 * low + a2, a1 * high + a2))
        nearest = min(max(0.0, ends[0]), ends[1])

        def slope(argument: float) -> float:
            t = _tanh(argument)
            return a0 * a1 * (1.0 - t) * (1.0 + t)

        return min(slope(ends[0]), slope(ends[1])), slope(nearest)

    def inverse_problems(self, low: float, high: float) -> list[str]:
        """Branches whose slope vanishes in double precision somewhere in the range."""
        return [
            f"the {'ascending' if up else 'descending'} envelope is flat to double precision within "
            f"{low:.6g} to {high:.6g}; narrow input_range"
            for up in ((True, False) if self.branches_differ else (True,))
            if not self.slope_range(low, high, up)[0] > 0.0
        ]
