/* A lag of at most half a step as a block of the chain: its inverse decays within a few samples. In
   fixed point the state is the output at the next sample for an unchanged input. Called by the
   functions that emission writes for a chain, see compensator/chain/model.h. */
#include "compensator/chain/model.h"
#ifdef HYSTGEN_FIXED
#include "arithmetic/factors.c"
#endif

#ifdef HYSTGEN_FIXED
/* Settles everything at the input v. Returns the output. */
static int64_t hystgen_lag_exact_rest(const hystgen_lag_exact_table_t *t, hystgen_lag_exact_t *self,
                                      int64_t v) {
    self->next = v * ((int64_t)1 << t->bits);
    self->before = v;
    return v;
}

/* The input for the output y at this sample. */
static int64_t hystgen_lag_exact_solve(const hystgen_lag_exact_table_t *t,
                                       const hystgen_lag_exact_t *self, int64_t y) {
    const int64_t more = y * ((int64_t)1 << t->bits) - self->next;
    return self->before + hystgen_times(more >> t->drop, &t->inverse_late);
}

/* Takes the input v at this sample. Returns the output. */
HYSTGEN_APART int64_t hystgen_lag_exact_absorb(const hystgen_lag_exact_table_t *t,
                                               hystgen_lag_exact_t *self, int64_t v) {
    const int64_t reached = self->next + hystgen_times(v - self->before, &t->late);
    const int64_t more = v * ((int64_t)1 << t->bits) - reached;
    self->next = reached + hystgen_times(more >> t->drop, &t->rate);
    self->before = v;
    return hystgen_nearest(reached, t->bits);
}
#else
/* Settles everything at the input v. Returns the output. */
static hystgen_real_t hystgen_lag_exact_rest(const hystgen_lag_exact_table_t *t,
                                             hystgen_lag_exact_t *self, hystgen_real_t v) {
    (void)t; /* read in fixed point */
    self->reached = v;
    self->before = v;
    return v;
}

/* The input for the output y at this sample. */
static hystgen_real_t hystgen_lag_exact_solve(const hystgen_lag_exact_table_t *t,
                                              const hystgen_lag_exact_t *self, hystgen_real_t y) {
    const hystgen_real_t ahead =
        self->reached + (t->early * self->before - t->rate * self->reached);
    return (y - ahead) * t->inverse_late;
}

/* Takes the input v at this sample. Returns the output. */
static hystgen_real_t hystgen_lag_exact_absorb(const hystgen_lag_exact_table_t *t,
                                               hystgen_lag_exact_t *self, hystgen_real_t v) {
    const hystgen_real_t reached = self->reached;
    self->reached = reached + ((t->early * self->before + t->late * v) - t->rate * reached);
    self->before = v;
    return self->reached;
}
#endif
