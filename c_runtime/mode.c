#include "hystgen_runtime.h"

/* A mode as a block of the forward operator. Its states, the output less the input and the rate of
   that, turn into each other and decay. */

/* Everything has settled at the input x. Returns the output. */
static hystgen_real_t hystgen_mode_rest(hystgen_mode_t *self, hystgen_real_t x) {
    self->before = x;
    self->off = 0;
    self->rate = 0;
    return x;
}

/* The input is x at this sample. Returns the output. */
static hystgen_real_t hystgen_mode_absorb(const hystgen_mode_table_t *t, hystgen_mode_t *self,
                                          hystgen_real_t x) {
    const hystgen_real_t change = x - self->before;
    const hystgen_real_t off = self->off;
    const hystgen_real_t rate = self->rate;
    self->off = off + ((t->keep * off + t->turn * rate) + t->lead * change);
    self->rate = rate + ((t->swing * rate - t->turn * off) + t->push * change);
    self->before = x;
    return x + self->off;
}
