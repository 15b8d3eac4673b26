"""A lag as a block: its exactly invertible part is inverted exactly, and the rest is of second order."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple, Protocol

import numpy as np

from hystgen.basics.jit import jit
from hystgen.effects.base import decays
from hystgen.effects.kinds import Constants, Kind
from hystgen.effects.lag.model import Lag
from hystgen.plays.slots import Counts, Reals, zero

LONG_STEP = 2.0
"""[time constants in a step] From here on the lag is inverted exactly. The pole of that inverse is then above -0.53, so
that what it does to one sample falls to 1 % in seven; its gain from reference to drive is 4.2 where the lead has 2.2,
and with steps half as long it would be 13. The lead leaves 0.3 % of a sine of 40 steps. Set by:
benchmarks/chosen_numbers.py lag."""


MOST_LED = 2.0
"""[times the move before] Largest move of a target that is led in full in front of two branches, so that a step is not
led beyond its end, from where there is no way back but a turn. A step of 0.2 um out of a slow ramp goes 0.002 um beyond
its end, without a limit 0.1. A sine of 100 samples from rest is missed by 0.0032 um rms with 2 and with any more, by
0.0045 with 1. Set by: benchmarks/chosen_numbers.py branches."""


class Branched(Protocol):
    """What is behind a lag, and differs with the direction in which it arrives: `ascending` as it moved last, `rises`
    as it is to move now."""

    ascending: bool
    rises: bool


class LagBlock:
    """`a_k = E a_(k-1) + b0 v_(k-1) + b1 v_k`, led by way of the state of a lag on held drives.

    For steps T well below tau the inverse of this is a pole near -1, which rings. With `theta = b0/(1 - E)` and
    `x_k = E x_(k-1) + (1 - E) v_k`, which is exactly invertible, `a_k = (1 - theta) x_k + theta x_(k-1)` for even
    steps: x is led to `a + theta (a - a_before)`. What remains is `theta^2` times the second difference of the wanted
    a. For T >= 2 tau the pole fades within a few samples, and the inverse is the exact one.
    """

    def __init__(self, time_constant: float) -> None:
        self.time_constant = time_constant
        self.branched: Branched | None = None
        self.always_led = False
        self.rest(0.0)
        self.advance(0.0)

    def advance(self, seconds: float) -> None:
        """The factors of this step."""
        self.decay, self.early, self.late = (float(x[0]) for x in decays(np.array([seconds]), self.time_constant))
        self.exact = seconds >= LONG_STEP * self.time_constant and not self.always_led
        self.theta = self.early / (1.0 - self.decay) if self.decay < 1.0 else 0.5

    def turn_with(self, branched: Branched, always_led: bool) -> None:
        """Arrive from one side at what follows, which differs with the direction, unless the inverse is exact.

        `always_led`: it never is, since a drive that is rounded does not arrive exactly.
        """
        self.branched, self.always_led = branched, always_led

    def resting(self, y: float) -> float:
        """The drive itself."""
        return y

    def rest(self, x: float) -> float:
        """Settle."""
        self.state = self.reached = self.before = self.wanted = self._asked = self._earlier = self.answer = x
        self._target, self._moved, self._missed = x, 0.0, 0.0
        return x

    def solve(self, y: float) -> float:
        """The drive that leads to `y`."""
        if self.branched is None or self.exact:
            return self._led(y)
        way = y - self._target
        if way * self._moved <= 0.0:
            way = 0.0
        elif abs(way) > MOST_LED * abs(self._moved):
            way = MOST_LED * self._moved
        self.wanted = self._earlier = y - way
        v = self._led(y)
        self.wanted -= self._missed
        self.answer = self.steady(v)
        return self.answer

    def steady(self, v: float) -> float:
        """The drive nearest to v that does not take the lag back from the direction in which it is to arrive."""
        if self.branched is None or self.exact:
            return v
        return max(v, self.state) if self.branched.rises else min(v, self.state)

    def _led(self, y: float) -> float:
        if self.exact:
            self.answer = (y - self.decay * self.reached - self.early * self.before) / self.late
        else:
            goal = y + self.theta * (y - self.wanted)
            self.answer = self.state + (goal - self.state) / (1.0 - self.decay)
        self._asked = y
        return self.answer

    def braked(self, near: float, short: float, falling: float, rising: float) -> float:
        """The drive from which the lag does not overshoot, though its drive comes back by `falling` or `rising` a step.

        `near`: the drive in reach that is nearest to the answer, `short` of it. A target that moves on by `way` a step
        takes a lead of `way/(1 - E)`. With m beyond that, which shrinks by `back` a step, the lag gains at most
        `(1 - E)(m + back/2)^2/(2 back)` on the target, and is to gain `left`. Up to `left = (1 - E) back/2` it arrives
        in one step; and a drive no farther than where the lag is to arrive never overshoots. Where nothing limits the
        drive its lead is right as it is, so that it gives way by what it is short of the answer and was before at most.
        """
        rate = 1.0 - self.decay
        way = min(max(self._asked - self._earlier, -falling), rising)
        left = self._asked + self.theta * way - self.state - way
        back = falling + way if left > 0.0 else rising - way
        room = short + abs(self._earlier - self.wanted) / rate
        lead = math.copysign(1.0, left) * (near - self.state - way / rate)
        most = abs(left) / rate
        if most <= 0.5 * back:
            room = min(max(lead - most, -room), room)
        else:
            most = max(abs(left), math.sqrt(2.0 * back * most) - 0.5 * back)
            room = min(max(lead - most, 0.0), room)
        return near - math.copysign(1.0, left) * room

    def absorb(self, x: float) -> float:
        """The lag follows. Behind another drive than the one asked for, the next lead starts from where that leads."""
        self.reached = self.decay * self.reached + self.early * self.before + self.late * x
        self.state = self.state + (1.0 - self.decay) * (x - self.state)
        self.wanted = self._asked + self.late * (x - self.answer)
        self.before = x
        self._target, self._moved = self._asked, self._asked - self._target
        self._earlier = self._asked
        self._missed = self._earlier - self.wanted
        return self.reached


def block(effect: Lag) -> LagBlock | None:
    """The block of an effect; None if its time constant is 0."""
    return LagBlock(effect.time_constant) if effect.time_constant > 0.0 else None


def numbers(effect: Lag, seconds: float, turning: bool = False) -> tuple[bool, tuple[float, float, float, float]]:
    """Whether the inverse is exact, and its constants: `1 - E`, then b0, b1, `1/b1`, or else theta, b1, `1/(1 - E)`.

    `turning`: what follows differs with the direction in which the lag arrives, so that it is led in any case.
    """
    one = LagBlock(effect.time_constant)
    one.advance(seconds)
    rate = -float(np.expm1(-seconds / effect.time_constant))
    if one.exact and not turning:
        return True, (rate, one.early, one.late, 1.0 / one.late)
    return False, (rate, one.early / rate, one.late, 1.0 / rate)


def shifted(theta: float, turning: bool = False) -> float:
    """Largest error of what a lag is led to, for errors up to 1 of what is asked, if it has seen the same drives.

    The target before is what its drive led to: it keeps `W = theta^2 + theta (1 - theta) W` of the errors before. In
    front of two branches (`turning`) the move that is led is off by what two targets are, or `MOST_LED` times that.
    """
    if turning:
        return 1.0 + 2.0 * MOST_LED * theta
    return 1.0 + theta + theta**3 / (1.0 - theta + theta * theta)


# ---------------------------------------------------------------- lag.c, lag_exact.c

RATE, THETA, LATE, INVERSE = 0, 1, 2, 3
EARLY = THETA
HIGH, LOW, WANTED, ASKED, ANSWER, EARLIER = range(6)
REACHED, BEFORE = HIGH, LOW

HALVES = 16
"""[steps] Halvings of the search for a lead. They end at most 2^-16 of it below, which costs less than 2e-5 of the way
and never overshoots; the tests of overshoot hold it."""


KIND = Kind(
    "lag", ("rate", "theta", "late", "inverse_rate"), ("high", "low", "wanted", "asked", "answer"),
    reading=("solve", "absorb"), own=("rest", "solve", "absorb"),
)  # fmt: skip
BRAKED_KIND = Kind(
    "braked", KIND.table, (*KIND.state, "earlier"), reading=KIND.reading, own=KIND.own, like=KIND.name,
)  # fmt: skip
EXACT_KIND = Kind(
    "lag_exact", ("rate", "early", "late", "inverse_late"), ("reached", "before"),
    reading=("solve", "absorb"), own=("rest", "solve", "absorb"),
)  # fmt: skip


class LagTables(NamedTuple):
    """All lags of a model: `exact` (k,), 1 where it is inverted exactly; `block` (k, 4), in fixed point (k, 8)."""

    exact: Counts
    block: Reals


def constants(t: LagTables, braked: bool) -> Iterator[Constants]:
    """The numbers of each lag; `braked`: of the one that there is, behind a slew limit."""
    for exact, row in zip(t.exact, t.block, strict=True):
        yield Constants(EXACT_KIND if exact else BRAKED_KIND if braked else KIND, row, (3, 3 if exact else 2))


@jit
def lag_rest(t: LagTables, s: Reals, j: int, x: Any) -> Any:
    """Everything has settled at the input x. Returns the output."""
    s[j, HIGH] = x
    s[j, LOW] = x if t.exact[j] else zero(x)
    s[j, WANTED] = x
    s[j, ASKED] = x
    s[j, ANSWER] = x
    s[j, EARLIER] = x
    return x


@jit
def lag_solve(t: LagTables, s: Reals, j: int, y: Any) -> Any:
    """The input that leads to the output y at this sample."""
    n = t.block[j]
    if t.exact[j]:
        reached = s[j, REACHED]
        return (y - (reached + (n[EARLY] * s[j, BEFORE] - n[RATE] * reached))) * n[INVERSE]
    goal = y + n[THETA] * (y - s[j, WANTED])
    s[j, ASKED] = y
    s[j, ANSWER] = s[j, HIGH] + (goal - s[j, HIGH]) * n[INVERSE]
    return s[j, ANSWER]


@jit
def lag_absorb(t: LagTables, s: Reals, j: int, x: Any) -> Any:
    """The input is x at this sample. Returns the output."""
    n = t.block[j]
    state = s[j, HIGH]
    if t.exact[j]:
        reached = state + ((n[EARLY] * s[j, BEFORE] + n[LATE] * x) - n[RATE] * state)
        s[j, REACHED] = reached
        s[j, BEFORE] = x
        return reached
    change = n[RATE] * (x - state) + s[j, LOW]
    following = state + change
    s[j, HIGH] = following
    s[j, LOW] = change - (following - state)
    s[j, WANTED] = s[j, ASKED] + n[LATE] * (x - s[j, ANSWER])
    s[j, EARLIER] = s[j, ASKED]
    return following - n[THETA] * (following - state)


# ---------------------------------------------------------------- lag_steady.c


@jit
def steady_missed(t: LagTables, way: Any) -> Any:
    """What the only lag of a model misses of a way in its first sample."""
    return t.block[0, THETA] * way


@jit
def steady_led(way: Any, moved: Any) -> Any:
    """The part of a target's move that is led, `MOST_LED` times the one before at most."""
    most = moved + moved
    least = most - most
    if most < 0:
        least, most = most, least
    return least if way < least else most if way > most else way


@jit
def steady_solve(
    t: LagTables, s: Reals, y: Any, moved: Any, rises: int, applied: Any, little: Any
) -> tuple[Any, Any]:
    """The input that leads the only lag of a model to the output y without taking it back from the direction `rises`,
    and the way there from the output asked for before, to which it had `moved`. A brake sees the part of that way which
    is led, and what the input before was short of."""
    way = y - s[0, ASKED]
    missed = s[0, EARLIER] - s[0, WANTED]
    s[0, WANTED] = y - steady_led(way, moved)
    s[0, EARLIER] = s[0, WANTED]
    v = steady_kept(t, s, lag_solve(t, s, 0, y), rises, applied, little)
    s[0, ANSWER] = v
    s[0, WANTED] = s[0, WANTED] - missed
    return v, way


@jit
def steady_kept(t: LagTables, s: Reals, v: Any, rises: int, applied: Any, little: Any) -> Any:  # noqa: ARG001  as in fixed point
    """The input v if it is ahead of x by `little` or more, in the direction `rises`. Else one with which x comes to
    rest without going back: the last one, `applied`, or one ahead of x by `little`."""
    x = s[0, HIGH]
    ahead, kept = (v - x, applied - x) if rises else (x - v, x - applied)
    if ahead >= little:
        return v
    if kept >= 0 and kept <= little + little:
        return applied
    return x + little if rises else x - little


@jit
def steady_absorb(s: Reals, before: Any) -> None:
    """The lag has followed from x = `before`. What rounding took from a sum is known exactly unless x has moved by more
    than its own size, and could then take x back."""
    x = s[0, HIGH]
    way = x - before
    if (-way if way < 0 else way) >= (-before if before < 0 else before):
        s[0, LOW] = zero(x)


# ---------------------------------------------------------------- braked.c


@jit
def braked(t: LagTables, s: Reals, near: Any, short: Any, falling: Any, rising: Any) -> Any:
    """As `LagBlock.braked`, of the only lag of a model."""
    n = t.block[0]
    missed = s[0, EARLIER] - s[0, WANTED]
    room = short + (-missed if missed < 0 else missed) * n[INVERSE]
    if not room > 0:
        return near
    move = s[0, ASKED] - s[0, EARLIER]
    way = move
    if move > rising:
        way = rising
    elif move < -falling:
        way = -falling
    left = (s[0, ASKED] - s[0, HIGH]) + (n[THETA] * way - way)
    ahead = near - (s[0, HIGH] + way * n[INVERSE])
    down = left < 0
    back = rising - way if down else falling + way
    size = -left if down else left
    over = braked_over(size, size * n[INVERSE], -ahead if down else ahead, back, room, n.dtype.type(0.5))
    return near + over if down else near - over


@jit
def braked_over(size: Any, most: Any, lead: Any, back: Any, room: Any, half: Any) -> Any:
    """By how much a lead exceeds the largest that comes back in time, within `room`; `most` gains `size` at once."""
    margin = back * half
    over = lead - most
    if most > margin:
        limit = (most + most) * back
        if lead <= size or (lead + margin) * (lead + margin) <= limit:
            return lead - lead
        low, high = size, lead
        for _ in range(HALVES):
            middle = low + (high - low) * half
            if (middle + margin) * (middle + margin) <= limit:
                low = middle
            else:
                high = middle
        over = lead - low
    if over > room:
        return room
    return -room if over < -room else over
