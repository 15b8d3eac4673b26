"""hystgen: from a measured hysteresis loop to a verified compensator in C.

>>> import hystgen
>>> model = hystgen.load("stage_x.yaml")
>>> y = model.simulate(v)
>>> v = model.inverse().simulate(u)
>>> hystgen.emit(model, "firmware/")

`hystgen.closed_loop` simulates a model with a plant and a controller; `hystgen.plants` has other hysteretic plants.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from hystgen.basics.version import __version__ as __version__

if TYPE_CHECKING:
    from hystgen import closed_loop as closed_loop
    from hystgen import effects as effects
    from hystgen import plants as plants
    from hystgen import records as records
    from hystgen.basics.problems import FormatError as FormatError
    from hystgen.basics.problems import NotInvertibleError as NotInvertibleError
    from hystgen.basics.problems import ParameterError as ParameterError
    from hystgen.basics.problems import SampleWarning as SampleWarning
    from hystgen.cascade import PI as PI
    from hystgen.cascade import Cascade as Cascade
    from hystgen.cascade import InverseCascade as InverseCascade
    from hystgen.compensator.reference import Session as Session
    from hystgen.degaussing import degauss as degauss
    from hystgen.distribution.fmu import fmu as fmu
    from hystgen.distribution.libraries import build as build
    from hystgen.emission.calls import differences as differences
    from hystgen.emission.calls import emit as emit
    from hystgen.emission.units import blob as blob
    from hystgen.emission.units import show_blob as show_blob
    from hystgen.fleet.batch import identify_batch as identify_batch
    from hystgen.front.dead_zone.model import DeadZone as DeadZone
    from hystgen.front.tanh.model import TanhEnvelope as TanhEnvelope
    from hystgen.model import InverseModel as InverseModel
    from hystgen.model import Model as Model
    from hystgen.model import load as load
    from hystgen.parameters.schema import schema as schema
    from hystgen.plays import density as density
    from hystgen.plays import elastoplastic as elastoplastic
    from hystgen.plays import operators as operators
    from hystgen.report.comparison import compare as compare
    from hystgen.report.diagnosis import diagnose as diagnose
    from hystgen.report.fleet import report_fleet as report_fleet
    from hystgen.report.identification import identify as identify
    from hystgen.report.identification import report_fit as report_fit
    from hystgen.report.monitoring import monitor as monitor
    from hystgen.report.plan import plan as plan
    from hystgen.report.tracking import track as track
    from hystgen.service.learning import refine as refine
    from hystgen.verification.run import verify as verify

# The module of each public name, imported on first use because `hystgen emit` has to start fast. A test checks that it
# agrees with the imports above, which type checkers read.
_NAMES = {
    "basics.problems": ("FormatError", "NotInvertibleError", "ParameterError", "SampleWarning"),
    "cascade": ("Cascade", "InverseCascade", "PI"),
    "compensator.reference": ("Session",),
    "degaussing": ("degauss",),
    "distribution.fmu": ("fmu",),
    "distribution.libraries": ("build",),
    "emission.calls": ("differences", "emit"),
    "emission.units": ("blob", "show_blob"),
    "fleet.batch": ("identify_batch",),
    "front.dead_zone.model": ("DeadZone",),
    "front.tanh.model": ("TanhEnvelope",),
    "model": ("InverseModel", "Model", "load"),
    "parameters.schema": ("schema",),
    "report.comparison": ("compare",),
    "report.diagnosis": ("diagnose",),
    "report.fleet": ("report_fleet",),
    "report.identification": ("identify", "report_fit"),
    "report.monitoring": ("monitor",),
    "report.plan": ("plan",),
    "report.tracking": ("track",),
    "service.learning": ("refine",),
    "verification.run": ("verify",),
}
_PLACES = {name: module for module, names in _NAMES.items() for name in names}
_MODULES = {
    "closed_loop": "closed_loop",
    "density": "plays.density",
    "effects": "effects",
    "elastoplastic": "plays.elastoplastic",
    "operators": "plays.operators",
    "plants": "plants",
    "records": "records",
}

__all__ = [*sorted(_PLACES), *_MODULES, "__version__"]


def __getattr__(name: str) -> object:
    if name in _MODULES:
        value: object = importlib.import_module(f"hystgen.{_MODULES[name]}")
    elif name in _PLACES:
        value = getattr(importlib.import_module(f"hystgen.{_PLACES[name]}"), name)
    else:
        raise AttributeError(f"module 'hystgen' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*(name for name in globals() if name.startswith("__")), *_PLACES, *_MODULES]
