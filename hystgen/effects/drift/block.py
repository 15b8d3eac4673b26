"""Drift as a part of the chain: what a clock adds to the displacement."""

from __future__ import annotations

from hystgen.effects.drift import compensator, fixed
from hystgen.effects.part import Part

CLOCK = Part(
    "clock", "drift", lambda effect: effect.name == "drift", lambda effect, *_: effect,
    compensator.ARITHMETIC, fixed.ARITHMETIC,
)  # fmt: skip
