"""Structures of named numbers, declared once for both the arrays of the bit-exact reference and the structs in C.

    class LagState(Struct):
        '''A lag that is led.'''

        high: Signal = note("x, the response to a zero-order-hold drive;")
        low: Signal = note("its rounding remainder")

`LagState.zeros(3, np.float32)`, a single structured array, is the memory of three lags. `s.high[1]` is the second lag's
`high`, in Python and in compiled code alike, since numba accepts structured arrays. `hystgen.emission.declarations`
writes the struct in C from the same class: its docstring and the notes are the comments there.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Annotated, Any, NamedTuple, Protocol, Self, TypeAlias, get_args, get_origin, get_type_hints, overload

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


class FactorArray(NumberArray, Protocol):
    """An array of factors, as numbers or in two parts."""

    mantissa: NumberArray
    shift: NumberArray


Real: TypeAlias = Annotated[NumberArray, "real_t"]
Flag: TypeAlias = Annotated[NumberArray, "bool"]
Int64: TypeAlias = Annotated[NumberArray, "int64_t"]
Int32: TypeAlias = Annotated[NumberArray, "int32_t"]
UInt32: TypeAlias = Annotated[NumberArray, "uint32_t"]
UInt8: TypeAlias = Annotated[NumberArray, "uint8_t"]
Signal: TypeAlias = Annotated[NumberArray, "signal_t"]  # a real in floating point, int64_t in fixed point
Narrow: TypeAlias = Annotated[NumberArray, "narrow_t"]  # a real in floating point, int32_t in fixed point
Play: TypeAlias = Annotated[NumberArray, "play_t"]  # a real in floating point, int32_t in fixed point
Reach: TypeAlias = Annotated[NumberArray, "reach_t"]  # a real in floating point, in fixed point wider than a code
Literal: TypeAlias = Annotated[NumberArray, "signal_t", 0, "python"]  # a constant that is not a member in C
AnyFactor: TypeAlias = Annotated[FactorArray, "factor_t"]  # a real in floating point, a `Factor` in fixed point
# members in only one kind of arithmetic
FloatReal: TypeAlias = Annotated[NumberArray, "real_t", 0, "float"]
FloatSignal: TypeAlias = Annotated[NumberArray, "signal_t", 0, "float"]
FixedSignal: TypeAlias = Annotated[NumberArray, "signal_t", 0, "fixed"]
FixedFactor: TypeAlias = Annotated[FactorArray, "factor_t", 0, "fixed"]
FixedUInt8: TypeAlias = Annotated[NumberArray, "uint8_t", 0, "fixed"]
Number: TypeAlias = Annotated[NumberArray, "number_t"]
Count: TypeAlias = Annotated[NumberArray, "uint_least16_t"]
SmallCount: TypeAlias = Annotated[NumberArray, "uint_least8_t"]
Int32s: TypeAlias = Annotated[NumberArray, "const int32_t *"]  # pointers: only in C
UInt8s: TypeAlias = Annotated[NumberArray, "const uint8_t *"]
TwoReals: TypeAlias = Annotated[NumberArray, "real_t", 2]
SevenReals: TypeAlias = Annotated[NumberArray, "real_t", 7]
FiveInt32: TypeAlias = Annotated[NumberArray, "int32_t", 5]
FourInt32: TypeAlias = Annotated[NumberArray, "int32_t", 4]
FourNarrow: TypeAlias = Annotated[NumberArray, "narrow_t", 4]


OF_ARITHMETIC = frozenset(["real_t", "signal_t", "narrow_t", "play_t", "reach_t", "factor_t"])
"""Types that depend on the arithmetic."""


class Member(NamedTuple):
    """A member of a structure: another structure or the C type without its prefix, an array's length, or 0, and its
    comment in C; `only`: the kind of arithmetic in which it is a member, empty for both; "python": not in C."""

    kind: type[Struct] | str
    length: int = 0
    only: str = ""
    note: str = ""


def note(words: str) -> Any:
    """The comment of a member."""
    return words


class Struct(np.ndarray[Any, np.dtype[Any]]):
    """An array of structures of one kind; each member is an array of numbers or structures.

    Members of `OF_ARITHMETIC` have the type of the arithmetic. Others are int64 here, however narrow they are in C.
    """

    def __array_finalize__(self, _: object) -> None:
        """Give a new array its members as attributes."""
        if self.dtype.names:
            plain = self.view(np.ndarray)
            for name in self.dtype.names:
                kind, member = self.members()[name].kind, plain[name]
                view = member.view(kind if isinstance(kind, type) else Factor) if member.dtype.names else member
                setattr(self, name, view)

    def __setstate__(self, state: Any) -> None:
        """Unpickle, then add the members: the array had no fields when it was created."""
        super().__setstate__(state)
        self.__array_finalize__(None)

    @classmethod
    @functools.cache
    def members(cls) -> Mapping[str, Member]:
        """Members by name, in order."""
        found: dict[str, Member] = {}
        for name, hint in get_type_hints(cls, include_extras=True).items():
            member = get_args(hint)[1:] if get_origin(hint) is Annotated else (hint,)
            found[name] = Member(*member)._replace(note=getattr(cls, name, ""))
        return found

    @classmethod
    @functools.cache
    def layout(cls, real: np.dtype[np.generic]) -> np.dtype[np.void]:
        """numpy's structured type in an arithmetic whose numbers have the type `real`, an integer in fixed point."""
        taken = [name for name in cls.members() if hasattr(np.ndarray, name)]
        assert not taken, f"{cls.__name__}: arrays have attributes {taken}"
        fields: list[tuple[str, DTypeLike, tuple[int, ...]]] = []
        floating = real.kind == "f"
        for name, (kind, length, only, _) in cls.members().items():
            if only == ("fixed" if floating else "float"):
                continue
            structure = Factor if kind == "factor_t" and not floating else kind
            number = np.dtype(real if kind in OF_ARITHMETIC else np.int64)
            number = structure.layout(real) if isinstance(structure, type) else number
            fields.append((name, number, (length,) if length else ()))
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
    """A real factor: mantissa / 2^shift."""

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
