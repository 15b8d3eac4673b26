"""Derives every number in the tanh and atanh kernels; run it to see the tables as C and as Python.

    python c_runtime/front/fit_coefficients.py [--format float32|float64]

Every polynomial interpolates f(d) - f(0) at Chebyshev nodes in d, with the node nearest to 0 moved to 0, where the only
error is then that of the rounded f(0). Coefficients are rounded to the format one by one, the lowest first, and the
higher ones are refitted each time to make up for the rounding. Centers of pieces are moved a little until f(0) is
almost a number of the format (S. Gal, "Computing elementary functions: a new approach for achieving high accuracy and
good performance", 1986). `tanh_error` and `atanh_error` bound the error of the kernels.
"""

from __future__ import annotations

import argparse
import functools
import itertools
import textwrap
from collections.abc import Callable
from typing import NamedTuple

import mpmath as mp

mp.mp.prec = 160

Function = Callable[[mp.mpf], mp.mpf]


class Shape(NamedTuple):
    """What is chosen by hand for a format; everything else follows."""

    bits: int  # of the significand
    grid: int  # centers of pieces are multiples of 2^-grid
    tanh_tiny: int  # below 2^-tanh_tiny, tanh x is x
    tanh_odd: int  # terms after x in the odd polynomial
    tanh_degree: int  # of a piece
    atanh_odd: int
    atanh_degree: int


PIECES = 8
SHAPES = {
    "float32": Shape(24, 12, 12, 5, 6, 6, 4),
    "float64": Shape(53, 16, 27, 12, 15, 13, 10),
}


def rounded(x: mp.mpf, bits: int) -> mp.mpf:
    """x to `bits` significant bits, to nearest."""
    with mp.workprec(bits):
        return +mp.mpf(x)


def nodes(count: int, low: mp.mpf, high: mp.mpf) -> list[mp.mpf]:
    """Chebyshev nodes on [low, high] from the outermost inwards to 0, without the one nearest to 0."""
    x = [mp.cos(mp.pi * (2 * i + 1) / (2 * count)) for i in range(count)]
    return sorted(((low + high + (high - low) * v) / 2 for v in x), key=abs, reverse=True)[:-1]


def interpolant(x: list[mp.mpf], y: list[mp.mpf]) -> list[mp.mpf]:
    """Coefficients, lowest first, of the polynomial through the points (Newton's divided differences)."""
    difference = list(y)
    for order in range(1, len(x)):
        for i in range(len(x) - 1, order - 1, -1):
            difference[i] = (difference[i] - difference[i - 1]) / (x[i] - x[i - order])
    out = [difference[-1]]
    for i in range(len(x) - 2, -1, -1):
        shifted = [mp.mpf(0), *out]
        out = [s - x[i] * o for s, o in zip(shifted, [*out, mp.mpf(0)], strict=True)]
        out[0] += difference[i]
    return out


def fit(f: Function, start: mp.mpf, degree: int, low: mp.mpf, high: mp.mpf, bits: int) -> list[mp.mpf]:
    """Rounded coefficients of degree 0 (`start`, the rounded f(0)) to `degree` on [low, high], which holds 0."""
    x = nodes(degree + 1, low, high)
    y = [(f(v) - start) / v for v in x]
    out = [start]
    while x:
        out.append(rounded(interpolant(x, y)[0], bits))
        x, y = x[:-1], [(w - out[-1]) / v for v, w in zip(x, y, strict=True)][:-1]
    return out


def worst(f: Function, coefficients: list[mp.mpf], low: mp.mpf, high: mp.mpf, points: int = 40) -> mp.mpf:
    """Largest error of the polynomial on [low, high]."""
    grid = [low + (high - low) * i / points for i in range(points + 1)]
    return max(abs(f(d) - functools.reduce(lambda y, c: c + d * y, reversed(coefficients))) for d in grid)


def center(f: Function, low: mp.mpf, high: mp.mpf, shape: Shape) -> mp.mpf:
    """The grid point nearest to the middle at which f is within ulp/64 of a multiple of the ulp below 1."""
    middle = mp.nint(mp.ldexp((low + high) / 2, shape.grid))
    for i in itertools.count():
        for step in (i, -i):
            point = mp.ldexp(middle + step, -shape.grid)
            value = mp.ldexp(f(point), shape.bits)
            if abs(value - mp.nint(value)) < mp.mpf(1) / 64:
                return point
    raise AssertionError


def piece(f: Function, low: mp.mpf, high: mp.mpf, middle: mp.mpf, degree: int, bits: int) -> list[mp.mpf]:
    """Coefficients of f(middle + d) for low <= middle + d <= high; the constant is a multiple of 2^-bits."""
    start = mp.ldexp(mp.nint(mp.ldexp(f(middle), bits)), -bits)
    return fit(lambda d: f(middle + d), start, degree, low - middle, high - middle, bits)


def odd_polynomial(f: Function, terms: int, end: mp.mpf, bits: int) -> list[mp.mpf]:
    """P with f(x) = x + x z P(z), z = x^2, for 0 <= x <= end."""

    def ratio(z: mp.mpf) -> mp.mpf:
        return f(mp.sqrt(z)) / mp.sqrt(z)

    return fit(ratio, mp.mpf(1), terms, mp.mpf(0), end**2, bits)[1:]


def tanh_reach(low: mp.mpf, last: mp.mpf, degree: int, tolerance: mp.mpf) -> mp.mpf:
    """End of a piece that begins at `low` and whose error stays within `tolerance`; at most `last`."""

    def good(high: mp.mpf) -> bool:
        middle = (low + high) / 2

        def f(d: mp.mpf) -> mp.mpf:
            return mp.tanh(middle + d)

        unrounded = fit(f, f(mp.mpf(0)), degree, low - middle, high - middle, mp.mp.prec)
        return bool(worst(f, unrounded, low - middle, high - middle) <= tolerance)

    if good(last):
        return last
    near, far = low, last
    while far - near > mp.mpf(2) ** -8:
        middle = (near + far) / 2
        near, far = (middle, far) if good(middle) else (near, middle)
    return mp.ldexp(mp.floor(mp.ldexp(near, 8)), -8)


def tanh_knots(shape: Shape, last: mp.mpf) -> list[mp.mpf]:
    """PIECES starting points, the first just above where tanh is 1/2, so that all pieces have about equal errors."""
    tolerance = mp.mpf(2) ** (-shape.bits - 4.5)
    while True:
        knots = [mp.mpf(141) / 256]
        while len(knots) <= PIECES:
            end = tanh_reach(knots[-1], last, shape.tanh_degree, tolerance)
            if end == last:
                return knots
            knots.append(end)
        tolerance *= mp.mpf(2) ** 0.25


@functools.cache
def tanh_tables(name: str) -> dict[str, list[mp.mpf]]:
    """Tables of tanh for "float32" or "float64"."""
    shape = SHAPES[name]
    last = rounded((shape.bits + 2) * mp.log(2) / 2, shape.bits)  # 1 - 2 exp(-2x) rounds to 1 from here
    knots = tanh_knots(shape, last)
    ends = [*knots[1:], last]
    centers = [center(mp.tanh, low, high, shape) for low, high in zip(knots, ends, strict=True)]
    pieces = [
        piece(mp.tanh, low, high, middle, shape.tanh_degree, shape.bits)
        for low, high, middle in zip(knots, ends, centers, strict=True)
    ]
    return {
        "bound": [mp.ldexp(1, -shape.tanh_tiny), last],
        "odd": odd_polynomial(mp.tanh, shape.tanh_odd, knots[0], shape.bits),
        "knot": knots,
        "center": centers,
        "row": [c for row in pieces for c in row],
    }


def half_log(m: mp.mpf) -> mp.mpf:
    """log(m)/2."""
    return mp.log(m) / 2


@functools.cache
def atanh_tables(name: str) -> dict[str, list[mp.mpf]]:
    """Tables of atanh for "float32" or "float64"; the pieces are those of log(m)/2 on [1, 2]."""
    shape = SHAPES[name]
    edges = [1 + mp.mpf(j) / PIECES for j in range(PIECES + 1)]
    spans = list(itertools.pairwise(edges))
    centers = [center(half_log, low, high, shape) for low, high in spans]
    pieces = [
        piece(half_log, low, high, middle, shape.atanh_degree, shape.bits)
        for (low, high), middle in zip(spans, centers, strict=True)
    ]
    return {
        "bound": [mp.mpf(1) / 2, 1 - mp.ldexp(1, -shape.bits)],
        "half_log2": [rounded(half_log(mp.mpf(2)), shape.bits)],
        "odd": odd_polynomial(mp.atanh, shape.atanh_odd, mp.mpf(1) / 2, shape.bits),
        "center": centers,
        "offset": [c - 1 for c in centers[PIECES // 2 :]],
        "row": [c for row in pieces for c in row],
    }


class Rounded(NamedTuple):
    """A value and a bound on the rounding error it carries."""

    value: mp.mpf
    error: mp.mpf

    def plus(self, other: Rounded, bits: int) -> Rounded:
        value = self.value + other.value
        return Rounded(value, self.error + other.error + half_ulp(value, bits))

    def times(self, other: Rounded, bits: int) -> Rounded:
        value = self.value * other.value
        error = abs(self.value) * other.error + abs(other.value) * self.error
        return Rounded(value, error + half_ulp(value, bits))


def half_ulp(x: mp.mpf, bits: int) -> mp.mpf:
    """Maximum error in rounding a result near x."""
    return mp.ldexp(1, mp.frexp(x)[1] - 1 - bits) if x else mp.mpf(0)


def exact(x: mp.mpf) -> Rounded:
    """x without error."""
    return Rounded(mp.mpf(x), mp.mpf(0))


def horner(coefficients: list[mp.mpf], d: Rounded, bits: int) -> Rounded:
    """The polynomial as the kernels evaluate it."""
    out = exact(coefficients[-1])
    for c in coefficients[-2::-1]:
        out = exact(c).plus(d.times(out, bits), bits)
    return out


def in_ulp(result: Rounded, true: mp.mpf, bits: int) -> mp.mpf:
    """Error of a result, rounding and polynomial together, in ulp of the true value."""
    return (result.error + abs(result.value - true)) / half_ulp(true, bits) / 2


def odd_error(f: Function, coefficients: list[mp.mpf], x: mp.mpf, bits: int) -> mp.mpf:
    """Error of x + x (z P(z)), in ulp."""
    z = exact(x).times(exact(x), bits)
    tail = exact(x).times(z.times(horner(coefficients, z, bits), bits), bits)
    return in_ulp(exact(x).plus(tail, bits), f(x), bits)


def tanh_error(name: str, points: int = 200) -> float:
    """Bound on the error of tanh in ulp with the worst possible roundings, at `points` arguments per piece."""
    bits, degree, t = SHAPES[name].bits, SHAPES[name].tanh_degree, tanh_tables(name)
    out = max(odd_error(mp.tanh, t["odd"], t["knot"][0] * i / points, bits) for i in range(1, points + 1))
    for i, (low, high) in enumerate(itertools.pairwise([*t["knot"], t["bound"][1]])):
        row = t["row"][i * (degree + 1) : (i + 1) * (degree + 1)]
        for x in (low + (high - low) * n / points for n in range(points + 1)):
            y = horner(row, exact(x - t["center"][i]), bits)
            out = max(out, in_ulp(y, mp.tanh(x), bits))
    return float(out)


def atanh_error(name: str, points: int = 200) -> float:
    """Like `tanh_error`, but at `points` arguments up to 1/2 and in each octave of 1 - x down to 2^-bits."""
    bits, degree, t = SHAPES[name].bits, SHAPES[name].atanh_degree, atanh_tables(name)
    out = max(odd_error(mp.atanh, t["odd"], mp.mpf(i) / (2 * points), bits) for i in range(1, points + 1))

    def log_piece(m: mp.mpf) -> tuple[mp.mpf, Rounded]:
        i = min(int((m - 1) * PIECES), PIECES - 1)
        row = t["row"][i * (degree + 1) : (i + 1) * (degree + 1)]
        d = exact(m - t["center"][i])
        return row[0], d.times(horner(row[1:], d, bits), bits)

    for k in range(1, bits + 1):
        product = rounded(k * t["half_log2"][0], bits)
        for m in (1 + mp.mpf(n) / points for n in range(points)):
            x = 1 - mp.ldexp(m, -k)
            if x < mp.mpf(1) / 2:
                continue
            (start, lower), (end, upper) = log_piece(m), log_piece(1 + x)
            difference = upper.plus(Rounded(-lower.value, lower.error), bits)
            y = exact(product).plus(exact(end - start).plus(difference, bits), bits)
            out = max(out, in_ulp(y, mp.atanh(x), bits))
    return float(out)


def literal(x: mp.mpf, name: str) -> str:
    """Shortest decimal that reads back as x."""
    if name == "float64":
        return repr(float(x))
    return next(
        repr(float(text))
        for text in (f"{float(x):.{digits}e}" for digits in range(9))
        if rounded(mp.mpf(text), SHAPES[name].bits) == x
    )


def wrapped(words: list[str], indent: str) -> str:
    """Words separated by commas, in lines of at most 110 columns."""
    return textwrap.fill(", ".join(words), 110, initial_indent=indent, subsequent_indent=indent)


def show(kernel: str, name: str) -> str:
    """The tables of a kernel as Python and as C text."""
    shape = SHAPES[name]
    tables = tanh_tables(name) if kernel == "tanh" else atanh_tables(name)
    columns = 1 + (shape.tanh_degree if kernel == "tanh" else shape.atanh_degree)
    python, c = [], []
    for key, values in tables.items():
        words = [literal(v, name) for v in values]
        python.append(f"{key}=[\n{wrapped(words, '    ')},\n],")
        words = [w + ("f" if name == "float32" else "") for w in words]
        head = f"static const hystgen_real_t hystgen_{kernel}_{key}[{len(words)}]"
        if key == "row":
            rows = [words[i : i + columns] for i in range(0, len(words), columns)]
            head = f"static const hystgen_real_t hystgen_{kernel}_row[{len(rows)}][{columns}]"
            body = ",\n".join("    {" + wrapped(row, "     ").strip() + "}" for row in rows)
        else:
            body = wrapped(words, "    ")
        c.append(f"{head} = {{\n{body}\n}};")
    return "\n".join([f"# {kernel}, {name}: Python", *python, f"/* {kernel}, {name}: C */", *c])


def main() -> None:
    parser = argparse.ArgumentParser(description="tables of the tanh and atanh kernels")
    parser.add_argument("--format", choices=sorted(SHAPES), action="append")
    for name in parser.parse_args().format or sorted(SHAPES):
        print(show("tanh", name))
        print(f"# at most {tanh_error(name):.3f} ulp\n")
        print(show("atanh", name))
        print(f"# at most {atanh_error(name):.3f} ulp\n")


if __name__ == "__main__":
    main()
