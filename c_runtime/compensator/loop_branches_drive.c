/* Operators of engine loop: drives in front of a memoryless part with two branches. Called by
   loop.c. */
#ifndef HYSTGEN_LOOP_BRANCHES_DRIVE_C
#define HYSTGEN_LOOP_BRANCHES_DRIVE_C
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_FRONT
#define HYSTGEN_HAS_TWO_BRANCHES
#endif
#include "compensator/model.h"
#include "compensator/branches.c"

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

#endif
