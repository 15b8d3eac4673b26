"""The kinds of a compensator's blocks: names of their parameters and states, and verbs, the same in Python and in C."""

from __future__ import annotations

import ast
import functools
import inspect
import textwrap
import types
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeVar

from hystgen.basics.jit import Answer, Jit, Scalar, jit
from hystgen.basics.structures import Struct
from hystgen.plays.slots import Counts

VERBS = ("rest", "resting", "solve", "absorb")
"""The verbs of every block: settle at an input, give the input of a settled output, solve for an input, absorb one."""

B = TypeVar("B", bound=Struct)
R = TypeVar("R", bound=Struct)


class RowedTables(NamedTuple, Generic[B, R]):
    """All blocks of a kind with rows: `block` (k,), the rows of each from `first` (k + 1) on in `row` (m,)."""

    block: B
    first: Counts
    row: R


class RowedMemory(NamedTuple, Generic[B, R]):
    """Memory of all blocks of a kind with rows: `block` (k,), `row` (m,)."""

    block: B
    row: R


@dataclass(frozen=True)
class Rows:
    """The repeated entries of a block: an entry's name, its constants, and its memory if it has any."""

    name: str
    table: type[Struct]
    state: type[Struct] | None = None


@dataclass(frozen=True)
class BlockKind:
    """One kind of block in one arithmetic.

    `name`: in its functions, `hystgen_NAME_solve` and so on; `table`: its constants, in C preceded by a pointer to its
    `rows` if it has any; `state`: its memory; `reading`: the verbs that take the table; `own`: the verbs that it
    defines; without `rest`, absorb also settles it, without `resting`, solve also serves at rest; `like`: the kind
    whose table type it shares.
    """

    name: str
    table: type[Struct]
    state: type[Struct]
    rows: Rows | None = None
    reading: tuple[str, ...] = VERBS
    own: tuple[str, ...] = VERBS
    like: str = ""

    @property
    def tabled(self) -> str:
        """The kind after which its table type is named."""
        return self.like or self.name

    def verb(self, asked: str) -> str:
        """The function that a verb calls."""
        return asked if asked in self.own else {"rest": "absorb", "resting": "solve"}[asked]


@dataclass(frozen=True)
class Constants:
    """The constants of one block: its table, a record with the members of `kind.table`, and its rows (m,); `products`:
    multiplications in absorb and in solve; `bits`: fraction bits of its signals beyond the chain's, if finer."""

    kind: BlockKind
    table: Any
    products: tuple[int, int]
    rows: Any = ()
    bits: int = 0


def numbered(kind: BlockKind, absorb: int, solve: int = 0, each: int = 0) -> Callable[[Any], Iterator[Constants]]:
    """A function that returns the constants of all blocks of a kind from their tables. Their verbs take `absorb` and
    `solve` products; absorb takes `each` more per row, and two per Newton step for the reciprocal of a gain."""

    def constants(t: Any) -> Iterator[Constants]:
        for j, row in enumerate(t if isinstance(t, Struct) else t.block):
            rows = t.row[t.first[j] : t.first[j + 1]] if kind.rows else ()
            turns = int(row["turns"]) if "turns" in row.dtype.names else 0
            yield Constants(kind, row, (absorb + each * len(rows) + 2 * turns, solve), rows)

    return constants


def product(number: Any, x: Any) -> Any:
    """The product of a table entry and x in a user's own block; in C, `hystgen_product(&t->number, x)`."""
    return number * x


@dataclass(frozen=True)
class OwnBlock:
    """The compensator of an effect; see `hystgen.effects.own`.

    `source`: the C file, next to the Python file; `table`, `state`: names of the entries of `t` and `s`, in order. The
    effect's method `numbers(seconds)` returns `t` for steps of that length.
    """

    source: str
    table: tuple[str, ...]
    state: tuple[str, ...]
    rest: Callable[..., Any]
    resting: Callable[..., Any]
    solve: Callable[..., Any]
    absorb: Callable[..., Any]

    def compiled(self, verb: str, arithmetic: Answer) -> Jit[..., Scalar]:
        """A function for the bit-exact reference, with the product of an arithmetic replacing `product`."""
        function = getattr(self, verb)
        names = function.__globals__
        replaced = {name: arithmetic for name, value in names.items() if value is product}
        twin = types.FunctionType(
            function.__code__, {**names, **replaced}, function.__name__, function.__defaults__, function.__closure__
        )
        return jit(twin)

    @functools.cached_property
    def products(self) -> tuple[int, int]:
        """Number of products in absorb and in solve."""
        return _products(self.absorb), _products(self.solve)

    def verbs(self) -> Iterator[tuple[str, Answer]]:
        """Names and functions of the verbs."""
        return ((verb, getattr(self, verb)) for verb in VERBS)


def _products(function: Answer) -> int:
    text = ast.parse(textwrap.dedent(inspect.getsource(function)))
    names = {name for name, value in function.__globals__.items() if value is product}
    called = (node.func for node in ast.walk(text) if isinstance(node, ast.Call))
    return sum(isinstance(each, ast.Name) and each.id in names for each in called)
