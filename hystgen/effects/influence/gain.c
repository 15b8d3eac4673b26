/* Gain and offset after the plays, set by the value of a column, at once and along a line. Called
   by the functions that emission writes for a chain, see compensator/chain/model.h. */
#ifndef HYSTGEN_INFLUENCE_GAIN_C
#define HYSTGEN_INFLUENCE_GAIN_C
#include "compensator/chain/model.h"
#include "effects/gains.c"

static void hystgen_gain_init(hystgen_gain_t *self) {
    self->gain = (hystgen_narrow_t)HYSTGEN_GAIN_ONE;
    self->inverse = (hystgen_narrow_t)HYSTGEN_GAIN_ONE;
    self->offset = 0;
}

/* How far a column is above its reference, and whether its value had to be limited. */
static hystgen_signal_t hystgen_gain_above(const hystgen_gain_table_t *t, hystgen_real_t value,
                                           bool *limited) {
#ifdef HYSTGEN_FIXED
    const hystgen_signal_t given = (hystgen_signal_t)value * ((int64_t)1 << t->bits);
#else
    const hystgen_signal_t given = value;
#endif
    hystgen_signal_t inside;
    if (given < t->lowest) {
        inside = t->lowest;
    } else if (given > t->highest) {
        inside = t->highest;
    } else {
        inside = given;
    }
    *limited = inside < given || inside > given;
    return inside - t->reference;
}

/* Follows a column along a line, but for the reciprocal of the gain. Returns whether the gain had
   to be limited. */
static bool hystgen_gain_line(const hystgen_gain_table_t *t, hystgen_gain_t *self,
                              hystgen_signal_t above) {
    const hystgen_signal_t wanted = HYSTGEN_GAIN_ONE + hystgen_times(above, &t->per_unit);
    self->offset = hystgen_times(above, &t->offset_per_unit);
    self->gain = hystgen_gain_inside(wanted);
    return self->gain < wanted || self->gain > wanted;
}

/* Sets gain and offset by the value of a column. Returns whether one of them had to be limited. */
static bool hystgen_gain_set(const hystgen_gain_table_t *t, hystgen_gain_t *self,
                             hystgen_real_t value) {
    bool limited = false;
    const hystgen_signal_t above = hystgen_gain_above(t, value, &limited);
    limited = hystgen_gain_line(t, self, above) || limited;
    self->inverse = hystgen_gain_reciprocal(self->gain);
    return limited;
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
