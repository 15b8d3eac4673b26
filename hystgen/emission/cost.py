"""What an emitted model costs, derived from the model alone so that it is the same wherever it is emitted."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hystgen import reference
from hystgen.fixed import FixedTables
from hystgen.models import Cascade

if TYPE_CHECKING:
    from hystgen.emission.module import Options


@dataclass(frozen=True)
class Cost:
    """Bytes on a 32-bit target, and worst-case operations of a step in words, for each operator."""

    table_bytes: int
    instance_bytes: list[tuple[str, int]]
    worst_case: list[tuple[str, str]]


def _struct(*fields: tuple[int, int]) -> tuple[int, int]:
    """Size and alignment of a C struct of fields of these sizes and alignments."""
    at, most = 0, 1
    for size, alignment in fields:
        at = -(-at // alignment) * alignment + size
        most = max(most, alignment)
    return -(-at // most) * most, most


_SIZES = {"float": 4, "double": 8, "real_t": 0, "int32_t": 4, "uint32_t": 4, "uint8_t": 1, "int64_t": 8, "sum_t": 8,
          "play_t": 0, "uint_least16_t": 2, "uint_least8_t": 1}  # fmt: skip
_STRUCTS = {"dead_zone_t": 28}  # of pointers and counts


def _corner_structs(real: int) -> dict[str, int]:
    """Bytes of the structures of the corner engine in floating point."""
    fields = {
        "segment_t": (real,) * 4,
        "corner_t": (real,) * 3 + (2, 1),
        "curve_t": (4,) + (real,) * 6,
        "start_t": (4, 2, 2) + (real,) * 3 + (2, 1),
        "drive_t": (real, real, 1),
    }
    return {name: _struct(*((size, size) for size in sizes))[0] for name, sizes in fields.items()}


def _constants(text: str, real: int, fixed: bool) -> int:
    """Bytes of the constants that the C text defines, alignment left out."""
    total = 0
    found = re.findall(r"^static const (\w+) \w+((?:\[\d+\])*) = ", text, flags=re.MULTILINE)
    for members in re.findall(r"^static const struct \{\n(.*?)^\} \w+ = ", text, flags=re.MULTILINE | re.DOTALL):
        found += re.findall(r"^    (\w+) \w+(\[\d+\]);", members, flags=re.MULTILINE)
    for kind, sizes in found:
        own = next((width for ending, width in _STRUCTS.items() if kind.endswith(ending)), None)
        if kind.endswith("envelope_t"):
            own = 7 * real
        elif kind.endswith("ends_t"):
            own = 16 + 2 * real + 8
        elif kind.endswith("tables_t"):
            own = 40 + 2 * real if fixed else 20
        elif not fixed and kind.endswith(tuple(_corner_structs(real))):
            own = next(width for ending, width in _corner_structs(real).items() if kind.endswith(ending))
        elif own is None:
            own = next(width for ending, width in _SIZES.items() if kind.endswith(ending))
            own = own or (4 if fixed else real)
        total += own * math.prod(map(int, re.findall(r"\d+", sizes)))
    return total


def estimate(cascade: Cascade, options: Options, numbers: reference.Tables | FixedTables, text: str) -> Cost:
    """Cost of the emitted model whose implementation is `text`, with what of a shared run time it needs."""
    n = cascade.pi.n
    fixed = isinstance(numbers, FixedTables)
    real = {"float32": 4, "float64": 8, "q31": 4, "q15": 2}[options.arithmetic]
    play, reach, sums = (4, 8 if options.arithmetic == "q31" else 4, 8) if fixed else (real, real, real)
    corners = options.engine == "corners"
    branches = cascade.branches_differ
    sizes = []
    for op in ("forward", "inverse"):
        if not getattr(options, op):
            continue
        if corners and not fixed:
            sizes.append((op, _corner_instance(n, op, real, bool(cascade.stages))))
            continue
        fields = [real] * (1 + branches) + [1] * branches + [4]
        if op == "inverse":
            fast = corners and not cascade.stages
            fields = [real] * (4 + branches) + [1] * (3 + 2 * fast + branches) + [4, 4]
            if fast:  # what stands before them
                fields = [8, 4, 4, play, play, 4, 4, 1] + fields
        scalars = [(size, size) for size in fields]
        if corners:
            place = _struct(*((size, size) for size in (sums, sums, reach, reach, 2, 2, 1)))
            memory = _struct(place, place, (play, play), (2, 2))
            size, alignment = _struct(*((size, size) for size in (sums, play, 2, 1)))
            order = [*scalars, memory] if op == "inverse" else [memory, *scalars]
            whole = _struct(*order, (max(n, 1) * size, alignment))
        else:
            whole = _struct(*scalars, ((n + 1) * play, play))
        sizes.append((op, whole[0]))
    worst = [(op, _worst(n, op, corners, numbers)) for op, _ in sizes]
    return Cost(_constants(text, reach if fixed else real, fixed), sizes, worst)


def _corner_instance(n: int, op: str, real: int, front: bool) -> int:
    """Bytes of an instance of the corner engine in floating point."""
    place = _struct((real, real), (real, real), (2, 2), (2, 2), (1, 1), (1, 1))
    plays = _struct(place, *[(real, real)] * 8)
    corner = _corner_structs(real)["corner_t"]
    if op == "forward":
        beside = [(real, real), (1, 1), (4, 4)] if front else [(4, 4)]
    elif front:
        beside = [place, *[(real, real)] * 5, *[(1, 1)] * 5, (4, 4), (4, 4)]
    else:
        beside = [place, (real, real), (real, real), (1, 1), (1, 1), (4, 4)]
    return _struct(plays, *beside, ((n + 1) * corner, real))[0]


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
