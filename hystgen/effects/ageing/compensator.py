"""Ageing: the gain as a function of the distance that the drive has travelled."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hystgen.basics.jit import Action, Answer, Scalar, inside, jit, zero
from hystgen.basics.structures import (
    AnyFactor,
    Count,
    FixedUInt8,
    Flag,
    FloatSignal,
    FourNarrow,
    Narrow,
    Signal,
    SmallCount,
    Struct,
    firsts,
    memory_of,
    note,
)
from hystgen.effects.ageing.model import ExponentialAgeing, LogarithmicAgeing, SeveralAgeing
from hystgen.effects.base import Place
from hystgen.effects.gains import (
    FLOATING,
    LARGEST_GAIN,
    LEAST_GAIN,
    MOST_CHANGE,
    GainLimits,
    Gains,
    following,
    newton_steps,
    too_fast,
)
from hystgen.effects.kinds import BlockKind, RowedTables, Rows, numbered
from hystgen.effects.part import (
    ChainPart,
    FloatSurroundings,
    Gained,
    Margin,
    One,
    Realized,
    Setting,
    Speed,
    Verbs,
    called,
    late,
)

Ageing = LogarithmicAgeing | ExponentialAgeing | SeveralAgeing

DECADES = 6
"""[decades above the longest travel] Range of a gain's table; beyond it the gain keeps its last value. A law whose
travel is a few moves over the range is then covered for a million times as many, in 65 pieces (1560 bytes in float32)
if the gain falls by 5 % per decade; each decade costs 11 pieces. Set by: benchmarks/chosen_numbers.py decades."""

TABLE_ERROR = 1e-6
"""[fraction of the output] Largest difference between a table and its gain, about the rounding of ten operations in
float32. A piece of a logarithmic law of 5 % per decade then ends at 1.23 times the travel where it begins: `0.05/2.3 *
6/384 * 0.23^4`. Set by: benchmarks/chosen_numbers.py decades."""


def losses(effect: ExponentialAgeing | SeveralAgeing) -> list[tuple[float, float]]:
    """The losses that level off, each with its travel."""
    if isinstance(effect, ExponentialAgeing):
        return [(effect.loss, effect.travel)]
    return list(zip(effect.losses, effect.travels, strict=True))


def gain(effect: Ageing, travelled: float) -> float:
    """The gain after a travel in input units."""
    if isinstance(effect, LogarithmicAgeing):
        return 1.0 - effect.loss * math.log10(1.0 + min(travelled / effect.travel, 1e300))
    return 1.0 + math.fsum(loss * math.expm1(-travelled / travel) for loss, travel in losses(effect))


def steepness(effect: Ageing, travelled: float) -> float:
    """Change of the gain per input unit travelled."""
    if isinstance(effect, LogarithmicAgeing):
        return -effect.loss / (math.log(10.0) * (effect.travel + travelled))
    return -math.fsum(loss / travel * math.exp(-travelled / travel) for loss, travel in losses(effect))


class AgeingPiece(Struct):
    """A piece of the gain over travel: a cubic in the travelled share of its length."""

    begin: Signal
    share: AnyFactor = note("of the travel since `begin` in the piece,")
    drop: FixedUInt8 = note("without the bits that the product leaves out")
    c: FourNarrow


@functools.lru_cache(maxsize=16)
def pieces(effect: Ageing) -> AgeingPiece:
    """The gain as cubic pieces (m,) in double precision.

    Each piece matches the gain's values and slopes at its ends and is as long as TABLE_ERROR allows.
    """
    travels = [effect.travel] if isinstance(effect, LogarithmicAgeing) else [travel for _, travel in losses(effect)]
    last = max(travels) * 10.0**DECADES if isinstance(effect, LogarithmicAgeing) else 20.0 * max(travels)
    rows = []
    at, length = 0.0, 0.25 * min(travels)
    while at < last:
        length *= 4.0
        row = _piece(effect, at, length)
        while _error(effect, row) > TABLE_ERROR:
            length *= 0.8
            row = _piece(effect, at, length)
        if not LEAST_GAIN <= gain(effect, at + length) <= LARGEST_GAIN:
            break
        rows.append(row)
        at += length
    return AgeingPiece.of(rows, np.float64)


def _piece(effect: Ageing, at: float, length: float) -> tuple[float, float, tuple[float, ...]]:
    a, b = gain(effect, at), gain(effect, at + length)
    da, db = (length * steepness(effect, x) for x in (at, at + length))
    return at, 1.0 / length, (a, da, 3.0 * (b - a) - 2.0 * da - db, 2.0 * (a - b) + da + db)


def _error(effect: Ageing, row: tuple[float, float, tuple[float, ...]]) -> float:
    """Largest difference from the gain at points inside a piece."""
    at, inverse, c = row
    shares = np.linspace(0.0, 1.0, 17)[1:-1]
    curve = ((c[3] * shares + c[2]) * shares + c[1]) * shares + c[0]
    pairs = zip(shares.tolist(), curve.tolist(), strict=True)
    return float(max(abs(gain(effect, at + x / inverse) - y) for x, y in pairs))


def most_at_once(effect: Ageing, span: float) -> float:
    """Largest relative change of the gain in one move over `span`."""
    places = [0.0, *pieces(effect).begin.tolist()]
    return max(abs(gain(effect, x + span) / gain(effect, x) - 1.0) for x in places)


def problems(effect: Ageing, at: Setting) -> Iterator[str]:
    """Why the C cannot follow the gain."""
    if effect in at.listed[1:]:
        yield "the model has more than one gain that follows the travel"
        return
    change = most_at_once(effect, at.ends[1] - at.ends[0])
    if len(pieces(effect)) == 0 or change > MOST_CHANGE:
        yield too_fast(change)


@dataclass(frozen=True)
class Aged(One):
    """The block of an ageing effect."""

    effect: Ageing

    def gained(self, speed: Speed, output: float, u: float, emitted: bool) -> Gained:
        """Properties of the gain; the C takes the gain from a table, at the travel one sample earlier."""
        late = most_at_once(self.effect, speed.step) + TABLE_ERROR if emitted else 0.0
        return Gained(1.0, LEAST_GAIN, LARGEST_GAIN, TABLE_ERROR * output * emitted, late * output)

    def grown(self, size: float, margin: Margin) -> float:
        """Largest output for inputs of magnitude up to `size`."""
        return size * LARGEST_GAIN

    def asked(self, given: float, asked: float, margin: Margin) -> float:
        """Largest answer of the inverse for outputs up to `asked`."""
        return asked / LEAST_GAIN


# ---------------------------------------------------------------- ageing.c


class AgeingTable(GainLimits):
    """Gain over travel up to `last`."""

    last: Signal
    n: Count
    turns: SmallCount = note("Newton steps for the reciprocal of a gain that has changed")
    bits: FixedUInt8 = note("of a gain below a code that sets it")


class AgeingState(Struct):
    """A gain that depends on the travel."""

    high: Signal = note("travel, in fixed point in drive codes;")
    low: FloatSignal = note("its rounding remainder")
    gain: Narrow
    inverse: Narrow
    own: Flag = note("the gain depends on the travel")


KIND = BlockKind("ageing", AgeingTable, AgeingState, Rows("piece", AgeingPiece), reading=(), own=("solve", "absorb"))


AgeingTables = RowedTables[AgeingTable, AgeingPiece]


def tables(blocks: Sequence[Aged], about: FloatSurroundings) -> AgeingTables:
    """The tables of several blocks in floating point."""
    curves = [pieces(one.effect) for one in blocks]
    span = about.ends[1] - about.ends[0]
    ends = [(*FLOATING.limits, each.begin[-1] + 1.0 / each.share[-1]) for each in curves]
    rows = about.reals(ends, "travels of the ageing")
    counts = [*map(len, curves)]
    turns = [newton_steps(most_at_once(one.effect, span), about.roundoff) for one in blocks]
    given = [(at, share, *c) for curve in curves for at, share, c in curve.tolist()]
    piece = about.reals(given, "travels of the ageing")
    return AgeingTables(
        AgeingTable.of([(*row, *n) for row, *n in zip(rows, counts, turns, strict=True)], rows.dtype),
        firsts(counts),
        AgeingPiece.of([(at, share, c) for at, share, *c in piece], piece.dtype),
    )


class UnevenAgeing:
    """The gain in double precision."""

    def __init__(self, effect: Ageing) -> None:
        self.effect, self.travelled = effect, 0.0

    def _travel(self, before: float, drive: float) -> float:
        return self.travelled + (0.0 if math.isnan(before) else abs(drive - before))

    def solve(self, y: float, before: float, drive: float, seconds: float) -> float:
        """The input that gives the output y if the drive goes from `before` to `drive`."""
        return y / gain(self.effect, self._travel(before, drive))

    def move(self, before: float, drive: float, seconds: float) -> None:
        """Note that the drive has moved from `before` to `drive`."""
        self.travelled = self._travel(before, drive)


@jit
def along(t: AgeingTables, k: int, travel: Scalar) -> Scalar:
    """The position of a travel in piece k, from 0 to 1; past the last piece it stays at 1."""
    share = (travel - t.row.begin[k]) * t.row.share[k]
    return t.block.one[0] if share > t.block.one[0] else share


@jit
def travel_on(t: AgeingTables, s: AgeingState, j: int, way: Scalar) -> None:
    """Add the length of a move to the travel."""
    change = way + s.low[j]
    high = s.high[j]
    following: Scalar = high + change
    if following > t.block.last[j]:
        following = t.block.last[j]
        change = following - high
    s.high[j] = following
    s.low[j] = change - (following - high)


def verbs(by: Gains, state: type[Struct], along: Answer, part_of: Answer, travel_on: Action) -> Verbs:
    """The verbs of ageing in an arithmetic, from its `along` and `travel_on`; `part_of`: the product of a gain and a
    position in a piece."""
    followed, times, reciprocal, given, put = following(by), by.times, by.reciprocal, by.given, by.put

    @jit
    def gain_at(t: AgeingTables, j: int, travel: Scalar) -> Scalar:
        """The gain at a travel."""
        low = t.first[j]
        high = t.first[j + 1]
        while high - low > 1:
            middle = (low + high) // 2
            if travel >= t.row.begin[middle]:
                low = middle
            else:
                high = middle
        share = along(t, low, travel)
        gain: Scalar = t.row.c[low, 3]
        for k in range(2, -1, -1):
            gain = part_of(gain, share) + t.row.c[low, k]
        return gain

    @jit
    def set_travel(t: AgeingTables, s: AgeingState, j: int, travel: Scalar) -> bool:
        """Set the travel. Returns whether it had to be limited."""
        taken = inside(travel, zero(t.block.last[j]), t.block.last[j])
        put(s, j, taken)
        s.own[j] = 1
        s.gain[j] = gain_at(t, j, taken)
        s.inverse[j] = reciprocal(t.block.one[j], s.gain[j])
        return bool(taken != travel)

    @jit
    def set_gain(t: AgeingTables, s: AgeingState, j: int, gain: Scalar) -> bool:
        """Set a gain that replaces the one from the travel. Returns whether it had to be limited."""
        asked = given(t.block, j, gain)
        s.own[j] = 0
        s.gain[j] = inside(asked, t.block.least[j], t.block.largest[j])
        s.inverse[j] = reciprocal(t.block.one[j], s.gain[j])
        return bool(s.gain[j] != asked)

    @jit
    def move(t: AgeingTables, s: AgeingState, j: int, before: Scalar, v: Scalar) -> None:
        """Note that the drive has moved from `before` to v."""
        way = v - before
        travel_on(t, s, j, way if way >= zero(way) else -way)
        if s.own[j]:
            s.gain[j] = gain_at(t, j, s.high[j])
            s.inverse[j] = followed(s.gain[j], s.inverse[j], t.block.two[j], t.block.turns[j])

    @jit(inline=True)
    def solve(t: AgeingTables, s: AgeingState, j: int, y: Scalar) -> Scalar:  # noqa: ARG001  block interface
        """The input that gives the output y."""
        return times(y, s.inverse[j])

    @jit(inline=True)
    def absorb(t: AgeingTables, s: AgeingState, j: int, x: Scalar) -> Scalar:  # noqa: ARG001  block interface
        """The output for the input x."""
        return times(x, s.gain[j])

    @jit
    def reset(t: AgeingTables, s: AgeingState, j: int) -> None:
        """Return to the state of the parameter file, a travel of 0."""
        set_travel(t, s, j, zero(t.block.last[j]))

    @jit
    def travelled(s: AgeingState, j: int) -> Scalar:
        """The distance travelled."""
        return s.high[j]

    return Verbs(
        memory_of(state), absorb=absorb, solve=solve, reset=reset, move=move,
        set_gain=set_gain, set_travel=set_travel, travelled=travelled,
    )


ARITHMETIC = Realized(
    verbs(FLOATING, AgeingState, along, FLOATING.product, travel_on), numbered(KIND, 5, 1), tables, kinds=(KIND,)
)

PART = ChainPart(
    "ageing", "ageing", Place.GAIN, called("ageing"), lambda effect, *_: Aged(effect),
    ARITHMETIC, late("ageing"), calls=("set_gain", "travel", "set_travel"),
    problems=problems, code=("ageing",), following=UnevenAgeing, longest=lambda t: float(t.block.last[0]),
    unreached=TABLE_ERROR,
)
"""Ageing as a part of the chain: a gain that depends on the travel, which the caller may set."""

PARTS = (PART,)
