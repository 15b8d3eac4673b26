/* Calls for users of every model. */
#include "compensator/model.h"
#include "compensator/health.h"
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
/* One sample from code to code. Commits the drive that the returned code makes. Cannot fail. */
int32_t hystgen_inverse_step_code(hystgen_inverse_t *self, int32_t code);
#endif
/* Change of the drive that other parameters make for the displacement expected now. With `take`
   they replace those of the instance, and the memory is carried over: each play stays as near to
   where it is as the one before it allows, and states of effects go on. */
hystgen_real_t hystgen_inverse_exchange(hystgen_inverse_t *self, const hystgen_parameters_t *next,
                                        bool take);
/* The reference that a code of the reference's converter stands for. */
hystgen_real_t hystgen_reference_from_code(int32_t code);
/* The drive that a code of the drive's converter makes. */
hystgen_real_t hystgen_drive_from_code(int32_t code);
/* The code whose drive is nearest to this one, among those of the drive's converter. */
int32_t hystgen_code_from_drive(hystgen_real_t drive);
/* Begins a sequence of drives that erases the memory, at the present drive. */
void hystgen_degauss_init(hystgen_degauss_t *self, hystgen_real_t start);
/* The next drive of the sequence, at its end the last one again. Apply it, and report it to the
   instances with a step of the forward operator, or a step and a commit of the inverse. */
hystgen_real_t hystgen_degauss_step(hystgen_degauss_t *self);
/* Whether the sequence has ended. */
bool hystgen_degauss_done(const hystgen_degauss_t *self);
/* HYSTGEN_STATUS_* bits since the last call; reading clears them. */
unsigned int hystgen_operator_status(hystgen_operator_t *self);
/* Begins to watch the error of the model. */
void hystgen_health_init(hystgen_health_t *self);
/* One sample: the displacement that the model expects and the one measured. At the end of each
   window of HYSTGEN_HEALTH_WINDOW samples the mean and the mean square of the error are stored and
   judged. Cannot fail. */
unsigned int hystgen_health_update(hystgen_health_t *self, hystgen_real_t expected,
                                   hystgen_real_t measured);

#endif
