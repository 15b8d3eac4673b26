"""A delay as a part of the chain: what the amplifier of the forward operator gets of the drive."""

from __future__ import annotations

from hystgen.effects.delay.compensator import ARITHMETIC, FIXED_ARITHMETIC
from hystgen.effects.part import Part

DELAY = Part(
    "delay", "a delay", lambda effect: effect.name == "delay" and effect.time > 0.0, lambda effect, *_: effect.time,
    ARITHMETIC, FIXED_ARITHMETIC, forward=True, joined=True,
)  # fmt: skip
