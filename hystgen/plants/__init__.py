"""Hysteretic plants to compensate, other than Prandtl-Ishlinskii models, for examples and tests.

All of them are rate-independent, so `simulate(v)` takes only the input samples and no time: between two samples the
input moves in a straight line, and its speed makes no difference. Every call begins at the plant's start state and
moves from there to the first sample in one move.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

PLANTS = {
    "BoucWen": "bouc_wen",
    "Dahl": "duhem",
    "Duhem": "duhem",
    "JilesAtherton": "jiles_atherton",
    "KrasnoselskiiPokrovskii": "krasnoselskii_pokrovskii",
    "MaxwellSlip": "maxwell_slip",
    "Preisach": "preisach",
}
"""Plants by name, each with the module from which it is imported when first used."""

_PLACES = {**PLANTS, "EverettTable": "preisach"}

__all__ = [*_PLACES, "PLANTS"]

if TYPE_CHECKING:
    from hystgen.plants.bouc_wen import BoucWen as BoucWen
    from hystgen.plants.duhem import Dahl as Dahl
    from hystgen.plants.duhem import Duhem as Duhem
    from hystgen.plants.jiles_atherton import JilesAtherton as JilesAtherton
    from hystgen.plants.krasnoselskii_pokrovskii import KrasnoselskiiPokrovskii as KrasnoselskiiPokrovskii
    from hystgen.plants.maxwell_slip import MaxwellSlip as MaxwellSlip
    from hystgen.plants.preisach import EverettTable as EverettTable
    from hystgen.plants.preisach import Preisach as Preisach


def __getattr__(name: str) -> object:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_PLACES[name]}"), name)
