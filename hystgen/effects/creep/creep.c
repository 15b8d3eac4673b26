/* Creep as a block of the chain. Part of each state follows a move at once, so that the block is
   exactly invertible. In floating point a state holds its contribution to the next output for an
   input of 0, and `ahead` is the sum of the states; in fixed point the input does not change, so
   that a block at rest has no rounding errors, and bits below those of a signal keep the slowest
   state from stalling. Called by the functions that emission writes for a chain, see
   compensator/chain/model.h. */
#include "compensator/chain/model.h"
#include "arithmetic/factors.c"

/* The input for the settled output y. */
static hystgen_signal_t hystgen_creep_resting(const hystgen_creep_table_t *t, hystgen_signal_t y) {
    return hystgen_times(y, &t->inverse_rest);
}

#ifdef HYSTGEN_FIXED
/* Settles everything at the input x. Returns the output. */
HYSTGEN_APART hystgen_signal_t hystgen_creep_rest(const hystgen_creep_table_t *t,
                                                  hystgen_creep_t *self,
                                                  hystgen_creep_state_t *state,
                                                  hystgen_signal_t x) {
    hystgen_signal_t sum = 0;
    unsigned int i;
    for (i = 0; i < t->n; ++i) {
        state[i].next = hystgen_times(x, &t->term[i].weight) * ((int64_t)1 << t->bits);
        sum += state[i].next;
    }
    self->before = x;
    self->ahead = hystgen_times(x, &t->direct) + hystgen_nearest(sum, t->bits);
    return self->ahead;
}

/* The input for the output y at this sample. */
static hystgen_signal_t hystgen_creep_solve(const hystgen_creep_table_t *t,
                                            const hystgen_creep_t *self, hystgen_signal_t y) {
    return self->before + hystgen_times(y - self->ahead, &t->inverse_slope);
}

/* Advances the states to the next sample; `ahead` is their sum at this one. Returns the output. */
HYSTGEN_APART hystgen_signal_t hystgen_creep_next(const hystgen_creep_table_t *t,
                                                  hystgen_creep_t *self,
                                                  hystgen_creep_state_t *state) {
    hystgen_signal_t next = 0;
    unsigned int i;
    for (i = 0; i < t->n; ++i) {
        const hystgen_creep_term_t *term = &t->term[i];
        const hystgen_signal_t settled =
            hystgen_times(self->before, &term->weight) * ((int64_t)1 << t->bits);
        state[i].next += hystgen_times((settled - state[i].next) >> t->drop, &term->rate);
        next += state[i].next;
    }
    const hystgen_signal_t direct = hystgen_times(self->before, &t->direct);
    const hystgen_signal_t y = direct + self->ahead;
    self->ahead = direct + hystgen_nearest(next, t->bits);
    return y;
}

/* Takes the input x at this sample. Returns the output. Two short functions, the first of which
   ends with a call of the second, need less stack than a long one. */
HYSTGEN_APART hystgen_signal_t hystgen_creep_absorb(const hystgen_creep_table_t *t,
                                                    hystgen_creep_t *self,
                                                    hystgen_creep_state_t *state,
                                                    hystgen_signal_t x) {
    const hystgen_signal_t change = x - self->before;
    hystgen_signal_t now = 0;
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
#else
/* Settles everything at the input x. Returns the output. */
static hystgen_real_t hystgen_creep_rest(const hystgen_creep_table_t *t, hystgen_creep_t *self,
                                         hystgen_creep_state_t *state, hystgen_real_t x) {
    hystgen_real_t ahead = 0;
    unsigned int i;
    for (i = 0; i < t->n; ++i) {
        const hystgen_real_t settled = t->term[i].share * x;
        state[i].high = settled;
        state[i].low = 0;
        ahead = ahead + settled;
    }
    self->ahead = ahead;
    return t->rest * x;
}

/* The input for the output y at this sample. */
static hystgen_real_t hystgen_creep_solve(const hystgen_creep_table_t *t,
                                          const hystgen_creep_t *self, hystgen_real_t y) {
    return (y - self->ahead) * t->inverse_slope;
}

/* Takes the input x at this sample. Returns the output. */
static hystgen_real_t hystgen_creep_absorb(const hystgen_creep_table_t *t, hystgen_creep_t *self,
                                           hystgen_creep_state_t *state, hystgen_real_t x) {
    const hystgen_real_t y = self->ahead + t->slope * x;
    hystgen_real_t ahead = 0;
    unsigned int i;
    for (i = 0; i < t->n; ++i) {
        const hystgen_real_t high = state[i].high;
        const hystgen_real_t change =
            t->term[i].rate * (t->term[i].share * x - high) + state[i].low;
        const hystgen_real_t next = high + change;
        state[i].high = next;
        state[i].low = change - (next - high); /* rounding remainder of the sum */
        ahead = ahead + next;
    }
    self->ahead = ahead;
    return y;
}
#endif
