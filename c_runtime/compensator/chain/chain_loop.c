/* Operators of engine loop, with effects or without: start memory. Called by users. */
#include "compensator/chain/model.h"
#include "compensator/chain/chain.c"
#ifndef HYSTGEN_CONFIGURED
#include "compensator/loop_start.c"
#endif

void hystgen_forward_init(hystgen_forward_t *self) {
    hystgen_forward_settings_init(self);
    hystgen_loop_init(self->play);
    hystgen_forward_begin(self, HYSTGEN_FORWARD_INIT_DRIVE, HYSTGEN_FORWARD_INIT_ASCENDING);
}

void hystgen_forward_reset(hystgen_forward_t *self, hystgen_real_t v) {
    hystgen_loop_rest(&hystgen_model_tables, self->play, 0);
    hystgen_forward_begin(self, HYSTGEN_FORWARD_RESET_DRIVE, HYSTGEN_FORWARD_RESET_ASCENDING);
    (void)hystgen_forward_step(self, v);
}

void hystgen_inverse_init(hystgen_inverse_t *self) {
    hystgen_inverse_settings_init(self);
    hystgen_loop_init(self->play);
    hystgen_inverse_begin(self, HYSTGEN_INVERSE_INIT_DRIVE, HYSTGEN_INVERSE_INIT_ASCENDING);
}

void hystgen_inverse_reset(hystgen_inverse_t *self, hystgen_real_t u) {
    hystgen_loop_rest(&hystgen_model_tables, self->play, 0);
    hystgen_inverse_begin(self, HYSTGEN_INVERSE_RESET_DRIVE, HYSTGEN_INVERSE_RESET_ASCENDING);
    (void)hystgen_inverse_step(self, u);
}
