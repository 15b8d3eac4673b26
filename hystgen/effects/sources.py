"""The C files of the catalogue: what each effect brings to an emitted module. Loads no model and no compensator."""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from hystgen.effects import CATALOGUE


class Sources(NamedTuple):
    """The C files of an effect, `SOURCES` of its folder, each tuple in order, callees before callers. `{}` in a name
    stands for `_fixed` in fixed point, and for nothing in floating point.

    `blocks`: its blocks; `drives`: blocks that convert drives into signals; `fixed`: blocks in fixed point alone;
    `limits`: drives before they are signals; `brake`: such drives if a block behind them must not overshoot; `moves`:
    plays by how they move, where they are searched for; `scanned`: those that are solved for one by one; `bends`: what
    a play contributes; `calls`: functions of the interface, by one of them.
    """

    blocks: tuple[str, ...] = ()
    drives: tuple[str, ...] = ()
    fixed: tuple[str, ...] = ()
    limits: tuple[str, ...] = ()
    brake: tuple[str, ...] = ()
    moves: Mapping[str, tuple[str, ...]] = MappingProxyType({})
    scanned: Mapping[str, tuple[str, ...]] = MappingProxyType({})
    bends: tuple[str, ...] = ()
    calls: Mapping[str, tuple[str, ...]] = MappingProxyType({})


@functools.cache
def _catalogue() -> dict[str, Sources]:
    modules = {name: importlib.import_module(f"hystgen.effects.{name}") for name in CATALOGUE}
    return {name: getattr(module, "SOURCES", Sources()) for name, module in modules.items()}


def files(use: Callable[[Sources], Iterable[str]], ending: str = "") -> tuple[str, ...]:
    """The files of all effects for one `use` of `Sources`, by their path; `ending`: what `{}` stands for."""
    return tuple(
        f"effects/{name}/{file.format(ending)}" for name, sources in _catalogue().items() for file in use(sources)
    )
