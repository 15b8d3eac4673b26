"""The arithmetics that compensators are emitted in, each an object that knows what is particular to it."""

from hystgen.arithmetic.description import Arithmetic
from hystgen.arithmetic.float32 import FLOAT32
from hystgen.arithmetic.float64 import FLOAT64
from hystgen.arithmetic.q15 import Q15
from hystgen.arithmetic.q31 import Q31

ARITHMETICS = {each.name: each for each in (FLOAT32, FLOAT64, Q31, Q15)}
"""By the names of the contract, in its order."""

__all__ = ["ARITHMETICS", "FLOAT32", "FLOAT64", "Q15", "Q31", "Arithmetic"]
