"""Double precision (IEEE 754 binary64)."""

from hystgen.arithmetic.floating import Floating

FLOAT64 = Floating("float64", "f64", "double", "float64", 8, float_h="DBL")
