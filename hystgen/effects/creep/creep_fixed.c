/* Creep as a block of the chain, in fixed point. A state holds its contribution at the next sample
   for an unchanged input; part of an input change takes effect at once: the block is exactly
   invertible. Bits below those of a signal keep the slowest state from stalling. Called by the
   functions that emission writes for a chain, see compensator/chain/model.h. */
#include "arithmetic/fixed.h"
#include "compensator/chain/model.h"
#include "arithmetic/factors.c"

/* Settles everything at the input x. Returns the output. */
HYSTGEN_APART int64_t hystgen_creep_rest(const hystgen_creep_table_t *t, hystgen_creep_t *self,
                                         hystgen_creep_state_t *state, int64_t x) {
    int64_t sum = 0;
    unsigned int i;
    for (i = 0; i < t->n; ++i) {
        state[i].next = hystgen_times(x, &t->term[i].weight) * ((int64_t)1 << t->bits);
        sum += state[i].next;
    }
    self->before = x;
    self->ahead = hystgen_times(x, &t->direct) + hystgen_nearest(sum, t->bits);
    return self->ahead;
}

/* The input for the settled output y. */
static int64_t hystgen_creep_resting(const hystgen_creep_table_t *t, int64_t y) {
    return hystgen_times(y, &t->inverse_rest);
}

/* The input for the output y at this sample. */
static int64_t hystgen_creep_solve(const hystgen_creep_table_t *t, const hystgen_creep_t *self,
                                   int64_t y) {
    return self->before + hystgen_times(y - self->ahead, &t->inverse_slope);
}

/* Advances the states to the next sample; `ahead` is their sum at this one. Returns the output. */
HYSTGEN_APART int64_t hystgen_creep_next(const hystgen_creep_table_t *t, hystgen_creep_t *self,
                                         hystgen_creep_state_t *state) {
    int64_t next = 0;
    unsigned int i;
    for (i = 0; i < t->n; ++i) {
        const hystgen_creep_term_t *term = &t->term[i];
        const int64_t settled =
            hystgen_times(self->before, &term->weight) * ((int64_t)1 << t->bits);
        state[i].next += hystgen_times((settled - state[i].next) >> t->drop, &term->rate);
        next += state[i].next;
    }
    const int64_t direct = hystgen_times(self->before, &t->direct);
    const int64_t y = direct + self->ahead;
    self->ahead = direct + hystgen_nearest(next, t->bits);
    return y;
}

/* Takes the input x at this sample. Returns the output. Two short functions, the first of which
   ends with a call of the second, need less stack than a long one. */
HYSTGEN_APART int64_t hystgen_creep_absorb(const hystgen_creep_table_t *t, hystgen_creep_t *self,
                                           hystgen_creep_state_t *state, int64_t x) {
    const int64_t change = x - self->before;
    int64_t now = 0;
    unsigned int i;
    self->before = x;
    for (i = 0; i < t->n; ++i) {
        const hystgen_creep_term_t *term = &t->term[i];
        state[i].next += hystgen_times(change, &term->late) * ((int64_t)1 << term->lift);
        now += state[i].next;
    }
    self->ahead = hystgen_nearest(now, t->bits);
    return hystgen_creep_next(t, self, state);
}
