"""Temperatures as parts of the chain: those that the caller sets, and those of own heat."""

from __future__ import annotations

from hystgen.effects.part import Part
from hystgen.effects.thermal import compensator, fixed

GAIN = Part(
    "gain", "a temperature", lambda effect: effect.name == "thermal" and bool(effect.columns),
    lambda effect, *_: compensator.Warm(effect), compensator.ARITHMETIC, fixed.ARITHMETIC, calls=("set_temperature",),
)  # fmt: skip
HEAT = Part(
    "heat", "own heat", lambda effect: effect.name == "thermal" and not effect.columns,
    lambda effect, *_: compensator.Warm(effect), compensator.HEAT_ARITHMETIC, fixed.HEAT_ARITHMETIC,
)  # fmt: skip
