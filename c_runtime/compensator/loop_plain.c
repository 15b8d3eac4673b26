/* Operators of engine loop: only plays. Called by loop.c and by chain/. */
#ifndef HYSTGEN_LOOP_PLAIN_C
#define HYSTGEN_LOOP_PLAIN_C
#include "compensator/model.h"
#include "front/front.c"

/* The actuator is at drive v. Returns the input of the plays. */
static hystgen_play_t hystgen_forward_arrive(hystgen_forward_t *self, hystgen_fine_t v) {
    (void)self;
    return hystgen_front_forward(v);
}

/* The actuator is at drive v. Returns the input of the plays. */
static hystgen_play_t hystgen_inverse_arrive(hystgen_inverse_t *self, hystgen_fine_t v) {
    self->drive = v;
    return hystgen_front_forward(v);
}

/* The drive that gives w. */
static hystgen_reach_t hystgen_inverse_drive(hystgen_inverse_t *self, hystgen_real_t level,
                                             hystgen_reach_t w) {
    (void)self;
    (void)level;
    return hystgen_front_inverse(w);
}

#endif
