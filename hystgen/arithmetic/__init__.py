"""The arithmetics in which compensators can be emitted; each is an object with everything specific to it."""

from hystgen.arithmetic.description import Arithmetic
from hystgen.arithmetic.fixed import Fixed
from hystgen.arithmetic.float32 import FLOAT32
from hystgen.arithmetic.float64 import FLOAT64
from hystgen.arithmetic.floating import Floating
from hystgen.arithmetic.q15 import Q15
from hystgen.arithmetic.q31 import Q31

FLOATING = {each.name: each for each in (FLOAT32, FLOAT64)}
FIXED = {each.name: each for each in (Q31, Q15)}
ARITHMETICS: dict[str, Arithmetic] = {**FLOATING, **FIXED}
"""All arithmetics by name, in the order in which messages list them."""

__all__ = [
    "ARITHMETICS", "FIXED", "FLOAT32", "FLOAT64", "FLOATING", "Q15", "Q31", "Arithmetic", "Fixed", "Floating",
]
