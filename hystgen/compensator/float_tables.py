"""From a model to the numbers that the kernels work with in floating point."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.arithmetic import ARITHMETICS
from hystgen.basics.problems import FormatError
from hystgen.chain.static import UNBOUNDED, StaticModel
from hystgen.compensator import corner_tables
from hystgen.compensator.bounds import error_bounds
from hystgen.compensator.layout import Tables, first_moves
from hystgen.front.dead_zone.model import DeadZone
from hystgen.front.tanh import kernels
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.plays import slots


def inward(low: float, high: float, dtype: Any) -> tuple[Any, Any]:
    """The ends of [low, high] in `dtype`, rounded so that they stay inside."""
    a, b = dtype(low), dtype(high)
    if float(a) < low:
        a = np.nextafter(a, dtype(np.inf))
    if float(b) > high:
        b = np.nextafter(b, dtype(-np.inf))
    return a, b


def upward(x: float, dtype: Any) -> Any:
    """x in `dtype`, rounded up."""
    rounded = dtype(x)
    return rounded if float(rounded) >= x else np.nextafter(rounded, dtype(np.inf))


def _stage_numbers(
    stage: DeadZone | TanhEnvelope, low: float, high: float
) -> tuple[int, int, list[float]]:
    if isinstance(stage, TanhEnvelope):
        numbers = []
        for ascending in (True, False):
            a0, a1, a2, a3 = stage.branch(ascending)
            numbers += [a0, a1, a2, a3, 1.0 / a0, 1.0 / a1, 1.0]  # the last becomes the largest number below 1
        return slots.TANH, 0, numbers
    kept = stage.over(low, high)
    return (
        slots.DEAD_ZONE,
        len(kept.breaks),
        [
            *kept.breaks,
            *kept.values,
            *(x for x, _ in kept.anchors),
            *(y for _, y in kept.anchors),
            *kept.slopes,
            *(1.0 / s if s > 0 else 0.0 for s in kept.slopes),
        ],
    )


def _corners(
    cascade: StaticModel, dtype: Any, limits: Sequence[float] | None, seen: tuple[float, float]
) -> dict[str, Any]:
    """What `Tables` has of the corner engine; `limits` as there, up to OFFSET, None for none; `seen` by the plays."""
    forward = corner_tables.forward_curve(cascade, dtype)
    inverse = forward
    if not cascade.inverse_problems():
        ends = None
        if limits is not None:
            low, high, least, most, offset = (dtype(end) for end in limits)
            ends = (low, high, least - offset, most - offset)
        inverse = corner_tables.inverse_curve(cascade, dtype, ends)
    memories = {"first": cascade.pi.start, "zero": (0.0,) * len(cascade.pi.start)}
    starts = {
        f"{operator}_{name}": corner_tables.start(cascade, curve, states, operator == "inverse", seen)
        for operator, curve in (("forward", forward), ("inverse", inverse))
        for name, states in memories.items()
    }
    return {"forward": forward, "inverse": inverse, "begin": np.zeros(4, dtype), **starts}


def build_float(
    cascade: StaticModel, arithmetic: str, engine: str, clamp: bool, inverse: bool, visited: Sequence[float] = ()
) -> Tables:
    """Tables of `cascade` in 'float32' or 'float64' for engine 'corners' or 'loop'; `visited` as for `build`.

    Without `clamp` the drive and output limits are those of the arithmetic. Raises FormatError when a number or an
    intermediate result of the model does not fit the arithmetic.
    """
    dtype = ARITHMETICS[arithmetic].computed.type
    info = np.finfo(dtype)
    largest = float(info.max)
    pi = cascade.pi
    n = pi.n

    def reals(values: Sequence[float], what: str, *at: str) -> NDArray[Any]:
        if any(abs(x) > largest / 16 for x in values):
            message = f"{what} reach {max(abs(x) for x in values):.3g}, too large for {arithmetic}"
            raise FormatError((("model", *at), message))
        return np.array(values, dtype=dtype)

    products = [p * r for p, r in zip(pi.weights, pi.thresholds, strict=True)]
    slope = [math.fsum(pi.weights[:k]) for k in range(n + 2)]
    lift = [math.fsum(products[:k]) for k in range(n + 2)]
    # the thresholds z of the inverse (36): output gained by the time play k starts to follow
    exact = [Fraction(0), *itertools.accumulate(map(Fraction, pi.weights))]
    rises = [Fraction(b) - Fraction(a) for a, b in itertools.pairwise(pi.thresholds)]
    start_level = [
        float(z) for z in itertools.accumulate((c * r for c, r in zip(exact[1:], rises, strict=False)), initial=0)
    ]
    bounded = clamp and all(math.isfinite(end) for end in cascade.input_range)

    everywhere = not bounded and not inverse
    spans = [UNBOUNDED] * len(cascade.stages) if everywhere else cascade.stage_spans
    kinds: list[int] = []
    firsts: list[int] = []
    sizes: list[int] = []
    numbers: list[float] = []
    for j, stage in enumerate(cascade.stages):
        assert isinstance(stage, DeadZone | TanhEnvelope)
        kind, size, data = _stage_numbers(stage, *spans[j])
        kinds.append(kind)
        firsts.append(len(numbers))
        sizes.append(size)
        numbers += data

    limits = [0.0] * 10
    if bounded:
        drive = inward(*cascade.input_range, dtype)
        outputs = inward(*cascade.output_range, dtype)
        if not (drive[0] < drive[1] and outputs[0] < outputs[1]):
            message = f"this range of the drive, or that of the output, is narrower than {arithmetic} can tell apart"
            raise FormatError((("input_range",), message))
        limits[slots.DRIVE_MIN : slots.OUTPUT_MAX + 1] = [float(x) for x in (*drive, *outputs)]
    else:
        limits[slots.DRIVE_MIN : slots.OUTPUT_MAX + 1] = [-largest, largest, -largest, largest]
    limits[slots.OFFSET] = cascade.output_offset

    def not_above(v: float) -> tuple[float, bool]:
        number = dtype(v)
        if float(number) > v:
            number = np.nextafter(number, dtype(-np.inf))
        return float(number), float(number) == v

    low, high = limits[slots.DRIVE_MIN], limits[slots.DRIVE_MAX]
    applied, ascending = first_moves(cascade, (low, high), not_above, lambda v: float(dtype(v)))
    if cascade.branches_differ and not cascade.inverse_problems():
        limits[slots.HOLD] = 2.0 * error_bounds(cascade, arithmetic, engine).rounding
    limits[slots.REAL_MAX] = largest
    if max(map(abs, limits)) > largest:
        reached = max(map(abs, limits))
        message = f"the start memory or a limit reaches {reached:.3g}, too large for {arithmetic}"
        raise FormatError((("model",), message))
    seen = (-math.inf, math.inf)
    if bounded:
        seen = cascade.play_range if cascade.stages else (low, high)
        seen = (min([seen[0], *visited]), max([seen[1], *visited]))
    tables = Tables(
        threshold=reals(pi.thresholds, "thresholds", "pi", "thresholds"),
        weight=reals(pi.weights, "weights", "pi", "weights"),
        slope=reals(slope, "sums of weights", "pi", "weights"),
        lift=reals(lift, "sums of weight times threshold", "pi"),
        start_level=reals(start_level, "outputs at which plays start to follow", "pi"),
        inverse_slope=reals(
            [1.0 / c if c > 0 else 0.0 for c in slope], "reciprocals of the sums of weights", "pi", "weights"
        ),
        start=reals(pi.start if len(set(pi.start)) > 1 else pi.start[:1], "start states", "pi"),
        limits=np.array(limits, dtype=dtype),
        applied=np.array(applied, dtype=dtype),
        ascending=np.array(ascending, dtype=np.int64),
        stage_kind=np.array(kinds, dtype=np.int64),
        stage_first=np.array(firsts, dtype=np.int64),
        stage_size=np.array(sizes, dtype=np.int64),
        stage_data=reals(numbers, "numbers of the memoryless stages", "memoryless"),
        **_corners(cascade, dtype, limits[: slots.OFFSET + 1] if bounded and not cascade.stages else None, seen),
        engine=slots.CORNERS if engine == "corners" else slots.LOOP,
        branches=int(cascade.branches_differ),
        tanh=kernels.tanh_tables(dtype),
        atanh=kernels.atanh_tables(dtype),
    )
    for kind, first in zip(kinds, firsts, strict=True):
        if kind == slots.TANH:
            tables.stage_data[[first + 6, first + 13]] = np.nextafter(dtype(1), dtype(0))
    for j, w in ((2, pi.start[0]), (3, 0.0)):  # a move from farther out passes the end of the range first
        tables.begin[j] = min(max(w, seen[0]), seen[1])
    if bounded:
        w = max(abs(x) for x in (*cascade.play_range, *pi.start))
        output = w * sum(abs(p) for p in pi.weights) + abs(lift[-1]) + abs(cascade.output_offset)
        most = 4 * max(output, w, pi.thresholds[-1]) * max(1.0, float(np.max(tables.inverse_slope)))
        reals([most], "intermediate results")
    return tables
