#include "hystgen_runtime.h"

/* Takes the ramp to v, or as near to it as the amplifier gets in one step. */
HYSTGEN_APART_IN_FIXED void hystgen_ramp_towards(hystgen_ramp_t *ramp, hystgen_reach_t v) {
    bool beyond;
    if (v > ramp->drive || (v >= ramp->drive && ramp->rest < 0)) {
        hystgen_ramp_on(ramp, HYSTGEN_SLEW_RISING, HYSTGEN_SLEW_RISING_REST);
        beyond = v > ramp->drive || (v >= ramp->drive && ramp->rest < 0);
    } else {
        hystgen_ramp_on(ramp, -HYSTGEN_SLEW_FALLING, -HYSTGEN_SLEW_FALLING_REST);
        beyond = v < ramp->drive || (v <= ramp->drive && ramp->rest > 0);
    }
    if (!beyond) {
        ramp->drive = v;
        ramp->rest = 0;
    }
}

/* The drive nearest to v that the amplifier reaches in one step; v itself in the first one. */
static hystgen_reach_t hystgen_forward_slewed(hystgen_forward_t *self, hystgen_reach_t v) {
    if (self->moving) {
        hystgen_ramp_towards(&self->reached, v);
    } else {
        self->reached.drive = v;
        self->reached.rest = 0;
    }
    return self->reached.drive;
}

/* What rounding has left of the drive applied last: that is where the answer led to, unless another
   one was applied. */
static hystgen_play_t hystgen_inverse_left(const hystgen_inverse_t *self) {
    const bool other = self->applied < self->reached.drive || self->applied > self->reached.drive;
    return other ? 0 : self->reached.rest;
}

/* Takes the ramp from the drive applied last, of which rounding has left `rest`, towards v. */
static void hystgen_inverse_ramp(hystgen_inverse_t *self, hystgen_play_t rest, hystgen_reach_t v) {
    self->reached.drive = self->applied;
    self->reached.rest = rest;
    hystgen_ramp_towards(&self->reached, v);
}

/* The last answer once more, or the drive nearest to it that the amplifier reaches in one step. */
HYSTGEN_APART_IN_FIXED hystgen_real_t hystgen_inverse_held(hystgen_inverse_t *self) {
    const hystgen_real_t last = self->stepped ? self->answer : self->applied;
    if (!self->moving) {
        return last;
    }
    hystgen_inverse_ramp(self, hystgen_inverse_left(self), last);
    if (self->reached.drive < last || self->reached.drive > last) {
        self->status |= HYSTGEN_STATUS_SLEW_LIMITED;
    }
    return (hystgen_real_t)self->reached.drive;
}

/* Every reference is answered anew: time has passed for the effects. */
static bool hystgen_inverse_stands(const hystgen_inverse_t *self, hystgen_real_t u) {
    (void)self;
    (void)u;
    return false;
}
