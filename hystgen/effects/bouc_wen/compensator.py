"""Elements in parallel with the plays, for a compensator."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hystgen.basics.jit import Scalar, jit
from hystgen.effects.bouc_wen.curve import halves
from hystgen.effects.bouc_wen.model import ParallelElements, at_rest, moved
from hystgen.effects.bouc_wen.pieces import CurvePieces, extremes, pieces
from hystgen.effects.part import Function, late
from hystgen.effects.plays import (
    CurvePiece,
    ElementNumbers,
    Elements,
    ElementsPart,
    ElementsState,
    ElementState,
    ElementTables,
    FixedElementTables,
    ParallelTerms,
    Tilt,
)
from hystgen.plays.slots import Reals

DEGREE = 7
"""Degree of the curve's polynomials in floating point, by the pieces that `pieces` needs for three laws: 17 to 32 in
float32 and 113 to 174 in float64; 27 to 47 and 272 to 394 with 5, and 12 to 25 and 80 to 121 with 9, whose state is
larger by two numbers an element."""

FINEST = 0.5
"""[unit roundoffs] Error allowed for the curve in floating point: that of rounding its value."""

EXACT = 1e-14
"""[1] Smallest error allowed: above that of the curve itself, 6e-15. Set by:
`test_bouc_wen::test_the_curve_is_its_equation`."""


class LoadedElements:
    """Elements in double precision, one input at a time."""

    def __init__(self, effect: ParallelElements) -> None:
        self.halves = halves(*effect.law)
        self.elements = list(zip(effect.weights, effect.widths, effect.leans, strict=True))
        self.rest(0.0)

    def rest(self, w: float) -> None:
        """Unload every element, z = 0, with the input at w."""
        self.memory = [at_rest(w, width, tilt) for _, width, tilt in self.elements]

    def total(self, w: float) -> float:
        """`sum k z` after the input has moved to w; moves nothing."""
        both = zip(self.memory, self.elements, strict=True)
        return sum(k * width * float(moved(m.copy(), w, width, tilt, *self.halves)) for m, (k, width, tilt) in both)

    def move(self, w: float) -> None:
        """Move the input to w."""
        for m, (_, width, tilt) in zip(self.memory, self.elements, strict=True):
            moved(m, w, width, tilt, *self.halves)


def of(effect: ParallelElements, low: float, high: float) -> ParallelTerms:
    """What a compensator needs to know of an effect's elements, for inputs within a range."""
    exponent, balance = effect.law
    weights, widths, drive, lean, top = effect.tilted(low, high)
    shapes = zip(effect.widths, effect.leans, strict=True)
    ends, steepest = map(np.array, zip(*(extremes(each, effect.law, low, high) for each in shapes), strict=True))
    most = np.where(lean == 0.0, ends[:, 0], widths * (drive + np.abs(lean)))
    bend = exponent * max(1.0, 2.0 * balance - 1.0) * (steepest + np.abs(lean)) / widths  # as |s| <= 1
    tilted = len(lean) * bool(np.any(lean))

    def polynomials(dtype: Any) -> CurvePieces:
        return pieces(exponent, balance, DEGREE, max(FINEST * float(np.finfo(dtype).eps) / 2, EXACT))

    def error(dtype: Any, emitted: bool) -> float:
        found, unit = polynomials(dtype), float(np.finfo(dtype).eps) / 2
        off = (found.error, found.slip) if emitted else (EXACT, EXACT)
        size = float(np.abs(weights) @ (widths * drive))
        return size * drifted(exponent, off[0] + 8.0 * unit, off[1] + (24.0 if tilted else 16.0) * unit)

    def tables(dtype: Any) -> ElementTables:
        found = polynomials(dtype)
        level_on = np.zeros(DEGREE)  # behind the last piece
        rows = zip(found.begin, found.level, [*found.up, level_on], [*found.back, level_on], strict=True)
        numbers = zip(weights * drive, weights * drive * widths, 1.0 / widths, strict=True)
        tilt = Tilt.of([*zip(lean / drive, top, lean / drive, strict=True)][:tilted], dtype)
        base = np.array([weights * widths @ lean], dtype)
        return ElementTables(CurvePiece.of(rows, dtype), ElementNumbers.of(numbers, dtype), tilt, base)

    coded = late("bouc_wen", "of"), late("bouc_wen", "error")

    def straight(step: float, unit: float, off: float) -> FixedElementTables:
        most = float(np.abs(weights) @ bend)
        near = math.sqrt(2.0 * off / most) if most else math.inf
        found: FixedElementTables = coded[0]()(effect, (low, high), step, unit, near)
        return found

    return ParallelTerms(
        weights, most, ends, -np.abs(lean), steepest, bend, LoadedElements(effect), tables, error,
        straight, lambda: coded[1]()(effect, low, high),
    )


def drifted(exponent: float, error: float, slip: float) -> float:
    """Bound on the error of s after any number of turns, for errors of C and of its slope.

    Along a move, the difference e of two elements does not grow, as C is concave, except by `slip` per distance moved:
    2 slip over any single move, since beyond that C has levelled off. Over moves up and down the same distance it
    shrinks by at least `4 b (e/2)^n` per distance, and grows by up to `2 slip max(1, b)`, so that it stays below
    `2 slip^(1/n)`, as b >= 1/2. Not proved for moves up and down different distances.
    """
    return 2.0 * error + 2.0 * slip + 2.0 * math.pow(slip, 1.0 / exponent)


# ---------------------------------------------------------------- elements.c


def functions(
    part: Function, by_slope: Function, steep: Function, share: Function, back: Function, distance: Function,
    amount: Function, weighed: Function,
) -> Elements:
    """The functions of elements, from those of one arithmetic: `part`, `by_slope`: y times h, and a distance times a
    slope; `steep`: a slope as it is summed; `share`: a distance on a piece or element as its polynomial takes it;
    `back`: the distance at which piece i has a value, and its share, for element j; `distance`: a move of the input in
    widths of element j; `amount`, `weighed`: its contributions to the sum and to the sum's slope."""

    @jit
    def piece_at(begins: Reals, x: Scalar) -> int:
        """The piece in which a place or a value of the curve lies, given where pieces begin."""
        low = 0
        high = len(begins)
        while high - low > 1:
            middle = (low + high) // 2
            if x < begins[middle]:
                high = middle
            else:
                low = middle
        return low

    @jit
    def slopes(c: Reals, j: int, h: Scalar) -> tuple[Scalar, Scalar]:
        """Mean slope from the begin of a piece or element on, and the slope there, for coefficients c[j]."""
        mean: Scalar = c[j, c.shape[1] - 1]
        slope = steep(mean)
        for k in range(c.shape[1] - 2, -1, -1):
            mean = c[j, k] + part(mean, h)
            slope = part(slope, h) + steep(mean)
        return mean, slope

    @jit
    def gained(t: ElementTables, m: ElementsState[ElementState], j: int, x: Scalar) -> tuple[Scalar, Scalar]:
        """Change of s of element j over the distance x since its last turn, and its slope there. Backwards, where a
        search may try inputs, the curve goes on straight."""
        e = m.element
        if x < x - x:
            return by_slope(x, e.c[j, 0]), steep(e.c[j, 0])
        if x < e.until[j]:
            mean, slope = slopes(e.c, j, share(e, j, x))
            return by_slope(x, mean), slope
        i = piece_at(t.piece.begin, e.place[j] + x)
        on = e.place[j] + x - t.piece.begin[i]
        mean, slope = slopes(t.piece.up, i, share(t.piece, i, on))
        more = t.piece.level[i] + by_slope(on, mean) - e.level[j]
        if len(t.tilt) > 0:
            slope = slope + steep(e.lean[j])
            more = more + by_slope(x, e.lean[j])
        return more, slope

    @jit
    def depart(t: ElementTables, m: ElementsState[ElementState], j: int, w: Scalar) -> None:
        """Put element j on the curve for a move from the input w: at its z/width, or with a tilted drive as far from
        the limit there, over the largest limit."""
        e = m.element
        c = e.c
        n = c.shape[1]
        s = e.s[j]
        if len(t.tilt) > 0:
            s = s - by_slope(distance(t, j, w - t.tilt.top[j]), t.tilt.lean[j])
        i = piece_at(t.piece.level, s)
        x, h = back(t, m, i, j, s)
        for k in range(n):
            c[j, k] = t.piece.up[i, k]
        for k in range(n - 1, 0, -1):  # the piece's polynomial about h: its mean slope up to there, then all others
            c[j, k - 1] = c[j, k - 1] + part(c[j, k], h)
        e.level[j] = t.piece.level[i] + by_slope(x, c[j, 0])
        for first in range(1, n):
            for k in range(n - 1, first - 1, -1):
                c[j, k - 1] = c[j, k - 1] + part(c[j, k], h)
        e.place[j] = t.piece.begin[i] + x
        e.until[j] = t.piece.begin[i + 1] - e.place[j] if i < len(t.piece) - 1 else x - x
        if len(t.tilt) > 0:
            c[j, 0] = c[j, 0] + e.lean[j]

    @jit
    def unload(t: ElementTables, m: ElementsState[ElementState], w: Scalar) -> None:
        """Bring every element to rest at z = 0, with its input at w."""
        m.turned[0] = w
        m.upward[0] = 1
        for j in range(len(t.element)):
            m.element.s[j] = m.element.low[j] = t.base[0] - t.base[0]
            if len(t.tilt) > 0:
                m.element.lean[j] = t.tilt.lean[j]
                m.element.s[j] = t.tilt.rest[j]
            depart(t, m, j, w)

    @jit
    def turn(t: ElementTables, m: ElementsState[ElementState], w: Scalar) -> None:
        """Turn every element at the input w. Its s changes sign: exactly, with a rounding remainder, 0 in
        fixed point."""
        way = w - m.turned[0] if m.upward[0] else m.turned[0] - w
        last = t.piece.level[len(t.piece) - 1]
        for j in range(len(t.element)):
            more, _ = gained(t, m, j, distance(t, j, way))
            s, low = m.element.s, m.element.low
            high = s[j] + more
            rise = high - s[j]
            rounded = low[j] + ((s[j] - (high - rise)) + (more - rise))
            whole = high + rounded
            low[j] = whole - whole if whole > last or whole < -last else whole - high - rounded
            s[j] = -min(max(whole, -last), last)
            m.element.lean[j] = -m.element.lean[j]
            depart(t, m, j, w)
        m.turned[0] = w
        m.upward[0] = 1 - m.upward[0]

    @jit
    def joined(t: ElementTables, m: ElementsState[ElementState], w: Scalar) -> tuple[Scalar, Scalar]:
        """The sum of the elements with their input at w, and its slope."""
        way = w - m.turned[0] if m.upward[0] else m.turned[0] - w
        total: Scalar = way - way
        slope: Scalar = total
        for j in range(len(t.element)):
            more, steeper = gained(t, m, j, distance(t, j, way))
            total = total + amount(t, j, m.element.s[j] + more + m.element.low[j])
            slope = slope + weighed(t, j, steeper)
        if len(t.tilt) > 0:
            total = total - (t.base[0] if m.upward[0] else -t.base[0])
        return (total if m.upward[0] else -total), slope

    return Elements(joined, turn, unload)


@jit(inline=True)
def product(y: Scalar, h: Scalar) -> Scalar:
    """y times h."""
    return y * h


@jit(inline=True)
def same(slope: Scalar) -> Scalar:
    """A slope as it is summed: as it is."""
    return slope


@jit(inline=True)
def share(_: object, __: int, x: Scalar) -> Scalar:
    """A distance as the polynomials take it: as it is."""
    return x


@jit
def back(t: ElementTables, _: object, i: int, __: int, s: Scalar) -> tuple[Scalar, Scalar]:
    """The distance from the begin of piece i at which the curve is s, twice."""
    u = s - t.piece.level[i]
    h: Scalar = t.piece.back[i, DEGREE - 1]
    for k in range(DEGREE - 2, -1, -1):
        h = h * u + t.piece.back[i, k]
    return h * u, h * u


@jit(inline=True)
def distance(t: ElementTables, j: int, way: Scalar) -> Scalar:
    """A move of the input in widths of element j."""
    return way * t.element.inverse_width[j]


@jit(inline=True)
def amount(t: ElementTables, j: int, s: Scalar) -> Scalar:
    """What element j contributes to the sum."""
    return t.element.amplitude[j] * s


@jit(inline=True)
def weighed(t: ElementTables, j: int, slope: Scalar) -> Scalar:
    """What element j contributes to the slope of the sum."""
    return t.element.weight[j] * slope


ELEMENTS = ElementsPart(
    of, functions(product, product, same, share, back, distance, amount, weighed), late("bouc_wen")
)
"""Elements in parallel with the plays as a part of the chain."""
