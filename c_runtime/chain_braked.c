#include "hystgen_runtime.h"

/* The drive nearest to v that the amplifier reaches in one step, or from which the lag behind it
   does not overshoot; v itself in the first one. */
HYSTGEN_APART_IN_FIXED hystgen_reach_t hystgen_inverse_slewed(hystgen_inverse_t *self,
                                                              hystgen_reach_t v) {
    if (!self->moving) {
        return v;
    }
    const hystgen_reach_t near = hystgen_inverse_within(self, v).drive;
    self->reached = hystgen_inverse_within(self, hystgen_inverse_braked(self, v, near));
    return self->reached.drive;
}
