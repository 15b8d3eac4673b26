#include "hystgen_runtime.h"

/* Operators of engine loop: plays solved for their input by the kernel, which sums them up again: a
   model without effects does not keep the sum, and in fixed point it lacks bits. */

/* Input of the plays at which their sum is h. */
static inline hystgen_reach_t hystgen_input_of(const hystgen_play_t *play, hystgen_signal_t level,
                                               hystgen_signal_t h) {
    (void)level;
    return hystgen_loop_solve(&hystgen_model_tables, play, hystgen_asked(h));
}
