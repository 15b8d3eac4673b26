"""Gain and offset that follow the drive's own heat, as a block."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from hystgen.basics.jit import Answer, N, Scalar, jit, zero
from hystgen.basics.structures import (
    AnyFactor,
    Count,
    FixedUInt8,
    Flag,
    FloatSignal,
    Literal,
    Narrow,
    Signal,
    Struct,
    added,
    firsts,
    memory_of,
    note,
)
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
from hystgen.effects.kinds import BlockKind, Constants, Rows, numbered
from hystgen.effects.part import (
    ChainPart,
    FloatSurroundings,
    Gained,
    Margin,
    One,
    Realized,
    Setting,
    Speed,
    Unmeasured,
    Verbs,
    called,
    late,
)
from hystgen.effects.thermal.model import HysteresisHeating, OwnHeat, lost_on
from hystgen.plays.slots import Counts


@dataclass(frozen=True)
class Warm(One):
    """The block of own heat."""

    effect: OwnHeat

    def gained(self, speed: Speed, output: float, u: float, emitted: bool) -> Gained:
        """Properties of the gain; the C ignores the heat of the present sample."""
        effect = self.effect
        degree = abs(effect.gain_per_degree) * output + abs(effect.offset_per_degree)
        _, least, largest = reached(effect, *speed)
        warmed = most_at_once(effect, *speed) * degree if emitted else 0.0
        wrong = misjudged(effect, speed, u, emitted) * degree
        return Gained(9.0, least, largest, wrong, warmed + wrong)  # the temperature has roundings too

    def farthest(self, ends: tuple[float, float], span: float, seconds: float) -> float:
        """Largest move of a drive within `ends` that may be repeated in every step; `span`: of the output."""
        return farthest(self.effect, ends, span, seconds)

    def grown(self, size: float, margin: Margin) -> float:
        """Largest output for inputs of magnitude up to `size`."""
        return size * LARGEST_GAIN + margin.span

    def asked(self, given: float, asked: float, margin: Margin) -> float:
        """Largest answer of the inverse for outputs up to `asked`."""
        return (asked + margin.span) / LEAST_GAIN


# ---------------------------------------------------------------- heat.c


class HeatTable(GainLimits):
    """Self-heating: degrees gained per amount of heating, the share lost in a step, and the rise up to which gain and
    offset follow."""

    rate: AnyFactor
    per_amount: AnyFactor
    per_degree: AnyFactor
    offset_per_degree: AnyFactor
    hottest: Signal
    turns: Count = note("Newton steps for the reciprocal of a gain that has changed")
    coarse: FixedUInt8 = note("bits of an amount that its product leaves out,")
    lift: FixedUInt8 = note("bits of the temperature that the same product leaves out,")
    drop: FixedUInt8 = note("and bits that products of the temperature leave out")


class HeatState(Struct):
    """Self-heating."""

    high: Signal = note("rise of the temperature over the surroundings;")
    low: FloatSignal = note("its rounding remainder")
    gain: Narrow
    inverse: Narrow
    offset: Signal


HEAT_KIND = BlockKind("heat", HeatTable, HeatState, reading=(), own=("solve", "absorb"))


class FrictionPlay(Struct):
    """A friction play."""

    threshold: Signal


class FrictionTable(Struct):
    """Friction plays, the smallest threshold first."""

    n: Count
    one: Literal
    two: Literal
    bits: FixedUInt8 = note("of a play below a drive code")


class FrictionPlayState(Struct):
    """A friction play."""

    at: Narrow = note("value of the play")


class FrictionState(Struct):
    """Friction plays."""

    begun: Flag = note("the plays have values")


FRICTION_KIND = BlockKind(
    "friction", FrictionTable, FrictionState, Rows("play", FrictionPlay, FrictionPlayState), reading=(), own=()
)
HEAT_KINDS = HEAT_KIND, FRICTION_KIND

FRICTION_PLAYS = 16
"""Plays that represent the continuum of rubbing plays: loops heat as with the continuum, to within a thousandth of the
largest rise, see `coarseness`. Set by: tests/test_fixed_chain.py -k fastest_rate; with 8 plays the bound was 6.7 times
the error in that test, with 16 it is 5.3 times."""


class HeatTables(NamedTuple):
    """Own heat of a model: `block` (k,); `friction` (k,), without plays if the drive's square is the heat; `play` (m,):
    the rubbing plays, those of each block from `first` (k + 1) on."""

    block: HeatTable
    friction: FrictionTable
    first: Counts
    play: FrictionPlay


class HeatMemory(NamedTuple):
    """Memory of all blocks: `block` (k,), and of the rubbing plays, `friction` (k,) and `play` (m,)."""

    block: HeatState
    friction: FrictionState
    play: FrictionPlayState


def reach(effect: HysteresisHeating, ends: tuple[float, float]) -> float:
    """The largest threshold of plays that a drive within `ends` can move."""
    return min(effect.reach, ends[1] - ends[0])


def thresholds(effect: OwnHeat, ends: tuple[float, float]) -> list[float]:
    """Thresholds of the rubbing plays, at the centres of equal parts of their reach; none without friction."""
    if not isinstance(effect, HysteresisHeating):
        return []
    half = 0.5 * reach(effect, ends) / FRICTION_PLAYS
    return [(2 * i + 1) * half for i in range(FRICTION_PLAYS)]


def per_amount(effect: OwnHeat, ends: tuple[float, float], seconds: float) -> float:
    """Final temperature rise per unit of heat in each step; heat is the change of the drive's signed square, or the sum
    of the rubbing plays' moves, each times its threshold as an odd multiple of the first."""
    if not isinstance(effect, HysteresisHeating):
        return effect.heating * 0.25 / seconds
    cell = reach(effect, ends) / FRICTION_PLAYS
    return effect.heating * 0.5 * cell * cell / seconds


def most_amount(effect: OwnHeat, ends: tuple[float, float], move: float) -> float:
    """Largest heat of a step in which the drive moves by `move` within `ends`: a play with threshold r moves no farther
    than the drive can go beyond r."""
    if isinstance(effect, HysteresisHeating):
        span = ends[1] - ends[0]
        ways = (min(move, max(span - r, 0.0)) for r in thresholds(effect, ends))
        return math.fsum((2 * i + 1) * way for i, way in enumerate(ways))
    largest = max(map(abs, ends))
    inward, outward = min(move, largest), min(max(move - largest, 0.0), largest)
    return inward * (2.0 * largest - inward) + outward * outward


def lost(effect: OwnHeat, seconds: float) -> float:
    """Fraction of a temperature rise that is lost in a step."""
    return -math.expm1(-seconds / effect.time_constant)


def risen(effect: OwnHeat, rise: float, heat: float, seconds: float) -> float:
    """The temperature rise after a step whose heat, if sustained, would cause a final rise of `heat`."""
    return rise + lost(effect, seconds) * (heat - rise)


def most_at_once(effect: OwnHeat, ends: tuple[float, float], move: float, seconds: float) -> float:
    """Largest rise in one step in which the drive moves by `move` within `ends`."""
    return risen(effect, 0.0, per_amount(effect, ends, seconds) * most_amount(effect, ends, move), seconds)


def farthest(effect: OwnHeat, ends: tuple[float, float], span: float, seconds: float) -> float:
    """Largest move of the drive within `ends` that may be repeated in every step without exceeding the temperature that
    the C can follow. `span`: as in `heat_numbers`."""
    hottest = heat_numbers(effect, ends, span, seconds)[-1]
    amount = hottest / per_amount(effect, ends, seconds) if effect.heating else math.inf
    if isinstance(effect, HysteresisHeating):
        return amount / FRICTION_PLAYS**2  # all plays follow
    largest = max(map(abs, ends))
    if amount < largest * largest:
        return amount / (largest + math.sqrt(largest * largest - amount))  # from the end of the range inwards
    return largest + math.sqrt(amount - largest * largest)


def reached(effect: OwnHeat, ends: tuple[float, float], move: float, seconds: float) -> tuple[float, float, float]:
    """The largest temperature rise from a drive that moves by at most `move` per step within `ends`, and the smallest
    and largest gain up to that rise."""
    warmest = most_at_once(effect, ends, move, seconds) / lost(effect, seconds)
    gain = min(max(1.0 + effect.gain_per_degree * warmest, LEAST_GAIN), LARGEST_GAIN)
    return warmest, min(gain, 1.0), max(gain, 1.0)


def coarseness(effect: OwnHeat, ends: tuple[float, float], move: float, seconds: float) -> float:
    """How far the rise can be from that caused by the continuum of plays, in degrees, for moves up to `move` per step.

    After a move of 2x from a turning point, the plays up to x follow. With plays only at the centres of n cells of
    width h, the loss per unit of the move is off by `g(x) = x^2/2 - h sum r_i`, which within a cell is first positive,
    then negative, and `|integral of g from 0 to x| <= 0.0873 h^2 x`, reached at `x = (3/4)^(1/3) h`. By rainflow
    counting, any drive consists of whole runs from a turning point, with x from 0 on, and of runs already under way at
    its start. In each direction the x of the latter only grows, so they are wrong by at most the integral of the
    negative parts of 2 g over the reach, `h reach^2/8 (1 + 2/(3n))`; the positive parts contribute less. The
    temperature decays, so no later loss has less weight than an earlier one.
    """
    if not isinstance(effect, HysteresisHeating):
        return 0.0
    top = reach(effect, ends)
    cell = top / FRICTION_PLAYS
    begun = 0.25 * cell * top * top * (1.0 + 2.0 / (3.0 * FRICTION_PLAYS)) * lost(effect, seconds)
    return effect.heating * (0.0873 * cell * cell * move + begun) / seconds


def misjudged(effect: OwnHeat, speed: Speed, u: float, emitted: bool) -> float:
    """Error of the rise caused by the rubbing plays, in degrees; `emitted`: against the continuum of plays."""
    widths = thresholds(effect, speed.ends)
    if not widths:
        return 0.0
    # a play is off by one rounding, or by three if it stays only because another one does
    amount = len(widths) ** 2 * 4.0 * u * (max(map(abs, speed.ends)) + widths[-1])
    amount += (len(widths) + 3.0) * u * most_amount(effect, speed.ends, speed.step)
    found = amount * per_amount(effect, speed.ends, speed.seconds)
    return found + coarseness(effect, *speed) if emitted else found


def heat_numbers(
    effect: OwnHeat, ends: tuple[float, float], span: float, seconds: float
) -> tuple[float, float, float, float, float]:
    """Constants of a block for an output that spans `span` and drives within `ends`, at steps of `seconds`."""
    hot = [1e6]  # degrees; if the temperature has no effect
    if effect.gain_per_degree:
        hot += [(limit - 1.0) / effect.gain_per_degree for limit in (LEAST_GAIN, LARGEST_GAIN)]
    if effect.offset_per_degree:
        hot.append(span / abs(effect.offset_per_degree))
    loss = lost(effect, seconds)
    per = loss * per_amount(effect, ends, seconds)
    hottest = min(end for end in hot if end > 0.0)
    return loss, per, effect.gain_per_degree, effect.offset_per_degree, hottest


def heat_problems(effect: OwnHeat, at: Setting) -> Iterator[str]:
    """Why the C cannot follow the gain."""
    if (change := heat_change(effect, at.ends, at.seconds)) > MOST_CHANGE:
        yield too_fast(change)


def heat_change(effect: OwnHeat, ends: tuple[float, float], seconds: float) -> float:
    """Largest relative change of the gain in one move over the range."""
    return abs(effect.gain_per_degree) * most_at_once(effect, ends, ends[1] - ends[0], seconds) / LEAST_GAIN


def heat_tables(blocks: Sequence[Warm], about: FloatSurroundings) -> HeatTables:
    """The tables of several blocks in floating point."""
    effects: list[Any] = [one.effect for one in blocks]
    ends, seconds = about.ends, about.seconds
    turns = [newton_steps(heat_change(each, ends, seconds), about.roundoff) for each in effects]
    widths = [thresholds(each, ends) for each in effects]
    given = [(*FLOATING.limits, *heat_numbers(each, ends, about.span, seconds)) for each in effects]
    rows = about.reals(given, "temperatures")
    play = about.reals([(r,) for each in widths for r in each], "thresholds")
    return HeatTables(
        HeatTable.of([(*row, n) for row, n in zip(rows, turns, strict=True)], rows.dtype),
        FrictionTable.of([(len(each), 1.0, 2.0) for each in widths], rows.dtype),
        firsts(map(len, widths)),
        FrictionPlay.of(play, play.dtype),
    )


@jit
def heat_way(before: N, v: N) -> N:
    """Absolute change of the drive's signed square."""
    way = (v * v if v >= zero(v) else -(v * v)) - (before * before if before >= zero(v) else -(before * before))
    return way if way >= zero(v) else -way


@jit
def warmed(t: HeatTable, s: HeatState, j: int, amount: Scalar) -> Scalar:
    """Absorb the heat of a step. Returns the temperature rise."""
    return added(s, j, t.per_amount[j] * amount - t.rate[j] * s.high[j])


def heat_verbs(
    by: Gains, memory: Callable[..., object], warmed: Answer, narrowed: Answer, entered: Answer
) -> Verbs:
    """The verbs of own heat in an arithmetic. `warmed`: as above; `narrowed`: a gain brought back within limits that
    rounding may have exceeded; `entered`: a drive as a position of the rubbing plays."""
    times, scaled, put, followed, rub = by.times, by.scaled, by.put, following(by), friction_move(entered)

    @jit
    def reset(t: HeatTables, s: HeatMemory, j: int) -> None:
        """Return to the temperature of the surroundings."""
        put(s.block, j, zero(t.block.one[j]))
        s.block.gain[j] = t.block.one[j]
        s.block.inverse[j] = t.block.one[j]
        s.block.offset[j] = zero(t.block.one[j])
        s.friction.begun[j] = 0

    @jit
    def move(t: HeatTables, s: HeatMemory, j: int, before: Scalar, v: Scalar) -> None:
        """Note that the drive has moved from `before` to v."""
        amount = rub(t, s, j, before, v) if t.friction.n[j] else heat_way(before, v)
        warm = warmed(t.block, s.block, j, amount)
        rise = t.block.hottest[j] if warm > t.block.hottest[j] else warm
        gain = narrowed(t.block, j, t.block.one[j] + scaled(rise, t.block.per_degree, j))
        s.block.gain[j] = gain
        s.block.inverse[j] = followed(gain, s.block.inverse[j], t.block.two[j], t.block.turns[j])
        s.block.offset[j] = scaled(rise, t.block.offset_per_degree, j)

    @jit(inline=True)
    def solve(t: HeatTables, s: HeatMemory, j: int, y: Scalar) -> Scalar:  # noqa: ARG001  block interface
        """The input that gives the output y."""
        return times(y - s.block.offset[j], s.block.inverse[j])

    @jit(inline=True)
    def absorb(t: HeatTables, s: HeatMemory, j: int, x: Scalar) -> Scalar:  # noqa: ARG001  block interface
        """The output for the input x."""
        return times(x, s.block.gain[j]) + s.block.offset[j]

    return Verbs(memory, absorb=absorb, solve=solve, reset=reset, move=move)


# ---------------------------------------------------------------- friction.c

def friction_constants(t: HeatTables, each: int = 1) -> Iterator[Constants | None]:
    """The rubbing plays of each block, with `each` products per play; None if the block has none."""
    for row, first in zip(t.friction, t.first, strict=False):
        n = int(row["n"])
        yield Constants(FRICTION_KIND, row, (each * n, 0), t.play[first : first + n]) if n else None


def friction_move(entered: Answer) -> Answer:
    """A function that moves the drive to v; the first time, the plays start at `before`. It returns the sum of their
    moves, each times its threshold as an odd multiple of the first. If a play stays, so do those with larger
    thresholds. `entered`: a drive as a position of the plays."""

    @jit
    def move(t: HeatTables, s: HeatMemory, j: int, before: Scalar, v: Scalar) -> Scalar:
        if not s.friction.begun[j]:
            s.friction.begun[j] = 1
            for i in range(t.first[j], t.first[j + 1]):
                s.play.at[i] = entered(t.friction, j, before)
        x = entered(t.friction, j, v)
        amount = zero(x)
        odd = t.friction.one[j]
        for i in range(t.first[j], t.first[j + 1]):
            r = t.play.threshold[i]
            at = s.play.at[i]
            if x - r > at:
                to = x - r
                amount = amount + odd * (to - at)
            elif x + r < at:
                to = x + r
                amount = amount + odd * (at - to)
            else:
                break
            s.play.at[i] = to
            odd = odd + t.friction.two[j]
        return amount

    return move


# ---------------------------------------------------------------- at steps of any length


class UnevenHeat:
    """A temperature that follows the heat of a drive, with the turning points that friction remembers."""

    def __init__(self, effect: OwnHeat) -> None:
        self.effect, self.rise = effect, 0.0
        self.first, self.corner, self.depth, self.up = math.nan, np.empty(16), 0, True

    def _heat(self, before: float, drive: float, seconds: float) -> tuple[float, int, bool]:
        """Final rise for the heat of a move, and the state of friction after the move."""
        effect = self.effect
        if isinstance(effect, HysteresisHeating):
            if self.depth == len(self.corner):
                self.corner = np.append(self.corner, np.empty_like(self.corner))
            energy, depth, up = lost_on(before, drive, self.first, effect.reach, self.corner, self.depth, self.up)
            return effect.heating * energy / seconds, depth, up
        return effect.heating * 0.25 * heat_way(before, drive) / seconds, 0, True

    def _risen(self, before: float, drive: float, seconds: float) -> float:
        """The rise after the drive has moved from `before` to `drive`; unchanged at the first sample."""
        if math.isnan(before) or math.isnan(drive) or seconds == 0.0:
            return self.rise
        return risen(self.effect, self.rise, self._heat(before, drive, seconds)[0], seconds)

    def solve(self, y: float, before: float, drive: float, seconds: float) -> float:
        """The input that gives the output y if the drive goes from `before` to `drive`."""
        rise = self._risen(before, drive, seconds)
        return (y - self.effect.offset_per_degree * rise) / (1.0 + self.effect.gain_per_degree * rise)

    def move(self, before: float, drive: float, seconds: float) -> None:
        """Note that the drive has moved from `before` to `drive`."""
        if math.isnan(before):
            self.first = drive
        elif seconds > 0.0:
            self.rise = self._risen(before, drive, seconds)
            _, self.depth, self.up = self._heat(before, drive, seconds)


HEAT_ARITHMETIC = Realized(
    heat_verbs(FLOATING, memory_of(HeatMemory), warmed, FLOATING.given, FLOATING.given),
    numbered(HEAT_KIND, 7, 1), heat_tables, kinds=HEAT_KINDS, beside=friction_constants,
)

HEAT_PART = ChainPart(
    "heat", "own heat", Place.GAIN, called("thermal", lambda effect: not effect.read),
    lambda effect, *_: Warm(effect), HEAT_ARITHMETIC,
    late("thermal", "HEAT_ARITHMETIC"),
    problems=heat_problems, following=UnevenHeat,
    unmeasured=Unmeasured(
        "self_heating",
        "the drive's own heat, open loop: the temperature also changes with the room's; measure it, or have it "
        "followed by emit.compensation.compensate: [self_heating]",
        "thermal from the drive's own heat (the temperature is not measured, and changes with the room's",
    ),
    code=("heat", "friction"), counted=lambda t, blocks: (blocks, int(t.friction.n.any())),
)
"""A temperature caused by the drive's own heat, as a part of the chain."""

PARTS = (HEAT_PART,)
