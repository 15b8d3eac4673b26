"""Plays that depend on the rate of their input, for a compensator.

A viscous play with the state q before a step is at `z = q + b1 dz_r(w - q)` at the end of the step, and its new state
is `q = z + (1 - E/M) dz_r(w - z)`, with `M = (1 - E) tau/T` and dz_r the part beyond +-r: the exact response to a
straight input while the play slides or rests.

The state of a play with a nonlinear dashpot is its position, in two parts. In a step its input counts as standing still
at a fraction a of the way: `z' = z + D(dz_r(x + a (w - x) - z))`, with D the yield of a stretch in a step by the
dashpot's own law. Two such plays whose inputs differ by at most e stay within e of each other, so the error is at most
a times the way.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.jit import jit, zero
from hystgen.effects.base import Array, Effect, decays
from hystgen.effects.part import Function, late
from hystgen.effects.plays import DASHPOT, DILATED, RELAXING, Moved, Moves, MovingTables, PlaysPart, Response
from hystgen.effects.rate_dependence.model import RelaxingPlays, ThresholdRate, dilated_plays, relaxed
from hystgen.plays.loop import State
from hystgen.plays.slots import Reals


class Movement:
    """How plays (n + 1) move that relax, or whose thresholds grow with the rate.

    Plays that relax move as in the forward model. Thresholds that grow with the rate have a bounded inverse only while
    `sum p_i beta_i < T/2 sum p_i` holds for every number of plays that slide together. Where it does not, plays that
    relax with time constants beta_i stand in for them: they lag as far behind on ramps, and their inverse is stable.
    """

    def __init__(self, effect: RelaxingPlays | ThresholdRate, thresholds: Array, weights: Array) -> None:
        self.r, self.weights = thresholds, weights
        self.dashpot = effect if nonlinear(effect) else None
        self.betas = np.array(effect.betas) if isinstance(effect, ThresholdRate) else None
        self.exponent, self.scale = 1.0, float(thresholds[-1])
        if isinstance(effect, RelaxingPlays):
            self.taus, self.exponent = np.full(len(thresholds) - 1, effect.time_constant), effect.exponent
        else:
            self.taus = np.array(effect.betas)

    def by_threshold(self, seconds: float) -> bool:
        """Whether the growing thresholds are used as they are."""
        if self.betas is None:
            return False
        p = self.weights
        sliding = np.cumsum(p[1:] * self.betas) < 0.5 * seconds * np.cumsum(p)[1:]
        least = p[0] + float(np.sum(p[1:] * np.minimum(0.0, 1.0 - self.betas / seconds)))
        return bool(np.all(sliding) and least > 0.0)

    def moves(self, seconds: float) -> int:
        """Their kind at steps of `seconds`."""
        return DASHPOT if self.dashpot else DILATED if self.by_threshold(seconds) else RELAXING

    @property
    def in_order(self) -> bool:
        """Whether no play yields faster than one with a smaller threshold."""
        return self.exponent >= 1.0 if self.betas is None else len(set(self.betas.tolist())) == 1

    def stood_in_for(self, seconds: float) -> bool:
        """Whether plays that relax stand in for thresholds that grow with the rate."""
        return self.betas is not None and not self.by_threshold(seconds)

    def falling(self, seconds: float, steep: float) -> float:
        """As in `Mover`: a threshold that grows faster than the input moves pushes its play back."""
        if self.betas is None:
            return 0.0
        return steep * float(np.sum(self.weights[1:] * np.minimum(0.0, 1.0 - self.betas / seconds)))

    def numbers(self, seconds: float, largest_step: float, span: float) -> Moved:
        """Their constants at steps of `seconds`, for drive steps up to `largest_step` and stretches up to `span`."""
        none, kind = np.zeros(len(self.taus)), self.moves(seconds)
        if self.dashpot:
            rows = pieces(self.dashpot, self.scale, seconds, span)
            share = seen_share(self.dashpot, self.scale, seconds, largest_step)
            jumps, bend = varying(rows, span)
            return Moved(kind, none, none, rows, share, (share * jumps, share * share * bend))
        no_yields = np.zeros((0, C3 + 1))
        if kind == DILATED:
            return Moved(kind, np.asarray(self.betas) / seconds, none, no_yields, 0.0)
        first, second = np.array([_viscous(seconds, tau) for tau in self.taus]).T
        return Moved(kind, first, second, no_yields, 0.0)

    def responses(self, z: NDArray[np.complex128], seconds: float) -> Iterator[Response]:
        """As in `Mover`; with a nonlinear dashpot, plays may be too slow to follow at all."""
        p = self.weights
        if self.dashpot:
            yield float(np.sum(p)), np.full_like(z, p[0]), float(p[0])
            return
        slope, response, at_once = float(p[0]), np.full_like(z, p[0]), float(p[0])
        for weight, tau in zip(p[1:].tolist(), self.taus.tolist(), strict=True):
            if self.by_threshold(seconds):
                followed, first = 1.0 - tau / seconds * (1.0 - z), 1.0 - tau / seconds
            else:
                decay, early, first = (float(x[0]) for x in decays(np.array([seconds]), tau))
                followed = (first + early * z) / (1.0 - decay * z)
            slope, response, at_once = slope + weight, response + weight * followed, at_once + weight * first
            yield slope, response, at_once

    def whole_yields(
        self, seconds: float, begins: Sequence[int], end: int, step: float, bits: int
    ) -> list[tuple[object, ...]]:
        """`FixedMovingTables.yields` for stretches up to `end` steps, with knots at `begins` among others."""
        if not (dashpot := self.dashpot):
            return []
        found: list[tuple[object, ...]] = late("rate_dependence", "whole_yields")()(
            lambda x: yielded(dashpot, self.scale, seconds, x), begins, end, step, bits
        )
        return found

    def disorder(self, rows: Array, top: float) -> float:
        """By how much plays can leave the order of their thresholds, for stretches up to `top`."""
        return disorder(rows, top) if self.dashpot else 0.0

    def stretch_error(self, seconds: float, rows: Array, ways: tuple[float, float], held: Array) -> float:
        """Largest difference between the stretches of plays by the table and by the law."""
        return stretch_error(self.dashpot, self.scale, seconds, rows, ways, held) if self.dashpot else 0.0

    def after(self, plays: Array, x: float, w: float, seconds: float) -> Array:
        """The plays (n + 1) after a step from x to w, given the plays before it."""
        out = np.empty_like(plays)
        out[0] = w
        if self.by_threshold(seconds):
            rate = np.array([abs(w - x) / seconds])
            dilated_plays(np.array([w]), rate, self.r[1:], np.asarray(self.betas), plays[1:], out[1:, None])
            return out
        linear = self.exponent == 1.0  # Python's numbers take a third of the time, but their powers do not overflow
        r, states = (self.r.tolist(), plays.tolist()) if linear else (self.r, plays)
        for i, tau in enumerate(self.taus, 1):
            if tau > 0.0:
                out[i] = relaxed(x, w, seconds, r[i], tau, self.exponent, self.scale, states[i])
            else:
                out[i] = min(max(states[i], w - r[i]), w + r[i])
        return out


def _viscous(seconds: float, tau: float) -> tuple[float, float]:
    """b1 and 1 - E/M of a step; a play with the time constant 0 follows at once."""
    if not tau > 0.0:
        return 1.0, 0.0
    decay, _, late = (float(x[0]) for x in decays(np.array([seconds]), tau))
    return late, 1.0 - decay / (1.0 - late)


# ---------------------------------------------------------------- a nonlinear dashpot, by a table

BEGIN, C0, C1, C2, C3 = range(5)
"""Columns of a piece: where it begins, and the coefficients of a cubic in the distance from there."""

LEAST_STRETCH = 1e-6
"""[largest thresholds] A stretch below this loses a fixed fraction of itself; a range has some 1e5 of these."""

LEAST_YIELD = 2.0**-40
"""A stretch that loses less than this fraction in a step is taken to lose in proportion to its size: next to nothing in
2^28 steps."""

LONGEST = 4.0
"""Largest ratio of a piece's end to its beginning: over two octaves a cubic fits even laws steeper than a dashpot's."""

YIELD_ERROR = 1e-3
"""Largest relative error of the loss of a stretch: the relative error of plays' lag behind their input is
`YIELD_ERROR/exponent`, while records determine time constants to 1 % at best."""


def nonlinear(effect: Effect) -> TypeGuard[RelaxingPlays]:
    """Whether plays have a dashpot that needs the table."""
    return isinstance(effect, RelaxingPlays) and effect.exponent != 1.0 and effect.time_constant > 0.0


def yielded(effect: RelaxingPlays, scale: float, seconds: float, x: float) -> tuple[float, float]:
    """The loss of a stretch x > 0 in a step in which only the play moves, and its slope.

    `e' = -(scale/tau) (e/scale)^m` has the solution `e^(1-m) = x^(1-m) + (m - 1) T scale^(1-m)/tau`.
    """
    more = effect.exponent - 1.0
    size = math.log(seconds / effect.time_constant) + more * math.log(x / scale)
    part = more * math.exp(min(size, 700.0))
    if part <= -1.0:
        return x, 1.0  # it comes to an end within the step
    spent = (math.log1p(part) if size < 700.0 else math.log(more) + size) / more
    return -x * math.expm1(-spent), -math.expm1(-effect.exponent * spent)


def seen_share(effect: RelaxingPlays, scale: float, seconds: float, way: float) -> float:
    """The fraction of the move `way` at which the input is taken to stand still.

    Exact for a linear dashpot as stiff as this one in steady motion by `way` per step.

    With `s = T f'(e)`, `E = exp(-s)` and `M = (1 - E)/s`: `(1 - M)/(1 - E)`, 1/2 for s = 0.
    """
    size = math.log(way * effect.time_constant / (seconds * scale)) / effect.exponent
    stiff = min(effect.exponent * way / (scale * math.exp(min(size, 50.0))), 1e3)
    return (1.0 + math.expm1(-stiff) / stiff) / -math.expm1(-stiff) if stiff > 1e-3 else 0.5 + stiff / 12.0


def pieces(effect: RelaxingPlays, scale: float, seconds: float, top: float) -> Array:
    """The loss of stretches up to `top` in a step, in rows (K, 5)."""
    more = effect.exponent - 1.0
    share = 1.0 / -more if more < 0.0 else LEAST_YIELD  # of a stretch that is lost within the step, or hardly at all
    begins = scale * math.exp(min(math.log(share * effect.time_constant / seconds) / more, 700.0))
    at = min(max(LEAST_STRETCH * scale, begins), top)
    rows: list[tuple[float, ...]] = [(0.0, 0.0, yielded(effect, scale, seconds, at)[0] / at, 0.0, 0.0)]
    while at < top:
        ratio = LONGEST
        while not _fits(effect, scale, seconds, row := _piece(effect, scale, seconds, at, ratio), at * ratio):
            ratio = math.sqrt(ratio)
        rows.append(row)
        at *= ratio
    return np.array(rows)


def varying(rows: Array, top: float) -> tuple[float, float]:
    """Sum of the jumps of the loss's slope over stretches up to `top`, and the largest change of the slope per change
    of the stretch."""
    begins, _, slopes, bends, thirds = rows.T
    lengths = np.diff(begins, append=max(top, LONGEST * float(begins[-1])))
    bent = np.abs([bends, bends + 3.0 * thirds * lengths])
    ends = slopes + (2.0 * bends + 3.0 * thirds * lengths) * lengths
    return float(np.sum(np.abs(slopes - np.append(0.0, ends[:-1])))), 2.0 * float(np.max(bent))


def _piece(effect: RelaxingPlays, scale: float, seconds: float, at: float, ratio: float) -> tuple[float, ...]:
    (a, da), (b, db) = (yielded(effect, scale, seconds, x) for x in (at, at * ratio))
    length = at * (ratio - 1.0)
    mean = (b - a) / length
    return at, a, da, (3.0 * mean - 2.0 * da - db) / length, (da + db - 2.0 * mean) / (length * length)


def _fits(effect: RelaxingPlays, scale: float, seconds: float, row: tuple[float, ...], end: float) -> bool:
    """Whether a piece rises, and is close enough to the law at points inside."""
    at, *c = row
    inside = np.linspace(at, end, 17)
    on = inside - at
    curve = ((c[3] * on + c[2]) * on + c[1]) * on + c[0]
    law = np.array([yielded(effect, scale, seconds, x)[0] for x in inside.tolist()])
    return bool(np.all(np.diff(curve) >= 0.0) and np.all(np.abs(curve - law) <= YIELD_ERROR * law))


def stretch_error(
    effect: RelaxingPlays, scale: float, seconds: float, rows: Array, ways: tuple[float, float], held: Array
) -> float:
    """Largest difference between the stretches of plays by the table and by the law.

    `ways`: the largest move of the input in a step, and overall; `held` (K,): rounding error of the loss on each piece.
    If one play follows the law and another the table, neither gains on the other once it is stretched less by that
    much.
    """
    end = LONGEST * rows[-1, BEGIN] if len(rows) > 1 else LEAST_STRETCH * scale
    x = np.append(0.0, np.geomspace(1e-3 * (rows[1, BEGIN] if len(rows) > 1 else end), end, 6000))
    law = np.array([0.0, *(yielded(effect, scale, seconds, each)[0] for each in x[1:].tolist())])
    k = np.searchsorted(rows[:, BEGIN], x, side="right") - 1
    on = x - rows[k, BEGIN]
    curve = ((rows[k, C3] * on + rows[k, C2]) * on + rows[k, C1]) * on + rows[k, C0]
    least, most = (np.maximum.accumulate(np.append(0.0, (curve + side * held[k])[1:])) for side in (-1.0, 1.0))
    reached = (law <= min(ways[0], float(least[-1]))) & (x <= ways[1])
    farther = np.interp(law, least, x) - x
    nearer = x - np.interp(law, most, x)
    return float(max(np.max(farther[reached]), np.max(nearer[reached])))


def disorder(rows: Array, top: float) -> float:
    """By how much a play can be stretched farther than one with a smaller threshold, for stretches up to `top`.

    Of two plays, the one that is stretched farther stays so in a step, except where the loss rises faster than the
    stretch.
    """
    x = np.linspace(0.0, top, 6001)
    k = np.searchsorted(rows[:, BEGIN], x, side="right") - 1
    on = x - rows[k, BEGIN]
    slope = (3.0 * rows[k, C3] * on + 2.0 * rows[k, C2]) * on + rows[k, C1]
    return float(np.sum(np.maximum(slope - 1.0, 0.0)) * (x[1] - x[0]))


# ---------------------------------------------------------------- moved.c and dashpot.c, in any arithmetic


@jit(inline=True)
def stretch(x: Any, r: Any) -> Any:
    """The part of x beyond +-r."""
    if x > r:
        return x - r
    if x < -r:
        return x + r
    return r - r


def movement(
    share_of: Function, yields: Function, seen: Function, moved_by: Function, yield_of: Function, *,
    at_rest: bool = False,
) -> tuple[Function, Function, Function, Function]:
    """`moved`, `move`, `put` and `rest` of `Moves`, from the functions in which arithmetics differ: x times a play's
    factor; a stretch's yield in a step; the part of a way at which the input counts as standing still; the move of a
    play for its yield, and the reverse; `at_rest`: whether a play that is not stretched keeps its remainder."""

    @jit
    def change(m: Any, r: Reals, i: int, s: State, lost: Reals, w: Any) -> tuple[Any, bool]:
        """Move, as a yield, of play i with a nonlinear dashpot while the input of the plays goes to w, and whether the
        play is stretched."""
        x = s.play[0] + seen(m, w - s.play[0]) - s.play[i]
        on = (-x if x < zero(x) else x) - r[i]
        if not on > zero(on):
            return lost[i], False
        gained = yields(m, on)
        return lost[i] - gained if x < zero(x) else lost[i] + gained, True

    @jit
    def moved(m: Any, r: Reals, i: int, s: State, lost: Reals, w: Any) -> Any:
        """Play i after the input of the plays has gone to w."""
        q = s.play[i]
        if m.moves == DASHPOT:
            gained, _ = change(m, r, i, s, lost, w)
            return q + moved_by(m, gained)
        if m.moves == RELAXING:
            return q + share_of(m.first, i, stretch(w - q, r[i]))
        threshold = r[i]
        if m.moves == DILATED:
            before = s.play[0]
            way = w - before if w > before else before - w
            threshold = r[i] + share_of(m.first, i, way)
        low = w - threshold
        high = w + threshold
        upper = high if q > high else q
        return low if upper < low else upper

    @jit
    def move(m: Any, r: Reals, i: int, s: State, lost: Reals, w: Any) -> bool:
        """Move play i while the input of the plays goes to w. Returns whether it moves."""
        before = s.play[i]
        if m.moves == DASHPOT:
            gained, stretched = change(m, r, i, s, lost, w)
            if stretched or not at_rest:
                s.play[i] = before + moved_by(m, gained)
                lost[i] = gained - yield_of(m, s.play[i] - before)
            return stretched or not at_rest
        s.play[i] = moved(m, r, i, s, lost, w)
        return bool(s.play[i] != before)

    @jit
    def put(m: Any, i: int, s: State, lost: Reals, z: Any) -> None:
        """Put play i to rest at z."""
        if m.moves == DASHPOT:
            lost[i] = zero(lost[i])
        s.play[i] = z

    @jit
    def rest(m: Any, r: Reals, i: int, s: State) -> Any:
        """Where play i would come to rest with its input held, as seen one step later."""
        return s.play[i] + share_of(m.second, i, stretch(s.play[0] - s.play[i], r[i]))

    return moved, move, put, rest


# ---------------------------------------------------------------- yield.c, relaxing.c


@jit
def piece(t: MovingTables, x: Any) -> int:
    """The piece of the yield at stretch x >= 0."""
    low = 0
    high = len(t.yields)
    while high - low > 1:
        middle = (low + high) // 2
        if x < t.yields[middle, BEGIN]:
            high = middle
        else:
            low = middle
    return low


@jit
def yielding(t: MovingTables, x: Any) -> tuple[Any, Any]:
    """The yield in a step of a play with a nonlinear dashpot at stretch x >= 0, and its change per change of x."""
    k = piece(t, x)
    on = x - t.yields[k, BEGIN]
    bend = t.yields[k, C3] * on
    slope = (bend + bend + bend + t.yields[k, C2] + t.yields[k, C2]) * on + t.yields[k, C1]
    return ((bend + t.yields[k, C2]) * on + t.yields[k, C1]) * on + t.yields[k, C0], slope


@jit
def yields(t: MovingTables, x: Any) -> Any:
    """The yield that `yielding` returns, alone."""
    y, _ = yielding(t, x)
    return y


@jit(inline=True)
def seen(t: MovingTables, way: Any) -> Any:
    """The part of `way` at which the input counts as standing still."""
    return way * t.number.standing_share[0]


@jit(inline=True)
def unchanged(t: MovingTables, x: Any) -> Any:  # noqa: ARG001  as in fixed point
    """A yield as the move of a play, and the reverse: the same number in floating point."""
    return x


@jit(inline=True)
def share_of(factors: Reals, i: int, x: Any) -> Any:
    """x times the factor of play i."""
    return factors[i] * x


@jit
def relaxing_follow(t: MovingTables, plays: Any, s: State, w: Any) -> Any:
    """Move viscous plays with one time constant as their input goes to w. Returns their sum."""
    r, p = plays.threshold, plays.weight
    total = p[0] * w
    for i in range(1, len(r)):
        z = s.play[i] + t.first[1] * stretch(w - s.play[i], r[i])
        total = total + p[i] * z
        s.play[i] = z + t.second[1] * stretch(w - z, r[i])
    s.play[0] = w
    return total


@jit
def relaxing_input(t: MovingTables, plays: Any, s: State, h: Any) -> Any:
    """Input of viscous plays at which their sum is h: first as if no play were stretched, then with each play that is
    stretched on the way there."""
    r, p = plays.threshold, plays.weight
    rest = r[0]
    for i in range(1, len(r)):
        rest = rest + p[i] * s.play[i]
    rest = h - rest
    w = rest * t.inverse[0]
    rising = w > s.play[1]
    for i in range(1, len(r)):
        first = s.play[i] + r[i] if rising else s.play[i] - r[i]
        if w <= first if rising else w >= first:
            break
        rest = rest + t.share[i] * first
        w = rest * t.inverse[i]
        if w < first if rising else w > first:
            w = first
    return w


moved, move, put, rest = movement(share_of, yields, seen, unchanged, unchanged, at_rest=True)


@jit
def tried(t: MovingTables, r: Reals, i: int, s: State, lost: Reals, moving: bool, w: Any) -> tuple[bool, Any, Any]:
    """Whether play i moves when the input of the plays goes to w, or comes to rest there; the value it reaches, and its
    change per further change of w."""
    q, x = s.play[i], s.play[0]
    one = t.number.one[0]
    if t.moves == DASHPOT and moving:
        x = x + seen(t, w - x) - q
        on = (-x if x < zero(x) else x) - r[i]
        if not on > zero(on):
            return False, q, one
        gained, slope = yielding(t, on)
        return True, q + (lost[i] - gained if x < zero(x) else lost[i] + gained), slope * t.number.standing_share[0]
    if t.moves == RELAXING:
        on = stretch(w - q, r[i])
        share = t.first[i] if moving else one
        return on != zero(on), q + on * share, share
    threshold = r[i]
    wider = zero(q)
    if t.moves == DILATED:
        way = w - x if moving else wider
        grows = (-one if way < zero(way) else one) if moving else wider
        threshold = r[i] + t.first[i] * (-way if way < zero(way) else way)
        wider = grows * t.first[i]
    if w - threshold > q:
        return True, w - threshold, one - wider
    return w + threshold < q, w + threshold, one + wider


MOVES = PlaysPart(
    Movement,
    Moves(moved, move, put, rest, relaxing_follow, relaxing_input, tried),
    late("rate_dependence"),
)
"""Plays that depend on the rate as a part of the chain."""
