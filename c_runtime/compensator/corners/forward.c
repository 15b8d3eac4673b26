/* The forward operator without a memoryless part, in floating point. Called by users. */
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#endif
#include "compensator/model.h"

/* One sample. */
hystgen_real_t hystgen_forward_step(hystgen_forward_t *self, hystgen_real_t v) {
    if (!(v >= HYSTGEN_DRIVE_MIN && v <= HYSTGEN_DRIVE_MAX)) {
        if (!(v >= -HYSTGEN_REAL_MAX && v <= HYSTGEN_REAL_MAX)) {
            self->status |= HYSTGEN_STATUS_HELD;
            return self->plays.here.output + HYSTGEN_OFFSET;
        }
        v = v < HYSTGEN_DRIVE_MIN ? HYSTGEN_DRIVE_MIN : HYSTGEN_DRIVE_MAX;
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    return hystgen_plays_step(&hystgen_forward_curve, &self->plays, self->corner, v) +
           HYSTGEN_OFFSET;
}

static void hystgen_forward_begin(hystgen_forward_t *self, const hystgen_start_t *start) {
    hystgen_start(&hystgen_forward_curve, &self->plays, self->corner, start);
    self->status = 0;
}

void hystgen_forward_init(hystgen_forward_t *self) {
    hystgen_forward_begin(self, &hystgen_forward_start[0]);
}

void hystgen_forward_reset(hystgen_forward_t *self, hystgen_real_t v) {
    hystgen_forward_begin(self, &hystgen_forward_start[1]);
    (void)hystgen_forward_step(self, v);
}
