"""The arithmetics that compensators are emitted in."""

ARITHMETICS = ("float32", "float64", "q31", "q15")
FLOAT_ARITHMETICS = ("float32", "float64")
