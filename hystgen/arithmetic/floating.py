"""Floating point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from hystgen.arithmetic.description import Arithmetic

if TYPE_CHECKING:
    import numpy as np


@dataclass(frozen=True)
class Floating(Arithmetic):
    """Floating point. `float_h`: the prefix of the type's macros in <float.h>."""

    float_h: str = ""

    fixed = one_curve = False
    includes = ("float", "stdbool", "stddef", "stdint")
    travels = 1
    unused = ("drive_lsb", "output_lsb")

    @cached_property
    def computed(self) -> np.dtype[Any]:
        return self.number

    @cached_property
    def real(self) -> type[np.floating]:
        found: type[np.floating] = self.number.type
        return found

    @cached_property
    def types(self) -> Mapping[str, str]:
        return {}

    @cached_property
    def constants(self) -> Mapping[str, str]:
        return {"HYSTGEN_REAL_MAX": f"{self.float_h}_MAX"}

    @cached_property
    def facts(self) -> tuple[str, ...]:
        return ("HYSTGEN_REAL_IS_DOUBLE",) if self.c_type == "double" else ()

    def share(self, part: float) -> float:
        return part
