/* Long products and quotients without library calls, for dividing an output by a slope to get an
   input. Called by the plays of both engines in fixed point. */
#include "arithmetic/fixed.h"
#include "hystgen_runtime.h"

/* Bits of a word and of half a word, and the mask of the lower half. */
#define HYSTGEN_WORD 32u
#define HYSTGEN_HALF_WORD 16u
#define HYSTGEN_LOW_HALF 0xffffu

/* a times b; cores without a long multiplication use half words instead of a library call. */
HYSTGEN_API uint64_t hystgen_wide(uint32_t a, uint32_t b) {
#if defined(__ARM_ARCH_6M__) || defined(__ARM_ARCH_8M_BASE__)
    const uint32_t low = (a & HYSTGEN_LOW_HALF) * (b & HYSTGEN_LOW_HALF);
    const uint32_t one =
        (a >> HYSTGEN_HALF_WORD) * (b & HYSTGEN_LOW_HALF) + (low >> HYSTGEN_HALF_WORD);
    const uint32_t other =
        (a & HYSTGEN_LOW_HALF) * (b >> HYSTGEN_HALF_WORD) + (one & HYSTGEN_LOW_HALF);
    return (uint64_t)((a >> HYSTGEN_HALF_WORD) * (b >> HYSTGEN_HALF_WORD) +
                      (one >> HYSTGEN_HALF_WORD) + (other >> HYSTGEN_HALF_WORD))
               << HYSTGEN_WORD |
           (other << HYSTGEN_HALF_WORD | (low & HYSTGEN_LOW_HALF));
#else
    return (uint64_t)a * b;
#endif
}

/* The lower 31 bits; no argument has any bits above them. */
static inline uint32_t hystgen_low_31(uint64_t x) {
    return (uint32_t)x & 0x7fffffffu;
}

/* x > 0 as a mantissa of 31 bits. Returns the number of bits by which it is shifted up, before
   its upper word is taken. */
static unsigned int hystgen_mantissa(uint64_t x, uint32_t *mantissa) {
    unsigned int raised = 0;
    unsigned int bits;
    for (bits = HYSTGEN_WORD; bits > 0; bits /= 2u) {
        if (x >> (2u * HYSTGEN_WORD - 1u - bits) == 0) {
            x = (x & (~(uint64_t)0 >> bits)) << bits;
            raised |= bits;
        }
    }
    *mantissa = hystgen_low_31(x >> HYSTGEN_WORD);
    return raised;
}

/* 2^bits x / y to a part in 2^28 and to the nearest integer, for x >= 0 and y > 0 below 2^62; at
   least 2^59 where the exact quotient is larger. The reciprocal 2^61 / y begins with the line
   48/17 - 32/17 y, whose relative error is at most 1/17, and each step squares this error. */
HYSTGEN_API int64_t hystgen_quotient(int64_t x, int64_t y, unsigned int bits) {
    uint32_t number;
    uint32_t divisor;
    if (x == 0) {
        return 0;
    }
    const int raised = (int)hystgen_mantissa((uint64_t)x, &number);
    const int lifted = (int)hystgen_mantissa((uint64_t)y, &divisor);
    uint32_t rate = 3031741620u - (uint32_t)(hystgen_wide(divisor, 2021161080u) >> 31);
    unsigned int i;
    for (i = 0; i < 3u; ++i) {
        const uint32_t off = 0x80000000u - hystgen_low_31(hystgen_wide(divisor, rate) >> 31);
        rate = (uint32_t)(hystgen_wide(rate, off) >> 30);
    }
    const int shift = 60 + raised - lifted - (int)bits;
    if (shift > 62) {
        return 0;
    }
    return (int64_t)(((hystgen_wide(number, rate) >> (shift > 0 ? shift : 0)) + 1u) >> 1);
}

/* d / slope to the nearest integer, d >= 0: the upper bits of d times the reciprocal
   2^(32 + shift) / slope. A slope is at least 16, so `shift` is 2 .. 29. */
HYSTGEN_API int64_t hystgen_divide_by_slope(int64_t d, uint32_t reciprocal, unsigned int shift) {
    const uint64_t low = hystgen_wide((uint32_t)d, reciprocal) >> HYSTGEN_WORD;
    const uint64_t quotient =
        hystgen_wide((uint32_t)((uint64_t)d >> HYSTGEN_WORD), reciprocal) + low;
    const uint32_t high = (uint32_t)(quotient >> HYSTGEN_WORD);
    const uint32_t whole = (high & (((uint32_t)1 << shift) - 1u)) << (HYSTGEN_WORD - shift) |
                           (uint32_t)quotient >> shift;
    return (int64_t)(((uint64_t)(high >> shift) << HYSTGEN_WORD | whole) +
                     ((uint32_t)quotient >> (shift - 1u) & 1u));
}
