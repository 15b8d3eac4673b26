"""The glue of a model with effects in C: the tables and memory of its blocks, and the order in which they are called.
The blocks themselves are in `c_runtime/` and in the folders of effects."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hystgen.emission.compensator import (
    ConstantTable,
    EmittedStage,
    Form,
    Glue,
    Tabled,
    Writer,
    macros_of,
    members,
)
from hystgen.emission.runtime import Field, Variant, template
from hystgen.emission.text import operand
from hystgen.plays import slots

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import ChainTables
    from hystgen.effects.kinds import BlockKind, Constants


@dataclass(frozen=True)
class NamedBlock:
    """One block of a chain: its constants, and its name within the model."""

    constants: Constants
    name: str

    @property
    def kind(self) -> BlockKind:
        """The kind, which names its functions and types."""
        return self.constants.kind

    @property
    def table(self) -> str:
        """The expression for its table in functions."""
        return f"&hystgen_{self.name}"

    @property
    def fields(self) -> list[Field]:
        """The fields of its memory."""
        kind, rows = self.kind, self.kind.rows
        found = [Field(f"{kind.name}_t", self.name)]
        if rows and rows.state and len(self.constants.rows):
            found.append(Field(f"{kind.name}_state_t", f"{self.name}_state", length=str(len(self.constants.rows))))
        return found

    def call(self, verb: str, x: str) -> str:
        """A call of one of its verbs with the argument x."""
        own = self.kind.verb(verb)
        given = [self.table] * (own in self.kind.reading) + [f"&self->{self.name}"] * (own != "resting")
        if own in ("rest", "absorb"):
            given += [f"self->{field.name}" for field in self.fields[1:]]
        name, bits = f"hystgen_{self.kind.name}_{own}", self.constants.bits
        if not bits:
            return f"{name}({', '.join([*given, x])})"
        finer = f"{x} * ((hystgen_signal_t)1 << {bits}u)"
        return f"hystgen_nearest({name}({', '.join([*given, finer])}), {bits}u)"

    def warming(self) -> str:
        """The call for the heat that a move of the drive to v generates in rubbing plays."""
        return f"hystgen_friction_move({self.table}, &self->{self.name}, self->{self.fields[1].name}, self->applied, v)"

    def tables(self, writer: Writer) -> list[ConstantTable]:
        """Its table, after the table of its rows if it has one."""
        kind, constants = self.kind, self.constants
        numbers = members(kind.table, constants.table)
        if not kind.rows:
            return [writer.entries(f"{kind.tabled}_table_t", self.name, numbers)]
        rows = [members(kind.rows.table, row) for row in constants.rows]
        if not rows:
            return [writer.entries(f"{kind.name}_table_t", self.name, ["NULL", *numbers])]
        of_rows = writer.rows(f"{kind.name}_{kind.rows.name}_t", f"{self.name}_{kind.rows.name}", rows)
        return [of_rows, writer.entries(f"{kind.name}_table_t", self.name, [of_rows.name, *numbers])]


def sides(t: ChainTables, operator: str) -> tuple[list[NamedBlock], list[NamedBlock]]:
    """The blocks of an operator: those in front of the plays, from the drive on, and those behind them."""
    from hystgen.compensator.chain import blocks

    found: list[list[NamedBlock]] = []
    for side in blocks.sides(t, operator):
        counts: Counter[str] = Counter()
        found.append([])
        for constants in side:
            counts[constants.kind.name] += 1
            found[-1].append(NamedBlock(constants, f"{constants.kind.name}_{counts[constants.kind.name]}"))
    return found[0], found[1]


MOVES = ("play", "dilated", "relaxing", "dashpot")
BENDS = ("none", "polynomial", "centre")
"""Run-time files for how plays move and how they are bent, indexed by the codes of `hystgen.effects.plays`."""

SETTINGS = {
    "push": slots.OP_PUSH,
    "settle": slots.OP_SETTLE,
    "set_offset": slots.OP_OFFSET,
    "set_temperature": slots.OP_TEMPERATURE,
    "set_gain": slots.OP_GAIN,
    "set_travel": slots.OP_TRAVEL,
    "set_influence": slots.OP_INFLUENCE,
}
"""Calls that take a number and return nothing, which only models with effects have."""


def settings(calls: Collection[str], columns: int) -> Iterator[tuple[int, str, str]]:
    """The settings among `calls`: code, name in C, and arguments before the number, once for each of the columns."""
    for name, code in SETTINGS.items():
        if name in calls and name != "set_influence":
            yield code, name, ""
        elif name in calls:
            yield from ((code + i, name, f"{i}u, ") for i in range(columns))


def plays(t: ChainTables) -> tuple[str, str]:
    """How plays move and how they are bent. Both are empty for the ordinary plays of an engine, the second also for
    plays that are solved one by one."""
    if t.moving.scanned:
        return MOVES[t.moving.moves], ""
    return (MOVES[t.moving.moves], BENDS[t.moving.bends]) if t.moving.used else ("", "")


@dataclass(frozen=True)
class NamedColumn:
    """A gain that follows a column: its blocks, and the index of its setting, -1 for the temperature."""

    gain: NamedBlock
    course: NamedBlock | None
    entry: int

    @property
    def late(self) -> bool:
        """Whether it follows through a lag."""
        return bool(self.course and self.course.constants.table["lags"])

    @property
    def memory(self) -> str:
        """The arguments for the memory of its course."""
        assert self.course
        first, *rows = self.course.fields
        return ", ".join([f"&self->{first.name}", *(f"self->{each.name}" for each in rows)] + ["NULL"] * (not rows))

    def set(self, value: str) -> str:
        """The call that sets the column to `value`."""
        gain = f"{self.gain.table}, &self->{self.gain.name}"
        if self.course is None:
            return f"hystgen_gain_set({gain}, {value})"
        return f"hystgen_course_set({gain}, {self.course.table}, {self.memory}, {value})"


@dataclass(frozen=True)
class ChainBlocks:
    """The blocks of a model, none without effects: for each operator those in front of the plays and those behind; its
    clock; the plays that rub; and how gains follow columns, with the indices of their settings."""

    sides: Mapping[str, tuple[list[NamedBlock], list[NamedBlock]]]
    clocks: list[NamedBlock]
    rubbing: list[NamedBlock | None]
    courses: list[NamedBlock | None]
    entries: list[int]

    @classmethod
    def none(cls, operators: Sequence[str]) -> ChainBlocks:
        """Those of a model without effects."""
        return cls({op: ([], []) for op in operators}, [], [], [], [])

    @classmethod
    def of(cls, t: ChainTables, operators: Sequence[str]) -> ChainBlocks:
        """The blocks of a model with effects."""
        from hystgen.compensator.chain import blocks

        rubbing, courses = (
            [
                NamedBlock(constants, f"{constants.kind.name}_{i}") if constants else None
                for i, constants in enumerate(blocks.beside(t, name), 1)
            ]
            for name in ("heat", "gain")
        )
        clocks = [NamedBlock(each, "clock") for each in blocks.clocks(t)]
        return cls({op: sides(t, op) for op in operators}, clocks, rubbing, courses, t.columns.entry.tolist())

    def blocks(self, operator: str) -> list[NamedBlock]:
        """Every block of an operator."""
        before, after = self.sides[operator]
        return [*before, *after, *(each for each in [*self.rubbing, *self.courses] if each), *self.clocks]


def effects(t: ChainTables, chain: ChainBlocks, form: Form, writer: Writer) -> Tabled:
    """Tables and macros of a model's effects, besides those of its stages of saturation."""
    largest = max(map(chain.blocks, chain.sides), key=len)  # the forward operator has the inverse's blocks plus modes
    tables = [table for block in largest for table in block.tables(writer)]
    constants = macros_of(t.number)
    constants += [("LEAD", operand(row["most_ahead"]), "samples that references are ahead") for row in t.of("clock")]
    constants.append(("WAITING", f"{t.of('wait').samples}u", "drive samples held in the delay"))
    if t.of("wait").samples:
        tables.append(form.factors("waited", t.of("wait").share, writer))
    if len(t.tap):
        tables.append(form.factors("tap", t.tap, writer))
    constants += [
        ("QUIET", f"{t.quiet}u", "equal references after which the drive stands still"),
        ("TAPS", f"{len(t.tap)}u", "samples of the reference that are summed"),
        *form.effects(t),
    ]
    if t.moving.used:
        moved, numbers_of_plays = form.moving(t, writer)
        tables, constants = tables + moved, constants + numbers_of_plays
    return tables, constants


def glue(t: Variant, chain: ChainBlocks, form: Form, behind: Sequence[EmittedStage], plays: int) -> Glue:
    """The glue of a model with effects, or of one without in the loop engine, which is a chain without blocks;
    `behind`: its stages of saturation."""
    functions = "\n".join(_functions(op, t, chain, form, behind) for op in chain.sides)
    heated = [call for call in ("set_temperature", "set_influence") if call in t.calls]
    aged = ["set_gain", "travel", "set_travel"] * ("travel" in t.calls)
    every = ["settle", "set_offset", *heated, *aged]
    calls = {"forward": every, "inverse": [*every, "expected", "correct", *(["push"] * (t.taps > 0))]}
    fields = {op: instance(op, t, chain.blocks(op), form, plays) for op in chain.sides}
    return Glue(fields, functions, calls if t.chain else {})


_PLAYS = "play 0 is the input of the plays"
_KEPT = "; the rounding remainder of each follows"
_LAST = "the same, limited: the next reference moves up or down from here"


def instance(op: str, t: Variant, blocks: Sequence[NamedBlock], form: Form, plays: int) -> list[Field]:
    """The memory of one operator, field by field."""
    inverse, taps, kept = op == "inverse", t.taps, plays * (t.moves == "dashpot")
    waiting = 0 if inverse else t.waiting
    arrived = Field("fine_t", "drive", "last output of the drive side")
    answer = "drive" if inverse else "displacement" if t.chain else "output"
    length = str(plays + 1 + kept) if kept else "HYSTGEN_N_PLAYS + 1"
    searched = [Field("bool", "sought", "a solution has been found since the plays last followed")] * inverse
    return [
        *[Field("real_t", "pending", "drive sent but not yet in the memory")] * inverse,
        Field("real_t", "applied", "last applied drive"),
        *[Field("ramp_t", "reached", "drive at a limited rate")] * t.slew,
        arrived if t.chain else Field("real_t", "drive", "last applied drive"),
        *[Field("real_t", "reference", "of the last step"), Field("real_t", "last", _LAST)] * inverse,
        Field("signal_t", "level", "sum of the plays"),
        Field("signal_t", "output", "last output of the output side"),
        Field("real_t", "answer", f"last returned {answer}"),
        Field("signal_t", "offset", "set in addition to the model's"),
        *(field for block in blocks for field in block.fields),
        *[Field("quiet_t", "quiet")] * (inverse and t.quiet),
        *[Field("steady_t", "steady")] * (inverse and t.turning),
        *[Field("signal_t", "line", "references, the newest last", str(taps))] * (inverse and taps > 0),
        *[Field("real_t", "waiting", "drives", str(waiting)), Field("unsigned int", "oldest", "drive")] * (waiting > 0),
        Field("bool", "ascending", "direction of the drive's last move"),
        Field("bool", "moving", "a drive has been applied"),
        *[
            Field("bool", "has_pending"),
            Field("bool", "repeated", "the last returned drive is still valid for `reference`"),
            Field("bool", "stepped", "a step has returned a drive"),
            Field("bool", "filled", "the line holds references"),
            Field("unsigned int", "bits", "of the last step"),
        ] * inverse,
        Field("unsigned int", "status"),
        *([*searched, *form.corners(inverse, plays)] if t.engine == "corners"
          else [Field("play_t", "play", _PLAYS + _KEPT * (kept > 0), length)]),
        *[Field("signal_t", "bent", "contribution of each play", "HYSTGEN_N_PLAYS")] * t.bent,
        *[
            Field("signal_t", "staying", "sum of the plays that have not moved lately"),
            Field("unsigned int", "released", "the last of the plays that have"),
        ] * bool(t.bent or t.elements),
        *[
            Field("play_t", "turned", "input of the elements in parallel with the plays at their last turn"),
            Field("bool", "upward", "their input has risen since"),
            *[
                Field("play_t", "found", "input to which a search has led,"),
                Field("signal_t", "asked", "and the sum of the plays there"),
            ] * (inverse and t.family.kind == "float"),
            *[
                Field("play_t", "near", "input for which the sum of the elements was last computed,"),
                Field("sum_t", "joined", "that sum,"),
                Field("sum_t", "slope", "its slope, and whether"),
                Field("bool", "departs", "they have turned there"),
            ] * (t.family.kind == "fixed"),
            *[Field("sum_t", "steep", "slope that the rate of a search has, or -1 after a turn")]
            * (inverse and t.family.kind == "fixed" and t.smooth),
            Field("element_t", "element", "", str(t.elements)),
        ] * bool(t.elements),
        *[Field("search_t", "search", "for the input of the plays")] * (inverse and bool(t.bends)),
    ]


def _functions(op: str, t: Variant, chain: ChainBlocks, form: Form, behind: Sequence[EmittedStage]) -> str:
    """The functions of one operator that name its blocks."""
    inverse, (before, after), clocks = op == "inverse", chain.sides[op], chain.clocks
    quiet, turning = inverse and t.quiet, inverse and t.turning
    settled = absorbed = seen = ""
    if turning:
        place = f"self->{before[0].name}{'.lag' * t.braked}"
        settled = "    hystgen_steady_rest(&self->steady);\n"
        seen = f"    const hystgen_signal_t before = {place}.high;\n"
        absorbed = f"    hystgen_steady_absorb(&self->steady, &{place}, before);\n"
    elif quiet:
        settled, absorbed = "    hystgen_quiet_rest(&self->quiet, v);\n", "    self->quiet.arrived = v;\n"
    from hystgen.compensator.chain.parts import PARTS

    moved = {kind.name for part in PARTS if part.floating.verbs.move for kind in part.floating.kinds}
    kinds: defaultdict[str, list[NamedBlock]] = defaultdict(list)
    for block in after:
        kinds[block.kind.name].append(block)

    def offset(lead: str) -> str:
        drifts = "".join(f" + hystgen_clock_drift({each.table}, &self->{each.name}, {lead})" for each in clocks)
        return f"(HYSTGEN_OUTPUT_OFFSET + self->offset{drifts})" if t.chain else "HYSTGEN_OFFSET"

    return template(
        "chain.c.j2", op=op, inverse=inverse, before=before, after=after, behind=behind, clocks=clocks,
        rubbing=[each for each in chain.rubbing if each], kinds=kinds,
        turning=turning, quiet=quiet, settled=settled, absorbed=absorbed, seen=seen, offset=offset,
        solve="braked" if t.braked else "solve", counted="" if quiet else "const ",
        lead=f"self->filled ? self->{clocks[0].name}.lead : 0" if clocks and t.taps else "0",
        displacing=form.apart if behind or clocks else "static",
        travelling=form.apart if clocks or any(block.kind.name in moved for block in after) else "static",
        columns=list(map(NamedColumn, kinds["gain"], chain.courses, chain.entries)),
        warming=["hystgen_heat_way(self->applied, v)" if each is None else each.warming() for each in chain.rubbing],
    )
