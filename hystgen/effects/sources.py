"""The C files of the catalogue: what each effect brings to an emitted module. Loads no model and no compensator.

`SOURCES` of an effect's folder names them by their use, callees before callers; `{}` in a name stands for `_fixed` in
fixed point, and for nothing in floating point. `blocks`: its blocks; `drives`: blocks that convert drives into signals;
`limits`: drives before they are signals; `brake`: such drives if a block behind them must not overshoot; `bends`: what
a play contributes; `calls`: functions of the interface. Plays that are searched for are named by how they move, and
with `alone` behind it those that are solved for one by one.
"""

from __future__ import annotations

import functools
import importlib

from hystgen.effects import CATALOGUE


@functools.cache
def files(use: str, ending: str = "") -> tuple[str, ...]:
    """The files of all effects for one use, by their path; `ending`: what `{}` stands for."""
    found = {name: getattr(importlib.import_module(f"hystgen.effects.{name}"), "SOURCES", {}) for name in CATALOGUE}
    return tuple(
        f"effects/{name}/{file.format(ending)}" for name, sources in found.items() for file in sources.get(use, ())
    )
