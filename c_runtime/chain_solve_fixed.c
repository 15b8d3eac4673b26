#include "hystgen_runtime.h"

/* Operators of a model with effects: plays solved for their input, in fixed point. */

/* Input of the plays at which their sum is h; `level`, what it is now, lacks the bits below it. */
static inline hystgen_reach_t hystgen_input_of(const hystgen_play_t *play, hystgen_signal_t level,
                                               hystgen_signal_t h) {
    (void)level;
    return hystgen_loop_solve(&hystgen_model_tables, play, hystgen_asked(h));
}
