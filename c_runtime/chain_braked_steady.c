#include "hystgen_runtime.h"

/* The drive v, or one that keeps the lag on its branch. */
HYSTGEN_APART_IN_FIXED hystgen_reach_t hystgen_inverse_kept(const hystgen_inverse_t *self,
                                                            hystgen_reach_t v) {
    return hystgen_drive_code(hystgen_steady_kept(
        &self->steady, &hystgen_braked_1, &self->braked_1.lag, hystgen_entered_drive(v),
        hystgen_entered_drive(self->applied), HYSTGEN_DITHER));
}

/* The drive nearest to v that the amplifier reaches in one step, or from which the lag behind it
   neither overshoots nor leaves its branch; v itself in the first one. */
HYSTGEN_APART_IN_FIXED hystgen_reach_t hystgen_inverse_slewed(hystgen_inverse_t *self,
                                                              hystgen_reach_t v) {
    if (!self->moving) {
        return v;
    }
    const hystgen_play_t left = hystgen_inverse_left(self);
    hystgen_inverse_ramp(self, left, v);
    const hystgen_reach_t braked = hystgen_inverse_braked(self, v, self->reached.drive);
    hystgen_inverse_ramp(self, left, hystgen_inverse_kept(self, braked));
    return self->reached.drive;
}
