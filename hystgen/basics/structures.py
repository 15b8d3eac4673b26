"""Structures of named numbers, declared once for both the arrays of the bit-exact reference and the structs in C.

    class LagState(Struct):
        high: Real  # comments say what a number is, as in C
        low: Real

`LagState.zeros(3, np.float32)`, a single structured array, is the memory of three lags. `s.high[1]` is the second lag's
`high`, in Python and in compiled code alike, since numba accepts structured arrays.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Annotated, Any, Protocol, Self, TypeAlias, get_args, get_origin, get_type_hints, overload

import numpy as np
from numpy.typing import DTypeLike, NDArray

from hystgen.basics.jit import Element, Scalar, jit


class NumberArray(Protocol):
    """An array of numbers, whose type is chosen with the arithmetic when tables and memory are made."""

    @property
    def dtype(self) -> np.dtype[Any]: ...
    @property
    def shape(self) -> tuple[int, ...]: ...
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[Any]: ...
    @overload
    def __getitem__(self, at: int | tuple[int, int], /) -> Element: ...
    @overload
    def __getitem__(self, at: slice | list[int] | tuple[slice, int] | tuple[int, slice], /) -> NDArray[Any]: ...
    def __setitem__(self, at: int | slice | list[int] | tuple[int, int], number: float | NDArray[Any], /) -> None: ...
    def __array__(self) -> NDArray[Any]: ...
    def tolist(self) -> Any: ...


Real: TypeAlias = Annotated[NumberArray, "real_t"]
Flag: TypeAlias = Annotated[NumberArray, "bool"]
Int64: TypeAlias = Annotated[NumberArray, "int64_t"]
Int32: TypeAlias = Annotated[NumberArray, "int32_t"]
UInt32: TypeAlias = Annotated[NumberArray, "uint32_t"]
UInt8: TypeAlias = Annotated[NumberArray, "uint8_t"]
Signal: TypeAlias = Annotated[NumberArray, "signal_t"]  # a real in floating point, int64_t in fixed point
Narrow: TypeAlias = Annotated[NumberArray, "narrow_t"]  # a real in floating point, int32_t in fixed point
Number: TypeAlias = Annotated[NumberArray, "number_t"]
Count: TypeAlias = Annotated[NumberArray, "uint_least16_t"]
SmallCount: TypeAlias = Annotated[NumberArray, "uint_least8_t"]
TwoReals: TypeAlias = Annotated[NumberArray, "real_t", 2]
FourInt32: TypeAlias = Annotated[NumberArray, "int32_t", 4]
FourNarrow: TypeAlias = Annotated[NumberArray, "narrow_t", 4]


class Struct(np.ndarray[Any, np.dtype[Any]]):
    """An array of structures of one kind; each member is an array of numbers or structures.

    A `Real`, `Signal` or `Narrow` has the type of the arithmetic. Others are int64 here, however narrow they are in C.
    """

    def __array_finalize__(self, _: object) -> None:
        """Give a new array its members as attributes."""
        if self.dtype.names:
            plain = self.view(np.ndarray)
            for name, (kind, _length) in self.members().items():
                setattr(self, name, plain[name].view(kind) if isinstance(kind, type) else plain[name])

    def __setstate__(self, state: Any) -> None:
        """Unpickle, then add the members: the array had no fields when it was created."""
        super().__setstate__(state)
        self.__array_finalize__(None)

    @classmethod
    @functools.cache
    def members(cls) -> Mapping[str, tuple[type[Struct] | str, int]]:
        """Members by name, in order: a structure or the C type without its prefix, and an array's length, or 0."""
        found: dict[str, tuple[type[Struct] | str, int]] = {}
        for name, hint in get_type_hints(cls, include_extras=True).items():
            if get_origin(hint) is Annotated:
                kind, *length = get_args(hint)[1:]
                found[name] = kind, sum(length)
            elif isinstance(hint, type) and issubclass(hint, Struct):
                found[name] = hint, 0
        return found

    @classmethod
    @functools.cache
    def layout(cls, real: np.dtype[np.generic]) -> np.dtype[np.void]:
        """numpy's structured type in an arithmetic whose numbers have the type `real`."""
        taken = [name for name in cls.members() if hasattr(np.ndarray, name)]
        assert not taken, f"{cls.__name__}: arrays have attributes {taken}"
        fields: list[Any] = []
        for name, (kind, length) in cls.members().items():
            number = real if kind in ("real_t", "signal_t", "narrow_t") else np.int64
            number = kind.layout(real) if isinstance(kind, type) else np.dtype(number)
            fields.append((name, number, (length,)) if length else (name, number))
        return np.dtype(fields)

    @classmethod
    def zeros(cls, count: int, real: DTypeLike = np.int64) -> Self:
        """`count` structures, with all numbers 0."""
        return np.zeros(count, cls.layout(np.dtype(real))).view(cls)

    @classmethod
    def of(cls, rows: Iterable[Any], real: DTypeLike = np.int64) -> Self:
        """One structure per row; a row lists the members in order, with nested structures as tuples."""
        return np.array([tuple(row) for row in rows], cls.layout(np.dtype(real))).view(cls)


class TwoParts(Protocol):
    """Numbers in two parts, since their steps may be far smaller than their last bit."""

    high: NumberArray
    low: NumberArray


@jit
def added(s: TwoParts, j: int, change: Scalar) -> Scalar:
    """Add to number j in two parts. Returns its upper part."""
    high = s.high[j]
    change = change + s.low[j]
    following: Scalar = high + change
    s.high[j] = following
    s.low[j] = change - (following - high)
    return following


class Factor(Struct):
    """A real factor, mantissa / 2^shift."""

    mantissa: Int32
    shift: UInt8


def declared(name: str, members: Iterable[str], word: Any) -> type[Struct]:
    """A structure with these members, all of one type, such as `Real`."""
    return type(name, (Struct,), {"__annotations__": dict.fromkeys(members, word)})


def firsts(lengths: Iterable[int]) -> NumberArray:
    """Where lists of these lengths begin when stored one after another, and where the last one ends."""
    return np.cumsum([0, *lengths]).astype(np.int64)


def memory_of(kind: type[Any]) -> Callable[[Any, DTypeLike], Any]:
    """Return a function that makes the memory of blocks, all 0, from their tables and the type of `Real`.

    `kind`: a structure, made once per entry of the tables; or a NamedTuple of structures, each made once per entry of
    the tables' field of the same name.
    """
    named = get_origin(kind) or kind
    given = dict(zip(getattr(named, "__parameters__", ()), get_args(kind), strict=True))

    def memory(t: Any, real: DTypeLike) -> Any:
        if issubclass(named, Struct):
            return named.zeros(len(t), real)
        fields = get_type_hints(named).items()
        return named(*(given.get(each, each).zeros(len(getattr(t, name)), real) for name, each in fields))

    return memory
