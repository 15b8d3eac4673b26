/* A drive that stands still while the reference does. The drive in front of a lag makes up for the
   rounding of the one before, and creep notices that too: at rest it goes to and fro by a code.
   After HYSTGEN_QUIET equal references, with drives no farther than HYSTGEN_DITHER from what stands
   in front of the plays in the end, the last one is kept until it is that far off. What is sought
   in front of the plays is then within twice that of what has arrived; beyond, it has jumped.
   Called by the functions that emission writes for a chain, see compensator/chain/model.h. */
#ifndef HYSTGEN_LAG_QUIET_C
#define HYSTGEN_LAG_QUIET_C
#include "compensator/chain/model.h"
#include "compensator/chain/drive_signal.c"

/* Everything has settled with a in front of the plays. */
static void hystgen_quiet_rest(hystgen_quiet_t *self, hystgen_signal_t a) {
    self->arrived = a;
    self->reference = 0;
    self->equal = 0;
}

/* Counts references that are equal to the next one, u. */
static void hystgen_quiet_count(hystgen_quiet_t *self, hystgen_signal_t u) {
    if (u < self->reference || u > self->reference) {
        self->reference = u;
        self->equal = 0;
    }
    if (self->equal <= HYSTGEN_QUIET) {
        ++self->equal;
    }
}

/* Whether the drive stands still. */
static bool hystgen_quiet_still(const hystgen_quiet_t *self) {
    return self->equal >= HYSTGEN_QUIET;
}

/* The drive for a in front of the plays: v, which leads there, or one that stands still. */
static hystgen_signal_t hystgen_quiet_drive(hystgen_quiet_t *self, hystgen_signal_t a,
                                            hystgen_signal_t v, hystgen_real_t applied) {
    const bool kept = self->equal > HYSTGEN_QUIET;
    const hystgen_signal_t away = kept ? a - self->arrived : v - a;
    const hystgen_signal_t most = kept ? HYSTGEN_DITHER + HYSTGEN_DITHER : HYSTGEN_DITHER;
    if (away > most || away < -most) {
        self->equal = 0;
    }
    if (!hystgen_quiet_still(self)) {
        return v;
    }
    const hystgen_signal_t last = hystgen_drive_signal(applied);
    const hystgen_signal_t off = a - last;
    return kept && off <= HYSTGEN_DITHER && off >= -HYSTGEN_DITHER ? last : a;
}

#endif
