"""Elements in parallel with the plays, in fixed point.

Places on the curve, in widths, and values of s = z/width have `UNIT` bits. On each piece the curve is `level + x m(h)`,
with x from the begin of the piece, h = x over the length of the piece with 31 bits, and the mean slope m with `SLOPE`
bits: changes of s are thus exact to 2^-28 of themselves, however short the move.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from hystgen.arithmetic.factors import factor, lifted, times
from hystgen.basics.jit import jit
from hystgen.effects.base import Array
from hystgen.effects.bouc_wen.compensator import drifted, piece_at
from hystgen.effects.bouc_wen.model import Elements as Effect
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

SUMMED = 38
"""Bits of the slope of the sum, by which a distance is multiplied."""

FARTHEST = 2 ** (62 - SUMMED)
"""[steps] Largest distance over which the sum is computed along its slope, so that the product has 62 bits. Derived."""

ALLOWED = 2.0**-30
"""Error allowed for the curve: about that of a slope with `SLOPE` bits over a quarter of a width."""

WIDTHS = 127
"""[widths] Largest distance, by the bits of a number to be multiplied; behind 32, the curve is level within `ALLOWED`,
from any place. Derived."""


@functools.cache
def _pieces(exponent: float, balance: float) -> CurvePieces:
    return pieces(exponent, balance, DEGREE, ALLOWED, 2.0 ** (31 - UNIT))


def of(effect: Effect, ends: tuple[float, float], step: float, unit: float, straight: float) -> FixedElementTables:
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
    most = math.floor(min(straight / step, FARTHEST))
    leans = np.rint(np.ldexp(lean / drive, SLOPE)).astype(np.int64).tolist()
    tilt = [*zip(leans, np.rint(top / step).astype(np.int64).tolist(), strict=True)] if np.any(lean) else []
    base = np.rint([weights * widths @ lean / unit]).astype(np.int64)
    return FixedElementTables(FixedPiece.of(pieces_of), FixedElement.of(elements), Tilt.of(tilt), base, most)


def error(effect: Effect, low: float, high: float) -> float:
    """Bound on the error of the sum of the elements, output units, for inputs within a range."""
    found = _pieces(*effect.law)
    weights, widths, drive, lean, _ = effect.tilted(low, high)
    rounded = 2.0**-SLOPE * DEGREE
    slip = found.slip + 2.0 * rounded + 2.0**-SLOPE * (1.0 + (high - low) / widths) * (lean != 0.0)
    each = [drifted(effect.law[0], found.error + rounded, x) for x in slip.tolist()]
    return float(np.abs(weights) * widths * drive @ np.array(each))


# ---------------------------------------------------------------- elements.c


@jit
def share_of(x: int, scale: int) -> int:
    """A distance x >= 0 from the begin of a piece, over its length, with 31 bits."""
    return min(x >> scale, 2**31 - 1)


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
def gained(t: FixedElementTables, m: ElementsState[FixedElementState], j: int, x: int) -> tuple[int, int]:
    """Change of s of element j over the distance x since its last turn, and the curve's slope there without its `STEEP`
    lowest bits; backwards the curve goes on straight."""
    n = m.element.c.shape[1]
    if x < 0:
        return times(x, m.element.c[j, 0], SLOPE), m.element.c[j, 0] >> STEEP
    if x < m.element.until[j]:
        h = share_of(x, m.element.scale[j])
        slope = m.element.c[j, n - 1]
        steep = slope >> STEEP
        for k in range(n - 2, -1, -1):
            slope = m.element.c[j, k] + part(slope, h)
            steep = part(steep, h) + (slope >> STEEP)
        return times(x, slope, SLOPE), steep
    i = piece_at(t.piece.begin, m.element.place[j] + x)
    on = m.element.place[j] + x - t.piece.begin[i]
    h = share_of(on, t.piece.scale[i])
    slope = t.piece.up[i, n - 1]
    steep = slope >> STEEP
    for k in range(n - 2, -1, -1):
        slope = t.piece.up[i, k] + part(slope, h)
        steep = part(steep, h) + (slope >> STEEP)
    more = t.piece.level[i] + times(on, slope, SLOPE) - m.element.level[j]
    if len(t.tilt) > 0:
        steep = steep + (m.element.lean[j] >> STEEP)
        more = more + times(x, m.element.lean[j], SLOPE)
    return more, steep


@jit
def put(t: FixedElementTables, m: ElementsState[FixedElementState], j: int, s: int) -> None:
    """Put element j at the value s of the curve."""
    n = m.element.c.shape[1]
    last = len(t.piece) - 1
    i = piece_at(t.piece.level, s)
    g = times((s - t.piece.level[i]) << t.piece.lift[i], t.piece.share.mantissa[i], t.piece.share.shift[i])
    g = min(g, 2**31 - 1)
    slope = t.piece.back[i, n - 1]
    for k in range(n - 2, -1, -1):
        slope = t.piece.back[i, k] + part(slope, g)
    h = min(max((slope * g + 2 ** (BACK - 1)) >> BACK, 0), 2**31 - 1)
    x = h << t.piece.scale[i]
    for k in range(n):
        m.element.c[j, k] = t.piece.up[i, k]
    for k in range(n - 1, 0, -1):  # the slope at h, then the other coefficients
        m.element.c[j, k - 1] = m.element.c[j, k - 1] + part(m.element.c[j, k], h)
    m.element.level[j] = t.piece.level[i] + times(x, m.element.c[j, 0], SLOPE)
    for first in range(1, n):
        for k in range(n - 1, first - 1, -1):
            m.element.c[j, k - 1] = m.element.c[j, k - 1] + part(m.element.c[j, k], h)
    m.element.place[j] = t.piece.begin[i] + x
    m.element.scale[j] = t.piece.scale[i]
    m.element.until[j] = t.piece.begin[i + 1] - m.element.place[j] if i < last else 0
    if len(t.tilt) > 0:
        m.element.c[j, 0] = m.element.c[j, 0] + m.element.lean[j]


@jit
def go_on(t: FixedElementTables, m: ElementsState[FixedElementState], j: int, w: int) -> None:
    """Put element j on the curve for a move from the input w: at its z/width, or with a tilted drive as far from the
    limit there, over the largest limit."""
    s = m.element.s[j]
    if len(t.tilt) > 0:
        s = s - times(distance(t, j, w - t.tilt.top[j]), t.tilt.lean[j], SLOPE)
    put(t, m, j, s)


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
def unload(t: FixedElementTables, m: ElementsState[FixedElementState], w: int) -> None:
    """Bring every element to rest at z = 0, with its input at w."""
    m.turned[0] = w
    m.upward[0] = 1
    for j in range(len(t.element)):
        m.element.s[j] = 0
        if len(t.tilt) > 0:
            m.element.lean[j] = t.tilt.lean[j]
            m.element.s[j] = times(1 << UNIT, m.element.lean[j], SLOPE)
        go_on(t, m, j, w)
    depart(t, m, w, 0)


@jit
def turn(t: FixedElementTables, m: ElementsState[FixedElementState], w: int) -> None:
    """Turn every element at the input w: its s changes sign."""
    way = w - m.turned[0] if m.upward[0] else m.turned[0] - w
    last = t.piece.level[len(t.piece) - 1]
    for j in range(len(t.element)):
        s = m.element.s[j] + gained(t, m, j, distance(t, j, way))[0]
        m.element.s[j] = -min(max(s, -last), last)
        m.element.lean[j] = -m.element.lean[j]
        go_on(t, m, j, w)
    m.turned[0] = w
    m.upward[0] = 1 - m.upward[0]
    depart(t, m, w, m.asked[0] + m.slope[0] * (w - m.found[0]))


@jit
def approach(t: FixedElementTables, m: ElementsState[FixedElementState], w: int) -> None:
    """Compute the sum of the elements with their input at w, and its slope."""
    way = w - m.turned[0] if m.upward[0] else m.turned[0] - w
    total = 0
    slope = 0
    for j in range(len(t.element)):
        more, steep = gained(t, m, j, distance(t, j, way))
        size = t.element.amplitude
        s = m.element.s[j] + more
        total = total + (times(s, size.mantissa[j], size.shift[j]) << t.element.amplitude_lift[j])
        slope = slope + sloped(t, j, steep)
    if len(t.tilt) > 0:
        total = total - (t.base[0] if m.upward[0] else -t.base[0])
    m.found[0] = w
    m.asked[0] = total if m.upward[0] else -total
    m.slope[0] = slope
    m.departs[0] = 0


@jit
def joined(t: FixedElementTables, m: ElementsState[FixedElementState], w: int) -> tuple[int, int]:
    """The sum of the elements with their input at w: along the slope at the input for which it was last computed, or
    computed there if that is not near or they have turned since."""
    on = w - m.found[0]
    if on != 0 and (m.departs[0] or on > t.straight or on < -t.straight):
        approach(t, m, w)
        on = 0
    return m.asked[0] + m.slope[0] * on, 0


ARITHMETIC = Elements(joined, turn, unload)
