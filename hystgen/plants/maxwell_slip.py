"""Maxwell-slip: springs in parallel, each of which slips when its force reaches a limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hystgen.basics.arguments import Array, finite, finite_numbers, finite_samples
from hystgen.cascade import PI
from hystgen.plays import operators


@dataclass(frozen=True)
class MaxwellSlip:
    """Force of elastic elements that slip, together with a spring that does not:
    `F = k v + sum k_i stop_(W_i / k_i)[v]`.

    `stiffnesses`: k_i > 0 in output per input unit; `slip_forces`: W_i > 0 in output units, the force at which element
    i slips; `spring`: k >= 0, the spring that never slips. All elements start relaxed at the input 0. The output leads
    the input, so as a play sum it has negative weights. Raises ValueError. Source: M. Goldfarb, N. Celanovic, Modeling
    piezoelectric stack actuators for control of micromanipulation, IEEE Control Systems 17(3), 1997.
    """

    stiffnesses: Sequence[float]
    slip_forces: Sequence[float]
    spring: float = 0.0

    def __post_init__(self) -> None:
        finite(spring=self.spring)
        stiffnesses = finite_numbers(self.stiffnesses, "stiffnesses")
        slip_forces = finite_numbers(self.slip_forces, "slip_forces")
        if len(stiffnesses) != len(slip_forces):
            raise ValueError(f"{len(stiffnesses)} stiffnesses but {len(slip_forces)} slip forces")
        if min(stiffnesses) <= 0.0 or min(slip_forces) <= 0.0 or self.spring < 0.0:
            raise ValueError("stiffnesses and slip forces have to be positive, the spring not negative")
        object.__setattr__(self, "stiffnesses", stiffnesses)
        object.__setattr__(self, "slip_forces", slip_forces)

    def simulate(self, v: ArrayLike) -> Array:
        """Force (N,) at the displacements `v` (N,); does not depend on time."""
        samples = finite_samples(v)
        force = self.spring * samples
        for stiffness, slip in zip(self.stiffnesses, self.slip_forces, strict=True):
            force += stiffness * operators.stop(samples, slip / stiffness)
        return force

    def play_sum(self) -> PI:
        """The same operator as a play sum: `stop_r = identity - play_r` (26), so p_0 = k + sum k_i and p_i = -k_i."""
        thresholds = np.array(self.slip_forces) / np.array(self.stiffnesses)
        distinct, place = np.unique(thresholds, return_inverse=True)
        weights = np.bincount(place, weights=self.stiffnesses)
        return PI([0.0, *distinct.tolist()], [self.spring + float(sum(weights)), *(-weights).tolist()])
