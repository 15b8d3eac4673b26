"""The gain that ageing leaves, from the distance that the drive has travelled."""

from __future__ import annotations

import math

from hystgen.effects.ageing.model import ExponentialAgeing, LogarithmicAgeing, SeveralAgeing


def gain(effect: LogarithmicAgeing | ExponentialAgeing | SeveralAgeing, travelled: float) -> float:
    """The gain after that distance, input units."""
    if isinstance(effect, LogarithmicAgeing):
        return 1.0 - effect.loss * math.log10(1.0 + min(travelled / effect.travel, 1e300))
    if isinstance(effect, ExponentialAgeing):
        return 1.0 + effect.loss * math.expm1(-travelled / effect.travel)
    pairs = zip(effect.losses, effect.travels, strict=True)
    return 1.0 + sum(loss * math.expm1(-travelled / travel) for loss, travel in pairs)
