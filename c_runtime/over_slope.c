#include "hystgen_runtime.h"

#if (-1 >> 1) != -1
#error "right shifts of negative numbers have to keep the sign"
#endif

/* Down to a whole number: reaches the same whole numbers that x reaches twice. */
static hystgen_sum_t hystgen_half(hystgen_sum_t x)
{
    return x >> 1;
}

/* d / slope[k] to the nearest whole number, d not negative: the upper bits of d times the reciprocal. */
static hystgen_sum_t hystgen_over_slope(const hystgen_tables_t *t, hystgen_sum_t d, unsigned int k)
{
    const uint32_t r = t->reciprocal[k];
    const uint64_t low = ((uint64_t)(uint32_t)d * r) >> 32;
    const uint64_t quotient = (uint64_t)(uint32_t)((uint64_t)d >> 32) * r + low;
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
