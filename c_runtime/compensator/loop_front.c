/* Operators of engine loop: plays behind a memoryless part. Called by loop.c and by chain/. */
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_FRONT
#endif
#include "compensator/model.h"
#include "front/front.c"
#include "compensator/branches.c"

/* The actuator is at drive v. Returns the input of the plays. */
static hystgen_play_t hystgen_forward_arrive(hystgen_forward_t *self, hystgen_fine_t v) {
    (void)self;
    return hystgen_front_forward(v, true);
}

/* The actuator is at drive v. Returns the input of the plays. */
static hystgen_play_t hystgen_inverse_arrive(hystgen_inverse_t *self, hystgen_fine_t v) {
    self->drive = v;
    return hystgen_front_forward(v, true);
}

/* The drive that gives w. */
static hystgen_reach_t hystgen_inverse_drive(hystgen_inverse_t *self, hystgen_real_t level,
                                             hystgen_reach_t w) {
    bool limited;
    const hystgen_reach_t v = hystgen_inverse_choose(self, level, w, &limited);
    if (limited) {
        self->bits |= HYSTGEN_STATUS_DOMAIN;
    }
    return v;
}
