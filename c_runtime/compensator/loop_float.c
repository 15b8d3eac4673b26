/* Operators of engine loop: samples in floating point, which may be NaN or infinite. Called by
   users. */
#include "compensator/model.h"
#include "compensator/loop.c"

static bool hystgen_finite(hystgen_real_t x) {
    return x >= -HYSTGEN_REAL_MAX && x <= HYSTGEN_REAL_MAX; /* false for NaN */
}

/* One sample. */
hystgen_real_t hystgen_forward_step(hystgen_forward_t *self, hystgen_real_t v) {
    if (!(v >= HYSTGEN_DRIVE_MIN && v <= HYSTGEN_DRIVE_MAX)) {
        if (!hystgen_finite(v)) {
            self->status |= HYSTGEN_STATUS_HELD;
            return self->answer;
        }
        v = hystgen_clamp_drive(v);
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    hystgen_forward_absorb(self, v);
    self->answer = hystgen_forward_output(self);
    return self->answer;
}

/* One sample. */
hystgen_real_t hystgen_inverse_step(hystgen_inverse_t *self, hystgen_real_t u) {
    hystgen_real_t level = u;
    unsigned int bits = 0;
    hystgen_inverse_take(self);
    if (!(u >= HYSTGEN_OUTPUT_MIN && u <= HYSTGEN_OUTPUT_MAX)) {
        if (!hystgen_finite(u)) {
            self->status |= HYSTGEN_STATUS_HELD;
            return hystgen_inverse_answer(self, self->stepped ? self->answer : self->drive);
        }
        level = hystgen_inverse_clamp(u);
        bits = HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    return hystgen_inverse_search(self, u, level, bits);
}

void hystgen_inverse_commit(hystgen_inverse_t *self, hystgen_real_t applied) {
    if (!hystgen_finite(applied)) {
        self->status |= HYSTGEN_STATUS_HELD;
        return;
    }
    hystgen_inverse_replace(self, applied, hystgen_clamp_drive(applied) + 0); /* no drive is -0 */
}
