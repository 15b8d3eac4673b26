#include "hystgen_runtime.h"

/* The drive nearest to v that the amplifier reaches in one step from `before`, of which rounding
   has left `rest`. */
HYSTGEN_APART_IN_FIXED hystgen_ramp_t hystgen_nearest_ramp(hystgen_reach_t before,
                                                           hystgen_play_t rest, hystgen_reach_t v) {
    const hystgen_ramp_t reached = {v, 0};
    const hystgen_ramp_t highest =
        hystgen_ramp(before, rest, HYSTGEN_SLEW_RISING, HYSTGEN_SLEW_RISING_REST);
    const hystgen_ramp_t lowest =
        hystgen_ramp(before, rest, -HYSTGEN_SLEW_FALLING, -HYSTGEN_SLEW_FALLING_REST);
    if (v > highest.drive || (v >= highest.drive && highest.rest < 0)) {
        return highest;
    }
    if (v < lowest.drive || (v <= lowest.drive && lowest.rest > 0)) {
        return lowest;
    }
    return reached;
}

/* The drive nearest to v that the amplifier reaches in one step; v itself in the first one. */
static hystgen_reach_t hystgen_forward_slewed(hystgen_forward_t *self, hystgen_reach_t v) {
    if (self->moving) {
        self->reached = hystgen_nearest_ramp(self->reached.drive, self->reached.rest, v);
    } else {
        self->reached.drive = v;
        self->reached.rest = 0;
    }
    return self->reached.drive;
}

/* The drive nearest to v that the amplifier reaches in one step from the one applied last. That is
   where the answer led to, with what rounding has left of it, unless another one was applied. */
HYSTGEN_APART_IN_FIXED hystgen_ramp_t hystgen_inverse_within(const hystgen_inverse_t *self,
                                                             hystgen_reach_t v) {
    const bool other = self->applied < self->reached.drive || self->applied > self->reached.drive;
    return hystgen_nearest_ramp(self->applied, other ? 0 : self->reached.rest, v);
}

/* The last answer once more, or the drive nearest to it that the amplifier reaches in one step. */
HYSTGEN_APART_IN_FIXED hystgen_real_t hystgen_inverse_held(hystgen_inverse_t *self) {
    const hystgen_real_t last = self->stepped ? self->answer : self->applied;
    if (!self->moving) {
        return last;
    }
    self->reached = hystgen_inverse_within(self, last);
    if (self->reached.drive < last || self->reached.drive > last) {
        self->status |= HYSTGEN_STATUS_SLEW_LIMITED;
    }
    return (hystgen_real_t)self->reached.drive;
}
