"""Plays that an effect moves or bends in its own way: the constants of `c_runtime/compensator/chain/moving_plays.c`.

The state of play i is where it would come to rest, and its contribution there. A plain play rests where it is. A
viscous play with the state q before a step is at `z = q + b1 dz_r(w - q)` at the end of the step, and its new state is
`q = z + (1 - E/M) dz_r(w - z)`, with `M = (1 - E) tau/T` and dz_r the part beyond +-r: the exact response to a straight
input while the play slides or rests.

The state of a play with a nonlinear dashpot is its position, in two parts. In a step its input counts as standing still
at a fraction a of the way: `z' = z + D(dz_r(x + a (w - x) - z))`, with D the yield of a stretch in a step by the
dashpot's own law. Two such plays whose inputs differ by at most e stay within e of each other, so the error is at most
a times the way.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from hystgen.arithmetic.factors import factor
from hystgen.basics.jit import jit
from hystgen.chain.static import StaticModel
from hystgen.compensator.fixed_tables import FixedCurve, reciprocal
from hystgen.compensator.layout import FixedTables
from hystgen.effects.base import Array, Effect, decays
from hystgen.effects.bend import Bends, bends
from hystgen.effects.noncongruent.model import LoopCentre, PlayFunctions
from hystgen.effects.rate_dependence import compensator as dashpot
from hystgen.effects.rate_dependence.compensator import Movement
from hystgen.effects.rate_dependence.model import RelaxingPlays, ThresholdRate
from hystgen.front.tanh.model import TanhEnvelope
from hystgen.plays.slots import Counts, Reals

PLAIN, DILATED, RELAXING, DASHPOT = range(4)
STRAIGHT, POLYNOMIAL, CENTRE = range(3)
"""How plays move, and how they are bent."""

SCALE, INVERSE_SCALE, MIDDLE, INVERSE_WIDTH, BUMP, TANH_CENTRE, LEAST_INPUT, LARGEST_INPUT, HALF, SEEN = range(10)
"""Places in `MovingTables.number`."""

CELLS = 4096
"""Cells in which the slope of bent plays is computed: 1/4096 of the range is far below the width of any bump that a
record shows; a search rejects widths below a twentieth of the range."""

YIELD_BEGIN, YIELD_C0, YIELD_C1, YIELD_C2, YIELD_C3, YIELD_SCALE, YIELD_LIFT = range(7)
"""Columns of the yields of a nonlinear dashpot in fixed point, as in `hystgen_yield_t`."""

MOST_YIELD_BITS = 30
"""Most bits of a yield below a step of the plays' input: its rounding error is kept in 32 bits."""

FINEST_BUMP = 8
"""Most bits of a bent play's contribution below a step of its input: the error of its curve is then a 16th of a
step."""


class MovingTables(NamedTuple):
    """Constants of moved or bent plays. `first`, `second` (n + 1,): for dilated plays the growth of a threshold per
    unit of a step, for viscous ones b1 and 1 - E/M; `curve` (n + 1, K): coefficients of the polynomials; `halves`:
    bisections of the search."""

    moves: int
    bends: int
    first: Reals
    second: Reals
    curve: Reals
    number: Reals
    halves: int
    scanned: int  # 1 for viscous plays with one time constant and no bend
    share: Reals  # p_i b1 (n + 1,), if scanned
    inverse: Reals  # 1 / (p_0 + b1 (p_1 + ... + p_i))
    yields: Reals  # (K, 5): yields of a nonlinear dashpot, by pieces

    @property
    def used(self) -> bool:
        """Whether an effect moves or bends the plays; if not, engine loop solves for them."""
        return self.moves != PLAIN or self.bends != STRAIGHT


class FixedMovingTables(NamedTuple):
    """The same in fixed point. `first`, `second`: factors (n + 1, 2); `farthest`: the largest input that a search
    tries; `relaxed`: tables of plays with the slopes that viscous plays with one time constant have in a step; `bump`:
    curves of bent plays less the plays themselves, with `bump_bits` bits below a step of their input; `bump_of`
    (n + 1,): the curve of each play; `yields` (K, 7): yields of a nonlinear dashpot with `yield_bits` bits below a
    step, in columns from `YIELD_BEGIN` on, for stretches up to `stretch`; `seen`: a factor."""

    moves: int
    bends: int
    scanned: int
    first: Reals
    second: Reals
    farthest: int
    relaxed: FixedTables
    bump: Bends
    bump_of: Counts
    bump_bits: int
    yields: Reals
    yield_bits: int
    stretch: int
    seen: Reals

    @property
    def used(self) -> bool:
        """Whether an effect moves or bends the plays; if not, engine loop solves for them."""
        return self.moves != PLAIN or self.bends != STRAIGHT


@dataclass(frozen=True)
class Bumps:
    """Contributions of bent plays less the plays themselves, in fixed point: curves for whole inputs from -`end` to
    `end`, whose values have `bits` bits below a step of the input and leave out `lift` of them; `of` (n + 1): the curve
    of each play; `largest`: the largest value, in steps."""

    curves: list[FixedCurve]
    of: list[int]
    end: int
    bits: int
    lift: int
    largest: float

    @property
    def error(self) -> float:
        """How far a value can be from the model's, in steps."""
        worst = max((curve.error for curve in self.curves), default=0.0)
        return worst * 2.0 ** (self.lift - self.bits) + 0.5 * (len(self.curves) > 0)


def problems(static: StaticModel, effects: Sequence[Effect], seconds: float) -> Iterator[tuple[Effect, str]]:
    """The effects on plays that the C cannot solve for at steps of `seconds`, each with its reason."""
    bending = [effect for effect in effects if effect.bends_plays()]
    yield from ((effect, "one effect bends the plays, and there is another one") for effect in bending[1:])
    if not bending:
        return
    if not (slope := least_slope(static, bending[:1])) > 0.0:
        yield bending[0], f"somewhere the output falls as the drive rises, by {-slope:.3g} a unit: there is no inverse"
    elif _dilated(static, effects, seconds) and not (slope := least_dilated(static, effects, seconds)) > 0.0:
        what = "plays are so steep that with thresholds by rate the output may fall in a step as the drive rises"
        yield bending[0], f"{what}, by {-slope:.3g} a unit: there is no inverse"


def _dilated(static: StaticModel, effects: Sequence[Effect], seconds: float) -> bool:
    """Whether thresholds grow with the rate and are emitted as such, not replaced by viscous plays."""
    r, p = np.array(static.pi.thresholds), np.array(static.pi.weights)
    thresholds = [effect for effect in effects if isinstance(effect, ThresholdRate)]
    return any(Movement(effect, r, p).by_threshold(seconds) for effect in thresholds)


def beyond_forward(static: StaticModel, effects: Sequence[Effect], seconds: float) -> Iterator[tuple[Effect, str]]:
    """Thresholds that grow so fast with the rate that viscous plays replace them, which only the inverse allows."""
    for effect in effects:
        if isinstance(effect, ThresholdRate) and not _dilated(static, [effect], seconds):
            yield effect, "viscous plays stand in for it, which only the inverse may; emit the inverse alone"


def least_dilated(static: StaticModel, effects: Sequence[Effect], seconds: float) -> float:
    """Least change of the sum per change of the plays' input in one step, for thresholds that grow with the rate."""
    p = np.array(static.pi.weights)
    found = float(p[0])
    steep = 1.0 + steepest_bend(static, effects)
    for effect in effects:
        if isinstance(effect, ThresholdRate):
            found += steep * float(np.sum(p[1:] * np.minimum(0.0, 1.0 - np.array(effect.betas) / seconds)))
    return found


def least_slope(static: StaticModel, effects: Sequence[Effect]) -> float:
    """Least change of the sum per change of the plays' input, over their reach and any number of plays that follow."""
    low, high = static.play_range
    p, r = np.array(static.pi.weights), np.array(static.pi.thresholds)
    at = np.linspace(low - r[-1], high + r[-1], CELLS + 1)
    rows = np.tile(at, (len(p), 1))
    for effect in effects:
        if effect.bends_plays():
            rows = effect.bent(rows, r)
    steep = np.diff(rows, axis=1) / np.diff(at)
    return float(np.min(np.cumsum(p[:, None] * steep, axis=0)))


def bent_slopes(static: StaticModel, effects: Sequence[Effect]) -> tuple[Array, Array]:
    """Least and largest change of each play's contribution (n + 1,) per change of the play, wherever it can be."""
    low, high = static.play_range
    r, start = np.array(static.pi.thresholds), np.array(static.pi.start)
    ends = np.array([low + r, high - r, start])
    at = np.linspace(np.min(ends, axis=0), np.max(ends, axis=0), CELLS + 1, axis=1)
    rows = at
    for effect in effects:
        if effect.bends_plays():
            rows = effect.bent(rows, r)
    moved = np.diff(at, axis=1)
    steep = np.divide(np.diff(rows, axis=1), moved, out=np.ones_like(moved), where=moved > 0.0)
    return np.min(steep, axis=1), np.max(steep, axis=1)


def of_shifts(static: StaticModel, effects: Sequence[Effect], moves: int, shifts: Array) -> tuple[float, float]:
    """Errors of the sum of plays whose input is shifted by up to `shifts` (n,), and the part that counts in the
    inverse, as an error of the sum that its gain `2/least_slope` multiplies."""
    flat, steep = bent_slopes(static, effects)
    p = np.abs(static.pi.weights)
    error = float((p * steep)[1:] @ shifts)
    if moves == DILATED or np.min(flat) < 0.0:
        return error, error
    in_order = all(_in_order(effect) for effect in effects if effect.moves_plays())
    found = found_shifted(p * steep, p * flat, shifts, in_order)
    return error, min(error, 0.5 * least_slope(static, effects) * found)


def found_shifted(most: Array, least: Array, shifts: Array, in_order: bool) -> float:
    """Error of the inverse's input for plays whose input is shifted by up to `shifts` (n,), anew at each time.

    `most`, `least` (n + 1,): change of a play's contribution per change of the play; `in_order`: see below.

    The difference of two such plays is `d_i' = a_i (e + g_i - d_i)`, with shifts g_i and rates a_i >= 0, and the
    inverse has `p_0 e = -sum p_i d_i`. Backwards in time, the share x_i of d_i in e is like heat that starts in a hub
    of capacity p_0 and spreads to places of capacity p_i while their plays move, and g_i counts with each change of
    x_i. Plays come into contact in the order of their thresholds. Those that follow at once then share the heat evenly
    with the hub, so that x_i rises to at most `1/(p_0 + .. + p_i)` and falls to at least `1/sum p`:

        |e| <= sum g_i p_i (2/(p_0 + .. + p_i) - 1/sum p).

    Places that heat up slowly can take heat from others again. A search of schedules for sets of 3 to 6 weights over up
    to four decades found sums of at most 1.13 times this bound if rates do not rise with the threshold (`in_order`),
    all below the bound without its second term, which is used here. For rates in any order it found up to 0.7 of
    `2 g log(sum p/p_0)`, which is at least as large as that bound for any order of the plays. Neither is proved for
    plays that follow in part; benchmarks/chosen_numbers.py shifts repeats the search, and reaches 0.86 and 0.64 of
    them.
    """
    slopes = np.cumsum(least)
    if in_order:
        return float(np.sum(2.0 * most[1:] / slopes[1:] * shifts))
    return float(2.0 * np.max(most / least) * math.log(slopes[-1] / slopes[0]) * np.max(shifts, initial=0.0))


def _in_order(effect: Effect) -> bool:
    """Whether no moving play yields faster than one with a smaller threshold."""
    if isinstance(effect, ThresholdRate):
        return len(set(effect.betas)) == 1
    return isinstance(effect, RelaxingPlays) and effect.exponent >= 1.0


def steepest_bend(static: StaticModel, effects: Sequence[Effect]) -> float:
    """Largest difference between the slope of a bent play and 1, the slope of the play itself."""
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
    """The tables of a model's plays, for effects without `problems` and drive steps up to `largest_step`."""
    n = static.pi.n
    low, high = static.play_range
    first, second = np.zeros(n + 1), np.zeros(n + 1)
    moves, kind = PLAIN, STRAIGHT
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
            kind = POLYNOMIAL
            terms = max(map(len, effect.coefficients))
            curve = np.zeros((n + 1, terms))
            for i, row in enumerate(effect.coefficients, 1):
                curve[i, : len(row)] = row
            number[[SCALE, INVERSE_SCALE]] = r[-1], 1.0 / r[-1]
        elif isinstance(effect, LoopCentre):
            kind = CENTRE
            number[[MIDDLE, INVERSE_WIDTH]] = effect.centre, 1.0 / effect.width
            number[[BUMP, TANH_CENTRE]] = effect.amplitude * effect.width, math.tanh(effect.centre / effect.width)
    halves = int(np.finfo(dtype).nmant) + 4
    p = np.array(static.pi.weights)
    scanned = moves == RELAXING and kind == STRAIGHT and len(set(first[1:].tolist())) == 1 and float(np.min(p)) >= 0.0
    share = np.append(0.0, p[1:] * first[1:])
    inverse = 1.0 / (p[0] + np.cumsum(share)) if scanned else np.zeros(n + 1)
    given = (np.array(each, dtype=dtype) for each in (first, second, curve, number, share, inverse, yields))
    first, second, curve, number, share, inverse, yields = given
    return MovingTables(moves, kind, first, second, curve, number, halves, int(scanned), share, inverse, yields)


def largest_bend(static: StaticModel, effects: Sequence[Effect]) -> float:
    """Largest difference between the contribution of a bent play and the play itself, over the reach of plays."""
    r, far = np.array(static.pi.thresholds), _far(static)
    rows = np.tile(np.linspace(-far, far, CELLS + 1), (len(r), 1))
    away = np.zeros_like(rows)
    for effect in effects:
        if effect.bends_plays():
            away += effect.bent(rows, r) - rows
    return float(np.max(np.abs(away)) + np.max(np.abs(np.diff(away, axis=1))))


def largest_stretch(static: StaticModel) -> float:
    """Largest distance by which the plays' input can be ahead of a play: the span of all places where either can be."""
    ends = *static.play_range, *static.pi.start
    return max(ends) - min(ends)


def _far(static: StaticModel) -> float:
    """Largest distance of plays from 0, with a small margin."""
    return 1.001 * max(*map(abs, static.play_range), *map(abs, static.pi.start))


def bumps(static: StaticModel, effects: Sequence[Effect], step: float, end: int, degree: int) -> Bumps:
    """Curves of bent plays for inputs in steps of `step`, up to `end`. Raises FormatError if one bends too sharply."""
    largest = largest_bend(static, effects) / step
    room = 30 - max(0, math.ceil(math.log2(max(largest, 1.0))))
    bits, lift = max(0, min(room, FINEST_BUMP)), max(0, -room)
    found = Bumps([], [0] * (static.pi.n + 1), end, bits, lift, largest)
    unit = step * 2.0 ** (lift - bits)
    kinds: dict[Any, int] = {}
    for effect in effects:
        if not effect.bends_plays():
            continue
        for i in range(1, static.pi.n + 1):
            key, function = _bump(effect, i, static.pi.thresholds[-1])
            if key not in kinds:
                kinds[key] = len(found.curves)
                allowed = max(0.5, 2.0**bits / 64.0)
                curve = FixedCurve(lambda z: function(z * step) / unit, (-end, end), [], degree, allowed)  # noqa: B023
                found.curves.append(curve)
            found.of[i] = kinds[key]
    return found


def _bump(effect: Effect, i: int, scale: float) -> tuple[Any, Callable[[float], float]]:
    """A key that plays with the same bend share, and the difference between a bent play's contribution and the play."""
    if isinstance(effect, PlayFunctions):
        row = effect.coefficients[i - 1]

        def polynomial(z: float) -> float:
            xi, total = z / scale, 0.0
            for c in reversed(row):
                total = (total + c) * xi
            return scale * (total * xi)

        return row, polynomial
    assert isinstance(effect, LoopCentre)
    high, inverse = effect.amplitude * effect.width, 1.0 / effect.width
    bump = TanhEnvelope((1.0, inverse, -effect.centre * inverse, 0.0))
    begin = float(bump.forward(0.0))
    return "centre", lambda z: high * (float(bump.forward(z)) - begin)


def build_fixed(
    plays: FixedTables,
    static: StaticModel,
    effects: Sequence[Effect],
    seconds: float,
    farthest: int,
    bump: Bumps,
    step: float,
    largest_step: float,
) -> FixedMovingTables:
    """The tables in fixed point, with inputs in steps of `step` and up to `farthest`. Raises OverflowError."""
    own = build(static, effects, seconds, largest_step, np.float64)
    first, second = (np.array([factor(x) for x in each], dtype=np.int64) for each in (own.first, own.second))
    ends, scaled = [(-bump.end, bump.end)] * len(bump.curves), [(0, bump.lift)] * len(bump.curves)
    degree = bump.curves[0].degree if bump.curves else 0
    curves = bends([curve.pieces for curve in bump.curves], ends, scaled, degree)
    relaxed = _relaxed(plays, float(own.first[1])) if own.scanned else plays
    stretch_end = min(farthest + bump.end, 2**32 - 1)
    bits = min(MOST_YIELD_BITS, 61 - stretch_end.bit_length())
    rows: list[tuple[int, ...]] = []
    for effect in filter(dashpot.nonlinear, effects):
        scale = static.pi.thresholds[-1]
        begins = [round(x / step) for x in own.yields[:, dashpot.BEGIN].tolist()]
        rows = _yields(lambda x: dashpot.yielded(effect, scale, seconds, x), begins, stretch_end, step, bits)  # noqa: B023
    return FixedMovingTables(
        own.moves, own.bends, own.scanned, first, second, farthest, relaxed, curves,
        np.array(bump.of, dtype=np.int64), bump.bits,
        np.array(rows, dtype=np.int64).reshape(-1, YIELD_LIFT + 1), bits, stretch_end,
        np.array(factor(float(own.number[SEEN])), dtype=np.int64),
    )


def _yields(
    law: Callable[[float], tuple[float, float]], begins: Sequence[int], end: int, step: float, bits: int
) -> list[tuple[int, ...]]:
    """Pieces of the yields of stretches up to `end`, cubic between whole knots; the first one is straight."""
    knots = sorted({0, end + 1, *(x for x in begins if 0 < x <= end)})
    while knots[-2] and dashpot.LONGEST * knots[-2] < end:  # beyond the last piece in floating point
        knots.insert(-1, int(dashpot.LONGEST) * knots[-2])
    while (wide := max(b - a for a, b in itertools.pairwise(knots))) > 2**30:
        k = next(i for i, (a, b) in enumerate(itertools.pairwise(knots)) if b - a == wide)
        knots.insert(k + 1, (knots[k] + knots[k + 1]) // 2)
    rows = []
    for a, b in itertools.pairwise(knots):
        shift = 31 - (b - a).bit_length()
        ratio = 2.0 ** (31 - shift) / (b - a)  # range of the variable per length of the piece
        if a:
            (low, begin), (high, slope) = law(a * step), law(b * step)
            run, rise = (b - a) * step, high - low
            c = [low, begin * run, 3.0 * rise - (2.0 * begin + slope) * run, (begin + slope) * run - 2.0 * rise]
        else:
            c = [0.0, law(b * step)[0], 0.0, 0.0]
        units = [each * ratio**k * 2.0**bits / step for k, each in enumerate(c)]
        lift = max(0, max(math.frexp(each)[1] for each in units) - 30)
        rows.append((a, *(round(each / 2.0**lift) for each in units), shift, lift))
    return rows


def yield_error(
    t: FixedMovingTables, effect: RelaxingPlays, static: StaticModel, seconds: float, step: float, way: float
) -> float:
    """As `dashpot.stretch_error`, for tables in fixed point with steps of `step`, plus the stretch lost to rounding."""
    rows, held = [], []
    for begin, *c, shift, lift in t.yields.tolist():
        unit, run = step * 2.0 ** (lift - t.yield_bits), step * 2.0 ** (31 - shift)
        rows.append((begin * step, *(each * unit / run**k for k, each in enumerate(c))))
        held.append(2.5 * unit)  # rounding of a coefficient and of three products
    ways = way, largest_stretch(static)
    return dashpot.stretch_error(effect, static.pi.thresholds[-1], seconds, np.array(rows), ways, np.array(held))


def _relaxed(plays: FixedTables, late: float) -> FixedTables:
    """Tables of plays with the slopes of viscous ones that gain the share `late` of their stretch in a step."""
    weight = plays.weight
    sums = [0, int(weight[0])]
    for p in weight[1:].tolist():
        sums.append(sums[-1] + round(p * late))
    pairs = [reciprocal(slope) for slope in sums]
    return plays._replace(
        slope=np.array(sums, dtype=np.int64),
        reciprocal=np.array([pair[0] for pair in pairs], dtype=np.int64),
        shift=np.array([pair[1] for pair in pairs], dtype=np.int64),
    )


@jit(inline=True)
def stretch(x: Any, r: Any) -> Any:
    """The part of x beyond +-r."""
    if x > r:
        return x - r
    if x < -r:
        return x + r
    return r - r


def _viscous(seconds: float, tau: float) -> tuple[float, float]:
    """b1 and 1 - E/M of a step; a play with the time constant 0 follows at once."""
    if not tau > 0.0:
        return 1.0, 0.0
    decay, _, late = (float(x[0]) for x in decays(np.array([seconds]), tau))
    return late, 1.0 - decay / (1.0 - late)
