"""Gain and offset that follow a logged column, as a block: the caller sets the column's value."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hystgen.basics.jit import Answer, Scalar, inside, jit, zero
from hystgen.basics.structures import (
    AnyFactor,
    Count,
    FixedUInt8,
    Flag,
    FloatSignal,
    Narrow,
    Signal,
    SmallCount,
    Struct,
    added,
    firsts,
    memory_of,
    note,
)
from hystgen.effects.base import Effect, Place, decays
from hystgen.effects.columns import Follower, Law
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
    Verbs,
    late,
)
from hystgen.plays.slots import MOST_COLUMNS, Counts, Reals


class GainTable(GainLimits):
    """Gain and offset per unit of a column above the reference, between two values of the column."""

    per_unit: AnyFactor
    offset_per_unit: AnyFactor
    reference: Signal
    lowest: Signal
    highest: Signal
    bits: FixedUInt8 = note("of a value below a code")


class GainState(Struct):
    """A gain with an offset behind it."""

    gain: Narrow
    inverse: Narrow
    offset: Signal


KIND = BlockKind("gain", GainTable, GainState, reading=(), own=("solve", "absorb"))


class CourseTable(Struct):
    """How gain and offset follow a column other than at once and along a line."""

    n: Count = note("plays of the column")
    turns: Count = note("Newton steps for the reciprocal of a gain that has changed")
    lags: SmallCount = note("1 if the column acts through a first-order lag")
    rate: AnyFactor = note("share of the distance that the lag covers in a step,")
    late: AnyFactor = note("and of a change within the step")
    inverse_reach: AnyFactor
    square: Signal = note("offset at the reach, of the column's square")
    cube: Signal = note("and cube")


class CoursePlay(Struct):
    """A play of a column."""

    threshold: Signal
    weight: AnyFactor


class CoursePlayState(Struct):
    """A play of a column."""

    at: Signal = note("value of the play")


class CourseState(Struct):
    """A column that has been set."""

    high: Signal = note("the column above its reference, behind the lag;")
    low: FloatSignal = note("its rounding remainder")
    now: Signal = note("the column, set last,")
    seen: Signal = note("and at the previous sample")
    begun: Flag = note("it has been set")


COURSE_KIND = BlockKind(
    "course", CourseTable, CourseState, Rows("play", CoursePlay, CoursePlayState), reading=(), own=()
)


class GainTables(NamedTuple):
    """All gains of a model: `block` (k,); `course` (k,), in use where `winding` (k,) is 1, with the plays of each from
    `first` (k + 1) on in `play` (m,); `entry` (k,): the index of its setting, -1 for the temperature; `unit` (k,): the
    value by which a caller sets it per unit of the column, 1 or codes; `middle` (k,): where the gain is 1, in units,
    and `lowest`, `highest` (k,): where the column is limited."""

    block: GainTable
    course: CourseTable
    winding: Counts
    first: Counts
    play: CoursePlay
    entry: Counts
    unit: Reals
    middle: Reals
    lowest: Reals
    highest: Reals


class GainMemory(NamedTuple):
    """Memory of all gains: `block` (k,), `course` (k,), and of the plays, `play` (m,)."""

    block: GainState
    course: CourseState
    play: CoursePlayState


@dataclass(frozen=True)
class LimitedLaw:
    """A law between two values of its column: the largest `reach` above or below the reference, and the largest slope
    of the offset there."""

    law: Law
    lowest: float
    highest: float

    @property
    def reach(self) -> float:
        """Largest distance from the reference."""
        return max(abs(self.lowest - self.law.reference), abs(self.highest - self.law.reference))

    @property
    def slope(self) -> float:
        """Largest change of the offset per unit of the column."""
        return self.law.steepest + sum(k * abs(c) * self.reach ** (k - 1) for k, c in enumerate(self.law.curve, 2))

    def powers(self) -> tuple[float, float]:
        """The offset that the curve's square, and its cube, add at the reach."""
        square, cube, *_ = (*self.law.curve, 0.0, 0.0)
        return square * self.reach**2, cube * self.reach**3

    def steps(self, seconds: float) -> tuple[float, float]:
        """Share of the distance that the lag covers in a step, and of a change within the step."""
        late = self.law.time_constant
        _, _, within = decays(np.array([seconds]), late)
        return -math.expm1(-seconds / late) if late else 1.0, float(within[0])

    def change(self, seconds: float) -> float:
        """Largest relative change of the gain in a step."""
        way = min(sum(self.steps(seconds)), 1.0) * (self.highest - self.lowest)
        return abs(self.law.gain) * way / LEAST_GAIN if self.law.time_constant else 0.0


def limited(law: Law, span: float) -> LimitedLaw:
    """A law between the values of its column up to which the gain stays within its limits, and the offset within the
    `span` of the output."""
    ends = [math.inf]
    if law.gain:
        ends += [(limit - 1.0) / law.gain for limit in (LEAST_GAIN, LARGEST_GAIN)]
    if law.steepest or any(law.curve):
        farthest = span / law.steepest if law.steepest else math.inf
        if any(law.curve):
            terms = [law.steepest, *map(abs, law.curve)]
            low, high = 0.0, min([farthest, *((span / c) ** (1.0 / k) for k, c in enumerate(terms, 1) if c)])
            for _ in range(60):  # halvings: more than a double has bits
                middle = 0.5 * (low + high)
                within = sum(c * middle**k for k, c in enumerate(terms, 1)) <= span
                low, high = (middle, high) if within else (low, middle)
            farthest = low
        ends += [farthest, -farthest]
    up = min((end for end in ends if end > 0.0), default=math.inf)
    down = max((end for end in ends if end < 0.0), default=-math.inf)
    largest = 1e6  # units; if the column has no effect
    lowest, highest = law.reference + max(down, -largest), law.reference + min(up, largest)
    return LimitedLaw(law, max(lowest, law.ends[0]), min(highest, law.ends[1]))


@dataclass(frozen=True)
class Followed(One):
    """The block of an effect that follows a column."""

    effect: Follower

    def gained(self, speed: Speed, output: float, u: float, emitted: bool) -> Gained:
        """Properties of the gain, and roundings of the column on its way to the offset.

        A lag adds less than 16 roundings: its state has a remainder, so each step rounds only its own move, four times,
        and loses that error again at the rate at which it moves; two coefficients are rounded as well.
        """
        law, wide = self.effect.law, limited(self.effect.law, output)
        if self.effect.columns:  # the temperature
            return Gained(1.0, LEAST_GAIN, LARGEST_GAIN, 0.0, 0.0)
        reach = min(wide.reach, 1e6)
        column = u * (abs(law.reference) + (17.0 if law.time_constant else 1.0) * reach)
        own = u * (4.0 + len(law.weights)) * min(law.steepest * reach, output)
        own += u * 8.0 * math.fsum(map(abs, wide.powers()))
        wrong = column * (abs(law.gain) * output + wide.slope) + own
        return Gained(9.0 if law.time_constant else 1.0, LEAST_GAIN, LARGEST_GAIN, wrong, wrong)

    def grown(self, size: float, margin: Margin) -> float:
        """Largest output for inputs of magnitude up to `size`."""
        return size * LARGEST_GAIN + margin.span

    def asked(self, given: float, asked: float, margin: Margin) -> float:
        """Largest answer of the inverse for outputs up to `asked`."""
        return (asked + margin.span) / LEAST_GAIN


def entries(blocks: Sequence[Followed]) -> Counts:
    """The index of the setting of each block, in the order of the file; -1 for the temperature's."""
    count = 0
    found = []
    for one in blocks:
        found.append(-1 if one.effect.columns else count)
        count += not one.effect.columns
    return np.array(found, dtype=np.int64)


def tables(blocks: Sequence[Followed], about: FloatSurroundings) -> GainTables:
    """The tables of several gains in floating point."""
    laws = [limited(one.effect.law, about.span) for one in blocks]
    given = [
        (*FLOATING.limits, wide.law.gain, wide.law.offset, wide.law.reference, wide.lowest, wide.highest)
        for wide in laws
    ]
    rows = about.reals(given, "gains")
    ways = [(*wide.steps(about.seconds), 1.0 / wide.reach, *wide.powers()) for wide in laws]
    numbers = about.reals(ways, "responses to a column")
    pairs = [each for wide in laws for each in zip(wide.law.thresholds, wide.law.weights, strict=True)]
    plays = about.reals(pairs, "plays of a column")
    turns = [newton_steps(wide.change(about.seconds), about.roundoff) for wide in laws]
    counts = [(len(wide.law.weights), n, wide.law.time_constant > 0.0) for wide, n in zip(laws, turns, strict=True)]
    return GainTables(
        GainTable.of(rows, rows.dtype),
        CourseTable.of([(*count, *row) for count, row in zip(counts, numbers, strict=True)], rows.dtype),
        np.array([not wide.law.plain for wide in laws], dtype=np.int64),
        firsts(len(wide.law.weights) for wide in laws),
        CoursePlay.of(plays, rows.dtype),
        entries(blocks),
        np.ones(len(laws)),
        np.array([wide.law.reference for wide in laws]),
        np.array([wide.lowest for wide in laws]),
        np.array([wide.highest for wide in laws]),
    )


def courses(t: GainTables) -> Iterator[Constants | None]:
    """How each gain follows its column, or None if at once and along a line."""
    for j, row in enumerate(t.course):
        n = int(row["n"])
        if not t.winding[j]:
            yield None
            continue
        products = 5 + n + (2 + 2 * int(row["turns"])) * int(row["lags"])
        yield Constants(COURSE_KIND, row, (products, 0), t.play[t.first[j] : t.first[j + 1]])


def gain_verbs(by: Gains, add: Answer) -> Verbs:
    """The verbs of a gain in an arithmetic. `add`: adds to the state of a lag, and returns it."""
    times, reciprocal, scaled, given, put = by.times, by.reciprocal, by.scaled, by.given, by.put
    followed = following(by)

    @jit
    def reset(t: GainTables, s: GainMemory, j: int) -> None:
        """Return to the state of the parameter file: gain 1, offset 0."""
        nothing = zero(t.block.one[j])
        s.block.gain[j] = t.block.one[j]
        s.block.inverse[j] = t.block.one[j]
        s.block.offset[j] = nothing
        put(s.course, j, nothing)
        s.course.now[j] = nothing
        s.course.seen[j] = nothing
        s.course.begun[j] = 0
        for i in range(t.first[j], t.first[j + 1]):
            s.play.at[i] = nothing

    @jit
    def bent(t: GainTables, s: GainMemory, j: int, above: Scalar) -> Scalar:
        """The offset of a column's curve and plays, which follow the column."""
        share = scaled(above, t.course.inverse_reach, j)
        total = times(times(t.course.square[j] + times(t.course.cube[j], share), share), share)
        for i in range(t.first[j], t.first[j + 1]):
            s.play.at[i] = inside(s.play.at[i], above - t.play.threshold[i], above + t.play.threshold[i])
            total = total + scaled(s.play.at[i], t.play.weight, i)
        return total

    @jit
    def settle(t: GainTables, s: GainMemory, j: int, above: Scalar) -> bool:
        """Set gain and offset by a column that is `above` its reference. Returns whether the gain had to be limited."""
        wanted = t.block.one[j] + scaled(above, t.block.per_unit, j)
        offset = scaled(above, t.block.offset_per_unit, j)
        if t.winding[j]:
            offset = offset + bent(t, s, j, above)
        s.block.offset[j] = offset
        s.block.gain[j] = inside(wanted, t.block.least[j], t.block.largest[j])
        return bool(s.block.gain[j] != wanted)

    @jit
    def set_column(t: GainTables, s: GainMemory, j: int, entry: int, value: Scalar) -> bool:
        """Set the column of a block. Returns whether it, or the gain, had to be limited."""
        if t.entry[j] != entry:
            return False
        asked = given(t.block, j, value)
        taken = inside(asked, t.block.lowest[j], t.block.highest[j])
        above = taken - t.block.reference[j]
        limited = bool(taken != asked)
        s.course.now[j] = above
        if t.course.lags[j] and s.course.begun[j]:
            return limited
        s.course.begun[j] = 1
        s.course.seen[j] = above
        put(s.course, j, above)
        limited = settle(t, s, j, above) or limited
        s.block.inverse[j] = reciprocal(t.block.one[j], s.block.gain[j])
        return limited

    @jit
    def tick(t: GainTables, s: GainMemory, j: int) -> None:
        """A sample has passed: the lag moves on. A column behind a lag is at rest where it was first set."""
        if t.course.lags[j] and s.course.begun[j]:
            seen = s.course.seen[j]
            s.course.seen[j] = s.course.now[j]
            way = scaled(seen - s.course.high[j], t.course.rate, j)
            above = add(s.course, j, way + scaled(s.course.now[j] - seen, t.course.late, j))
            settle(t, s, j, above)
            inverse = s.block.inverse[j]
            s.block.inverse[j] = followed(s.block.gain[j], inverse, t.block.two[j], t.course.turns[j])

    @jit(inline=True)
    def solve(t: GainTables, s: GainMemory, j: int, y: Scalar) -> Scalar:  # noqa: ARG001  block interface
        """The input that gives the output y."""
        return times(y - s.block.offset[j], s.block.inverse[j])

    @jit(inline=True)
    def absorb(t: GainTables, s: GainMemory, j: int, x: Scalar) -> Scalar:  # noqa: ARG001  block interface
        """The output for the input x."""
        return times(x, s.block.gain[j]) + s.block.offset[j]

    return Verbs(
        memory_of(GainMemory), absorb=absorb, solve=solve, reset=reset, set_column=set_column, tick=tick
    )


def problems(effect: Effect, at: Setting) -> Iterator[str]:
    """Why the C cannot follow the column."""
    assert isinstance(effect, Follower)
    change = limited(effect.law, 1.0).change(at.seconds) if effect.law.gain else 0.0
    if change > MOST_CHANGE:
        yield too_fast(change)
    if sum(not each.columns for each in at.listed) > MOST_COLUMNS:
        yield f"is one of more than {MOST_COLUMNS} columns; remove some"


def calls(t: GainTables) -> Iterator[str]:
    """The calls that set the columns."""
    found = t.entry.tolist()
    if -1 in found:
        yield "set_temperature"
    if max(found, default=-1) >= 0:
        yield "set_influence"


ARITHMETIC = Realized(
    gain_verbs(FLOATING, added), numbered(KIND, 1, 1), tables, kinds=(KIND, COURSE_KIND), beside=courses,
)

PART = ChainPart(
    "gain", "a column", Place.GAIN, lambda effect: isinstance(effect, Follower),
    lambda effect, *_: Followed(effect), ARITHMETIC, late("influence"),
    problems=problems, code=("gain",), told=calls,
)

PARTS = (PART,)
