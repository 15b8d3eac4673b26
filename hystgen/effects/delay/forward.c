/* The delay of the forward operator, or none; the inverse gets its references ahead of time
   instead. Called by chain.c. */
#ifndef HYSTGEN_DELAY_FORWARD_C
#define HYSTGEN_DELAY_FORWARD_C
#include "compensator/chain/model.h"
#ifdef HYSTGEN_HAS_DELAY
#include "effects/delay/delay.c"
#endif

#ifdef HYSTGEN_HAS_DELAY
/* Appends the drive v of this sample. Returns the delayed drive. */
static hystgen_reach_t hystgen_forward_waited(hystgen_forward_t *self, hystgen_real_t v) {
    if (self->moving) {
        hystgen_delay_put(self->waiting, &self->oldest, v);
    } else {
        hystgen_delay_rest(self->waiting, &self->oldest, v);
    }
    return hystgen_delayed(self->waiting, self->oldest);
}
#else
/* The drive acts at once. */
static hystgen_reach_t hystgen_forward_waited(hystgen_forward_t *self, hystgen_real_t v) {
    (void)self;
    return v;
}
#endif

#endif
