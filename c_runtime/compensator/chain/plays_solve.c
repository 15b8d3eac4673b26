/* Operators of the loop engine: solves plays for their input. Called by plays.c and relaxing.c. */
#ifndef HYSTGEN_CHAIN_PLAYS_SOLVE_C
#define HYSTGEN_CHAIN_PLAYS_SOLVE_C
#include "compensator/chain/model.h"
#include "compensator/chain/signals.c"

/* Input of the plays at which their sum is h. The plays are summed again if their present sum is
   not stored (without effects) or lacks bits (in fixed point, where the kernel sums them). */
static inline hystgen_reach_t hystgen_input_of(const hystgen_play_t *play, hystgen_signal_t level,
                                               hystgen_signal_t h) {
#if defined(HYSTGEN_CHAIN) && !defined(HYSTGEN_FIXED)
    return hystgen_loop_solve(&hystgen_model_tables, play, level, h);
#elif defined(HYSTGEN_FIXED)
    (void)level;
    return hystgen_loop_solve(&hystgen_model_tables, play, hystgen_asked(h));
#else
    (void)level;
    return hystgen_loop_solve(&hystgen_model_tables, play,
                              hystgen_loop_output(&hystgen_model_tables, play), hystgen_asked(h));
#endif
}

#endif
