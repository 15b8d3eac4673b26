/* A delay of the forward operator: drives wait in a ring buffer. Called by forward.c. */
#ifndef HYSTGEN_DELAY_DELAY_C
#define HYSTGEN_DELAY_DELAY_C
#include "compensator/chain/model.h"
#include "arithmetic/factors.c"

/* Sets the whole past of the drive to v. */
static void hystgen_delay_rest(hystgen_real_t *sample, unsigned int *oldest, hystgen_real_t v) {
    volatile hystgen_real_t *entry = sample; /* no call of memset, which a target may lack */
    unsigned int i;
    for (i = 0; i < HYSTGEN_WAITING; ++i) {
        entry[i] = v;
    }
    *oldest = 0;
}

/* The index after that of the oldest sample. */
static unsigned int hystgen_delay_next(unsigned int oldest) {
    return oldest + 1u < HYSTGEN_WAITING ? oldest + 1u : 0;
}

/* Appends the drive v of this sample. */
static void hystgen_delay_put(hystgen_real_t *sample, unsigned int *oldest, hystgen_real_t v) {
    sample[*oldest] = v;
    *oldest = hystgen_delay_next(*oldest);
}

/* The delayed drive: the oldest sample plus a share of the step to the next one, in fixed point to
   the nearest code. */
static hystgen_reach_t hystgen_delayed(const hystgen_real_t *sample, unsigned int oldest) {
    const hystgen_reach_t v = sample[oldest];
    const hystgen_signal_t change = (hystgen_signal_t)sample[hystgen_delay_next(oldest)] - v;
    return v + (hystgen_reach_t)hystgen_times(change, hystgen_waited);
}

#endif
