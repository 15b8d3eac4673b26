/* A mode as a block of the forward operator. Its states, output minus input and the rate of this,
   turn into each other and decay; in fixed point they have bits below those of a signal. Called by
   the functions that emission writes for a chain, see compensator/chain/model.h. */
#include "compensator/chain/model.h"
#ifdef HYSTGEN_FIXED
#include "arithmetic/factors.c"
#endif

#ifdef HYSTGEN_FIXED
/* A number in units of the states times a factor. */
HYSTGEN_APART int64_t hystgen_mode_scaled(const hystgen_mode_table_t *t, int64_t x,
                                          const hystgen_factor_t *f) {
    return hystgen_times(x >> t->drop, f);
}

/* A change of the input times a factor, in units of the states. */
HYSTGEN_APART int64_t hystgen_mode_entered(const hystgen_mode_table_t *t, int64_t change,
                                           const hystgen_factor_t *f) {
    return hystgen_times(change, f) * ((int64_t)1 << t->lift);
}

/* Settles everything at the input x. Returns the output. */
static int64_t hystgen_mode_rest(hystgen_mode_t *self, int64_t x) {
    self->before = x;
    self->off = 0;
    self->rate = 0;
    return x;
}

/* Takes the input x at this sample. Returns the output. */
HYSTGEN_APART int64_t hystgen_mode_absorb(const hystgen_mode_table_t *t, hystgen_mode_t *self,
                                          int64_t x) {
    const int64_t change = x - self->before;
    const int64_t off = self->off;
    self->before = x;
    self->off +=
        hystgen_mode_scaled(t, off, &t->keep) + hystgen_mode_scaled(t, self->rate, &t->turn);
    self->rate +=
        hystgen_mode_scaled(t, self->rate, &t->swing) - hystgen_mode_scaled(t, off, &t->turn);
    self->off += hystgen_mode_entered(t, change, &t->late) - change * ((int64_t)1 << t->bits);
    self->rate += hystgen_mode_entered(t, change, &t->push);
    return self->before + hystgen_nearest(self->off, t->bits);
}
#else
/* Settles everything at the input x. Returns the output. */
static hystgen_real_t hystgen_mode_rest(hystgen_mode_t *self, hystgen_real_t x) {
    self->before = x;
    self->off = 0;
    self->rate = 0;
    return x;
}

/* Takes the input x at this sample. Returns the output. */
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
#endif
