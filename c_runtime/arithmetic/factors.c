/* Products of signals with non-integer constants. Called by all blocks. */
#ifndef HYSTGEN_ARITHMETIC_FACTORS_C
#define HYSTGEN_ARITHMETIC_FACTORS_C
#include "compensator/chain/model.h"

#ifdef HYSTGEN_FIXED
/* Bits of the lower part of a number, which is multiplied separately. */
#define HYSTGEN_LOW_PART 20u

/* x times a factor, to the nearest integer; |x| < 2^51, a shift is 21 to 82. */
static int64_t hystgen_times(int64_t x, const hystgen_factor_t *f) {
    const int32_t high = (int32_t)(x >> HYSTGEN_LOW_PART);
    const int32_t low = (int32_t)(x & (((int64_t)1 << HYSTGEN_LOW_PART) - 1));
    const int64_t whole =
        (int64_t)high * f->mantissa + (((int64_t)low * f->mantissa) >> HYSTGEN_LOW_PART);
    return ((whole >> (f->shift - HYSTGEN_LOW_PART - 1u)) + 1) >> 1;
}

/* The same for |x| < 2^32, whose product with a mantissa fits 64 bits. */
static int64_t hystgen_short_times(int64_t x, const hystgen_factor_t *f) {
    return (((x * f->mantissa) >> (f->shift - 1u)) + 1) >> 1;
}
#else
/* x times a factor. */
static inline hystgen_signal_t hystgen_times(hystgen_signal_t x, const hystgen_factor_t *f) {
    return *f * x;
}
#endif

#endif
