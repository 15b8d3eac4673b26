"""Error bounds of a compiled operator with effects against the model in double precision, block by block.

Every block adds the roundings of its own operations to the error that reaches it, and passes the sum on with its
largest gain from sample to sample. Limiting a drive to its range or committing one, in one computation or in both,
never increases their difference: limiting is nonexpansive, and both absorb the applied drive. A slew limit leaves
drives as far apart as they were, while a lag in front of the plays follows them; with both, only the range of the drive
bounds the errors behind them, and `rounding` excludes that case.

Inverse. The reference minus its offsets passes through saturation (slope at the ends of the output), the taps (sum of
their absolute values) and gains (at most 1/LEAST_GAIN); then creep, whose inverse passes an output error on to its
input, and from there through all states to later inputs: `e <= R eta + R g e`, with `g = sum c_i (1 - b1_i)` the
states' share of the previous input, hence `e <= eta/(d + 2 sum c_i b1_i - sum c_i)`. For plays see
`hystgen.compensator.bounds`. Leading a lag multiplies an error by `(1 + 2 theta)/(1 - theta)`, since the previous
target counts too, even if a limit has shifted it, and then by `(2 - rate)/rate`. For a user's own block see `own`.

States that move by less than their last bit are kept in two parts. Their roundings are proportional to their steps, so
they add up to a few units of the state however slow it is; roundings of the second part add up to `u^2/rate` of it.
"""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np

from hystgen.chain.static import StaticModel
from hystgen.compensator import engines
from hystgen.compensator.bounds import SECOND_ORDER, UNSLEWED, ErrorBounds, LoopRoundings, error_bounds, together
from hystgen.compensator.chain import moving
from hystgen.compensator.chain.layout import Compiled, ahead_of, crossing, lead
from hystgen.compensator.chain.parts import SENT, Parts
from hystgen.effects.maps import MapErrors
from hystgen.effects.part import Gained, Speed
from hystgen.effects.plays import DASHPOT, DILATED, RELAXING

SAME = "both have seen the same drives"

STILL = "the drive does not stand still"
"""Condition for a quiet drive in front of a lag: the arriving signal is then within twice its dither of the target."""


@dataclasses.dataclass(frozen=True)
class _Sizes:
    """Largest magnitudes: drive, sum of the plays, output behind creep, displacement with all settings."""

    drive: float
    plays: float
    output: float
    displacement: float


def _sizes(compiled: Compiled) -> _Sizes:
    static, t = compiled.static, compiled.tables
    drive = max(abs(end) for end in static.input_range)
    bent = moving.largest_bend(static, compiled.parts.plays)
    plays = LoopRoundings.of(static).level + math.fsum(map(abs, static.pi.weights)) * bent
    plays += moving.largest_parallel(static, compiled.parts.plays)
    output = plays * math.prod(one.growth for one in compiled.behind)
    ends = [abs(float(t.limits.output.low[0])), abs(float(t.limits.output.high[0]))]
    settings = 2.0 * max(ends) * (1 + 3 * t.number_of("clock"))  # a drift has six roundings of its own
    return _Sizes(drive, plays, output, max(ends) + abs(static.output_offset) + settings)


def _mapped(compiled: Compiled, u: float, kind: str) -> tuple[float, float, float]:
    """Maps of the output: the slope of their inverse at its ends, the roundings of the inverse in terms of its result,
    and the roundings of the maps."""
    limits = compiled.tables.limits
    ends = np.array([float(limits.output.low[0]), float(limits.output.high[0])]) - compiled.static.output_offset
    found = MapErrors(ends, 1.0, 0.0, 0.0)
    for each in reversed(compiled.parts.maps):
        found = each.errors(found, u, kind)
    return found.slope, found.back, found.there


def _gains(compiled: Compiled, u: float, emitted: bool) -> Gained:
    """All gains combined, with own heat at the fastest rate; `emitted` as for `_moving`."""
    speed = Speed(compiled.static.input_range, compiled.largest_step, compiled.seconds)
    output = _sizes(compiled).output
    found = [one.gained(speed, output, u, emitted) for one in compiled.behind]
    ends = math.prod(each.least for each in found), math.prod(each.largest for each in found)
    there, back = sum(each.there for each in found), sum(each.back for each in found)
    return Gained(sum(each.roundings for each in found), *ends, there, back)


def _moving(compiled: Compiled, kind: str, emitted: bool) -> tuple[float, float, float]:
    """Errors of plays that an effect moves or bends: roundings of a play as a shift of its input, roundings of the sum,
    and the error of the sum that a search leaves when it stops.

    `emitted`: include the approximations of the C, which double precision does not make.
    """
    u = float(np.finfo(kind).eps) / 2
    t, static = compiled.tables.moving, compiled.static
    low, high = static.play_range
    size = 3.0 * max(abs(low), abs(high)) + float(static.pi.thresholds[-1])
    summed = moving.sum_rounding(static, compiled.parts.plays, u)
    summed += sum(each.error(kind, emitted) for each in moving.parallel(static, compiled.parts.plays))
    play = 4.0 * u * size
    if t.moves == RELAXING:
        slow = t.first[1:].astype(float)
        play = 8.0 * u * size / float(np.min(slow))
        if emitted:
            play += compiled.largest_way / 4.0  # contact within a step counts from the first touch
    if t.moves == DASHPOT:
        (mover,), way = moving.movers(static, compiled.parts.plays), compiled.largest_way
        rows, ways = t.yields.astype(float), (way, moving.largest_stretch(static))
        stretched = mover.stretch_error(compiled.seconds, rows, ways, np.zeros(len(rows)))
        play = 8.0 * u * size + stretched + mover.disorder(rows, ways[1])  # plays that a sum assumes to be stationary
        if emitted:
            play += float(t.number.standing_share[0]) * way  # a slower input counts as standing still
    most = moving.slopes(static, compiled.parts.plays, compiled.seconds)[1]
    missed = most * 3.0 * (high - low) * 2.0**-t.halves
    left = moving.residual(static, compiled.parts.plays, u)
    return play, summed, most * u * size + (left if missed + summed <= float(t.number.close[0]) else max(missed, left))


def _one(compiled: Compiled, kind: str, emitted: bool, same: bool) -> tuple[float, float]:
    """Errors of the forward operator's displacement, and of the play sum that the inverse asks for.

    They apply to one arithmetic and exclude the plays' own errors; `emitted` as for `_moving`; `same`: the states of
    both compensators have seen the same drives.
    """
    u = float(np.finfo(kind).eps) / 2
    sizes = _sizes(compiled)
    slope, back, there = _mapped(compiled, u, kind)
    gains, least, gain, misjudged, late = _gains(compiled, u, emitted)
    taps = float(np.sum(np.abs(compiled.taps.weights))) if compiled.taps else 1.0
    inverse = 4.0 * u * sizes.displacement * slope + back
    if compiled.taps:
        inverse = taps * (inverse + u * (len(compiled.taps.weights) + 1) * sizes.displacement * slope)
    inverse = inverse / least + 3.0 * u * gains * taps * sizes.output / least
    inverse += late / least
    ahead, behind, ones = ahead_of(compiled.ones), compiled.behind, compiled.ones
    moved = max((one.rounding(sizes.drive, u)[0] for part in SENT for one in ones[part.name]), default=0.0)
    moved += _slewed(compiled, kind)
    if not emitted:  # in double precision every slew-limited step is rounded
        moved += u * sizes.drive * crossing(compiled.static, compiled.parts, compiled.seconds)
    moved += sum(one.rounding(sizes.drive, u)[0] for one in ahead)
    static = compiled.static
    forward = static.front_slopes[1] * math.fsum(abs(p) for p in static.pi.weights) * moved
    if emitted and ahead and static.branches_differ:  # the front's input may come to rest on either branch
        forward += static.pi.slopes[-1] * static.branch_gap
    given = sizes.plays * np.cumprod([1.0, *(one.growth for one in behind)])
    for one, size in zip(behind, given.tolist(), strict=False):
        forward = forward * one.growth + one.rounding(size, u)[0]
    for one, size in zip(reversed(behind), given[-2::-1].tolist(), strict=True):
        inverse = one.solved(inverse, size, u, same)
    forward = gain * (forward + 3.0 * u * sizes.output * gains) + misjudged
    size, ringing = gain * sizes.output + sizes.displacement, 1.0
    for mode in compiled.last:
        forward = mode.growth * forward + mode.rounding(size, u)[0]
        size, ringing = mode.growth * size, ringing * mode.growth
    return forward + ringing * there + 3.0 * u * ringing * sizes.displacement, inverse


def _led(compiled: Compiled, error: float, u: float, same: bool) -> float:
    """The error of the drive that results from an error in front of the plays; `same` as for `_one`."""
    drive, turning = _sizes(compiled).drive, bool(compiled.tables.turning)
    for one in reversed(ahead_of(compiled.ones)):
        error = one.led(error, drive, u, same, turning)
    return error + _kept(compiled) * turning


def _seen(compiled: Compiled) -> float:
    """Factor by which the states of blocks that see the sum of the plays multiply an error of the plays."""
    return max(math.prod(one.seen() for one in compiled.behind), 1.0)


def _kept(compiled: Compiled) -> float:
    """How far the input of the plays can be from its target while the drive stands still. Also how far a drive that
    keeps a lag on its branch can be from the lag's state, at which the model in double precision keeps the drive."""
    return 2.0 * float(compiled.tables.number.dither[0])


def _slewed(compiled: Compiled, kind: str) -> float:
    """How far a slew-limited drive can be from the exact drive, in drive units: roundings of the drive, of the previous
    drive if it was committed, and of the rate, accumulated while the drive crosses its range."""
    steps = crossing(compiled.static, compiled.parts, compiled.seconds)
    u = float(np.finfo(kind).eps) / 2
    return _sizes(compiled).drive * (3.0 * u * (steps > 0.0) + steps * 2.0 * u * u)


CELLS = 4096
"""[parts of the drive's range] Grid for bounding the error of a drive that keeps its branch; each cell adds at most its
width, 2e-4 of the range, to the distance kept."""


def kept_branch(compiled: Compiled) -> float:
    """Largest distance of the displacement at rest from its reference, in output units, because a drive in front of two
    branches stays on its branch.

    The drive stays put up to a lag's share theta of the distance to the other branch, plus the step back that rounding
    may cause, `limits.hold[0]`, beyond a target that itself has half of that rounding error. Both branches rise between
    grid points, so their values there bound all values in between.
    """
    static, t = compiled.static, compiled.tables
    theta = ahead_of(compiled.ones)[0].second if t.turning else 0.0
    unit = 1.0
    if compiled.codes is not None:
        unit = float(compiled.codes.drive_lsb) / 2.0 ** float(t.number.drive_bits[0])
    more = 1.5 * float(t.plays.limits.hold[0]) * unit
    low, high = static.input_range
    drives = [low + (high - low) * i / CELLS for i in range(CELLS + 1)]
    worst = 0.0
    for up, (at, end) in itertools.product((True, False), itertools.pairwise(drives)):
        first, last = (at, end) if up else (end, at)  # towards the end of a move on this branch
        begin = float(static.front(first, up))
        other = min(max(float(static.front_inverse(begin, not up)), low), high)
        far = last + theta * (last - other) + math.copysign(more, last - first)
        worst = max(worst, abs(float(static.front(far, up)) - begin))
    steep = 1.0 + abs(moving.steepest_bend(static, compiled.parts.plays))
    rest = math.prod(one.growth for one in compiled.behind)
    return worst * static.pi.slopes[-1] * steep * rest * _gains(compiled, 0.0, True).largest


def swing(static: StaticModel, parts: Parts, seconds: float) -> float:
    """How far the drive may swing at a constant reference, in drive units, because a user's own blocks lead it back and
    forth between two branches; 0 if it comes to rest."""
    if not static.branches_differ or not parts.own_drives:
        return 0.0
    gain = lead(ahead_of(parts.ones(seconds)))
    low, high = static.input_range
    return min(gain * static.branch_gap / static.front_slopes[0], high - low)


def condition(compiled: Compiled) -> str:
    """The condition of `rounding` in words, if only the range bounds the difference between two drives; else "".

    A led lag misses its target by a second difference, so the plays and creep behind it see a signal other than the one
    solved for; their memories then differ for two drives, and the lead amplifies that. So does a user's own block
    in front while the drive is limited: its memory of an earlier difference then moves the plays differently
    although the drives are equal. Elements in parallel with the plays remember an earlier difference as well.
    Thresholds that grow with the rate amplify an earlier difference between drives. A braked lag behind a slew
    limit gives up more of its lead than the limit cuts off. In front of two branches, whether a lag stays or turns
    depends on the drives that it has seen.
    """
    still = STILL * (compiled.tables.quiet > 0)
    if compiled.tables.braked:
        return together(SAME, UNSLEWED, still)
    missed = any(one.misses for one in ahead_of(compiled.ones))
    remembered = compiled.static.pi.n > 0 or any(one.remembers for one in compiled.behind)
    dilated = compiled.tables.moving.moves == DILATED
    joined = any(effect.joins_plays() for effect in compiled.parts.plays)
    return together(SAME, still) if dilated or joined or compiled.tables.turning or (missed and remembered) else ""


def chain_bounds(compiled: Compiled, arithmetic: str) -> ErrorBounds:
    """Bounds for `arithmetic` 'float32' or 'float64', provided the caller sets only gains and temperatures."""
    static = dataclasses.replace(compiled.static, output_offset=0.0)
    plays = error_bounds(static, arithmetic, engines.ENGINES[compiled.tables.plays.engine])
    pi = static.pi
    same = bool(condition(compiled))
    gain = math.inf
    if pi.weights[0] > 0.0:
        whole_gain = 2.0 / pi.weights[0] - 1.0 / pi.slopes[-1]
        gain = (1.0 / pi.weights[0] if same else whole_gain) / static.front_slopes[0]
        at_once = gain * static.front_slopes[0] / whole_gain  # for plays with the same memory, as `rounding` states
        plays = dataclasses.replace(plays, rounding=plays.rounding * at_once)
    only_seen = 0.0  # error of the sum that the inverse undoes; only creep behind plays with a limited drive feels it
    if compiled.tables.moving.used:
        least = moving.least_slope(static, compiled.parts.plays) * (1.0 if same else 0.5)
        if compiled.tables.moving.moves == DILATED:
            least = min(least, moving.least_dilated(static, compiled.parts.plays, compiled.seconds))
        gain = 1.0 / least / static.front_slopes[0]
        pairs = zip(_moving(compiled, arithmetic, True), _moving(compiled, "float64", False), strict=True)
        shift, rounding, search = (sum(each) for each in pairs)
        shifts = np.full(pi.n, shift)
        there, back = moving.of_shifts(static, compiled.parts.plays, compiled.tables.moving.moves, shifts)
        counting = there if same else back
        only_seen = gain * (there - counting)
        own = gain * (counting + rounding + search)
        plays = ErrorBounds(plays.forward + there + rounding, plays.inverse + own, plays.rounding + own)
    u = float(np.finfo(arithmetic).eps) / 2 + float(np.finfo("float64").eps) / 2
    ways = _one(compiled, arithmetic, True, same), _one(compiled, "float64", False, same)
    forward, asked = (sum(each) for each in zip(*ways, strict=True))
    whole = static.input_range[1] - static.input_range[0]
    seen = 1.0 if same else _seen(compiled)
    kept = _slewed(compiled, arithmetic) + _slewed(compiled, "float64")
    if compiled.tables.quiet and not same:  # the plays have seen the drive that stood still
        kept += _kept(compiled)
    if kept > 0.0:
        apart = gain * pi.slopes[-1] * static.front_slopes[1] * kept
        plays = ErrorBounds(plays.forward, plays.inverse + kept + apart, plays.rounding + kept + apart)
    inverse, rounding = (
        min(SECOND_ORDER * _led(compiled, seen * own + (seen - 1.0) * only_seen + gain * asked, u, same), whole)
        for own in (plays.inverse, plays.rounding)
    )
    if same or (compiled.tables.slew and ahead_of(compiled.ones)):
        inverse = whole
    most = _gains(compiled, u, True).largest * math.prod(one.growth for one in (*compiled.behind, *compiled.last))
    return ErrorBounds(SECOND_ORDER * (forward + most * plays.forward), inverse, rounding)
