#include "hystgen_runtime.h"

/* Operators of engine loop: what is a sample in fixed point, where every code is a number. */

/* One sample. */
hystgen_real_t hystgen_forward_step(hystgen_forward_t *self, hystgen_real_t v)
{
    const hystgen_reach_t asked = v;
    if (asked < HYSTGEN_DRIVE_MIN || asked > HYSTGEN_DRIVE_MAX) {
        v = hystgen_clamp_drive(v);
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    hystgen_forward_absorb(self, v);
    self->answer = hystgen_forward_output(self);
    return self->answer;
}

/* One sample. */
hystgen_real_t hystgen_inverse_step(hystgen_inverse_t *self, hystgen_real_t u)
{
    const hystgen_reach_t asked = u;
    hystgen_real_t level = u;
    unsigned int bits = 0;
    hystgen_inverse_take(self);
    if (asked < HYSTGEN_OUTPUT_MIN || asked > HYSTGEN_OUTPUT_MAX) {
        level = hystgen_inverse_clamp(u);
        bits = HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    return hystgen_inverse_search(self, u, level, bits);
}

void hystgen_inverse_commit(hystgen_inverse_t *self, hystgen_real_t applied)
{
    hystgen_inverse_replace(self, applied, hystgen_clamp_drive(applied));
}
