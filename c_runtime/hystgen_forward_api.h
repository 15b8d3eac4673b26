#ifndef HYSTGEN_FORWARD_API_H
#define HYSTGEN_FORWARD_API_H

/* Start memory of the parameter file. */
void hystgen_forward_init(hystgen_forward_t *self);
/* All plays 0, status cleared, then one ordinary step to drive v. */
void hystgen_forward_reset(hystgen_forward_t *self, hystgen_real_t v);
/* One sample: drive v in, output out. Cannot fail. */
hystgen_real_t hystgen_forward_step(hystgen_forward_t *self, hystgen_real_t v);
/* HYSTGEN_STATUS_* bits since the last call; reading clears them. */
unsigned int hystgen_forward_status(hystgen_forward_t *self);

#endif
