"""Fixed point in 16 bits."""

from hystgen.arithmetic.fixed import Fixed

Q15 = Fixed(
    "q15", "q15", "int16_t", "int16", 2, finer="q31", reach="int32_t", code_bits=15, degree=3, finer_plays=True,
    play_bits=26, low_bits=16,
)
