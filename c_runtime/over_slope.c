#include "hystgen_runtime.h"

#if (-1 >> 1) != -1
#error "right shifts of negative numbers have to keep the sign"
#endif

/* Down to a whole number: reaches the same whole numbers that x reaches twice. */
static hystgen_sum_t hystgen_half(hystgen_sum_t x)
{
    return x >> 1;
}

/* a times b. Cores without a long multiplication take half words, which is what they can do without a call. */
HYSTGEN_API uint64_t hystgen_wide(uint32_t a, uint32_t b)
{
#if defined(__ARM_ARCH_6M__) || defined(__ARM_ARCH_8M_BASE__)
    const uint32_t low = (a & 0xffffu) * (b & 0xffffu);
    const uint32_t one = (a >> 16) * (b & 0xffffu) + (low >> 16);
    const uint32_t other = (a & 0xffffu) * (b >> 16) + (one & 0xffffu);
    return (uint64_t)((a >> 16) * (b >> 16) + (one >> 16) + (other >> 16)) << 32 | (other << 16 | (low & 0xffffu));
#else
    return (uint64_t)a * b;
#endif
}

/* d / slope[k] to the nearest whole number, d not negative: the upper bits of d times the reciprocal. */
static hystgen_sum_t hystgen_over_slope(const hystgen_tables_t *t, hystgen_sum_t d, unsigned int k)
{
    const uint32_t r = t->reciprocal[k];
    const uint64_t low = hystgen_wide((uint32_t)d, r) >> 32;
    const uint64_t quotient = hystgen_wide((uint32_t)((uint64_t)d >> 32), r) + low;
    return (hystgen_sum_t)(((quotient >> (t->shift[k] - 1u)) + 1u) >> 1);
}

/* The input of the plays that lies d further on in output than w, kept near the range of the plays' input. */
static hystgen_reach_t hystgen_going(const hystgen_tables_t *t, hystgen_reach_t w, hystgen_sum_t d, unsigned int k,
                                     bool rising)
{
    const hystgen_sum_t step = hystgen_over_slope(t, d, k);
    if (rising) {
        return step > (hystgen_sum_t)t->most - w ? t->most : (hystgen_reach_t)(w + step);
    }
    return step > (hystgen_sum_t)w - t->least ? t->least : (hystgen_reach_t)(w - step);
}
