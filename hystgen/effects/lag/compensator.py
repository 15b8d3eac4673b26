"""A lag as a block: the part of it that is exactly invertible is, and the rest is of second order."""

from __future__ import annotations

import numpy as np

from hystgen.effects.base import decays
from hystgen.effects.lag.model import Lag


class LagBlock:
    """`a_k = E a_(k-1) + b0 v_(k-1) + b1 v_k`, led by way of the state of a lag on held drives.

    For steps T well below tau the inverse of this is a pole near -1, which rings. With `theta = b0/(1 - E)` and
    `x_k = E x_(k-1) + (1 - E) v_k`, which is exactly invertible, `a_k = (1 - theta) x_k + theta x_(k-1)` for even
    steps: x is led to `a + theta (a - a_before)`. What remains is `theta^2` times the second difference of the wanted
    a. For T >= 2 tau the pole fades within a few samples, and the inverse is the exact one.
    """

    def __init__(self, time_constant: float) -> None:
        self.time_constant = time_constant
        self.state = self.reached = self.before = self.wanted = self.answer = 0.0
        self.advance(0.0)

    def advance(self, seconds: float) -> None:
        """The factors of this step."""
        self.decay, self.early, self.late = (float(x[0]) for x in decays(np.array([seconds]), self.time_constant))
        self.exact = seconds >= 2.0 * self.time_constant
        self.theta = self.early / (1.0 - self.decay) if self.decay < 1.0 else 0.5

    def resting(self, y: float) -> float:
        """The drive itself."""
        return y

    def rest(self, x: float) -> float:
        """Settle."""
        self.state = self.reached = self.before = self.wanted = self.answer = x
        return x

    def solve(self, y: float) -> float:
        """The drive that leads to `y`."""
        if self.exact:
            self.answer = (y - self.decay * self.reached - self.early * self.before) / self.late
        else:
            goal = y + self.theta * (y - self.wanted)
            self.answer = self.state + (goal - self.state) / (1.0 - self.decay)
        self._asked = y
        return self.answer

    def absorb(self, x: float) -> float:
        """The lag follows. Behind another drive than the one asked for, the next lead starts from what is reached."""
        self.reached = self.decay * self.reached + self.early * self.before + self.late * x
        self.state = self.state + (1.0 - self.decay) * (x - self.state)
        self.wanted = self._asked if x == self.answer else self.reached
        self.before = x
        return self.reached


def block(effect: Lag) -> LagBlock | None:
    """The block of an effect; none for no lag."""
    return LagBlock(effect.time_constant) if effect.time_constant > 0.0 else None
