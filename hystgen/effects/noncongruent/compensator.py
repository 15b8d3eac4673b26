"""Bent plays for a compensator: by a polynomial, or by a bump or a dip around a centre."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from hystgen.basics.jit import jit
from hystgen.effects import plays as at
from hystgen.effects.base import Array
from hystgen.effects.noncongruent.model import LoopCentre, PlayFunctions
from hystgen.effects.part import late
from hystgen.effects.plays import Bending, Bent, MovingTables, PlaysPart
from hystgen.front.tanh.kernels import tanh
from hystgen.front.tanh.model import TanhEnvelope


def of(effect: PlayFunctions | LoopCentre, thresholds: Array, _: Array) -> Bent:
    """How an effect bends plays with these thresholds."""
    return _centred(effect) if isinstance(effect, LoopCentre) else _polynomials(effect, float(thresholds[-1]))


def _polynomials(effect: PlayFunctions, scale: float) -> Bent:
    rows = effect.coefficients
    curve = np.zeros((len(rows), max(map(len, rows))))
    for i, row in enumerate(rows):
        curve[i, : len(row)] = row

    def bump(i: int) -> tuple[object, Callable[[float], float]]:
        def polynomial(z: float) -> float:
            xi, total = z / scale, 0.0
            for c in reversed(rows[i - 1]):
                total = (total + c) * xi
            return scale * (total * xi)

        return rows[i - 1], polynomial

    return Bent(at.POLYNOMIAL, curve, {"scale": scale, "inverse_scale": 1.0 / scale}, bump)


def _centred(effect: LoopCentre) -> Bent:
    high, inverse = effect.amplitude * effect.width, 1.0 / effect.width
    envelope = TanhEnvelope((1.0, inverse, -effect.centre * inverse, 0.0))
    begin = float(envelope.forward(0.0))
    numbers = {
        "centre": effect.centre, "inverse_width": inverse, "bump": high,
        "amplitude": effect.amplitude, "steepest": 1.0 + effect.amplitude,
        "tanh_centre": math.tanh(effect.centre / effect.width),
    }
    return Bent(
        at.CENTRE, np.zeros((1, 1)), numbers, lambda _: (None, lambda z: high * (float(envelope.forward(z)) - begin))
    )


# ---------------------------------------------------------------- bent.c


@jit
def steep(t: MovingTables, plays: Any, i: int, z: Any) -> tuple[Any, Any]:
    """Contribution of play i at z, and its change per change of z."""
    if t.bends == at.POLYNOMIAL:
        x = z * t.number.inverse_scale[0]
        total = z - z
        slope = total
        for k in range(t.curve.shape[1] - 1, -1, -1):
            total = total + t.curve[i, k]
            slope = slope * x + total
            total = total * x
        return z + t.number.scale[0] * (total * x), t.number.one[0] + (slope * x + total)
    if t.bends == at.CENTRE:
        bump = tanh((z - t.number.centre[0]) * t.number.inverse_width[0], plays.tanh)
        value = z + t.number.bump[0] * (bump + t.number.tanh_centre[0])
        return value, t.number.steepest[0] - t.number.amplitude[0] * bump * bump
    return z, t.number.one[0]


@jit
def bent(t: MovingTables, plays: Any, i: int, z: Any) -> Any:
    """Contribution of play i at z."""
    value, _ = steep(t, plays, i, z)
    return value


BENDS = PlaysPart(of, Bending(bent, steep), late("noncongruent"))
"""Bent plays as a part of the chain."""
