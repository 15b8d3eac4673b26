"""The glue of a model with effects in C: tables and memory of its blocks, and the order of their calls. The blocks
themselves are in `c_runtime/` and in the folders of effects.
"""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from hystgen.emission.text import WIDTH, constant, literal, operand, structure, table
from hystgen.plays import slots

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import ChainTables, Compiled
    from hystgen.compensator.chain.moving import FixedMovingTables, MovingTables
    from hystgen.effects.bend import Bends
    from hystgen.effects.kinds import Constants, Kind


@dataclass(frozen=True)
class Field:
    """A field of an instance: `kind` is that of a number, flag, status, or of a block and then made of `members`, real
    numbers r or those of fixed point as in `Kind`, and `flags`, or a type of the corner engine; with a `count` it is an
    array, which C gives the length `length`, if any."""

    kind: str
    name: str
    comment: str = ""
    count: int = 0
    members: str = ""
    flags: int = 0
    length: str = ""

    def text(self) -> str:
        """Its declaration."""
        kind = {"flag": "bool", "status": "unsigned int"}.get(self.kind, f"hystgen_{self.kind}_t")
        size = f"[{self.length or self.count}]" if self.count else ""
        return f"{kind} {self.name}{size};" + (f" /* {self.comment} */" if self.comment else "")


@dataclass(frozen=True)
class Block:
    """One block of a chain: its numbers, and its name among those of the model."""

    constants: Constants
    name: str

    @property
    def kind(self) -> Kind:
        """Which names its functions and types."""
        return self.constants.kind

    @property
    def table(self) -> str:
        """How functions name its table."""
        return f"&hystgen_{self.name}"

    @property
    def fields(self) -> list[Field]:
        """Its memory."""
        kind, rows = self.kind, self.kind.rows
        found = [Field(kind.name, self.name, members=kind.memory or len(kind.state) * "r", flags=len(kind.flags))]
        if rows and (rows.state or rows.memory):
            count, members = len(self.constants.rows), rows.memory or len(rows.state) * "r"
            found.append(Field(f"{kind.name}_state", f"{self.name}_state", count=count, members=members))
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
        """What plays that rub make of a move of the drive to v."""
        return f"hystgen_friction_move({self.table}, &self->{self.name}, self->{self.fields[1].name}, self->applied, v)"

    def arrays(self, prefix: str) -> list[str]:
        """Its table, behind that of its rows where it has any."""
        kind, constants, own = self.kind, self.constants, f"{prefix}_{self.name}"
        numbers = [_entries(constants.table, kind.letters)] * (len(constants.table) > 0)
        numbers += map(str, constants.counts)
        if not kind.rows:
            return [_table(f"{prefix}_{kind.tabled}_table_t {own}", numbers)]
        rows, n = f"{own}_{kind.rows.name}", len(constants.rows)
        lines = ",\n".join(f"    {{{_entries(row, kind.rows.letters)}}}" for row in constants.rows)
        return [
            f"static const {prefix}_{kind.name}_{kind.rows.name}_t {rows}[{n}] = {{\n{lines},\n}};\n",
            _table(f"{prefix}_{kind.name}_table_t {own}", [rows, *numbers]),
        ]


def _table(declared: str, entries: Sequence[str]) -> str:
    lines = textwrap.wrap(", ".join(entries) + ",", WIDTH, initial_indent="    ", subsequent_indent="    ")
    return f"static const {declared} = {{\n" + "\n".join(lines) + "\n};\n"

def sides(t: ChainTables, operator: str) -> tuple[list[Block], list[Block]]:
    """The blocks of an operator in front of the plays, starting from the drive, and those behind them."""
    from hystgen.compensator.chain import blocks

    found: list[list[Block]] = []
    for side in blocks.sides(t, operator):
        counts: Counter[str] = Counter()
        found.append([])
        for constants in side:
            counts[constants.kind.name] += 1
            found[-1].append(Block(constants, f"{constants.kind.name}_{counts[constants.kind.name]}"))
    return found[0], found[1]


def _entries(values: Any, letters: str = "") -> str:
    """Numbers of a table as they stand in C; `letters` as in `Kind`."""
    found, rest = [], iter(values)
    for letter in letters or len(values) * "r":
        if letter == "f":
            found.append(f"{{{literal(next(rest))}, {next(rest)}}}")
        elif letter == "n":
            found.append(f"{{{_entries([next(rest), next(rest)], 'f')}, {next(rest)}, {next(rest)}}}")
        elif letter == "c":
            found.append(f"{{{', '.join(literal(next(rest)) for _ in range(4))}}}")
        else:
            found.append(literal(next(rest)))
    return ", ".join(found)


def saturation(t: ChainTables, j: int, name: str, prefix: str) -> dict[str, Any]:
    """What saturates in fixed point, as `numbers.stage` has it in floating point."""
    behind, own = t.behind, f"{name}_behind_{j + 1}"
    if behind.kind[j] == slots.DEAD_ZONE:
        lower, upper, *over = behind.piece[j]
        entries = f"{literal(lower)}, {literal(upper)}, {_entries(over, 'ff')}"
        text = f"static const {prefix}_stops_t {own} = {{\n    {entries},\n}};\n"
        return {"kind": "stops", "arrays": [text], "table": f"&hystgen_behind_{j + 1}", "limited": ""}
    arrays, ends = [], []
    for which, direction in ((2 * j, "there"), (2 * j + 1, "back")):
        more, entries = _curve(behind.bends, which, f"{own}_{direction}")
        arrays += more
        ends.append(f"    {{{entries}}}")
    arrays.append(f"static const {prefix}_bend_t {own} = {{\n" + ",\n".join(ends) + ",\n};\n")
    return {"kind": "bend", "arrays": arrays, "table": f"&hystgen_behind_{j + 1}", "limited": ", limited"}


def _curve(t: Bends, which: int, own: str) -> tuple[list[str], str]:
    """The tables of a curve in fixed point, and the initializer of the curve itself."""
    arrays, pointers = _pieces(t, which, own)
    counts = (*t.domain[which], t.pieces[which], t.coefficient.shape[1] - 1, *t.scaled[which])
    return arrays, f"{pointers},\n     {_entries(counts)}"


def _pieces(t: Bends, which: int, own: str) -> tuple[list[str], str]:
    """The tables of a curve's pieces, and their names."""
    here = int(t.first[which])
    rows = slice(here, here + int(t.pieces[which]))
    arrays = [
        table("int32_t", f"{own}_knot", list(t.knot[rows])),
        table("uint8_t", f"{own}_scale", list(t.scale[rows])),
        table("int32_t", f"{own}_coefficient", list(t.coefficient[rows].ravel())),
    ]
    pointers = ", ".join(f"{own}_{part}" for part in ("knot", "scale", "coefficient"))
    return arrays, pointers


MOVES = ("play", "dilated", "relaxing", "dashpot")
BENDS = ("none", "polynomial", "centre")
"""Files of the run time that say how plays move and are bent, by the codes of `hystgen.compensator.chain.moving`."""


SETTINGS = {
    "push": slots.OP_PUSH,
    "settle": slots.OP_SETTLE,
    "set_offset": slots.OP_OFFSET,
    "set_temperature": slots.OP_TEMPERATURE,
    "set_gain": slots.OP_GAIN,
    "set_travel": slots.OP_TRAVEL,
}
"""Calls of models with effects that take a number and return none."""


def plays(t: ChainTables) -> tuple[str, str]:
    """How plays move and are bent; empty where engine loop has them, and bends where they are solved for one after the
    other."""
    if t.moving.scanned:
        return MOVES[t.moving.moves], ""
    return (MOVES[t.moving.moves], BENDS[t.moving.bends]) if t.moving.used else ("", "")


def _moving(t: MovingTables, prefix: str) -> tuple[list[str], list[tuple[str, str, str]]]:
    """Tables and numbers of plays that an effect moves or bends."""
    from hystgen.compensator.chain import moving

    real_t = f"{prefix}_real_t"
    arrays: list[str] = []
    if t.scanned:
        members = [("share", list(t.share)), ("inverse", list(t.inverse))]
        numbers = [("LATE", operand(t.first[1]), "of a stretch, what a play gains at the end of a step"),
                   ("KEPT", operand(t.second[1]), "and on the way to the next")]  # fmt: skip
        return [structure(real_t, f"{prefix}_relaxing", members)], numbers
    if t.moves == moving.DILATED:
        arrays.append(table(real_t, f"{prefix}_wider", list(t.first)))
    if t.moves == moving.RELAXING:
        arrays += [table(real_t, f"{prefix}_late", list(t.first)), table(real_t, f"{prefix}_kept", list(t.second))]
    if t.moves == moving.DASHPOT:
        rows = ",\n".join(f"    {{{_entries(row)}}}" for row in t.yields)
        n, terms = t.yields.shape
        arrays.append(f"static const {real_t} {prefix}_yields[{n}][{terms}] = {{\n{rows},\n}};\n")
    if t.bends == moving.POLYNOMIAL:
        n, terms = t.curve.shape
        rows = ",\n".join(f"    {{{', '.join(map(literal, row))}}}" for row in t.curve)
        arrays.append(f"static const {real_t} {prefix}_curve[{n}][{terms}] = {{\n{rows},\n}};\n")
    words = (
        ("SCALE", moving.SCALE, "largest threshold"), ("INVERSE_SCALE", moving.INVERSE_SCALE, ""),
        ("CENTRE", moving.MIDDLE, "of the loops that count more or less"),
        ("INVERSE_WIDTH", moving.INVERSE_WIDTH, ""), ("BUMP", moving.BUMP, "how much, times the width"),
        ("TANH_CENTRE", moving.TANH_CENTRE, "so that a play at 0 contributes nothing"),
        ("LEAST_INPUT", moving.LEAST_INPUT, "of the plays, for a search"),
        ("LARGEST_INPUT", moving.LARGEST_INPUT, ""),
        ("STANDING_SHARE", moving.SEEN, "share of a step's way at which the input counts as standing still"),
    )  # fmt: skip
    constants = [(name, operand(t.number[place]), comment) for name, place, comment in words]
    counts = [("TERMS", f"{t.curve.shape[1]}u", "of a polynomial"), ("HALVES", f"{t.halves}u", "steps of the search"),
              ("YIELDS", f"{len(t.yields)}u", "pieces of what a dashpot yields")]  # fmt: skip
    return arrays, [*constants, *counts]


def _fixed_moving(t: FixedMovingTables, prefix: str, inverse: bool) -> tuple[list[str], list[tuple[str, str, str]]]:
    """Tables and numbers of plays that an effect moves or bends in fixed point."""
    from hystgen.compensator.chain import moving

    factor_t = f"{prefix}_factor_t {prefix}"
    numbers = [("LARGEST_INPUT", operand(t.farthest), "of the plays, for a search")]
    if t.scanned:
        arrays = [
            f"static const {factor_t}_relaxing_{name} = {{{_entries(rows[1], 'f')[1:-1]}}};\n"
            for name, rows in (("late", t.first), ("kept", t.second))
        ]
        if inverse:
            arrays += [
                table("int32_t", f"{prefix}_relaxing_slope", list(t.relaxed.slope)),
                table("uint32_t", f"{prefix}_relaxing_reciprocal", list(t.relaxed.reciprocal)),
                table("uint8_t", f"{prefix}_relaxing_shift", list(t.relaxed.shift)),
            ]
        return arrays, numbers
    names = {moving.RELAXING: ("late", "kept"), moving.DILATED: ("wider",)}.get(t.moves, ())
    arrays = [
        constant(f"{factor_t}_{name}[{len(rows)}]", [f"    {_entries(row, 'f')}," for row in rows])
        for name, rows in zip(names, (t.first, t.second), strict=False)
    ]
    if t.moves == moving.DASHPOT:
        rows = ",\n".join(f"    {{{_entries(row, 'rcrr')}}}" for row in t.yields)
        arrays.append(f"static const {prefix}_yield_t {prefix}_yields[{len(t.yields)}] = {{\n{rows},\n}};\n")
        arrays.append(f"static const {factor_t}_standing_share = {{{_entries(t.seen, 'f')[1:-1]}}};\n")
        numbers += [
            ("YIELDS", f"{len(t.yields)}u", "pieces of what a dashpot yields"),
            ("YIELD_BITS", f"{t.yield_bits}u", "of a yield below a step of the plays' input"),
            ("STRETCH", operand(t.stretch), "of a play, up to which there are any"),
        ]
    if t.bends != moving.STRAIGHT:
        curves = [_pieces(t.bump, k, f"{prefix}_bump_{k + 1}") for k in range(len(t.bump.pieces))]
        arrays += [text for texts, _ in curves for text in texts]
        rows = ",\n".join(f"    {{{names}, {n}}}" for (_, names), n in zip(curves, t.bump.pieces, strict=True))
        arrays.append(f"static const {prefix}_bump_t {prefix}_bump[{len(curves)}] = {{\n{rows},\n}};\n")
        arrays.append(table("uint16_t", f"{prefix}_bump_of", list(t.bump_of)))
        numbers += [
            ("BUMP_END", operand(t.bump.domain[0, 1]), "largest input of what a bent play adds"),
            ("BUMP_DEGREE", f"{t.bump.coefficient.shape[1] - 1}u", ""),
            ("BUMP_LIFT", f"{t.bump.scaled[0, 1]}u", "bits that its polynomials leave out"),
            ("BUMP_BITS", f"{t.bump_bits}u", "and those of it below a step of the plays' input"),
        ]
    return arrays, numbers


@dataclass(frozen=True)
class Shape:
    """What decides on functions and memory of a chain beside its blocks: `effects`: it has any; `corners`: engine
    corners, `taps`: samples of the reference that are summed, `waiting`: drives that wait; the others as in `Variant`.
    """

    fixed: bool
    effects: bool = False
    corners: bool = False
    slew: bool = False
    braked: bool = False
    quiet: bool = False
    turning: bool = False
    taps: int = 0
    waiting: int = 0

    @classmethod
    def of(cls, t: ChainTables) -> Shape:
        """That of a model with effects."""
        return cls(
            t.fixed, True, t.plays.engine == slots.CORNERS, bool(t.slew), bool(t.braked), bool(t.quiet),
            bool(t.turning), len(t.tap), t.of("delay").samples,
        )  # fmt: skip


@dataclass(frozen=True)
class Glue:
    """The operators of a model with effects: the memory of an instance and the text of its type by operator, functions,
    tables, which functions of the interface it has beside those of every model, and the numbers that functions name."""

    fields: dict[str, list[Field]]
    states: dict[str, str]
    functions: str
    arrays: list[str]
    beside: list[str]
    calls: dict[str, list[str]]
    constants: list[tuple[str, str, str]]


def glue(compiled: Compiled, operators: Sequence[str], prefix: str, behind: Sequence[dict[str, Any]]) -> Glue:
    """The glue of a model; `behind`: its stages of saturation as `numbers.stage` has them."""
    from hystgen.compensator.chain import blocks, moving
    from hystgen.compensator.chain.layout import DITHER

    t = compiled.tables
    shape = Shape.of(t)
    named = {op: sides(t, op) for op in operators}
    clocks = [Block(constants, "clock") for constants in blocks.clocks(t)]
    rubbing = [
        Block(constants, f"{constants.kind.name}_{i}") if constants else None
        for i, constants in enumerate(blocks.rubbing(t), 1)
    ]
    functions = [
        line for op in operators for line in _functions(op, shape, *named[op], behind, clocks, rubbing)
    ]
    heated = ["set_temperature"] * ("set_temperature" in t.calls)
    aged = ["set_gain", "travel", "set_travel"] * ("travel" in t.calls)
    every = ["settle", "set_offset", *heated, *aged]
    calls = {
        "forward": every,
        "inverse": [*every, "expected", "correct", *(["push"] * (len(t.tap) > 0))],
    }
    beside = [*(each for each in rubbing if each), *clocks]
    own = {op: [*before, *after, *beside] for op, (before, after) in named.items()}
    largest = max(own.values(), key=len)  # the forward operator has what the inverse has, and modes
    arrays = [text for block in largest for text in block.arrays(prefix)]
    if "forward" in operators and t.of("delay").samples and t.fixed:
        share = _entries(t.of("delay").share, "f")[1:-1]
        arrays.append(f"static const {prefix}_factor_t {prefix}_waited = {{{share}}};\n")
    if "inverse" in operators and len(t.tap):
        arrays.append(
            constant(f"{prefix}_factor_t {prefix}_tap[{len(t.tap)}]", [f"    {_entries(row, 'f')}," for row in t.tap])
            if t.fixed else table(f"{prefix}_real_t", f"{prefix}_tap", list(t.tap))
        )  # fmt: skip
    names = ("OUTPUT_OFFSET", "FARTHEST_OFFSET", "SLEW_RISING", "SLEW_FALLING", "SLEW_RISING_REST", "SLEW_FALLING_REST")
    number = dict(zip(names, t.number, strict=False))
    words = {
        "OUTPUT_OFFSET": "part of every displacement",
        "FARTHEST_OFFSET": "largest that can be set beside it",
        "SLEW_RISING": "largest move of the drive in a step",
        "SLEW_FALLING": "",
        "SLEW_RISING_REST": "and what rounding took from that",
        "SLEW_FALLING_REST": "",
    }
    constants = [(name, operand(value), words[name]) for name, value in number.items()]
    constants += [("LEAD", operand(row[-1]), "samples that references come ahead") for row in t.of("clock")]
    waited = t.of("delay")
    constants.append(("WAITING", f"{waited.samples}u", "samples of the drive that wait"))
    if waited.samples and not t.fixed:
        constants.append(("WAITED", operand(waited.share[0]), "part of the step after the oldest that is over"))
    constants.append(("QUIET", f"{t.quiet}u", "equal references after which the drive stands still"))
    constants.append(("DITHER", operand(t.number[DITHER]), "signal by which a drive at rest goes to and fro"))
    constants.append(("TAPS", f"{len(t.tap)}u", "samples of the reference that are summed"))
    constants += _fixed_constants(t) if t.fixed else []
    if t.moving.used:
        more, numbers = (
            _fixed_moving(t.moving, prefix, "inverse" in operators)
            if isinstance(t.moving, moving.FixedMovingTables) else _moving(t.moving, prefix)
        )  # fmt: skip
        arrays, constants = arrays + more, constants + numbers
    searched = t.moving.used and not t.moving.scanned
    n = len(t.threshold) - 1
    kept = n * (t.moving.moves == moving.DASHPOT)
    fields = {op: instance(op, shape, own[op], n, kept, searched) for op in operators}
    return Glue(
        fields,
        {op: _state(op, fields[op]) for op in operators},
        "\n".join(functions), arrays, [text for stage in behind for text in stage["arrays"]], calls, constants,
    )  # fmt: skip


def alone(operators: Sequence[str], plays: int, fixed: bool) -> Glue:
    """The glue of a model without effects in engine loop: a chain without blocks."""
    shape = Shape(fixed)
    functions = [line for op in operators for line in _functions(op, shape, (), (), (), (), ())]
    fields = {op: instance(op, shape, (), plays, 0, False) for op in operators}
    return Glue(fields, {op: _state(op, fields[op]) for op in operators}, "\n".join(functions), [], [], {}, [])


def with_fields(made: Glue, named: Mapping[str, Collection[str]]) -> Glue:
    """The glue with the fields alone that the functions of each operator name."""
    fields = {op: [each for each in found if each.name in named[op]] for op, found in made.fields.items()}
    return replace(made, fields=fields, states={op: _state(op, found) for op, found in fields.items()})


def _fixed_constants(t: ChainTables) -> list[tuple[str, str, str]]:
    """Numbers that functions name in fixed point alone."""
    from hystgen.compensator.chain.layout import (
        ARRIVING_BITS,
        BRAKED_DROP,
        DRIVE_BITS,
        LARGEST_LEVEL,
        LEAST_CODE,
        LEVEL_BITS,
        LEVEL_DROP,
        MOST_CODE,
        SHARE_BITS,
    )

    low, high = t.plays.limits[slots.DRIVE_MIN : slots.DRIVE_MAX + 1]
    return [
        ("FINE_MIN", operand(low), "what the ends of the drive's range are in front of the plays"),
        ("FINE_MAX", operand(high), ""),
        ("LEAST_CODE", operand(t.number[LEAST_CODE]), "between which a drive is kept before it is limited"),
        ("MOST_CODE", operand(t.number[MOST_CODE]), ""),
        ("DRIVE_BITS", f"{t.number[DRIVE_BITS]}u", "bits of a signal in front of the plays below a drive code"),
        ("ARRIVING_BITS", f"{t.number[ARRIVING_BITS]}u", "and below an input of the plays"),
        ("LEVEL_BITS", f"{t.number[LEVEL_BITS]}u", "bits of a signal behind the plays below an output code"),
        ("LEVEL_DROP", f"{t.number[LEVEL_DROP]}u", "and those that a sum of the plays has beyond that"),
        ("LARGEST_LEVEL", operand(t.number[LARGEST_LEVEL]), "sum that is asked of the plays"),
        ("SHARE_BITS", f"{t.number[SHARE_BITS]}u", "bits of a mantissa below a code"),
        ("BRAKED_DROP", f"{t.number[BRAKED_DROP]}u", "bits of a signal beyond those of a search for a lead"),
    ]


_PLAYS = "play 0 is the input of the plays"
_KEPT = "; behind them what each has lost"
_LAST = "the same, limited: the next reference moves up or down from here"


def instance(op: str, t: Shape, blocks: Sequence[Block], plays: int, kept: int, moving: bool) -> list[Field]:
    """The memory of one operator, field by field."""
    inverse, taps = op == "inverse", t.taps
    waiting = 0 if inverse else t.waiting
    arrived = Field("fine", "drive", "what arrived of it in front of the plays")
    return [
        *([Field("real", "pending", "drive sent but not yet part of the memory")] if inverse else []),
        Field("real", "applied", "drive seen last"),
        *([Field("ramp", "reached", "drive at a limited rate")] if t.slew else []),
        arrived if t.effects else Field("real", "drive", "seen last"),
        *([Field("real", "reference", "of the last step"), Field("real", "last", _LAST)] if inverse else []),
        Field("signal", "level", "sum of the plays"),
        Field("signal", "output", "what the output side made of it"),
        Field("real", "answer", f"{'drive' if inverse else 'displacement' if t.effects else 'output'} returned last"),
        Field("signal", "offset", "set beside that of the model"),
        *(field for block in blocks for field in block.fields),
        *([Field("quiet", "quiet", members="wwi" if t.fixed else "rri")] if inverse and t.quiet else []),
        *([Field("steady", "steady", members="ww" if t.fixed else "rr", flags=1)] if inverse and t.turning else []),
        *([Field("signal", "line", "references, the newest one last", taps)] if inverse and taps else []),
        *([Field("real", "waiting", "drives", waiting), Field("status", "oldest", "of them")] if waiting else []),
        Field("flag", "ascending", "direction of the drive's last move"),
        Field("flag", "moving", "a drive was applied"),
        *([Field("flag", "has_pending"), Field("flag", "repeat", "the last answer still stands for `reference`"),
           Field("flag", "stepped", "a step has answered")] if inverse else []),
        *([Field("flag", "filled", "there are references"), Field("status", "bits", "of the last step")] if inverse
          else []),
        Field("status", "status"),
        *(_corners(t, inverse, plays) if t.corners
          else [Field("play", "play", _PLAYS + _KEPT * (kept > 0), plays + 1 + kept,
                      length="" if kept else "HYSTGEN_N_PLAYS + 1")]),
        *([Field("signal", "bent", "what each contributes", plays + 1)] if moving else []),
    ]  # fmt: skip


def _corners(t: Shape, inverse: bool, plays: int) -> list[Field]:
    """The memory of the plays of engine corners."""
    sought = [Field("flag", "sought", "a solution has been found since the plays followed")] * inverse
    if not t.fixed:
        undo = [Field("place", "undo", "where the plays were before the solution")] * inverse
        return [*sought, Field("plays", "plays"), *undo, Field("corner", "corner", "", plays + 1)]
    return [
        *sought,
        Field("place", "here"),
        Field("signal", "next", "output, along the move, at which another play begins to follow"),
        Field("kink", "kink", "of the present step; here rather than on the stack"),
        Field("corner", "corner", "", max(plays, 1)),
    ]  # fmt: skip


def _state(op: str, fields: Sequence[Field]) -> str:
    """The type of an instance."""
    words = "reference in, drive out" if op == "inverse" else "drive in, displacement out"
    top = f"/* One {op} operator: {words}. Plain data, owned by the caller. */"
    body = "\n".join(f"    {field.text()}" for field in fields)
    return f"{top}\ntypedef struct {{\n{body}\n}} hystgen_{op}_t;\n"


def _function(comment: str, head: str, lines: Sequence[str]) -> str:
    body = "\n".join(f"    {line}" for line in lines)
    return f"/* {comment} */\n{head} {{\n{body}\n}}\n"


def _functions(
    op: str,
    t: Shape,
    before: Sequence[Block],
    after: Sequence[Block],
    behind: Sequence[dict[str, Any]],
    clocks: Sequence[Block],
    rubbing: Sequence[Block | None],
) -> Iterator[str]:
    """The functions of one operator that name the blocks."""
    inverse, ahead = op == "inverse", t.taps > 0
    self_t = f"hystgen_{op}_t *self"
    apart = "HYSTGEN_APART" if t.fixed else "static"  # its products of 64 bits stay off the stack of what calls it

    def through(
        blocks: Sequence[Block], verb: str, x: str, side: str, comment: str, more: Sequence[str] = (),
        first: Sequence[str] = (),
    ) -> str:
        lines = [*first, *(f"{x} = {block.call(verb, x)};" for block in blocks), *more]
        last = f"return {x};"
        if blocks and not more:
            last = lines.pop().replace(f"{x} =", "return", 1)
        head = f"static hystgen_signal_t hystgen_{op}_{side}_{verb}({self_t}, hystgen_signal_t {x})"
        return _function(comment, head, [*lines, last])

    quiet = inverse and bool(t.quiet)
    rest, absorb = (["hystgen_quiet_rest(&self->quiet, v);"], ["self->quiet.arrived = v;"]) if quiet else ([], [])
    turning = inverse and bool(t.turning)
    place = f"self->{before[0].name}{'.lag' * t.braked}" if turning else ""
    first: list[str] = []
    if turning:
        rest = ["hystgen_steady_rest(&self->steady);"]
        first = [] if t.fixed else [f"const hystgen_signal_t before = {place}.high;"]
        absorb = [f"hystgen_steady_absorb(&self->steady{'' if t.fixed else f', &{place}, before'});"]
    yield through(before, "rest", "v", "drive_side", "Settles at drive v. Returns what is in front of the plays.", rest)
    yield through(
        before, "absorb", "v", "drive_side", "Drive v at this sample. Returns what is in front of the plays.", absorb,
        first,
    )  # fmt: skip
    yield through(after, "rest", "h", "output_side", "Settles at the sum h of the plays. Returns the output.")
    yield through(after, "absorb", "h", "output_side", "The sum of the plays is h at this sample. Returns the output.")
    if inverse:
        back = list(reversed(before)), list(reversed(after))
        leads = "The drive that leads to a in front of the plays."
        if turning:
            (block,) = before
            yield _function(
                "What the lag misses of a way in front of the plays in its first sample.",
                "static hystgen_signal_t hystgen_inverse_missed(hystgen_signal_t way)",
                [f"return hystgen_steady_missed({block.table}, way);"],
            )
            lines = [
                "bool rises = self->ascending;",
                "if (a > self->drive) {",
                "    rises = true;",
                "} else if (a < self->drive) {",
                "    rises = false;",
                "}",
                f"return hystgen_steady_{'braked' if t.braked else 'solve'}(&self->steady, {block.table}, "
                f"&self->{block.name}, a, rises,",
                "    hystgen_drive_signal(self->applied), HYSTGEN_DITHER);",
            ]
            head = f"HYSTGEN_APART hystgen_signal_t hystgen_inverse_drive_side_solve({self_t}, hystgen_signal_t a)"
            yield _function(f"{leads} The lag arrives from the side of its branch.", head, lines)
        elif quiet:
            lines = ["hystgen_signal_t v = a;", *(f"v = {block.call('solve', 'v')};" for block in back[0])]
            lines.append("return hystgen_quiet_drive(&self->quiet, a, v, self->applied);")
            head = f"static hystgen_signal_t hystgen_inverse_drive_side_solve({self_t}, hystgen_signal_t a)"
            yield _function(leads, head, lines)
        else:
            yield through(back[0], "solve", "a", "drive_side", leads)
        yield through(back[1], "solve", "y", "output_side", "The sum of the plays that gives y at this sample.")
        yield through(back[1], "resting", "y", "output_side", "The sum of the plays that gives y at rest.")
    lines = ["hystgen_signal_t x = y;"] if behind else []
    x = "x" if behind else "y"
    lines += [f"x = hystgen_{stage['kind']}_forward({stage['table']}, x);" for stage in behind]
    offsets = "HYSTGEN_OUTPUT_OFFSET + self->offset" if t.effects else "HYSTGEN_OFFSET"

    def drifts(lead: str) -> str:
        return "".join(f" + hystgen_clock_drift({each.table}, &self->{each.name}, {lead})" for each in clocks)

    def total(more: str) -> str:
        return f"({offsets}{more})" if t.effects else offsets

    yield _function(
        "Sum of the plays.", f"static hystgen_signal_t hystgen_{op}_level(const {self_t})",
        ["return self->level;" if t.effects else "return hystgen_loop_output(&hystgen_model_tables, self->play);"],
    )  # fmt: skip
    yield _function(
        "What the output side has given last.", f"static hystgen_signal_t hystgen_{op}_output(const {self_t})",
        ["return self->output;" if after else f"return hystgen_{op}_level(self);"],
    )  # fmt: skip
    own = apart if behind or clocks else "static"
    yield _function(
        "The displacement for an output y of the chain.",
        f"{own} hystgen_signal_t hystgen_{op}_displaced(const {self_t}, hystgen_signal_t y)",
        [*lines, f"return {x} + {total(drifts('0'))};"],
    )
    if inverse:
        lead = f"self->filled ? self->{clocks[0].name}.lead : 0" if clocks and ahead else "0"
        lines = [f"const hystgen_signal_t lead = {lead};"] * len(clocks)
        counted = ["hystgen_quiet_count(&self->quiet, u);"] * quiet
        y = f"u - {total(drifts('self->moving ? lead + 1 : lead'))}"
        lines += counted
        if behind:
            lines.append(f"hystgen_signal_t y = {y};")
        for stage in reversed(behind):
            y = f"hystgen_{stage['kind']}_inverse({stage['table']}, y{stage['limited']})"
            lines.append(f"y = {y};")
        lines = lines[: len(lines) - bool(behind)]
        yield _function(
            "The output of the chain that gives the displacement u; `limited` tells whether none does.",
            f"static hystgen_signal_t hystgen_inverse_undisplaced({'' if quiet else 'const '}{self_t}, "
            "hystgen_signal_t u, bool *limited)",
            [*lines, f"return {y};"],
        )
        put = [
            line for each in clocks
            for line in (f"const hystgen_signal_t lead = self->filled ? self->{each.name}.lead + 1 : 1;",
                         f"self->{each.name}.lead = lead > HYSTGEN_LEAD ? HYSTGEN_LEAD : lead;")
        ]  # fmt: skip
        put.append("hystgen_preview_put(self->line, &self->filled, y);")
        yield _function(
            "What has to be given now for the newest reference, y once it is undisplaced.",
            f"static hystgen_signal_t hystgen_inverse_ahead({self_t}, hystgen_signal_t y)",
            [*put, "return hystgen_preview_target(hystgen_tap, self->line);"] if ahead
            else ["return y;"],
        )
        yield _function(
            "No new reference: the newest one once more.",
            f"static void hystgen_inverse_repeat({self_t})",
            ["hystgen_preview_repeat(self->line, &self->filled);"] if ahead else [],
        )  # fmt: skip
    gains = [block for block in after if block.kind.name == "gain"]
    ageing = [block for block in after if block.kind.name == "ageing"]
    heat = [block for block in after if block.kind.name == "heat"]
    rubs = [block for block in rubbing if block]
    warming = ["hystgen_heat_way(self->applied, v)" if each is None else each.warming() for each in rubbing]
    way = "(hystgen_signal_t)v - self->applied"
    yield _function(
        "Offset and gains of the parameter file.",
        f"static void hystgen_{op}_settings_init({self_t})",
        [
            *(["self->offset = 0;"] if t.effects else []),
            *(["self->reached.drive = 0;", "self->reached.rest = 0;"] if t.slew else []),
            *(["hystgen_delay_rest(self->waiting, &self->oldest, 0);"] if t.waiting and not inverse else []),
            *(f"hystgen_clock_start(&self->{each.name});" for each in clocks),
            *(f"self->{each.name}.lead = 0;" for each in clocks),
            *(f"hystgen_heat_init(&self->{each.name});" for each in heat),
            *(f"hystgen_friction_init(&self->{each.name});" for each in rubs),
            *(f"hystgen_gain_init(&self->{block.name});" for block in gains),
            *(f"(void)hystgen_ageing_set_travel({each.table}, &self->{each.name}, 0);" for each in ageing),
        ],
    )
    yield _function(
        "The drive moves to v from where it was, in one sample.",
        f"{apart if clocks or heat or ageing else 'static'} void hystgen_{op}_travelled({self_t}, hystgen_real_t v)",
        [
            *(f"hystgen_clock_tick({each.table}, &self->{each.name});" for each in clocks),
            *(
                f"hystgen_heat_move({each.table}, &self->{each.name}, {amount});"
                for each, amount in zip(heat, warming, strict=True)
            ),
            *(f"hystgen_ageing_move({each.table}, &self->{each.name}, {way});" for each in ageing),
        ],
    )
    yield _function(
        "Drift begins anew, at the drive absorbed last.",
        f"static void hystgen_{op}_clock_start({self_t})",
        [f"hystgen_clock_start(&self->{each.name});" for each in clocks],
    )
    heats = [f"hystgen_gain_heat({block.table}, &self->{block.name}, temperature)" for block in gains]
    yield _function(
        "Gains and offsets of a temperature. Returns whether it had to be limited.",
        f"static bool hystgen_{op}_heat({self_t}, hystgen_real_t temperature)",
        ["bool limited = false;", *(f"limited = {heat} || limited;" for heat in heats), "return limited;"]
        if heats else ["return false;"],
    )  # fmt: skip
