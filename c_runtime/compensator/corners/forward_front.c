/* The forward operator with a memoryless part, in floating point. Called by users. */
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#define HYSTGEN_HAS_FRONT
#endif
#include "compensator/model.h"
#include "front/front.c"

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
    if (v > self->drive) {
        self->ascending = true;
    } else if (v < self->drive) {
        self->ascending = false;
    }
    self->drive = v;
    return hystgen_plays_step(&hystgen_forward_curve, &self->plays, self->corner,
                              hystgen_front_forward(v, self->ascending)) +
           HYSTGEN_OFFSET;
}

static void hystgen_forward_begin(hystgen_forward_t *self, const hystgen_start_t *start,
                                  const hystgen_drive_t *first) {
    hystgen_start(&hystgen_forward_curve, &self->plays, self->corner, start);
    self->drive = first->drive;
    self->ascending = first->ascending;
    self->status = 0;
}

void hystgen_forward_init(hystgen_forward_t *self) {
    hystgen_forward_begin(self, &hystgen_forward_start[0], &hystgen_forward_drive[0]);
}

void hystgen_forward_reset(hystgen_forward_t *self, hystgen_real_t v) {
    hystgen_forward_begin(self, &hystgen_forward_start[1], &hystgen_forward_drive[1]);
    (void)hystgen_forward_step(self, v);
}
