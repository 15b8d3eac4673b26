#include "hystgen_runtime.h"

/* Operators of a model with effects: plays that move as in any other model. */

/* The plays follow their input w. Returns their sum. */
static hystgen_real_t hystgen_forward_follow(hystgen_forward_t *self, hystgen_real_t w) {
    hystgen_loop_absorb(&hystgen_model_tables, self->play, w);
    return hystgen_loop_output(&hystgen_model_tables, self->play);
}

/* The plays follow their input w. Returns their sum. */
static hystgen_real_t hystgen_inverse_follow(hystgen_inverse_t *self, hystgen_real_t w) {
    hystgen_loop_absorb(&hystgen_model_tables, self->play, w);
    return hystgen_loop_output(&hystgen_model_tables, self->play);
}

/* Input of the plays at which their sum is h. */
static hystgen_real_t hystgen_inverse_input(const hystgen_inverse_t *self, hystgen_real_t h) {
    return hystgen_loop_solve(&hystgen_model_tables, self->play, h);
}

/* Sum of the plays as they are set. */
static hystgen_real_t hystgen_forward_started(const hystgen_forward_t *self) {
    return hystgen_loop_output(&hystgen_model_tables, self->play);
}

/* Sum of the plays as they are set. */
static hystgen_real_t hystgen_inverse_started(const hystgen_inverse_t *self) {
    return hystgen_loop_output(&hystgen_model_tables, self->play);
}
