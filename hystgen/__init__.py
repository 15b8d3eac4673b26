"""hystgen: from a measured hysteresis loop to a verified compensator in C.

>>> import hystgen
>>> model = hystgen.load("stage_x.yaml")
>>> y = model.simulate(v)
>>> v = model.inverse().simulate(u)
>>> hystgen.emit(model, "firmware/")
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

# Everything is imported when it is first used: `hystgen emit` must start fast.
_PLACES = {
    "Cascade": "models",
    "DeadZone": "models",
    "FormatError": "tables",
    "InverseCascade": "models",
    "InverseModel": "api",
    "Model": "api",
    "NotInvertibleError": "models",
    "PI": "models",
    "ParameterError": "params",
    "Session": "simulation",
    "TanhEnvelope": "models",
    "differences": "api",
    "emit": "api",
    "identify": "api",
    "load": "api",
    "schema": "params",
    "verify": "api",
}

__all__ = [*sorted(_PLACES), "__version__"]

if TYPE_CHECKING:
    from hystgen.api import InverseModel, Model, differences, emit, identify, load, verify
    from hystgen.models import PI, Cascade, DeadZone, InverseCascade, NotInvertibleError, TanhEnvelope
    from hystgen.params import ParameterError, schema
    from hystgen.simulation import Session
    from hystgen.tables import FormatError


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'hystgen' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"hystgen.{_PLACES[name]}"), name)
    globals()[name] = value
    return value
