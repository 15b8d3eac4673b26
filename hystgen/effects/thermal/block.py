"""Temperatures as parts of the chain: those that the caller sets, and those of own heat."""

from __future__ import annotations

from hystgen.effects.part import Part
from hystgen.effects.thermal import compensator, fixed

GAIN = Part("gain", compensator.ARITHMETIC, fixed.ARITHMETIC, calls=("set_temperature",))
HEAT = Part("heat", compensator.HEAT_ARITHMETIC, fixed.HEAT_ARITHMETIC)
