"""Floating-point form of a model: the constants of its kernels; those of the corner engine are fractions rounded
once."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystgen.arithmetic import ARITHMETICS
from hystgen.basics.problems import FormatError
from hystgen.chain.static import UNBOUNDED, StaticModel
from hystgen.compensator.bounds import CornerRoundings, error_bounds
from hystgen.compensator.layout import Tables, first_moves
from hystgen.front.dead_zone.model import DeadZone
from hystgen.front.tanh import kernels
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.plays import slots
from hystgen.plays.corners.corners_float import Curve, Literals, Start
from hystgen.plays.slots import LimitTable


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


@dataclass(frozen=True)
class _Sums:
    """The plays' constants as fractions: thresholds r, weights p, C_k = p_0 + .. + p_k, Q_k = p_0 r_0 + .. + p_k r_k,
    and z_k = C_k r_k - Q_k, the thresholds of the inverse (36)."""

    r: list[Fraction]
    p: list[Fraction]

    @property
    def c(self) -> list[Fraction]:
        """C_0 .. C_n."""
        return list(itertools.accumulate(self.p))

    @property
    def q(self) -> list[Fraction]:
        """Q_0 .. Q_n."""
        return list(itertools.accumulate(p * r for p, r in zip(self.p, self.r, strict=True)))

    @property
    def z(self) -> list[Fraction]:
        """z_0 .. z_n."""
        return [c * r - q for c, r, q in zip(self.c, self.r, self.q, strict=True)]


def _sums(cascade: StaticModel) -> _Sums:
    """The exact constants of a model's plays."""
    pi = cascade.pi
    return _Sums([Fraction(r) for r in pi.thresholds], [Fraction(p) for p in pi.weights])


def _forward_curve(cascade: StaticModel, dtype: Any) -> Curve:
    """Input: the input w of the plays; output: their sum. Nothing is limited."""
    s = _sums(cascade)
    rows = [(2 * r, 2 * z, c, 1 / c if c else c) for r, z, c in zip(s.r, s.z, s.c, strict=True)]
    return _curve(rows, dtype)


def _inverse_curve(cascade: StaticModel, dtype: Any, limits: Sequence[Any] | None) -> Curve:
    """Input: the sum of the plays; output: their input w. `limits`: of the drive, then of the sum; None for no limits.

    Each play begins to follow early, by as much as rounding could otherwise carry an answer past that point.
    """
    s = _sums(cascade)
    roundings = CornerRoundings.of(cascade, np.dtype(dtype).name)
    early = Fraction(roundings.early)
    rows = []
    for r, z, c in zip(s.r, s.z, s.c, strict=True):
        way = Fraction(float(dtype(float(max(2 * z - early, Fraction(0))))))
        rows.append((way, 2 * r - (2 * z - way) / c, 1 / c, c))
    curve = _curve(rows, dtype)
    if limits is None:
        return curve
    low, high, least, most = limits
    inside = [dtype(float(end) - roundings.margin) for end in (-low, high)]
    inside = [np.nextafter(a, dtype(-np.inf)) for a in inside]
    return curve._replace(
        limit=np.array([-low, high], dtype), inside=np.array(inside, dtype), range=np.array([-least, most], dtype)
    )


def _curve(rows: Sequence[Sequence[Fraction]], dtype: Any) -> Curve:
    largest = np.finfo(dtype).max
    columns = [np.array([float(x) for x in column], dtype=dtype) for column in zip(*rows, strict=True)]
    ends = (largest / 2, largest / 2, 0, 0)  # a play that never follows
    way, reach, gain, slope = (np.append(column, dtype(end)) for column, end in zip(columns, ends, strict=True))
    two = np.array([largest, largest], dtype)
    return Curve(way, reach, gain, slope, two, two.copy(), two.copy(), Literals.of([(largest, 0, 0.5, 1)], dtype))


def _start(
    cascade: StaticModel, curve: Curve, states: Sequence[float], inverse: bool, seen: tuple[float, float]
) -> Start:
    """The memory in which play k holds `states[k]`; `curve`: the operator's; `seen`: range of the plays' input.

    A play is entered on the side of its state on which it can begin to follow within the range, since lines from far
    outside would lose digits. The first play that can begin on neither side, and all with larger thresholds, belong to
    the bottom.
    """
    s, dtype = _sums(cascade), curve.way.dtype.type
    held = [Fraction(state) for state in states]
    # input and output if plays 0 .. k all hold the value of play k
    centers = [(w, c * w + aside) for w, c, aside in zip(held, s.c, _aside(s, held), strict=True)]
    if inverse:
        centers = [(y, w) for w, y in centers]
    rest = all(state == held[0] for state in held)
    points = np.array([[float(x) for x in point] for point in centers[: 1 if rest else None]], dtype)
    ways, axis = (curve.reach, 1) if inverse else (curve.way, 0)

    def risen_to(k: int, sign: int) -> float:
        """Where play k begins to follow a rising (falling) move, as the engine computes it."""
        return float(points[0 if rest else k, axis] + dtype(sign) * (ways[k] * dtype(0.5)))

    plays = range(1, len(held))
    risen = next((k - 1 for k in plays if risen_to(k, 1) > seen[1]), len(held) - 1)
    top = next((k for k in plays if k > risen and risen_to(k, -1) < seen[0]), len(held))
    # While plays 0 .. top-1 all follow, a rising move gives y = C w - Q and a falling one y = C w + Q, each plus the
    # other plays' contribution: lines from two turning points with equal outputs and with inputs on either side of a
    # centre. If every play can move, any centre is right; the one taken is the same for all start memories, so that a
    # start is forgotten to the last bit
    k = top - 1
    w = held[top] if top < len(held) else Fraction(min(max(0.0, seen[0]), seen[1]))
    y = s.c[k] * w + _aside(s, held)[k]
    to, output = (y, w) if inverse else (w, y)
    apart = s.q[k] if inverse else (-s.q[k] / s.c[k] if s.c[k] else Fraction(0))
    bottom = np.array([float(output), float(-(to + apart)), float(to - apart)], dtype)
    return Start(points, int(not rest), risen, bottom, top)


def _aside(s: _Sums, held: Sequence[Fraction]) -> list[Fraction]:
    """The contribution to the sum, for each play, of all plays with larger thresholds."""
    above = [p * w for p, w in zip(s.p, held, strict=True)]
    return [*itertools.accumulate(above[:0:-1], initial=Fraction(0))][::-1]


def _corners(
    cascade: StaticModel, dtype: Any, limits: LimitTable | None, seen: tuple[float, float]
) -> dict[str, Any]:
    """The entries of `Tables` for the corner engine; `limits`: as in `Tables`, None for no limits; `seen`:
    range of the plays' input."""
    forward = _forward_curve(cascade, dtype)
    inverse = forward
    if not cascade.inverse_problems():
        ends = None
        if limits is not None:
            low, high, least, most, offset = map(dtype, (*limits.drive[0], *limits.output[0], limits.offset[0]))
            ends = (low, high, least - offset, most - offset)
        inverse = _inverse_curve(cascade, dtype, ends)
    memories = {"first": cascade.pi.start, "zero": (0.0,) * len(cascade.pi.start)}
    starts = {
        f"{operator}_{name}": _start(cascade, curve, states, operator == "inverse", seen)
        for operator, curve in (("forward", forward), ("inverse", inverse))
        for name, states in memories.items()
    }
    return {"forward": forward, "inverse": inverse, "begin": np.zeros(4, dtype), **starts}


def build_float(
    cascade: StaticModel, arithmetic: str, engine: str, clamp: bool, inverse: bool, visited: Sequence[float] = ()
) -> Tables:
    """Tables of `cascade` in 'float32' or 'float64' for engine 'corners' or 'loop'; `visited` as for `build`.

    Without `clamp` only the arithmetic limits drive and output. Raises FormatError if a number or an intermediate
    result of the model does not fit the arithmetic.
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
    # the thresholds z of the inverse (36): output gained by the time play k begins to follow
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

    limits = LimitTable.zeros(1, np.float64)
    if bounded:
        drive = inward(*cascade.input_range, dtype)
        outputs = inward(*cascade.output_range, dtype)
        if not (drive[0] < drive[1] and outputs[0] < outputs[1]):
            message = f"this range of the drive, or that of the output, is narrower than {arithmetic} can tell apart"
            raise FormatError((("input_range",), message))
    else:
        drive = outputs = -largest, largest
    limits.drive[0] = tuple(map(float, drive))
    limits.output[0] = tuple(map(float, outputs))
    limits.offset[0] = cascade.output_offset

    def not_above(v: float) -> tuple[float, bool]:
        number = dtype(v)
        if float(number) > v:
            number = np.nextafter(number, dtype(-np.inf))
        return float(number), float(number) == v

    low, high = map(float, drive)
    applied, ascending = first_moves(cascade, (low, high), not_above, lambda v: float(dtype(v)))
    if cascade.branches_differ and not cascade.inverse_problems():
        limits.hold[0] = 2.0 * error_bounds(cascade, arithmetic, engine).rounding
    limits.real_max[0] = largest
    reached = float(np.max(np.abs(np.array(limits).view(np.float64))))
    if reached > largest:
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
        start_level=reals(start_level, "outputs at which plays begin to follow", "pi"),
        inverse_slope=reals(
            [1.0 / c if c > 0 else 0.0 for c in slope], "reciprocals of the sums of weights", "pi", "weights"
        ),
        start=reals(pi.start if len(set(pi.start)) > 1 else pi.start[:1], "start states", "pi"),
        limits=LimitTable.of(limits.tolist(), dtype),
        applied=np.array(applied, dtype=dtype),
        ascending=np.array(ascending, dtype=np.int64),
        stage_kind=np.array(kinds, dtype=np.int64),
        stage_first=np.array(firsts, dtype=np.int64),
        stage_size=np.array(sizes, dtype=np.int64),
        stage_data=reals(numbers, "parameters of the memoryless stages", "memoryless"),
        **_corners(cascade, dtype, limits if bounded and not cascade.stages else None, seen),
        engine=slots.CORNERS if engine == "corners" else slots.LOOP,
        branches=int(cascade.branches_differ),
        tanh=kernels.TANH_TABLES[arithmetic],
        atanh=kernels.ATANH_TABLES[arithmetic],
    )
    for kind, first in zip(kinds, firsts, strict=True):
        if kind == slots.TANH:
            tables.stage_data[[first + 6, first + 13]] = np.nextafter(dtype(1), dtype(0))
    for j, w in ((2, pi.start[0]), (3, 0.0)):  # a move from outside enters through the end of the range
        tables.begin[j] = min(max(w, seen[0]), seen[1])
    if bounded:
        w = max(abs(x) for x in (*cascade.play_range, *pi.start))
        output = w * sum(abs(p) for p in pi.weights) + abs(lift[-1]) + abs(cascade.output_offset)
        most = 4 * max(output, w, pi.thresholds[-1]) * max(1.0, float(np.max(tables.inverse_slope)))
        reals([most], "intermediate results")
    return tables
