/* A mode as a block of the forward operator. Its states, output minus input and the rate of this,
   turn into each other and decay; in fixed point they have bits below those of a signal. Called by
   the functions that emission writes for a chain, see compensator/chain/model.h. */
#include "compensator/chain/model.h"
#include "arithmetic/factors.c"

#ifdef HYSTGEN_FIXED
/* A number in units of the states times a factor. */
HYSTGEN_APART hystgen_signal_t hystgen_mode_scaled(const hystgen_mode_table_t *t,
                                                   hystgen_signal_t x, const hystgen_factor_t *f) {
    return hystgen_times(x >> t->drop, f);
}

/* A change of the input times a factor, in units of the states. */
HYSTGEN_APART hystgen_signal_t hystgen_mode_entered(const hystgen_mode_table_t *t,
                                                    hystgen_signal_t change,
                                                    const hystgen_factor_t *f) {
    return hystgen_times(change, f) * ((int64_t)1 << t->lift);
}
#else
static hystgen_signal_t hystgen_mode_scaled(const hystgen_mode_table_t *t, hystgen_signal_t x,
                                            const hystgen_factor_t *f) {
    (void)t;
    return hystgen_times(x, f);
}

static hystgen_signal_t hystgen_mode_entered(const hystgen_mode_table_t *t, hystgen_signal_t change,
                                             const hystgen_factor_t *f) {
    (void)t;
    return hystgen_times(change, f);
}
#endif

/* Settles everything at the input x. Returns the output. */
static hystgen_signal_t hystgen_mode_rest(hystgen_mode_t *self, hystgen_signal_t x) {
    self->before = x;
    self->off = 0;
    self->rate = 0;
    return x;
}

/* Takes the input x at this sample. Returns the output. */
HYSTGEN_APART_IN_FIXED_BLOCK hystgen_signal_t hystgen_mode_absorb(const hystgen_mode_table_t *t,
                                                                  hystgen_mode_t *self,
                                                                  hystgen_signal_t x) {
    const hystgen_signal_t change = x - self->before;
    const hystgen_signal_t off = self->off;
    const hystgen_signal_t turned =
        hystgen_mode_scaled(t, off, &t->keep) + hystgen_mode_scaled(t, self->rate, &t->turn);
    const hystgen_signal_t swung =
        hystgen_mode_scaled(t, self->rate, &t->swing) - hystgen_mode_scaled(t, off, &t->turn);
    self->before = x;
#ifdef HYSTGEN_FIXED
    self->off += turned;
    self->rate += swung;
    self->off += hystgen_mode_entered(t, change, &t->late) - change * ((int64_t)1 << t->bits);
    self->rate += hystgen_mode_entered(t, change, &t->push);
    return self->before + hystgen_nearest(self->off, t->bits);
#else
    self->off = off + (turned + hystgen_mode_entered(t, change, &t->lead));
    self->rate = self->rate + (swung + hystgen_mode_entered(t, change, &t->push));
    return x + self->off;
#endif
}
