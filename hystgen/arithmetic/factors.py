"""Products with constants; in fixed point, a whole number times a non-integer: `c_runtime/arithmetic/factors.c`."""

from __future__ import annotations

import math
from fractions import Fraction

from hystgen.basics.jit import Scalar, jit
from hystgen.basics.structures import NumberArray

LOW_BITS = 20
"""Number of low bits that are multiplied separately; the upper part then has 31 bits, and both products fit into 64."""

LARGEST = 2**51
"""Exclusive bound on numbers to be multiplied: their upper part then has no more bits than a mantissa, 31."""

STATE_BITS = 60
"""Bits of a state without its sign. A product takes 50 of them; the shifts of factors allow for the ten dropped."""

GUARD = 3
"""Extra low bits of a state. Without them its rounding errors would add up to the last bit of a signal; with them they
add up to an eighth of it, and a slow state stalls in a dead band of at most 1/16 of it. Held by
`test_slow_states_neither_stall_nor_drift`, and for a user's own effects by `test_fixed_point_stays_within_its_bounds`.
From 0 to 8 bits, a mode's error bound in q31 and q15 changes by less than 1e-4, since the factors dominate it."""

MANTISSA_BITS, LEAST_SHIFT, MOST_SHIFT = 31, LOW_BITS + 1, LOW_BITS + 62
"""Bits of a mantissa without its sign, and range of shifts: a product drops 1 bit (for rounding) to 62 bits."""

BEYOND = 2.0 ** (MANTISSA_BITS - LEAST_SHIFT)
"""Exclusive bound on factors."""


def factor(x: float | Fraction) -> tuple[int, int]:
    """Mantissa and shift of a factor, `mantissa / 2^shift`, to 31 bits; fewer only below 2^-52.

    Raises OverflowError for `BEYOND` or more.
    """
    exact = Fraction(x)
    if not exact:
        return 0, LEAST_SHIFT
    shift = min(MANTISSA_BITS - math.frexp(float(exact))[1], MOST_SHIFT)
    mantissa = round(exact * 2**shift)
    if abs(mantissa) >= 1 << MANTISSA_BITS:  # rounded up to a power of 2
        shift -= 1
        mantissa = round(exact * 2**shift)
    if shift < LEAST_SHIFT:
        raise OverflowError(f"{float(x):.6g} is not a factor below {BEYOND:g}")
    return mantissa, shift


def error(x: float | Fraction) -> float:
    """Absolute error in rounding x to a factor."""
    mantissa, shift = factor(x)
    return float(abs(Fraction(mantissa) / 2**shift - Fraction(x)))


def lifted(x: float, bits: int) -> int:
    """Number of bits by which a scaling of x by 2^bits must be reduced so that the result is a factor."""
    return max(0, math.frexp(x)[1] + bits - (math.frexp(BEYOND)[1] - 1))


@jit
def times(x: int, mantissa: int, shift: int) -> int:
    """x times a factor, rounded to the nearest whole number; for |x| < LARGEST."""
    high = x >> LOW_BITS
    low = x & ((1 << LOW_BITS) - 1)
    whole = high * mantissa + ((low * mantissa) >> LOW_BITS)
    return (whole + (1 << (shift - LOW_BITS - 1))) >> (shift - LOW_BITS)


@jit
def paired(x: int, factors: NumberArray, j: int) -> int:
    """x times factor j of an array of mantissas and shifts."""
    return times(x, factors[j, 0], factors[j, 1])


@jit(inline=True)
def multiplied(x: Scalar, factors: NumberArray, j: int) -> Scalar:
    """The same in floating point, with an array of numbers."""
    return factors[j] * x
