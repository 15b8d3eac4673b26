"""Single precision (IEEE 754 binary32)."""

from hystgen.arithmetic.floating import Floating

FLOAT32 = Floating("float32", "f32", "float", "float32", 4, finer="float64", float_h="FLT")
