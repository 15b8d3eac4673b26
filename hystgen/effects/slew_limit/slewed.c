/* Drives with or without a rate limit. The rounding remainder of a limited drive, and in floating
   point that of the rate, is stored too: rounding errors do not add up over steps, and a step may
   be smaller than the drive's last bit. Called by chain.c and chain_calls.c. */
#ifndef HYSTGEN_SLEW_LIMIT_SLEWED_C
#define HYSTGEN_SLEW_LIMIT_SLEWED_C
#include "compensator/chain/model.h"

#ifdef HYSTGEN_HAS_SLEW_LIMIT
#ifdef HYSTGEN_FIXED
/* Bits of a rounding remainder below a code: two remainders and one half fit 32 bits. */
#define HYSTGEN_REST_BITS 30

/* One step of `move`, whose rounding remainder is `more`. */
static void hystgen_ramp_on(hystgen_ramp_t *ramp, hystgen_reach_t move, hystgen_play_t more) {
    const hystgen_play_t left = ramp->rest + more;
    const hystgen_play_t whole =
        (left + ((hystgen_play_t)1 << (HYSTGEN_REST_BITS - 1))) >> HYSTGEN_REST_BITS;
    ramp->drive = ramp->drive + move + whole;
    ramp->rest = left - whole * ((hystgen_play_t)1 << HYSTGEN_REST_BITS);
}
#else
/* One step of `move`, whose rounding remainder is `more`. */
static void hystgen_ramp_on(hystgen_ramp_t *ramp, hystgen_reach_t move, hystgen_play_t more) {
    const hystgen_reach_t before = ramp->drive;
    const hystgen_reach_t next = before + move;
    const hystgen_reach_t moved = next - before;
    const hystgen_play_t lost = (before - (next - moved)) + (move - moved);
    const hystgen_play_t left = lost + (ramp->rest + more);
    ramp->drive = next + left;
    ramp->rest = left - (ramp->drive - next);
}
#endif

/* Moves the ramp to v, or as near to v as the amplifier gets in one step. */
HYSTGEN_APART_IN_FIXED void hystgen_ramp_towards(hystgen_ramp_t *ramp, hystgen_reach_t v) {
    if (v > ramp->drive || (v >= ramp->drive && ramp->rest < 0)) {
        hystgen_ramp_on(ramp, HYSTGEN_SLEW_RISING, HYSTGEN_SLEW_RISING_REST);
        if (v > ramp->drive || (v >= ramp->drive && ramp->rest < 0)) {
            return;
        }
    } else {
        hystgen_ramp_on(ramp, -HYSTGEN_SLEW_FALLING, -HYSTGEN_SLEW_FALLING_REST);
        if (v < ramp->drive || (v <= ramp->drive && ramp->rest > 0)) {
            return;
        }
    }
    ramp->drive = v;
    ramp->rest = 0;
}

/* Drive nearest to v that the amplifier reaches in one step; v itself in the first step. */
static hystgen_reach_t hystgen_forward_slewed(hystgen_forward_t *self, hystgen_reach_t v) {
    if (self->moving) {
        hystgen_ramp_towards(&self->reached, v);
    } else {
        self->reached.drive = v;
        self->reached.rest = 0;
    }
    return self->reached.drive;
}

/* Rounding remainder of the last applied drive: that of the last returned drive, or 0 if another
   drive was applied. */
static hystgen_play_t hystgen_inverse_left(const hystgen_inverse_t *self) {
    const bool other = self->applied < self->reached.drive || self->applied > self->reached.drive;
    return other ? 0 : self->reached.rest;
}

/* Moves the ramp from the last applied drive, whose rounding remainder is `rest`, towards v. */
static void hystgen_inverse_ramp(hystgen_inverse_t *self, hystgen_play_t rest, hystgen_reach_t v) {
    self->reached.drive = self->applied;
    self->reached.rest = rest;
    hystgen_ramp_towards(&self->reached, v);
}

/* Last returned drive again, or the nearest that the amplifier reaches in one step. */
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

#ifndef HYSTGEN_HAS_BRAKED_LAG
/* Drive nearest to v that the amplifier reaches in one step; v itself in the first step. */
static hystgen_reach_t hystgen_inverse_slewed(hystgen_inverse_t *self, hystgen_reach_t v) {
    if (!self->moving) {
        return v;
    }
    hystgen_inverse_ramp(self, hystgen_inverse_left(self), v);
    return self->reached.drive;
}
#endif
#else
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

#ifdef HYSTGEN_CHAIN
/* Last returned drive again. */
static hystgen_real_t hystgen_inverse_held(const hystgen_inverse_t *self) {
    return self->stepped ? self->answer : self->applied;
}
#else
/* Last returned drive again. */
static hystgen_real_t hystgen_inverse_held(const hystgen_inverse_t *self) {
    return self->stepped ? self->answer : self->drive;
}
#endif
#endif

#ifdef HYSTGEN_CHAIN
/* Every reference is solved anew: time has passed for the effects. */
static bool hystgen_inverse_stands(const hystgen_inverse_t *self, hystgen_real_t u) {
    (void)self;
    (void)u;
    return false;
}
#else
/* Whether the last returned drive is still valid for u, which becomes the last reference. */
static bool hystgen_inverse_stands(hystgen_inverse_t *self, hystgen_real_t u) {
    if (self->repeated && u >= self->reference && u <= self->reference) {
        self->status |= self->bits;
        return true;
    }
    self->reference = u;
    self->repeated = true;
    return false;
}
#endif

#endif
