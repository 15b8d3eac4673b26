"""Double precision (IEEE 754 binary64)."""

from hystgen.arithmetic.description import Arithmetic

FLOAT64 = Arithmetic("float64", "f64", "double", "float64", "float64", 8, float_h="DBL")
