"""A delay as a part of the chain: what the amplifier of the forward operator gets of the drive."""

from __future__ import annotations

from hystgen.effects.delay.compensator import ARITHMETIC, FIXED_ARITHMETIC, Wait
from hystgen.effects.part import ChainPart

DELAY = ChainPart(
    "delay", "a delay", lambda effect: effect.name == "delay" and effect.time > 0.0,
    lambda effect, *_: Wait(effect.time), ARITHMETIC, FIXED_ARITHMETIC, forward=True, joined=True,
)
