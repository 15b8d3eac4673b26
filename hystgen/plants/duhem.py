"""Duhem models, whose slope depends on input, output and direction, and Dahl's friction as a special case."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hystgen.basics.arguments import Array, finite, finite_samples, positive
from hystgen.basics.jit import jit
from hystgen.plants import integration
from hystgen.plants.integration import Slope


@dataclass(frozen=True)
class Duhem:
    """General Duhem model: `dy/dv = rising(v, y)` where the input rises and `falling(v, y)` where it falls.

    `rising`, `falling`: functions of two floats, in output per input unit; `start`: y at the input 0; `scale` > 0: the
    magnitude of y to which the tolerance near zero refers. Raises ValueError, including if the integration fails.
    Source: J. W. Macki, P. Nistri, P. Zecca, Mathematical models for hysteresis, SIAM Review 35, 1993.
    """

    rising: Slope
    falling: Slope
    start: float = 0.0
    scale: float = 1.0

    def __post_init__(self) -> None:
        finite(start=self.start)
        positive(scale=self.scale)

    @classmethod
    def coleman_hodgdon(
        cls,
        alpha: float,
        f: Callable[[float], float],
        g: Callable[[float], float],
        start: float = 0.0,
        scale: float = 1.0,
    ) -> Duhem:
        """`dy = alpha |dv| (f(v) - y) + g(v) dv`: with alpha > 0 the output follows the curve f with a lag.

        `alpha` in 1 / input unit; `start` and `scale` in output units, as for every Duhem model. Source: B. D. Coleman,
        M. L. Hodgdon, A constitutive relation for rate-independent hysteresis in ferromagnetically soft materials,
        Int. J. Eng. Sci. 24, 1986.
        """
        positive(alpha=alpha)
        return cls(
            lambda v, y: g(v) + alpha * (f(v) - y),
            lambda v, y: g(v) - alpha * (f(v) - y),
            start,
            scale,
        )

    def simulate(self, v: ArrayLike) -> Array:
        """Output (N,) at the inputs `v` (N,); does not depend on time."""
        return integration.integrate(finite_samples(v), float(self.start), self.rising, self.falling, float(self.scale))


@jit
def _dahl(v: Array, v0: float, start: float, sigma: float, limit: float, exponent: float, out: Array) -> None:
    force = start
    last = v0
    for k in range(len(v)):
        if v[k] != last:  # a round trip through the formulas would not be bit-exact
            sign = 1.0 if v[k] > last else -1.0
            s = sigma * abs(v[k] - last) / limit
            rest = 1.0 - sign * force / limit  # 0 when fully developed in this direction, 2 in the other
            if exponent == 1.0:
                rest *= math.exp(-s)
            elif rest > 0.0:
                change = (exponent - 1.0) * s * rest ** (exponent - 1.0)
                if change <= -1.0:
                    rest = 0.0
                elif change < math.inf:
                    rest *= math.exp(-math.log1p(change) / (exponent - 1.0))
                else:  # where the 1 in log1p is negligible
                    rest = ((exponent - 1.0) * s) ** (1.0 / (1.0 - exponent))
            force = sign * limit * (1.0 - rest)
            last = v[k]
        out[k] = force


@dataclass(frozen=True)
class Dahl:
    """Solid friction `dF/dv = sigma (1 - sgn(dv) F / F_c)^i`, the Duhem model of friction.

    `sigma` > 0: stiffness at rest in output per input unit; `limit` > 0: F_c, the sliding force in output units;
    `exponent`: i >= 0, below 1 for brittle materials, which slide fully after a finite move (i = 0 is the stop
    operator), 1 and above for ductile ones; `start`: F at the input 0, within the limit. Closed form over every
    monotone move, for every i. The output leads the input. Raises ValueError. Source: P. R. Dahl, A solid friction
    model, The Aerospace Corporation TOR-0158(3107-18)-1, 1968.
    """

    sigma: float
    limit: float
    exponent: float = 1.0
    start: float = 0.0

    def __post_init__(self) -> None:
        positive(sigma=self.sigma, limit=self.limit)
        finite(exponent=self.exponent, start=self.start)
        if self.exponent < 0.0:
            raise ValueError(f"exponent has to be at least 0, not {self.exponent}")
        if abs(self.start) > self.limit:
            raise ValueError(f"start has to be within the limit {self.limit}, not {self.start}")

    def simulate(self, v: ArrayLike) -> Array:
        """Friction force (N,) at the displacements `v` (N,); does not depend on time."""
        samples = finite_samples(v)
        out = np.empty_like(samples)
        start, sigma, limit, exponent = map(float, (self.start, self.sigma, self.limit, self.exponent))
        _dahl(samples, 0.0, start, sigma, limit, exponent, out)
        return out
