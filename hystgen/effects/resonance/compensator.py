"""A mode: what leads to a wanted motion, from three samples of it."""

from __future__ import annotations

import math

import numpy as np

from hystgen.effects.base import Array
from hystgen.effects.resonance.model import Resonance


def denominator(effect: Resonance, step: float) -> tuple[float, float]:
    """`a1`, `a2` of the mode's exact poles over a step, `z^2 + a1 z + a2`."""
    zeta, angle = effect.damping, 2.0 * math.pi * effect.frequency * step
    if zeta < 1.0:
        decay = math.exp(-zeta * angle)
        return -2.0 * decay * math.cos(math.sqrt(1.0 - zeta * zeta) * angle), decay * decay
    apart = math.sqrt(zeta * zeta - 1.0)
    slow, fast = math.exp(-angle / (zeta + apart)), math.exp(-(zeta + apart) * angle)
    return -(slow + fast), slow * fast


def led(effect: Resonance, before: Array, now: Array, after: Array, step: float) -> Array:
    """What the mode has to be given (N,) so that it moves as wanted, from samples a step apart.

    `(x_(k+1) + a1 x_k + a2 x_(k-1))/(1 + a1 + a2)`: no recursion, hence stable for every frequency and damping. What
    arrives is `(x_(k+1) + 4 x_k + x_(k-1))/6`, without delay and without ringing at corners; the zeros of a
    second-order system sampled with straight input, near -0.27 and -3.7, cannot be inverted.
    """
    a1, a2 = denominator(effect, step)
    return np.asarray((after + a1 * now + a2 * before) / (1.0 + a1 + a2))
