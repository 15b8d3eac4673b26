/* Calls for users of every model. */
#include "compensator/model.h"
#ifndef HYSTGEN_API_H
#define HYSTGEN_API_H

/* Sets the start memory of the parameter file. */
void hystgen_operator_init(hystgen_operator_t *self);
/* Sets all plays to 0, clears the status, and makes one ordinary step with operator_x. */
void hystgen_operator_reset(hystgen_operator_t *self, hystgen_real_t operator_x);
#ifdef HYSTGEN_FORWARD
/* One sample: drive v in, output out. Cannot fail. */
hystgen_real_t hystgen_operator_step(hystgen_operator_t *self, hystgen_real_t v);
#else
/* One sample: reference u in, drive out, inside HYSTGEN_DRIVE_MIN .. MAX. Cannot fail. */
hystgen_real_t hystgen_operator_step(hystgen_operator_t *self, hystgen_real_t u);
/* Reports, after a step, the drive actually applied in place of the one returned. */
void hystgen_inverse_commit(hystgen_inverse_t *self, hystgen_real_t applied);
#endif
/* HYSTGEN_STATUS_* bits since the last call; reading clears them. */
unsigned int hystgen_operator_status(hystgen_operator_t *self);

#endif
