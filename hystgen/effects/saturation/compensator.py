"""Saturation behind the plays as a block without memory."""

from __future__ import annotations

import numpy as np

from hystgen.effects.base import Array
from hystgen.effects.saturation.model import HardSaturation, Stops, TanhSaturation


def unsaturated(effect: TanhSaturation | HardSaturation | Stops, y: Array) -> Array:
    """The input (N,) that gives the output `y` (N,); for an output out of reach, of the nearest within reach."""
    if isinstance(effect, TanhSaturation):
        most = np.nextafter(1.0, 0.0)
        share = np.clip((y - effect.centre) / effect.level, -most, most)
        return np.asarray(effect.centre + effect.level * np.arctanh(share))
    if isinstance(effect, HardSaturation):
        return np.clip(y, -effect.level, effect.level)
    inside = np.clip(y, effect.lower, effect.upper)
    return inside if effect.give == 0.0 else np.asarray(inside + (y - inside) / effect.give)
