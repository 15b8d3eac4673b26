/* Operators of engine corners: start memory. Called by users. */
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#endif
#include "compensator/model.h"
#ifndef HYSTGEN_CONFIGURED
#ifdef HYSTGEN_FORWARD
#include "compensator/corners/forward.c"
#elif defined(HYSTGEN_FIXED)
#include "compensator/corners/inverse_fixed.c"
#else
#include "compensator/corners/inverse.c"
#endif
#endif

/* The start memory of the parameter file (`which` 0) or all plays at 0 (1). */
HYSTGEN_APART_IN_FLOAT void hystgen_operator_begin(hystgen_operator_t *self, unsigned int which) {
#ifdef HYSTGEN_FIXED
    hystgen_start(&hystgen_model_curve, &self->here, self->corner,
                  which > 0u ? hystgen_model_zero : hystgen_model_start,
                  which > 0u ? 0u : HYSTGEN_START_STEP);
#else
    hystgen_start(&hystgen_operator_curve, &self->plays, self->corner,
                  &hystgen_operator_start[which]);
#endif
#ifdef HYSTGEN_HAS_FRONT
    const hystgen_drive_t *first = &hystgen_operator_first_drive[which];
    self->drive = (hystgen_real_t)first->drive;
    self->ascending = first->ascending;
#endif
    self->status = 0;
    hystgen_operator_rest(self, which);
}

void hystgen_operator_init(hystgen_operator_t *self) {
    hystgen_operator_begin(self, 0);
}

void hystgen_operator_reset(hystgen_operator_t *self, hystgen_real_t x) {
    hystgen_operator_begin(self, 1);
    (void)hystgen_operator_step(self, x);
}
