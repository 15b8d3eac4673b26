"""A lag as a part of the chain, in front of the plays."""

from __future__ import annotations

from hystgen.effects.lag import compensator, fixed
from hystgen.effects.part import Part

LAG = Part(
    "lag", "a lag", lambda effect: effect.name == "lag" and effect.time_constant > 0.0, compensator.numbers,
    compensator.ARITHMETIC, fixed.ARITHMETIC,
)  # fmt: skip
