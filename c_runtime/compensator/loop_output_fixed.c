/* Operators of engine loop: outputs of the plays in fixed point, whose sums are finer than codes.
   Called by loop.c and loop_fixed.c. */
#ifndef HYSTGEN_LOOP_OUTPUT_FIXED_C
#define HYSTGEN_LOOP_OUTPUT_FIXED_C
#include "arithmetic/fixed.h"
#include "compensator/model.h"
#include "compensator/code.c"

static hystgen_real_t hystgen_forward_output(hystgen_forward_t *self) {
    return hystgen_code(hystgen_loop_output(&hystgen_model_tables, self->play) + HYSTGEN_OFFSET,
                        &self->status);
}

/* The part common to init and reset, once the plays are set. */
static void hystgen_forward_begin(hystgen_forward_t *self) {
    self->answer = 0; /* no step has answered yet */
    self->status = 0;
}

static hystgen_real_t hystgen_inverse_output(const hystgen_inverse_t *self) {
    unsigned int status = 0; /* not reported: this is no step */
    return hystgen_code(hystgen_loop_output(&hystgen_model_tables, self->play) + HYSTGEN_OFFSET,
                        &status);
}

/* Input of the plays that gives output code `level`. */
static hystgen_reach_t hystgen_inverse_solve(const hystgen_inverse_t *self, hystgen_real_t level) {
    const hystgen_sum_t output =
        (hystgen_sum_t)level * ((hystgen_sum_t)1 << HYSTGEN_FRACTION) - HYSTGEN_OFFSET;
    return hystgen_loop_solve(&hystgen_model_tables, self->play, output);
}

#endif
