/* Gain and offset after the plays, set by a temperature. Called by
   the functions that emission writes for a chain, see compensator/chain/model.h. */
#ifndef HYSTGEN_THERMAL_GAIN_C
#define HYSTGEN_THERMAL_GAIN_C
#include "compensator/chain/model.h"
#include "effects/gains.c"

static void hystgen_gain_init(hystgen_gain_t *self) {
    self->gain = (hystgen_narrow_t)HYSTGEN_GAIN_ONE;
    self->inverse = (hystgen_narrow_t)HYSTGEN_GAIN_ONE;
    self->offset = 0;
}

/* Sets gain and offset by a temperature. Returns whether one of them had to be limited. */
static bool hystgen_gain_heat(const hystgen_gain_table_t *t, hystgen_gain_t *self,
                              hystgen_real_t temperature) {
#ifdef HYSTGEN_FIXED
    const hystgen_signal_t given = (hystgen_signal_t)temperature * ((int64_t)1 << t->bits);
#else
    const hystgen_signal_t given = temperature;
#endif
    hystgen_signal_t inside;
    if (given < t->coldest) {
        inside = t->coldest;
    } else if (given > t->hottest) {
        inside = t->hottest;
    } else {
        inside = given;
    }
    const hystgen_signal_t above = inside - t->reference;
    const hystgen_signal_t wanted = HYSTGEN_GAIN_ONE + hystgen_times(above, &t->per_degree);
    self->offset = hystgen_times(above, &t->offset_per_degree);
    self->gain = hystgen_gain_inside(wanted);
    self->inverse = hystgen_gain_reciprocal(self->gain);
    return self->gain < wanted || self->gain > wanted || inside < given || inside > given;
}

/* The input for the output y. */
static hystgen_signal_t hystgen_gain_solve(const hystgen_gain_t *self, hystgen_signal_t y) {
    return hystgen_gain_times(y - self->offset, self->inverse);
}

/* The output for the input x. */
static hystgen_signal_t hystgen_gain_absorb(const hystgen_gain_t *self, hystgen_signal_t x) {
    return hystgen_gain_times(x, self->gain) + self->offset;
}

#endif
