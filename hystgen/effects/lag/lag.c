/* A lag as a block of the chain. The inverse of a lag whose drive is interpolated between samples
   rings; the inverse of x, the response to a zero-order-hold drive, does not. The output is x minus
   theta of its last step, so x is led beyond the requested output by theta of the output's step:
   exact on ramps. In fixed point `lead`, the requested move of x, gives the effect of an input
   other than the solution. Called by the functions that emission writes for a chain, see
   compensator/chain/model.h. */
#ifndef HYSTGEN_LAG_LAG_C
#define HYSTGEN_LAG_LAG_C
#include "compensator/chain/model.h"
#include "arithmetic/factors.c"

#ifdef HYSTGEN_FIXED
/* A signal in units of the states, which have more bits. */
static hystgen_signal_t hystgen_lag_raised(const hystgen_lag_table_t *t, hystgen_signal_t x) {
    return x * ((int64_t)1 << t->bits);
}

/* A number in units of the states as a signal. */
static hystgen_signal_t hystgen_lag_rounded(const hystgen_lag_table_t *t, hystgen_signal_t x) {
    return hystgen_nearest(x, t->bits);
}

/* A number in units of the states times a factor. */
static hystgen_signal_t hystgen_lag_scaled(const hystgen_lag_table_t *t, hystgen_signal_t x,
                                           const hystgen_factor_t *f) {
    return hystgen_times(x >> t->drop, f);
}
#else
static hystgen_signal_t hystgen_lag_raised(const hystgen_lag_table_t *t, hystgen_signal_t x) {
    (void)t;
    return x;
}

static hystgen_signal_t hystgen_lag_rounded(const hystgen_lag_table_t *t, hystgen_signal_t x) {
    (void)t;
    return x;
}

/* x times a factor. */
static hystgen_signal_t hystgen_lag_scaled(const hystgen_lag_table_t *t, hystgen_signal_t x,
                                           const hystgen_factor_t *f) {
    (void)t;
    return hystgen_times(x, f);
}
#endif

/* Settles everything at the input v. Returns the output. */
static hystgen_signal_t hystgen_lag_rest(const hystgen_lag_table_t *t, hystgen_lag_t *self,
                                         hystgen_signal_t v) {
    const hystgen_signal_t x = hystgen_lag_raised(t, v);
    self->high = x;
#ifndef HYSTGEN_FIXED
    self->low = 0;
#endif
    self->wanted = x;
    self->asked = x;
#ifdef HYSTGEN_FIXED
    self->lead = 0;
#else
    self->answer = v;
#endif
    return v;
}

/* The input for the output y at this sample. */
static hystgen_signal_t hystgen_lag_solve(const hystgen_lag_table_t *t, hystgen_lag_t *self,
                                          hystgen_signal_t y) {
    const hystgen_signal_t asked = hystgen_lag_raised(t, y);
    const hystgen_signal_t lead =
        asked + hystgen_lag_scaled(t, asked - self->wanted, &t->theta) - self->high;
    const hystgen_signal_t v =
        hystgen_lag_rounded(t, self->high) + hystgen_lag_scaled(t, lead, &t->inverse_rate);
    self->asked = asked;
#ifdef HYSTGEN_FIXED
    self->lead = lead;
#else
    self->answer = v;
#endif
    return v;
}

/* The input v takes the place of the solution. */
static void hystgen_lag_replace(hystgen_lag_t *self, hystgen_signal_t v, bool other) {
#ifdef HYSTGEN_FIXED
    (void)v;
    if (other) {
        self->lead = 0; /* no move is requested */
    }
#else
    (void)other;
    self->answer = v;
#endif
}

/* Takes the input v at this sample. Returns the output. */
HYSTGEN_APART_IN_FIXED_BLOCK hystgen_signal_t hystgen_lag_absorb(const hystgen_lag_table_t *t,
                                                                 hystgen_lag_t *self,
                                                                 hystgen_signal_t v) {
#ifdef HYSTGEN_FIXED
    const hystgen_signal_t change =
        hystgen_lag_scaled(t, hystgen_lag_raised(t, v) - self->high, &t->rate);
    const hystgen_signal_t left = self->lead - change;
    self->high += change;
    self->wanted = self->asked - (left - hystgen_lag_scaled(t, left, &t->theta));
    self->lead -= hystgen_lag_scaled(t, change, &t->rate);
#else
    const hystgen_signal_t high = self->high;
    const hystgen_signal_t more = t->rate * (v - high) + self->low;
    self->high = high + more;
    const hystgen_signal_t change = self->high - high;
    self->low = more - change; /* rounding remainder of the sum */
    self->wanted = self->asked + t->late * (v - self->answer);
#endif
    return hystgen_lag_rounded(t, self->high - hystgen_lag_scaled(t, change, &t->theta));
}

#endif
