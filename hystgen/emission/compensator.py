"""A model's compensator in an arithmetic, from which its C is written: names, numbers, tables and memory. A `Form` for
each kind of arithmetic holds the differences between floating and fixed point."""

from __future__ import annotations

import itertools
import math
import re
import textwrap
from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import numpy as np

from hystgen.basics.structures import Struct
from hystgen.compensator.layout import FixedTables, Tables
from hystgen.emission import runtime
from hystgen.emission.folding import Member
from hystgen.emission.options import Options
from hystgen.emission.runtime import LANGUAGE, Field, Piece, declared_type
from hystgen.emission.text import WIDTH, Number, comment_text, constant, literal, operand, structure, table
from hystgen.plays.slots import Reals

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import ChainTables, Compiled
    from hystgen.compensator.chain.measured import Measured
    from hystgen.compensator.converter import CodeConversion
    from hystgen.compensator.health import Watch
    from hystgen.degaussing import Degauss
    from hystgen.model import Model

Macro: TypeAlias = tuple[str, str, str]
"""A macro of a model: its name without the model's prefix, its value, and a comment."""

@dataclass(frozen=True)
class ConstantTable:
    """A constant; `contents`: the types in it, without a run time's prefix, and how many of each it contains."""

    name: str
    text: str
    contents: tuple[tuple[str, int], ...]

    @property
    def kind(self) -> str:
        """The type of which it is, by which its members are known."""
        return self.contents[0][0]

    def keeping(self, types: Mapping[str, str], named: Collection[Member], whole: Collection[str]) -> ConstantTable:
        """A copy with only the members that are `named`; `types`: those of all, by name; `whole`: structures that keep
        all, where pointers become NULL instead."""
        return self


@dataclass(frozen=True)
class Columns(ConstantTable):
    """Arrays of numbers in one structure, so compilers reach all of them from one address; `typed`: the type of the
    numbers as written in C."""

    typed: str = ""
    columns: tuple[tuple[str, Sequence[Number]], ...] = ()

    @classmethod
    def of(cls, name: str, kind: str, typed: str, columns: Iterable[tuple[str, Sequence[Number]]]) -> Columns:
        """The constant with these columns."""
        columns = tuple(columns)
        contents = tuple((kind, len(values)) for _, values in columns)
        return cls(name, structure(typed, name, columns), contents, typed, columns)

    @property
    def kind(self) -> str:
        return self.name

    def keeping(self, types: Mapping[str, str], named: Collection[Member], whole: Collection[str]) -> ConstantTable:
        kept = (each for each in self.columns if (self.name, each[0]) in named)
        return self.of(self.name, self.contents[0][0], self.typed, kept)


@dataclass(frozen=True)
class Structures(ConstantTable):
    """A structure, or an array of them; `declared`: its declaration; `rows`: the members of each as written in C;
    `words`: a comment above it."""

    declared: str = ""
    rows: tuple[Sequence[str], ...] = ()
    words: str = ""

    @classmethod
    def of(cls, name: str, kind: str, declared: str, rows: Iterable[Sequence[str]], words: str) -> Structures:
        """The constant with these rows."""
        rows = tuple(rows)
        lines = filled(rows[0]).splitlines()
        if declared.endswith("]"):
            lines = filled(f"{{{', '.join(row)}}}" for row in rows).splitlines()
        text = constant(declared, lines)
        return cls(name, words + text, ((kind, len(rows)),), declared, rows, words)

    def keeping(self, types: Mapping[str, str], named: Collection[Member], whole: Collection[str]) -> ConstantTable:
        wanted = {name for name in types if (self.kind, name) in named}
        idle = {name for name, kind in types.items() if "*" in kind} - wanted
        shown = types if self.kind in whole else wanted
        rows = [
            ["NULL" if name in idle else entry for name, entry in zip(types, row, strict=True) if name in shown]
            for row in self.rows
        ]
        return self.of(self.name, self.kind, self.declared, rows, self.words)


@dataclass(frozen=True)
class EmittedStage:
    """A memoryless stage: its kind, its tables, the expression for the last table in a call, and the argument through
    which the call reports that the stage limited its input."""

    kind: str
    arrays: tuple[ConstantTable, ...]
    table: str
    limited: str = ""


@dataclass(frozen=True)
class Writer:
    """Writes the constants of the model `name` with the types of the run time `prefix`. A constant is named after the
    model, followed by `own`; it is an array if it has `sizes`."""

    name: str
    prefix: str

    @property
    def own(self) -> Writer:
        """A writer for types that the model itself defines."""
        return Writer(self.name, self.name)

    def entries(self, kind: str, own: str, entries: Sequence[str], words: str = "") -> ConstantTable:
        """A structure with these entries; `words`: a comment above it."""
        return Structures.of(f"{self.name}_{own}", kind, self._declared(kind, own, ()), [entries], words)

    def rows(self, kind: str, own: str, rows: Sequence[Sequence[str]], words: str = "") -> ConstantTable:
        """An array of structures."""
        declared = self._declared(kind, own, (len(rows),))
        return Structures.of(f"{self.name}_{own}", kind, declared, rows, words)

    def matrix(self, kind: str, own: str, rows: Sequence[Sequence[Number]]) -> ConstantTable:
        """An array of arrays of numbers."""
        sizes = len(rows), len(rows[0])
        lines = filled(f"{{{entries(row)}}}" for row in rows).splitlines()
        text = constant(self._declared(kind, own, sizes), lines)
        return ConstantTable(f"{self.name}_{own}", text, ((kind, math.prod(sizes)),))

    def array(self, kind: str, own: str, values: Sequence[Number], words: str = "") -> ConstantTable:
        """An array of numbers."""
        text = table(self._typed(kind), f"{self.name}_{own}", values)
        return ConstantTable(f"{self.name}_{own}", words + text, ((kind, len(values)),))

    def columns(self, kind: str, own: str, columns: Sequence[tuple[str, Sequence[Number]]]) -> ConstantTable:
        """Arrays of numbers in one structure."""
        return Columns.of(f"{self.name}_{own}", kind, self._typed(kind), columns)

    def _typed(self, kind: str) -> str:
        return kind if kind in LANGUAGE else f"{self.prefix}_{kind}"

    def _declared(self, kind: str, own: str, sizes: Sequence[int]) -> str:
        return f"{self._typed(kind)} {self.name}_{own}" + "".join(f"[{size}]" for size in sizes)


def filled(entries: Iterable[str]) -> str:
    """Entries of a table on as few lines as possible; an entry that fits on a line is not broken."""
    fitting = WIDTH - len("    ,")
    whole = ", ".join(entry.replace(" ", "\0") if len(entry) <= fitting else entry for entry in entries)
    lines = textwrap.wrap(whole, WIDTH, initial_indent="    ", subsequent_indent="    ", break_long_words=False)
    return "\n".join(lines).replace("\0", " ")


def entries(values: Iterable[Number]) -> str:
    """Numbers in a table as written in C."""
    return ", ".join(map(literal, values))


def members(kind: type[Struct], one: np.void | Mapping[str, object]) -> list[str]:
    """The members of a structure as written in C."""
    names = one if isinstance(one, Mapping) else one.dtype.names or ()
    return [_written(one[name]) for name in names if kind.members()[name].only != "python"]


def _written(number: Any) -> str:
    if isinstance(number, np.void):
        return f"{{{', '.join(_written(number[name]) for name in number.dtype.names or ())}}}"
    return f"{{{entries(number)}}}" if isinstance(number, np.ndarray) else literal(number)


Tabled: TypeAlias = tuple[list[ConstantTable], list[Macro]]
"""Tables and macros of effects, or of plays that an effect moves or bends."""

AnyTables: TypeAlias = "Tables | FixedTables | ChainTables"


@dataclass(frozen=True)
class Errors:
    """Error bounds for the forward operator and the inverse against the double model, 0 for a missing operator;
    `rounding`: the inverse's bound while `condition`, in words, holds."""

    forward: Number
    inverse: Number
    rounding: Number
    condition: str = ""


@dataclass(frozen=True)
class Numbers:
    """The numbers of a model in an arithmetic.

    `macros`: for use by functions; `plays`: tables with an entry for each play, and the start memory; `beside`: other
    tables; `stages`: of the memoryless part, if functions call them one by one; `lsb`: physical units per code of drive
    and output, if there are codes; `precision`: sentences about codes and their error; `envelopes`: whether an envelope
    limits its argument; the others as in `hystgen.emission.runtime.Variant`.
    """

    tables: AnyTables
    macros: tuple[Macro, ...]
    plays: tuple[ConstantTable, ...]
    beside: tuple[ConstantTable, ...]
    errors: Errors
    fronts: bool
    envelopes: bool
    stages: tuple[EmittedStage, ...] = ()
    finer: bool = False
    saturates: bool = False
    lsb: tuple[Number, ...] = ()
    precision: tuple[str, ...] = ()

    @property
    def start_list(self) -> bool:
        """Whether each play starts at its own value."""
        tables = self.tables if isinstance(self.tables, Tables | FixedTables) else self.tables.plays
        return len(tables.start) > 1


class Form(ABC):
    """How one kind of arithmetic writes the numbers of a model, and how it describes them if it has codes.

    `apart`: first words of functions that would cost their callers stack if inlined; `suffix`: of the names of macros
    in codes; `held`: meaning of the status bit HELD; `warning`: about compiler flags; `settings`: descriptions of what
    the setters take, in which MODEL stands for the model's name.
    """

    apart = "static"
    suffix = ""
    held: ClassVar[str]
    warning = ""
    settings: ClassVar[Mapping[str, str]]

    @abstractmethod
    def numbers(self, model: Model, options: Options, writer: Writer) -> Numbers:
        """The numbers of a model without effects."""

    @abstractmethod
    def chained(
        self, model: Model, compiled: Compiled, effects: Tabled, stages: Sequence[EmittedStage], options: Options,
        writer: Writer,
    ) -> Numbers:
        """The numbers of a model with effects, with these stages of saturation behind the plays."""

    @abstractmethod
    def behind(self, t: ChainTables, writer: Writer) -> list[EmittedStage]:
        """The stages of saturation."""

    @abstractmethod
    def moving(self, t: ChainTables, writer: Writer) -> Tabled:
        """Tables and macros of plays that an effect moves or bends."""

    @abstractmethod
    def factors(self, own: str, rows: Reals, writer: Writer) -> ConstantTable:
        """An array of factors."""

    @abstractmethod
    def corners(self, inverse: bool, plays: int) -> list[Field]:
        """The memory of the corner engine's plays in a model with effects."""

    def effects(self, t: ChainTables) -> list[Macro]:
        """Macros that a model with effects needs only in fixed point."""
        return []

    def code_sizes(self, t: ChainTables, columns: Sequence[str]) -> list[Macro]:
        """Sizes of the codes that set a temperature, a gain or one of the `columns`."""
        return []

    def drive_bits(self, t: ChainTables) -> int:
        """Number of bits by which a signal in front of the plays is finer than a drive."""
        return 0

    @abstractmethod
    def between(self, low: Number, high: Number, part: float) -> Number:
        """The number at this fraction of a range, computed with the arithmetic's operations."""

    def counted(self, side: str, unit: str) -> str:
        """What the numbers of one side, drive or output, mean: a quantity in its unit, or codes."""
        return self.quantity(side, "", unit)

    def unit(self, unit: str, side: str = "") -> str:
        """The unit after a number, naming the side if one is given."""
        return f" {unit}" if unit else ""

    def quantity(self, words: str, macro: str, unit: str) -> str:
        """A quantity with its unit; `macro`: the one for the size of a code."""
        return f"{words}, {unit}" if unit else words

    def unless_held(self, call: str) -> str:
        """What a call does with NaN and infinite arguments."""
        return ""


def macros_of(numbers: Struct) -> list[Macro]:
    """Macros for the members of a structure."""
    return [
        (name.upper(), f"{numbers[name][0]}u" if kind == "uint8_t" else operand(numbers[name][0]), note)
        for name, (kind, _, only, note) in type(numbers).members().items() if only != "python"
    ]


def macros(numbers: Tables | FixedTables) -> list[Macro]:
    """Macros that every arithmetic has."""
    ends = numbers.limits
    return [
        ("OFFSET", operand(ends.offset[0]), "added to every output"),
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
        ("HOLD", operand(ends.hold[0]), "largest step back at which the drive is held instead"),
    ]


def structures(writer: Writer, *arrays: tuple[str, Struct]) -> list[ConstantTable]:
    """Tables of structures, whose types are named like them, unless they are empty."""
    return [
        writer.rows(f"{name}_t", name, [members(type(part), row) for row in part])
        for name, part in arrays if len(part)
    ]


def truth(x: object) -> str:
    """A truth value in C."""
    return "true" if x else "false"


def pointers(
    numbers: Tables | FixedTables, places: Sequence[str], writer: Writer, whose: str = "model"
) -> ConstantTable:
    """Pointers to the loop engine's tables."""
    return writer.entries("tables_t", f"{whose}_tables", [*places, str(len(numbers.threshold) - 1)])


def drives(numbers: Tables | FixedTables, columns: Sequence[Reals], operator: str, writer: Writer) -> ConstantTable:
    """The drives of an operator's start memories: these columns, and the direction of the last move."""
    first = 2 * (operator == "inverse")
    rows = [
        [*(literal(column[j]) for column in columns), truth(numbers.ascending[j])] for j in (first, first + 1)
    ]
    return writer.rows("drive_t", f"{operator}_first_drive", rows)


@dataclass(frozen=True)
class Glue:
    """The operators of a model as a chain: the memory of an instance, by operator; functions; and, by operator, the
    calls beyond those that every model has."""

    fields: Mapping[str, Sequence[Field]]
    functions: str
    calls: Mapping[str, Sequence[str]]

    @property
    def states(self) -> dict[str, Piece]:
        """The type of an instance by operator."""
        words = {"inverse": "reference in, drive out", "forward": "drive in, displacement out"}
        owned = "Plain data, owned by the caller."
        return {
            op: declared_type(f"{op}_t", f"/* One {op} operator: {words[op]}. {owned} */", fields)
            for op, fields in self.fields.items()
        }


@dataclass(frozen=True)
class Names:
    """The names of a model and of its run time in C; `NAME` and `RT` in macros."""

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
class UnitTexts:
    """Units of drive and output as written in comments, empty if the parameter file has none."""

    drive: str
    output: str

    def behind(self, side: str) -> str:
        """The unit of a side after a comma."""
        unit: str = getattr(self, side)
        return f", {unit}" if unit else ""


def influence_macros(columns: Sequence[str]) -> list[str]:
    """The names of columns in macros: in upper case, other characters as _, and with a number where two are equal."""
    found: list[str] = []
    for column in columns:
        plain = re.sub(r"[^A-Z0-9]", "_", column.upper())
        names = itertools.chain([plain], (f"{plain}_{i}" for i in itertools.count(2)))
        found.append(next(name for name in names if name not in found))
    return found


@dataclass(frozen=True)
class EmittedModel:
    """A model in an arithmetic; `compiled`: None without effects; `glue`: None unless the model is a chain;
    `conversion`: None unless the inverse has converters; `watch`: None unless the C watches the model's error;
    `erasing`: the sequence that erases the memory, if the file asks for one."""

    model: Model
    options: Options
    names: Names
    family: runtime.Family
    variant: runtime.Variant
    form: Form
    numbers: Numbers
    compiled: Compiled | None
    glue: Glue | None
    conversion: CodeConversion | None = None
    watch: Watch | None = None
    erasing: Degauss | None = None

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns that `set_influence` sets, by index."""
        return tuple(column for column, *_ in self.compiled.columns) if self.compiled else ()

    @cached_property
    def measured(self) -> Measured | None:
        """The largest error that a search finds, for an inverse whose error is bounded only by the drive range."""
        limits = self.numbers.tables.limits
        whole = float(limits.drive.high[0]) - float(limits.drive.low[0])
        if not self.options.inverse or self.compiled is None or self.numbers.errors.inverse < whole:
            return None
        from hystgen.compensator.chain.measured import measured

        return measured(self.compiled, self.model.chain, self.model.parameters.emit.compensation)

    @property
    def kernel_facts(self) -> frozenset[str]:
        """What the kernels know about the model; nothing if models share them. Plays stop at a limit of their sum only
        in an inverse of plays alone, which solves for drives at one."""
        t = self.numbers.tables
        limited = self.options.inverse and isinstance(t, Tables | FixedTables) and not t.has_front
        known = not limited and self.options.layout != "shared-runtime"
        guarded = self.options.tables == "runtime" and self.options.layout != "shared-runtime"
        return frozenset(["HYSTGEN_HAS_NO_LIMIT"] * known + ["HYSTGEN_HAS_PARAMETERS"] * guarded)

    @property
    def units(self) -> UnitTexts:
        """Units of drive and output."""
        units = self.model.parameters.units
        return UnitTexts(comment_text(units.input), comment_text(units.output))

    @property
    def calls(self) -> Mapping[str, Sequence[str]]:
        """By operator, the functions that a model with effects has in addition to those of every model."""
        return self.glue.calls if self.glue else {}

    @property
    def corners(self) -> int:
        """Number of corners that the corner engine keeps, 0 for the loop engine."""
        return self.family.corners(self.model.cascade.pi.n) if self.options.engine == "corners" else 0
