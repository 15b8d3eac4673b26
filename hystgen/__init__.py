"""hystgen: from a measured hysteresis loop to a verified compensator in C.

>>> import hystgen
>>> model = hystgen.load("stage_x.yaml")
>>> y = model.simulate(v)
>>> v = model.inverse().simulate(u)
>>> hystgen.emit(model, "firmware/")

`hystgen.closed_loop` simulates it with a plant and a controller, `hystgen.plants` other hysteretic plants.
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
    "diagnose": "api",
    "differences": "api",
    "emit": "api",
    "identify": "api",
    "identify_batch": "api",
    "load": "api",
    "plan": "api",
    "report_fit": "api",
    "schema": "params",
    "verify": "api",
}

_SUBMODULES = ("closed_loop", "density", "effects", "elastoplastic", "operators", "plants", "records")

__all__ = [*sorted(_PLACES), *_SUBMODULES, "__version__"]

if TYPE_CHECKING:
    from hystgen import closed_loop as closed_loop
    from hystgen import density as density
    from hystgen import effects as effects
    from hystgen import elastoplastic as elastoplastic
    from hystgen import operators as operators
    from hystgen import plants as plants
    from hystgen import records as records
    from hystgen.api import InverseModel as InverseModel
    from hystgen.api import Model as Model
    from hystgen.api import diagnose as diagnose
    from hystgen.api import differences as differences
    from hystgen.api import emit as emit
    from hystgen.api import identify as identify
    from hystgen.api import identify_batch as identify_batch
    from hystgen.api import load as load
    from hystgen.api import plan as plan
    from hystgen.api import report_fit as report_fit
    from hystgen.api import verify as verify
    from hystgen.models import PI as PI
    from hystgen.models import Cascade as Cascade
    from hystgen.models import DeadZone as DeadZone
    from hystgen.models import InverseCascade as InverseCascade
    from hystgen.models import NotInvertibleError as NotInvertibleError
    from hystgen.models import TanhEnvelope as TanhEnvelope
    from hystgen.params import ParameterError as ParameterError
    from hystgen.params import schema as schema
    from hystgen.simulation import Session as Session
    from hystgen.tables import FormatError as FormatError


def __getattr__(name: str) -> Any:
    if name in _SUBMODULES:
        return importlib.import_module(f"hystgen.{name}")
    if name not in _PLACES:
        raise AttributeError(f"module 'hystgen' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"hystgen.{_PLACES[name]}"), name)
    globals()[name] = value
    return value
