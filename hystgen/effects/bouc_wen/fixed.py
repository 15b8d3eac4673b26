"""Elements in parallel with the plays, in fixed point.

Places on the curve, in widths, and values of s = z/width have `UNIT` bits. On each piece the curve is `level + x m(h)`,
with x from the begin of the piece, h = x over the length of the piece with 31 bits, and the mean slope m with `SLOPE`
bits: changes of s are thus exact to 2^-28 of themselves, however short the move.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from hystgen.arithmetic.factors import LARGEST, factor, lifted, times
from hystgen.basics.jit import jit
from hystgen.effects.base import Array
from hystgen.effects.bouc_wen.compensator import drifted, functions
from hystgen.effects.bouc_wen.model import LARGEST_BALANCE, ParallelElements
from hystgen.effects.bouc_wen.pieces import CurvePieces, pieces
from hystgen.effects.plays import (
    Elements,
    ElementsState,
    FixedElement,
    FixedElementState,
    FixedElementTables,
    FixedPiece,
    Tilt,
)

UNIT = 44
"""Bits of places and values."""

SLOPE = 27
"""Bits of slopes, which are at most 8."""

BACK = 28
"""Bits of shares of a piece over shares of its rise."""

DEGREE = 5
"""Degree of the curve's polynomials."""

STEEP = (DEGREE - 1).bit_length()
"""Bits of a slope that its computation drops: its terms are up to `DEGREE` times as large as the curve's. Derived."""

STEEPEST = 2.0 * LARGEST_BALANCE
"""[1] Largest slope of the curve, right after a turn. Derived."""

ALLOWED = 2.0**-30
"""Error allowed for the curve: about that of a slope with `SLOPE` bits over a quarter of a width."""

WIDTHS = (LARGEST >> UNIT) - 1
"""[widths] Largest distance, 127: one more and its places could not be multiplied. Derived."""


@functools.cache
def _pieces(exponent: float, balance: float) -> CurvePieces:
    return pieces(exponent, balance, DEGREE, ALLOWED, 2.0 ** (31 - UNIT))


def of(
    effect: ParallelElements, ends: tuple[float, float], step: float, unit: float, straight: float
) -> FixedElementTables:
    """Tables for inputs between `ends` in steps of `step` and a sum in steps of `unit`, straight over a distance.
    Raises OverflowError."""
    found = _pieces(*effect.law)
    wide = np.diff(found.begin)
    scale = UNIT - 32 + np.frexp(wide)[1]  # lengths are powers of 2
    powers = np.arange(DEGREE)
    up = np.rint(np.ldexp(found.up * wide[:, None] ** powers, SLOPE)).astype(np.int64)
    rise = np.diff(found.level)
    back = np.rint(
        np.ldexp(found.back * rise[:, None] ** (powers + 1) / wide[:, None], BACK)
    ).astype(np.int64)
    if max(np.max(np.sum(np.abs(up), axis=1)), np.max(np.sum(np.abs(back), axis=1))) >= 2**31 - DEGREE:
        raise OverflowError("the curve is too steep")
    lift = [max(0, -math.frexp(each)[1]) for each in rise.tolist()]
    share = [factor(2.0 ** (31 - UNIT - more) / each) for each, more in zip(rise.tolist(), lift, strict=True)]

    def scaled(values: Array) -> tuple[list[tuple[int, int]], list[int]]:
        lifts = [lifted(each, 0) for each in values.tolist()]
        return [factor(each / 2.0**more) for each, more in zip(values.tolist(), lifts, strict=True)], lifts

    weights, widths, drive, lean, top = effect.tilted(*ends)
    if np.any(lean) and np.ptp(ends) > WIDTHS * np.min(widths):
        raise OverflowError(f"the range of the plays' input is more than {WIDTHS} widths of a tilted element")
    ratio = 2.0**UNIT * step / widths
    distance, distance_lift = scaled(ratio)
    amplitude, amplitude_lift = scaled(weights * drive * widths / unit / 2.0**UNIT)
    weight, weight_lift = scaled(weights * drive * step / unit / 2.0 ** (SLOPE - STEEP))
    begin, level = (np.rint(np.ldexp(each, UNIT)).astype(np.int64).tolist() for each in (found.begin, found.level))
    far = np.minimum(np.floor(WIDTHS * 2.0**UNIT / ratio), 2**40).astype(np.int64).tolist()
    level_on = [[0] * DEGREE]  # behind the last piece
    pieces_of = zip(
        begin, level, [*share, (0, 21)], [*up.tolist(), *level_on], [*back.tolist(), *level_on],
        [*scale.tolist(), 0], [*lift, 0], strict=True,
    )
    elements = zip(distance, amplitude, weight, far, distance_lift, amplitude_lift, weight_lift, strict=True)
    steepest = STEEPEST * float(np.abs(weights) @ drive) * step / unit
    most = math.floor(min(straight / step, 2.0**62 / max(steepest, 1.0)))  # a distance times the slope has 62 bits
    leans, tops = (np.rint(each).astype(np.int64) for each in (np.ldexp(lean / drive, SLOPE), top / step))
    tilt = zip(leans.tolist(), tops.tolist(), (leans << UNIT - SLOPE).tolist(), strict=True) if np.any(lean) else ()
    base = np.rint([weights * widths @ lean / unit]).astype(np.int64)
    return FixedElementTables(FixedPiece.of(pieces_of), FixedElement.of(elements), Tilt.of(tilt), base, most)


def error(effect: ParallelElements, low: float, high: float) -> float:
    """Bound on the error of the sum of the elements, output units, for inputs within a range."""
    found = _pieces(*effect.law)
    weights, widths, drive, lean, _ = effect.tilted(low, high)
    rounded = 2.0**-SLOPE * DEGREE
    slip = found.slip + 2.0 * rounded + 2.0**-SLOPE * (1.0 + (high - low) / widths) * (lean != 0.0)
    each = [drifted(effect.law[0], found.error + rounded, x) for x in slip.tolist()]
    return float(np.abs(weights) * widths * drive @ np.array(each))


# ---------------------------------------------------------------- elements.c


@jit
def share_of(pieces: FixedPiece | FixedElementState, i: int, x: int) -> int:
    """A distance x >= 0 from the begin of a piece, over its length, with 31 bits."""
    return min(x >> pieces.scale[i], 2**31 - 1)


@jit
def part(y: int, h: int) -> int:
    """y times h = 0 .. 1 with 31 bits."""
    return (y * h + 2**30) >> 31


@jit
def distance(t: FixedElementTables, j: int, way: int) -> int:
    """A move of the input in widths of element j."""
    far = t.element.far[j]
    inside = min(max(way, -far), far)
    by = t.element.distance
    return times(inside << t.element.distance_lift[j], by.mantissa[j], by.shift[j])


@jit
def sloped(t: FixedElementTables, j: int, slope: int) -> int:
    """The slope of the sum that results from a slope of the curve of element j."""
    by = t.element.weight
    return times(slope, by.mantissa[j], by.shift[j]) << t.element.weight_lift[j]


@jit
def depart(t: FixedElementTables, m: ElementsState[FixedElementState], w: int, total: int) -> None:
    """Let the elements depart from the input w, where this is their sum, in a new direction."""
    m.found[0] = w
    m.asked[0] = total
    m.slope[0] = 0
    m.departs[0] = 1
    for j in range(len(t.element)):
        m.slope[0] = m.slope[0] + sloped(t, j, m.element.c[j, 0] >> STEEP)


@jit
def back(
    t: FixedElementTables, m: ElementsState[FixedElementState], i: int, j: int, s: int
) -> tuple[int, int]:
    """The distance from the begin of piece i at which the curve is s, and its share of the piece's length, by whose
    scale element j goes on."""
    g = times((s - t.piece.level[i]) << t.piece.lift[i], t.piece.share.mantissa[i], t.piece.share.shift[i])
    g = min(g, 2**31 - 1)
    slope = t.piece.back[i, DEGREE - 1]
    for k in range(DEGREE - 2, -1, -1):
        slope = t.piece.back[i, k] + part(slope, g)
    h = min(max((slope * g + 2 ** (BACK - 1)) >> BACK, 0), 2**31 - 1)
    m.element.scale[j] = t.piece.scale[i]
    return h << t.piece.scale[i], h


@jit(inline=True)
def by_slope(x: int, slope: int) -> int:
    """x times a slope."""
    return times(x, slope, SLOPE)


@jit(inline=True)
def steep(slope: int) -> int:
    """A slope without its `STEEP` lowest bits."""
    return slope >> STEEP


@jit
def amount(t: FixedElementTables, j: int, s: int) -> int:
    """What element j contributes to the sum."""
    size = t.element.amplitude
    return times(s, size.mantissa[j], size.shift[j]) << t.element.amplitude_lift[j]


summed, turned, unloaded = functions(part, by_slope, steep, share_of, back, distance, amount, sloped)


@jit
def unload(t: FixedElementTables, m: ElementsState[FixedElementState], w: int) -> None:
    """Bring every element to rest at z = 0, with its input at w."""
    unloaded(t, m, w)
    depart(t, m, w, 0)


@jit
def turn(t: FixedElementTables, m: ElementsState[FixedElementState], w: int) -> None:
    """Turn every element at the input w: its s changes sign."""
    turned(t, m, w)
    depart(t, m, w, m.asked[0] + m.slope[0] * (w - m.found[0]))


@jit
def joined(t: FixedElementTables, m: ElementsState[FixedElementState], w: int) -> tuple[int, int]:
    """The sum of the elements with their input at w: along the slope at the input for which it was last computed, or
    computed there if that is not near or they have turned since."""
    on = w - m.found[0]
    if on != 0 and (m.departs[0] or on > t.straight or on < -t.straight):
        m.found[0] = w
        m.asked[0], m.slope[0] = summed(t, m, w)
        m.departs[0] = 0
        on = 0
    return m.asked[0] + m.slope[0] * on, 0


ARITHMETIC = Elements(joined, turn, unload)
