#include "hystgen_runtime.h"

/* The drive nearest to v that the amplifier reaches in one step, or from which the lag behind it
   does not overshoot; v itself in the first one. */
HYSTGEN_APART_IN_FIXED hystgen_reach_t hystgen_inverse_slewed(hystgen_inverse_t *self,
                                                              hystgen_reach_t v) {
    if (!self->moving) {
        return v;
    }
    const hystgen_play_t left = hystgen_inverse_left(self);
    hystgen_inverse_ramp(self, left, v);
    const hystgen_reach_t braked = hystgen_inverse_braked(self, v, self->reached.drive);
    hystgen_inverse_ramp(self, left, braked);
    return self->reached.drive;
}
