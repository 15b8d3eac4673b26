"""A lag as a block: its exactly invertible part is inverted exactly; the remainder is of second order."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics.jit import N, Scalar, inside, jit, zero
from hystgen.basics.structures import (
    AnyFactor,
    FixedSignal,
    FixedUInt8,
    FloatReal,
    FloatSignal,
    Signal,
    Struct,
    added,
    memory_of,
    note,
)
from hystgen.effects.base import Block, Place, decays
from hystgen.effects.kinds import BlockKind, Constants
from hystgen.effects.lag.model import Lag
from hystgen.effects.part import ChainPart, Led, Margin, One, Realized, Responses, Verbs, called, late
from hystgen.plays.slots import Counts

LONG_STEP = 2.0
"""[time constants per step] From this step length on the lag is inverted exactly. The inverse's pole is then above
-0.53, so its response to one sample falls to 1 % in seven; its gain from reference to drive is 4.2, against 2.2 for the
lead, and would be 13 with steps half as long. The lead leaves an error of 0.3 % on a sine of 40 steps. Set by:
benchmarks/chosen_numbers.py lag."""

MOST_LED = 2.0
"""[times the previous move] Largest move of a target that is led in full in front of two branches: otherwise a step is
led beyond its end, from where the drive has to turn back. A step of 0.2 um out of a slow ramp overshoots by 0.002 um,
without the limit by 0.1 um. The error on a sine of 100 samples from rest is 0.0032 um rms with 2 or more, 0.0045 um
with 1. Set by: benchmarks/chosen_numbers.py branches."""


@dataclass(frozen=True)
class LagNumbers(One):
    """Whether the inverse is `exact`, and constants: `rate` is 1 - E, `late` is b1; `second` and `inverse` are b0 and
    1/b1 if exact, otherwise theta and 1/(1 - E)."""

    exact: bool
    rate: float
    second: float
    late: float
    inverse: float

    @property
    def lead(self) -> float:
        """Largest gain of its inverse."""
        rate, second = self.rate, self.second
        return (2.0 - rate) / (self.late - second) if self.exact else (1.0 + 2.0 * second) * (2.0 - rate) / rate

    @property
    def room(self) -> float:
        """Largest gain from its input to an intermediate result."""
        return 2.0 / (self.late if self.exact else self.rate)

    @property
    def misses(self) -> bool:
        """Whether the output differs from the one solved for."""
        return not self.exact

    def rounding(self, size: float, u: float) -> tuple[float, float]:
        """Rounding errors of the output for inputs up to `size`; those of the inverse are in `led`."""
        return u * size * (8.0 + u / self.rate), 0.0

    def led(self, error: float, drive: float, u: float, same: bool, turning: bool) -> float:
        """Error of the input caused by an error of the requested output.

        If the states have seen the same drives, it is `goal/rate`. The goal includes the error W of the previous
        target, which includes those of earlier targets: `W = theta^2 e + theta (1 - theta) W`.
        """
        rate, theta = self.rate, self.second
        if self.exact:
            return ((2.0 - rate) * error + 8.0 * u * drive) / (self.late - self.second)
        states = u * drive * (5.0 + u / rate)
        farthest = (1.0 + 2.0 * theta) / (1.0 - theta)
        before = shifted(theta, turning) if same else farthest
        goal = before * error + farthest * states + 6.0 * u * drive
        return (goal + states) * (1.0 if same else 2.0 - rate) / rate + u * drive * (2.0 + 6.0 / rate)

    def respond(self, z: NDArray[np.complex128], found: Responses) -> Responses:
        """The responses with this lag added to the other blocks."""
        rate, second = self.rate, self.second
        if self.exact:
            return found._replace(led=found.led * (1.0 - (1.0 - rate) * z) / (self.late + second * z))
        led = found.led * (1.0 + second - second * z) * (1.0 - (1.0 - rate) * z) / rate
        return found._replace(led=led, arriving=found.arriving * (1.0 - second * second * (1.0 - z) ** 2))

    @property
    def fineness(self) -> float:
        """Bits of accuracy that its lead costs a signal in front of the plays, 0 for none."""
        return 0.0 if self.exact else math.log2(4.0 / self.rate)

    def asked(self, given: float, asked: float, margin: Margin) -> float:
        """Largest answer of the inverse for outputs up to `asked`, after inputs up to `given`."""
        return self.sizes(given, asked, margin.turning).answer

    def sizes(self, given: float, asked: float, turning: bool) -> LagSizes:
        """Largest sizes of its signals."""
        return LagSizes(self.exact, self.rate, self.late, given, asked, turning)


class LagSizes:
    """Largest sizes of a lag's signals: its input, the requested output, its states, and the inverse's answer;
    `turning`: in front of two branches."""

    def __init__(
        self, exact: bool, rate: float, late: float, given: float, asked: float, turning: bool = False
    ) -> None:
        self.given, self.asked = given, asked
        if exact:
            self.state = given + asked
            self.answer = given + self.state / late
        else:
            # |wanted| <= theta^2 asked + (1 - theta)(theta |wanted| + given), theta at most 1/2; or with two branches
            # asked plus a led move, 2 asked, minus the shortfall of the input, (1 - theta)(2 asked + 3 given)
            self.state = 3.0 * (given + (2.0 if turning else 1.0) * asked)
            self.answer = given + self.state / rate


def numbers(effect: Lag, seconds: float, turning: bool = False, exact: bool | None = None) -> LagNumbers:
    """The constants of a lag at steps of `seconds`.

    `turning`: blocks behind the lag depend on its direction of arrival, so it is always led; `exact` overrides this.

    For steps T well below tau, the inverse of `a_k = E a_(k-1) + b0 v_(k-1) + b1 v_k` has a pole near -1 and rings.
    With `theta = b0/(1 - E)` and `x_k = E x_(k-1) + (1 - E) v_k`, which is exactly invertible, `a_k = (1 - theta) x_k +
    theta x_(k-1)` for even steps: x is led to `a + theta (a - a_before)`. The error is `theta^2` times the second
    difference of the target a. For T >= 2 tau the exact inverse decays within a few samples, and is used.
    """
    if exact is None:
        exact = seconds >= LONG_STEP * effect.time_constant and not turning
    _, early, late = (float(x[0]) for x in decays(np.array([seconds]), effect.time_constant))
    rate = -float(np.expm1(-seconds / effect.time_constant))
    return LagNumbers(exact, rate, early, late, 1.0 / late) if exact else LagNumbers(
        exact, rate, early / rate, late, 1.0 / rate
    )


def shifted(theta: float, turning: bool = False) -> float:
    """Largest error of a lag's goal, for errors up to 1 of the requested output, if the lag has seen the same drives.

    The previous target is computed from the drive that led to it, and retains earlier errors, `W = theta^2 + theta (1 -
    theta) W`. In front of two branches (`turning`) the led move is off by the errors of two targets, or `MOST_LED`
    times those errors.
    """
    if turning:
        return 1.0 + 2.0 * MOST_LED * theta
    return 1.0 + theta + theta**3 / (1.0 - theta + theta * theta)


# ---------------------------------------------------------------- lag.c, exact.c

HALVES = 16
"""[steps] Halvings of the search for a lead. The lead found is at most 2^-16 of the lead too small, which costs less
than 2e-5 of the distance and never overshoots, as the tests of overshoot check."""


class LagTable(Struct):
    """Lag before the plays: x += rate (v - x); the output lies theta of that step behind x."""

    rate: AnyFactor
    theta: AnyFactor
    late: FloatReal
    inverse_rate: AnyFactor
    bits: FixedUInt8 = note("bits of the states below those of a signal,")
    drop: FixedUInt8 = note("and bits that products leave out")


class ExactTable(Struct):
    """Lag shorter than half a step: a += early v_before + late v - rate a. In fixed point the output follows a share
    `late` of a move at once, and approaches the input by a share `rate` in the next step."""

    rate: AnyFactor
    early: FloatReal
    late: AnyFactor
    inverse_late: AnyFactor
    bits: FixedUInt8 = note("bits of the state below those of a signal,")
    drop: FixedUInt8 = note("and bits that products leave out")


class LagState(Struct):
    """A lag that is led."""

    high: Signal = note("x, the response to a zero-order-hold drive;")
    low: FloatSignal = note("its rounding remainder")
    wanted: Signal = note("output for the last input")
    asked: Signal = note("requested output,")
    answer: FloatSignal = note("and the input solved for it")
    lead: FixedSignal = note("and the move of x solved for it")


class BrakedState(LagState):
    """A lag behind a slew limit."""

    earlier: Signal = note("output requested one sample before")


class ExactState(Struct):
    """A lag that is inverted exactly."""

    reached: FloatSignal
    next: FixedSignal = note("output at the next sample for an unchanged input")
    before: Signal = note("input of the last sample")


KIND = BlockKind("lag", LagTable, LagState, own=("rest", "solve", "absorb"))
BRAKED_KIND = replace(KIND, name="braked", state=BrakedState, like=KIND.name)
EXACT_KIND = replace(KIND, name="lag_exact", table=ExactTable, state=ExactState)
KINDS = KIND, EXACT_KIND, BRAKED_KIND


class LagTables(NamedTuple):
    """All lags of a model: `exact` (k,), 1 for a lag that is inverted exactly, with its constants in `inverted` (k,),
    else in `led` (k,); `braked`: 1 if the only lag is kept from overshooting behind a slew limit."""

    exact: Counts
    led: LagTable
    inverted: ExactTable
    braked: int


class LagMemory(NamedTuple):
    """Memory of all lags: of each lag both as a led lag and as one that is inverted exactly."""

    led: BrakedState
    inverted: ExactState


def tables(lags: Sequence[LagNumbers], reals: Callable[[ArrayLike, str], NDArray[Any]], braked: int = 0) -> LagTables:
    """The tables of several lags in floating point; `reals`: converts named numbers to the arithmetic."""
    rows = reals([(one.rate, one.second, one.late, one.inverse) for one in lags], "constants of the lag")
    return LagTables(
        np.array([int(one.exact) for one in lags], dtype=np.int64),
        LagTable.of(rows, rows.dtype), ExactTable.of(rows, rows.dtype), braked,
    )


def constants(t: LagTables, if_exact: tuple[int, int] = (3, 3), led: tuple[int, int] = (3, 2)) -> Iterator[Constants]:
    """The constants of each lag, with its products in absorb and solve if it is inverted exactly or led."""
    kind = BRAKED_KIND if t.braked else KIND
    for exact, one, inverted in zip(t.exact, t.led, t.inverted, strict=True):
        yield Constants(EXACT_KIND, inverted, if_exact) if exact else Constants(kind, one, led)


@jit
def lag_rest(t: LagTables, s: LagMemory, j: int, x: Scalar) -> Scalar:
    """Settle everything at the input x. Returns the output."""
    if t.exact[j]:
        s.inverted.reached[j] = x
        s.inverted.before[j] = x
        return x
    s.led.high[j] = x
    s.led.low[j] = zero(x)
    s.led.wanted[j] = x
    s.led.asked[j] = x
    s.led.answer[j] = x
    s.led.earlier[j] = x
    return x


@jit
def lag_solve(t: LagTables, s: LagMemory, j: int, y: Scalar) -> Scalar:
    """The input that leads to the output y at this sample."""
    if t.exact[j]:
        reached = s.inverted.reached[j]
        early = t.inverted.early[j] * s.inverted.before[j]
        return (y - (reached + (early - t.inverted.rate[j] * reached))) * t.inverted.inverse_late[j]
    goal = y + t.led.theta[j] * (y - s.led.wanted[j])
    s.led.asked[j] = y
    s.led.answer[j] = s.led.high[j] + (goal - s.led.high[j]) * t.led.inverse_rate[j]
    return s.led.answer[j]


@jit
def lag_absorb(t: LagTables, s: LagMemory, j: int, x: Scalar) -> Scalar:
    """Absorb the input x at this sample. Returns the output."""
    if t.exact[j]:
        reached = s.inverted.reached[j]
        given = t.inverted.early[j] * s.inverted.before[j] + t.inverted.late[j] * x
        s.inverted.reached[j] = reached + (given - t.inverted.rate[j] * reached)
        s.inverted.before[j] = x
        return s.inverted.reached[j]
    high = s.led.high[j]
    following = added(s.led, j, t.led.rate[j] * (x - high))
    s.led.wanted[j] = s.led.asked[j] + t.led.late[j] * (x - s.led.answer[j])
    s.led.earlier[j] = s.led.asked[j]
    return following - t.led.theta[j] * (following - high)


# ---------------------------------------------------------------- steady.c


@jit
def steady_missed(t: LagTables, way: Scalar) -> Scalar:
    """How far a model's only lag falls short of a move in the first sample of the move."""
    return t.led.theta[0] * way


@jit
def steady_led(way: N, moved: N) -> N:
    """The led part of a target's move, at most `MOST_LED` times the previous move."""
    most = moved + moved
    least = most - most
    if most < 0:
        least, most = most, least
    return inside(way, least, most)


@jit
def steady_solve(
    t: LagTables, s: LagMemory, y: Scalar, moved: Scalar, rises: int, applied: Scalar, little: Scalar
) -> tuple[Scalar, Scalar]:
    """The input that leads a model's only lag to the output y without turning it back from the direction `rises`, and
    the move to y from the previously requested output, `moved` being the previous one. A brake takes into account only
    the led part of the move and the previous input's shortfall."""
    way = y - s.led.asked[0]
    missed = s.led.earlier[0] - s.led.wanted[0]
    s.led.wanted[0] = y - steady_led(way, moved)
    s.led.earlier[0] = s.led.wanted[0]
    v = steady_kept(t, s, lag_solve(t, s, 0, y), rises, applied, little)
    s.led.answer[0] = v
    s.led.wanted[0] = s.led.wanted[0] - missed
    return v, way


@jit
def steady_kept(t: LagTables, s: LagMemory, v: Scalar, rises: int, applied: Scalar, little: Scalar) -> Scalar:  # noqa: ARG001  used in fixed point
    """The input v if it is ahead of x by `little` or more, in the direction `rises`. Otherwise an input with which x
    comes to rest without reversing: the last input, `applied`, or the input ahead of x by `little`."""
    x = s.led.high[0]
    ahead, kept = (v - x, applied - x) if rises else (x - v, x - applied)
    if ahead >= little:
        return v
    if kept >= 0 and kept <= little + little:
        return applied
    return x + little if rises else x - little


@jit
def steady_absorb(s: LagMemory, before: Scalar) -> None:
    """Note that the lag has moved from x = `before`. The remainder of the sum is exact unless x has moved by at least
    its own size; it could then move x backwards, and is dropped."""
    x = s.led.high[0]
    way = x - before
    if (-way if way < 0 else way) >= (-before if before < 0 else before):
        s.led.low[0] = zero(x)


# ---------------------------------------------------------------- braked.c


@jit
def braked(
    t: LagTables, s: LagMemory, near: Scalar, short: Scalar, falling: Scalar, rising: Scalar, halves: int
) -> Scalar:
    """The drive at which a model's only lag does not overshoot, although the drive comes back by at most `falling` or
    `rising` per step.

    `near`: the reachable drive nearest to the answer, off by `short`. A target that moves by `way` per step requires a
    lead of `way/(1 - E)`. With a lead m beyond that, which shrinks by `back` per step, the lag gains at most `(1 - E)(m
    + back/2)^2/(2 back)` on the target; it has to gain `left`. If `left` is at most `(1 - E) back/2`, it arrives in one
    step, and a drive up to the lag's destination never overshoots. A lead that no limit affects is right: the drive is
    reduced by no more than its present and last shortfall. `halves`: of the search for m.
    """
    missed = s.led.earlier[0] - s.led.wanted[0]
    room = short + (-missed if missed < 0 else missed) * t.led.inverse_rate[0]
    if not room > 0:
        return near
    way: Scalar = inside(s.led.asked[0] - s.led.earlier[0], -falling, rising)
    left = (s.led.asked[0] - s.led.high[0]) + (t.led.theta[0] * way - way)
    ahead = near - (s.led.high[0] + way * t.led.inverse_rate[0])
    down = left < 0
    back = rising - way if down else falling + way
    size = -left if down else left
    most, half = size * t.led.inverse_rate[0], t.led.rate.dtype.type(0.5)
    over = braked_over(size, most, -ahead if down else ahead, back, room, half, halves)
    return near + over if down else near - over


@jit
def braked_over(
    size: Scalar, most: Scalar, lead: Scalar, back: Scalar, room: Scalar, half: Scalar, halves: int
) -> Scalar:
    """Excess of a lead over the largest lead that comes back in time, at most `room`; `most` gains `size` at once."""
    margin = back * half
    over = lead - most
    if most > margin:
        limit = (most + most) * back
        if lead <= size or (lead + margin) * (lead + margin) <= limit:
            return lead - lead
        low, high = size, lead
        for _ in range(halves):
            middle = low + (high - low) * half
            if (middle + margin) * (middle + margin) <= limit:
                low = middle
            else:
                high = middle
        over = lead - low
    return inside(over, -room, room)


@jit
def steady_state(s: LagMemory) -> Scalar:
    """The state of the lag."""
    return s.led.high[0]


LED = Led(steady_state, steady_solve, steady_kept, steady_absorb, steady_missed, braked, HALVES)
ARITHMETIC = Realized(
    Verbs(memory_of(LagMemory), lag_rest, lag_absorb, solve=lag_solve, led=LED), constants,
    lambda blocks, about: tables(blocks, about.reals, about.braked), kinds=KINDS,
)

# ---------------------------------------------------------------- at steps of any length


ALL_HALVES = 64
"""[steps] Halvings that exhaust the 53 bits of double precision."""


class UnevenLag(Block):
    """A lag in double precision at steps of any length: row 0 of its tables leads it, row 1 inverts it exactly and
    gives its output. With `always_led` it is led at any step, since a rounded drive does not arrive exactly."""

    def __init__(self, effect: Lag) -> None:
        self.rises: Callable[[], bool] | None = None
        self.always_led = False
        self.moved = 0.0
        self._of_step = functools.lru_cache(maxsize=64)(functools.partial(_uneven, effect))
        self.advance(1.0)
        self.state: LagMemory = memory_of(LagMemory)(self.table, np.float64)
        self.begun = self.state.led[0].copy()

    def advance(self, seconds: float, later: float | None = None) -> None:
        """Set the constants for this step."""
        long, self.table = self._of_step(seconds)
        self.exact = long and not self.always_led

    @property
    def patience(self) -> float:
        """The fraction of the distance to the other branch by which it falls short in the first sample of a turn."""
        return 0.0 if self.exact else float(self.table.led.theta[0])

    def call(self, verb: str, x: float) -> float:
        """The result of a verb for x; `solve` may be called several times."""
        t, s = self.table, self.state
        if verb == "rest":
            self.moved = 0.0
            lag_rest(t, s, 0, x)
            lag_rest(t, s, 1, x)
        elif verb == "absorb":
            self.moved = float(s.led.asked[0] - self.begun["asked"])
            lag_absorb(t, s, 0, x)
            x = lag_absorb(t, s, 1, x)
        elif verb == "solve":
            s.led[0] = self.begun
            if self.exact:
                answer = lag_solve(t, s, 1, x)
                s.led.asked[0], s.led.answer[0] = x, answer
                return float(answer)
            if self.rises is None:
                return float(lag_solve(t, s, 0, x))
            return float(steady_solve(t, s, x, self.moved, int(self.rises()), s.led.high[0], 0.0)[0])
        if verb != "resting":
            self.begun = s.led[0].copy()
        return float(x)

    def steady(self, v: float) -> float:
        """The drive nearest to v that does not turn the lag back from its direction of arrival."""
        if self.rises is None or self.exact:
            return v
        return float(steady_kept(self.table, self.state, v, int(self.rises()), self.state.led.high[0], 0.0))

    def braked(self, near: float, short: float, falling: float, rising: float) -> float:
        """The drive at which the lag does not overshoot, from `braked`."""
        return self.steady(float(braked(self.table, self.state, near, short, falling, rising, ALL_HALVES)))


def _uneven(effect: Lag, seconds: float) -> tuple[bool, LagTables]:
    """Whether a step is long enough for the exact inverse, and the constants for both cases."""
    long = numbers(effect, seconds).exact
    return long, tables([numbers(effect, seconds, exact=exact) for exact in (False, True)], lambda x, _: np.array(x))

PART = ChainPart(
    "lag", "a lag", Place.DRIVE, called("lag", lambda effect: effect.time_constant > 0.0), numbers,
    ARITHMETIC, late("lag"),
    code=("lag", "lag_exact"), uneven=UnevenLag,
    counted=lambda t, blocks: (blocks - int(t.exact.sum()), int(t.exact.sum())),
)
"""A lag as a part of the chain, in front of the plays."""

PARTS = (PART,)
