"""The parts of the chain in order, and the effects of a model sorted into them."""

from __future__ import annotations

import importlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from hystgen import effects
from hystgen.chain.chain import rank
from hystgen.compensator.chain import own_fixed
from hystgen.effects import CATALOGUE, shapes
from hystgen.effects.base import Effect, Place
from hystgen.effects.kinds import OwnBlock
from hystgen.effects.maps import Map, MapPart
from hystgen.effects.part import ChainPart
from hystgen.effects.plays import Bending, Bent, ElementsPart, Mover, Moves, PlaysPart
from hystgen.plays.slots import Counts


def _catalogue() -> list[ModuleType]:
    """The module `compensator` of each effect in the catalogue, in the order of the chain."""
    folder = Path(effects.__file__).parent
    names = [name for name in CATALOGUE if (folder / name / "compensator.py").exists()]
    names.sort(key=lambda name: rank(shapes(name)[0]))
    return [importlib.import_module(f"hystgen.effects.{name}.compensator") for name in names]


_MODULES = _catalogue()
_CATALOGUE: list[ChainPart] = [part for module in _MODULES for part in getattr(module, "PARTS", ())]

MOVES: PlaysPart[Mover, Moves]
(MOVES,) = (module.MOVES for module in _MODULES if hasattr(module, "MOVES"))
BENDS: PlaysPart[Bent, Bending]
(BENDS,) = (module.BENDS for module in _MODULES if hasattr(module, "BENDS"))
"""The effects that move plays, and those that bend them."""

ELEMENTS: ElementsPart
(ELEMENTS,) = (module.ELEMENTS for module in _MODULES if hasattr(module, "ELEMENTS"))
"""The effect that adds elements in parallel with the plays."""

MAPS: list[MapPart] = [module.MAPS for module in _MODULES if hasattr(module, "MAPS")]
"""Maps of the output at the very end of the chain."""

OWN_AHEAD, OWN_BEHIND = own_fixed.part("own_ahead", Place.DRIVE), own_fixed.part("own_behind", Place.LINEAR)


def _at(*places: Place, forward: bool = False) -> list[ChainPart]:
    return [part for part in _CATALOGUE if part.place in places and part.forward in (False, forward)]


SENT = tuple(part for part in _CATALOGUE if part.place is Place.DRIVE and part.forward)
"""Parts between the drive and the amplifier."""

AHEAD = (*_at(Place.DRIVE), OWN_AHEAD)
"""Parts in front of the plays, from the amplifier on. If the front has two branches, only the first (lag) is led."""

_first, *_others = _at(Place.LINEAR, Place.GAIN, forward=True)
BEHIND = (_first, OWN_BEHIND, *_others)
"""Parts behind the plays, from their sum on."""

BESIDE = tuple(_at(Place.ADDED))
"""Parts added to the displacement."""

PARTS = (*SENT, *AHEAD, *BEHIND, *BESIDE)
"""All parts, in the order of `ChainTables.blocks`."""

NAMES = [part.name for part in PARTS]
LED = PARTS.index(AHEAD[0])


def parts_with(
    ahead: Sequence[OwnBlock], behind: Sequence[OwnBlock], effects: Sequence[type[Effect]] = ()
) -> list[ChainPart]:
    """The parts of a model with a user's own blocks; `effects`: the classes of these blocks, starting with `ahead`."""
    given = {
        OWN_AHEAD.name: own_fixed.part(OWN_AHEAD.name, Place.DRIVE, ahead, effects[: len(ahead)]),
        OWN_BEHIND.name: own_fixed.part(OWN_BEHIND.name, Place.LINEAR, behind, effects[len(ahead) :]),
    }
    return [given.get(part.name, part) for part in PARTS]


@dataclass(frozen=True)
class Parts:
    """The effects of a model by part of the chain, each list in the chain's order; `blocks`: by name of the part."""

    blocks: dict[str, list[Any]]
    maps: list[Map]
    slew: list[Any]
    plays: list[Effect]

    @classmethod
    def of(cls, effects: Sequence[Effect]) -> Parts:
        """Sort the effects of a chain."""

        blocks = {part.name: [effect for effect in effects if part.takes(effect)] for part in PARTS}
        plays = [effect for effect in effects if effect.place is Place.PLAYS]
        maps = [part.of(effect) for effect in effects for part in MAPS if part.takes(effect)]
        return cls(blocks, maps, [effect for effect in effects if effect.slews], plays)

    @property
    def delay(self) -> float:
        """Total delay of the drive, in s."""
        return math.fsum(each.dead_time for part in SENT for each in self.blocks[part.name])

    @property
    def modes(self) -> list[Any]:
        """Modes that the preview inverts."""
        return [effect for part in BEHIND if part.forward for effect in self.blocks[part.name]]

    @property
    def own_drives(self) -> list[Effect]:
        """The user's own effects in front of the plays."""
        return self.blocks[OWN_AHEAD.name]

    @property
    def own_outputs(self) -> list[Effect]:
        """The user's own effects behind the plays."""
        return self.blocks[OWN_BEHIND.name]

    @property
    def counts(self) -> Counts:
        """Numbers of blocks, as in `ChainTables`."""
        found = [len(self.blocks[part.name]) for part in PARTS]
        most = [1 if part.joined else len(self.blocks[part.name]) for part in PARTS]
        return np.minimum(np.array(found, dtype=np.int64), most)

    def ones(self, seconds: float, turning: bool = False, parts: Sequence[ChainPart] = PARTS) -> dict[str, list[Any]]:
        """The blocks of the given parts at steps of `seconds`."""
        return {
            part.name: [part.one(effect, seconds, turning) for effect in self.blocks[part.name]] for part in parts
        }

    @property
    def leading(self) -> list[Any]:
        """Effects in front of the plays; their inverse leads the drive."""
        return [effect for part in AHEAD for effect in self.blocks[part.name]]

    def behind(self, seconds: float) -> list[Any]:
        """The blocks of the inverse behind the plays at steps of `seconds`."""
        ones = self.ones(seconds, parts=[part for part in BEHIND if not part.forward])
        return [one for each in ones.values() for one in each]

    def turning(self, branches: bool) -> bool:
        """Whether exactly one block is led, in front of a memoryless part with two `branches`."""
        return branches and len(self.blocks[AHEAD[0].name]) == 1 == len(self.leading)
