"""Krasnosel'skii-Pokrovskii: parallel relays that switch along a ramp."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hystgen.basics.arguments import Array, finite, finite_numbers, finite_samples, positive, whole_from
from hystgen.basics.jit import jit


@jit
def _add_kernel(v: Array, p1: float, p2: float, ramp: float, weight: float, state: float, out: Array) -> None:
    for k in range(len(v)):
        high = min(max(2.0 * (v[k] - p1) / ramp - 1.0, -1.0), 1.0)
        low = min(max(2.0 * (v[k] - p2) / ramp - 1.0, -1.0), 1.0)
        state = max(low, min(high, state))
        out[k] += weight * state


@dataclass(frozen=True)
class KrasnoselskiiPokrovskii:
    """Weighted sum of KP kernels `s_k = max(r(v_k - p_2), min(r(v_k - p_1), s_(k-1)))`.

    `r(x)` rises along a straight line from -1 at x = 0 to 1 at x = `ramp` > 0. `lower`, `upper`: p_1 <= p_2 of every
    kernel, in input units, where it reaches -1 as it falls and leaves -1 as it rises; `weights`: of any sign, in output
    units; `start` in [-1, 1]: state of all kernels before the first sample. Raises ValueError. With a narrow ramp a
    kernel is a relay; with one wider than the input's range, a play. Source: H. T. Banks, A. J. Kurdila, G. Webb,
    Identification of hysteretic control influence operators representing smart actuators, Math. Probl. Eng. 3, 1997.
    """

    lower: Sequence[float]
    upper: Sequence[float]
    weights: Sequence[float]
    ramp: float
    start: float = -1.0

    def __post_init__(self) -> None:
        positive(ramp=self.ramp)
        finite(start=self.start)
        if not -1.0 <= self.start <= 1.0:
            raise ValueError(f"start has to lie between -1 and 1, not at {self.start}")
        for name in ("lower", "upper", "weights"):
            object.__setattr__(self, name, finite_numbers(getattr(self, name), name))
        if not len(self.lower) == len(self.upper) == len(self.weights):
            raise ValueError(
                f"{len(self.lower)} lower and {len(self.upper)} upper positions but {len(self.weights)} weights"
            )
        if any(p1 > p2 for p1, p2 in zip(self.lower, self.upper, strict=True)):
            raise ValueError("the lower position of a kernel must not be above its upper one")

    @classmethod
    def on_grid(
        cls, low: float, high: float, divisions: int, weights: Callable[[Array, Array], ArrayLike]
    ) -> KrasnoselskiiPokrovskii:
        """Kernels at all p_1 <= p_2 of a grid over [low, high - ramp], with a ramp as wide as the grid's step.

        `low`, `high`: input units; `divisions`: steps between them, at least 2; `weights(p1, p2)`: a function of two
        arrays of positions that returns a weight for each kernel, or one for all, in output units. Raises ValueError.
        """
        finite(low=low, high=high)
        whole_from(2, divisions=divisions)
        if not low < high:
            raise ValueError(f"low = {low} has to be below high = {high}")
        places = np.linspace(low, high, divisions + 1)[:-1]
        i, j = np.triu_indices(divisions)
        found = np.asarray(weights(places[i], places[j]), dtype=np.float64)
        each = found if found.ndim else np.full(len(i), found)
        return cls(places[i].tolist(), places[j].tolist(), each.tolist(), (high - low) / divisions)

    def simulate(self, v: ArrayLike) -> Array:
        """Output (N,) at the inputs `v` (N,); does not depend on time."""
        samples = finite_samples(v)
        out = np.zeros_like(samples)
        for p1, p2, weight in zip(self.lower, self.upper, self.weights, strict=True):
            _add_kernel(samples, p1, p2, float(self.ramp), weight, float(self.start), out)
        return out
