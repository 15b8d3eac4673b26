/* Operators of the loop engine and of every model with effects: start memory. Called by users. */
#include "compensator/chain/model.h"
#include "compensator/chain/chain.c"
#ifndef HYSTGEN_CONFIGURED
#include "compensator/loop_start.c"
#endif

void hystgen_operator_init(hystgen_operator_t *self) {
    hystgen_operator_settings_init(self);
#ifdef HYSTGEN_HAS_CORNERS
    hystgen_operator_plays_start(self, false);
#else
    hystgen_loop_init(self->play);
#endif
    hystgen_operator_begin(self, HYSTGEN_OPERATOR_INIT_DRIVE, HYSTGEN_OPERATOR_INIT_ASCENDING);
}

void hystgen_operator_reset(hystgen_operator_t *self, hystgen_real_t operator_x) {
#ifdef HYSTGEN_HAS_CORNERS
    hystgen_operator_plays_start(self, true);
#else
    hystgen_loop_rest(&hystgen_model_tables, self->play, 0);
#endif
    hystgen_operator_begin(self, HYSTGEN_OPERATOR_RESET_DRIVE, HYSTGEN_OPERATOR_RESET_ASCENDING);
    (void)hystgen_operator_step(self, operator_x);
}
