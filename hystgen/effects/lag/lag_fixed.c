/* A lag as a block of the chain, in fixed point: x, the response to a zero-order-hold drive, is led
   beyond the requested output by theta of the output's step, as in floating point. `lead` is the
   requested move of x, which gives the effect of an input other than the solution. Called by the
   functions that emission writes for a chain, see compensator/chain/model.h. */
#ifndef HYSTGEN_LAG_LAG_FIXED_C
#define HYSTGEN_LAG_LAG_FIXED_C
#include "arithmetic/fixed.h"
#include "compensator/chain/model.h"
#include "arithmetic/factors.c"

/* A number in units of the states times a factor. */
static int64_t hystgen_lag_scaled(const hystgen_lag_table_t *t, int64_t x,
                                  const hystgen_factor_t *f) {
    return hystgen_times(x >> t->drop, f);
}

/* Settles everything at the input v. Returns the output. */
static int64_t hystgen_lag_rest(const hystgen_lag_table_t *t, hystgen_lag_t *self, int64_t v) {
    self->high = v * ((int64_t)1 << t->bits);
    self->wanted = self->high;
    self->asked = self->high;
    self->lead = 0;
    return v;
}

/* The input for the output y at this sample. */
static int64_t hystgen_lag_solve(const hystgen_lag_table_t *t, hystgen_lag_t *self, int64_t y) {
    const int64_t asked = y * ((int64_t)1 << t->bits);
    self->lead = asked + hystgen_lag_scaled(t, asked - self->wanted, &t->theta) - self->high;
    self->asked = asked;
    return hystgen_nearest(self->high, t->bits) +
           hystgen_lag_scaled(t, self->lead, &t->inverse_rate);
}

/* Takes the input v at this sample. Returns the output. */
HYSTGEN_APART int64_t hystgen_lag_absorb(const hystgen_lag_table_t *t, hystgen_lag_t *self,
                                         int64_t v) {
    const int64_t given = v * ((int64_t)1 << t->bits);
    const int64_t change = hystgen_lag_scaled(t, given - self->high, &t->rate);
    const int64_t left = self->lead - change;
    self->high += change;
    self->wanted = self->asked - (left - hystgen_lag_scaled(t, left, &t->theta));
    self->lead -= hystgen_lag_scaled(t, change, &t->rate);
    return hystgen_nearest(self->high - hystgen_lag_scaled(t, change, &t->theta), t->bits);
}

#endif
