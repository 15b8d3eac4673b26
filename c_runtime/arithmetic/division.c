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
