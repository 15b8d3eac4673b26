#include "hystgen_runtime.h"

/* The drive that gives w; DOMAIN is added to `bits` where an envelope cannot give w. */
HYSTGEN_APART_IN_FLOAT hystgen_reach_t hystgen_inverse_choose(hystgen_inverse_t *self, hystgen_real_t level, hystgen_reach_t w)
{
    bool limited = false;
    const hystgen_reach_t v = hystgen_front_inverse(w, true, &limited);
    (void)level;
    self->bits |= limited ? HYSTGEN_STATUS_DOMAIN : 0u;
    return v;
}
