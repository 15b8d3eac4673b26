"""Plays that an effect moves or bends in its own way: their slopes, bounds and constants, from what the effect provides
(`hystgen.effects.plays`). The C is `c_runtime/compensator/chain/moving_plays.c` and the files of the effects."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hystgen.arithmetic.factors import factor
from hystgen.chain.static import StaticModel
from hystgen.compensator.chain.parts import BENDS, ELEMENTS, MOVES
from hystgen.compensator.fixed_tables import FixedCurve, reciprocal
from hystgen.compensator.layout import FixedTables
from hystgen.effects import plays as at
from hystgen.effects.base import Array, Effect
from hystgen.effects.bend import bends
from hystgen.effects.plays import *  # noqa: F403  emission asks for the codes here

CELLS = 4096
"""Number of cells in which slopes of bent plays are computed: 1/4096 of the range is far below the width of any bump
that a record can show; the search for a bump rejects widths below a twentieth of the range."""

CLOSENESS = 0.125
"""[times the bound of the sum's rounding error] A search in floating point ends when its last step leaves at most this
error of the sum: sums of 10 plays are off by at most a 30th of the bound, so nearly every search succeeds."""

STRAIGHTNESS = 16.0
"""[1] In fixed point, the sum of elements is computed along its slope where this errs by at most this part of the
change for half a step of the input. Set by: benchmarks/effect_costs.py --parts elements, which finds 3 % fewer
instructions with 4 and 3 % more with 64 (q31, Cortex-M4F)."""

MOST_TURNS = 12
"""Maximum number of iterations for the reciprocal of a slope: enough if the smallest slope is at least a 400th of the
largest; with flatter ones Newton's method takes shorter steps."""

MOST_YIELD_BITS = 30
"""Maximum bits of a yield below a step of the plays' input: its rounding error is kept in 32 bits."""

FINEST_BUMP = 8
"""Maximum bits of a bent play's contribution below a step of its input: its curve's error is then a 16th of a step."""


def movers(static: StaticModel, effects: Sequence[Effect], weights: Array | None = None) -> list[at.Mover]:
    """The mover of the plays, if an effect moves them; `weights`: used in place of the model's."""
    r, p = np.array(static.pi.thresholds), np.array(static.pi.weights) if weights is None else weights
    return [MOVES.of(effect, r, p) for effect in effects if effect.moves_plays()]


def parallel(static: StaticModel, effects: Sequence[Effect]) -> list[at.ParallelTerms]:
    """The elements in parallel with the plays, if an effect adds them."""
    return [ELEMENTS.of(effect, *static.play_range) for effect in effects if effect.joins_plays()]


def largest_parallel(static: StaticModel, effects: Sequence[Effect]) -> float:
    """Largest magnitude of the sum of the elements in parallel with the plays."""
    return math.fsum(float(np.abs(each.weights) @ each.most) for each in parallel(static, effects))


def parallel_slopes(static: StaticModel, effects: Sequence[Effect]) -> tuple[float, float]:
    """Smallest and largest change of the sum of the elements per change of their input, over all histories."""
    found = [each.weights * np.stack([each.flattest, each.steepest]) for each in parallel(static, effects)]
    return (
        math.fsum(float(np.sum(np.min(each, axis=0))) for each in found),
        math.fsum(float(np.sum(np.max(each, axis=0))) for each in found),
    )


@dataclass(frozen=True)
class Bumps:
    """Contributions of bent plays minus the plays themselves, in fixed point: curves for integer inputs from -`end` to
    `end`, whose values have `bits` bits below a step of the input or omit its `lift` lowest bits; `of` (n + 1): index
    of each play's curve; `largest`: largest value, in steps."""

    curves: list[FixedCurve]
    of: list[int]
    end: int
    bits: int
    lift: int
    largest: float

    @property
    def error(self) -> float:
        """Largest difference of a value from the model's, in steps."""
        worst = max((curve.error for curve in self.curves), default=0.0)
        return worst * 2.0 ** (self.lift - self.bits) + 0.5 * (len(self.curves) > 0)


def problems(static: StaticModel, effects: Sequence[Effect], seconds: float) -> Iterator[tuple[Effect, str]]:
    """The effects on plays that the C cannot invert at steps of `seconds`, each with its reason."""
    bending = [effect for effect in effects if effect.bends_plays()]
    yield from ((effect, "one effect bends the plays, and there is another one") for effect in bending[1:])
    joining = [effect for effect in effects if effect.joins_plays()]
    wrong = [(each, found) for each in joining for found in each.problems_within(*static.play_range)]
    if wrong:
        yield from wrong
        return
    if joining and not (slope := least_slope(static, [*bending[:1], *joining])) > 0.0:
        falling = -parallel_slopes(static, joining)[0]
        what = f"right after a turn the output falls as the drive rises, by {-slope:.3g} a unit: there is no inverse"
        room = slope + falling
        yield joining[0], what + (f"; divide negative weights by more than {falling / room:.3g}" if room > 0.0 else "")
        return
    if not bending:
        return
    if not (slope := least_slope(static, bending[:1])) > 0.0:
        yield bending[0], f"somewhere the output falls as the drive rises, by {-slope:.3g} a unit: there is no inverse"
    elif dilated(static, effects, seconds) and not (slope := least_dilated(static, effects, seconds)) > 0.0:
        what = "plays are so steep that with thresholds by rate the output may fall in a step as the drive rises"
        yield bending[0], f"{what}, by {-slope:.3g} a unit: there is no inverse"


def dilated(static: StaticModel, effects: Sequence[Effect], seconds: float) -> bool:
    """Whether thresholds grow with the rate and are emitted as such, not replaced by viscous plays."""
    return any(mover.moves(seconds) == at.DILATED for mover in movers(static, effects))


def beyond_forward(static: StaticModel, effects: Sequence[Effect], seconds: float) -> Iterator[tuple[Effect, str]]:
    """Effects whose plays are replaced by viscous ones, which only the inverse allows."""
    moving = [effect for effect in effects if effect.moves_plays()]
    for effect, mover in zip(moving, movers(static, effects), strict=True):
        if mover.stood_in_for(seconds):
            yield effect, "viscous plays stand in for it, which only the inverse may; emit the inverse alone"


def least_dilated(static: StaticModel, effects: Sequence[Effect], seconds: float) -> float:
    """Smallest change of the sum per change of the plays' input in one step, for thresholds that grow with the rate."""
    steep = 1.0 + steepest_bend(static, effects)
    falls = (mover.falling(seconds, steep) for mover in movers(static, effects))
    return sum(falls, start=float(static.pi.weights[0])) + parallel_slopes(static, effects)[0]


def least_slope(static: StaticModel, effects: Sequence[Effect]) -> float:
    """Smallest change of the sum per change of the plays' input, over their reach and any number of following plays."""
    p = np.array(static.pi.weights)
    plays = float(np.min(np.cumsum(p[:, None] * _bends(static, effects)[1], axis=0)))
    return plays + parallel_slopes(static, effects)[0]


def bent_slopes(static: StaticModel, effects: Sequence[Effect]) -> tuple[Array, Array]:
    """Smallest and largest change of each play's contribution (n + 1,) per change of the play, over its whole reach."""
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


def slopes(static: StaticModel, effects: Sequence[Effect], seconds: float) -> tuple[float, float]:
    """Smallest and largest change of the sum per change of the plays' input in a step of `seconds`."""
    p, steep = np.abs(static.pi.weights), 1.0 + steepest_bend(static, effects)
    least, drawn = least_slope(static, effects), np.ones(static.pi.n)
    for mover in movers(static, effects):
        if mover.moves(seconds) == at.DILATED:
            least = min(least, least_dilated(static, effects, seconds))
            drawn = drawn + mover.numbers(seconds, 1.0, 1.0).first
    return least, float(p[0] + steep * (p[1:] @ drawn)) + parallel_slopes(static, effects)[1]


def inverse_turns(least: float, most: float, unit: float) -> tuple[float, int]:
    """Reciprocal of the mean of two slopes, and number of iterations `x <- x (2 - slope x)` that turn it into the
    reciprocal of any slope in between, to a relative error of `unit`: each squares the error."""
    off = (most - least) / (most + least)
    turns = math.log2(max(math.log(unit) / math.log(off), 1.0)) if off > 0.0 else 0.0
    return 2.0 / (least + most), min(math.ceil(turns), MOST_TURNS)


def sum_rounding(static: StaticModel, effects: Sequence[Effect], unit: float) -> float:
    """Bound on the rounding error of a sum of moved or bent plays at any input that a search tries; `unit`: unit
    roundoff."""
    low, high = static.play_range
    size = 3.0 * max(abs(low), abs(high)) + static.pi.thresholds[-1]
    bent = 1.0 + abs(steepest_bend(static, effects))
    elements = 24.0 * unit * largest_parallel(static, effects)
    return (12.0 + len(static.pi.weights)) * unit * size * bent * float(np.sum(np.abs(static.pi.weights))) + elements


def residual(static: StaticModel, effects: Sequence[Effect], unit: float) -> float:
    """Largest error of the sum that a search leaves after its last step."""
    return CLOSENESS * sum_rounding(static, effects, unit)


def closeness(
    static: StaticModel, effects: Sequence[Effect], slopes: tuple[float, float], unit: float, turns: int,
    varies: tuple[float, float] | None,
) -> float:
    """Largest error of the sum from which one more step leaves at most `residual`.

    A step with the reciprocal of the mean slope leaves at most `(most - least)/(most + least)` of the error. With plays
    that start to move softly (`varies`, as in `Moved`), the slope changes by at most `J + M d` within a step d, and a
    step with the slope at its start leaves at most `J d + M d^2/2`; J includes the error of the reciprocal.
    """
    left, (least, most) = residual(static, effects, unit), slopes
    off = (most - least) / (most + least)
    if varies is None:
        return left / (off + 4.0 * unit)
    p = np.abs(static.pi.weights)
    steep = 1.0 + steepest_bend(static, effects)
    jumps = float(np.sum(p[1:])) * steep * varies[0]
    bend = float(np.sum(p[1:])) * (steep * varies[1] + sharpest_bend(static, effects))
    return smoothness(left, slopes, (jumps, bend), unit, turns)


def smoothness(left: float, slopes: tuple[float, float], varies: tuple[float, float], unit: float, turns: int) -> float:
    """Largest error of the sum from which one more step, with the slope at its start, leaves at most `left`, if the
    slope changes by at most `varies`, J, and M per change of the input, as in `closeness`."""
    least, most = slopes
    off = (most - least) / (most + least)
    jumps, bend = varies[0] + most * (math.pow(off, 2.0**turns) + 8.0 * unit), varies[1]
    return least * 2.0 * left / (jumps + math.sqrt(jumps * jumps + 2.0 * bend * left))


def of_shifts(static: StaticModel, effects: Sequence[Effect], moves: int, shifts: Array) -> tuple[float, float]:
    """Error of the sum of plays whose inputs are shifted by up to `shifts` (n,), and the part that affects the inverse,
    as an error of the sum to be multiplied by the gain `2/least_slope`."""
    flat, steep = bent_slopes(static, effects)
    p = np.abs(static.pi.weights)
    error = float((p * steep)[1:] @ shifts)
    if moves == at.DILATED or np.min(flat) < 0.0:
        return error, error
    in_order = all(mover.in_order for mover in movers(static, effects))
    found = found_shifted(p * steep, p * flat, shifts, in_order)
    return error, min(error, 0.5 * least_slope(static, effects) * found)


def found_shifted(most: Array, least: Array, shifts: Array, in_order: bool) -> float:
    """Error of the inverse's input for plays whose inputs are shifted by up to `shifts` (n,), varying over time.

    `most`, `least` (n + 1,): change of a play's contribution per change of the play; `in_order`: see below.

    A play with shift g_i and its exact counterpart differ by d_i, `d_i' = a_i (e + g_i - d_i)` with rates a_i >= 0, and
    the inverse has `p_0 e = -sum p_i d_i`. Backwards in time, the weight x_i of d_i in e behaves like heat that starts
    in a hub of capacity p_0 and spreads to places of capacity p_i while their plays move; g_i enters with each change
    of x_i. Plays come into contact in the order of their thresholds. Those that follow at once then share the heat
    evenly with the hub, so that x_i rises to at most `1/(p_0 + .. + p_i)` and falls to at least `1/sum p`:

        |e| <= sum g_i p_i (2/(p_0 + .. + p_i) - 1/sum p).

    Places that heat up slowly can take heat from others again. A search of schedules for sets of 3 to 6 weights over up
    to four decades found sums of at most 1.13 times this bound if rates do not rise with the threshold (`in_order`);
    all are below the bound without its second term, which is used here. For rates in any order it found up to 0.7 of
    `2g log(sum p/p_0)`, which is at least as large as that bound for any order of the plays. Neither bound is proved
    for plays that follow in part; benchmarks/chosen_numbers.py shifts repeats the search and reaches 0.86 and 0.64 of
    them.
    """
    slopes = np.cumsum(least)
    if in_order:
        return float(np.sum(2.0 * most[1:] / slopes[1:] * shifts))
    return float(2.0 * np.max(most / least) * math.log(slopes[-1] / slopes[0]) * np.max(shifts, initial=0.0))


def steepest_bend(static: StaticModel, effects: Sequence[Effect]) -> float:
    """Largest difference between the slope of a bent play and 1, the slope of the play itself."""
    return float(np.max(np.abs(_bends(static, effects)[1] - 1.0)))


def _bends(static: StaticModel, effects: Sequence[Effect]) -> tuple[float, Array]:
    """The width of the cells, and the slopes of the plays' contributions (n + 1, `CELLS`)."""
    low, high = static.play_range
    r = np.array(static.pi.thresholds)
    at = np.linspace(low - r[-1], high + r[-1], CELLS + 1)
    rows = np.tile(at, (len(r), 1))
    for effect in effects:
        if effect.bends_plays():
            rows = effect.bent(rows, r)
    return float(at[1] - at[0]), np.diff(rows, axis=1) / np.diff(at)


def sharpest_bend(static: StaticModel, effects: Sequence[Effect]) -> float:
    """Largest change of a bent play's slope per change of the play."""
    cell, steep = _bends(static, effects)
    return float(np.max(np.abs(np.diff(steep, axis=1)))) / cell


def build(
    static: StaticModel, effects: Sequence[Effect], seconds: float, largest_step: float, dtype: Any
) -> at.MovingTables:
    """The tables of a model's plays, for effects without `problems` and drive steps up to `largest_step`."""
    n = static.pi.n
    low, high = static.play_range
    r, p = np.array(static.pi.thresholds), np.array(static.pi.weights)
    first, second, curve = np.zeros(n + 1), np.zeros(n + 1), np.zeros((n + 1, 1))
    moves, kind, yields = at.PLAIN, at.STRAIGHT, np.zeros((0, 5))
    number = {"least_input": 2.0 * low - high, "largest_input": 2.0 * high - low, "half": 0.5, "one": 1.0}
    varies = None
    for mover in movers(static, effects):
        found = mover.numbers(seconds, largest_step, 3.0 * (high - low))
        moves, first[1:], second[1:], yields, number["standing_share"], _ = found
        varies = found.varies if moves == at.DASHPOT else None
    for effect in effects:
        if effect.bends_plays():
            kind, rows, numbers, _ = BENDS.of(effect, r, p)
            curve = np.zeros((n + 1, rows.shape[1]))
            curve[1:] = rows
            number |= numbers
    halves = int(np.finfo(dtype).nmant) + 4
    joined = parallel(static, effects)
    alone = not (joined or movers(static, effects) or any(effect.bends_plays() for effect in effects))
    turns = 0
    if not alone:
        unit = float(np.finfo(dtype).eps) / 2
        ends = slopes(static, effects, seconds)
        number["rate"], turns = inverse_turns(*ends, unit)
        number["close"] = closeness(static, effects, ends, unit, turns, varies)
        if (room := number["close"] - sum_rounding(static, effects, unit)) > 0.0:  # a narrower interval is not needed
            halves = min(halves, math.ceil(math.log2(3.0 * (high - low) * ends[1] / room)))
        if joined and moves == at.PLAIN and kind == at.STRAIGHT:
            bend = math.fsum(float(np.abs(each.weights) @ each.bend) for each in joined)
            number["smooth"] = smoothness(residual(static, effects, unit), ends, (0.0, bend), unit, turns)
    alike = kind == at.STRAIGHT and not joined and len(set(first[1:].tolist())) == 1
    scanned = moves == at.RELAXING and alike and float(np.min(p)) >= 0.0
    share = np.append(0.0, p[1:] * first[1:])
    inverse = 1.0 / (p[0] + np.cumsum(share)) if scanned else np.zeros(n + 1)
    given = (np.array(each, dtype=dtype) for each in (first, second, curve, share, inverse, yields))
    first, second, curve, share, inverse, yields = given
    constants = at.MovingNumbers.of([[number.get(name, 0.0) for name in at.MovingNumbers.members()]], dtype)
    elements = joined[0].tables(dtype) if joined else at.ElementTables.none(dtype)
    return at.MovingTables(
        moves, kind, first, second, curve, constants, halves, turns, int(scanned), share, inverse, yields, elements
    )


def largest_bend(static: StaticModel, effects: Sequence[Effect]) -> float:
    """Largest difference between the contribution of a bent play and the play itself, over the plays' reach."""
    r, far = np.array(static.pi.thresholds), _far(static)
    rows = np.tile(np.linspace(-far, far, CELLS + 1), (len(r), 1))
    away = np.zeros_like(rows)
    for effect in effects:
        if effect.bends_plays():
            away += effect.bent(rows, r) - rows
    return float(np.max(np.abs(away)) + np.max(np.abs(np.diff(away, axis=1))))


def largest_stretch(static: StaticModel) -> float:
    """Largest distance by which the plays' input can be ahead of a play: the span of all values of either."""
    ends = *static.play_range, *static.pi.start
    return max(ends) - min(ends)


def _far(static: StaticModel) -> float:
    """Largest distance of a play from 0, with a small margin."""
    return 1.001 * max(*map(abs, static.play_range), *map(abs, static.pi.start))


def bumps(static: StaticModel, effects: Sequence[Effect], step: float, end: int, degree: int) -> Bumps:
    """Curves of bent plays for inputs in steps of `step`, up to `end`. Raises FormatError if one bends too sharply."""
    largest = largest_bend(static, effects) / step
    room = 30 - max(0, math.ceil(math.log2(max(largest, 1.0))))
    bits, lift = max(0, min(room, FINEST_BUMP)), max(0, -room)
    found = Bumps([], [0] * (static.pi.n + 1), end, bits, lift, largest)
    unit = step * 2.0 ** (lift - bits)
    kinds: dict[object, int] = {}
    r, p = np.array(static.pi.thresholds), np.array(static.pi.weights)
    for bender in (BENDS.of(effect, r, p) for effect in effects if effect.bends_plays()):
        for i in range(1, static.pi.n + 1):
            key, function = bender.bump(i)
            if key not in kinds:
                kinds[key] = len(found.curves)
                allowed = max(0.5, 2.0**bits / 64.0)
                curve = FixedCurve(lambda z: function(z * step) / unit, (-end, end), [], degree, allowed)  # noqa: B023
                found.curves.append(curve)
            found.of[i] = kinds[key]
    return found


def build_fixed(
    plays: FixedTables, static: StaticModel, effects: Sequence[Effect], seconds: float, farthest: int, bump: Bumps,
    step: float, largest_step: float,
) -> at.FixedMovingTables:
    """The tables in fixed point, with inputs in steps of `step` and up to `farthest`. Raises OverflowError."""
    own = build(static, effects, seconds, largest_step, np.float64)
    first, second = (np.array([factor(x) for x in each], dtype=np.int64) for each in (own.first, own.second))
    ends, scaled = [(-bump.end, bump.end)] * len(bump.curves), [(0, bump.lift)] * len(bump.curves)
    terms = [k for curve in bump.curves for piece in curve.pieces for k, c in enumerate(piece.coefficients) if c]
    degree = max(terms, default=1)
    curves = bends([curve.pieces for curve in bump.curves], ends, scaled, degree)
    relaxed = _relaxed(plays, float(own.first[1])) if own.scanned else plays
    least, weight = slopes(static, effects, seconds)[0], static.pi.weights[0]
    near = int(0.5 * int(plays.weight[0]) * least / weight) if weight > 0.0 else 0
    stretch_end = min(farthest + bump.end, 2**32 - 1)
    bits = min(MOST_YIELD_BITS, 61 - stretch_end.bit_length())
    rows: list[tuple[object, ...]] = []
    for mover in movers(static, effects):
        begins = [round(x / step) for x in own.yields[:, 0].tolist()]
        rows = mover.whole_yields(seconds, begins, stretch_end, step, bits)
    unit = step * weight / int(plays.weight[0]) if weight > 0.0 else 0.0  # of the sum, output units
    found = [each.coded(step, unit, unit * near / STRAIGHTNESS) for each in parallel(static, effects)]
    elements = found[0] if found else at.FixedElementTables.none()
    return at.FixedMovingTables(
        own.moves, own.bends, own.scanned, first, second, farthest, near, max(32, 31 + near.bit_length()), relaxed,
        curves, np.array(bump.of, dtype=np.int64), bump.bits, at.FixedYield.of(rows), bits, stretch_end,
        np.array(factor(float(own.number.standing_share[0])), dtype=np.int64),
        elements,
    )


def yield_error(
    t: at.FixedMovingTables, static: StaticModel, effects: Sequence[Effect], seconds: float, step: float, way: float
) -> float:
    """As `Mover.stretch_error`, for tables in fixed point with steps of `step`, plus the stretch lost to rounding."""
    rows, held = [], []
    for begin, c, shift, lift in t.yields.tolist():
        unit, run = step * 2.0 ** (lift - t.yield_bits), step * 2.0 ** (31 - shift)
        rows.append((begin * step, *(each * unit / run**k for k, each in enumerate(c))))
        held.append(2.5 * unit)  # rounding of a coefficient and of three products
    ways = way, largest_stretch(static)
    errors = (each.stretch_error(seconds, np.array(rows), ways, np.array(held)) for each in movers(static, effects))
    return max(errors, default=0.0)


def _relaxed(plays: FixedTables, late: float) -> FixedTables:
    """Tables of plays with the slopes of viscous plays, which make up for `late` of their stretch in a step."""
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
