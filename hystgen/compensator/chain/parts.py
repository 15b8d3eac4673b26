"""The effects of a model by their part in the chain."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hystgen.effects.base import Effect, Place
from hystgen.plays.slots import Counts


@dataclass(frozen=True)
class Parts:
    """The effects of a model by their part in the chain, each list in the order of the chain."""

    lags: list[Any]
    creeps: list[Any]
    ageing: list[Any]
    thermal: list[Any]
    heat: list[Any]
    drift: list[Any]
    modes: list[Any]
    saturations: list[Any]
    slew: list[Any]
    plays: list[Effect]
    delay: float
    own_drives: list[Effect]
    own_outputs: list[Effect]

    @classmethod
    def of(cls, effects: Sequence[Effect]) -> Parts:
        """Sort the effects of a chain."""

        def called(name: str) -> list[Any]:
            return [effect for effect in effects if effect.name == name]

        thermal_effects = called("thermal")
        return cls(
            [each for each in called("lag") if each.time_constant > 0.0], called("creep"), called("ageing"),
            [each for each in thermal_effects if each.columns], [each for each in thermal_effects if not each.columns],
            called("drift"), [each for each in called("resonance") if each.block is None], called("saturation"),
            called("slew_limit"),
            [effect for effect in effects if effect.place is Place.PLAYS],
            math.fsum(each.time for each in called("delay")),
            [effect for effect in effects if effect.block and effect.place is Place.DRIVE],
            [effect for effect in effects if effect.block and effect.place is not Place.DRIVE],
        )  # fmt: skip

    def count(self, waiting: int) -> Counts:
        """As in `ChainTables`; `waiting`: drives that a delay keeps."""
        return np.array([
            waiting > 0, len(self.lags), len(self.own_drives) > 0, len(self.creeps), len(self.own_outputs) > 0,
            len(self.ageing), len(self.heat), len(self.thermal), len(self.modes), len(self.drift),
        ], dtype=np.int64)  # fmt: skip

    def turning(self, branches: bool) -> bool:
        """Whether a lag alone is in front of a memoryless part that has two `branches`."""
        return branches and len(self.lags) == 1 and not self.own_drives
