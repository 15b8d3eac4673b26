/* A lag as a block of the chain. The inverse of a lag whose drive is interpolated between samples
   rings; the inverse of x, the response to a zero-order-hold drive, does not. The output is x minus
   theta of its last step, so x is led beyond the requested output by theta of the output's step:
   exact on ramps. Called by the functions that emission writes for a chain, see
   compensator/chain/model.h. */
#ifndef HYSTGEN_LAG_LAG_C
#define HYSTGEN_LAG_LAG_C
#include "compensator/chain/model.h"

/* Settles everything at the input v. Returns the output. */
static hystgen_real_t hystgen_lag_rest(hystgen_lag_t *self, hystgen_real_t v) {
    self->high = v;
    self->low = 0;
    self->wanted = v;
    self->asked = v;
    self->answer = v;
    return v;
}

/* The input for the output y at this sample. */
static hystgen_real_t hystgen_lag_solve(const hystgen_lag_table_t *t, hystgen_lag_t *self,
                                        hystgen_real_t y) {
    const hystgen_real_t goal = y + t->theta * (y - self->wanted);
    self->asked = y;
    self->answer = self->high + (goal - self->high) * t->inverse_rate;
    return self->answer;
}

/* Takes the input v at this sample. Returns the output. */
static hystgen_real_t hystgen_lag_absorb(const hystgen_lag_table_t *t, hystgen_lag_t *self,
                                         hystgen_real_t v) {
    const hystgen_real_t high = self->high;
    const hystgen_real_t change = t->rate * (v - high) + self->low;
    const hystgen_real_t next = high + change;
    self->high = next;
    self->low = change - (next - high); /* rounding remainder of the sum */
    self->wanted = self->asked + t->late * (v - self->answer);
    return next - t->theta * (next - high);
}

#endif
