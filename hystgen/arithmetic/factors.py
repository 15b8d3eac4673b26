"""Products of whole numbers with non-integer constants, in fixed point: `c_runtime/arithmetic/factors.c`."""

from __future__ import annotations

import math
from fractions import Fraction

from hystgen.basics.jit import jit

LOW_BITS = 20
"""Low bits of a number that are multiplied separately, so that 31 remain: both products fit 64 bits."""

LARGEST = 2**51
"""Exclusive bound of the numbers that are multiplied: the upper part then has 31 bits, like a mantissa."""

STATE_BITS = 60
"""Bits of a state without its sign. A product takes 50 and drops ten, and no rate outgrows a factor."""

GUARD = 3
"""Extra bits of a state, below those with which its roundings add up to the last bit of a signal: they then add up to
an eighth of it, and a slow state stalls in a dead band of at most 1/16 of it. Held by
`test_slow_states_neither_stall_nor_drift`, and for a user's own effects by `test_fixed_point_stays_within_its_bounds`.
The error bound of a mode in q31 and q15 is the same to 1e-4 with 0 to 8 bits: it is set by the factors."""

MANTISSA_BITS, LEAST_SHIFT, MOST_SHIFT = 31, LOW_BITS + 1, LOW_BITS + 62
"""Bits of a mantissa without its sign, and range of shifts: a product drops at least one bit, to round, and at most
62."""

BEYOND = 2.0 ** (MANTISSA_BITS - LEAST_SHIFT)
"""Exclusive bound of factors."""


def factor(x: float | Fraction) -> tuple[int, int]:
    """Mantissa and shift of a factor, `mantissa / 2^shift`, to 31 bits; fewer only below 2^-52.

    Raises OverflowError from `BEYOND` on.
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
    """Absolute error of a factor."""
    mantissa, shift = factor(x)
    return float(abs(Fraction(mantissa) / 2**shift - Fraction(x)))


def lifted(x: float, bits: int) -> int:
    """How many of the `bits` of a product with x have to be dropped so that x becomes a factor."""
    return max(0, math.frexp(x)[1] + bits - (math.frexp(BEYOND)[1] - 1))


@jit
def times(x: int, mantissa: int, shift: int) -> int:
    """x times a factor, rounded to the nearest whole number; for |x| < LARGEST."""
    high = x >> LOW_BITS
    low = x & ((1 << LOW_BITS) - 1)
    whole = high * mantissa + ((low * mantissa) >> LOW_BITS)
    return (whole + (1 << (shift - LOW_BITS - 1))) >> (shift - LOW_BITS)
