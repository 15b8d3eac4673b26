"""The curve along which a Bouc-Wen element moves, the same after every reversal.

With `s = z/width` in the direction of the input, `ds/dx = 1 - (b sgn s + 1 - b) |s|^n` over the distance x moved, in
widths. So `s = C(place + x)` for one rising curve C with C(0) = 0, from the place at which s = -1 on, and a reversal
changes the sign of s. Each half of C, m = |s| at the distance d from 0, obeys `dm/dd = 1 - c m^n`, with c = 1 above 0
and c = 1 - 2 b <= 0 below.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.jit import jit

Array = NDArray[np.float64]

NEAR = 0.25
"""[widths] Up to this distance from 0 a half is a power series in `c d^n`, which no Taylor series about 0 replaces for
fractional n; beyond, it is a Taylor series in each cell. The last of the `TERMS` is then below 1e-17 for the steepest
law (balance 4, exponents 1, 1.2 and 2); with 0.5 it reaches 4e-5."""

TERMS = 30
"""Coefficients of the series near 0. Set by: `test_bouc_wen::test_the_curve_is_its_equation`."""

DEGREE = 12
"""Degree of the Taylor series in the cells. Set by: the same."""

CELLS = 16.0
"""[1/width] Cells per width at the exponent 1. With others the curve is continued to poles at a distance of order
`1/(n max(1, |c|))`, so cells are shorter by this factor."""

BEYOND = 45.0
"""[e-foldings] Distance after which 1 - s is below the spacing of numbers: exp(-45) is 3e-20."""

TRIES = 60
"""Maximum number of Newton steps for a place on the curve, a reserve: C is convex or concave on each half, so that they
approach from one side, and 3 to 6 are usual."""


class Half(NamedTuple):
    """One half of a curve: `c`, `exponent` (1,); `near` (TERMS,): coefficients of `m/d` in powers of `c d^n`; `cells`
    (K, DEGREE + 1): Taylor coefficients about the middle of each cell of the length `wide` (1,), from NEAR on;
    `ends` (K + 1,): m at the ends of the cells."""

    c: Array
    exponent: Array
    near: Array
    cells: Array
    ends: Array
    wide: Array


@jit
def _powers(a: Array, n: float, out: Array, k: int) -> None:
    """Coefficient k > 0 of the n-th power `out` of a power series `a` with `a_0 > 0`."""
    total = 0.0
    for j in range(1, k + 1):
        total += (n * j - k + j) * a[j] * out[k - j]
    out[k] = total / (k * a[0])


@jit
def _taylor(m: float, c: float, n: float, power: Array, out: Array) -> None:
    """Taylor coefficients `out` of the solution of `m' = 1 - c m^n` from m > 0 on; `power`: those of `m^n`."""
    out[0] = m
    power[0] = m**n
    for k in range(1, len(out)):
        out[k] = ((1.0 if k == 1 else 0.0) - c * power[k - 1]) / k
        _powers(out, n, power, k)


@jit
def _series(n: float, power: Array, out: Array) -> None:
    """Coefficients `out` of `Y = m/d` in powers of `q = c d^n`: `Y + n q Y' = 1 - q Y^n`."""
    out[0] = power[0] = 1.0
    for k in range(1, len(out)):
        out[k] = -power[k - 1] / (1.0 + n * k)
        _powers(out, n, power, k)


@jit
def horner(coefficients: Array, x: float) -> float:
    """Value of a polynomial at x, from its coefficients."""
    total = 0.0
    for k in range(len(coefficients) - 1, -1, -1):
        total = coefficients[k] + total * x
    return total


@jit
def _cells(m: float, c: float, n: float, wide: float, power: Array, cells: Array, ends: Array) -> int:
    """Fill the cells, from m on, up to the one after that in which m reaches 1; returns the number filled."""
    ends[0] = m
    for i in range(len(cells)):
        over = m >= 1.0
        _taylor(m, c, n, power, cells[i])
        middle = horner(cells[i], 0.5 * wide)
        _taylor(middle, c, n, power, cells[i])
        m = horner(cells[i], 0.5 * wide)
        m = min(m, 1.0) if c > 0.0 else m
        ends[i + 1] = m
        if over:
            return i + 1
    return len(cells)


@jit
def size(half: Half, d: float) -> float:
    """m at the distance d >= 0 from 0; 1 from the end of the cells on."""
    total = 0.0
    if d < NEAR:
        q = half.c[0] * d ** half.exponent[0]
        for k in range(TERMS - 1, -1, -1):
            total = half.near[k] + total * q
        return d * total
    along = (d - NEAR) / half.wide[0]
    if along >= len(half.cells):
        return 1.0
    i = int(along)
    x = d - NEAR - (i + 0.5) * half.wide[0]
    for k in range(DEGREE, -1, -1):
        total = half.cells[i, k] + total * x
    return total


@jit
def distance(half: Half, m: float) -> float:
    """The distance from 0 at which a half is at m, 0 to 1."""
    low, high = 0, len(half.ends) - 1
    if m >= half.ends[high]:
        return float(NEAR + high * half.wide[0])
    if m < half.ends[0]:
        d = m
    else:
        while high - low > 1:
            middle = (low + high) // 2
            if m < half.ends[middle]:
                high = middle
            else:
                low = middle
        d = NEAR + (low + (m - half.ends[low]) / (half.ends[high] - half.ends[low])) * half.wide[0]
    for _ in range(TRIES):
        found = size(half, d)
        slope = 1.0 - half.c[0] * found ** half.exponent[0]
        if not slope > 0.0:
            break
        step = (m - found) / slope
        d = max(d + step, 0.0)
        if abs(step) <= 4e-16 * d:
            break
    return d


@functools.lru_cache(maxsize=64)
def halves(exponent: float, balance: float) -> tuple[Half, Half]:
    """The halves of the curve above and below 0."""
    return _half(exponent, 1.0), _half(exponent, 1.0 - 2.0 * balance)


def _half(exponent: float, c: float) -> Half:
    near, power = np.empty(TERMS), np.empty(TERMS)
    _series(exponent, power, near)
    wide = 1.0 / (CELLS * exponent * max(1.0, -c))
    # above 0, from 1 - s = 1/e on at the latest, 1 - s falls by a factor e per 1/n or faster; below 0, s falls steadily
    longest = 1.0 + BEYOND / exponent if c > 0.0 else 1.0
    count = math.ceil(longest / wide) + 1
    cells, ends = np.empty((count, DEGREE + 1)), np.empty(count + 1)
    begin = NEAR * horner(near, c * NEAR**exponent)
    count = _cells(begin, c, exponent, wide, power[: DEGREE + 1], cells, ends)
    return Half(np.array([c]), np.array([exponent]), near, cells[:count], ends[: count + 1], np.array([wide]))
