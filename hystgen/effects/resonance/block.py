"""A mode as a part of the chain, of the forward operator alone."""

from __future__ import annotations

from hystgen.effects.part import Part
from hystgen.effects.resonance import compensator, fixed

MODE = Part(
    "mode", "resonance", lambda effect: effect.name == "resonance" and effect.block is None,
    lambda effect, seconds, _: compensator.numbers(effect, seconds),
    compensator.ARITHMETIC, fixed.ARITHMETIC, forward=True,
)  # fmt: skip
