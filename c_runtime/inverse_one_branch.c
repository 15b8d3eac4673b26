#include "hystgen_runtime.h"

/* The drive that gives w; sets `limited` if there is none. */
HYSTGEN_APART_IN_FLOAT_CORNERS hystgen_reach_t hystgen_inverse_choose(const hystgen_inverse_t *self,
                                                                      hystgen_real_t level,
                                                                      hystgen_reach_t w,
                                                                      bool *limited) {
    (void)self;
    (void)level;
    return hystgen_front_inverse(w, true, limited);
}
