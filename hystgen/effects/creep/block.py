"""Creep as a part of the chain."""

from __future__ import annotations

from hystgen.effects.creep import compensator, fixed
from hystgen.effects.part import Part

CREEP = Part(
    "creep", "creep", lambda effect: effect.name == "creep",
    lambda effect, seconds, _: compensator.numbers(effect, seconds),
    compensator.ARITHMETIC, fixed.ARITHMETIC,
)  # fmt: skip
