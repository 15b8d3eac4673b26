"""Plays in fixed point: rounding, dividing by a slope with a reciprocal, and solving in the loop engine.

Inputs of the plays are integer multiples of a smallest step, sums are integer multiples of a fraction of an output
code, and both engines compute the same integers, so they agree in every bit.
"""

from __future__ import annotations

from typing import Protocol

from hystgen.basics.jit import inside, jit
from hystgen.plays.loop import PlayTables, State, loop_output
from hystgen.plays.slots import OUTPUT_CLAMPED, Reals


class FixedPlayTables(PlayTables, Protocol):
    """The model constants that plays need in fixed point."""

    @property
    def slope(self) -> Reals: ...
    @property
    def start_level(self) -> Reals: ...
    @property
    def way(self) -> Reals: ...
    @property
    def reach(self) -> Reals: ...
    @property
    def reciprocal(self) -> Reals: ...
    @property
    def shift(self) -> Reals: ...


LINE = 3031741620
FALL = 2021161080
"""For x in 1/2 .. 1, 1/x is 48/17 - 32/17 x to within 1/17: 48/17 in units of 2^-30, 16/17 in units of 2^-31."""


@jit
def nearest(x: int, bits: int) -> int:
    """x / 2^bits to the nearest integer, ties away from zero."""
    if bits == 0:
        return x
    half = 1 << (bits - 1)
    if x < 0:
        return (x + half - 1) >> bits
    return (x + half) >> bits


@jit
def code(t: FixedPlayTables, total: int) -> tuple[int, int]:
    """Output code of a sum, limited to the type, and its status bits."""
    found = nearest(total, t.limits.fraction[0])
    bits = OUTPUT_CLAMPED if found > t.limits.saturated[0] or found < -t.limits.saturated[0] else 0
    return inside(found, -t.limits.code_max[0], t.limits.code_max[0]), bits


@jit
def divide_by_slope(t: FixedPlayTables, d: int, k: int) -> int:
    """d / slope[k] to the nearest integer, d >= 0."""
    r = t.reciprocal[k]
    shift = t.shift[k]
    quotient = (d >> 32) * r + (((d & 0xFFFFFFFF) * r) >> 32)
    return ((quotient >> (shift - 1)) + 1) >> 1


@jit
def mantissa(x: int) -> tuple[int, int]:
    """An integer x > 0 below 2^63 as a mantissa of 31 bits, and the number of bits that it was shifted left."""
    raised = 0
    for bits in (32, 16, 8, 4, 2, 1):
        if x >> (63 - bits) == 0:
            x = x << bits
            raised += bits
    return x >> 32, raised


@jit
def quotient(x: int, y: int, bits: int) -> int:
    """2^bits x / y to a part in 2^28, rounded to an integer, for integers x >= 0 and y > 0 below 2^62. If it exceeds
    2^59, the result is at least 2^59."""
    if x == 0:
        return x
    number, raised = mantissa(x)
    divisor, lifted = mantissa(y)
    rate = LINE - ((divisor * FALL) >> 31)
    for _ in range(3):  # 2^61/divisor: each step squares the relative error, initially 1/17
        rate = (rate * ((1 << 31) - ((divisor * rate) >> 31))) >> 30
    shift = 60 + raised - lifted - bits
    if shift > 62:
        return x - x
    return (((number * rate) >> (shift if shift > 0 else 0)) + 1) >> 1


@jit
def input_further(t: FixedPlayTables, w: int, d: int, k: int, rising: int) -> int:
    """The input of the plays at which the output is d beyond that at w; at most slightly outside their range."""
    step = divide_by_slope(t, d, k)
    if rising:
        most = t.limits.play.high[0] + t.limits.margin[0]
        if step > most - w:
            return most
        return w + step
    least = t.limits.play.low[0] - t.limits.margin[0]
    if step > w - least:
        return least
    return w - step


@jit
def loop_solve(t: FixedPlayTables, s: State, output: int) -> int:
    """Input of the plays that gives `output`, found by letting one play after another begin to follow."""
    here = loop_output(t, s)
    w = s.play[0]
    if output == here:
        return w
    rising = 1 if output > here else 0
    left = output - here if rising else here - output
    k = 1
    while k < len(s.play):
        start = s.play[k] + t.threshold[k] if rising else s.play[k] - t.threshold[k]
        step = t.slope[k] * (start - w if rising else w - start)
        if left < step:
            break
        left = left - step
        w = start
        k += 1
    return input_further(t, w, left, k, rising)
