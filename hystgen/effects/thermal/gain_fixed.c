/* Gain and offset behind the plays, set from outside, in fixed point. Called by the functions that
   emission writes for a chain, see compensator/chain/model.h. Heat and ageing take its reciprocal
   from here. */
#ifndef HYSTGEN_THERMAL_GAIN_FIXED_C
#define HYSTGEN_THERMAL_GAIN_FIXED_C
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

/* The same for a gain that has changed, by Newton steps from the reciprocal before. */
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

static void hystgen_gain_init(hystgen_gain_t *self) {
    self->gain = (int32_t)HYSTGEN_GAIN_ONE;
    self->inverse = (int32_t)HYSTGEN_GAIN_ONE;
    self->offset = 0;
}

/* Sets gain and offset by a temperature. Returns whether one of them had to be limited. */
static bool hystgen_gain_heat(const hystgen_gain_table_t *t, hystgen_gain_t *self,
                              hystgen_real_t temperature) {
    const int64_t given = (int64_t)temperature * ((int64_t)1 << t->bits);
    int64_t inside;
    if (given < t->coldest) {
        inside = t->coldest;
    } else if (given > t->hottest) {
        inside = t->hottest;
    } else {
        inside = given;
    }
    const int64_t above = inside - t->reference;
    const int64_t wanted = HYSTGEN_GAIN_ONE + hystgen_times(above, &t->per_degree);
    self->offset = hystgen_times(above, &t->offset_per_degree);
    self->gain = hystgen_gain_inside(wanted);
    self->inverse = hystgen_gain_reciprocal(self->gain);
    return self->gain != wanted || inside != given;
}

/* The input that gives the output y. */
static int64_t hystgen_gain_solve(const hystgen_gain_t *self, int64_t y) {
    return hystgen_gain_times(y - self->offset, self->inverse);
}

/* The output for the input x. */
static int64_t hystgen_gain_absorb(const hystgen_gain_t *self, int64_t x) {
    return hystgen_gain_times(x, self->gain) + self->offset;
}

#endif
