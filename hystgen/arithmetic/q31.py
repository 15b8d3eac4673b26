"""Fixed point in 32 bits."""

from hystgen.arithmetic.description import Arithmetic

Q31 = Arithmetic(
    "q31", "q31", "int32_t", "int32", "int64", 4, finer="float64", fixed=True, reach="int64_t", reach_bytes=8,
    code_bits=31, degree=5, play_bits=30, low_bits=32,
)  # fmt: skip
