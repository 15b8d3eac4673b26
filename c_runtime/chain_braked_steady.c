#include "hystgen_runtime.h"

/* The drive nearest to v that the amplifier reaches in one step, or from which the lag behind it
   neither overshoots nor leaves its branch; v itself in the first one. */
HYSTGEN_APART_IN_FIXED hystgen_reach_t hystgen_inverse_slewed(const hystgen_inverse_t *self,
                                                              hystgen_reach_t v) {
    const hystgen_reach_t near = hystgen_inverse_within(self, v);
    if (!self->moving) {
        return v;
    }
    const hystgen_signal_t drive =
        hystgen_braked_drive(&hystgen_braked_1, &self->braked_1, hystgen_entered_drive(near),
                             hystgen_entered_drive(v > near ? v - near : near - v));
    const hystgen_signal_t kept = hystgen_steady_kept(
        &self->steady, &hystgen_braked_1, &self->braked_1.lag,
        hystgen_entered_drive(hystgen_drive_code(drive)), hystgen_entered_drive(self->applied),
        HYSTGEN_DITHER);
    return hystgen_inverse_within(self, hystgen_drive_code(kept));
}
