#include "hystgen_runtime.h"

/* Operators of engine loop: drives in front of a memoryless part with two branches. */

/* The drive that gives w on the branch of its own move. */
static hystgen_reach_t hystgen_inverse_drive(hystgen_inverse_t *self, hystgen_real_t level,
                                             hystgen_reach_t w) {
    bool limited;
    const hystgen_reach_t v = hystgen_inverse_choose(self, level, w, &limited);
    self->last = level;
    if (limited) {
        self->bits |= HYSTGEN_STATUS_DOMAIN;
    }
    return v;
}
