"""The catalogue of effects beyond the static model: one file an effect, each a forward model with its parameters.

An effect's file is imported when a parameter file names it, so that plain models stay quick to load.
"""

from __future__ import annotations

import functools
import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hystgen.effects.base import About as About
    from hystgen.effects.base import Candidate as Candidate
    from hystgen.effects.base import Effect as Effect
    from hystgen.effects.base import Place as Place
    from hystgen.effects.base import Run as Run
    from hystgen.effects.chain import Chain as Chain
    from hystgen.effects.user import load_user_effects as load_user_effects

CATALOGUE = (
    "creep",
    "rate_dependence",
    "resonance",
    "lag",
    "delay",
    "slew_limit",
    "saturation",
    "thermal",
    "drift",
    "ageing",
    "sensor_nonlinearity",
    "noncongruent",
)
"""Names of the effects, each a module of this package whose `SHAPES` are its classes, the default shape first."""

_PLACES = {
    "About": "base",
    "Candidate": "base",
    "Chain": "chain",
    "Effect": "base",
    "Place": "base",
    "Run": "base",
    "load_user_effects": "user",
}

__all__ = ["CATALOGUE", "About", "Candidate", "Chain", "Effect", "Place", "Run", "load_user_effects", "shapes"]


@functools.cache
def shapes(name: str) -> tuple[type[Effect], ...]:
    """The classes of a catalogue entry, its default shape first. Raises KeyError for a name that is none."""
    if name not in CATALOGUE:
        raise KeyError(name)
    found: tuple[type[Effect], ...] = importlib.import_module(f"hystgen.effects.{name}").SHAPES
    return found


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"hystgen.effects.{_PLACES[name]}"), name)
