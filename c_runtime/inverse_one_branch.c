#include "hystgen_runtime.h"

/* The drive that gives w; `limited` is set where an envelope cannot give w. */
HYSTGEN_APART_IN_FLOAT hystgen_reach_t hystgen_inverse_choose(hystgen_inverse_t *self, hystgen_real_t level, hystgen_reach_t w)
{
    (void)level;
    return hystgen_front_inverse(w, true, &self->limited);
}
