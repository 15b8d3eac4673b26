/* Operators of the loop engine: plays unchanged by effects. Called by chain.c and chain_calls.c. */
#ifndef HYSTGEN_CHAIN_PLAYS_C
#define HYSTGEN_CHAIN_PLAYS_C
#include "compensator/chain/model.h"
#include "compensator/chain/plays_solve.c"
#include "compensator/chain/signals.c"

/* Sum of the plays. */
static hystgen_signal_t hystgen_operator_started(const hystgen_operator_t *self) {
    return hystgen_level(hystgen_loop_output(&hystgen_model_tables, self->play));
}

/* The plays follow their input w. Updates their sum. */
HYSTGEN_APART_IN_FIXED_CHAIN void hystgen_operator_follow(hystgen_operator_t *self,
                                                          hystgen_play_t w) {
    hystgen_loop_absorb(&hystgen_model_tables, self->play, w);
    self->level = hystgen_operator_started(self);
}

#ifdef HYSTGEN_INVERSE
/* Input of the plays at which their sum is h. */
HYSTGEN_APART_IN_FIXED_CHAIN hystgen_reach_t hystgen_inverse_input(const hystgen_inverse_t *self,
                                                                   hystgen_signal_t h) {
    return hystgen_input_of(self->play, self->level, h);
}
#endif

#endif
