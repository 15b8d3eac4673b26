"""Ageing as a part of the chain: a gain over the travel, which the caller may set."""

from __future__ import annotations

from hystgen.effects.ageing import compensator, fixed
from hystgen.effects.part import Part

AGEING = Part(
    "ageing", "ageing", lambda effect: effect.name == "ageing", lambda effect, *_: compensator.Aged(effect),
    compensator.ARITHMETIC, fixed.ARITHMETIC, calls=("set_gain", "travel", "set_travel"),
)  # fmt: skip
