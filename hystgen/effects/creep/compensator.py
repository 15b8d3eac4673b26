"""Creep as a block: exactly invertible, since a state answers a move at once by a known share."""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np

from hystgen.effects.base import Array, decays
from hystgen.effects.creep.model import ExponentialCreep, LogarithmicCreep

EFFECTS = (ExponentialCreep, LogarithmicCreep)


class CreepBlock:
    """`y_k = d h_k + sum X_i`, `X_i <- E_i X_i + c_i (b0_i h_(k-1) + b1_i h_k)`, the weights folded into the states.

    `direct`: d, what of a step arrives at once; `weights`: c_i >= 0. Solved, `h_k = (y_k - sum (E_i X_i +
    c_i b0_i h_(k-1)))/(d + sum c_i b1_i)`: for d > 0 the inverse is stable whatever the time constants are, since the
    response is strictly positive real.
    """

    def __init__(self, direct: float, time_constants: Array, weights: Array) -> None:
        self.direct, self.time_constants, self.weights = direct, time_constants, weights
        self.states, self.before = np.zeros(len(weights)), 0.0
        self._factors = functools.lru_cache(maxsize=64)(self._of_step)
        self.advance(0.0)

    def _of_step(self, seconds: float) -> tuple[Array, Array, Array, float]:
        step = np.array([seconds])
        decay, early, late = np.array([np.concatenate(decays(step, tau)) for tau in self.time_constants]).T
        late = self.weights * late
        return decay, self.weights * early, late, self.direct + float(np.sum(late))

    def resting(self, y: float) -> float:
        """`y/(d + sum c_i)`."""
        return y / (self.direct + float(np.sum(self.weights)))

    def rest(self, x: float) -> float:
        """Every state holds its share of `x`."""
        self.states, self.before = self.weights * x, x
        return self.direct * x + float(np.sum(self.states))

    def advance(self, seconds: float) -> None:
        """The factors of this step."""
        self.decay, self.early, self.late, self.slope = self._factors(seconds)

    def solve(self, y: float) -> float:
        """The play sum that gives `y` with what creeps anyway."""
        return (y - float(np.sum(self.decay * self.states + self.early * self.before))) / self.slope

    def absorb(self, x: float) -> float:
        """The states follow."""
        self.states = self.decay * self.states + self.early * self.before + self.late * x
        self.before = x
        return self.direct * x + float(np.sum(self.states))


def block(effect: ExponentialCreep | LogarithmicCreep) -> CreepBlock:
    """The block of an effect without `problems`."""
    if isinstance(effect, ExponentialCreep):
        return CreepBlock(1.0, np.array(effect.time_constants), np.array(effect.weights))
    tau, weight = effect.spectrum()
    return CreepBlock(effect.at_once, tau, np.full(len(tau), weight))


def problems(effect: ExponentialCreep | LogarithmicCreep) -> Iterator[str]:
    """Why there is no inverse."""
    if isinstance(effect, LogarithmicCreep) and not effect.at_once > 0.0:
        yield (
            f"creep, logarithmic: with per_decade = {effect.per_decade:g}, t0 = {effect.t0:g} s and t_min = "
            f"{effect.t_min:g} s nothing of a step arrives at once ({effect.at_once:.3g} of it); give a t0 nearer to "
            "t_min, or a smaller share"
        )
