"""Creep as a part of the chain."""

from __future__ import annotations

from hystgen.effects.creep import compensator, fixed
from hystgen.effects.part import Part

CREEP = Part("creep", compensator.ARITHMETIC, fixed.ARITHMETIC)
