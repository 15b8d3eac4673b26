"""What an emitted model costs, derived from the model alone so that it is the same wherever it is emitted."""

from __future__ import annotations

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


def _constants(text: str, real: int, fixed: bool) -> int:
    """Bytes of the constants that the C text defines, alignment left out."""
    total = 0
    for kind, size in re.findall(r"^static const (\w+) \w+(?:\[(\d+)\])? = ", text, flags=re.MULTILINE):
        own = next((width for ending, width in _STRUCTS.items() if kind.endswith(ending)), None)
        if kind.endswith("envelope_t"):
            own = 7 * real
        elif kind.endswith("ends_t"):
            own = 16 + 2 * real + 8
        elif kind.endswith("tables_t"):
            own = 40 + 2 * real if fixed else 24 + 2 * real
        elif own is None:
            own = next(width for ending, width in _SIZES.items() if kind.endswith(ending))
            own = own or (4 if fixed else real)
        total += own * int(size or 1)
    return total


def estimate(cascade: Cascade, options: Options, numbers: reference.Tables | FixedTables, text: str) -> Cost:
    """Cost of the emitted model whose implementation is `text`."""
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
        fields = [real] * (1 + branches) + [1] * branches + [4]
        if op == "inverse":
            fast = corners and not fixed and not cascade.stages
            fields = [real] * (4 + 4 * fast + branches) + [1] * (3 + 2 * fast + branches) + [4, 4]
        scalars = [(size, size) for size in fields]
        if corners:
            place = _struct(*((size, size) for size in (sums, sums, reach, reach, 2, 2, 1)))
            memory = _struct(place, place, (play, play))
            size, alignment = _struct(*((size, size) for size in (sums, play, 2, 1)))
            order = [*scalars, memory] if op == "inverse" else [memory, *scalars]
            whole = _struct(*order, (max(n, 1) * size, alignment))
        else:
            whole = _struct(*scalars, ((n + 1) * play, play))
        sizes.append((op, whole[0]))
    worst = [(op, _worst(n, op, corners, numbers)) for op, _ in sizes]
    return Cost(_constants(text, reach if fixed else real, fixed), sizes, worst)


def _worst(n: int, op: str, corners: bool, numbers: reference.Tables | FixedTables) -> str:
    """Most multiplications and comparisons of real numbers in one step, kernels of tanh and atanh not counted."""
    bisect = n.bit_length()
    probes = bisect + 2 * bisect  # through the corners, then through one block with galloping
    absorb_products, absorb_compares = (2, probes + 3) if corners else (0, 2 * (n + 1))
    if op == "forward":
        products = absorb_products + (1 if corners else n + 1)
        compares = absorb_compares + 4
    elif corners:
        products = absorb_products + 1 + 1 + 3 * probes + 2
        compares = absorb_compares + probes + 2 + 10
    else:
        products = (n + 1) + 2 * n + 1
        compares = absorb_compares + n + 1 + 10
    if numbers.branches:
        compares += 12
    if isinstance(numbers, FixedTables):
        products = 2 * products + 2  # wide ones count twice
        if numbers.fronts:
            passes = 1 if op == "forward" else 2 + int(numbers.branches)
            degree = numbers.coefficient.shape[1] - 1
            products += passes * (degree + 1)
            compares += passes * (int(max(numbers.pieces)).bit_length() + 2)
        return f"{products} multiplications of 32 by 32 bits, {compares} comparisons"
    fronts = [0, 0]
    for kind, size in zip(numbers.stage_kind, numbers.stage_size, strict=True):
        passes = 1 if op == "forward" else 2 + int(numbers.branches)
        if kind == reference.DEAD_ZONE:
            fronts[0] += passes
            fronts[1] += passes * int(size).bit_length()
        else:
            fronts[0] += 2 * passes
            fronts[1] += 2 * passes
    envelopes = sum(int(kind) == reference.TANH for kind in numbers.stage_kind)
    kernels = f", {envelopes} tanh" if envelopes else ""
    if envelopes and op == "inverse":
        kernels += f", {envelopes * (1 + int(numbers.branches))} atanh"
    return f"{products + fronts[0]} multiplications, {compares + fronts[1]} comparisons{kernels}"
