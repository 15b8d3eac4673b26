/* Start memory of the corner engine's operators. Called by users. */
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

void hystgen_operator_init(hystgen_operator_t *self) {
    hystgen_operator_begin(self, false);
}

void hystgen_operator_reset(hystgen_operator_t *self, hystgen_real_t operator_x) {
    hystgen_operator_begin(self, true);
    (void)hystgen_operator_step(self, operator_x);
}
