"""The cost of an emitted model, derived from the model alone, so that it is the same on every machine."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from hystgen.chain.static import StaticModel
from hystgen.compensator import engines
from hystgen.compensator.layout import FixedTables, Tables
from hystgen.emission.compensator import AnyTables, ConstantTable
from hystgen.emission.options import Options
from hystgen.emission.runtime import LANGUAGE, Family, Field, Piece
from hystgen.plays import slots

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import ChainTables
    from hystgen.effects.plays import FixedMovingTables, MovingTables


@dataclass(frozen=True)
class Layout:
    """The data layout of a target: sizes of `int` and of pointers, and whether data are packed without alignment."""

    integer: int
    pointer: int
    packed: bool

    def struct(self, *fields: tuple[int, int]) -> tuple[int, int]:
        """Size and alignment of a C struct whose fields have these sizes and alignments."""
        if self.packed:
            return sum(size for size, _ in fields), 1
        at, most = 0, 1
        for size, alignment in fields:
            at = -(-at // alignment) * alignment + size
            most = max(most, alignment)
        return -(-at // most) * most, most


WATCH = "health"
"""The watch over the model's error among the instances."""

CORE_32 = Layout(integer=4, pointer=4, packed=False)
AVR = Layout(integer=2, pointer=2, packed=True)


@dataclass(frozen=True)
class MemoryBytes:
    """Bytes of the constant tables and of an instance of each operator; `play`: bytes that each play adds to both."""

    tables: int
    instances: list[tuple[str, int]]
    play: int

    @property
    def all(self) -> int:
        """Bytes of the tables and of one instance of each operator."""
        return self.tables + sum(size for _, size in self.instances)


@dataclass(frozen=True)
class Cost:
    """Code size of the module by core (`hystgen.compensator.engines`); memory on a 32-bit target, and on an 8-bit AVR,
    where tables lie in RAM too (None in float64, which an AVR lacks); and for each operator the worst-case operations
    of a step in words, and the most expensive sample of similar models on each core."""

    code: Mapping[str, int]
    memory: MemoryBytes
    avr: MemoryBytes | None
    worst_case: list[tuple[str, str]]
    dearest: Mapping[str, Mapping[str, engines.Dearest]]

    @property
    def code_words(self) -> str:
        """The code size in words."""
        small, large = (self.code[core] for core in engines.CORES)
        return f"{small} bytes on a Cortex-M0+, {large} on a Cortex-M4F"

    def dearest_words(self, operator: str) -> str:
        """The most expensive sample of an operator in words."""
        small, large = (self.dearest[operator][core] for core in engines.CORES)
        return (
            f"{small.instructions} instructions and {small.stack} bytes of stack on a Cortex-M0+, "
            f"{large.instructions} and {large.stack} on a Cortex-M4F"
        )


Size: TypeAlias = tuple[int, int]
"""Size and alignment of a type."""


def sizes(pieces: Iterable[Piece], family: Family, layout: Layout, lengths: Mapping[str, int]) -> dict[str, Size]:
    """Sizes of a model's types, by their names without prefix, taken from their declarations.

    `pieces`: ordered so that a type comes before those that contain it; `lengths`: values of macros in array lengths.
    """
    plain = {**LANGUAGE, "unsigned int": layout.integer}
    plain |= {name: LANGUAGE[kind] for name, kind in {"real_t": family.real, **family.types}.items()}
    found = {name: (size, size) for name, size in plain.items()}

    def field(member: Field) -> Size:
        if "*" in member.kind:
            return layout.pointer, layout.pointer
        size, alignment = found[family.meaning(member.kind)]
        return size * _length(member.length, lengths), alignment

    for piece in pieces:
        if members := piece.members:
            whole = [field(each) for each in members if not each.bits]
            if bits := sum(each.bits for each in members):  # bit fields are packed into bytes at the end
                whole.append((-(-bits // 8), min(-(-bits // 8), layout.integer)))
            found[piece.name.removeprefix("hystgen_")] = layout.struct(*whole)
    return found


def _length(words: str, lengths: Mapping[str, int]) -> int:
    """The length of an array, a sum of numbers and macros; 1 without."""
    return sum(lengths[term] if term in lengths else int(term) for term in (words or "1").split(" + "))


def _constants(contents: Iterable[tuple[str, int]], known: Mapping[str, Size], family: Family, plays: int = 1) -> int:
    """Bytes of constants without padding between them; with `plays`, of one entry of tables that have one per play."""
    return sum(known[family.meaning(kind)][0] * (count // plays) for kind, count in contents)


@dataclass(frozen=True)
class Data:
    """The data of a model in memory: types, an instance of each operator, tables with an entry for each play, and all
    constants, including those of the run time."""

    family: Family
    types: Sequence[Piece]
    plays: Sequence[ConstantTable]
    constants: Sequence[tuple[str, int]]


def estimate(cascade: StaticModel, options: Options, numbers: AnyTables, data: Data) -> Cost:
    """Cost of the emitted model, including the parts of a shared run time that it needs."""
    corners = options.engine == "corners"
    known = options.arithmetic != "float64"  # on an AVR, a double is only a float
    worst = [(op, worst_case(cascade.pi.n, op, corners, numbers)) for op in options.operators]
    memory, avr = (_memory(cascade.pi.n, options, data, layout) for layout in (CORE_32, AVR))
    code = dict(engines.code_bytes(cascade, options.operator, options.arithmetic, options.engine))
    parts: dict[str, list[str]] = {}
    if not isinstance(numbers, Tables | FixedTables):
        from hystgen.compensator.chain import costs

        parts = {op: costs.found(numbers, op) for op in options.operators}
        products = chain_products(numbers)
        worst = [(op, f"{words}; effects: {products[op]} multiplications") for op, words in worst]
        for op in options.operators:
            more = costs.code_bytes(numbers, options.arithmetic, op)
            code = {core: size + more[core] for core, size in code.items()}
    dearest = {
        op: engines.dearest(cascade, op, options.arithmetic, options.engine, parts.get(op)) for op in options.operators
    }
    return Cost(code, memory, avr if known else None, worst, dearest)


def selftest_bytes(
    real: int, fixed: bool, memory: MemoryBytes, samples: int, codes: int, windows: int, layout: Layout
) -> tuple[int, int]:
    """Bytes of a self-test's samples, with `real` bytes per number, of its pairs of codes and of its windows; bytes of
    the instances, one of which its operators share."""
    number, whole, answers = (real, real), (layout.integer, layout.integer), ((4, 4), (8, 8))
    sample, _ = layout.struct((1, 1), number, number, whole)
    window, _ = layout.struct(number, number, number, whole, *(answers if fixed else (number, number)))
    shared = max(size for each, size in memory.instances if each != WATCH)
    return samples * sample + 8 * codes + windows * window, shared + dict(memory.instances).get(WATCH, 0)


@dataclass(frozen=True)
class Counts:
    """Operations of a kind of arithmetic, counted in the bit-exact reference (`tests/test_cost.py`) and rounded up as
    if every search bisected its whole list.

    `factor`: multiplications in a product with a factor; `words`: qualify a multiplication; `plays`:
    multiplications, comparisons, and further comparisons per play and per bit of n, for plays, checks and limits, by
    operator and engine, where `fast` is the corner engine without a front; `both`: the same for corners that are solved
    and then follow an applied drive that may differ; `solved`: multiplications per play for an inverse in the loop
    engine; `chained`: multiplications and comparisons for an inverse with effects, and both per play; `braked`:
    multiplications for a lag behind a slew limit, and those per halving in its search.
    """

    factor: int
    words: str
    plays: Mapping[tuple[str, str], tuple[int, int, int, int]]
    both: tuple[int, int, int, int]
    solved: int
    chained: tuple[int, int, int, int]
    braked: tuple[int, int]


FLOAT = Counts(
    1, "",
    {("forward", "loop"): (1, 7, 2, 0), ("inverse", "loop"): (3, 14, 3, 0),
     # the sign of a move costs a multiplication too; up to eight plays are tried one by one before either search
     ("forward", "corners"): (17, 18, 0, 2), ("inverse", "corners"): (28, 26, 0, 4),
     ("forward", "fast"): (17, 18, 0, 2), ("inverse", "fast"): (17, 18, 0, 2)},
    both=(34, 27, 0, 4), solved=3, chained=(4, 17, 4, 3), braked=(7, 2),
)
FIXED = Counts(
    2, " of 32 by 32 bits",
    {("forward", "loop"): (1, 11, 2, 0), ("inverse", "loop"): (3, 14, 3, 0),
     # bisection of the corners, then of the plays in a block; clamps, rounding to a code, looking ahead; a corner's
     # output is the sum of its parts, for the top corner and the one below it
     ("forward", "corners"): (1, 15, 0, 2), ("inverse", "corners"): (5, 19, 0, 4),
     ("forward", "fast"): (1, 15, 0, 2), ("inverse", "fast"): (7, 22, 0, 4)},
    both=(7, 25, 0, 4), solved=2, chained=(4, 21, 3, 3), braked=(13, 1),
)


def _counts(t: AnyTables) -> Counts:
    return FIXED if isinstance(t if isinstance(t, Tables | FixedTables) else t.plays, FixedTables) else FLOAT


def _refined(t: ChainTables) -> bool:
    """Whether an inverse's solution has a remainder, which requires another search."""
    return isinstance(t.plays, FixedTables) and bool(t.number.arriving_bits[0])


def chain_products(t: ChainTables) -> dict[str, int]:
    """Multiplications per step in the blocks in front of the plays and behind them, for each operator."""
    from hystgen.compensator.chain import blocks
    from hystgen.compensator.chain.parts import LED, PARTS

    counts, kinds = _counts(t), t.behind.kinds
    envelopes = kinds.count(slots.TANH)
    stages = counts.factor * (len(kinds) - envelopes) + envelopes * t.behind.products
    everything, inverse = blocks.every(t, "forward"), blocks.every(t, "inverse")
    forward = sum(each.products[0] for each in everything) + counts.factor * bool(t.of("wait").samples)
    both = sum(sum(each.products) for each in inverse)
    once, halving = counts.braked
    found = PARTS[LED].floating.verbs.led
    led = t.braked * (once + halving * (found.halves if found else 0)) + counts.factor * (t.turning + len(t.tap))
    return {"forward": forward + stages, "inverse": both + led + stages}


def _memory(n: int, options: Options, data: Data, layout: Layout) -> MemoryBytes:
    lengths = {"HYSTGEN_N_PLAYS": n, "HYSTGEN_CORNERS": data.family.corners(n)}
    known = sizes(data.types, data.family, layout, lengths)
    a_play, _ = known["corner_t" if options.engine == "corners" else data.family.meaning("play_t")]
    of_plays = [each for table in data.plays for each in table.contents]
    instances = [(op, known[f"{op}_t"][0]) for op in (*options.operators, *[WATCH] * options.health)]
    more = _constants(of_plays, known, data.family, n + 1) + a_play * len(options.operators)
    return MemoryBytes(_constants(data.constants, known, data.family), instances, more)


def worst_case(n: int, op: str, corners: bool, tables: AnyTables) -> str:
    """The maximum number of multiplications and comparisons in one step, as functions of n and its number of bits b,
    without those of tanh, atanh and effects."""
    numbers: Tables | FixedTables = tables if isinstance(tables, Tables | FixedTables) else tables.plays
    counts, passes, curves = _counts(tables), 1 if op == "forward" else 2 + int(numbers.branches), 0
    engine = "loop" if not corners else "corners" if numbers.has_front else "fast"
    products, compares, per_play, per_bit = counts.plays[op, engine]
    per_play_products = 0 if corners else 1 if op == "forward" else counts.solved
    if not isinstance(tables, Tables | FixedTables) and not corners:
        products, per_play_products, compares, per_play, curves = _worst_of_chain(op, tables)
    elif not isinstance(tables, Tables | FixedTables) and op == "inverse":
        refined = _refined(tables)
        products, compares, per_play, per_bit = counts.both
        products, compares, per_bit = products + 2 * refined, compares + 10 * refined, per_bit + 2 * refined
    compares += (2 if op == "forward" else 16) * int(bool(numbers.branches))
    envelopes = 0
    if isinstance(numbers, Tables):
        for kind, size in zip(map(int, numbers.stage_kind), map(int, numbers.stage_size), strict=True):
            envelopes += kind == slots.TANH
            products += passes if kind == slots.DEAD_ZONE else 2 * passes
            compares += passes * size.bit_length() if kind == slots.DEAD_ZONE else 2 * passes
    elif numbers.fronts:
        products += passes * numbers.coefficient.shape[1]
        compares += passes * (int(max(numbers.pieces)).bit_length() + 2)
    kernels = f", {envelopes} tanh" if envelopes else ""
    if envelopes and op == "inverse":
        kernels += f", {envelopes * (1 + int(numbers.branches))} atanh"
    if curves:
        kernels += f", {curves * n} tanh of plays"
    words = f"{products + per_play_products * n} multiplications{counts.words}"
    if per_play_products:
        words += f" ({products} + {per_play_products} n)"
    words += f", {compares + per_play * n + per_bit * n.bit_length()} comparisons"
    if per_bit:
        words += f" ({compares} + {per_bit} b, b = {n.bit_length()}, the bit length of n)"
    elif per_play:
        words += f" ({compares} + {per_play} n)"
    return words + kernels


def _worst_of_chain(op: str, t: ChainTables) -> tuple[int, int, int, int, int]:
    """Operations of the plays of a model with effects in the loop engine: multiplications, further ones per play,
    comparisons, further ones per play, and tanh per play.

    Ordinary plays follow and are solved one by one. Plays that an effect moves or bends require a search, in which
    each try sums all of them and, in floating point, also computes the slope of the sum.
    """
    from hystgen.effects import plays

    m, counts, inverse = t.moving, _counts(t), op == "inverse"
    factor, more = counts.factor, counts.factor - 1  # one more comparison if a product with a factor has two parts
    if not m.used or m.scanned:
        if not inverse:
            return 1, 1 + 2 * factor * m.scanned, 11 + 2 * more, 4 + 2 * more if m.scanned else 2, 0
        refined = _refined(t)
        products, compares, per_play, looked = counts.chained
        per_play, looked = per_play + 2 * factor * m.scanned, looked + (3 + more) * m.scanned
        return products + 2 * refined, per_play + refined, compares + 12 * refined, looked + 3 * refined, 0
    yields = len(m.yields).bit_length() + 3 + 2 * more
    moved, kept = {
        plays.DILATED: ((factor, 3 + more), (0, 0)),
        plays.RELAXING: ((factor, 2 + more), (factor, 2 + more)),
        plays.DASHPOT: ((4 + factor, yields), (0, 0)),
    }.get(m.moves, ((0, 2), (0, 0)))
    bent, looked, tanh = _bent(m)
    # contributions computed per play: a second one if plays relax (at rest) or, in fixed point, are plain (unmoved)
    twice = 1 + (m.moves == plays.RELAXING or (m.moves == plays.PLAIN and isinstance(m, plays.FixedMovingTables)))
    tries, beside = _tries(m) if inverse else (0, (0, 0))
    tried = 1 + moved[0] + bent, 1 + moved[1] + looked
    if isinstance(m, plays.MovingTables):  # a try also computes the slope
        sought = {plays.DILATED: (2, 4), plays.RELAXING: (1, 3), plays.DASHPOT: (6, yields)}.get(m.moves, (0, 2))
        tried = 3 + sought[0] + bent, sought[1]
    joined, turned = _elements(m)
    at, turns = tries + 1, 1 + inverse  # a drive other than that found may turn the elements once more
    return (
        tries + 1 + beside[0] + at * joined[0] + turns * turned[0],
        tries * tried[0] + moved[0] + kept[0] + twice * (1 + bent),
        beside[1] + 15 + 6 * inverse + at * joined[1] + turns * turned[1],
        tries * tried[1] + 2 + moved[1] + kept[1] + twice * looked,
        tanh * (tries + twice),
    )


def _elements(m: MovingTables | FixedMovingTables) -> tuple[tuple[int, int], tuple[int, int]]:
    """Multiplications and comparisons of the sum of elements in parallel with the plays, and of their turn."""
    from hystgen.effects import plays

    count, looked, tilted = len(m.elements.element), len(m.elements.piece).bit_length(), len(m.elements.tilt) > 0
    if isinstance(m, plays.FixedMovingTables):
        degree = m.elements.piece.up.shape[1]
        at = 2 * (degree + tilted) + 8, looked + 8  # five products in two parts, and a piece's slope with its mean
        put = degree * (degree + 7) // 2 + 5 + 4 * tilted, looked + 8 + 2 * tilted
    else:
        degree = m.elements.piece.up.shape[1]
        at = 2 * degree + 2 + tilted, looked + 2
        put = degree * (degree + 3) // 2 + 2 * tilted, looked + 2
    if not count:
        return (0, 0), (0, 0)
    return (count * at[0] + 1, count * at[1] + 6), (count * (at[0] + put[0]), count * (at[1] + put[1]))


QUOTIENT = (8, 17)
"""Multiplications and comparisons of a quotient."""


def _tries(m: MovingTables | FixedMovingTables) -> tuple[int, tuple[int, int]]:
    """Maximum number of tries in a search, and its multiplications and comparisons besides those of the sums."""
    from hystgen.effects import plays

    if isinstance(m, plays.FixedMovingTables):
        tries = 1 + plays.SECANTS + (2 * m.farthest + 1).bit_length()
        secant = QUOTIENT[0] + 2, QUOTIENT[1] + 8  # the rate's quotient, and the step at that rate
        return tries, (secant[0] * plays.SECANTS, secant[1] * plays.SECANTS + 8 * tries)
    tries = plays.NEWTON_TRIES + m.halves
    return tries, ((2 * m.turns + 1) * (plays.NEWTON_TRIES + 2) + tries, 5 * tries)


def _bent(m: MovingTables | FixedMovingTables) -> tuple[int, int, int]:
    """Multiplications, comparisons and tanh of a bend per play, in floating point including its slope."""
    from hystgen.effects import plays

    if m.bends == plays.STRAIGHT:
        return 0, 0, 0
    if isinstance(m, plays.FixedMovingTables):
        return m.bump.coefficient.shape[1], int(max(m.bump.pieces)).bit_length() + 5, 0
    if m.bends == plays.CENTRE:
        return 4, 0, 1
    return 2 * m.curve.shape[1] + 4, 0, 0
