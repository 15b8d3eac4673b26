/* Operators of engine loop: start memory and branch. Called by users. */
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_FRONT
#define HYSTGEN_HAS_TWO_BRANCHES
#endif
#include "compensator/model.h"
#include "compensator/loop.c"
#ifndef HYSTGEN_CONFIGURED
#include "compensator/loop_start.c"
#endif

void hystgen_forward_init(hystgen_forward_t *self) {
    hystgen_loop_init(self->play);
    self->drive = HYSTGEN_FORWARD_INIT_DRIVE;
    self->ascending = HYSTGEN_FORWARD_INIT_ASCENDING;
    hystgen_forward_begin(self);
}

void hystgen_forward_reset(hystgen_forward_t *self, hystgen_real_t v) {
    hystgen_loop_rest(&hystgen_model_tables, self->play, 0);
    self->drive = HYSTGEN_FORWARD_RESET_DRIVE;
    self->ascending = HYSTGEN_FORWARD_RESET_ASCENDING;
    hystgen_forward_begin(self);
    (void)hystgen_forward_step(self, v);
}

void hystgen_inverse_init(hystgen_inverse_t *self) {
    hystgen_loop_init(self->play);
    self->level = hystgen_inverse_output(self);
    self->ascending = HYSTGEN_INVERSE_INIT_ASCENDING;
    hystgen_inverse_begin(self, HYSTGEN_INVERSE_INIT_DRIVE);
}

void hystgen_inverse_reset(hystgen_inverse_t *self, hystgen_real_t u) {
    hystgen_loop_rest(&hystgen_model_tables, self->play, 0);
    self->level = hystgen_inverse_output(self);
    self->ascending = HYSTGEN_INVERSE_RESET_ASCENDING;
    hystgen_inverse_begin(self, HYSTGEN_INVERSE_RESET_DRIVE);
    (void)hystgen_inverse_step(self, u);
}
