"""Gains behind the plays that vary: their limits and reciprocals, as in `gains.c`."""

from __future__ import annotations

import itertools
from typing import NamedTuple, Protocol

from hystgen.arithmetic.factors import MANTISSA_BITS, multiplied, times
from hystgen.basics.jit import Action, Answer, Scalar, jit, zero
from hystgen.basics.structures import Factor, Literal, NumberArray, Struct, TwoParts
from hystgen.effects.part import CodedGain, Coding

LEAST_GAIN, LARGEST_GAIN = 0.5, 2.0
"""[times] A gain is kept between these: a gain beyond them that the caller sets is due to a faulty sensor or a wrong
unit. Set by fixed point: with `GAIN_BITS` fraction bits, 2 is the limit of a gain and of its reciprocal."""

MOST_CHANGE = 0.25
"""[fraction of the gain] The largest change of a gain in one sample that the C follows: five Newton steps from the last
reciprocal leave `0.25^32`, less than the rounding of double precision. A limit of 0.5 would take six steps in every
sample, a limit of 0.9 nine. Set by: benchmarks/chosen_numbers.py newton."""

GAIN_BITS = 29
"""Fraction bits of a gain in fixed point: 2 is the largest, and mantissas have 31."""

ONE = 1 << GAIN_BITS

RECIPROCAL_ERROR = 4.0 * 2.0**-GAIN_BITS
"""[fraction of the signal] Error of the reciprocal of a gain of at least 1/2 that is off by its last bit: twice the
gain's error, plus that of a Newton step."""

LINEAR_ERROR = 2.0**-GAIN_BITS
"""[fraction of the signal] Error of a gain that is linear in a temperature or a column: one product."""

FACTOR_ERROR = 2.0**-MANTISSA_BITS
"""[fraction of a product] Error of a factor: half its last bit. The reference of a column has the same error."""


def coded_gain(
    rates: tuple[float, float], size: float, at: Coding, wrong: float, at_once: float, least: float, largest: float,
    offset: float,
) -> CodedGain:
    """A gain in fixed point that follows a column, with `rates` of gain and offset per unit of it, for inputs up to
    `size`; the column is off by `wrong` units and changes by `at_once` units per sample."""
    unit = abs(rates[0]) * size + abs(rates[1]) / at.output_lsb
    there = wrong * unit + LINEAR_ERROR * size + FACTOR_ERROR * offset
    back = (wrong + at_once) * unit / least + RECIPROCAL_ERROR * size + FACTOR_ERROR * offset / least
    return CodedGain(least, largest, there, back, offset)


def too_fast(change: float) -> str:
    """Why the C cannot follow a gain that changes by a fraction `change` in one move over the range."""
    return f"its gain changes by {100.0 * change:.3g} % in one move over the range, more than {MOST_CHANGE:.0%}"


def newton_steps(change: float, roundoff: float) -> int:
    """Newton steps that make the reciprocal exact up to rounding after the gain has changed by a fraction `change`."""
    left = max(change, 1e-9)
    return next(n for n in itertools.count(1) if left ** (2**n) < roundoff)


# ---------------------------------------------------------------- gains.c


class Gains(NamedTuple):
    """How an arithmetic computes with gains: the product of a signal and a gain, and of two gains; the reciprocal of a
    gain, from the gain 1; the product of a signal and factor j of a table; a caller's setting (in floating point any
    number) as a number of block j; and an action that sets a block's running sum (in floating point two parts).

    `limits`: numbers as in `GainLimits`.
    """

    times: Answer
    product: Answer
    reciprocal: Answer
    scaled: Answer
    given: Answer
    put: Action
    limits: tuple[float, float, float, float]


class GainLimits(Struct):
    """The gains 1 and 2, and the limits of a gain that is set."""

    one: Literal
    two: Literal
    least: Literal
    largest: Literal


def following(by: Gains) -> Answer:
    """A function for the reciprocal of a gain that has changed, by `turns` Newton steps from the previous one."""
    product = by.product

    @jit
    def followed(gain: Scalar, before: Scalar, two: Scalar, turns: int) -> Scalar:
        inverse = before
        for _ in range(turns):
            inverse = product(inverse, two - product(gain, inverse))
        return inverse

    return followed


@jit(inline=True)
def _times(x: Scalar, gain: Scalar) -> Scalar:
    return gain * x


@jit(inline=True)
def _reciprocal(one: Scalar, gain: Scalar) -> Scalar:
    return one / gain


@jit(inline=True)
def _given(t: Struct, j: int, x: Scalar) -> Scalar:  # noqa: ARG001  used in fixed point
    return x


@jit
def _put(s: TwoParts, j: int, x: Scalar) -> None:
    s.high[j] = x
    s.low[j] = zero(x)


FLOATING = Gains(_times, _times, _reciprocal, multiplied, _given, _put, (1.0, 2.0, LEAST_GAIN, LARGEST_GAIN))


@jit
def _fixed_times(x: int, gain: int) -> int:
    return times(x, gain, GAIN_BITS)


@jit
def _fixed_product(a: int, b: int) -> int:
    return (a * b + (1 << (GAIN_BITS - 1))) >> GAIN_BITS


@jit
def _fixed_reciprocal(one: int, gain: int) -> int:
    return ((one << GAIN_BITS) + (gain >> 1)) // gain


@jit
def _fixed_scaled(x: int, factors: Factor, j: int) -> int:
    return times(x, factors.mantissa[j], factors.shift[j])


@jit
def _fixed_given(t: _Coded, j: int, x: int) -> int:
    return x << t.bits[j]


@jit
def _fixed_put(s: TwoParts, j: int, x: int) -> None:
    s.high[j] = x


class _Coded(Protocol):
    """A table with the left shift from a caller's code to a number of a block."""

    bits: NumberArray


FIXED = Gains(
    _fixed_times, _fixed_product, _fixed_reciprocal, _fixed_scaled, _fixed_given, _fixed_put,
    (ONE, 2 * ONE, int(LEAST_GAIN * ONE), int(LARGEST_GAIN * ONE)),
)
