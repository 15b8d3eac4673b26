#include "hystgen_runtime.h"

/* The drive may move any distance in one step. */
static hystgen_reach_t hystgen_forward_slewed(hystgen_forward_t *self, hystgen_reach_t v) {
    (void)self;
    return v;
}

/* The drive may move any distance in one step. */
static hystgen_reach_t hystgen_inverse_slewed(hystgen_inverse_t *self, hystgen_reach_t v) {
    (void)self;
    return v;
}

/* The last answer once more. */
static hystgen_real_t hystgen_inverse_held(const hystgen_inverse_t *self) {
    return self->stepped ? self->answer : self->applied;
}

/* Every reference is answered anew: time has passed for the effects. */
static bool hystgen_inverse_stands(const hystgen_inverse_t *self, hystgen_real_t u) {
    (void)self;
    (void)u;
    return false;
}
