"""Curves from signal to signal in fixed point, as piecewise polynomials: `maps.c`."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics.jit import inside, jit
from hystgen.basics.structures import Count, Int32, Int32s, Struct, UInt8, UInt8s, note
from hystgen.front.curve import curve
from hystgen.plays.fixed import nearest
from hystgen.plays.slots import Reals


class BendCurve(Struct):
    """A smooth limit, or its inverse, as a piecewise polynomial."""

    knot: Int32s
    scale: UInt8s
    coefficient: Int32s
    least: Int32 = note("argument")
    most: Int32
    pieces: Count
    degree: UInt8
    drop: UInt8 = note("bits of a signal that an argument leaves out,")
    lift: UInt8 = note("and bits that a value leaves out")


class SmoothLimit(Struct):
    """A smooth limit."""

    forward: BendCurve
    inverse: BendCurve


class Bump(Struct):
    """What bending adds to the value of a play, as a piecewise polynomial of the same form."""

    knot: Int32s
    scale: UInt8s
    coefficient: Int32s
    pieces: Count


class BendPiece(Protocol):
    """A piece of a curve, as in `hystgen.compensator.fixed_tables.FixedCurve`."""

    @property
    def knot(self) -> int: ...
    @property
    def scale(self) -> int: ...
    @property
    def coefficients(self) -> tuple[int, ...]: ...


class Bends(NamedTuple):
    """Curves (k,) as in `hystgen.compensator.layout.FixedTables`; `scaled` (k, 2): right shift from a signal to the
    argument, and left shift from the value to a signal."""

    knot: Reals
    coefficient: Reals
    scale: Reals
    first: Reals
    pieces: Reals
    domain: Reals
    scaled: Reals


def bends(
    pieces: Sequence[Sequence[BendPiece]], domain: Sequence[tuple[int, int]], scaled: Sequence[tuple[int, int]],
    degree: int,
) -> Bends:
    """Tables of curves up to `degree`; a curve that is not needed has no pieces."""
    flat = list(itertools.chain.from_iterable(pieces))
    first = [0, *itertools.accumulate(map(len, pieces))][: len(pieces)]

    def whole(values: ArrayLike, columns: int = 0) -> NDArray[np.int64]:
        found = np.array(values, dtype=np.int64)
        return found.reshape(-1, columns) if columns else found

    return Bends(
        whole([one.knot for one in flat]), whole([one.coefficients[: degree + 1] for one in flat], degree + 1),
        whole([one.scale for one in flat]), whole(first), whole([len(each) for each in pieces]),
        whole(domain, 2), whole(scaled, 2),
    )


@jit
def bend(t: Bends, which: int, x: int) -> tuple[int, int]:
    """The value of a curve at x, and whether x had to be limited to the curve's ends."""
    argument = nearest(x, t.scaled[which, 0])
    within = inside(argument, t.domain[which, 0], t.domain[which, 1])
    return curve(t, which, within) << t.scaled[which, 1], 1 if within != argument else 0
