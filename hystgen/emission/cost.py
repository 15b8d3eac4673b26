"""What an emitted model costs, derived from the model alone so that it is the same wherever it is emitted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from hystgen import reference
from hystgen.models import Cascade

if TYPE_CHECKING:
    from hystgen.emission.module import Options


@dataclass(frozen=True)
class Cost:
    """Bytes on a 32-bit target, and worst-case operations of a step in words, for each operator."""

    table_bytes: int
    instance_bytes: list[tuple[str, int]]
    worst_case: list[tuple[str, str]]


def _struct(*fields: int) -> int:
    """Size of a C struct of these field sizes under natural alignment."""
    at = 0
    for size in fields:
        at = -(-at // size) * size + size
    return -(-at // max(fields)) * max(fields)


def estimate(cascade: Cascade, options: Options, numbers: reference.Tables) -> Cost:
    """Cost of the emitted model."""
    n = cascade.pi.n
    real = 4 if options.arithmetic == "float32" else 8
    corners = options.engine == "corners"
    branches = cascade.branches_differ
    sizes = []
    for op in ("forward", "inverse"):
        if not getattr(options, op):
            continue
        if corners:
            memory = _struct(real, real, real, real, 2, 2, 1) + max(n, 1) * _struct(real, real, 2, 1)
        else:
            memory = (n + 1) * real
        if op == "forward":
            fields = [real] * (1 + branches) + [1] * branches + [4]
        else:
            fields = [real] * (4 + branches) + [1] * (3 + branches) + [4, 4]
        rest = _struct(*fields)
        sizes.append((op, memory + rest))

    used = [True, not corners, corners, corners or options.inverse, options.inverse]
    counts = [n + 1, n + 1, n + 2, n + 2, n + 2]
    reals = sum(count for count, use in zip(counts, used, strict=True) if use)
    reals += len(numbers.start) if len(numbers.start) > 1 else 0
    stage_bytes = len(numbers.stage_data) * real
    worst = [(op, _worst(n, op, corners, numbers)) for op, _ in sizes]
    return Cost(reals * real + stage_bytes + 24, sizes, worst)


def _worst(n: int, op: str, corners: bool, numbers: reference.Tables) -> str:
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
