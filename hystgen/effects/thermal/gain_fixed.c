/* Gain and offset after the plays, set from outside, in fixed point. Called by the functions that
   emission writes for a chain, see compensator/chain/model.h. */
#include "effects/gains.c"

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

/* The input for the output y. */
static int64_t hystgen_gain_solve(const hystgen_gain_t *self, int64_t y) {
    return hystgen_gain_times(y - self->offset, self->inverse);
}

/* The output for the input x. */
static int64_t hystgen_gain_absorb(const hystgen_gain_t *self, int64_t x) {
    return hystgen_gain_times(x, self->gain) + self->offset;
}
