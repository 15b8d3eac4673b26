"""The curve of a Bouc-Wen element and its inverse as polynomials, for a compensator."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hystgen.effects.base import Array
from hystgen.effects.bouc_wen.curve import halves, size
from hystgen.effects.bouc_wen.model import place_of, reach

SAMPLES = 33
"""Points of a piece at which its errors are measured, ends included."""

SLIP = 16.0
"""[errors allowed] Error allowed for the slope of C: what errors of the slope add up to matters more than that of C."""

NOISE = 1e-13
"""Error of a slope times the piece's length that the rounding of C itself, some 1e-15, causes in a polynomial."""

MOST_SUM = 7.5
"""Largest such sum, twice that for the curve itself: with slopes of up to 8, 31 bits hold both."""

MOST_PIECES = 2000
"""Maximum number of pieces, a reserve: float64 takes some 100."""

LARGEST = 1e36
"""Largest coefficient: float32 holds numbers up to 3.4e38."""


class CurvePieces(NamedTuple):
    """A curve C between places `begin` (K + 1,): on piece k, over h from `begin[k]`, C is `level[k]` (K + 1,) plus
    `h (up[k, 0] + h (up[k, 1] + ..))`, and the place of the value `level[k] + u` is `begin[k] + u (back[k, 0] + ..)`.

    `error`: largest error of C; `slip`: largest error of its slope, with that of the place at which the inverse puts a
    value.
    """

    begin: Array
    level: Array
    up: Array
    back: Array
    error: float
    slip: float


def extremes(
    shape: tuple[float, float], law: tuple[float, float], low: float, high: float
) -> tuple[tuple[float, float], float]:
    """For an element of a `shape`, its width and tilt, and an input within a range: -z at the smallest input and z at
    the largest, after a move there from rest at the other end, which no other history exceeds anywhere on the way; and
    the largest change of z per change of the input, right after a reversal."""
    (width, tilt), (exponent, balance) = shape, law
    span = (high - low) / width
    if not tilt:
        s = reach(*halves(exponent, balance), span)
        return (width * s, width * s), 1.0 + (2.0 * balance - 1.0) * s**exponent
    ends, steepest = [], 0.0
    for lean, begin in ((-tilt * width, 1.0 + tilt * high), (tilt * width, 1.0 + tilt * low)):
        rest = begin - lean
        peak = min(max(math.log(-0.5 * rest / lean), 0.0), span) if lean < 0.0 else span
        moved = [lean * x - rest * math.expm1(-x) for x in (peak, span)]
        steepest = max(steepest, begin, begin + lean * peak + moved[0])
        ends.append(width * moved[1])
    return (ends[0], ends[1]), steepest


@functools.lru_cache(maxsize=16)
def pieces(exponent: float, balance: float, degree: int, allowed: float, shortest: float = 0.0) -> CurvePieces:
    """The curve as polynomials of a `degree`, from -1 until it is within `allowed` of 1; each errs by at most
    `allowed`. `shortest`: if given, lengths are powers of 2, at least this one, and the polynomials of shares of a
    piece and of its rise have coefficients that sum up to less than `MOST_SUM`."""
    above, below = halves(exponent, balance)

    def curve(x: Array) -> Array:
        return np.array([-size(below, -each) if each < 0.0 else size(above, each) for each in x.tolist()])

    first, last = place_of(above, below, -1.0), place_of(above, below, 1.0 - allowed)
    todo = [(0.0, last), (first, 0.0)]
    if shortest:  # the curve goes on below -1 for another cell
        fine = 2.0 ** math.floor(math.log2(float(below.wide[0])))
        todo = [*[(a, b) for a, b in _powers(last, 0.5)][::-1], *[(-b, -a) for a, b in _powers(-first, fine)]]
        first, last = todo[-1][0], todo[0][1]
    begin: list[float] = []
    up: list[Array] = []
    back: list[Array] = []
    error, slip = 0.0, 0.0
    while todo:
        a, b = todo.pop()
        there, missed, off = _fitted(curve, exponent, balance, degree, a, b)
        rough = missed > allowed or off > SLIP * allowed + NOISE / (b - a)
        if shortest:
            rough = rough or _largest(there, a, b) > MOST_SUM
        if rough and b - a >= 2.0 * shortest:
            if len(begin) + len(todo) > MOST_PIECES:
                raise OverflowError("the curve bends too sharply")
            todo += [(0.5 * (a + b), b), (a, 0.5 * (a + b))]
            continue
        begin.append(a)
        up.append(there[0])
        back.append(there[1])
        error, slip = max(error, missed), max(slip, off)
    places = np.array([*begin, last])
    return CurvePieces(places, curve(places), np.array(up), np.array(back), error + allowed, slip)


def _largest(polynomials: tuple[Array, Array], a: float, b: float) -> float:
    """Sum of the coefficients of two polynomials, of the curve from a to b and of its inverse, over shares."""
    there, back = polynomials
    powers = np.arange(1, len(there) + 1)
    rise = float(there @ (b - a) ** powers)
    sums = np.abs(there) @ (b - a) ** (powers - 1), np.abs(back) @ rise**powers / (b - a)
    return float(max(0.5 * sums[0], sums[1]))


def _powers(length: float, fine: float) -> list[tuple[float, float]]:
    """Adjacent intervals from 0 to `length`, rounded up to a multiple of `fine`, each a power of 2 long, the longest
    first."""
    left, ends = math.ceil(length / fine), [0.0]
    while left:
        power = 1 << (left.bit_length() - 1)
        ends.append(ends[-1] + power * fine)
        left -= power
    return list(itertools.pairwise(ends))


def _fitted(
    curve: Callable[[Array], Array], exponent: float, balance: float, degree: int, a: float, b: float
) -> tuple[tuple[Array, Array], float, float]:
    """Polynomials of the curve and of its inverse from a to b, the error of C, and that of its slope."""
    nodes = 0.5 - 0.5 * np.cos(np.pi * np.arange(degree + 1) / degree)  # with both ends, so that neighbours meet
    low, high = curve(np.array([a, b]))
    x = a + (b - a) * nodes
    there = _through((b - a) * nodes, curve(x) - low)
    above, below = halves(exponent, balance)
    back = _back(functools.partial(place_of, above, below), degree, (a, float(low), float(high)))
    h = (b - a) * np.linspace(0.0, 1.0, SAMPLES)
    exact = curve(a + h)
    missed = float(np.max(np.abs(low + _value(there, h) - exact)))
    slope = 1.0 - np.where(exact > 0.0, 1.0, 1.0 - 2.0 * balance) * np.abs(exact) ** exponent
    steep = np.polynomial.polynomial.polyval(h, there * np.arange(1, degree + 1))
    put = curve(a + _value(back, exact - low))
    bend = exponent * max(1.0, 2.0 * balance - 1.0)  # largest change of the slope per change of s
    return (there, back), missed, float(np.max(np.abs(steep - slope)) + bend * np.max(np.abs(put - exact)))


def _back(place: Callable[[float], float], degree: int, piece: tuple[float, float, float]) -> Array:
    """Polynomial of the inverse, of the largest degree whose coefficients are no numbers that float32 cannot hold:
    where the curve is nearly level, they grow with the powers of the reciprocal of its rise."""
    a, low, high = piece
    for used in range(degree, 0, -1):
        values = low + (high - low) * (0.5 - 0.5 * np.cos(np.pi * np.arange(used + 1) / used))
        back = _through(values - low, np.array([place(each) for each in values.tolist()]) - a)
        if np.max(np.abs(back)) < LARGEST:
            break
    return np.append(back, np.zeros(degree - used))


def _through(x: Array, y: Array) -> Array:
    """Coefficients, from x^1 on, of the polynomial through points (degree + 1,) of which the first is (0, 0)."""
    scale = x[-1]
    table = (x[1:, None] / scale) ** np.arange(1, len(x))
    return np.asarray(np.linalg.solve(table, y[1:]) / scale ** np.arange(1, len(x)))


def _value(c: Array, x: Array) -> Array:
    total = np.zeros_like(x)
    for each in c[::-1]:
        total = (total + each) * x
    return total
