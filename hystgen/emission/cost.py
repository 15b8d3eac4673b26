"""What an emitted model costs, derived from the model alone so that it is the same wherever it is emitted."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hystgen import engines, reference
from hystgen.fixed import FixedTables
from hystgen.models import Cascade

if TYPE_CHECKING:
    from hystgen.emission.module import Options


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
    """Bytes of the constant tables and of an instance of each operator; `play`: of both, those of one play more."""

    tables: int
    instances: list[tuple[str, int]]
    play: int

    @property
    def all(self) -> int:
        """Bytes of the tables and of one instance of each operator."""
        return self.tables + sum(size for _, size in self.instances)


@dataclass(frozen=True)
class Cost:
    """Code of the module by core (`hystgen.engines`), memory on a 32-bit target and on an 8-bit AVR, where tables lie
    in RAM too (None in float64, which it lacks), and worst-case operations of a step in words, for each operator."""

    code: Mapping[str, int]
    memory: Memory
    avr: Memory | None
    worst_case: list[tuple[str, str]]

    @property
    def code_words(self) -> str:
        """The code in words."""
        small, large = (self.code[core] for core in engines.CORES)
        return f"{small} bytes on a Cortex-M0+, {large} on a Cortex-M4F"


REAL_BYTES = {"float32": 4, "float64": 8, "q31": 4, "q15": 2}
_SIZES = {"float": 4, "double": 8, "real_t": 0, "int32_t": 4, "uint32_t": 4, "uint8_t": 1, "int64_t": 8, "sum_t": 8,
          "play_t": 0, "uint_least16_t": 2, "uint_least8_t": 1}  # fmt: skip


def _corner_structs(real: int, layout: Layout) -> dict[str, tuple[int, int]]:
    """Sizes and alignments of the structures of the corner engine in floating point."""
    reals = (real, real)
    pointer = (layout.pointer, layout.pointer)
    corner = layout.struct(*3 * [reals], (2, 2), (1, 1))
    return {
        "segment_t": layout.struct(*4 * [reals]),
        "corner_t": corner,
        "curve_t": layout.struct(pointer, *6 * [reals]),
        "start_t": layout.struct(pointer, (2, 2), (2, 2), corner),
        "drive_t": layout.struct(reals, reals, (1, 1)),
    }


def _constants(text: str, real: int, fixed: bool, layout: Layout, each: bool = False) -> int:
    """Bytes of the constants that the C text defines, alignment between them left out; `each`: of one entry of each."""
    reach = (real, real)
    pointers = 6 * [(layout.pointer, layout.pointer)]
    count = (2, 2)
    structs = {
        "dead_zone_t": layout.struct(*pointers, count),
        "envelope_t": layout.struct(*(7 * [reach])),
        "ends_t": layout.struct((8, 8), (8, 8), reach, reach, (4, 4), (4, 4)),
        "tables_t": layout.struct(*pointers[: 6 if fixed else 4], *([(8, 8), reach, reach] if fixed else []), count),
    }
    if not fixed:
        structs |= _corner_structs(real, layout)
    total = 0
    found = re.findall(r"^static const (\w+) \w+((?:\[\d+\])*) = ", text, flags=re.MULTILINE)
    for members in re.findall(r"^static const struct \{\n(.*?)^\} \w+ = ", text, flags=re.MULTILINE | re.DOTALL):
        found += re.findall(r"^    (\w+) \w+(\[\d+\]);", members, flags=re.MULTILINE)
    for kind, sizes in found:
        own = next((size for ending, (size, _) in structs.items() if kind.endswith(ending)), None)
        if own is None:
            own = next(width for ending, width in _SIZES.items() if kind.endswith(ending))
            own = own or (4 if fixed else real)
        total += own * (1 if each else math.prod(map(int, re.findall(r"\d+", sizes))))
    return total


def estimate(
    cascade: Cascade, options: Options, numbers: reference.Tables | FixedTables, text: str, plays: str
) -> Cost:
    """Cost of the emitted model whose implementation is `text`, with what of a shared run time it needs.

    `plays`: the part of it that defines the tables with an entry for each play.
    """
    fixed = isinstance(numbers, FixedTables)
    corners = options.engine == "corners"
    known = options.arithmetic != "float64"  # a double of the AVR is a float
    worst = [
        (op, _worst(cascade.pi.n, op, corners, numbers)) for op in ("forward", "inverse") if getattr(options, op)
    ]
    memory, avr = (_memory(cascade, options, fixed, text, plays, layout) for layout in (CORE_32, AVR))
    code = engines.code_bytes(cascade, options.operator, options.arithmetic, options.engine)
    return Cost(code, memory, avr if known else None, worst)


def selftest_bytes(options: Options, memory: Memory, samples: int, layout: Layout) -> tuple[int, int]:
    """Bytes of a self-test's samples, and of the instance that its operators use one after the other."""
    real = REAL_BYTES[options.arithmetic]
    sample, _ = layout.struct((1, 1), (real, real), (real, real), (layout.integer, layout.integer))
    return samples * sample, max(size for _, size in memory.instances)


def _memory(cascade: Cascade, options: Options, fixed: bool, text: str, plays: str, layout: Layout) -> Memory:
    n = cascade.pi.n
    real = REAL_BYTES[options.arithmetic]
    play, reach, sums = (4, 8 if options.arithmetic == "q31" else 4, 8) if fixed else (real, real, real)
    corners = options.engine == "corners"
    branches = cascade.branches_differ
    sizes = []
    a_play = play
    integer = layout.integer
    for op in ("forward", "inverse"):
        if not getattr(options, op):
            continue
        if corners and not fixed:
            size, a_play = _corner_instance(n, op, real, bool(cascade.stages), layout)
            sizes.append((op, size))
            continue
        fields = [real] * (1 + branches) + [1] * branches + [integer]
        if op == "inverse":
            fast = corners and not cascade.stages
            fields = [real] * (4 + branches) + [1] * (3 + 2 * fast + branches) + [integer, integer]
            if fast:  # what stands before them
                fields = [8, 4, 4, play, play, 4, 4, 1, *fields]
        scalars = [(size, size) for size in fields]
        if corners:
            place = layout.struct(*((size, size) for size in (sums, sums, reach, reach, 2, 2, 1)))
            memory = layout.struct(place, place, (play, play), (2, 2), (1, 1))
            a_play, alignment = layout.struct(*((size, size) for size in (sums, play, 2, 1)))
            order = [*scalars, memory] if op == "inverse" else [memory, *scalars]
            whole = layout.struct(*order, (max(n, 1) * a_play, alignment))
        else:
            whole = layout.struct(*scalars, ((n + 1) * play, play))
        sizes.append((op, whole[0]))
    width = reach if fixed else real
    more = _constants(plays, width, fixed, layout, each=True) + a_play * len(sizes)
    return Memory(_constants(text, width, fixed, layout), sizes, more)


def _corner_instance(n: int, op: str, real: int, front: bool, layout: Layout) -> tuple[int, int]:
    """Bytes of an instance of the corner engine in floating point, and of one corner."""
    reals, flag, status = (real, real), (1, 1), (layout.integer, layout.integer)
    place = layout.struct(reals, reals, (2, 2), (2, 2), flag)
    plays = layout.struct(place, *8 * [reals], flag)
    corner, alignment = _corner_structs(real, layout)["corner_t"]
    if op == "forward":
        beside = [reals, flag, status] if front else [status]
    elif front:
        beside = [place, *5 * [reals], *5 * [flag], status, status]
    else:
        beside = [place, reals, reals, flag, flag, status]
    return layout.struct(plays, *beside, ((n + 1) * corner, alignment))[0], corner


def _worst(n: int, op: str, corners: bool, numbers: reference.Tables | FixedTables) -> str:
    """Most multiplications and comparisons of numbers in one step as functions of n, kernels of tanh and atanh aside.

    A search through the corner list bisects it, in fixed point after a look at the last corner; that through a block
    bisects it too, in fixed point after one or two looks: at most 3 + 2 b comparisons in all, b the bits of n. Corners
    of a start list are bisected apart, but own a play each, so that no block is searched then. A drive that is limited
    or committed is searched for too, then or when it is taken to memory, the answer once more.
    """
    stages: list[tuple[int, int]] = []
    fixed = isinstance(numbers, FixedTables)
    if isinstance(numbers, FixedTables):
        fronts = bool(numbers.fronts)
    else:
        stages = [(int(kind), int(size)) for kind, size in zip(numbers.stage_kind, numbers.stage_size, strict=True)]
        fronts = bool(stages)
    products, compares, per_play, per_bit = _worst_of_plays(op, corners, fixed, corners and not fronts)
    per_play_products = 0 if corners else 1 if op == "forward" else 2 if fixed else 3
    passes = 1 if op == "forward" else 2 + int(numbers.branches)
    compares += 12 * int(bool(numbers.branches))
    kernels = ""
    if isinstance(numbers, FixedTables) and fronts:
        products += passes * numbers.coefficient.shape[1]
        compares += passes * (int(max(numbers.pieces)).bit_length() + 2)
    envelopes = sum(kind == reference.TANH for kind, _ in stages)
    for kind, size in stages:
        products += passes if kind == reference.DEAD_ZONE else 2 * passes
        compares += passes * size.bit_length() if kind == reference.DEAD_ZONE else 2 * passes
    if envelopes:
        kernels = f", {envelopes} tanh"
        if op == "inverse":
            kernels += f", {envelopes * (1 + int(numbers.branches))} atanh"
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


def _worst_of_plays(op: str, corners: bool, fixed: bool, fast: bool) -> tuple[int, int, int, int]:
    """Multiplications, comparisons, and of these more a play, more a bit of n; of plays, checks and limits."""
    if not corners:
        return (1, 6, 2, 0) if op == "forward" else (3 if fixed else 2, 13, 3, 0)
    if op == "forward":  # turning back leaves a corner, the way to a play is halved; the output. Checks 4, turned 2,
        return 4 if fixed else 3, 10, 0, 2  # next 1, search 3. In fixed point a sum takes two multiplications.
    # The drive: turned 2, foretold 2, next 1, search 3; the reference: checks 7, going on 3, search 3, place 2, limits
    # 4 + 3, in floating point ahead 1; where samples can be fast: two edges, and in fixed point one more play 5, edges
    # anew 4, in floating point room 1, the range's ends 3, limited 2. The drive's corner and way, the reference's; two
    # lines; with fast samples the edge, and in fixed point the next play's line and way.
    compares = 30 + 11 * fast if fixed else 31 + 8 * fast
    return (10 + 4 * fast if fixed else 6 + fast), compares, 0, 4
