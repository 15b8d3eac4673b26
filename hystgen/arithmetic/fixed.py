"""Fixed point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from hystgen.arithmetic.description import Arithmetic

if TYPE_CHECKING:
    import numpy as np


@dataclass(frozen=True)
class Fixed(Arithmetic):
    """Fixed point.

    `reach`: C type of the input at which a play starts to follow; `code_bits`: bits of a code without its sign;
    `degree`: degree of the polynomials of the memoryless part; `finer_plays`: whether the plays' input can be finer
    than a drive code; `play_bits`: bits of the plays' input without its sign, if it is not the drive code itself;
    `low_bits`: bits of a sum that a corner keeps in addition to 32.
    """

    reach: str = ""
    code_bits: int = 0
    degree: int = 0
    finer_plays: bool = False
    play_bits: int = 0
    low_bits: int = 0

    fixed = one_curve = True
    includes = ("stdbool", "stddef", "stdint")
    travels = 1 << 16
    unused = ()

    @cached_property
    def computed(self) -> np.dtype[Any]:
        """int64, however narrow a number is in C."""
        import numpy as np

        return np.dtype("int64")

    @cached_property
    def real(self) -> type[np.floating]:
        import numpy as np

        return np.float64

    @property
    def code_max(self) -> int:
        """Largest code; answers lie in -code_max .. code_max."""
        return (1 << self.code_bits) - 1

    @cached_property
    def types(self) -> Mapping[str, str]:
        return {"play_t": "int32_t", "reach_t": self.reach, "sum_t": "int64_t"}

    @cached_property
    def constants(self) -> Mapping[str, str]:
        return {"HYSTGEN_LOW_BITS": str(self.low_bits), "hystgen_low_t": f"uint{self.low_bits}_t"}

    @cached_property
    def facts(self) -> tuple[str, ...]:
        return ("HYSTGEN_FIXED", *["HYSTGEN_REAL_IS_SHORT"] * (self.c_type == "int16_t"))

    def share(self, part: float) -> float:
        return int(part * (self.code_max + 1))
