"""A mode as a part of the chain, of the forward operator alone."""

from __future__ import annotations

from hystgen.effects.part import Part
from hystgen.effects.resonance import compensator, fixed

MODE = Part("mode", compensator.ARITHMETIC, fixed.ARITHMETIC, forward=True)
