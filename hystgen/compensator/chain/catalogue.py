"""The parts of the chain in their order: the catalogue's kinds of blocks, and those of the user's own."""

from __future__ import annotations

from collections.abc import Sequence

from hystgen.compensator.chain import own_fixed
from hystgen.effects.ageing.block import AGEING
from hystgen.effects.base import Effect, Place
from hystgen.effects.creep.block import CREEP
from hystgen.effects.delay.block import DELAY
from hystgen.effects.drift.block import CLOCK
from hystgen.effects.kinds import OwnBlock
from hystgen.effects.lag.block import LAG
from hystgen.effects.part import Part
from hystgen.effects.resonance.block import MODE
from hystgen.effects.thermal.block import GAIN, HEAT

OWN_AHEAD, OWN_BEHIND = own_fixed.part("own_ahead", Place.DRIVE), own_fixed.part("own_behind", Place.LINEAR)

SENT = (DELAY,)
"""What a drive passes on its way to the amplifier."""

AHEAD = (LAG, OWN_AHEAD)
"""In front of the plays, from the amplifier on. Only the first one is led in front of two branches."""

BEHIND = (CREEP, OWN_BEHIND, AGEING, HEAT, GAIN, MODE)
"""Behind the plays, from their sum on."""

BESIDE = (CLOCK,)
"""What is added to the displacement."""

PARTS = (*SENT, *AHEAD, *BEHIND, *BESIDE)
"""All of them, in the order of `ChainTables.blocks`."""

NAMES = [part.name for part in PARTS]
LED = PARTS.index(AHEAD[0])


def parts_with(
    ahead: Sequence[OwnBlock], behind: Sequence[OwnBlock], effects: Sequence[type[Effect]] = ()
) -> list[Part]:
    """The parts of a model with blocks of the user's own; `effects`: the classes of all of these."""
    given = {
        OWN_AHEAD.name: own_fixed.part(OWN_AHEAD.name, Place.DRIVE, ahead, effects[: len(ahead)]),
        OWN_BEHIND.name: own_fixed.part(OWN_BEHIND.name, Place.LINEAR, behind, effects[len(ahead) :]),
    }
    return [given.get(part.name, part) for part in PARTS]
