/* A drive that stands still while the reference does. Each drive into a lag corrects the rounding
   of the previous drive, and creep responds to this too: at rest the drive alternates by a code.
   After HYSTGEN_QUIET equal references, with drives no farther than HYSTGEN_DITHER from the drive
   needed at rest, the last drive is kept until it is farther away. The requested output of the
   drive side is then within twice HYSTGEN_DITHER of the present one; a larger difference is a jump.
   Called by the functions that emission writes for a chain, see compensator/chain/model.h. */
#ifndef HYSTGEN_LAG_QUIET_C
#define HYSTGEN_LAG_QUIET_C
#include "compensator/chain/model.h"
#include "compensator/chain/drive_signal.c"

/* Starts at rest with the output a of the drive side. */
static void hystgen_quiet_rest(hystgen_quiet_t *self, hystgen_signal_t a) {
    self->arrived = a;
    self->reference = 0;
    self->equal = 0;
}

/* Counts consecutive references equal to the next one, u. */
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

/* The drive for the output a of the drive side: v, the solution, or one that stands still. */
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
