"""Plays that depend on the rate of their input, in fixed point."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence

from hystgen.arithmetic.factors import times
from hystgen.basics.jit import jit
from hystgen.effects.plays import FixedMovingTables, Moves
from hystgen.effects.rate_dependence.compensator import LONGEST, movement, stretch
from hystgen.front.curve import HALF
from hystgen.plays.fixed import FixedPlayTables, loop_solve, nearest
from hystgen.plays.loop import State
from hystgen.plays.slots import Reals


def whole_yields(
    law: Callable[[float], tuple[float, float]], begins: Sequence[int], end: int, step: float, bits: int
) -> list[tuple[object, ...]]:
    """The members of a `FixedYield` for each piece of the yields of stretches up to `end`, cubic between integer knots;
    the first piece is straight."""
    knots = sorted({0, end + 1, *(x for x in begins if 0 < x <= end)})
    while knots[-2] and LONGEST * knots[-2] < end:  # beyond the last piece in floating point
        knots.insert(-1, int(LONGEST) * knots[-2])
    while (wide := max(b - a for a, b in itertools.pairwise(knots))) > 2**30:
        k = next(i for i, (a, b) in enumerate(itertools.pairwise(knots)) if b - a == wide)
        knots.insert(k + 1, (knots[k] + knots[k + 1]) // 2)
    rows: list[tuple[object, ...]] = []
    for a, b in itertools.pairwise(knots):
        shift = 31 - (b - a).bit_length()
        ratio = 2.0 ** (31 - shift) / (b - a)  # range of the variable per length of the piece
        if a:
            (low, begin), (high, slope) = law(a * step), law(b * step)
            run, rise = (b - a) * step, high - low
            c = [low, begin * run, 3.0 * rise - (2.0 * begin + slope) * run, (begin + slope) * run - 2.0 * rise]
        else:
            c = [0.0, law(b * step)[0], 0.0, 0.0]
        units = [each * ratio**k * 2.0**bits / step for k, each in enumerate(c)]
        lift = max(0, max(math.frexp(each)[1] for each in units) - 30)
        rows.append((a, [round(each / 2.0**lift) for each in units], shift, lift))
    return rows


# ---------------------------------------------------------------- yield.c, relaxing.c


@jit
def yields(t: FixedMovingTables, x: int) -> int:
    """The yield in a step of a play with a nonlinear dashpot at stretch x >= 0, with bits below a step of the input."""
    inside = t.stretch if x > t.stretch else x
    low = 0
    high = len(t.yields)
    while high - low > 1:
        middle = (low + high) // 2
        if inside < t.yields.begin[middle]:
            high = middle
        else:
            low = middle
    h = (inside - t.yields.begin[low]) << t.yields.scale[low]
    y = h - h
    for k in range(3, -1, -1):
        y = t.yields.c[low, k] + ((y * h + HALF) >> 31)
    y = y << t.yields.lift[low]
    most = x << t.yield_bits
    return most if y > most else y


@jit
def seen(t: FixedMovingTables, way: int) -> int:
    """The part of `way` at which the input counts as standing still."""
    return times(way, t.seen[0], t.seen[1])


@jit
def moved_by(t: FixedMovingTables, gained: int) -> int:
    """The move of a play for its yield."""
    return nearest(gained, t.yield_bits)


@jit
def yield_of(t: FixedMovingTables, moved: int) -> int:
    """The yield for a play's move."""
    return moved << t.yield_bits


@jit
def share_of(factors: Reals, i: int, x: int) -> int:
    """x times the factor of play i."""
    return times(x, factors[i, 0], factors[i, 1])


@jit
def relaxing_follow(t: FixedMovingTables, plays: FixedPlayTables, s: State, w: int) -> int:
    """Move viscous plays with one time constant as their input goes to w. Returns their sum. Despite rounding,
    neighbouring plays rest at most as far apart as their thresholds."""
    r, p = plays.threshold, plays.weight
    total = p[0] * w
    for i in range(1, len(r)):
        z = s.play[i] + times(stretch(w - s.play[i], r[i]), t.first[1, 0], t.first[1, 1])
        total = total + p[i] * z
        rest = z + times(stretch(w - z, r[i]), t.second[1, 0], t.second[1, 1])
        if i > 1:
            room = r[i] - r[i - 1]
            if rest > s.play[i - 1] + room:
                rest = s.play[i - 1] + room
            elif rest < s.play[i - 1] - room:
                rest = s.play[i - 1] - room
        s.play[i] = rest
    s.play[0] = w
    return total


@jit
def relaxing_input(t: FixedMovingTables, plays: FixedPlayTables, s: State, h: int) -> int:  # noqa: ARG001  as in floating point
    """Input of viscous plays at which their sum is h. With the input at play 1, none is stretched; from there they are
    solved for like plain plays with smaller slopes."""
    s.play[0] = s.play[1]
    return loop_solve(t.relaxed, s, h)


ARITHMETIC = Moves(*movement(share_of, yields, seen, moved_by, yield_of), relaxing_follow, relaxing_input)
