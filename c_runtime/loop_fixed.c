#include "hystgen_runtime.h"

/* Operators of engine loop: what fixed point does, whose sums are finer than codes. */

static hystgen_real_t hystgen_forward_output(hystgen_forward_t *self)
{
    return hystgen_code(hystgen_loop_output(&hystgen_model_tables, self->play) + HYSTGEN_OFFSET,
                        &self->status);
}

/* One sample. */
hystgen_real_t hystgen_forward_step(hystgen_forward_t *self, hystgen_real_t v)
{
    const hystgen_real_t inside = hystgen_clamp_drive(v);
    if (inside != v) {
        self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;
    }
    hystgen_forward_absorb(self, inside);
    self->answer = hystgen_forward_output(self);
    return self->answer;
}

static hystgen_real_t hystgen_inverse_output(const hystgen_inverse_t *self)
{
    unsigned int status = 0; /* of what no step has answered */
    return hystgen_code(hystgen_loop_output(&hystgen_model_tables, self->play) + HYSTGEN_OFFSET,
                        &status);
}

/* Input of the plays that gives output code `level`. */
HYSTGEN_APART hystgen_reach_t hystgen_inverse_solve(const hystgen_inverse_t *self,
                                                    hystgen_real_t level)
{
    const hystgen_sum_t output =
        (hystgen_sum_t)level * ((hystgen_sum_t)1 << HYSTGEN_FRACTION) - HYSTGEN_OFFSET;
    return hystgen_loop_solve(&hystgen_model_tables, self->play, output);
}

/* One sample. */
hystgen_real_t hystgen_inverse_step(hystgen_inverse_t *self, hystgen_real_t u)
{
    const hystgen_real_t level = hystgen_inverse_clamp(u);
    hystgen_inverse_take(self);
    return hystgen_inverse_search(self, u, level, level != u ? HYSTGEN_STATUS_INPUT_CLAMPED : 0u);
}

void hystgen_inverse_commit(hystgen_inverse_t *self, hystgen_real_t applied)
{
    hystgen_inverse_replace(self, applied, hystgen_clamp_drive(applied));
}
