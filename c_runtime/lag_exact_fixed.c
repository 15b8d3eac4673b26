#include "hystgen_runtime.h"

/* A lag of at most half a step as a block of the chain, in fixed point. The state is the output at
   the next sample if the input stays. */

/* Everything has settled at the input v. Returns the output. */
static int64_t hystgen_lag_exact_rest(const hystgen_lag_exact_table_t *t, hystgen_lag_exact_t *self,
                                      int64_t v) {
    self->next = v * ((int64_t)1 << t->bits);
    self->before = v;
    return v;
}

/* The input that leads to the output y at this sample. */
static int64_t hystgen_lag_exact_solve(const hystgen_lag_exact_table_t *t,
                                       const hystgen_lag_exact_t *self, int64_t y) {
    const int64_t more = y * ((int64_t)1 << t->bits) - self->next;
    return self->before + hystgen_times(more >> t->drop, &t->inverse_late);
}

/* The input is v at this sample. Returns the output. */
HYSTGEN_APART int64_t hystgen_lag_exact_absorb(const hystgen_lag_exact_table_t *t,
                                               hystgen_lag_exact_t *self, int64_t v) {
    const int64_t reached = self->next + hystgen_times(v - self->before, &t->late);
    const int64_t more = v * ((int64_t)1 << t->bits) - reached;
    self->next = reached + hystgen_times(more >> t->drop, &t->rate);
    self->before = v;
    return hystgen_nearest(reached, t->bits);
}
