"""Gains behind the plays that vary: their limits, and in fixed point their reciprocals, as in `gains.c`."""

from __future__ import annotations

import itertools

from hystgen.basics.jit import jit

LEAST_GAIN, LARGEST_GAIN = 0.5, 2.0
"""[times] A gain is kept between these: a gain beyond them that the caller sets is due to a faulty sensor or a wrong
unit. Set by fixed point: with `GAIN_BITS` fraction bits, 2 is the limit of a gain and of its reciprocal."""

MOST_CHANGE = 0.25
"""[share of the gain] The largest change of a gain in one sample that the C follows: five Newton steps from the last
reciprocal leave `0.25^32`, less than the rounding of double precision. A limit of 0.5 would take six steps in every
sample, a limit of 0.9 nine. Set by: benchmarks/chosen_numbers.py newton."""

GAIN_BITS = 29
"""Fraction bits of a gain in fixed point: 2 is the largest, and mantissas have 31."""

ONE = 1 << GAIN_BITS
LEAST, LARGEST = int(LEAST_GAIN * ONE), int(LARGEST_GAIN * ONE)

RECIPROCAL_ERROR = 4.0 * 2.0**-GAIN_BITS
"""[share of the signal] Error of the reciprocal of a gain of at least 1/2 that is off by its last bit: twice the gain's
error, plus that of a Newton step."""


def too_fast(change: float) -> str:
    """Why the C cannot follow a gain that changes by a share `change` in one move over the range."""
    return f"its gain changes by {100.0 * change:.3g} % in one move over the range, more than {MOST_CHANGE:.0%}"


def newton_steps(change: float, roundoff: float) -> int:
    """Newton steps that make the reciprocal exact up to rounding after the gain has changed by a share `change`."""
    left = max(change, 1e-9)
    return next(n for n in itertools.count(1) if left ** (2**n) < roundoff)


# ---------------------------------------------------------------- gains.c


@jit
def reciprocal(gain: int) -> int:
    """1 over a gain."""
    return ((1 << (2 * GAIN_BITS)) + (gain >> 1)) // gain


@jit
def followed(gain: int, before: int, turns: int) -> int:
    """The reciprocal of a gain that has changed, by Newton steps from the previous reciprocal."""
    half = 1 << (GAIN_BITS - 1)
    inverse = before
    for _ in range(turns):
        product = (gain * inverse + half) >> GAIN_BITS
        inverse = (inverse * (2 * ONE - product) + half) >> GAIN_BITS
    return inverse
