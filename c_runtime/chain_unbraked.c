#include "hystgen_runtime.h"

/* The drive nearest to v that the amplifier reaches in one step; v itself in the first one. */
static hystgen_reach_t hystgen_inverse_slewed(hystgen_inverse_t *self, hystgen_reach_t v) {
    if (!self->moving) {
        return v;
    }
    hystgen_inverse_ramp(self, hystgen_inverse_left(self), v);
    return self->reached.drive;
}
