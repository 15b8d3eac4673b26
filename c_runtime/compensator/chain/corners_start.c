/* Operators of a model with effects: start memory of engine corners. Called by users. */
#ifndef HYSTGEN_CONFIGURED
#define HYSTGEN_HAS_CORNERS
#endif
#include "compensator/chain/model.h"
#include "compensator/chain/chain.c"

void hystgen_forward_init(hystgen_forward_t *self) {
    hystgen_forward_settings_init(self);
    hystgen_forward_plays_init(self);
    hystgen_forward_begin(self, HYSTGEN_FORWARD_INIT_DRIVE, HYSTGEN_FORWARD_INIT_ASCENDING);
}

void hystgen_forward_reset(hystgen_forward_t *self, hystgen_real_t v) {
    hystgen_forward_plays_reset(self);
    hystgen_forward_begin(self, HYSTGEN_FORWARD_RESET_DRIVE, HYSTGEN_FORWARD_RESET_ASCENDING);
    (void)hystgen_forward_step(self, v);
}

void hystgen_inverse_init(hystgen_inverse_t *self) {
    hystgen_inverse_settings_init(self);
    hystgen_inverse_plays_init(self);
    hystgen_inverse_begin(self, HYSTGEN_INVERSE_INIT_DRIVE, HYSTGEN_INVERSE_INIT_ASCENDING);
}

void hystgen_inverse_reset(hystgen_inverse_t *self, hystgen_real_t u) {
    hystgen_inverse_plays_reset(self);
    hystgen_inverse_begin(self, HYSTGEN_INVERSE_RESET_DRIVE, HYSTGEN_INVERSE_RESET_ASCENDING);
    (void)hystgen_inverse_step(self, u);
}
