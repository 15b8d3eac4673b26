"""The properties of an arithmetic that models, tables, C text and verification need."""

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

    `name`: as users write it; `short`: as in names of the run time; `c_type`: C type of inputs and answers,
    NAME_real_t; `number_name`, `bytes`: numpy's name and the size of that type; `finer`: the arithmetic to use if this
    one is too coarse; empty if there is none.

    Shared by a kind of arithmetic: `fixed`: whether numbers are codes; `unused`: keys for code sizes in the `emit`
    section that do not apply; `one_curve`: whether all stages of a memoryless part are one curve; `includes`: C headers
    needed; `travels`: factor from an argument to a travel, above 1 where travels have more bits than codes.
    """

    name: str
    short: str
    c_type: str
    number_name: str
    bytes: int
    finer: str = ""

    fixed: ClassVar[bool]
    one_curve: ClassVar[bool]
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
        """The type in which the bit-exact reference computes."""

    @cached_property
    @abstractmethod
    def real(self) -> type[np.floating]:
        """Type of numbers in physical units."""

    @cached_property
    @abstractmethod
    def types(self) -> Mapping[str, str]:
        """C types of plays and sums that differ from NAME_real_t."""

    @cached_property
    @abstractmethod
    def constants(self) -> Mapping[str, str]:
        """Constants that `hystgen_runtime.h` defines and emitted code names directly."""

    @cached_property
    @abstractmethod
    def facts(self) -> tuple[str, ...]:
        """Macros that select the variant of the run time."""

    @abstractmethod
    def share(self, part: float) -> float:
        """A fraction between 0 and 1 as an argument of an emitted function."""
