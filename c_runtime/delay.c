#include "hystgen_runtime.h"

/* A delay of the forward operator: drives wait in a ring buffer. */

/* The drive has always been v. */
static void hystgen_delay_rest(hystgen_real_t *sample, unsigned int *oldest, hystgen_real_t v) {
    volatile hystgen_real_t *entry = sample; /* no call of memset, which a target need not have */
    unsigned int i;
    for (i = 0; i < HYSTGEN_WAITING; ++i) {
        entry[i] = v;
    }
    *oldest = 0;
}

/* The place after that of the oldest sample. */
static unsigned int hystgen_delay_next(unsigned int oldest) {
    return oldest + 1u < HYSTGEN_WAITING ? oldest + 1u : 0;
}

/* The drive is v at this sample. */
static void hystgen_delay_put(hystgen_real_t *sample, unsigned int *oldest, hystgen_real_t v) {
    sample[*oldest] = v;
    *oldest = hystgen_delay_next(*oldest);
}
