"""A delay as a part of the chain: what the amplifier of the forward operator gets of the drive."""

from __future__ import annotations

from hystgen.effects.delay.compensator import ARITHMETIC, FIXED_ARITHMETIC
from hystgen.effects.part import Part

DELAY = Part("delay", ARITHMETIC, FIXED_ARITHMETIC, forward=True)
