"""Bent plays for a compensator: a polynomial, or more or less than the play around a centre."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from hystgen.basics.jit import jit
from hystgen.effects.base import Array
from hystgen.effects.noncongruent.model import LoopCentre, PlayFunctions
from hystgen.effects.plays import (
    BUMP,
    CENTRE,
    INVERSE_SCALE,
    INVERSE_WIDTH,
    MIDDLE,
    POLYNOMIAL,
    SCALE,
    TANH_CENTRE,
    Bender,
    Bent,
    MovingTables,
    PlaysPart,
)
from hystgen.front.tanh.kernels import tanh
from hystgen.front.tanh.model import TanhEnvelope


class Polynomials(Bender):
    """Plays bent by a polynomial each."""

    def __init__(self, effect: PlayFunctions, scale: float) -> None:
        self.rows, self.scale = effect.coefficients, scale

    def numbers(self) -> Bent:
        """The constants."""
        curve = np.zeros((len(self.rows), max(map(len, self.rows))))
        for i, row in enumerate(self.rows):
            curve[i, : len(row)] = row
        return Bent(POLYNOMIAL, curve, {SCALE: self.scale, INVERSE_SCALE: 1.0 / self.scale})

    def bump(self, i: int) -> tuple[object, Callable[[float], float]]:
        """Its coefficients are the key."""
        row, scale = self.rows[i - 1], self.scale

        def polynomial(z: float) -> float:
            xi, total = z / scale, 0.0
            for c in reversed(row):
                total = (total + c) * xi
            return scale * (total * xi)

        return row, polynomial


class Centred(Bender):
    """Plays that all have the same bump."""

    def __init__(self, effect: LoopCentre) -> None:
        self.effect = effect

    def numbers(self) -> Bent:
        """The constants."""
        effect = self.effect
        numbers = {
            MIDDLE: effect.centre, INVERSE_WIDTH: 1.0 / effect.width, BUMP: effect.amplitude * effect.width,
            TANH_CENTRE: math.tanh(effect.centre / effect.width),
        }
        return Bent(CENTRE, np.zeros((1, 1)), numbers)

    def bump(self, i: int) -> tuple[object, Callable[[float], float]]:
        """The same for every play."""
        effect = self.effect
        high, inverse = effect.amplitude * effect.width, 1.0 / effect.width
        bump = TanhEnvelope((1.0, inverse, -effect.centre * inverse, 0.0))
        begin = float(bump.forward(0.0))
        return None, lambda z: high * (float(bump.forward(z)) - begin)


def bender(effect: PlayFunctions | LoopCentre, thresholds: Array, _: Array) -> Bender:
    """How an effect bends plays with these thresholds."""
    return Centred(effect) if isinstance(effect, LoopCentre) else Polynomials(effect, float(thresholds[-1]))


# ---------------------------------------------------------------- bent.c


@jit
def bent(t: MovingTables, plays: Any, i: int, z: Any) -> Any:
    """Contribution of play i at z."""
    if t.bends == POLYNOMIAL:
        x = z * t.number[INVERSE_SCALE]
        total = z - z
        for k in range(t.curve.shape[1] - 1, -1, -1):
            total = (total + t.curve[i, k]) * x
        return z + t.number[SCALE] * (total * x)
    if t.bends == CENTRE:
        x = (z - t.number[MIDDLE]) * t.number[INVERSE_WIDTH]
        return z + t.number[BUMP] * (tanh(x, plays.tanh) + t.number[TANH_CENTRE])
    return z


BENDS = PlaysPart(bender, bent, "hystgen.effects.noncongruent.fixed")
"""Bent plays as a part of the chain."""
