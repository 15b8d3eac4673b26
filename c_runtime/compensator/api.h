/* What users call of every model. */
#include "compensator/model.h"
#ifndef HYSTGEN_API_H
#define HYSTGEN_API_H

/* Start memory of the parameter file. */
void hystgen_forward_init(hystgen_forward_t *self);
/* All plays 0, status cleared, then one ordinary step to drive v. */
void hystgen_forward_reset(hystgen_forward_t *self, hystgen_real_t v);
/* One sample: drive v in, output out. Cannot fail. */
hystgen_real_t hystgen_forward_step(hystgen_forward_t *self, hystgen_real_t v);
/* HYSTGEN_STATUS_* bits since the last call; reading clears them. */
unsigned int hystgen_forward_status(hystgen_forward_t *self);

/* Start memory of the parameter file. */
void hystgen_inverse_init(hystgen_inverse_t *self);
/* All plays 0, status cleared, then one ordinary step to reference u. */
void hystgen_inverse_reset(hystgen_inverse_t *self, hystgen_real_t u);
/* One sample: reference u in, drive out, inside HYSTGEN_DRIVE_MIN .. MAX. Cannot fail. */
hystgen_real_t hystgen_inverse_step(hystgen_inverse_t *self, hystgen_real_t u);
/* After a step: the drive that was really applied in place of the one returned. */
void hystgen_inverse_commit(hystgen_inverse_t *self, hystgen_real_t applied);
/* HYSTGEN_STATUS_* bits since the last call; reading clears them. */
unsigned int hystgen_inverse_status(hystgen_inverse_t *self);

#endif
