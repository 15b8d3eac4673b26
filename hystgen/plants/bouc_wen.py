"""Bouc-Wen: a restoring force with a hysteretic part that obeys one differential equation."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hystgen.basics.arguments import Array, finite, finite_samples, positive
from hystgen.basics.jit import jit
from hystgen.plants import integration


@jit
def _back(m: float, s: float, amplitude: float, c: float, exponent: float) -> tuple[float, float]:
    """|z| after the part of a move that reduces |z| = m > 0, `dm/ds = -A + c m^n`, c <= 0, and the remainder of s.

    n = 1 and 2 only.
    """
    if c == 0.0:
        needed = m / amplitude
        return (m - amplitude * s, 0.0) if s < needed else (0.0, s - needed)
    if exponent == 1.0:
        needed = math.log1p(-c * m / amplitude) / -c
        if s < needed:
            return m * math.exp(c * s) - amplitude * math.expm1(c * s) / c, 0.0
        return 0.0, s - needed
    root = math.sqrt(-amplitude * c)
    angle = math.atan(m * root / amplitude)
    if s * root < angle:
        return amplitude / root * math.tan(angle - s * root), 0.0
    return 0.0, s - angle / root


@jit
def _on(x: float, s: float, amplitude: float, c: float, exponent: float) -> float:
    """|z| >= 0 after a move that increases it, `dx/ds = A - c x^n` with c > 0; n = 1 and 2 only."""
    if exponent == 1.0:
        return x * math.exp(-c * s) - amplitude * math.expm1(-c * s) / c
    limit = math.sqrt(amplitude / c)
    t = math.tanh(math.sqrt(amplitude * c) * s)
    return limit * (x + limit * t) / (limit + x * t)


@jit
def _exactly(v: Array, v0: float, z0: float, p: tuple[float, ...], out: Array) -> None:
    amplitude, beta, gamma, exponent, distance = p
    z = z0
    last = v0
    for k in range(len(v)):
        if v[k] != last:  # a round trip through the formulas would not be bit-exact
            s = abs(v[k] - last) / distance
            sign = 1.0 if v[k] > last else -1.0
            x = sign * z
            if x < 0.0:
                m, s = _back(-x, s, amplitude, gamma - beta, exponent)
                x = -m
            if x >= 0.0:
                x = _on(x, s, amplitude, gamma + beta, exponent)
            z = sign * x
            last = v[k]
        out[k] = z


@dataclass(frozen=True)
class BoucWen:
    """Force `y = alpha k v + (1 - alpha) k D z`, `D dz/dv = A - (beta sgn(z dv) + gamma) |z|^n`.

    `alpha` >= 0: ratio of the stiffness after yielding to that before; above 1 the output lags the input, like a piezo
    drive's, below 1 it leads; `k`: stiffness in output per input unit; `D`: input units; `A`, `beta`, `gamma`: pure
    numbers, -beta < gamma <= beta, so that the model is bounded and dissipative; `n` >= 1; `start`: z at the input 0.
    Closed form over every monotone move for n = 1 (exponential) and n = 2 (tan and tanh), otherwise integrated to the
    tolerance in `integration`. Raises ValueError. Sources: Y. K. Wen, Method for random vibration of hysteretic
    systems, J. Eng. Mech. Div. ASCE 102, 1976; F. Ikhouane, J. Rodellar, Systems with Hysteresis, Wiley, 2007 (the
    classes); T. S. Low, W. Guo, Modeling of a three-layer piezoelectric bimorph beam with hysteresis, J. MEMS 4, 1995.
    """

    alpha: float
    k: float
    D: float = 1.0
    A: float = 1.0
    beta: float = 0.5
    gamma: float = 0.5
    n: float = 1.0
    start: float = 0.0

    def __post_init__(self) -> None:
        positive(k=self.k, D=self.D, A=self.A, beta=self.beta)
        finite(alpha=self.alpha, gamma=self.gamma, n=self.n, start=self.start)
        if self.alpha < 0.0:
            raise ValueError(f"alpha has to be at least 0, not {self.alpha}")
        if self.n < 1.0:
            raise ValueError(f"n has to be at least 1, not {self.n}: below that, z is not unique")
        if not -self.beta < self.gamma <= self.beta:
            raise ValueError(f"gamma has to be above -beta and at most beta = {self.beta}, not {self.gamma}")
        if abs(self.start) > self.bound:
            raise ValueError(f"start has to be within the bound {self.bound:.6g} of z, not {self.start}")

    @property
    def bound(self) -> float:
        """Largest |z|, `(A / (beta + gamma))^(1/n)`."""
        return float((self.A / (self.beta + self.gamma)) ** (1.0 / self.n))

    def simulate(self, v: ArrayLike) -> Array:
        """Force (N,) at the displacements `v` (N,); does not depend on time."""
        samples = finite_samples(v)
        return self.alpha * self.k * samples + (1.0 - self.alpha) * self.k * self.D * self.hysteretic(samples)

    def hysteretic(self, v: ArrayLike) -> Array:
        """The hysteretic variable z (N,) at the displacements `v` (N,)."""
        samples = finite_samples(v)
        z = np.empty_like(samples)
        p = tuple(float(x) for x in (self.A, self.beta, self.gamma, self.n, self.D))
        if self.n in (1.0, 2.0):
            _exactly(samples, 0.0, float(self.start), p, z)
            return z
        up, down = (functools.partial(self._slope, sign) for sign in (1.0, -1.0))
        z = integration.integrate(samples, float(self.start), up, down, self.bound)
        return np.clip(z, -self.bound, self.bound)  # integration errors may exceed the bound

    def _slope(self, sign: float, v: float, z: float) -> float:  # noqa: ARG002, the input does not enter
        # A / (beta + gamma) at the bound; a trial step far beyond must not overflow
        built: float = self.A / (self.beta + self.gamma) * min(abs(z) / self.bound, 2.0 ** (1.0 / self.n)) ** self.n
        return (self.A - (self.gamma + math.copysign(self.beta, sign * z)) * built) / self.D
