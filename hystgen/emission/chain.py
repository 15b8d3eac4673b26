"""The glue of a model with effects in C: tables and memory of its blocks, and the order of their calls. The blocks
themselves are in `c_runtime/` and in the folders of effects.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hystgen.emission.compensator import Effects, Field, Form, Glue, Stage, Table, Writer, entries
from hystgen.emission.text import operand
from hystgen.plays import slots

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import ChainTables, Compiled
    from hystgen.effects.kinds import Constants, Kind

NUMBERS = {
    "OUTPUT_OFFSET": "part of every displacement",
    "FARTHEST_OFFSET": "largest that can be set beside it",
    "SLEW_RISING": "largest move of the drive in a step",
    "SLEW_FALLING": "",
    "SLEW_RISING_REST": "and what rounding took from that",
    "SLEW_FALLING_REST": "",
}
"""Macros of the first places of `ChainTables.number`."""


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
        found = [Field(f"{kind.name}_t", self.name)]
        if rows and (rows.state or rows.memory):
            found.append(Field(f"{kind.name}_state_t", f"{self.name}_state", count=len(self.constants.rows)))
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

    def tables(self, writer: Writer) -> list[Table]:
        """Its table, behind that of its rows where it has any."""
        kind, constants = self.kind, self.constants
        numbers = [entries(constants.table, kind.letters)] * (len(constants.table) > 0)
        numbers += map(str, constants.counts)
        if not kind.rows:
            return [writer.block(f"{kind.tabled}_table_t", self.name, numbers)]
        rows = [entries(row, kind.rows.letters) for row in constants.rows]
        of_rows = writer.rows(f"{kind.name}_{kind.rows.name}_t", f"{self.name}_{kind.rows.name}", rows, len(rows))
        return [of_rows, writer.block(f"{kind.name}_table_t", self.name, [of_rows.name, *numbers])]


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


@dataclass(frozen=True)
class Shape:
    """What decides on functions and memory of a chain beside its blocks: `effects`: it has any; `corners`: engine
    corners, `taps`: samples of the reference that are summed, `waiting`: drives that wait; the others as in `Variant`.
    """

    form: Form
    effects: bool = False
    corners: bool = False
    slew: bool = False
    braked: bool = False
    quiet: bool = False
    turning: bool = False
    taps: int = 0
    waiting: int = 0

    @classmethod
    def of(cls, t: ChainTables, form: Form) -> Shape:
        """That of a model with effects."""
        return cls(
            form, True, t.plays.engine == slots.CORNERS, bool(t.slew), bool(t.braked), bool(t.quiet),
            bool(t.turning), len(t.tap), t.of("wait").samples,
        )


@dataclass(frozen=True)
class Chain:
    """The blocks of a model with effects, by operator in front of the plays and behind, and those beside: its clock,
    and what rubs."""

    sides: Mapping[str, tuple[list[Block], list[Block]]]
    clocks: list[Block]
    rubbing: list[Block | None]

    @classmethod
    def of(cls, t: ChainTables, operators: Sequence[str]) -> Chain:
        """Those of a model."""
        from hystgen.compensator.chain import blocks

        rubbing = [
            Block(constants, f"{constants.kind.name}_{i}") if constants else None
            for i, constants in enumerate(blocks.rubbing(t), 1)
        ]
        return cls({op: sides(t, op) for op in operators}, [Block(each, "clock") for each in blocks.clocks(t)], rubbing)

    def blocks(self, operator: str) -> list[Block]:
        """Every block of an operator."""
        before, after = self.sides[operator]
        return [*before, *after, *(each for each in self.rubbing if each), *self.clocks]


def effects(
    compiled: Compiled, operators: Sequence[str], form: Form, behind: Sequence[Stage], writer: Writer
) -> Effects:
    """Tables and macros of a model's effects; `behind`: its stages of saturation."""
    from hystgen.compensator.chain.layout import DITHER

    t, chain = compiled.tables, Chain.of(compiled.tables, operators)
    largest = max(map(chain.blocks, operators), key=len)  # the forward operator has what the inverse has, and modes
    tables = [table for block in largest for table in block.tables(writer)]
    numbers = dict(zip(NUMBERS, t.number, strict=False))
    constants = [(name, operand(value), NUMBERS[name]) for name, value in numbers.items()]
    constants += [("LEAD", operand(row[-1]), "samples that references come ahead") for row in t.of("clock")]
    constants.append(("WAITING", f"{t.of('wait').samples}u", "samples of the drive that wait"))
    if t.of("wait").samples:
        waited, share = form.waited(t, writer)
        tables += waited * ("forward" in operators)
        constants += share
    if "inverse" in operators and len(t.tap):
        tables.append(form.tap(t, writer))
    constants += [
        ("QUIET", f"{t.quiet}u", "equal references after which the drive stands still"),
        ("DITHER", operand(t.number[DITHER]), "signal by which a drive at rest goes to and fro"),
        ("TAPS", f"{len(t.tap)}u", "samples of the reference that are summed"),
        *form.effects(t),
    ]
    if t.moving.used:
        moved, numbers_of_plays = form.moving(t, "inverse" in operators, writer)
        tables, constants = tables + moved, constants + numbers_of_plays
    return Effects(compiled, tuple(tables), tuple(each for stage in behind for each in stage.arrays), tuple(constants))


def glue(compiled: Compiled, operators: Sequence[str], form: Form, behind: Sequence[Stage]) -> Glue:
    """The glue of a model with effects."""
    from hystgen.compensator.chain import moving

    t, chain = compiled.tables, Chain.of(compiled.tables, operators)
    shape = Shape.of(t, form)
    functions = [
        line for op in operators
        for line in _functions(op, shape, *chain.sides[op], behind, chain.clocks, chain.rubbing)
    ]
    heated = ["set_temperature"] * ("set_temperature" in t.calls)
    aged = ["set_gain", "travel", "set_travel"] * ("travel" in t.calls)
    every = ["settle", "set_offset", *heated, *aged]
    calls = {"forward": every, "inverse": [*every, "expected", "correct", *(["push"] * (len(t.tap) > 0))]}
    searched = t.moving.used and not t.moving.scanned
    n = len(t.threshold) - 1
    kept = n * (t.moving.moves == moving.DASHPOT)
    fields = {op: instance(op, shape, chain.blocks(op), n, kept, searched) for op in operators}
    return Glue(fields, "\n".join(functions), calls)


def alone(operators: Sequence[str], plays: int, form: Form) -> Glue:
    """The glue of a model without effects in engine loop: a chain without blocks."""
    shape = Shape(form)
    functions = [line for op in operators for line in _functions(op, shape, (), (), (), (), ())]
    return Glue({op: instance(op, shape, (), plays, 0, False) for op in operators}, "\n".join(functions), {})


_PLAYS = "play 0 is the input of the plays"
_KEPT = "; behind them what each has lost"
_LAST = "the same, limited: the next reference moves up or down from here"


def instance(op: str, t: Shape, blocks: Sequence[Block], plays: int, kept: int, moving: bool) -> list[Field]:
    """The memory of one operator, field by field."""
    inverse, taps = op == "inverse", t.taps
    waiting = 0 if inverse else t.waiting
    arrived = Field("fine_t", "drive", "what arrived of it in front of the plays")
    answer = "drive" if inverse else "displacement" if t.effects else "output"
    length = "" if kept else "HYSTGEN_N_PLAYS + 1"
    searched = [Field("bool", "sought", "a solution has been found since the plays followed")] * inverse
    return [
        *[Field("real_t", "pending", "drive sent but not yet part of the memory")] * inverse,
        Field("real_t", "applied", "drive seen last"),
        *[Field("ramp_t", "reached", "drive at a limited rate")] * t.slew,
        arrived if t.effects else Field("real_t", "drive", "seen last"),
        *[Field("real_t", "reference", "of the last step"), Field("real_t", "last", _LAST)] * inverse,
        Field("signal_t", "level", "sum of the plays"),
        Field("signal_t", "output", "what the output side made of it"),
        Field("real_t", "answer", f"{answer} returned last"),
        Field("signal_t", "offset", "set beside that of the model"),
        *(field for block in blocks for field in block.fields),
        *[Field("quiet_t", "quiet")] * (inverse and t.quiet),
        *[Field("steady_t", "steady")] * (inverse and t.turning),
        *[Field("signal_t", "line", "references, the newest one last", taps)] * (inverse and taps > 0),
        *[Field("real_t", "waiting", "drives", waiting), Field("unsigned int", "oldest", "of them")] * (waiting > 0),
        Field("bool", "ascending", "direction of the drive's last move"),
        Field("bool", "moving", "a drive was applied"),
        *[
            Field("bool", "has_pending"),
            Field("bool", "repeat", "the last answer still stands for `reference`"),
            Field("bool", "stepped", "a step has answered"),
            Field("bool", "filled", "there are references"),
            Field("unsigned int", "bits", "of the last step"),
        ] * inverse,
        Field("unsigned int", "status"),
        *([*searched, *t.form.corners(inverse, plays)] if t.corners
          else [Field("play_t", "play", _PLAYS + _KEPT * (kept > 0), plays + 1 + kept, length)]),
        *[Field("signal_t", "bent", "what each contributes", plays + 1)] * moving,
    ]


def _function(comment: str, head: str, lines: Sequence[str]) -> str:
    body = "\n".join(f"    {line}" for line in lines)
    return f"/* {comment} */\n{head} {{\n{body}\n}}\n"


def _functions(
    op: str,
    t: Shape,
    before: Sequence[Block],
    after: Sequence[Block],
    behind: Sequence[Stage],
    clocks: Sequence[Block],
    rubbing: Sequence[Block | None],
) -> Iterator[str]:
    """The functions of one operator that name the blocks."""
    inverse, ahead = op == "inverse", t.taps > 0
    self_t = f"hystgen_{op}_t *self"
    apart = t.form.apart

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
        first = [f"const hystgen_signal_t before = {place}.high;"]
        absorb = [f"hystgen_steady_absorb(&self->steady, &{place}, before);"]
    yield through(before, "rest", "v", "drive_side", "Settles at drive v. Returns what is in front of the plays.", rest)
    yield through(
        before, "absorb", "v", "drive_side", "Drive v at this sample. Returns what is in front of the plays.", absorb,
        first,
    )
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
    lines += [f"x = hystgen_{stage.kind}_forward({stage.table}, x);" for stage in behind]
    offsets = "HYSTGEN_OUTPUT_OFFSET + self->offset" if t.effects else "HYSTGEN_OFFSET"

    def drifts(lead: str) -> str:
        return "".join(f" + hystgen_clock_drift({each.table}, &self->{each.name}, {lead})" for each in clocks)

    def total(more: str) -> str:
        return f"({offsets}{more})" if t.effects else offsets

    yield _function(
        "Sum of the plays.", f"static hystgen_signal_t hystgen_{op}_level(const {self_t})",
        ["return self->level;" if t.effects else "return hystgen_loop_output(&hystgen_model_tables, self->play);"],
    )
    yield _function(
        "What the output side has given last.", f"static hystgen_signal_t hystgen_{op}_output(const {self_t})",
        ["return self->output;" if after else f"return hystgen_{op}_level(self);"],
    )
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
            y = f"hystgen_{stage.kind}_inverse({stage.table}, y{stage.limited})"
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
        ]
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
        )
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
    )
