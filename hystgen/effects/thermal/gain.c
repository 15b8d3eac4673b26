/* Gain and offset after the plays, set from outside. Called by the functions that emission writes
   for a chain, see compensator/chain/model.h. */
#include "compensator/chain/model.h"

static void hystgen_gain_init(hystgen_gain_t *self) {
    self->gain = 1;
    self->inverse = 1;
    self->offset = 0;
}

/* Sets the gain. Returns whether it had to be limited. */
static bool hystgen_gain_set(const hystgen_gain_table_t *t, hystgen_gain_t *self,
                             hystgen_real_t gain) {
    hystgen_real_t inside;
    if (gain < t->least) {
        inside = t->least;
    } else if (gain > t->largest) {
        inside = t->largest;
    } else {
        inside = gain;
    }
    self->gain = inside;
    self->inverse = 1 / inside;
    return inside < gain || inside > gain;
}

/* Sets gain and offset by a temperature. Returns whether one of them had to be limited. */
static bool hystgen_gain_heat(const hystgen_gain_table_t *t, hystgen_gain_t *self,
                              hystgen_real_t temperature) {
    hystgen_real_t inside;
    if (temperature < t->coldest) {
        inside = t->coldest;
    } else if (temperature > t->hottest) {
        inside = t->hottest;
    } else {
        inside = temperature;
    }
    const hystgen_real_t above = inside - t->reference;
    self->offset = t->offset_per_degree * above;
    return hystgen_gain_set(t, self, 1 + t->per_degree * above) || inside < temperature ||
           inside > temperature;
}

/* The input for the output y. */
static hystgen_real_t hystgen_gain_solve(const hystgen_gain_t *self, hystgen_real_t y) {
    return (y - self->offset) * self->inverse;
}

/* The output for the input x. */
static hystgen_real_t hystgen_gain_absorb(const hystgen_gain_t *self, hystgen_real_t x) {
    return self->gain * x + self->offset;
}
