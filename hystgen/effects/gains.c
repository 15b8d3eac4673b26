/* Gains after the plays and their reciprocals, in fixed point. Called by effects with a gain. */
#ifndef HYSTGEN_GAINS_C
#define HYSTGEN_GAINS_C
#include "arithmetic/fixed.h"
#include "compensator/chain/model.h"
#include "arithmetic/factors.c"

/* Fraction bits of a gain, the gain 1, and the limits of a gain. */
#define HYSTGEN_GAIN_BITS 29u
#define HYSTGEN_GAIN_ONE ((int64_t)1 << HYSTGEN_GAIN_BITS)
#define HYSTGEN_GAIN_LEAST (HYSTGEN_GAIN_ONE / 2)
#define HYSTGEN_GAIN_LARGEST (HYSTGEN_GAIN_ONE * 2)

/* A gain within its limits. */
static int32_t hystgen_gain_inside(int64_t gain) {
    if (gain < HYSTGEN_GAIN_LEAST) {
        return (int32_t)HYSTGEN_GAIN_LEAST;
    }
    if (gain > HYSTGEN_GAIN_LARGEST) {
        return (int32_t)HYSTGEN_GAIN_LARGEST;
    }
    return (int32_t)gain;
}

/* The reciprocal of a gain within its limits. */
static int32_t hystgen_gain_reciprocal(int32_t gain) {
    return (int32_t)((((int64_t)1 << 2u * HYSTGEN_GAIN_BITS) + gain / 2) / gain);
}

/* The same for a gain that has changed, by Newton steps from the previous reciprocal. */
static int32_t hystgen_gain_followed(int32_t gain, int32_t before, unsigned int turns) {
    const int64_t half = (int64_t)1 << (HYSTGEN_GAIN_BITS - 1u);
    int64_t inverse = before;
    unsigned int i;
    for (i = 0; i < turns; ++i) {
        const int64_t product = (gain * inverse + half) >> HYSTGEN_GAIN_BITS;
        const int64_t more = 2 * HYSTGEN_GAIN_ONE - product;
        inverse = (inverse * more + half) >> HYSTGEN_GAIN_BITS;
    }
    return (int32_t)inverse;
}

/* x times a gain. */
static int64_t hystgen_gain_times(int64_t x, int32_t gain) {
    const hystgen_factor_t f = {gain, HYSTGEN_GAIN_BITS};
    return hystgen_times(x, &f);
}

#endif
