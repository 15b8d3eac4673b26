/* Operators of engine loop: outputs of the plays in floating point. Called by loop.c and
   loop_float.c. */
#ifndef HYSTGEN_LOOP_OUTPUT_FLOAT_C
#define HYSTGEN_LOOP_OUTPUT_FLOAT_C
#include "compensator/model.h"

static hystgen_real_t hystgen_forward_output(const hystgen_forward_t *self) {
    return hystgen_loop_output(&hystgen_model_tables, self->play) + HYSTGEN_OFFSET;
}

/* The part common to init and reset, once the plays are set. */
static void hystgen_forward_begin(hystgen_forward_t *self) {
    self->answer = hystgen_forward_output(self);
    self->status = 0;
}

static hystgen_real_t hystgen_inverse_output(const hystgen_inverse_t *self) {
    return hystgen_loop_output(&hystgen_model_tables, self->play) + HYSTGEN_OFFSET;
}

/* Input of the plays that gives output `level`. */
static hystgen_real_t hystgen_inverse_solve(const hystgen_inverse_t *self, hystgen_real_t level) {
    return hystgen_loop_solve(&hystgen_model_tables, self->play, level - HYSTGEN_OFFSET);
}

#endif
