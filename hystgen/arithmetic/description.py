"""What an arithmetic is, as far as models, tables, C text and verification need to know it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np


@dataclass(frozen=True)
class Arithmetic:
    """A number format in which compensators compute.

    `name`: of the contract; `short`: in names of the run time; `c_type`: NAME_real_t, the type of inputs and answers,
    of `bytes` bytes, which numpy calls `number_name`; `computed_name`: numpy's name of the type that the bit reference
    computes with; `finer`: the arithmetic to turn to where this one is too coarse, empty for none; `float_h`: what
    <float.h> calls it.

    In fixed point (`fixed`) `reach` is the C type, of `reach_bytes`, of where plays start to follow; `code_bits` are
    those of a code without its sign, `degree` is that of the polynomials of the memoryless part, and `finer_plays` says
    whether the plays' input may have bits below those of a drive code. `play_bits` are those of the plays' input where
    it is not the drive code itself, without its sign; a corner keeps a sum in 32 bits and `low_bits` more.
    """

    name: str
    short: str
    c_type: str
    number_name: str
    computed_name: str
    bytes: int
    finer: str = ""
    float_h: str = ""
    fixed: bool = False
    reach: str = ""
    reach_bytes: int = 0
    code_bits: int = 0
    degree: int = 0
    finer_plays: bool = False
    play_bits: int = 0
    low_bits: int = 0

    @cached_property
    def number(self) -> np.dtype[Any]:
        """NAME_real_t."""
        import numpy as np

        return np.dtype(self.number_name)

    @cached_property
    def computed(self) -> np.dtype[Any]:
        """What the bit reference computes with: in fixed point int64, however narrow a number is in C."""
        import numpy as np

        return np.dtype(self.computed_name)

    @property
    def code_max(self) -> int:
        """Largest code of fixed point; the smallest that answers is its negative."""
        return (1 << self.code_bits) - 1
