/* Creep as a block of the chain. Part of each state follows a move at once, so that the block is
   exactly invertible; a state holds its contribution to the next output for an input of 0. `ahead`
   is the sum of the states. Called by the functions that emission writes for a chain, see
   compensator/chain/model.h. */
#include "compensator/chain/model.h"

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

/* The input for the settled output y. */
static hystgen_real_t hystgen_creep_resting(const hystgen_creep_table_t *t, hystgen_real_t y) {
    return y * t->inverse_rest;
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
