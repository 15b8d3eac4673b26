"""What an emitted model costs, derived from the model alone so that it is the same wherever it is emitted."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hystgen.arithmetic import ARITHMETICS, Arithmetic
from hystgen.chain.static import StaticModel
from hystgen.compensator import engines
from hystgen.compensator.layout import FixedTables, Tables
from hystgen.emission.chain import Field
from hystgen.emission.options import Options
from hystgen.emission.runtime import Piece
from hystgen.plays import slots

if TYPE_CHECKING:
    from hystgen.compensator.chain.layout import ChainTables
    from hystgen.effects.kinds import Kind, Rows


@dataclass(frozen=True)
class Layout:
    """How a target lays out data: sizes of `int` and of pointers; packed where nothing is aligned."""

    integer: int
    pointer: int
    packed: bool

    def struct(self, *fields: tuple[int, int]) -> tuple[int, int]:
        """Size and alignment of a C struct of fields of these sizes and alignments."""
        if self.packed:
            return sum(size for size, _ in fields), 1
        at, most = 0, 1
        for size, alignment in fields:
            at = -(-at // alignment) * alignment + size
            most = max(most, alignment)
        return -(-at // most) * most, most


CORE_32 = Layout(integer=4, pointer=4, packed=False)
AVR = Layout(integer=2, pointer=2, packed=True)


@dataclass(frozen=True)
class Memory:
    """Bytes of the constant tables and of an instance of each operator; `play`: bytes of both per additional play."""

    tables: int
    instances: list[tuple[str, int]]
    play: int

    @property
    def all(self) -> int:
        """Bytes of the tables and of one instance of each operator."""
        return self.tables + sum(size for _, size in self.instances)


@dataclass(frozen=True)
class Cost:
    """Code of the module by core (`hystgen.compensator.engines`), memory on a 32-bit target and on an 8-bit AVR, where
    tables lie in RAM too (None in float64, which it lacks), and for each operator worst-case operations of a step in
    words, and the dearest sample of such models on each core."""

    code: Mapping[str, int]
    memory: Memory
    avr: Memory | None
    worst_case: list[tuple[str, str]]
    dearest: dict[str, dict[str, engines.Dearest]]

    @property
    def code_words(self) -> str:
        """The code in words."""
        small, large = (self.code[core] for core in engines.CORES)
        return f"{small} bytes on a Cortex-M0+, {large} on a Cortex-M4F"

    def dearest_words(self, operator: str) -> str:
        """The dearest sample of an operator in words."""
        small, large = (self.dearest[operator][core] for core in engines.CORES)
        return (
            f"{small.instructions} instructions and {small.stack} bytes of stack on a Cortex-M0+, "
            f"{large.instructions} and {large.stack} on a Cortex-M4F"
        )


_SIZES = {"float": 4, "double": 8, "real_t": 0, "int32_t": 4, "uint32_t": 4, "uint16_t": 2, "uint8_t": 1, "int64_t": 8,
          "sum_t": 8, "play_t": 0, "uint_least16_t": 2, "uint_least8_t": 1}  # fmt: skip


_MEMBER = re.compile(r"(unsigned int|\w+) \w+((?:\[[^\]]+\])*)(?: : (\d+))?")


def declared(
    pieces: Iterable[Piece], arithmetic: Arithmetic, layout: Layout, lengths: Mapping[str, int]
) -> dict[str, tuple[int, int]]:
    """Sizes and alignments of the structures of `c_runtime/`, by their names without prefix, from their declarations.

    `pieces`: in an order in which a type stands before those that contain it; `lengths`: macros in lengths of arrays.
    """
    real = (arithmetic.bytes, arithmetic.bytes)
    play = (4, 4) if arithmetic.fixed else real
    reach = 2 * (arithmetic.reach_bytes,) if arithmetic.fixed else real
    found = {"real_t": real, "play_t": play, "reach_t": reach, "unsigned int": (layout.integer, layout.integer)}
    found |= {name: (size, size) for name, size in _SIZES.items() if size} | {"bool": (1, 1)}
    for piece in pieces:
        _, opened, members = piece.code.partition("{")
        if not opened or "typedef struct" not in piece.code:
            continue
        fields: list[tuple[int, int]] = []
        bits = 0
        for member in re.findall(r"[^;{}]+(?=;)", members.rpartition("}")[0]):
            if "*" in member:
                fields.append((layout.pointer, layout.pointer))
                continue
            parts = _MEMBER.fullmatch(" ".join(member.split()))
            assert parts, f"{piece.name}: {member}"
            kind, sizes, width = parts.groups()
            bits += int(width or 0)
            if width:
                continue
            size, alignment = found[kind.removeprefix("hystgen_")]
            for length in re.findall(r"\[(.+?)\]", sizes):
                size *= sum(lengths[term] if term in lengths else int(term) for term in length.split(" + "))
            fields.append((size, alignment))
        if bits:  # side by side in whole numbers, which stand last
            fields.append((-(-bits // 8), min(-(-bits // 8), layout.integer)))
        found[piece.name.removeprefix("hystgen_")] = layout.struct(*fields)
    return found


_LETTERS = {"w": (8, 8), "i": (4, 4), "c": (16, 4), "b": (1, 1)}
"""Sizes and alignments of the numbers of a block in fixed point, by the letters of `Kind`."""


def _block_structs(kinds: Iterable[Kind], real: tuple[int, int], layout: Layout) -> dict[str, tuple[int, int]]:
    """Sizes and alignments of the tables of a chain's blocks."""
    factor = layout.struct((4, 4), (1, 1))
    sizes = {**_LETTERS, "f": factor, "n": layout.struct(factor, (1, 1), (1, 1))}

    def made_of(numbers: Kind | Rows) -> list[tuple[int, int]]:
        return [sizes[letter] for letter in numbers.letters] or len(numbers.table) * [real]

    found = {}
    for kind in kinds:
        members = [(layout.pointer, layout.pointer)] * bool(kind.rows) + made_of(kind)
        counts = [(2, 2) if i == 0 else (1, 1) for i, _ in enumerate(kind.counts)]
        found[f"_{kind.tabled}_table_t"] = layout.struct(*members, *counts)
        if kind.rows:
            found[f"_{kind.name}_{kind.rows.name}_t"] = layout.struct(*made_of(kind.rows))
    return found


def _constants(
    text: str,
    arithmetic: Arithmetic,
    layout: Layout,
    types: Mapping[str, tuple[int, int]],
    kinds: Iterable[Kind],
    plays: int = 1,
) -> int:
    """Bytes of the constants that the C text defines, without padding between them; for constants with an entry for
    each of `plays`, the bytes of one entry. `types`: as `declared` gives them; `kinds`: of the blocks of a chain."""
    fixed = arithmetic.fixed
    real = arithmetic.reach_bytes if fixed else arithmetic.bytes
    reach = (real, real)
    count = (2, 2)
    factor, table = layout.struct((4, 4), (1, 1)), (layout.pointer, layout.pointer)
    bend = layout.struct(table, table, table, (4, 4), (4, 4), count, *3 * [(1, 1)])
    behind = {
        "factor_t": factor,
        "bend_curve_t": bend,
        "bend_t": layout.struct(bend, bend),
        "bump_t": layout.struct(table, table, table, count),
        "yield_t": layout.struct((4, 4), (16, 4), (1, 1), (1, 1)),
        "stops_t": layout.struct(*2 * [(8, 8)], factor, factor),
    }
    structs = {
        **{name: size for name, size in types.items() if name not in _SIZES},
        **_block_structs(kinds, reach, layout),
        **(behind if fixed else {}),
    }
    total = 0
    found = re.findall(r"^static const (\w+) \w+((?:\[\d+\])*) = ", text, flags=re.MULTILINE)
    for members in re.findall(r"^static const struct \{\n(.*?)^\} \w+ = ", text, flags=re.MULTILINE | re.DOTALL):
        found += re.findall(r"^    (\w+) \w+(\[\d+\]);", members, flags=re.MULTILINE)
    for kind, sizes in found:
        endings = sorted(structs, key=len, reverse=True)  # a name may end in another one
        own = next((structs[ending][0] for ending in endings if kind.endswith(ending)), None)
        if own is None:
            own = next(width for ending, width in _SIZES.items() if kind.endswith(ending))
            own = own or (4 if fixed else real)
        total += own * (math.prod(map(int, re.findall(r"\d+", sizes))) // plays)
    return total


def estimate(
    cascade: StaticModel,
    options: Options,
    numbers: Tables | FixedTables | ChainTables,
    text: str,
    plays: str,
    types: Sequence[Piece],
    fields: Mapping[str, Sequence[Field]],
) -> Cost:
    """Cost of the emitted model whose implementation is `text`, with the parts of a shared run time that it needs.

    `plays`: the part of it that defines the tables with an entry for each play; `types`: declarations of the tables and
    of the instances; `fields`: of a model with effects, the memory of each operator.
    """
    corners = options.engine == "corners"
    known = options.arithmetic != "float64"  # a double of the AVR is a float
    worst = [
        (op, worst_case(cascade.pi.n, op, corners, numbers)) for op in ("forward", "inverse") if getattr(options, op)
    ]
    code = dict(engines.code_bytes(cascade, options.operator, options.arithmetic, options.engine))
    kinds: list[Kind] = []
    parts: dict[str, list[str]] = {}
    if not isinstance(numbers, Tables | FixedTables):
        from hystgen.compensator.chain import blocks, costs

        products = chain_products(numbers)
        worst = [(op, f"{words}; effects: {products[op]} multiplications") for op, words in worst]
        kinds = [each.kind for each in blocks.every(numbers, "forward")]
        parts = {op: costs.parts(numbers, op) for op, _ in worst}
        for op, _ in worst:
            more = costs.code_bytes(numbers, options.arithmetic, op)
            code = {core: size + more[core] for core, size in code.items()}
    dearest = {
        op: engines.dearest(cascade, op, options.arithmetic, options.engine, parts.get(op)) for op, _ in worst
    }
    memory, avr = (_memory(cascade, options, text, plays, layout, types, fields, kinds) for layout in (CORE_32, AVR))
    return Cost(code, memory, avr if known else None, worst, dearest)


def selftest_bytes(options: Options, memory: Memory, samples: int, layout: Layout) -> tuple[int, int]:
    """Bytes of a self-test's samples, and of the instance that its operators use one after the other."""
    real = ARITHMETICS[options.arithmetic].bytes
    sample, _ = layout.struct((1, 1), (real, real), (real, real), (layout.integer, layout.integer))
    return samples * sample, max(size for _, size in memory.instances)


def chain_products(t: ChainTables) -> dict[str, int]:
    """Multiplications of the blocks in front of the plays and behind them in one step, of each operator; in fixed point
    a product of a signal takes two."""
    from hystgen.compensator.chain import blocks
    from hystgen.effects.lag import compensator as lag

    kinds = list(map(int, t.behind.kind if t.fixed else t.behind.stage_kind))
    envelopes = kinds.count(slots.TANH)
    everything, inverse = blocks.every(t, "forward"), blocks.every(t, "inverse")
    forward = sum(each.products[0] for each in everything) + (1 + t.fixed) * t.number_of("delay")
    absorbed, solved = (sum(each.products[way] for each in inverse) for way in (0, 1))
    if t.fixed:
        stages = 2 * (len(kinds) - envelopes) + envelopes * t.behind.bends.coefficient.shape[1]
        braked = t.braked * (13 + lag.HALVES) + 2 * t.turning
        return {"forward": forward + stages, "inverse": absorbed + solved + braked + stages + 2 * len(t.tap)}
    stages = len(kinds) + envelopes
    braked = t.braked * (7 + 2 * lag.HALVES) + t.turning
    return {"forward": forward + stages, "inverse": absorbed + solved + braked + stages + len(t.tap)}


def _memory(
    cascade: StaticModel,
    options: Options,
    text: str,
    plays: str,
    layout: Layout,
    types: Sequence[Piece],
    chain: Mapping[str, Sequence[Field]],
    kinds: Sequence[Kind],
) -> Memory:
    n = cascade.pi.n
    arithmetic = ARITHMETICS[options.arithmetic]
    lengths = {"HYSTGEN_N_PLAYS": n, "HYSTGEN_CORNERS": max(n, 1) if arithmetic.fixed else n + 1}
    known = declared(types, arithmetic, layout, lengths)
    sizes = []
    for op in ("forward", "inverse"):
        if getattr(options, op):
            fields = chain.get(op)
            members = [_field(each, arithmetic, layout, known) for each in fields] if fields else [known[f"{op}_t"]]
            sizes.append((op, layout.struct(*members)[0]))
    a_play, _ = known["corner_t" if options.engine == "corners" else "play_t"]
    more = _constants(plays, arithmetic, layout, known, kinds, n + 1) + a_play * len(sizes)
    return Memory(_constants(text, arithmetic, layout, known, kinds), sizes, more)


def _field(
    field: Field, arithmetic: Arithmetic, layout: Layout, known: Mapping[str, tuple[int, int]]
) -> tuple[int, int]:
    """Size and alignment of a field of an instance; `known`: of the types of the corner engine."""
    real = (arithmetic.bytes, arithmetic.bytes)
    signal, fine = ((8, 8), (4, 4)) if arithmetic.fixed else (real, real)
    whole = (layout.integer, layout.integer)
    ramp = layout.struct(known["reach_t"], known["play_t"])
    one = {"flag": (1, 1), "status": whole, "signal": signal, "fine": fine, "play": fine, "ramp": ramp}.get(field.kind)
    one = one or known.get(f"{field.kind}_t", real)
    members = [*(_LETTERS.get(letter, real) for letter in field.members), *field.flags * [(1, 1)]]
    size, alignment = layout.struct(*members) if members else one
    return size * max(field.count, 1), alignment


def worst_case(n: int, op: str, corners: bool, tables: Tables | FixedTables | ChainTables) -> str:
    """The largest numbers of multiplications and comparisons in one step as functions of n, without those of tanh and
    atanh, and of effects; b are the bits of n."""
    numbers, chain = (tables, None) if isinstance(tables, Tables | FixedTables) else (tables.plays, tables)
    stages: list[tuple[int, int]] = []
    fixed = isinstance(numbers, FixedTables)
    if isinstance(numbers, FixedTables):
        fronts = bool(numbers.fronts)
    else:
        stages = [(int(kind), int(size)) for kind, size in zip(numbers.stage_kind, numbers.stage_size, strict=True)]
        fronts = bool(stages)
    products, compares, per_play, per_bit = _worst_of_plays(op, corners, fixed, corners and not fronts)
    if corners and op == "inverse" and chain is not None:
        from hystgen.compensator.chain.layout import ARRIVING_BITS

        # plays follow what was applied, which may be elsewhere than what was solved for: two searches
        products, compares, per_bit = (7, 25, 4) if fixed else (30, 26, 4)
        if fixed and chain.number[ARRIVING_BITS]:  # and a third one for the remainder of a solution
            products, compares, per_bit = products + 2, compares + 10, per_bit + 2
    per_play_products = 0 if corners else 1 if op == "forward" else 2 if fixed else 3
    curves = 0
    if not corners and chain is not None:
        products, per_play_products, compares, per_play, curves = _worst_of_chain(op, chain)
    passes = 1 if op == "forward" else 2 + int(numbers.branches)
    compares += (2 if op == "forward" else 16) * int(bool(numbers.branches))
    kernels = ""
    if isinstance(numbers, FixedTables) and fronts:
        products += passes * numbers.coefficient.shape[1]
        compares += passes * (int(max(numbers.pieces)).bit_length() + 2)
    envelopes = sum(kind == slots.TANH for kind, _ in stages)
    for kind, size in stages:
        products += passes if kind == slots.DEAD_ZONE else 2 * passes
        compares += passes * size.bit_length() if kind == slots.DEAD_ZONE else 2 * passes
    if envelopes:
        kernels = f", {envelopes} tanh"
        if op == "inverse":
            kernels += f", {envelopes * (1 + int(numbers.branches))} atanh"
    if curves:
        kernels += f", {curves * n} tanh of plays"
    many = products + per_play_products * n
    words = f"{many} multiplications" + " of 32 by 32 bits" * fixed
    if per_play_products:
        words += f" ({products} + {per_play_products} n)"
    total = compares + per_play * n + per_bit * n.bit_length()
    words += f", {total} comparisons"
    if per_bit:
        words += f" ({compares} + {per_bit} b, b = {n.bit_length()} the bits of n)"
    elif per_play:
        words += f" ({compares} + {per_play} n)"
    return words + kernels


def _worst_of_chain(op: str, t: ChainTables) -> tuple[int, int, int, int, int]:
    """Multiplications, further ones per play, comparisons, further ones per play, and tanh per play: of plays in engine
    loop of a model with effects.

    Plain plays follow and are solved for one after the other. Plays that an effect moves or bends in a way of their own
    are searched for: all of them are summed up once for each bisection. Counted in the bit reference
    (`tests/test_cost.py`).
    """
    from hystgen.compensator.chain import moving
    from hystgen.compensator.chain.layout import ARRIVING_BITS

    m, share = t.moving, 1 + t.fixed  # a product with a factor takes two
    inverse = op == "inverse"
    finer = inverse and t.fixed and bool(t.number[ARRIVING_BITS])
    if not m.used or m.scanned:
        if not inverse:
            return 1, 1 + 2 * share * m.scanned, 11 + 2 * t.fixed, 4 + 2 * t.fixed if m.scanned else 2, 0
        products, per_play, compares, more = (4, 3, 21, 3) if t.fixed else (4, 4, 17, 3)
        if m.scanned:
            per_play, more = per_play + 2 * share, more + 3 + t.fixed
        return products + 2 * finer, per_play + finer, compares + 12 * finer, more + 3 * finer, 0
    yields = len(m.yields).bit_length() + 3 + 2 * t.fixed
    moved, kept = {
        moving.DILATED: ((share, 3 + t.fixed), (0, 0)),
        moving.RELAXING: ((share, 2 + t.fixed), (share, 2 + t.fixed)),
        moving.DASHPOT: ((share + 3 + t.fixed, yields), (0, 0)),
    }.get(m.moves, ((0, 2), (0, 0)))
    bent, looked = 0, 0
    if m.bends != moving.STRAIGHT and t.fixed:
        bent, looked = m.bump.coefficient.shape[1], int(max(m.bump.pieces)).bit_length() + 5
    elif m.bends != moving.STRAIGHT:
        bent = m.curve.shape[1] + 3 if m.bends == moving.POLYNOMIAL else 2
    tanh = int(m.bends == moving.CENTRE and not t.fixed)
    twice = 1 + (m.moves == moving.RELAXING)  # what a play contributes, and where it will rest
    sums = 0 if not inverse else 3 + (2 * m.farthest).bit_length() if t.fixed else 1 + m.halves
    halved = 0 if t.fixed or not inverse else m.halves
    return (
        sums + 1 + halved,
        sums * (1 + moved[0] + bent) + 1 + moved[0] + kept[0] + twice * bent,
        2 * sums + 15 + 6 * inverse,
        sums * (1 + moved[1] + looked) + 2 + moved[1] + kept[1] + twice * looked,
        tanh * (sums + twice),
    )


def _worst_of_plays(op: str, corners: bool, fixed: bool, fast: bool) -> tuple[int, int, int, int]:
    """Multiplications; comparisons; further ones per play and per bit of n; of plays, checks and limits.

    Counted in the bit reference (`tests/test_cost.py`), and rounded up to what a search that bisects its whole list
    would take.
    """
    if not corners:
        if op == "forward":
            return 1, 11 if fixed else 7, 2, 0
        return 3, 14, 3, 0
    if fixed:  # the corner, then the play in its block: either is bisected; clamps, the code, what lies ahead
        # the output of a corner is the sum of its parts, for the top one and the one behind it
        return (1, 15, 0, 2) if op == "forward" else (5 + 2 * fast, 19 + 3 * fast, 0, 4)
    # the sign of a move takes a multiplication too; up to eight plays are tried one by one before either search
    if op == "forward" or fast:
        return 17, 18, 0, 2
    return 26, 24, 0, 4
