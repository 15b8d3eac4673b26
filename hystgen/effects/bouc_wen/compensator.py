"""Elements in parallel with the plays, for a compensator."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hystgen.basics.jit import Scalar, jit
from hystgen.effects.bouc_wen.curve import halves
from hystgen.effects.bouc_wen.model import BoucWenElements, DahlElements, place_of, reach, turned_at, value
from hystgen.effects.bouc_wen.pieces import CurvePieces, largest, pieces
from hystgen.effects.part import late
from hystgen.effects.plays import (
    ElementNumbers,
    Elements,
    ElementsPart,
    ElementsState,
    ElementState,
    ElementTables,
    FixedElementTables,
    ParallelTerms,
)

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

    def __init__(self, effect: BoucWenElements | DahlElements) -> None:
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


def of(effect: BoucWenElements | DahlElements, span: float) -> ParallelTerms:
    """What a compensator needs to know of an effect's elements, for inputs within `span`."""
    exponent, balance = effect.law
    weights, widths = np.array(effect.weights), np.array(effect.widths)
    most = np.array([largest(width, exponent, balance, span) for width in effect.widths])
    steepest = 1.0 + (2.0 * balance - 1.0) * most**exponent  # right after a reversal
    bend = exponent * max(1.0, 2.0 * balance - 1.0) * steepest / widths  # as |s| <= 1

    def polynomials(dtype: Any) -> CurvePieces:
        return pieces(exponent, balance, DEGREE, max(FINEST * float(np.finfo(dtype).eps) / 2, EXACT))

    def error(dtype: Any, emitted: bool) -> float:
        found, unit = polynomials(dtype), float(np.finfo(dtype).eps) / 2
        off = (found.error, found.slip) if emitted else (EXACT, EXACT)
        size = float(np.abs(weights) @ widths)
        return size * drifted(exponent, off[0] + 8.0 * unit, off[1] + 16.0 * unit)

    def tables(dtype: Any) -> ElementTables:
        found = polynomials(dtype)
        rows = np.zeros((len(found.begin), 2 + 2 * DEGREE))
        rows[:, 0], rows[:, 1] = found.begin, found.level
        rows[:-1, 2 : 2 + DEGREE], rows[:-1, 2 + DEGREE :] = found.up, found.back
        numbers = zip(weights, weights * widths, 1.0 / widths, strict=True)
        return ElementTables(np.array(rows, dtype=dtype), ElementNumbers.of(numbers, dtype))

    coded = late("bouc_wen", "of"), late("bouc_wen", "error")

    def straight(step: float, unit: float, off: float) -> FixedElementTables:
        most = float(np.abs(weights) @ bend)
        found: FixedElementTables = coded[0]()(effect, step, unit, math.sqrt(2.0 * off / most) if most else math.inf)
        return found

    return ParallelTerms(
        weights, most * widths, steepest, bend, LoadedElements(effect), tables, error,
        straight, lambda: coded[1]()(effect),
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
def piece_at(t: ElementTables, column: int, x: Scalar) -> int:
    """The piece in which a place (column 0) or a value of the curve (column 1) lies."""
    low = 0
    high = len(t.piece)
    while high - low > 1:
        middle = (low + high) // 2
        if x < t.piece[middle, column]:
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
    i = piece_at(t, 0, m.element.place[j] + x)
    h = m.element.place[j] + x - t.piece[i, 0]
    value = t.piece[i, n + 1]
    slope = value
    for k in range(n, 1, -1):
        value = value * h + t.piece[i, k]
        slope = slope * h + value
    return t.piece[i, 1] + value * h - m.element.level[j], slope


@jit
def put(t: ElementTables, m: ElementsState[ElementState], j: int, s: Scalar) -> None:
    """Put element j at the value s of the curve."""
    n = m.element.c.shape[1]
    i = piece_at(t, 1, s)
    u = s - t.piece[i, 1]
    h: Scalar = t.piece[i, 2 * n + 1]
    for k in range(2 * n, n + 1, -1):
        h = h * u + t.piece[i, k]
    h = h * u
    for k in range(n):
        m.element.c[j, k] = t.piece[i, 2 + k]
    for k in range(n - 1, 0, -1):  # the piece's polynomial about h: its value there, then its coefficients
        m.element.c[j, k - 1] = m.element.c[j, k - 1] + h * m.element.c[j, k]
    m.element.level[j] = t.piece[i, 1] + h * m.element.c[j, 0]
    for first in range(1, n):
        for k in range(n - 1, first - 1, -1):
            m.element.c[j, k - 1] = m.element.c[j, k - 1] + h * m.element.c[j, k]
    m.element.place[j] = t.piece[i, 0] + h
    last = len(t.piece) - 1
    m.element.until[j] = t.piece[i + 1, 0] - m.element.place[j] if i < last else h - h


@jit
def unload(t: ElementTables, m: ElementsState[ElementState], w: Scalar) -> None:
    """Bring every element to rest at z = 0, with its input at w."""
    m.turned[0] = w
    m.upward[0] = 1
    for j in range(len(t.element)):
        m.element.high[j] = m.element.low[j] = w - w
        put(t, m, j, m.element.high[j])


@jit
def turn(t: ElementTables, m: ElementsState[ElementState], w: Scalar) -> None:
    """Turn every element at the input w. Its s changes sign: exactly, with a rounding remainder."""
    way = w - m.turned[0] if m.upward[0] else m.turned[0] - w
    for j in range(len(t.element)):
        more, _ = gained(t, m, j, way * t.element.inverse_width[j])
        high = m.element.high[j] + more
        part = high - m.element.high[j]
        low = m.element.low[j] + ((m.element.high[j] - (high - part)) + (more - part))
        whole = high + low
        m.element.low[j] = whole - high - low
        m.element.high[j] = -whole
        last = t.piece[len(t.piece) - 1, 1]
        if whole > last or whole < -last:
            m.element.high[j] = -last if whole > last else last
            m.element.low[j] = whole - whole
        put(t, m, j, m.element.high[j])
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
        total = total + t.element.amplitude[j] * (m.element.high[j] + more + m.element.low[j])
        slope = slope + t.element.weight[j] * steep
    return (total if m.upward[0] else -total), slope


ELEMENTS = ElementsPart(of, Elements(joined, turn, unload), late("bouc_wen"))
"""Elements in parallel with the plays as a part of the chain."""
