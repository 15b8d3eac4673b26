#include "hystgen_runtime.h"

/* The drive acts at once. */
static hystgen_reach_t hystgen_forward_waited(hystgen_forward_t *self, hystgen_real_t v) {
    (void)self;
    return v;
}
