/* Operators of engine loop: plays behind a memoryless part with two branches. Called by loop.c and
   chain/chain.c. */
#ifndef HYSTGEN_LOOP_BRANCHES_C
#define HYSTGEN_LOOP_BRANCHES_C
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_FRONT
#define HYSTGEN_HAS_TWO_BRANCHES
#endif
#include "compensator/model.h"
#include "front/front.c"

/* The actuator is at drive v; its move picks the branch. Returns the input of the plays. */
static hystgen_play_t hystgen_forward_arrive(hystgen_forward_t *self, hystgen_fine_t v) {
    if (v > self->drive) {
        self->ascending = true;
    } else if (v < self->drive) {
        self->ascending = false;
    }
    self->drive = v;
    return hystgen_front_forward(v, self->ascending);
}

/* The actuator is at drive v; its move picks the branch. Returns the input of the plays. */
static hystgen_play_t hystgen_inverse_arrive(hystgen_inverse_t *self, hystgen_fine_t v) {
    if (v > self->drive) {
        self->ascending = true;
    } else if (v < self->drive) {
        self->ascending = false;
    }
    self->drive = v;
    return hystgen_front_forward(v, self->ascending);
}

#endif
