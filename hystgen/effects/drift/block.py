"""Drift as a part of the chain: what a clock adds to the displacement."""

from __future__ import annotations

from hystgen.effects.drift import compensator, fixed
from hystgen.effects.part import Part

CLOCK = Part("clock", compensator.ARITHMETIC, fixed.ARITHMETIC)
