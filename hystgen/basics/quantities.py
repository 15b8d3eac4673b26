"""Numbers of a parameter file: pydantic types, and exact values."""

from __future__ import annotations

from fractions import Fraction
from typing import Annotated

from pydantic import AfterValidator, Field

MAX_PLAYS = 4096
"""Maximum number of plays in a model, not counting r_0. A model with this many takes 66 kB of tables and 66 kB of RAM
in float32, and 4.8 s of processor time in `hystgen show`, 2.7 s in `emit`, for `density: {formula: "0.8*exp(-0.3*r)",
p0: 0.7, r_max: 10, n: 4096}`."""

MAX_NUMBER = 1e30
"""Maximum magnitude of a number, in the number's own unit. The sum of `MAX_PLAYS` weights of this magnitude, 4.1e33,
fits float32 (up to 3.4e38), and the product of ten such numbers fits double (up to 1.8e308); `hystgen show` still
bounds the error of every arithmetic."""


def _float(value: float) -> float:
    return float(value) + 0.0  # a plain float, and 0.0 for -0.0: equal models have equal canonical texts


Number = Annotated[float, Field(ge=-MAX_NUMBER, le=MAX_NUMBER, allow_inf_nan=False), AfterValidator(_float)]
Positive = Annotated[float, Field(gt=0, le=MAX_NUMBER, allow_inf_nan=False), AfterValidator(_float)]
NotNegative = Annotated[float, Field(ge=0, le=MAX_NUMBER, allow_inf_nan=False), AfterValidator(_float)]


def decimal(x: float) -> Fraction:
    """The exact value of the number as written: 0.001 is exactly a thousandth, which no double is."""
    return Fraction(repr(float(x)))
