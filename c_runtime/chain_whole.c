#include "hystgen_runtime.h"

/* Operators of engine loop and of every model with effects: the input of the plays is fine enough as
   it is. */

static inline hystgen_signal_t hystgen_inverse_finer(const hystgen_inverse_t *self,
                                                     hystgen_signal_t h, hystgen_reach_t w,
                                                     hystgen_reach_t a) {
    (void)self;
    (void)h;
    (void)w;
    return a;
}

/* The solution w of engine corners is used as it is. */
static inline void hystgen_inverse_seen(hystgen_inverse_t *self, hystgen_reach_t w) {
    (void)self;
    (void)w;
}
