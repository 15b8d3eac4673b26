"""The parts of the chain in order, and the effects of a model sorted into them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hystgen.compensator.chain import own_fixed
from hystgen.effects.ageing.compensator import AGEING
from hystgen.effects.base import Effect, Place
from hystgen.effects.creep.compensator import CREEP
from hystgen.effects.delay.compensator import DELAY
from hystgen.effects.drift.compensator import CLOCK
from hystgen.effects.kinds import OwnBlock
from hystgen.effects.lag.compensator import LAG
from hystgen.effects.part import ChainPart
from hystgen.effects.resonance.compensator import MODE
from hystgen.effects.thermal.compensator import GAIN_PART, HEAT_PART
from hystgen.plays.slots import Counts

OWN_AHEAD, OWN_BEHIND = own_fixed.part("own_ahead", Place.DRIVE), own_fixed.part("own_behind", Place.LINEAR)

SENT = (DELAY,)
"""Between the drive and the amplifier."""

AHEAD = (LAG, OWN_AHEAD)
"""In front of the plays, from the amplifier on. In front of two branches only the first is led."""

BEHIND = (CREEP, OWN_BEHIND, AGEING, HEAT_PART, GAIN_PART, MODE)
"""Behind the plays, from their sum on."""

BESIDE = (CLOCK,)
"""Added to the displacement."""

PARTS = (*SENT, *AHEAD, *BEHIND, *BESIDE)
"""All parts, in the order of `ChainTables.blocks`."""

NAMES = [part.name for part in PARTS]
LED = PARTS.index(AHEAD[0])


def parts_with(
    ahead: Sequence[OwnBlock], behind: Sequence[OwnBlock], effects: Sequence[type[Effect]] = ()
) -> list[ChainPart]:
    """The parts of a model with a user's own blocks; `effects`: the classes of these blocks, those `ahead` first."""
    given = {
        OWN_AHEAD.name: own_fixed.part(OWN_AHEAD.name, Place.DRIVE, ahead, effects[: len(ahead)]),
        OWN_BEHIND.name: own_fixed.part(OWN_BEHIND.name, Place.LINEAR, behind, effects[len(ahead) :]),
    }
    return [given.get(part.name, part) for part in PARTS]


@dataclass(frozen=True)
class Parts:
    """The effects of a model by their part in the chain, each list in the order of the chain; `blocks`: by part
    name."""

    blocks: dict[str, list[Any]]
    saturations: list[Any]
    slew: list[Any]
    plays: list[Effect]

    @classmethod
    def of(cls, effects: Sequence[Effect]) -> Parts:
        """Sort the effects of a chain."""

        def called(name: str) -> list[Any]:
            return [effect for effect in effects if effect.name == name]

        blocks = {part.name: [effect for effect in effects if part.takes(effect)] for part in PARTS}
        plays = [effect for effect in effects if effect.place is Place.PLAYS]
        return cls(blocks, called("saturation"), called("slew_limit"), plays)

    @property
    def delay(self) -> float:
        """Total delay of the drive, in s."""
        return math.fsum(each.dead_time for each in self.blocks[DELAY.name])

    @property
    def modes(self) -> list[Any]:
        """Modes that the preview inverts."""
        return self.blocks["mode"]

    @property
    def own_drives(self) -> list[Effect]:
        """The user's own effects in front of the plays."""
        return self.blocks["own_ahead"]

    @property
    def own_outputs(self) -> list[Effect]:
        """The user's own effects behind the plays."""
        return self.blocks["own_behind"]

    @property
    def counts(self) -> Counts:
        """Numbers of blocks, as in `ChainTables`."""
        found = [len(self.blocks[part.name]) for part in PARTS]
        most = [1 if part.joined else len(self.blocks[part.name]) for part in PARTS]
        return np.minimum(np.array(found, dtype=np.int64), most)

    def ones(self, seconds: float, turning: bool = False, parts: Sequence[ChainPart] = PARTS) -> dict[str, list[Any]]:
        """The blocks of some parts at steps of `seconds`."""
        return {
            part.name: [part.one(effect, seconds, turning) for effect in self.blocks[part.name]] for part in parts
        }

    @property
    def leading(self) -> list[Any]:
        """Effects in front of the plays: their inverse leads."""
        return [effect for part in AHEAD for effect in self.blocks[part.name]]

    def behind(self, seconds: float) -> list[Any]:
        """The blocks of the inverse behind the plays at steps of `seconds`."""
        ones = self.ones(seconds, parts=[part for part in BEHIND if not part.forward])
        return [one for each in ones.values() for one in each]

    def turning(self, branches: bool) -> bool:
        """Whether exactly one block is led, and in front of a memoryless part that has two `branches`."""
        return branches and len(self.blocks[AHEAD[0].name]) == 1 == len(self.leading)
