/* Operators of engine loop: samples in fixed point, where every code is finite. Called by users. */
#include "arithmetic/fixed.h"
#include "compensator/model.h"
#include "compensator/loop.c"

/* One sample. */
hystgen_real_t hystgen_forward_step(hystgen_forward_t *self, hystgen_real_t v) {
    const hystgen_real_t inside = hystgen_clamp_drive(v);
    if (inside != v) {
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    hystgen_forward_absorb(self, inside);
    self->answer = hystgen_forward_output(self);
    return self->answer;
}

/* One sample. */
hystgen_real_t hystgen_inverse_step(hystgen_inverse_t *self, hystgen_real_t u) {
    const hystgen_real_t level = hystgen_inverse_clamp(u);
    hystgen_inverse_take(self);
    return hystgen_inverse_search(self, u, level, level != u ? HYSTGEN_STATUS_INPUT_CLAMPED : 0u);
}

void hystgen_inverse_commit(hystgen_inverse_t *self, hystgen_real_t applied) {
    hystgen_inverse_replace(self, applied, hystgen_clamp_drive(applied));
}
