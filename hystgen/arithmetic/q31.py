"""Fixed point in 32 bits."""

from hystgen.arithmetic.fixed import Fixed

Q31 = Fixed(
    "q31", "q31", "int32_t", "int32", 4, finer="float64", reach="int64_t", code_bits=31, degree=5, play_bits=30,
    low_bits=32,
)
