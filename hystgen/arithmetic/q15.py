"""Fixed point in 16 bits."""

from hystgen.arithmetic.description import Arithmetic

Q15 = Arithmetic(
    "q15", "q15", "int16_t", "int16", "int64", 2, finer="q31", fixed=True, reach="int32_t", reach_bytes=4,
    code_bits=15, degree=3, finer_plays=True, play_bits=26, low_bits=16,
)  # fmt: skip
