"""What an arithmetic is, as far as models, tables, C text and verification need to know it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    import numpy as np


@dataclass(frozen=True)
class Arithmetic(ABC):
    """A number format in which compensators compute.

    `name`: of the contract; `short`: in names of the run time; `c_type`: NAME_real_t, the type of inputs and answers,
    of `bytes` bytes, which numpy calls `number_name`; `finer`: the arithmetic to turn to where this one is too coarse,
    empty for none.

    Of all of its kind: `fixed`: numbers are codes; `unused`: sizes of codes in the `emit` section that it has no use
    for; `includes`: headers of the language that C needs; `travels`: what an argument is multiplied by to be a travel,
    where a travel has more bits.
    """

    name: str
    short: str
    c_type: str
    number_name: str
    bytes: int
    finer: str = ""

    fixed: ClassVar[bool]
    unused: ClassVar[tuple[str, ...]]
    includes: ClassVar[tuple[str, ...]]
    travels: ClassVar[int]

    @cached_property
    def number(self) -> np.dtype[Any]:
        """NAME_real_t."""
        import numpy as np

        return np.dtype(self.number_name)

    @cached_property
    @abstractmethod
    def computed(self) -> np.dtype[Any]:
        """What the bit reference computes with."""

    @cached_property
    @abstractmethod
    def real(self) -> type[np.floating[Any]]:
        """Type of numbers in physical units."""

    @cached_property
    @abstractmethod
    def types(self) -> Mapping[str, str]:
        """Types in C of plays and sums, where these are others than NAME_real_t."""

    @cached_property
    @abstractmethod
    def constants(self) -> Mapping[str, str]:
        """What `hystgen_runtime.h` defines and emitted code names directly."""

    @cached_property
    @abstractmethod
    def facts(self) -> tuple[str, ...]:
        """Macros that choose the forms of the run time that it takes."""

    @abstractmethod
    def share(self, part: float) -> float:
        """The argument that stands for a share."""
