"""Plays that an effect moves or bends in its own way: `c_runtime/chain_moving.c` and what it is made of.

Play i is kept as where it would come to rest and what it contributes there. A plain play rests where it is; a viscous
one is on its way there, `z = q + b1 dz_r(w - q)` at the end of a step, whose rest a step later is
`q = z + (1 - E/M) dz_r(w - z)` with `M = (1 - E) tau/T` and dz_r what lies beyond +-r: the exact response to a straight
input while the play slides or rests.

A play with a nonlinear dashpot is kept where it is, in two parts: in a step its input counts as if it stood at a share
a of the way, `z' = z + D(dz_r(x + a (w - x) - z))` with D what a stretch yields in a step by the dashpot's own law. Two
such plays with inputs that differ by at most e stay within e of each other, so that the error is at most a of the way.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from hystgen.arithmetic.factors import factor, times
from hystgen.basics.jit import jit
from hystgen.chain.static import StaticModel
from hystgen.compensator.fixed_tables import reciprocal
from hystgen.compensator.layout import FixedTables
from hystgen.effects.base import Effect, decays
from hystgen.effects.noncongruent.model import LoopCentre, PlayFunctions
from hystgen.effects.rate_dependence import compensator as dashpot
from hystgen.effects.rate_dependence.compensator import Movement
from hystgen.effects.rate_dependence.model import RelaxingPlays, ThresholdRate
from hystgen.front.tanh.kernels import TanhTables, tanh
from hystgen.plays.fixed import loop_solve
from hystgen.plays.loop import State
from hystgen.plays.slots import Reals

PLAIN, DILATED, RELAXING, DASHPOT = range(4)
STRAIGHT, POLYNOMIAL, CENTRE = range(3)
"""How plays move, and how they are bent."""

SCALE, INVERSE_SCALE, MIDDLE, INVERSE_WIDTH, BUMP, TANH_CENTRE, LEAST_INPUT, LARGEST_INPUT, HALF, SEEN = range(10)
"""Places in `MovingTables.number`."""

CELLS = 4096
"""Inputs at which the slope of bent plays is looked at: a cell of 1/4096 of the range is far below the width of any
bump that a record shows, of which a search takes none below a twentieth of it."""


class MovingTables(NamedTuple):
    """`first`, `second` (n + 1,): of dilated plays how much wider a threshold is per unit of the way of a step, of
    viscous ones b1 and 1 - E/M; `curve` (n + 1, K): coefficients of the polynomials; `halves` of the search; `used`: 0
    for plain plays that nothing bends, which engine loop solves."""

    moves: int
    bends: int
    first: Reals
    second: Reals
    curve: Reals
    number: Reals
    halves: int
    scanned: int  # 1 for viscous plays of one time constant that nothing bends
    share: Reals  # of these, p_i b1 (n + 1,)
    inverse: Reals  # 1 / (p_0 + b1 (p_1 + ... + p_i))
    yields: Reals  # (K, 5): what a nonlinear dashpot yields, by pieces

    @property
    def used(self) -> bool:
        """Whether plays are other than those of engine loop."""
        return self.moves != PLAIN or self.bends != STRAIGHT


class FixedMovingTables(NamedTuple):
    """The same in fixed point, which has viscous plays and those that are dilated: `first`, `second` are factors
    (n + 1, 2), `farthest` the largest input that a search takes, and `relaxed` tables of plays whose sums have the
    slopes that viscous ones of one time constant have in a step."""

    moves: int
    bends: int
    scanned: int
    first: Reals
    second: Reals
    farthest: int
    relaxed: FixedTables

    @property
    def used(self) -> bool:
        """Whether plays are other than those of engine loop."""
        return self.moves != PLAIN


def problems(static: StaticModel, effects: Sequence[Effect]) -> Iterator[tuple[Effect, str]]:
    """Which effects on plays the C cannot solve for, and why."""
    bends = [effect for effect in effects if effect.bends_plays()]
    yield from ((effect, "one effect bends the plays, and there is another one") for effect in bends[1:])
    if bends and not (slope := least_slope(static, bends[:1])) > 0.0:
        yield bends[0], f"somewhere the output falls as the drive rises, by {-slope:.3g} a unit: there is no inverse"


def beyond_forward(static: StaticModel, effects: Sequence[Effect], seconds: float) -> Iterator[tuple[Effect, str]]:
    """Thresholds that grow so fast with the rate that viscous plays stand in for them, in the inverse alone."""
    r, p = np.array(static.pi.thresholds), np.array(static.pi.weights)
    for effect in effects:
        if isinstance(effect, ThresholdRate) and not Movement(effect, r, p).by_threshold(seconds):
            yield effect, "viscous plays stand in for it, which only the inverse may; emit the inverse alone"


def least_dilated(static: StaticModel, effects: Sequence[Effect], seconds: float) -> float:
    """Least change of the sum per change of the plays' input in one step, of plays whose thresholds grow with it."""
    p = np.array(static.pi.weights)
    found = float(p[0])
    for effect in effects:
        if isinstance(effect, ThresholdRate):
            found += float(np.sum(p[1:] * np.minimum(0.0, 1.0 - np.array(effect.betas) / seconds)))
    return found


def least_slope(static: StaticModel, bends: Sequence[Effect]) -> float:
    """Least change of the sum per change of the plays' input, over what they can reach and any number that follow."""
    low, high = static.play_range
    p, r = np.array(static.pi.weights), np.array(static.pi.thresholds)
    at = np.linspace(low - r[-1], high + r[-1], CELLS + 1)
    rows = np.tile(at, (len(p), 1))
    for effect in bends:
        if effect.bends_plays():
            rows = effect.bent(rows, r)
    steep = np.diff(rows, axis=1) / np.diff(at)
    return float(np.min(np.cumsum(p[:, None] * steep, axis=0)))


def steepest_bend(static: StaticModel, effects: Sequence[Effect]) -> float:
    """Largest slope by which a bent play differs from the play itself."""
    low, high = static.play_range
    r = np.array(static.pi.thresholds)
    at = np.linspace(low - r[-1], high + r[-1], CELLS + 1)
    rows = np.tile(at, (len(r), 1))
    for effect in effects:
        if effect.bends_plays():
            rows = effect.bent(rows, r)
    return float(np.max(np.abs(np.diff(rows, axis=1) / np.diff(at) - 1.0)))


def build(
    static: StaticModel, effects: Sequence[Effect], seconds: float, largest_step: float, dtype: Any
) -> MovingTables:
    """The tables of a model's plays, for effects without `problems` and a drive that takes no larger steps."""
    n = static.pi.n
    low, high = static.play_range
    first, second = np.zeros(n + 1), np.zeros(n + 1)
    moves, bends = PLAIN, STRAIGHT
    r = np.array(static.pi.thresholds)
    curve = np.zeros((n + 1, 1))
    number = np.zeros(SEEN + 1)
    yields = np.zeros((0, dashpot.C3 + 1))
    number[[LEAST_INPUT, LARGEST_INPUT, HALF]] = 2.0 * low - high, 2.0 * high - low, 0.5
    for effect in effects:
        if dashpot.nonlinear(effect):
            moves = DASHPOT
            number[SEEN] = dashpot.seen(effect, r[-1], seconds, largest_step)
            yields = dashpot.pieces(effect, r[-1], seconds, 3.0 * (high - low))
        elif isinstance(effect, RelaxingPlays | ThresholdRate):
            moves = RELAXING
            movement = Movement(effect, r, np.array(static.pi.weights))
            if movement.by_threshold(seconds):
                moves = DILATED
                first[1:] = np.asarray(movement.betas) / seconds
            else:
                first[1:], second[1:] = np.array([_viscous(seconds, tau) for tau in movement.taus]).T
        elif isinstance(effect, PlayFunctions):
            bends = POLYNOMIAL
            terms = max(map(len, effect.coefficients))
            curve = np.zeros((n + 1, terms))
            for i, row in enumerate(effect.coefficients, 1):
                curve[i, : len(row)] = row
            number[[SCALE, INVERSE_SCALE]] = r[-1], 1.0 / r[-1]
        elif isinstance(effect, LoopCentre):
            bends = CENTRE
            number[[MIDDLE, INVERSE_WIDTH]] = effect.centre, 1.0 / effect.width
            number[[BUMP, TANH_CENTRE]] = effect.amplitude * effect.width, math.tanh(effect.centre / effect.width)
    halves = int(np.finfo(dtype).nmant) + 4
    p = np.array(static.pi.weights)
    scanned = moves == RELAXING and bends == STRAIGHT and len(set(first[1:].tolist())) == 1 and float(np.min(p)) >= 0.0
    share = np.append(0.0, p[1:] * first[1:])
    inverse = 1.0 / (p[0] + np.cumsum(share)) if scanned else np.zeros(n + 1)
    given = (np.array(each, dtype=dtype) for each in (first, second, curve, number, share, inverse, yields))
    first, second, curve, number, share, inverse, yields = given
    return MovingTables(moves, bends, first, second, curve, number, halves, int(scanned), share, inverse, yields)


def build_fixed(
    plays: FixedTables, static: StaticModel, effects: Sequence[Effect], seconds: float, farthest: int
) -> FixedMovingTables:
    """The same in fixed point, for effects without `beyond_fixed` and inputs up to `farthest`. Raises OverflowError."""
    own = build(static, effects, seconds, np.ptp(static.input_range), np.float64)
    first, second = (np.array([factor(x) for x in each], dtype=np.int64) for each in (own.first, own.second))
    if not own.scanned:
        return FixedMovingTables(own.moves, STRAIGHT, 0, first, second, farthest, plays)
    late = float(own.first[1])
    weight = plays.weight
    sums = [0, int(weight[0])]
    for p in weight[1:].tolist():
        sums.append(sums[-1] + round(p * late))
    pairs = [reciprocal(slope) for slope in sums]
    relaxed = plays._replace(
        slope=np.array(sums, dtype=np.int64),
        reciprocal=np.array([pair[0] for pair in pairs], dtype=np.int64),
        shift=np.array([pair[1] for pair in pairs], dtype=np.int64),
    )
    return FixedMovingTables(RELAXING, STRAIGHT, 1, first, second, farthest, relaxed)


def beyond_fixed(effects: Sequence[Effect]) -> Iterator[tuple[Effect, str]]:
    """What fixed point does not have of effects on plays."""
    for effect in effects:
        if effect.bends_plays() or dashpot.nonlinear(effect):
            words = "in fixed point there is no C for plays that are bent or have a nonlinear dashpot"
            yield effect, f"{words}; use float32"


def _viscous(seconds: float, tau: float) -> tuple[float, float]:
    """b1 and 1 - E/M of a step; a play without time constant follows at once."""
    if not tau > 0.0:
        return 1.0, 0.0
    decay, _, late = (float(x[0]) for x in decays(np.array([seconds]), tau))
    return late, 1.0 - decay / (1.0 - late)


@jit(inline=True)
def beyond(x: Any, r: Any) -> Any:
    """The part of x beyond +-r."""
    if x > r:
        return x - r
    if x < -r:
        return x + r
    return r - r


@jit
def yields(t: MovingTables, x: Any) -> Any:
    """What a play that is stretched by x, not negative, gains of it in a step."""
    low = 0
    high = len(t.yields)
    while high - low > 1:
        middle = (low + high) // 2
        if x < t.yields[middle, 0]:
            high = middle
        else:
            low = middle
    on = x - t.yields[low, 0]
    return ((t.yields[low, 4] * on + t.yields[low, 3]) * on + t.yields[low, 2]) * on + t.yields[low, 1]


@jit
def change(t: MovingTables, r: Reals, i: int, s: State, lost: Reals, w: Any) -> Any:
    """How far play i with a nonlinear dashpot moves while the input of the plays goes to w."""
    x = s.play[0] + (w - s.play[0]) * t.number[SEEN] - s.play[i]
    gained = r[0]
    if x > r[i]:
        gained = yields(t, x - r[i])
    elif x < -r[i]:
        gained = -yields(t, -x - r[i])
    return gained + lost[i]


@jit
def moved(t: MovingTables, r: Reals, i: int, s: State, lost: Reals, w: Any) -> Any:
    """Play i once the input of the plays has gone to w."""
    q = s.play[i]
    if t.moves == DASHPOT:
        return q + change(t, r, i, s, lost, w)
    if t.moves == RELAXING:
        return q + t.first[i] * beyond(w - q, r[i])
    threshold = r[i]
    if t.moves == DILATED:
        before = s.play[0]
        way = w - before if w > before else before - w
        threshold = r[i] + t.first[i] * way
    low = w - threshold
    high = w + threshold
    upper = high if q > high else q
    return low if upper < low else upper


@jit
def left(t: MovingTables, r: Reals, i: int, z: Any, w: Any) -> Any:
    """Where play i comes to rest from z with its input held at w, as far as one more step goes."""
    if t.moves == RELAXING:
        return z + t.second[i] * beyond(w - z, r[i])
    return z


@jit
def keep(t: MovingTables, r: Reals, i: int, s: State, lost: Reals, w: Any, z: Any) -> None:
    """Play i has moved, and comes to rest at z, while the input of the plays goes to w."""
    if t.moves == DASHPOT:
        lost[i] = change(t, r, i, s, lost, w) - (z - s.play[i])
    s.play[i] = z


@jit
def put(t: MovingTables, r: Reals, i: int, s: State, lost: Reals, z: Any) -> None:
    """Play i rests at z."""
    if t.moves == DASHPOT:
        lost[i] = r[0]
    s.play[i] = z


@jit
def bent(t: MovingTables, kernel: TanhTables, i: int, z: Any) -> Any:
    """What play i contributes at z."""
    if t.bends == POLYNOMIAL:
        x = z * t.number[INVERSE_SCALE]
        total = z - z
        for k in range(t.curve.shape[1] - 1, -1, -1):
            total = (total + t.curve[i, k]) * x
        return z + t.number[SCALE] * (total * x)
    if t.bends == CENTRE:
        x = (z - t.number[MIDDLE]) * t.number[INVERSE_WIDTH]
        return z + t.number[BUMP] * (tanh(x, kernel) + t.number[TANH_CENTRE])
    return z


@jit
def moved_sum(
    t: MovingTables, kernel: TanhTables, r: Reals, p: Reals, s: State, lost: Reals, values: Reals, w: Any
) -> Any:
    """What the plays give once their input has gone to w."""
    total = p[0] * w
    for i in range(1, len(r)):
        z = moved(t, r, i, s, lost, w)
        total = total + p[i] * (values[i] if z == s.play[i] else bent(t, kernel, i, z))
    return total


@jit
def moved_follow(
    t: MovingTables, kernel: TanhTables, r: Reals, p: Reals, s: State, lost: Reals, values: Reals, w: Any
) -> Any:
    """The plays follow their input w; their sum."""
    total = p[0] * w
    for i in range(1, len(r)):
        z = moved(t, r, i, s, lost, w)
        rest = left(t, r, i, z, w)
        value = values[i] if z == s.play[i] else bent(t, kernel, i, z)
        total = total + p[i] * value
        values[i] = value if rest == z else bent(t, kernel, i, rest)
        keep(t, r, i, s, lost, w, rest)
    s.play[0] = w
    return total


@jit
def relaxing_follow(t: MovingTables, r: Reals, p: Reals, s: State, w: Any) -> Any:
    """Viscous plays follow their input w; their sum."""
    total = p[0] * w
    for i in range(1, len(r)):
        z = s.play[i] + t.first[1] * beyond(w - s.play[i], r[i])
        total = total + p[i] * z
        s.play[i] = z + t.second[1] * beyond(w - z, r[i])
    s.play[0] = w
    return total


@jit
def stretched(x: Any, r: Any, share: Reals) -> Any:
    """A share of the part of x beyond +-r, in fixed point."""
    return times(beyond(x, r), share[0], share[1])


@jit
def fixed_moved(t: FixedMovingTables, r: Reals, i: int, s: State, w: Any) -> Any:
    """Play i once the input of the plays has gone to w, in fixed point."""
    q = s.play[i]
    if t.moves == RELAXING:
        return q + stretched(w - q, r[i], t.first[i])
    before = s.play[0]
    way = w - before if w > before else before - w
    threshold = r[i] + times(way, t.first[i, 0], t.first[i, 1])
    low = w - threshold
    high = w + threshold
    upper = high if q > high else q
    return low if upper < low else upper


@jit
def fixed_moved_follow(t: FixedMovingTables, r: Reals, p: Reals, s: State, w: Any) -> Any:
    """Plays follow their input w in fixed point; their sum. Those of one time constant stay as near to each other as
    they are to be, give or take no rounding."""
    total = p[0] * w
    for i in range(1, len(r)):
        z = fixed_moved(t, r, i, s, w)
        total = total + p[i] * z
        rest = z + stretched(w - z, r[i], t.second[i]) if t.moves == RELAXING else z
        if t.scanned and i > 1:
            room = r[i] - r[i - 1]
            if rest > s.play[i - 1] + room:
                rest = s.play[i - 1] + room
            elif rest < s.play[i - 1] - room:
                rest = s.play[i - 1] - room
        s.play[i] = rest
    s.play[0] = w
    return total


@jit
def fixed_moved_sum(t: FixedMovingTables, r: Reals, p: Reals, s: State, w: Any) -> Any:
    """What the plays give once their input has gone to w, in fixed point."""
    total = p[0] * w
    for i in range(1, len(r)):
        total = total + p[i] * fixed_moved(t, r, i, s, w)
    return total


@jit
def fixed_moved_input(t: FixedMovingTables, r: Reals, p: Reals, s: State, h: Any) -> Any:
    """Input of the plays at which their sum is h: of one time constant by a scan, else by halves between where it is
    and the farthest, the nearer of two neighbours."""
    if t.scanned:
        s.play[0] = s.play[1]
        return loop_solve(t.relaxed, s, h)
    here = s.play[0]
    total = fixed_moved_sum(t, r, p, s, here)
    if total == h:
        return here
    low = here if total < h else -t.farthest
    high = t.farthest if total < h else here
    while high - low > 1:
        middle = low + (high - low) // 2
        if fixed_moved_sum(t, r, p, s, middle) >= h:
            high = middle
        else:
            low = middle
    return low if h - fixed_moved_sum(t, r, p, s, low) < fixed_moved_sum(t, r, p, s, high) - h else high


@jit
def relaxing_input(t: MovingTables, r: Reals, p: Reals, s: State, h: Any) -> Any:
    """Input of viscous plays at which their sum is h: of none at first, then of those stretched on the way there."""
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


@jit
def resting(r: Reals, s: State, i: int, w: Any) -> Any:
    """Play i at rest with its input at w."""
    low = w - r[i]
    high = w + r[i]
    upper = high if s.play[i] > high else s.play[i]
    return low if upper < low else upper


@jit
def moved_rest(
    t: MovingTables, kernel: TanhTables, r: Reals, p: Reals, s: State, lost: Reals, values: Reals, w: Any
) -> Any:
    """The plays at rest with their input at w; their sum."""
    total = p[0] * w
    for i in range(1, len(r)):
        put(t, r, i, s, lost, resting(r, s, i, w))
        values[i] = bent(t, kernel, i, s.play[i])
        total = total + p[i] * values[i]
    s.play[0] = w
    return total


@jit
def resting_sum(t: MovingTables, kernel: TanhTables, r: Reals, p: Reals, s: State, w: Any) -> Any:
    """What rest at an input w gives."""
    total = p[0] * w
    for i in range(1, len(r)):
        total = total + p[i] * bent(t, kernel, i, resting(r, s, i, w))
    return total


@jit
def moved_input(
    t: MovingTables, kernel: TanhTables, r: Reals, p: Reals, s: State, lost: Reals, values: Reals, moving: bool, h: Any
) -> Any:
    """Input of the plays at which their sum is h, by halves between where it is and the farthest."""
    here = s.play[0]
    total = moved_sum(t, kernel, r, p, s, lost, values, here) if moving else resting_sum(t, kernel, r, p, s, here)
    if total == h:
        return here
    low = here if total < h else t.number[LEAST_INPUT]
    high = t.number[LARGEST_INPUT] if total < h else here
    for _ in range(t.halves):
        w = low + (high - low) * t.number[HALF]
        total = moved_sum(t, kernel, r, p, s, lost, values, w) if moving else resting_sum(t, kernel, r, p, s, w)
        if total < h:
            low = w
        else:
            high = w
    return high


