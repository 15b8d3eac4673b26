/* Gains after the plays and their reciprocals. Called by effects with a gain. */
#ifndef HYSTGEN_GAINS_C
#define HYSTGEN_GAINS_C
#include "compensator/chain/model.h"
#include "arithmetic/factors.c"

#ifdef HYSTGEN_FIXED
/* Fraction bits of a gain, and the gain 1. */
#define HYSTGEN_GAIN_BITS 29u
#define HYSTGEN_GAIN_ONE ((int64_t)1 << HYSTGEN_GAIN_BITS)

/* x times a gain. */
static int64_t hystgen_gain_times(int64_t x, int32_t gain) {
    const hystgen_factor_t f = {gain, HYSTGEN_GAIN_BITS};
    return hystgen_times(x, &f);
}

/* The product of two gains. */
static int64_t hystgen_gain_product(int64_t a, int64_t b) {
    return (a * b + ((int64_t)1 << (HYSTGEN_GAIN_BITS - 1u))) >> HYSTGEN_GAIN_BITS;
}

/* The reciprocal of a gain within its limits. */
static int32_t hystgen_gain_reciprocal(int32_t gain) {
    return (int32_t)((((int64_t)1 << 2u * HYSTGEN_GAIN_BITS) + gain / 2) / gain);
}
#else
/* The gain 1. */
#define HYSTGEN_GAIN_ONE ((hystgen_real_t)1)

/* x times a gain. */
static inline hystgen_real_t hystgen_gain_times(hystgen_real_t x, hystgen_real_t gain) {
    return gain * x;
}

/* The product of two gains. */
static inline hystgen_real_t hystgen_gain_product(hystgen_real_t a, hystgen_real_t b) {
    return a * b;
}

/* The reciprocal of a gain within its limits. */
static hystgen_real_t hystgen_gain_reciprocal(hystgen_real_t gain) {
    return 1 / gain;
}
#endif

/* Limits of a gain that is set from outside. */
#define HYSTGEN_GAIN_LEAST (HYSTGEN_GAIN_ONE / 2)
#define HYSTGEN_GAIN_LARGEST (HYSTGEN_GAIN_ONE * 2)

/* A gain within its limits. */
static hystgen_narrow_t hystgen_gain_inside(hystgen_signal_t gain) {
    if (gain < HYSTGEN_GAIN_LEAST) {
        return (hystgen_narrow_t)HYSTGEN_GAIN_LEAST;
    }
    if (gain > HYSTGEN_GAIN_LARGEST) {
        return (hystgen_narrow_t)HYSTGEN_GAIN_LARGEST;
    }
    return (hystgen_narrow_t)gain;
}

/* The reciprocal of a gain that has changed, by Newton steps from the previous reciprocal. */
static hystgen_narrow_t hystgen_gain_followed(hystgen_narrow_t gain, hystgen_narrow_t before,
                                              unsigned int turns) {
    hystgen_signal_t inverse = before;
    unsigned int i;
    for (i = 0; i < turns; ++i) {
        inverse = hystgen_gain_product(inverse,
                                       2 * HYSTGEN_GAIN_ONE - hystgen_gain_product(gain, inverse));
    }
    return (hystgen_narrow_t)inverse;
}

#endif
