/* Rate-limited drives into a lag, which must not overshoot. Called by chain_calls.c. */
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_SLEW_LIMIT
#define HYSTGEN_HAS_BRAKED_LAG
#endif
#include "compensator/chain/model.h"
#include "compensator/chain/signals.c"
#include "compensator/chain/drive_signal.c"
#include "effects/slew_limit/slewed.c"
#define HYSTGEN_ASKS_LED
#include "effects/catalogue.h"

/* The drive from which the lag after the amplifier does not overshoot on its way to the solution v;
   `reachable` is the drive nearest to v that the amplifier reaches. */
static hystgen_reach_t hystgen_inverse_braked(const hystgen_inverse_t *self, hystgen_reach_t v,
                                              hystgen_reach_t reachable) {
    return hystgen_drive_code(
        hystgen_braked_drive(&hystgen_braked_1, &self->braked_1, hystgen_drive_signal(reachable),
                             hystgen_drive_signal(v > reachable ? v - reachable : reachable - v)));
}

#if defined(HYSTGEN_HAS_STEADY_LAG) && !defined(HYSTGEN_HAS_QUIET_DRIVE)
/* The drive v, or one that keeps the lag on its branch. */
HYSTGEN_APART_IN_FIXED hystgen_reach_t hystgen_inverse_kept(const hystgen_inverse_t *self,
                                                            hystgen_reach_t v) {
    return hystgen_drive_code(hystgen_steady_kept(
        &self->steady, &hystgen_braked_1, &self->braked_1.lag, hystgen_drive_signal(v),
        hystgen_drive_signal(self->applied), HYSTGEN_DITHER));
}
#else
static hystgen_reach_t hystgen_inverse_kept(const hystgen_inverse_t *self, hystgen_reach_t v) {
    (void)self;
    return v;
}
#endif

/* Drive nearest to v that the amplifier reaches in one step, or, unless the drive stands still,
   from which the lag after the amplifier neither overshoots nor leaves its branch; v itself in the
   first step. */
HYSTGEN_APART_IN_FIXED hystgen_reach_t hystgen_inverse_slewed(hystgen_inverse_t *self,
                                                              hystgen_reach_t v) {
    if (!self->moving) {
        return v;
    }
    const hystgen_play_t left = hystgen_inverse_left(self);
    hystgen_inverse_ramp(self, left, v);
#ifdef HYSTGEN_HAS_QUIET_DRIVE
    if (hystgen_quiet_still(&self->quiet)) {
        return self->reached.drive;
    }
#endif
    const hystgen_reach_t braked = hystgen_inverse_braked(self, v, self->reached.drive);
    hystgen_inverse_ramp(self, left, hystgen_inverse_kept(self, braked));
    return self->reached.drive;
}
