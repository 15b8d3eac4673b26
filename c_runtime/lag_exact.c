#include "hystgen_runtime.h"

/* A lag of at most half a step as a block of the chain: its inverse fades within a few samples. */

/* Everything has settled at the input v. Returns the output. */
static hystgen_real_t hystgen_lag_exact_rest(hystgen_lag_exact_t *self, hystgen_real_t v) {
    self->reached = v;
    self->before = v;
    return v;
}

/* The input that leads to the output y at this sample. */
static hystgen_real_t hystgen_lag_exact_solve(const hystgen_lag_exact_table_t *t,
                                              const hystgen_lag_exact_t *self, hystgen_real_t y) {
    const hystgen_real_t ahead =
        self->reached + (t->early * self->before - t->rate * self->reached);
    return (y - ahead) * t->inverse_late;
}

/* The input is v at this sample. Returns the output. */
static hystgen_real_t hystgen_lag_exact_absorb(const hystgen_lag_exact_table_t *t,
                                               hystgen_lag_exact_t *self, hystgen_real_t v) {
    const hystgen_real_t reached = self->reached;
    self->reached = reached + ((t->early * self->before + t->late * v) - t->rate * reached);
    self->before = v;
    return self->reached;
}
