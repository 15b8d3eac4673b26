"""Elements in parallel with the plays, for a compensator."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hystgen.basics.jit import Scalar, jit
from hystgen.effects.bouc_wen.curve import halves
from hystgen.effects.bouc_wen.model import Elements as Effect
from hystgen.effects.bouc_wen.model import turned_at, value
from hystgen.effects.bouc_wen.pieces import CurvePieces, extremes, pieces
from hystgen.effects.part import late
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

    def __init__(self, effect: Effect) -> None:
        exponent, balance = effect.law
        self.above, self.below = halves(exponent, balance)
        self.elements = list(zip(effect.weights, effect.widths, effect.leans, strict=True))
        self.rest(0.0)

    def rest(self, w: float) -> None:
        """Unload every element, z = 0, with the input at w."""
        self.way, self.turned, self.input = 1.0, w, w
        self.begin = [width * tilt for _, width, tilt in self.elements]

    def _values(self) -> list[float]:
        found = zip(self.begin, self.elements, strict=True)
        ends = self.turned, self.input
        return [
            float(value(self.above, self.below, begin, self.way, ends, (width, tilt)))
            for begin, (_, width, tilt) in found
        ]

    def total(self, w: float) -> float:
        """`sum k z` after the input has moved to w; moves nothing."""
        kept = self.way, self.turned, self.input, self.begin
        self.move(w)
        found = sum(
            weight * width * (self.way * s - width * tilt)
            for s, (weight, width, tilt) in zip(self._values(), self.elements, strict=True)
        )
        self.way, self.turned, self.input, self.begin = kept
        return found

    def move(self, w: float) -> None:
        """Move the input to w."""
        if self.way * (w - self.input) < 0.0:
            found = zip(self._values(), self.elements, strict=True)
            self.begin = [float(turned_at(self.above, self.below, s, tilt)) for s, (*_, tilt) in found]
            self.way, self.turned = -self.way, self.input
        self.input = w


def of(effect: Effect, low: float, high: float) -> ParallelTerms:
    """What a compensator needs to know of an effect's elements, for inputs within a range."""
    exponent, balance = effect.law
    weights, widths, drive, lean, top = effect.tilted(low, high)
    shapes = zip(effect.widths, effect.leans, strict=True)
    ends, most, steepest = (
        np.array(each) for each in zip(*(extremes(shape, effect.law, low, high) for shape in shapes), strict=True)
    )
    bend = exponent * max(1.0, 2.0 * balance - 1.0) * (steepest + np.abs(lean)) / widths  # as |s| <= 1
    base = np.array([weights * widths @ lean])
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
        tilt = Tilt.of([*zip(lean / drive, top, strict=True)][:tilted], dtype)
        return ElementTables(CurvePiece.of(rows, dtype), ElementNumbers.of(numbers, dtype), tilt, base.astype(dtype))

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
def gained(t: ElementTables, m: ElementsState[ElementState], j: int, x: Scalar) -> tuple[Scalar, Scalar]:
    """Change of s of element j over the distance x since its last turn, and its slope there. Backwards, where a search
    may try inputs, the curve goes on straight."""
    n = m.element.c.shape[1]
    if x < x - x:
        return m.element.c[j, 0] * x, m.element.c[j, 0]
    if x < m.element.until[j]:
        value: Scalar = m.element.c[j, n - 1]
        slope: Scalar = value
        for k in range(n - 2, -1, -1):
            value = value * x + m.element.c[j, k]
            slope = slope * x + value
        return value * x, slope
    i = piece_at(t.piece.begin, m.element.place[j] + x)
    h = m.element.place[j] + x - t.piece.begin[i]
    value = t.piece.up[i, n - 1]
    slope = value
    for k in range(n - 2, -1, -1):
        value = value * h + t.piece.up[i, k]
        slope = slope * h + value
    value = t.piece.level[i] + value * h - m.element.level[j]
    if len(t.tilt) > 0:
        slope = slope + m.element.lean[j]
        value = value + m.element.lean[j] * x
    return value, slope


@jit
def put(t: ElementTables, m: ElementsState[ElementState], j: int, s: Scalar) -> None:
    """Put element j at the value s of the curve."""
    n = m.element.c.shape[1]
    i = piece_at(t.piece.level, s)
    u = s - t.piece.level[i]
    h: Scalar = t.piece.back[i, n - 1]
    for k in range(n - 2, -1, -1):
        h = h * u + t.piece.back[i, k]
    h = h * u
    for k in range(n):
        m.element.c[j, k] = t.piece.up[i, k]
    for k in range(n - 1, 0, -1):  # the piece's polynomial about h: its value there, then its coefficients
        m.element.c[j, k - 1] = m.element.c[j, k - 1] + h * m.element.c[j, k]
    m.element.level[j] = t.piece.level[i] + h * m.element.c[j, 0]
    for first in range(1, n):
        for k in range(n - 1, first - 1, -1):
            m.element.c[j, k - 1] = m.element.c[j, k - 1] + h * m.element.c[j, k]
    m.element.place[j] = t.piece.begin[i] + h
    last = len(t.piece) - 1
    m.element.until[j] = t.piece.begin[i + 1] - m.element.place[j] if i < last else h - h
    if len(t.tilt) > 0:
        m.element.c[j, 0] = m.element.c[j, 0] + m.element.lean[j]


@jit
def depart(t: ElementTables, m: ElementsState[ElementState], j: int, w: Scalar) -> None:
    """Put element j on the curve for a move from the input w: at its z/width, or with a tilted drive as far from the
    limit there, over the largest limit."""
    s: Scalar = m.element.s[j]
    if len(t.tilt) > 0:
        s = s - (w - t.tilt.top[j]) * t.element.inverse_width[j] * t.tilt.lean[j]
    put(t, m, j, s)


@jit
def unload(t: ElementTables, m: ElementsState[ElementState], w: Scalar) -> None:
    """Bring every element to rest at z = 0, with its input at w."""
    m.turned[0] = w
    m.upward[0] = 1
    for j in range(len(t.element)):
        m.element.s[j] = m.element.low[j] = w - w
        if len(t.tilt) > 0:
            m.element.s[j] = m.element.lean[j] = t.tilt.lean[j]
        depart(t, m, j, w)


@jit
def turn(t: ElementTables, m: ElementsState[ElementState], w: Scalar) -> None:
    """Turn every element at the input w. Its s changes sign: exactly, with a rounding remainder."""
    way = w - m.turned[0] if m.upward[0] else m.turned[0] - w
    for j in range(len(t.element)):
        more, _ = gained(t, m, j, way * t.element.inverse_width[j])
        high = m.element.s[j] + more
        part = high - m.element.s[j]
        low = m.element.low[j] + ((m.element.s[j] - (high - part)) + (more - part))
        whole = high + low
        m.element.low[j] = whole - high - low
        m.element.s[j] = -whole
        last = t.piece.level[len(t.piece) - 1]
        if whole > last or whole < -last:
            m.element.s[j] = -last if whole > last else last
            m.element.low[j] = whole - whole
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
        more, steep = gained(t, m, j, way * t.element.inverse_width[j])
        total = total + t.element.amplitude[j] * (m.element.s[j] + more + m.element.low[j])
        slope = slope + t.element.weight[j] * steep
    if len(t.tilt) > 0:
        total = total - (t.base[0] if m.upward[0] else -t.base[0])
    return (total if m.upward[0] else -total), slope


ELEMENTS = ElementsPart(of, Elements(joined, turn, unload), late("bouc_wen"))
"""Elements in parallel with the plays as a part of the chain."""
