"""Bent plays in fixed point."""

from __future__ import annotations

from typing import Any

from hystgen.basics.jit import jit
from hystgen.effects.bend import bend
from hystgen.effects.plays import STRAIGHT, Bending, FixedMovingTables
from hystgen.plays.fixed import nearest


@jit
def bent(t: FixedMovingTables, plays: Any, i: int, z: int) -> int:  # noqa: ARG001  as in floating point
    """Contribution of play i at z."""
    if t.bends == STRAIGHT:
        return z
    value, _ = bend(t.bump, t.bump_of[i], z)
    return z + nearest(value, t.bump_bits)


ARITHMETIC = Bending(bent)
