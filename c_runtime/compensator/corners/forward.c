/* The corner engine's forward operator, with or without a memoryless part. Called by users. */
#if !defined(HYSTGEN_CONFIGURED) && !defined(HYSTGEN_FORWARD)
#define HYSTGEN_FORWARD
#endif
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#endif
#include "compensator/model.h"
#include "compensator/drive.c"
#ifdef HYSTGEN_FIXED
#include "compensator/code.c"
#endif

#ifdef HYSTGEN_FORWARD
/* One sample. */
hystgen_real_t hystgen_operator_step(hystgen_operator_t *self, hystgen_real_t v) {
#ifdef HYSTGEN_FIXED
    const hystgen_real_t inside = hystgen_clamp_drive(v);
    if (inside != v) {
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    const int64_t sum =
        hystgen_plays_step(&hystgen_model_curve, &self->here, self->corner, &self->kink,
                           &self->next, hystgen_operator_arrive(self, inside));
    return hystgen_code(sum, &self->status);
#else
    if (!(v >= HYSTGEN_DRIVE_MIN && v <= HYSTGEN_DRIVE_MAX)) {
        if (!(v >= -HYSTGEN_REAL_MAX && v <= HYSTGEN_REAL_MAX)) {
            self->status |= HYSTGEN_STATUS_HELD;
            return self->plays.here.output + HYSTGEN_OFFSET;
        }
        v = v < HYSTGEN_DRIVE_MIN ? HYSTGEN_DRIVE_MIN : HYSTGEN_DRIVE_MAX;
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    return hystgen_plays_step(&hystgen_operator_curve, &self->plays, self->corner,
                              hystgen_operator_arrive(self, v)) +
           HYSTGEN_OFFSET;
#endif
}

/* Code shared by init and reset. */
static void hystgen_operator_begin(hystgen_operator_t *self, bool reset) {
#ifdef HYSTGEN_FIXED
    hystgen_start(&hystgen_model_curve, &self->here, self->corner,
                  reset ? hystgen_model_zero : hystgen_model_start,
                  reset ? 0u : HYSTGEN_START_STEP);
    self->next = self->here.input;
#else
    hystgen_start(&hystgen_operator_curve, &self->plays, self->corner,
                  &hystgen_operator_start[reset ? 1 : 0]);
#endif
#ifdef HYSTGEN_HAS_FRONT
    const hystgen_drive_t *first = &hystgen_operator_first_drive[reset ? 1 : 0];
    self->drive = (hystgen_real_t)first->drive;
    self->ascending = first->ascending;
#endif
    self->status = 0;
}
#endif
