"""The catalogue of effects beyond the static model: one folder per effect, with its forward model and parameters.

An effect's `model` is imported only when a parameter file names it, so that plain models load quickly.
"""

from __future__ import annotations

import functools
import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from hystgen.effects.base import About as About
    from hystgen.effects.base import Candidate as Candidate
    from hystgen.effects.base import Effect as Effect
    from hystgen.effects.base import Place as Place
    from hystgen.effects.base import Run as Run
    from hystgen.effects.base import decays as decays
    from hystgen.effects.base import follow as follow
    from hystgen.effects.kinds import OwnBlock as OwnBlock
    from hystgen.effects.kinds import product as product
    from hystgen.effects.user import load_user_effects as load_user_effects

_FIRST = (
    "creep",
    "rate_dependence",
    "resonance",
    "lag",
    "delay",
    "slew_limit",
    "saturation",
    "thermal",
    "influence",
    "drift",
    "ageing",
    "sensor_nonlinearity",
    "noncongruent",
)
"""The order in which messages and searches name effects; any others follow alphabetically."""

BEND, LIMIT = "asymmetry", "saturation"
"""Names for what a memoryless front in `model.memoryless` can do: bend the curve, or flatten its ends. The first has no
folder; the folder of the second is for a limit behind the plays."""

FRONTS = BEND, LIMIT

PARALLEL = "bouc_wen"
"""Name of the effect that puts elements in parallel with the plays."""

TOLD_APART = {
    frozenset(("creep", "drift")): "record holds of a minute after moves up and down: creep follows the last move",
    frozenset(("lag", "delay")): "record full steps with three samples or more to the edge: a lag has a tail",
    frozenset(("lag", "resonance")): "record steps or a sweep: a resonance rings and has a peak",
    frozenset(("lag", "rate_dependence")): "record small loops at high rate with reversals: a lag opens them",
    frozenset((BEND, "sensor_nonlinearity")): "record wide and nested loops: a sensor's curve is a line over y",
}
"""Experiments that separate two effects."""

Unmeasured = Literal["drift", "self_heating"]
"""Quantities that nothing measures, which a compensator follows open loop if the user requests it."""


def _catalogue() -> tuple[str, ...]:
    found = [path.parent.name for path in Path(__file__).parent.glob("*/model.py")]
    return tuple(sorted(found, key=lambda name: (_FIRST.index(name) if name in _FIRST else len(_FIRST), name)))


CATALOGUE = _catalogue()
"""Names of the effects: the folders here, each with a `model` whose `SHAPES` are its classes, default first."""

_PLACES = {
    **dict.fromkeys(("About", "Candidate", "Effect", "Place", "Run", "decays", "follow"), "base"),
    **dict.fromkeys(("OwnBlock", "product"), "kinds"),
    "load_user_effects": "user",
}

__all__ = [*_PLACES, "BEND", "CATALOGUE", "FRONTS", "LIMIT", "TOLD_APART", "Unmeasured", "shapes"]


@functools.cache
def shapes(name: str) -> tuple[type[Effect], ...]:
    """The classes of a catalogue entry, its default shape first. Raises KeyError for an unknown name."""
    if name not in CATALOGUE:
        raise KeyError(name)
    found: tuple[type[Effect], ...] = importlib.import_module(f"hystgen.effects.{name}.model").SHAPES
    return found


def load_compiled() -> None:
    """Compile the compiled parts of all models, or load them from the cache, in this process before it forks."""
    from hystgen.effects import base

    base.load()
    for name in CATALOGUE:
        model = importlib.import_module(f"hystgen.effects.{name}.model")
        if hasattr(model, "load"):
            model.load()


def __getattr__(name: str) -> object:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"hystgen.effects.{_PLACES[name]}"), name)
