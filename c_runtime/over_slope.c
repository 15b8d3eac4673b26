#include "hystgen_runtime.h"

#if (-1 >> 1) != -1
#error "right shifts of negative numbers have to keep the sign"
#endif

/* a times b. Cores without a long multiplication take half words, which is what they can do without
 * a call. */
HYSTGEN_API uint64_t hystgen_wide(uint32_t a, uint32_t b)
{
#if defined(__ARM_ARCH_6M__) || defined(__ARM_ARCH_8M_BASE__)
    const uint32_t low = (a & 0xffffu) * (b & 0xffffu);
    const uint32_t one = (a >> 16) * (b & 0xffffu) + (low >> 16);
    const uint32_t other = (a & 0xffffu) * (b >> 16) + (one & 0xffffu);
    return (uint64_t)((a >> 16) * (b >> 16) + (one >> 16) + (other >> 16)) << 32 |
           (other << 16 | (low & 0xffffu));
#else
    return (uint64_t)a * b;
#endif
}

/* d / slope to the nearest whole number, d not negative: the upper bits of d times the reciprocal
   2^(32 + shift) / slope. A slope is at least 16, so that `shift` is 2 .. 29. */
HYSTGEN_API int64_t hystgen_over_slope(int64_t d, uint32_t reciprocal, unsigned int shift)
{
    const uint64_t low = hystgen_wide((uint32_t)d, reciprocal) >> 32;
    const uint64_t quotient = hystgen_wide((uint32_t)((uint64_t)d >> 32), reciprocal) + low;
    const uint32_t high = (uint32_t)(quotient >> 32);
    const uint32_t whole =
        (high & (((uint32_t)1 << shift) - 1u)) << (32u - shift) | (uint32_t)quotient >> shift;
    return (int64_t)(((uint64_t)(high >> shift) << 32 | whole) +
                     ((uint32_t)quotient >> (shift - 1u) & 1u));
}
