"""The C files of the catalogue: what each effect adds to an emitted module. Loads no model and no compensator.

`SOURCES` in an effect's folder lists them by use, callees before callers. `blocks`: its blocks; `drives`: blocks that
convert drives into signals; `limits`: drives before they become signals; `brake`: such drives if a block behind them
must not overshoot; `bends`: a play's contribution; `elements`: elements in parallel with the plays; `calls`: functions
of the interface. Plays whose input is found by a search are named by how they move; with `alone` appended, those that
are solved for one by one.
"""

from __future__ import annotations

import functools
import importlib

from hystgen.effects import CATALOGUE


@functools.cache
def files(use: str) -> tuple[str, ...]:
    """The files of all effects for one use, sorted by path."""
    found = {name: getattr(importlib.import_module(f"hystgen.effects.{name}"), "SOURCES", {}) for name in CATALOGUE}
    return tuple(f"effects/{name}/{file}" for name, sources in found.items() for file in sources.get(use, ()))
