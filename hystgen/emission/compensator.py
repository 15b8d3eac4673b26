"""A model's compensator in an arithmetic, as the source of its C: names, numbers, tables and memory. A `Form` for each
kind of arithmetic holds the differences between floating and fixed point."""

from __future__ import annotations

import math
import textwrap
from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, TypeAlias

from hystgen.basics.frozen import dataclass
from hystgen.chain.static import StaticModel
from hystgen.compensator.layout import FixedTables, Tables
from hystgen.emission import runtime
from hystgen.emission.options import Options
from hystgen.emission.text import WIDTH, Number, braces, comment_text, constant, literal, operand, structure, table
from hystgen.parameters.files import Parameters
from hystgen.plays import slots
from hystgen.plays.slots import Reals

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import ChainTables, Compiled

Macro: TypeAlias = tuple[str, str, str]
"""A macro of a model: its name after the model's, its value, and a comment."""

STANDARD = frozenset(["int32_t", "uint32_t", "uint16_t", "uint8_t"])
"""Types of the language that appear in tables."""


@dataclass(frozen=True)
class Table:
    """A constant; `contents`: its types, without the prefix of a run time, and how many of each there are."""

    name: str
    text: str
    contents: tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class Stage:
    """A memoryless stage: its kind, its tables, the expression for the last of them in functions, and the argument by
    which functions report that the stage limited something."""

    kind: str
    arrays: tuple[Table, ...]
    table: str
    limited: str = ""


@dataclass(frozen=True)
class Field:
    """A field of an instance. Its type is one of the run time without its prefix, or one of the language; with a
    `count` it is an array, whose length in C is `length` if that is given."""

    kind: str
    name: str
    comment: str = ""
    count: int = 0
    length: str = ""

    def text(self) -> str:
        """Its declaration in C."""
        kind = f"hystgen_{self.kind}" if self.kind.endswith("_t") else self.kind
        size = f"[{self.length or self.count}]" if self.count else ""
        return f"{kind} {self.name}{size};" + (f" /* {self.comment} */" if self.comment else "")


@dataclass(frozen=True)
class Writer:
    """Writes the constants of the model `name` with the types of the run time `prefix`. Each constant is named by the
    model's name and `own`, and is an array if it has `sizes`."""

    name: str
    prefix: str

    @property
    def own(self) -> Writer:
        """A writer for types that the model itself defines."""
        return Writer(self.name, self.name)

    def constant(self, kind: str, own: str, lines: Sequence[str], *sizes: int, words: str = "") -> Table:
        """A constant with these lines between its braces, on one line if it fits, below a comment `words`."""
        return self._table(own, words + constant(self._declared(kind, own, sizes), lines), [(kind, math.prod(sizes))])

    def line(self, kind: str, own: str, values: str, *sizes: int) -> Table:
        """A constant on one line."""
        text = f"static const {self._declared(kind, own, sizes)} = {{{values}}};\n"
        return self._table(own, text, [(kind, math.prod(sizes))])

    def entries(self, kind: str, own: str, entries: Iterable[str], words: str = "") -> Table:
        """A structure with these entries, on as few lines as they need."""
        return self.constant(kind, own, filled(entries).splitlines(), words=words)

    def rows(self, kind: str, own: str, rows: Iterable[str], *sizes: int, last: str = ",") -> Table:
        """An array of structures, one per line; `last`: text after the last one."""
        *first, final = [f"    {{{row}}}" for row in rows]
        return self.lines(kind, own, [*(f"{row}," for row in first), final + last], *sizes)

    def block(self, kind: str, own: str, entries: Sequence[str]) -> Table:
        """The table of a block."""
        lines = textwrap.wrap(", ".join(entries) + ",", WIDTH, initial_indent="    ", subsequent_indent="    ")
        return self.lines(kind, own, lines)

    def lines(self, kind: str, own: str, lines: Sequence[str], *sizes: int, words: str = "") -> Table:
        """A constant with these lines between its braces."""
        return self._table(own, words + braces(self._declared(kind, own, sizes), lines), [(kind, math.prod(sizes))])

    def array(self, kind: str, own: str, values: Sequence[Number], words: str = "") -> Table:
        """An array of numbers."""
        text = table(self._typed(kind), f"{self.name}_{own}", values)
        return self._table(own, words + text, [(kind, len(values))])

    def columns(self, kind: str, own: str, columns: Sequence[tuple[str, Sequence[Number]]]) -> Table:
        """Arrays of numbers in one structure, so that compilers reach all of them from one address."""
        text = structure(self._typed(kind), f"{self.name}_{own}", columns)
        return self._table(own, text, [(kind, len(values)) for _, values in columns])

    def _typed(self, kind: str) -> str:
        return kind if kind in STANDARD else f"{self.prefix}_{kind}"

    def _declared(self, kind: str, own: str, sizes: Sequence[int]) -> str:
        return f"{self._typed(kind)} {self.name}_{own}" + "".join(f"[{size}]" for size in sizes)

    def _table(self, own: str, text: str, contents: Sequence[tuple[str, int]]) -> Table:
        return Table(f"{self.name}_{own}", text, tuple(contents))


def filled(entries: Iterable[str]) -> str:
    """Entries of a table on as few lines as possible; one that fits on a line is not broken."""
    fitting = WIDTH - len("    ,")
    whole = ", ".join(entry.replace(" ", "\0") if len(entry) <= fitting else entry for entry in entries)
    lines = textwrap.wrap(whole, WIDTH, initial_indent="    ", subsequent_indent="    ", break_long_words=False)
    return "\n".join(lines).replace("\0", " ")


def entries(values: Iterable[Number], letters: str = "") -> str:
    """Numbers of a table as written in C; `letters` as in `hystgen.effects.kinds.Kind`, and r for a plain number."""
    rest = iter(values)
    if not letters:
        return ", ".join(map(literal, rest))
    return ", ".join(_entry(letter, rest) for letter in letters)


def _entry(letter: str, rest: Iterator[Number]) -> str:
    if letter == "f":
        return f"{{{literal(next(rest))}, {next(rest)}}}"
    if letter == "n":
        return f"{{{_entry('f', rest)}, {next(rest)}, {next(rest)}}}"
    if letter == "c":
        return f"{{{', '.join(literal(next(rest)) for _ in range(4))}}}"
    return literal(next(rest))


AnyTables: TypeAlias = "Tables | FixedTables | ChainTables"


@dataclass(frozen=True)
class Errors:
    """Bounds against the double model for the forward operator and the inverse, 0 for a missing one; `rounding`: the
    inverse's while `condition`, in words, holds."""

    forward: Number
    inverse: Number
    rounding: Number
    condition: str = ""


@dataclass(frozen=True)
class Numbers:
    """The numbers of a model in an arithmetic.

    `drive`, `output`: limits of both; `macros`: for use by functions; `plays`: tables with an entry for each play, and
    the start memory; `beside`: other tables; `stages`: of the memoryless part, if functions call them one by one;
    `lsb`: physical units per code of drive and output, if there are codes; `precision`: sentences about both;
    `envelopes`: whether an envelope limits its argument; the others as in `hystgen.emission.runtime.Variant`.
    """

    tables: AnyTables
    drive: tuple[str, str]
    output: tuple[str, str]
    macros: tuple[Macro, ...]
    plays: tuple[Table, ...]
    beside: tuple[Table, ...]
    errors: Errors
    fronts: bool
    envelopes: bool
    stages: tuple[Stage, ...] = ()
    finer: bool = False
    saturates: bool = False
    lsb: tuple[Number, ...] = ()
    precision: tuple[str, ...] = ()

    @property
    def start_list(self) -> bool:
        """Whether each play starts at its own value."""
        tables = self.tables if isinstance(self.tables, Tables | FixedTables) else self.tables.plays
        return len(tables.start) > 1


@dataclass(frozen=True)
class Effects:
    """The C of a model's effects besides its plays: tables, tables of saturation, and macros."""

    compiled: Compiled
    tables: tuple[Table, ...]
    behind: tuple[Table, ...]
    macros: tuple[Macro, ...]


class Form(ABC):
    """How one kind of arithmetic writes the numbers of a model, and its own words for them if it has codes.

    `apart`: words that begin functions which would cost their callers stack if inlined; `suffix`: of names of macros
    that count codes; `held`: meaning of the status bit HELD; `warning`: about compiler flags; `settings`: arguments of
    the calls that set something, where MODEL is the model's name.
    """

    apart = "static"
    suffix = ""
    held: ClassVar[str]
    warning = ""
    settings: ClassVar[Mapping[str, str]]

    @abstractmethod
    def numbers(self, parameters: Parameters, cascade: StaticModel, options: Options, writer: Writer) -> Numbers:
        """The numbers of a model without effects."""

    @abstractmethod
    def chained(
        self, parameters: Parameters, effects: Effects, stages: Sequence[Stage], options: Options, writer: Writer
    ) -> Numbers:
        """The numbers of a model with effects, with these stages of saturation behind the plays."""

    @abstractmethod
    def behind(self, t: ChainTables, options: Options, writer: Writer) -> list[Stage]:
        """The stages of saturation."""

    @abstractmethod
    def moving(self, t: ChainTables, inverse: bool, writer: Writer) -> tuple[list[Table], list[Macro]]:
        """Tables and numbers of plays that an effect moves or bends."""

    @abstractmethod
    def tap(self, t: ChainTables, writer: Writer) -> Table:
        """The weights of the references that are summed."""

    @abstractmethod
    def waited(self, t: ChainTables, writer: Writer) -> tuple[list[Table], list[Macro]]:
        """The part of a step that a delay takes."""

    @abstractmethod
    def corners(self, inverse: bool, plays: int) -> list[Field]:
        """The memory of engine corners' plays in a model with effects."""

    def effects(self, t: ChainTables) -> list[Macro]:
        """Numbers of a model with effects that only codes need."""
        return []

    def code_sizes(self, t: ChainTables) -> list[Macro]:
        """Sizes of the codes that set a temperature or a gain."""
        return []

    def drive_bits(self, t: ChainTables) -> int:
        """Bits of a signal in front of the plays below a drive."""
        return 0

    @abstractmethod
    def reference_temperature(self, t: ChainTables) -> float:
        """The temperature, degC, at which the model's gain holds."""

    @abstractmethod
    def between(self, low: Number, high: Number, part: float) -> Number:
        """The number at this fraction of a range, in operations of the arithmetic."""

    def counted(self, side: str, unit: str) -> str:
        """The quantity that numbers of the drive or the output count."""
        return self.quantity(side, "", unit)

    def unit(self, unit: str, side: str = "") -> str:
        """The unit after a number, naming the side if one is given."""
        return f" {unit}" if unit else ""

    def quantity(self, words: str, macro: str, unit: str) -> str:
        """A quantity with its unit; `macro`: of the size of a code."""
        return f"{words}, {unit}" if unit else words

    def unless_held(self, call: str) -> str:
        """What a call does with arguments that are not numbers."""
        return ""


def limits(numbers: Tables | FixedTables | ChainTables) -> tuple[tuple[str, str], tuple[str, str]]:
    """Limits of drive and output."""
    ends = [operand(x) for x in numbers.limits[slots.DRIVE_MIN : slots.OUTPUT_MAX + 1]]
    return (ends[0], ends[1]), (ends[2], ends[3])


def macros(numbers: Tables | FixedTables) -> list[Macro]:
    """Macros that every arithmetic has."""
    ends = numbers.limits
    return [
        ("OFFSET", operand(ends[slots.OFFSET]), "part of every output"),
        ("START", operand(numbers.start[0]), "value of each play after init"),
        *(
            (f"{op}_{call}_{what}", value, comment)
            for op, first in (("FORWARD", 0), ("INVERSE", 2))
            for call, j in (("INIT", first), ("RESET", first + 1))
            for what, value, comment in (
                ("DRIVE", operand(numbers.applied[j]), "drive of the start memory"),
                ("ASCENDING", truth(numbers.ascending[j]), "and the direction of its last move"),
            )
        ),
        ("HOLD", operand(ends[slots.HOLD]), "largest step back for which the drive is held instead"),
    ]


def truth(x: object) -> str:
    """A truth value in C."""
    return "true" if x else "false"


def pointers(numbers: Tables | FixedTables, places: Sequence[str], writer: Writer, whose: str = "model") -> Table:
    """Pointers to the tables of engine loop."""
    return writer.entries("tables_t", f"{whose}_tables", [*places, str(len(numbers.threshold) - 1)])


def units(parameters: Parameters) -> tuple[str, str]:
    """Units of drive and output, as written after a number."""
    words = (comment_text(unit) for unit in (parameters.units.input, parameters.units.output))
    drive, output = (f" {unit}" if unit else "" for unit in words)
    return drive, output


def drives(numbers: Tables | FixedTables, columns: Sequence[Reals], operator: str, writer: Writer) -> Table:
    """The drives that an operator's start memories stand for: these columns, and the direction."""
    first = 2 * (operator == "inverse")
    rows = (
        f"{{{', '.join([*(literal(column[j]) for column in columns), truth(numbers.ascending[j])])}}}"
        for j in (first, first + 1)
    )
    return writer.line("drive_t", f"{operator}_first_drive", ", ".join(rows), 2)


@dataclass(frozen=True)
class Glue:
    """The operators of a model as a chain: the memory of an instance by operator, functions, and the calls that it adds
    to those of every model."""

    fields: Mapping[str, Sequence[Field]]
    functions: str
    calls: Mapping[str, Sequence[str]]

    @property
    def states(self) -> dict[str, str]:
        """The type of an instance by operator."""
        return {op: _state(op, fields) for op, fields in self.fields.items()}

    def named(self, names: Mapping[str, Collection[str]]) -> Glue:
        """A copy with only the fields that the functions of each operator name."""
        fields = {op: [each for each in found if each.name in names[op]] for op, found in self.fields.items()}
        return replace(self, fields=fields)


def _state(op: str, fields: Sequence[Field]) -> str:
    """The type of an instance."""
    words = "reference in, drive out" if op == "inverse" else "drive in, displacement out"
    top = f"/* One {op} operator: {words}. Plain data, owned by the caller. */"
    body = "\n".join(f"    {field.text()}" for field in fields)
    return f"{top}\ntypedef struct {{\n{body}\n}} hystgen_{op}_t;\n"


@dataclass(frozen=True)
class Names:
    """The names of a model and of its run time in C, as `NAME` and `RT` in macros."""

    name: str
    rt: str

    @property
    def NAME(self) -> str:  # noqa: N802
        """The model's name in macros."""
        return self.name.upper()

    @property
    def RT(self) -> str:  # noqa: N802
        """The run time's name in macros."""
        return self.rt.upper()


@dataclass(frozen=True)
class Units:
    """Units of drive and output as written in comments, empty if the parameter file has none."""

    drive: str
    output: str

    def behind(self, side: str) -> str:
        """The unit of a side after a comma."""
        unit: str = getattr(self, side)
        return f", {unit}" if unit else ""


@dataclass(frozen=True)
class Compensator:
    """A model in an arithmetic; `compiled`: only with effects; `glue`: only of a chain."""

    parameters: Parameters
    cascade: StaticModel
    options: Options
    names: Names
    family: runtime.Family
    variant: runtime.Variant
    form: Form
    numbers: Numbers
    compiled: Compiled | None
    glue: Glue | None

    @property
    def units(self) -> Units:
        """Units of drive and output."""
        units = self.parameters.units
        return Units(comment_text(units.input), comment_text(units.output))

    @property
    def calls(self) -> dict[str, list[str]]:
        """By operator, the functions that a model with effects adds to those of every model."""
        return {op: list(calls) for op, calls in self.glue.calls.items()} if self.glue else {}

    @property
    def corners(self) -> int:
        """Number of corners that the corner engine keeps, 0 for engine loop."""
        return self.family.corners(self.cascade.pi.n) if self.options.engine == "corners" else 0
