"""Single precision (IEEE 754 binary32)."""

from hystgen.arithmetic.description import Arithmetic

FLOAT32 = Arithmetic("float32", "f32", "float", "float32", "float32", 4, finer="float64", float_h="FLT")
