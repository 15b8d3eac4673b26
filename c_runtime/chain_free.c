#include "hystgen_runtime.h"

/* The drive may move any distance in one step. */
static hystgen_reach_t hystgen_forward_slewed(hystgen_forward_t *self, hystgen_reach_t v) {
    (void)self;
    return v;
}

/* The drive may move any distance in one step. */
static hystgen_reach_t hystgen_inverse_slewed(const hystgen_inverse_t *self, hystgen_reach_t v) {
    (void)self;
    return v;
}
