#include "hystgen_runtime.h"

/* Operators of engine loop: plays behind a memoryless part with two branches. */

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
